"""Choose the pair of frames, and the way to map them, with the least cost for two drawings.

Candidates are compared by coarse maps of disks, which take a tenth of a second each (`drawings.cost`):

- Frames with gaps closed to several degrees on both sides. Two descents search them: one starts from both hulls and
  opens gaps, the other from the tightest pair and closes gaps, as long as the cost decreases.
- The tightest frames, with the target's concavities filled by triangles of low weight (fit `cover`). Then the map
  itself determines how far each concavity closes.
- For drawings of one part with the same number of holes, the outlines, with holes mapped to holes.
- For drawings with the same number of parts, pairs of parts.

`choose` returns them with their frames, coarse maps and costs. The first is refined, from its coarse map; the next ones
only where that fails.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from ..arrays import Complex, Index
from ..balanced.coarse import CoarseMap, coarse_filled, coarse_map
from ..balanced.model.energy import Energy
from ..balanced.model.measures import stretch_quantile
from ..balanced.model.mesh_map import MeshMap
from ..balanced.search.candidates import HOPELESS
from ..curve import Curve, hausdorff
from ..drawings.cost import LOST_POINT_ENERGY, NO_MAP, Cost, cost_of
from ..drawings.drawing import Drawing
from ..drawings.frame import Frame
from ..drawings.pairing import pair_by_place
from ..drawings.region import PaintedRegion
from ..options import Options
from ..plane import triangle_areas
from ..problem import Holes

GOOD_STRETCH_P95 = 2.2
"""A map of whole outlines is accepted without further search if its stretch on 95 % of the area is at most this."""
GOOD_LOST_SHARE = 0.02
"""It must also hide or leave bare at most this share of either drawing."""
GOOD_OUTLINES_COST = 1.5
"""And it must cost at most this: where stretch is small on 95 %, the rest may still be stretched into stripes, which
shows in the mean energy.
"""
CRACK_WIDTH_SHARE = 3 / 512
"""Relative to the target's size: narrower slits count as cracks of this width."""
MOST_MATCHED_HOLES = 3
"""Drawings with more holes are mapped with their holes filled, since each hole needs a separate boundary."""
MOST_PAIRED_PARTS = 8
"""Drawings with more parts are mapped as wholes, since each pair of parts needs a separate map."""
GIVEN_UP_COST_RATIO = 4 / 3
"""Relative to the cost of pairs of parts: if both starts of the descents cost more, wholes are not considered."""
ABANDONED_COST_RATIO = 1.1
"""Relative to the least cost found, which filled concavities often have: a descent at a higher cost is abandoned. On
325 pairs of outlines and of drawings of one or more parts, no such descent reached the cheapest frames."""
CLOSED_COST_RATIO = 0.95
"""Relative to the cost with the source's tightest frame: a frame that shows more gaps of the source, or a map that
leaves out pieces of the outlines, must cost less than this, since missing pieces of an outline are more conspicuous
than the mean over the area suggests."""
SAME_FORM_SHARE = 0.03
"""Relative to the diagonal: outlines closer than this, once they have the same proportions, differ in these alone."""
STRAIGHT_COST_RATIO = 1.25
"""Relative to the least cost: a stretch, which keeps all straight lines straight, is preferred up to this. Rectangles
are stretched up to four times; beyond that they are bent, which distorts less."""
PAIRED_COST_RATIO = 0.95
"""Relative to the cost of the best map of wholes: pairing parts must cost less than this, since it moves parts relative
to each other."""


@dataclass(frozen=True, eq=False)
class Choice:
    """One way to map two drawings: frames, a coarse map of them, and its cost.

    Attributes:
        frames: the frames of source and target.
        fit: "whole" maps the frames' outlines onto each other; "cover" and "contain" fill concavities of one of them.
        holed: whether drawings of one part are mapped with their holes.
        cost: of the coarse map, see `drawings.cost`.
        coarse: the coarse map, which a solve refines; None if there is none, or parts are mapped separately.
        pairs: parts of source and target that are mapped one-to-one; empty where the drawings are mapped as wholes.
        stretch: ratio of the source's width to its height by which it is stretched before it is mapped.
        composed: the cost of what is seen of the picture's detail, for a choice that composes it.
        shown: what pictures show of the target, if that is more than it paints; see `frames.silhouettes`.
    """

    frames: tuple[Frame, Frame]
    fit: str = "whole"
    holed: bool = False
    cost: Cost = NO_MAP
    coarse: CoarseMap | None = None
    pairs: Sequence["PairOfParts"] = field(default_factory=list)
    stretch: float = 1.0
    composed: Cost | None = None
    shown: Drawing | None = None


