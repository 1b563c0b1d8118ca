"""Triangles and the texels that they cover: the rasteriser behind baking and behind pictures of surfaces.

A texel belongs to the triangle that holds its centre; a centre exactly on an edge belongs to one of the two triangles
(the top-left rule), so that charts have neither gaps nor double texels. Edge functions are float64. Texels that a
chart's border only touches are given to the nearest border triangle afterwards, so that interpolation at the border
finds colours there.
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
SLICE_TRIANGLES = 1 << 15  # triangles that a thread takes at a time (by hand)
ROWS_AT_ONCE = 1024  # (by hand) of the grid that a thread fills at a time, looking at every triangle


@dataclass(frozen=True, eq=False)
class Ownership:
    """Triangles on a grid of texels.

    Attributes:
        owner: (h, w) int32 triangle of each texel, NONE where there is none.
        centre: (h, w) whether the texel's centre lies in that triangle, not only a part of its square.
        last: (h, w) int32 the last triangle that holds the texel's centre, NONE where none does. The owner is the
            first one, so they differ where several triangles hold it.
    """

    owner: NDArray[np.int32]
    centre: NDArray[np.bool_]
    last: NDArray[np.int32]

    @cached_property
    def shared(self) -> NDArray[np.bool_]:
        """(h, w) texels whose centre lies in more than one triangle."""
        return self.centre & (self.last != self.owner)

    @property
    def overlaps(self) -> int:
        """Number of texels whose centre lies in more than one triangle."""
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
    """Give all texels to triangles; how many times one lies in a further triangle."""
    again: list[int] = []

    def fill(rows: slice) -> None:
        again.append(_fill(corners, len(corners), owner, *owner.shape, rows.start, rows.stop, wrap))

    over_slices(fill, len(owner), threads, ROWS_AT_ONCE)
    return sum(again)


def affine(corners: Real, values: NDArray, threads: int | None = None) -> NDArray:
    """Return (m, 3) coefficients of c0 + cx x + cy y that takes (m, 3, 2) corners to (m, 3) values; flat where no
    area.
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
    """Return (m,) whether a triangle lies on a chart's border: an edge has no neighbour, or one with other coordinates.

    Args:
        uv_corners: (m, 3) texture coordinate of each corner.
        twin: (3m,) neighbouring half-edge of each, -1 where there is none (see `topology.Triangles`).
    """
    tail, head = uv_corners.ravel(), np.roll(uv_corners, -1, axis=1).ravel()
    joined = (twin >= 0) & (tail == head[twin]) & (head == tail[twin])
    return ~joined.reshape(-1, 3).all(axis=1)
