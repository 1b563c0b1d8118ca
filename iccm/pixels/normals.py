"""Tangent-space normals under a map: they are rotated and reflected with it."""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex


def rotate(
    stored: NDArray[np.float32],
    rotation: Complex,
    dtype: np.dtype,
    *,
    up: bool,
    mirrored: NDArray[np.bool_] | None = None,
) -> NDArray[np.float32]:
    """Rotate normals about z by the angle of a complex number, and normalize them.

    For integers the middle value, 128 of 255, is exactly zero, so that a flat surface stays flat.

    Args:
        stored: (p, 3) normals as 0..1.
        rotation: (p,) complex numbers with the angles; not zero.
        dtype: type of the picture before and after.
        up: whether y is stored upwards.
        mirrored: (p,) normals whose y is then negated.
    """
    top = 1.0 if dtype.kind == "f" else float(np.iinfo(dtype).max)
    middle, span = (0.5, 0.5) if top == 1 else ((top + 1) / 2 / top, (top - 1) / 2 / top)
    n = (stored - middle) / span
    flat = (n[:, 0] + 1j * (n[:, 1] if up else -n[:, 1])) * rotation / np.abs(rotation)
    if mirrored is not None:
        flat = np.where(mirrored, flat.conj(), flat)
    n[:, 0], n[:, 1] = flat.real, flat.imag if up else -flat.imag
    length = np.linalg.norm(n, axis=1, keepdims=True)
    return (n / np.where(length > 0, length, 1) * span + middle).astype(np.float32)
