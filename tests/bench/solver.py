"""The solver on random pairs of real silhouettes, `paper` and `conformal` compared; time against vertices.

python -m tests.bench.solver [--pairs 40] [--seed 1] [--atlas 110m|50m|10m] [--largest 4000] [--outlines 2]
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np

import iccm
from iccm import Curve
from tests import exact

from . import shapes

METHODS = ("paper", "conformal")
DEPTH = 1e-3  # of the certificate, relative to the source's diagonal
LONG = 5000  # vertices above which an outline counts as long
SIZES = (250, 500, 1000, 2000, 4000)


@dataclass(frozen=True)
class Row:
    """Results of one method for one pair; lengths relative to the target's diagonal."""

    gap: float
    rms: float
    certified: bool
    depth: float
    spread: float
    vertices: int
    iterations: int
    seconds: float
    status: str
    notes: tuple[str, ...]


def measured(source: Curve, target: Curve, **options) -> Row:
    """Measure one fit, without the time for its report."""
    start = time.perf_counter()
    fit = iccm.fit(source, target, **options)
    seconds = time.perf_counter() - start
    report = fit.report()
    boundary, proof, area = report["boundary"], report["injective"], report["log10_area"]
    return Row(
        boundary["hausdorff"],
        boundary["rms"],
        proof["certified"],
        proof["depth"],
        area["p95"] - area["p05"],
        report["vertices"],
        report["iterations"],
        seconds,
        report["status"],
        tuple(report["notes"]),
    )


def pairs(count: int, seed: int, scale: str) -> dict[str, list[Row]]:
    """Fit every pair with every method; print a line for each, then quantiles."""
    drawn = shapes.pairs(count, seed, scale)
    print(f"## {count} random pairs (seed {seed}), countries at 1:{scale}")
    print("lengths relative to the target's diagonal; area: log10 of the area scale, 5 % to 95 %;")
    print("iterations of conformal: rounds of placing vertices after the first")
    head = "gap      rms      certified  area  vert  iter  seconds"
    print(f"{'pair':46} method  {head}  status")
    rows: dict[str, list[Row]] = {name: [] for name in METHODS}
    measured(drawn[0][0][1], drawn[0][1][1])  # for compilation and imports
    for (a, source), (b, target) in drawn:
        for method in METHODS:
            row = measured(source, target, method=method)
            rows[method].append(row)
            label = f"{a[:21]} → {b[:21]}" if method == METHODS[0] else ""
            print(f"{label:46} {method:6}  {line(row)}  {'; '.join((row.status, *row.notes))}", flush=True)
    summary(rows)
    return rows


def line(row: Row) -> str:
    """Return the figures of a row in columns."""
    proof = f"at {row.depth:.0e}" if row.certified else "no"
    return (
        f"{row.gap:.1e}  {row.rms:.1e}  {proof:9}  {row.spread:4.1f}  {row.vertices:4d}  {row.iterations:4d}"
        f"  {row.seconds:7.2f}"
    )


def summary(rows: dict[str, list[Row]]) -> None:
    """Print quantiles of both methods, and the goals of `conformal`."""
    print("\nquantiles (50 %, 90 %, 100 %)")
    for name in ("gap", "rms", "spread", "vertices", "iterations", "seconds"):
        cells = [
            " ".join(f"{quantile(method_rows, name, q):9.2g}" for q in (0.5, 0.9, 1.0))
            for method_rows in rows.values()
        ]
        print(f"  {name:11}" + "   ".join(f"{m:7}{c}" for m, c in zip(rows, cells)))
    shares = ", ".join(f"{method} {share_certified(method_rows):.0%}" for method, method_rows in rows.items())
    print(f"  certified injective at a depth of {DEPTH:g} or less: {shares} of the pairs")
    conformal = rows["conformal"]
    goals_to_meet = [
        ("median gap at most 1e-3", quantile(conformal, "gap", 0.5), 1e-3),
        ("90 % gap at most 5e-3", quantile(conformal, "gap", 0.9), 5e-3),
        ("not certified on at most 10 %", 1 - share_certified(conformal), 0.1),
        ("median seconds at most 1", quantile(conformal, "seconds", 0.5), 1.0),
        ("90 % seconds at most 3", quantile(conformal, "seconds", 0.9), 3.0),
    ]
    for label, value, bound in goals_to_meet:
        print(f"  {'holds   ' if value <= bound else 'FAILS   '} {label}: {value:.2g}")


