"""Holes without a partner: filled in the source, cut out of what is filled in the target."""

from typing import NamedTuple

import numpy as np

from ...arrays import Index
from ..model.discrete_map import DiscreteMap
from ..model.sketch import Sketch


class Cut(NamedTuple):
    """A map without the triangles that fill holes of the target.

    Attributes:
        vertices: (n,) those of the map that stay.
        faces: (m, 3) triangles, of these.
        loops: boundary vertices, the outer loop first, counter-clockwise, then those of holes, clockwise, in the order
            of the target's.
        partners: for each hole's loop, which hole of the source and of the target it is; -1 for a slit.
        lines: (l, 2) vertices of the edges of strokes.
    """

    vertices: Index
    faces: Index
    loops: tuple[Index, ...]
    partners: tuple[tuple[int, int], ...]
    lines: Index


def without_filled(state: DiscreteMap | Sketch, *, mirrored: bool) -> Cut:
    """The map without the triangles that fill holes of the target; those that fill holes of the source stay, so that
    the picture has no crack. Triangles and loops turn as in a mirror if the unit coordinates are `mirrored`."""
    opened = [loop for loop in state.filled if loop.source < 0]
    faces = state.material if opened else state.faces
    used = np.unique(faces)
    place = np.full(state.z.size, -1)
    place[used] = np.arange(used.size)
    holes = sorted((*state.loops, *opened), key=lambda loop: loop.target)
    loops = tuple(place[vertices] for vertices in (state.outer, *(hole.vertices for hole in holes)))
    faces = place[faces]
    if mirrored:
        faces, loops = np.ascontiguousarray(faces[:, ::-1]), tuple(loop[::-1].copy() for loop in loops)
    partners = tuple((hole.source, hole.target) for hole in holes)
    return Cut(used, faces, loops, partners, place[state.lines])
