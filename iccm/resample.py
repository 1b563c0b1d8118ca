"""Carries a texture through a map: the inverse at every pixel, filtered by its Jacobian, smooth at the outline."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import colour, sampling, tiles
from .canvas import Band, Box, Canvas, Diagnostics, Raster
from .errors import InputError
from .evaluate import Evaluator
from .harmonic import HarmonicMap
from .inverse import Inverse
from .padding import pad
from .parallel import in_order
from .stmap import Stored

__all__ = ["Box", "Canvas", "Texture", "Warp", "Warped", "warp"]


CHUNK = 1 << 17  # pixels that are filtered at a time
LARGE = 1 << 27  # numbers in a texture from which it is not turned into floats


@dataclass(frozen=True, eq=False)
class Texture:
    """Pixels with their placement in the plane.

    Attributes:
        pixels: (h, w, c) uint8, uint16, float16 or float32, row 0 on top.
        box: lower left and upper right corner of the picture, in the source's plane.
        alpha: index of the alpha channel, or -1.
        transfer: "srgb" or "linear", how the colour channels are encoded.
        associated: whether they are premultiplied by alpha.
    """

    pixels: NDArray
    box: Box
    alpha: int = -1
    transfer: str = "srgb"
    associated: bool = False


@dataclass(frozen=True, eq=False)
class Warped:
    """A warped picture: (H, W, c) pixels of the texture's type, the index of its alpha channel, and what happened."""

    pixels: NDArray
    alpha: int
    diagnostics: Diagnostics


