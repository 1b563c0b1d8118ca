"""Reading a picture at points with the footprint that a map gives a pixel: a mip pyramid and a stretched kernel.

A pixel's footprint in the texture is the ellipse of J, d(texel) / d(pixel). The kernel is k(u) k(v) with
(u, v) = S⁻¹ d, S being the symmetric square root of J Jᵀ with no axis under one texel. So it is the plain separable
kernel where the texture is magnified, a wider one where a conformal map shrinks it, a sheared one under a
quasi-conformal map, and changes continuously between these. Wide kernels read a smaller level of the pyramid.

Negative lobes make a kernel sharp and let it overshoot: a dark edge gets a darker ring. Colours are clamped to the
range of the texels that the kernel reads, channel by channel, which leaves the slope of an edge as steep as it was.
"""

import math

import numpy as np
from numba import types
from numba.extending import overload
from numpy.typing import NDArray

from ..arrays import Real
from ..jit import inlined
from ..jit import kernel as compiled
from .canvas import Band
from .colour import FINE, Float, byte_edges, unit
from .lanes import LANES, four, higher, keep, lane, lower, nothing, plus
from .pyramid import CLEAR, FRAME, MIRROR, REPEAT, Pyramid, inside
from .texture import Corner, place

NEAREST, LINEAR, CUBIC, LANCZOS, SPLINE = 0, 1, 2, 3, 4
FILTERS = {"nearest": NEAREST, "linear": LINEAR, "cubic": CUBIC, "lanczos": LANCZOS, "spline": SPLINE}
RADIUS = (0.5, 1.0, 2.0, 3.0, 3.0)  # of the kernels, in texels
LONGEST = 8.0
"""Longest over shortest axis of a kernel: beyond, the short one is widened (by hand: bounds the work)."""
COLUMNS = 8  # of texels whose weights are worked out at a time
MOST = 232  # rows and columns of a kernel: one of Lanczos with axes of 32 and 4 texels, leaning by 22.5°
ACROSS = np.tile(np.arange(COLUMNS, dtype=np.float32), MOST)
DOWN = np.repeat(np.arange(MOST, dtype=np.float32), COLUMNS)
ZERO, HALF, ONE, TWO = (np.float32(v) for v in (0, 0.5, 1, 2))  # plain numbers would make all double
BLEND = 1.5  # a spline gives way to the cubic between a footprint of one texel and this (by hand)


@compiled
def _shape(xx, xy, yx, yy):
    """Inverse of S and its axes: (p, q, r) with S⁻¹ = [[p, q], [q, r]], longest and shortest axis."""
    e, f, g = xx * xx + xy * xy, xx * yx + xy * yy, yx * yx + yy * yy
    if e <= 1 and g <= 1 and (1 - e) * (1 - g) >= f * f:  # no axis over one texel: the short way to the same
        return 1.0, 0.0, 1.0, 1.0, 1.0
    mean, half = 0.5 * (e + g), 0.5 * (e - g)
    root = math.sqrt(half * half + f * f)
    long = math.sqrt(max(mean + root, 1.0))
    short = max(math.sqrt(max(mean - root, 1.0)), long / LONGEST)
    if root <= 1e-6 * mean or long == 1.0:
        return 1 / long, 0.0, 1 / long, long, long
    cos, sin = half / root, f / root  # of twice the long axis's angle
    mid, dev = 0.5 * (1 / long + 1 / short), 0.5 * (1 / long - 1 / short)
    return mid + dev * cos, dev * sin, mid - dev * cos, long, short


def ready(tex, i, j, k):
    """Channel k of the picture's texel (i, j), decoded and premultiplied."""
    raise NotImplementedError("only in kernels")


@overload(ready, jit_options={"error_model": "numpy"})
def _ready(tex, i, j, k):
    if not isinstance(tex.types[0].dtype, types.Integer):
        return lambda tex, i, j, k: tex.base[i, j, k]

    def decoded(tex, i, j, k):
        value = tex.decode[tex.base[i, j, k], k]
        if tex.alpha < 0 or k == tex.alpha:
            return value
        return value * tex.decode[tex.base[i, j, tex.alpha], tex.alpha]

    return decoded


