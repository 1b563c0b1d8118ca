"""Polygon meshes as arrays: the class that every mesh format is read into, checks of its elements, and triangulation.

Input is not trusted here. libigl trusts its input (an index out of range ends the process), so call `check`
before it.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from .. import limits
from ..arrays import Index, Real, distinct_rows
from ..curve import polygon_of
from ..errors import InputError
from ..parallel import over_slices
from ..plane import cross, triangle_areas

MOST_EAR_CORNERS = 100
"""Largest number of corners of a polygon for ear clipping, which takes cubic time."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Polygons over points in space, with texture coordinates at corners.

    Attributes:
        name: name in messages, usually the file's name with the selected part.
        points: (n, 3) positions.
        corners: (c,) vertex of each corner, face after face.
        starts: (f + 1,) first corner of each face.
        uv: (t, 2) texture coordinates, v up, or None.
        uv_corners: (c,) texture coordinate of each corner, -1 if it has none, or None.
        base: number of the first vertex and face in the file format: 1 in OBJ, 0 elsewhere.
        lines: (f,) line of each face in the file, or None.
        whole: whether it is all of the file's mesh, so that a note reports unused vertices.
        cut_like: (n, 3) positions that determine the triangulation of polygons instead of `points`, or None.
        normals: (k, 3) unit normals from the file, or None.
        normal_corners: (c,) normal of each corner, or None.
        materials: (f,) number of each face's material, or None.
        seams: (k, 2) vertices at the ends of edges that the file marks as seams, or None.
        up_axis: the axis that points up: 1 for y, 2 for z as in formats for printing.
    """

    name: str
    points: Real
    corners: Index
    starts: Index
    uv: Real | None = None
    uv_corners: Index | None = None
    base: int = 0
    lines: Index | None = None
    whole: bool = True
    cut_like: Real | None = None
    normals: Real | None = None
    normal_corners: Index | None = None
    materials: Index | None = None
    seams: Index | None = None
    up_axis: int = 1

    @classmethod
    def triangles(cls, name: str, points: Real, faces: Index, **attributes) -> "Mesh":
        """Return a mesh of triangles from (n, 3) points and (m, 3) vertex indices."""
        faces = np.asarray(faces, dtype=np.int64)
        return cls(
            name, np.asarray(points, float), faces.ravel(), 3 * np.arange(len(faces) + 1), **attributes
        )

    @property
    def sizes(self) -> Index:
        """Number of corners of each face; shape (f,)."""
        return np.diff(self.starts)

    def face_name(self, face: int) -> str:
        """Return the name of a face in messages."""
        line = f" (line {self.lines[face]})" if self.lines is not None else ""
        return f"face {face + self.base}{line}"

    def vertex_name(self, vertex: int) -> str:
        """Return the name of a vertex in messages."""
        return f"vertex {vertex + self.base}"

    def part(self, faces: NDArray[np.bool_], name: str) -> "Mesh":
        """Return the mesh of the faces marked in (f,), over the same points."""
        keep = np.repeat(faces, self.sizes)
        return replace(
            self,
            name=name,
            corners=self.corners[keep],
            starts=np.concatenate([[0], np.cumsum(self.sizes[faces])]),
            uv_corners=None if self.uv_corners is None else self.uv_corners[keep],
            normal_corners=None if self.normal_corners is None else self.normal_corners[keep],
            lines=None if self.lines is None else self.lines[faces],
            materials=None if self.materials is None else self.materials[faces],
            whole=False,
        )


def up_and_front(up_axis: int) -> tuple[Real, Real]:
    """Return unit vectors (3,) up and to the front of a model, see `Mesh.up_axis`: y and z, or z and -y."""
    rows = np.eye(3)
    return (rows[1], rows[2]) if up_axis == 1 else (rows[2], -rows[1])


def merge(meshes: Sequence[Mesh], name: str) -> Mesh:
    """Join several meshes of one file, with vertices and faces one after the other, and normals if all have some."""
    firsts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    corners = np.concatenate([mesh.corners + first for mesh, first in zip(meshes, firsts)])
    ends = np.cumsum([0, *(mesh.corners.size for mesh in meshes)])
    starts = np.concatenate([[0], *(mesh.starts[1:] + end for mesh, end in zip(meshes, ends))])
    uv, uv_corners = _united([(mesh.uv, mesh.uv_corners) for mesh in meshes], meshes, 2)
    normals = [(mesh.normals, mesh.normal_corners) for mesh in meshes]
    stated = all(values is not None for values, _ in normals)
    normal, normal_corners = _united(normals, meshes, 3) if stated else (None, None)
    points = np.concatenate([mesh.points for mesh in meshes])
    return Mesh(
        name,
        points,
        corners,
        starts,
        uv,
        uv_corners,
        normals=normal,
        normal_corners=normal_corners,
        materials=np.repeat(np.arange(len(meshes)), [mesh.sizes.size for mesh in meshes]),
        up_axis=meshes[0].up_axis,
    )


def _united(
    entries: Sequence[tuple[Real | None, Index | None]], meshes: Sequence[Mesh], width: int
) -> tuple[Real | None, Index | None]:
    """Join values at corners of several meshes.

    Returns:
        The values, and (c,) the index for each corner, -1 for meshes without values; None if no mesh has any.
    """
    if all(values is None for values, _ in entries):
        return None, None
    arrays = [np.zeros((0, width)) if values is None else values for values, _ in entries]
    firsts = np.cumsum([0, *map(len, arrays)])
    numbers = [
        np.full(mesh.corners.size, -1) if index is None else np.where(index < 0, -1, index + first)
        for (_, index), mesh, first in zip(entries, meshes, firsts)
    ]
    return np.concatenate(arrays), np.concatenate(numbers)


def check(mesh: Mesh) -> Mesh:
    """Return the mesh if all of its elements are valid.

    Raises:
        InputError: names the first invalid element: there are no faces, an index is out of range, a face has
            fewer than three corners, or a vertex is not finite or too far away.
    """
    if not mesh.points.size:
        raise InputError(f"{mesh.name}: contains no vertices; is this a mesh?")
    if mesh.starts.size < 2:
        raise InputError(
            f"{mesh.name}: contains {len(mesh.points)} vertices but no faces; a point cloud cannot be mapped"
        )
    _refuse(mesh, mesh.sizes < 3, "has fewer than 3 corners")
    outside = (mesh.corners < 0) | (mesh.corners >= len(mesh.points))
    if outside.any():
        corner = int(np.flatnonzero(outside)[0])
        vertex = int(mesh.corners[corner])
        vertex_text = f"vertex {vertex + mesh.base}" if vertex >= 0 else "a vertex before the first one"
        place = mesh.face_name(_face_of(mesh, corner))
        raise InputError(
            f"{mesh.name}: {place}: uses {vertex_text}, but the file has {len(mesh.points)}; is the file truncated?"
        )
    if mesh.uv_corners is not None and mesh.uv is not None:
        _refuse_corner(
            mesh, mesh.uv_corners >= len(mesh.uv), "uses a texture coordinate that is not in the file"
        )
    if mesh.normal_corners is not None and mesh.normals is not None:
        _refuse_corner(
            mesh, mesh.normal_corners >= len(mesh.normals), "uses a normal that is not in the file"
        )
    bad = ~(np.abs(mesh.points) <= limits.MESH_COORDINATE).all(axis=1)  # NaN included
    if bad.any():
        vertex = int(np.flatnonzero(bad)[0])
        raise InputError(
            f"{mesh.name}: {mesh.vertex_name(vertex)}: is not finite, or larger than {limits.MESH_COORDINATE:g}"
        )
    return mesh


def triangulate(mesh: Mesh) -> Index:
    """Return (m, 3) corners (indices into mesh.corners) of the triangles of a checked mesh, face after face.

    Quads are divided by the diagonal whose two triangles agree with the quad's own normal; by the shorter one
    if both do; and by the other one if that diagonal is an edge already, which would then have more than two
    faces. Larger polygons become a fan if that has no flipped triangle, and are clipped into ears otherwise.
    Triangles with repeated vertices are omitted.

    Raises:
        InputError: a polygon cannot be triangulated.
    """
    first, sizes = mesh.starts[:-1], mesh.sizes
    points = mesh.points if mesh.cut_like is None else mesh.cut_like
    faces = [np.flatnonzero(sizes == 3), np.flatnonzero(sizes == 4)]
    parts = [first[faces[0], None] + np.arange(3)]
    owners = [faces[0]]
    if faces[1].size:
        quad_corners = first[faces[1], None] + np.arange(4)
        place = distinct_rows(mesh.points)[1][mesh.corners]  # coinciding vertices may be joined later
        quads = _split_quads(points[mesh.corners[quad_corners]], place[quad_corners], _sides(mesh, place))
        parts.append((first[faces[1], None, None] + quads).reshape(-1, 3))
        owners.append(np.repeat(faces[1], 2))
    for face in np.flatnonzero(sizes > 4):
        try:
            pieces = _split_polygon(points[mesh.corners[first[face] : first[face] + sizes[face]]])
        except ValueError as error:
            raise InputError(f"{mesh.name}: {mesh.face_name(int(face))}: {error}") from None
        parts.append(first[face] + pieces)
        owners.append(np.full(len(pieces), face))
    corners = np.concatenate(parts)[np.argsort(np.concatenate(owners), kind="stable")]
    return corners[proper(mesh.corners[corners])]


def fans(mesh: Mesh) -> tuple[Index, Index]:
    """Return all triangles (k, 3) into which other programs may divide polygons, and the face of each (k,).

    These are all fans of quads, and of larger polygons with up to MOST_EAR_CORNERS corners that are convex in
    space.
    """
    triangles, owners = [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)]
    for size in range(4, min(int(mesh.sizes.max(initial=3)), MOST_EAR_CORNERS) + 1):
        k = np.arange(size)
        i, j = (grid.ravel() for grid in np.meshgrid(k, k))
        triples = np.unique(np.sort(np.column_stack([i, (i + 1) % size, j]), axis=1), axis=0)
        triples = triples[proper(triples)]
        faces = np.flatnonzero(mesh.sizes == size)
        corners = mesh.starts[faces, None, None] + triples
        points = mesh.points[mesh.corners[mesh.starts[faces, None] + k]]
        normal = np.cross(points, np.roll(points, -1, axis=1)).sum(axis=1)
        convex = (_agreement(points[:, triples], normal) > 0).all(axis=1) | (size == 4)
        triangles.append(corners[convex].reshape(-1, 3))
        owners.append(np.repeat(faces[convex], len(triples)))
    return np.concatenate(triangles), np.concatenate(owners)


def proper(faces: Index) -> NDArray[np.bool_]:
    """Return (m,) whether triangles (m, 3) have three distinct vertices."""
    a, b, c = faces.T
    return (a != b) & (b != c) & (c != a)


def with_unit_area(points: Real, faces: Index) -> Real:
    """Return points (n, 3) scaled so that the total area of triangles (m, 3) is one."""
    return points / np.sqrt(face_areas(points[faces]).sum())


def face_areas(triangle: Real) -> Real:
    """Return (m,) areas of (m, 3, 3) triangles in space."""
    areas = np.empty(len(triangle))

    def work(part: slice) -> None:
        a, b, c = np.moveaxis(triangle[part], 1, 0)
        across = np.cross(b - a, c - a)
        areas[part] = 0.5 * np.sqrt(np.einsum("ij,ij->i", across, across))

    over_slices(work, len(triangle))
    return areas


def polygon_areas(mesh: Mesh) -> Real:
    """Return (f,) areas of polygons, of bent ones that of their projection; 0 for invalid ones."""
    points = np.nan_to_num(mesh.points[np.clip(mesh.corners, 0, max(len(mesh.points) - 1, 0))])
    following = np.arange(1, mesh.corners.size + 1)
    has_corners = mesh.sizes > 0
    following[mesh.starts[1:][has_corners] - 1] = mesh.starts[:-1][has_corners]
    centre = points.mean(axis=0) if len(points) else 0.0
    across = np.cross(points - centre, points[following] - centre)
    sums = np.cumsum(np.vstack([np.zeros((1, 3)), across]), axis=0)
    return 0.5 * np.linalg.norm(sums[mesh.starts[1:]] - sums[mesh.starts[:-1]], axis=1)


def face_angles(triangle: Real) -> Real:
    """Return (m, 3) the angles of (m, 3, 3) triangles in space at their corners; 0 if two of these coincide."""
    ahead, behind = np.roll(triangle, -1, axis=1) - triangle, np.roll(triangle, 1, axis=1) - triangle
    across = np.linalg.norm(np.cross(ahead, behind), axis=-1)
    return np.arctan2(across, np.einsum("mij,mij->mi", ahead, behind))


def _face_of(mesh: Mesh, corner: int) -> int:
    return int(np.searchsorted(mesh.starts, corner, side="right")) - 1


def _refuse(mesh: Mesh, faces: NDArray[np.bool_], problem: str) -> None:
    if faces.any():
        raise InputError(f"{mesh.name}: {mesh.face_name(int(np.flatnonzero(faces)[0]))}: {problem}")


def _refuse_corner(mesh: Mesh, corners: NDArray[np.bool_], problem: str) -> None:
    if corners.any():
        raise InputError(
            f"{mesh.name}: {mesh.face_name(_face_of(mesh, int(np.flatnonzero(corners)[0])))}: {problem}"
        )


def _split_quads(quad: Real, vertices: Index, sides: Index) -> Index:
    """Return (q, 2, 3) local corners of the two triangles of each quad.

    Args:
        quad: (q, 4, 3) positions.
        vertices: (q, 4) vertices.
        sides: edges of the mesh, see `_edges`.
    """
    diagonals = np.array([[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]])
    normal = np.cross(quad[:, 2] - quad[:, 0], quad[:, 3] - quad[:, 1])
    agree = [_agreement(quad[:, diagonal], normal).min(axis=1) for diagonal in diagonals]
    length = [np.linalg.norm(quad[:, a] - quad[:, b], axis=1) for a, b in ((0, 2), (1, 3))]
    both_agree = (agree[0] > 0) & (agree[1] > 0)
    takes_second = np.where(both_agree, length[1] < length[0] * (1 - 1e-9), agree[1] > agree[0])
    edges = np.column_stack([_edges(vertices[:, 0], vertices[:, 2]), _edges(vertices[:, 1], vertices[:, 3])])
    first, alike = distinct_rows(np.sort(vertices, axis=1))  # quads with the same corners count once
    chosen_edges = np.where(takes_second, edges[:, 1], edges[:, 0])[first]
    used = Counter(chosen_edges.tolist())
    exists = np.isin(edges, sides)
    for k in np.sort(first[exists[first].any(axis=1) | _repeated(chosen_edges)]):
        present, new = int(takes_second[k]), 1 - int(takes_second[k])
        if (exists[k, present] or used[edges[k, present]] > 1) and not (
            exists[k, new] or used[edges[k, new]]
        ):
            takes_second[k] = new
            used[edges[k, present]] -= 1
            used[edges[k, new]] += 1
    chosen_edges = np.where(takes_second, edges[:, 1], edges[:, 0])[first]
    return diagonals[(edges[:, 1] == chosen_edges[alike]).astype(int)]


def _edges(tails: Index, heads: Index) -> Index:
    """Return a key for each edge between two vertices, independent of direction."""
    return np.minimum(tails, heads) << 32 | np.maximum(tails, heads)


def _sides(mesh: Mesh, place: Index) -> Index:
    """Return the keys of the edges between the positions (c,) of neighbouring corners of all faces."""
    following = np.arange(1, mesh.corners.size + 1)
    following[mesh.starts[1:] - 1] = mesh.starts[:-1]
    return _edges(place, place[following])


def _repeated(values: Index) -> NDArray[np.bool_]:
    """Return which values occur more than once."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    return count[place] > 1


