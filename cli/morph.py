"""`iccm morph`."""

from __future__ import annotations

from typing import Any

import click

from . import logs, options, status
from .options import FILE


@click.command("morph", cls=options.Command)
@click.argument("source", type=FILE)
@click.argument("target", type=FILE)
@options.of("morph")
def command(source: str, target: str, **arguments: Any) -> int:
    """Animate SOURCE into TARGET, with its texture.

    The first frame shows the source on the target's canvas, the last one the target. No frame folds or overlaps
    itself, and sizes and angles change evenly over time. All parts of both drawings are shown; parts without a
    partner fade in or out. Use pins and --turn to control which points correspond.

    \b
    iccm morph rose.svg leaf.svg -o rose-leaf.webp
    iccm morph rose.svg leaf.svg --back-and-forth -o rose-leaf.gif
    iccm morph rose.svg leaf.svg -o rose-leaf.css.svg
    iccm morph rose.svg leaf.svg -o 'm-{number}.svg'

    Exit code: 0 done, 1 the last frame differs from the target, 2 wrong input.
    """
    from ..io.run.job import make
    from ..io.run.morph import MorphSettings, run

    settings = MorphSettings(
        *(arguments.pop(name) for name in ("frames", "target_texture", "fps", "back_and_forth"))
    )
    threads = arguments.pop("threads")
    with status.show_status() as listener:
        job = make(options.values({"source": source, "target": target, **arguments}))
        ok, message, written = run(job, settings, threads=threads, tell=logs.tell, listener=listener)
    logs.log.info(f"wrote {written[0]}" + (f" to {written[-1]}" if len(written) > 1 else ""))
    (logs.log.info if ok else logs.log.error)(message)
    return int(not ok)
