"""Time to follow a dragged pin in `iccm edit`: from the page's message to the bytes of the answer.

python -m tests.bench.live [--icons N] [--updates 60] [--seed 1]

Three pairs of samples, one pair with a mesh, and N random pairs of icons (fetched by npm). One of three pins is dragged
along a closed path of a tenth of the target's size, in steps of a hundredth; then its end in the source. The table
shows CPU and wall-clock milliseconds, median and 95 %; `full` is the time after releasing the pin, and `missed` the
number of updates that did not reach the pin. Places outside the shape do not count.
"""

import argparse
import random
import time
from pathlib import Path

import numpy as np

from iccm.errors import InputError
from iccm.io.edit import placing
from iccm.io.edit.messages import Scene
from iccm.io.edit.pair import PLACE_DIGITS
from iccm.io.edit.scene import frame
from iccm.io.edit.session import Session
from iccm.io.run.job import make

from . import shapes

SAMPLES = Path(__file__).parents[2] / "samples"
PAIRS = [("rose-leaf/rose.svg", "rose-leaf/leaf.svg"), ("pins/cat.svg#face", "pins/round.svg#face")]
PAIRS += [("limbs/gingerbread.svg", "limbs/starfish.svg"), ("face-pins/tiger.svg", "face-pins/face.obj")]
RADIUS, PINS, TRIES = 0.05, 3, 1000


Pin = list[list[float]]


def scene(pins: list[Pin]) -> Scene:
    """Return pins as the page sends them."""
    return Scene.model_validate({"pins": [{"source": a, "target": b} for a, b in pins]})


def place(session: Session, side: int, z: complex) -> list[float]:
    """Return a point of a shape's plane as the page sends it."""
    surface, shape = session.view.surfaces[side], (session.pair.source, session.pair.target)[side]
    if surface:
        return surface.places(np.array([z]), PLACE_DIGITS)[0]
    found: list[float] = shape.to_file(z).tolist()
    return found


def reached(session: Session, z: complex) -> bool:
    """Return whether a point of the source is neither in a hole nor hidden."""
    try:
        placing.transfer(session, "source", [tuple(session.pair.source.to_file(z).tolist())])
    except InputError:
        return False
    return True


def spread(session: Session, rng: np.random.Generator) -> list[Pin]:
    """Return pins at random places well inside, with the images that the map gives them."""
    curve = session.pair.source.curve
    low, high = curve.box
    found: list[complex] = []
    for _ in range(TRIES):
        if len(found) == PINS:
            break
        z = complex(rng.uniform(low.real, high.real), rng.uniform(low.imag, high.imag))
        depth = abs(curve.nearest(np.array([z]))[0] - z)
        apart = min((abs(z - other) for other in found), default=np.inf)
        if (
            curve.contains(np.array([z]))[0]
            and min(depth, apart) > 0.04 * curve.diagonal
            and reached(session, z)
        ):
            found.append(z)
    if len(found) < PINS:
        raise InputError(f"no room for {PINS} pins")
    here = [place(session, 0, z) for z in found]
    return [list(ends) for ends in zip(here, placing.transfer(session, "source", here))]


def dragged(session: Session, pins: list[Pin], side: int, updates: int) -> tuple[np.ndarray, int]:
    """Return (updates, 2) CPU and wall-clock seconds of each update, and how many did not reach the pin."""
    shape = (session.pair.source, session.pair.target)[side]
    size, start = shape.curve.diagonal, shape.at(tuple(pins[0][side]))
    way = np.exp(2j * np.pi * np.arange(updates) / updates) - 1
    seconds, missed = [], 0
    for step in RADIUS * size * way:
        moved = [list(ends) for ends in pins]
        moved[0][side] = place(session, side, start + step)
        cpu, wall = time.process_time(), time.perf_counter()
        shown = session.follow(scene(moved))
        if shown.drawn is not None:
            frame(shown.head(0), shown.drawn)
        if shown.kind != "error":  # else the path has left the shape
            seconds.append((time.process_time() - cpu, time.perf_counter() - wall))
            missed += not shown.ok
    if not seconds:
        raise InputError("all of the way is outside the shape")
    return np.array(seconds), missed


def measure(name: str, source: str, target: str, updates: int, seed: int) -> None:
    """One line of the table."""
    session = Session(make({"source": source, "target": target}))
    session.solve(Scene())
    pins = spread(session, np.random.default_rng(seed))
    cpu = time.process_time()
    session.solve(scene(pins))
    full = time.process_time() - cpu
    session.follow(scene(pins))
    cells = []
    for side in (1, 0):
        seconds, missed = dragged(session, pins, side, updates)
        middle, most = (1000 * np.quantile(seconds, share, axis=0) for share in (0.5, 0.95))
        cells.append(f"{middle[0]:5.0f} {most[0]:5.0f}  {middle[1]:5.0f} {most[1]:5.0f} {missed:6d}")
    print(f"{name[:34]:34}  {cells[0]}   {cells[1]}  {full:5.2f}", flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--icons", type=int, default=0)
    parser.add_argument("--updates", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(f"{'':34}  target end: CPU ms, wall ms, missed   source end: likewise       full, CPU s")
    for a, b in PAIRS:
        name = f"{Path(a.partition('#')[0]).stem} -> {Path(b.partition('#')[0]).stem}"
        measure(name, str(SAMPLES / a), str(SAMPLES / b), options.updates, options.seed)
    rng = random.Random(options.seed)
    found = sorted(shapes.icons().items()) if options.icons else []
    for _ in range(options.icons):
        (name, a), (other, b) = rng.sample(found, 2)
        try:
            measure(f"{name} -> {other}", str(a), str(b), options.updates, options.seed)
        except InputError as error:
            print(f"{name} -> {other}: {error}")


if __name__ == "__main__":
    main()
