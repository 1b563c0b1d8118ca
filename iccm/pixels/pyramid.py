"""Mip pyramids for filters: reductions by powers of two, and spline coefficients.

The rows of a pyramid are computed strip by strip, when a filter first reads them: a map that shows a part of a picture
decodes that part, and one that magnifies it needs no reductions.
"""

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..memory import Memory
from ..native import Record, function, record
from .colour import Float

Picture = record("""struct Pyramid {
    const uint8_t *base; int64_t base_bytes; int64_t channels; const float *decode; int64_t alpha; const float *texels;
    const int64_t *levels; int64_t level_count; int64_t edge; int64_t strip_rows; const uint8_t *present;
    uint8_t *wanted; }""")
_halve = function("""int64_t iccm_pixels_halve(
    const float *picture, int64_t height, int64_t width, int64_t c, const float *taps, int64_t edge, bool clamped,
    int64_t first, int64_t last, float *out)""")
_decode = function("""int64_t iccm_pixels_decode(
    const uint8_t *pixels, int64_t bytes, int64_t count, int64_t c, const float *table, int64_t alpha, float *out)""")
_present = function("int64_t iccm_pixels_present(uint8_t *present, int64_t strip)")
FRAME_TEXELS = 12
"""Texels around a spline's coefficients: the pole of the spline to this power is 0.43 ** 12 = 4e-5."""
CLAMP, CLEAR, REPEAT, MIRROR = 0, 1, 2, 3
EDGES = {"clamp": CLAMP, "transparent": CLEAR, "repeat": REPEAT, "mirror": MIRROR}
STRIP_VALUES, LEAST_ROWS = 1 << 20, 64
"""Numbers of a picture, and least number of rows, that are processed at a time, which bounds memory."""
STRIP_ROWS = 16  # rows of a level that are computed together, when the first of them is read
ROWS_ABOVE, ROWS_BELOW = 5, 7
"""Rows that the kernel of a halving reads above and from the first of the two rows on that it joins."""
HALO_ROWS = 20
"""Rows above and below that two halvings at once need: 6 + 2 · 6, rounded up to a multiple of 4."""


Rows = Callable[[Any, Float | None], Float]
"""Returns given rows of a picture, ready to be filtered: in the array given, or in a new one."""


