"""`iccm flatten`."""

from __future__ import annotations

import os
from typing import Any

import click

from . import logs, options, status
from .options import FILE

# NumPy, which is imported later, asks Linux for huge pages: its arrays are short-lived here, and finding room for such
# pages took 5.1 s of the 15 of a million faces, small ones 2.2 (and no longer in the program).
os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")


@click.command("flatten", cls=options.Command)
@click.argument("mesh", type=FILE)
@options.of("flatten")
def command(**arguments: Any) -> int:
    """Flatten MESH (OBJ, GLB, PLY, OFF, STL, GIFTI, FreeSurfer) into the plane, without folds or overlaps.

    MESH is a file, file#part (an OBJ object, group or material), or file#2 to use the second-longest boundary as the
    outline. Holes stay holes. Without an output option, MESH-flat.svg is written to the current folder.

    \b
    iccm flatten face.obj -o face.svg
    iccm flatten body.obj#sleeve -o sleeve.svg --report - --plot sleeve.png
    iccm flatten cow.obj --cut-open --uv cow-uv.obj
    iccm flatten glove.obj --method balanced --plot glove.png
    iccm flatten face.obj --onto heart.svg --uv face-heart.obj

    Exit code: 0 done, 1 the flattening is not one-to-one, 2 wrong input.
    """
    from ..flattening import METHODS
    from ..io.run import flatten
    from ..io.run.job import FlattenJob, described
    from ..io.spec import Spec

    if not any(arguments[name] for name in ("output", *FlattenJob.written)):
        arguments["output"] = (f"{Spec.of(arguments['mesh']).path.stem}-flat.svg",)
    if not arguments["onto"] and arguments["method"] not in METHODS:
        logs.log.warning("--method OUTLINE is now --onto OUTLINE; the old form works until iccm 2")
    job = described(FlattenJob, options.values(arguments))
    with status.show_phases("flatten"):
        outcome = flatten.run(job, tell=logs.log.warning)
    return logs.conclude(job.mesh, outcome, flatten.summary(outcome.report))
