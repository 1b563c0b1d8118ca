"""`iccm edit`."""

from __future__ import annotations

import gc
from typing import Any

import click

from ..errors import InputError
from . import logs, options, process
from .options import FILE

EXTRA = "iccm edit needs a server: pip install 'iccm[edit]'"


@click.command("edit", cls=options.Command)
@click.argument("source", type=FILE, required=False)
@click.argument("target", type=FILE, required=False)
@options.of("edit")
def command(**given: Any) -> int:
    """Place pins and strokes on SOURCE and TARGET in the browser, and see the map follow.

    The page's address is written to stdout; nobody but this machine reaches it. Files change only by Save. Ends with
    Ctrl-C, or when the page is closed. Without SOURCE and TARGET they are chosen on the page; without TARGET the pins
    deform SOURCE.

    \b
    iccm edit
    iccm edit rose.svg leaf.svg --texture petals.jpg
    iccm edit cat.svg round.svg --constraints pairs.json
    iccm edit gingerbread.svg --texture icing.png

    Exit code: 0 the page was closed, 2 an input is wrong, 130 Ctrl-C.
    """
    try:
        import websockets  # noqa: F401  (uvicorn speaks to pages by it)

        from ..io.edit import server
    except ModuleNotFoundError as error:
        if error.name not in ("starlette", "uvicorn", "websockets"):
            raise
        raise InputError(EXTRA) from None
    from ..io.edit.workspace import Workspace

    port, browser = given.pop("port") or 0, not given.pop("no_browser")
    given.pop("threads")
    process.leave_signals()
    gc.enable()  # it runs long
    workspace = Workspace(**options.values(given))
    for note in workspace.session.notes if workspace.session else ():
        logs.tell(note)
    server.serve(workspace, port=port, browser=browser, show=click.echo)
    if workspace.session and workspace.session.scene != workspace.session.saved:
        logs.tell("not saved, but kept: the same command offers it again")
    return 0
