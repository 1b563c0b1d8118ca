"""A map and its inverse as one object with the interface of scikit-image's transforms.

`skimage.transform.warp(picture, transform.inverse)` accepts transforms between outlines in pixels, x right and
y down.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import overload

from .arrays import Complex, Numbers, Pairs, Real, as_points
from .axes import UP, is_pairs, on_pairs
from .errors import InputError

Function = Callable[[Complex], Complex]


@dataclass(frozen=True, eq=False)
class Transform:
    """A map from points of one plane to points of another, with its inverse.

    Attributes:
        forward: complex points of any shape to points of the same shape, NaN where there is no image.
        backward: the inverse, in the same form.
        axes: meaning of pairs on either side, see `iccm.axes`.

    >>> import iccm
    >>> double = iccm.Transform(lambda z: 2 * z, lambda w: w / 2)
    >>> complex(double.then(double)(1 + 1j))
    (4+4j)
    >>> double.inverse([2.0, 6.0])
    array([1., 3.])
    """

    forward: Function
    backward: Function
    axes: tuple[str, str] = UP

    @overload
    def __call__(self, points: Pairs) -> Real: ...

    @overload
    def __call__(self, points: complex) -> complex: ...

    @overload
    def __call__(self, points: Numbers) -> Complex: ...

    def __call__(self, points: Pairs | complex | Numbers) -> Complex | Real | complex:
        """Return the images of complex points of any shape, or of pairs (…, 2), in the same form.

        Raises:
            InputError: neither complex numbers nor pairs.
        """
        if is_pairs(points):
            return on_pairs(self.forward, points, self.axes)
        return self.forward(as_points(points))[()]

    @property
    def inverse(self) -> "Transform":
        """The inverse transform."""
        return Transform(self.backward, self.forward, self.axes[::-1])

    def then(self, other: "Transform") -> "Transform":
        """Return the composition: this transform first, then `other`.

        Raises:
            InputError: `other` is not a transform.
        """
        if not isinstance(other, Transform):
            raise InputError(f"then: takes a map, not an object of type {type(other).__name__}")
        axes = self.axes[0], other.axes[1]
        return Transform(
            lambda z: other.forward(self.forward(z)), lambda w: self.backward(other.backward(w)), axes
        )
