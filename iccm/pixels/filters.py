"""Reading a picture at points with the footprint that a map gives a pixel: a mip pyramid and a stretched kernel.

A pixel's footprint in the texture is the ellipse of J, d(texel) / d(pixel). The kernel is k(u) k(v) with
(u, v) = S⁻¹ d, S being the symmetric square root of J Jᵀ with no axis under one texel. So it is the plain separable
kernel where the texture is magnified, a wider one where a conformal map shrinks it, a sheared one under a
quasi-conformal map, and changes continuously between these. Wide kernels read a smaller level of the pyramid.
"""

import math

import numpy as np
from numba import types
from numba.extending import overload

from ..arrays import Real
from ..jit import inner
from ..jit import kernel as compiled
from .colour import Float
from .pyramid import CLAMP, CLEAR, FRAME, Pyramid

NEAREST, LINEAR, CUBIC, LANCZOS, SPLINE = 0, 1, 2, 3, 4
FILTERS = {"nearest": NEAREST, "linear": LINEAR, "cubic": CUBIC, "lanczos": LANCZOS, "spline": SPLINE}
RADIUS = (0.5, 1.0, 2.0, 3.0, 3.0)  # of the kernels, in texels
LONGEST = 8.0
"""Longest over shortest axis of a kernel: beyond, the short one is widened (by hand: bounds the work)."""
BLEND = 1.5  # a spline gives way to the cubic between a footprint of one texel and this (by hand)


@compiled
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


@compiled
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


def add(tex, i, j, weight, out):
    """Adds `weight` times the picture's texel (i, j), decoded, to out (c,)."""
    raise NotImplementedError("only in kernels")


@overload(add, jit_options={"error_model": "numpy"})
def _add(tex, i, j, weight, out):
    if isinstance(tex.types[0].dtype, types.Integer):

        def stored(tex, i, j, weight, out):
            over = weight
            if tex.alpha >= 0:
                over *= tex.decode[tex.base[i, j, tex.alpha], tex.alpha]
            for k in range(out.size):
                out[k] += (weight if k == tex.alpha else over) * tex.decode[tex.base[i, j, k], k]

        return stored

    def ready(tex, i, j, weight, out):
        for k in range(out.size):
            out[k] += weight * tex.base[i, j, k]

    return ready


@compiled
def _nearest(tex, xy, out):
    """The texels that hold the places xy (p, 2), into out (p, c)."""
    w, h = tex.width[0], tex.height[0]
    out[:] = 0
    for n in range(xy.shape[0]):
        i, j = math.floor(xy[n, 1]), math.floor(xy[n, 0])
        if tex.edge == CLAMP or (i >= 0 and j >= 0 and i < h and j < w):
            add(tex, min(max(i, 0), h - 1), min(max(j, 0), w - 1), 1.0, out[n])


@inner
def _gather(tex, x, y, p, q, r, level, kind, weights, out):
    """The kernel with S⁻¹ = [[p, q], [q, r]] at (x, y) of a level. `weights` has room for one row of them."""
    w, h, first = tex.width[level], tex.height[level], tex.start[level]
    det = p * r - q * q
    reach_x, reach_y = RADIUS[kind] * (abs(r) + abs(q)) / det, RADIUS[kind] * (abs(p) + abs(q)) / det
    j0, j1 = math.ceil(x - reach_x - 0.5), math.floor(x + reach_x - 0.5)
    i0, i1 = math.ceil(y - reach_y - 0.5), math.floor(y + reach_y - 0.5)
    total = 0.0
    out[:] = 0
    if q == 0:
        for j in range(j0, j1 + 1):
            weights[j - j0] = kernel(p * (j + 0.5 - x), kind)
    for i in range(i0, i1 + 1):
        dy = i + 0.5 - y
        plain = kernel(r * dy, kind) if q == 0 else 0.0
        row = min(max(i, 0), h - 1)
        for j in range(j0, j1 + 1):
            if q == 0:
                weight = plain * weights[j - j0]
            else:
                dx = j + 0.5 - x
                weight = kernel(p * dx + q * dy, kind) * kernel(q * dx + r * dy, kind)
            if weight == 0:
                continue
            total += weight
            if tex.edge == CLEAR and (i < 0 or j < 0 or i >= h or j >= w):
                continue
            column = min(max(j, 0), w - 1)
            if level == 0:
                add(tex, row, column, weight, out)
            else:
                for k in range(out.size):
                    out[k] += weight * tex.texels[first + row * w + column, k]
    for k in range(out.size):
        out[k] /= total


@inner
def _quintic(t, weights):
    """The six quintic B-splines that reach t in [0, 1) after the third knot."""
    for k in range(6):
        x = abs(t + 2 - k)
        if x < 1:
            weights[k] = (66 - x * x * (60 - x * x * (30 - 10 * x))) / 120
        elif x < 2:
            weights[k] = (51 + x * (75 - x * (210 - x * (150 - x * (45 - 5 * x))))) / 120
        else:
            weights[k] = (3 - x) ** 5 / 120 if x < 3 else 0.0


@inner
def _smooth(tex, x, y, across, down, out):
    """The spline through the texels at (x, y)."""
    h, w = tex.spline.shape[0], tex.spline.shape[1]
    x, y = min(max(x, -6.0), w - 2 * FRAME + 6.0), min(max(y, -6.0), h - 2 * FRAME + 6.0)
    i, j = math.floor(y - 0.5), math.floor(x - 0.5)
    _quintic(y - 0.5 - i, down)
    _quintic(x - 0.5 - j, across)
    out[:] = 0
    for a in range(6):
        for b in range(6):
            weight = down[a] * across[b]
            for k in range(out.size):
                out[k] += weight * tex.spline[i + a - 2 + FRAME, j + b - 2 + FRAME, k]


