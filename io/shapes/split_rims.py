"""Split the rims of meshes so that chords between written coordinates follow the outline (--subdivide-rim)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Complex, Index, Real
from ...maps.approximation import AnyMap
from ...meshes.flatten import Flattening
from ...meshes.mesh import Mesh
from ...meshes.patch import Patch
from ...meshes.topology import Triangles
from ...surfaces.subdivided import RimSplits, SplitLayout, Subdivision, least_heights, subdivision
from ..meshes.mesh_format import MeshFile
from .mesh_parts import join
from .mesh_shape import MeshShape

LEFT = "{} edges at the boundary stay straight, because adjacent triangles would flip (rim_edges_left)"

COARSE_TOLERANCES = 10  # a chord that deviates by more from the outline is reported


def missed(
    boundary: Mapping[str, float], tolerance: float, split: bool, *, divides: bool = False
) -> list[str]:
    """Return a note if chords between written coordinates deviate far from an outline, see `boundary` in the report.

    Args:
        boundary: the deviation.
        tolerance: the requested one.
        split: whether triangles at the rim were split already.
        divides: whether the command can divide all triangles.
    """
    if (gap := boundary["hausdorff"]) <= COARSE_TOLERANCES * tolerance:
        return []
    problem = (
        f"between vertices of the mesh, the boundary is up to {gap:.1%} of the diagonal away from the outline"
    )
    cure = "" if split else "; use --subdivide-rim to split its triangles there"
    if divides:
        cure += ", or --subdivide 3 to divide all of them, which also lets them stretch less" if cure else ""
    return [f"{problem}, because the mesh is too coarse (boundary){cure}"]


def subdivide_rims(
    parts: Sequence[MeshShape],
    images: Sequence[Complex],
    maps: Sequence[AnyMap],
    tolerance: float,
    layout_functions: Sequence[Callable[[Flattening], Complex]],
) -> tuple[list[MeshShape], dict[str, int], list[str]]:
    """Split the rims of parts of one file, except where triangles would flip; see `RimSplits`.

    `placed` returns the positions in the map's source of a part's vertices, split or not, rounded as in the file.

    Returns:
        The parts, numbers for the report, and notes.
    """
    splits = RimSplits.of([part.flattening for part in parts], images, maps, tolerance)
    split_parts, heights_before, edge_count = list(parts), None, splits.edges
    while splits.edges:
        layouts = splits.layouts_split()
        split_parts = _subdivided(parts, layouts)
        heights_before = heights_before or [
            _heights(part, place) for part, place in zip(parts, layout_functions)
        ]
        flipped = [
            _turned(heights, _heights(part, place), split.surface.original)
            for heights, part, place, split in zip(heights_before, split_parts, layout_functions, layouts)
        ]
        if not any(triangles.size for triangles in flipped):
            break
        split_parts, splits = list(parts), splits.without(flipped)
    added = sum(len(part.flattening.flat) - len(old.flattening.flat) for part, old in zip(split_parts, parts))
    edges_left = edge_count - splits.edges
    notes = [LEFT.format(edges_left)] if edges_left else []
    return split_parts, {"rim_vertices": added, "rim_edges_left": edges_left}, notes


def _heights(part: MeshShape, lay_out: Callable[[Flattening], Complex]) -> Real:
    return least_heights(part.flattening, lay_out(part.flattening))


def _turned(old_heights: Real, new_heights: Real, parents: Index) -> Index:
    """Return the triangles that were not flipped before, and have flipped parts."""
    return np.unique(parents[(old_heights[parents] > 0) & (new_heights <= 0)])


def _subdivided(parts: Sequence[MeshShape], splits: Sequence[SplitLayout]) -> list[MeshShape]:
    """Return parts of one file with their layouts split."""
    plans_of_parts = [subdivision(part.flattening, split.surface) for part, split in zip(parts, splits)]
    united = join(parts).file
    polygons = united.content.polygons
    face_marks = [part.file.faces for part in parts]
    plans = []
    for (plan, _, _), part, marks in zip(plans_of_parts, parts, face_marks):
        faces = np.flatnonzero(marks)
        shift = (polygons.starts[faces] - part.file.mesh.starts[:-1])[plan.faces]
        plans.append(Subdivision(faces[plan.faces], plan.corners + shift[:, None], plan.weights))
    joined_plan = Subdivision.joined(plans)
    content = united.content.subdivide(joined_plan)
    times = joined_plan.sizes(polygons.sizes)
    return [
        _with(part, split, how, part.file.part_of(content, np.repeat(marks, times)))
        for part, split, how, marks in zip(parts, splits, plans_of_parts, face_marks)
    ]


def _with(
    part: MeshShape, split: SplitLayout, how: tuple[Subdivision, Index, Index], file: MeshFile
) -> MeshShape:
    """Return the part with its split layout on the mesh of the new file."""
    old_flattening, surface = part.flattening, split.surface
    patch = old_flattening.patch
    corner = _corners(patch, split, how, file.mesh)
    vertex = np.empty(surface.count, np.int64)
    vertex[surface.faces] = file.mesh.corners[corner]
    new_numbers = np.zeros(len(patch.mesh.points), np.int64)
    new_numbers[patch.vertex] = vertex[: patch.vertex.size]
    points = surface.carried(patch.points)
    new_patch = Patch(
        file.mesh,
        points,
        Triangles(surface.faces, surface.count),
        vertex,
        corner,
        new_numbers[patch.seam],
        patch.notes,
    )
    loop = next(loop for loop in new_patch.loops if old_flattening.loop[0] in loop)
    return replace(
        part,
        file=file,
        flattening=Flattening(new_patch, split.flat, loop, old_flattening.method, old_flattening.notes),
    )


def _corners(patch: Patch, split: SplitLayout, how: tuple[Subdivision, Index, Index], mesh: Mesh) -> Index:
    """Return (m, 3) corners of all triangles in the mesh in which triangles replace polygons."""
    plan, rows, is_reversed = how
    parents = split.surface.original
    face = patch.polygon
    firsts = np.concatenate([[0], np.cumsum(plan.sizes(patch.mesh.sizes))])
    shift = mesh.starts[firsts[:-1]] - patch.mesh.starts[:-1]
    corner = patch.corner[parents] + shift[face[parents]][:, None]
    rank = np.arange(rows.size) - np.searchsorted(plan.faces, plan.faces)
    new = mesh.starts[firsts[plan.faces] + rank]
    corner[rows] = new[:, None] + np.where(is_reversed[:, None], [2, 1, 0], [0, 1, 2])
    return corner
