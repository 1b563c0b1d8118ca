"""The sides from which two models are looked at together: the front, or above or below where both face up or down."""

from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Real
from .mesh import up_and_front
from .patch import Patch

LEAST_FACING_SHARE = 0.3
"""Of a surface's area, seen from above less what is seen from below: a surface that shows less has no such side."""


class Viewpoint(NamedTuple):
    """A direction from which a model is looked at.

    Attributes:
        up: (3,) unit vector that is up in the picture; right is the model's x.
        toward: (3,) unit vector towards the viewer.
    """

    up: Real
    toward: Real

    def plan(self, points: Real) -> Complex:
        """Return right + i up of points (k, 3)."""
        return points[:, 0] + 1j * (points @ self.up)


def views(source: Patch, target: Patch) -> tuple[Viewpoint, Viewpoint]:
    """Return the views of two models: from the front, unless both face up, as terrains and lids do, or both down.

    From above, the back of a model is up in the picture; from below, its front is.
    """
    sides = [_side(patch) for patch in (source, target)]
    side = sides[0] if sides[0] == sides[1] else 0
    first, second = (_view(patch, side) for patch in (source, target))
    return first, second


def _view(patch: Patch, side: int) -> Viewpoint:
    above, front = up_and_front(patch.mesh.up_axis)
    return Viewpoint(-side * front, side * above) if side else Viewpoint(above, front)


def _side(patch: Patch) -> int:
    """Return 1 for a surface that faces up rather than to its front, -1 for one that faces down, 0 for others."""
    a, b, c = np.moveaxis(patch.points[patch.faces], 1, 0)
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1).sum()
    axes = up_and_front(patch.mesh.up_axis)
    up, front = (float(normals.sum(axis=0) @ axis) / max(area, 1e-300) for axis in axes)
    return int(np.sign(up)) if abs(up) > max(LEAST_FACING_SHARE, abs(front)) else 0
