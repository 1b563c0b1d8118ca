"""Between stored pixels and what filters need: linear light, premultiplied, float."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float32]


def linear_from_srgb(v):
    """IEC 61966-2-1 decoding, odd-symmetric for negative values."""
    a = np.abs(v)
    return np.copysign(np.where(a <= 0.04045, a / 12.92, ((a + 0.055) / 1.055) ** 2.4), v)


def srgb_from_linear(v):
    """IEC 61966-2-1 encoding, the inverse of `linear_from_srgb`."""
    a = np.abs(v)
    return np.copysign(np.where(a <= 0.0031308, a * 12.92, 1.055 * a ** (1 / 2.4) - 0.055), v)


@cache
def _table(levels: int, srgb: bool) -> Float:
    v = np.arange(levels) / (levels - 1)
    return (linear_from_srgb(v) if srgb else v).astype(np.float32)


def decode(pixels: NDArray, alpha: int, *, srgb: bool, associated: bool, premultiply: bool) -> Float:
    """(h, w, c) pixels as float32 in linear light, premultiplied when asked. Integers become 0..1.

    Args:
        pixels: uint8, uint16, float16 or float32.
        alpha: index of the alpha channel or -1; it is never decoded.
        srgb: whether the other channels are sRGB-encoded.
        associated: whether they are premultiplied already.
        premultiply: whether the result shall be.
    """
    plain = pixels.dtype.kind == "f"
    out = np.empty(pixels.shape, dtype=np.float32)
    for k in range(pixels.shape[2]):
        if plain:
            v = pixels[..., k].astype(np.float32)
            out[..., k] = linear_from_srgb(v) if srgb and k != alpha else v
        else:
            out[..., k] = _table(np.iinfo(pixels.dtype).max + 1, srgb and k != alpha)[pixels[..., k]]
    if alpha >= 0 and premultiply != associated:
        a = out[..., alpha : alpha + 1]
        colour = [k for k in range(out.shape[2]) if k != alpha]
        if premultiply:
            out[..., colour] *= a
        else:
            out[..., colour] /= np.where(a != 0, a, 1)
    return out


def encode(values: Float, dtype: np.dtype, alpha: int, *, srgb: bool) -> NDArray:
    """The stored form of (h, w, c) linear values, rounded and clipped for integer types."""
    integer = dtype.kind != "f"
    out = np.empty(values.shape, dtype=dtype)
    top = np.iinfo(dtype).max if integer else 0
    for k in range(values.shape[2]):
        v = values[..., k]
        if integer:
            v = np.clip(v, 0, 1)
        if srgb and k != alpha:
            v = srgb_from_linear(v)
        out[..., k] = np.rint(v * top) if integer else v
    return out
