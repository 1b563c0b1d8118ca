"""Read PLY files without loss: every property of every element, comments and their order, ASCII or binary.

Turk, *The PLY Polygon File Format*, 1994. trimesh does not read binary files whose faces have different numbers of
corners, triangulates polygons, and cannot write everything back.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...arrays import Index, Real, distinct_rows
from ...meshes.mesh import Mesh
from .. import files, limits
from .odd_forms import strip

TYPES = {
    **{"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2"},
    **{"ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4"},
    **{"float": "f4", "float32": "f4", "double": "f8", "float64": "f8"},
}
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
INDICES = ("vertex_indices", "vertex_index")
COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))  # names used by various programs
COLOURS = ("red", "green", "blue")
CORNERWISE = "texcoord"  # list property with the coordinates of a face's corners
TEXTURE = "texturefile"  # in a comment, before the file name of a picture


@dataclass(frozen=True)
class Property:
    """A property: its name, and numpy's codes of its type and, for a list, of the type of its count."""

    name: str
    dtype: str
    count: str = ""


@dataclass(frozen=True, eq=False)
class PlyElement:
    """The rows of an element in cells: bytes, or the numbers of an ASCII file as text.

    Attributes:
        name: of the element.
        properties: in order.
        cells: (k,) cells of all rows.
        starts: (n, p + 1) first cell of each property of each row, and the end of the row.
    """

    name: str
    properties: tuple[Property, ...]
    cells: NDArray
    starts: Index

    def __contains__(self, name: str) -> bool:
        return any(p.name == name for p in self.properties)

    @property
    def text(self) -> bool:
        """Whether cells are text."""
        return self.cells.dtype.kind == "S"

    def column(self, name: str) -> NDArray:
        """Return (n,) the values of a scalar property."""
        k, prop = self._place(name)
        return _values(self.cells, self.starts[:-1, k], prop.dtype)

    def lists(self, name: str) -> tuple[NDArray, Index, Index]:
        """Return a list property: values (c,), their positions in the cells (c,), and where rows begin (n + 1,)."""
        k, prop = self._place(name)
        starts = self.starts[:-1, k]
        sizes = _values(self.cells, starts, prop.count).astype(np.int64)
        begins = np.concatenate([[0], np.cumsum(sizes)])
        # a list is its size and then its values, each of which takes one cell in text, or some bytes
        size_cells = 1 if self.text else np.dtype(prop.count).itemsize
        value_cells = 1 if self.text else np.dtype(prop.dtype).itemsize
        place_in_list = np.arange(begins[-1]) - np.repeat(begins[:-1], sizes)
        cells = np.repeat(starts + size_cells, sizes) + value_cells * place_in_list
        return _values(self.cells, cells, prop.dtype), cells, begins

    def _place(self, name: str) -> tuple[int, Property]:
        return next((k, p) for k, p in enumerate(self.properties) if p.name == name)


