"""Concavities, and holes without a partner: these are filled in the source, and cut out of what is filled in the
target.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ...meshes.topology import Triangles
from ...plane import polygon_area
from ..model.discrete_map import BAY
from ..model.mesh_map import MeshMap


class Cut(NamedTuple):
    """A map without the triangles that fill concavities, and holes of the target.

    Attributes:
        vertices: (n,) those of the map that stay.
        faces: (m, 3) triangles, of these.
        loops: boundary vertices, the outer loop first, counter-clockwise, then those of holes, clockwise, in the order
            of the target's.
        partners: for each hole's loop, which hole of the source and of the target it is; -1 for a slit.
        lines: (l, 2) vertices of the edges of strokes.
        filled: where there are concavities, the vertices of the outer loop with these, of the map that is cut.
    """

    vertices: Index
    faces: Index
    loops: tuple[Index, ...]
    partners: tuple[tuple[int, int], ...]
    lines: Index
    filled: Index | None


def without_filled(state: MeshMap, *, mirrored: bool) -> Cut:
    """Return the map without the triangles that fill concavities, and holes of the target; those that fill holes of the
    source stay, so that the picture has no crack. Triangles and loops turn as in a mirror if the unit coordinates are
    `mirrored`.
    """
    opened = [loop for loop in state.filled if loop.source < 0 <= loop.target]
    weights: Real = np.ones(len(state.faces)) if state.weights is None else state.weights
    bays = bool(np.any(weights == BAY))
    kept: Flags = weights == 1 if opened else weights != BAY
    faces = state.faces[kept]
    used = np.unique(faces)
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


def outer_loop(faces: Index, z: Complex) -> Index:
    """Return the vertices of the boundary of triangles (m, 3) that surrounds them, counter-clockwise."""
    return max(Triangles(faces, z.size).loops(), key=lambda loop: polygon_area(z[loop]))