@inner
def _footprint(turn):
    """`_shape` of a footprint (4,); one that is not finite counts as a point."""
    p, q, r, long, short = _shape(turn[0], turn[1], turn[2], turn[3])
    if not long < 1e12:
        return 1.0, 0.0, 1.0, 1.0, 1.0
    return p, q, r, long, short


@inner
def _at_level(tex, x, y, p, q, r, short, kind, weights, out):
    """What `_gather` reads at the level that suits a footprint."""
    level = 0
    while level + 1 < tex.size.size and short >= tex.size[level + 1]:
        level += 1
    size = float(tex.size[level])
    if short >= 4 * size:  # nothing smaller is left: the whole picture
        p, q, r = 0.25 / size, 0.0, 0.25 / size
    _gather(tex, x / size, y / size, p * size, q * size, r * size, level, kind, weights, out)


@compiled
def _gathered(tex, xy, turn, kind, out):
    """Filters at texel coordinates xy (p, 2) with footprints turn (p, 4) = xx, xy, yx, yy into out (p, c).

    x is to the right, y down, and the first texel's centre at 0.5.
    """
    value, weights = np.empty(out.shape[1]), np.empty(512)
    for i in range(xy.shape[0]):
        p, q, r, _, short = _footprint(turn[i])
        _at_level(tex, xy[i, 0], xy[i, 1], p, q, r, short, kind, weights, value)
        for k in range(value.size):
            out[i, k] = value[k]


@compiled
def _splined(tex, xy, turn, out):
    """The same by the spline, which gives way to the cubic where the texture is shrunk."""
    value, mixed = np.empty(out.shape[1]), np.empty(out.shape[1])
    weights, more = np.empty(512), np.empty(8)
    for i in range(xy.shape[0]):
        x, y = xy[i, 0], xy[i, 1]
        p, q, r, long, short = _footprint(turn[i])
        share = max(0.0, (BLEND - long) / (BLEND - 1))
        if share < 1:
            _at_level(tex, x, y, p, q, r, short, CUBIC, weights, value)
        if share > 0:
            _smooth(tex, x, y, weights, more, mixed)
            for k in range(value.size):
                value[k] = mixed[k] if share == 1 else share * mixed[k] + (1 - share) * value[k]
        for k in range(value.size):
            out[i, k] = value[k]


def _read_all(tex: Pyramid, xy: Real, turn: Real, kind: int, out: Float) -> None:
    """The kernel for a filter: what is seldom asked for is one of its own, which the first run need not compile."""
    if kind == NEAREST:
        _nearest(tex, xy, out)
    elif kind == SPLINE and tex.spline.size:
        _splined(tex, xy, turn, out)
    else:
        _gathered(tex, xy, turn, CUBIC if kind == SPLINE else kind, out)


def read(tex: Pyramid, xy: Real, turn: Real, kind: int) -> Float:
    """(p, c) values at texel coordinates with footprints, see `_gathered`; magnified pixels under a cubic filter take
    a short cut, which differs by rounding."""
    out = np.empty((len(xy), tex.base.shape[2]), np.float32)
    if kind != CUBIC or tex.base.dtype.kind != "f":
        _read_all(tex, xy, turn, kind, out)
        return out
    left = _magnified(tex, xy, turn, out)
    if left.any():
        rest = np.empty((int(left.sum()), out.shape[1]), np.float32)
        _read_all(tex, xy[left], turn[left], kind, rest)
        out[left] = rest
    return out


@compiled
def _magnified(tex, xy, turn, out):
    """Catmull-Rom where the texture is magnified and its edge is not near; (p,) whether a point is left to do."""
    width, height, channels = tex.width[0], tex.height[0], tex.base.shape[2]
    row, reach = width * channels, 4 * channels
    texels = tex.base.reshape(height * row)
    columns = np.empty(reach)
    left = np.ones(xy.shape[0], np.bool_)
    for i in range(xy.shape[0]):
        x, y = xy[i]
        a, b, c, d = turn[i]
        e, f, g = a * a + b * b, a * c + b * d, c * c + d * d
        if not (e <= 1 and g <= 1 and (1 - e) * (1 - g) >= f * f):  # an axis of the footprint over one texel
            continue
        if not (1.5 <= x < width - 1.5 and 1.5 <= y < height - 1.5):
            continue
        j, k = int(x - 0.5), int(y - 0.5)
        first = (k - 1) * row + (j - 1) * channels
        above, upper = texels[first : first + reach], texels[first + row : first + row + reach]
        first += 2 * row
        lower, below = texels[first : first + reach], texels[first + row : first + row + reach]
        w = _catmull_rom(y - 0.5 - k)
        for n in range(reach):
            columns[n] = w[0] * above[n] + w[1] * upper[n] + w[2] * lower[n] + w[3] * below[n]
        w = _catmull_rom(x - 0.5 - j)
        for n in range(channels):
            m = n + 2 * channels
            out[i, n] = (
                w[0] * columns[n]
                + w[1] * columns[n + channels]
                + w[2] * columns[m]
                + w[3] * columns[m + channels]
            )
        left[i] = False
    return left


@inner
def _catmull_rom(t):
    """Weights of the four texels around a place t past the second one."""
    return (
        ((-0.5 * t + 1) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1,
        ((-1.5 * t + 2) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    )
