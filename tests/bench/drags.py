"""Whether pins that are dragged in `iccm edit` are met when they are released, and whether the map jumps then.

python -m tests.bench.drags [--pairs 10] [--drags 10] [--steps 60] [--rest 3] [--seed 1] [--first 0] [--compare]
                            [--straight] [--hold]

Each pair of five sets of drawings (fetched by npm) gives one pair of shapes, then each set alone, 15 in all: in turns
silhouettes, and whole drawings as the page opens them. The drags of a pair follow each other, as on the page: each
places a new pin where the map takes it, or takes an earlier one; one of its ends moves in equal steps to a random
place anywhere in the shape, along the shortest path inside that keeps away from the outline, or with --straight along
a straight line, which may leave the shape; the hand rests for a number of updates (three take some 150 ms), and
releases the pin. With --hold it rests until the page has done everything that it does then: the map comes to rest, and
a better one replaces it. After the last drag, or after each with --compare, the map is compared with the one from
scratch, as the page does when nothing happens.

Of each pair, the table shows how many releases were `met`: the map takes the pin to where the hand put it. Where it
cannot follow, the pin stops `short`. The table also shows jumps in per cent of the target's diagonal, as the
distance that 95 % of the points move at most: when a pin is placed where the map takes it (`placed`), in the first
step of the drag (`begun`), while the hand holds the pin (`held`, between the map that has come to rest and the one that
replaces it), between the map seen after the last step and the converged one (`at once`), between the map
seen at the release and the converged one (`released`), between two consecutive pictures after the release, of which
there is one for each update in which the map settles (`picture`), and when the comparison shows the map from scratch
(`replaced`). `settling` is the mean number of updates between the release and the converged map. `p95` is the stretch
on 95 % of the target after the last drag, relative to the map from scratch with the same pins, before and after the
comparison. `wound` is the number of pairs whose map differs from the one from scratch by more than a deformation that
leaves the pins where they are.
"""

import argparse
import json
import random
import time
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree
from skimage.graph import route_through_array

from iccm.arrays import Complex
from iccm.curve import Curve, inside_any
from iccm.errors import InputError
from iccm.io.edit import placing
from iccm.io.edit.link import MOST_RELAXATIONS
from iccm.io.edit.map_update import MapUpdate
from iccm.io.edit.messages import Scene
from iccm.io.edit.session import Session
from iccm.io.run.job import make
from iccm.io.shapes.shape import Shape
from iccm.maps.triangulated.map import TriangulatedMap

from . import shapes
from .isotopy import wound
from .live import Pin, place, reached, scene

SETS = {
    "fluent": "@iconify-json/fluent-emoji-high-contrast@1.2.6",
    "firefox": "@iconify-json/fxemoji@1.2.2",
    "games": "@iconify-json/game-icons@1.2.4",
    "noto-v1": "@iconify-json/noto-v1@1.2.5",
    "emojione-v1": "@iconify-json/emojione-v1@1.2.3",
}
# relative to the diagonal: distances from the outline, and from other pins and the place before
LEAST_DEPTH, LEAST_GAP = 0.02, 0.04
NEW_PIN_SHARE = 0.5  # share of drags that begin with a new pin
TRIES = 1000  # random places before a drag is given up
PLAIN_JUMP = 0.5  # per cent of the diagonal: a designer sees more (4 pixels of 800)
JUMPS = ("placed", "begun", "held", "at_once", "released", "picture", "replaced")  # columns
ARC_POINTS = 1000  # on the arcs between pins, which show how the pins are wound around each other
PATH_CELLS = 120  # along the longer side of the box in which paths are searched
COST_AT_OUTLINE = 5.0  # of a step closer to the outline than LEAST_DEPTH, relative to one further inside


