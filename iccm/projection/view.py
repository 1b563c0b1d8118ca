"""Views: flat sheets as they are seen in a picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import shapely

from ..arrays import Complex, Real
from ..errors import InputError
from .camera import Camera
from .surfaces import SheetSurface, rectangle


class View(Protocol):
    """A sheet as it is seen in a picture.

    Attributes:
        label: width and height of the sheet; None if it may be as large as the surface below it.
        size: the largest width and height of the sheet.
    """

    @property
    def label(self) -> tuple[float, float] | None:
        """See above."""

    @property
    def size(self) -> tuple[float, float]:
        """See above."""

    def image(self, sheet: Complex) -> Complex:
        """Return the points of the picture, y up, at which points of the sheet are seen.

        The sheet's points are counted from its middle, to the right and upwards.
        """

    def visible(self, label: tuple[float, float]) -> shapely.Geometry:
        """Return the region of a chart in which a sheet of a size is seen.

        Raises:
            InputError: nothing of it is.
        """

    def sheet(self, chart: Complex) -> Complex:
        """Return points of the sheet for points of the chart, in which it is triangulated."""


@dataclass(frozen=True, eq=False)
class Projected:
    """A sheet on a surface that a camera sees; see `View`."""

    surface: SheetSurface
    camera: Camera
    label: tuple[float, float] | None = None

    @property
    def size(self) -> tuple[float, float]:
        """See `View`."""
        return self.surface.size

    def image(self, sheet: Complex) -> Complex:
        """See `View`."""
        return self.camera.image(self.surface.place(np.asarray(sheet)))

    def visible(self, label: tuple[float, float]) -> shapely.Geometry:
        """See `View`."""
        if self.camera.depth(self.surface.extremes).min() <= 0:
            raise InputError("reaches behind the camera; choose a larger distance")
        region = self.surface.facing(self.camera.centre, label)
        if region.is_empty:
            raise InputError("is not seen from its front; change its turn or pitch")
        return region

    def sheet(self, chart: Complex) -> Complex:
        """See `View`."""
        return self.surface.sheet(chart, self.camera.centre)


@dataclass(frozen=True, eq=False)
class Planar:
    """A flat sheet in perspective, given by the images of its corners.

    Attributes:
        corners: (4,) top left, top right, bottom right, bottom left, in the picture with y up.
        label: width and height of the sheet, or of any sheet with its proportions.
    """

    corners: Complex
    label: tuple[float, float]

    @property
    def size(self) -> tuple[float, float]:
        """See `View`."""
        return self.label

    @property
    def matrix(self) -> Real:
        """(3, 3) the homography from the unit square, y down, to the picture (Heckbert, *Fundamentals of texture
        mapping and image warping*, 1989, section 2.2.3)."""
        p = self.corners
        total, side, opposite = p[0] - p[1] + p[2] - p[3], p[1] - p[2], p[3] - p[2]
        across = (side.conjugate() * opposite).imag
        g = (total.conjugate() * opposite).imag / across
        h = (side.conjugate() * total).imag / across
        a, b = p[1] - p[0] + g * p[1], p[3] - p[0] + h * p[3]
        return np.array([[a.real, b.real, p[0].real], [a.imag, b.imag, p[0].imag], [g, h, 1]])

    def image(self, sheet: Complex) -> Complex:
        """See `View`."""
        width, height = self.label
        sheet = np.asarray(sheet)
        u, v = sheet.real / width + 0.5, 0.5 - sheet.imag / height
        x, y, w = np.einsum("ij,j...->i...", self.matrix, np.stack([u, v, np.ones_like(u)]))
        return (x + 1j * y) / w

    def visible(self, label: tuple[float, float]) -> shapely.Geometry:
        """See `View`."""
        return rectangle(label)

    def sheet(self, chart: Complex) -> Complex:
        """See `View`."""
        return chart


def label_size(view: View, aspect: float | None) -> tuple[float, float]:
    """Return width and height of the sheet: its own, or the largest with an aspect ratio, width by height.

    Without an aspect ratio, it covers the whole surface.
    """
    if view.label is not None:
        return view.label
    width, height = view.size
    if aspect is None:
        return width, height
    return min(width, height * aspect), min(height, width / aspect)
