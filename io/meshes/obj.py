"""Read OBJ files without loss, so that everything that is not changed can be written back byte by byte.

Vertex and face order, polygons, groups, smoothing, materials, comments, spacing, line ends and negative indices are
kept. New texture coordinates change only `vt` lines and the texture indices of `f` lines; a texture also changes
`mtllib` and `usemtl`.
"""

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...arrays import Index, Real
from ...errors import InputError
from ...meshes.mesh import Mesh
from .. import files, limits
from . import obj_scan
from .obj_scan import Elements

NUMBER_WIDTH = 32  # longest number, in bytes, that is converted by numpy together with others
WRONG = {
    1: "a face needs at least 3 corners; is the file truncated?",
    2: "a corner must have the form v, v/vt, v//vn or v/vt/vn with whole numbers other than 0",
    3: "too few numbers; is the file truncated?",
}


VERTEX_LINE = re.compile(rb"^[ \t]*v[ \t][^\r\n]*", re.MULTILINE)
CHANNELS, BYTE_TOP = ("red", "green", "blue"), 255.0  # of a vertex color, and its largest number


@dataclass(frozen=True)
class Statement:
    """An `o`, `g`, `usemtl` or `mtllib` line: first byte, end including the line end, keyword, and the rest."""

    start: int
    end: int
    keyword: str
    text: str


@dataclass(frozen=True, eq=False)
class Obj(Elements):
    """The bytes of an OBJ file and their content.

    Attributes:
        path: the file.
        data: its bytes.
        statements: `o`, `g`, `usemtl` and `mtllib` lines in file order.
    """

    path: Path
    data: bytes
    statements: tuple[Statement, ...]

    @cached_property
    def vertex_colours(self) -> Real | None:
        """Colors of the vertices from 0 to 1, sRGB as programs write them after positions; shape (n, 3).

        None unless every vertex has one. Numbers up to 255 are accepted, which some scanners write.
        """
        rows = [line.split(b"#")[0].split()[4:7] for line in VERTEX_LINE.findall(self.data)]
        if len(rows) != len(self.v) or not rows or min(map(len, rows)) < len(CHANNELS):
            return None
        try:
            colours = np.array(rows, dtype="S32").astype(float)
        except ValueError:
            return None
        if not (np.isfinite(colours).all() and colours.min() >= 0 and colours.max() <= BYTE_TOP):
            return None
        return colours / BYTE_TOP if colours.max() > 1 else colours

    @cached_property
    def line_ends(self) -> Index:
        """Positions of line ends, used to convert a byte position into a line number."""
        return line_ends(self.data)

    def mesh(self, part: str | None = None) -> Mesh:
        """Return all polygons, or those of the object, group or material called `part`.

        Raises:
            InputError: there is no such part; the message lists the parts.
        """
        faces = np.ones(len(self.face_at), bool) if part is None else self.faces_of(part)
        return self.mesh_of(faces, str(self.path) + ("" if part is None else f"#{part}"))

    def mesh_of(self, faces: NDArray[np.bool_], name: str) -> Mesh:
        """Return the polygons marked in `faces` (f,) as a mesh; it has normals only if all of its corners do."""
        lines = np.searchsorted(self.line_ends, self.face_at) + 1
        has_uv = bool(len(self.vt)) and bool((self.corners[:, 1] >= 0).any())
        uv, uv_corners = (self.vt, self.corners[:, 1]) if has_uv else (None, None)
        whole = Mesh(name, self.v, self.corners[:, 0], self.starts, uv, uv_corners, 1, lines)
        materials, statements = self.current("usemtl")
        whole = replace(
            whole,
            normals=self._unit_normals,
            normal_corners=self.normals,
            materials=materials if statements else None,
        )
        mesh = whole if faces.all() else whole.part(faces, name)
        stated = self._has_normals(mesh.normal_corners)
        return mesh if stated else replace(mesh, normals=None, normal_corners=None)

    @cached_property
    def _unit_normals(self) -> Real:
        """Unit normals; NaN for zero vectors; shape (k, 3)."""
        size = np.linalg.norm(self.vn, axis=1, keepdims=True)
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.vn / size

    def _has_normals(self, corners: Index | None) -> bool:
        """Return whether all corners (c,) have a valid normal."""
        if corners is None or not len(self.vn):
            return False
        inside = (corners >= 0) & (corners < len(self.vn))
        return bool(inside.all() and np.isfinite(self._unit_normals[corners]).all())

    def faces_of(self, part: str) -> NDArray[np.bool_]:
        """Mark the faces (f,) of the object, group or material called `part`.

        Raises:
            InputError: there is no such part with faces.
        """
        for keyword in ("o", "g", "usemtl"):
            marked = self._marked(keyword, part)
            if marked.any():
                return marked
        raise InputError(
            f"{self.path}#{part}: there is no part '{part}' with faces; the file has {self._choices()}"
        )

    def parts(self) -> list[str]:
        """Return the names of objects, groups and materials with faces, in file order."""
        used: set[tuple[str, str]] = set()
        for keyword in ("o", "g", "usemtl"):
            statements = [s for s in self.statements if s.keyword == keyword]
            first = np.searchsorted(
                self.face_at, [s.start for s in statements] + [len(self.data)]
            )  # faces before each
            used |= {
                (keyword, name) for k in np.flatnonzero(np.diff(first)) for name in _names_of(statements[k])
            }
        keyed_names = ((s.keyword, name) for s in self.statements for name in _names_of(s))
        return list(dict.fromkeys(name for keyword, name in keyed_names if (keyword, name) in used))

    def names_at(self, faces: Index) -> set[str]:
        """Return the names of objects, groups and materials that faces (k,) belong to."""
        names: set[str] = set()
        for keyword in ("o", "g", "usemtl"):
            statement_at, statements = self.current(keyword)
            names.update(
                name for k in np.unique(statement_at[faces]) if k >= 0 for name in _names_of(statements[k])
            )
        return names

    def current(self, keyword: str) -> tuple[Index, list[Statement]]:
        """Return (f,) the index of the `keyword` statement in force at each face, -1 before the first; and these."""
        statements = [s for s in self.statements if s.keyword == keyword]
        return np.searchsorted([s.start for s in statements], self.face_at) - 1, statements

    def _marked(self, keyword: str, name: str) -> NDArray[np.bool_]:
        statement_at, statements = self.current(keyword)
        good = np.array(
            [name == s.text or (keyword == "g" and name in s.text.split()) for s in statements] + [False]
        )
        return good[statement_at]

    def _choices(self) -> str:
        names = self.parts()
        return (
            ", ".join(f"'{n}'" for n in names[:8]) + (" …" if len(names) > 8 else "")
            if names
            else "no named part"
        )


