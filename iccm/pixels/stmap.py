"""Maps stored as pictures (STMaps): for each pixel the place in a texture.

The convention is that of Nuke's STMap and Fusion's UV map: red is s, from 0 at the left edge of the texture to 1 at its
right edge; green is t, from 0 at the *bottom* edge to 1 at the top edge. So the first texel's centre is at half a
texel. OpenImageIO's `st_warp` counts t from the top: use its `flip_t`. Alpha is the coverage; where it is 0, s and t
are meaningless and set to 0.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .. import progress
from ..arrays import Box, Complex, Flags, Real
from ..errors import InputError
from ..maps.triangulated.map import TriangulatedMap
from ..parallel import in_order
from ..plane import diagonal, triangle_areas
from ..transform import Transform
from . import preimages
from .canvas import BAND_ROWS, Band, Canvas, Diagnostics
from .texture import Placing, Texture

JUMP_PICTURE_SHARE, STEEPER_RATIO = 1 / 512, 4
"""Step as a share of the picture, and relative to the step on the other side; larger steps are seams."""
FINEST_TEXELS_ACROSS = 16384  # texels across: accuracy sufficient for any picture, since few are larger


def stmap(
    map: preimages.AnyMap,
    box: Box,
    canvas: Canvas,
    *,
    placing: Placing | None = None,
    max_error: float = 0.05,
    texels: int = FINEST_TEXELS_ACROSS,
    threads: int | None = None,
) -> Iterator[NDArray[np.float32]]:
    """Yield the rows of an STMap, band by band from the top.

    Args:
        map: source → target.
        box: the part of the source's plane that the texture will cover.
        canvas: the raster, in the target's plane.
        placing: places points of the source's plane in a texture of one texel, instead of `box`.
        max_error: of s and t, in texels of a texture with `texels` texels across.
        texels: see `max_error`.
        threads: number of threads, by default that of processors; it does not affect the result.

    Yields:
        (rows, W, 4) s, t, 0, coverage.
    """
    lying = placing or flat(box)
    source = preimages.of(map, canvas, max_error / texels / max(lying.scale), slopes=False)

    def rows(row: int) -> NDArray[np.float32]:
        band = source(row)
        is_covered = band.coverage > 0
        out = np.zeros((*is_covered.shape, 4), dtype=np.float32)
        out[is_covered, :2], out[is_covered, 3] = st_of(lying, band.z[is_covered]), band.coverage[is_covered]
        return out

    starts = range(0, canvas.height, BAND_ROWS)
    for row, block in zip(starts, in_order(rows, starts, threads)):
        progress.tell("resample", row, canvas.height)
        yield block


def flat(box: Box, rotation: complex = 1) -> Texture:
    """Return a texture of one texel that covers a box of the plane, rotated about its middle by `rotation`."""
    return Texture(np.zeros((1, 1, 1), np.uint8), box, rotation=rotation)


def st_of(placing: Placing, z: Complex) -> Real:
    """Convert points (p,) of the source's plane to s and t (p, 2), given their places in a texture of one texel."""
    still = np.zeros(z.size, complex)
    xy = placing.places(z, still, still).xy
    return np.column_stack([xy[:, 0], 1 - xy[:, 1]])


def point_of(lying: Texture, st: Real) -> Complex:
    """Convert s and t (p, 2) to points (p,) of the source's plane; inverse of `st_of` for a texture in that plane."""
    low, size = lying.box[0], lying.box[1] - lying.box[0]
    z, middle = low + st[:, 0] * size.real + 1j * st[:, 1] * size.imag, low + size / 2
    return middle + (z - middle) * lying.rotation


