"""Pictures for notebooks: PNG with 8 bits per channel."""

import io

import numpy as np
from numpy.typing import NDArray

LARGEST_SIDE_PIXELS = 640
"""Pixels of the longer side; larger pictures are subsampled, since a notebook stores what it shows."""


def png(pixels: NDArray) -> bytes:
    """Return a PNG of (h, w, c) pixels, integers or floats of 0..1; grey or RGB, with or without alpha."""
    from PIL import Image

    step = max(1, -(-max(pixels.shape[:2]) // LARGEST_SIDE_PIXELS))
    small = pixels[::step, ::step]
    if small.dtype.kind == "f":
        small = np.clip(np.nan_to_num(small.astype(np.float32)), 0, 1) * 255 + 0.5
    elif small.dtype == np.uint16:
        small = small // 257
    small = small.astype(np.uint8)
    target = io.BytesIO()
    Image.fromarray(small[..., 0] if small.shape[2] == 1 else small).save(target, "PNG")
    return target.getvalue()
