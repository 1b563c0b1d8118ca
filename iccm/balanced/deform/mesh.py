"""Meshes of a shape whose outline is free, with pins and strokes as vertices and edges."""

from collections.abc import Sequence

import numpy as np

from ...arrays import Complex
from ...curve import Curve
from ...linalg.cholesky import system_of
from ..constraints.strokes import inside
from ..constraints.validate import Pins
from ..holes.outlines import FEWEST
from ..meshing.mesh import Sizes, triangulate
from ..model.boundary import FreeBoundary
from ..model.boundary_mesh import kept_by, regions_of
from ..model.boundary_pairs import Match, subdivide
from ..model.discrete_map import DiscreteMap
from ..model.energy import Energy
from ..search.levels import subdivide_rings

SPACING = 0.75  # of the outline's vertices, in mesh sizes


def mesh_of(
    outlines: Sequence[Curve],
    pins: Pins,
    energy: Energy,
    size: float,
    drawn: list[Match] | None = None,
    regions: Sequence[Sequence[Complex]] = (),
) -> DiscreteMap:
    """The shape on a mesh, not moved yet.

    Args:
        outlines: the outer one, counter-clockwise, and those of holes, clockwise, around an area of about one, with a
            vertex at every pin on them.
        pins: in its coordinates.
        energy: what maps of it minimise.
        size: h of the triangles.
        drawn: where the vertices of strokes go; ends to ends, evenly, if None.
        regions: polygons of rigid regions.

    Raises:
        Stuck: no mesh holds all of this.
    """
    drawn = drawn or [stroke.even for stroke in pins.strokes]
    kept = inside(pins.strokes, drawn, SPACING * size, pins.inner)
    outer, *holes = (space_out(each, min(SPACING * size, each.length / FEWEST), kept.z) for each in outlines)
    bones = subdivide_rings(regions, SPACING * size)
    points, around = kept_by(bones, kept.z)
    links = np.append(kept.links, np.where(around < 0, -1, kept.z.size + around))
    points = np.append(kept.z, points)
    z, faces = triangulate(outer, Sizes.even(0.5 * size**2), points, links, holes, kept.rays(outer))
    border = np.concatenate([outer, *holes])
    pinned = np.abs(pins.outer[:, :1] - border).argmin(axis=1) if len(pins.outer) else np.empty(0, np.int64)
    boundary = FreeBoundary((outer.size, *(hole.size for hole in holes)), pinned, pins.outer[:, 1])
    pattern = system_of(faces, np.append(boundary.following, boundary.size + kept.following), z.size)
    rigid = regions_of(z[faces].mean(axis=1), bones) if bones else None
    state = DiscreteMap(faces, pattern, z, z.copy(), boundary, inside=kept, bound=True, rigid=rigid)
    return state.with_energy(energy)


def space_out(outline: Curve, spacing: float, points: Complex) -> Complex:
    """Vertices of an outline, no farther apart than `spacing`, and closer beside points that are close to it."""
    s, length = outline.knots[:-1], outline.length
    for place, step in sorted(_beside(outline, spacing, points), key=lambda found: found[1]):
        gaps = np.abs(np.mod(s - place + 0.5 * length, length) - 0.5 * length)
        if gaps.min() > 0.5 * step:
            s = np.append(s, np.mod(place, length))
    s = np.sort(s)
    gaps = np.diff(s, append=length)
    own, share = subdivide(gaps, spacing)
    return outline.at(s[own] + share * gaps[own])


def _beside(outline: Curve, spacing: float, points: Complex) -> list[tuple[float, float]]:
    """Arclengths around the feet of points, in steps that double from the distance on, up to the spacing."""
    found = []
    for s, point in zip(outline.closest(points), points):
        away = float(abs(outline.at(s) - point))
        if not away:
            continue
        steps = away * 2.0 ** np.arange(np.ceil(np.log2(max(spacing / away, 1.0))))
        found += [(float(s + side * step), float(step)) for step in steps for side in (-1, 0, 1)]
    return found
