"""Mesh a map's boundary and everything inside: constraints, filled holes, concavities, rigid regions."""

from collections.abc import Sequence

import numpy as np

from ...arrays import Complex, Index, Real
from ...curve import Curve, inside_any, polygon_of
from ...linalg.cholesky import system_of
from ..meshing.mesh import Sizes, closed_links, triangulate
from .boundary import MatchedBoundary
from .discrete_map import BAY, FILLED, DiscreteMap
from .inner_constraints import InnerConstraints
from .mesh_map import NONE_INSIDE


def mesh_boundary(
    boundary: MatchedBoundary,
    sizes: Sizes,
    inside: InnerConstraints = NONE_INSIDE,
    filled: Sequence[Complex] = (),
    bays: Sequence[Complex] = (),
    regions: Sequence[Sequence[Complex]] = (),
) -> DiscreteMap:
    """Triangulate a domain. The image is given on the boundary and zero inside.

    Args:
        boundary: the outlines; their vertices are the mesh's boundary vertices.
        sizes: limits on the triangles' areas.
        inside: constraints, whose vertices are in the mesh; strokes are chains of edges.
        filled: polygons of filled holes; their edges are in the mesh.
        bays: polylines across filled concavities, each from the outline to the outline.
        regions: polygons of rigid regions, the outer one first; their edges are in the mesh.
    """
    # 1. Vertices and edges that the mesh must have. Its vertices are numbered in this order: the boundary's,
    # then those inside: of constraints, filled holes, polylines of concavities without their ends (which are
    # the outline's), and rings of regions. Chains of edges inside are given by `links`, the next vertex of each
    # on its polyline, -1 at an end.
    pairs = boundary.pairs
    outer, *inner = (loop.source.curve.at(pairs.s[loop.vertices]) for loop in boundary.loops)
    # `soft` has the links of all inner vertices that do not belong to constraints. While it is built, these vertices
    # are numbered from 0, so each part that is appended is shifted by the number before it. In `links` they follow
    # the vertices of constraints, so at the end all are shifted by the number of those.
    around = closed_links([rim.size for rim in filled])
    soft = np.append(around, linked_on([bay.size - 2 for bay in bays], around.size))
    region_points, region_links = kept_by(regions, inside.z)
    soft = np.append(soft, np.where(region_links < 0, -1, soft.size + region_links))
    links = np.append(inside.links, np.where(soft < 0, -1, inside.z.size + soft))
    points = np.concatenate([inside.z, *filled, *(bay[1:-1] for bay in bays), region_points])
    # Edges between the outline and inner vertices: where strokes, and the polylines of concavities, meet it.
    mouths = [mouth_of(outer, bay) for bay in bays]
    rays = np.concatenate([inside.rays(outer), bay_rays(bays, mouths, inside.z.size + around.size)])
    z, faces = triangulate(outer, sizes, points, links, inner, rays)

    # 2. The matrix of Newton's method couples each vertex that slides, on the boundary or on a constraint, to the
    # next one on the same curve (`following`). For all other vertices, which do not slide, `following` is the
    # vertex itself.
    inner_vertices = np.arange(points.size)
    ends = np.where((links >= 0) & (inner_vertices < inside.z.size), links, inner_vertices)
    following = np.append(boundary.following, boundary.size + ends)
    u = np.zeros(z.size, np.complex128)
    u[: boundary.size] = boundary.images()
    pattern = system_of(faces, following, z.size)

    # 3. Weights: triangles in filled holes and in concavities count less. A concavity lies between its polyline
    # and the part of the outline between its ends, its mouth: the polygon runs along the polyline, and back along
    # the mouth without its ends, which the polyline has already.
    rings = [np.append(bay, outer[mouth[-2:0:-1]]) for bay, mouth in zip(bays, mouths)]
    weights = weights_of(z, faces, filled, rings) if filled or bays else None
    rigid = region_at(z[faces].mean(axis=1), regions) if regions else None
    return DiscreteMap(
        faces, z, u, boundary=boundary, inside=inside, weights=weights, pattern=pattern, rigid=rigid
    )


def linked_on(sizes: Sequence[int], first: int) -> Index:
    """Return (k,) the next vertex on each of several open polylines; -1 at their ends.

    Args:
        sizes: numbers of vertices of the polylines, which follow each other.
        first: number of the first vertex.
    """
    links = first + np.arange(1, sum(sizes) + 1)
    links[np.cumsum(sizes, dtype=np.int64) - 1] = -1
    return links


def mouth_of(outline: Complex, bay: Complex) -> Index:
    """Return the outline's vertices (b,) between the two ends of a concavity's polyline."""
    start, stop = (int(np.abs(outline - end).argmin()) for end in (bay[0], bay[-1]))
    return np.arange(start, stop + 1 if stop > start else stop + 1 + outline.size) % outline.size


def bay_rays(bays: Sequence[Complex], mouths: Sequence[Index], first: int) -> Index:
    """Return (2 k, 2) edges from the outline to the polylines of concavities, at the ends of their mouths.

    Args:
        bays: the polylines, including their ends on the outline.
        mouths: the outline's vertices of each mouth.
        first: number of the first inner vertex of the first polyline.
    """
    rays = []
    for bay, mouth in zip(bays, mouths):
        after_last = first + bay.size - 2  # both ends are the outline's
        rays += [(mouth[0], first), (mouth[-1], after_last - 1)]
        first = after_last
    return np.array(rays, np.int64).reshape(-1, 2)


def weights_of(z: Complex, faces: Index, filled: Sequence[Complex], bays: Sequence[Complex] = ()) -> Real:
    """Return (m,) weights of triangles: FILLED inside `filled`, `BAY` inside the concavities `bays`, else 1."""
    middles, weights = z[faces].mean(axis=1), np.ones(len(faces))
    for polygons, weight in ((filled, FILLED), (bays, BAY)):
        weights[inside_any(map(Curve, polygons), middles)] = weight
    return weights


def kept_by(regions: Sequence[Sequence[Complex]], pins: Complex) -> tuple[Complex, Index]:
    """Return the vertices that a mesh must have for rigid regions, and their links.

    These are the vertices of the regions' rings, and one inside each region that holds no pin.

    Returns:
        (k,) points, and (k,) the next vertex on the same ring; -1 for none.
    """
    rings = [ring for region in regions for ring in region]
    pinned = set(region_at(pins, regions).tolist())
    empty = [region for k, region in enumerate(regions) if k not in pinned]
    seeds = np.array([middle_of(region) for region in empty], np.complex128)
    links = np.append(closed_links([ring.size for ring in rings]), np.full(seeds.size, -1))
    return np.concatenate([*rings, seeds]), links


def middle_of(region: Sequence[Complex]) -> complex:
    """Return a point inside a region, given as polygons, the outer one first.

    A round region needs a vertex inside: the vertices of its ring have one circumcentre, so that refinement
    could not begin.
    """
    point = polygon_of(*region).representative_point()
    return complex(point.x, point.y)


def region_at(places: Complex, regions: Sequence[Sequence[Complex]]) -> Index:
    """Return (p,) the index of the region that contains each place, -1 for none.

    Regions are disjoint, and may have holes.
    """
    region = np.full(places.size, -1)
    for k, (outer, *holes) in enumerate(regions):
        region[Curve(outer).contains(places) & ~inside_any(map(Curve, holes), places)] = k
    return region
