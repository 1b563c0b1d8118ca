"""Signs without doubt: a filter in floating point, fractions where it cannot tell.

Shewchuk, *Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates*, Discrete & Computational
Geometry 18, 1997, §4.3.
"""

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ...arrays import Complex

Signs = NDArray[np.int8]
UNIT = 2.0**-53  # unit roundoff
FILTER = (
    3 + 16 * UNIT
) * UNIT  # Shewchuk's bound for (a - c) × (b - c), relative to the sum of the two products
TINY = 1e-250  # below this products may underflow, which the bound leaves out


def orientation(a: Complex, b: Complex, c: Complex) -> Signs:
    """Whether points a, b, c (p,) turn left (1), right (-1) or lie on a line (0). All must be finite."""
    u, v = a - c, b - c
    left, right = u.real * v.imag, u.imag * v.real
    value, size = left - right, np.abs(left) + np.abs(right)
    sign = np.sign(value).astype(np.int8)
    for k in np.flatnonzero(~((np.abs(value) > FILTER * size) & (size > TINY))):
        sign[k] = _exact_orientation(a[k], b[k], c[k])
    return sign


def _exact_orientation(a: complex, b: complex, c: complex) -> int:
    (ax, ay), (bx, by), (cx, cy) = ((Fraction(float(p.real)), Fraction(float(p.imag))) for p in (a, b, c))
    value = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return (value > 0) - (value < 0)
