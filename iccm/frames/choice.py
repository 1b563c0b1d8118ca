"""The pair of frames, and the way to map them, that cost the least for two drawings.

Coarse maps of discs take a tenth of a second, so candidates are compared by them (`drawings.cost`):

- frames of several degrees on both sides, by two descents: from both hulls a side is opened, and from the tightest pair
  a side is closed further, as long as that lowers the cost;
- the tightest frames with the target's concavities filled by triangles that weigh little (fit `cover`): the map decides
  itself how far each one closes;
- for drawings of one part with as many holes each, the outlines with holes onto holes;
- parts paired one to one, where both drawings have as many of them.

Only the cheapest candidate is solved for on a fine mesh.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal

import numpy as np
import shapely

from ..arrays import Complex, Index
from ..balanced.coarse import CoarseMap, coarse_filled, coarse_holed, coarse_map
from ..balanced.holes.given import Holes
from ..balanced.model.measures import stretch_quantile
from ..balanced.model.mesh_map import MeshMap
from ..balanced.model.settings import Settings
from ..balanced.search.candidates import HOPELESS
from ..drawings.cost import LOST, price
from ..drawings.drawing import Drawing
from ..drawings.frame import Frame
from ..drawings.pairing import pair_by_place
from ..drawings.seen import NOTHING_SEEN, Seen, seen
from ..plane import triangle_areas

Way = Literal["whole", "cover", "contain"]

GOOD_STRETCH = 2.2
"""Stretch on 95 % of the area up to which the map of whole outlines is taken without looking further,"""
GOOD_LOST = 0.02
"""and the share of both drawings that such a map may lose."""
GOOD_COST = 1.5
"""and its cost: maps whose stretch is small on 95 % may still stretch the rest into stripes, which the mean energy
sees.
"""
CRACK_WIDTH = 3 / 512
"""Relative to the target's size: a slit narrower than that is seen as a crack of that width."""
MOST_MATCHED_HOLES = 3
"""Drawings with more holes are mapped with their holes filled: each one needs a separate boundary."""
MOST_PAIRED_PARTS = 8
"""Drawings with more parts are mapped joined: each pair of parts needs a separate map."""
GIVEN_UP = 4 / 3
"""Times the least cost found: a descent that stands higher is given up. Of 36 pairs of drawings with many parts or long
outlines, no descent came from there to the cheapest frames, and half of the time for comparing frames is saved."""
CLOSED_GAIN = 0.95
"""Times the cost with the source's tightest frame: one that shows more gaps of the source must cost less, since the
eye sees a bite in an outline before the mean over the area does."""
PAIRED_GAIN = 0.95
"""Times the cost of the best joined map: pairing parts must cost less, since it moves them against each other."""


@dataclass(frozen=True, eq=False)
class Choice:
    """How two drawings are mapped.

    Attributes:
        frames: the frames of source and target.
        way: whether their outlines go onto each other (whole), or concavities of one are filled (cover, contain).
        holed: whether holes of drawings of one part go onto holes.
        cost: by a coarse map.
        seen: what that shows.
        pairs: parts of source and target that are mapped one to one; empty where the drawings are mapped as wholes.
    """

    frames: tuple[Frame, Frame]
    way: Way = "whole"
    holed: bool = False
    cost: float = np.inf
    seen: Seen = NOTHING_SEEN
    pairs: Sequence[tuple[Drawing, Drawing]] = field(default_factory=list)


def choices(
    source: Drawing,
    target: Drawing,
    settings: Settings,
    *,
    free_gaps: bool = False,
    pair_parts: bool = False,
    framed: bool = False,
) -> list[Choice]:
    """Return ways to map a drawing onto another, the cheapest first, judged by coarse maps.

    Parameters
    ----------
    source, target
        The drawings.
    settings
        What is asked of the map.
    free_gaps
        Whether gaps of the source may be shown at no cost, as with a checkerboard.
    pair_parts
        Whether parts may be mapped one to one.
    framed
        Whether only frames are considered, and of these only the ones around all of a drawing.
    """
    drawings = source, target, settings, free_gaps, framed
    paired = _paired(source, target, settings, free_gaps=free_gaps) if pair_parts else None
    if paired is not None and _search(*drawings).starts_above(GIVEN_UP * paired.cost):
        return [paired]
    found = list(_joined(*drawings))
    if paired is not None and paired.cost < PAIRED_GAIN * found[0].cost:
        return [paired, *found]
    return found


