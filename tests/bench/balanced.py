"""Balanced maps on random pairs of drawings, glyphs, emoji, states and countries: partial maps beside whole ones.

python -m tests.bench.balanced [--pairs 150] [--seed 1] [--sheet FILE.png]
"""

import argparse
import random
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import iccm
from iccm import InputError
from iccm.io.shapes.holes import fit_with_holes, without_holes
from iccm.io.shapes.shape import Shape

from . import pictures, shapes

SHOWN = 40  # pairs of the contact sheet
FITS = ("whole", "auto")
HEAD = "p95  K95  left out  uncovered  turn  gap  certified  CPU-s"


@dataclass(frozen=True)
class Row:
    """Figures of the fit of a pair; lengths relative to the target's diagonal, other figures over the target's area."""

    p95: float
    K95: float
    left_out: float
    uncovered: float
    turn: float
    gap: float
    certified: bool
    seconds: float

    def __str__(self) -> str:
        proof = "yes" if self.certified else "NO"
        return (
            f"{self.p95:6.2f} {self.K95:6.1f} {self.left_out:6.3f} {self.uncovered:6.3f} {self.turn:5.0f}°"
            f" {self.gap:.0e} {proof:3} {self.seconds:6.2f}"
        )


def measured(source: Shape, target: Shape, fit: str) -> tuple[Row | None, iccm.Fit | None, float]:
    """Fit a pair as `iccm map` does; return the row, the fit, and CPU-seconds without the report. None without a
    map.
    """
    if fit == "auto":
        source, target = (without_holes(shape, lambda note: None) for shape in (source, target))
    start = time.process_time()
    try:
        fit_found = fit_with_holes(source, target, lambda note: None, fit=fit)
    except InputError:
        return None, None, time.process_time() - start
    seconds = time.process_time() - start
    r = fit_found.report()
    row = Row(
        r["stretch"]["p95"],
        r["dilatation"]["p95"],
        r.get("left_out", 0.0),
        r.get("uncovered", 0.0),
        r["turn"],
        r["boundary"]["hausdorff"],
        r["injective"]["certified"],
        seconds,
    )
    return row, fit_found, seconds


def wild_pairs(count: int, seed: int, refusals: list[str]) -> list[tuple[Shape, Shape]]:
    """Return random pairs of shapes from the packages in `shapes.WILD`, which the seed determines."""
    choice, names = random.Random(seed), sorted(shapes.WILD)
    return [
        (shapes.drawn_shape(choice, refusals, names), shapes.drawn_shape(choice, refusals, names))
        for _ in range(count)
    ]


def share(rows: list[Row | None], holds) -> float:
    """Return the share of pairs that have a map with a property."""
    return float(np.mean([row is not None and holds(row) for row in rows]))


def goals(rows: dict[str, list[Row | None]], seconds: dict[str, list[float]]) -> None:
    """Print the goals of `auto`, with the share of `whole` for comparison."""
    print("\ngoals of auto: share of the pairs, asked for; whole")
    targets = [
        ("has a map", 1.0, lambda r: True),
        ("certified one-to-one", 1.0, lambda r: r.certified),
        ("p95 stretch at most 3", 0.85, lambda r: r.p95 <= 3),
        ("p95 stretch at most 4", 0.95, lambda r: r.p95 <= 4),
        ("K95 at most 5", 0.85, lambda r: r.K95 <= 5),
        ("left out at most .15", 0.95, lambda r: r.left_out <= 0.15),
        ("uncovered at most .15", 0.95, lambda r: r.uncovered <= 0.15),
        ("turn at most 20°", 0.80, lambda r: abs(r.turn) <= 20),
        ("gap at most 5e-4", 0.98, lambda r: r.gap <= 5e-4),
    ]
    for name, least, holds in targets:
        auto_share, whole_share = (share(rows[fit], holds) for fit in ("auto", "whole"))
        verdict = "holds" if auto_share >= least - 1e-9 else "FAILS"
        print(f"  {verdict}  {name:24} {auto_share:7.1%} {least:5.0%} {whole_share:7.1%}")
    ratio = np.median(np.array(seconds["auto"]) / np.array(seconds["whole"]))
    print(f"  {'holds' if ratio <= 2 else 'FAILS'}  CPU of auto by whole's, median: {ratio:.2f} of at most 2")
    slowest = max(seconds["auto"])
    print(f"  {'holds' if slowest <= 10 else 'FAILS'}  CPU-seconds, largest: {slowest:.1f} of at most 10")


def quantiles(rows: list[Row | None]) -> None:
    """Print a line for each figure."""
    measured_rows = [row for row in rows if row is not None]
    for name in ("p95", "K95", "left_out", "uncovered", "gap", "seconds"):
        values = [getattr(row, name) for row in measured_rows]
        cells = " ".join(f"{np.quantile(values, q, method='inverted_cdf'):9.3g}" for q in (0.5, 0.9, 1.0))
        print(f"  {name:10} {cells}")


def sheet(results: list[tuple[tuple[Shape, Shape], list[iccm.Fit | None]]], path: Path) -> None:
    """Draw a contact sheet: source, whole, auto; three pairs in a row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = -(-len(results) // 3)
    figure = Figure(figsize=(18, 2.1 * rows), dpi=80)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, 9, squeeze=False)
    for axis in axes.flat:
        axis.set_axis_off()
    for k, ((source, target), fits) in enumerate(results):
        cells = axes[k // 3, 3 * (k % 3) : 3 * (k % 3) + 3]
        texture = pictures.board(source.curve)
        identity = iccm.fit(source.curve, source.curve)
        for cell, fit, around in zip(cells, (identity, *fits), (source, target, target)):
            if fit is not None:
                pictures.textured(cell, fit, texture, pictures.around(around.curve), 260)
        for cell, title in zip(cells, (shapes.label(source), f"{shapes.label(target)}, whole", "auto")):
            cell.set_title(f"{k + 1}. {title}", fontsize=6)
    figure.tight_layout(pad=0.4)
    figure.savefig(path)


def main(words: list[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sheet", type=Path, help=f"a contact sheet of the first {SHOWN} pairs")
    options = parser.parse_args(words)
    refusals: list[str] = []
    pairs = wild_pairs(options.pairs, options.seed, refusals)
    print(f"## {options.pairs} random pairs (seed {options.seed}) of {', '.join(sorted(shapes.WILD))}")
    kinds = Counter(refusal.split(": ")[-1] for refusal in refusals)
    print(f"drawings refused while picking: {len(refusals)} {dict(kinds)}\n{HEAD}")
    for fit in FITS:
        measured(*pairs[0], fit)  # compiles and imports
    rows: dict[str, list[Row | None]] = {fit: [] for fit in FITS}
    seconds: dict[str, list[float]] = {fit: [] for fit in FITS}
    results = []
    for k, (source, target) in enumerate(pairs, 1):
        fits = []
        for fit in FITS:
            row, result, elapsed = measured(source, target, fit)
            rows[fit].append(row)
            seconds[fit].append(elapsed)
            fits.append(result)
            name = f"{k} {shapes.label(source)[:25]} → {shapes.label(target)[:25]}"
            print(f"{name:56} {fit:5} {row or f'NO MAP {elapsed:.2f}'}", flush=True)
        if k <= SHOWN:
            results.append(((source, target), fits))
    for fit in FITS:
        print(f"\n{fit}: quantiles (50 %, 90 %, 100 %)")
        quantiles(rows[fit])
    goals(rows, seconds)
    if options.sheet:
        sheet(results, options.sheet)


if __name__ == "__main__":
    main()
