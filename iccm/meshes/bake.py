"""Resample a texture into a mesh's own UV layout: each texel is mapped back through its flat position to the source.

Where the inverse map is nearly linear within a triangle (to `max_error` texels of the texture), it is
interpolated from the corners; elsewhere it is evaluated at each texel.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex, Index, Real
from ..maps.extended_inverse import ExtendedInverse, bends
from ..native import function
from ..parallel import over_slices
from ..pixels.padding import pad_charts
from ..pixels.sampler import Sampler, put
from ..pixels.stmap import FINEST_TEXELS_ACROSS, st_of
from ..pixels.texture import Placing
from ..plane import cross
from .flatten import Flattening
from .layout import SAME_PLACE, Layout
from .rasterise import affine

_evaluate = function("""int64_t iccm_meshes_evaluate(
    const Complex *coefficients, const double *corners, const int32_t *owner, const int64_t *at, int64_t count,
    int64_t first, int64_t height, int64_t width, Complex *z, Complex *zx, Complex *zy)""")
ROWS_AT_ONCE, TEXELS_AT_ONCE = (
    64,
    512,
)  # texels of the layout that are filtered at a time, which bounds memory
BYTES_PER_TEXEL = 48  # bytes of work arrays per texel of the layout

Origins = tuple[Complex, Complex, Complex]
"""(p,) points of the source's plane, and their derivatives with respect to the output's x and y."""


def whole_bytes(height: int, width: int, channels: int, itemsize: int) -> int:
    """Return the bytes that `layout` and `bake` need for a picture, which is in memory as a whole."""
    return height * width * (2 * channels * itemsize + BYTES_PER_TEXEL)


@dataclass(frozen=True, eq=False)
class BakedPart:
    """A part of the target, with its map to the source.

    Attributes:
        target: the flattened patch.
        inverse: map from its plane to the source's.
        placing: positions of points of the source's plane in the texture.
        partial: whether parts of the target that the map does not reach stay empty.
    """

    target: Flattening
    inverse: ExtendedInverse
    placing: Placing
    partial: bool = False


def bake(
    parts: Sequence[BakedPart],
    grid: Layout,
    sampler: Sampler,
    *,
    padding: int | None = None,
    max_error: float = 0.05,
    alpha: bool = False,
    threads: int | None = None,
) -> tuple[NDArray, dict]:
    """Fill the target's UV charts from the source's texture.

    Args:
        parts: of the target, each with a separate map.
        grid: their UV layout, triangle for triangle, part after part.
        sampler: the texture.
        padding: number of texels by which colours extend beyond the charts; see `pixels.padding.pad_charts`.
        max_error: largest error of positions in the texture, in texels.
        alpha: whether to add a channel that marks known texels.
        threads: number of threads; by default one per processor.

    Returns:
        (h, w, c) pixels of the texture's type and channels, zero where there is no preimage, and a report.
    """
    out = np.zeros((*grid.shape, sampler.channels + alpha), sampler.dtype)
    full = 1.0 if out.dtype.kind == "f" else np.iinfo(out.dtype).max

    def shade(part: BakedPart, origins: Callable[[slice], Origins], count: int) -> NDArray:
        colors = sampler(lambda some: part.placing.places(*origins(some)), count, 1)
        return np.column_stack([colors, np.full(count, full, colors.dtype)]) if alpha else colors

    report = _fill_charts(out, parts, grid, shade, sampler.texture.pixels.shape[1::-1], max_error, threads)
    return out, report | {"padding": pad_charts(out, grid.owners.owner >= 0, padding, sampler.kind)}


def bake_stmap(
    parts: Sequence[BakedPart],
    grid: Layout,
    *,
    padding: int | None = None,
    max_error: float = 0.05,
    threads: int | None = None,
) -> tuple[NDArray[np.float32], dict]:
    """Return the STMap of the target's UV charts (see `pixels.stmap`), and a report.

    Args:
        parts: as for `bake`, placed in textures of one texel.
        grid, padding, threads: as for `bake`.
        max_error: largest error of s and t, in texels of a texture that is `stmap.FINEST_TEXELS_ACROSS` wide.

    Returns:
        (h, w, 4) s, t, 0 and 1 for known texels, and a report.
    """
    out = np.zeros((*grid.shape, 4), np.float32)

    def shade(part: BakedPart, origins: Callable[[slice], Origins], count: int) -> NDArray:
        coordinates = np.zeros((count, 4), np.float32)
        coordinates[:, :2], coordinates[:, 3] = st_of(part.placing, origins(slice(0, count))[0]), 1
        return coordinates

    report = _fill_charts(out, parts, grid, shade, (1, 1), max_error / FINEST_TEXELS_ACROSS, threads)
    return out, report | {"padding": pad_charts(out, grid.owners.owner >= 0, padding)}


def _fill_charts(
    out: NDArray,
    parts: Sequence[BakedPart],
    grid: Layout,
    shade: Callable[[BakedPart, Callable[[slice], Origins], int], NDArray],
    size: tuple[int, int],
    max_error: float,
    threads: int | None,
) -> dict:
    """Fill the covered texels of a picture, and return the report; `size` is the texture's width and height."""
    firsts = np.cumsum([0, *(len(part.target.patch.faces) for part in parts)])
    sources = [_Source(part, grid, int(first), max_error) for part, first in zip(parts, firsts)]

    def fill(rows: slice) -> None:
        for part, source in zip(parts, sources):
            texels, origins = source.rows(rows)
            put(out[rows].reshape(-1, out.shape[2]), texels, shade(part, origins, texels.size))

    over_slices(fill, grid.shape[0], threads, ROWS_AT_ONCE)
    return grid.report | {
        "conflicting_texels": _conflicting_texels(grid, sources, firsts, size),
        "exact_triangles": sum(int(source.exact.sum()) for source in sources),
        "outside_points": sum(part.inverse.outside for part in parts),
        "outside_distance": max(part.inverse.away / part.target.boundary.diagonal for part in parts),
    }


