"""`iccm flatten`."""

from __future__ import annotations

import os
from contextlib import ExitStack

import click

from . import logs, options, status
from .options import FILE

# NumPy, which is imported later, asks Linux for huge pages: its arrays are short-lived here, and finding room for such
# pages took 5.1 s of the 15 of a million faces, small ones 2.2 (and no longer in the program).
os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")


@click.command(cls=options.Command)
@click.argument("mesh", type=FILE)
@options.of("flatten")
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
    outside: bool,
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
    from ..flattening import METHODS
    from ..io import files, formats, references
    from ..io.meshes import size_limits
    from ..io.meshes.mesh_files import check_output
    from ..io.run import flat_files, flatten
    from ..io.spec import Spec

    click.get_current_context().with_resource(references.outside(outside))
    if not (output or uv or report or plot):
        output = (f"{Spec.of(mesh).path.stem}-flat.svg",)
    for name in output:
        flat_files.check(name)
    if uv:
        check_output(uv)
    if plot:
        formats.check(plot, "plot", "--plot")
    formats.check_report(report)
    outputs = [name for name in (*output, uv, plot, None if report == "-" else report) if name]
    inputs = [Spec.of(name).path for name in ((mesh,) if method in METHODS else (mesh, method))]
    files.check_outputs(outputs, inputs, force=force)
    size_limits.faces(Spec.of(mesh).path, max_faces)
    with ExitStack() as stack:
        stack.enter_context(status.show_phases("flatten"))
        laid = flatten.lay_out(mesh, method, cut=cut, tell=lambda note: logs.log.warning(f"{mesh}: {note}"))
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
