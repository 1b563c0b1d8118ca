"""The server's lifetime: from the command until the page is closed or Ctrl-C is pressed."""

from __future__ import annotations

import os
import secrets
import socket
import tempfile
import threading
import webbrowser
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import uvicorn

from ...errors import InputError
from .. import limits
from . import autosave
from .routes import app
from .workspace import EditedFiles, remove_old_copies

BROWSER_DELAY_SECONDS = 0.3
"""Seconds before the browser is opened; by then the server must be listening."""


def serve(workspace: EditedFiles, *, port: int, browser: bool, show: Callable[[str], None]) -> None:
    """Serve a workspace until its page is closed.

    Args:
        workspace: the open shapes.
        port: 0 for any free port.
        browser: whether to open the page.
        show: called with the page's address.

    Raises:
        InputError: the port is in use.
        KeyboardInterrupt: on Ctrl-C.
    """
    remove_old_copies()
    unsaved = autosave.read(workspace.session.pair.job) if workspace.session else None
    if workspace.session:
        autosave.offer(workspace.session, unsaved)
    with (
        listen(port or (unsaved.port if unsaved else 0), any_if_used=not port) as listener,
        tempfile.TemporaryDirectory(prefix="iccm-edit-", ignore_cleanup_errors=True) as private_folder,
    ):
        port = listener.getsockname()[1]
        token = unsaved.token if unsaved else secrets.token_urlsafe(24)
        address = f"http://127.0.0.1:{port}/{token}/"
        redirect = Path(private_folder, "iccm-edit.html")

        def stop() -> None:
            server.should_exit = True

        server = uvicorn.Server(
            uvicorn.Config(
                app(
                    workspace,
                    token,
                    port,
                    stop,
                    lambda session, scene: autosave.keep(session, scene, port, token),
                    arrived=lambda: redirect.unlink(missing_ok=True),
                ),
                lifespan="off",
                log_config=None,
                access_log=False,
                server_header=False,
                ws_max_size=limits.PAGE_MESSAGE_BYTES,
                ws_ping_interval=None,  # a machine that was asleep has not closed its page
                timeout_graceful_shutdown=1,
            )
        )
        show(address)
        if browser:
            write_redirect(redirect, address)
            threading.Timer(BROWSER_DELAY_SECONDS, _open, (redirect,)).start()
        server.run(sockets=[listener])


def write_redirect(path: Path, address: str) -> None:
    """Write a page that only the user can read and that leads to an address.

    The browser is started with the name of this file, because all users of the machine can read the arguments of a
    process, and who knows the address can write files in the user's name.
    """
    content = f"""<!DOCTYPE html><html lang="en"><meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={address}"><title>iccm edit</title><a href="{address}">iccm edit</a></html>
"""
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with open(handle, "w", encoding="utf-8") as file:
        file.write(content)


def _open(page: Path) -> None:
    with suppress(Exception):  # the address was printed: it can be opened by hand
        webbrowser.open(page.as_uri())


def listen(port: int, *, any_if_used: bool = False) -> socket.socket:
    """Return a listening socket that only this machine can reach; on any other port if this one is in use and
    `any_if_used`.

    Raises:
        InputError: the port is in use, or may not be used.
    """
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if os.name != "nt":  # the port of a server that died a moment ago can be reused
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("127.0.0.1", port))
        listener.listen()
    except OSError as error:
        listener.close()
        if any_if_used:
            return listen(0)
        raise InputError(
            f"--port {port}: {error.strerror}; leave the option out to use any free port"
        ) from error
    return listener