@dataclass(frozen=True, eq=False)
class Ply:
    """A PLY file.

    Attributes:
        path: the file.
        header: its lines before `end_header`.
        newline: its line end.
        tables: its elements, in order.
    """

    path: Path
    header: tuple[str, ...]
    newline: str
    tables: dict[str, PlyElement]

    @cached_property
    def polygons(self) -> tuple[Index, Index]:
        """Vertices of all faces' corners, and (f + 1,) where each face begins; strips become triangles; shape (c,)."""
        for name in ("face", "faces"):
            if name in self.tables and len(self.tables[name].starts) > 1:
                list_name = next(p for p in INDICES if p in self.tables[name])
                corners, _, starts = self.tables[name].lists(list_name)
                return corners.astype(np.int64), starts
        if "tristrips" not in self.tables:
            return np.zeros(0, np.int64), np.zeros(1, np.int64)
        table = self.tables["tristrips"]
        corners, _, starts = table.lists(table.properties[0].name)
        parts = [strip(row) for row in np.split(corners.astype(np.int64), starts[1:-1])]
        faces = np.concatenate([np.zeros((0, 3), np.int64), *parts])
        return faces.ravel(), 3 * np.arange(len(faces) + 1)

    @property
    def faces(self) -> PlyElement | None:
        """The table of faces; None for strips."""
        return self.tables.get("face", self.tables.get("faces"))

    def named(self, *sets: tuple[str, ...]) -> tuple[str, ...] | None:
        """Return the first of several sets of property names that vertices have; None if there is none."""
        table = self.tables["vertex"]
        return next((names for names in sets if all(name in table for name in names)), None)

    def vertices(self, names: tuple[str, ...]) -> Real:
        """Return (n, k) values of the named properties of the vertices."""
        return np.column_stack([self.tables["vertex"].column(name).astype(float) for name in names])

    @property
    def vertex_colours(self) -> Real | None:
        """Colors of the vertices from 0 to 1, sRGB as programs store them; None if they have none; shape (n, 3)."""
        table = self.tables["vertex"]
        if self.named(COLOURS) is None:
            return None
        types = {p.name: np.dtype(p.dtype) for p in table.properties}
        tops = [np.iinfo(types[name]).max if types[name].kind in "iu" else 1 for name in COLOURS]
        return self.vertices(COLOURS) / tops

    @property
    def mesh(self) -> Mesh:
        """Its polygons."""
        corners, starts = self.polygons
        normals = self.named(("nx", "ny", "nz"))
        uv, uv_corners = self._coordinates(corners, starts)
        return Mesh(
            str(self.path),
            self.vertices(("x", "y", "z")),
            corners,
            starts,
            uv,
            uv_corners,
            normals=None if normals is None else self.vertices(normals),
            normal_corners=None if normals is None else corners,
        )

    def _coordinates(self, corners: Index, starts: Index) -> tuple[Real | None, Index | None]:
        if self.faces is not None and CORNERWISE in self.faces:
            values, _, begins = self.faces.lists(CORNERWISE)
            if (begins == 2 * starts).all():
                rows = np.column_stack([corners, values.reshape(-1, 2).astype(float)])
                first, index = distinct_rows(rows)
                return rows[first, 1:], index
        names = self.named(*COORDINATES)
        return (None, None) if names is None else (self.vertices(names), corners)

    @property
    def texture(self) -> Path | None:
        """The picture that a comment names, if it exists."""
        for line in self.header:
            _, keyword, name = line.lower().partition(TEXTURE)
            path = self.path.parent / line[len(line) - len(name) :].strip()
            if keyword and name.strip() and path.is_file():
                return path
        return None


def read(path: Path) -> Ply:
    """Read a .ply file.

    Raises:
        ValueError, IndexError, KeyError: the file does not have this format.
    """
    return parse(files.read_bytes(path, max_bytes=limits.MESH_BYTES), path)


def parse(data: bytes, path: Path) -> Ply:
    """Parse the bytes of a PLY file.

    Raises:
        ValueError, IndexError, KeyError: they do not have this format.
    """
    end = data.index(b"end_header")
    newline = next((mark for mark in ("\r\n", "\n") if mark.encode() in data[:end]), "\r")
    lines = data[:end].decode("utf-8", "surrogateescape").split(newline)[:-1]
    words = [line.split() for line in lines]
    if words[0][:1] != ["ply"]:
        raise ValueError("the file does not begin with 'ply'")
    order = FORMATS[next(line for line in words if line[:1] == ["format"])[1]]
    body = data[end + len("end_header") :]
    body = body[len(newline) :] if body.startswith(newline.encode()) else body.lstrip(b" ")[1:]
    cells = np.frombuffer(body, np.uint8) if order else np.array(body.split() or [b""])
    tables, offset = dict[str, PlyElement](), 0
    for name, count, properties in _elements(words, order):
        starts = _rows(cells[offset:], count, properties)
        end = int(starts[-1, 0])
        tables[name] = PlyElement(name, properties, cells[offset : offset + end], starts)
        offset += end
    _ = tables["vertex"]
    return Ply(path, tuple(lines), newline, tables)


