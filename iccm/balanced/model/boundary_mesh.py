"""A mesh for what holds a map's boundary and for what is inside: constraints, filled holes, concavities, rigid
regions.
"""

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
    """Make a mesh for a boundary; the image is given there and zero inside.

    Args:
        boundary: the outlines, whose vertices are those of the mesh on its boundary.
        sizes: how large triangles may be.
        inside: constraints, whose vertices are in the mesh, strokes as chains of edges.
        filled: polygons of holes that are covered; their edges are in the mesh.
        bays: polylines across filled concavities, each from the outline to the outline.
        regions: polygons of rigid regions, the outer one first; their edges are in the mesh.
    """
    # 1. What the mesh must have. Its vertices are numbered in this order: the boundary's, then those inside: of
    # constraints, filled holes, polylines of concavities without their ends (which are the outline's), and rings of
    # regions. Chains of edges inside are given by `links`, the next vertex of each on its polyline, -1 at an end.
    pairs = boundary.pairs
    outer, *inner = (loop.source.curve.at(pairs.s[loop.vertices]) for loop in boundary.loops)
    # `soft` has the links of all but the constraints, counted from its own first vertex. It grows part by part, the
    # links of each shifted by what is there already, and is shifted by the constraints' vertices at the end.
    around = closed_links([rim.size for rim in filled])
    soft = np.append(around, linked_on([bay.size - 2 for bay in bays], around.size))
    kept, around_kept = kept_by(regions, inside.z)
    soft = np.append(soft, np.where(around_kept < 0, -1, soft.size + around_kept))
    links = np.append(inside.links, np.where(soft < 0, -1, inside.z.size + soft))
    points = np.concatenate([inside.z, *filled, *(bay[1:-1] for bay in bays), kept])
    # Edges between the outline and inner vertices: where strokes, and the polylines of concavities, meet it.
    mouths = [mouth_of(outer, bay) for bay in bays]
    rays = np.concatenate([inside.rays(outer), bay_rays(bays, mouths, inside.z.size + around.size)])
    z, faces = triangulate(outer, sizes, points, links, inner, rays)

    # 2. The matrix of Newton's method couples vertices that slide to the next one on the same curve (`following`):
    # those of the boundary and of constraints. All other vertices do not slide, and are their own next ones.
    given = np.arange(points.size)
    ends = np.where((links >= 0) & (given < inside.z.size), links, given)
    following = np.append(boundary.following, boundary.size + ends)
    u = np.zeros(z.size, np.complex128)
    u[: boundary.size] = boundary.images()
    pattern = system_of(faces, following, z.size)

    # 3. What triangles count: less in filled holes, and in concavities. A concavity lies between its polyline and the
    # part of the outline between its ends, its mouth.
    rings = [np.append(bay, outer[mouth[-2:0:-1]]) for bay, mouth in zip(bays, mouths)]
    weights = weights_of(z, faces, filled, rings) if filled or bays else None
    rigid = regions_of(z[faces].mean(axis=1), regions) if regions else None
    return DiscreteMap(
        faces, z, u, boundary=boundary, inside=inside, weights=weights, pattern=pattern, rigid=rigid
    )


def linked_on(sizes: Sequence[int], first: int) -> Index:
    """Return (k,) the next vertex on each of several open polylines of given sizes, of which `first` is the first; -1
    at their ends.
    """
    links = first + np.arange(1, sum(sizes) + 1)
    links[np.cumsum(sizes, dtype=np.int64) - 1] = -1
    return links


def mouth_of(outline: Complex, bay: Complex) -> Index:
    """Return the vertices of an outline (b,) from the beginning of a concavity's polyline to its end."""
    start, stop = (int(np.abs(outline - end).argmin()) for end in (bay[0], bay[-1]))
    return np.arange(start, stop + 1 if stop > start else stop + 1 + outline.size) % outline.size


def bay_rays(bays: Sequence[Complex], mouths: Sequence[Index], first: int) -> Index:
    """Return (2 k, 2) vertices of the outline at the ends of mouths, and those inside beside them, of which `first` is
    the first.
    """
    rays = []
    for bay, mouth in zip(bays, mouths):
        rays += [(mouth[0], first), (mouth[-1], first := first + bay.size - 3)]
        first += 1
    return np.array(rays, np.int64).reshape(-1, 2)


def weights_of(z: Complex, faces: Index, filled: Sequence[Complex], bays: Sequence[Complex] = ()) -> Real:
    """Return (m,) weights of triangles: FILLED in the polygons `filled`, `BAY` in those of concavities, else 1."""
    middles, weights = z[faces].mean(axis=1), np.ones(len(faces))
    for polygons, weight in ((filled, FILLED), (bays, BAY)):
        weights[inside_any(map(Curve, polygons), middles)] = weight
    return weights


def kept_by(regions: Sequence[Sequence[Complex]], pins: Complex) -> tuple[Complex, Index]:
    """Return (k,) points that a mesh has for regions: their rings' vertices, and one inside each that holds no pin; and
    the next on its ring.
    """
    rings = [ring for region in regions for ring in region]
    pinned = set(regions_of(pins, regions).tolist())
    empty = [region for k, region in enumerate(regions) if k not in pinned]
    seeds = np.array([middle_of(region) for region in empty], np.complex128)
    links = np.append(closed_links([ring.size for ring in rings]), np.full(seeds.size, -1))
    return np.concatenate([*rings, seeds]), links


def middle_of(region: Sequence[Complex]) -> complex:
    """Return a point inside a region, outer polygon first: a mesh refines a round one from there, whose vertices alone
    have one circumcentre.
    """
    point = polygon_of(*region).representative_point()
    return complex(point.x, point.y)


def regions_of(places: Complex, regions: Sequence[Sequence[Complex]]) -> Index:
    """Return (p,) the region that each place is in, -1 for none; regions are apart, and may have holes."""
    found = np.full(places.size, -1)
    for k, (outer, *holes) in enumerate(regions):
        found[Curve(outer).contains(places) & ~inside_any(map(Curve, holes), places)] = k
    return found
