"""What `iccm flatten` writes and tells."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from ... import __version__
from ...errors import InputError
from ...meshes import layout
from ...meshes.flatten import overlap
from .. import files
from ..meshes import mesh_files
from ..shapes.mesh_shape import MeshShape
from ..spec import Spec
from . import carried_maps, flat_files, report

SCHEMA = "iccm.flatten/1"


def checked(names: list[str | None], mesh: str, *, force: bool) -> list[str]:
    """The outputs that are asked for, after checking that each can be written.

    Raises:
        InputError: one cannot be written, is named twice, or is the mesh itself.
    """
    outputs = [name for name in names if name]
    seen = {Spec.of(mesh).path.resolve()}
    for name in outputs:
        real = files.check_output(name, force=force)
        if real in seen:
            raise InputError(f"{name}: is the input, or named for two outputs; name another file")
        seen.add(real)
    return outputs


def figures(shape: MeshShape, uv: str | None) -> dict[str, Any]:
    """The report: conformal error, area distortion, holes, seam; lengths in the mesh's units.

    Args:
        shape: the flattened mesh.
        uv: the mesh that its coordinates are written to, whose rounding counts; None: an OBJ's.
    """
    low, high = shape.box
    turned, fault = turned_over(shape, uv), overlap(shape.flattening)
    return {
        "schema": SCHEMA,
        "version": __version__,
        "status": "flipped" if any(turned.values()) else "overlaps" if fault else "done",
        "overlap": fault,
        **shape.flattening.report(),
        "uv": turned,
        "box": [low, high],
        "boundary_loops": [len(loop) for loop in shape.flattening.patch.loops],
        "notes": list(shape.notes),
        "inputs": [{"path": str(shape.path), "sha256": files.sha256(shape.path)}],
    }


def turned_over(shape: MeshShape, uv: str | None) -> dict[str, int]:
    """How many triangles are flipped or degenerate in the coordinates that are written."""
    corners = mesh_files.as_written(flat_files.unit_uvs(shape), uv or "flat.obj")[
        shape.flattening.patch.faces
    ]
    return layout.turned_over(corners)


def doubt(found: dict[str, Any]) -> str | None:
    """What keeps the coordinates that are written from being one-to-one, by their figures, or None."""
    turned = found["uv"]
    if any(turned.values()):
        return f"{turned['flipped']} triangles are turned over, {turned['degenerate']} without area"
    return found["overlap"]


def write_all(
    shape: MeshShape,
    output: tuple[str, ...],
    uv: str | None,
    plot: str | None,
    to: str | None,
    stack: ExitStack,
    *,
    force: bool,
    carry_maps: bool = False,
) -> dict[str, Any]:
    """Write every output; the files appear when the stack is left. What is returned are the figures."""
    if carry_maps:
        carried_maps.check(shape.file, uv or "--uv")
    found = figures(shape, uv)
    for name in output:
        flat_files.write(shape, stack.enter_context(files.replacing(name, force=force)))
    if uv:
        path = stack.enter_context(files.replacing(uv, force=force))
        found["notes"] += flat_files.write_uvs(shape, path, Path(uv), carry_maps)
    if plot:
        from .figures import surfaces

        surfaces.draw(shape, stack.enter_context(files.replacing(plot, force=force)))
    if to:
        report.write(found, to, stack, force=force)
    return found


def summary(found: dict[str, Any]) -> list[str]:
    """The figures that a person wants to see, a line each."""
    spread = found["log10_area"]["p95"] - found["log10_area"]["p05"]
    error = ", ".join(f"{name} {value:.4g}" for name, value in found["dilatation"].items())
    return [
        f"mesh        {found['triangles']} triangles, {found['boundary_vertices']} boundary vertices, "
        f"{found['holes']} holes, {found['seam_edges']} seam edges",
        f"dilatation  {error} ({found['method']})",
        f"log10 area  p05 to p95 {spread:.3g}",
    ]
