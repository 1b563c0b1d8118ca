"""`iccm info`."""

from __future__ import annotations

from pathlib import Path

import click

from ..progress import tell
from . import logs, status
from .paths import FILE


@click.command()
@click.argument("file", type=FILE, nargs=-1, required=True)
@click.option("--json", "as_json", is_flag=True, help="One JSON object a file and line.")
@click.option("--max-faces", type=int, default=5_000_000, show_default=True, help="Refuse larger meshes.")
@logs.options
def command(file: tuple[str, ...], as_json: bool, max_faces: int) -> int:
    """Tell what iccm sees in each FILE: outlines and ids, pins and strokes, pictures, meshes, constraints, jobs."""
    import json

    from ..io.describe import describe, lines
    from ..io.run.report import plain

    for name in file:
        with status.shown():
            tell(f"read {name}")
            facts = describe(Path(name), max_faces=max_faces)
        click.echo(json.dumps(plain(facts), ensure_ascii=False) if as_json else "\n".join(lines(facts)))
    return 0
