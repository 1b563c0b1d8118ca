"""Places in a mesh's own texture of points of its flattening's plane."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Box, Complex, Real, xy_of
from ..pixels.texture import Places, repeat
from ..plane import cross
from .layout import turns
from .locate import Locator


@dataclass(frozen=True, eq=False)
class Surface:
    """Places in the texture of a mesh, whose flattening is the source's plane.

    Attributes:
        locator: of the flattening.
        corners: (m, 3, 2) texture coordinates of its triangles in texels, y down; beyond the texture it repeats.
        size: the texture's width and height in texels.
        tiled: whether it is of several tiles, which do not repeat.
    """

    locator: Locator
    corners: Real
    size: tuple[int, int]
    tiled: bool = False

    @property
    def scale(self) -> tuple[float, float]:
        """Texels a unit, across and down: the square root of the ratio of areas."""
        at = self.locator.flat[self.locator.faces]
        flat, own = (np.abs(turns(c)).sum() for c in (xy_of(at), self.corners))
        return (float(np.sqrt(own / flat)),) * 2

    def places(self, z: Complex, right: NDArray, down: NDArray) -> Places:
        """As `Placing.places`."""
        triangle, weights = self.locator(z, 1)
        place = np.einsum("pk,pkc->pc", weights, self.corners[triangle])
        place = place if self.tiled else repeat(place, self.size)
        at = self.locator.flat[self.locator.faces[triangle]]
        e1, e2 = at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]
        area = cross(e1, e2)
        d1, d2 = (self.corners[triangle, k] - self.corners[triangle, 0] for k in (1, 2))
        turn = np.empty((z.size, 4))
        for k, step in enumerate((right, down)):
            s, t = cross(step, e2) / area, cross(e1, step) / area
            turn[:, k::2] = s[:, None] * d1 + t[:, None] * d2
        turned = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
        tangent = np.sign(turned) * (e1 * d2[:, 1] - e2 * d1[:, 1])  # where x grows and y does not
        steps = (step * tangent.conj() for step in (right, down))
        return Places(place, turn, *(np.where(turned > 0, step.conj(), step) for step in steps))

    @classmethod
    def of(cls, locator: Locator, uv: Real, size: tuple[int, int], tiles: Box | None = None) -> "Surface":
        """From (m, 3, 2) texture coordinates, v up; each triangle comes to where its middle is on the texture.

        With `tiles` the texture covers that box of the layout, and does not repeat.
        """
        return cls(locator, texels(uv, size, tiles), size, tiles is not None)


def texels(uv: Real, size: tuple[int, int], tiles: Box | None) -> Real:
    """(m, 3, 2) corners of triangles in texels, y down, of a picture that covers a box of the layout, or repeats."""
    corners = np.stack([uv[..., 0], 1 - uv[..., 1]], axis=-1)
    if tiles is None:
        return (corners - np.floor(corners.mean(axis=1, keepdims=True))) * size
    low, extent = tiles[0], tiles[1] - tiles[0]
    return (corners - (low.real, 1 - tiles[1].imag)) / (extent.real, extent.imag) * size
