"""The target mesh with its own texture coordinates, and the texture baked into them as its material (--bake)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ....errors import InputError
from ... import formats
from ...meshes import mesh_files
from ...meshes.mesh_format import NewCoordinates, ShownPictures
from ...pictures import image_files
from ...shapes.mesh_parts import join
from ...shapes.mesh_shape import as_mesh
from ..job import Job
from ..report import OutputReport
from ..state import Run
from .baked import baked_picture, check_bake, report_bake
from .output import Output

HELD_AS = "picture.png"
"""Name by whose suffix pictures inside meshes are checked."""


class BakedMesh(Output):
    """A mesh that keeps its coordinates, with a baked picture for each --texture and --normal."""

    samples, shows, is_mesh = True, True, True

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require a format whose materials have pictures, and textures that it can show."""
        formats.check(self.name, "uv", formats.why_no_coordinates(self.name))
        if not mesh_files.format_of(self.name).dialect:
            suffix = formats.suffix_of(self.name)[1:].upper()
            able = " or ".join(mesh_files.suffixes_with_materials())
            raise InputError(
                f"{self.name}: {suffix} files contain no baked picture; use {able}, or write a picture (.png)"
            )
        if job.kind not in ("colour", "normal"):
            raise InputError(
                f"{self.name}: a mesh only includes a --texture and a --normal, not {job.texture}"
            )
        if any(kind == "normal" for _, kind in job.maps):
            mesh_files.demand_normal_maps(self.name)
        if job.carry_maps:
            raise InputError(
                "--carry-maps: needs new coordinates, and --bake keeps those of the mesh; leave one out"
            )

    def check(self, run: Run) -> None:
        """Check the layouts, the textures and memory, and whether the mesh's format can contain the pictures."""
        for map in _shown(run.job):
            with_map = run.with_texture(map)
            image, width, height = check_bake(with_map)
            image_files.check(HELD_AS, image, height, width)
            losses = image_files.losses(HELD_AS, with_map.image)
            run.note(*(f"{self.name}, which holds a picture: {loss}" for loss in losses))

    def companion_files(self, run: Run) -> list[str]:
        """Return the names of the material library and of the pictures."""
        kinds = [run.with_texture(map).job.kind for map in _shown(run.job)]
        pictures = ShownPictures(b"" if "colour" in kinds else None, b"" if "normal" in kinds else None)
        return mesh_files.format_of(self.name).companions(Path(self.name), pictures)

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Bake the pictures, and write the mesh with them and the files beside it."""
        pictures, report = dict[str, bytes](), OutputReport()
        for map in _shown(run.job):
            with_map = run.with_texture(map)
            picture, figures = baked_picture(with_map)
            pictures[with_map.job.kind] = image_files.as_png(picture)
            report = report_bake(run, figures, None)
        target, name = join([as_mesh(target) for _, target in run.pairs]), Path(self.name)
        mesh, (_, triangles) = target.file.mesh, target.corners
        assert mesh.uv is not None and mesh.uv_corners is not None
        own = NewCoordinates(mesh.uv, mesh.uv_corners, triangles, kept=True)
        shown = ShownPictures(pictures.get("colour"), pictures.get("normal"))
        with run.phases.timed("write"):
            written = mesh_files.write(target.file, own, shown, path, name, force=run.job.force)
        run.note(*written.notes)
        return OutputReport(report.figures, files=written.files)


def _shown(job: Job) -> list[tuple[str, str] | None]:
    """Return the textures that the mesh shows, by kind; None for the job's first, which may be the source's own."""
    return [None, *(map for map in job.maps if map[1] == "normal" and map[1] != job.kind)][:2]
