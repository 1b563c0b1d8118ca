"""Routes of the server: the page's files, textures and meshes, files chosen on the page, and the websocket.

Only files named on the command line or chosen on the page are read from disk.
"""

from __future__ import annotations

import json
import mimetypes
import os
from collections.abc import Callable
from importlib.resources import files
from typing import Any
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket

from ...errors import InputError
from .. import limits
from ..run.report import as_json
from . import messages, saving
from .guard import Guard
from .link import Keep, Links
from .map_update import LOST, SEEN
from .wording import on_page
from .workspace import EditedFiles, parts_of

CONTENT_TYPES = {
    ".html": "text/html",
    ".css": "text/css",
    ".js": "text/javascript",
    ".svg": "image/svg+xml",
}
COMPARED_FIGURES = ("stretch", *SEEN, *LOST)  # of the maps of several fits
LEAST_SIDE_TEXELS = 2048  # of a texture's side: supported by every WebGL 2 implementation
MOST_SIDE_DIGITS = 5  # of a texture's side in a request


def page_files() -> dict[str, tuple[bytes, str]]:
    """Return content and media type of each of the page's files by name; the page itself has the empty name."""
    contents = {}
    for file in files(__package__).joinpath("page").iterdir():
        suffix = file.name[file.name.rfind(".") :]
        if suffix in CONTENT_TYPES:
            contents[file.name.replace("index.html", "")] = file.read_bytes(), CONTENT_TYPES[suffix]
    return contents


def app(
    workspace: EditedFiles,
    token: str,
    port: int,
    stop: Callable[[], None],
    keep: Keep = lambda *_: None,
    arrived: Callable[[], object] = lambda: None,
    **options: Any,
) -> Guard:
    """Make the application that answers requests with the right token.

    Args:
        workspace: the open shapes.
        token: the first part of every address.
        port: of the server.
        stop: called when the last page has been closed.
        keep: stores unsaved changes.
        arrived: called when a browser requests the page.
        **options: passed to `Links`.
    """
    answers = _Answers(workspace, Links(workspace, stop, keep, **options), arrived)
    routes: list[BaseRoute] = [
        Route(f"/{token}/{name}", answers.page_file(name, content, kind), methods=["GET"])
        for name, (content, kind) in page_files().items()
    ]
    routes += [
        Route(f"/{token}/texture.png", answers.texture, methods=["GET"]),
        Route(f"/{token}/{{side}}.drawing", answers.drawing, methods=["GET"]),
        Route(f"/{token}/{{side}}.triangles", answers.triangles, methods=["GET"]),
        Route(f"/{token}/files/{{name}}", answers.put_file, methods=["PUT"]),
        Route(f"/{token}/export", answers.export, methods=["POST"]),
        Route(f"/{token}/workspace", answers.describe_workspace, methods=["GET"]),
        Route(f"/{token}/workspace", answers.open_files, methods=["POST"]),
        WebSocketRoute(f"/{token}/link", answers.converse),
    ]
    served = Starlette(routes=routes)
    served.router.redirect_slashes = False
    return Guard(served, token, port)


