"""Text summaries of a report."""

from typing import Any

SEEN_FOLDS_SHARE = 2e-3
"""Relative to the source's area: smaller folds are sampling noise."""
WELL_SEEN_SHARE = 0.8
"""Relative to a drawing's painted area: the summary mentions if less is shown or covered."""
SEEN_CRACKS_SHARE = 5e-3
"""Relative to the target drawing's painted area: a note reports larger cracks."""
CERTAIN_SHARE = 0.99
"""Relative to the source's area: the summary mentions if the map is certified on less."""


def summary(report: dict[str, Any]) -> list[str]:
    """Return the most important figures, one line each."""
    lines = []
    boundary, dilatation = report.get("boundary", {}), report.get("dilatation", {})
    area, injective = report.get("log10_area", {}), report.get("injective", {})
    if boundary:
        rms, gap = _figure(boundary.get("rms")), _figure(boundary.get("hausdorff"))
        source_gap = (
            f", of the source {_figure(boundary['source'])} of its diagonal" if "source" in boundary else ""
        )
        lines.append(
            f"boundary    root mean square {rms}, Hausdorff distance {gap} of the diagonal{source_gap}"
        )
    if dilatation:
        lines.append(
            "dilatation  " + ", ".join(f"{name} {_figure(value)}" for name, value in dilatation.items())
        )
    if area:
        lines.append("log10 area  " + ", ".join(f"{name} {_figure(value)}" for name, value in area.items()))
    if apart := report.get("apart"):
        distances = ", ".join(f"{name} {_figure(value)}" for name, value in apart.items())
        lines.append(f"apart       {distances} of the diagonal, in space")
    if "shown" in report:
        lines.append(
            f"seen        {_percent(report['shown'])} of the source drawing, "
            f"{_percent(report['covered'])} of the target drawing covered, {_percent(report['cracks'])} "
            "of it lost to cracks"
        )
    if injective:
        lines.append(f"injective   {_certificate(injective)}")
    if parts := report.get("parts"):
        worst = max(parts, key=lambda part: part["boundary"]["hausdorff"])
        gap = _figure(worst["boundary"]["hausdorff"])
        worst_of = f"the worst Hausdorff is {gap}, of #{worst['source'] or worst['target']}"
        lines.append(f"parts       {len(parts)}, the largest above; {worst_of}")
    if report.get("pins"):
        lines.append(f"pins        largest error {_figure(max(pin['error'] for pin in report['pins']))}")
    if regions := report.get("regions"):
        worst = max(region["dilatation"] for region in regions)
        sizes = [region["scale"] for region in regions]
        size_range = _figure(min(sizes)) + (f" to {_figure(max(sizes))}" if len(sizes) > 1 else "")
        lines.append(
            f"regions     {len(regions)} rigid, dilatation up to {worst:.4g}, size {size_range} times the mean scale"
        )
    if "seconds" in report:
        phases = {name: value for name, value in report["seconds"].items() if value >= 0.005}
        lines.append("seconds     " + ", ".join(f"{name} {value:.2f}" for name, value in phases.items()))
    return lines


def in_words(report: dict[str, Any]) -> list[str]:
    """Return the report's message, figures and notes, one line each."""
    return [report["message"], "", *summary(report), "", *(f"note: {note}" for note in report["notes"])]


def in_short(report: dict[str, Any]) -> str:
    """Return the most important figures in one line.

    They are the picture's size, a missed outline, visible and covered shares, uniformity of scale, folds, and
    seconds, and whether the picture is the numbered checkerboard, or on paper.
    """
    pixels, seconds = report.get("pixels", {}), report.get("seconds")
    parts = [
        _picture_size(pixels),
        _outline_gap(report),
        _shares_seen(report),
        _scale(report.get("scale", {})),
        _folds(report["injective"]),
        f"{seconds['total']:.1f} s" if seconds else "",
        "numbered checkerboard" if pixels.get("checkerboard") else "",
        f"on paper, {pixels['paper']} (without: --background transparent)" if pixels.get("paper") else "",
    ]
    return " · ".join(part for part in parts if part)


def _picture_size(pixels: dict[str, Any]) -> str:
    return f"{pixels['width']}×{pixels['height']}" if "width" in pixels else ""


def _outline_gap(report: dict[str, Any]) -> str:
    """Return the distance of the outline, if the status is that it is missed."""
    gap = (report.get("boundary") or {}).get("hausdorff")
    if gap is None or report["status"] not in ("gap", "source_gap", "crowded"):
        return ""
    return f"OUTLINE OFF by {_percent(gap)} of the diagonal"


def _shares_seen(report: dict[str, Any]) -> str:
    """Return the visible and covered shares of both drawings, if much of either is missing."""
    shown, covered = report.get("shown"), report.get("covered")
    if shown is None or covered is None or min(shown, covered) >= WELL_SEEN_SHARE:
        return ""
    return f"shows {_percent(shown)} of the source, covers {_percent(covered)} of the target"


def _scale(scale: dict[str, Any]) -> str:
    within = scale.get("within2")
    return "" if within is None else f"scale within 2× on {_percent(within)}"


def _folds(injective: dict[str, Any]) -> str:
    """Return whether the map folds, by the share that the inverse does not recover, or else by the certificate."""
    folded, share = injective.get("folded") or 0.0, injective.get("share") or 0.0
    if folded >= SEEN_FOLDS_SHARE:
        return f"FOLDS on {_percent(folded)}"
    if not injective["certified"]:
        return "not certified one-to-one"
    return (
        "no folds" if share >= CERTAIN_SHARE else f"no folds on {_percent(share)}, uncertain at the outline"
    )


def _percent(share: float) -> str:
    """Return a share as a percentage with two significant digits: 64 %, 0.3 %."""
    return f"{100 * share:.0f} %" if share >= 0.0995 or share == 0 else f"{100 * share:.2g} %"


def _certificate(certificate: dict[str, Any]) -> str:
    if certificate.get("certified"):
        depth, share = _figure(certificate.get("depth")), certificate.get("share") or 0.0
        return f"certified on {share:.2%} of the area, beyond a depth of {depth} of the inradius"
    return f"not certified; {certificate.get('obstacle', 'unknown')}"


def _figure(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, int | float) else "unknown"
