"""`iccm info`."""

from __future__ import annotations

from pathlib import Path

import click

from ..progress import tell
from . import logs, options, status
from .options import FILE


@click.command(cls=options.Command)
@click.argument("file", type=FILE, nargs=-1, required=True)
@options.of("info")
@logs.options
def command(file: tuple[str, ...], json: bool, max_faces: int) -> int:
    """Tell what iccm sees in each FILE: outlines and ids, pins and strokes, pictures, meshes, constraints, jobs."""
    from json import dumps

    from ..io.describe import describe, lines
    from ..io.run.report import as_json

    for name in file:
        with status.show_status():
            tell(f"read {name}")
            facts = describe(Path(name), max_faces=max_faces)
        click.echo(dumps(as_json(facts), ensure_ascii=False) if json else "\n".join(lines(facts)))
    return 0