@compiled
def _nearest(tex, xy, out):
    """The texels that hold the places xy (p, 2), into out (p, c)."""
    w, h = tex.width[0], tex.height[0]
    out[:] = 0
    for n in range(xy.shape[0]):
        i, j = math.floor(xy[n, 1]), math.floor(xy[n, 0])
        if tex.edge != CLEAR or (i >= 0 and j >= 0 and i < h and j < w):
            i, j = inside(i, h, tex.edge), inside(j, w, tex.edge)
            for k in range(out.shape[1]):
                out[n, k] = ready(tex, i, j, k)


@compiled
def _cubic(x):
    """Catmull-Rom by truncated powers, in single precision and without branches."""
    x = abs(x)
    a, b = max(ZERO, ONE - x), max(ZERO, TWO - x)
    return HALF * b * b * (b - ONE) + a * a * (ONE - TWO * a)


@compiled
def _linear(x):
    """The tent."""
    return max(ZERO, ONE - abs(x))


@compiled
def _lanczos(x):
    """Lanczos with three lobes."""
    x = abs(float(x))
    if x < 1e-9:
        return 1.0
    if x >= 3:
        return 0.0
    a = math.pi * x
    return 3 * math.sin(a) * math.sin(a / 3) / (a * a)


@inlined
def _weigh(x, y, p, q, r, kind, count, across, down, weights):
    """The kernel k(u) k(v), (u, v) = S⁻¹ d with S⁻¹ = [[p, q], [q, r]], at places across, down from the first texel.

    One loop for each kernel: the first two are done eight numbers at a time.
    """
    x, y, p, q, r = np.float32(x), np.float32(y), np.float32(p), np.float32(q), np.float32(r)
    if kind == LINEAR:
        for t in range(count):
            dx, dy = across[t] - x, down[t] - y
            weights[t] = _linear(p * dx + q * dy) * _linear(q * dx + r * dy)
    elif kind == LANCZOS:
        for t in range(count):
            dx, dy = across[t] - x, down[t] - y
            weights[t] = _lanczos(p * dx + q * dy) * _lanczos(q * dx + r * dy)
    else:
        for t in range(count):
            dx, dy = across[t] - x, down[t] - y
            weights[t] = _cubic(p * dx + q * dy) * _cubic(q * dx + r * dy)


@compiled
def _weighed(texels, at, row, columns, rows, x, y, p, q, r, kind, clamped, across, down, weights, out):
    """The mean of rows and columns of texels, weighed by the kernel, eight columns and four channels at a time.

    Args:
        texels: (n,) numbers, `row` of them a row, the first texel's from `at` on; LANES more are there.
        x, y: the middle, from the first texel's.
        p, q, r, kind: as for `_weigh`.
        clamped: whether the mean stays between the least and the greatest of these texels.
        across, down, weights: ACROSS, DOWN, and as many weights.
        out: (c,), written.
    """
    count = rows * COLUMNS
    for part in range(0, out.size, LANES):
        total, value = 0.0, nothing()
        least = most = four(texels, at + part)
        for first in range(0, columns, COLUMNS):
            _weigh(x - first, y, p, q, r, kind, count, across, down, weights)
            for a in range(rows):
                start = at + a * row + first * out.size + part
                for b in range(min(COLUMNS, columns - first)):
                    weight = weights[a * COLUMNS + b]
                    total += weight
                    value = plus(value, weight, texels, start + b * out.size)
                    if clamped:
                        texel = four(texels, start + b * out.size)
                        least, most = lower(least, texel), higher(most, texel)
        for k in range(part, min(out.size, part + LANES)):
            mean = lane(value, k - part) / total
            if clamped:
                mean = min(max(mean, lane(least, k - part)), lane(most, k - part))
            out[k] = mean


