"""Fields of positive numbers over the plane, from pictures: weights of distortion, and desired scales."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Box, Complex, Index, Real
from ..errors import InputError


@dataclass(frozen=True, eq=False)
class Field:
    """Positive numbers at the centres of a box's pixels, interpolated linearly, and constant beyond.

    Attributes:
        values: (h, w), row 0 on top.
        box: lower left and upper right corner, x + iy, y up.

    >>> field = Field.of([[1, 3]], (0, 2 + 1j), 1.0, "sizes")
    >>> field(np.array([0.5 + 0.5j, 1 + 0.2j, 9 + 9j])).tolist()
    [1.0, 2.0, 3.0]
    """

    values: Real
    box: Box

    @classmethod
    def of(cls, numbers: ArrayLike, box: Box, least: float, name: str) -> "Field":
        """Return the field of numbers (h, w); those below the share `least` of the largest are raised to it.

        Args:
            numbers: the numbers, row 0 on top.
            box: lower left and upper right corner.
            least: least value relative to the largest.
            name: name of the argument in messages.

        Raises:
            InputError: not an array (h, w), or values that are not finite, negative, or all zero.
        """
        try:
            values = np.asarray(numbers, float)
        except (TypeError, ValueError):
            values = np.empty(0)
        if values.ndim != 2 or not values.size:
            raise InputError(f"{name}: not a two-dimensional array of numbers (h, w)")
        if not np.isfinite(values).all() or values.min() < 0:
            raise InputError(f"{name}: contains numbers that are negative or not finite")
        if not values.max() > 0:
            raise InputError(f"{name}: is zero everywhere")
        return cls(np.maximum(values, least * values.max()), box)

    def __call__(self, z: Complex) -> Real:
        """Return the interpolated numbers at points of any shape."""
        height, width = self.values.shape
        y, x = (
            np.clip(coordinate - 0.5, 0, most - 1)
            for coordinate, most in zip(self._in_pixels(z), (height, width))
        )
        i, j = np.minimum(y.astype(int), max(height - 2, 0)), np.minimum(x.astype(int), max(width - 2, 0))
        below, right = np.minimum(i + 1, height - 1), np.minimum(j + 1, width - 1)
        s, t = x - j, y - i
        v = self.values
        upper, lower = (1 - s) * v[i, j] + s * v[i, right], (1 - s) * v[below, j] + s * v[below, right]
        return np.asarray((1 - t) * upper + t * lower)

    def pixels(self, z: Complex) -> tuple[Index, Index]:
        """Return the rows and columns of the pixels that contain points of any shape, or are closest to them."""
        i, j = (
            np.clip(coordinate, 0, most - 1)
            for coordinate, most in zip(self._in_pixels(z), self.values.shape)
        )
        return i.astype(int), j.astype(int)

    def _in_pixels(self, z: Complex) -> tuple[Real, Real]:
        """Return the distances of points, in pixels, below the upper edge and to the right of the left edge."""
        (low, high), (height, width) = self.box, self.values.shape
        size = high - low
        return (high.imag - z.imag) / size.imag * height, (z.real - low.real) / size.real * width
