"""The target mesh with texture coordinates that show the texture: nothing is resampled."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ....arrays import Complex, Flags, Index, Real, complex_of, xy_of
from ....curve import Curve
from ....errors import InputError
from ....fits import leaves_bare
from ....flattening.opening import concave, not_convex
from ....maps.approximation import AnyMap
from ....maps.extended_inverse import ExtendedInverse
from ....maps.triangulated.map import TriangulatedMap
from ....meshes import layout
from ....meshes.flatten import Flattening
from ....meshes.locate import barycentric
from ....pixels.stmap import point_of, st_of
from ....pixels.texture import Texture
from ....result import Status
from ....surfaces.as_written import Written
from ....surfaces.boundary_slivers import with_room
from ... import formats
from ...materials.carried_maps import CarriedMaps
from ...meshes import mesh_files
from ...meshes.mesh_format import NewCoordinates, ShownPictures
from ...shapes.mesh_parts import join
from ...shapes.mesh_shape import MeshShape, as_mesh
from ...shapes.shape import Shape
from ...shapes.split_rims import missed, subdivide_rims
from .. import parts
from ..framing import placing_options
from ..job import Job
from ..state import Run
from ..texture import own_pictures
from .baked import Parts, parts_of
from .output import Output

SAME = 1e-6  # of the source's diagonal: points this close are the same


class TexturedMesh(Output):
    """A mesh with new texture coordinates."""

    shows = True

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """A mesh as target, and a suffix that holds texture coordinates."""
        if job.target is None:
            raise InputError(
                f"{self.name}: a deformation is in the plane and writes no mesh; use a picture's suffix"
            )
        if not onto_mesh:
            raise InputError(f"{self.name}: a mesh is written for a mesh as target; {job.target} is none")
        formats.check(self.name, "uv", "unknown suffix for -o")
        if leaves_bare(job.fit):
            raise InputError(
                f"{self.name}: with --fit {job.fit} parts of {job.target} have no coordinates; "
                "--bake leaves them transparent, --fit cover gives all of it some"
            )
        if job.edge == "mirror" or (placing_options(job) and job.edge != "repeat"):
            raise InputError(f"{self.name}: meshes show textures that repeat; use --edge repeat, or --bake")
        if _normal_map(job) is None:
            return
        if not mesh_files.format_of(self.name).shows_normals:
            suffix, able = formats.suffix_of(self.name), " or ".join(mesh_files.suffixes_with_materials())
            raise InputError(f"{self.name}: {suffix[1:].upper()} has no place for a normal map; use {able}")
        if job.carry_maps:
            raise InputError(
                f"{self.name}: --normal takes the place of the normals that --carry-maps carries; leave one out"
            )

    def check(self, run: Run) -> None:
        """Texture coordinates of a mesh source, and a texture that the format can show; tell which are not shown."""
        for source, _ in run.pairs:
            if source.is_mesh:
                _ = as_mesh(source).uv_faces
        for path in _textures_not_shown(run.job):
            run.note(f"{self.name}: does not show {path}; a mesh shows a --texture of colours and a --normal")
        for texture in (_shown_texture(run), _normal_map(run.job)):
            mesh_files.format_of(self.name).check_texture(Path(self.name), texture)
        if run.job.carry_maps:
            run.carried_maps.check(self.name)

    def beside(self, run: Run) -> list[str]:
        """Material library and picture."""
        shown = ShownPictures(_shown_texture(run), _normal_map(run.job))
        found = mesh_files.format_of(self.name).companions(Path(self.name), shown)
        if run.job.carry_maps:
            found += run.carried_maps.companions(self.name, shown=shown.texture is not None)
        return list(dict.fromkeys(found))

    def write(self, run: Run, path: Path) -> None:
        """The mesh, and what stands beside it."""
        lying, name = run.flat, Path(self.name)
        options: dict[str, Any] = {
            "texture": _shown_texture(run),
            "force": run.job.force,
            "threads": run.threads,
        }
        options |= {
            "carried_maps": run.carried_maps if run.job.carry_maps else None,
            "normals": _normal_map(run.job),
        }
        options |= {"tolerance": run.job.tolerance if run.job.subdivide_rim else None}
        with run.phases.timed("write"):
            figures = new_uvs(parts_of(run), lying, path, name=name, **options)
        run.note(*figures.pop("material_notes"))
        _measure(run, figures.pop("measured"))
        before = run.figures.get("also_written", [])
        run.figures |= figures | {"also_written": [*before, *figures["also_written"]]}


def _measure(run: Run, measured: list[Written]) -> None:
    """Report what the written coordinates of each part are, and note what the map behind them does not show."""
    whole, own = run.fit_report, [each.report() for each in measured]
    for found, figures in zip(whole.get("parts", []), own):
        found |= {key: found[key] | value for key, value in figures.items() if key in found}
    for figures in own[:1]:
        whole |= {key: whole[key] | value for key, value in figures.items()}
    widest = max((each.boundary["hausdorff"] for each in measured), default=0.0)
    if widest > run.job.tolerance and run.fit.status is Status.REACHED:
        at_most = f"at most {widest:.2%} of the picture's diagonal off (boundary)"
        whole["message"] = f"The mesh's vertices are on the outline; the edges between them are {at_most}."
    for pair, fit, each in zip(run.pairs, run.fits, measured):
        told = missed(each.boundary, run.job.tolerance, run.job.subdivide_rim)
        run.note(*(parts.label(pair, note) for note in told))
        if fit.distortion.strain is None and (strain := each.distortion.strain):
            said = "in its coordinates as written lengths change by more than {:.1f} times on 5 %, and by {:.0f} times"
            run.note(parts.label(pair, f"{said} as much one way as the other (stretch)".format(*strain)))


def _shown_texture(run: Run) -> Path | bytes | None:
    """The picture that a mesh with new coordinates shows: --texture, or that of a mesh source."""
    return (
        run.held_drawing or _first(run.job, "colour") or next(iter(own_pictures(run.job, run.source)), None)
    )


def _normal_map(job: Job) -> Path | None:
    """The normal map that such a mesh shows."""
    return _first(job, "normal")


def _first(job: Job, kind: str) -> Path | None:
    return next((Path(path) for path, is_kind in job.maps if is_kind == kind), None)


def _textures_not_shown(job: Job) -> list[str]:
    """The textures that such a mesh has no place for: numbers, normals with y down, further normals."""
    shown = _first(job, "colour"), _normal_map(job)
    return [path for path, _ in job.maps if Path(path) not in shown]


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
    tolerance: float | None = None,
) -> dict[str, Any]:
    """Write the target with texture coordinates that show the source's texture.

    Args:
        parts: those of the mesh, the map from the source's plane to each one's, and the source's shape; a mesh gives
            its own texture coordinates.
        lying: a texture of one texel, as the texture lies in the source's plane (not used with a mesh).
        out: temporary file to write.
        name: its final name.
        texture: picture file to bind to the mesh, or its content; None writes coordinates only.
        normals: a normal map to bind to it, y up, where the format shows one.
        force: whether the files beside it may be replaced (see `MeshFormat.companions`).
        threads: as many as there are processors by default.
        carried_maps: the other maps of its materials, if they are carried to the new coordinates.
        tolerance: relative to the source's diagonal: triangles at the rim are split until the chords of coordinates are
            off its outline by no more; None splits none.

    Returns:
        Figures for the report.

    Raises:
        InputError: the format holds no texture coordinates, or the source has none.
    """
    pulls = [ExtendedInverse(map, threads) for _, map, _ in parts]
    figures: dict[str, Any] = {"measured": []}
    told = list[str]()
    if tolerance is not None:
        shapes, maps, sources = zip(*parts)
        trials = [
            ExtendedInverse(map, threads) for map in maps
        ]  # they count what lies outside for themselves
        images = [pull(part.flattening.flat) for pull, part in zip(trials, shapes)]

        def placed(map: AnyMap, pull: ExtendedInverse, layout: Flattening) -> Complex:
            return complex_of(mesh_files.as_written(st_of(lying, _pull_back(map, pull, layout)), name))

        placing = [partial(placed, *each) for each in zip(maps, trials)]
        split, rims, told = subdivide_rims(shapes, images, maps, tolerance, placing)
        parts, figures = list(zip(split, maps, sources)), figures | rims
    target = join([part for part, _, _ in parts])
    found = [
        _uv_of(source, lying, _pull_back(map, pull, part.flattening), part, threads)
        for (part, map, source), pull in zip(parts, pulls)
    ]
    corners, triangles = target.corners
    uv, faces = _joined(found)
    corners[target.flattening.patch.corner] = faces
    new = NewCoordinates(uv, corners, triangles)
    pictures = {}
    if carried_maps is not None:
        pictures = carried_maps.carry(target.file, new, shown=texture is not None, threads=threads)
    shown = ShownPictures(texture, normals, pictures)
    written = mesh_files.write(target.file, new, shown, out, name, force=force)
    missing = written.notes
    if parts[0][2].is_mesh:
        figures["torn_triangles"] = torn = sum(each.torn for each in found)
        if torn:
            said = (
                f"{torn} triangles lie across seams of {parts[0][2].spec}, and show its texture up to there"
            )
            missing = [*missing, f"{name}: {said}; --bake makes a picture without seams"]
    else:  # a mesh's own layout may have mirrored charts
        rounded, patch = mesh_files.as_written(uv, name), target.flattening.patch
        points = np.split(point_of(lying, rounded), np.cumsum([len(each.uv) for each in found])[:-1])
        figures["measured"] = [
            Written.of(z, part.flattening, source.curve) for z, (part, _, source) in zip(points, parts)
        ]
        figures |= {"uv": layout.turned_over(rounded[faces]), "concave_polygons": concave(rounded, patch)}
        if count := figures["concave_polygons"]:
            missing = [*missing, f"{name}: {not_convex(count)}"]
    return figures | {
        "flattening": parts[0][0].flattening.report(),
        "outside_points": sum(pull.outside for pull in pulls),
        "outside_distance": max(pull.away / part.curve.diagonal for (part, _, _), pull in zip(parts, pulls)),
        "also_written": written.files,
        "material_notes": [*missing, *(f"{name}: {note}" for note in told)],
    }


def _pull_back(map: AnyMap, pull: ExtendedInverse, layout: Flattening) -> Complex:
    """Where a mesh's vertices come from; triangles for which the source's outline leaves no room are given some."""
    z = pull(layout.flat)
    if not isinstance(map, TriangulatedMap):
        return z
    return with_room(z, layout, Curve(map.polygon).diagonal)


class _Coordinates(NamedTuple):
    """New coordinates of a part of the target.

    Attributes:
        uv: (t, 2) coordinates.
        faces: (m, 3) those of its triangles' corners.
        torn: triangles that reach into several charts of the source.
    """

    uv: Real
    faces: Index
    torn: int = 0


def _joined(parts: Sequence[_Coordinates]) -> tuple[Real, Index]:
    """The coordinates of all parts, and those of their triangles' corners."""
    firsts = np.cumsum([0, *(len(part.uv) for part in parts)])
    faces = [part.faces + first for part, first in zip(parts, firsts)]
    return np.concatenate([part.uv for part in parts]), np.concatenate(faces)


