"""The run of `iccm relayout`: inputs, outputs and report."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ... import __version__
from ...arrays import Real
from ...errors import InputError
from ...meshes.charted import Charted
from ...meshes.layout import CONFLICTING_SHARE, is_stacked
from ...meshes.mesh import check
from ...meshes.relayout import (
    COLOUR_TEXELS_ACROSS,
    PROBED_TEXELS_ACROSS,
    SAME_PLACE_SHARE,
    Conflicts,
    Origin,
    carry,
    partners,
    picture_side,
)
from ...pixels.sampler import Sampler
from ...pixels.texture import check_kind
from ...surfaces.matching import cut_alike, matched
from .. import files, formats, references
from ..materials import relaid, written
from ..materials.carried import BakeSettings
from ..meshes import mesh_files
from ..meshes.gltf_format import with_new_layout
from ..meshes.mesh_format import MeshFile
from ..pictures import image_files, tiles
from ..spec import Spec
from . import report
from .framing import size_within
from .inputs import expand_tiles
from .job import STEM, Outcome, RelayoutJob, name_each

SCHEMA = "iccm.relayout/1"
# figures of a layout that are counted separately for each tile
TEXELS = ("overlapping_texels", "covered_texels")
_Read = list[MeshFile]  # all geometries of a file


class CarriedPicture(NamedTuple):
    """A texture to transfer.

    Attributes:
        path: of the old layout.
        kind: of its channels (see `pixels.sampler.KINDS`).
        output: the file to write.
    """

    path: str
    kind: str
    output: str


class RelayoutPlan(NamedTuple):
    """The outputs of a job.

    Attributes:
        pictures: the textures to write as pictures, and their files.
        mesh: the mesh to write, with all textures of the old mesh's materials and those given; None for no mesh.
    """

    pictures: list[CarriedPicture]
    mesh: str | None


def plan(job: RelayoutJob) -> RelayoutPlan:
    """Return the outputs of a job: a mesh, and one picture per texture in order, or one name with `{stem}` for all.

    Raises:
        InputError: a picture has no texture, there are too many or too few outputs, or one is named twice or is an
            input.
    """
    formats.check_report(job.report)
    meshes = [name for name in job.output if formats.of(name).mesh]
    if len(meshes) > 1:
        raise InputError(f"{meshes[1]}: only one mesh can be written; remove the other -o")
    picture_names = [name for name in job.output if name not in meshes]
    pictures = _pictures(job.maps, picture_names) if picture_names else []
    outputs = [*meshes, *(picture.output for picture in pictures)]
    files.check_outputs(outputs, expand_tiles(job.inputs), force=job.force)
    return RelayoutPlan(pictures, meshes[0] if meshes else None)


def _pictures(maps: Sequence[tuple[str, str]], outputs: Sequence[str]) -> list[CarriedPicture]:
    if not maps:
        cure = (
            "name a picture with --texture, --normal or --data, or write a .glb or .obj for all "
            "textures of the materials"
        )
        raise InputError(f"{outputs[0]}: no texture is given; {cure}")
    names = name_each(outputs, maps)
    if len(names) != len(maps):
        textures = f"{len(maps)} texture{'s' * (len(maps) != 1)}"
        count = f"{len(outputs)} output{'s' * (len(outputs) != 1)}"
        raise InputError(
            f"{textures} but {count}: give one -o for each texture, or one with {STEM} in its name"
        )
    return [CarriedPicture(path, kind, name) for (path, kind), name in zip(maps, names)]


class _Mesh:
    """The new mesh with the old one's materials, ready to be written; all errors are raised when it is created."""

    def __init__(self, name: str, job: RelayoutJob, old: _Read, new: _Read, settings: BakeSettings) -> None:
        material_set = relaid.material_set_of(old, plain=True)
        material_set = material_set.instead(relaid.given_maps(job.maps, material_set.dialect))
        self.name, self.force = name, job.force
        self.relaid = relaid.Relaid(material_set, new, Path(name), settings)
        self.relaid.check()
        for path in written.companion_files(self.relaid):
            files.check_output(path, force=job.force)

    @property
    def notes(self) -> list[str]:
        """Notes on both files, and on what the new file cannot hold."""
        return self.relaid.notes

    @property
    def conflicts(self) -> list[Conflicts]:
        """For each material, the texels of its largest picture that cannot be correct."""
        return self.relaid.conflicts

    def write(self, stack: ExitStack) -> tuple[list[str], list[Origin]]:
        """Write the mesh and its files; return their names, and the origins of the texels."""
        path = stack.enter_context(files.writing(self.name, force=self.force))
        others = written.write(self.relaid, path, force=self.force)
        return [self.name, *others], self.relaid.origins


