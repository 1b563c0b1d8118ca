"""Mesh a shape with a free outline, with pins and strokes as vertices and edges."""

from collections.abc import Sequence

import numpy as np

from ...arrays import Complex
from ...curve import Curve
from ...linalg.cholesky import system_of
from ..constraints.strokes import inside
from ..constraints.validate import Pins
from ..holes.outlines import FEWEST_RIM_VERTICES
from ..meshing.mesh import Sizes, triangulate
from ..model.boundary import FreeBoundary
from ..model.boundary_mesh import kept_by, region_at
from ..model.boundary_pairs import Match, subdivide
from ..model.discrete_map import DiscreteMap, folds
from ..model.energy import Energy
from ..model.mesh_sizes import finer_at_pins
from ..search.levels import subdivide_rings
from ..search.rounding import snap_to_coarse_grid

SPACING_MESH_SIZES = 0.75  # distance of the outline's vertices, in mesh sizes


def mesh_of(
    outlines: Sequence[Curve],
    pins: Pins,
    energy: Energy,
    size: float,
    matches: list[Match] | None = None,
    regions: Sequence[Sequence[Complex]] = (),
) -> DiscreteMap:
    """Return the undeformed shape on a mesh.

    Args:
        outlines: the outer one, counter-clockwise, and those of holes, clockwise, around an area of about one,
            with a vertex at every pin on them.
        pins: in its coordinates.
        energy: the energy that maps minimise.
        size: edge length h of the triangles.
        matches: correspondence of each stroke; in proportion to arclength, ends to ends, if None.
        regions: polygons of rigid regions.

    Raises:
        Stuck: no mesh with these constraints was found.
    """
    matches = matches or [stroke.even for stroke in pins.strokes]
    inner = inside(pins.strokes, matches, SPACING_MESH_SIZES * size, pins.inner)
    spaced = [
        _spaced(outline, min(SPACING_MESH_SIZES * size, outline.length / FEWEST_RIM_VERTICES), inner.z)
        for outline in outlines
    ]
    # The triangulation is that of outlines on a coarse grid, so that noise far below the grid spacing does not
    # change it.
    outer, *holes = [rounded for rounded, _ in spaced]
    bones = subdivide_rings(regions, SPACING_MESH_SIZES * size)
    points, around = kept_by(bones, inner.z)
    links = np.append(inner.links, np.where(around < 0, -1, inner.z.size + around))
    points = np.append(inner.z, points)
    z, faces = triangulate(outer, sizes_at_pins(outer, size, energy), points, links, holes, inner.rays(outer))
    border = np.concatenate([target_outline for _, target_outline in spaced])
    restored = np.append(border, z[border.size :])
    if folds(faces, restored):
        border = z[: border.size]
    else:
        z = restored
    pinned = np.abs(pins.outer[:, :1] - border).argmin(axis=1) if len(pins.outer) else np.empty(0, np.int64)
    boundary = FreeBoundary((outer.size, *(hole.size for hole in holes)), pinned, pins.outer[:, 1])
    pattern = system_of(faces, np.append(boundary.following, boundary.size + inner.following), z.size)
    rigid = region_at(z[faces].mean(axis=1), bones) if bones else None
    state = DiscreteMap(
        faces, z, z.copy(), boundary=boundary, inside=inner, bound=True, pattern=pattern, rigid=rigid
    )
    return state.with_energy(energy)


def sizes_at_pins(outline: Complex, size: float, energy: Energy) -> Sizes:
    """Return the size limits for triangles of size h, smaller around soft pins."""
    sizes = Sizes.even(0.5 * size**2)
    if energy.pins is None:
        return sizes
    return finer_at_pins(sizes, outline, energy.pins.source, energy.pins.radii)


def _spaced(outline: Curve, spacing: float, points: Complex) -> tuple[Complex, Complex]:
    """Return the vertices of an outline on the grid (see `space_out`), and the same positions on the given one."""
    z = snap_to_coarse_grid(outline.z)
    rounded = Curve(z)
    if (rounded.lengths == 0).any() or not rounded.polygon.is_valid:
        vertices = space_out(outline, spacing, points)
        return vertices, vertices
    vertices = space_out(rounded, spacing, points)
    s = rounded.closest(vertices)
    edge = np.clip(np.searchsorted(rounded.knots, s, side="right") - 1, 0, rounded.lengths.size - 1)
    share = (s - rounded.knots[edge]) / rounded.lengths[edge]
    return vertices, outline.at(outline.knots[edge] + share * outline.lengths[edge])


def space_out(outline: Curve, spacing: float, points: Complex) -> Complex:
    """Return vertices of an outline, no farther apart than `spacing`, and denser near points that are close to it."""
    s, length = outline.knots[:-1], outline.length
    for place, step in sorted(_beside(outline, spacing, points), key=lambda pair: pair[1]):
        gaps = np.abs(np.mod(s - place + 0.5 * length, length) - 0.5 * length)
        if gaps.min() > 0.5 * step:
            s = np.append(s, np.mod(place, length))
    s = np.sort(s)
    gaps = np.diff(s, append=length)
    gap, share = subdivide(gaps, spacing)
    return outline.at(s[gap] + share * gaps[gap])


def _beside(outline: Curve, spacing: float, points: Complex) -> list[tuple[float, float]]:
    """Return arclengths around the feet of points.

    Steps double from the point's distance up to the spacing.
    """
    places = []
    for s, point in zip(outline.closest(points), points):
        away = float(abs(outline.at(s) - point))
        if not away:
            continue
        steps = away * 2.0 ** np.arange(np.ceil(np.log2(max(spacing / away, 1.0))))
        places += [(float(s + side * step), float(step)) for step in steps for side in (-1, 0, 1)]
    return places
