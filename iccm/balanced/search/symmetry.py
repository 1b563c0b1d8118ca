"""Pairs of mirror-symmetric shapes with a vertical axis: solve one half and mirror it."""

from dataclasses import dataclass

import numpy as np
import shapely

from ...arrays import Complex, complex_of
from ...curve import Curve
from ...symmetry import MOST_ASYMMETRY_SHARE, asymmetry
from ..model.mesh_map import MeshMap


@dataclass(frozen=True, eq=False)
class Half:
    """The right half of a mirror-symmetric domain.

    Attributes:
        curve: its boundary, counter-clockwise from the lower end of the axis, up the outline and down the axis.
        top: vertex of the upper end of the axis.
        axis: real part of the axis in the domain's coordinates; in those of the half it is 0.
        asymmetry: largest distance of the mirrored outline from the outline, relative to the diagonal.
    """

    curve: Curve
    top: int
    axis: float
    asymmetry: float


def half_of(curve: Curve) -> Half | None:
    """Return the right half of a domain.

    None if the domain is not symmetric, or its axis crosses the outline more than twice.
    """
    low, high = curve.box
    middle = 0.5 * (low.real + high.real)
    axis = min((middle, 0.0), key=lambda x: asymmetry(curve, x, 1j))  # the centroid is at 0
    worst = asymmetry(curve, axis, 1j)
    if worst > MOST_ASYMMETRY_SHARE:
        return None
    polygon = shapely.Polygon(np.column_stack([curve.z.real - axis, curve.z.imag]))
    right = polygon.intersection(shapely.box(0, low.imag - 1, high.real - low.real + 1, high.imag + 1))
    if right.geom_type != "Polygon" or len(right.interiors):
        return None
    ring = complex_of(shapely.get_coordinates(shapely.geometry.polygon.orient(right).exterior)[:-1])
    return _begun_at_axis(ring, axis, worst)


def _begun_at_axis(ring: Complex, axis: float, worst: float) -> Half | None:
    on = np.abs(ring.real) < 1e-9
    ring = np.where(on, 1j * ring.imag, ring)
    if np.count_nonzero(on) != 2:
        return None
    low, high = sorted(np.flatnonzero(on), key=lambda k: ring[k].imag)
    if (high + 1) % ring.size != low:
        return None
    curve = Curve(np.roll(ring, -low))
    return Half(curve, int((high - low) % ring.size), axis, worst)


def mirror(half: MeshMap, outline: int) -> MeshMap:
    """Return the map of the right half joined to its mirror image along the axis.

    Args:
        half: the map, whose boundary begins at the lower end of the axis.
        outline: number of boundary vertices from there to the upper end of the axis, both ends included.
    """
    n = half.z.size
    on_axis = np.zeros(n, bool)
    on_axis[[0, *range(outline - 1, half.border)]] = True
    # Vertices on the axis are their own partners; partners of the others come after all vertices of the half.
    partner = np.where(on_axis, np.arange(n), n + np.cumsum(~on_axis) - 1)
    z, u = (np.concatenate([w, -w[~on_axis].conj()]) for w in (half.z, half.u))
    faces = np.concatenate([half.faces, partner[half.faces][:, ::-1]])
    loop = np.concatenate([np.arange(outline), partner[np.arange(outline - 2, 0, -1)]])
    # The outline's vertices come first.
    order = np.concatenate([loop, np.setdiff1d(np.arange(z.size), loop)])
    place = np.empty(order.size, np.int64)
    place[order] = np.arange(order.size)
    weights = None if half.weights is None else np.tile(half.weights, 2)
    return MeshMap.plain(z[order], u[order], place[faces], loop.size, filled=half.filled, weights=weights)
