"""Operations on whole rasters: distance transforms, morphology, resampling, connected components.

SciPy and Pillow are imported where they are used, since many jobs need neither.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Flags, Index
from ..native import function

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Float = NDArray[np.float32]

BAND_ROWS = 256  # rows of a result that are computed at a time
NARROW_SIGMA_PIXELS = 4.0
"""Standard deviation in pixels; Gaussians of at least twice this are applied at a lower resolution."""

_nearest_known = function(
    """int64_t iccm_pixels_nearest_known(
        const bool *known, int64_t height, int64_t width, int32_t *nearest, float *distances)"""
)


class Nearest(NamedTuple):
    """The nearest pixel of a set for each pixel of a raster.

    Attributes:
        numbers: (h, w) flat index of the nearest pixel; -1 if the set is empty.
        distances: (h, w) in pixels; infinite if the set is empty.
    """

    numbers: NDArray[np.int32]
    distances: Float


def nearest(known: NDArray[np.bool_]) -> Nearest:
    """Find the nearest pixel of a set for each pixel of a raster (exact Euclidean distance transform).

    Args:
        known: (h, w) marks the pixels of the set.
    """
    height, width = known.shape
    numbers, distances = np.empty((height, width), np.int32), np.empty((height, width), np.float32)
    _nearest_known(np.ascontiguousarray(known), height, width, numbers, distances)
    return Nearest(numbers, distances)


def depths(mask: NDArray[np.bool_]) -> Float:
    """Return distances (h, w) in pixels to the nearest pixel outside a mask; infinite if there is none."""
    return nearest(~mask).distances


def dilated(values: NDArray, reach: int = 1) -> NDArray:
    """Return the maximum (h, w) over squares that extend `reach` pixels in each direction; also for flags."""
    return _extreme(values, reach, np.maximum)


def eroded(values: NDArray, reach: int = 1) -> NDArray:
    """Return the minimum (h, w) over squares that extend `reach` pixels in each direction; also for flags."""
    return _extreme(values, reach, np.minimum)


def _extreme(values: NDArray, reach: int, extremum: np.ufunc) -> NDArray:
    """Return the extreme value in a square, first within columns, then within rows."""
    height, width = values.shape
    within_columns = values.copy()
    for step in range(1, min(reach, height - 1) + 1):
        extremum(within_columns[step:], values[:-step], out=within_columns[step:])
        extremum(within_columns[:-step], values[step:], out=within_columns[:-step])
    extreme = within_columns.copy()
    for step in range(1, min(reach, width - 1) + 1):
        extremum(extreme[:, step:], within_columns[:, :-step], out=extreme[:, step:])
        extremum(extreme[:, :-step], within_columns[:, step:], out=extreme[:, :-step])
    return extreme


def resized_by_area(pixels: NDArray, size: tuple[int, int]) -> NDArray:
    """Downsample pixels (h, w, c) or (h, w) by exact area averaging.

    Args:
        pixels: of any type.
        size: width and height of the result, at most those of the pixels.
    """
    height, width = pixels.shape[:2]
    by_row, by_column = _area_shares(height, size[1]), _area_shares(width, size[0])
    channels = pixels.reshape(height, width, -1)
    resized = np.empty((size[1], size[0], channels.shape[2]), pixels.dtype)
    for start in range(0, size[1], BAND_ROWS):  # by bands, to limit the memory for intermediate floats
        shares = by_row[start : start + BAND_ROWS]
        used = slice(int(shares.indices.min()), int(shares.indices.max()) + 1)
        rows = shares[:, used] @ channels[used].reshape(used.stop - used.start, -1).astype(np.float32)
        for k in range(channels.shape[2]):
            means = rows.reshape(-1, width, channels.shape[2])[..., k] @ by_column.T
            resized[start : start + BAND_ROWS, :, k] = np.rint(means) if pixels.dtype.kind == "u" else means
    return resized.reshape(size[1], size[0], *pixels.shape[2:])


def _area_shares(count: int, new_count: int) -> "csr_array":
    """Return (kept, count) shares of each pixel of a line in the `new_count` <= `count` pixels that replace it."""
    from scipy.sparse import csr_array

    edges = np.arange(new_count + 1) * (count / new_count)
    first = np.floor(edges[:-1]).astype(np.int64)
    last = np.minimum(np.ceil(edges[1:]).astype(np.int64), count)
    spans = last - first
    rows = np.repeat(np.arange(new_count), spans)
    columns = np.arange(spans.sum()) - np.repeat(np.cumsum(spans) - spans - first, spans)
    overlap = np.minimum(columns + 1, edges[rows + 1]) - np.maximum(columns, edges[rows])
    shares = (overlap * (new_count / count)).astype(np.float32)
    return csr_array((shares, (rows, columns)), shape=(new_count, count))


def resized_linearly(pixels: NDArray, size: tuple[int, int]) -> Float:
    """Upsample values (h, w) by linear interpolation between pixel centres.

    Args:
        pixels: numbers.
        size: width and height of the result.
    """
    from PIL import Image

    image = Image.fromarray(np.ascontiguousarray(pixels, np.float32))
    return np.array(image.resize(size, Image.Resampling.BILINEAR))


def doubled(values: Float) -> Float:
    """Upsample values (h, w) by two, by linear interpolation between pixel centres.

    This is a faster special case of `resized_linearly`.
    """
    height, width = values.shape
    rows = np.empty((2 * height, width), np.float32)
    _interpolate(values, rows[0::2], rows[1::2])
    upsampled = np.empty((2 * height, 2 * width), np.float32)
    _interpolate(rows.T, upsampled[:, 0::2].T, upsampled[:, 1::2].T)
    return upsampled


def _interpolate(values: Float, upper: Float, lower: Float) -> None:
    """Interpolate a quarter of a pixel before and after the centre of each row of `values` (h, w), in place."""
    main = 0.75 * values
    upper[1:], lower[:-1] = values[:-1], values[1:]
    upper[:1], lower[-1:] = values[:1], values[-1:]
    upper *= 0.25
    lower *= 0.25
    upper += main
    lower += main


def blurred(pixels: NDArray, sigma: float) -> Float:
    """Return pixels (h, w, c) or (h, w) convolved with a Gaussian, mirrored at the sides.

    Wide Gaussians are applied at a lower resolution, where they are NARROW_SIGMA_PIXELS wide; they remove finer detail
    anyway.

    Args:
        pixels: of any type.
        sigma: standard deviation in pixels.
    """
    from scipy import ndimage

    height, width = pixels.shape[:2]
    by = max(1, int(sigma / NARROW_SIGMA_PIXELS))
    if by > 1:
        size = max(1, width // by), max(1, height // by)
        small = blurred(resized_by_area(np.asarray(pixels, np.float32), size), sigma / by)
        channels = small.reshape(*small.shape[:2], -1)
        whole = [resized_linearly(channels[..., k], (width, height)) for k in range(channels.shape[2])]
        return np.stack(whole, axis=-1).reshape(pixels.shape)
    sigmas = (sigma, sigma, *[0] * (pixels.ndim - 2))
    return ndimage.gaussian_filter(np.asarray(pixels, np.float32), sigmas, mode="mirror")


@dataclass(frozen=True, eq=False)
class Components:
    """The connected components of a mask.

    Attributes:
        labels: (h, w) component of each pixel, from 1; 0 for none.
        sizes: (p,) number of pixels.
        boxes: (p, 4) first row, first column, and the row and column after the last.
    """

    labels: NDArray[Any]
    sizes: Index
    boxes: Index

    @property
    def count(self) -> int:
        """Number of components."""
        return len(self.sizes)

    @property
    def extents(self) -> Index:
        """Height and width of each component's bounding box; shape (p, 2)."""
        return self.boxes[:, 2:] - self.boxes[:, :2]

    def where(self, is_chosen: Flags) -> NDArray[np.bool_]:
        """Mark the pixels (h, w) of chosen components (p,)."""
        return np.append(False, is_chosen)[self.labels]


def pieces(mask: NDArray[np.bool_], *, diagonally: bool) -> Components:
    """Find the connected components of a mask (h, w).

    Args:
        mask: marks the pixels.
        diagonally: whether pixels that share only a corner are connected.
    """
    from scipy import ndimage

    labels, count = ndimage.label(mask, np.ones((3, 3)) if diagonally else None)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    boxes = [
        (rows.start, columns.start, rows.stop, columns.stop) for rows, columns in ndimage.find_objects(labels)
    ]
    return Components(labels, sizes, np.array(boxes, np.int64).reshape(-1, 4))