def _conflicting_texels(
    grid: Layout, sources: Sequence["_Source"], firsts: Index, size: tuple[int, int]
) -> int:
    """Count texels in several triangles that show different places of a texture of this size (width, height)."""
    texels = np.flatnonzero(grid.owners.shared)
    shown = np.zeros((2, texels.size, 2))
    for xy, owners in zip(shown, (grid.owners.owner, grid.owners.last)):
        triangles = owners.ravel()[texels]
        parts = np.searchsorted(firsts, triangles, side="right") - 1
        for k, source in enumerate(sources):
            some = parts == k
            xy[some] = source.linear_places(triangles[some] - source.first, texels[some])
    return int((np.abs(shown[0] - shown[1]) > SAME_PLACE * np.array(size)).any(axis=1).sum())


class _Source:
    """Preimages of the texels of a part of a layout in its source's plane.

    `first` is the part's first triangle there.
    """

    def __init__(self, part: BakedPart, grid: Layout, first: int, max_error: float):
        target, self.inverse, threads = part.target, part.inverse, part.inverse.threads
        self.placing = part.placing
        self.faces, self.w, self.first = target.patch.faces, target.flat, first
        self.owner = grid.owners.owner
        self.corners = np.ascontiguousarray(grid.corners[first : first + len(self.faces)], np.float64)
        scale = float(np.hypot(*part.placing.scale)) / np.sqrt(2)
        z = self.inverse(self.w)
        self.exact = bends(self.faces, self.w, *self.inverse.slopes(z), threads) * scale > max_error
        self.partial = part.partial
        self.exact |= self.partial  # interpolation from corners without a preimage would be meaningless
        self.linear = affine(self.corners, z[self.faces], threads)
        self.flat = affine(self.corners, self.w[self.faces], threads) if self.exact.any() else None

    def rows(self, rows: slice) -> tuple[Index, Callable[[slice], Origins]]:
        """Return the covered texels of some rows, and a function that returns the origins of a slice.

        Texels are numbered from the first row.
        """
        owner = self.owner[rows].ravel() - self.first
        texels = np.flatnonzero((owner >= 0) & (owner < len(self.faces)))
        block = (texels % self.owner.shape[1] // TEXELS_AT_ONCE).astype(np.int16)
        # So that only a small part of the texture is read at a time, for any rotation.
        texels = texels[np.argsort(block, kind="stable")]
        if self.partial:  # all of its texels are evaluated
            z, reached = self.inverse.reached(self._flat_places(owner[texels], texels, rows.start))
            texels, z = texels[reached], z[reached]
        owners = owner[texels]
        hard = np.flatnonzero(self.exact[owners])
        exact_origins = None
        if hard.size:
            if not self.partial:
                z = self.inverse(self._flat_places(owners[hard], texels[hard], rows.start))
            exact_origins = self._exact_origins(owners[hard], texels[hard], rows.start, z)

        def origins(part: slice) -> Origins:
            result = self._affine(self.linear, owners[part], texels[part], rows.start)
            if exact_origins is not None:
                a, b = np.searchsorted(hard, [part.start, part.stop])
                for values, exact in zip(result, exact_origins):
                    values[hard[a:b] - part.start] = exact[a:b]
            return result

        return texels, origins

    def linear_places(self, owners: Index, texels: Index) -> Real:
        """Return (p, 2) places in the texture of texels, interpolated in triangles of the part."""
        return self.placing.places(*self._affine(self.linear, owners, texels, 0)).xy

    def _affine(self, coefficients: Complex, owners: NDArray, texels: Index, first: int) -> Origins:
        z, zx, zy = (np.empty(texels.size, complex) for _ in range(3))
        _evaluate(
            coefficients, self.corners, owners, texels, texels.size, first, *self.owner.shape, z, zx, zy
        )
        return z, zx, zy

    def _flat_places(self, owners: NDArray, texels: Index, first: int) -> Complex:
        """Return (p,) positions of texels in the target's plane, in the triangles that own them."""
        assert self.flat is not None
        return _into(self.w[self.faces[owners]], self._affine(self.flat, owners, texels, first)[0])

    def _exact_origins(self, owners: NDArray, texels: Index, first: int, z: Complex) -> Origins:
        """Return the exact origins of texels with preimages z (p,).

        The derivatives are those of the linear interpolation where the map has none.
        """
        assert self.flat is not None
        _, wx, wy = self._affine(self.flat, owners, texels, first)
        _, zx, zy = self._affine(self.linear, owners, texels, first)
        z_w, z_wbar = self.inverse.slopes(z)
        good = np.isfinite(z_w)
        zx[good] = (z_w * wx + z_wbar * wx.conj())[good]
        zy[good] = (z_w * wy + z_wbar * wy.conj())[good]
        return z, zx, zy


def _into(triangle: Complex, w: Complex) -> Complex:
    """Return points (p,) moved into their triangles (p, 3).

    Texels that a chart's border only touches have centres outside.
    """
    a, b, c = triangle.T
    area = cross(b - a, c - a)
    weights = np.stack([cross(q - p, w - p) / area for p, q in ((b, c), (c, a), (a, b))], axis=1)
    weights = np.maximum(weights, 0)
    return np.einsum("pk,pk->p", weights / weights.sum(axis=1, keepdims=True), triangle)
