"""A map and its inverse as one object with the interface of scikit-image's transforms.

`skimage.transform.warp(picture, transform.inverse)` accepts transforms between outlines in pixels, x right and
y down.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Complex, Real
from .axes import UP, on_pairs

Function = Callable[[Complex], Complex]


@dataclass(frozen=True, eq=False)
class Transform:
    """A map from points of one plane to points of another, with its inverse.

    Attributes:
        forward: complex points of any shape to points of the same shape, NaN where there is no image.
        backward: the inverse, in the same form.
        axes: meaning of pairs on either side, see `iccm.axes`.

    >>> double = Transform(lambda z: 2 * z, lambda w: w / 2)
    >>> complex(double.then(double)(1 + 1j))
    (4+4j)
    >>> double.inverse([2.0, 6.0])
    array([1., 3.])
    """

    forward: Function
    backward: Function
    axes: tuple[str, str] = UP

    def __call__(self, points: ArrayLike) -> Complex | Real:
        """Return the images of complex points of any shape, or of pairs (…, 2), in the same form."""
        array = np.asarray(points)
        if np.iscomplexobj(array):
            return self.forward(array)
        if array.shape[-1:] != (2,):
            raise ValueError(
                f"points: have shape {array.shape}; pass complex numbers, or real numbers of shape (n, 2)"
            )
        return on_pairs(self.forward, array, self.axes)

    @property
    def inverse(self) -> "Transform":
        """The inverse transform."""
        return Transform(self.backward, self.forward, self.axes[::-1])

    def then(self, other: "Transform") -> "Transform":
        """Return the composition: this transform first, then `other`."""
        axes = self.axes[0], other.axes[1]
        return Transform(
            lambda z: other.forward(self.forward(z)), lambda w: self.backward(other.backward(w)), axes
        )