@lru_cache(maxsize=1)
def _search(
    source: Drawing, target: Drawing, settings: Settings, free_gaps: bool, framed: bool
) -> "_FrameSearch":
    """Return the search for frames of two drawings, which keeps what it has compared."""
    return _FrameSearch(_Judge(source, target, settings, free_gaps=free_gaps), around_all=framed)


# Whether parts are paired is asked before any map is solved for, which asks again for the same drawings.
@lru_cache(maxsize=1 + MOST_PAIRED_PARTS)
def _joined(
    source: Drawing, target: Drawing, settings: Settings, free_gaps: bool, framed: bool
) -> tuple[Choice, ...]:
    """Return ways to map a drawing onto another as one thing, the cheapest first."""
    search = _search(source, target, settings, free_gaps, framed)
    judge = search.judge
    tightest = source.tightest, target.tightest
    first = search.attempt((0, 0))
    found = [] if first is None else [first]
    if first is not None and judge.is_good(first):
        return (first,)
    if not framed:
        outlines = tightest[0].outline, tightest[1].outline
        covers = coarse_filled(*outlines, replace(settings, fit="cover"))
        found += [judge.choice(tightest, "cover", coarse) for coarse in covers]
        holes = Holes(tuple(source.mappable_holes), tuple(target.mappable_holes))
        if 0 < len(holes.source) == len(holes.target) <= MOST_MATCHED_HOLES:
            holed = coarse_holed(*outlines, holes, settings)
            if holed is not None:
                found.append(judge.choice(tightest, "whole", holed, holed=True))
    found += search.descents()
    found.sort(key=lambda choice: choice.cost)
    least_closed = [choice for choice in found if choice.frames[0].radius <= tightest[0].radius]
    if least_closed and not free_gaps and found[0].cost > CLOSED_GAIN * least_closed[0].cost:
        found.remove(least_closed[0])
        found.insert(0, least_closed[0])
    return tuple(found or [Choice(tightest)])


class _Judge:
    """Compares coarse maps of two drawings."""

    def __init__(self, source: Drawing, target: Drawing, settings: Settings, *, free_gaps: bool):
        self.source, self.target, self.settings, self.free_gaps = source, target, settings, free_gaps
        self._covering = source.hull_region if free_gaps else source.region
        self._good: set[Choice] = set()
        self.least_cost = np.inf

    def choice(
        self, frames: tuple[Frame, Frame], way: Way, coarse: CoarseMap, *, holed: bool = False
    ) -> Choice:
        """Return the choice that a coarse map stands for."""
        shown = self._seen(coarse)
        found = Choice(frames, way, holed, shown.cost(coarse.turning), shown)
        self.least_cost = min(self.least_cost, found.cost)
        if (
            max(shown.hidden, shown.bare) <= GOOD_LOST
            and found.cost <= GOOD_COST
            and stretch_quantile(*_of_area_one(coarse.map), 0.95) <= GOOD_STRETCH
        ):
            self._good.add(found)
        return found

    def is_good(self, choice: Choice) -> bool:
        """Return whether a map of the whole outlines of both only parts does, without looking further."""
        return choice in self._good and all(frame.radius == 0 for frame in choice.frames)

    def _seen(self, coarse: CoarseMap) -> Seen:
        """Return what a coarse map shows; where filled gaps of the source collapse, slits count as wide as an eye sees
        them."""
        source, target = self.source.region, self.target.region
        shown = seen(
            coarse.map.z,
            coarse.map.u,
            coarse.map.faces[~coarse.voids],
            source,
            target,
            covering=self._covering,
            theta=self.settings.theta,
        )
        if not coarse.voids.any():
            return shown
        corners = coarse.map.u[coarse.map.faces[coarse.voids]]
        triangles = shapely.polygons(np.stack([corners.real, corners.imag], axis=-1))
        slits = shapely.union_all(shapely.make_valid(triangles))
        # both sides of a slit are its boundary
        length = shapely.length(shapely.intersection(slits.boundary, self.target.painted)) / 2
        width = CRACK_WIDTH * np.sqrt(shapely.convex_hull(self.target.painted).area)
        return shown._replace(bare=min(1.0, shown.bare + length * width / target.area))


