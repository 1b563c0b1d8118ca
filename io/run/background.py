"""The target's own drawing, photo or text, shown behind the result (`--background target`)."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ...pixels.preimages import Unchanged
from ...pixels.sampler import Sampler
from ...pixels.warp import Canvas, Warp, whole
from .. import formats
from ..artwork import is_drawn, rendering, svg_data
from ..artwork.element import SVG
from ..artwork.embedded import LINK, address_of
from ..pictures.image import Image, convert, unassociate

if TYPE_CHECKING:
    from ..shapes.shape import Shape
    from .state import Run

PICTURES = formats.holding("picture")


def has_own_picture(target: Shape) -> bool:
    """Return whether a target's file shows something: a drawing, a photo, or a text in a font."""
    if target.is_mesh or target.is_layout:
        return False
    return is_drawn(target.path) or formats.suffix_of(target.path) in PICTURES


def element_of(run: Run) -> Element:
    """Return what the target's file shows as an element of an SVG in the target's units.

    Raises:
        InputError: the file cannot be read.
    """
    target = run.target
    if is_drawn(target.path):
        return rendering.drawn(svg_data(target))
    image = _photo(run)
    low, high = target.box
    sides = zip(("x", "y", "width", "height"), (low.real, -high.imag, *_extent(high - low)))
    was_jpeg = formats.suffix_of(target.path) in (".jpg", ".jpeg")
    attributes = {name: f"{value:.9g}" for name, value in sides} | {"preserveAspectRatio": "none"}
    return Element(f"{SVG}image", attributes | {LINK: address_of(image, was_jpeg=was_jpeg)})


class Background:
    """What the target's file shows on a canvas, to be seen behind pixels of the result.

    Args:
        run: the state of a job.
        canvas: the raster of the result.

    Raises:
        InputError: the file cannot be read.
    """

    def __init__(self, run: Run, canvas: Canvas):
        self._like = run.image
        size = canvas.width, canvas.height
        if is_drawn(run.target.path):
            shown = rendering.render_data(svg_data(run.target), run.target.path, canvas.box, size)
        else:
            photo = _photo(run)
            sampler = Sampler(photo.texture(run.target.box), memory=run.room, threads=run.threads)
            warped = whole(Warp(Unchanged(run.target.box), sampler, canvas), threads=run.threads)
            shown = unassociate(photo.with_pixels(warped.pixels, warped.alpha))
        shown = convert(shown, run.image.colorspace, run.image.pixels.dtype)
        self._pixels = _coloured(shown).pixels

    def behind(self, block: NDArray, alpha: int, row: int) -> Image:
        """Return rows of the result, beginning with `row`, in front of the background; colours are not premultiplied.

        Colours are mixed in the stored encoding, as drawing programs do.
        """
        result = _coloured(unassociate(self._like.with_pixels(block, alpha)))
        below = self._pixels[row : row + len(block)]
        largest = np.iinfo(below.dtype).max if below.dtype.kind == "u" else 1
        own, other = (pixels[..., 3:].astype(np.float32) / largest for pixels in (result.pixels, below))
        other = other * (1 - own)
        opacity = own + other
        mixed = own * result.pixels[..., :3] + other * below[..., :3]
        mixed /= np.where(opacity > 0, opacity, 1)
        pixels = np.concatenate([mixed, opacity * largest], axis=2)
        if below.dtype.kind == "u":
            np.rint(pixels, out=pixels)
        return result.with_pixels(pixels.astype(below.dtype), 3)


def _photo(run: Run) -> Image:
    from ..pictures import image_files

    return image_files.read(run.target.path, max_pixels=run.job.max_pixels, room=run.room)


def _coloured(image: Image) -> Image:
    """Return a picture with alpha as one of three colours and alpha, which comes last."""
    colours = [k for k in range(image.pixels.shape[2]) if k != image.alpha]
    order = [*(colours if len(colours) == 3 else colours[:1] * 3), image.alpha]
    return image.with_pixels(image.pixels[..., order], 3)


def _extent(size: complex) -> tuple[float, float]:
    return size.real, size.imag
