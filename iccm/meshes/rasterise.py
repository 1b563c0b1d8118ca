"""Rasterise triangles on a grid of texels, for baking and for pictures of surfaces.

A texel belongs to the triangle that contains its centre; a centre exactly on an edge belongs to one of the two
triangles (the top-left rule), so that charts have neither gaps nor double texels. Edge functions are float64.
Texels that a chart's border only touches are then assigned to the nearest border triangle, so that
interpolation at the border finds colours there.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Index, Real
from ..native import function
from ..parallel import over_slices

_fill = function("""int64_t iccm_meshes_fill(
    const double *corners, int64_t m, int32_t *owner, int64_t height, int64_t width, int64_t top, int64_t bottom,
    bool wrap)""")
_touch = function("""int64_t iccm_meshes_touch(
    const double *corners, const int64_t *chosen, int64_t count, int32_t *owner, const bool *centre, float *nearest,
    int64_t height, int64_t width, bool wrap)""")
_affine = function("""int64_t iccm_meshes_affine(
    const double *corners, const double *values, int64_t m, int64_t parts, double *out)""")
NONE = -1
SLICE_TRIANGLES = 1 << 15  # triangles that a thread takes at a time: milliseconds of work
ROWS_AT_ONCE = 1024
"""Rows that a thread fills at a time, checking all triangles: few bands, since each does that."""


@dataclass(frozen=True, eq=False)
class Ownership:
    """The triangle of each texel of a grid.

    Attributes:
        owner: (h, w) int32 triangle of each texel, NONE if there is none.
        centre: (h, w) whether the triangle contains the texel's centre, rather than only touching its square.
        last: (h, w) int32 the last triangle that contains the texel's centre, NONE if none does. The owner is
            the first one, so they differ where triangles overlap.
    """

    owner: NDArray[np.int32]
    centre: NDArray[np.bool_]
    last: NDArray[np.int32]

    @cached_property
    def shared(self) -> NDArray[np.bool_]:
        """(h, w) texels with centres in more than one triangle."""
        return self.centre & (self.last != self.owner)

    @property
    def overlaps(self) -> int:
        """Number of texels with centres in more than one triangle."""
        return int(np.count_nonzero(self.shared))


def rasterise(
    corners: Real,
    width: int,
    height: int,
    *,
    border: NDArray[np.bool_] | None = None,
    wrap: bool = False,
    threads: int | None = None,
) -> Ownership:
    """Rasterise triangles; if several overlap, the first one owns a texel.

    Args:
        corners: (m, 3, 2) in texels, x right, y down, with texel centres at + 0.5. Both orientations are
            allowed; triangles without area are skipped.
        width, height: size of the grid.
        border: (m,) triangles that also get the uncovered texels that they touch.
        wrap: whether parts outside the grid wrap around to the other side, as for repeated textures.
        threads: number of threads; by default one per processor. The result does not depend on it.
    """
    owner = np.full((height, width), NONE, np.int32)
    corners = np.ascontiguousarray(corners, dtype=np.float64)
    again = _filled(corners, owner, wrap, threads)
    centre, last = owner >= 0, owner.copy()
    if again:
        _filled(np.ascontiguousarray(corners[::-1]), last := np.full_like(owner, NONE), wrap, threads)
        last[centre] = len(corners) - 1 - last[centre]
    if border is not None and border.any():
        nearest = np.full((height, width), np.inf, np.float32)
        chosen = np.flatnonzero(border)
        _touch(corners, chosen, chosen.size, owner, centre, nearest, height, width, wrap)
    return Ownership(owner, centre, last)


def _filled(corners: Real, owner: NDArray[np.int32], wrap: bool, threads: int | None) -> int:
    """Assign all texels to triangles; return how often a texel is in a further triangle."""
    again: list[int] = []

    def fill(rows: slice) -> None:
        again.append(_fill(corners, len(corners), owner, *owner.shape, rows.start, rows.stop, wrap))

    over_slices(fill, len(owner), threads, ROWS_AT_ONCE)
    return sum(again)


def affine(corners: Real, values: NDArray, threads: int | None = None) -> NDArray:
    """Return (m, 3) coefficients of c0 + cx x + cy y, which takes (m, 3, 2) corners to (m, 3) values.

    Triangles without area get constant functions.
    """
    kind = np.complex128 if np.iscomplexobj(values) else np.float64
    out = np.empty((len(corners), 3), kind)
    corners, values = np.ascontiguousarray(corners, np.float64), np.ascontiguousarray(values, kind)
    numbers = kind().itemsize // 8

    def fit(part: slice) -> None:
        some = values[part].view(np.float64)
        _affine(corners[part], some, len(some), numbers, out[part].view(np.float64))

    over_slices(fit, len(out), threads, SLICE_TRIANGLES)
    return out


def open_edges(uv_corners: Index, twin: Index) -> NDArray[np.bool_]:
    """Return (m,) whether a triangle is on a chart's border: an edge has no neighbour, or one with other coordinates.

    Args:
        uv_corners: (m, 3) texture coordinate of each corner.
        twin: (3m,) neighbouring half-edge of each, -1 if there is none (see `topology.Triangles`).
    """
    tail, head = uv_corners.ravel(), np.roll(uv_corners, -1, axis=1).ravel()
    joined = (twin >= 0) & (tail == head[twin]) & (head == tail[twin])
    return ~joined.reshape(-1, 3).all(axis=1)
