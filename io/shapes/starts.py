"""An earlier map in a constraints file, to continue from: what `iccm edit` showed before the last change.

It is a triangulation of both shapes, with vertices in the units of their files (for meshes, in the flattening's
plane)::

    {"start": {"source": [[x, y], ...], "target": [[x, y], ...], "triangles": [[0, 1, 2], ...]}}
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ...arrays import Complex
from ...errors import InputError
from ...maps.triangulated.map import TriangulatedMap
from ...meshes.mesh import proper
from ...meshes.topology import Triangles
from ...plane import polygon_area, triangle_areas
from .. import limits
from ..checked import StrictModel
from .shape import Shape

Number = Annotated[
    float, Field(allow_inf_nan=False, ge=-limits.COORDINATE, le=limits.COORDINATE, strict=True)
]
Vertices = Annotated[list[tuple[Number, Number]], Field(min_length=3, max_length=limits.START_ENTRIES)]
Corner = Annotated[int, Field(ge=0, lt=limits.START_ENTRIES, strict=True)]


class StartingMap(StrictModel):
    """Triangles with their corners in both shapes, in the units of the shapes' files."""

    source: Vertices
    target: Vertices
    triangles: Annotated[
        list[tuple[Corner, Corner, Corner]], Field(min_length=1, max_length=limits.START_ENTRIES)
    ]

    @classmethod
    def of(cls, map: TriangulatedMap, source: Shape, target: Shape) -> StartingMap:
        """Convert a map to the form of a constraints file."""
        rows = (shape.to_file(w) for shape, w in ((source, map.source), (target, map.image)))
        digits = [[(float(f"{x:.12g}"), float(f"{y:.12g}")) for x, y in side.tolist()] for side in rows]
        faces = [(a, b, c) for a, b, c in map.faces.tolist()]
        return cls.model_construct(source=digits[0], target=digits[1], triangles=faces)

    def map(self, source: Shape, target: Shape) -> TriangulatedMap:
        """Return the map between two shapes.

        Raises:
            InputError: the triangles do not form a disk, with or without holes, or overlap.
        """
        z, w = source.to_core(self.source), target.to_core(self.target)
        faces = np.array(self.triangles, dtype=np.int64)
        if len(z) != len(w):
            raise InputError(f"start: has {len(z)} vertices in the source but {len(w)} in the target")
        if not np.array_equal(np.unique(faces), np.arange(len(z))):
            raise InputError(f"start: the triangles must use each of its {len(z)} vertices")
        for side, at in (("source", z), ("target", w)):
            if not proper(faces).all() or (triangle_areas(at[faces]) <= 0).any():
                raise InputError(f"start: a triangle is flipped or has no area in the {side}")
        return TriangulatedMap(z, w, faces, _loops(z, faces))


def _loops(z: Complex, faces: NDArray[np.int64]) -> tuple[NDArray[np.int64], ...]:
    """Return the boundary loops, the outer one first.

    Raises:
        InputError: the triangles do not form a disk with holes.
    """
    shape = Triangles(faces, len(z))
    ends = shape.tail[shape.twin < 0]
    sound = shape.components().max() == 0 and shape.crowded_edges == 0 and np.unique(ends).size == ends.size
    loops = shape.loops() if sound else []
    if not loops or shape.count - shape.edge_count + len(faces) != 2 - len(loops):
        raise InputError("start: the triangles do not form a disk, with or without holes")
    size = [polygon_area(z[k]) for k in loops]
    return tuple(loops[k] for k in np.argsort([-s for s in size], kind="stable"))
