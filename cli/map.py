"""`iccm map`."""

from __future__ import annotations

from typing import Any

import click

from . import logs, options, status
from .options import FILE


@click.command(cls=options.Command)
@click.argument("source", type=FILE)
@click.argument("target", type=FILE)
@options.of("map")
@logs.options
def command(**given: Any) -> int:
    """Map the shape SOURCE onto the shape TARGET and carry a texture through the map.

    SOURCE and TARGET are files (SVG, a picture with a silhouette, OBJ) or file#id, an element of the file.
    Coordinates are in the files' own units. Without options the picture SOURCE-TARGET.png of a numbered
    checkerboard is written.

    \b
    iccm map rose.svg leaf.svg
    iccm map rose.svg leaf.svg --texture petals.png -o out.png --size 2048 --report out.json
    iccm map face.svg mask.svg --pin 30,40:28,44 --quasi 0.1 --plot fit.png

    Exit code: 0 done, 1 the result is not good enough, 2 an input is wrong.
    """
    return execute(given)


def execute(given: dict[str, Any]) -> int:
    """Run the job of these options, tell about it on stderr, and give the exit code."""
    with status.show_status() as listener:
        from ..io.run.execute import run
        from ..io.run.job import make
        from ..maps.summary import in_short, summary

        threads, dry = given.pop("threads"), given.pop("dry_run")
        job = make(options.values(given))
        outcome = run(job, threads=threads, tell=logs.tell, listener=listener, dry=dry)
    for line in summary(outcome.report):
        logs.log.debug(line)
    for name in outcome.written:
        logs.log.info(f"{'would write' if dry else 'wrote'} {name}")
    if dry:
        return 0
    if not outcome.ok:
        logs.log.error(outcome.message)
        return 1
    logs.log.info(": ".join(filter(None, [in_short(outcome.report), outcome.message])))
    return 0
