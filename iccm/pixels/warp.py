"""Warp a texture by a map: the inverse at every pixel, filtered by its Jacobian, antialiased at the outline."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import progress
from ..arrays import Box, Complex
from ..errors import InputError
from ..parallel import in_order
from . import preimages
from .canvas import BAND_ROWS, Band, Canvas, Diagnostics
from .preimages import AnyMap
from .sampler import SLICE_POINTS, Sampler, put
from .texture import Placing, Texture, TexturePlaces

__all__ = ["Box", "Canvas", "Sampler", "Texture", "Warp", "Warped", "padded", "warp", "whole"]

ACROSS = SLICE_POINTS // BAND_ROWS  # columns of a band that are filtered at a time
BYTES_PER_PIXEL, BYTES_PER_SAMPLE = 96, 1024
"""Working memory in bytes per pixel of a band, and per pixel that is being filtered (sum of the arrays)."""


def band_bytes(width: int) -> int:
    """Return the working memory in bytes with which a thread makes a band of a picture."""
    return width * BAND_ROWS * BYTES_PER_PIXEL + SLICE_POINTS * BYTES_PER_SAMPLE


def whole_bytes(height: int, width: int, channels: int, itemsize: int) -> int:
    """Return the working memory in bytes of `whole` with padding."""
    return height * width * (4 * channels * itemsize + 32)


@dataclass(frozen=True, eq=False)
class Warped:
    """A warped picture: (H, W, c) pixels of the texture's type, index of the alpha channel, and counts of pixels."""

    pixels: NDArray
    alpha: int
    diagnostics: Diagnostics


def warp(
    map: AnyMap,
    texture: Texture,
    canvas: Canvas,
    *,
    filter: str = "auto",
    kind: str = "colour",
    edge: str = "clamp",
    placing: Placing | None = None,
    antialias: bool = True,
    padding: int = 0,
    fill: str = "push-pull",
    max_error: float = 0.05,
    threads: int | None = None,
) -> Warped:
    """Warp a texture by a map.

    Args:
        map: source → target, or a stored map.
        texture: placed in the source's plane; for a stored map, in its `box`.
        canvas: the raster of the result, in the target's plane; for a stored map, its own raster.
        filter, kind, edge: as for `Sampler`.
        placing: as for `Warp`.
        antialias: whether alpha is the coverage of pixels; otherwise it is all or nothing.
        padding: pixels by which colours are extended beyond the outline (alpha is kept), -1 for all. Needs straight
            alpha.
        fill: method of padding, "push-pull" (smooth) or "nearest".
        max_error: of the texture coordinates, in texels.
        threads: number of threads, by default that of processors; it does not affect the result.

    Returns:
        Pixels of the texture's type; an alpha channel is appended if the texture has none.

    Raises:
        InputError: an unknown filter, kind or edge; normals without three channels; padding of associated alpha.
    """
    sampler = Sampler(texture, filter, kind, edge, threads=threads)
    job = Warp(map, sampler, canvas, placing=placing, antialias=antialias, max_error=max_error)
    return whole(job, padding=padding, fill=fill, threads=threads)


def whole(
    job: "Warp",
    *,
    padding: int = 0,
    fill: str = "push-pull",
    threads: int | None = None,
) -> Warped:
    """Return all pixels of a warp at once; arguments as for `warp`."""
    out = np.zeros((job.canvas.height, job.canvas.width, job.channels), dtype=job.dtype)
    row = 0
    for block in job.blocks(threads):
        out[row : row + len(block)] = block
        row += len(block)
    if padding:
        if job.sampler.texture.associated:
            raise InputError(
                "padding: the texture's alpha is associated (premultiplied), so no colour can be stored "
                "where alpha is zero"
            )
        out = padded(out, job.alpha, padding, fill)
    return Warped(out, job.alpha, job.diagnostics)


def padded(pixels: NDArray, alpha: int, reach: int, fill: str) -> NDArray:
    """Return (h, w, c) straight pixels with colours extended to where the channel `alpha` is 0; see `warp`."""
    if fill not in ("push-pull", "nearest"):
        raise InputError(f"fill {fill!r}: must be push-pull or nearest")
    from .padding import pad

    colours = [k for k in range(pixels.shape[2]) if k != alpha]
    out, extended = pixels.copy(), pixels[..., colours]
    pad(extended, pixels[..., alpha] > 0, reach, fill)
    out[..., colours] = extended
    return out


