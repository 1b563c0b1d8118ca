"""Extend colours beyond the outline, so that mipmaps and bilinear filters do not pick up the background."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .raster import depths, doubled, nearest

FLAT_NORMAL = (128 / 255, 128 / 255, 1.0)
"""The neutral normal of a normal map, from 0 to 1; 128 of 255 is what programs write for 0."""
BAND_ROWS = 64
"""Rows that are filled at once from their nearest pixels."""


def pad(pixels: NDArray, known: NDArray[np.bool_], reach: int, method: str = "push-pull") -> None:
    """Fill unknown pixels from known ones, in place.

    Args:
        pixels: (h, w, c) of any type.
        known: (h, w) marks the pixels that have a colour.
        reach: distance in pixels up to which to fill, -1 for the whole picture.
        method: "push-pull" (smooth, averages of increasing neighbourhoods) or "nearest" (the nearest known pixel).
    """
    if known.all() or not known.any() or reach == 0:
        return
    unknown = ~known
    if method == "nearest":
        fill_from_nearest(pixels, list(range(pixels.shape[2])), known, unknown, reach)
        return
    if reach > 0:
        unknown &= depths(unknown) <= reach
    levels = _levels(known.astype(np.float32))
    for k in range(pixels.shape[2]):
        filled = _push_pull(pixels[..., k].astype(np.float32), levels)[unknown]
        pixels[unknown, k] = np.rint(filled) if pixels.dtype.kind != "f" else filled


def pad_charts(pixels: NDArray, known: NDArray[np.bool_], padding: int | None, kind: str = "colour") -> int:
    """Fill the texels between the charts of a layout in place, so that mip-maps do not show what lies there.

    Colours and data extend from the nearest chart, by default over the whole picture, so that no mip level bleeds.
    Normals extend by a thirty-second of the picture; beyond, they are flat, which is also their mean.

    Args:
        pixels: (h, w, c) of any type.
        known: (h, w) marks the texels of charts.
        padding: texels by which to extend, -1 for all; None for the default.
        kind: of the channels, see `pixels.sampler.KINDS`.

    Returns:
        The texels by which they were extended, -1 for all.
    """
    is_normal = kind.startswith("normal")
    if padding is None:
        padding = max(4, max(pixels.shape[:2]) // 32) if is_normal else -1
    if is_normal:
        most = 1.0 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max
        flat = np.array(FLAT_NORMAL) * most
        pixels[~known, :3] = flat if pixels.dtype.kind == "f" else np.rint(flat)
        pixels[~known, 3:] = most
    pad(pixels, known, padding, "nearest")
    return padding


def fill_from_nearest(
    pixels: NDArray,
    channels: list[int],
    known: NDArray[np.bool_],
    unknown: NDArray[np.bool_],
    reach: int = -1,
) -> None:
    """Fill channels of unknown pixels from the nearest known pixel, in place.

    Args:
        pixels: (h, w, c) of any type.
        channels: those that are filled.
        known: (h, w) marks the pixels that have a colour; if there are none, nothing is filled.
        unknown: (h, w) marks pixels to fill, none of which is known.
        reach: distance in pixels up to which to fill, -1 for the whole picture.
    """
    if not known.any():
        return
    source, away = nearest(known)
    # in bands, since the numbers of all pixels take more memory than the picture
    for row in range(0, len(pixels), BAND_ROWS):
        rows = slice(row, row + BAND_ROWS)
        fill = unknown[rows] if reach < 0 else unknown[rows] & (away[rows] <= reach)
        places = np.divmod(source[rows][fill], pixels.shape[1])
        for channel in channels:
            pixels[rows, :, channel][fill] = pixels[..., channel][places]


class _Level(NamedTuple):
    """Weights (h, w) of known values at one resolution, from 0 to 1, and their sums (h/2, w/2) at the next one."""

    weight: NDArray
    mass: NDArray | None


def _levels(weight: NDArray) -> list[_Level]:
    """Return the levels of a pyramid, finest first, down to one at which everything is known."""
    levels = []
    while weight.min() < 1 and max(weight.shape) > 1:
        mass = _sums_of_four(weight)
        levels.append(_Level(weight, mass))
        weight = np.minimum(mass, 1)
    return [*levels, _Level(weight, None)]


def _push_pull(value: NDArray, levels: list[_Level]) -> NDArray:
    """Fill values by push-pull (Gortler, Grzeszczuk, Szeliski, Cohen, *The Lumigraph* (1996), §3.4).

    Averages are computed down the pyramid and interpolated back up.
    """
    weight, mass = levels[0]
    if mass is None:
        return value
    h, w = value.shape
    weighted = weight * value
    coarse = _push_pull(_sums_of_four(weighted) / np.where(mass > 0, mass, 1), levels[1:])
    guess = doubled(coarse)[:h, :w]
    guess -= weight * guess
    return weighted + guess


def _sums_of_four(values: NDArray) -> NDArray:
    """Return the sums of blocks of two by two values (h, w), padded with zeros."""
    h, w = values.shape
    even = np.pad(values, [(0, h % 2), (0, w % 2)]) if h % 2 or w % 2 else values
    return even[0::2, 0::2] + even[0::2, 1::2] + even[1::2, 0::2] + even[1::2, 1::2]
