"""The map between two pictures of a sheet, which is known in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from ..arrays import Box, Complex, complex_of
from ..curve import Curve
from ..errors import InputError, naming
from ..maps.composition import ERROR_SHARE, composed
from ..maps.refinement import Triangulation
from ..result import Fit
from ..status import Status
from .surfaces import rectangle
from .view import Planar, View, label_size

FIRST_EDGE_SHARE = 1 / 24
"""Length of edges relative to the sheet's diagonal before they are split where the map bends: with longer ones, an edge
could meet the map by chance at both ends and in its middle."""
LEFT_OUT_SHARE = 0.01
"""Relative to the visible part of a sheet: a second part of it that is smaller is not reported."""


@dataclass(frozen=True)
class FlatView:
    """A flat picture, which is a sheet itself; a `View`.

    Attributes:
        box: lower left and upper right corner.
    """

    box: Box

    @property
    def label(self) -> tuple[float, float]:
        """See `View`."""
        extent = self.box[1] - self.box[0]
        return extent.real, extent.imag

    @property
    def size(self) -> tuple[float, float]:
        """See `View`."""
        return self.label

    def image(self, sheet: Complex) -> Complex:
        """See `View`."""
        return (self.box[0] + self.box[1]) / 2 + sheet

    def visible(self, label: tuple[float, float]) -> shapely.Geometry:
        """See `View`."""
        return rectangle(label)

    def sheet(self, chart: Complex) -> Complex:
        """See `View`."""
        return chart


def solve(source: View, target: View, names: tuple[str, str] = ("source", "target")) -> Fit:
    """Return the map that takes each point of a sheet from where it is in one picture to where it is in another.

    Args:
        source, target: Views of the sheet; a sheet without a given size gets the proportions of the other one, and is
            as large as its surface permits.
        names: Of both, for messages.

    Raises:
        InputError: Nothing of the sheet is seen in both pictures.
    """
    views = source, target
    sizes = [label_size(view, _aspect(partner)) for view, partner in zip(views, views[::-1])]
    visible = list[shapely.Geometry]()
    for view, size, name in zip(views, sizes, names):
        with naming(name):
            visible.append(view.visible(size))
    # the mesh is made in the chart of the side that is not flat, in which its triangles have a good shape
    base = 0 if isinstance(target, FlatView | Planar) else 1
    region, partner = visible[base], visible[1 - base]
    if not partner.equals(rectangle(sizes[1 - base])):
        region = region.intersection(_rescaled(partner, sizes[1 - base], sizes[base]))
    parts = sorted(
        (part for part in shapely.get_parts(region) if part.geom_type == "Polygon" and part.area > 0),
        key=lambda part: -part.area,
    )
    if not parts:
        raise InputError(f"{names[1]}: shows nothing of {names[0]}; change its turn or pitch")
    notes = []
    if region.area - parts[0].area > LEFT_OUT_SHARE * region.area:
        share = 1 - parts[0].area / region.area
        notes.append(
            f"both ends of the sheet are seen, and only the larger part is shown, without the other {share:.0%}; "
            "turn the object"
        )
    mesh = _meshed(complex_of(shapely.get_coordinates(orient(parts[0]).exterior)[:-1]))

    def image_in(number: int, chart: Complex) -> Complex:
        sheet, base_size, size = views[base].sheet(chart), sizes[base], sizes[number]
        return views[number].image(
            sheet.real * (size[0] / base_size[0]) + 1j * sheet.imag * (size[1] / base_size[1])
        )

    map, error = composed(
        mesh.z, mesh.faces, lambda chart: image_in(0, chart), lambda chart: image_in(1, chart)
    )
    if error > ERROR_SHARE:
        notes.append(f"the map is only accurate to {error:.1e} of the diagonal")
    outlines = [Curve(w[map.loops[0]]) for w in (map.source, map.image)]
    return Fit(map, Status.REACHED, [], outlines[0], outlines[1], np.empty((0, 2), complex), [], notes)


def _aspect(view: View) -> float | None:
    """Return width by height of a sheet; None if that of the other one decides."""
    return None if view.label is None else view.label[0] / view.label[1]


def _rescaled(
    region: shapely.Geometry, size: tuple[float, float], onto: tuple[float, float]
) -> shapely.Geometry:
    """Return a region of a sheet on a sheet of another size."""
    return shapely.transform(region, lambda xy: xy * np.divide(onto, size))


def _meshed(ring: Complex) -> Triangulation:
    """Return a triangulation of the inside of a polygon with edges of at most FIRST_EDGE_SHARE."""
    mesh = Triangulation.of(ring)
    longest = FIRST_EDGE_SHARE * Curve(ring).diagonal
    while (long := mesh.lengths > longest).any():
        mesh = mesh.refined(long)
    return mesh
