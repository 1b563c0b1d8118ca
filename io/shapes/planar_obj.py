"""Planar OBJ files as outlines: closed polylines (`l`), or the boundary loops of faces. y points up, as in the core."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...arrays import Complex, Real
from ...errors import InputError
from .. import files, limits
from ..meshes import obj
from ..meshes.obj import Obj
from ..svg.drawing_content import DrawingContent

FLAT_EXTENT_SHARE = 1e-6  # largest deviation from a plane z = constant, relative to the extent

_LINE = re.compile(rb"^[ \t]*l[ \t]+([^\r\n]*)", re.MULTILINE)
_VERTEX = re.compile(rb"^[ \t]*v[ \t]", re.MULTILINE)
_INDEX = re.compile(rb"([+-]?\d{1,18})(?:/[+-]?\d*)?")

Edges = NDArray[np.int64]  # (e, 2) pairs of vertices, from 0


def read(
    path: Path, selection: str | None = None, *, flatness: float = 1e-4, max_bytes: int = limits.DRAWING_BYTES
) -> DrawingContent:
    """Return the closed outlines of an OBJ file in a plane z = constant, or those of the object or group `selection`.

    Polylines with common ends are joined; vertices at the same position count as one. Without `l` lines, the outlines
    are the boundary loops of the faces. Loops inside others are holes. `flatness` is not used, since there are no
    curves.

    Raises:
        InputError: not OBJ, an index out of range, or vertices that do not have the same z.
    """
    files.open_input(path, max_bytes=max_bytes)
    content = obj.read(path)
    if not len(content.v):
        raise InputError(f"{path}: contains no vertices (lines that begin with v)")
    lines = polylines(content)
    ids = list(dict.fromkeys(name for name, _ in lines)) if lines else content.parts()
    parts = lines or _boundary(content, selection if selection in ids else None)
    points = _planar(content, np.unique(np.concatenate([edges for _, edges in parts])))
    (x, y), (width, height) = points.min(axis=0).tolist(), np.ptp(points, axis=0).tolist()
    drawing = DrawingContent([], (x, y, width, height), flip=False, ids={name: None for name in ids if name})
    for name, edges in _gathered(parts, selection).items():
        _add(drawing, content, name, edges)
    drawing.outlines.sort(key=lambda o: -o.area)
    return drawing


def _gathered(parts: list[tuple[str, Edges]], selection: str | None) -> dict[str, Edges]:
    """Group the edges of the chosen parts by name."""
    selected = [(name, edges) for name, edges in parts if selection in (None, name)]
    names = dict.fromkeys(name for name, _ in selected)
    return {name: np.concatenate([e for n, e in selected if n == name]) for name in names}


def _add(drawing: DrawingContent, content: Obj, name: str, edges: Edges) -> None:
    """Add a part's outlines to the drawing, or the reason why it has none."""
    points = _planar(content, np.unique(edges))
    place, merged = np.unique(content.v[:, :2], axis=0, return_inverse=True)
    z = place.view(np.complex128).ravel()  # includes unused vertices
    label = repr(name) if name else "the polylines"
    rings, area = _rings(merged.reshape(-1)[edges], z), float(np.prod(np.ptp(points, axis=0)))
    drawing.add((z[k] for k in rings), "evenodd", label, (name,) if name else (), area, keep_crossed=False)


def _planar(content: Obj, indices: NDArray) -> Real:
    """Return x and y of the used vertices.

    Raises:
        InputError: they are not finite, or do not have the same z.
    """
    v = content.v[indices]
    wrong = ~(np.abs(v) <= limits.SVG_NUMBER).all(axis=1)
    if wrong.any():
        raise InputError(f"{content.path}: vertex {int(indices[wrong][0]) + 1} is not finite, or too large")
    extent = np.ptp(v, axis=0)
    if extent[2] > FLAT_EXTENT_SHARE * extent.max():
        raise InputError(
            f"{content.path}: does not lie in a plane z = constant{_remedy(extent, len(content.starts) - 1)}"
        )
    return v[:, :2]


