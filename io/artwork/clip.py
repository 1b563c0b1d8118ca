"""Clip subpaths at a domain's boundary, closed so that fills stay the same inside.

A subpath that leaves the domain and returns must paint the same inside when it is cut. So each excursion is replaced by
an arc of the boundary between its ends that winds around the inside equally often. Then the winding number about every
point inside is unchanged, whatever the fill rule.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from ...arrays import Complex, complex_of, distinct, xy_of
from ...curve import Curve, corners_of, polygon_of
from ...plane import cross
from ..svg.curves import Bezier, Piece
from ..svg.path_data import PenPath

CORNER_RADIANS = 0.2  # an arc of the boundary is split at corners that turn by more
MOST_PIECE_VERTICES = 4096  # largest number of vertices of one segment's polyline
OFF_MIDDLE_RADIUS_SHARE = 0.217
"""Of the inscribed radius: an arbitrary number that drawings are unlikely to use."""
FLAT_LENGTH_SHARE = 1e-6  # of a subpath's length: one that stays closer to a line encloses nothing
TAIL_DISTANCES = 20  # times the distance that counts as inside: the longest line end that is trimmed there


@dataclass(frozen=True, eq=False)
class Span:
    """The part of a segment between two parameters, or of a closed curve between two arclengths.

    It is parametrized over [0, 1], and reversed if `stop` is less than `start`.

    Attributes:
        whole: the segment or curve.
        start, stop: parameters of the segment, from 0 to 1, or arclengths of the curve.
    """

    whole: Piece | Curve
    start: float
    stop: float

    def at(self, t: NDArray[np.float64]) -> Complex:
        """Return points at parameters in [0, 1]."""
        return self.whole.at(self.start + (self.stop - self.start) * t)


Part = Piece | Span


@dataclass(frozen=True, eq=False)
class Clipped:
    """The part of a shape that is inside a domain.

    Attributes:
        line: the subpaths inside, each with whether it is closed.
        cut: whether anything was cut off.
        fill: if anything was, closed subpaths that paint inside what the shape's fill paints.
        windings: for each subpath that never enters the domain, how often it winds around it.
        begins, ends: whether the shape's first and last point are inside.
    """

    line: list[tuple[list[Part], bool]]
    cut: bool = False
    fill: list[list[Part]] = field(default_factory=list)
    windings: list[int] = field(default_factory=list)
    begins: bool = True
    ends: bool = True


@dataclass(frozen=True, eq=False)
class _Stretch:
    """A part of a subpath as a polyline.

    Attributes:
        place: (p,) positions, each a segment's index plus the parameter on it; they continue past the end of a closed
            subpath.
        z: (p,) points.
        away: whether the part is outside.
    """

    place: NDArray[np.float64]
    z: Complex
    away: bool

    def between(self, start: float, stop: float, away: bool) -> "_Stretch":
        """Return the part between two positions."""
        inner = (self.place > start) & (self.place < stop)
        place = np.concatenate([[start], self.place[inner], [stop]])
        return _Stretch(place, _between(self.place, self.z, place), away)


class _Ring:
    """Closed polylines, indexed for intersection."""

    def __init__(self, *loops: Complex):
        self.a, self.b = np.concatenate(loops), np.concatenate([np.roll(z, -1) for z in loops])
        self.tree = shapely.STRtree(shapely.linestrings(xy_of(np.column_stack([self.a, self.b]))))

    def crossings(self, place: NDArray[np.float64], z: Complex) -> NDArray[np.float64]:
        """Return the positions at which a polyline with given positions crosses them, in order."""
        lines = shapely.linestrings(xy_of(np.column_stack([z[:-1], z[1:]])))
        segment, wall = self.tree.query(lines)
        p, d, e = z[segment], z[segment + 1] - z[segment], self.b[wall] - self.a[wall]
        area = cross(d, e)
        with np.errstate(divide="ignore", invalid="ignore"):
            along_line, along_wall = cross(self.a[wall] - p, e) / area, cross(self.a[wall] - p, d) / area
        crossed = (along_line >= 0) & (along_line <= 1) & (along_wall >= 0) & (along_wall <= 1)
        return distinct((place[segment] + along_line * (place[segment + 1] - place[segment]))[crossed])


class Domain:
    """A domain that clips subpaths at its boundary, in the same plane.

    Args:
        rim: the boundary, simple and counter-clockwise.
        margin: points up to this distance outside count as inside, since the boundary is flattened and the drawing is
            not.
        holes: boundaries of holes; holes narrower than `margin` are not shrunk by it.
    """

    def __init__(self, rim: Curve, margin: float, holes: Sequence[Curve] = ()):
        self.rim, self.margin = rim, margin
        self.holes = [(hole, _point_in(hole)) for hole in holes]
        self.polygon = polygon_of(rim.z, *(hole.z for hole in holes))
        deep = [_shrunk(polygon_of(hole.z), margin) for hole in holes]
        outer = shapely.Polygon(polygon_of(rim.z).buffer(margin).exterior)
        self.reach = shapely.Polygon(outer.exterior, [polygon.exterior for polygon in deep])
        shapely.prepare([self.polygon, self.reach])
        self.shore = _Ring(
            *(complex_of(shapely.get_coordinates(polygon.exterior)[:-1]) for polygon in (outer, *deep))
        )
        self.ring = _Ring(rim.z, *(hole.z for hole in holes))
        self.inner = complex(*shapely.maximum_inscribed_circle(self.polygon).coords[0])

    @cached_property
    def _corners(self) -> dict[Curve, NDArray[np.float64]]:
        return {
            curve: curve.knots[:-1][corners_of(curve, CORNER_RADIANS)]
            for curve in (self.rim, *(hole for hole, _ in self.holes))
        }

    def _hole_of(self, z: Complex) -> int | None:
        """Return the index of the hole that contains a polyline outside, or None."""
        middle = z[z.size // 2 : z.size // 2 + 1] if z.size > 2 else z.mean(keepdims=True)
        return next((k for k, (hole, _) in enumerate(self.holes) if hole.contains(middle)[0]), None)

    def clip(self, runs: Sequence[PenPath], *, seams: bool = False, filled: bool = True) -> Clipped:
        """Clip the subpaths of one shape; each has at least one segment.

        Args:
            runs: the subpaths.
            seams: whether lines must not continue across the start of a closed subpath.
            filled: whether the chords that close open subpaths belong to the shape.
        """
        # 1. Is anything cut? Not if no line leaves the domain, nor the chord that closes a filled line, and if no
        # subpath winds around a hole, which it would paint over.
        split = [self._stretches(run.pieces, run.closed and not seams) for run in runs]
        away = any(stretch.away for stretches in split for stretch in stretches)
        if filled and not away:
            chords = [_closed(run)[-1:] for run in runs if not (run.closed or is_flat(run.pieces))]
            away = any(stretch.away for chord in chords for stretch in self._stretches(chord, False))
        if not (away or (self.holes and any(self._laps(run) for run in runs))):
            return Clipped([(list(run.pieces), run.closed) for run in runs])
        ends = self._within(np.array([runs[0].start, runs[-1].pieces[-1].last()]))
        out = Clipped([], cut=True, begins=bool(ends[0]), ends=bool(ends[1]))
        laps = [0] * len(self.holes)  # how often all subpaths together wind around each hole
        for run, stretches in zip(runs, split):
            # 2. The line: its stretches inside, with their ends trimmed to the boundary itself.
            is_complete = len(stretches) == 1 and run.closed
            inner = [s if is_complete else self._landed(run.pieces, s) for s in stretches if not s.away]
            spans = [_spans(run.pieces, stretch) for stretch in inner]
            out.line.extend((parts, is_complete) for parts in spans if parts)
            if is_flat(run.pieces):
                continue
            # 3. The fill, of the closed subpath: stretches inside stay, those outside become arcs of the boundary. A
            # subpath that stays outside only matters by how often it winds around the domain.
            pieces = _closed(run)
            stretches = self._stretches(pieces, True)
            is_outside = stretches[0].away and len(stretches) == 1
            if is_outside and self._hole_of(stretches[0].z) is not None:
                continue  # it lies in a hole, and winds around no point of the domain
            laps = [a + b for a, b in zip(laps, self._windings(stretches))]
            if is_outside:
                out.windings.append(round(_angle(stretches[0].z - self.inner) / (2 * math.pi)))
            else:
                around = [self._detour(s) if s.away else _spans(pieces, s) for s in stretches]
                out.fill.append([part for parts in around for part in parts])
        # 4. Outlines of holes are clockwise: a hole's outline, run as often as the subpaths wind around the hole, makes
        # the winding number in the hole zero, so that nothing is painted there.
        for (hole, _), windings in zip(self.holes, laps):
            out.fill.extend([self._arcs(hole, 0.0, windings * hole.length)] if windings else [])
        return out

    def _laps(self, run: PenPath) -> bool:
        """Return whether a subpath winds around a hole."""
        place, z = _polyline(_closed(run), self.margin / 10)
        return any(self._windings([_Stretch(place, z, False)]))

    def _windings(self, stretches: Sequence[_Stretch]) -> list[int]:
        """Return how often a closed subpath winds around a point of each hole."""
        angles = [sum(_angle(stretch.z - point) for stretch in stretches) for _, point in self.holes]
        return [round(angle / (2 * math.pi)) for angle in angles]

    def around(self, windings: int) -> list[Part]:
        """Return the boundary `windings` times, clockwise if negative."""
        return self._arcs(self.rim, 0.0, windings * self.rim.length)

    def _within(self, z: Complex) -> NDArray[np.bool_]:
        return shapely.contains_xy(self.reach, z.real, z.imag)

    def _stretches(self, pieces: Sequence[Piece], closed: bool) -> list[_Stretch]:
        """Split a subpath into stretches alternately inside and outside; those of a closed one may cross its start."""
        place, z = _polyline(pieces, self.margin / 10)
        cuts = self.shore.crossings(place, z)
        complete = _Stretch(place, z, not self._within(z[:1])[0])
        if not cuts.size:
            return [complete]
        cuts = np.concatenate([place[:1], cuts, place[-1:]])
        away = ~self._within(_between(place, z, (cuts[:-1] + cuts[1:]) / 2))
        change = np.flatnonzero(np.diff(away)) + 1
        stretches = [
            complete.between(cuts[a], cuts[b], bool(away[a])) for a, b in pairwise([0, *change, len(away)])
        ]
        if closed and len(stretches) > 1 and stretches[0].away == stretches[-1].away:
            first, last = stretches[0], stretches.pop()
            place = np.concatenate([last.place, first.place[1:] + len(pieces)])
            stretches[0] = _Stretch(place, np.concatenate([last.z, first.z[1:]]), first.away)
        return stretches

    def _landed(self, pieces: Sequence[Piece], stretch: _Stretch) -> _Stretch:
        """Trim the ends of a stretch inside that lie beyond the boundary, though still near it."""
        cuts = self.ring.crossings(stretch.place, stretch.z)
        if not cuts.size:
            return stretch
        # Each end moves to the first or last crossing of the boundary, if that is near. Rounding may leave the crossing
        # itself outside, so points a little further inward are tried, at doubling distances; the first one inside is
        # taken, or else the end stays.
        ends = []
        for end, cut, inward in ((0, cuts[0], 1), (-1, cuts[-1], -1)):
            steps = inward * self.margin * np.concatenate([[0.0], 0.05 * 2.0 ** np.arange(8)])
            crossing = _between(stretch.place, stretch.z, np.array([cut]))
            is_near = abs(crossing[0] - stretch.z[end]) < TAIL_DISTANCES * self.margin
            places = np.concatenate(
                [[stretch.place[end]], cut + steps / _speed(pieces, cut) if is_near else []]
            )
            z = np.array([_point(pieces, place) for place in places])
            inside = shapely.contains_xy(self.polygon, z.real, z.imag)
            ends.append(places[np.argmax(inside)])
        start, stop = (float(end) for end in ends)
        return stretch.between(start, stop, False) if start < stop else stretch

    def _detour(self, stretch: _Stretch) -> list[Part]:
        """Return the arc of the boundary that replaces an excursion.

        It has the same ends, and winds equally often around the inside, or around a point of the hole that the
        excursion passes through.
        """
        hole = self._hole_of(stretch.z)
        rim, point = (self.rim, self.inner) if hole is None else self.holes[hole]
        # The arc from a to b in the boundary's direction sweeps another angle than the excursion, by full turns, which
        # are added as laps. A lap of the outer boundary is a turn, one of a hole's clockwise outline a turn back.
        a, b = (float(s) for s in rim.closest(stretch.z[[0, -1]]))
        forth = (b - a) % rim.length
        inner = np.concatenate([rim.knots, rim.knots + rim.length])
        arc = rim.at(np.concatenate([[a], inner[(inner > a) & (inner < a + forth)], [b]]))
        laps_between = round((_angle(stretch.z - point) - _angle(arc - point)) / (2 * math.pi))
        return self._arcs(rim, a, a + forth + (laps_between if hole is None else -laps_between) * rim.length)

    def _arcs(self, rim: Curve, start: float, stop: float) -> list[Part]:
        """Return the part of a boundary between two arclengths, split at its corners."""
        low, high = sorted((start, stop))
        laps = rim.length * np.arange(math.floor(low / rim.length), high // rim.length + 1)
        corners = np.add.outer(laps, self._corners[rim]).ravel()
        cuts = [low, *corners[(corners > low) & (corners < high)], high]
        return [Span(rim, float(a), float(b)) for a, b in pairwise(cuts if start <= stop else cuts[::-1])]


def _closed(run: PenPath) -> Sequence[Piece]:
    """Return the segments of a subpath including the chord with which a fill closes it."""
    return run.pieces if run.closed else [*run.pieces, Bezier((run.pieces[-1].last(), run.start))]


def is_flat(pieces: Sequence[Part]) -> bool:
    """Return whether a subpath stays on a straight line, so that its fill paints nothing."""
    z = np.concatenate([piece.at(np.linspace(0, 1, 17)) for piece in pieces])
    away = z - z[0]
    farthest = away[np.argmax(np.abs(away))]
    return bool(np.abs(cross(farthest, away)).max() <= FLAT_LENGTH_SHARE * abs(farthest) ** 2)


def _point_in(hole: Curve) -> complex:
    """Return a point deep in a hole, but not its centre, since drawings often pass through centres."""
    circle = shapely.get_coordinates(shapely.maximum_inscribed_circle(polygon_of(hole.z)))
    middle, touched = complex_of(circle)
    return complex(middle + OFF_MIDDLE_RADIUS_SHARE * (touched - middle))


def _shrunk(hole: shapely.Polygon, distance: float) -> shapely.Polygon:
    """Return the largest part of a hole that is at least `distance` from its outline; all of it if there is none."""
    parts = [part for part in shapely.get_parts(hole.buffer(-distance)) if part.area > 0]
    return max(parts, key=lambda part: part.area, default=hole)


def _polyline(pieces: Sequence[Piece], tolerance: float) -> tuple[NDArray[np.float64], Complex]:
    """Return positions (index + parameter) and points of a polyline within a tolerance of a subpath."""
    counts = [
        min(MOST_PIECE_VERTICES, max(1, math.ceil(math.sqrt(piece.bend() / (8 * tolerance)))))
        for piece in pieces
    ]
    t = [np.arange(count) / count for count in counts]
    place = np.concatenate([k + part for k, part in enumerate(t)] + [[len(pieces)]])
    points = [piece.at(part) for piece, part in zip(pieces, t)]
    return place, np.concatenate([*points, [pieces[-1].last()]])


def _between(place: NDArray[np.float64], z: Complex, positions: NDArray[np.float64]) -> Complex:
    return np.interp(positions, place, z.real) + 1j * np.interp(positions, place, z.imag)


def _spans(pieces: Sequence[Piece], stretch: _Stretch) -> list[Part]:
    """Return the segments of a stretch of a curve, with the first and the last one shortened to its ends."""
    parts: list[Part] = []
    for k in range(math.floor(stretch.place[0]), math.ceil(stretch.place[-1])):
        a, b = max(stretch.place[0] - k, 0.0), min(stretch.place[-1] - k, 1.0)
        piece = pieces[k % len(pieces)]
        if b - a > 1e-9:
            parts.append(Span(piece, a, b) if b - a < 1 else piece)
    return parts


def _point(pieces: Sequence[Piece], place: float) -> complex:
    number = max(math.ceil(place) - 1, 0)
    return complex(pieces[number % len(pieces)].at(np.array([place - number]))[0])


def _speed(pieces: Sequence[Piece], place: float) -> float:
    """Return the speed of a subpath in its position parameter, at least a thousandth of the segment's size."""
    piece, t = pieces[int(place) % len(pieces)], place % 1
    z = piece.at(np.array([0, 0.5, 1, max(t - 1e-4, 0), min(t + 1e-4, 1)]))
    size = float(np.abs(np.diff(z[:3])).sum())
    return max(abs(z[4] - z[3]) / 2e-4, 1e-3 * size, 1e-300)


def _angle(z: Complex) -> float:
    """Return the angle that a polyline sweeps as seen from the origin."""
    return float(np.angle(z[1:] * z[:-1].conj()).sum())
