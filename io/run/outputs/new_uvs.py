"""New texture coordinates for the target mesh: the preimages of its vertices in the source's picture or layout."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ....arrays import Complex, Flags, Index, Real, complex_of, xy_of
from ....curve import Curve
from ....flattening.opening import concave, not_convex
from ....maps.approximation import AnyMap
from ....maps.extended_inverse import ExtendedInverse
from ....maps.triangulated.map import TriangulatedMap
from ....meshes import layout
from ....meshes.flatten import Flattening
from ....meshes.locate import barycentric
from ....pixels.stmap import point_of, st_of
from ....pixels.texture import Texture
from ....surfaces.as_written import WrittenCoordinates
from ....surfaces.boundary_slivers import with_room
from ...materials.carried_maps import CarriedMaps
from ...meshes import mesh_files
from ...meshes.mesh_format import NewCoordinates, ShownPictures
from ...shapes.mesh_parts import join
from ...shapes.mesh_shape import MeshShape, as_mesh
from ...shapes.shape import Shape
from ...shapes.split_rims import subdivide_rims
from .baked import Parts

SAME_POINT_SHARE = 1e-6  # relative to the source's diagonal: points this close are considered the same


@dataclass(frozen=True, eq=False)
class NewUVs:
    """The result of writing a mesh with new texture coordinates.

    Attributes:
        figures: entries of the report.
        measured: distortion and outline of each part's written coordinates; empty for those in a mesh's layout.
        files: names of the files that were written beside the mesh.
        notes: what could not be kept, or may surprise the user.
    """

    figures: dict[str, Any]
    measured: list[WrittenCoordinates] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def new_uvs(
    parts: Parts,
    lying: Texture,
    out: Path,
    *,
    name: Path,
    texture: Path | bytes | None = None,
    normals: Path | None = None,
    force: bool = False,
    threads: int | None = None,
    carried_maps: CarriedMaps | None = None,
    padding: int | None = None,
    tolerance: float | None = None,
) -> NewUVs:
    """Write the target with texture coordinates that show the source's texture.

    Args:
        parts: of the mesh, with the map from the source's plane to each, and the source's shape; a mesh provides its
            own texture coordinates.
        lying: a texture of one texel in the texture's place in the source's plane (not used for a mesh).
        out: temporary file to write.
        name: its final name.
        texture: picture file to bind to the mesh, or its content; None writes coordinates only.
        normals: a normal map to bind to it, y up, if the format supports one.
        force: whether files beside it may be replaced (see `MeshFormat.companions`).
        threads: number of threads; None for all processors.
        carried_maps: further textures of its materials, if they are carried to the new coordinates.
        padding: texels by which their colours extend beyond charts; see `BakeSettings`.
        tolerance: relative to the source's diagonal: triangles at the boundary are split until the edges of the layout
            deviate from the outline by no more; None splits none.

    Raises:
        InputError: the format cannot hold texture coordinates, or the source has none.
    """
    pulls = [ExtendedInverse(map, threads) for _, map, _ in parts]
    figures, measured, rim_notes = dict[str, Any](), list[WrittenCoordinates](), list[str]()
    if tolerance is not None:
        shapes, maps, sources = zip(*parts)
        # separate ones, because they also count what lies outside
        trials = [ExtendedInverse(map, threads) for map in maps]
        images = [pull(part.flattening.flat) for pull, part in zip(trials, shapes)]

        def placed(map: AnyMap, pull: ExtendedInverse, layout: Flattening) -> Complex:
            return complex_of(mesh_files.as_written(st_of(lying, pull_back(map, pull, layout)), name))

        placing = [partial(placed, map, trial) for map, trial in zip(maps, trials)]
        split, rims, rim_notes = subdivide_rims(shapes, images, maps, tolerance, placing)
        parts, figures = list(zip(split, maps, sources)), figures | rims
    target = join([part for part, _, _ in parts])
    coordinates = [
        _uv_of(source, lying, pull_back(map, pull, part.flattening), part, threads)
        for (part, map, source), pull in zip(parts, pulls)
    ]
    corners, triangles = target.corners
    uv, faces = _joined(coordinates)
    corners[target.flattening.patch.corner] = faces
    new = NewCoordinates(uv, corners, triangles)
    pictures, notes = ShownPictures(texture, normals), list[str]()
    if carried_maps is not None:
        carried = carried_maps.carry(
            target.file, new, retextured=texture is not None, padding=padding, threads=threads
        )
        pictures = replace(pictures, pictures=carried.pictures)
        notes += [f"{name}: {note}" for note in carried.notes]
    written = mesh_files.write(target.file, new, pictures, out, name, force=force)
    notes += written.notes
    if parts[0][2].is_mesh:
        figures["torn_triangles"] = torn = sum(part.torn for part in coordinates)
        if torn:
            seams = f"across seams of {parts[0][2].spec}, and show its texture only up to the seam"
            cure = "use --bake to make a picture without seams"
            notes.append(f"{name}: {torn} triangles lie {seams}; {cure}")
    else:  # a mesh's own layout may have mirrored charts
        rounded, patch = mesh_files.as_written(uv, name), target.flattening.patch
        points = np.split(point_of(lying, rounded), np.cumsum([len(part.uv) for part in coordinates])[:-1])
        for z, (part, _, source) in zip(points, parts):
            measured.append(WrittenCoordinates.of(z, part.flattening, source.curve))
        figures["uv"] = layout.turned_over(rounded[faces], patch.points[patch.faces])
        figures["concave_polygons"] = count = concave(rounded, patch)
        if count:
            notes.append(f"{name}: {not_convex(count)}")
    figures["flattening"] = parts[0][0].flattening.report()
    figures["outside_points"] = sum(pull.outside for pull in pulls)
    away = [pull.away / part.curve.diagonal for (part, _, _), pull in zip(parts, pulls)]
    figures["outside_distance"] = max(away)
    notes += [f"{name}: {note}" for note in rim_notes]
    return NewUVs(figures, measured, written.files, notes)


def pull_back(map: AnyMap, pull: ExtendedInverse, layout: Flattening) -> Complex:
    """Return the preimages of a mesh's vertices, adjusted where the source's outline leaves no room for a triangle."""
    z = pull(layout.flat)
    if not isinstance(map, TriangulatedMap):
        return z
    return with_room(z, layout, Curve(map.polygon).diagonal)


class _Coordinates(NamedTuple):
    """New coordinates of a part of the target.

    Attributes:
        uv: (t, 2) coordinates.
        faces: (m, 3) indices of its triangles' corners.
        torn: number of triangles that reach into several charts of the source.
    """

    uv: Real
    faces: Index
    torn: int = 0


def _joined(parts: Sequence[_Coordinates]) -> tuple[Real, Index]:
    """Return the coordinates of all parts, and the indices of their triangles' corners."""
    firsts = np.cumsum([0, *(len(part.uv) for part in parts)])
    faces = [part.faces + first for part, first in zip(parts, firsts)]
    return np.concatenate([part.uv for part in parts]), np.concatenate(faces)


