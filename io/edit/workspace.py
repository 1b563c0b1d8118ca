"""The workspace of the page: the pair that is edited, if any, and the files that can be opened."""

from __future__ import annotations

import os
import re
import time
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import xy_of
from ...errors import InputError
from .. import files, formats
from ..run.job import CHECKER, make
from ..shapes import shape
from ..shapes.shape import Shape
from ..shapes.silhouette import CANVAS
from ..spec import path_of
from ..svg.reader import SILHOUETTE
from . import autosave
from .saving import local
from .session import Session

SAMPLES = {
    "A face, by pins": ("pins", "round.svg", "cat.svg", "face.png"),
    "Limbs": ("limbs", "gingerbread.svg", "starfish.svg", "icing.png"),
    "A feather, by strokes": ("strokes", "straight.svg", "bent.svg", "barbs.jpg"),
}
"""Samples: folder, source, target and texture."""
KEPT_DAYS = 30  # days after which a file dropped on the page is removed, unless it was opened since
ALL = "all"
"""The name that the page gives to the whole drawing among its parts."""
SHOWN_PARTS = 30  # parts of a drawing, the largest first, that are shown as thumbnails
THUMBNAIL_POINTS = 300  # approximate number of points of a thumbnail's outline
ROLES = ("source", "target", "texture")
AUTOMATIC, WHOLE_PICTURE = "automatic", "whole picture"
"""The names of the shapes that a picture can be read as, besides its silhouette."""


class EditedFiles:
    """The session that is being edited, if any, and the means to open another.

    Attributes:
        session: what is edited; None until files have been chosen.
        chosen: the files chosen so far, by role.
    """

    def __init__(self, **options: Any) -> None:
        """Open the pair, or the shape to deform, given by the options of a job.

        Raises:
            InputError: as in `Session`.
        """
        self._options = options
        self.roles = {role: options[role] for role in ROLES if options.get(role)}
        self._known = {path_of(spec) for spec in self.roles.values()} | {CHECKER}
        self.session = Session(make(options)) if "source" in self.roles else None

    def describe(self) -> dict[str, Any]:
        """Return what the page needs to know to offer files."""
        pictures = formats.holding("picture")
        shapes = (*formats.holding("drawing"), *formats.holding("mesh"), *pictures)
        suffixes = {"source": shapes, "target": shapes, "texture": pictures}
        return {
            "chosen": self.roles,
            "paths": {role: path_of(spec) for role, spec in self.roles.items()},
            "samples": [_sample(name) for name in SAMPLES if samples_of(name)],
            "suffixes": {role: list(dict.fromkeys(names)) for role, names in suffixes.items()},
        }

    def put(self, name: str, content: bytes) -> str:
        """Return a path for a file from the browser: an identical file in the current folder, else a copy in the user's
        state folder.

        Raises:
            InputError: the name is not allowed, or the copy cannot be written.
        """
        local(name)
        path = Path(name)
        if not (path.is_file() and path.stat().st_size == len(content) and path.read_bytes() == content):
            folder = _copies() / _name_of(content)
            path = folder / name
            autosave.make_private(folder)
            if not path.exists():
                files.write_bytes(path, content, private=True)
            os.utime(path)
        self._known.add(str(path))
        return str(path)

    def open(self, specs: dict[str, str], *, resumed: bool = True) -> None:
        """Open other files, or the same shapes with another texture; the latter keeps pins and strokes.

        Args:
            specs: specs by role, of files that were put here or given before.
            resumed: whether to offer the unsaved changes of an earlier session.

        Raises:
            InputError: a file is neither, or as in `Session`.
        """
        for spec in filter(None, specs.values()):
            if path_of(spec) not in self._known:
                raise InputError(f"{spec}: choose this file again")
        roles = {role: spec for role, spec in (self.roles | specs).items() if role in ROLES and spec}
        if "source" not in roles:
            raise InputError("choose a source shape as well")
        previous = self.session
        is_same_pair = all(roles.get(side) == self.roles.get(side) for side in ("source", "target"))
        options = self._options | {role: roles.get(role) for role in ROLES}
        if not is_same_pair:  # they belong to other shapes
            options = {name: value for name, value in options.items() if name not in ("constraints", "pin")}
        session = Session(make(options))
        if previous is not None and is_same_pair:
            session.take_over(previous)
        elif resumed:
            autosave.offer(session, autosave.read(session.pair.job))
        self._options, self.roles, self.session = options, roles, session

    def open_sample(self, name: str) -> None:
        """Open one of `SAMPLES`.

        Raises:
            InputError: there is no sample with this name.
        """
        files = samples_of(name)
        if not files:
            raise InputError(f"{name}: unknown sample")
        self._known.update(files)
        self.open(dict(zip(ROLES, files)), resumed=False)  # whoever tried it before on this computer

    def parts(self, role: str) -> list[dict[str, Any]]:
        """Return the shapes in the file of a side, the largest first; see `parts_of`.

        Raises:
            InputError: the file is invalid.
        """
        return parts_of(path_of(self.roles[role])) if role in self.roles else []