class _Answers:
    """Handlers of the routes."""

    def __init__(self, workspace: EditedFiles, links: Links, arrived: Callable[[], object]) -> None:
        self._workspace, self._links, self._arrived = workspace, links, arrived

    def page_file(self, name: str, content: bytes, kind: str) -> Callable[..., Any]:
        """Return a handler that answers with a file of the page."""

        async def answer(_: Request) -> Response:
            if not name:
                self._links.expect()
                self._arrived()
            return Response(content, media_type=kind)

        return answer

    def texture(self, request: Request) -> Response:
        """Return the texture as a PNG, with at most as many pixels a side as the page asks for, and on its paper."""
        session = self._workspace.session
        if session is None:
            return Response(status_code=404)
        side = request.query_params.get("side", "")
        most = int(side) if side.isdecimal() and len(side) <= MOST_SIDE_DIGITS else LEAST_SIDE_TEXELS
        most = min(max(most, LEAST_SIDE_TEXELS), limits.PAGE_TEXELS)
        toned = request.query_params.get("paper") == "toned"
        return Response(session.view.texture(most, toned=toned), media_type="image/png")

    def triangles(self, request: Request) -> Response:
        """Return the mesh of a side."""
        session = self._workspace.session
        if session is None:
            return Response(status_code=404)
        try:
            content = session.view.triangles(request.path_params["side"])
        except KeyError:
            return Response(status_code=404)
        return Response(content, media_type="application/octet-stream")

    def drawing(self, request: Request) -> Response:
        """Return the picture in the file of a side, if there is one."""
        session = self._workspace.session
        if session is None:
            return Response(status_code=404)
        picture = session.view.drawing(request.path_params["side"])
        return Response(picture[0], media_type=picture[1]) if picture else Response(status_code=204)

    async def put_file(self, request: Request) -> Response:
        """Keep a file that was chosen or dropped on the page, and list its parts."""
        content = await _body(request, limits.PAGE_FILE_BYTES)
        if content is None:
            return JSONResponse({"error": f"the file has more than {limits.PAGE_FILE_BYTES >> 20} MB"})
        name, has_parts = request.path_params["name"], request.query_params.get("role") != "texture"
        if len(os.fsencode(name)) > limits.NAME_BYTES:
            return JSONResponse({"error": f"the name is longer than {limits.NAME_BYTES} bytes"}, 400)

        def keep() -> dict[str, Any]:
            path = self._workspace.put(name, content)
            return {"path": path, "parts": parts_of(path) if has_parts else []}

        return await _in_thread(keep)

    async def export(self, request: Request) -> Response:
        """Return a file that `iccm map` writes, to be shown or downloaded."""
        session = self._workspace.session
        if session is None:
            return Response(status_code=404)
        body = await _body(request, limits.PAGE_MESSAGE_BYTES)
        if body is None:
            return JSONResponse({"error": "the request is too large"}, 413)
        try:
            order = messages.read_download(body)
            result = await run_in_threadpool(saving.download, session, order.scene, order.name, order.size)
        except InputError as error:
            return JSONResponse({"error": on_page(str(error))})
        suffix = result.name[result.name.rfind(".") :].lower()
        kind = CONTENT_TYPES.get(suffix) or mimetypes.types_map.get(suffix, "application/octet-stream")
        notes = json.dumps([on_page(note) for note in result.notes])
        shown = json.dumps(as_json({name: result.figures.get(name) for name in COMPARED_FIGURES}))
        headers = {"x-file-name": quote(result.name), "x-notes": quote(notes), "x-figures": shown}
        return Response(result.content, media_type=kind, headers=headers)

    async def describe_workspace(self, request: Request) -> Response:
        """Return the open files and those that may be chosen; with ?side=source or target, the parts of that file."""
        side = request.query_params.get("side", "")
        if side in ("source", "target"):
            return await _in_thread(lambda: {"parts": self._workspace.parts(side)})
        return await _in_thread(self._workspace.describe)

    async def open_files(self, request: Request) -> Response:
        """Open the named files, or a sample."""
        body = await _body(request, limits.PAGE_MESSAGE_BYTES)
        if body is None:
            return JSONResponse({"error": "the request is too large"}, 413)
        try:
            chosen = json.loads(body)
        except (ValueError, RecursionError):
            chosen = None
        if not isinstance(chosen, dict) or not all(isinstance(value, str) for value in chosen.values()):
            return JSONResponse({"error": "not understood"}, 400)
        sample = chosen.pop("sample", None)

        def open_them() -> dict[str, Any]:
            if sample:
                self._workspace.open_sample(sample)
            else:
                self._workspace.open(chosen)
            return {}

        return await _in_thread(open_them)

    async def converse(self, page: WebSocket) -> None:
        """Serve the websocket of a page."""
        await self._links.serve(page)


async def _body(request: Request, most: int) -> bytes | None:
    """Return the body of a request; None, without reading on, if it exceeds so many bytes."""
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > most:
            return None
    return bytes(body)


async def _in_thread(call: Callable[[], dict[str, Any]]) -> Response:
    """Return the result of a call in another thread, or {"error": …}."""
    try:
        return JSONResponse(await run_in_threadpool(call))
    except InputError as error:
        return JSONResponse({"error": on_page(str(error))})
