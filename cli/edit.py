"""`iccm edit`."""

from __future__ import annotations

import gc
from typing import Any

import click

from ..io import extras
from . import logs, options, process
from .options import FILE


@click.command("edit", cls=options.Command)
@click.argument("source", type=FILE, required=False)
@click.argument("target", type=FILE, required=False)
@options.of("edit")
def command(**arguments: Any) -> int:
    """Place pins and strokes on SOURCE and TARGET in the browser and watch the map follow.

    The page's address is written to stdout; only this computer can open it. Files change only when you press Save.
    The command ends with Ctrl-C, or when the page is closed. Without arguments, choose the files on the page; without
    TARGET, the pins deform SOURCE.

    \b
    iccm edit
    iccm edit rose.svg leaf.svg --texture petals.jpg
    iccm edit cat.svg round.svg --constraints pairs.json
    iccm edit gingerbread.svg --texture icing.png

    Exit code: 0 the page was closed, 2 wrong input, 130 Ctrl-C.
    """
    for package in ("starlette", "uvicorn", "websockets"):
        extras.load("iccm edit", package)
    from ..io.edit import server
    from ..io.edit.workspace import EditedFiles

    port, browser = arguments.pop("port") or 0, not arguments.pop("no_browser")
    arguments.pop("threads")
    process.leave_signals()
    gc.enable()  # it runs long
    workspace = EditedFiles(**options.values(arguments))
    for note in workspace.session.view.notes if workspace.session else ():
        logs.tell(note)
    server.serve(workspace, port=port, browser=browser, show=click.echo)
    if workspace.session and workspace.session.scene != workspace.session.saved:
        logs.tell("unsaved pins and strokes are kept; run the same command again to restore them")
    return 0
