"""Carries a texture through a map: the inverse at every pixel, filtered by its Jacobian, smooth at the outline."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import colour, sampling
from .canvas import Band, Box, Canvas, Diagnostics, Raster
from .errors import InputError
from .evaluate import Evaluator
from .harmonic import HarmonicMap
from .inverse import Inverse
from .parallel import over_slices

__all__ = ["Box", "Canvas", "Texture", "Warp", "Warped", "warp"]

ROWS = 64


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
    map: HarmonicMap | Evaluator | Inverse,
    texture: Texture,
    canvas: Canvas,
    *,
    filter: str = "auto",
    kind: str = "colour",
    edge: str = "clamp",
    antialias: bool = True,
    padding: int = 0,
    max_error: float = 0.05,
    threads: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> Warped:
    """The texture seen through the map.

    Args:
        map: source → target.
        texture: placed in the source's plane.
        canvas: the raster to make, in the target's plane.
        filter: "nearest", "linear", "cubic" (Catmull-Rom), "lanczos", or "auto" (cubic).
        kind: "colour" (filtered in linear light, premultiplied) or "data" (numbers, filtered as they are).
        edge: outside the texture's box its edge is repeated ("clamp") or nothing is there ("transparent").
        antialias: whether alpha holds the coverage of outline pixels; else it is all or nothing.
        padding: pixels to extend the colours beyond the outline (alpha stays), -1 for all.
        max_error: of the texture coordinates, in texels.
        threads: as many as there are processors by default; the result does not depend on it.
        progress: called with the number of rows done.

    Returns:
        Pixels of the texture's type; an alpha channel is appended when the texture has none.

    Raises:
        InputError: an unknown filter, kind or edge.
    """
    job = Warp(map, texture, canvas, filter, kind, edge, antialias, max_error, threads)
    out = np.zeros((canvas.height, canvas.width, job.channels), dtype=texture.pixels.dtype)
    for row, block in job.bands():
        out[row : row + len(block)] = block
        if progress:
            progress(len(block))
    return Warped(out, job.alpha, job.raster.diagnostics)


class Warp:
    """A warp made ready: everything that is not one band's own. Arguments as in `warp`."""

    def __init__(self, map, texture, canvas, filter, kind, edge, antialias, max_error, threads):
        for given, known, what in (
            (filter, ("auto", *sampling.FILTERS), "filter"),
            (kind, ("colour", "data"), "kind"),
            (edge, ("clamp", "transparent"), "edge"),
            (texture.transfer, ("srgb", "linear"), "transfer"),
        ):
            if given not in known:
                raise InputError(f"{what} {given!r}: not one of {', '.join(known)}")
        name = "cubic" if filter == "auto" else filter
        self.filter = sampling.FILTERS[name]
        self.texture, self.canvas, self.antialias, self.threads = texture, canvas, antialias, threads
        self.srgb = texture.transfer == "srgb" and kind == "colour" and name != "nearest"
        self.mixes = kind == "colour" and name != "nearest"
        self.channels = texture.pixels.shape[2] + (texture.alpha < 0)
        self.alpha = texture.alpha if texture.alpha >= 0 else self.channels - 1
        inverse = map if isinstance(map, Inverse) else Inverse(map, 2 * min(canvas.step))
        self.raster = Raster(inverse, canvas, threads)
        picture = colour.decode(
            texture.pixels,
            texture.alpha,
            srgb=self.srgb,
            associated=texture.associated,
            premultiply=self.mixes,
        )
        border = sampling.CLAMP if edge == "clamp" else sampling.CLEAR
        self.pyramid = sampling.pyramid(picture, border, 1 if name == "nearest" else 16)

    def bands(self) -> Iterator[tuple[int, NDArray]]:
        """(first row, (rows, W, c) finished pixels) from top to bottom."""
        for row in range(0, self.canvas.height, ROWS):
            band = self.raster.band(row, min(ROWS, self.canvas.height - row))
            yield row, self._finish(band, self._filtered(band))

    def _filtered(self, band: Band) -> NDArray[np.float32]:
        """(p, c) linear values of the band's pixels."""
        lo, hi = self.texture.box
        h, w = self.texture.pixels.shape[:2]
        sx, sy = w / (hi - lo).real, h / (hi - lo).imag
        dx, dy = self.canvas.step
        xy = np.column_stack([(band.z.real - lo.real) * sx, (hi.imag - band.z.imag) * sy])
        right, down = (band.z_w + band.z_wbar) * dx, -1j * (band.z_w - band.z_wbar) * dy
        turn = np.column_stack([right.real * sx, down.real * sx, -right.imag * sy, -down.imag * sy])
        out = np.empty((band.at.size, self.pyramid.texels.shape[1]), dtype=np.float32)
        over_slices(
            lambda part: sampling.read_all(self.pyramid, xy[part], turn[part], self.filter, out[part]),
            band.at.size,
            self.threads,
        )
        return out

    def _finish(self, band: Band, values: NDArray[np.float32]) -> NDArray:
        """Stored pixels: unpremultiplied, covered, encoded; zero where nothing is."""
        cover = band.coverage.ravel()[band.at]
        if not self.antialias:
            cover = (cover >= 0.5).astype(np.float32)
        if self.texture.alpha < 0:
            values = np.column_stack([values, cover])
        else:
            alpha = values[:, self.alpha].copy()
            colours = [k for k in range(self.channels) if k != self.alpha]
            if self.mixes and not self.texture.associated:
                values[:, colours] /= np.where(alpha != 0, alpha, 1)[:, None]
            values[:, self.alpha] = alpha * cover
        if self.texture.associated:
            colours = [k for k in range(self.channels) if k != self.alpha]
            values[:, colours] *= cover[:, None]
        out = np.zeros((band.coverage.size, self.channels), dtype=self.texture.pixels.dtype)
        out[band.at] = colour.encode(values[None], out.dtype, self.alpha, srgb=self.srgb)[0]
        return out.reshape(*band.coverage.shape, self.channels)
