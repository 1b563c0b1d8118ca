"""The types of arrays that all rooms share, and conversions to them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]
Box = tuple[complex, complex]
"""Lower left and upper right corner."""


def as_complex(z: ArrayLike | Sequence, name: str, columns: int = 0) -> Complex:
    """(n,) complex numbers, or (n, columns).

    Raises:
        InputError: no numbers, or another shape.
    """
    try:
        z = np.asarray(z, dtype=np.complex128)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: no array of complex numbers x + iy ({error})") from error
    if z.ndim != 1 + bool(columns) or (columns and z.shape[1] != columns):
        wanted = f"(n, {columns})" if columns else "(n,)"
        raise InputError(f"{name}: an array of shape {z.shape}; {wanted} complex numbers x + iy are needed")
    return z


def xy_of(z: Complex) -> Real:
    """(..., 2) real and imaginary parts of complex numbers."""
    return np.stack([z.real, z.imag], axis=-1)


def unique_rows(values: Real) -> tuple[Index, Index]:
    """The first (k,) of each of the different rows of (n, c) numbers, in order, and which of them each row is (n,).

    Sorting hashes takes a tenth of the time that sorting rows takes; rows of one hash are compared.
    """
    values = np.ascontiguousarray(values, dtype=np.float64) + 0.0  # -0.0 is 0.0
    mixed = np.zeros(len(values), np.uint64)
    for column in values.T:
        mixed = (mixed ^ column.copy().view(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    _, first, label = np.unique(mixed, return_index=True, return_inverse=True)
    if not np.array_equal(values[first][label], values):
        _, first, label = np.unique(values, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size)
    return first[order], rank[label.ravel()]
