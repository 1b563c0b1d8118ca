"""Positions in a mesh's own texture of points in the plane of its flattening."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Box, Complex, Real, xy_of
from ..pixels.texture import REPEAT, TexturePlaces, Wrap, wrapped
from ..plane import cross
from .layout import doubled_areas
from .locate import Locator

# Number of tiles after which a wrapped picture repeats; 0 for never.
PERIOD = {"repeat": 1, "mirror": 2, "clamp": 0}


@dataclass(frozen=True, eq=False)
class Surface:
    """Positions in the texture of a mesh, whose flattening is the source's plane.

    Attributes:
        locator: of the flattening.
        corners: (m, 3, 2) texture coordinates of its triangles in texels, y down.
        size: the texture's width and height in texels.
        wrap: how the texture continues beyond its edges; None if it covers several tiles.
    """

    locator: Locator
    corners: Real
    size: tuple[int, int]
    wrap: Wrap | None = REPEAT

    @property
    def scale(self) -> tuple[float, float]:
        """Texels per unit of length, across and down: the square root of the ratio of areas."""
        corners = self.locator.flat[self.locator.faces]
        plane_area = np.abs(doubled_areas(xy_of(corners))).sum()
        texel_area = np.abs(doubled_areas(self.corners)).sum()
        return (float(np.sqrt(texel_area / plane_area)),) * 2

    def places(self, z: Complex, right: NDArray, down: NDArray) -> TexturePlaces:
        """Return the same as `Placing.places`."""
        triangle, weights = self.locator(z, 1)
        place = np.einsum("pk,pkc->pc", weights, self.corners[triangle])
        corners = self.locator.flat[self.locator.faces[triangle]]
        e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = cross(e1, e2)
        d1, d2 = (self.corners[triangle, k] - self.corners[triangle, 0] for k in (1, 2))
        jacobian = np.empty((z.size, 4))
        for k, step in enumerate((right, down)):
            s, t = cross(step, e2) / area, cross(e1, step) / area
            jacobian[:, k::2] = s[:, None] * d1 + t[:, None] * d2
        determinant = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
        # Direction in which x grows and y is constant.
        tangent = np.sign(determinant) * (e1 * d2[:, 1] - e2 * d1[:, 1])
        steps = (step * tangent.conj() for step in (right, down))
        places = TexturePlaces(
            place, jacobian, *(np.where(determinant > 0, step.conj(), step) for step in steps)
        )
        return places if self.wrap is None else wrapped(places, self.size, self.wrap)

    @classmethod
    def of(
        cls,
        locator: Locator,
        uv: Real,
        size: tuple[int, int],
        tiles: Box | None = None,
        wrap: Wrap = REPEAT,
    ) -> "Surface":
        """Create it from (m, 3, 2) texture coordinates, v up.

        With `tiles`, the texture covers only that box of the layout.
        """
        return cls(locator, texels(uv, size, tiles, wrap), size, wrap if tiles is None else None)


def texels(uv: Real, size: tuple[int, int], tiles: Box | None, wrap: Wrap = REPEAT) -> Real:
    """Return (m, 3, 2) corners of triangles in texels, y down, in a picture that covers a box of the layout.

    Without a box the picture covers 0..1 and is wrapped: each triangle is moved so that its centroid is on the
    picture.
    """
    corners = np.stack([uv[..., 0], 1 - uv[..., 1]], axis=-1)
    if tiles is None:
        period = np.array([PERIOD[how] for how in wrap])
        tile = np.floor(corners.mean(axis=1, keepdims=True) / np.maximum(period, 1))
        return (corners - period * tile) * size
    low, extent = tiles[0], tiles[1] - tiles[0]
    return (corners - (low.real, 1 - tiles[1].imag)) / (extent.real, extent.imag) * size
