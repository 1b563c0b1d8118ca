"""The page's files, and the life of the server: from the command until the page is closed or Ctrl-C."""

from __future__ import annotations

import json
import os
import secrets
import socket
import threading
import webbrowser
from collections.abc import Callable
from importlib.resources import files
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from ...errors import InputError
from .. import limits
from . import autosave
from .guard import Guard
from .link import Keep, Links
from .session import Session
from .workspace import Workspace, parts_of, remove_old_copies

TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
LEAST_TEXELS = 2048  # of a texture's side: what every WebGL 2 takes


def page_files() -> dict[str, tuple[bytes, str]]:
    """Content and type of each of the page's files, by name; the page itself has none."""
    found = {}
    for file in files(__package__).joinpath("page").iterdir():
        suffix = file.name[file.name.rfind(".") :]
        if suffix in TYPES:
            found[file.name.replace("index.html", "")] = file.read_bytes(), TYPES[suffix]
    return found


def app(
    workspace: Workspace,
    token: str,
    port: int,
    gone: Callable[[], None],
    keep: Keep = lambda *_: None,
    **options: Any,
) -> Guard:
    """What answers requests: the page's files, the texture, the conversation, and files that are chosen on the page;
    of the disk nothing is read that was not named on the command line or chosen."""
    links = Links(workspace, gone, keep, **options)

    def serving(name: str, content: bytes, kind: str) -> Callable[..., Any]:
        async def answer(_: Request) -> Response:
            if not name:
                links.expect()
            return Response(content, media_type=kind)

        return answer

    def of_session(make: Callable[[Session, Request], Response]) -> Callable[..., Any]:
        return lambda request: (
            make(workspace.session, request) if workspace.session else Response(status_code=404)
        )

    def texture(session: Session, request: Request) -> Response:
        side = request.query_params.get("side", "")
        most = int(side) if side.isdecimal() and len(side) < 6 else LEAST_TEXELS
        return Response(
            session.texture(min(max(most, LEAST_TEXELS), limits.PAGE_TEXELS)), media_type="image/png"
        )

    def triangles(session: Session, request: Request) -> Response:
        try:
            return Response(
                session.triangles(request.path_params["side"]), media_type="application/octet-stream"
            )
        except KeyError:
            return Response(status_code=404)

    def drawing(session: Session, request: Request) -> Response:
        found = session.drawing(request.path_params["side"])
        return Response(found[0], media_type=found[1]) if found else Response(status_code=204)

    async def put(request: Request) -> Response:
        content = bytearray()
        async for part in request.stream():
            content += part
            if len(content) > limits.PAGE_FILE_BYTES:
                return JSONResponse({"error": f"the file has more than {limits.PAGE_FILE_BYTES >> 20} MB"})
        name, shaped = request.path_params["name"], request.query_params.get("role") != "texture"
        if len(os.fsencode(name)) > limits.NAME_BYTES:
            return JSONResponse({"error": f"a name of more than {limits.NAME_BYTES} bytes"}, 400)

        def kept() -> dict[str, Any]:
            path = workspace.put(name, bytes(content))
            return {"path": path, "parts": parts_of(path) if shaped else []}

        return await _told(kept)

    async def lying(request: Request) -> Response:
        parts = {side: (lambda side=side: workspace.parts(side)) for side in ("source", "target")}
        side = request.query_params.get("side", "")
        return await _told(lambda: {"parts": parts[side]()} if side in parts else workspace.describe())

    async def choose(request: Request) -> Response:
        body = bytearray()
        async for part in request.stream():
            body += part
            if len(body) > limits.PAGE_MESSAGE_BYTES:
                return JSONResponse({"error": "more than the names of files"}, 413)
        try:
            chosen = json.loads(body)
        except (ValueError, RecursionError):
            chosen = None
        if not isinstance(chosen, dict) or not all(isinstance(each, str) for each in chosen.values()):
            return JSONResponse({"error": "not understood"}, 400)
        sample = chosen.pop("sample", None)

        def opened() -> dict[str, Any]:
            if sample:
                workspace.open_sample(sample)
            else:
                workspace.open(chosen)
            return {}

        return await _told(opened)

    async def talk(page: WebSocket) -> None:
        await links.serve(page)

    routes: list[Any] = [
        Route(f"/{token}/{name}", serving(name, data, kind), methods=["GET"])
        for name, (data, kind) in page_files().items()
    ]
    routes.append(Route(f"/{token}/texture.png", of_session(texture), methods=["GET"]))
    routes.append(Route(f"/{token}/{{side}}.drawing", of_session(drawing), methods=["GET"]))
    routes.append(Route(f"/{token}/{{side}}.triangles", of_session(triangles), methods=["GET"]))
    routes.append(Route(f"/{token}/files/{{name}}", put, methods=["PUT"]))
    routes.append(Route(f"/{token}/workspace", lying, methods=["GET"]))
    routes.append(Route(f"/{token}/workspace", choose, methods=["POST"]))
    routes.append(WebSocketRoute(f"/{token}/link", talk))
    served = Starlette(routes=routes)
    served.router.redirect_slashes = False
    return Guard(served, token, port)


async def _told(call: Callable[[], dict[str, Any]]) -> Response:
    """What a call in another thread gives, or {"error": …}."""
    try:
        return JSONResponse(await run_in_threadpool(call))
    except InputError as error:
        return JSONResponse({"error": str(error)})


def serve(workspace: Workspace, *, port: int, browser: bool, show: Callable[[str], None]) -> None:
    """Serve a workspace until its page is closed.

    Args:
        workspace: what is edited.
        port: 0 for any that is free.
        browser: whether to open the page.
        show: is given the page's address.

    Raises:
        InputError: the port is taken.
        KeyboardInterrupt: Ctrl-C.
    """
    remove_old_copies()
    left = autosave.read(workspace.session.job) if workspace.session else None
    if workspace.session:
        autosave.offer(workspace.session, left)
    with listen(port or (left.port if left else 0), otherwise=not port) as listener:
        port = listener.getsockname()[1]
        token = left.token if left else secrets.token_urlsafe(24)

        def gone() -> None:
            server.should_exit = True

        server = uvicorn.Server(
            uvicorn.Config(
                app(
                    workspace,
                    token,
                    port,
                    gone,
                    lambda session, scene: autosave.keep(session, scene, port, token),
                ),
                lifespan="off",
                log_config=None,
                access_log=False,
                server_header=False,
                ws_max_size=limits.PAGE_MESSAGE_BYTES,
                ws_ping_interval=None,  # a machine that slept has not closed its page
                timeout_graceful_shutdown=1,
            )
        )
        address = f"http://127.0.0.1:{port}/{token}/"
        show(address)
        if browser:
            threading.Timer(0.3, _open, (address,)).start()
        server.run(sockets=[listener])


def _open(address: str) -> None:
    try:
        webbrowser.open(address)
    except Exception:  # the address was shown: it can be opened by hand
        return


def listen(port: int, *, otherwise: bool = False) -> socket.socket:
    """A socket of this machine alone; if the port is taken and `otherwise`, of any other.

    Raises:
        InputError: the port is taken, or not for everybody.
    """
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if os.name != "nt":  # the port of a server that died a moment ago is free
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("127.0.0.1", port))
        listener.listen()
    except OSError as error:
        listener.close()
        if otherwise:
            return listen(0)
        raise InputError(f"--port {port}: {error.strerror}; leave it out for a free one") from error
    return listener
