"""Stability of maps: smooth near the outline, unchanged under noise, and always found.

python -m tests.bench.stability [--seed 1] [--pairs 60] [--constrained 12] [--only PART ...]
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

import iccm
from iccm import Curve, InputError
from iccm.arrays import Complex
from iccm.io.shapes.shape import Shape

from .balanced import wild_pairs
from .goals import goal

COUNTS = (
    (60, 5000),
    (5000, 300),
    (200, 333),
    (64, 2000),
    (1000, 77),
    (20_000, 60),
    (300, 300),
    (3000, 20_000),
)
"""Numbers of vertices of a disc or ellipse, and of the same shape with others."""
MOVED = 1e-3  # relative to the diagonal
LONG = 10.0  # CPU-seconds
NOISES = (0.0, 2e-3, 1e-2)  # relative to the diagonal
PARTS = ("discs", "rim", "noise", "pins", "holes", "noisy")

Change = Callable[[Complex], Complex]
Solver = Callable[[Complex, Complex, Change], iccm.Fit]


def disc(vertices: int, axis: float, shift: float) -> Curve:
    """Return a regular polygon, stretched to an ellipse."""
    t = 2 * np.pi * (np.arange(vertices) + shift) / vertices
    return Curve(axis * np.cos(t) + 1j * np.sin(t))


def onto_themselves() -> None:
    """Map discs and ellipses onto themselves with other vertices: the identity."""
    rows = []
    for k, (a, b) in enumerate(COUNTS):
        axis = 1.0 + k % 3
        report = iccm.fit(disc(a, axis, 0.0), disc(b, axis, 0.37)).report()
        rows.append((report["stretch"]["p95"], report["stretch"]["max"], report["boundary"]["hausdorff"]))
        print(
            "  {:g}:1, {:5} onto {:5} vertices: p95 {:.3f} max {:.3f} gap {:.1e}".format(
                axis, a, b, *rows[-1]
            )
        )
    worst = np.max(rows, axis=0)
    for name, value, most in zip(("p95", "largest", "gap"), worst, (1.01, 1.05, 1e-4)):
        goal(f"discs and ellipses onto themselves, {name}", value, most)


def roughness(fit: iccm.Fit) -> float:
    """Return the root mean square of dτ/ds about its mean over two edges of the mesh, relative to that mean."""
    loop = fit.map.loops[0]
    s, tau = (Curve(w[loop]).knots for w in (fit.map.source, fit.map.image))
    edge = np.sqrt(4 * Curve(fit.map.source[loop]).area / len(fit.map.faces))
    places = np.linspace(0, s[-1], int(8 * s[-1] / edge) + 1)
    slope = np.diff(np.interp(places, s, tau))
    around = np.concatenate([slope[-8:], slope, slope[:8]])
    mean = np.convolve(around, np.ones(17) / 17, "valid")
    return float(np.sqrt(np.mean((slope / mean - 1) ** 2)))


def beside_the_outline(pairs: list[tuple[Shape, Shape]]) -> None:
    """Print how rough maps are along the outline, and how far the largest stretch is from that of most points."""
    rows = []
    for source, target in pairs:
        fit = iccm.fit(source.curve, target.curve, fit="whole")
        report = fit.report()
        gap, proof = report["boundary"]["hausdorff"], report["injective"]["certified"]
        rows.append((roughness(fit), report["stretch"]["max"] / report["stretch"]["p95"], gap, not proof))
    rough, ratio, gap, unproven = np.array(rows).T
    goal("high-frequency part of dτ/ds, median", float(np.median(rough)), 0.03)
    goal("pairs whose largest stretch exceeds 4 × p95, share", float(np.mean(ratio > 4)), 0.1)
    goal("gap, largest", float(gap.max()), 5e-4)
    goal("maps without a certificate", float(unproven.sum()), 0)


def shaken(rng: np.random.Generator, share: float = 1e-9) -> Change:
    """Return a function that moves points by a share of the diagonal of their bounding box."""
    return lambda z: z + share * span(z) * np.exp(2j * np.pi * rng.random(z.shape))


def rounded(z: Complex) -> Complex:
    """Return points scaled to a box of 512 with coordinates rounded to three decimals, as drawing programs write
    them.
    """
    scale = 512 / max(np.ptp(z.real), np.ptp(z.imag), 1e-300)
    return np.round(z * scale, 3) / scale


def span(z: Complex) -> float:
    """Return the diagonal of the bounding box of points; for a single point that of the unit square."""
    return abs(complex(np.ptp(z.real), np.ptp(z.imag))) or 1.0


def hold_still(name: str, pairs: list[tuple[Complex, Complex]], solve: Solver, seed: int) -> None:
    """Print how far maps move when their outlines move by next to nothing."""
    for change, label in (
        (shaken(np.random.default_rng(seed)), "noise of 1e-9"),
        (rounded, "3 decimals of 512"),
    ):
        moved, lost = [], 0
        for pair in pairs:
            try:
                before, after = solve(*pair, lambda z: z), solve(*pair, change)
            except InputError:
                lost += 1
                continue
            z = before.map.source[before.map.faces].mean(axis=1)
            moved.append(np.nanmax(np.abs(after.map(z) - before.map(z))) / span(pair[1]))
        print(f"  {name}, {label}: farthest point, median {np.median(moved):.1e}; {lost} without a map")
        goal(f"{name}: of {len(moved)} maps moved by {label}", int(np.sum(np.array(moved) > MOVED)), 1)


def solved(source: Complex, target: Complex, change: Change) -> iccm.Fit:
    """Return the whole map of two outlines after a change."""
    return iccm.fit(Curve.domain(change(source)), Curve.domain(change(target)), fit="whole")


def pinned(source: Complex, target: Complex, change: Change) -> iccm.Fit:
    """Return the same with three pins of an unconstrained map, whose images are moved by 2 % of the diagonal."""
    free = solved(source, target, lambda z: z)
    chosen = np.argsort(np.abs(free._interior - np.mean(source)))[
        [0, len(free._interior) // 4, len(free._interior) // 2]
    ]
    goals = free.map(free._interior[chosen]) + 0.02 * span(target) * np.array([1, 1j, -1])
    curves = (Curve.domain(change(z)) for z in (source, target))
    return iccm.fit(*curves, pins=np.column_stack([free._interior[chosen], goals]))


def pierced(source: Complex, target: Complex, change: Change) -> iccm.Fit:
    """Return the same with a square hole in each shape, where the outlines are farthest away."""
    import shapely

    from iccm.arrays import xy_of

    holes = []
    for z in (source, target):
        polygon = shapely.Polygon(xy_of(z))
        centre = shapely.maximum_inscribed_circle(polygon)
        middle = complex(*shapely.get_coordinates(centre)[0])
        holes.append([middle + 0.4 * shapely.length(centre) * 1j ** np.arange(4)[::-1]])
    curves = (Curve.domain(change(z)) for z in (source, target))
    changed = ([change(hole) for hole in side] for side in holes)
    source_holes, target_holes = changed
    return iccm.fit(*curves, source_holes=source_holes, target_holes=target_holes, fit="whole")


def always_there(pairs: list[tuple[Complex, Complex]], seed: int) -> None:
    """Check that outlines with noise on their vertices have a map within the time limit."""
    rng, lost, slow, worst = np.random.default_rng(seed), 0, 0, 0.0
    for k, pair in enumerate(pairs):
        change = shaken(rng, NOISES[k % len(NOISES)])
        try:
            curves = [Curve.domain(change(z)) for z in pair]
        except InputError:
            continue  # the noise makes the outline cross itself
        start = time.process_time()
        try:
            iccm.fit(*curves)
        except InputError as error:
            lost += 1
            print(f"  {k}: {error}")
        elapsed = time.process_time() - start
        if elapsed > LONG:
            print(f"  {k}: {elapsed:.1f} CPU-s", flush=True)
        slow, worst = slow + (elapsed > LONG), max(worst, elapsed)
    goal("noisy outlines without a map", lost, 0)
    goal(f"noisy outlines over {LONG:g} CPU-s", slow, 0)
    print(f"  slowest {worst:.1f} CPU-s")


def main(words: list[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--constrained", type=int, default=12)
    parser.add_argument("--only", nargs="*", choices=PARTS, default=PARTS)
    options = parser.parse_args(words)
    shapes = wild_pairs(options.pairs, options.seed, [])
    pairs = [(a.curve.z, b.curve.z) for a, b in shapes]
    few = pairs[: options.constrained]
    print(f"## {options.pairs} random pairs, seed {options.seed}")
    parts: dict[str, Callable[[], None]] = {
        "discs": onto_themselves,
        "rim": lambda: beside_the_outline(shapes),
        "noise": lambda: hold_still("free", pairs, solved, options.seed),
        "pins": lambda: hold_still("pins", few, pinned, options.seed),
        "holes": lambda: hold_still("holes", few, pierced, options.seed),
        "noisy": lambda: always_there(pairs, options.seed),
    }
    for name in options.only:
        parts[name]()


if __name__ == "__main__":
    main()