def _remedy(extent: Real, faces: int) -> str:
    """Return the remedy for points that do not have the same z."""
    upright = next(
        (axis for axis, size in zip("xy", extent) if size <= FLAT_EXTENT_SHARE * extent.max()), None
    )
    if upright:
        where = f" but {upright} = constant; export it with z up (Blender: Forward Axis Y, Up Axis Z)"
        return where + (", or flatten it first with iccm flatten" if faces else "")
    return "; flatten it first with iccm flatten" if faces else "; draw it flat, and export it with z up"


def polylines(content: Obj) -> list[tuple[str, Edges]]:
    """Return the edges of `l` lines, each with the object or group in force there."""
    vertices = None
    lines = []
    names = [s for s in content.statements if s.keyword in ("o", "g")]
    places = [s.start for s in names]
    for line in _LINE.finditer(content.data):
        words = line[1].split(b"#")[0].replace(b"\\", b" ").split()
        index = np.array([_index(content, word, line.start()) for word in words], dtype=np.int64)
        if index.size < 2:
            raise InputError(f"{_place(content, line.start())}: a line (l) needs at least 2 vertices")
        if (index < 0).any():  # relative to the vertices so far
            if vertices is None:
                vertices = np.array([m.start() for m in _VERTEX.finditer(content.data)])
            index = np.where(index < 0, index + np.searchsorted(vertices, line.start()) + 1, index)
        bad = (index < 1) | (index > len(content.v))
        if bad.any():
            raise InputError(
                f"{_place(content, line.start())}: there is no vertex {words[int(np.argmax(bad))].decode()}"
            )
        number = int(np.searchsorted(places, line.start())) - 1
        name = names[number].text if number >= 0 else ""
        lines.append((name, np.column_stack([index[:-1], index[1:]]) - 1))
    return lines


def _index(content: Obj, word: bytes, position: int) -> int:
    match = _INDEX.fullmatch(word)
    if not match or not int(match[1]):
        text = word[:24].decode("utf-8", "replace")
        raise InputError(f"{_place(content, position)}: {text!r} is not a vertex")
    return int(match[1])


def _place(content: Obj, position: int) -> str:
    return f"{content.path}: line {int(np.searchsorted(content.line_ends, position)) + 1}"


def _boundary(content: Obj, part: str | None) -> list[tuple[str, Edges]]:
    """Return the edges that belong to only one face, of the whole mesh or of one part."""
    if not len(content.face_at):
        raise InputError(f"{content.path}: contains no polylines (l) or faces (f)")
    mesh = content.mesh(part)
    corners = mesh.corners
    bad = (corners < 0) | (corners >= len(content.v))
    if bad.any():
        raise InputError(
            f"{content.path}: a face uses vertex {int(corners[bad][0]) + 1}, which does not exist"
        )
    after = np.arange(1, len(corners) + 1)
    after[mesh.starts[1:] - 1] = mesh.starts[:-1]
    edges = np.sort(np.column_stack([corners, corners[after]]), axis=1)
    single, count = np.unique(edges, axis=0, return_counts=True)
    if not (count == 1).any():
        raise InputError(
            f"{content.path}: the faces have no boundary; flatten the mesh first with iccm flatten"
        )
    return [(part or "", single[count == 1])]


def _rings(edges: Edges, z: Complex) -> Iterator[NDArray]:
    """Yield the closed paths of the edges, in which every vertex must have exactly two of them.

    Raises:
        InputError: a path has an end, or lines branch.
    """
    edges = np.unique(np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1), axis=0)
    half_edges = np.concatenate([edges, edges[:, ::-1]])
    half_edges = half_edges[np.argsort(half_edges[:, 0], kind="stable")]
    vertex, start, degree = np.unique(half_edges[:, 0], return_index=True, return_counts=True)
    for wrong, problem in ((degree == 1, "the outline is open: it ends"), (degree > 2, "lines branch")):
        if wrong.any():
            points = " and ".join(f"({p.real:g}, {p.imag:g})" for p in z[vertex[wrong]][:2])
            raise InputError(f"{problem} at {points}; every outline must be one closed loop")
    neighbours = {int(v): (int(half_edges[s, 1]), int(half_edges[s + 1, 1])) for v, s in zip(vertex, start)}
    while neighbours:
        first = previous = next(iter(neighbours))
        current, ring = neighbours.pop(first)[0], [first]
        while current != first:
            ring.append(current)
            a, b = neighbours.pop(current)
            previous, current = current, b if a == previous else a
        yield np.array(ring)
