"""Types of arrays, and conversions to them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]
Numbers = Sequence[complex] | NDArray[np.complexfloating[Any, Any]]
"""Points as complex numbers, of any shape; one number is a `complex`."""
Pairs = Sequence[float] | Sequence[Sequence[float]] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
"""Points as pairs of real numbers, (…, 2)."""
Box = tuple[complex, complex]
"""Lower left and upper right corner, x + iy."""


def as_complex(z: ArrayLike | Sequence, name: str, columns: int = 0) -> Complex:
    """Convert complex numbers, or real ones with a last axis of x and y, to an (n,) or (n, columns) complex array.

    Args:
        z: the numbers.
        name: name of the argument in messages.
        columns: number of columns; 0 for a one-dimensional array.

    Raises:
        InputError: not numbers, or another shape.
    """
    try:
        array = np.asarray(z)
        if array.dtype.kind in "iuf" and array.ndim == 2 + bool(columns) and array.shape[-1] == 2:
            array = np.ascontiguousarray(array, np.float64).view(np.complex128)[..., 0]
        z = np.asarray(array, dtype=np.complex128)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name}: cannot be read as an array of complex numbers x + iy ({error})") from error
    if z.ndim != 1 + bool(columns) or (columns and z.shape[1] != columns):
        expected = f"(n, {columns})" if columns else "(n,)"
        raise InputError(
            f"{name}: wrong shape {z.shape}; give {expected} complex numbers x + iy, or pairs of x and y"
        )
    return z


def as_points(z: ArrayLike) -> Complex:
    """Convert complex points of any shape to an array.

    Raises:
        InputError: not numbers, or real numbers in several dimensions, which would be mistaken for points on the
            real axis.
    """
    try:
        array = np.asarray(z)
        if array.dtype.kind not in "iufcb":
            raise ValueError("not numbers")
        points = np.asarray(array, dtype=np.complex128)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"points: cannot be read as complex numbers x + iy, or as pairs ({error})") from None
    if array.dtype.kind in "iuf" and array.ndim > 0 and array.size:
        raise InputError(
            f"points: real array of shape {array.shape}; pass complex numbers x + iy, or pairs where they are accepted"
        )
    return points


def xy_of(z: Complex) -> Real:
    """Return (..., 2) real and imaginary parts of complex numbers (...)."""
    return np.stack([z.real, z.imag], axis=-1)


def complex_of(xy: ArrayLike) -> Complex:
    """Return complex numbers (...) from pairs (..., 2) of real and imaginary parts."""
    pairs = np.asarray(xy, np.float64)
    return pairs[..., 0] + 1j * pairs[..., 1]


def unit_vectors(vectors: Real) -> Real:
    """Return vectors (..., d) divided by their lengths; vectors of length 0 stay 0.

    >>> unit_vectors(np.array([[3.0, 4.0], [0.0, 0.0]])).tolist()
    [[0.6, 0.8], [0.0, 0.0]]
    """
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def at_vertices(values: Real, faces: Index, count: int) -> Real:
    """Return (n,) means of the values (m,) of the triangles (m, 3) around each of `count` vertices."""
    corners = faces.ravel()
    means: Real = np.bincount(corners, np.repeat(values, 3), count) / np.bincount(corners, minlength=count)
    return means


def distinct(values: NDArray) -> NDArray:
    """Return the distinct values of an array, without NaN, in ascending order.

    This is `numpy.unique`, whose first call imports masked arrays, which small jobs do not need otherwise.

    >>> distinct(np.array([[3, 1], [3, 2]])).tolist()
    [1, 2, 3]
    """
    ordered = np.sort(values, axis=None)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])[: ordered.size]]


def is_among(values: NDArray, members: NDArray) -> Flags:
    """Return which of some values (n,) are among the members (k,), as `numpy.isin` does without masked arrays.

    >>> is_among(np.array([1j, 2.0]), np.array([2.0 + 0j])).tolist()
    [False, True]
    """
    known = set(members.tolist())
    return np.array([value in known for value in values.tolist()], bool)


def distinct_rows(rows: NDArray) -> tuple[Index, Index]:
    """Return the first occurrence of each distinct row of (n, k) in ascending order, and (n,) each row's group.

    This is `numpy.unique(axis=0)`, which takes five times as long, and blocks all threads meanwhile.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    begins = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))[: len(rows)]
    number = np.empty(len(rows), np.int64)
    number[order] = np.cumsum(begins) - 1
    return order[begins], number
