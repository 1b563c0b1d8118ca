"""The meaning of pairs of numbers: x and y with y up or down, or rows and columns.

Complex numbers are always x + iy with y up.
"""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Complex, Real, xy_of
from .errors import InputError

Axes = Literal["xy", "screen", "image"]
AXES: dict[Axes, str] = {
    "xy": "pairs are x and y, y up",
    "screen": "pairs are x and y, y down: pixels as OpenCV and SVG count them",
    "image": "pairs are row and column, rows down: as NumPy and scikit-image index pixels",
}
"""Values of `axes` and their meaning."""
UP = ("xy", "xy")
"""The axes of both sides of a map if nothing else is known."""


def check(axes: str) -> None:
    """Raise an InputError for an unknown value of `axes`."""
    if axes not in AXES:
        raise InputError(f"axes: {axes!r} is not one of {', '.join(AXES)}")


def complex_in(pairs: ArrayLike, axes: str) -> Complex:
    """Return complex numbers (…), y up, from pairs (…, 2); the coordinates are exact except for their signs."""
    coordinates = np.asarray(pairs, np.float64)[..., :2]
    coordinates = coordinates[..., ::-1] if axes == "image" else coordinates
    z = np.ascontiguousarray(coordinates).view(np.complex128)[..., 0]
    return z if axes == "xy" else z.conj()


def pairs_in(z: Complex, axes: str) -> Real:
    """Return (…, 2) pairs in the given axes from complex numbers with y up."""
    pairs = xy_of(z if axes == "xy" else z.conj())
    return np.ascontiguousarray(pairs[..., ::-1]) if axes == "image" else pairs


def is_pairs(points: Any) -> bool:
    """Return whether points are pairs of real numbers, an array (…, 2); one pair is one point."""
    if isinstance(points, complex | float | int):
        return False
    try:
        array = np.asarray(points)
    except ValueError:  # lists of different lengths
        return False
    return array.dtype.kind in "iuf" and array.ndim > 0 and array.shape[-1] == 2


def on_pairs(function: Callable[[Complex], Complex], points: ArrayLike, axes: tuple[str, str]) -> Real:
    """Return (…, 2) the images of pairs under a function of complex numbers.

    Args:
        function: the function.
        points: (…, 2) pairs.
        axes: of the points and of their images.
    """
    return pairs_in(function(complex_in(points, axes[0])), axes[1])
