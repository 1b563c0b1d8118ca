"""Triangles and the texels that they cover: the rasteriser behind baking and behind pictures of surfaces.

A texel belongs to the triangle that holds its centre; a centre exactly on an edge belongs to one of the two triangles
(the top-left rule), so that charts have neither gaps nor double texels. Edge functions are float64. Texels that a
chart's border only touches are given to the nearest border triangle afterwards, so that interpolation at the border
finds colours there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Index, Real
from ..jit import kept
from ..parallel import over_slices

NONE = -1
SLICE = 1 << 15  # triangles that a thread takes at a time (by hand)
ROWS = 1024  # (by hand) of the grid that a thread fills at a time, looking at every triangle


@dataclass(frozen=True, eq=False)
class Ownership:
    """Triangles on a grid of texels.

    Attributes:
        owner: (h, w) int32 triangle of each texel, NONE where there is none.
        centre: (h, w) whether the texel's centre lies in that triangle, not only a part of its square.
        overlaps: number of texels whose centre lies in more than one triangle.
    """

    owner: NDArray[np.int32]
    centre: NDArray[np.bool_]
    overlaps: int


def rasterise(
    corners: Real,
    width: int,
    height: int,
    *,
    border: NDArray[np.bool_] | None = None,
    wrap: bool = False,
    threads: int | None = None,
) -> Ownership:
    """Rasterise triangles, the first one winning where several overlap.

    Args:
        corners: (m, 3, 2) in texels, x right, y down, texel centres at + 0.5. Either turn; without area: skipped.
        width, height: of the grid.
        border: (m,) triangles to let have the uncovered texels that they touch.
        wrap: whether what lies outside the grid comes in on the other side, as repeated textures do.
        threads: as many as there are processors by default; the result does not depend on it.
    """
    owner = np.full((height, width), NONE, np.int32)
    corners = np.ascontiguousarray(corners, dtype=np.float64)
    overlaps = 0
    if _filled(corners, owner, wrap, threads):
        last = np.full_like(owner, NONE)
        _filled(np.ascontiguousarray(corners[::-1]), last, wrap, threads)
        overlaps = int(np.count_nonzero((owner >= 0) & (last != len(corners) - 1 - owner)))
    centre = owner >= 0
    if border is not None and border.any():
        nearest = np.full((height, width), np.inf, np.float32)
        _touch(corners, np.flatnonzero(border), owner, centre, nearest, wrap)
    return Ownership(owner, centre, overlaps)


def _filled(corners: Real, owner: NDArray[np.int32], wrap: bool, threads: int | None) -> int:
    """Gives all texels to triangles; how many times one lies in a further triangle."""
    again: list[int] = []
    over_slices(
        lambda r: again.append(_fill(corners, owner, r.start, r.stop, wrap)), len(owner), threads, ROWS
    )
    return sum(again)


def affine(corners: Real, values: NDArray, threads: int | None = None) -> NDArray:
    """(m, 3) coefficients of c0 + cx x + cy y that takes (m, 3, 2) corners to (m, 3) values; flat where no area."""
    out = np.empty((len(corners), 3), values.dtype)
    corners, values = np.ascontiguousarray(corners, dtype=np.float64), np.ascontiguousarray(values)
    over_slices(lambda part: _affine(corners[part], values[part], out[part]), len(out), threads, SLICE)
    return out


@kept()
def _affine(corners, values, out):
    for t in range(corners.shape[0]):
        ax, ay = corners[t, 1, 0] - corners[t, 0, 0], corners[t, 1, 1] - corners[t, 0, 1]
        bx, by = corners[t, 2, 0] - corners[t, 0, 0], corners[t, 2, 1] - corners[t, 0, 1]
        area = ax * by - ay * bx
        inverse = 1.0 / area if area != 0 else 0.0
        d1, d2 = values[t, 1] - values[t, 0], values[t, 2] - values[t, 0]
        out[t, 1] = (d1 * by - d2 * ay) * inverse
        out[t, 2] = (d2 * ax - d1 * bx) * inverse
        out[t, 0] = values[t, 0] - out[t, 1] * corners[t, 0, 0] - out[t, 2] * corners[t, 0, 1]


@kept()
def _edges(tri, sign, a, b, c):
    """Coefficients of the three edge functions a x + b y + c of a triangle in `sign` turn: positive inside."""
    for k in range(3):
        p, q = k, (k + 1) % 3
        if sign < 0:
            p, q = q, p
        a[k] = tri[p, 1] - tri[q, 1]
        b[k] = tri[q, 0] - tri[p, 0]
        # anchored on the same end for both triangles of an edge: they compute the same number, opposite in sign
        u = p if (tri[p, 0], tri[p, 1]) < (tri[q, 0], tri[q, 1]) else q
        c[k] = -(a[k] * tri[u, 0] + b[k] * tri[u, 1])


@kept()
def _span(tri, axis, start, stop, grow, wrap):
    """The texels first .. last - 1 whose centres can lie in the triangle along one axis, grown by `grow`."""
    low, high = min(tri[0, axis], tri[1, axis], tri[2, axis]), max(tri[0, axis], tri[1, axis], tri[2, axis])
    first, last = int(np.ceil(low - 0.5 - grow)), int(np.floor(high - 0.5 + grow)) + 1
    if not wrap:
        first, last = max(first, start), min(last, stop)
    return first, last


@kept()
def _turn(tri):
    return (tri[1, 0] - tri[0, 0]) * (tri[2, 1] - tri[0, 1]) - (tri[1, 1] - tri[0, 1]) * (
        tri[2, 0] - tri[0, 0]
    )


@kept()
def _inside(e, a, b):
    """Whether a point with edge function e is in: on an edge, only if that is a left or a top one."""
    return e > 0 or (e == 0 and (a > 0 or (a == 0 and b > 0)))


@kept()
def _set_up(tri, width, top, bottom, grow, wrap, a, b, c):
    """Edge functions of a triangle into a, b, c, and the columns x0 .. x1 - 1 and rows y0 .. y1 - 1 to look at.

    Unless what lies outside comes in on the other side, rows are among top .. bottom - 1 and columns on the grid.
    """
    y0, y1 = _span(tri, 1, top, bottom, grow, wrap)
    sign = _turn(tri) if y0 < y1 else 0.0
    if not (sign > 0 or sign < 0):
        return 0, 0, 0, 0
    _edges(tri, sign, a, b, c)
    x0, x1 = _span(tri, 0, 0, width, grow, wrap)
    return x0, x1, y0, y1


@kept()
def _fill(corners, owner, top, bottom, wrap):
    """Give the texels of rows top .. bottom - 1 to triangles; how many times one lies in a further triangle."""
    height, width = owner.shape
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    overlaps = 0
    for t in range(corners.shape[0]):
        x0, x1, y0, y1 = _set_up(corners[t], width, top, bottom, 0.0, wrap, a, b, c)
        for y in range(y0, y1):
            row = y % height
            if not top <= row < bottom:
                continue
            for x in range(x0, x1):
                px, py = x + 0.5, y + 0.5
                if (
                    _inside(a[0] * px + b[0] * py + c[0], a[0], b[0])
                    and _inside(a[1] * px + b[1] * py + c[1], a[1], b[1])
                    and _inside(a[2] * px + b[2] * py + c[2], a[2], b[2])
                ):
                    column = x % width
                    if owner[row, column] < 0:
                        owner[row, column] = t
                    else:
                        overlaps += 1
    return overlaps


@kept()
def _touch(corners, chosen, owner, centre, nearest, wrap):
    """Give texels without a centre in any triangle to the triangle of `chosen` that enters their square the most."""
    height, width = owner.shape
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    for t in chosen:
        x0, x1, y0, y1 = _set_up(corners[t], width, 0, height, 0.5, wrap, a, b, c)
        for y in range(y0, y1):
            row = y % height
            for x in range(x0, x1):
                column = x % width
                if centre[row, column]:
                    continue
                away = 0.0
                for k in range(3):
                    e = a[k] * (x + 0.5) + b[k] * (y + 0.5) + c[k]
                    if e <= -0.5 * (abs(a[k]) + abs(b[k])):
                        away = np.inf
                        break
                    away = max(away, -e / np.sqrt(a[k] * a[k] + b[k] * b[k]))
                if away < nearest[row, column]:
                    nearest[row, column] = away
                    owner[row, column] = t


def open_edges(uv_corners: Index, twin: Index) -> NDArray[np.bool_]:
    """(m,) whether a triangle lies on a chart's border: an edge has no neighbour, or one with other coordinates.

    Args:
        uv_corners: (m, 3) texture coordinate of each corner.
        twin: (3m,) neighbouring half-edge of each, -1 where there is none (see `topology.Triangles`).
    """
    tail, head = uv_corners.ravel(), np.roll(uv_corners, -1, axis=1).ravel()
    joined = (twin >= 0) & (tail == head[twin]) & (head == tail[twin])
    return ~joined.reshape(-1, 3).all(axis=1)
