"""Balanced maps on random pairs of drawings from seven packages, `conformal` beside them in the same run.

python -m tests.bench.balanced [--pairs 150] [--seed 1] [--tight 40] [--conformal 150] [--sheet FILE.png]
"""

import argparse
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import iccm
from iccm import Curve, InputError
from iccm.io.shapes.shape import Shape

from . import pictures, shapes
from .goals import goal

SHOWN = 30  # pairs of the contact sheet
TIGHT = 1e-4


@dataclass(frozen=True)
class Row:
    """What a method made of a pair; lengths relative to the target's diagonal, figures over the target's area."""

    gap: float
    certified: bool
    within2: float
    within4: float
    p50: float
    p95: float
    K95: float
    turn: float
    seconds: float
    triangles: int
    status: str


def measured(source: Curve, target: Curve, **options) -> tuple[Row, iccm.Fit]:
    """One fit, in CPU-seconds of this process without the report's."""
    start = time.process_time()
    fit = iccm.fit(source, target, **options)
    seconds = time.process_time() - start
    r = fit.report()
    row = Row(
        r["boundary"]["hausdorff"],
        r["injective"]["certified"],
        r["scale"]["within2"],
        r["scale"]["within4"],
        r["stretch"]["p50"],
        r["stretch"]["p95"],
        r["dilatation"]["p95"],
        abs(r["turn"]),
        seconds,
        r["vertices"],
        r["status"],
    )
    return row, fit


def line(row: Row) -> str:
    """The figures of a row in columns."""
    proof = "yes" if row.certified else "NO "
    return (
        f"{row.gap:.1e} {proof} {row.within2:6.3f} {row.within4:6.3f} {row.p50:6.2f} {row.p95:8.2f} {row.K95:6.2f}"
        f" {row.turn:5.0f}° {row.seconds:6.2f}s {row.status}"
    )


def run(
    pairs: list[tuple[Shape, Shape]], method: str, **options
) -> tuple[list[Row | None], list[iccm.Fit | None]]:
    """Fit every pair; print a line each. A pair without a map, None, is told with its sentence."""
    rows, fits = [], []
    for source, target in pairs:
        name = f"{shapes.label(source)[:27]} → {shapes.label(target)[:27]}"
        try:
            row, fit = measured(source.curve, target.curve, method=method, **options)
        except InputError as error:
            print(f"{name:58} {method:9} NO MAP: {error}", flush=True)
            rows.append(None)
            fits.append(None)
            continue
        rows.append(row)
        fits.append(fit)
        print(f"{name:58} {method:9} {line(row)}", flush=True)
    return rows, fits


def share(rows: list[Row], holds) -> float:
    """Share of the rows for which something holds."""
    return float(np.mean([holds(row) for row in rows]))


def found_of(rows: list[Row | None]) -> list[Row]:
    """The rows of those pairs that have a map."""
    return [row for row in rows if row is not None]


def goals(rows: list[Row], count: int) -> list[tuple[str, float, float]]:
    """What was asked of the balanced method: name, share reached, share asked for."""
    return [
        ("ends with a map", len(rows) / count, 1.0),
        ("certified one-to-one", share(rows, lambda r: r.certified), 1.0),
        ("gap at most 5e-4", share(rows, lambda r: r.gap <= 5e-4), 0.98),
        ("gap at most 1e-3", share(rows, lambda r: r.gap <= 1e-3), 1.0),
        ("turn at most 20°", share(rows, lambda r: r.turn <= 20), 0.80),
        ("turn at most 10°", share(rows, lambda r: r.turn <= 10), 0.50),
    ]


