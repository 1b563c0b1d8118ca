"""Write new texture coordinates, and a texture, to an OBJ file that is otherwise unchanged."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...arrays import Index, Real
from ...surfaces.subdivided import Mixtures, Subdivision
from . import obj_scan
from .obj import Obj
from .splitting import replaced

Edit = tuple[int, int, bytes]  # replace data[start:end] by these bytes


KINDS = {b"v": 0, b"vt": 1, b"vn": 2}
ELEMENTS = (b"f", b"l", b"p")


@dataclass(frozen=True)
class Binding:
    """How faces are bound to their texture.

    Attributes:
        library: file name for the `mtllib` line.
        rename: new material name by old one, for the faces that change; None means "no material".
        plain: material of the other faces that had none.
    """

    library: str
    rename: dict[str | None, str]
    plain: str


def retexture(
    obj: Obj, faces: NDArray[np.bool_], uv: Real, uv_corners: Index, binding: Binding | None = None
) -> bytes:
    """Return the file's bytes with new texture coordinates for some faces.

    Args:
        obj: the file.
        faces: (f,) marks the faces that change.
        uv: (t, 2) their texture coordinates, v up.
        uv_corners: (c,) index into `uv` for each of their corners, in file order.
        binding: the texture, if there is one.
    """
    corner_changes = np.repeat(faces, np.diff(obj.starts))
    keep_old = bool((obj.corners[~corner_changes, 1] >= 0).any())
    newline = _newline(obj)
    insertion = _line_of_first_change(obj, faces, keep_old)
    edits: list[Edit] = [] if keep_old else _runs_of_lines(obj)
    edits.append((insertion, insertion, vt_text(uv, newline.decode()).encode()))
    changed, index = _new_indices(obj, corner_changes, uv_corners, len(uv), insertion, keep_old)
    if binding is not None:
        edits += _binding_edits(obj, faces, binding, newline)
    return _apply(obj, edits, changed, index)


def rebind(obj: Obj, faces: NDArray[np.bool_], binding: Binding) -> bytes:
    """Return the file's bytes with other materials for some faces; arguments as for `retexture`."""
    nothing = np.zeros(0, np.int64)
    return _apply(obj, _binding_edits(obj, faces, binding, _newline(obj)), nothing, nothing)


def _newline(obj: Obj) -> bytes:
    head = obj.data[:4096]
    if b"\r\n" in head:
        return b"\r\n"
    return b"\r" if b"\r" in head and b"\n" not in obj.data else b"\n"


def _line_of_first_change(obj: Obj, faces: NDArray[np.bool_], keep_old: bool) -> int:
    """Return the position of the new vt lines: that of the old ones, but before the first face that needs them."""
    first = int(obj.face_at[np.flatnonzero(faces)[0]])
    return min(first, int(obj.vt_at[0])) if len(obj.vt_at) and not keep_old else first


def _runs_of_lines(obj: Obj) -> list[Edit]:
    """Return edits that delete all vt lines, merging consecutive lines."""
    if not len(obj.vt_at):
        return []
    ends = np.append(obj.line_ends, len(obj.data) - 1)
    stop = ends[np.searchsorted(ends, obj.vt_at)] + 1
    while (continues := _continues(obj.data, stop)).any():
        stop[continues] = ends[np.searchsorted(ends, stop[continues])] + 1
    begins = np.flatnonzero(np.append(True, obj.vt_at[1:] != stop[:-1]))
    last = np.append(begins[1:], len(stop)) - 1
    return [(int(a), int(b), b"") for a, b in zip(obj.vt_at[begins], stop[last])]


def _continues(data: bytes, stop: Index) -> NDArray[np.bool_]:
    """Return whether the line that ends before each byte continues after a backslash."""
    raw = np.frombuffer(b"  " + data, np.uint8)
    last_byte = np.where(raw[stop] == 13, raw[stop - 1], raw[stop])  # raw is shifted by two
    return (last_byte == 92) & (stop < len(data))


