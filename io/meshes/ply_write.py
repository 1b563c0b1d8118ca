"""Write new texture coordinates to a PLY file that is otherwise unchanged."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...arrays import Flags, Index, Real
from ...errors import InputError
from ...meshes.mesh import Mesh
from ...surfaces.subdivided import Subdivision
from .ply import COORDINATES, CORNERWISE, INDICES, TEXTURE, Ply, PlyElement, Property, parse
from .splitting import Split, replaced, with_triangles

NUMBER = "%.9g"  # single precision, as text


@dataclass(eq=False)
class Changes:
    """The new header lines, and the new bytes of each element."""

    header: list[str]
    bodies: dict[str, bytes]


def with_coordinates(
    ply: Ply, faces: Flags, uv: Real, uv_corners: Index, texture: str | None
) -> tuple[bytes, list[str]]:
    """Return the file with new texture coordinates for some faces.

    They replace existing ones at corners of faces (`texcoord`) or at vertices (`s` and `t`, `u` and `v`, …), or are
    added to vertices as `s` and `t`. Vertices with several coordinates are split; the copies come last.

    Args:
        ply: the file.
        faces: (f,) marks the faces that change.
        uv: (t, 2) coordinates, v up.
        uv_corners: (c,) index into `uv` for each of their corners.
        texture: name of the picture to show, relative to the folder of the new file.

    Returns:
        Its bytes, and notes.

    Raises:
        InputError: vertices have list properties, and cannot be written any other way.
    """
    corners, starts = ply.polygons
    changed = np.repeat(faces, np.diff(starts))
    changes = Changes(
        list(ply.header), {name: _bytes(table.cells, table.starts) for name, table in ply.tables.items()}
    )
    table, notes = ply.faces, list[str]()
    if table is not None and CORNERWISE in table:
        _, cells, begins = table.lists(CORNERWISE)
        has_all_corners = (begins == 2 * starts).all()  # two numbers for each
        if has_all_corners:
            _cornerwise(changes, table, cells.reshape(-1, 2)[changed], uv[uv_corners])
            return _whole(ply, changes, texture), notes
        notes.append("its lists of texture coordinates do not cover all corners and are kept unchanged")
    names = ply.named(*COORDINATES)
    old = np.zeros((len(ply.tables["vertex"].starts) - 1, 2)) if names is None else ply.vertices(names)
    # index of each corner's coordinates among the new and the old ones, which unchanged faces keep
    index = len(uv) + corners
    index[changed] = uv_corners
    split = Split.of(corners, index, len(old))
    values = split.values(np.concatenate([uv, old]), old)
    _vertices(ply, changes, names, split.order, values)
    if split.copies.size:
        _corners(ply, changes, split.number)
    return _whole(ply, changes, texture), notes


def subdivided(ply: Ply, plan: Subdivision) -> Ply:
    """Return the file with some faces replaced by triangles, which inherit the properties of their face.

    Raises:
        InputError: vertices have list properties, and cannot be split.
    """
    corners, starts = ply.polygons
    vertices = ply.tables["vertex"]
    if any(p.count for p in vertices.properties):
        raise InputError(
            f"{ply.path}: vertices with lists cannot be split at seams; write an OBJ or GLB instead"
        )
    mixed = plan.mixtures(corners, len(vertices.starts) - 1)
    numbers, begins = with_triangles(starts, corners, plan, mixed.number)
    changes = Changes(list(ply.header), {name: _bytes(t.cells, t.starts) for name, t in ply.tables.items()})
    rows = _room(vertices.cells).reshape(len(vertices.starts) - 1, -1)
    new = rows[mixed.parents[:, 0]]
    for k, prop in enumerate(vertices.properties):
        values = mixed.of(vertices.column(prop.name))
        whole = np.dtype(prop.dtype).kind in "iu"
        offsets = new.shape[1] * np.arange(len(new)) + vertices.starts[0, k]
        _put(new.reshape(-1), offsets, np.round(values) if whole else values, prop.dtype)
    rows = np.concatenate([rows, new])
    changes.bodies["vertex"] = _bytes(rows.reshape(-1), rows.shape[1] * np.arange(len(rows) + 1)[:, None])
    _count(changes, "vertex", len(rows))
    if ply.faces is None:
        _corners(ply, changes, numbers)
    else:
        changes.bodies[ply.faces.name] = _faces(ply.faces, corners, plan, numbers, begins)
        _count(changes, ply.faces.name, len(begins) - 1)
    return parse(_whole(ply, changes, None), ply.path)


def _faces(table: PlyElement, corners: Index, plan: Subdivision, numbers: Index, begins: Index) -> bytes:
    """Return rows of faces with vertices (c,), each with the other properties of the face that it replaces."""
    times = plan.sizes(np.zeros(len(table.starts) - 1, np.int64))
    parent = np.repeat(np.arange(times.size), times)
    new = np.flatnonzero(np.repeat(replaced(plan, times.size), times))
    indices = next(p for p in INDICES if p in table)
    cornerwise = table.lists(CORNERWISE) if CORNERWISE in table else None
    parts = list[list[bytes]]()
    for k, prop in enumerate(table.properties):
        cells = [table.cells[a:b] for a, b in zip(table.starts[:-1, k], table.starts[:-1, k + 1])]
        parts.append([_cells(cells[face]) for face in parent])
        values = dict[int, NDArray]()
        if prop.name == indices:
            values = dict(enumerate(np.split(numbers, begins[1:-1])))
        elif prop.name == CORNERWISE and cornerwise is not None and (cornerwise[2][-1] == 2 * corners.size):
            mixed = np.einsum(
                "kij,kjc->kic", plan.weights, cornerwise[0].reshape(-1, 2)[plan.corners].astype(float)
            )
            values = dict(zip(new.tolist(), mixed.reshape(len(mixed), -1)))
        for row in new.tolist() if values else ():
            parts[-1][row] = _list(values[row], prop, table.text)
    end = b"\n" if table.text else b""
    between = b" " if table.text else b""
    return b"".join(between.join(row) + end for row in zip(*parts))


def _cells(cells: NDArray) -> bytes:
    return b" ".join(cells.tolist()) if cells.dtype.kind == "S" else cells.tobytes()


def _list(values: NDArray, prop: Property, text: bool) -> bytes:
    """Return a list property as bytes of the file."""
    if not text:
        return np.array([len(values)], prop.count).tobytes() + values.astype(prop.dtype).tobytes()
    cells = np.zeros(len(values), "S24")
    _put(cells, np.arange(len(values)), values, prop.dtype)
    return b"%d " % len(values) + b" ".join(cells.tolist())


def _count(changes: Changes, name: str, count: int) -> None:
    """Set the number of rows of an element in the header."""
    row = next(k for k, line in enumerate(changes.header) if line.split()[:2] == ["element", name])
    changes.header[row] = f"element {name} {count}"


def plain(mesh: Mesh, name: Path) -> Ply:
    """Return a mesh of another format as a binary file, still without texture coordinates."""
    used, corners = np.unique(mesh.corners, return_inverse=True)
    properties = "".join(f"property float {axis}\n" for axis in "xyz")
    size = "uchar" if mesh.sizes.max(initial=0) < 256 else "int"
    head = (
        f"ply\nformat binary_little_endian 1.0\ncomment iccm\nelement vertex {used.size}\n{properties}"
        f"element face {mesh.sizes.size}\nproperty list {size} int vertex_indices\nend_header\n"
    )
    size_type, size_bytes = ("u1", 1) if size == "uchar" else ("<i4", 4)
    # each face is its number of corners, and then their indices of 4 bytes each
    begins = np.concatenate([[0], np.cumsum(size_bytes + 4 * mesh.sizes)])
    body = np.zeros(begins[-1], np.uint8)
    _put(body, begins[:-1], mesh.sizes, size_type)
    place_in_face = np.arange(corners.size) - np.repeat(mesh.starts[:-1], mesh.sizes)
    index_at = np.repeat(begins[:-1] + size_bytes, mesh.sizes) + 4 * place_in_face
    _put(body, index_at, corners.ravel(), "<i4")
    return parse(head.encode() + mesh.points[used].astype("<f4").tobytes() + body.tobytes(), name)


def _put(cells: NDArray, starts: Index, values: NDArray, dtype: str) -> None:
    """Write values (n,) to the cells at which they begin."""
    if cells.dtype.kind == "S":
        whole = np.dtype(dtype).kind in "iu"
        cells[starts] = [b"%d" % v if whole else (NUMBER % v).encode() for v in values.tolist()]
        return
    raw = np.ascontiguousarray(values.astype(dtype)).view(np.uint8).reshape(len(values), -1)
    cells[starts[:, None] + np.arange(raw.shape[1])] = raw


def _room(cells: NDArray) -> NDArray:
    """Return a copy of the cells; text cells get room for any number."""
    return cells.astype(f"S{max(cells.itemsize, 24)}") if cells.dtype.kind == "S" else cells.copy()


def _bytes(cells: NDArray, starts: Index) -> bytes:
    if cells.dtype.kind != "S":
        return cells.tobytes()
    words = cells.tolist()
    ends = starts[:, 0].tolist()
    return b"".join(b" ".join(words[a:b]) + b"\n" for a, b in pairwise(ends))


def _cornerwise(changes: Changes, table: PlyElement, places: Index, values: Real) -> None:
    """Set the texture coordinates (c, 2) of corners."""
    cells = _room(table.cells)
    prop = next(p for p in table.properties if p.name == CORNERWISE)
    _put(cells, places.ravel(), values.ravel(), prop.dtype)
    changes.bodies[table.name] = _bytes(cells, table.starts)


def _vertices(ply: Ply, changes: Changes, names: tuple[str, ...] | None, order: Index, values: Real) -> None:
    """Write the vertices in a new order, with coordinates (n, 2)."""
    table = ply.tables["vertex"]
    if any(p.count for p in table.properties):
        raise InputError(
            f"{ply.path}: texture coordinates cannot be added to vertices with lists; write "
            "an OBJ or GLB instead"
        )
    wide = int(table.starts[0, -1]) if len(table.starts) > 1 else 0
    rows = _room(table.cells).reshape(-1, wide)[order]
    head = next(k for k, line in enumerate(changes.header) if line.split()[:2] == ["element", "vertex"])
    changes.header[head] = f"element vertex {len(order)}"
    if names is not None:
        for name, column in zip(names, values.T):
            k, prop = next((k, p) for k, p in enumerate(table.properties) if p.name == name)
            flat = rows.reshape(-1)
            _put(flat, wide * np.arange(len(order)) + table.starts[0, k], column, prop.dtype)
    else:
        dtype = "f4" if table.text else table.properties[0].dtype[0] + "f4"
        added = np.zeros((len(order), 2 if table.text else 8), rows.dtype)
        _put(added.reshape(-1), np.arange(2 * len(order)) * (1 if table.text else 4), values.ravel(), dtype)
        rows = np.concatenate([rows, added], axis=1)
        after = changes.header[head + 1 :]
        end = next((k for k, line in enumerate(after) if line.split()[:1] == ["element"]), len(after))
        changes.header[head + 1 + end : head + 1 + end] = ["property float s", "property float t"]
    changes.bodies["vertex"] = _bytes(rows.reshape(-1), rows.shape[1] * np.arange(len(order) + 1)[:, None])


def _corners(ply: Ply, changes: Changes, vertices: Index) -> None:
    """Set the vertices (c,) of the faces' corners; strips become faces."""
    table = ply.faces
    if table is not None:
        name = next(p for p in INDICES if p in table)
        cells, prop = _room(table.cells), next(p for p in table.properties if p.name == name)
        _put(cells, table.lists(name)[1], vertices, prop.dtype)
        changes.bodies[table.name] = _bytes(cells, table.starts)
        return
    strips = ply.tables["tristrips"]
    faces = vertices.reshape(-1, 3)
    if strips.text:
        changes.bodies["tristrips"] = b"".join(b"3 %d %d %d\n" % tuple(face) for face in faces.tolist())
    else:
        order = strips.properties[0].dtype[0]
        rows = np.zeros(len(faces), [("n", "u1"), ("v", order + "i4", 3)])
        rows["n"], rows["v"] = 3, faces
        changes.bodies["tristrips"] = rows.tobytes()
    row = next(k for k, line in enumerate(changes.header) if line.split()[:2] == ["element", "tristrips"])
    changes.header[row : row + 2] = [f"element face {len(faces)}", "property list uchar int vertex_indices"]


def _whole(ply: Ply, changes: Changes, texture: str | None) -> bytes:
    header = changes.header
    if texture is not None:
        header = [line for line in header if TEXTURE not in line.lower()]
        header.insert(2, f"comment TextureFile {texture}")
    text = ply.newline.join([*header, "end_header", ""])
    bodies = b"".join(changes.bodies[name] for name in ply.tables)
    ascii_of = next(iter(ply.tables.values())).text
    bodies = bodies.replace(b"\n", ply.newline.encode()) if ascii_of and ply.newline != "\n" else bodies
    return text.encode("utf-8", "surrogateescape") + bodies
