"""Meshes whose rim is split, so that chords between written coordinates follow the outline (--subdivide-rim)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Complex, Index
from ...maps.approximation import AnyMap
from ...meshes.flatten import Flattening
from ...meshes.mesh import Mesh
from ...meshes.patch import Patch
from ...meshes.topology import Triangles
from ...surfaces.subdivided import SplitLayout, Subdivision, split_rims, subdivision
from ..meshes import mesh_files
from .mesh_parts import join
from .mesh_shape import MeshShape


def subdivide_rims(
    parts: Sequence[MeshShape], images: Sequence[Complex], maps: Sequence[AnyMap], tolerance: float
) -> tuple[list[MeshShape], int]:
    """Parts of one file with their rims split, and how many vertices that adds to them; see `split_rims`."""
    splits = split_rims([part.flattening for part in parts], images, maps, tolerance)
    added = sum(split.surface.count - len(part.flattening.flat) for part, split in zip(parts, splits))
    if not added:
        return list(parts), 0
    found = [subdivision(part.flattening, split.surface) for part, split in zip(parts, splits)]
    united = join(parts).file
    held = mesh_files.held(united)
    chosen = [mesh_files.marked(part.file, united) for part in parts]
    plans = []
    for (plan, _, _), part, own in zip(found, parts, chosen):
        faces = np.flatnonzero(own)
        shift = (held.starts[faces] - part.file.mesh.starts[:-1])[plan.faces]
        plans.append(Subdivision(faces[plan.faces], plan.corners + shift[:, None], plan.weights))
    whole = Subdivision.joined(plans)
    made = mesh_files.subdivided(united, whole)
    times = whole.sizes(held.sizes)
    return [
        _with(part, split, how, mesh_files.part_of(made, np.repeat(own, times), part.file))
        for part, split, how, own in zip(parts, splits, found, chosen)
    ], added


def _with(
    part: MeshShape, split: SplitLayout, how: tuple[Subdivision, Index, Index], file: mesh_files.MeshFile
) -> MeshShape:
    """The part on the new file's mesh."""
    before, surface = part.flattening, split.surface
    patch = before.patch
    corner = _corners(patch, split, how, file.mesh)
    vertex = np.empty(surface.count, np.int64)
    vertex[surface.faces] = file.mesh.corners[corner]
    now = np.zeros(len(patch.mesh.points), np.int64)
    now[patch.vertex] = vertex[: patch.vertex.size]
    points = surface.carried(patch.points)
    whole = Patch(
        file.mesh,
        points,
        Triangles(surface.faces, surface.count),
        vertex,
        corner,
        now[patch.seam],
        patch.notes,
    )
    loop = next(loop for loop in whole.loops if before.loop[0] in loop)
    return replace(
        part, file=file, flattening=Flattening(whole, split.flat, loop, before.method, before.notes)
    )


def _corners(patch: Patch, split: SplitLayout, how: tuple[Subdivision, Index, Index], mesh: Mesh) -> Index:
    """(m, 3) corners of a mesh in which triangles stand in the place of polygons, of all triangles."""
    plan, rows, turned = how
    own = split.surface.own
    face = np.searchsorted(patch.mesh.starts, patch.corner[:, 0], side="right") - 1
    firsts = np.concatenate([[0], np.cumsum(plan.sizes(patch.mesh.sizes))])
    shift = mesh.starts[firsts[:-1]] - patch.mesh.starts[:-1]
    corner = patch.corner[own] + shift[face[own]][:, None]
    rank = np.arange(rows.size) - np.searchsorted(plan.faces, plan.faces)
    new = mesh.starts[firsts[plan.faces] + rank]
    corner[rows] = new[:, None] + np.where(turned[:, None], [2, 1, 0], [0, 1, 2])
    return corner