class _FrameSearch:
    """Looks for the pair of frames, given by their numbers, that costs the least.

    Parameters
    ----------
    judge
        Compares maps.
    around_all
        Whether frames that leave parts of a drawing out are ignored.
    """

    def __init__(self, judge: _Judge, *, around_all: bool):
        self.judge = judge
        source, target = (
            [frame for frame in drawing.frames if frame.left_out == 0 or not around_all]
            for drawing in (judge.source, judge.target)
        )
        self._sides = source, target
        self._hulls = len(source) - 1, len(target) - 1
        self._compared: dict[tuple[int, int], Choice | None] = {}

    def attempt(self, pair: tuple[int, int]) -> Choice | None:
        """Return the choice that a pair of frames is; None where no map is found, or its energy is hopeless."""
        if pair not in self._compared:
            frames = self._sides[0][pair[0]], self._sides[1][pair[1]]
            most = HOPELESS * min(self.judge.least_cost, LOST)
            coarse = coarse_map(frames[0].outline, frames[1].outline, self.judge.settings, most=most)
            self._compared[pair] = None if coarse is None else self.judge.choice(frames, "whole", coarse)
        return self._compared[pair]

    def starts_above(self, cost: float) -> bool:
        """Return whether both pairs of frames that descents start from cost more: neither is worth descending from."""
        return all(self._cost(self.attempt(pair)) > cost for pair in ((0, 0), self._hulls))

    def descents(self) -> Iterator[Choice]:
        """Yield the choices that two descents look at, each once, but for the tightest pair.

        One opens frames, from both hulls on, which are compared fastest; the other closes them further, from the
        tightest pair on. One alone often misses the best pair: closing a part of a gap may cost more than closing all
        of it.
        """
        last, passed = self._hulls, {(0, 0)}
        for start, step in ((last, -1), ((0, 0), 1)):
            best, at = start, None
            while best != at:
                at = best  # its own cost is compared, too, so that a descent ends where no neighbour is cheaper
                neighbours = [
                    (i, j)
                    for i, j in (at, (at[0], at[1] + step), (at[0] + step, at[1]))
                    if 0 <= i <= last[0] and 0 <= j <= last[1]
                ]
                for pair in neighbours:
                    if self._is_given_up(at):
                        break
                    found = self.attempt(pair)
                    if found is not None and pair not in passed:
                        yield found
                    passed.add(pair)
                best = min(neighbours, key=lambda pair: self._cost(self._compared.get(pair)))

    @staticmethod
    def _cost(choice: Choice | None) -> float:
        """Return the cost of what was compared; infinite where no map was found."""
        return np.inf if choice is None else choice.cost

    def _is_given_up(self, pair: tuple[int, int]) -> bool:
        """Return whether a pair of frames has a map that costs so much that its neighbours are not looked at."""
        cost = self._cost(self._compared.get(pair))
        return bool(GIVEN_UP * self.judge.least_cost < cost < np.inf)


def _of_area_one(map: MeshMap) -> tuple[Complex, Complex, Index]:
    """Return a map between regions of area one, which stretches are relative to."""
    z, u = (w / np.sqrt(np.abs(triangle_areas(w[map.faces])).sum()) for w in (map.z, map.u))
    return z, u, map.faces


def may_pair(source: Drawing, target: Drawing) -> bool:
    """Return whether each part of a drawing may have a separate partner."""
    return 2 <= len(source.parts) == len(target.parts) <= MOST_PAIRED_PARTS


def _paired(source: Drawing, target: Drawing, settings: Settings, *, free_gaps: bool) -> Choice | None:
    """Return the map of each part onto a separate part, by place and size; None where the parts do not match."""
    if not may_pair(source, target):
        return None
    parts = source.parts, target.parts
    pairs, energies, weights, shown, covered = [], [], [], 0.0, 0.0
    for i, j in pair_by_place(parts[0], parts[1]):
        pair = Drawing(parts[0][i]), Drawing(parts[1][j])
        best = choices(*pair, settings, free_gaps=free_gaps)[0]
        if not np.isfinite(best.cost):
            return None
        areas = pair[0].region.area / source.region.area, pair[1].region.area / target.region.area
        pairs.append(pair)
        energies.append(best.seen.energy)
        weights.append(0.5 * sum(areas))
        shown += areas[0] * (1 - best.seen.hidden)
        covered += areas[1] * (1 - best.seen.bare)
    whole = Seen(float(np.average(energies, weights=weights)), 1 - shown, 1 - covered)
    cost = price(whole.energy, (whole.hidden, whole.bare), 1.0)
    return Choice((source.tightest, target.tightest), cost=cost, seen=whole, pairs=pairs)
