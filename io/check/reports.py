"""Reports of a check: an HTML page, a summary in Markdown, and records for JSON."""

from __future__ import annotations

import shlex
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .. import formats
from ..page import Cell, Row, address, page
from .compare import Verdict
from .regression import as_picture

LISTED_FILES = 50  # files in a summary at most
RAMP = np.array(
    [[0, 0, 0], [170, 0, 0], [255, 136, 0], [255, 255, 0], [255, 255, 255]]
)  # of `page.html`'s scale


def record(verdict: Verdict) -> dict[str, Any]:
    """Return a verdict as a JSON object."""
    fields = asdict(verdict)
    fields["moved"] = [difference._asdict() for difference in verdict.moved]
    return {"schema": "iccm.check/1", **fields}


def summary(verdicts: list[Verdict]) -> str:
    """Return a summary: how many files match their baselines, are different, new, or missing."""
    counts = Counter("different" if verdict.state == "differs" else verdict.state for verdict in verdicts)
    ways = [f"{counts[state]} {state}" for state in ("different", "new", "missing") if counts[state]]
    matching = sum(verdict.ok for verdict in verdicts)
    return ", ".join([f"{matching} of {len(verdicts)} files match their baselines", *ways])


def html(verdicts: list[Verdict], run: Path, baselines: Path) -> bytes:
    """Return a page with the differences: pictures before and after, figures with limits, and how to accept them."""
    rows = []
    for verdict in verdicts:
        state = Cell(verdict.state, state="good" if verdict.ok else "bad")
        gap = verdict.figures.get("max")
        cells = [Cell(verdict.name), state, Cell("" if gap is None else f"{gap:.4g}", sort=gap or 0.0)]
        first = verdict.problems[0] if verdict.problems else ""
        detail = None if verdict.ok else _detail(verdict, run, baselines)
        rows.append(Row(verdict.ok, [*cells, Cell(first)], detail))
    title = f"iccm check {run} {baselines}"
    return page(title, summary(verdicts), ["file", "state", "largest difference", "problem"], rows)


def update_line(verdict: Verdict, run: Path, baselines: Path) -> str:
    """Return the command that makes a result the baseline."""
    words = ["iccm", "check", str(run), str(baselines), "--update", "--only", verdict.name]
    return " ".join(map(shlex.quote, words))


def _detail(verdict: Verdict, run: Path, baselines: Path) -> dict[str, Any]:
    return {
        "title": verdict.name,
        "problems": verdict.problems,
        "figures": verdict.moved,
        "update": update_line(verdict, run, baselines),
        "pair": _pair(verdict, run, baselines),
    }


def _pair(verdict: Verdict, run: Path, baselines: Path) -> dict[str, Any] | None:
    """Return the two pictures for `page.html`, and their difference if they have the same size."""
    baseline, new = (_pixels(folder / verdict.name) for folder in (baselines, run))
    sample = new if new is not None else baseline
    if sample is None:
        return None
    height, width = sample.shape[:2]
    column, row = verdict.worst or (width / 2, height / 2)
    pair: dict[str, Any] = {"width": width, "height": height, "x": column / width, "y": row / height}
    for name, pixels in (("before", baseline), ("after", new)):
        if pixels is not None:
            pair[name] = address(np.round(255 * pixels).astype(np.uint8))
    if baseline is not None and new is not None and baseline.shape == new.shape:
        gap = np.abs(baseline - new).max(axis=2)
        largest = float(gap.max())
        pair |= {"heat": address(heat(gap / max(largest, 1e-9))), "largest": f"{largest:.3g}"}
    return pair


def heat(share: NDArray) -> NDArray[np.uint8]:
    """Return (h, w, 3) colours for (h, w) numbers from 0 to 1: from black through red and yellow to white."""
    positions = np.linspace(0, 1, len(RAMP))
    return np.stack([np.interp(share, positions, channel) for channel in RAMP.T], axis=-1).astype(np.uint8)


def _pixels(path: Path) -> NDArray | None:
    from ..pictures import image_files

    if not formats.of(path.name).picture or not path.is_file():
        return None
    try:
        return as_picture(image_files.read(path).pixels)
    except InputError:
        return None


def markdown(verdicts: list[Verdict]) -> str:
    """Return a summary in Markdown for the page of a CI job."""
    bad = [verdict for verdict in verdicts if not verdict.ok]
    lines = [f"### iccm check: {'no regression' if not bad else 'regression'}", "", summary(verdicts), ""]
    if bad:
        lines += ["| file | state | problem |", "|---|---|---|"]
        lines += [f"| {_text(v.name)} | {v.state} | {_text(v.problems[0])} |" for v in bad[:LISTED_FILES]]
    if len(bad) > LISTED_FILES:
        lines += ["", f"and {len(bad) - LISTED_FILES} more"]
    return "\n".join(lines).rstrip() + "\n"


def _text(words: str) -> str:
    """Escape text for Markdown and HTML."""
    printable = "".join(c if c.isprintable() else "?" for c in words)
    return "".join(f"&#{ord(c)};" if c in "|<>&[]`*_\\!#~@$:" else c for c in printable)
