"""What a map shows of two drawings: the energy over what is seen, and the shares that are lost."""

from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Index, Real
from ..maps.distortion import Distortion
from ..meshes.stretch import linear
from ..plane import triangle_areas
from .cost import price
from .region import Region

SUBDIVISION = 3
"""Parts of a triangle's edge: each triangle is sampled in the middles of its SUBDIVISION² equal parts."""


class Seen(NamedTuple):
    """What a map shows of two drawings.

    Attributes:
        energy: mean balanced energy over what is seen, both drawings' seen areas taken as one; infinite where nothing
            is seen.
        hidden: share of the source drawing's painted area that is not seen.
        bare: share of the target drawing's painted area that shows nothing.
    """

    energy: float = np.inf
    hidden: float = 1.0
    bare: float = 1.0

    def cost(self, turning: float = 1.0) -> float:
        """Return the cost of the map; see `cost`."""
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
    subdivision: int = SUBDIVISION,
) -> Seen:
    """Measure what a piecewise linear map shows of two drawings.

    Parameters
    ----------
    z, u
        (n,) complex vertices and their images.
    faces
        (m, 3) triangles that fold neither there nor here.
    source, target
        The regions that both drawings paint.
    covering
        What of the source's plane the texture covers; None: all of it.
    theta
        Weight of areas in the energy.
    subdivision
        Parts of a triangle's edge; the accuracy of the shares is that of counting the parts' middles.
    """
    shares = shares_seen(z, u, faces, source, target, covering=covering, subdivision=subdivision)
    f_z, f_zbar = linear(z[faces], u[faces])
    areas = np.abs(triangle_areas(z[faces]))
    images = areas * (np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2)
    shown = float(areas @ shares.both)
    covered = float(images @ shares.textured)
    energy = np.inf
    if (images * shares.both > 0).any():
        before, after = areas * shares.both, images * shares.both
        scale = float(np.sqrt(after.sum() / before.sum()))
        density = Distortion(after, f_z, f_zbar, scale).energies(theta)["total"]
        # half the source's area and half the target's, as in the balanced energy
        weights = 0.5 * before / before.sum() + 0.5 * after / after.sum()
        energy = float(weights @ np.where(weights > 0, density, 0))
    return Seen(energy, max(0.0, 1 - shown / source.area), max(0.0, 1 - covered / target.area))


class Shares(NamedTuple):
    """How much of each triangle is seen.

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
    subdivision: int = SUBDIVISION,
) -> Shares:
    """Measure how much of each triangle is seen; arguments as for `seen`."""
    weights = middles(subdivision)
    samples = z[faces] @ weights.T
    from_source = source.contains(samples)
    in_target = target.contains(u[faces] @ weights.T)
    textured = in_target if covering is None else in_target & covering.contains(samples)
    return Shares((from_source & in_target).mean(axis=1), textured.mean(axis=1))


def middles(parts: int) -> Real:
    """Return the barycentric coordinates (parts², 3) of the middles of a triangle's equal parts."""
    found = []
    for i in range(parts):
        for j in range(parts - i):
            found.append((i + 1 / 3, j + 1 / 3))
            if j < parts - i - 1:
                found.append((i + 2 / 3, j + 2 / 3))
    first, second = np.array(found).T / parts
    return np.column_stack([first, second, 1 - first - second])
