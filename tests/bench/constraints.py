"""Pins met exactly: random pins on random pairs of drawings, the balanced method without them beside.

python -m tests.bench.constraints [--pairs 16] [--seed 1] [--only KIND] [--share 1.0]
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import iccm
from iccm import Curve, InputError

from . import shapes

PIN_ERROR, GAP = 1e-9, 1e-3  # goals, the latter of the diagonal
CLEAR = 0.03  # of the diagonal: how far random pins stay from the outlines, and half of it from each other
TRIES = 400


@dataclass(frozen=True)
class Case:
    """A pair of domains with pins and strokes, and the map without them."""

    name: str
    source: Curve
    target: Curve
    free: iccm.Fit
    seconds: float
    pins: np.ndarray
    strokes: tuple = ()


@dataclass(frozen=True)
class Row:
    """What became of a case; the ratios are to the map without constraints."""

    error: float
    gap: float
    certified: bool
    slower: float
    seconds: float
    energy: float
    p95: float
    status: str

    @property
    def met(self) -> bool:
        """Whether all is as promised."""
        return self.error <= PIN_ERROR and self.gap <= GAP and self.certified and self.status == "reached"


def clear(curve: Curve, z: np.ndarray) -> np.ndarray:
    """Which points are inside and far enough from the outline."""
    return curve.contains(z) & (np.abs(curve.at(curve.closest(z)) - z) > CLEAR * curve.diagonal)


def apart(points: list, z: complex, unit: float) -> bool:
    """Whether a point is far enough from the others."""
    return all(abs(z - other) > CLEAR * unit for other in points)


def inner(rng, free: iccm.Fit, count: int, low: float, high: float) -> np.ndarray | None:
    """Pins inside, displaced from where the map without pins has them by shares `low` to `high` of the diagonal."""
    points, pins = free.interior, []
    for _ in range(TRIES):
        z = complex(rng.choice(points))
        w = complex(free.map(np.array([z]))[0])
        way = rng.uniform(low, high) * np.exp(2j * np.pi * rng.uniform()) * free.target.diagonal
        both = zip((z, w + way), (free.source, free.target), zip(*pins) if pins else ([], []))
        if all(clear(c, np.array([p]))[0] and apart(have, p, c.diagonal) for p, c, have in both):
            pins.append((z, w + way))
        if len(pins) == count:
            return np.array(pins)
    return None


def outer(rng, free: iccm.Fit, count: int, slide: float) -> np.ndarray | None:
    """Pins on the outline, slid by up to a share of its length, in order."""
    source, target = free.source, free.target
    for _ in range(TRIES):
        s = np.sort(rng.uniform(0, source.length, count))
        tau = target.closest(free.map(source.at(s)))
        tau = tau + rng.uniform(-slide, slide, count) * target.length
        gaps = np.mod(np.diff(tau, append=tau[:1] + target.length), target.length)
        spans = np.diff(s, append=s[:1] + source.length) / source.length
        if (
            abs(gaps.sum() - target.length) < 1e-6
            and gaps.min() > 0.02 * target.length
            and spans.min() > 0.02
        ):
            return np.column_stack([source.at(s), target.at(tau)])
    return None


def mixed(rng, free: iccm.Fit, count: int) -> np.ndarray | None:
    """Pins inside and on the outline."""
    parts = inner(rng, free, 1 + count % 3, 0.03, 0.15), outer(rng, free, 2 + count % 3, 0.05)
    return None if any(part is None for part in parts) else np.concatenate(parts)


KINDS: dict[str, tuple[int, float, Callable]] = {
    "inner": (100, 1.0, lambda rng, free, k: inner(rng, free, 1 + k % 6, 0.03, 0.15)),
    "far": (50, 0.95, lambda rng, free, k: inner(rng, free, 1 + k % 6, 0.15, 0.40)),
    "outline": (60, 1.0, lambda rng, free, k: outer(rng, free, 2 + k % 5, 0.08)),
    "mixed": (40, 0.95, mixed),
}
"""How many cases of each kind, the share that must be met, and what makes them."""


def free_fits(count: int, seed: int) -> list[Case]:
    """Random pairs with their maps without constraints."""
    found = []
    for source, target in shapes.drawn_pairs(count, seed, []):
        name = f"{shapes.label(source)[:22]} → {shapes.label(target)[:22]}"
        try:
            iccm.fit(source.curve, target.curve) if not found else None  # compiles
            start = time.process_time()
            free = iccm.fit(source.curve, target.curve)
        except InputError as error:
            print(f"{name}: no map without constraints: {error}", flush=True)
            continue
        seconds = time.process_time() - start
        found.append(Case(name, source.curve, target.curve, free, seconds, np.empty((0, 2))))
    return found


def measured(case: Case, pins: np.ndarray) -> Row:
    """One fit with pins."""
    start = time.process_time()
    fit = iccm.fit(case.source, case.target, pins=pins)
    seconds = time.process_time() - start
    r, free = fit.report(), case.free.report()
    return Row(
        max(pin["error"] for pin in r["pins"]),
        r["boundary"]["hausdorff"],
        r["injective"]["certified"],
        seconds / case.seconds,
        seconds,
        fit.energies[0]["total"] / case.free.energies[0]["total"],
        r["stretch"]["p95"] / free["stretch"]["p95"],
        r["status"],
    )


def run(kind: str, cases: list[Case], seed: int, share: float) -> list[Row]:
    """All cases of a kind, a line each, and a summary with the goals."""
    count, least, make = KINDS[kind]
    rng, rows, failed, made = np.random.default_rng(seed), [], 0, 0
    for k in range(max(1, round(count * share))):
        case = cases[k % len(cases)]
        pins = make(rng, case.free, k // len(cases) + k)
        if pins is None:
            continue
        made += 1
        name = f"{kind:8} {case.name:48} {len(pins)}"
        try:
            row = measured(case, pins)
        except InputError as error:
            print(f"{name} NO MAP: {error}", flush=True)
            failed += 1
            continue
        rows.append(row)
        print(
            f"{name} {'met' if row.met else 'NOT'} error {row.error:.0e} gap {row.gap:.0e} "
            f"{'' if row.certified else 'FOLDS '}energy × {row.energy:.2f} p95 × {row.p95:.2f} "
            f"{row.seconds:.2f}s × {row.slower:.1f} {row.status}",
            flush=True,
        )
    met = sum(row.met for row in rows)
    middle = [float(np.median([getattr(row, f) for row in rows])) for f in ("slower", "energy", "p95")]
    print(
        f"{kind}: {met} of {made} met (goal {least:.0%}), folds {sum(not r.certified for r in rows)} (goal 0), "
        f"no map {failed}, CPU × {middle[0]:.2f} in the median (goal 2), most {max(r.seconds for r in rows):.1f} s "
        f"(goal 20), energy × {middle[1]:.2f}, p95 × {middle[2]:.2f}; seed {seed}\n"
    )
    return rows


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=16)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=KINDS)
    parser.add_argument("--share", type=float, default=1.0, help="of the cases")
    args = parser.parse_args()
    cases = free_fits(args.pairs, args.seed)
    for kind in [args.only] if args.only else KINDS:
        run(kind, cases, args.seed, args.share)


if __name__ == "__main__":
    main()
