"""An OBJ file, opened once for all that a run asks of it."""

import hashlib
import re
from functools import cached_property
from io import BufferedReader
from pathlib import Path

from ...errors import InputError
from .. import files, limits
from . import obj
from .obj import Obj

BLOCK = 1 << 20
LONGEST = 1 << 16  # bytes of a line that are looked at
_INDENTED = re.compile(rb"^[ \t]+f[ \t]", re.MULTILINE)
_LIBRARY = re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]+)", re.MULTILINE)


class ObjSource:
    """What is in an OBJ file.

    Attributes:
        path: the file.
        faces: how many it has; with one at most it is a drawing and no mesh.
        libraries: what its `mtllib` lines name.
    """

    def __init__(self, path: Path, keep: int = -1) -> None:
        """Look through the file, and keep its content if it has no more than `keep` faces.

        Raises:
            InputError: it is missing or cannot be read.
        """
        self.path = path
        with files.opened(path, max_bytes=limits.MESH_BYTES) as file:
            self.faces, self.libraries = _scan(file)
            file.seek(0)
            self._content = file.read() if self.faces <= keep else None

    @cached_property
    def obj(self) -> Obj:
        """All that it says.

        Raises:
            InputError: it is empty, or as `obj.parse`.
        """
        if not self._content:
            raise InputError(f"{self.path}: the file is empty")
        return obj.parse(self._content, self.path)

    @cached_property
    def sha256(self) -> str:
        """The hash of the content as it was read."""
        if self._content is None:
            return files.sha256(self.path)
        return hashlib.sha256(self._content).hexdigest()


def _scan(file: BufferedReader) -> tuple[int, list[bytes]]:
    """The number of faces and the names of the libraries, a block of whole lines at a time."""
    faces, libraries, rest = 0, list[bytes](), b"\n"
    while block := file.read(BLOCK):
        block = rest + block.replace(b"\r", b"\n")  # old files end lines so
        end = block.rfind(b"\n")
        lines, rest = block[:end], block[end:][:LONGEST]
        faces += _faces(lines)
        libraries += _libraries(lines)
    return faces + _faces(rest), libraries + _libraries(rest)


def _faces(lines: bytes) -> int:
    """How many lines are faces, where each begins with a line end; the search for those with blanks is slow."""
    found = lines.count(b"\nf ") + lines.count(b"\nf\t")
    return found + len(_INDENTED.findall(lines)) if b"\n " in lines or b"\n\t" in lines else found


def _libraries(lines: bytes) -> list[bytes]:
    return _LIBRARY.findall(lines) if b"mtllib" in lines else []
