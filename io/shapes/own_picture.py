"""Pictures as textures of the silhouettes that they show: their pixels without the background."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import naming
from ..pictures import image_files
from ..pictures.image_files import Image
from ..spec import Spec
from .silhouette import Reading, handed, interpret, opaque_part, part_of, straight_colours

FAINT_COVERAGE = 0.05  # coverage below which the colour cannot be separated from the background's


def read(spec: Spec, trace: str = "auto", *, anew: bool = False, **options: Any) -> Image:
    """Read a picture as the texture of the silhouette that it shows.

    The object is opaque, and the background transparent. At the edge, where pixels mix both, the background's share is
    removed from the colour. Pictures with alpha, and photographs, are unchanged.

    Args:
        spec: the picture and its selected part.
        trace: as for `silhouette.read`.
        anew: whether to decode it again even if it is still in memory from reading the shape.
        options: as for `image_files.read`.

    Raises:
        InputError: it is not a picture, or nothing stands out from the background.
    """
    part = part_of(spec.selection)
    handed_over = handed.take(Path(spec.path), trace, part)
    as_asked = not anew and not options.get("colorspace")
    if handed_over and as_asked and _pixels(handed_over[0]) <= options.get("max_pixels", np.inf):
        image, reading = handed_over
    else:
        image = image_files.read(spec.path, **options)
        with naming(spec.path):
            reading = interpret(image.pixels, image.alpha, trace, part)
    if reading.kind in ("rectangle", "alpha"):
        return image
    return _cut_out(image, reading)


def _pixels(image: Image) -> int:
    height, width = image.pixels.shape[:2]
    return int(height * width)


def _cut_out(image: Image, reading: Reading) -> Image:
    """Return the picture with an alpha channel: the share of each pixel that the object covers."""
    height, width = image.pixels.shape[:2]
    alpha = opaque_part(reading, (height, width))
    colours = straight_colours(image.pixels, image.alpha)
    if reading.kind == "plain":
        colours = _unmix(colours, alpha)
    largest = np.iinfo(image.pixels.dtype).max if image.pixels.dtype.kind == "u" else 1
    cut_out = np.concatenate([colours, alpha[..., None]], axis=2) * np.float32(largest)
    if image.pixels.dtype.kind == "u":
        cut_out = np.rint(cut_out)
    return replace(
        image,
        pixels=cut_out.astype(image.pixels.dtype),
        alpha=cut_out.shape[2] - 1,
        associated=False,
        metadata={name: value for name, value in image.metadata.items() if name != "channels"},
    )


def _unmix(colours: NDArray[np.float32], alpha: NDArray[np.float32]) -> NDArray[np.float32]:
    """Remove the background from mixed pixels: solve c = a s + (1 - a) b for s.

    This uses the stored encoding, in which drawing programs antialias edges. (Linear light would be exact for
    photographs.)
    """
    border = np.concatenate([colours[0], colours[-1], colours[:, 0], colours[:, -1]])
    background = np.median(border, axis=0)
    mixed = (alpha > FAINT_COVERAGE) & (alpha < 1)
    out, share = colours.copy(), alpha[mixed][:, None]
    out[mixed] = np.clip((colours[mixed] - (1 - share) * background) / share, 0, 1)
    return out
