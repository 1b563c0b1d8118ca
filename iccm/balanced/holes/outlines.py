"""Simplify the outlines of a domain with holes for one level.

The result is coarse enough to be cheap, and fine enough to remain disjoint.
"""

from collections.abc import Sequence

import numpy as np
import shapely

from ...arrays import Complex, xy_of
from ...curve import Curve
from ..model.boundary_pairs import subdivide
from ..model.outline import FINENESS_OF_TOLERANCE, Outline, simplify

COARSEST_SHARE_OF_HOLE = 0.08  # relative to a hole's own diagonal: a disc keeps at least seven corners
FEWEST_RIM_VERTICES = 8  # least number of vertices of a hole's outline
# Factor of the fineness, and most repetitions, until outlines are disjoint.
FINER_FACTOR, FINER_ROUNDS = 0.5, 8


def outlines_of(
    curve: Curve,
    holes: Sequence[Curve],
    fineness: float,
    corner_fineness: float,
    always: tuple[complex, ...] = (),
    spacing: float = np.inf,
) -> list[Outline]:
    """Return the outer outline of a domain and those of its holes, simplified but disjoint.

    Args:
        curve: the outer boundary.
        holes: those of holes, clockwise.
        fineness: largest distance from the given outlines, relative to the diagonal of the outer one.
        corner_fineness: the same for the polygons of their corners.
        always: vertices of the outer one that are kept.
        spacing: see `Outline.of`.
    """
    if not holes:
        return [Outline.of(curve, fineness, corner_fineness, always, spacing)]
    for _ in range(FINER_ROUNDS):
        outer = Outline.of(curve, fineness, corner_fineness, always, spacing)
        shares = fineness, corner_fineness, spacing
        outlines = [outer, *(_of_hole(hole, curve.diagonal, *shares) for hole in holes)]
        if spacing < np.inf or are_disjoint([_polygon(outline) for outline in outlines]):
            return outlines
        fineness, corner_fineness = FINER_FACTOR * fineness, FINER_FACTOR * corner_fineness
    return [Outline.of(ring, 0.0, 0.0, always * (ring is curve)) for ring in (curve, *holes)]


def _polygon(outline: Outline) -> Complex:
    """Return the outline's corners; for a round one with fewer than three corners, all vertices."""
    return outline.curve.at(outline.corners) if outline.corners.size > 2 else outline.curve.z


def _of_hole(
    hole: Curve, diagonal: float, fineness: float, corner_fineness: float, spacing: float
) -> Outline:
    scale = diagonal / hole.diagonal
    shares = (
        min(scale * fineness, COARSEST_SHARE_OF_HOLE),
        min(scale * corner_fineness, COARSEST_SHARE_OF_HOLE),
    )
    return Outline.of(hole, *shares, spacing=min(spacing, hole.length / FEWEST_RIM_VERTICES))


def manageable_holes(
    outer: Curve, holes: Sequence[Curve], tolerance: float, always: Sequence[tuple[complex, ...]] = ()
) -> list[Curve]:
    """Return the outlines of holes simplified within a share of the tolerance, relative to the outer one.

    They are returned unchanged if they would touch the outer outline or each other. The vertices `always` of
    each are kept.
    """
    fineness = FINENESS_OF_TOLERANCE * tolerance * outer.diagonal
    simplified = [
        simplify(
            hole,
            min(fineness / hole.diagonal, FINENESS_OF_TOLERANCE * COARSEST_SHARE_OF_HOLE),
            fixed_vertices,
        )
        for hole, fixed_vertices in zip(holes, always or [()] * len(holes))
    ]
    return simplified if are_disjoint([outer.z, *(hole.z for hole in simplified)]) else list(holes)


def are_disjoint(loops: Sequence[Complex]) -> bool:
    """Return whether polygons are disjoint, and the first one contains all others."""
    outer, *holes = (xy_of(z) for z in loops)
    domain = shapely.Polygon(outer, holes)
    return bool(domain.is_valid) and shapely.get_num_interior_rings(domain.normalize()) == len(holes)


def rim_spacing(
    outlines: tuple[Outline, Outline], spacing: float, fewest: int = FEWEST_RIM_VERTICES
) -> float:
    """Return the longest edge on the outlines of a pair of holes."""
    return min(spacing, *(outline.length / fewest for outline in outlines))


def space_out(outline: Outline, spacing: float, *, every_vertex: bool = False) -> Complex:
    """Return the corners of an outline, and points between them, no farther apart than `spacing`.

    With `every_vertex`, these are all vertices of the polyline rather than its `corners`.
    """
    corners = outline.curve.knots[:-1] if every_vertex else outline.corners
    corners = corners if corners.size else np.zeros(1)
    gaps = np.diff(corners, append=corners[0] + outline.length)
    gap, share = subdivide(gaps, min(spacing, outline.length / FEWEST_RIM_VERTICES))
    return outline.curve.at(corners[gap] + share * gaps[gap])
