"""Compose a picture: place it whole and upright in the target, with paper around it.

A drawing that is its own picture need not have its outline mapped onto the target's: the outline is its most telling
edge, and would become invisible there. Two further candidates are compared with the frames by the cost of the detail
that is seen (`drawings.cost`):

- An upright stretch of the plane places the drawing in the target. The source's frame is then the target's outline,
  pulled back by the stretch; what it contains besides the drawing is paper. No part of the picture is bent. The place,
  the size and the stretch minimise the cost.
- The drawing's bounding box with a margin is mapped onto the target, which bends the picture in long or bent targets.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely
import shapely.affinity
from scipy import optimize

from ..arrays import Complex, Index, complex_of, xy_of
from ..balanced.coarse import coarse_map
from ..curve import Curve, hausdorff, polygon_of
from ..drawings.cost import Cost
from ..drawings.detail import (
    COMPARED_POINTS,
    Detail,
    TargetView,
    cost_of_detail,
    covered_cost,
    energy_of_form,
    hidden_cost,
    off_centre_cost,
    paper_cost,
)
from ..drawings.drawing import Drawing
from ..drawings.frame import Frame
from ..drawings.placing import largest_copy
from ..drawings.region import PaintedRegion
from ..maps.triangulated.map import TriangulatedMap
from ..options import Options
from ..polygons import rings_of
from .choice import Choice
from .silhouettes import rooms, silhouettes

BOX_MARGIN_SHARE = 0.05
"""Margin around a drawing's box, relative to its longer side, that is mapped with it."""
MOST_STRETCH_RATIO = 4.0
"""Of width to height relative to the drawing: beyond it nobody recognises a subject."""
UPRIGHT_STRETCH_COST_RATIO = 1.02
"""Relative to the least cost: a placement in the target's middle, or without stretch, is preferred up to this."""
OUTLINE_POINTS = 400
"""Points of the target's outline at which a placement is examined for what it covers."""
FEW_STARTS = 4
"""Starts from which the search for a placement descends, the cheapest first."""
MOST_EVALUATIONS = 200
"""Of the cost in each of these descents; a hundred evaluations take ten milliseconds."""
COVERING_RATIO = 1.002
"""Of the picture's size to the target's, at least, if the picture has no margin: it then covers the target's rim."""
NEAREST_WEIGHT = 0.06
"""Share of the edges that count as hidden if the subject touches the rim at one place, which is seen at once."""
COPY_SHARE = 1e-3
"""Relative to the area: drawings that differ by less are the same picture, which then covers the target exactly."""
GOOD_PLACEMENT_COST = 1.12
"""A placement in the target itself is accepted without comparing its silhouettes if it costs at most this; that of a
picture without margin also without comparing other frames."""
SAME_OUTLINE_SHARE = 0.01
"""Hausdorff distance relative to the diagonal, up to which a map's outline is that of a silhouette."""
PLACED_COST = 2.2
"""A placement of a subject with paper around it is accepted without comparing other frames if it costs at most this: on
nine pairs of icons of which both were measured, each map that bends the subject cost at least twice as much."""

LEAST_SIZE_IN_ROOM_RATIO = 0.75
"""A subject is made smaller by up to a quarter if it then lies in a hole of the target as a whole."""
ROOM_MARGIN_SHARE = 0.04
"""Between a subject and the rim of such a room, relative to the room's size (square root of the area)."""


@dataclass(frozen=True)
class UprightPlacement:
    """An upright stretch of the plane that places a picture in the target.

    Attributes:
        centre: middle of the picture's box.
        image: its place in the target's plane.
        scale: factors of horizontal and of vertical lengths.
    """

    centre: complex
    image: complex
    scale: tuple[float, float]

    @property
    def stretch(self) -> float:
        """Ratio of horizontal to vertical scale."""
        return self.scale[0] / self.scale[1]

    def __call__(self, z: Complex) -> Complex:
        """Return the images of points."""
        moved = z - self.centre
        return self.image + self.scale[0] * moved.real + 1j * self.scale[1] * moved.imag

    def pull_back(self, w: Complex) -> Complex:
        """Return the points with images w."""
        moved = w - self.image
        return self.centre + moved.real / self.scale[0] + 1j * moved.imag / self.scale[1]


