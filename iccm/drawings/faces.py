"""Faces in photos: people see every bend of them, so they count more than other detail, and are hardly bent.

They are found by scikit-image's cascade of local binary patterns (Liao et al., "Learning multi-scale block local binary
patterns for face recognition", 2007), which finds upright frontal faces.
"""

import os

import numpy as np
from scipy import ndimage

from ..arrays import Box, Real
from ..errors import InputError

LONGER_SIDE_PIXELS = 180
"""Of the copy in which faces are sought, which takes less than a tenth of a second."""
LEAST_FACE_PIXELS = 24
"""Size of the smallest face: that of the cascade. Faces below an eighth of the picture's longer side are not found."""
SIZE_RATIO = 1.2
"""Of two sizes at which faces are sought, one after the other."""
AROUND_FACE_RATIO = 1.5
"""Of the region that counts as a face to the cascade's square, which reaches from the brows to the chin: the head."""
ABOVE_FACE_SHARE = 0.15
"""Relative to the square: how much higher the head's middle is."""


def faces_of(pixels: Real, box: Box, *, required: bool = False) -> list[Box]:
    """Find the faces in a picture.

    Parameters
    ----------
    pixels
        (h, w, 3) colours from 0 to 1, in the encoding in which they are shown, row 0 on top.
    box
        Lower left and upper right corner of its place in the plane.
    required
        Whether to raise an error if the file of the cascade is missing; else no faces are found then.

    Returns
    -------
        The box of each face in the plane.

    Raises
    ------
    InputError
        The file of the cascade is missing.

    Examples
    --------
    >>> faces_of(np.zeros((60, 40, 3)), (0j, 40 + 60j))
    []
    """
    from skimage.data import lbp_frontal_face_cascade_filename
    from skimage.feature import Cascade

    name = lbp_frontal_face_cascade_filename()
    if not os.path.isfile(name):
        if required:
            raise InputError(f"{name}: missing, so faces cannot be found; install scikit-image again")
        return []
    small = _reduced(np.asarray(pixels, dtype=np.float32))
    height, width = small.shape[:2]
    if min(height, width) < LEAST_FACE_PIXELS:
        return []
    found = Cascade(name).detect_multi_scale(
        img=np.rint(255 * np.clip(small, 0, 1)).astype(np.uint8),
        scale_factor=SIZE_RATIO,
        step_ratio=1,
        min_size=(LEAST_FACE_PIXELS, LEAST_FACE_PIXELS),
        max_size=(height, width),
    )
    low, high = box
    step = complex((high - low).real / width, (high - low).imag / height)
    faces = []
    for face in found:
        middle = complex(
            low.real + (face["c"] + face["width"] / 2) * step.real,
            high.imag - (face["r"] + (0.5 - ABOVE_FACE_SHARE) * face["height"]) * step.imag,
        )
        half = AROUND_FACE_RATIO / 2 * complex(face["width"] * step.real, face["height"] * step.imag)
        faces.append((middle - half, middle + half))
    return faces


def _reduced(pixels: Real) -> Real:
    """Return a picture with at most LONGER_SIDE_PIXELS on its longer side, smoothed against aliasing."""
    ratio = LONGER_SIDE_PIXELS / max(pixels.shape[:2])
    if ratio >= 1:
        return pixels
    sigma = (1 / ratio - 1) / 2
    smooth = ndimage.gaussian_filter(pixels, (sigma, sigma, 0))
    return ndimage.zoom(smooth, (ratio, ratio, 1), order=1, grid_mode=True, mode="nearest")
