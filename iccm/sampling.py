"""Reading a picture at points with the footprint that a map gives a pixel: a mip pyramid and a stretched kernel.

A pixel's footprint in the texture is the ellipse of J, d(texel) / d(pixel). The kernel is k(u) k(v) with
(u, v) = S⁻¹ d, S being the symmetric square root of J Jᵀ with no axis under one texel. So it is the plain separable
kernel where the texture is magnified, a wider one where a conformal map shrinks it, a sheared one under a
quasi-conformal map, and changes continuously between these. Wide kernels read a smaller level of the pyramid.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from .colour import Float

NEAREST, LINEAR, CUBIC, LANCZOS = 0, 1, 2, 3
FILTERS = {"nearest": NEAREST, "linear": LINEAR, "cubic": CUBIC, "lanczos": LANCZOS}
RADIUS = (0.5, 1.0, 2.0, 3.0)
LONGEST = 16.0  # longest over shortest axis of a kernel: beyond, the short one is widened
CLAMP, CLEAR = 0, 1


class Pyramid(NamedTuple):
    """A picture and its reductions by two, in one buffer.

    Attributes:
        texels: (t, c) all levels, row after row.
        start, height, width: (l,) where a level begins and its size.
        edge: CLAMP or CLEAR, what lies outside.
    """

    texels: Float
    start: NDArray[np.int64]
    height: NDArray[np.int64]
    width: NDArray[np.int64]
    edge: int


def pyramid(picture: Float, edge: int, levels: int = 16) -> Pyramid:
    """The mip pyramid of an (h, w, c) picture; levels=1 makes only the picture itself."""
    h, w, c = picture.shape
    sizes = [(h, w)]
    while len(sizes) < levels and max(sizes[-1]) > 1:
        sizes.append(((sizes[-1][0] + 1) // 2, (sizes[-1][1] + 1) // 2))
    start = np.cumsum([0] + [a * b for a, b in sizes])
    texels = np.empty((start[-1], c), dtype=np.float32)
    texels[: start[1]] = picture.reshape(-1, c)
    for k in range(1, len(sizes)):
        above = texels[start[k - 1] : start[k]].reshape(*sizes[k - 1], c)
        texels[start[k] : start[k + 1]] = (
            _halved(_halved(above, edge).swapaxes(0, 1), edge).swapaxes(0, 1).reshape(-1, c)
        )
    size = np.array(sizes, dtype=np.int64)
    return Pyramid(texels, start[:-1].astype(np.int64), size[:, 0].copy(), size[:, 1].copy(), edge)


def _halved(a: Float, edge: int) -> Float:
    """(h, w, c) reduced to ((h + 1) // 2, w, c) with a Lanczos-windowed half-band kernel of 12 taps."""
    x = (np.arange(6) + 0.5) / 2
    side = np.sinc(x) * np.sinc(x / 3)
    taps = np.concatenate([side[::-1], side])
    taps /= taps.sum()
    h = (a.shape[0] + 1) // 2
    mode = "edge" if edge == CLAMP else "constant"
    padded = np.pad(a, [(5, 7), (0, 0), (0, 0)], mode=mode)
    out = np.zeros((h, *a.shape[1:]), dtype=np.float32)
    for k, tap in enumerate(taps):
        out += np.float32(tap) * padded[k : k + 2 * h : 2]
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def kernel(x, kind):
    """The reconstruction kernel at distance x: tent, Catmull-Rom, or Lanczos with three lobes."""
    x = abs(x)
    if kind == LINEAR:
        return max(0.0, 1.0 - x)
    if kind == CUBIC:
        if x < 1:
            return (1.5 * x - 2.5) * x * x + 1
        if x < 2:
            return ((-0.5 * x + 2.5) * x - 4) * x + 2
        return 0.0
    if x < 1e-9:
        return 1.0
    if x >= 3:
        return 0.0
    a = math.pi * x
    return 3 * math.sin(a) * math.sin(a / 3) / (a * a)


@njit(cache=True, nogil=True, error_model="numpy")
def _shape(xx, xy, yx, yy):
    """Inverse of S and its axes: (p, q, r) with S⁻¹ = [[p, q], [q, r]], longest and shortest axis."""
    e, f, g = xx * xx + xy * xy, xx * yx + xy * yy, yx * yx + yy * yy
    mean, half = 0.5 * (e + g), 0.5 * (e - g)
    root = math.sqrt(half * half + f * f)
    long = math.sqrt(max(mean + root, 1.0))
    short = max(math.sqrt(max(mean - root, 1.0)), long / LONGEST)
    if root <= 1e-6 * mean or long == 1.0:
        return 1 / long, 0.0, 1 / long, long, long
    cos, sin = half / root, f / root  # of twice the long axis's angle
    mid, dev = 0.5 * (1 / long + 1 / short), 0.5 * (1 / long - 1 / short)
    return mid + dev * cos, dev * sin, mid - dev * cos, long, short


@njit(cache=True, nogil=True, error_model="numpy")
def read(tex, x, y, xx, xy, yx, yy, kind, radius, out):
    """Filters the picture at texel coordinates (x, y) (x right, y down, first texel's centre at 0.5) into out (c,)."""
    c = out.size
    if kind == NEAREST:
        w, h = tex.width[0], tex.height[0]
        i, j = math.floor(y), math.floor(x)
        if tex.edge == CLEAR and (i < 0 or j < 0 or i >= h or j >= w):
            out[:] = 0
            return
        i, j = min(max(i, 0), h - 1), min(max(j, 0), w - 1)
        for k in range(c):
            out[k] = tex.texels[i * w + j, k]
        return
    p, q, r, long, short = _shape(xx, xy, yx, yy)
    level = 0
    while short >= 2 and level + 1 < tex.width.size:
        level += 1
        short *= 0.5
        long *= 0.5
        x *= 0.5
        y *= 0.5
        p *= 2
        q *= 2
        r *= 2
    w, h, first = tex.width[level], tex.height[level], tex.start[level]
    det = p * r - q * q
    reach_x, reach_y = radius * (abs(r) + abs(q)) / det, radius * (abs(p) + abs(q)) / det
    j0, j1 = math.ceil(x - reach_x - 0.5), math.floor(x + reach_x - 0.5)
    i0, i1 = math.ceil(y - reach_y - 0.5), math.floor(y + reach_y - 0.5)
    total = 0.0
    for k in range(c):
        out[k] = 0
    for i in range(i0, i1 + 1):
        dy = i + 0.5 - y
        plain = kernel(r * dy, kind) if q == 0 else 0.0
        row = first + min(max(i, 0), h - 1) * w
        for j in range(j0, j1 + 1):
            dx = j + 0.5 - x
            if q == 0:
                weight = plain * kernel(p * dx, kind)
            else:
                weight = kernel(p * dx + q * dy, kind) * kernel(q * dx + r * dy, kind)
            if weight == 0:
                continue
            total += weight
            if tex.edge == CLEAR and (i < 0 or j < 0 or i >= h or j >= w):
                continue
            t = row + min(max(j, 0), w - 1)
            for k in range(c):
                out[k] += weight * tex.texels[t, k]
    for k in range(c):
        out[k] /= total


@njit(cache=True, nogil=True, error_model="numpy")
def read_all(tex, xy, turn, kind, out):
    """Filters at texel coordinates xy (p, 2) with footprints turn (p, 4) = xx, xy, yx, yy into out (p, c)."""
    value = np.empty(out.shape[1])
    radius = RADIUS[kind]
    for i in range(xy.shape[0]):
        read(tex, xy[i, 0], xy[i, 1], turn[i, 0], turn[i, 1], turn[i, 2], turn[i, 3], kind, radius, value)
        for k in range(value.size):
            out[i, k] = value[k]