@dataclass(frozen=True)
class PlacedMap:
    """A map that was a placement until pins were dragged, with the interface of one.

    Attributes:
        map: the map; what it does not show has no image.
        centre: middle of the picture's box.
    """

    map: TriangulatedMap
    centre: complex
    stretch: float = 1.0

    @property
    def image(self) -> complex:
        """The place of the picture's middle in the target's plane."""
        return complex(self(np.array([self.centre]))[0])

    def __call__(self, z: Complex) -> Complex:
        """Return the images of points; of those that are not shown, the images of the nearest ones that are."""
        return self.map.extended_jet(z)[0]

    def pull_back(self, w: Complex) -> Complex:
        """Return the points with images w; of points that the map does not reach, those of the nearest ones."""
        return self.map.extended_inverse(w)[0]


Placement = UprightPlacement | PlacedMap


class _PlacementSearch:
    """Searches for the placement with the least cost.

    A placement is given by its image of the picture's centre, the logarithm of its mean scale, and, for a picture
    without margin, that of its stretch. A subject with paper around it keeps its proportions, which people know.

    Args:
        subject: the region of the source's plane that is not paper, see `subject_of`.
        detail: the edges of the picture.
        view: the region in which the picture is shown.
        outline: points of the outline by which the target is recognised, see `outline_points`.
    """

    def __init__(self, subject: PaintedRegion, detail: Detail, view: TargetView, outline: Complex):
        self._subject, self.detail, self.view, self._outline = subject, detail, view, outline
        low, high = detail.box
        self._centre, self._extent = (low + high) / 2, high - low
        self._points, _, weights = detail.compared
        self._weights = weights / weights.sum()
        self._hull = complex_of(shapely.get_coordinates(shapely.convex_hull(subject.painted))[:-1])
        self._shadow = PaintedRegion(shapely.convex_hull(shapely.MultiPoint(xy_of(self._points))))
        self._targets = view.spread(COMPARED_POINTS)

    def placement(self, values: Sequence[float]) -> UprightPlacement:
        """Return the placement for three or four numbers."""
        x, y, scale, *rest = values
        stretch = rest[0] if rest else 0.0
        image, across, up = (
            complex(x, y),
            float(np.exp(scale + stretch / 2)),
            float(np.exp(scale - stretch / 2)),
        )
        if self.detail.is_full and self.detail.fills_box:  # so it can cover the target, and has to
            low, high = self.view.box
            across = max(across, COVERING_RATIO * (high - low).real / self._extent.real)
            up = max(up, COVERING_RATIO * (high - low).imag / self._extent.imag)
            half = complex(across * self._extent.real, up * self._extent.imag) / 2
            image = complex(
                np.clip(x, high.real - half.real, low.real + half.real),
                np.clip(y, high.imag - half.imag, low.imag + half.imag),
            )
        return UprightPlacement(self._centre, image, (across, up))

    def cost(self, placement: Placement) -> Cost:
        """Return the cost of a placement, or of a map that was one until pins were dragged."""
        shown = self.view.seen(placement(self._points))
        seen = shown @ self._weights - (NEAREST_WEIGHT * (1 - shown.min()) if self.detail.has_paper else 0.0)
        hidden = self.detail.hidden_cost(1 - float(seen))
        if self.detail.has_paper:
            covered = float(self._shadow.contains(placement.pull_back(self._outline)).mean())
            bare = (
                paper_cost(self._paper_share(placement))
                + off_centre_cost(abs(placement.image - self.view.centroid) / self.view.size)
                + covered_cost(covered)
            )
            return Cost(1.0, hidden, bare)
        stretch = placement.stretch
        empty = 1 - float(self._subject.contains(placement.pull_back(self._targets)).mean())
        # a part without picture is a loss
        return Cost(
            energy_of_form(0.5 * (stretch + 1 / stretch), self.detail.energy_weight(has_margin=False)),
            hidden,
            hidden_cost(empty),
        )

    def _paper_share(self, placement: Placement) -> float:
        """Return the share of the target that the subject's hull leaves empty: exactly, so that places compare well."""
        hull, painted = polygon_of(placement(self._hull)), self.view.painted
        covered = hull if painted.contains(hull) else shapely.intersection(hull, painted)
        return 1 - float(covered.area / painted.area)

    def best(self) -> UprightPlacement:
        """Return the cheapest placement."""
        bound = np.log(MOST_STRETCH_RATIO)

        def total(values: Sequence[float]) -> float:
            beyond = max(0.0, abs(values[3]) - bound) if len(values) > 3 else 0.0
            return self.cost(self.placement(values)).total + beyond

        count = 3 if self.detail.has_paper else 4
        starts = sorted((start[:count] for start in self._starts()), key=total)[:FEW_STARTS]
        step = 0.08 * self.view.size
        ends = []
        for start in starts:
            moves = np.diag([step, step, 0.15, 0.25][:count])
            simplex = np.array(start) + np.vstack([np.zeros(count), moves])
            tuned = {"initial_simplex": simplex, "maxfev": MOST_EVALUATIONS, "xatol": 1e-3, "fatol": 1e-4}
            ends.append(optimize.minimize(total, start, method="Nelder-Mead", options=tuned))
        values = min(ends, key=lambda end: end.fun).x
        most = UPRIGHT_STRETCH_COST_RATIO * total(values)
        middle = (self.view.box[0] + self.view.box[1]) / 2
        for index, plain in ((0, middle.real), (1, middle.imag), (3, 0.0))[: count - 1]:
            simpler = values.copy()
            simpler[index] = plain
            if total(simpler) <= most:
                values = simpler
        return self.placement(values)

    def _starts(self) -> Iterator[tuple[float, float, float, float]]:
        """Yield placements of several sizes in the middle of the target, at its centroid and in its widest place."""
        low, high = self.view.box
        room = high - low
        fitting = min(room.real / self._extent.real, room.imag / self._extent.imag)
        filling = np.sqrt(room.real * room.imag / (self._extent.real * self._extent.imag))
        stretch = np.log(room.real / self._extent.real * self._extent.imag / room.imag)
        stretch = float(np.clip(stretch, -np.log(MOST_STRETCH_RATIO), np.log(MOST_STRETCH_RATIO)))
        for place in dict.fromkeys(((low + high) / 2, self.view.centroid, self.view.widest)):
            for size, part in (
                (0.9 * fitting, 0),
                (0.6 * fitting, 0),
                (0.9 * filling, 1),
                (0.8 * filling, 0.5),
            ):
                yield place.real, place.imag, float(np.log(size)), part * stretch
            if place == self.view.widest:
                yield (
                    place.real,
                    place.imag,
                    float(np.log(self.view.distances.max() * 2 / abs(self._extent))),
                    0,
                )
            if self.detail.is_full:
                yield place.real, place.imag, float(np.log(1.02 * filling)), stretch
            for face_low, face_high in self.detail.faces:
                for size in (filling, 1.5 * filling):  # with the face in this place
                    image = place - size * ((face_low + face_high) / 2 - self._centre)
                    yield image.real, image.imag, float(np.log(size)), 0.0