class _Pictures:
    """Pictures for the new layout, ready to be written; all errors are raised when they are created."""

    def __init__(
        self,
        pictures: Sequence[CarriedPicture],
        old_files: _Read,
        new_files: _Read,
        settings: BakeSettings,
        force: bool,
    ) -> None:
        self.before = relaid.sheet_of(old_files)
        self.after = matched(self.before, relaid.sheet_of(new_files), settings.match)
        self.pictures, self.settings, self.force = pictures, settings, force
        self.read = [
            tiles.read_any(picture.path, lambda: _middles(self.before), max_pixels=settings.max_pixels)
            for picture in pictures
        ]
        for picture, (image, _) in zip(pictures, self.read):
            check_kind(picture.kind, image.pixels.shape[2], picture.path)
        self.pairs = partners(self.before, self.after)
        self.files = [_outputs(picture.output, self.after, force) for picture in pictures]
        self.tiles = list(dict.fromkeys(tile for names in self.files for tile in names))
        self.cut = list[str]()
        self.conflicts = list[Conflicts]()
        self.size = settings.size or self._square()
        width, height = self.size
        for picture, (image, _) in zip(pictures, self.read):
            image_files.check(picture.output, image, height, width)

    def _square(self) -> tuple[int, int]:
        """Return width and height at which pictures show as much detail as the textures."""
        sides = [0]
        for tile in self.tiles:
            probe = self._origin(PROBED_TEXELS_ACROSS, PROBED_TEXELS_ACROSS, tile)
            reached = probe.reached(self.settings.limit)
            for image, box in self.read:
                size = image.pixels.shape[1::-1]
                side, note = picture_side(probe, reached, size, box)
                sides.append(side)
                self.cut += [note] if note else []
        return (max(sides) or COLOUR_TEXELS_ACROSS,) * 2

    def _origin(self, width: int, height: int, tile: complex | None) -> Origin:
        return Origin.of(self.before, self.after, width, height, tile, self.pairs)

    @property
    def notes(self) -> list[str]:
        """Notes on the textures."""
        notes = [*self.cut]
        for picture, (image, _) in zip(self.pictures, self.read):
            notes += [_with_path(picture.path, note) for note in image.notes]
            losses = image_files.losses(picture.output, image)
            notes += [f"{picture.output}: {loss}" for loss in losses]
        return notes

    def write(self, stack: ExitStack) -> tuple[list[str], list[Origin]]:
        """Write the pictures; return their names, and the origins of the texels."""
        settings, origins = self.settings, {tile: self._origin(*self.size, tile) for tile in self.tiles}
        self.conflicts = [origin.conflicts() for origin in origins.values()]
        for picture, (image, box), names in zip(self.pictures, self.read, self.files):
            sampler = Sampler(
                image.texture((0j, 1 + 1j), picture.kind),
                settings.filter,
                picture.kind,
                threads=settings.threads,
            )
            for tile, name in names.items():
                options: dict[str, Any] = {
                    "tiles": box,
                    "padding": settings.padding,
                    "threads": settings.threads,
                }
                pixels = carry(origins[tile], sampler, settings.limit, **options)
                path = stack.enter_context(files.writing(name, force=self.force))
                image_files.write(path, image.with_pixels(pixels, image.alpha))
        return [name for names in self.files for name in names.values()], list(origins.values())


def run(job: RelayoutJob, *, threads: int | None = None) -> Outcome:
    """Transfer textures from one layout to another.

    Args:
        job: what to do.
        threads: number of threads; never changes the result.

    Raises:
        InputError: a mesh has no texture coordinates, or a picture cannot be read or written.
    """
    from ...blas import one_thread

    with one_thread(), references.outside(job.allow_outside), files.together(), ExitStack() as stack:
        outputs = plan(job)
        for name in (job.old, job.new):
            mesh_files.check_size(Spec.of(name).path, job.max_faces)
        figures = write_all(job, outputs, threads, stack)
        if job.report:
            report.write(figures, job.report, stack, force=job.force)
    message = _doubt(figures, job)
    names = [*figures["written"], *([job.report] if job.report not in (None, "-") else [])]
    return Outcome(
        message is None, message or remarks(figures)[0], figures, tuple(names), tuple(figures["notes"])
    )