def _uv_of(source: Shape, lying: Texture, z: Complex, target: MeshShape, threads: int | None) -> _Coordinates:
    """Of the target's vertices, which come from points z of the source's plane.

    On a mesh each face of the target is on the chart that its middle is on: corners beyond that chart's border are at
    the border's nearest point.
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
    own = np.repeat(chart[mesh.locator(middle, threads)[0]][face][:, None], 3, axis=1)
    beyond = chart[triangle][patch.faces] != own
    wanted, number = np.unique(
        np.column_stack([own[beyond], patch.faces[beyond]]), axis=0, return_inverse=True
    )
    more, away = np.empty((len(wanted), 2)), np.empty(len(wanted))
    for k in np.unique(wanted[:, 0]):
        at = wanted[:, 0] == k
        more[at], away[at] = _on_chart(mesh, chart == k, z[wanted[at, 1]])
    rows, torn = patch.faces.copy(), np.zeros(beyond.shape, bool)
    rows[beyond], torn[beyond] = z.size + number, (away > SAME * mesh.curve.diagonal)[number]
    return _Coordinates(np.concatenate([uv, more]), rows, int(torn.any(axis=1).sum()))


def _on_chart(mesh: MeshShape, chart: Flags, z: Complex) -> tuple[Real, Real]:
    """(p, 2) coordinates at those points of some triangles (m,) of a mesh that are nearest to points z of its plane,
    and (p,) how far these are."""
    import igl

    flat, faces = mesh.flattening.flat, mesh.flattening.patch.faces[chart]
    points, at = (np.column_stack([*xy_of(w).T, np.zeros(w.size)]) for w in (flat, z))
    tree = igl.AABB()
    tree.init(points, faces)
    squared, triangle, closest = tree.squared_distance(points, faces, at)
    triangle = np.atleast_1d(triangle)
    weights = barycentric(points[faces[triangle]], np.reshape(closest, (-1, 3)))
    uv = mesh.uv[mesh.uv_faces[chart][triangle]]
    return np.einsum("pk,pkc->pc", weights, uv), np.sqrt(np.atleast_1d(squared))