@dataclass(frozen=True, eq=False)
class PairOfParts:
    """Two parts that are mapped onto each other.

    Attributes:
        source: the part of the source, as a drawing.
        target: that of the target.
        choices: ways to map them, best first.
    """

    source: Drawing
    target: Drawing
    choices: Sequence[Choice]


def choose(
    source: Drawing,
    target: Drawing,
    options: Options,
    *,
    free_gaps: bool = False,
    pair_parts: bool = False,
    framed: bool = False,
) -> list[Choice]:
    """Return ways to map a drawing onto another, sorted by the cost of their coarse maps.

    Pairs of parts and frames with closed gaps come first only if they cost clearly less than what they replace.

    Parameters
    ----------
    source, target
        The drawings.
    options
        Options of the solver.
    free_gaps
        Whether gaps of the source may be shown at no cost, as with a checkerboard.
    pair_parts
        Whether parts may be mapped one-to-one.
    framed
        Whether to consider only frames, and of these only the ones that contain all of a drawing.
    """
    search = _FrameSearch(_Judge(source, target, options, free_gaps=free_gaps), around_all=framed)
    paired = _paired(source, target, options, free_gaps=free_gaps) if pair_parts else None
    if paired is not None and search.starts_above(GIVEN_UP_COST_RATIO * paired.cost.total):
        return [paired]
    wholes = _of_wholes(search, framed=framed)
    if paired is not None and paired.cost.total < PAIRED_COST_RATIO * wholes[0].cost.total:
        return [paired, *wholes]
    return wholes


def _of_wholes(search: "_FrameSearch", *, framed: bool) -> list[Choice]:
    """Return ways to map a drawing onto another as a whole, the cheapest first."""
    judge = search.judge
    tightest = judge.source.tightest, judge.target.tightest
    straight = judge.stretch(tightest)
    if straight is not None and straight.cost.total <= STRAIGHT_COST_RATIO:
        return [straight]  # no map costs less than 1
    first = search.attempt((0, 0))
    candidates = [] if first is None else [first]
    if first is not None and judge.is_good(first):
        return _with_straight(straight, [first])
    if not framed:
        outlines = tightest[0].outline, tightest[1].outline
        covers = coarse_filled(*outlines, replace(judge.options, fit="cover"))
        candidates += [judge.choice(tightest, "cover", coarse) for coarse in covers]
        holes = Holes(tuple(judge.source.mappable_holes), tuple(judge.target.mappable_holes))
        if 0 < len(holes.source) == len(holes.target) <= MOST_MATCHED_HOLES:
            holed = coarse_map(*outlines, judge.options, holes=holes)
            if holed is not None:
                candidates.append(judge.choice(tightest, "whole", holed, holed=True))
    candidates += search.descents()
    candidates.sort(key=lambda choice: choice.cost.total)
    least_closed = [
        choice
        for choice in candidates
        if choice.fit == "whole" and choice.frames[0].radius <= tightest[0].radius
    ]
    if (
        least_closed
        and not judge.free_gaps
        and candidates[0].cost.total > CLOSED_COST_RATIO * least_closed[0].cost.total
    ):
        candidates.remove(least_closed[0])
        candidates.insert(0, least_closed[0])
    return _with_straight(straight, candidates) or [Choice(tightest)]


def _with_straight(straight: Choice | None, candidates: list[Choice]) -> list[Choice]:
    """Return candidates, the best first, with a stretch, which comes first if it costs little more than the best."""
    if straight is None:
        return candidates
    least = min((choice.cost.total for choice in candidates), default=np.inf)
    if straight.cost.total <= STRAIGHT_COST_RATIO * least:
        return [straight, *candidates]
    return [*candidates, straight]


def textured_region(source: Drawing, *, free_gaps: bool) -> PaintedRegion:
    """Return the region of a drawing that may be shown without being counted as bare."""
    return source.hull_region if free_gaps else source.region


def map_cost(
    triangles: tuple[Complex, Complex, Index],
    regions: tuple[PaintedRegion, PaintedRegion],
    covering: PaintedRegion | None,
    energy: Energy,
    *,
    rotation: float = 1.0,
) -> Cost:
    """Return the cost of a piecewise linear map of two drawings in an energy, of which further terms count as well.

    Parameters
    ----------
    triangles
        (n,) vertices, their (n,) images, and the (m, 3) triangles, which fold neither in the source nor in the target.
    regions
        The painted regions of source and target.
    covering
        The region of the source's plane that the texture covers; None if it covers everything.
    energy
        Weights areas, and has the further terms.
    rotation
        The factor for rotating the picture.
    """
    cost = cost_of(*triangles, *regions, covering=covering, balance=energy.balance, rotation=rotation)
    return cost._replace(energy=cost.energy + energy.sum_of_terms(*triangles))


