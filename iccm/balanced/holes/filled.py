"""Cut virtual triangles from a map: those of filled concavities, and of the target's holes without a partner."""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real, distinct
from ...maps.triangulated.map import TriangulatedMap
from ...meshes.topology import Triangles
from ...plane import polygon_area
from ..model.discrete_map import BAY
from ..model.mesh_map import MeshMap


class Cut(NamedTuple):
    """A map without the triangles that fill concavities and those that fill holes of the target.

    Attributes:
        vertices: (n,) the vertices that remain.
        faces: (m, 3) triangles of these.
        loops: boundary vertices, the outer loop first, counter-clockwise, then those of holes, clockwise, in
            the order of the target's holes.
        partners: for each hole's loop, the hole of the source and of the target; -1 for a slit.
        lines: (l, 2) vertex pairs of the edges of strokes.
        filled: if there are concavities, the vertices of the outer loop including them, in the map before
            cutting; else None.
    """

    vertices: Index
    faces: Index
    loops: tuple[Index, ...]
    partners: tuple[tuple[int, int], ...]
    lines: Index
    filled: Index | None


def without_filled(state: MeshMap, *, mirrored: bool) -> Cut:
    """Remove the triangles that fill concavities and those that fill holes of the target.

    Triangles that fill holes of the source remain, so that the picture has no crack. If the unit coordinates
    are `mirrored`, the orientation of triangles and loops is reversed.
    """
    opened = [loop for loop in state.filled if loop.source < 0 <= loop.target]
    weights: Real = np.ones(len(state.faces)) if state.weights is None else state.weights
    bays = bool(np.any(weights == BAY))
    is_material: Flags = weights == 1 if opened else weights != BAY
    faces = state.faces[is_material]
    used = distinct(faces)
    place = np.full(state.z.size, -1)
    place[used] = np.arange(used.size)
    filled: Index = np.arange(state.z.size)[state.outer]
    outer = outer_loop(faces, state.z) if bays else filled
    holes = sorted((*state.loops, *opened), key=lambda loop: loop.target)
    loops = (place[outer], *(place[hole.vertices] for hole in holes))
    faces = place[faces]
    if mirrored:
        faces, loops = np.ascontiguousarray(faces[:, ::-1]), tuple(loop[::-1].copy() for loop in loops)
    partners = tuple((hole.source, hole.target) for hole in holes)
    return Cut(used, faces, loops, partners, place[state.lines], filled if bays else None)


def covering(state: MeshMap, z: Complex, u: Complex, *, mirrored: bool) -> TriangulatedMap:
    """Return a map with the triangles that fill holes of the target, from which a drag can continue.

    Args:
        state: the map in unit coordinates.
        z: (n,) its vertices in the given coordinates.
        u: (n,) their images.
        mirrored: whether the unit coordinates are mirrored.
    """
    vertices = np.arange(state.border)
    loops = [vertices[state.outer], *(vertices[loop.vertices] for loop in state.loops)]
    if not mirrored:
        return TriangulatedMap(z, u, state.faces, tuple(loops))
    return TriangulatedMap(
        z, u, np.ascontiguousarray(state.faces[:, ::-1]), tuple(loop[::-1] for loop in loops)
    )


def outer_loop(faces: Index, z: Complex) -> Index:
    """Return the vertices of the outer boundary of triangles (m, 3), counter-clockwise."""
    return max(Triangles(faces, z.size).loops(), key=lambda loop: polygon_area(z[loop]))
