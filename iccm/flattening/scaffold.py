"""Keep a layout from overlapping itself by triangles around it.

Jiang, Schaefer, Panozzo, *Simplicial Complex Augmentation Framework for Bijective Maps*, SIGGRAPH Asia 2017: the space
between the outline and a frame, and the holes, are triangulated anew at every step. The rest shape of these scaffold
triangles is their current one, and no triangle of either kind may fold.
"""

from collections.abc import Iterable

import numpy as np
import shapely

from .. import deadline
from ..arrays import Complex, Index, complex_of, xy_of
from ..plane import triangle_areas
from .free import Elastic

FRAME_CORNERS = 24  # corners of the frame, whose radius is FRAME_RADIUS_FACTOR times that of the layout
FRAME_RADIUS_FACTOR = 2.0
SCAFFOLD_WEIGHT = 1e-3  # of the surface's energy: total weight of the scaffold
THIN_AREA_SHARE = 1e-14  # of the frame's radius squared: triangles with less area are dropped
SETTLED_STEPS = 3  # consecutive steps with little gain after which the layout has converged
LEAST_KEPT_AREA_SHARE = 0.5
"""Of its area at first: a scaffold is triangulated anew when one of its triangles gets smaller. Towards the end the
layout hardly moves, and the sparsity pattern of a large surface takes longer than a step."""


def relax_with_scaffold(
    sheet: Elastic,
    u: Complex,
    loops: list[Index],
    theta: float,
    steps: Iterable[int],
    tolerance: float,
    settled: int = SETTLED_STEPS,
) -> Complex:
    """Take Newton steps with a scaffold, from a layout that does not overlap itself to one with less energy.

    Args:
        sheet: the surface.
        u: (n,) positions of its vertices.
        loops: its boundary loops, the outline first.
        theta: weight of the area part.
        steps: yields one item per step that may be taken, so that several calls can share a limit.
        tolerance: relative decrease that counts as none.
        settled: consecutive steps with no decrease after which the layout counts as converged.

    Returns:
        (n,) new positions.
    """
    energy, small = sheet.energy(u, theta), 0
    around = frame(u[loops[0]])
    faces, areas, joint = outside(u, around, loops), np.empty(0), None
    for _ in steps:
        if deadline.ends_search():
            break
        positions = np.concatenate([around, u])
        if joint is not None and (triangle_areas(positions[faces]) < LEAST_KEPT_AREA_SHARE * areas).any():
            around, joint = frame(u[loops[0]]), None
            faces, positions = outside(u, around, loops), np.concatenate([around, u])
        if not len(faces):  # the outline is too thin for a scaffold; without one it might overlap itself
            break
        shapes = np.concatenate([sheet.shapes, positions[faces]])
        light = np.full(len(faces), SCAFFOLD_WEIGHT * energy / len(faces))
        weights = np.concatenate([sheet.weights, light])
        if joint is None:
            areas, joined = (
                triangle_areas(positions[faces]),
                np.concatenate([sheet.faces + FRAME_CORNERS, faces]),
            )
            joint = Elastic.of(joined, shapes, weights, FRAME_CORNERS)
        else:
            joint = joint.with_shapes(shapes, weights)
        u = joint.relaxed(positions, theta, 1, tolerance)[FRAME_CORNERS:]
        previous, energy = energy, sheet.energy(u, theta)
        small = small + 1 if previous - energy < tolerance * previous else 0
        if small == settled:
            break
    return u


def frame(outline: Complex) -> Complex:
    """Return the corners (FRAME_CORNERS,) of a regular polygon around an outline."""
    middle = outline.mean()
    radius = FRAME_RADIUS_FACTOR * np.abs(outline - middle).max()
    return middle + radius * np.exp(2j * np.pi * np.arange(FRAME_CORNERS) / FRAME_CORNERS)


def outside(u: Complex, around: Complex, loops: list[Index]) -> Index:
    """Return (k, 3) counter-clockwise triangles between the frame and the outline and in the holes.

    Vertices are those of the frame, then those of the layout.
    """
    positions = np.concatenate([around, u])
    rings = [np.arange(around.size), *(loop + around.size for loop in loops)]
    frame_polygon = shapely.Polygon(xy_of(around), [xy_of(u[loops[0]])])
    polygons = np.append(_polygons(u, loops[1:]), frame_polygon)
    return _numbered(
        positions, rings, polygons, THIN_AREA_SHARE * float(np.abs(around[0] - around.mean()) ** 2)
    )


def filling(u: Complex, hole: Index) -> Index:
    """Return (k, 3) counter-clockwise triangles that cover a hole, given its vertices' numbers in u (n,)."""
    return _numbered(u, [hole], _polygons(u, [hole]), 0.0)


def _polygons(u: Complex, loops: list[Index]) -> np.ndarray:
    """Return (k,) the polygons that loops of vertices bound; all are made at once, as scans have thousands of holes."""
    if not loops:
        return np.empty(0, object)
    ring = np.repeat(np.arange(len(loops)), [loop.size for loop in loops])
    return shapely.polygons(shapely.linearrings(xy_of(u[np.concatenate(loops)]), indices=ring))


def _numbered(positions: Complex, rings: list[Index], polygons: np.ndarray, thin: float) -> Index:
    """Triangulate polygons (k,); return the vertex numbers of triangles with more area than `thin`."""
    vertices = np.concatenate(rings)
    number = dict(zip(positions[vertices].tolist(), vertices.tolist()))
    xy = shapely.get_coordinates(shapely.get_parts(_triangulations(polygons))).reshape(-1, 4, 2)[:, :3]
    faces = np.array([number[z] for z in complex_of(xy.reshape(-1, 2)).tolist()], np.int64).reshape(-1, 3)
    area = triangle_areas(positions[faces])
    faces = np.where((area < 0)[:, None], faces[:, ::-1], faces)
    return np.ascontiguousarray(faces[np.abs(area) > thin])


def _triangulations(polygons: np.ndarray) -> np.ndarray:
    """Return the Delaunay triangulations (k,) of polygons; none where one is too thin for GEOS, until it gets wider."""
    try:
        return shapely.constrained_delaunay_triangles(polygons)
    except shapely.errors.GEOSException:
        if len(polygons) == 1:
            return np.empty(0, object)
        halves = np.array_split(polygons, 2)
        return np.concatenate([_triangulations(half) for half in halves])
