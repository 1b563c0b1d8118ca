"""Exact signs of triangles and the simplicity of outlines, in the very numbers that are returned."""

from fractions import Fraction

import numpy as np
import shapely

from ..arrays import Complex, Flags, Index, xy_of
from ..maps.triangulated.simple import fault
from .errors import NoMapError

UNIT = 2.0**-53
FILTER = (
    3 + 16 * UNIT
) * UNIT  # Shewchuk 1997: error bound of the determinant, of the sum of its two products


def positive(z: Complex, faces: Index) -> Flags:
    """(m,) which triangles are counter-clockwise: by floating point where that is certain, else by fractions."""
    a, b, c = z[faces].T
    left = (b.real - a.real) * (c.imag - a.imag)
    right = (b.imag - a.imag) * (c.real - a.real)
    determinant = left - right
    signs = determinant > 0
    unsure = np.abs(determinant) <= FILTER * (np.abs(left) + np.abs(right))
    for t in np.flatnonzero(unsure):
        signs[t] = _exactly_positive(*z[faces[t]].tolist())
    return signs


def _exactly_positive(a: complex, b: complex, c: complex) -> bool:
    (ax, ay), (bx, by), (cx, cy) = ((Fraction(w.real), Fraction(w.imag)) for w in (a, b, c))
    return (bx - ax) * (cy - ay) > (by - ay) * (cx - ax)


def is_simple(loop: Complex) -> bool:
    """Whether a closed polyline neither crosses nor touches itself."""
    ring = np.append(loop, loop[0])
    return bool(shapely.LinearRing(xy_of(ring)).is_simple)


def refuse_folds(name: str, w: Complex, faces: Index) -> None:
    """Raises NoMapError unless all triangles are positive, in these very numbers."""
    if not positive(w, faces).all():
        raise NoMapError(
            f"the {name} has triangles without area in double precision; move the shape to the origin or enlarge it"
        )


def refuse_touching(name: str, outer: Complex, *holes: Complex) -> None:
    """Raises NoMapError unless an outline is simple, its holes too and inside it, in these very numbers."""
    if not is_simple(outer) or (holes and fault([outer, *holes])):
        raise NoMapError(f"the outline of the {name} touches itself in double precision")
