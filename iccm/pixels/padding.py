"""Colours beyond the outline, so that mip-maps and bilinear reads of the result do not pick up the background."""

import cv2
import numpy as np
from numpy.typing import NDArray


def pad(pixels: NDArray, known: NDArray[np.bool_], reach: int, method: str = "push-pull") -> None:
    """Fills unknown pixels from known ones, in place.

    Args:
        pixels: (h, w, c) of any type.
        known: (h, w) which of them hold a colour.
        reach: how many pixels to go, -1 for the whole picture.
        method: "push-pull" (smooth: averages of ever larger neighbourhoods) or "nearest" (the nearest known pixel).
    """
    if known.all() or not known.any() or reach == 0:
        return
    wanted = ~known
    if method == "nearest":
        _spread(pixels, known, wanted, reach)
        return
    if reach > 0:
        wanted &= cv2.distanceTransform(wanted.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE) <= reach
    for k in range(pixels.shape[2]):
        filled = _push_pull(pixels[..., k].astype(np.float32), known.astype(np.float32))[wanted]
        pixels[wanted, k] = np.rint(filled) if pixels.dtype.kind != "f" else filled


def _spread(pixels: NDArray, known: NDArray[np.bool_], wanted: NDArray[np.bool_], reach: int) -> None:
    """The colour of the nearest known pixel, by distances that are exact to a few hundredths of a pixel."""
    away, label = cv2.distanceTransformWithLabels(
        wanted.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    source = np.zeros(int(label.max()) + 1, np.int64)
    at = np.flatnonzero(known)
    source[label.ravel()[at]] = at
    fill = np.flatnonzero(wanted & ((away <= reach) | (reach < 0)))
    flat = pixels.reshape(-1, pixels.shape[2])
    flat[fill] = flat[source[label.ravel()[fill]]]
    if not np.may_share_memory(flat, pixels):  # of an array that is not contiguous it is a copy
        pixels[...] = flat.reshape(pixels.shape)


def _push_pull(value: NDArray, weight: NDArray) -> NDArray:
    """Gortler, Grzeszczuk, Szeliski, Cohen, *The Lumigraph* (1996), §3.4: averages down, interpolation back up."""
    h, w = value.shape
    if weight.min() >= 1 or max(h, w) == 1:
        return value
    size = (w + 1) // 2, (h + 1) // 2
    mass, sums = (
        cv2.resize(np.pad(a, [(0, h % 2), (0, w % 2)]), size, interpolation=cv2.INTER_AREA)
        for a in (weight, weight * value)
    )
    coarse = _push_pull(sums / np.where(mass > 0, mass, 1), np.minimum(4 * mass, 1))
    guess = cv2.resize(coarse, (2 * size[0], 2 * size[1]), interpolation=cv2.INTER_LINEAR)[:h, :w]
    return weight * value + (1 - weight) * guess
