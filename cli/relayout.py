"""`iccm relayout`."""

from __future__ import annotations

from typing import Any

import click

from . import logs, options, status
from .options import FILE


@click.command("relayout", cls=options.Command)
@click.argument("old", type=FILE)
@click.argument("new", type=FILE)
@options.of("relayout")
def command(threads: int | None, **arguments: Any) -> int:
    """Transfer the materials or textures of OLD to NEW, the same surface with another UV layout.

    Triangles with the same corners are matched, whatever the order of the faces; elsewhere, texels are taken from the
    nearest point of OLD. Normals are rotated from the old tangents to the new ones (MikkTSpace).

    \b
    iccm relayout old.glb new.glb -o out.glb
    iccm relayout old.obj new.obj --texture albedo.png -o new-albedo.png
    iccm relayout old.glb new.glb --texture albedo.png -o 'new/{stem}.png'

    Exit code: 0 done, 1 a part of NEW is farther from OLD than the limit, or its layout is empty or overlaps itself, 2
    wrong input.
    """
    from ..io.run import relayout
    from ..io.run.job import RelayoutJob, described

    job = described(RelayoutJob, options.values(arguments))
    with status.show_phases("carry textures"):
        outcome = relayout.run(job, threads=threads)
    for note in outcome.notes:
        logs.log.warning(note)
    return logs.conclude(job.new, outcome, relayout.remarks(outcome.report))
