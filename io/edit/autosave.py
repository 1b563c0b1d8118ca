"""What was not saved of a pair, in the user's state folder: for a browser or a server that dies."""

from __future__ import annotations

import os
from contextlib import suppress
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path

from pydantic import ValidationError

from ...errors import InputError
from ..checked import StrictModel
from ..files import make_private_folder, write_bytes
from ..run.job import Job
from ..shapes.starts import StartingMap
from ..spec import path_of
from .messages import Scene
from .session import Session


class Unsaved(StrictModel):
    """Pins and strokes that no file has.

    Attributes:
        scene: these.
        start: the map that theirs continues from.
        when: they were last changed.
        port: of the server that had them: the next one takes its place, so that a page that is still open continues.
        token: of its address.
    """

    scene: Scene
    start: StartingMap | None
    when: datetime
    port: int
    token: str


def folder() -> Path:
    """Return where programs keep what is to outlast them: $XDG_STATE_HOME, or what the system has for it."""
    home = os.environ.get("LOCALAPPDATA") if os.name == "nt" else os.environ.get("XDG_STATE_HOME")
    return Path(home or Path.home() / ".local" / "state") / "iccm" / "edit"


def make_private(path: Path) -> None:
    """Make a folder in, or the one that is, `folder`: for the user alone, as the token of the page's address is kept
    there.

    Raises:
        InputError: it cannot be made so.
    """
    make_private_folder(path, folder().parent)


def path(job: Job) -> Path:
    """Return the file of a pair."""
    specs = [
        os.path.abspath(path_of(spec)) + spec[len(path_of(spec)) :] for spec in (job.source, job.target or "")
    ]
    return folder() / f"{sha256(chr(0).join(specs).encode()).hexdigest()[:32]}.json"


def read(job: Job) -> Unsaved | None:
    """Return what was kept of a pair, if anything was that can be read."""
    try:
        return Unsaved.model_validate_json(path(job).read_bytes())
    except (OSError, ValidationError):
        return None


def offer(session: Session, left: Unsaved | None) -> None:
    """Let the page ask whether to continue with what was left of the pair."""
    if left is None or left.scene == session.first:
        return
    session.left = left.scene
    if left.start:
        with suppress(InputError):  # the files have changed: from scratch
            session.begin(left.scene, left.start.map(session.source, session.target))


def keep(session: Session, scene: Scene, port: int, token: str) -> None:
    """Write what is not saved, for the user alone to read; forget it when all is.

    Raises:
        InputError: it cannot be written.
    """
    if scene == session.left:
        session.left = None
    if scene == session.saved:
        if not session.left:
            forget(session.job)
        return
    found, pair = session.start(scene), (session.source, session.target)
    start = None if found is None else StartingMap.of(found, *pair)
    unsaved = Unsaved(scene=scene, start=start, when=datetime.now(UTC), port=port, token=token)
    make_private(folder())
    write_bytes(path(session.job), unsaved.model_dump_json().encode(), force=True, private=True)


def forget(job: Job) -> None:
    """Nothing is unsaved any more."""
    with suppress(OSError):
        path(job).unlink()
