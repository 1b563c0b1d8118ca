"""The drawing in a file of any format: outlines to choose a domain from, a canvas, and constraints."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import shapely

from ...arrays import Complex
from ...curve import polygon_of
from ...errors import InputError
from ...polygons import unite
from ...saved.georeference import Georeference
from .affine import Affine
from .fill import FaceBudget, FilledOutline, Refused, outlines, with_lines_filled

Rectangle = tuple[float, float, float, float]  # x, y, width, height


@dataclass(frozen=True)
class WrappedPicture:
    """A picture that is the only content of a drawing.

    Attributes:
        content: bytes of its file.
        place: the rectangle in which it is shown, in its user space.
        to_root: map from there to the file's units.
        aspect: its `preserveAspectRatio`.
        name: its name in messages.
    """

    content: bytes
    place: Rectangle
    to_root: Affine
    aspect: str
    name: str


@dataclass(frozen=True, eq=False)
class DrawingContent:
    """The content of a file of any format; coordinates are x + iy as in the file.

    Attributes:
        outlines: candidates for the domain, the largest first.
        rectangle: x, y, width and height of the canvas; None where the file has none.
        flip: whether the file's y axis points down.
        pins: positions of pins by name.
        pin_radii: radii of the circles that represent pins, by name.
        strokes: polylines of strokes by name.
        rigid: outlines of rigid regions.
        notes: what was ignored or changed.
        refused: (enclosed area, error) for content that looks like a domain but cannot be used.
        ids: names that can be selected, in order; a dictionary for fast look-up.
        coloured: whether it has separate colours to show, and is not just a shape.
        wrapped: the picture, if the drawing contains nothing else.
        has_lines: whether strokes paint something besides the fills.
        millimetres: length of a unit; None where the file does not state it.
        unit: the unit in which the file states its size, such as "in"; empty if it does not.
        georeference: where the file's coordinates lie on a map.
        paint: computes `ink` and `painted` where these are more than the union of the outlines.
        budget: limits the work for outlines that cross.
    """

    outlines: list[FilledOutline]
    rectangle: Rectangle | None
    flip: bool
    pins: dict[str, complex] = field(default_factory=dict)
    pin_radii: dict[str, float] = field(default_factory=dict)
    strokes: dict[str, Complex] = field(default_factory=dict)
    rigid: list[Complex] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    refused: list[Refused] = field(default_factory=list)
    ids: dict[str, None] = field(default_factory=dict)
    coloured: bool = False
    wrapped: WrappedPicture | None = None
    has_lines: bool = False
    millimetres: float | None = None
    unit: str = ""
    georeference: Georeference | None = None
    paint: Callable[[], tuple[shapely.Geometry, shapely.Geometry]] | None = None
    budget: FaceBudget = field(default_factory=FaceBudget)

    @property
    def ink(self) -> shapely.Geometry:
        """The area that the whole drawing paints: the union of fills, visible strokes and embedded pictures.

        A (multi)polygon in the file's units and directions.
        """
        return self._areas[0]

    @property
    def painted(self) -> shapely.Geometry:
        """The area that the drawing appears to cover: its ink, and the inside of closed lines in line drawings."""
        return self._areas[1]

    @cached_property
    def _areas(self) -> tuple[shapely.Geometry, shapely.Geometry]:
        if self.paint is not None:
            return self.paint()
        ink = unite([polygon_of(outline.z, *outline.holes).buffer(0) for outline in self.outlines])
        return ink, with_lines_filled(ink)

    def add(
        self,
        rings: Iterable[Complex],
        rule: str,
        label: str,
        names: tuple[str, ...],
        area: float = 0.0,
        **how: Any,
    ) -> None:
        """Add the regions that filling rings by a rule paints.

        If there are none, the error is added to `refused` with the area at stake. Further arguments are those of
        `fill.outlines`.
        """
        try:
            painted, refused = outlines(rings, rule, label, budget=self.budget, **how)
        except InputError as error:
            painted, refused = [], [(area, error)]
        self.outlines.extend(replace(outline, names=names) for outline in painted)
        self.refused.extend(refused)
