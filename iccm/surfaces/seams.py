"""Choose the order of landmarks along a seam so that two closed surfaces are cut along the same seam.

Two landmarks may be joined by several geodesics of similar length, one on either side of a protrusion. A seam that
takes one of them on the source and another on the target twists the map by a full rotation. Corresponding geodesics
leave a landmark in the same direction relative to the others, and have similar lengths. Among the orders with low cost
by these criteria, the one whose even layouts are most alike is chosen.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Index, Real
from ..errors import InputError
from ..flattening import even_layout, flatten
from ..meshes.cut import cut_along_path, cut_through, path_through
from ..meshes.disk_patch import nearest, sound_piece
from ..meshes.flatten import Flattening
from ..meshes.geodesics import GeodesicGraph
from ..meshes.mesh import face_areas
from ..meshes.patch import Patch
from .icp_start import unlikeness
from .inserted import Opening, with_way
from .trilateration import same_way

MOST_TRIANGLES = 20_000  # with more, the order is left as given: a search would take over ten seconds
BEAM_WIDTH = 50_000
"""Partial orders that are kept, the cheapest ones: with up to eight landmarks these are all that exist."""
ASTRAY_RADIANS, LONGER_LOG_RATIO = 0.5, 0.2
"""Difference in direction (radians) and in log length that doubles the cost of a path: half a radian off is as bad
as a fifth longer."""
ORDERS_TRIED = 8  # orders whose layouts are compared
FEWEST_STOPS = 4  # landmarks needed for trilateration: two places may be equally far from three points
COARSE_TRIANGLES = 3000  # triangles: with more, edge paths are close to the geodesics
CLEAR_UNLIKENESS = 0.03  # difference between layouts below which no further order is tried


class Opened(NamedTuple):
    """Two closed surfaces cut open through landmarks.

    Attributes:
        wholes: source and target before the cut; triangles of the source may be split for it.
        patches: both, cut open.
        stops: (k, 2) vertices of the wholes at the landmarks, in the order of the seam.
    """

    wholes: tuple[Patch, Patch]
    patches: tuple[Patch, Patch]
    stops: Index

    @classmethod
    def of(cls, source: Patch, target: Patch, stops: Index, opening: Opening | None = None) -> "Opened":
        """Cut both surfaces along geodesics, or the source along the path of an opening if given.

        Raises:
            InputError: there is no such seam.
        """
        target_cut = cut_through(target, stops[:, 1].tolist())
        if opening is None:
            return cls((source, target), (cut_through(source, stops[:, 0].tolist()), target_cut), stops)
        split = sound_piece(opening.mesh)
        marks = np.column_stack([nearest(split, source.points[stops[:, 0]]), stops[:, 1]])
        return cls(
            (split, target), (cut_along_path(split, nearest(split, opening.points)), target_cut), marks
        )

    def pins(self, layouts: Sequence[Flattening]) -> tuple[Complex, Complex]:
        """Return the landmarks (k,) in layouts of both patches, in order around the outlines."""
        source, target = layouts
        return (
            on_seam(source, (self.wholes[0], self.stops[:, 0])),
            on_seam(target, (self.wholes[1], self.stops[:, 1])),
        )

    def unlikeness(self) -> float:
        """Return how different the even layouts of both patches are, see `icp_start.unlikeness`.

        Raises:
            InputError: one has no even layout.
        """
        layouts = [even_layout(flatten(patch)) for patch in self.patches]
        return unlikeness(layouts[0].boundary, layouts[1].boundary, *self.pins(layouts))


def agreed_orders(source: Patch, target: Patch, stops: Index) -> list[Index]:
    """Return orders (k,) of landmarks in which to cut both surfaces, those with the most similar layouts first.

    If an order makes the layouts similar enough (CLEAR_UNLIKENESS), it is the only one. With fewer than three
    landmarks, or many triangles, the order is left as given.

    Args:
        source: a closed surface without handles.
        target: as above.
        stops: (k, 2) vertices of both.
    """
    given_order = np.arange(len(stops))
    large = max(len(source.faces), len(target.faces)) > MOST_TRIANGLES
    if len(stops) < 3 or large:
        return [given_order]
    rated = []
    for order in _orders(_cost(source, target, stops)):
        rated.append((_unlikeness(source, target, stops[order]), order))
        if rated[-1][0] < CLEAR_UNLIKENESS:
            return [order]
    rated.sort(key=lambda pair: pair[0])
    return [order for unlike, order in rated if unlike < np.inf] or [given_order]


def same_seam(source: Patch, target: Patch, stops: Index) -> Opening | None:
    """Return the source opened along the target's seam, transferred by geodesic distances.

    None where that does not make the layouts more alike, or where triangles are so small that paths along edges are
    close to geodesics anyway.

    Args:
        source: a closed surface without handles.
        target: as above.
        stops: (k, 2) vertices of both, in the order of the seam.
    """
    if len(stops) < FEWEST_STOPS or len(target.faces) > COARSE_TRIANGLES:
        return None
    try:
        path = path_through(target, stops[:, 1].tolist())
        opening = with_way(source, same_way(source, target, stops, path))
        if opening is None:
            return None
        unlike = Opened.of(source, target, stops).unlikeness()
        alike = Opened.of(source, target, stops, opening).unlikeness()
    except InputError:
        return None
    return opening if alike < unlike else None


def _orders(cost: Real) -> Iterator[Index]:
    """Yield the cheapest orders found by a beam search, each in one of its two directions."""
    ways, total = np.arange(len(cost))[:, None], np.zeros(len(cost))
    while ways.shape[1] < len(cost):
        further = total[:, None] + cost[ways[:, -1]]
        np.put_along_axis(further, ways, np.inf, axis=1)
        cheapest = np.argsort(further, axis=None, kind="stable")[:BEAM_WIDTH]
        cheapest = cheapest[further.ravel()[cheapest] < np.inf]
        predecessors, last = np.divmod(cheapest, len(cost))
        ways, total = np.column_stack([ways[predecessors], last]), further.ravel()[cheapest]
    yield from ways[ways[:, 0] < ways[:, -1]][:ORDERS_TRIED]


def _unlikeness(source: Patch, target: Patch, stops: Index) -> float:
    """Return `Opened.unlikeness` of both cut through the stops (k, 2) in order; infinite where that is impossible."""
    try:
        return Opened.of(source, target, stops).unlikeness()
    except InputError:
        return np.inf


def on_seam(layout: Flattening, stops: tuple[Patch, Index]) -> Complex:
    """Return the landmarks (k,) in a layout that was cut through them, in order around the outline.

    `stops` holds the surface before the cut, and its vertices at the landmarks; the first one comes first.
    """
    whole, vertices = stops
    vertex = layout.patch.vertex[layout.loop]
    marks = whole.vertex[vertices]
    around = np.roll(layout.loop, -int(np.flatnonzero(vertex == marks[0])[0]))
    return layout.flat[around[np.isin(layout.patch.vertex[around], marks)]]


def _cost(source: Patch, target: Patch, stops: Index) -> Real:
    """Return (k, k) costs of the path between two landmarks: its length, times a penalty for differences."""
    source_lengths, source_angles = _geodesics(source, stops[:, 0])
    target_lengths, target_angles = _geodesics(target, stops[:, 1])
    away = _wrapped(target_angles - source_angles)
    for row, is_other in zip(away, ~np.eye(len(away), dtype=bool)):
        turns = row[is_other]
        turn = turns[np.abs(_wrapped(turns - turns[:, None])).sum(axis=1).argmin()]
        row[is_other] = _wrapped(turns - turn)
    ratio = np.log(np.maximum(source_lengths, 1e-300) / np.maximum(target_lengths, 1e-300))
    astray = (away**2 + away.T**2) / ASTRAY_RADIANS**2 + (ratio / LONGER_LOG_RATIO) ** 2
    return 0.5 * (source_lengths + target_lengths) * (1 + astray)


def _geodesics(whole: Patch, stops: Index) -> tuple[Real, Real]:
    """Return geodesics between vertices of a surface.

    Returns:
        (k, k) lengths, relative to the root of the area; and (k, k) angles at which each leaves its first vertex,
        scaled so that the angles around a vertex sum to 2π.
    """
    reach = GeodesicGraph.of(whole.points, whole.triangles).distances(stops)
    angles = np.zeros((len(stops), len(stops)))
    for i, vertex in enumerate(stops):
        around, directions = _fan(whole, int(vertex))
        steps = np.linalg.norm(whole.points[around] - whole.points[vertex], axis=1)
        gaps = np.diff(directions, append=directions[0] + 2 * np.pi)
        falls = (reach[:, around] - reach[:, [vertex]]) / steps
        angles[i] = np.angle(-(falls * (gaps + np.roll(gaps, 1)) * np.exp(1j * directions)).sum(axis=1))
    lengths = reach[:, stops] / np.sqrt(face_areas(whole.points[whole.faces]).sum())
    return lengths, angles


def _fan(whole: Patch, vertex: int) -> tuple[Index, Real]:
    """Return the neighbours of a vertex of a closed surface in order, and their directions, scaled to sum to 2π."""
    first = np.argmax(whole.faces == vertex, axis=1)
    fan = np.flatnonzero((whole.faces == vertex).any(axis=1))
    ends = np.array([np.roll(whole.faces[t], -first[t])[1:] for t in fan])
    after = dict(ends.tolist())
    around = [int(ends[0, 0])]
    while (step := after[around[-1]]) != around[0]:
        around.append(step)
    edges = whole.points[around] - whole.points[vertex]
    following = np.roll(edges, -1, axis=0)
    across = np.linalg.norm(np.cross(edges, following), axis=1)
    corners = np.arctan2(across, (edges * following).sum(axis=1))
    return np.array(around), 2 * np.pi * (np.cumsum(corners) - corners) / corners.sum()


def _wrapped(angles: Real) -> Real:
    return np.mod(angles + np.pi, 2 * np.pi) - np.pi
