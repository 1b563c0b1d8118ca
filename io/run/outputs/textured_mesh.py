"""The target mesh with texture coordinates that show the texture, without resampling."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ....errors import InputError
from ....fits import leaves_bare
from ....status import Status
from ....surfaces.as_written import WrittenCoordinates
from ... import formats
from ...meshes import mesh_files
from ...meshes.mesh_format import ShownPictures
from ...shapes.mesh_shape import as_mesh
from ...shapes.split_rims import missed
from .. import parts
from ..framing import placing_options
from ..job import Job
from ..report import OutputReport
from ..state import Run
from ..texture import own_pictures
from .baked import parts_of
from .new_uvs import new_uvs
from .output import Output


class TexturedMesh(Output):
    """A mesh with new texture coordinates."""

    shows, is_mesh = True, True

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require a mesh as target, and a suffix that can hold texture coordinates."""
        if job.target is None:
            raise InputError(
                f"{self.name}: a deformation cannot be written as a mesh; use a picture's suffix"
            )
        if not onto_mesh:
            raise InputError(
                f"{self.name}: a mesh can only be written if the target is a mesh, and "
                f"{job.target} is not; use a picture's suffix"
            )
        problem = "unknown suffix for -o"
        if formats.of(self.name).mesh:
            problem = formats.why_no_coordinates(self.name)
        formats.check(self.name, "uv", problem)
        if leaves_bare(job.fit):
            raise InputError(
                f"{self.name}: with --fit {job.fit}, parts of {job.target} get no texture coordinates; "
                "use --bake to leave them transparent, or --fit cover"
            )
        if job.edge == "mirror" or (placing_options(job) and job.edge != "repeat"):
            raise InputError(f"{self.name}: textures of meshes repeat; use --edge repeat, or --bake")
        if _normal_map(job) is None:
            return
        mesh_files.demand_normal_maps(self.name)
        if job.carry_maps:
            raise InputError(
                f"{self.name}: --normal and --carry-maps both provide a normal map; leave one of the two out"
            )

    def check(self, run: Run) -> None:
        """Check the coordinates of a mesh source and the textures that the format can include; note those that it
        cannot.
        """
        for source, _ in run.pairs:
            if source.is_mesh:
                _ = as_mesh(source).uv_faces
        for path in _textures_not_shown(run.job):
            run.note(
                f"{self.name}: cannot include {path}; a mesh includes a --texture of colours and a --normal"
            )
        for texture in (_shown_texture(run), _normal_map(run.job)):
            mesh_files.format_of(self.name).check_texture(Path(self.name), texture)
        if run.job.carry_maps:
            run.carried_maps.check(self.name)

    def companion_files(self, run: Run) -> list[str]:
        """Return the names of the material library and of pictures."""
        pictures = ShownPictures(_shown_texture(run), _normal_map(run.job))
        names = mesh_files.format_of(self.name).companions(Path(self.name), pictures)
        if run.job.carry_maps:
            names += run.carried_maps.companions(self.name, retextured=pictures.texture is not None)
        return list(dict.fromkeys(names))

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Write the mesh, and the files beside it."""
        with run.phases.timed("write"):
            new = new_uvs(
                parts_of(run),
                run.flat,
                path,
                name=Path(self.name),
                texture=_shown_texture(run),
                normals=_normal_map(run.job),
                force=run.job.force,
                threads=run.threads,
                carried_maps=run.carried_maps if run.job.carry_maps else None,
                padding=run.job.padding,
                tolerance=run.job.tolerance if run.job.subdivide_rim else None,
            )
        run.note(*new.notes)
        _note_distortion(run, new.measured)
        measured = [written.report() for written in new.measured]
        return OutputReport(new.figures, parts=measured, message=_message(run, new.measured), files=new.files)


def _message(run: Run, measured: list[WrittenCoordinates]) -> str | None:
    """Return a sentence if edges of the written layout leave the outline, since the solver only checks vertices."""
    widest = max((written.boundary["hausdorff"] for written in measured), default=0.0)
    if widest <= run.job.tolerance or run.fit.status is not Status.REACHED:
        return None
    at_most = f"at most {widest:.2%} of the picture's diagonal away from it (boundary)"
    return f"The mesh's vertices are on the outline; the edges between them are {at_most}."


def _note_distortion(run: Run, measured: list[WrittenCoordinates]) -> None:
    """Note what the written coordinates of each part show but the underlying map does not."""
    job = run.job
    for pair, fit, written in zip(run.pairs, run.fits, measured):
        boundary_notes = missed(written.boundary, job.tolerance, job.subdivide_rim, divides=not job.subdivide)
        run.note(*(parts.label(pair, note) for note in boundary_notes))
        strain, map_strain = written.distortion.strain, fit.distortion.strain
        if strain is not None and (map_strain is None or strain[0] > map_strain[0]):
            text = "in the texture coordinates as written, lengths change by a factor of more than"
            run.note(parts.label(pair, f"{text} {strain[0]:.3g} on 5 % of the area (stretch)"))


def _shown_texture(run: Run) -> Path | bytes | None:
    """Return the picture for a mesh with new coordinates: --texture, or the texture of a mesh source."""
    return (
        run.held_drawing or _first(run.job, "colour") or next(iter(own_pictures(run.job, run.source)), None)
    )


def _normal_map(job: Job) -> Path | None:
    """Return the normal map for a mesh with new coordinates."""
    return _first(job, "normal")


def _first(job: Job, kind: str) -> Path | None:
    return next((Path(path) for path, is_kind in job.maps if is_kind == kind), None)


def _textures_not_shown(job: Job) -> list[str]:
    """Return the textures that a mesh cannot include: data, normals with y down, and further normals."""
    bound = _first(job, "colour"), _normal_map(job)
    return [path for path, _ in job.maps if Path(path) not in bound]
