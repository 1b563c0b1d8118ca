"""Mip pyramids for filters: reductions by powers of two, and spline coefficients."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..memory import Memory
from ..native import Record, function, record
from ..parallel import over_slices
from .colour import Float

Picture = record("""struct Pyramid {
    const uint8_t *base; int64_t base_bytes; int64_t channels; const float *decode; int64_t alpha; const float *texels;
    const int64_t *levels; int64_t level_count; int64_t edge; }""")
_halve = function("""int64_t iccm_pixels_halve(
    const float *picture, int64_t height, int64_t width, int64_t c, const float *taps, int64_t edge, bool clamped,
    float *out)""")
_decode = function("""int64_t iccm_pixels_decode(
    const uint8_t *pixels, int64_t bytes, int64_t count, int64_t c, const float *table, int64_t alpha, float *out)""")
FRAME_TEXELS = 12
"""Texels around a spline's coefficients: the pole of the spline to this power is 0.43 ** 12 = 4e-5."""
CLAMP, CLEAR, REPEAT, MIRROR = 0, 1, 2, 3
EDGES = {"clamp": CLAMP, "transparent": CLEAR, "repeat": REPEAT, "mirror": MIRROR}
STRIP_VALUES, LEAST_ROWS = 1 << 20, 64
"""Numbers of a picture, and least number of rows, that are processed at a time, which bounds memory."""
HALO_ROWS = (0, 6, 20)
"""Rows above and below needed for so many halvings: 6, and 6 + 2 · 6 rounded up to a multiple of 4."""