class _Judge:
    """Assesses coarse maps of two drawings."""

    def __init__(self, source: Drawing, target: Drawing, options: Options, *, free_gaps: bool):
        self.source, self.target, self.options, self.free_gaps = source, target, options, free_gaps
        self._covering = textured_region(source, free_gaps=free_gaps)
        self._good: set[Choice] = set()
        self._energy = Energy.of(options)
        self.least_cost = np.inf

    def choice(
        self, frames: tuple[Frame, Frame], fit: str, coarse: CoarseMap, *, holed: bool = False
    ) -> Choice:
        """Return the choice for a coarse map, with its cost and losses."""
        cost = self._cost(coarse)
        choice = Choice(frames, fit, holed, cost, coarse)
        self.least_cost = min(self.least_cost, cost.total)
        if (
            max(cost.hidden, cost.bare) <= GOOD_LOST_SHARE
            and cost.total <= GOOD_OUTLINES_COST
            and stretch_quantile(*_of_area_one(coarse.map), 0.95) <= GOOD_STRETCH_P95
        ):
            self._good.add(choice)
        return choice

    def stretch(self, frames: tuple[Frame, Frame]) -> Choice | None:
        """Return the choice that stretches a frame onto another one of the same form, but other proportions.

        None if the frames differ in more than their proportions.
        """
        options = self.options
        if options.balance != 1 or options.rotation != 0 or options.terms:
            return None  # something else than even scales is asked for
        ratio = stretch_between(frames)
        if ratio is None:
            return None
        coarse = coarse_map(frames[0].outline, frames[1].outline, options, stretch=ratio)
        return None if coarse is None else replace(self.choice(frames, "whole", coarse), stretch=ratio)

    def least_cost_of(self, frames: tuple[Frame, Frame]) -> float:
        """Return a cost below that of any map of two frames that scales areas evenly, without solving for one.

        Such a map shows at most the smaller of the painted shares of both frames, however little it distorts them.
        Maps of minimal energy cost more too: on 1,200 coarse maps of 325 pairs none cost less.
        """
        source, target = frames
        shares = self.source.region.area / source.outline.area, self.target.region.area / target.outline.area
        inside = [(1 - frame.left_out) * share for frame, share in zip(frames, shares)]
        hidden = 1 - min(inside) / shares[0]
        bare = target.left_out if self.free_gaps else 1 - min(inside) / shares[1]
        return Cost(1.0, max(0.0, hidden), max(0.0, bare)).total

    def is_good(self, choice: Choice) -> bool:
        """Return whether a choice is a good enough map of exact outlines, so that the search can stop."""
        return choice in self._good and all(frame.radius == 0 for frame in choice.frames)

    def _cost(self, coarse: CoarseMap) -> Cost:
        """Return the cost of a coarse map.

        Where filled gaps of the source collapse, the slits that remain count with the width at which they are seen.
        """
        regions = self.source.region, self.target.region
        triangles = coarse.map.z, coarse.map.u, coarse.map.faces[~coarse.voids]
        cost = map_cost(triangles, regions, self._covering, self._energy, rotation=coarse.rotation_cost)
        if not coarse.voids.any():
            return cost
        corners = coarse.map.u[coarse.map.faces[coarse.voids]]
        triangles = shapely.polygons(np.stack([corners.real, corners.imag], axis=-1))
        slits = shapely.union_all(shapely.make_valid(triangles))
        # both sides of a slit are its boundary
        length = shapely.length(shapely.intersection(slits.boundary, self.target.painted)) / 2
        width = CRACK_WIDTH_SHARE * np.sqrt(shapely.convex_hull(self.target.painted).area)
        return cost._replace(bare=min(1.0, cost.bare + length * width / self.target.region.area))


