"""`iccm info`."""

from __future__ import annotations

from pathlib import Path

import click

from . import logs


@click.command()
@click.argument("file", nargs=-1, required=True)
@click.option("--json", "as_json", is_flag=True, help="One JSON object a file and line.")
@logs.options
def command(file: tuple[str, ...], as_json: bool) -> int:
    """Tell what iccm sees in each FILE: outlines and ids, pins and strokes, pictures, meshes, constraints, jobs."""
    import json

    from ..io.describe import describe, lines
    from ..io.run.report import plain

    for name in file:
        facts = describe(Path(name))
        click.echo(json.dumps(plain(facts), ensure_ascii=False) if as_json else "\n".join(lines(facts)))
    return 0