def compose(
    source: Drawing,
    target: Drawing,
    detail: Detail,
    options: Options,
    choices: Callable[[], Sequence[Choice]],
) -> list[Choice]:
    """Return ways to map a picture onto a target, sorted by the cost of the detail that is seen.

    Parameters
    ----------
    source, target
        The drawings.
    detail
        The edges of the picture.
    options
        Options of the solver.
    choices
        Returns the ways to map the drawings without regard to what the picture shows, best first.
    """
    if is_copy(source, target):
        return list(choices())
    composer = Composer(source, target, detail, options)
    placed = composer.placed()
    if placed is None:
        return list(choices())
    accepted = PLACED_COST if detail.has_paper else GOOD_PLACEMENT_COST
    if detail.weight == 1 and composer.cost(placed).total <= accepted:
        return [placed]
    candidates = [placed, composer.box(), *choices()]

    def cost(choice: Choice) -> float:
        of_detail = composer.cost(choice).total
        return (
            detail.weight * of_detail + (1 - detail.weight) * choice.cost.total
            if detail.weight < 1
            else of_detail
        )

    return sorted((choice for choice in candidates if choice is not None), key=cost)


def is_copy(source: Drawing, target: Drawing) -> bool:
    """Return whether a drawing is the other one moved and scaled, so that it need not be composed.

    Examples
    --------
    >>> small, large = Drawing(shapely.box(0, 0, 2, 1)), Drawing(shapely.box(5, 5, 9, 7))
    >>> is_copy(small, large), is_copy(small, Drawing(shapely.box(0, 0, 1, 2)))
    (True, False)
    """
    (left, low, right, high), box = source.painted.bounds, target.painted.bounds
    scale = (box[2] - box[0]) / (right - left)
    if abs(scale * (high - low) / (box[3] - box[1]) - 1) > COPY_SHARE:
        return False
    if abs(scale**2 * source.painted.area / target.painted.area - 1) > COPY_SHARE:
        return False
    moved = [scale, 0, 0, scale, box[0] - scale * left, box[1] - scale * low]
    copy = shapely.affinity.affine_transform(source.painted, moved)
    return bool(shapely.symmetric_difference(copy, target.painted).area < COPY_SHARE * target.painted.area)


