"""Textures whose alpha ends at the source's outline: remove this antialiased edge.

The edge is a texel wide, and a map that magnifies stretches it to a fade of many pixels. The result gets its edge from
the target's coverage instead, so alpha and colours of the inside are extended beyond the outline.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex
from .coverage import coverage
from .padding import fill_from_nearest
from .raster import dilated, eroded
from .texture import Texture

REACH_TEXELS = 2  # texels: radius of a cubic filter, and width of an antialiased edge
NO_ALPHA_SHARE = 0.1
"""Share of the alpha inside; less counts as transparent, since lossy pictures have some noise."""
BYTES_PER_TEXEL = 64  # working memory per texel: arrays counted


def without_own_edge(texture: Texture, outlines: Sequence[Complex]) -> Texture:
    """Extend a texture's inside beyond the outlines, if its alpha ends there; otherwise return it unchanged.

    Alpha ends at the outlines if along most of them, more than a texel and at most REACH_TEXELS outside, it is less
    than NO_ALPHA_SHARE of its maximum inside. Texels outside are changed, and the alpha of those inside that fade
    towards the outline.

    Args:
        texture: the texture; unchanged if it has no alpha channel.
        outlines: closed outlines of the source and of its holes, in its plane.
    """
    pixels, channel = texture.pixels, texture.alpha
    if channel < 0 or not outlines:
        return texture
    top = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1
    alpha = _framed(pixels[..., channel].astype(np.float32) / top)
    if not alpha[REACH_TEXELS:-REACH_TEXELS, REACH_TEXELS:-REACH_TEXELS].min() < 1:  # opaque, or not finite
        return texture
    inside = _framed(_inside(texture, outlines))
    rim = np.flatnonzero(inside & ~eroded(inside))
    most = _greatest_near(rim, REACH_TEXELS, alpha, inside)
    beyond = _greatest_near(rim, REACH_TEXELS, alpha, eroded(~inside))
    ending = rim[beyond < NO_ALPHA_SHARE * most]
    if 2 * ending.size <= rim.size:
        return texture
    falls = np.zeros_like(inside)
    falls.ravel()[ending] = True
    fading = inside & dilated(falls, REACH_TEXELS)
    full = np.where(fading, _risen(alpha, inside), alpha)
    known = inside & (alpha > 0) & (2 * alpha >= full)  # colours are unreliable where alpha fades
    to_fill = fading & ~known | ~inside
    crop = (slice(REACH_TEXELS, -REACH_TEXELS), slice(REACH_TEXELS, -REACH_TEXELS))
    inside, full, known, to_fill = inside[crop], full[crop], known[crop], to_fill[crop]
    out = pixels.copy()
    out[..., channel] = np.rint(full * top) if top > 1 else full
    if texture.associated:
        gain = np.where(alpha[crop] > 0, full / np.where(alpha[crop] > 0, alpha[crop], 1), 0)
        for k in range(pixels.shape[2]):
            out[..., k] = pixels[..., k] * gain if k != channel else out[..., k]
    del alpha, full, fading, falls, most, beyond  # filling takes as much memory as these arrays
    _bleed(out, [channel], inside, to_fill)
    _bleed(out, [k for k in range(pixels.shape[2]) if k != channel], known, to_fill)
    return replace(texture, pixels=out)


def _bleed(
    pixels: NDArray, channels: list[int], known: NDArray[np.bool_], to_fill: NDArray[np.bool_]
) -> None:
    """Fill texels from the nearest known texel that is finite, channel by channel, in place."""
    if pixels.dtype.kind != "f":  # the nearest texel is the same for all channels
        fill_from_nearest(pixels, channels, known, to_fill & ~known)
        return
    for channel in channels:
        is_known = known & np.isfinite(pixels[..., channel])
        fill_from_nearest(pixels, [channel], is_known, to_fill & ~is_known)


def _inside(texture: Texture, outlines: Sequence[Complex]) -> NDArray[np.bool_]:
    """Mark (h, w) the texels whose centres are enclosed by an odd number of outlines."""
    left, top, across, down = texture.corner
    height, width = texture.pixels.shape[:2]
    inside = np.zeros((height, width), np.bool_)
    for z in map(texture.rotated_back, outlines):
        inside ^= coverage((z.real - left) * across + 1j * (top - z.imag) * down, 0, height, width)[1]
    return inside


def _framed(values: NDArray) -> NDArray:
    """Pad values with zeros by REACH_TEXELS."""
    return np.pad(values, REACH_TEXELS)


def _risen(alpha: NDArray[np.float32], inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return alpha without a decrease towards the outline in the outermost REACH_TEXELS + 1 rows of texels."""
    rows = [inside]
    for _ in range(REACH_TEXELS + 1):
        rows.append(eroded(rows[-1]))
    out = alpha.copy()
    for deeper, row in zip(rows[:0:-1], rows[-2::-1]):
        ring = np.flatnonzero(row & ~deeper)
        flat = out.ravel()
        flat[ring] = np.maximum(flat[ring], _greatest_near(ring, 1, out, deeper))
    return out


def _greatest_near(
    numbers: NDArray[np.intp], reach: int, values: NDArray[np.float32], counted: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """Return the greatest of the values that count, and of 0, within so many texels of some texels.

    Few texels are at the outline: looking around each of them takes a fraction of the time of `dilated`.

    Args:
        numbers: of these texels in framed arrays, row by row.
        reach: at most REACH_TEXELS, so that what is looked at is in the frame.
        values: (h, w), framed.
        counted: (h, w) which of them count.
    """
    width = values.shape[1]
    greatest = np.zeros(numbers.size, np.float32)
    for down in range(-reach, reach + 1):
        for right in range(-reach, reach + 1):
            neighbours = numbers + (down * width + right)
            np.maximum(
                greatest, np.where(counted.ravel()[neighbours], values.ravel()[neighbours], 0), out=greatest
            )
    return greatest
