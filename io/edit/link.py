"""The websocket between server and page.

Maps are computed in three threads: one for the coarse map during dragging, one for the converged map, and one for the
map from scratch that the converged map is compared with. If several requests arrive while a thread is busy, only the
newest is served.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from ...errors import InputError, naming
from ..files import check_output
from ..shapes.landmarks import landmarks_file
from ..shapes.landmarks.pairs import LandmarkPairs
from . import messages, placing, saving
from .messages import (
    AddHandles,
    Draw,
    Export,
    Follow,
    Forget,
    Place,
    ReadPins,
    Save,
    Scene,
    Solve,
    Suggest,
    WritePins,
)
from .scene import frame
from .session import MapUpdate, Session
from .wording import message_on_page
from .workspace import EditedFiles

KINDS = ("follow", "solve", "compare")
Answered = Place | Suggest | AddHandles | Save | Draw | Export | Forget | ReadPins | WritePins
Keep = Callable[[Session, Scene], None]
IDLE_SECONDS = 0.5  # seconds without a change before a map is compared with the one from scratch
MOST_RELAXATIONS = 30  # steps of some 50 ms in which a map comes to rest
RELOAD_GRACE_SECONDS = 3.0  # seconds that the server waits for a page that is being reloaded to be requested
LOADING_SECONDS = 30.0  # seconds within which a requested page must connect
UNSUPPORTED = 1003  # close code (RFC 6455, 7.4.1): the type of data is not accepted
TAKE_OVER = '{"type":"take"}'  # sent by a waiting page when its user wants to edit there again
MISTAKE = "internal error, please report it ({}: {})"


class Links:
    """The open pages of a workspace.

    Only one of them edits: the newest, or the one that last asked to. The others wait, and may take over. `stop` is
    called when the last page has been closed.
    """

    def __init__(
        self,
        workspace: EditedFiles,
        stop: Callable[[], None],
        keep: Keep,
        grace: float = RELOAD_GRACE_SECONDS,
    ) -> None:
        self._workspace, self._stop, self._keep, self._grace = workspace, stop, keep, grace
        self._open: set[WebSocket] = set()
        self._replaced: asyncio.Event | None = None
        self._leaving: asyncio.TimerHandle | None = None
        self._expected = False
        self._pools = {kind: ThreadPoolExecutor(1, f"iccm-{kind}") for kind in (*KINDS, "files")}

    async def serve(self, socket: WebSocket) -> None:
        """Serve one page until it is closed."""
        await socket.accept()
        self._open.add(socket)
        self._expected = False
        self._leave(None)
        try:
            while await self._edit(socket):
                await _wait_for_return(socket)
        except WebSocketDisconnect:
            pass
        finally:
            self._open.discard(socket)
            if not self._open:
                self._leave(LOADING_SECONDS if self._expected else self._grace)

    async def _edit(self, socket: WebSocket) -> bool:
        """Let a page edit in place of the current one; return whether another page took over before it was closed."""
        if self._replaced:
            self._replaced.set()
        self._replaced = replaced = asyncio.Event()
        session = self._workspace.session
        if session is None:
            page = asyncio.create_task(_choosing(socket, self._workspace))
        else:
            link = _Link(session, socket, self._pools, partial(self._keep, session))
            page = asyncio.create_task(link.run())
        other = asyncio.create_task(replaced.wait())
        try:
            await asyncio.wait({page, other}, return_when=asyncio.FIRST_COMPLETED)
            if page.done():
                page.result()
                return False
        finally:
            other.cancel()
            page.cancel()
            with suppress(asyncio.CancelledError, WebSocketDisconnect):
                await page
            if self._replaced is replaced:
                self._replaced = None
        return True

    def expect(self) -> None:
        """Note that a page was requested, and wait for it to connect."""
        self._expected = True
        if self._leaving:
            self._leave(LOADING_SECONDS)

    def _leave(self, seconds: float | None) -> None:
        """Schedule the end of the server in some seconds; None cancels it."""
        if self._leaving:
            self._leaving.cancel()
        loop = asyncio.get_running_loop()
        self._leaving = None if seconds is None else loop.call_later(seconds, self._stop)


def _folder() -> str:
    """Return the current folder as a user would write it."""
    with suppress(ValueError, RuntimeError):
        return str(Path("~") / Path.cwd().relative_to(Path.home()))
    return str(Path.cwd())


async def _wait_for_return(socket: WebSocket) -> None:
    """Inform a page that another one is editing, and wait until the user wants to edit here again.

    Raises:
        WebSocketDisconnect: the page was closed.
    """
    with suppress(RuntimeError):
        await socket.send_json({"type": "taken"})
    while await _text(socket) != TAKE_OVER:
        pass


async def _text(socket: WebSocket) -> str:
    """Return the next message of a page, which sends text only.

    Raises:
        WebSocketDisconnect: the page was closed, or sent bytes, for which the connection is closed.
    """
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1000))
    text = message.get("text")
    if text is None:
        await socket.close(UNSUPPORTED)
        raise WebSocketDisconnect(UNSUPPORTED)
    return text


async def _choosing(socket: WebSocket, workspace: EditedFiles) -> None:
    """Serve a page on which no files have been opened yet, until it is closed."""
    with suppress(WebSocketDisconnect, RuntimeError):
        await socket.send_json({"type": "hello", "empty": True, **workspace.describe()})
        while True:
            await _text(socket)


class _Link:
    """The connection to the page that is editing."""

    def __init__(
        self,
        session: Session,
        socket: WebSocket,
        pools: dict[str, ThreadPoolExecutor],
        keep: Callable[[Scene], None],
    ) -> None:
        self._session, self._socket, self._pools, self._keep = session, socket, pools, keep
        self._newest: dict[str, asyncio.Queue[Any]] = {kind: asyncio.Queue(1) for kind in KINDS}
        self._sending = asyncio.Lock()
        self._has_reported = False

    async def run(self) -> None:
        """Serve the page until it is closed."""
        await self._say({"type": "hello", **self._session.describe(), **self._names()})
        async with asyncio.TaskGroup() as tasks:
            works = self._work("follow"), self._work("solve"), self._compare()
            workers = [tasks.create_task(work) for work in works]
            with suppress(WebSocketDisconnect):
                while True:
                    await self._hear(await _text(self._socket))
            for worker in workers:
                worker.cancel()

    async def _hear(self, text: str) -> None:
        try:
            message = messages.read(text)
        except InputError as error:
            return await self._say({"type": "error", "message": str(error)})
        if isinstance(message, Follow | Solve):
            self._session.scene = message.scene  # here, where messages arrive in order, not in the threads
            return self._put(message.type, message)
        pool = "follow" if isinstance(message, Place | Suggest | AddHandles) else "files"
        answer = await self._done(pool, self._answer, message)
        return await self._say({"type": "answer", "id": message.id, **answer})

    async def _work(self, kind: str) -> None:
        session, queue = self._session, self._newest[kind]
        while True:
            message: Follow | Solve = await queue.get()
            if session.scene is not message.scene:
                continue  # the pin was released in the meantime
            if isinstance(message, Solve) and not message.way:
                if message.hand and session.is_behind(message.scene):
                    await self._follow_last(message)
                await self._relax(message)  # so that the picture settles visibly, and does not jump
                if session.scene is not message.scene:
                    continue
            compute: Callable[[Scene], MapUpdate] = session.follow
            if isinstance(message, Solve):
                compute = partial(session.answer, way=message.way, hand=message.hand)
            shown: Any = await self._done(kind, compute, message.scene)
            if isinstance(shown, dict):
                shown = MapUpdate("error", False, shown["error"])
            if kind == "solve" and session.scene is not message.scene and shown.kind != "error":
                continue  # the user is dragging again
            if shown.scene is not None:
                session.scene = shown.scene
                message = message.model_copy(update={"scene": shown.scene})
            await self._show(message, shown)
            if kind == "follow":
                await self._relax(message)
            if kind == "solve" and shown.kind != "blocked":
                await self._kept(message.scene)
            if shown.kind in ("full", "blocked"):
                self._put("compare", message)

    async def _follow_last(self, message: Solve) -> None:
        """Show the map at the last place of a drag, where the hand came to rest before the map had followed it."""
        shown: Any = await self._done("follow", self._session.follow, message.scene)
        if isinstance(shown, MapUpdate) and shown.kind != "error":
            await self._show(message, shown)

    async def _relax(self, message: Follow | Solve) -> None:
        """Continue and show the map that followed a drag while nothing moves, until it has converged.

        Once the pin is released, it stays close to what was seen then.
        """
        session, queue = self._session, self._newest["follow"]
        is_released = isinstance(message, Solve) and message.hand == "released"
        released: Any = await self._done("follow", lambda: session.maps) if is_released else None
        for _ in range(MOST_RELAXATIONS):
            if not queue.empty() or session.scene is not message.scene:
                return
            if not session.has_followed(message.scene):
                return
            shown: Any = await self._done("follow", session.relax, message.scene, released)
            if not isinstance(shown, MapUpdate):
                return
            if session.scene is message.scene:  # else the converged map has been requested
                await self._show(message, shown)

    async def _kept(self, scene: Scene) -> None:
        """Keep unsaved changes; report a failure once."""
        failed = await self._done("files", self._keep, scene)
        if failed and not self._has_reported:
            self._has_reported = True
            await self._say(
                {"type": "error", "message": f"unsaved changes could not be kept: {failed['error']}"}
            )

    async def _compare(self) -> None:
        """While nothing else is to be done, compare the map with the one from scratch, and show the page what comes of
        it.
        """
        session, queue = self._session, self._newest["compare"]
        while True:
            message: Solve = await queue.get()
            await asyncio.sleep(IDLE_SECONDS)
            if session.scene is not message.scene or not queue.empty():
                continue
            was_blocked, compare = session.has_followed(message.scene), session.compare
            resting = message.hand == "resting"
            shown: Any = await self._done("compare", partial(compare, resting=resting), message.scene)
            if not isinstance(shown, MapUpdate) or session.scene is not message.scene:
                continue
            await self._show(message, shown)
            await self._kept(message.scene)
            if was_blocked and queue.empty():
                self._put("compare", message)  # the map that was found need not be the one from scratch

    def _put(self, kind: str, message: Follow | Solve) -> None:
        """Queue a request in place of the one that is waiting."""
        queue = self._newest[kind]
        if queue.full():
            queue.get_nowait()
        queue.put_nowait(message)

    async def _show(self, message: Follow | Solve, shown: MapUpdate) -> None:
        drawn, head = shown.drawn, shown.head(message.seq)
        if isinstance(message, Solve):
            head["command"] = saving.command(self._session, message.scene)
        if drawn is None:
            await self._say(head)
        else:
            await self._send(self._socket.send_bytes(frame(message_on_page(head), drawn)))

    async def _done(self, pool: str, call: Callable[..., Any], *arguments: Any) -> Any:
        """Return the result of a call in another thread, or {"error": …}."""
        try:
            return await asyncio.get_running_loop().run_in_executor(self._pools[pool], call, *arguments)
        except InputError as error:
            return {"error": str(error)}
        except Exception as error:  # an error in iccm must not close the page and lose the user's work
            return {"error": MISTAKE.format(type(error).__name__, " ".join(str(error).split()))}

    def _answer(self, message: Answered) -> dict[str, Any]:
        session = self._session
        match message:
            case Forget():
                return self._forget()
            case Place():
                return {"points": placing.transfer(session, message.side, message.points)}
            case Suggest():
                return {"pins": placing.suggest(session, message.scene)}
            case AddHandles():
                return {"pins": placing.handles(session, message.scene, message.rows, message.columns)}
            case ReadPins():
                with naming(message.name):
                    return {"pins": session.pair.read_pins(message.name, message.text)}
            case WritePins():
                return self._write_pins(message)
            case Export(write=False):
                command = saving.export_command(session, message.scene, message.name, message.size)
                unsaved = saving.unsaved_files(self._session, message.scene)
                return {"command": command, "sized": saving.has_size(message.name), "unsaved": unsaved}
            case Draw():
                return self._write(message, saving.copy_names(session, message.name))
            case _:
                return self._write(message, [message.name])

    def _forget(self) -> dict[str, Any]:
        session = self._session
        session.left = None
        self._keep(session.scene)
        return {}

    def _write_pins(self, message: WritePins) -> dict[str, Any]:
        pair = self._session.pair
        name = f"{saving.stem(pair.job)}{message.suffix}"
        file = landmarks_file.file_of(name)
        if file is None:
            raise InputError(f"{name}: no program's landmarks have this suffix")
        pairs = LandmarkPairs.of_pins(message.scene.pins, pair.source, pair.target, file.axes)
        return {"text": file.text(pairs), "name": name}

    def _must_confirm(self, name: str) -> bool:
        """Return whether the user must confirm that a file may be replaced: one that exists and was not written by this
        session.
        """
        session = self._session
        is_known = name in session.written or name == session.pair.job.constraints
        return not is_known and check_output(name, force=True).exists()

    def _write(self, message: Save | Draw | Export, names: list[str]) -> dict[str, Any]:
        """Write files, unless the user must confirm that some may be replaced."""
        if not message.replace and (existing := [name for name in names if self._must_confirm(name)]):
            return {"exists": existing}
        match message:
            case Export():
                written = self._export(message, names[0])
            case Save():
                written = self._save(message, names[0])
            case Draw():
                written = self._draw(message, names)
        return {**written, "folder": _folder()}

    def _export(self, message: Export, name: str) -> dict[str, Any]:
        session = self._session
        replace = message.replace or name in session.written
        outcome = saving.export(session, message.scene, name, message.size, replace=replace)
        return {"written": outcome.written, "notes": outcome.notes, "message": outcome.message}

    def _save(self, message: Save, name: str) -> dict[str, Any]:
        session, scene = self._session, message.scene
        name = saving.save(session, scene, name, replace=True)
        self._keep(scene)
        return {"written": [name], "command": saving.command(session, scene, {"constraints": name})}

    def _draw(self, message: Draw, names: list[str]) -> dict[str, Any]:
        session, scene = self._session, message.scene
        fields = saving.copies(session, scene, names, replace=True)
        session.note_files(scene, fields)
        if session.pair.drawn:
            session.saved = scene
            self._keep(scene)
        return {"written": names[: len(fields)], "command": saving.command(session, scene, fields)}

    def _names(self) -> dict[str, Any]:
        session = self._session
        name = saving.stem(session.pair.job) + session.pair.suffix
        file = saving.constraints_file(session)
        names = {"constraints": file, "picture": name, "drawn": session.pair.drawn, "ending": saving.ENDING}
        return names | {"restart": saving.edit_command(session)}

    async def _say(self, message: dict[str, Any]) -> None:
        await self._send(self._socket.send_json(message_on_page(message)))

    async def _send(self, sending: Any) -> None:
        with suppress(WebSocketDisconnect, RuntimeError):  # the page was closed
            async with self._sending:
                await sending