class _Placed(NamedTuple):
    """A placement of the picture.

    Attributes:
        drawing: what is shown of the target, see `silhouettes`.
        filling_cost: what filling it costs.
        search: the search for places in it.
        placement: the place.
    """

    drawing: Drawing
    filling_cost: float
    search: _PlacementSearch
    placement: UprightPlacement

    @property
    def cost(self) -> Cost:
        """The cost of what is seen of the picture, and of filling the target."""
        cost = self.search.cost(self.placement)
        return cost._replace(bare=min(1.0, cost.bare + self.filling_cost))


class Composer:
    """Compares ways to compose a picture.

    Parameters
    ----------
    source, target
        The drawings.
    detail
        The edges of the picture.
    options
        Options of the solver.
    """

    def __init__(self, source: Drawing, target: Drawing, detail: Detail, options: Options):
        self.source, self.target, self.detail, self.options = source, target, detail, options

    @cached_property
    def view(self) -> TargetView:
        """The target, prepared for queries what of it is seen."""
        return TargetView.of(self.target.painted)

    @cached_property
    def _outline(self) -> Complex:
        return outline_points(self.target.painted)

    @cached_property
    def _subject(self) -> PaintedRegion:
        return subject_of(self.source, self.detail)

    def shown(self, map: TriangulatedMap) -> Drawing | None:
        """Return what pictures show of the target if a map that was composed stays as it is, if that is more than the
        target paints.

        Of the silhouettes whose outline is the map's, it is the one that costs least, as when the map was composed.
        """
        if self.detail.is_empty:
            return None
        low, high = self.detail.box
        placement, outline = PlacedMap(map, (low + high) / 2), Curve(map.image[map.loops[0]])
        best, least_total = self.target, np.inf
        for drawing, filling_cost, search in self._searches():
            if hausdorff(drawing.tightest.outline, outline) > SAME_OUTLINE_SHARE * outline.diagonal:
                continue
            cost = search.cost(placement)
            total = cost._replace(bare=min(1.0, cost.bare + filling_cost)).total
            if total < least_total:
                best, least_total = drawing, total
            if self.detail.keeps_form or total <= GOOD_PLACEMENT_COST:
                break
        return None if best is self.target else best

    def _searches(self) -> Iterator[tuple[Drawing, float, _PlacementSearch]]:
        """Yield the regions in which the picture may be shown, what filling them costs, and the search for a place."""
        for drawing, filling_cost in silhouettes(
            self.target, is_full=self.detail.is_full, canvas=self.detail.canvas
        ):
            view = self.view if drawing is self.target else TargetView.of(drawing.painted)
            yield drawing, filling_cost, _PlacementSearch(self._subject, self.detail, view, self._outline)

    def placed(self) -> Choice | None:
        """Return the choice that places the picture upright in the target, or in its silhouette if that costs less."""
        if self.detail.is_empty:
            return None
        best: _Placed | None = None
        for drawing, filling_cost, search in self._searches():
            placed = _Placed(drawing, filling_cost, search, search.best())
            if best is None or placed.cost.total < best.cost.total:
                best = placed
            if self.detail.keeps_form or placed.cost.total <= GOOD_PLACEMENT_COST:
                break
        if best is None:
            return None
        if self.detail.has_paper:
            best = self._in_a_room(best)
        drawing, placement, cost = best.drawing, best.placement, best.cost
        frame = Frame(Curve(placement.pull_back(drawing.tightest.outline.z)), np.inf)
        return Choice(
            (frame, drawing.tightest),
            cost=cost._replace(hidden=min(1.0, cost.hidden), bare=0.0),
            stretch=placement.stretch,
            composed=cost,
            shown=None if drawing is self.target else drawing,
        )

    def _in_a_room(self, placed: _Placed) -> _Placed:
        """Return a placement in a room of the target if the subject is nearly as large there, or else the given one.

        A subject that crosses the rim of a frame looks as if it had slipped.
        """
        subject = shapely.convex_hull(self.source.painted)
        size = placed.placement.scale[0]
        copy = polygon_of(placed.placement(complex_of(shapely.get_coordinates(subject)[:-1])))
        for room in rooms(self.target, within=placed.drawing):
            inner = shapely.buffer(room, -ROOM_MARGIN_SHARE * float(np.sqrt(room.area)))
            if shapely.contains(inner, copy):
                return placed
            if inner.area < LEAST_SIZE_IN_ROOM_RATIO**2 * copy.area:
                continue
            copied = largest_copy(subject, inner)
            if copied is None or abs(copied.factor) < LEAST_SIZE_IN_ROOM_RATIO * size:
                continue
            centre = placed.placement.centre
            image = complex(copied(np.array([centre]))[0])
            size = min(abs(copied.factor), size)
            in_room = placed._replace(placement=UprightPlacement(centre, image, (size, size)))
            if in_room.cost.total <= PLACED_COST:
                return in_room
        return placed

    def box(self) -> Choice | None:
        """Return the choice that maps the picture's box, with a margin, onto the target's tightest frame."""
        frame = box_frame(self.source, self.detail)
        coarse = coarse_map(frame.outline, self.target.tightest.outline, self.options)
        if coarse is None:
            return None
        choice = Choice((frame, self.target.tightest), coarse=coarse)
        cost = self.cost(choice)
        return replace(choice, cost=cost._replace(hidden=min(1.0, cost.hidden), bare=0.0), composed=cost)

    def cost(self, choice: Choice) -> Cost:
        """Return the cost of what is seen of the picture's detail in the coarse map of a choice."""
        if choice.composed is not None:
            return choice.composed
        if choice.coarse is None:
            return choice.cost
        map, voids = choice.coarse.map, choice.coarse.voids
        triangles = map.z, map.u, map.faces[~voids]
        return seen_cost(triangles, self.detail, self.view, self._subject, self.options.balance)


