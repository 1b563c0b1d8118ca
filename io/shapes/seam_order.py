"""In which order the seams of two closed meshes run through pins, and where on the source."""

from collections.abc import Sequence

import numpy as np

from ...meshes.disk_patch import nearest, sound_piece
from ...surfaces.inserted import Opening
from ...surfaces.seams import agreed_order, same_seam
from ..meshes import mesh_files
from ..meshes.obj import Obj
from ..point_syntax import Place
from .mesh_shape import point_of, split_at


def seam_order(
    specs: tuple[str, str], wholes: tuple[Obj | None, Obj | None], pins: Sequence[tuple[Place, Place]]
) -> tuple[list[int], Opening | None]:
    """Numbers of the pins in the order in which both meshes are best cut through them, if both are closed, and where
    the source is best cut, if not along geodesics.

    Args:
        specs: of source and target.
        wholes: what is known of them, as for `mesh_shape.read`.
        pins: on source and target.

    Raises:
        InputError: a mesh cannot be read, or has no such vertex.
    """
    given = list(range(len(pins)))
    found = [mesh_files.read(spec, whole) for spec, whole in zip(specs, wholes)]
    if any(file.chart for file in found):
        return given, None
    points = [
        np.array([point_of(file, spec, pair[side]) for pair in pins])
        for side, (file, spec) in enumerate(zip(found, specs))
    ]
    found[0] = split_at(found[0], points[0])
    source, target = (sound_piece(file.mesh, file.piece or 1) for file in found)
    if any(patch.loops or patch.genus for patch in (source, target)):
        return given, None
    stops = np.column_stack([nearest(patch, each) for patch, each in zip((source, target), points)])
    if any(np.unique(side).size < side.size for side in stops.T):
        return given, None
    order = agreed_order(source, target, stops)
    return order.tolist(), same_seam(source, target, stops[order])