def vt_text(uv: Real, newline: str) -> str:
    """Return the `vt` lines of texture coordinates (t, 2)."""
    return (("vt %.10g %.10g" + newline) * len(uv)) % tuple(uv.ravel().tolist())


def _new_indices(
    obj, corner_changes, uv_corners, added: int, insertion: int, keep_old: bool
) -> tuple[Index, Index]:
    """Return the corners whose texture index changes, and their new indices.

    These are the corners with new coordinates, and those whose coordinates are renumbered because of the new lines.
    """
    old = obj.corners[:, 1]
    index = old.copy()
    first_new = int(np.searchsorted(obj.vt_at, insertion))
    if keep_old:
        index[old >= first_new] += added
        index[corner_changes] = first_new + uv_corners
        after = np.repeat(obj.face_at >= insertion, np.diff(obj.starts))
        is_renumbered = np.where(obj.relative, after != (old >= first_new), old >= first_new) & (old >= 0)
    else:
        index[corner_changes] = uv_corners
        is_renumbered = np.zeros(old.size, bool)
    changed = np.flatnonzero(corner_changes | is_renumbered)
    return changed, index[changed]


def _binding_edits(obj: Obj, faces: NDArray[np.bool_], binding: Binding, newline: bytes) -> list[Edit]:
    """Return edits that replace `mtllib` lines, and insert `usemtl` lines around faces that change material."""
    line = f"mtllib {binding.library}".encode("utf-8", "surrogateescape") + newline
    libraries = [s for s in obj.statements if s.keyword == "mtllib"]
    edits: list[Edit] = [(s.start, s.end, line if k == 0 else b"") for k, s in enumerate(libraries)]
    if not libraries:
        edits.append((0, 0, line))
    use_index, uses = obj.current("usemtl")
    names: list[str | None] = [s.text for s in uses] + [None]  # index -1 is before the first
    breaks = np.append(True, (use_index[1:] != use_index[:-1]) | (faces[1:] != faces[:-1]))
    begins = np.flatnonzero(breaks)
    previous: str | None = None
    for k, face in enumerate(begins):
        old_name = names[use_index[face]]
        new_name = binding.rename.get(old_name, old_name) if faces[face] else old_name
        current = old_name if k == 0 or use_index[face] != use_index[face - 1] else previous
        if new_name != current:
            use = f"usemtl {new_name if new_name is not None else binding.plain}".encode(
                "utf-8", "surrogateescape"
            )
            edits.append((int(obj.face_at[face]), int(obj.face_at[face]), use + newline))
        previous = new_name
    return edits


INDEX_BYTES = 20
"""Largest number of digits of a 64-bit index, by which its rewritten corner may be longer."""


def _apply(obj: Obj, edits: list[Edit], changed: Index, index: Index) -> bytes:
    """Apply edits and rewrite corner indices; edits at the same byte keep their order."""
    raw = np.frombuffer(obj.data, np.uint8)
    corner_at = obj.corner_at[changed]
    out = np.empty(len(obj.data) + INDEX_BYTES * changed.size, np.uint8)
    pieces, position = [], 0
    to_end = len(obj.data), len(obj.data), b""
    for start, end, text in [*sorted(edits, key=lambda edit: edit[:2]), to_end]:
        # what lies between the last edit and this one, with new indices
        first, after = np.searchsorted(corner_at, [position, start])
        size = obj_scan.rewrite(raw, position, start, corner_at[first:after], index[first:after], out)
        pieces += [out[:size].tobytes(), text]
        position = max(position, end)
    return b"".join(pieces)


