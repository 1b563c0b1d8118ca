"""`iccm doctor`."""

from __future__ import annotations

import click

from . import options, status


@click.command("doctor", cls=options.Command)
@options.of("doctor")
def command(json: bool) -> int:
    """Check that iccm is installed correctly: list versions, threads and folders, and compute a small map."""
    from json import dumps

    from ..io.doctor import examine

    bad = 0
    for finding in examine(lambda: status.show_phases("examine")):
        bad += finding.ok is False
        mark = {True: "ok", False: "WRONG", None: ""}[finding.ok]
        click.echo(dumps(vars(finding)) if json else f"{mark:6}{finding.check:24}{finding.result}")
    return 1 if bad else 0