@lru_cache
def _sample(name: str) -> dict[str, Any]:
    """Return a sample with thumbnails of both shapes."""
    source, target, _ = samples_of(name)
    shapes = [_part(shape.read(path, whole=True), path, "") for path in (source, target)]
    return {"name": name, "shapes": [part["d"] for part in shapes]}


def without_folders(text: str) -> str:
    """Return a message in which copies of the browser's files have the names that the user knows."""
    folder = re.escape(f"{_copies()}{os.sep}")
    return re.sub(rf"{folder}[0-9a-f]{{16}}[\\/]", "", text)


def _copies() -> Path:
    """Return the folder of copies of the browser's files, each in a subfolder named after its content."""
    return autosave.folder() / "files"


def _name_of(content: bytes) -> str:
    return sha256(content).hexdigest()[:16]


def remove_old_copies(present: float | None = None) -> None:
    """Remove copies of the browser's files that were last opened more than KEPT_DAYS days ago. `present` is in seconds
    since 1970.

    Files that were changed since, or are not such copies, belong to the user and are kept.
    """
    oldest = (time.time() if present is None else present) - KEPT_DAYS * 86400
    for path in _copies().glob("*/*"):
        with suppress(OSError):
            plain = path.is_file() and not (path.is_symlink() or path.parent.is_symlink())
            if plain and path.stat().st_mtime < oldest and _name_of(path.read_bytes()) == path.parent.name:
                path.unlink()
                path.parent.rmdir()  # fails if the folder contains anything else


def samples_of(name: str) -> list[str]:
    """Return the files of one of `SAMPLES`; empty if it was not installed."""
    folder, *names = SAMPLES.get(name, ("",))
    root = Path(__file__).parents[2] / "samples" / folder
    return [str(root / file) for file in names] if names and (root / names[0]).is_file() else []


def parts_of(path: str) -> list[dict[str, Any]]:
    """Return the shapes that a drawing or picture can be read as: the spec of each, its names, and its outline as SVG's
    `d`.

    If there are several, the whole drawing comes first, and the silhouette of an SVG last. For a picture, its rectangle
    and its silhouette are among them. There are none for meshes.

    Raises:
        InputError: the file is invalid, or draws nothing.
    """
    if formats.of(Path(path)).mesh:
        return []
    if formats.suffix_of(path) in formats.holding("picture"):
        return _parts_of_picture(path)
    shapes = shape.read_all(path)
    parts = [_part(part, f"{path}#{part.part}", ", ".join(part.names[:1])) for part in shapes[:SHOWN_PARTS]]
    if len(shapes) > 1:
        with suppress(InputError):  # its largest part may not be a shape
            parts.insert(0, _part(shape.read(path, whole=True), path, ALL))
    if len(shapes) > 1 and formats.suffix_of(path) in (".svg", ".svgz"):
        whole = shape.read(f"{path}#{SILHOUETTE}", whole=True)
        parts.append(_part(whole, whole.spec, SILHOUETTE))
    return parts


def _parts_of_picture(path: str) -> list[dict[str, Any]]:
    """Return the shapes that a picture can be read as: iccm's choice, the whole picture, its silhouette, then single
    pieces.
    """
    parts = []
    for spec, name in (
        (path, AUTOMATIC),
        (f"{path}#{CANVAS}", WHOLE_PICTURE),
        (f"{path}#{SILHOUETTE}", SILHOUETTE),
    ):
        with suppress(InputError):  # nothing stands out from the background
            parts.append(_part(shape.read(spec, whole=True), spec, name))
    with suppress(InputError):
        pieces = shape.read_all(path)[:SHOWN_PARTS]
        parts += [_part(piece, f"{path}#{piece.part}", "") for piece in pieces] if len(pieces) > 1 else []
    if not parts:
        shape.read(path, whole=True)  # raises the error
    return [{**part, "picture": True} for part in parts]


def _part(part: Shape, spec: str, name: str) -> dict[str, Any]:
    """Return one of these shapes, with its thumbnail in a unit square, y down: outlines, and the frame around several
    parts.
    """
    low, high = part.box
    size = max((high - low).real, (high - low).imag)

    rings = part.drawing.rings if part.drawing else (part.curve.z, *part.holes)

    def ring(z: np.ndarray) -> str:
        points = xy_of((np.asarray(z)[:: max(1, len(z) // THUMBNAIL_POINTS)] - low) / size)
        return "M" + "L".join(f"{x:.3f} {1 - y:.3f}" for x, y in points) + "Z"

    width, height = (high - low).real / size, (high - low).imag / size
    framed = part.drawing is not None and not part.drawing.is_one_part
    return {
        "spec": spec,
        "name": name,
        "d": "".join(map(ring, rings)),
        "frame": ring(part.curve.z) if framed else "",
        "extent": [width, height],
    }