def _agreement(triangles: Real, normal: Real) -> Real:
    """Return the dot product of each triangle's area vector (…, 3, 3) with its polygon's normal."""
    across = np.cross(triangles[:, :, 1] - triangles[:, :, 0], triangles[:, :, 2] - triangles[:, :, 0])
    return np.einsum("qti,qi->qt", across, normal)


def _split_polygon(polygon: Real) -> Index:
    """Return (k - 2, 3) local corners of the triangles of a (k, 3) polygon with more than four corners."""
    k = len(polygon)
    normal = np.cross(polygon, np.roll(polygon, -1, axis=0)).sum(axis=0)
    fan = np.column_stack([np.zeros(k - 2, int), np.arange(1, k - 1), np.arange(2, k)])
    if not normal.any() or (_agreement(polygon[None, fan], normal[None]) > 0).all():
        return fan  # also of a polygon that lies in no plane, such as one whose corners are on a line
    axis = np.eye(3)[np.argmin(np.abs(normal))]
    right = np.cross(axis, normal)
    up = np.cross(normal, right)
    z = polygon @ right / np.linalg.norm(right) + 1j * (polygon @ up) / np.linalg.norm(up)
    return _ears(z) if k <= MOST_EAR_CORNERS else _delaunay(z)


def _delaunay(z: NDArray[np.complex128]) -> Index:
    """Return the constrained Delaunay triangulation of a simple polygon, for which ear clipping would take too long.

    Raises:
        ValueError: it is not simple.
    """
    number = {point: k for k, point in enumerate(map(complex, z))}
    polygon = polygon_of(z)
    if len(number) < z.size or not polygon.is_valid:
        raise ValueError(
            f"has {z.size} corners and crosses or touches itself; triangulate the mesh in a modelling program"
        )
    parts = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    xy = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]
    corners = np.array([[number[complex(x, y)] for x, y in triangle] for triangle in xy])
    flipped = triangle_areas(z[corners]) < 0
    corners[flipped] = corners[flipped][:, ::-1]
    return corners


def _ears(z: NDArray[np.complex128]) -> Index:
    """Clip ears, the best-shaped ear first."""
    remaining, ears = list(range(len(z))), []
    while len(remaining) > 3:
        scores = [_ear_score(z, remaining, k) for k in range(len(remaining))]
        k = int(np.argmax(scores))
        ears.append([remaining[k - 1], remaining[k], remaining[(k + 1) % len(remaining)]])
        del remaining[k]
    return np.array([*ears, remaining])


def _ear_score(z: NDArray[np.complex128], remaining: list[int], k: int) -> float:
    """Return the area over the squared longest side of the ear at position k; negative if it is not an ear."""
    a, b, c = z[remaining[k - 1]], z[remaining[k]], z[remaining[(k + 1) % len(remaining)]]
    area = cross(b - a, c - a)
    other_points = z[[i for i in remaining if z[i] not in (a, b, c)]]
    turns = [cross(q - p, other_points - p) >= 0 for p, q in ((a, b), (b, c), (c, a))]
    blocked = np.logical_and.reduce(turns).any()
    size = max(abs(b - a), abs(c - b), abs(a - c)) ** 2
    return float(area / size) - (2.0 if blocked else 0.0)
