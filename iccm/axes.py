"""What pairs of numbers mean: x and y with y up or down, or rows and columns; complex numbers are x + iy, y up."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Complex, Real, xy_of
from .errors import InputError

AXES = {
    "xy": "pairs are x and y, y up",
    "screen": "pairs are x and y, y down: pixels as OpenCV and SVG count them",
    "image": "pairs are row and column, rows down: as NumPy and scikit-image index pixels",
}
"""Values of `axes` and what they mean."""
UP = ("xy", "xy")
"""The axes of both sides of a map if nothing else is known."""


def check(axes: str) -> None:
    """Raise an InputError for axes that there are not."""
    if axes not in AXES:
        raise InputError(f"axes: {axes!r} is not one of {', '.join(AXES)}")


def complex_in(pairs: ArrayLike, axes: str) -> Complex:
    """Return (…) complex numbers, y up, of pairs (…, 2), bit for bit but for signs."""
    given = np.asarray(pairs, np.float64)[..., :2]
    given = given[..., ::-1] if axes == "image" else given
    z = np.ascontiguousarray(given).view(np.complex128)[..., 0]
    return z if axes == "xy" else z.conj()


def pairs_in(z: Complex, axes: str) -> Real:
    """Return (…, 2) pairs of complex numbers, y up."""
    pairs = xy_of(z if axes == "xy" else z.conj())
    return np.ascontiguousarray(pairs[..., ::-1]) if axes == "image" else pairs


def is_pairs(points: Any) -> bool:
    """Return whether points are pairs of real numbers (n, 2), (…, n, 2)."""
    given = np.asarray(points)
    return given.dtype.kind in "iuf" and given.ndim > 1 and given.shape[-1] == 2


def on_pairs(function: Callable[[Complex], Complex], points: ArrayLike, axes: tuple[str, str]) -> Real:
    """Return (…, 2) the images of pairs under a function of complex numbers, by the axes of its two sides."""
    return pairs_in(function(complex_in(points, axes[0])), axes[1])