def summary(given: dict[str, list[Row | None]]) -> None:
    """Quantiles of both methods, and the goals with their shares; CPU-seconds on the pairs that both have a map for."""
    rows = {method: found_of(each) for method, each in given.items()}
    print("\nquantiles (50 %, 90 %, 100 %)")
    for name in ("gap", "p50", "p95", "K95", "turn", "seconds"):
        cells = [
            f"{method:9}" + " ".join(f"{quantile(found, name, q):9.2g}" for q in (0.5, 0.9, 1.0))
            for method, found in rows.items()
            if found
        ]
        print(f"  {name:9}" + "   ".join(cells))
    print("\ngoals of the balanced method (share of the pairs, asked for); conformal's share behind it")
    beside = (
        {name: found for name, found, _ in goals(rows["conformal"], len(given["conformal"]))}
        if rows.get("conformal")
        else {}
    )
    for name, found, asked in goals(rows["balanced"], len(given["balanced"])):
        mark = "holds" if found >= asked - 1e-9 else "FAILS"
        other = f"{beside[name]:7.1%}" if beside else ""
        print(f"  {mark}  {name:30} {found:7.1%} {asked:7.0%}   {other}")
    both = [each for each in zip(given["balanced"], given["conformal"]) if None not in each]
    if both:
        for q, factor in ((0.5, 1.0), (0.9, 2.0)):
            mine, other = (quantile(list(each), "seconds", q) for each in zip(*both))
            mark = "holds" if mine <= factor * other else "FAILS"
            print(
                f"  {mark}  CPU-seconds on the same {len(both)} pairs, {q:.0%} quantile:"
                f" {mine:.2f} at most {factor:g} x {other:.2f}"
            )
    for q, most in ((0.5, 0.5), (0.9, 1.0)):
        goal(f"balanced solve, {q:.0%} quantile", quantile(rows["balanced"], "seconds", q), most, "CPU-s")


def quantile(rows: list[Row], name: str, q: float) -> float:
    """The smallest value that a share q of the rows does not exceed."""
    return float(np.quantile([getattr(row, name) for row in rows], q, method="inverted_cdf"))


def sheet(found: list[tuple[tuple[Shape, Shape], iccm.Fit | None, iccm.Fit | None]], path: Path) -> None:
    """A contact sheet: source, balanced, conformal; three pairs in a row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = -(-len(found) // 3)
    figure = Figure(figsize=(18, 2.1 * rows), dpi=80)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, 9, squeeze=False)
    for axis in axes.flat:
        axis.set_axis_off()
    for k, ((source, target), balanced, conformal) in enumerate(found):
        cells = axes[k // 3, 3 * (k % 3) : 3 * (k % 3) + 3]
        texture = pictures.board(source.curve)
        own = iccm.fit(source.curve, source.curve, method="balanced")
        for cell, fit, around in zip(cells, (own, balanced, conformal), (source, target, target)):
            if fit is not None:
                pictures.textured(cell, fit, texture, pictures.around(around.curve), 260)
        cells[0].set_title(f"{k + 1}. {shapes.label(source)}", fontsize=6)
        cells[1].set_title(f"{shapes.label(target)}, balanced", fontsize=6)
        cells[2].set_title("conformal", fontsize=6)
    figure.tight_layout(pad=0.4)
    figure.savefig(path)


def main(words: list[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tight", type=int, default=40, help=f"pairs also with a tolerance of {TIGHT:g}")
    parser.add_argument("--conformal", type=int, default=150, help="pairs on which conformal runs beside")
    parser.add_argument("--sheet", type=Path, help=f"a contact sheet of the first {SHOWN} pairs")
    given = parser.parse_args(words)
    refusals: list[str] = []
    pairs = shapes.drawn_pairs(given.pairs, given.seed, refusals)
    packages = ", ".join([*shapes.DRAWINGS, "svgmaps"])
    print(f"## {given.pairs} random pairs (seed {given.seed}) of {packages}")
    print(
        f"drawings refused while picking: {len(refusals)} {dict(Counter(r.split(': ')[-1] for r in refusals))}"
    )
    head = "gap  certified  within 2x  4x  stretch p50  p95  K95  turn  CPU  status"
    print(f"figures over the target's area: {head}")
    for method in ("balanced", "conformal"):
        measured(pairs[0][0].curve, pairs[0][1].curve, method=method)  # compiles and imports
    balanced, fits = run(pairs, "balanced")
    conformal, others = run(pairs[: given.conformal], "conformal")
    if given.sheet:
        both = list(zip(pairs, fits, [*others, *[None] * len(fits)]))
        sheet(both[:SHOWN], given.sheet)
    summary({"balanced": balanced, "conformal": conformal})
    if given.tight:
        print(f"\n## tolerance {TIGHT:g}")
        tight, _ = run(pairs[: given.tight], "balanced", tolerance=TIGHT)
        reached = share(found_of(tight), lambda r: r.gap <= TIGHT)
        print(f"  {'holds' if reached >= 0.9 else 'FAILS'}  gap at most {TIGHT:g}: {reached:.1%} of 90 %")


if __name__ == "__main__":
    main()