@dataclass
class Drags:
    """What the drags of one pair gave: a number for each release, or for each pair."""

    met: list[bool] = field(default_factory=list)
    short: list[bool] = field(default_factory=list)
    placed: list[float] = field(default_factory=list)
    begun: list[float] = field(default_factory=list)
    held: list[float] = field(default_factory=list)
    at_once: list[float] = field(default_factory=list)
    released: list[float] = field(default_factory=list)
    picture: list[float] = field(default_factory=list)
    replaced: list[float] = field(default_factory=list)
    settling: list[int] = field(default_factory=list)
    ratios: list[tuple[float, float]] = field(default_factory=list)
    wound: list[bool] = field(default_factory=list)

    def add(self, other: "Drags") -> None:
        """Append the numbers of another pair."""
        for name, values in vars(self).items():
            values.extend(getattr(other, name))

    def row(self, name: str) -> str:
        """Return a line of the table."""
        cells = [f"{sum(self.met):4d}/{len(self.met):3d} {sum(self.short):6d}"]
        for name_of_jumps in JUMPS:
            jumps = getattr(self, name_of_jumps)
            within = sum(jump <= PLAIN_JUMP for jump in jumps)
            cells.append(f"{np.max(jumps, initial=0):6.2f} {within:4d}/{len(jumps):3d}")
        cells.append(f"{np.mean(self.settling or [0]):5.1f}")
        before, after = (np.max([pair[k] for pair in self.ratios], initial=0) for k in (0, 1))
        return f"{name[:52]:52}  {'  '.join(cells)}  {before:5.2f} {after:5.2f} {sum(self.wound):4d}"


def drawing(name: str, choice: random.Random) -> Path:
    """Return a random drawing of a set."""
    folder = shapes.fetched(name, SETS[name])
    collection = json.loads((folder / "icons.json").read_text(encoding="utf-8"))
    key = choice.choice(sorted(collection["icons"]))
    icon = collection["icons"][key]
    width, height = (icon.get(side, collection.get(side, 16)) for side in ("width", "height"))
    drawn = shapes.CACHE / name / "drawn" / f"{key}.svg"
    drawn.parent.mkdir(exist_ok=True)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}">'
    drawn.write_text(f"{head}{icon['body']}</svg>", encoding="utf-8")
    return drawn


def opened(names: tuple[str, str], part: str, choice: random.Random) -> Session:
    """Return a session with the first random pair of two sets that can be read and mapped."""
    while True:
        source, target = (f"{drawing(name, choice)}{part}" for name in names)
        try:
            session = Session(make({"source": source, "target": target}))
            if session.solve(Scene()).kind == "full":
                return session
        except InputError:
            continue


def random_place(session: Session, side: int, pins: list[Pin], rng: np.random.Generator) -> complex | None:
    """Return a random place of a shape, apart from the ends of pins and from the outline; None if there is no room."""
    shape = (session.pair.source, session.pair.target)[side]
    curve = shape.curve
    low, high = curve.box
    for _ in range(TRIES):
        z = complex(rng.uniform(low.real, high.real), rng.uniform(low.imag, high.imag))
        depth = abs(curve.nearest(np.array([z]))[0] - z)
        apart = min((abs(z - shape.at(tuple(pin[side]))) for pin in pins), default=np.inf)
        is_apart = depth > LEAST_DEPTH * curve.diagonal and apart > LEAST_GAP * curve.diagonal
        if is_apart and curve.contains(np.array([z]))[0] and (side == 1 or reached(session, z)):
            return z
    return None


def path_inside(shape: Shape, start: complex, goal: complex, *, holed: bool) -> Complex:
    """Return the corners of the cheapest path between two places of a shape, which keeps away from its outlines.

    It is searched on a grid, and shortened wherever a straight line costs no more.

    Raises:
        ValueError: the grid does not resolve the shape's narrowest places between them.
    """
    curve = shape.curve
    holes = [Curve(shape.holes[k]) for k in shape.mappable_holes] if holed else []
    low, high = curve.box
    step = max((high - low).real, (high - low).imag) / PATH_CELLS
    columns, rows = np.arange(low.real, high.real + step, step), np.arange(low.imag, high.imag + step, step)
    cells = (columns + 1j * rows[:, None]).ravel()
    cost = np.ones(cells.size)
    for outline in (curve, *holes):
        cost[outline.distances(cells) < LEAST_DEPTH * curve.diagonal] = COST_AT_OUTLINE
    cost[~curve.contains(cells) | inside_any(holes, cells)] = np.inf
    nearest = cKDTree(np.stack([cells.real, cells.imag], axis=1)[np.isfinite(cost)])
    ends = np.flatnonzero(np.isfinite(cost))[nearest.query([[z.real, z.imag] for z in (start, goal)])[1]]
    grid = cost.reshape(rows.size, columns.size)
    route, _ = route_through_array(
        np.where(np.isfinite(grid), grid, -1), *(divmod(int(end), columns.size) for end in ends)
    )
    points = np.array([start, *(complex(columns[j], rows[i]) for i, j in route[1:-1]), goal])

    def price(a: complex, b: complex) -> float:
        z = a + (b - a) * np.linspace(0, 1, 2 + int(2 * abs(b - a) / step))
        i, j = np.rint((z.imag - low.imag) / step), np.rint((z.real - low.real) / step)
        return float(grid[i.astype(int), j.astype(int)].mean()) * abs(b - a)

    so_far = np.cumsum([0, *(price(a, b) for a, b in pairwise(points))])
    corners = [0]
    while corners[-1] < points.size - 1:
        first = corners[-1]
        shortcuts = [
            k
            for k in range(first + 2, points.size)
            if price(points[first], points[k]) <= so_far[k] - so_far[first]
        ]
        corners.append(max(shortcuts, default=first + 1))
    return points[corners]


