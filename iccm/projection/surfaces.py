"""Simple surfaces on which a flat sheet lies: where its points are in space, and which of them face a camera.

A point of the sheet is s + it, in units of length: s to the right and t upwards, seen from outside, from the middle of
the surface's front. In space, x is to the right, y upwards and z to the front; the middle of the surface is the origin.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import shapely

from ..arrays import Complex, Real

CONTOUR_DEGREES = 1.0
"""A surface is used up to this angle from its contour, where it is seen edge-on and a map would have no inverse. The
strip beyond it has 1.5e-4 of the radius in the picture."""
POLE_DEGREES = 89.5
"""Latitude up to which a sheet on a sphere is used; at a pole, a whole edge of it would be one point."""
SEAM_SHARE = 4e-4
"""Relative to the radius: how far the ends of a sheet that goes all the way around stay from where they meet."""
SEAM_POINTS = 721  # of that line on a sphere
CAP_POINTS = 720  # of the contour of a sphere
CELL_DEGREES, CELL_POINTS = 7.5, 8
"""Size of the cells from which the visible part of a sheet on a sphere is joined, and points on each of their sides."""
CHART_GRID_SHARE = 1e-9
"""Relative to a sphere's radius: points of neighbouring cells that are closer than this are the same."""


class SheetSurface(Protocol):
    """A surface on which a sheet lies."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the sheet that covers all of it."""

    def place(self, sheet: Complex) -> Real:
        """Return (…, 3) the points in space of points of the sheet."""

    def facing(self, centre: Real, label: tuple[float, float]) -> shapely.Geometry:
        """Return the region of a chart of the surface in which a label faces a camera; it may be empty.

        Args:
            centre: (3,) of the camera.
            label: width and height of the label in the middle of the sheet.
        """

    def sheet(self, chart: Complex, centre: Real) -> Complex:
        """Return points of the sheet, for points of the chart for a camera. Most charts are the sheet itself."""

    @property
    def extremes(self) -> Real:
        """Points whose images enclose the image of the surface; shape (n, 3)."""


@dataclass(frozen=True)
class Flat:
    """A flat sheet that stands upright.

    Attributes:
        width, height: of the sheet.
    """

    width: float
    height: float

    @property
    def size(self) -> tuple[float, float]:
        """See `SheetSurface`."""
        return self.width, self.height

    def place(self, sheet: Complex) -> Real:
        """See `SheetSurface`."""
        return np.stack([sheet.real, sheet.imag, np.zeros(np.shape(sheet))], axis=-1)

    def facing(self, centre: Real, label: tuple[float, float]) -> shapely.Geometry:
        """See `SheetSurface`."""
        return rectangle(label) if centre[2] > 0 else shapely.Polygon()

    def sheet(self, chart: Complex, centre: Real) -> Complex:
        """See `SheetSurface`."""
        return chart

    @property
    def extremes(self) -> Real:
        """See `SheetSurface`."""
        return self.place(_corners(self.size))


@dataclass(frozen=True)
class Revolved:
    """A cylinder, or a frustum of a cone, whose axis is vertical.

    Horizontal lines of the sheet become circles about the axis; at half the height, widths are true.

    Attributes:
        top, bottom: radii.
        height: along the axis.
    """

    top: float
    bottom: float
    height: float

    @property
    def radius(self) -> float:
        """The radius at half the height."""
        return (self.top + self.bottom) / 2

    @property
    def slope(self) -> float:
        """By how much the radius grows with the height."""
        return (self.top - self.bottom) / self.height

    @property
    def size(self) -> tuple[float, float]:
        """See `SheetSurface`; the height is measured on the surface."""
        return 2 * np.pi * self.radius, float(np.hypot(self.height, self.top - self.bottom))

    def place(self, sheet: Complex) -> Real:
        """See `SheetSurface`."""
        angle, y = np.real(sheet) / self.radius, np.imag(sheet) * self.height / self.size[1]
        radius = self.radius + self.slope * y
        return np.stack([radius * np.sin(angle), y, radius * np.cos(angle)], axis=-1)

    def facing(self, centre: Real, label: tuple[float, float]) -> shapely.Geometry:
        """See `SheetSurface`. A tangent plane touches a cone along a line, so the contour consists of such lines."""
        away = float(np.hypot(centre[0], centre[2]))
        cosine = (self.radius + self.slope * centre[1]) / away if away else np.inf
        if cosine >= 1:
            return shapely.Polygon()
        half = np.pi if cosine <= -1 else np.arccos(cosine) - np.radians(CONTOUR_DEGREES)
        middle = np.arctan2(centre[0], centre[2])
        width, height = self.size
        whole = min(label[0], width - 2 * SEAM_SHARE * self.radius), label[1]
        strips = [
            shapely.box(
                self.radius * (middle + turn - half),
                -height / 2,
                self.radius * (middle + turn + half),
                height / 2,
            )
            for turn in 2 * np.pi * np.arange(-1, 2)
        ]
        return shapely.union_all(strips).intersection(rectangle(whole))

    def sheet(self, chart: Complex, centre: Real) -> Complex:
        """See `SheetSurface`."""
        return chart

    @property
    def extremes(self) -> Real:
        """See `SheetSurface`."""
        width, height = self.size
        along = np.linspace(-width / 2, width / 2, 721)
        return self.place(np.concatenate([along - 0.5j * height, along + 0.5j * height]))


