"""`iccm flatten`."""

from __future__ import annotations

import os
from contextlib import ExitStack

import click

from . import logs, status
from .paths import FILE, OUTSIDE

# NumPy, which is imported later, asks Linux for huge pages: its arrays are short-lived here, and finding room for such
# pages took 5.1 s of the 15 of a million faces, small ones 2.2 (and no longer in the program).
os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")

METHODS = ("conformal", "lscm", "balanced")


@click.command()
@click.argument("mesh", type=FILE)
@click.option(
    "-o",
    "--output",
    multiple=True,
    type=FILE,
    metavar="FILE",
    help="The outline (.svg) or the flat mesh (.obj).",
)
@click.option(
    "--uv",
    type=FILE,
    metavar="FILE",
    help="The mesh with its flattening as texture coordinates (.obj .glb .ply).",
)
@click.option(
    "--method",
    type=FILE,
    metavar="[" + "|".join(METHODS) + "|OUTLINE]",
    default=METHODS[0],
    show_default=True,
    help="Keep angles, one-to-one; least squares (LSCM) as it comes; even: angles and areas; or onto the outline of a "
    "drawing or picture (outline.svg, sheet.svg#id), as evenly on the surface as it allows.",
)
@click.option(
    "--carry-maps",
    is_flag=True,
    help="With --uv of a GLB or OBJ: carry the maps of its materials to the new coordinates.",
)
@click.option("--cut", is_flag=True, help="Cut a closed surface, or one with handles, open.")
@click.option(
    "--report", type=FILE, metavar="FILE.json", help="Figures of the flattening as JSON; - for stdout."
)
@click.option(
    "--plot",
    type=FILE,
    metavar="FILE.png",
    help="The flat mesh and the surface with a checkerboard (.png .svg .pdf).",
)
@click.option("--max-faces", type=int, default=5_000_000, show_default=True, help="Refuse larger meshes.")
@OUTSIDE
@click.option("--force", is_flag=True, help="Replace files that exist.")
@logs.options
def command(
    mesh: str,
    output: tuple[str, ...],
    uv: str | None,
    method: str,
    carry_maps: bool,
    cut: bool,
    report: str | None,
    plot: str | None,
    max_faces: int,
    force: bool,
) -> int:
    """Flatten MESH (OBJ, GLB, PLY, OFF, STL) into the plane, without folds or overlaps.

    MESH is file, file#part (an OBJ object, group or material), or file#2 for the outline along the second-longest
    boundary. Inner holes stay holes. Without an output option MESH-flat.svg is written here.

    \b
    iccm flatten face.obj -o face.svg
    iccm flatten body.obj#sleeve -o sleeve.svg --report - --plot sleeve.png
    iccm flatten cow.obj --cut --uv cow-uv.obj
    iccm flatten glove.obj --method balanced --plot glove.png
    iccm flatten face.obj --method heart.svg --uv face-heart.obj

    Exit code: 0 done, 1 what was written is not one-to-one, 2 an input is wrong.
    """
    from ..io import formats
    from ..io.meshes import size_limits
    from ..io.meshes.mesh_files import check_output
    from ..io.run import flat_files, flatten
    from ..io.spec import Spec

    if not (output or uv or report or plot):
        output = (f"{Spec.of(mesh).path.stem}-flat.svg",)
    for name in output:
        flat_files.check(name)
    if uv:
        check_output(uv)
    if plot:
        formats.check(plot, "plot", "--plot")
    formats.check_report(report)
    outputs = flatten.checked([*output, uv, plot, None if report == "-" else report], mesh, force=force)
    size_limits.faces(Spec.of(mesh).path, max_faces)
    with ExitStack() as stack:
        stack.enter_context(status.watched("flatten"))
        laid = flatten.laid_out(mesh, method, cut=cut, tell=lambda note: logs.log.warning(f"{mesh}: {note}"))
        found = flatten.write_all(laid, output, uv, plot, report, stack, force=force, carry_maps=carry_maps)
        for note in found["notes"][len(laid.shape.notes) :]:
            logs.log.warning(note)
    for line in flatten.summary(found):
        logs.log.info(line)
    for name in [*outputs, *found.get("also_written", [])]:
        logs.log.info(f"wrote {name}")
    doubt = flatten.doubt(found)
    if doubt:
        logs.log.error(f"{mesh}: {doubt}")
    return int(doubt is not None)
