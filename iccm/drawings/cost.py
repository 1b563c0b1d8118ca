"""The one cost by which maps are compared, in words and as a function.

A map is better the less it distorts what is visible of the picture, the less of both shapes is lost, and the less it
rotates the picture:

    cost = ((1 - lost) · E + lost · LOST_POINT_ENERGY) · rotation

- E is the mean balanced energy over what is visible: the part of the source's painted area whose image lies in the
  target's painted area. It is 1 for a similarity.
- `lost` is half the share of the source that is hidden, because it lands in gaps of the target or is not mapped at all,
  plus half the share of the target that stays bare, because a gap that the texture does not cover lands there, or
  nothing at all.
- `rotation` is the factor for rotating the picture (`balanced.minimise.upright`): 1 if it is as upright as requested.

Pairs of frames, maps with filled concavities, symmetric maps and others, pairs of parts, maps with pins, and maps with
and without an earlier one are all compared by it. Coarse maps of the same outlines from different starts, which lose
the same parts, are compared by their energies.
"""

from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Index
from ..maps.distortion import Distortion
from ..meshes.stretch import linear
from ..plane import triangle_areas
from .region import PaintedRegion
from .visible import EDGE_SUBDIVISIONS, visible_shares

LOST_POINT_ENERGY = 5.05
"""Energy counted for a point without a partner: that of a map that stretches lengths ten times in one direction,
(10 + 1/10)/2. Pictures with K95 of 8 were judged usable, with 24 useless."""


class Cost(NamedTuple):
    """The cost of a map, with what it consists of.

    Attributes:
        energy: mean balanced energy over the visible area, with the visible area of both drawings scaled to one, at
            least 1; infinite where nothing is visible.
        hidden: share of the source drawing's painted area that is not visible.
        bare: share of the target drawing's painted area that shows nothing.
        rotation: the factor for rotating the picture, at least 1.
    """

    energy: float = np.inf
    hidden: float = 1.0
    bare: float = 1.0
    rotation: float = 1.0

    @property
    def total(self) -> float:
        """The cost, a number of at least 1; see the module for its meaning."""
        lost = min(1.0, 0.5 * (self.hidden + self.bare))
        visible_part = (1 - lost) * self.energy if lost < 1 else 0.0
        return float((visible_part + lost * LOST_POINT_ENERGY) * self.rotation)


NO_MAP = Cost(np.inf, 0.0, 0.0)
"""Where there is no map: costlier than any map."""


def cost_of(
    z: Complex,
    u: Complex,
    faces: Index,
    source: PaintedRegion,
    target: PaintedRegion,
    *,
    covering: PaintedRegion | None,
    balance: float = 1.0,
    rotation: float = 1.0,
    subdivision: int = EDGE_SUBDIVISIONS,
) -> Cost:
    """Return the cost of a piecewise linear map of two drawings.

    Parameters
    ----------
    z, u
        (n,) complex vertices and their images.
    faces
        (m, 3) triangles, which fold neither in the source nor in the target.
    source, target
        The painted regions of both drawings.
    covering
        The region of the source's plane that the texture covers; None if it covers everything.
    balance
        Weight of areas in the energy, θ.
    rotation
        The factor for rotating the picture.
    subdivision
        Subdivisions of a triangle's edge; the shares are as accurate as counting the centroids of the parts.
    """
    shares = visible_shares(z, u, faces, source, target, covering=covering, subdivision=subdivision)
    f_z, f_zbar = linear(z[faces], u[faces])
    areas = np.abs(triangle_areas(z[faces]))
    images = areas * (np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2)
    visible_area = float((areas * shares.both).sum())
    covered_area = float((images * shares.textured).sum())
    energy = np.inf
    if (images * shares.both > 0).any():
        source_areas, image_areas = areas * shares.both, images * shares.both
        scale = float(np.sqrt(image_areas.sum() / source_areas.sum()))
        density = Distortion(image_areas, f_z, f_zbar, scale).energies(balance)["total"]
        # half the source's area and half the target's, as in the balanced energy
        weights = 0.5 * source_areas / source_areas.sum() + 0.5 * image_areas / image_areas.sum()
        energy = float((weights * np.where(weights > 0, density, 0)).sum())
    hidden, bare = 1 - visible_area / source.area, 1 - covered_area / target.area
    return Cost(energy, max(0.0, hidden), max(0.0, bare), rotation)