@dataclass(frozen=True)
class Ball:
    """A sphere; s is measured along the equator and t along the meridians, as in a picture of the whole globe that is
    twice as wide as high.

    Attributes:
        radius: of the sphere.
    """

    radius: float

    @property
    def size(self) -> tuple[float, float]:
        """See `SheetSurface`."""
        return 2 * np.pi * self.radius, np.pi * self.radius

    def place(self, sheet: Complex) -> Real:
        """See `SheetSurface`."""
        longitude, latitude = np.real(sheet) / self.radius, np.imag(sheet) / self.radius
        across = np.cos(latitude)
        return self.radius * np.stack(
            [across * np.sin(longitude), np.sin(latitude), across * np.cos(longitude)], axis=-1
        )

    def facing(self, centre: Real, label: tuple[float, float]) -> shapely.Geometry:
        """See `SheetSurface`. The part that faces a camera is a cap, a disc of its chart."""
        away = float(np.linalg.norm(centre))
        if away <= self.radius:
            return shapely.Polygon()
        angle = np.arccos(self.radius / away) - np.radians(CONTOUR_DEGREES)
        turns = 2 * np.pi * np.arange(CAP_POINTS) / CAP_POINTS
        cap = shapely.Polygon(self.radius * angle * np.stack([np.cos(turns), np.sin(turns)], axis=1))
        width, height = (min(side, most) for side, most in zip(label, self._widest))
        # the label in small cells, so that none surrounds the point opposite to the camera, where the chart ends
        columns, rows = (np.linspace(-side / 2, side / 2, self._cells(side)) for side in (width, height))
        share = np.linspace(0, 1, CELL_POINTS, endpoint=False)
        s, t = columns[:-1, None], rows[None, :-1]
        wide, high = columns[1] - columns[0], rows[1] - rows[0]
        ring = np.concatenate([share * wide, wide + 1j * share * high, wide - share * wide + 1j * high])
        ring = np.append(ring, 1j * (high - share * high))
        cells = np.asarray((s + 1j * t).ravel()[:, None] + ring, np.complex128)
        points = self.place(cells) @ (centre / away) / self.radius
        facing = cells[(points > np.cos(angle)).any(axis=1)]
        if not len(facing):
            return shapely.Polygon()
        charted = self._charted(facing, centre)
        parts = shapely.polygons(np.stack([charted.real, charted.imag], axis=-1))
        region = shapely.union_all(parts, grid_size=CHART_GRID_SHARE * self.radius).intersection(cap)
        if width < self._widest[0]:
            return region
        latitudes = np.linspace(-np.pi / 2, np.pi / 2, SEAM_POINTS)
        seam = np.asarray(self.radius * (np.pi + 1j * latitudes), np.complex128)
        seam = seam[self.place(seam) @ (centre / away) > 0]  # no more of it than half a circle is seen
        if seam.size < 2:
            return region
        line = self._charted(seam, centre)
        gap = shapely.LineString(np.stack([line.real, line.imag], axis=1)).buffer(SEAM_SHARE * self.radius)
        return region.difference(gap)

    def sheet(self, chart: Complex, centre: Real) -> Complex:
        """See `SheetSurface`. The chart is azimuthal and equidistant, about the point that is nearest to the camera."""
        right, up, forward = self._axes(centre)
        angle, direction = np.abs(chart) / self.radius, np.exp(1j * np.angle(chart))
        aside = np.sin(angle)
        x, y, z = (
            aside * direction.real * right[k] + aside * direction.imag * up[k] + np.cos(angle) * forward[k]
            for k in range(3)
        )
        sheet: Complex = self.radius * (np.arctan2(x, z) + 1j * np.arcsin(np.clip(y, -1, 1)))
        return sheet

    def _charted(self, sheet: Complex, centre: Real) -> Complex:
        """Return points of the chart; the inverse of `sheet`."""
        right, up, forward = self._axes(centre)
        points = self.place(sheet) / self.radius
        direction = points @ right + 1j * (points @ up)
        away = self.radius * np.arccos(np.clip(points @ forward, -1, 1))
        return np.asarray(away * np.exp(1j * np.angle(direction)), np.complex128)

    @staticmethod
    def _axes(centre: Real) -> tuple[Real, Real, Real]:
        """Return unit vectors to the right, upwards, and to a camera."""
        forward = centre / np.linalg.norm(centre)
        right = np.cross(
            [0.0, 1.0, 0.0] if abs(forward[1]) < 0.9 else [0.0, 0.0, -np.sign(forward[1])], forward
        )
        right /= np.linalg.norm(right)
        return right, np.cross(forward, right), forward

    @property
    def _widest(self) -> tuple[float, float]:
        """Width and height of the largest sheet that is used."""
        width, height = self.size
        return width, height * POLE_DEGREES / 90

    def _cells(self, side: float) -> int:
        """Return the number of points between the cells of a side of the sheet."""
        return 1 + int(np.ceil(np.degrees(side / self.radius) / CELL_DEGREES))

    @property
    def extremes(self) -> Real:
        """See `SheetSurface`."""
        width, height = self.size
        s, t = np.meshgrid(np.linspace(-width / 2, width / 2, 181), np.linspace(-height / 2, height / 2, 91))
        return self.place((s + 1j * t).ravel())


def _corners(size: tuple[float, float]) -> Complex:
    half = complex(*size) / 2
    return np.array([-half, half.conjugate(), half, -half.conjugate()])


def rectangle(size: tuple[float, float]) -> shapely.Polygon:
    """Return a rectangle about the origin of a width and a height."""
    width, height = size
    return shapely.box(-width / 2, -height / 2, width / 2, height / 2)