def along(corners: Complex, shares: np.ndarray) -> Complex:
    """Return the points of a polyline at shares of its length."""
    length = np.concatenate([[0], np.cumsum(np.abs(np.diff(corners)))])
    return np.interp(shares * length[-1], length, corners)


def moved(session: Session, before: TriangulatedMap, after: TriangulatedMap) -> float:
    """Return how far 95 % of the points move at most, in per cent of the target's diagonal."""
    z = before.source[before.loops[0].size :]
    gaps = np.abs(after(z) - before.image[before.loops[0].size :]) / session.pair.target.curve.diagonal
    return 100 * float(np.nanquantile(gaps, 0.95))


def stretch(session: Session) -> float:
    """Return the stretch on 95 % of the target of the map that is shown."""
    distortion = session._fit.distortion
    return float(distortion.quantile(distortion.stretches, 0.95))


def drag_once(
    session: Session,
    pins: list[Pin],
    steps: int,
    rest: int,
    rng: np.random.Generator,
    found: Drags,
    *,
    straight: bool,
    holding: bool,
) -> bool:
    """Drag a new or an earlier pin, and release it; return whether there was room. `pins` is changed."""
    if not pins or rng.uniform() < NEW_PIN_SHARE:
        z = random_place(session, 0, pins, rng)
        if z is None:
            return False
        here = place(session, 0, z)
        pins.append([here, placing.transfer(session, "source", [tuple(here)])[0]])
        number = len(pins) - 1
    else:
        number = int(rng.integers(len(pins)))
    side = int(rng.integers(2))
    shape = (session.pair.source, session.pair.target)[side]
    start = shape.at(tuple(pins[number][side]))
    goal = random_place(session, side, pins, rng)
    if goal is None:
        return False
    # the pin is placed, and solved, before it is dragged
    before = session._map
    session.solve(scene(pins))
    found.placed.append(moved(session, before, session._map))
    before = session._map
    path = (
        np.array([start, goal]) if straight else path_inside(shape, start, goal, holed=session.pair.job.holed)
    )
    shares = np.arange(1, steps + 1) / steps
    for share, z in zip(shares, along(path, shares)):
        pins[number] = list(pins[number])
        pins[number][side] = place(session, side, z)
        session.scene = last = scene(pins)
        shown = session.follow(last)
        if share == 1 / steps:
            found.begun.append(moved(session, before, session._map))
    if shown.kind == "error":
        print(f"    {shown.message}")
    dragged = session._map
    shown = hold(session, last, found) if holding else None
    if shown is None:
        for _ in range(rest):
            session.relax(last)
    released, released_maps = session._map, session.maps
    pictures = [released]
    if shown is not None and shown.kind == "full":
        full = session.solve(last, "fresh" if shown.other == "kept" else "kept", hand="released")
    else:
        for _ in range(MOST_RELAXATIONS):
            if session.relax(last, released_maps) is None:
                break
            pictures.append(session._map)
        full = session.solve(last, hand="released")
    found.settling.append(len(pictures) - 1)
    found.met.append(full.kind == "full" and full.ok and not full.short)
    found.short.append(bool(full.short))
    if full.scene is not None:
        session.scene = full.scene
        for k in full.short:
            pins[k] = [list(full.scene.pins[k].source), list(full.scene.pins[k].target)]
    if full.short:
        away = abs(shape.at(tuple(pins[number][side])) - goal) / shape.curve.diagonal
        print(f"    pin {number + 1}, side {side}: {100 * away:.1f} % short", flush=True)
    elif full.kind != "full" or not full.ok:
        print(f"    pin {number + 1}, side {side}: {full.message}", flush=True)
    converged = session._map
    pictures.append(converged)
    found.at_once.append(moved(session, dragged, converged))
    found.released.append(moved(session, released, converged))
    found.picture.append(max(moved(session, a, b) for a, b in pairwise(pictures)))
    return True


