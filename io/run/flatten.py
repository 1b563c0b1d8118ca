"""The run of `iccm flatten`: layout, figures and files."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from ... import __version__, deadline
from ...arrays import complex_of
from ...errors import InputError
from ...flattening import METHODS
from ...flattening.opening import concave, not_convex
from ...flattening.segmentation import Charts
from ...meshes import layout
from ...meshes.flatten import chart_figures, overlap
from ...options import Options
from ...pixels.sampler import Sampler
from ...plane import longer_side
from ...surfaces.as_written import WrittenCoordinates
from .. import files, formats, references
from ..lengths import MILLIMETRES
from ..meshes import mesh_files, overlays
from ..options import TEXELS_BETWEEN_CHARTS
from ..shapes import mesh_reading
from ..shapes import shape as planar
from ..shapes.mesh_shape import MeshShape
from ..shapes.shape import Shape
from ..shapes.split_rims import missed
from ..spec import Spec
from . import flat_files, report
from .job import FlattenJob, Outcome
from .requirements import Requirement, refuse

SCHEMA = "iccm.flatten/1"
IN_MILLIMETRES = (".svg", ".dxf")
"""Suffixes of outputs that have a size in millimetres."""


class FlatMesh(NamedTuple):
    """A mesh flattened into the plane.

    Attributes:
        shape: the mesh.
        figures: of the map onto an outline, if there is one.
        outline: the outline that the mesh is mapped onto, if any.
    """

    shape: MeshShape
    figures: dict[str, Any]
    outline: Shape | None = None


REQUIREMENTS = (
    Requirement(
        ("margin",), lambda job, flat_layout: flat_layout.shape.packed, "the mesh is flattened in one piece"
    ),
    Requirement(
        ("unit",),
        lambda job, flat_layout: any(formats.suffix_of(name) in IN_MILLIMETRES for name in job.output),
        "no file with a size in millimetres is written; write one with -o FILE (.svg, .dxf)",
    ),
    Requirement(("method",), lambda job, flat_layout: not job.onto, "--onto replaces it"),
)


def check(job: FlattenJob) -> None:
    """Check that outputs have suitable suffixes and may be written.

    Raises:
        InputError: one of them cannot be written.
    """
    if job.subdivide_rim and goal_of(job) in METHODS:
        raise InputError("--subdivide-rim: needs an outline to follow; name one with --onto")
    if job.max_distortion and (job.charts == "one" or goal_of(job) not in ("balanced", "conformal")):
        raise InputError(
            "--max-distortion: only applies to --charts auto with --method balanced or conformal, and not to --onto"
        )
    if job.seams and (job.no_cut or job.onto):
        raise InputError(f"--seams: cannot be combined with {'--no-cut' if job.no_cut else '--onto'}")
    for name in job.output:
        flat_files.check(name, overlay=bool(job.overlay))
    if job.overlay or job.colormap or job.overlay_range:
        _check_overlay(job)
    if job.uv:
        formats.check(job.uv, "uv", formats.why_no_coordinates(job.uv))
    if job.plot:
        formats.check_plot(job.plot)
    if job.preview:
        from . import preview  # slow to import, as it reads and writes pictures

        preview.check(job.preview)
    formats.check_report(job.report)
    files.check_outputs(job.outputs, job.inputs, force=job.force)


def _check_overlay(job: FlattenJob) -> None:
    """Check that an overlay is drawn, and that its options apply.

    Raises:
        InputError: there is no picture of it, or none in colour.
    """
    from . import overlay_picture  # slow to import, as it writes pictures

    pictures = [name for name in job.output if flat_files.is_picture(name)]
    if job.overlay and not pictures:
        raise InputError("--overlay: needs a picture that shows it; add -o FILE with .png, .tif or .exr")
    for option in ("colormap", "overlay_range"):
        if getattr(job, option) and not any(overlay_picture.is_coloured(name) for name in pictures):
            name = option.replace("_", "-")
            raise InputError(f"--{name}: is for pictures of --overlay in colour; write one with -o FILE.png")
    overlay_picture.check_colormap(job.colormap)


def run(job: FlattenJob, *, tell: Callable[[str], None] = lambda note: None) -> Outcome:
    """Flatten a mesh and write the outputs.

    Args:
        job: what to do.
        tell: called with each note as it is made.

    Raises:
        InputError: an input or output is invalid. In this case nothing has been written.
    """
    from ...blas import one_thread

    notes = list[str]()

    def note(text: str) -> None:
        notes.append(text)
        tell(text)

    with one_thread(), references.outside(job.allow_outside), files.together(), ExitStack() as stack:
        check(job)
        mesh_files.check_size(Spec.of(job.mesh).path, job.max_faces)
        flat_layout = lay_out(
            job.mesh,
            goal_of(job),
            cut=not job.no_cut,
            tell=lambda remark: note(f"{job.mesh}: {remark}"),
            split=job.subdivide_rim,
            margin=None if job.parts == "largest" else job.margin,
            charts=job.charts,
            max_distortion=job.max_distortion,
            seams=job.seams,
        )
        idle = refuse(job, REQUIREMENTS, job, flat_layout)
        results = write_all(flat_layout, job, stack)
        for remark in results["notes"][len(flat_layout.shape.notes) :]:
            note(remark)
        for name in filter(flat_files.is_flat_mesh, job.output):
            note(
                f"{name}: the flat mesh itself; for the mesh in space with texture coordinates, use --uv {name}"
            )
        if job.uv_by_suffix:
            note(
                f"{job.uv}: the mesh in space with texture coordinates; for the flat mesh itself, use -o FILE.obj"
            )
    message = doubt(results)
    if (limit := deadline.current()) and limit.cut:
        message = message or limit.message("flattening it as evenly as possible")
    names = (*job.outputs, *results.get("also_written", []))
    return Outcome(message is None, message or summary(results)[1], results, names, tuple(notes), idle)


def goal_of(job: FlattenJob) -> str:
    """Return the method of a job, or the outline that its mesh is mapped onto (which was once an option of
    --method).
    """
    return job.onto or job.method


def lay_out(
    mesh: str,
    method: str,
    *,
    cut: bool,
    tell: Callable[[str], None],
    split: bool = False,
    margin: int | None = TEXELS_BETWEEN_CHARTS,
    charts: Charts = "auto",
    max_distortion: float | None = None,
    seams: str | None = None,
) -> FlatMesh:
    """Return a mesh flattened by a method, or onto an outline.

    Args:
        mesh: its spec, see `io.spec`.
        method: one of METHODS, or the drawing or picture of an outline.
        cut: whether the mesh may be cut open.
        tell: called with notes.
        split: whether triangles at the boundary are split until their edges follow the outline.
        margin: distance of the charts of several pieces, in texels of a texture of 1024; None: only the largest piece,
            in one chart.
        charts, max_distortion: see `segmentation.charts_of`.
        seams: file of seams, see `marked_seams.with_seams`.

    Raises:
        InputError: the mesh cannot be flattened, or the method, the file or an outline in it does not exist.
    """
    cutting = mesh_reading.Cutting(closed=cut)
    if method in METHODS:
        whole = None
        if margin is not None:
            whole = mesh_reading.read_whole(
                mesh,
                cut=cut,
                method=method,
                margin=margin,
                charts=charts,
                max_distortion=max_distortion,
                seams=seams,
                backs=True,
            )
        if whole is None and seams:
            raise InputError(
                "--seams: is for whole meshes; leave out --parts largest, --onto and numbers of pieces"
            )
        shape = whole or mesh_reading.read(mesh, cutting=cutting, method=method, purpose="texture")
        flat_layout = FlatMesh(shape, {})
    else:
        path = Spec.of(method).path
        if not path.is_file():
            raise InputError(
                f"--onto {method}: no such file; for a method use --method ({', '.join(METHODS)})"
            )
        if formats.of(path).mesh:
            raise InputError(f"--onto {method}: is a mesh; name a drawing or a picture with an outline")
        from ..shapes import onto_outline

        outline = planar.read(method)
        shape = mesh_reading.read(mesh, cutting=cutting)
        flat_layout = FlatMesh(
            *onto_outline.lay_onto(shape, outline, tell, Options().tolerance if split else None), outline
        )
    for note in flat_layout.shape.notes:
        tell(note)
    return flat_layout


def figures(flat_layout: FlatMesh, uv: str | None) -> dict[str, Any]:
    """Return the report: conformal error, area distortion, holes and seam of the written coordinates, in mesh units.

    Args:
        flat_layout: the flattened mesh.
        uv: the mesh file that the coordinates are written to, and rounded for; None: an OBJ.
    """
    shape, outline = flat_layout.shape, flat_layout.outline
    low, high = shape.box
    rounded = mesh_files.as_written(flat_files.unit_uvs(shape), uv or "flat.obj")
    written = replace(shape.flattening, flat=low + longer_side(low, high) * complex_of(rounded))
    entries, patch = written.report(), written.patch
    turned_over = layout.turned_over(rounded[patch.faces], patch.points[patch.faces])
    concave_count = concave(rounded, patch)
    # not of the rounded coordinates: sides that meet, as in nets, cross by a rounding error, which is not seen
    fault = overlap(shape.flattening)
    loops = list(shape.flattening.outer_loops) if shape.packed else shape.flattening.patch.loops
    notes = [*shape.notes, *([f"{shape.spec}: {not_convex(concave_count)}"] if concave_count else [])]
    if outline is not None:
        as_map = WrittenCoordinates.of(written.flat, written, outline.curve).report()
        entries |= {key: as_map[key] for key in ("stretch", "scale")}
        entries["boundary"] = flat_layout.figures["boundary"] | as_map["boundary"]
        notes += missed(entries["boundary"], Options().tolerance, "rim_vertices" in flat_layout.figures)
    status = "overlaps" if fault else "done"
    if any(turned_over.values()):
        status = "flipped"
    return {
        "schema": SCHEMA,
        "version": __version__,
        "status": status,
        "overlap": fault,
        **flat_layout.figures,
        **entries,
        "uv": turned_over,
        "concave_polygons": concave_count,
        "each_chart": chart_figures(shape.flattening),
        "box": [low, high],
        "boundary_loops": [len(loop) for loop in loops],
        "notes": notes,
        "inputs": [
            {"path": str(p), "sha256": files.sha256(p)} for p in (shape.path, outline and outline.path) if p
        ],
    }


def doubt(results: dict[str, Any]) -> str | None:
    """Return why the written coordinates are not one-to-one, or None."""
    turned_over = results["uv"]
    if any(turned_over.values()):
        return f"{turned_over['flipped']} triangles are flipped and {turned_over['degenerate']} have no area"
    return results["overlap"]


def write_all(flat_layout: FlatMesh, job: FlattenJob, stack: ExitStack) -> dict[str, Any]:
    """Write every output, and return the figures; the files appear when the stack is closed."""
    uv, force = job.uv, job.force
    shape = flat_layout.shape
    maps = None
    if job.carry_maps:
        from ..materials.carried_maps import CarriedMaps

        maps = CarriedMaps(shape.file)
        maps.check(uv or "--uv")
        for name in maps.companions(uv or "", retextured=False):
            files.check_output(name, force=force)
    results = figures(flat_layout, uv)
    millimetres, remark = length_of_unit(flat_layout, job.unit)
    results["millimetres"] = millimetres
    if remark and any(formats.suffix_of(name) in IN_MILLIMETRES for name in job.output):
        results["notes"] = [*results["notes"], remark]
    overlay = overlays.read(job.overlay, len(shape.file.mesh.points)) if job.overlay else None
    for name in job.output:
        path = stack.enter_context(files.replacing(name, force=force))
        if overlay is not None and flat_files.is_picture(name):
            from . import overlay_picture

            overlay_picture.write(shape, overlay, path, colormap=job.colormap, ends=job.overlay_range)
        else:
            flat_files.write(shape, path, millimetres)
    if uv:
        path = stack.enter_context(files.replacing(uv, force=force))
        written = flat_files.write_uvs(shape, path, Path(uv), maps, force=force)
        results["notes"] = results["notes"] + written.notes
        if written.files:
            results["also_written"] = written.files
    if job.plot:
        from . import plots

        words = [*summary(results), "", *(f"note: {note}" for note in results["notes"])]
        plots.draw(shape, stack.enter_context(files.replacing(job.plot, force=force)), words)
    if job.preview:
        from . import preview

        path = stack.enter_context(files.replacing(job.preview, force=force))
        part, checks = preview.textured(shape)
        preview.write(path, [part], Sampler(checks), shape.file.mesh.up_axis)
    if job.report:
        report.write(results, job.report, stack, force=force)
    return results


def length_of_unit(flat_layout: FlatMesh, unit: str | None) -> tuple[float | None, str]:
    """Return the length of a unit of the plane in millimetres, and a note if no file states it.

    On an outline, the plane is that of the outline's drawing. That of texture coordinates has no length: None.

    Args:
        flat_layout: the flattened mesh.
        unit: name of the mesh's unit; None for what its file states.
    """
    shape, outline = flat_layout.shape, flat_layout.outline
    if unit:
        return MILLIMETRES[unit], ""
    if shape.is_layout:
        return None, ""
    if outline is not None:
        millimetres, name = outline.millimetres, outline.spec
    else:
        millimetres, name = mesh_files.open_mesh(shape.path).millimetres(), shape.spec
    if millimetres is None:
        return 1.0, f"{name}: does not state a unit; one unit is written as 1 mm, --unit names another one"
    return millimetres, ""


def summary(results: dict[str, Any]) -> list[str]:
    """Return the most important figures, one per line."""
    spread = results["log10_area"]["p95"] - results["log10_area"]["p05"]
    error = ", ".join(f"{name} {value:.4g}" for name, value in results["dilatation"].items())
    return [
        f"mesh        {results['triangles']} triangles, {results['boundary_vertices']} boundary vertices, "
        f"{results['holes']} holes, {results['seam_edges']} seam edges"
        f" ({results['seam_length']:.3g} sides of a square of its area)",
        f"dilatation  {error} ({results['method']})",
        f"log10 area  p05 to p95 {spread:.3g}",
    ]
