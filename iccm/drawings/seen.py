"""Measure a map of two drawings: its energy over the visible area, and the shares that are lost."""

from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Index, Real
from ..maps.distortion import Distortion
from ..meshes.stretch import linear
from ..plane import triangle_areas
from .cost import price
from .region import Region

EDGE_SUBDIVISIONS = 3
"""Subdivisions of a triangle's edge: each triangle is sampled at the centroids of EDGE_SUBDIVISIONS² equal parts."""


class Seen(NamedTuple):
    """Energy and losses of a map of two drawings.

    Attributes:
        energy: mean balanced energy over the visible area, with the visible area of both drawings scaled to one;
            infinite where nothing is visible.
        hidden: share of the source drawing's painted area that is not visible.
        bare: share of the target drawing's painted area that shows nothing.
    """

    energy: float = np.inf
    hidden: float = 1.0
    bare: float = 1.0

    def cost(self, turning: float = 1.0) -> float:
        """Return the cost of the map; see `drawings.cost`."""
        return price(self.energy, (self.hidden, self.bare), turning)


NOTHING_SEEN = Seen()


def seen(
    z: Complex,
    u: Complex,
    faces: Index,
    source: Region,
    target: Region,
    *,
    covering: Region | None,
    theta: float = 1.0,
    subdivision: int = EDGE_SUBDIVISIONS,
) -> Seen:
    """Measure the energy and losses of a piecewise linear map of two drawings.

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
    theta
        Weight of areas in the energy.
    subdivision
        Subdivisions of a triangle's edge; the shares are as accurate as counting the centroids of the parts.
    """
    shares = shares_seen(z, u, faces, source, target, covering=covering, subdivision=subdivision)
    f_z, f_zbar = linear(z[faces], u[faces])
    areas = np.abs(triangle_areas(z[faces]))
    images = areas * (np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2)
    seen_area = float(areas @ shares.both)
    covered = float(images @ shares.textured)
    energy = np.inf
    if (images * shares.both > 0).any():
        source_areas, image_areas = areas * shares.both, images * shares.both
        scale = float(np.sqrt(image_areas.sum() / source_areas.sum()))
        density = Distortion(image_areas, f_z, f_zbar, scale).energies(theta)["total"]
        # half the source's area and half the target's, as in the balanced energy
        weights = 0.5 * source_areas / source_areas.sum() + 0.5 * image_areas / image_areas.sum()
        energy = float(weights @ np.where(weights > 0, density, 0))
    return Seen(energy, max(0.0, 1 - seen_area / source.area), max(0.0, 1 - covered / target.area))


class Shares(NamedTuple):
    """Visible share of each triangle.

    Attributes:
        both: (m,) share that is painted in the source and in the target.
        textured: (m,) share that is painted in the target and covered by the texture.
    """

    both: Real
    textured: Real


def shares_seen(
    z: Complex,
    u: Complex,
    faces: Index,
    source: Region,
    target: Region,
    *,
    covering: Region | None,
    subdivision: int = EDGE_SUBDIVISIONS,
) -> Shares:
    """Measure the visible share of each triangle; arguments as for `seen`."""
    weights = middles(subdivision)
    samples = z[faces] @ weights.T
    from_source = source.contains(samples)
    in_target = target.contains(u[faces] @ weights.T)
    textured = in_target if covering is None else in_target & covering.contains(samples)
    return Shares((from_source & in_target).mean(axis=1), textured.mean(axis=1))


def middles(parts: int) -> Real:
    """Return barycentric coordinates (parts², 3) of the centroids of a triangle's equal parts."""
    points = []
    for i in range(parts):
        for j in range(parts - i):
            points.append((i + 1 / 3, j + 1 / 3))
            if j < parts - i - 1:
                points.append((i + 2 / 3, j + 2 / 3))
    first, second = np.array(points).T / parts
    return np.column_stack([first, second, 1 - first - second])