class _FrameSearch:
    """Searches for the cheapest pair of frames; pairs are given by the frames' indices.

    Parameters
    ----------
    judge
        Assesses maps.
    around_all
        Whether to ignore frames that leave out parts of a drawing.
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
        """Return the choice for a pair of frames; None where no map is found, or none that could be the cheapest."""
        if pair not in self._compared:
            frames = self._sides[0][pair[0]], self._sides[1][pair[1]]
            if self.judge.least_cost_of(frames) >= self.judge.least_cost / CLOSED_COST_RATIO:
                self._compared[pair] = None
                return None
            most = HOPELESS * min(self.judge.least_cost, LOST_POINT_ENERGY)
            coarse = coarse_map(frames[0].outline, frames[1].outline, self.judge.options, most=most)
            self._compared[pair] = None if coarse is None else self.judge.choice(frames, "whole", coarse)
        return self._compared[pair]

    def starts_above(self, cost: float) -> bool:
        """Return whether both pairs from which descents start cost more than `cost`, so that none is worthwhile."""
        return all(self._cost(self.attempt(pair)) > cost for pair in ((0, 0), self._hulls))

    def descents(self) -> Iterator[Choice]:
        """Yield the choices that two descents visit, each once, except the tightest pair.

        One descent starts from both hulls, which are the fastest to compare, and opens gaps. The other starts from the
        tightest pair and closes gaps. Either alone often misses the best pair, since closing part of a gap may cost
        more than closing all of it.
        """
        last, visited = self._hulls, {(0, 0)}
        for start, step in ((last, -1), ((0, 0), 1)):
            best, current = start, None
            while best != current:
                current = best  # compared with its neighbours, so that the descent ends at a local minimum
                neighbours = [
                    (i, j)
                    for i, j in (current, (current[0], current[1] + step), (current[0] + step, current[1]))
                    if 0 <= i <= last[0] and 0 <= j <= last[1]
                ]
                for pair in neighbours:
                    if self._is_given_up(current):
                        break
                    choice = self.attempt(pair)
                    if choice is not None and pair not in visited:
                        yield choice
                    visited.add(pair)
                best = min(neighbours, key=lambda pair: self._cost(self._compared.get(pair)))

    @staticmethod
    def _cost(choice: Choice | None) -> float:
        """Return the cost of a choice; infinite where no map was found."""
        return np.inf if choice is None else choice.cost.total

    def _is_given_up(self, pair: tuple[int, int]) -> bool:
        """Return whether a pair of frames costs so much that its neighbours are not visited."""
        cost = self._cost(self._compared.get(pair))
        return bool(ABANDONED_COST_RATIO * self.judge.least_cost < cost < np.inf)


def _of_area_one(map: MeshMap) -> tuple[Complex, Complex, Index]:
    """Return a map scaled so that its source and image have area one, as the energy expects."""
    z, u = (w / np.sqrt(np.abs(triangle_areas(w[map.faces])).sum()) for w in (map.z, map.u))
    return z, u, map.faces


def stretch_between(frames: tuple[Frame, Frame]) -> float | None:
    """Return the ratio by which the width of a frame is stretched, relative to its height, onto that of another one.

    None if the frames differ in more than their proportions, or not in these.
    """
    extents = [frame.outline.box[1] - frame.outline.box[0] for frame in frames]
    ratio = extents[1].real / extents[1].imag * extents[0].imag / extents[0].real
    if abs(ratio - 1) <= SAME_FORM_SHARE:
        return None
    source, target = (_in_unit_box(frame.outline) for frame in frames)
    return ratio if hausdorff(source, target) <= SAME_FORM_SHARE * target.diagonal else None


def _in_unit_box(outline: Curve) -> Curve:
    """Return an outline, stretched and moved so that its bounding box is the unit square."""
    low, high = outline.box
    moved = outline.z - low
    return Curve(moved.real / (high - low).real + 1j * moved.imag / (high - low).imag)


def may_pair(source: Drawing, target: Drawing) -> bool:
    """Return whether two drawings have equally many parts, and few enough to map them one-to-one."""
    return 2 <= len(source.parts) == len(target.parts) <= MOST_PAIRED_PARTS


def _paired(source: Drawing, target: Drawing, options: Options, *, free_gaps: bool) -> Choice | None:
    """Return the choice that maps parts one-to-one, paired by place and size; None where the parts do not match."""
    if not may_pair(source, target):
        return None
    parts = source.parts, target.parts
    pairs, energies, weights, shown_share, covered_share = list[PairOfParts](), [], [], 0.0, 0.0
    for i, j in pair_by_place(parts[0], parts[1]):
        part, image = Drawing(parts[0][i]), Drawing(parts[1][j])
        choices = choose(part, image, options, free_gaps=free_gaps)
        best = choices[0].cost
        if not np.isfinite(best.total):
            return None
        areas = part.region.area / source.region.area, image.region.area / target.region.area
        pairs.append(PairOfParts(part, image, choices))
        energies.append(best.energy)
        weights.append(0.5 * sum(areas))
        shown_share += areas[0] * (1 - best.hidden)
        covered_share += areas[1] * (1 - best.bare)
    cost = Cost(float(np.average(energies, weights=weights)), 1 - shown_share, 1 - covered_share)
    return Choice((source.tightest, target.tightest), cost=cost, pairs=pairs)
