"""The compiled loops behind `obj`: one counts the lines of an OBJ file, one fills arrays, one rewrites indices.

They process half a million faces in a fraction of a second. Numbers of up to 15 digits are converted exactly (Clinger's
fast path); other numbers are only listed.
"""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Flags, Index, Real
from ...native import function

OTHER, VERTEX, TEXTURE, NORMAL, FACE, STATEMENT = range(6)  # kinds of lines, as the core numbers them
Bytes = NDArray[np.uint8]

_count = function("int64_t iccm_meshes_count_obj(const uint8_t *data, int64_t size, int64_t *lines)")
_fill = function(
    """int64_t iccm_meshes_fill_obj(
        const uint8_t *data, int64_t size, double *v, double *vt, double *vn, int64_t *vt_at, int64_t *face_at,
        int64_t *starts, int64_t *corner_at, int64_t *corners, int64_t *normals, bool *relative, int64_t *statement_at,
        int64_t *slow_v, int64_t *slow_vt, int64_t *slow_vn, int64_t *found)"""
)
_rewrite = function(
    """int64_t iccm_meshes_rewrite_obj(
        const uint8_t *data, int64_t size, int64_t start, int64_t stop, const int64_t *corner_at,
        const int64_t *new_vt, int64_t c, uint8_t *out)"""
)


@dataclass(frozen=True, eq=False)
class Elements:
    """The numbers of an OBJ file, and their positions in it. Indices are zero-based; -1 means absent.

    Attributes:
        v: (n, 3) positions.
        vt: (t, 2) texture coordinates.
        vn: (k, 3) normals, of any length.
        vt_at: (t,) first byte of each `vt` line.
        face_at: (f,) first byte of each `f` line.
        starts: (f + 1,) first corner of each face.
        corner_at: (c,) first byte of each corner.
        corners: (c, 2) vertex and texture coordinate of each corner.
        normals: (c,) normal of each corner.
        relative: (c,) whether the texture index is written as a negative number.
    """

    v: Real
    vt: Real
    vn: Real
    vt_at: Index
    face_at: Index
    starts: Index
    corner_at: Index
    corners: Index
    normals: Index
    relative: Flags


class Scan(NamedTuple):
    """Results of parsing an OBJ file.

    Attributes:
        elements: its numbers.
        statement_at: first byte of each `o`, `g`, `usemtl` and `mtllib` line.
        unconverted: for each of v, vt and vn, (k, 2) the numbers that are still to be converted: their flat index and
            their first byte.
        fault: 0, or the code of the first error, at which parsing stopped.
        fault_at: first byte of the invalid text.
    """

    elements: Elements
    statement_at: Index
    unconverted: list[Index]
    fault: int
    fault_at: int


def count(data: Bytes) -> tuple[Index, int]:
    """Return the numbers of other, v, vt, vn, f and statement lines (6,), and the number of face corners."""
    lines = np.empty(6, np.int64)
    corners = _count(data, data.size, lines)
    return lines, corners


def scan(data: Bytes) -> Scan:
    """Parse the numbers of an OBJ file."""
    lines, corner_count = count(data)
    vertices, coordinates, normals = (int(lines[kind]) for kind in (VERTEX, TEXTURE, NORMAL))
    faces = int(lines[FACE])
    elements = Elements(
        v=np.zeros((vertices, 3)),
        vt=np.zeros((coordinates, 2)),
        vn=np.zeros((normals, 3)),
        vt_at=np.zeros(coordinates, np.int64),
        face_at=np.zeros(faces, np.int64),
        starts=np.zeros(faces + 1, np.int64),
        corner_at=np.zeros(corner_count, np.int64),
        corners=np.zeros((corner_count, 2), np.int64),
        normals=np.zeros(corner_count, np.int64),
        relative=np.zeros(corner_count, bool),
    )
    statement_at = np.zeros(lines[STATEMENT], np.int64)
    unconverted = [np.zeros((values.size, 2), np.int64) for values in (elements.v, elements.vt, elements.vn)]
    counters = np.empty(4, np.int64)
    arrays = [getattr(elements, field.name) for field in fields(elements)]  # in the order of the core
    fault = _fill(data, data.size, *arrays, statement_at, *unconverted, counters)
    *counts, fault_at = counters.tolist()
    remaining_rows = [rows[:count] for rows, count in zip(unconverted, counts)]
    return Scan(elements, statement_at, remaining_rows, fault, fault_at)


def rewrite(data: Bytes, start: int, stop: int, corner_at: Index, new_vt: Index, out: Bytes) -> int:
    """Copy data[start:stop] to `out`, replacing the texture indices of the corners at bytes `corner_at`.

    Args:
        data: the file's bytes.
        start, stop: the range to copy.
        corner_at: first bytes of corners in this range, increasing.
        new_vt: their new zero-based texture indices.
        out: written; must have room for 20 more bytes per corner.

    Returns:
        Number of bytes written.
    """
    return _rewrite(data, data.size, start, stop, corner_at, new_vt, corner_at.size, out)