def _names_of(statement: Statement) -> list[str]:
    """Return the names that a statement gives to the following faces; a group may have several."""
    names = statement.text.split() if statement.keyword == "g" else [statement.text]
    return [name for name in names if name]


def line_ends(data: bytes) -> Index:
    """Return positions of line ends: \\n, or \\r in a file without \\n."""
    raw = np.frombuffer(data, np.uint8)
    ends = np.flatnonzero(raw == 10)
    return ends if ends.size else np.flatnonzero(raw == 13)


def read(path: str | Path) -> Obj:
    """Read an OBJ file.

    Raises:
        InputError: an invalid number or index, or a face with fewer than 3 corners; the message has file and line.
    """
    return parse(files.read_bytes(path, max_bytes=limits.MESH_BYTES), Path(path))


def parse(data: bytes, path: Path) -> Obj:
    """Parse the bytes of an OBJ file; `path` is used in messages.

    Raises:
        InputError: as `read`.
    """
    scan = obj_scan.scan(np.frombuffer(data, np.uint8))
    if scan.fault:
        raise InputError(f"{path}: {_place(data, scan.fault_at)}: {WRONG[scan.fault]}")
    elements, (positions, coordinates, normals) = scan.elements, scan.unconverted
    _convert(data, path, elements.v, *positions.T)
    _convert(data, path, elements.vt, *coordinates.T)
    _convert_normals(data, path, elements.vn, *normals.T)
    statements = tuple(_statement(data, int(start)) for start in scan.statement_at)
    return Obj(**vars(elements), path=path, data=data, statements=statements)


def _convert_normals(data: bytes, path: Path, vn: Real, indices: Index, offsets: Index) -> None:
    """Convert the numbers of normals; if one is invalid all become 0, since normals are optional."""
    try:
        _convert(data, path, vn, indices, offsets)
    except InputError:
        vn[:] = 0


def _convert(data: bytes, path: Path, values: Real, indices: Index, offsets: Index) -> None:
    """Convert the numbers that the scanner left: values.flat[indices] start at these bytes."""
    if not indices.size:
        return
    raw = np.frombuffer(data + b" " * NUMBER_WIDTH, np.uint8)
    text = raw[offsets[:, None] + np.arange(NUMBER_WIDTH)].copy()
    ends_number = (text <= ord(" ")) | (text == ord("\\"))
    after_number = np.cumsum(ends_number, axis=1) > 0
    text[after_number] = 0
    strings = text.view(f"S{NUMBER_WIDTH}").ravel()
    try:
        if not after_number[:, -1].all():
            raise ValueError("a number is too long")
        values.ravel()[indices] = strings.astype(np.float64)
    except ValueError:  # find the invalid number, or convert those that are too long
        for index, offset in zip(indices, offsets):
            values.ravel()[index] = _one_number(data, path, int(offset))


def _one_number(data: bytes, path: Path, offset: int) -> float:
    word = data[offset : offset + 400].split(maxsplit=1)[0].rstrip(b"\\")
    try:
        return float(word)
    except ValueError:
        excerpt = word[:30].decode("utf-8", "replace")
        raise InputError(f"{path}: {_place(data, offset)}: '{excerpt}' is not a number") from None


def _place(data: bytes, offset: int) -> str:
    return f"line {int(np.searchsorted(line_ends(data), offset)) + 1}"


def _statement(data: bytes, start: int) -> Statement:
    end = start
    while True:
        stop = [k for k in (data.find(b"\n", end), data.find(b"\r", end)) if k >= 0]
        end = min(stop, default=len(data))
        if end == 0 or end >= len(data) or data[end - 1 : end] != b"\\":
            break
        end += 2 if data[end : end + 2] == b"\r\n" else 1
    text = data[start:end].decode("utf-8", "surrogateescape").replace("\\\r\n", " ").replace("\\\n", " ")
    keyword, _, value = (
        text.strip().partition(" ") if "\t" not in text.strip()[:8] else text.strip().partition("\t")
    )
    after = end + (2 if data[end : end + 2] == b"\r\n" else 1)
    return Statement(start, min(after, len(data)), keyword, value.strip())
