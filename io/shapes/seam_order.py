"""Choose the order in which seams of two closed meshes run through pins, and their path on the source.

For meshes with the same connectivity, also choose the pins.
"""

from collections.abc import Sequence
from itertools import chain

import numpy as np

from ...arrays import Index
from ...errors import InputError
from ...flattening import flatten
from ...meshes.disk_patch import nearest, sound_piece
from ...meshes.geodesics import GeodesicGraph
from ...meshes.patch import Patch
from ...surfaces.inserted import Opening
from ...surfaces.isomorphism import Polygons, isomorphism
from ...surfaces.seams import COARSE_TRIANGLES, Opened, agreed_orders, same_seam
from ..meshes import mesh_files
from ..meshes.mesh_format import MeshFormat
from ..point_syntax import Place
from .mesh_reading import point_of, split_at

MAPS_TRIED = 3
"""Maps tried for small meshes until one is not twisted, each with another seam."""
PINNED_VERTICES = 5
"""Pins for meshes with the same connectivity: on a body, its head, hands and feet."""


def same_vertices(specs: tuple[str, str], opened: tuple[MeshFormat, MeshFormat]) -> list[tuple[Place, Place]]:
    """Return vertices far apart of two closed meshes with the same connectivity, as pins; empty for other meshes.

    Args:
        specs: of source and target.
        opened: their files.

    Raises:
        InputError: a mesh cannot be read.
    """
    mesh_parts = [mesh_files.read(spec, file) for spec, file in zip(specs, opened)]
    if any(file.chart for file in mesh_parts):
        return []
    if mesh_parts[0].mesh.corners.size != mesh_parts[1].mesh.corners.size:
        return []
    source, target = (sound_piece(file.mesh, file.piece or 1) for file in mesh_parts)
    if any(patch.loops or patch.genus for patch in (source, target)):
        return []
    partner = np.arange(len(target.points))
    if not np.array_equal(source.faces, target.faces):
        corner = isomorphism(*(Polygons.triangles(part.points, part.faces) for part in (source, target)))
        if corner is None:
            return []
        partner[target.faces.ravel()] = source.faces.ravel()[corner]
    graph, count = GeodesicGraph.of(target.points, target.triangles), len(target.points)
    stops = [int(np.argmax(graph.distances(np.zeros(1, np.int64))[0, :count]))]
    while len(stops) < min(PINNED_VERTICES, count):
        stops.append(int(np.argmax(graph.distances(np.array(stops))[:, :count].min(axis=0))))
    rows = (
        source.vertex[partner[stops]] + mesh_parts[0].mesh.base,
        target.vertex[stops] + mesh_parts[1].mesh.base,
    )
    return [(f"v{a}", f"v{b}") for a, b in zip(*rows)]


def seam_order(
    specs: tuple[str, str], opened: tuple[MeshFormat, MeshFormat], pins: Sequence[tuple[Place, Place]]
) -> tuple[list[int], Opening | None]:
    """Return the best order of pins for cutting two closed meshes, and a path on the source if not along geodesics.

    The order is a list of indices, unchanged if the meshes are not closed.

    Args:
        specs: of source and target.
        opened: their files.
        pins: on source and target.

    Raises:
        InputError: a mesh cannot be read, or does not have such a vertex.
    """
    as_given = list(range(len(pins)))
    mesh_parts = [mesh_files.read(spec, file) for spec, file in zip(specs, opened)]
    if any(file.chart for file in mesh_parts):
        return as_given, None
    points = [
        np.array([point_of(file, spec, pair[side]) for pair in pins])
        for side, (file, spec) in enumerate(zip(mesh_parts, specs))
    ]
    mesh_parts[0] = split_at(mesh_parts[0], points[0])
    source, target = (sound_piece(file.mesh, file.piece or 1) for file in mesh_parts)
    if any(patch.loops or patch.genus for patch in (source, target)):
        return as_given, None
    stops = np.column_stack([nearest(patch, positions) for patch, positions in zip((source, target), points)])
    if any(np.unique(side).size < side.size for side in stops.T):
        return as_given, None
    orders = agreed_orders(source, target, stops)
    candidates = ((order, same_seam(source, target, stops[order])) for order in orders[:MAPS_TRIED])
    best = next(candidates)
    if len(orders) > 1 and max(len(source.faces), len(target.faces)) <= COARSE_TRIANGLES:
        fine = (
            seam for seam in chain([best], candidates) if not _twists(source, target, stops[seam[0]], seam[1])
        )
        best = next(fine, best)
    return best[0].tolist(), best[1]


def _twists(source: Patch, target: Patch, stops: Index, opening: Opening | None) -> bool:
    """Return whether the map of two surfaces cut in this way is twisted, or does not exist."""
    from ...solve import fit

    try:
        opened = Opened.of(source, target, stops, opening)
        layouts = [flatten(patch) for patch in opened.patches]
        return not fit(*layouts, pins=np.column_stack(opened.pins(layouts))).status.ok
    except InputError:
        return True
