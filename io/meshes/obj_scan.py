"""The compiled loops under `obj`: a pass that counts an OBJ file's lines, one that fills arrays, one that rewrites.

They walk the bytes of the file, so a half-million faces take a fraction of a second. Numbers of up to 15 digits are
converted exactly there (Clinger's fast path); the others are only listed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Flags, Index, Real
from ...native import function

OTHER, VERTEX, TEXTURE, NORMAL, FACE, STATEMENT = range(6)
FEW_CORNERS, BAD_INDEX, FEW_NUMBERS = 1, 2, 3
ABSENT = -1
OUTSIDE = -2  # an index that reaches before the first vertex
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


class Arrays(NamedTuple):
    """What the scanner fills in, sized by `count`: see `obj.Obj`, and the numbers that are left to convert.

    Attributes:
        slow_v, slow_vt, slow_vn: (k, 2) the place of each such number among all, and its byte.
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
    statement_at: Index
    slow_v: Index
    slow_vt: Index
    slow_vn: Index


def count(data: Bytes) -> tuple[Index, int]:
    """Numbers of other lines, v, vt, vn and f lines and of statements (o, g, usemtl, mtllib), and of face corners."""
    lines = np.empty(6, np.int64)
    corners = _count(data, data.size, lines)
    return lines, corners


def fill(data: Bytes, arrays: Arrays) -> tuple[int, int, list[int]]:
    """Fill the arrays of one OBJ file, which hold zeros.

    Returns:
        0, or what is wrong with a line; the byte at which that begins; how many numbers of v, vt and vn are left to
        convert.
    """
    found = np.empty(4, np.int64)
    fault = _fill(data, data.size, *arrays, found)
    *slow, place = found.tolist()
    return fault, place, slow


def rewrite(data: Bytes, start: int, stop: int, corner_at: Index, new_vt: Index, out: Bytes) -> int:
    """Copy data[start:stop] to `out` with the texture index of the corners at bytes `corner_at` replaced.

    Args:
        data: of the file.
        start, stop: what is copied.
        corner_at: increasing bytes in [start, stop).
        new_vt: their new zero-based texture indices.
        out: written; has room for 20 bytes more for each corner.

    Returns:
        Number of bytes written.
    """
    return _rewrite(data, data.size, start, stop, corner_at, new_vt, corner_at.size, out)