def seen_cost(
    triangles: tuple[Complex, Complex, Index],
    detail: Detail,
    view: TargetView,
    subject: PaintedRegion,
    balance: float,
) -> Cost:
    """Return the cost of what a map shows of a picture's detail, where paper is seen if the picture has any.

    Parameters
    ----------
    triangles
        (n,) vertices, (n,) their images, and (m, 3) triangles.
    detail, view, subject, balance
        See `cost_of_detail`.
    """
    paper = paper_cost if detail.has_paper else None
    return cost_of_detail(*triangles, detail, view, subject=subject, paper=paper, balance=balance)


def subject_of(source: Drawing, detail: Detail) -> PaintedRegion:
    """Return the region of the source's plane that is not paper: the subject, or all of a picture without margin."""
    return detail.subject(source.painted) if detail.has_paper else source.region


def box_frame(source: Drawing, detail: Detail | None = None) -> Frame:
    """Return the bounding box of a drawing as a frame, with a margin unless its picture fills the box."""
    left, low, right, high = source.painted.bounds
    margin = 0.0 if detail is None or detail.is_full else BOX_MARGIN_SHARE * max(right - left, high - low)
    corners = shapely.get_coordinates(shapely.box(left - margin, low - margin, right + margin, high + margin))
    return Frame(Curve.domain(corners[:-1] @ np.array([1, 1j])), np.inf)


def outline_points(painted: shapely.Geometry) -> Complex:
    """Return about OUTLINE_POINTS points (n,) that are evenly spaced on the boundary of a region.

    Examples
    --------
    >>> outline_points(shapely.box(0, 0, 1, 3))[:2].round(3).tolist()
    [(1+0j), (1+0.02j)]
    """
    spacing = painted.length / OUTLINE_POINTS
    points = []
    for ring in rings_of(painted):
        line = shapely.LinearRing(xy_of(ring))
        along = np.linspace(0, line.length, max(1, round(line.length / spacing)), endpoint=False)
        points.append(complex_of(shapely.get_coordinates(shapely.line_interpolate_point(line, along))))
    return np.concatenate(points)
