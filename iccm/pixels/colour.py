"""Conversion between stored pixels and the values for filters: linear light, premultiplied, float."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..native import function

Float = NDArray[np.float32]
HALF = np.finfo(np.float16).max
_encode_bytes = function("""int64_t iccm_pixels_encode_bytes(
    const float *values, int64_t count, int64_t c, int64_t alpha, const double *edges, const uint8_t *start,
    uint8_t *out)""")
TABLE_CELLS = 4096  # cells of the table from linear light to sRGB bytes, narrower than the range of any byte


def linear_from_srgb(v):
    """Decode sRGB (IEC 61966-2-1), extended to negative values as an odd function."""
    a = np.abs(v)
    return np.copysign(np.where(a <= 0.04045, a / 12.92, ((a + 0.055) / 1.055) ** 2.4), v)


def srgb_from_linear(v):
    """Encode sRGB (IEC 61966-2-1); inverse of `linear_from_srgb`."""
    a = np.abs(v)
    return np.copysign(np.where(a <= 0.0031308, a * 12.92, 1.055 * a ** (1 / 2.4) - 0.055), v)


@cache
def _table(levels: int, srgb: bool) -> Float:
    v = np.arange(levels) / (levels - 1)
    return (linear_from_srgb(v) if srgb else v).astype(np.float32)


def decode(pixels: NDArray, alpha: int, *, srgb: bool, associated: bool, premultiply: bool) -> Float:
    """Return (h, w, c) pixels as float32 in linear light; integers are scaled to 0..1.

    Args:
        pixels: uint8, uint16, float16 or float32.
        alpha: index of the alpha channel, or -1; it is only scaled.
        srgb: whether the other channels are sRGB-encoded.
        associated: whether they are premultiplied.
        premultiply: whether the result is to be premultiplied.
    """
    if alpha >= 0 and associated and srgb:  # the encoding applies to the colour itself
        straight = _scaled(_numbers(pixels), alpha, divide=True)
        out = straight.copy()
        for k in _colours(out, alpha):
            out[..., k] = linear_from_srgb(straight[..., k])
        return _scaled(out, alpha, divide=False) if premultiply else out
    out = np.empty(pixels.shape, dtype=np.float32)
    for k in range(pixels.shape[2]):
        encoded = srgb and k != alpha
        if pixels.dtype.kind == "f":
            v = pixels[..., k].astype(np.float32)
            out[..., k] = linear_from_srgb(v) if encoded else v
        else:
            out[..., k] = _table(np.iinfo(pixels.dtype).max + 1, encoded)[pixels[..., k]]
    if alpha >= 0 and premultiply != associated:
        return _scaled(out, alpha, divide=associated)
    return out


def encode(values: Float, dtype: np.dtype, alpha: int, *, srgb: bool, associated: bool = False) -> NDArray:
    """Encode (h, w, c) linear values for storage; integers are rounded and clipped.

    Args:
        values: the values, premultiplied if `associated`.
        dtype: type of the result.
        alpha: index of the alpha channel, or -1.
        srgb: whether to encode the other channels as sRGB.
        associated: whether the result is premultiplied.
    """
    if srgb and associated and alpha >= 0:
        straight = _scaled(values, alpha, divide=True)
        for k in _colours(straight, alpha):
            straight[..., k] = srgb_from_linear(straight[..., k])
        values, srgb = _scaled(straight, alpha, divide=False), False
    out = np.empty(values.shape, dtype=dtype)
    if srgb and dtype == np.uint8:
        height, width, channels = values.shape
        values = np.ascontiguousarray(values, np.float32)
        _encode_bytes(values, height * width, channels, alpha, *byte_edges(), out)
        return out
    top = np.iinfo(dtype).max if dtype.kind != "f" else 0
    for k in range(values.shape[2]):
        v = np.clip(values[..., k], 0, 1) if top else values[..., k]
        if srgb and k != alpha:
            v = srgb_from_linear(v)
        if dtype == np.float16:  # a filter may overshoot the range of half floats
            v = np.where(np.isinf(v), v, np.clip(v, -HALF, HALF))
        out[..., k] = np.rint(v * top) if top else v
    return out


@cache
def byte_edges() -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Return tables for encoding sRGB bytes.

    Returns:
        (257,) linear values at which the bytes 0 .. 255 begin, and infinity; and (TABLE_CELLS + 1,) the byte at
        the start of each of TABLE_CELLS cells, each of which contains at most one such value.
    """
    edges = linear_from_srgb((np.arange(256) - 0.5) / 255)
    start = np.searchsorted(edges, np.arange(TABLE_CELLS + 1) / TABLE_CELLS, side="right") - 1
    return np.append(edges, np.inf), start.astype(np.uint8)


def tables(dtype: np.dtype, channels: int, alpha: int, *, srgb: bool) -> Float:
    """Return (levels, channels) linear values of all unsigned integers of a type, by channel."""
    levels = np.iinfo(dtype).max + 1
    return np.column_stack([_table(levels, srgb and k != alpha) for k in range(channels)])


def _numbers(pixels: NDArray) -> Float:
    top = 1 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max
    return pixels.astype(np.float32) / np.float32(top)


def _colours(values: NDArray, alpha: int) -> list[int]:
    return [k for k in range(values.shape[2]) if k != alpha]


def _scaled(values: Float, alpha: int, *, divide: bool) -> Float:
    """Multiply colours by alpha, or divide them by it where it is not zero."""
    factor = values[..., alpha]
    if divide:
        factor = np.where(factor != 0, factor, 1)
    out = values.copy()
    for k in _colours(values, alpha):  # one by one: an array of indices would copy the pixels twice
        (np.divide if divide else np.multiply)(values[..., k], factor, out=out[..., k])
    return out