def write_all(
    job: RelayoutJob, outputs: RelayoutPlan, threads: int | None, stack: ExitStack
) -> dict[str, Any]:
    """Write the outputs, and return the report; the files appear when the stack is closed."""
    before, after = sources = [mesh_files.read_all(name) for name in (job.old, job.new)]
    after = sources[1] = [with_new_layout(file, before) for file in after]
    for file in (*before, *after):
        check(file.mesh)
    notes = [f"{file.mesh.name}: {note}" for read in sources for file in read for note in file.notes]
    diagonal = _diagonal(before)
    fixed = size_within(job.size, 1 + 1j, job.max_pixels) if job.size else None
    settings = BakeSettings(
        fixed, job.filter, job.limit * diagonal, job.padding, job.max_pixels, job.match, threads
    )
    if len(before) == len(after) == 1:
        after = [replace(after[0], mesh=cut_alike(before[0].mesh, after[0].mesh))]
    work: list[_Mesh | _Pictures] = []
    if outputs.mesh:
        work.append(_Mesh(outputs.mesh, job, before, after, settings))
    if outputs.pictures:
        work.append(_Pictures(outputs.pictures, before, after, settings, job.force))
    names, origins = list[str](), list[Origin]()
    for task in work:
        task_names, task_origins = task.write(stack)
        names, origins, notes = names + task_names, origins + task_origins, notes + task.notes
    _demand_partners(origins, job.old, job.new, settings)
    conflicts = [conflict for task in work for conflict in task.conflicts]
    _demand_one_tile(origins, conflicts, job.new)
    figures = _figures(origins, conflicts, job, diagonal)
    notes += _blank(origins, job.new)
    return figures | {"notes": list(dict.fromkeys(notes)), "written": names}


def _doubt(figures: dict[str, Any], job: RelayoutJob) -> str | None:
    """Return what is wrong with the pictures, or None."""
    if far_texels := figures["far_texels"]:
        return (
            f"{far_texels} texels stay empty, because they are farther from {job.old} than {job.limit:g} of "
            "the diagonal (--limit)"
        )
    if figures["status"] == "empty":
        return "its texture coordinates cover no texel; unwrap the mesh, or use a larger --size"
    if figures["status"] == "overlapping":
        share = figures["layout"]["conflicting_texels"] / figures["layout"]["covered_texels"]
        return (
            f"{job.new}: its layout overlaps itself, and on {share:.1%} of it the overlapping triangles show different "
            "parts of the old texture, so that some of them look wrong; unwrap the mesh without stacked charts, or say "
            "with --overlap mirror that they are meant to share their texels"
        )
    return None


def _demand_partners(origins: Sequence[Origin], old: str, new: str, settings: BakeSettings) -> None:
    """Check that at least one texel of the new mesh lies on the old one.

    Raises:
        InputError: none does; the message names the ways of matching that were tried.
    """
    covered = any(origin.grid.owners.owner.max() >= 0 for origin in origins)
    if covered and not any(origin.reached(settings.limit).any() for origin in origins):
        attempts = {"index": "by index", "topology": "by topology"}
        attempts["position"] = "by position, with and without a similarity"
        attempts["auto"] = "by position, by index, by topology, and by position after a similarity"
        raise InputError(f"{new}: no part of it matches {old}; tried {attempts[settings.match]}")


def _demand_one_tile(origins: Sequence[Origin], conflicts: Sequence[Conflicts], new: str) -> None:
    """Refuse a layout that repeats the picture, or whose charts in other tiles would come to lie on each other.

    Raises:
        InputError: saying how to write a picture for each tile.
    """
    cure = (
        "move it into u and v from 0 to 1, or write one picture for each tile "
        "(-o 'name.<UDIM>.png'), or a material for each tile (-o name.glb)"
    )
    if repeating := sum(origin.repeating_triangles for origin in origins):
        raise InputError(
            f"{new}: {repeating} triangles of its layout are larger than the picture, so it would be repeated in them; "
            f"{cure}"
        )
    covered = sum(origin.grid.report["covered_texels"] for origin in origins)
    if sum(conflict.wrapped for conflict in conflicts) > CONFLICTING_SHARE * covered:
        raise InputError(f"{new}: its layout lies in several tiles, whose charts would overlap; {cure}")


def _blank(origins: Sequence[Origin], new: str) -> list[str]:
    """Return a note on triangles without a texture because their new coordinates have no area."""
    blank_area, total_area = np.sum(
        [origin.blank for origin in {id(origin.partner): origin for origin in origins}.values()], axis=0
    )
    if blank_area <= SAME_PLACE_SHARE * total_area:
        return []
    return [
        f"{new}: {blank_area / total_area:.1%} of the surface shows no texture, because its texture coordinates "
        "have no area"
    ]


