"""An earlier map in a constraints file, to continue from: what `iccm edit` showed before the last change.

It is a triangulation of both shapes, with vertices in the units of their files (for meshes, in the flattening's
plane)::

    {"start": {"source": [[x, y], ...], "target": [[x, y], ...], "triangles": [[0, 1, 2], ...]}}

It is written as packed text (see `packed_map`), and both forms are read::

    {"start": {"packed": "...", "kept": "...", "springs": [1, ...]}}

`springs` are the stiffness of each pin's spring when the map was dragged, with which `iccm edit` continues. `kept` is
the fingerprint of the constraints and options whose map it is: with the same ones, the map is the result as
it is. With others, and without a fingerprint, the search continues from it until it has converged.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_serializer, model_validator

from ...arrays import Complex
from ...errors import InputError
from ...maps.triangulated.map import TriangulatedMap
from ...meshes.mesh import proper
from ...meshes.topology import Triangles
from ...plane import diagonal, polygon_area, triangle_areas
from .. import limits
from ..checked import StrictModel
from . import packed_map
from .shape import Shape

Number = Annotated[
    float, Field(allow_inf_nan=False, ge=-limits.COORDINATE, le=limits.COORDINATE, strict=True)
]
Spring = Annotated[float, Field(allow_inf_nan=False, ge=1, le=limits.COORDINATE, strict=True)]
Vertices = Annotated[list[tuple[Number, Number]], Field(min_length=3, max_length=limits.START_ENTRIES)]
Corner = Annotated[int, Field(ge=0, lt=limits.START_ENTRIES, strict=True)]

SAME_PLACE_SHARE = 1e-8  # of the diagonal: a vertex this close to a pin is that of the pin


class StartingMap(StrictModel):
    """Triangles with their corners in both shapes, in the units of the shapes' files."""

    source: Vertices
    target: Vertices
    triangles: Annotated[
        list[tuple[Corner, Corner, Corner]], Field(min_length=1, max_length=limits.START_ENTRIES)
    ]
    kept: Annotated[str, Field(max_length=limits.FINGERPRINT_DIGITS)] = ""
    springs: list[Spring] = Field([], max_length=limits.PAGE_PINS)

    @model_validator(mode="before")
    @classmethod
    def _unpack(cls, data: Any) -> Any:
        if not (isinstance(data, dict) and isinstance(data.get("packed"), str)):
            return data
        remaining = {name: value for name, value in data.items() if name != "packed"}
        if remaining.keys() - {"kept", "springs"}:
            return data
        source, target, triangles = packed_map.unpack(data["packed"])
        return {
            "source": [tuple(place) for place in source.tolist()],
            "target": [tuple(place) for place in target.tolist()],
            "triangles": [tuple(corners) for corners in triangles.tolist()],
            **remaining,
        }

    @model_serializer
    def _pack(self) -> dict[str, Any]:
        source, target = np.array(self.source, np.float64), np.array(self.target, np.float64)
        triangles = np.array(self.triangles, np.int64)
        packed: dict[str, Any] = {"packed": packed_map.pack(packed_map.PackedMap(source, target, triangles))}
        return packed | {name: value for name in ("kept", "springs") if (value := getattr(self, name))}

    @classmethod
    def of(
        cls,
        map: TriangulatedMap,
        source: Shape,
        target: Shape,
        *,
        pins: Complex | None = None,
        kept: str = "",
        springs: Sequence[float] = (),
    ) -> StartingMap:
        """Convert a map to the form of a constraints file, with rounded coordinates.

        Args:
            map: from the source to the target.
            source: its shape.
            target: as above.
            pins: (k,) points of the source, in the core plane. Vertices there are rounded finely, like those of the
                outlines; None rounds all vertices finely, for a map that is rounded already.
            kept: fingerprint of the constraints whose map this is as it is; empty if it is to converge.
            springs: stiffness of each pin's spring, rounded to four digits.
        """
        is_fine = np.ones(map.source.size, bool)
        if pins is not None:
            same_distance = SAME_PLACE_SHARE * diagonal(map.source)
            is_fine = np.isin(np.arange(map.source.size), np.concatenate(map.loops))
            is_fine |= (np.abs(map.source[:, None] - pins) <= same_distance).any(axis=1)
        source_points = np.reshape(source.to_file(map.source), (-1, 2))
        target_points = np.reshape(target.to_file(map.image), (-1, 2))
        rounded = packed_map.round_map(source_points, target_points, map.faces, is_fine)
        return cls.model_construct(
            source=[(x, y) for x, y in rounded.source.tolist()],
            target=[(x, y) for x, y in rounded.target.tolist()],
            triangles=[(a, b, c) for a, b, c in rounded.triangles.tolist()],
            kept=kept,
            springs=[float(f"{stiffness:.4g}") for stiffness in springs],
        )

    def map(self, source: Shape, target: Shape) -> TriangulatedMap:
        """Return the map between two shapes; `maps.joined.split` returns those of parts that are mapped separately.

        Raises:
            InputError: the triangles do not form disks, with or without holes, or overlap.
        """
        z, w = source.to_core(self.source), target.to_core(self.target)
        faces = np.array(self.triangles, dtype=np.int64)
        if len(z) != len(w):
            raise InputError(f"start: has {len(z)} vertices in the source but {len(w)} in the target")
        if not np.array_equal(np.unique(faces), np.arange(len(z))):
            raise InputError(f"start: each of its {len(z)} vertices must belong to a triangle")
        for side, points in (("source", z), ("target", w)):
            if not proper(faces).all() or (triangle_areas(points[faces]) <= 0).any():
                raise InputError(f"start: a triangle is flipped or has no area in the {side}")
        return TriangulatedMap(z, w, faces, _loops(z, faces))


def _loops(z: Complex, faces: NDArray[np.int64]) -> tuple[NDArray[np.int64], ...]:
    """Return the boundary loops of each part, its outer one first.

    Raises:
        InputError: a part is not a disk with holes.
    """
    shape = Triangles(faces, len(z))
    ends = shape.tail[shape.twin < 0]
    is_sound = shape.crowded_edges == 0 and np.unique(ends).size == ends.size
    loops = shape.loops() if is_sound else []
    numbers, ordered = shape.components(), list[NDArray[np.int64]]()
    for part in range(numbers.max() + 1):
        own_faces = faces[numbers == part]
        own = Triangles(
            np.unique(own_faces, return_inverse=True)[1].reshape(-1, 3), np.unique(own_faces).size
        )
        own_loops = [loop for loop in loops if np.isin(loop[0], own_faces)]
        if not own_loops or own.count - own.edge_count + len(own.faces) != 2 - len(own_loops):
            raise InputError("start: the triangles do not form a disk, with or without holes")
        ordered += sorted(own_loops, key=lambda loop: -polygon_area(z[loop]))
    return tuple(ordered)
