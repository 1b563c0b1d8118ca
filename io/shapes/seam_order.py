"""In which order the seams of two closed meshes run through pins, and where on the source; pins of meshes of the same
connectivity."""

from collections.abc import Sequence

import numpy as np

from ...meshes.disk_patch import nearest, sound_piece
from ...meshes.geodesics import GeodesicGraph
from ...surfaces.inserted import Opening
from ...surfaces.isomorphism import Polygons, isomorphism
from ...surfaces.seams import agreed_order, same_seam
from ..meshes import mesh_files
from ..meshes.obj import Obj
from ..point_syntax import Place
from .mesh_shape import point_of, split_at

MARKS = 5  # vertices of meshes of the same connectivity that are pins: of a body, its head, hands and feet


def same_vertices(specs: tuple[str, str], wholes: tuple[Obj | None, Obj | None]) -> list[tuple[Place, Place]]:
    """Vertices far apart of two closed meshes of the same connectivity, as pins; none where it is another.

    Args:
        specs: of source and target.
        wholes: what is known of them, as for `mesh_shape.read`.

    Raises:
        InputError: a mesh cannot be read.
    """
    found = [mesh_files.read(spec, whole) for spec, whole in zip(specs, wholes)]
    if any(file.chart for file in found) or found[0].mesh.corners.size != found[1].mesh.corners.size:
        return []
    source, target = (sound_piece(file.mesh, file.piece or 1) for file in found)
    if any(patch.loops or patch.genus for patch in (source, target)):
        return []
    partner = np.arange(len(target.points))
    if not np.array_equal(source.faces, target.faces):
        corner = isomorphism(*(Polygons.triangles(each.points, each.faces) for each in (source, target)))
        if corner is None:
            return []
        partner[target.faces.ravel()] = source.faces.ravel()[corner]
    graph, count = GeodesicGraph.of(target.points, target.triangles), len(target.points)
    stops = [int(np.argmax(graph.distances(np.zeros(1, np.int64))[0, :count]))]
    while len(stops) < min(MARKS, count):
        stops.append(int(np.argmax(graph.distances(np.array(stops))[:, :count].min(axis=0))))
    rows = source.vertex[partner[stops]] + found[0].mesh.base, target.vertex[stops] + found[1].mesh.base
    return [(f"v{a}", f"v{b}") for a, b in zip(*rows)]


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