def _uv_of(source: Shape, lying: Texture, z: Complex, target: MeshShape, threads: int | None) -> _Coordinates:
    """Return coordinates of the target's vertices from their preimages z in the source's plane.

    On a mesh, each face of the target is assigned to the chart that contains its centre; corners beyond that chart's
    border are moved to the nearest point of the border.
    """
    patch = target.flattening.patch
    if not source.is_mesh:
        return _Coordinates(st_of(lying, z), patch.faces)
    mesh = as_mesh(source)
    faces = mesh.uv_faces
    triangle, weights = mesh.locator(z, threads)
    uv = np.einsum("pk,pkc->pc", weights, mesh.uv[faces[triangle]])
    chart = layout.charts(faces, len(mesh.uv))[faces[:, 0]]
    _, face = np.unique(patch.polygon, return_inverse=True)
    centre, count = z[patch.faces].mean(axis=1), np.bincount(face)
    middle = complex_of(np.column_stack([np.bincount(face, part) / count for part in xy_of(centre).T]))
    face_chart = np.repeat(chart[mesh.locator(middle, threads)[0]][face][:, None], 3, axis=1)
    beyond = chart[triangle][patch.faces] != face_chart
    moved_corners, number = np.unique(
        np.column_stack([face_chart[beyond], patch.faces[beyond]]), axis=0, return_inverse=True
    )
    border_uv, away = np.empty((len(moved_corners), 2)), np.empty(len(moved_corners))
    for k in np.unique(moved_corners[:, 0]):
        in_chart = moved_corners[:, 0] == k
        border_uv[in_chart], away[in_chart] = _on_chart(mesh, chart == k, z[moved_corners[in_chart, 1]])
    rows, torn = patch.faces.copy(), np.zeros(beyond.shape, bool)
    rows[beyond], torn[beyond] = z.size + number, (away > SAME_POINT_SHARE * mesh.curve.diagonal)[number]
    return _Coordinates(np.concatenate([uv, border_uv]), rows, int(torn.any(axis=1).sum()))


def _on_chart(mesh: MeshShape, chart: Flags, z: Complex) -> tuple[Real, Real]:
    """Return (p, 2) coordinates at the points of some triangles (m,) of a mesh that are nearest to points z of its
    plane, and (p,) their distances.
    """
    import igl

    flat, faces = mesh.flattening.flat, mesh.flattening.patch.faces[chart]
    points, queries = _in_space(flat), _in_space(z)
    tree = igl.AABB()
    tree.init(points, faces)
    squared, triangle, closest = tree.squared_distance(points, faces, queries)
    triangle = np.atleast_1d(triangle)
    weights = barycentric(points[faces[triangle]], np.reshape(closest, (-1, 3)))
    uv = mesh.uv[mesh.uv_faces[chart][triangle]]
    return np.einsum("pk,pkc->pc", weights, uv), np.sqrt(np.atleast_1d(squared))


def _in_space(z: Complex) -> Real:
    """Return points (p, 3) at height 0 above points z (p,) of the plane."""
    return np.column_stack([*xy_of(z).T, np.zeros(z.size)])
