"""`iccm doctor`."""

from __future__ import annotations

import click

from . import logs, status


@click.command()
@click.option("--json", "as_json", is_flag=True, help="One JSON object a finding and line.")
@logs.options
def command(as_json: bool) -> int:
    """Tell versions, threads, caches and write access, and try a small map. Exit code 1 when something is wrong."""
    import json

    from ..io.doctor import examine

    bad = 0
    for finding in examine(lambda: status.watched("examine")):
        bad += finding.ok is False
        mark = {True: "ok", False: "WRONG", None: ""}[finding.ok]
        click.echo(json.dumps(vars(finding)) if as_json else f"{mark:6}{finding.what:24}{finding.said}")
    return 1 if bad else 0