def transform(st: NDArray, box: Box, canvas: Canvas) -> Transform:
    """Return the map that an STMap stores.

    It is linear on triangles between pixel centres, except where pixels are empty or at seams. Up to a pixel outside
    the triangles, points are replaced by the nearest point inside; farther out the map is undefined.

    Args:
        st: (H, W, c) as for `Stored`; it may be mirrored.
        box: the part of the source's plane that s and t from 0 to 1 cover.
        canvas: H × W pixels in the target's plane.

    Raises:
        InputError: there are no three adjacent pixels with source points.
    """
    stored, size = Stored(st, 1.0), box[1] - box[0]
    bands = [stored.band(row) for row in range(0, canvas.height, BAND_ROWS)]
    z, right, down = (
        np.concatenate([getattr(band, part) for band in bands]) for part in ("z", "right", "down")
    )
    across, along = _torn(z, right, 1), _torn(z, down, 0)
    whole = ~(across[:-1] | across[1:] | along[:, :-1] | along[:, 1:])
    number = np.arange(z.size).reshape(z.shape)
    a, b, c, d = (
        corner[whole] for corner in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:])
    )
    faces = np.column_stack([np.append(a, a), np.append(c, d), np.append(d, b)])
    z = box[0] + z.real.ravel() * size.real + 1j * z.imag.ravel() * size.imag
    area = triangle_areas(z[faces])
    mirrored = np.nansum(area) < 0
    faces = faces[area < 0 if mirrored else area > 0]
    if not len(faces):
        raise InputError("stmap: contains no three adjacent pixels with positions")
    used, corners = np.unique(faces, return_inverse=True)
    source, image = z[used], canvas.centres().ravel()[used]
    margin = max(canvas.step) / diagonal(image)
    if mirrored:
        map = TriangulatedMap(source.conj(), image, corners.reshape(-1, 3), (), margin)
        return Transform(lambda z: map(z.conj()), lambda w: map.inverse(w).conj())
    map = TriangulatedMap(source, image, corners.reshape(-1, 3), (), margin)
    return Transform(map, map.inverse)


def _torn(z: Complex, slope: Complex, axis: int) -> Flags:
    """Mark seams between pixels and the next ones along an axis, given the slopes along it."""
    usual = np.abs(slope)
    first, last = (np.take(usual, range(k, z.shape[axis] - 1 + k), axis) for k in (0, 1))
    step = np.abs(np.diff(z, axis=axis))
    return (step > JUMP_PICTURE_SHARE) & (step > STEEPER_RATIO * np.maximum(first, last))


class Stored:
    """An STMap that is used as a map: (H, W, c) with s, t in the first two channels and alpha, if any, in the fourth.

    Args:
        st: the pixels; without a fourth channel, pixels with s and t both 0 or not finite are empty.
        aspect: width / height of the texture, whose box is (0, aspect + 1j).
    """

    def __init__(self, st: NDArray, aspect: float):
        self.st, self.aspect = st, aspect
        self.canvas = Canvas(st.shape[1], st.shape[0], (0j, complex(st.shape[1], st.shape[0])))
        self.box = (0j, complex(aspect, 1))

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> preimages.Bands:
        """Return the bands of the STMap; other canvases are not supported, and accuracy cannot be increased."""
        return self.band

    def band(self, row: int) -> Band:
        """Return the band that starts at a row."""
        last = min(row + BAND_ROWS, self.canvas.height)
        first, end = max(row - 1, 0), min(last + 1, self.canvas.height)
        st = self.st[first:end].astype(np.float64)
        z = st[..., 0] * self.aspect + 1j * st[..., 1]
        cover = st[..., 3] if st.shape[2] > 3 else ((st[..., 0] != 0) | (st[..., 1] != 0)).astype(float)
        z[~np.isfinite(z) | ~(cover > 0)] = complex(np.nan, np.nan)
        keep = slice(row - first, row - first + last - row)
        right, down = (_slope(z, axis)[keep].astype(np.complex64) for axis in (1, 0))
        z = z[keep]
        covered = np.where(np.isnan(z), 0, np.clip(cover[keep], 0, 1)).astype(np.float32)
        return Band(row, covered, z, right, down, Diagnostics(inside=int((covered > 0).sum())))


def _slope(z: NDArray[np.complex128], axis: int) -> NDArray[np.complex128]:
    """Return changes to the next pixel along an axis: central differences, one-sided ones at unknown pixels, or 0."""
    pad = [(1, 1) if k == axis else (0, 0) for k in range(2)]
    wide = np.diff(np.pad(z, pad, constant_values=np.nan), axis=axis)
    n = z.shape[axis]
    backward, forward = np.take(wide, range(n), axis), np.take(wide, range(1, n + 1), axis)
    out = np.where(
        np.isnan(backward), forward, np.where(np.isnan(forward), backward, 0.5 * (backward + forward))
    )
    low, high = np.minimum(np.abs(backward), np.abs(forward)), np.maximum(np.abs(backward), np.abs(forward))
    seam = (high > JUMP_PICTURE_SHARE) & (
        high > STEEPER_RATIO * low
    )  # one of the neighbours belongs to another chart
    out = np.where(seam, np.where(np.abs(backward) < np.abs(forward), backward, forward), out)
    return np.nan_to_num(out, nan=0.0)
