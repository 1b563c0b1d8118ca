"""Reading a picture at points with the footprint that a map gives a pixel: a mip pyramid and a stretched kernel.

A pixel's footprint in the texture is the ellipse of J, d(texel) / d(pixel). The kernel is k(u) k(v) with
(u, v) = S⁻¹ d, S being the symmetric square root of J Jᵀ with no axis under one texel. So it is the plain separable
kernel where the texture is magnified, a wider one where a conformal map shrinks it, a sheared one under a
quasi-conformal map, and changes continuously between these. Wide kernels read a smaller level of the pyramid.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numba.extending import overload
from numpy.typing import NDArray

from ..memory import Room
from ..parallel import over_slices
from .colour import Float

NEAREST, LINEAR, CUBIC, LANCZOS, SPLINE = 0, 1, 2, 3, 4
FILTERS = {"nearest": NEAREST, "linear": LINEAR, "cubic": CUBIC, "lanczos": LANCZOS, "spline": SPLINE}
RADIUS = (0.5, 1.0, 2.0, 3.0, 3.0)
LONGEST = 8.0  # longest over shortest axis of a kernel: beyond, the short one is widened
BLEND = 1.5  # a spline gives way to the cubic between a footprint of one texel and this
FRAME = 12  # texels around a spline's coefficients: what lies outside no longer matters beyond
CLAMP, CLEAR = 0, 1
STRIP, LEAST_ROWS = 1 << 20, 64  # numbers of a picture, and rows of a wide one, that are worked on at a time
HALO = 20  # rows around them that two reductions by two reach


class Pyramid(NamedTuple):
    """A picture and its reductions by powers of two.

    Attributes:
        base: (h, w, c) the picture, ready to be filtered, or as stored in integers.
        decode: (levels, c) what stored integers mean, channel by channel; empty if the picture is ready.
        alpha: the channel that the others are to be multiplied by when they are decoded, or -1.
        texels: (t, c) the reductions, ready, row after row.
        size: (l,) how many texels of the picture a level's texel is wide; 1 is the picture itself.
        start, height, width: (l,) where a level begins in `texels`, and its size.
        edge: CLAMP or CLEAR, what lies outside.
        spline: (h + 2 FRAME, w + 2 FRAME, c) coefficients of the quintic spline through the picture, or nothing.
    """

    base: NDArray
    decode: Float
    alpha: int
    texels: Float
    size: NDArray[np.int64]
    start: NDArray[np.int64]
    height: NDArray[np.int64]
    width: NDArray[np.int64]
    edge: int
    spline: Float


def pyramid(
    picture: Float, edge: int, kind: int, room: Room | None = None, threads: int | None = None
) -> Pyramid:
    """What a filter of the given kind reads of an (h, w, c) picture that is ready: linear and premultiplied.

    Args:
        picture: the picture.
        edge: CLAMP or CLEAR.
        kind: a filter's number.
        room: where the reductions are kept.
        threads: never change the result.
    """
    c = picture.shape[2]
    spline = _coefficients(picture, edge) if kind == SPLINE else np.empty((0, 0, c), dtype=np.float32)
    no = np.empty((0, c), dtype=np.float32)
    levels = _reductions(picture.shape, picture.__getitem__, 0 if kind == NEAREST else 1, edge, room, threads)
    return _stacked(picture, no, -1, levels, edge, spline)


def compact(
    pixels: NDArray,
    decode: Float,
    alpha: int,
    edge: int,
    kind: int,
    room: Room | None = None,
    threads: int | None = None,
) -> Pyramid:
    """The same of a large picture that stays as it is stored, in unsigned integers.

    Its first reduction is by four, so that all of them together take a third of the memory of 8-bit pixels; a spline
    gives way to the cubic.

    Args:
        pixels: (h, w, c) uint8 or uint16.
        decode: (levels, c) the linear value of every integer, by channel.
        alpha: the channel to premultiply by, or -1.
        edge, kind, room, threads: as for `pyramid`.
    """
    spline = np.empty((0, 0, pixels.shape[2]), dtype=np.float32)

    def read(rows: slice) -> Float:
        return ready(pixels[rows], decode, alpha)

    levels = _reductions(pixels.shape, read, 0 if kind == NEAREST else 2, edge, room, threads)
    return _stacked(pixels, decode, alpha, levels, edge, spline)


def ready(pixels: NDArray, decode: Float, alpha: int) -> Float:
    """(h, w, c) stored integers decoded and premultiplied; arguments as for `compact`."""
    out = np.empty(pixels.shape, dtype=np.float32)
    _decoded(pixels, decode, alpha, out)
    return out


def strip_rows(width: int, channels: int) -> int:
    """How many rows of a picture are worked on at a time."""
    return max(LEAST_ROWS, STRIP // max(1, width * channels) // 8 * 8)


def _reductions(
    shape: tuple[int, ...],
    read: Callable[[slice], Float],
    halvings: int,
    edge: int,
    room: Room | None,
    threads: int | None,
) -> tuple[Float, list[Float], list[int]]:
    """All reductions' texels, the reductions as views of them, and by how much each is reduced.

    Args:
        shape: (h, w, c) of the picture.
        read: gives rows of it.
        halvings: before the first reduction; later ones are halves of those before. None at all for 0.
        edge, room, threads: as for `pyramid`.
    """
    (h, w, c), room = shape, room or Room()
    sizes: list[int] = []
    while halvings and max(h, w) > (sizes[-1] if sizes else 1):
        sizes.append(2 * sizes[-1] if sizes else 1 << halvings)
    shapes = [(-(-h // size), -(-w // size)) for size in sizes]
    ends = np.cumsum([0, *(a * b for a, b in shapes)])
    texels = room((int(ends[-1]), c), np.float32)
    levels = [texels[i : i + a * b].reshape(a, b, c) for i, (a, b) in zip(ends, shapes)]
    for out in levels:
        _shrink(read, h, out, halvings, edge, room, threads)
        read, h, halvings = out.__getitem__, len(out), 1
    return texels, levels, sizes


def _shrink(
    read: Callable[[slice], Float],
    height: int,
    out: Float,
    halvings: int,
    edge: int,
    room: Room,
    threads: int | None,
) -> None:
    """Halves a picture both ways, once or twice, some rows at a time."""
    by = 1 << halvings

    def strip(rows: slice) -> None:
        above, below = min(rows.start, HALO), min(height - rows.stop, HALO)
        part = read(slice(rows.start - above, rows.stop + below))
        for _ in range(halvings):
            part = _reduced(part, edge)
        first = rows.start // by
        out[first : -(-rows.stop // by)] = part[above // by :][: -(-(rows.stop - rows.start) // by)]
        room.release()

    over_slices(strip, height, threads, strip_rows(by * out.shape[1], out.shape[2]))


def _stacked(base, decode, alpha, levels: tuple[Float, list[Float], list[int]], edge: int, spline) -> Pyramid:
    texels, reduced, sizes = levels
    shapes = np.array([base.shape[:2], *(level.shape[:2] for level in reduced)], dtype=np.int64)
    start = np.cumsum([0, 0, *(len(level) * level.shape[1] for level in reduced)])[: len(shapes)]
    size = np.array([1, *sizes], dtype=np.int64)
    height, width = np.ascontiguousarray(shapes.T)
    return Pyramid(base, decode, alpha, texels, size, start.astype(np.int64), height, width, edge, spline)


def _reduced(a: Float, edge: int) -> Float:
    """(h, w, c) halved both ways with a Lanczos-windowed half-band kernel of 12 taps."""
    x = (np.arange(6) + 0.5) / 2
    side = np.sinc(x) * np.sinc(x / 3)
    taps = np.concatenate([side[::-1], side]).astype(np.float32)
    taps /= taps.sum()
    h, w, c = a.shape
    low = np.zeros(((h + 1) // 2, w, c), dtype=np.float32)
    _halve_rows(a.reshape(h, w * c), taps, edge, low.reshape(len(low), w * c))
    out = np.zeros((len(low), (w + 1) // 2, c), dtype=np.float32)
    _halve_columns(low, taps, edge, out)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _halve_rows(a, taps, edge, out):
    h = a.shape[0]
    for i in range(out.shape[0]):
        for t in range(taps.size):
            row = 2 * i + t - 5
            if edge == CLEAR and (row < 0 or row >= h):
                continue
            row, tap = min(max(row, 0), h - 1), taps[t]
            for j in range(a.shape[1]):
                out[i, j] += tap * a[row, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _halve_columns(a, taps, edge, out):
    w, c = a.shape[1], a.shape[2]
    line = np.zeros(((w + 12), c), dtype=np.float32)  # a row with its surroundings
    for i in range(a.shape[0]):
        for j in range(w + 12):
            if edge == CLAMP or 5 <= j < w + 5:
                for k in range(c):
                    line[j, k] = a[i, min(max(j - 5, 0), w - 1), k]
        for j in range(out.shape[1]):
            for t in range(taps.size):
                for k in range(c):
                    out[i, j, k] += taps[t] * line[2 * j + t, k]


@njit(cache=True, nogil=True, error_model="numpy")
def _decoded(pixels, decode, alpha, out):
    """Stored integers made ready."""
    h, w, c = pixels.shape
    for i in range(h):
        for j in range(w):
            over = decode[pixels[i, j, alpha], alpha] if alpha >= 0 else np.float32(1)
            for k in range(c):
                value = decode[pixels[i, j, k], k]
                out[i, j, k] = value if k == alpha else over * value


def _coefficients(picture: Float, edge: int) -> Float:
    """Quintic B-spline coefficients (Unser 1999) of the picture in a frame of what lies outside."""
    from scipy.ndimage import spline_filter1d

    framed = _framed(picture, [(FRAME, FRAME), (FRAME, FRAME), (0, 0)], edge)
    out = np.empty_like(framed)
    for k in range(framed.shape[2]):
        along = spline_filter1d(framed[..., k], 5, 0, output=np.float64, mode="mirror")
        out[..., k] = spline_filter1d(along, 5, 1, output=np.float64, mode="mirror")
    return out


def _framed(a: Float, frame: list[tuple[int, int]], edge: int) -> Float:
    return np.pad(a, frame, mode="edge") if edge == CLAMP else np.pad(a, frame)


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


@njit(cache=True, nogil=True, error_model="numpy")
def _nearest(tex, x, y, out):
    w, h = tex.width[0], tex.height[0]
    i, j = math.floor(y), math.floor(x)
    out[:] = 0
    if tex.edge == CLAMP or (i >= 0 and j >= 0 and i < h and j < w):
        add(tex, min(max(i, 0), h - 1), min(max(j, 0), w - 1), 1.0, out)


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(tex, x, y, p, q, r, level, kind, weights, out):
    """The kernel with S⁻¹ = [[p, q], [q, r]] at (x, y) of a level. `weights` is room for one row of them."""
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


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def read_all(tex, xy, turn, kind, out):
    """Filters at texel coordinates xy (p, 2) with footprints turn (p, 4) = xx, xy, yx, yy into out (p, c).

    x is to the right, y down, and the first texel's centre at 0.5. A footprint that is not finite counts as a point.
    """
    value, mixed = np.empty(out.shape[1]), np.empty(out.shape[1])
    weights, more = np.empty(512), np.empty(8)
    for i in range(xy.shape[0]):
        x, y = xy[i, 0], xy[i, 1]
        if kind == NEAREST:
            _nearest(tex, x, y, value)
        else:
            p, q, r, long, short = _shape(turn[i, 0], turn[i, 1], turn[i, 2], turn[i, 3])
            if not long < 1e12:
                p, q, r, long, short = 1.0, 0.0, 1.0, 1.0, 1.0
            smooth = kind == SPLINE and tex.spline.size > 0
            share = max(0.0, (BLEND - long) / (BLEND - 1)) if smooth else 0.0
            if share < 1:
                level = 0
                while level + 1 < tex.size.size and short >= tex.size[level + 1]:
                    level += 1
                size = float(tex.size[level])
                if short >= 4 * size:  # nothing smaller is left: the whole picture
                    p, q, r = 0.25 / size, 0.0, 0.25 / size
                kernel_kind = CUBIC if kind == SPLINE else kind
                _gather(
                    tex, x / size, y / size, p * size, q * size, r * size, level, kernel_kind, weights, value
                )
            if share > 0:
                _smooth(tex, x, y, weights, more, mixed)
                for k in range(value.size):
                    value[k] = mixed[k] if share == 1 else share * mixed[k] + (1 - share) * value[k]
        for k in range(value.size):
            out[i, k] = value[k]
