"""Stored pixels of a texture at scattered places with their footprints."""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ..arrays import Complex, Real
from ..errors import InputError
from ..parallel import over_slices
from . import colour, filters
from .colour import Float
from .normals import turned
from .texture import Texture, check_kind, mend

SLICE = 1 << 15
FINE = 4096
KINDS = ("colour", "data", "normal", "normal-down")


class Places(NamedTuple):
    """Where points lie in a texture.

    Attributes:
        xy: (p, 2) texel coordinates, x right, y down.
        turn: (p, 4) their derivatives by the output's x and y: dx/dx, dx/dy, dy/dx, dy/dy.
        right, down: (p,) directions of the output's x and y on the textured surface, for normals: 1 is where the
            texture's x goes, 1j is square to it on the side where its upward y goes.
    """

    xy: Real
    turn: Real
    right: Complex | None = None
    down: Complex | None = None


class Reader:
    """A texture made ready to be read at scattered places.

    Args:
        texture: the picture; its box does not matter.
        filter: "nearest", "linear", "cubic", "lanczos", or "auto" (cubic).
        kind: "colour" (filtered in linear light, premultiplied), "data", or "normal" and "normal-down" (tangent-space
            normals with y up or down, turned and mirrored as the output's directions lie in the texture).
        edge: "clamp" or "transparent", what lies outside the picture.

    Raises:
        InputError: an unknown filter, kind or edge; normals without three channels.
    """

    def __init__(self, texture: Texture, filter: str = "auto", kind: str = "colour", edge: str = "clamp"):
        name = "cubic" if filter == "auto" else filter
        if name not in filters.FILTERS:
            raise InputError(f"filter {filter!r}: not one of auto, {', '.join(filters.FILTERS)} for a mesh")
        if kind not in KINDS or edge not in ("clamp", "transparent"):
            raise InputError(
                f"kind {kind!r}, edge {edge!r}: not one of {', '.join(KINDS)}; clamp, transparent"
            )
        check_kind(kind, texture.pixels.shape[2])
        self.texture, self.kind = texture, kind
        self.filter = filters.FILTERS[name]
        self.mixes = kind == "colour" and name != "nearest"
        self.srgb = self.mixes and texture.transfer == "srgb"
        picture = colour.decode(
            texture.pixels,
            texture.alpha,
            srgb=self.srgb,
            associated=texture.associated,
            premultiply=self.mixes or texture.associated,
        )
        if self.dtype.kind == "f" and self.filter != filters.NEAREST:
            mend(picture, texture.alpha if self.mixes else -1)
        rim = filters.CLAMP if edge == "clamp" else filters.CLEAR
        self.pyramid = filters.pyramid(picture, rim, self.filter)

    @property
    def channels(self) -> int:
        """Of the texture."""
        return self.texture.pixels.shape[2]

    @property
    def dtype(self) -> np.dtype:
        """Of the texture's pixels."""
        return self.texture.pixels.dtype

    def __call__(self, places: Callable[[slice], Places], count: int, threads: int | None = None) -> NDArray:
        """(count, c) pixels as the texture stores them.

        Args:
            places: takes a slice of the points to where they lie.
            count: number of points.
            threads: as many as there are processors by default.
        """
        out = np.empty((count, self.channels), self.dtype)

        def fill(part: slice) -> None:
            at = places(part)
            values = np.empty((len(at.xy), self.channels), np.float32)
            _read(self.pyramid, at.xy, at.turn, self.filter, values)
            if self.kind.startswith("normal"):
                values[:, :3] = self._turned(values[:, :3], at)
            out[part] = self._stored(values)

        over_slices(fill, count, threads, SLICE)
        return out

    def _turned(self, normals: Float, at: Places) -> Float:
        assert at.right is not None
        assert at.down is not None
        turn = np.where(np.abs(at.right) > 0, at.right, 1).conj()
        mirrored = (at.right.conj() * at.down).imag > 0
        return turned(normals, turn, self.dtype, up=self.kind == "normal", mirrored=mirrored)

    def _stored(self, values: Float) -> NDArray:
        alpha, associated = self.texture.alpha, self.texture.associated
        if alpha >= 0 and self.mixes and not associated:
            colours = [k for k in range(self.channels) if k != alpha]
            values[:, colours] /= np.where(values[:, alpha] != 0, values[:, alpha], 1)[:, None]
        if self.srgb and self.dtype == np.uint8 and not associated:
            out = np.empty(values.shape, np.uint8)
            _encode(values, alpha, *_steps(), out)
            return out
        return colour.encode(values[None], self.dtype, alpha, srgb=self.srgb, associated=associated)[0]


@cache
def _steps() -> tuple[Real, NDArray[np.uint8]]:
    """Linear values at which sRGB bytes 0 .. 255 begin (and infinity), and the byte where each of FINE cells starts."""
    edges = colour.linear_from_srgb((np.arange(256) - 0.5) / 255)
    start = np.searchsorted(edges, np.arange(FINE + 1) / FINE, side="right") - 1
    return np.append(edges, np.inf), start.astype(np.uint8)


@njit(cache=True, nogil=True)
def _encode(values, alpha, edges, start, out):
    """As `colour.encode` to sRGB bytes, by looking up instead of raising to powers."""
    for i in range(values.shape[0]):
        for channel in range(values.shape[1]):
            v = values[i, channel]
            v = min(v, 1.0) if v > 0 else 0.0  # NaN too
            if channel == alpha:
                out[i, channel] = np.uint8(np.rint(v * 255))
                continue
            code = np.int64(start[int(v * FINE)])
            while v >= edges[code + 1]:
                code += 1
            out[i, channel] = code


def _read(tex: filters.Pyramid, xy: Real, turn: Real, kind: int, out: Float) -> None:
    """As `sampling.read_all`, with a short cut for magnified pixels under a cubic filter."""
    if kind != filters.CUBIC:
        filters.read_all(tex, xy, turn, kind, out)
        return
    left = _magnified(tex, xy, turn, out)
    if left.any():
        rest = np.empty((int(left.sum()), out.shape[1]), out.dtype)
        filters.read_all(tex, xy[left], turn[left], kind, rest)
        out[left] = rest


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def _catmull_rom(t):
    """Weights of the four texels around a place t past the second one."""
    return (
        ((-0.5 * t + 1) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1,
        ((-1.5 * t + 2) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    )
