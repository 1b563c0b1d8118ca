"""A map and its inverse as one thing that is called, turned round and composed, as scikit-image has transforms.

`skimage.transform.warp(picture, transform.inverse)` takes one between outlines given in pixels, x right and y down.
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
    """Points of one plane to points of another.

    Attributes:
        forward: complex points of any shape to points of the same shape, NaN where there is no image.
        backward: the other way.
        axes: what pairs mean on either side, see `iccm.axes`.

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
        """Return the images of complex points of any shape, or of real ones (…, 2): in the same form."""
        given = np.asarray(points)
        if np.iscomplexobj(given):
            return self.forward(given)
        if given.shape[-1:] != (2,):
            raise ValueError(
                f"points: have shape {given.shape}; pass complex numbers, or real numbers of shape (n, 2)"
            )
        return on_pairs(self.forward, given, self.axes)

    @property
    def inverse(self) -> "Transform":
        """The way back."""
        return Transform(self.backward, self.forward, self.axes[::-1])

    def then(self, other: "Transform") -> "Transform":
        """Return this one first, the other on what it gives."""
        axes = self.axes[0], other.axes[1]
        return Transform(
            lambda z: other.forward(self.forward(z)), lambda w: self.backward(other.backward(w)), axes
        )