@compiled
def _magnified(texels, at, row, x, y, clamped, c, out, first):
    """The plain cubic kernel, into out[first : first + c] and beyond, by LANES at most; other arguments as for
    `_weighed`."""
    a0, a1, a2, a3 = _catmull_rom(x)
    for part in range(0, c, LANES):
        value, start = nothing(), at + part
        least = most = four(texels, start)
        for down in _catmull_rom(y):
            value = plus(value, down * a0, texels, start)
            value = plus(value, down * a1, texels, start + c)
            value = plus(value, down * a2, texels, start + 2 * c)
            value = plus(value, down * a3, texels, start + 3 * c)
            if clamped:
                for texel in range(start, start + 4 * c, c):
                    least, most = lower(least, four(texels, texel)), higher(most, four(texels, texel))
            start += row
        if clamped:
            value = lower(higher(value, least), most)
        keep(value, out, first + part)


@compiled
def _catmull_rom(t):
    """Weights of the four texels around a place t past the first one, 1 <= t <= 2."""
    t -= 1
    return (
        ((-0.5 * t + 1) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1,
        ((-1.5 * t + 2) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    )


@compiled
def _copied(tex, level, i, j, rows, columns, patch):
    """Texels of a level from (i, j) on, ready, into the beginning of `patch`; beyond the edge what lies there."""
    w, h, c, n = tex.width[level], tex.height[level], tex.base.shape[2], 0
    for a in range(i, i + rows):
        for b in range(j, j + columns):
            nowhere = tex.edge == CLEAR and (a < 0 or b < 0 or a >= h or b >= w)
            y, x = inside(a, h, tex.edge), inside(b, w, tex.edge)
            for k in range(c):
                if nowhere:
                    patch[n] = 0
                elif level:
                    patch[n] = tex.texels[tex.start[level] + y * w + x, k]
                else:
                    patch[n] = ready(tex, y, x, k)
                n += 1


@compiled
def _folded(x, n, edge):
    """The place among n texels in a row that a place beyond them repeats; those of edges that do not stay."""
    if edge == REPEAT:
        return x - n * math.floor(x / n)
    if edge == MIRROR:
        x -= 2 * n * math.floor(x / (2 * n))
        return min(x, 2 * n - x)
    return x


@compiled
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


@compiled
def _smooth(spline, edge, x, y, across, down, out):
    """The spline through the texels at (x, y)."""
    h, w = spline.shape[:2]
    if edge != CLEAR:
        x, y = _folded(x, w - 2 * FRAME, edge), _folded(y, h - 2 * FRAME, edge)
    x, y = min(max(x, -6.0), w - 2 * FRAME + 6.0), min(max(y, -6.0), h - 2 * FRAME + 6.0)
    i, j = math.floor(y - 0.5), math.floor(x - 0.5)
    _quintic(y - 0.5 - i, down)
    _quintic(x - 0.5 - j, across)
    out[:] = 0
    for a in range(6):
        for b in range(6):
            weight = down[a] * across[b]
            for k in range(out.size):
                out[k] += weight * spline[i + a - 2 + FRAME, j + b - 2 + FRAME, k]


@compiled
def _footprint(xx, xy, yx, yy):
    """`_shape` of a footprint; one that is not finite counts as a point."""
    p, q, r, long, short = _shape(xx, xy, yx, yy)
    if not long < 1e12:
        return 1.0, 0.0, 1.0, 1.0, 1.0
    return p, q, r, long, short


@compiled
def _gathered(tex, xy, turn, kind, clamped, room, out):
    """Filters at texel coordinates xy (p, 2) with footprints turn (p, 4) = xx, xy, yx, yy into out (p c + LANES,).

    x is to the right, y down, and the first texel's centre at 0.5; `clamped` is as for `_weighed`, `room` of
    `_room`. Arrays are taken out of `tex` before the loop: to do so takes longer than a texel.
    """
    c, radius = tex.base.shape[2], RADIUS[kind]
    base, reduced, across, down, weights, patch = room
    sizes, starts, widths, heights = tex.size, tex.start, tex.width, tex.height
    large = base.size and widths[0] * c >= LANES
    repeats, periodic = tex.edge == REPEAT, tex.edge == REPEAT or tex.edge == MIRROR
    for n in range(xy.shape[0]):
        x, y = xy[n, 0], xy[n, 1]
        if repeats:
            x, y = _folded(x, widths[0], REPEAT), _folded(y, heights[0], REPEAT)
        p, q, r, long, short = _footprint(turn[n, 0], turn[n, 1], turn[n, 2], turn[n, 3])
        if kind == CUBIC and long == 1.0 and large:  # magnified: the short way to the same
            j, i = math.ceil(x - 2.5), math.ceil(y - 2.5)
            if i >= 0 and j >= 0 and math.floor(y + 1.5) + 1 < heights[0] and math.floor(x + 1.5) < widths[0]:
                at = (i * widths[0] + j) * c
                _magnified(base, at, widths[0] * c, x - 0.5 - j, y - 0.5 - i, clamped, c, out, n * c)
                continue
        level = 0
        while level + 1 < sizes.size and short >= sizes[level + 1]:
            level += 1
        size, w, h = sizes[level], widths[level], heights[level]
        if short >= 4 * size:  # nothing smaller is left: the whole picture
            p, q, r = 0.25 / size, 0.0, 0.25 / size
        if level:
            x, y, p, q, r = x / size, y / size, p * size, q * size, r * size
            if periodic:  # the last texel of a level may reach beyond: they share the picture evenly
                x, y = x * size * w / widths[0], y * size * h / heights[0]
        reach = radius / (p * r - q * q)
        reach_x, reach_y = reach * (abs(r) + abs(q)), reach * (abs(p) + abs(q))
        j, i = math.ceil(x - reach_x - 0.5), math.ceil(y - reach_y - 0.5)
        columns = min(math.floor(x + reach_x - 0.5) - j + 1, MOST)
        rows = min(math.floor(y + reach_y - 0.5) - i + 1, MOST)
        x, y = x - 0.5 - j, y - 0.5 - i
        # a row more: a register reaches beyond the last texel's channels
        within = i >= 0 and j >= 0 and i + rows < h and j + columns <= w and w * c >= LANES
        at, row, value = (i * w + j) * c, w * c, out[n * c : (n + 1) * c]
        if not within or (level == 0 and base.size == 0):
            _copied(tex, level, i, j, rows, columns, patch)
            at, row = np.int64(0), columns * c  # plain 0 would be a type of its own
            _weighed(
                patch, at, row, columns, rows, x, y, p, q, r, kind, clamped, across, down, weights, value
            )
        elif level:
            at += starts[level] * c
            _weighed(
                reduced, at, row, columns, rows, x, y, p, q, r, kind, clamped, across, down, weights, value
            )
        else:
            _weighed(base, at, row, columns, rows, x, y, p, q, r, kind, clamped, across, down, weights, value)


@compiled
def _painted(tex, z, right, down, cover, columns, at, kind, clamped, alpha, room, row, edges, start, out):
    """sRGB bytes of pixels (rows, width) that are covered, in some of their columns: place, filter and encode one after
    the other, a row at a time, which stays in the processor's nearest cache.

    Args:
        tex: the picture.
        z, right, down, cover: as in `Band`.
        columns: the first, and the one after the last.
        at: as for `place`.
        kind: of FILTERS.
        clamped: as for `_weighed`.
        alpha: the channel that is, or c: appended.
        room: of `_room`.
        row: memory for the pixels of a row: columns, places and their derivatives, values.
        edges, start: of `colour.byte_edges`.
        out: (rows, width, c), or one channel more, written where anything is covered.
    """
    c = tex.base.shape[2]
    held, places, turns, values = row
    for i in range(z.shape[0]):
        count = 0
        for j in range(columns[0], columns[1]):
            if cover[i, j] != 0:
                x, y, xx, xy, yx, yy = place(z[i, j], right[i, j], down[i, j], at)
                places[count, 0], places[count, 1] = x, y
                turns[count, 0], turns[count, 1], turns[count, 2], turns[count, 3] = xx, xy, yx, yy
                held[count] = j
                count += 1
        _gathered(tex, places[:count], turns[:count], kind, clamped, room, values)
        for n in range(count):
            j = held[n]
            share, opaque = cover[i, j], np.float32(1)
            if alpha < c:
                opaque = values[n * c + alpha]
                share *= opaque
            if opaque == 0:
                opaque = np.float32(1)
            for k in range(c):
                v = unit(values[n * c + k] / opaque)
                code = np.int64(start[int(v * FINE)])
                out[i, j, k] = code + (v >= edges[code + 1])
            out[i, j, alpha] = np.uint8(np.rint(unit(share) * 255))


@compiled
def _splined(spline, edge, xy, turn, out):
    """Puts the spline in the place of the cubic's values, which it gives way to where the texture is shrunk."""
    mixed, across, down = np.empty(out.shape[1]), np.empty(6), np.empty(6)
    for n in range(xy.shape[0]):
        long = _footprint(turn[n, 0], turn[n, 1], turn[n, 2], turn[n, 3])[3]
        share = max(0.0, (BLEND - long) / (BLEND - 1))
        if share > 0:
            _smooth(spline, edge, xy[n, 0], xy[n, 1], across, down, mixed)
            for k in range(mixed.size):
                out[n, k] = mixed[k] if share == 1 else share * mixed[k] + (1 - share) * out[n, k]


def _room(tex: Pyramid) -> tuple[Float, ...]:
    """What `_gathered` works with: the numbers of the picture, none of one that is decoded as it is read; those of its
    reductions; ACROSS and DOWN, of which a kernel would keep copies; memory for weights and texels."""
    base = tex.base.ravel() if tex.base.dtype == np.float32 else np.empty(0, np.float32)
    weights, patch = np.empty_like(ACROSS), np.empty(MOST * MOST * tex.base.shape[2] + LANES, np.float32)
    return base, tex.texels.ravel(), ACROSS, DOWN, weights, patch


def paint(
    tex: Pyramid,
    band: Band,
    columns: tuple[int, int],
    at: Corner,
    kind: int,
    clamped: bool,
    alpha: int,
    out: NDArray[np.uint8],
) -> None:
    """sRGB bytes of a band's pixels that are covered, in some of its columns; arguments as for `_painted`. `kind` is a
    kernel's: NEAREST and SPLINE are no such."""
    most, pixels = columns[1] - columns[0], (band.z, band.right, band.down, band.coverage)
    values = np.empty(most * tex.base.shape[2] + LANES, np.float32)
    row = np.empty(most, np.int64), np.empty((most, 2)), np.empty((most, 4)), values
    _painted(tex, *pixels, columns, at, kind, clamped, alpha, _room(tex), row, *byte_edges(), out)


def read(tex: Pyramid, xy: Real, turn: Real, kind: int, clamped: bool = False) -> Float:
    """(p, c) values at texel coordinates with footprints, see `_gathered`; `clamped` is for kernels.

    What is seldom asked for is a kernel of its own, which the first run need not compile.
    """
    c = tex.base.shape[2]
    numbers = np.empty(len(xy) * c + LANES, np.float32)
    out = numbers[:-LANES].reshape(-1, c)
    if kind == NEAREST:
        _nearest(tex, xy, out)
        return out
    _gathered(tex, xy, turn, CUBIC if kind == SPLINE else kind, clamped, _room(tex), numbers)
    if kind == SPLINE and tex.spline.size:
        _splined(tex.spline, tex.edge, xy, turn, out)
    return out
