"""Unsaved changes to a pair, kept in the user's state folder in case the browser or the server dies."""

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
from .session import Left, Session


class Unsaved(StrictModel):
    """Pins and strokes that have not been saved to a file.

    Attributes:
        scene: the pins and strokes.
        start: the map that the scene's map continues from.
        when: time of the last change.
        port: of the server that edited them; the next server reuses it, so that a page that is still open reconnects.
        token: of the address of that server.
    """

    scene: Scene
    start: StartingMap | None
    when: datetime
    port: int
    token: str


def folder() -> Path:
    """Return the folder for persistent state: $XDG_STATE_HOME, or the system's equivalent."""
    home = os.environ.get("LOCALAPPDATA") if os.name == "nt" else os.environ.get("XDG_STATE_HOME")
    return Path(home or Path.home() / ".local" / "state") / "iccm" / "edit"


def make_private(path: Path) -> None:
    """Make a folder in `folder()` readable by the user alone, and create it if necessary: the token of the page's
    address is stored there.

    Raises:
        InputError: the folder cannot be created or made private.
    """
    make_private_folder(path, folder().parent)


def path(job: Job) -> Path:
    """Return the file in which unsaved changes to a pair are kept."""
    specs = [
        os.path.abspath(path_of(spec)) + spec[len(path_of(spec)) :] for spec in (job.source, job.target or "")
    ]
    return folder() / f"{sha256(chr(0).join(specs).encode()).hexdigest()[:32]}.json"


def read(job: Job) -> Unsaved | None:
    """Return the unsaved changes to a pair, or None if there are none or they cannot be read."""
    try:
        return Unsaved.model_validate_json(path(job).read_bytes())
    except (OSError, ValidationError):
        return None


def offer(session: Session, unsaved: Unsaved | None) -> None:
    """Have the page ask whether to restore unsaved changes from an earlier session."""
    if unsaved is None or unsaved.scene == session.pair.first:
        return
    session.left = Left(unsaved.scene, unsaved.when)
    if unsaved.start:
        with suppress(InputError):  # the files have changed: start from scratch
            session.begin(unsaved.scene, unsaved.start)


def keep(session: Session, scene: Scene, port: int, token: str) -> None:
    """Store unsaved changes, readable by the user alone; delete them once everything is saved.

    Raises:
        InputError: the file cannot be written.
    """
    if session.left and scene == session.left.scene:
        session.left = None
    if scene == session.saved:
        if not session.left:
            forget(session.pair.job)
        return
    unsaved = Unsaved(scene=scene, start=session.start(scene), when=datetime.now(UTC), port=port, token=token)
    make_private(folder())
    write_bytes(path(session.pair.job), unsaved.model_dump_json().encode(), force=True, private=True)


def forget(job: Job) -> None:
    """Delete the stored changes to a pair."""
    with suppress(OSError):
        path(job).unlink()
