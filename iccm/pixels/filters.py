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
from ..lanes import LANES, lane, nothing, plus
from .colour import Float
from .pyramid import CLAMP, CLEAR, FRAME, Pyramid, decoded

NEAREST, LINEAR, CUBIC, LANCZOS, SPLINE = 0, 1, 2, 3, 4
FILTERS = {"nearest": NEAREST, "linear": LINEAR, "cubic": CUBIC, "lanczos": LANCZOS, "spline": SPLINE}
RADIUS = (0.5, 1.0, 2.0, 3.0, 3.0)  # of the kernels, in texels
LONGEST = 8.0
"""Longest over shortest axis of a kernel: beyond, the short one is widened (by hand: bounds the work)."""
COLUMNS, MOST = 8, 96  # a register of weights; what the longest kernel reaches, and leans
ACROSS = np.tile(np.arange(COLUMNS, dtype=np.float32), MOST)
DOWN = np.repeat(np.arange(MOST, dtype=np.float32), COLUMNS)
ZERO, HALF, ONE, TWO = (np.float32(v) for v in (0, 0.5, 1, 2))  # plain numbers would make all double
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
def _level(tex, short):
    """The level that suits a footprint: the smallest that its short axis does not pass over."""
    level = 0
    while level + 1 < tex.size.size and short >= tex.size[level + 1]:
        level += 1
    return level


@inner
def _at_level(tex, x, y, p, q, r, short, kind, weights, out):
    """What `_gather` reads at the level that suits a footprint."""
    level = _level(tex, short)
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
    """(p, c) values at texel coordinates with footprints, see `_gathered`; the cubic filter takes a short cut within
    the picture, which differs by rounding."""
    channels = tex.base.shape[2]
    out = np.empty((len(xy), channels), np.float32)
    if kind != CUBIC or channels > LANES:
        _read_all(tex, xy, turn, kind, out)
        return out
    left = _within(tex, xy, turn, ACROSS, DOWN, out)
    if left.any():
        rest = np.empty((int(left.sum()), channels), np.float32)
        _read_all(tex, xy[left], turn[left], kind, rest)
        out[left] = rest
    return out


@compiled
def _within(tex, xy, turn, across, down, out):
    """Catmull-Rom where all that it reads lies within the picture; (p,) whether a point is left to do.

    Args:
        tex, xy, turn, out: as for `_gathered`, at most LANES channels.
        across, down: ACROSS, DOWN.
    """
    channels = out.shape[1]
    left = np.ones(xy.shape[0], np.bool_)
    weights = np.empty(across.size, np.float32)
    base, reduced = ready_base(tex), tex.texels.reshape(tex.texels.size)
    for i in range(xy.shape[0]):
        x, y = xy[i]
        p, q, r, long, short = _footprint(turn[i])
        level = _level(tex, short)
        size = tex.size[level]
        if short >= 4 * size:
            continue
        x, y, p, q, r = x / size, y / size, p * size, q * size, r * size
        det = p * r - q * q
        reach_x, reach_y = 2 * (abs(r) + abs(q)) / det, 2 * (abs(p) + abs(q)) / det
        w, h = tex.width[level], tex.height[level]
        if not (
            x - reach_x >= 0.5 and x + reach_x <= w - 1.5 and y - reach_y >= 0.5 and y + reach_y <= h - 1.5
        ):
            continue  # a texel more: registers reach beyond the last one's channels
        j, k = math.ceil(x - reach_x - 0.5), math.ceil(y - reach_y - 0.5)
        columns, rows = math.floor(x + reach_x - 0.5) - j + 1, math.floor(y + reach_y - 0.5) - k + 1
        if max(rows, columns) > MOST:
            continue
        x, y = x - 0.5 - j, y - 0.5 - k
        if level:
            at, row = (tex.start[level] + k * w + j) * channels, w * channels
            _weighed(reduced, at, row, columns, rows, x, y, p, q, r, across, down, weights, out[i])
        else:
            at, row = make_ready(tex, j, k, columns, rows, base)
            if long == 1:
                _four_by_four(base, at, row, x, y, out[i])
            else:
                _weighed(base, at, row, columns, rows, x, y, p, q, r, across, down, weights, out[i])
        left[i] = False
    return left


def ready_base(tex):
    """(n,) numbers of the picture, or room for what a footprint reads of one that is decoded as it is read."""
    raise NotImplementedError("only in kernels")


def make_ready(tex, j, k, columns, rows, base):
    """Where in `base` the picture's texel (k, j) is, and how many numbers a row has there."""
    raise NotImplementedError("only in kernels")


@overload(ready_base)
def _ready_base(tex):
    if isinstance(tex.types[0].dtype, types.Integer):
        return lambda tex: np.empty((MOST * MOST + 1) * LANES, np.float32)
    return lambda tex: tex.base.reshape(tex.base.size)


@overload(make_ready)
def _make_ready(tex, j, k, columns, rows, base):
    if isinstance(tex.types[0].dtype, types.Integer):

        def decode(tex, j, k, columns, rows, base):
            channels = tex.base.shape[2]
            room = base[: rows * columns * channels].reshape(rows, columns, channels)
            decoded(tex.base[k : k + rows, j : j + columns], tex.decode, tex.alpha, room)
            return 0, columns * channels

        return decode

    def find(tex, j, k, columns, rows, base):
        width, channels = tex.base.shape[1:]
        return (k * width + j) * channels, width * channels

    return find


@inner
def _four_by_four(texels, at, row, x, y, out):
    """The plain kernel: from the texel `at` on, x and y being counted from its middle.

    Args:
        texels: (n,) numbers; `row` of them are a row.
    """
    across, value = _catmull_rom(x), nothing()
    for down in _catmull_rom(y):
        for b in range(4):
            value = plus(value, down * across[b], texels, at + b * out.size)
        at += row
    for k in range(out.size):
        out[k] = lane(value, k)


@inner
def _weighed(texels, at, row, columns, rows, x, y, p, q, r, across, down, weights, out):
    """The kernel with S⁻¹ = [[p, q], [q, r]] over rows and columns of texels, eight columns at a time.

    Args:
        texels, at, row, x, y: as for `_four_by_four`.
        across, down: ACROSS, DOWN.
        weights: as many, changed.
    """
    total, value = 0.0, nothing()
    p, q, r, y = np.float32(p), np.float32(q), np.float32(r), np.float32(y)
    for first in range(0, columns, COLUMNS):
        left = np.float32(x - first)
        for t in range(
            rows * COLUMNS
        ):  # more than there may be, so that all is done eight at a time: 0 beyond
            dx, dy = across[t] - left, down[t] - y
            weights[t] = _cubic(p * dx + q * dy) * _cubic(q * dx + r * dy)
        for a in range(rows):
            start = at + a * row + first * out.size
            for b in range(min(COLUMNS, columns - first)):
                weight = weights[a * COLUMNS + b]
                total += weight
                value = plus(value, weight, texels, start + b * out.size)
    for k in range(out.size):
        out[k] = lane(value, k) / total


@inner
def _cubic(x):
    """Catmull-Rom by truncated powers, in single precision and without branches."""
    x = abs(x)
    a, b = max(ZERO, ONE - x), max(ZERO, TWO - x)
    return HALF * b * b * (b - ONE) + a * a * (ONE - TWO * a)


@inner
def _catmull_rom(t):
    """Weights of the four texels around a place t past the first one, 1 <= t < 2."""
    t -= 1
    return (
        ((-0.5 * t + 1) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1,
        ((-1.5 * t + 2) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    )