def _elements(words: list[list[str]], order: str) -> list[tuple[str, int, tuple[Property, ...]]]:
    elements: list[tuple[str, int, tuple[Property, ...]]] = []
    for line in words:
        if line[:1] == ["element"]:
            elements.append((line[1], int(line[2]), ()))
        elif line[:1] == ["property"]:
            name, count, properties = elements.pop()
            types = [order + TYPES[word] for word in (line[2:4] if line[1] == "list" else line[1:2])]
            elements.append((name, count, (*properties, Property(line[-1], types[-1], "".join(types[:-1])))))
    return elements


def _cells(dtype: str, is_text: bool) -> int:
    """Return the number of cells that a number takes."""
    return 1 if is_text else np.dtype(dtype).itemsize


def _rows(cells: NDArray, count: int, properties: tuple[Property, ...]) -> Index:
    """Return (n + 1, p + 1) the first cell of each property of each row, and of a row after the last.

    Raises:
        ValueError: there are fewer cells than needed.
    """
    is_text = cells.dtype.kind == "S"  # a number is one cell of text, or as many cells as it has bytes
    sizes = [0 if p.count else _cells(p.dtype, is_text) for p in properties]
    heads = [_cells(p.count, is_text) if p.count else 0 for p in properties]
    least = max(1, sum(sizes) + sum(heads))
    if not 0 <= count * least <= cells.size:
        raise ValueError(f"there is not enough data for {count} rows; is the file truncated?")
    counted = [k for k, p in enumerate(properties) if p.count]
    row = _walk(cells, 1, properties, sizes, heads)[0] if count and counted else np.cumsum([0, *sizes])
    starts = row[-1] * np.arange(count + 1)[:, None] + row
    if starts[-1, 0] <= cells.size and all(_alike(cells, starts[:-1, k], properties[k]) for k in counted):
        return starts
    return _walk(cells, count, properties, sizes, heads)


def _alike(cells: NDArray, starts: Index, prop: Property) -> bool:
    """Return whether all lists have the same length."""
    counts = _values(cells, starts, prop.count)
    return bool((counts == counts[:1]).all())


def _walk(cells: NDArray, count: int, properties, sizes: list[int], heads: list[int]) -> Index:
    """Compute the result of `_rows` row by row, for lists of different lengths."""
    wide = [_cells(p.dtype, cells.dtype.kind == "S") for p in properties]
    counted = [_counter(cells, p) if p.count else None for p in properties]
    starts, position = np.empty((count + 1, len(properties) + 1), np.int64), 0
    for row in range(count):
        places = [position]
        for k, counts in enumerate(counted):
            position += sizes[k] if counts is None else heads[k] + wide[k] * counts(position)
            places.append(position)
        starts[row] = places
        if position > cells.size:
            raise ValueError(f"row {row} is incomplete; is the file truncated?")
    starts[count] = position
    return starts


def _counter(cells: NDArray, prop: Property) -> Callable[[int], int]:
    """Return a function from a cell to the length of the list that begins there."""

    def counts(start: int) -> int:
        size = int(_values(cells, np.array([start]), prop.count)[0])
        if size < 0:
            raise ValueError("a list has a negative length")
        return size

    if cells.dtype.kind == "S" or prop.count[1:] != "u1":
        return counts
    return lambda start: int(cells[start])


def _values(cells: NDArray, starts: Index, dtype: str) -> NDArray:
    """Return (n,) values at cells (n,); in ASCII files integers are read as floats, too."""
    if cells.dtype.kind == "S":
        return cells[starts].astype(float)
    if not starts.size:
        return np.zeros(0, dtype)
    return (
        np.ascontiguousarray(cells[starts[:, None] + np.arange(np.dtype(dtype).itemsize)]).view(dtype).ravel()
    )