def subdivided(obj: Obj, plan: Subdivision) -> bytes:
    """Return the file's bytes with some faces replaced by triangles.

    New vertices are inserted before the first of these, with colours if the old ones have them. Every other line is
    kept, except that indices past the new elements are increased, and relative ones become absolute.
    """
    counts = [len(obj.v), len(obj.vt), len(obj.vn)]
    items = [*obj.corners.T, obj.normals]
    mixed = [plan.mixtures(indices, count) for indices, count in zip(items, counts)]
    is_replaced, newline = replaced(plan, len(obj.face_at)), _newline(obj)
    counts_so_far, elements, faces = [0, 0, 0], list[list[list[float]]]([[], [], []]), 0
    lines = list[tuple[bytes, bytes, list[int]]]()  # first word, line, and counts of elements before it
    places = list[int]()
    for line in obj.data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").split(newline):
        word = line.split(None, 1)[:1]
        kind = word[0] if word else b""
        if kind in KINDS:
            counts_so_far[KINDS[kind]] += 1
            elements[KINDS[kind]].append([float(value) for value in line.split(b"#")[0].split()[1:]])
        elif kind == b"f":
            places.append(len(lines))
        lines.append((kind, line, list(counts_so_far) if kind in ELEMENTS else []))
    first = places[int(np.flatnonzero(is_replaced)[0])]
    first_counts = lines[first][2]
    added = [len(mixture.parents) for mixture in mixed]
    new_indices = [
        _moved(mixture.number, start, count, added_count)
        for mixture, start, count, added_count in zip(mixed, first_counts, counts, added)
    ]
    rows = np.searchsorted(plan.faces, np.arange(len(is_replaced) + 1))
    out = list[bytes]()
    for number, (kind, line, preceding) in enumerate(lines):
        if number == first:
            out += _new_lines(obj, mixed, elements)
        if kind == b"f" and is_replaced[faces]:
            out += [
                _face([indices[row] for indices in new_indices])
                for row in range(rows[faces], rows[faces + 1])
            ]
        else:
            text = (
                _renumbered(line, preceding, first_counts, added, after=number > first)
                if kind in ELEMENTS
                else line
            )
            out.append(text)
        faces += kind == b"f"
    return newline.join(out)


def _moved(number: Index, first: int, count: int, added: int) -> Index:
    """Return indices in the new file, from 1, of old and new items; the new ones come after `first` old ones.

    0 stands for none.
    """
    old = np.where(number >= first, number + added, number)
    return np.where(number < 0, -1, np.where(number >= count, number - count + first, old)) + 1


def _new_lines(obj: Obj, mixed: list[Mixtures], elements: list[list[list[float]]]) -> list[bytes]:
    """Return the lines of new vertices, coordinates and normals."""
    out = list[bytes]()
    for word, mixture, values in zip(KINDS, mixed, elements):
        for parents, weights in zip(mixture.parents.tolist(), mixture.weights.tolist()):
            rows = [values[parent] for parent in parents]
            row = [sum(w * part[k] for w, part in zip(weights, rows)) for k in range(min(map(len, rows)))]
            if word == b"vn":
                size = sum(value**2 for value in row) ** 0.5
                row = [value / (size or 1.0) for value in row]
            out.append(word + b"".join(b" %.10g" % value for value in row))
    return out


def _face(corners: list[Index]) -> bytes:
    """Return the line of a triangle, given indices (3,) of vertices, coordinates and normals, 0 for none."""
    words = []
    for v, vt, vn in zip(*(indices.tolist() for indices in corners)):
        word = b"%d" % v
        if vt or vn:
            word += b"/%d" % vt if vt else b"/"
        if vn:
            word += b"/%d" % vn
        words.append(word)
    return b"f " + b" ".join(words)


def _renumbered(
    line: bytes, preceding: list[int], first_counts: list[int], added: list[int], *, after: bool
) -> bytes:
    """Return the line of an element with its indices in the new file; unchanged if they are the same.

    Args:
        line: the line.
        preceding: numbers of vertices, coordinates and normals before it.
        first_counts: the same before the new ones.
        added: numbers of new vertices, coordinates and normals.
        after: whether the line is after these.
    """
    word, *corners = line.split(b"#")[0].split()
    out = []
    for corner in corners:
        parts = corner.split(b"/")
        for k, part in enumerate(parts):
            number = int(part or 0)
            place = number - 1 if number > 0 else preceding[k] + number
            later = place >= first_counts[k]
            if number and added[k] and (later if number > 0 else later != after):
                parts[k] = b"%d" % (place + 1 + later * added[k])
        out.append(b"/".join(parts))
    return line if out == corners else b" ".join([word, *out])
