"""A drawing: everything that a file paints, as one region of the plane."""

from collections.abc import Sequence
from functools import cached_property

import shapely

from ..arrays import Complex, complex_of
from ..curve import Curve, polygon_of
from ..errors import InputError
from ..plane import polygon_area
from ..polygons import fill_holes, polygons_of, rings_of
from .frame import Frame, frames_of
from .mappable_holes import mappable
from .region import PaintedRegion


class Drawing:
    """A region of any number of parts, each with any number of holes.

    Parameters
    ----------
    painted
        A valid Polygon or MultiPolygon with an area, in the plane with y up.

    Examples
    --------
    >>> drawing = Drawing(shapely.MultiPolygon([shapely.box(0, 0, 2, 1), shapely.box(3, 0, 4, 1)]))
    >>> drawing.is_one_part, [round(frame.radius, 3) for frame in drawing.frames]
    (False, [0.278, 0.694, inf])
    """

    def __init__(self, painted: shapely.Geometry):
        parts = polygons_of(painted)
        if not len(parts):
            raise InputError("the drawing paints nothing")
        parts = shapely.orient_polygons(parts)
        self.painted = parts[0] if len(parts) == 1 else shapely.MultiPolygon(list(parts))

    @classmethod
    def of_rings(cls, rings: Sequence[Complex], name: str = "drawing") -> "Drawing":
        """Create the drawing that rings enclose, filled together by the even-odd rule.

        Raises
        ------
        InputError
            They enclose nothing.
        """
        painted = _from_oriented(rings)
        if painted is None:
            painted = shapely.Polygon()
            for ring in rings:
                painted = shapely.symmetric_difference(painted, shapely.make_valid(polygon_of(ring)))
        try:
            return cls(painted)
        except InputError as error:
            raise error.named(name) from None

    @property
    def rings(self) -> list[Complex]:
        """The boundaries of all parts, counter-clockwise, and of their holes, clockwise; inverse of `of_rings`."""
        return rings_of(self.painted)

    @cached_property
    def region(self) -> PaintedRegion:
        """The painted area, prepared for point queries."""
        return PaintedRegion(self.painted)

    @cached_property
    def frames(self) -> list[Frame]:
        """The frames around the drawing, from the tightest to the convex hull."""
        return frames_of(self.painted)

    def filled(self) -> "Drawing":
        """Return the drawing with the holes of all parts filled."""
        return Drawing(fill_holes(self.painted))

    @property
    def parts(self) -> list[shapely.Polygon]:
        """Its connected parts."""
        return list(shapely.get_parts(self.painted))

    @property
    def is_one_part(self) -> bool:
        """Whether it is a single part, so that its own outline is a frame that contains everything."""
        return len(self.parts) == 1

    @property
    def holes(self) -> list[Complex]:
        """The outlines of the holes of its only part; empty where there are several parts."""
        if not self.is_one_part:
            return []
        return [complex_of(shapely.get_coordinates(ring)[:-1]) for ring in self.parts[0].interiors]

    @cached_property
    def mappable_holes(self) -> list[Curve]:
        """The holes that leave room for a map, in the same order."""
        holes = self.holes
        return [Curve(holes[k]) for k in mappable(self.tightest.outline, holes)]

    @cached_property
    def hull_region(self) -> PaintedRegion:
        """Its convex hull: the area that it may show where gaps cost nothing."""
        return PaintedRegion(shapely.convex_hull(self.painted))

    @property
    def tightest(self) -> Frame:
        """The tightest frame that contains all of it."""
        return next(frame for frame in self.frames if frame.left_out == 0)


def _from_oriented(rings: Sequence[Complex]) -> shapely.Geometry | None:
    """Return the region of rings ordered as in `Drawing.rings`, each part followed by its holes; None for other rings.

    No geometry is computed, so every vertex stays exactly as it is.
    """
    parts: list[list[Complex]] = []
    for ring in rings:
        if polygon_area(ring) > 0:
            parts.append([ring])
        elif parts:
            parts[-1].append(ring)
        else:
            return None
    painted = shapely.MultiPolygon([polygon_of(*part) for part in parts])
    return painted if painted.is_valid else None