class Pyramid(NamedTuple):
    """A picture and its reductions by powers of two.

    Attributes:
        base: (h, w, c) the picture, either ready to be filtered, or stored integers.
        decode: (levels, c) value of each stored integer, by channel; empty if the picture is ready.
        alpha: channel by which others are multiplied when they are decoded, or -1.
        texels: (t, c) the reductions, ready to be filtered, row after row.
        size: (l,) size of each level's texels in texels of the picture; 1 is the picture itself.
        start, height, width: (l,) offset of each level in `texels`, and its size.
        edge: one of EDGES, how the picture continues outside.
        spline: (h + 2 FRAME_TEXELS, w + 2 FRAME_TEXELS, c) coefficients of the quintic spline through the picture, or
        empty.
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

    @property
    def picture(self) -> Record:
        """The record for functions of the core."""
        levels = np.column_stack([self.size, self.start, self.height, self.width])
        base, channels = self.base, self.base.shape[2]
        return Picture(
            *(base.view(np.uint8), base.itemsize, channels, self.decode, self.alpha),
            *(self.texels, levels, len(levels), self.edge),
        )


def pyramid(
    picture: Float,
    edge: int,
    memory: Memory | None = None,
    threads: int | None = None,
    *,
    reduced: bool = True,
    spline: bool = False,
    clamped: bool = False,
) -> Pyramid:
    """Build the pyramid of an (h, w, c) picture that is ready to be filtered: linear and premultiplied.

    Args:
        picture: the picture.
        edge: one of EDGES.
        memory: where to allocate the reductions.
        threads: number of threads; it does not affect the result.
        reduced, spline: whether the filter needs reductions, and the spline.
        clamped: whether to keep reductions within the range of the texels that they are made of.
    """
    c = picture.shape[2]
    smooth = _coefficients(picture, edge) if spline else np.empty((0, 0, c), dtype=np.float32)
    no = np.empty((0, c), dtype=np.float32)
    levels = _reductions(picture.shape, picture.__getitem__, int(reduced), edge, clamped, memory, threads)
    return _stacked(picture, no, -1, levels, edge, smooth)


def compact(
    pixels: NDArray,
    decode: Float,
    alpha: int,
    edge: int,
    memory: Memory | None = None,
    threads: int | None = None,
    *,
    reduced: bool = True,
    clamped: bool = False,
) -> Pyramid:
    """Build the pyramid of a large picture that stays in its stored form of unsigned integers.

    The first reduction is by four, so that all reductions together take a third of the memory of 8-bit pixels. There is
    no spline; the cubic kernel is used instead.

    Args:
        pixels: (h, w, c) uint8 or uint16.
        decode: (levels, c) linear value of each integer, by channel.
        alpha: channel to premultiply by, or -1.
        edge, memory, threads, reduced, clamped: as for `pyramid`.
    """
    spline = np.empty((0, 0, pixels.shape[2]), dtype=np.float32)

    def read(rows: Any) -> Float:
        return ready(pixels[rows], decode, alpha)

    levels = _reductions(pixels.shape, read, 2 * reduced, edge, clamped, memory, threads)
    return _stacked(pixels, decode, alpha, levels, edge, spline)


def ready(pixels: NDArray, decode: Float, alpha: int) -> Float:
    """Decode and premultiply (h, w, c) stored integers; arguments as for `compact`."""
    height, width, channels = pixels.shape
    out = np.empty(pixels.shape, dtype=np.float32)
    stored = np.ascontiguousarray(pixels)
    table = np.ascontiguousarray(decode, np.float32)
    _decode(stored.view(np.uint8), stored.itemsize, height * width, channels, table, alpha, out)
    return out


def strip_rows(width: int, channels: int) -> int:
    """Return the number of rows of a picture that are processed at a time."""
    return max(LEAST_ROWS, STRIP_VALUES // max(1, width * channels) // 8 * 8)


def _reductions(
    shape: tuple[int, ...],
    read: Callable[[Any], Float],
    halvings: int,
    edge: int,
    clamped: bool,
    memory: Memory | None,
    threads: int | None,
) -> tuple[Float, list[Float], list[int]]:
    """Compute the reductions of a picture.

    Args:
        shape: (h, w, c) of the picture.
        read: returns rows of it.
        halvings: number of halvings to the first reduction; later ones halve the one before. 0 for no reductions.
        edge, clamped, memory, threads: as for `pyramid`.

    Returns:
        Texels of all reductions, the reductions as views of them, and the factor of each reduction.
    """
    (h, w, c), memory = shape, memory or Memory()
    sizes: list[int] = []
    while halvings and max(h, w) > (sizes[-1] if sizes else 1):
        sizes.append(2 * sizes[-1] if sizes else 1 << halvings)
    shapes = [(-(-h // size), -(-w // size)) for size in sizes]
    ends = np.cumsum([0, *(a * b for a, b in shapes)])
    texels = memory((int(ends[-1]), c), np.float32)
    levels = [texels[i : i + a * b].reshape(a, b, c) for i, (a, b) in zip(ends, shapes)]
    for out in levels:
        _shrink(read, h, out, halvings, edge, clamped, memory, threads)
        read, h, halvings = out.__getitem__, len(out), 1
    return texels, levels, sizes


def _shrink(
    read: Callable[[Any], Float],
    height: int,
    out: Float,
    halvings: int,
    edge: int,
    clamped: bool,
    memory: Memory,
    threads: int | None,
) -> None:
    """Halve a picture in both directions, once or twice, some rows at a time; writes `out`."""
    by = 1 << halvings

    def strip(rows: slice) -> None:
        if edge in (REPEAT, MIRROR):
            above = HALO_ROWS[halvings]
            part = read(_repeated(np.arange(rows.start - above, rows.stop + above), height, edge))
        else:
            above, below = min(rows.start, HALO_ROWS[halvings]), min(height - rows.stop, HALO_ROWS[halvings])
            part = read(slice(rows.start - above, rows.stop + below))
        for _ in range(halvings):
            part = _reduced(part, edge, clamped)
        first = rows.start // by
        out[first : -(-rows.stop // by)] = part[above // by :][: -(-(rows.stop - rows.start) // by)]
        memory.release()

    over_slices(strip, height, threads, strip_rows(by * out.shape[1], out.shape[2]))


def _stacked(base, decode, alpha, levels: tuple[Float, list[Float], list[int]], edge: int, spline) -> Pyramid:
    texels, reduced, sizes = levels
    shapes = np.array([base.shape[:2], *(level.shape[:2] for level in reduced)], dtype=np.int64)
    start = np.cumsum([0, 0, *(len(level) * level.shape[1] for level in reduced)])[: len(shapes)]
    size = np.array([1, *sizes], dtype=np.int64)
    height, width = np.ascontiguousarray(shapes.T)
    base, decode = np.ascontiguousarray(base), np.ascontiguousarray(decode, np.float32)
    return Pyramid(base, decode, alpha, texels, size, start.astype(np.int64), height, width, edge, spline)


def _reduced(a: Float, edge: int, clamped: bool = False) -> Float:
    """Halve (h, w, c) in both directions with a Lanczos-windowed half-band kernel of 12 taps.

    If `clamped`, results stay within the range of the texels that the kernel reads, in spite of its negative lobes.
    Filters clamp to the range of a level's texels, which is within that of the picture only if all levels are clamped.
    """
    x = (np.arange(6) + 0.5) / 2
    side = np.sinc(x) * np.sinc(x / 3)
    taps = np.concatenate([side[::-1], side]).astype(np.float32)
    taps /= taps.sum()
    h, w, c = a.shape
    out = np.empty(((h + 1) // 2, (w + 1) // 2, c), np.float32)
    _halve(np.ascontiguousarray(a, np.float32), h, w, c, taps, edge, clamped, out)
    return out


def _repeated(rows: NDArray[np.int64], height: int, edge: int) -> NDArray[np.int64]:
    """Map row numbers outside a picture to its rows, by repetition or mirroring."""
    if edge == REPEAT:
        return rows % height
    rows = rows % (2 * height)
    return np.minimum(rows, 2 * height - 1 - rows)


def _coefficients(picture: Float, edge: int) -> Float:
    """Return quintic B-spline coefficients (Unser 1999) of the picture, extended by FRAME_TEXELS on each side."""
    from scipy.ndimage import spline_filter1d

    framed = _framed(picture, [(FRAME_TEXELS, FRAME_TEXELS), (FRAME_TEXELS, FRAME_TEXELS), (0, 0)], edge)
    out = np.empty_like(framed)
    for k in range(framed.shape[2]):
        along = spline_filter1d(framed[..., k], 5, 0, output=np.float64, mode="mirror")
        out[..., k] = spline_filter1d(along, 5, 1, output=np.float64, mode="mirror")
    return out


def _framed(a: Float, frame: list[tuple[int, int]], edge: int) -> Float:
    modes: dict[int, Any] = {CLAMP: "edge", CLEAR: "constant", REPEAT: "wrap", MIRROR: "symmetric"}
    return np.pad(a, frame, mode=modes[edge])