def _diagonal(meshes: _Read) -> float:
    """Return the diagonal of the bounding box of all meshes in a file."""
    points = np.concatenate([file.mesh.points[np.unique(file.mesh.corners)] for file in meshes])
    return float(np.linalg.norm(np.ptp(points, axis=0))) if points.size else 0.0


def _middles(mesh: Charted) -> Real:
    """Return (m, 2) the centroids of triangles in the layout."""
    return mesh.uv[mesh.uv_faces].mean(axis=1)


def _outputs(name: str, mesh: Charted, force: bool) -> dict[complex | None, str]:
    """Return the files of an output, by tile of the layout.

    Raises:
        InputError: a file cannot be written, or faces lie where tiles have no number.
    """
    if not tiles.is_pattern(name):
        return {None: name}
    names: dict[complex | None, str] = {}
    for tile in tiles.all_of(_middles(mesh)):
        names[tile] = tiles.name_at(name, tile, mesh.name)
        files.check_output(names[tile], force=force)
    return names


def _with_path(path: str, note: str) -> str:
    return note if note.startswith(path) else f"{path}: {note}"


def _figures(
    origins: Sequence[Origin],
    conflicts: Sequence[Conflicts],
    job: RelayoutJob,
    diagonal: float,
) -> dict[str, Any]:
    """Return the report; the origins are of one layout, or of several parts of it."""
    partner = np.concatenate(list({id(origin.partner): origin.partner for origin in origins}.values()))
    limit = job.limit
    distance = np.concatenate([origin.distance for origin in origins])
    far_texels = sum(int(origin.far(limit * diagonal).sum()) for origin in origins)
    layout = _layout(origins) | {"conflicting_texels": sum(conflict.texels for conflict in conflicts)}
    return report.as_json(
        {
            "schema": SCHEMA,
            "version": __version__,
            "status": _status(far_texels, layout, job.overlap),
            "size": max((origin.grid.shape[::-1] for origin in origins), key=lambda size: size[0] * size[1]),
            "triangles": partner.size,
            "same_triangles": int((partner >= 0).sum()),
            "distance": {
                "limit": limit,
                "p95": float(np.quantile(distance, 0.95)) / (diagonal or 1.0) if distance.size else 0.0,
                "max": float(distance.max(initial=0.0)) / (diagonal or 1.0),
            },
            "nearest_texels": sum(int(origin.nearest.size) for origin in origins),
            "far_texels": far_texels,
            "layout": layout,
            "inputs": [{"path": name, "sha256": files.sha256(name)} for name in expand_tiles(job.inputs)],
        }
    )


def _status(far_texels: int, layout: dict[str, int], overlap: str) -> str:
    """Return how the run ended; the worst of several faults. `overlap` as the option."""
    if not layout["covered_texels"]:
        return "empty"
    if far_texels:
        return "far"
    return "overlapping" if overlap == "refuse" and is_stacked(layout) else "done"


def _layout(origins: Sequence[Origin]) -> dict[str, int]:
    """Return figures of the layout, summed over tiles or parts."""
    parts = {id(origin.partner): origin.grid.report for origin in origins}
    totals = {key: sum(part[key] for part in parts.values()) for key in origins[0].grid.report}
    return totals | {key: sum(origin.grid.report[key] for origin in origins) for key in TEXELS}


def remarks(figures: dict[str, Any]) -> list[str]:
    """Return a summary of the figures, one sentence each; the first reports how triangles were matched."""
    matching, count = figures["same_triangles"], figures["triangles"]
    sentences = [f"{matching} of {count} triangles match triangles of the old mesh"]
    sentences.append("pictures of {}x{} texels".format(*figures["size"]))
    nearest, overlaps = figures["nearest_texels"], figures["layout"]["overlapping_texels"]
    if nearest:
        worst = f"{figures['distance']['max']:.2g} of the diagonal"
        sentences.append(f"{nearest} texels are taken from the nearest point, at most {worst} away")
    if overlaps:
        conflicting = figures["layout"]["conflicting_texels"]
        text = f"{overlaps} texels lie in several triangles of the new layout, which overlaps"
        detail = (
            f"{conflicting} of them show the first of these" if conflicting else "all of these show the same"
        )
        sentences.append(f"{text}; {detail}")
    if mirrored := figures["layout"]["mirrored_triangles"]:
        sentences.append(f"{mirrored} triangles are mirrored in the new layout")
    return sentences