def warp(
    map: HarmonicMap | Evaluator | Inverse | Stored,
    texture: Texture,
    canvas: Canvas,
    *,
    filter: str = "auto",
    kind: str = "colour",
    edge: str = "clamp",
    antialias: bool = True,
    padding: int = 0,
    fill: str = "push-pull",
    max_error: float = 0.05,
    threads: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> Warped:
    """The texture seen through the map.

    Args:
        map: source → target, or a stored one.
        texture: placed in the source's plane; a stored map's `box` is where it goes.
        canvas: the raster to make, in the target's plane; the stored map's own.
        filter: "nearest", "linear", "cubic" (Catmull-Rom), "lanczos", "spline" (quintic, for smooth pictures that are
            enlarged; cubic where they are shrunk), or "auto" (cubic).
        kind: "colour" (filtered in linear light, premultiplied), "data" (numbers, filtered as they are), or "normal"
            and "normal-down" (tangent-space normals with y up or down, turned with the map and renormalised).
        edge: outside the texture's box its edge is repeated ("clamp") or nothing is there ("transparent").
        antialias: whether alpha holds the coverage of outline pixels; else it is all or nothing.
        padding: pixels to extend the colours beyond the outline (alpha stays), -1 for all. Needs straight alpha.
        fill: how, "push-pull" (smooth) or "nearest".
        max_error: of the texture coordinates, in texels.
        threads: as many as there are processors by default; the result does not depend on it.
        progress: called with the number of rows done.

    Returns:
        Pixels of the texture's type; an alpha channel is appended when the texture has none.

    Raises:
        InputError: an unknown filter, kind or edge; normals without three channels; padding of associated alpha.
    """
    job = Warp(map, texture, canvas, filter, kind, edge, antialias, max_error)
    out = np.zeros((canvas.height, canvas.width, job.channels), dtype=texture.pixels.dtype)
    row = 0
    for block in job.blocks(threads):
        out[row : row + len(block)] = block
        row += len(block)
        if progress:
            progress(len(block))
    if padding:
        out = _padded(out, job.alpha, texture, padding, fill)
    return Warped(out, job.alpha, job.diagnostics)


def _padded(pixels: NDArray, alpha: int, texture: Texture, reach: int, fill: str) -> NDArray:
    if texture.associated:
        raise InputError(
            "padding: the texture's alpha is associated, so nothing can be stored where it is zero"
        )
    if fill not in ("push-pull", "nearest"):
        raise InputError(f"fill {fill!r}: not one of push-pull, nearest")
    colours = [k for k in range(pixels.shape[2]) if k != alpha]
    out = pixels.copy()
    out[..., colours] = pad(pixels[..., colours], pixels[..., alpha] > 0, reach, fill)
    return out


class Warp:
    """A warp made ready: everything that is not one band's own. Arguments as in `warp`."""

    def __init__(self, map, texture, canvas, filter, kind, edge, antialias, max_error):
        for given, known, what in (
            (filter, ("auto", *sampling.FILTERS), "filter"),
            (kind, ("colour", "data", "normal", "normal-down"), "kind"),
            (edge, ("clamp", "transparent"), "edge"),
            (texture.transfer, ("srgb", "linear"), "transfer"),
        ):
            if given not in known:
                raise InputError(f"{what} {given!r}: not one of {', '.join(known)}")
        if kind.startswith("normal") and texture.pixels.shape[2] < 3:
            raise InputError(
                f"kind {kind!r}: the picture has {texture.pixels.shape[2]} channels; normals need 3"
            )
        self.kind = kind
        name = "cubic" if filter == "auto" else filter
        self.filter = sampling.FILTERS[name]
        self.texture, self.canvas, self.antialias = texture, canvas, antialias
        self.srgb = texture.transfer == "srgb" and kind == "colour" and name != "nearest"
        self.mixes = kind == "colour" and name != "nearest"
        self.channels = texture.pixels.shape[2] + (texture.alpha < 0)
        self.alpha = texture.alpha if texture.alpha >= 0 else self.channels - 1
        self.diagnostics = Diagnostics()
        self.raster = map
        if not isinstance(map, Stored):
            inverse = map if isinstance(map, Inverse) else Inverse(map, 2 * min(canvas.step))
            self.raster = Raster(inverse, canvas, max_error * min(1 / s for s in self.scale))
        self.pyramid = self._prepared(sampling.CLAMP if edge == "clamp" else sampling.CLEAR)

    def _prepared(self, edge: int) -> sampling.Pyramid:
        """The texture for the filter: decoded, or as it is stored when that would take too much memory."""
        pixels, alpha = self.texture.pixels, self.texture.alpha
        if pixels.size > LARGE and pixels.dtype.kind == "u" and not self.texture.associated:
            decode = colour.tables(pixels.dtype, pixels.shape[2], alpha, srgb=self.srgb)
            return sampling.compact(pixels, decode, alpha if self.mixes else -1, edge, self.filter)
        picture = colour.decode(
            pixels,
            alpha,
            srgb=self.srgb,
            associated=self.texture.associated,
            premultiply=self.mixes or self.texture.associated,
        )
        return sampling.pyramid(picture, edge, self.filter)

    @property
    def scale(self) -> tuple[float, float]:
        """Texels a unit of the source's plane, across and down."""
        size = self.texture.box[1] - self.texture.box[0]
        return self.texture.pixels.shape[1] / size.real, self.texture.pixels.shape[0] / size.imag

    def blocks(self, threads: int | None = None) -> Iterator[NDArray]:
        """(rows, W, c) finished pixels from top to bottom."""

        def finished(row: int) -> tuple[NDArray, Diagnostics]:
            band = self.raster.band(row)
            return self._finish(band), band.diagnostics

        for block, seen in in_order(finished, range(0, self.canvas.height, tiles.TILE), threads):
            self.diagnostics.add(seen)
            yield block

    def _finish(self, band: Band) -> NDArray:
        """Stored pixels of a band; zero where nothing is."""
        at = np.flatnonzero(band.coverage)
        out = np.zeros((band.coverage.size, self.channels), dtype=self.texture.pixels.dtype)
        for first in range(0, at.size, CHUNK):
            part = at[first : first + CHUNK]
            out[part] = self._stored(self._filtered(band, part), band.coverage.ravel()[part])
        return out.reshape(*band.coverage.shape, self.channels)

    def _stored(self, values: NDArray[np.float32], cover: NDArray[np.float32]) -> NDArray:
        """(p, c) filtered values unpremultiplied, covered and encoded."""
        if not self.antialias:
            cover = (cover >= 0.5).astype(np.float32)
        colours = [k for k in range(self.channels) if k != self.alpha]
        if self.texture.alpha < 0:
            values = np.column_stack([values, cover])
        else:
            alpha = values[:, self.alpha].copy()
            if self.mixes and not self.texture.associated:
                values[:, colours] /= np.where(alpha != 0, alpha, 1)[:, None]
            values[:, self.alpha] = alpha * cover
        if self.texture.associated:
            values[:, colours] *= cover[:, None]
        dtype, associated = self.texture.pixels.dtype, self.texture.associated
        return colour.encode(values[None], dtype, self.alpha, srgb=self.srgb, associated=associated)[0]

    def _filtered(self, band: Band, at: NDArray[np.intp]) -> NDArray[np.float32]:
        """(p, c) linear values of the band's pixels numbered `at`."""
        (sx, sy), (low, high) = self.scale, self.texture.box
        z, right, down = (a.ravel()[at] for a in (band.z, band.right, band.down))
        xy = np.column_stack([(z.real - low.real) * sx, (high.imag - z.imag) * sy])
        turn = np.column_stack([right.real * sx, down.real * sx, -right.imag * sy, -down.imag * sy])
        out = np.empty((at.size, self.pyramid.texels.shape[1]), dtype=np.float32)
        sampling.read_all(self.pyramid, xy, turn, self.filter, out)
        if self.kind.startswith("normal"):
            dx, dy = self.canvas.step
            inverse = right / dx + 1j * down / dy  # along the inverse's derivative: the map's angle, negated
            turn = np.where(inverse != 0, inverse, 1).conj()
            out[:, :3] = turned(out[:, :3], turn, self.texture.pixels.dtype, up=self.kind == "normal")
        return out


def turned(stored: NDArray[np.float32], turn: NDArray, dtype: np.dtype, *, up: bool) -> NDArray[np.float32]:
    """Normals (p, 3), stored as 0..1, turned in the plane by the angle of `turn` (p,) and made unit again.

    In integers the middle value, 128 of 255, is exactly zero, so that a flat surface stays flat.
    """
    top = 1.0 if dtype.kind == "f" else float(np.iinfo(dtype).max)
    middle, span = (0.5, 0.5) if top == 1 else ((top + 1) / 2 / top, (top - 1) / 2 / top)
    n = (stored - middle) / span
    flat = (n[:, 0] + 1j * (n[:, 1] if up else -n[:, 1])) * turn / np.abs(turn)
    n[:, 0], n[:, 1] = flat.real, flat.imag if up else -flat.imag
    length = np.linalg.norm(n, axis=1, keepdims=True)
    return (n / np.where(length > 0, length, 1) * span + middle).astype(np.float32)