class Warp:
    """A warp that is computed in bands of rows.

    Args:
        map: source → target, of any kind; or an STMap.
        sampler: the texture.
        canvas, antialias, max_error: as in `warp`.
        placing: places points of the source's plane in the texture, if the texture is not in this plane.
    """

    def __init__(
        self,
        map: AnyMap,
        sampler: Sampler,
        canvas: Canvas,
        *,
        placing: Placing | None = None,
        antialias: bool = True,
        max_error: float = 0.05,
    ):
        texture = sampler.texture
        self.sampler, self.canvas, self.antialias, self.dtype = sampler, canvas, antialias, sampler.dtype
        self.placing: Placing = placing or texture
        self.channels = sampler.channels + (texture.alpha < 0)
        self.alpha = texture.alpha if texture.alpha >= 0 else sampler.channels
        self.diagnostics = Diagnostics()
        # The scale is infinite if a transform shrinks the texture to a point; then an error of a pixel does not matter.
        largest = abs(complex(*canvas.step))
        scale = max(*self.placing.scale, max_error / largest)
        self.preimages = preimages.of(map, canvas, max_error / scale)

    def blocks(self, threads: int | None = None) -> Iterator[NDArray]:
        """Yield (rows, W, c) finished pixels from top to bottom."""

        def finished(row: int) -> tuple[NDArray, Diagnostics]:
            band = self.preimages(row)
            return self._finish(band), band.diagnostics

        bytes_per_band, purpose = band_bytes(self.canvas.width), f"rows of {self.canvas.width} pixels"
        threads = self.sampler.memory.threads(threads, bytes_per_band, purpose)
        rows = range(0, self.canvas.height, BAND_ROWS)
        for row, (block, diagnostics) in zip(rows, in_order(finished, rows, threads)):
            progress.tell("resample", row, self.canvas.height)
            self.diagnostics.add(diagnostics)
            yield block

    def _finish(self, band: Band) -> NDArray:
        """Return the stored pixels of a band; zero where nothing is covered."""
        out = np.zeros((*band.coverage.shape, self.channels), dtype=self.dtype)
        simple = self.sampler.paints and self.placing is self.sampler.texture
        paint = self.sampler.paint if simple and self.antialias and band.mixed is None else self._put
        width = out.shape[1]
        for first in range(
            0, width, ACROSS
        ):  # square blocks read a compact part of the texture in any orientation
            paint(band, (first, min(first + ACROSS, width)), out)
            self.sampler.memory.release()
        return out

    def _put(self, band: Band, columns: tuple[int, int], out: NDArray) -> None:
        """Write the pixels of some columns of a band, for all kinds of textures."""
        cover = band.coverage[:, slice(*columns)]
        i, j = np.nonzero(cover)
        part, share = i * out.shape[1] + columns[0] + j, cover[i, j]
        if not self.antialias:
            share = (share >= 0.5).astype(np.float32)
        put(out.reshape(-1, self.channels), part, self.sampler.stored(self._values(band, part), share))

    def _values(self, band: Band, pixels: NDArray[np.intp]) -> NDArray:
        """Return the filtered values of those pixels of the band whose flat indices are `pixels`.

        Pixels that show two source points are mixed, if values of this kind can be mixed.
        """
        z, right, down = band.z.ravel()[pixels], band.right.ravel()[pixels], band.down.ravel()[pixels]
        values = self.sampler.values(self._places(z, right, down))
        if band.mixed is None or not (self.sampler.mixes and self.antialias):
            return values
        _, positions, mixed_index = np.intersect1d(
            pixels, band.mixed.pixels, assume_unique=True, return_indices=True
        )
        if positions.size:
            also = band.mixed
            second_values = self.sampler.values(
                self._places(also.z[mixed_index], also.right[mixed_index], also.down[mixed_index])
            )
            values[positions] += also.share[mixed_index, None] * (second_values - values[positions])
        return values

    def _places(self, z: Complex, right: NDArray[np.complex64], down: NDArray[np.complex64]) -> TexturePlaces:
        """Return the places of source points in the texture; normals are rotated by the map's angle."""
        places = self.placing.places(z, right, down)
        if not self.sampler.kind.startswith("normal"):
            return places
        dx, dy = self.canvas.step
        along = right / dx + 1j * down / dy  # the inverse's derivative: the map's angle, negated
        rotated = self.placing.places(z, along, -1j * along)
        return places._replace(right=rotated.right, down=rotated.down)