def quantile(rows: list[Row], name: str, q: float) -> float:
    """Return the quantile q of a figure over the rows."""
    return float(np.quantile([getattr(row, name) for row in rows], q, method="inverted_cdf"))


def share_certified(rows: list[Row]) -> float:
    """Return the share of rows certified injective at DEPTH or less."""
    return float(np.mean([row.certified and row.depth <= DEPTH * (1 + 1e-9) for row in rows]))


def scaling(largest: int) -> float:
    """Measure time against vertices on one pair; return the exponent of the power law from 500 vertices up."""
    source = shapes.sample("hexagon-blob/hexagon.svg").curve
    target = shapes.sample("hexagon-blob/blob.svg").curve
    print("\n## Time against vertices, conformal, hexagon → blob, a tolerance that asks for all allowed")
    print("vertices  seconds  gap")
    points = []
    for size in [n for n in SIZES if n <= largest]:
        row = measured(source, target, vertices=size, tolerance=1e-9)
        points.append((row.vertices, row.seconds))
        print(f"{row.vertices:8d}  {row.seconds:7.2f}  {row.gap:.1e}", flush=True)
    x, y = np.log(np.array([p for p in points if p[0] >= 450] or points)).T
    exponent = float(np.polyfit(x, y, 1)[0]) if x.size > 1 else float("nan")
    print(f"fitted: time grows as vertices^{exponent:.2f}; at most 2.5 wanted")
    return exponent


def accuracy(largest: int) -> None:
    """Print errors against known conformal maps, and the order of convergence from row to row."""
    errors_of = {
        "disc → w + 0.2 w²": lambda n: exact.smooth_error(0.2, n),
        "disc → w + 0.45 w²": lambda n: exact.smooth_error(0.45, n),
        "square → disc": exact.square_error,
        "L → square": exact.ell_error,
    }
    print("\n## Largest error inside against known maps, relative to the disc's radius (order)")
    print("vertices  " + "  ".join(f"{name:20}" for name in errors_of))
    before: list[float] = []
    for size in [n for n in (60, 120, 240, 480, 960) if n <= largest]:
        errors = [error(size)[0] for error in errors_of.values()]
        gained = [np.log2(a / b) for a, b in zip(before, errors)] or [np.nan] * len(errors)
        cells = [f"{e:.1e} ({g:4.1f})" for e, g in zip(errors, gained)]
        print(f"{size:8d}  " + "  ".join(f"{cell:20}" for cell in cells), flush=True)
        before = errors


def long_outlines(count: int) -> list[Row]:
    """Map the longest country outlines at 1:10m onto a disk, and print how much was simplified."""
    atlas = shapes.countries("10m")
    names = sorted((n for n in atlas if atlas[n].z.size >= LONG), key=lambda n: atlas[n].z.size)[:count]
    disk = np.exp(2j * np.pi * np.arange(64) / 64)
    print("\n## Long outlines onto a 64-gon, conformal")
    rows = []
    for name in names:
        rows.append(measured(atlas[name], disk))
        print(f"{name} ({atlas[name].z.size} vertices): {line(rows[-1])}  {rows[-1].status}", flush=True)
        print("    " + "; ".join(rows[-1].notes))
    return rows


def main(words: list[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--atlas", default="110m", choices=("110m", "50m", "10m"))
    parser.add_argument(
        "--largest",
        type=int,
        default=4000,
        help="vertices of the tables of errors and times; 0 leaves them out",
    )
    parser.add_argument("--outlines", type=int, default=2, help="long country outlines to map")
    options = parser.parse_args(words)
    if options.pairs:
        pairs(options.pairs, options.seed, options.atlas)
    if options.largest:
        accuracy(options.largest)
        scaling(options.largest)
    if options.outlines:
        long_outlines(options.outlines)


if __name__ == "__main__":
    main()
