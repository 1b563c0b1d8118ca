"""Check that a map is one-to-one with the very numbers that are returned: no folds, simple outlines."""

import numpy as np
import shapely

from ..arrays import Complex, Index, xy_of
from ..maps.triangulated.simple import fault
from ..plane import orientation
from .errors import NoMapError


def is_simple(loop: Complex) -> bool:
    """Return whether a closed polyline neither crosses nor touches itself."""
    ring = np.append(loop, loop[0])
    return bool(shapely.LinearRing(xy_of(ring)).is_simple)


def refuse_folds(name: str, w: Complex, faces: Index) -> None:
    """Raise NoMapError unless all triangles have positive area, by exact predicates on the given numbers.

    Args:
        name: of the side, for the message.
        w: (n,) vertices.
        faces: (m, 3) triangles.
    """
    if (orientation(*w[faces].T) <= 0).any():
        raise NoMapError(
            f"the {name} has triangles that have no area in double precision; move the shape closer to "
            "the origin or enlarge it"
        )


def refuse_touching(name: str, outer: Complex, *holes: Complex) -> None:
    """Raise NoMapError unless an outline and its holes are simple and disjoint, with the given numbers.

    Args:
        name: of the side, for the message.
        outer: the outline.
        *holes: its holes.
    """
    if not is_simple(outer) or (holes and fault([outer, *holes])):
        raise NoMapError(
            f"the outline of the {name} touches itself in double precision; widen the gap, or move the "
            "shape closer to the origin"
        )