class Pyramid:
    """A picture and its reductions by powers of two.

    Args:
        base: (h, w, c) the picture, either ready to be filtered, or stored integers.
        edge: one of EDGES, how the picture continues outside.
        ready: returns rows of the picture that are ready to be filtered. None if `base` is.
        decode: (levels, c) value of each stored integer, by channel; None if the picture is not stored as integers.
        alpha: channel by which others are multiplied when they are decoded, or -1.
        memory: where to allocate the reductions.
        halvings: from the picture to its first reduction; 0 for no reductions.
        clamped: whether reductions stay within the range of the texels that they are made of.

    Attributes:
        base, decode, alpha, edge: as above. Rows of `base` that are not present are not initialised.
        texels: (t, c) the reductions, ready to be filtered, row after row.
        size: (l,) size of each level's texels in texels of the picture; 1 is the picture itself.
        start, height, width: (l,) offset of each level in `texels`, and its size.
        spline: (h + 2 FRAME_TEXELS, w + 2 FRAME_TEXELS, c) coefficients of the quintic spline through the picture, or
        empty.
    """

    def __init__(
        self,
        base: NDArray,
        edge: int,
        ready: Rows | None = None,
        *,
        decode: Float | None = None,
        alpha: int = -1,
        memory: Memory | None = None,
        halvings: int = 1,
        clamped: bool = False,
    ):
        h, w, c = base.shape
        self.base, self.edge, self.alpha, self.clamped = np.ascontiguousarray(base), edge, alpha, clamped
        no_table = np.empty((0, c), dtype=np.float32)
        self.decode = no_table if decode is None else np.ascontiguousarray(decode, np.float32)
        self._ready, self._halvings, self._memory = ready, halvings, memory or Memory()
        sizes = [1]
        while halvings and max(h, w) > (sizes[-1] if len(sizes) > 1 else 1):
            sizes.append(2 * sizes[-1] if len(sizes) > 1 else 1 << halvings)
        self.size = np.array(sizes)
        self.height, self.width = -(-h // self.size), -(-w // self.size)
        ends = np.cumsum([0, *(self.height * self.width)[1:]])
        self.start = np.array([0, *ends[:-1]])
        self.texels = self._memory((int(ends[-1]), c), np.float32)
        self.spline: Float = np.empty((0, 0, c), dtype=np.float32)
        self._first_strips = np.cumsum([0, *-(-self.height // STRIP_ROWS)])
        self._levels = np.column_stack(
            [self.size, self.start, self.height, self.width, self._first_strips[:-1]]
        )
        count = int(self._first_strips[-1])
        self._present = np.zeros(count, np.uint8)
        self._locks = [threading.Lock() for _ in range(count)]
        if ready is None or decode is not None:
            self._present[: self._first_strips[1]] = 1

    def picture(self, wanted: NDArray[np.uint8]) -> Record:
        """Return the record for functions of the core, which set `wanted` for the strips that they miss."""
        base, channels = self.base, self.base.shape[2]
        return Picture(
            *(base.view(np.uint8), base.itemsize, channels, self.decode, self.alpha),
            *(self.texels, self._levels, len(self._levels), self.edge, STRIP_ROWS, self._present, wanted),
        )

    def filtered(self, work: Callable[[Record, int], int]) -> None:
        """Filter all items, such as points: work(picture, first) filters those from `first` on.

        It returns the number of items before the first that wants rows which are absent. These are computed before the
        next call.
        """
        done = 0
        while True:
            wanted = np.zeros(len(self._present), np.uint8)
            done += work(self.picture(wanted), done)
            strips = np.flatnonzero(wanted)
            if not strips.size:
                return
            for strip in strips.tolist():
                self._compute(strip)

    def complete(self, levels: int | None = None) -> "Pyramid":
        """Compute all rows, or those of the first few levels; return the pyramid."""
        last = len(self.size) if levels is None else levels
        for strip in range(self._first_strips[last]):
            self._compute(strip)
            self._memory.release()
        return self

    def _compute(self, strip: int) -> None:
        """Compute the rows of a strip, unless they are present or another thread has just computed them.

        A strip waits only for strips of finer levels, so that threads cannot wait for each other in a circle.
        """
        with self._locks[strip]:
            if self._present[strip]:
                return
            level = int(np.searchsorted(self._first_strips, strip, side="right")) - 1
            first = STRIP_ROWS * (strip - int(self._first_strips[level]))
            last = min(first + STRIP_ROWS, int(self.height[level]))
            if level == 0:
                assert self._ready is not None
                self._ready(slice(first, last), self.base[first:last])
            elif level == 1 and self._halvings == 2:
                self._reduce_stored(first, last)
            else:
                self._reduce(level, first, last)
            _present(self._present, strip)

    def _reduce(self, level: int, first: int, last: int) -> None:
        """Compute some rows of a level by halving the level before it."""
        height = int(self.height[level - 1])
        rows = np.arange(2 * first - ROWS_ABOVE, 2 * last + ROWS_BELOW)
        for finer in np.unique(_inside(rows, height, self.edge) // STRIP_ROWS).tolist():
            self._compute(int(self._first_strips[level - 1]) + finer)
        _halved(self._rows(level - 1), self.edge, self.clamped, first, last, self._rows(level)[first:last])

    def _reduce_stored(self, first: int, last: int) -> None:
        """Compute some rows of the first reduced picture, straight from the stored one (by two halvings at once)."""
        assert self._ready is not None
        height, divisor = int(self.height[0]), 1 << self._halvings
        start, end = divisor * first, min(divisor * last, height)
        if self.edge in (REPEAT, MIRROR):
            above = HALO_ROWS
            part = self._ready(_inside(np.arange(start - above, end + above), height, self.edge), None)
        else:
            above, below = min(start, HALO_ROWS), min(height - end, HALO_ROWS)
            part = self._ready(slice(start - above, end + below), None)
        for _ in range(self._halvings):
            part = _reduced(part, self.edge, self.clamped)
        self._rows(1)[first:last] = part[above // divisor :][: last - first]

    def _rows(self, level: int) -> Float:
        """Return the (h, w, c) texels of a level, as a view; those of the picture itself are ready to be filtered."""
        if level == 0:
            return self.base
        height, width, start = (int(sizes[level]) for sizes in (self.height, self.width, self.start))
        return self.texels[start : start + height * width].reshape(height, width, -1)


def pyramid(
    picture: Float,
    edge: int,
    memory: Memory | None = None,
    ready: Rows | None = None,
    *,
    reduced: bool = True,
    spline: bool = False,
    clamped: bool = False,
) -> Pyramid:
    """Return the pyramid of an (h, w, c) picture that is ready to be filtered: linear and premultiplied.

    Args:
        picture: the picture; not initialised, and filled in when it is read, if `ready` is given.
        edge, memory, ready, clamped: as for `Pyramid`.
        reduced, spline: whether the filter needs reductions, and the spline.
    """
    result = Pyramid(picture, edge, ready, memory=memory, halvings=int(reduced), clamped=clamped)
    if spline:
        result.spline = _coefficients(result.complete(1).base, edge)
    return result


def compact(
    pixels: NDArray,
    decode: Float,
    alpha: int,
    edge: int,
    memory: Memory | None = None,
    *,
    reduced: bool = True,
    clamped: bool = False,
) -> Pyramid:
    """Return the pyramid of a large picture that stays in its stored form of unsigned integers.

    The first reduction is by four, so that all reductions together take a third of the memory of 8-bit pixels. There is
    no spline; the cubic kernel is used instead.

    Args:
        pixels: (h, w, c) uint8 or uint16.
        decode: (levels, c) linear value of each integer, by channel.
        alpha: channel to premultiply by, or -1.
        edge, memory, clamped: as for `Pyramid`.
        reduced: whether the filter needs reductions.
    """

    def read(rows: Any, out: Float | None) -> Float:
        return ready(pixels[rows], decode, alpha, out)

    halvings = 2 * reduced
    return Pyramid(
        pixels, edge, read, decode=decode, alpha=alpha, memory=memory, halvings=halvings, clamped=clamped
    )


def ready(pixels: NDArray, decode: Float, alpha: int, out: Float | None = None) -> Float:
    """Decode and premultiply (h, w, c) stored integers; arguments as for `compact`, `out` as for NumPy's functions."""
    height, width, channels = pixels.shape
    if out is None:
        out = np.empty(pixels.shape, dtype=np.float32)
    stored = np.ascontiguousarray(pixels)
    table = np.ascontiguousarray(decode, np.float32)
    _decode(stored.view(np.uint8), stored.itemsize, height * width, channels, table, alpha, out)
    return out


def strip_rows(width: int, channels: int) -> int:
    """Return the number of rows of a picture that are processed at a time."""
    return max(LEAST_ROWS, STRIP_VALUES // max(1, width * channels) // 8 * 8)


def _reduced(a: Float, edge: int, clamped: bool = False) -> Float:
    """Halve (h, w, c) in both directions; see `_halved`."""
    h, w, c = a.shape
    rows = (h + 1) // 2
    out = np.empty((rows, (w + 1) // 2, c), np.float32)
    _halved(np.ascontiguousarray(a, np.float32), edge, clamped, 0, rows, out)
    return out


def _halved(a: Float, edge: int, clamped: bool, first: int, last: int, out: Float) -> None:
    """Halve (h, w, c) in both directions with a Lanczos-windowed half-band kernel of 12 taps; write rows first to last.

    If `clamped`, results stay within the range of the texels that the kernel reads, in spite of its negative lobes.
    Filters clamp to the range of a level's texels, which is within that of the picture only if all levels are clamped.
    """
    x = (np.arange(6) + 0.5) / 2
    side = np.sinc(x) * np.sinc(x / 3)
    taps = np.concatenate([side[::-1], side]).astype(np.float32)
    taps /= taps.sum()
    _halve(a, *a.shape, taps, edge, clamped, first, last, out)


def _inside(rows: NDArray[np.int64], height: int, edge: int) -> NDArray[np.int64]:
    """Map row numbers outside a picture to its rows: by repetition, mirroring, or to the nearest."""
    if edge == REPEAT:
        return rows % height
    if edge == MIRROR:
        rows = rows % (2 * height)
        return np.minimum(rows, 2 * height - 1 - rows)
    return np.clip(rows, 0, height - 1)


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
