"""How far the map of `iccm edit` jumps when a pin is released.

python -m tests.bench.releases [--pairs 20] [--drags 10] [--steps 60] [--seed 1]

Random pairs of emoji (fetched by npm) as silhouettes, with pins at their eyes: the two largest parts that are mirror
images of each other. Each drag moves one end of one or both pins in equal steps to a random place, starting from the
map from eyes to eyes. A jump is the distance that 95 % of the points move at most on release, in per cent of the
target's diagonal. `failed` counts releases that end in an error, or in a map that does not meet the requirements
although the map that followed had met its pins; `missed` counts drags that do not end at their place; `eyes` is whether
the pair is mapped eye to eye before any drag (0 or 1). The times, 95 % for an update and the mean for a release, are
processor times.
"""

import argparse
import random
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from iccm.curve import Curve, inside_any
from iccm.errors import InputError
from iccm.io.edit.messages import Scene
from iccm.io.edit.scene import frame
from iccm.io.edit.session import Session
from iccm.io.run.job import make
from iccm.io.shapes import shape as files

from . import shapes
from .live import place, scene

EYES = (0.003, 0.08)  # relative to the silhouette's area: each eye
ALIKE = 1.2  # ratio of the eyes' areas
# relative to the diagonal: difference in height of the eyes, and their distance
LEVEL, APART = 0.02, (0.15, 0.5)
DEEP = 0.02  # relative to the diagonal: smallest distance of a drag's end from the outline


def eyes(path: str) -> list[complex]:
    """Return both eyes of an emoji, the left one first; empty if it has no two parts like eyes."""
    try:
        drawn, parts = files.read(f"{path}#silhouette"), files.read_all(path)
    except InputError:
        return []
    whole = drawn.curve
    size, best = whole.diagonal, (0.0, list[complex]())
    for k, first in enumerate(parts):
        for second in parts[k + 1 :]:
            small, large = sorted((first.curve.area, second.curve.area))
            a, b = (sum(part.curve.box) / 2 for part in (first, second))
            if (
                max(EYES[0] * whole.area, large / ALIKE, best[0]) < small
                and large < EYES[1] * whole.area
                and abs((a - b).imag) < LEVEL * size
                and APART[0] * size < abs((a - b).real) < APART[1] * size
                and whole.contains(np.array([a, b])).all()
                and not inside_any(map(Curve, drawn.holes), np.array([a, b])).any()
            ):
                best = small, sorted((a, b), key=lambda z: z.real)
    return best[1]


def pairs(count: int, seed: int) -> Iterator[tuple[str, str, list[list[complex]]]]:
    """Yield two drawings, and the pins [eye, eye] of both."""
    choice = random.Random(seed)
    names = [name for name in shapes.drawings("noto") if "skin-tone" not in name]
    for _ in range(count):
        drawings: list[tuple[str, list[complex]]] = []
        while len(drawings) < 2:
            name = choice.choice(names)
            if eye_pair := eyes(name):
                drawings.append((f"{name}#silhouette", eye_pair))
        (a, source_eyes), (b, target_eyes) = drawings
        yield a, b, [list(ends) for ends in zip(source_eyes, target_eyes)]


def inside(session: Session, side: int, rng: np.random.Generator) -> complex:
    """Return a random place of a shape."""
    curve = (session.pair.source, session.pair.target)[side].curve
    low, high = curve.box
    while True:
        z = complex(rng.uniform(low.real, high.real), rng.uniform(low.imag, high.imag))
        boundary = curve.nearest(np.array([z]))[0]
        if curve.contains(np.array([z]))[0] and abs(boundary - z) > DEEP * curve.diagonal:
            return z


def measure(
    session: Session, begin: list[list[complex]], drags: int, steps: int, rng: np.random.Generator
) -> tuple[list[float], list[float], list[float], list[str], int, bool]:
    """Return jumps, seconds of updates and releases, failures, the number of drags that were missed, and whether the
    pins were met before.
    """
    jumps, updates, releases, failed, missed, met = [], [], [], [], 0, True

    def scene_of(ends: list[list[complex]]) -> Scene:
        return scene([[place(session, side, z) for side, z in enumerate(pin)] for pin in ends])

    for _ in range(drags):
        met &= session.solve(scene_of(begin)).ok
        pin, side = (int(n) for n in rng.integers(2, size=2))
        start, goal = begin[pin][side], inside(session, side, rng)
        for share in np.arange(1, steps + 1) / steps:
            ends = [list(places) for places in begin]
            ends[pin][side] = start + share * (goal - start)
            session.scene = last = scene_of(ends)
            begun = time.process_time()
            update = session.follow(last)
            if update.drawn is not None:
                frame(update.head(0), update.drawn)
            updates.append(time.process_time() - begun)
        seen, begun = session._map, time.process_time()
        let_go = session.solve(last)
        releases.append(time.process_time() - begun)
        missed += not update.ok
        if update.ok and not let_go.ok:
            failed.append(f"pin {pin} end {side} to {goal:.4g}: {let_go.message}")
        elif update.ok:
            z = seen.source[seen.loops[0].size :]
            moved = np.abs(session._map(z) - seen(z)) / session.pair.target.curve.diagonal
            jumps.append(100 * float(np.nanquantile(moved, 0.95)))
    return jumps, updates, releases, failed, missed, met


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--drags", type=int, default=10)
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    every = [list[float]() for _ in range(3)]
    lost = [0, 0, 0]
    head = f"{'median':>7} {'95 %':>6} {'worst':>6}  {'update':>6} {'release':>7}  failed missed eyes"
    print(f"{'jump, % of the diagonal':58}  {head}", flush=True)

    def line(name: str, samples: list[list[float]], failed: int, missed: int, met: int) -> None:
        jumps, updates, releases = (np.array(total or [np.nan]) for total in samples)
        middle, most = np.quantile(jumps, [0.5, 0.95])
        figures = f"{middle:7.2f} {most:6.2f} {jumps.max():6.2f}  {1000 * np.quantile(updates, 0.95):6.0f}"
        print(
            f"{name[:58]:58}  {figures} {releases.mean():7.2f}  {failed:6d} {missed:6d} {met:4d}", flush=True
        )

    for a, b, begin in pairs(options.pairs, options.seed):
        name = " -> ".join(Path(spec.partition("#")[0]).stem for spec in (a, b))
        session = Session(make({"source": a, "target": b}))
        *samples, failed, missed, met = measure(session, begin, options.drags, options.steps, rng)
        line(name, samples, len(failed), missed, met)
        for text in failed:
            print(f"    {text}", flush=True)
        for total, more in zip(every, samples):
            total.extend(more)
        lost = [lost[0] + len(failed), lost[1] + missed, lost[2] + met]
    line(f"all {len(every[0])} releases that were met", every, *lost)


if __name__ == "__main__":
    main()