def hold(session: Session, last: Scene, found: Drags) -> MapUpdate:
    """Hold a pin until nothing changes any more, as the page's server does; return the last update of the page."""
    for _ in range(MOST_RELAXATIONS):
        if session.relax(last) is None:
            break
    shown, rested = session.solve(last, hand="resting"), session._map
    while shown.kind in ("full", "blocked"):
        was_blocked = session.has_followed(last)
        better = session.compare(last, resting=True)
        shown = better or shown
        if better is None or not was_blocked:
            break
    found.held.append(moved(session, rested, session._map))
    return shown


def compare(session: Session, pins: list[Pin], found: Drags) -> None:
    """Compare the map with the one from scratch as the page does; add by how much it changes, and both stretches."""
    converged, continued = session._map, stretch(session)
    session.scene = last = scene(pins)
    session.solve(last)
    session.compare(last)
    found.replaced.append(moved(session, converged, session._map))
    found.ratios[:] = [(continued, stretch(session))]


def pinned(session: Session, pins: list[Pin]) -> Complex:
    """Return the places of pins in the target."""
    return np.array([session.pair.target.at(tuple(pin[1])) for pin in pins])


def arcs_between(session: Session, pins: list[Pin]) -> list[Complex]:
    """Return arcs of the source from the first pin to each of the others, as polylines."""
    shape = session.pair.source
    start, *others = (shape.at(tuple(pin[0])) for pin in pins)
    shares = np.linspace(0, 1, ARC_POINTS)
    return [along(path_inside(shape, start, end, holed=session.pair.job.holed), shares) for end in others]


def images(session: Session, arcs: list[Complex]) -> list[Complex]:
    """Return the images of arcs by the map that is shown; without points in places that it does not cover."""
    curves = [session._map(arc) for arc in arcs]
    return [curve[np.isfinite(curve)] for curve in curves]


def measure(
    session: Session,
    drags: int,
    steps: int,
    rest: int,
    rng: np.random.Generator,
    *,
    comparing: bool = False,
    straight: bool = False,
    holding: bool = False,
) -> Drags:
    """Return what the drags of a pair give."""
    found, pins = Drags(), list[Pin]()
    while len(found.met) < drags and drag_once(
        session, pins, steps, rest, rng, found, straight=straight, holding=holding
    ):
        if comparing:
            compare(session, pins, found)
    if not comparing:
        compare(session, pins, found)
    ((continued, kept),) = found.ratios
    arcs = arcs_between(session, pins)
    continued_arcs = images(session, arcs)
    session.solve(scene(pins), "fresh")
    scratch = stretch(session)
    found.wound[:] = [wound(continued_arcs, images(session, arcs), pinned(session, pins))]
    found.ratios[:] = [(continued / scratch, kept / scratch)]
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=10)
    parser.add_argument("--drags", type=int, default=10)
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--rest", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first pair")
    parser.add_argument("--compare", action="store_true", help="after each drag")
    parser.add_argument("--straight", action="store_true", help="drag along straight lines")
    parser.add_argument("--hold", action="store_true", help="hold each pin until nothing changes any more")
    options = parser.parse_args()
    jumps = "  ".join(f"{name.replace('_', ' '):>14}" for name in JUMPS)
    print(
        f"{f'seed {options.seed}':52}  {'met':>8} {'short':>6}  {jumps}  {'settling':>5}  {'p95':11} wound",
        flush=True,
    )
    every = Drags()
    pairs = [*combinations(SETS, 2), *((name, name) for name in SETS)]
    for number, names in list(enumerate(pairs))[options.first : options.pairs]:
        choice = random.Random(f"{options.seed} {number}")
        session = opened(names, "#silhouette" if number % 2 == 0 else "", choice)
        begun = time.process_time()
        rng = np.random.default_rng([options.seed, number])
        found = measure(
            session,
            options.drags,
            options.steps,
            options.rest,
            rng,
            comparing=options.compare,
            straight=options.straight,
            holding=options.hold,
        )
        stems = [
            Path(shape.spec.partition("#")[0]).stem for shape in (session.pair.source, session.pair.target)
        ]
        name = f"{' -> '.join(stems)} {'' if number % 2 else '(silhouettes)'}"
        print(f"{found.row(name)}  {time.process_time() - begun:5.0f} s", flush=True)
        every.add(found)
    print(every.row("all"))


if __name__ == "__main__":
    main()
