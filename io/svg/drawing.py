"""The drawing of a file of any format: outlines to choose a domain from, a canvas, and constraints."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import shapely

from ...arrays import Complex
from ...curve import polygon_of
from ...errors import InputError
from ...polygons import unite
from .affine import Affine
from .fill import FilledOutline, Refused, outlines, with_lines_filled

Rectangle = tuple[float, float, float, float]  # x, y, width, height


@dataclass(frozen=True)
class WrappedPicture:
    """The picture that is all that a drawing shows.

    Attributes:
        content: its file.
        place: the rectangle that it is shown in, in its user space.
        to_root: from there to the file's units.
        aspect: its `preserveAspectRatio`.
        name: how messages name it.
    """

    content: bytes
    place: Rectangle
    to_root: Affine
    aspect: str
    name: str


@dataclass(frozen=True, eq=False)
class Drawing:
    """What a file holds, whatever its format; x + iy as in the file.

    Attributes:
        outlines: candidates for the domain, the largest first.
        rectangle: x, y, width and height of the canvas, None where the file has none.
        flip: whether the file's y axis points down.
        pins: places of pins by name.
        pin_radii: radii of the circles that pins are drawn as, by name.
        strokes: polylines of strokes by name.
        rigid: outlines of rigid regions.
        notes: what was left out or changed on the way.
        refused: (enclosed area, message) of what looks like a domain but is not one.
        ids: the names that select something, in order; a dictionary, for drawings of many.
        coloured: whether it has separate colours to show, and not just a shape.
        wrapped: the picture, if it shows nothing but one.
        has_lines: whether strokes paint something beside the fills.
        paint: computes `ink` and `painted` where these are more than the outlines together.
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
    paint: Callable[[], tuple[shapely.Geometry, shapely.Geometry]] | None = None

    @property
    def ink(self) -> shapely.Geometry:
        """What the whole drawing paints, as drawn: the union of fills, visible strokes and embedded pictures, in the
        file's units and directions; a (multi)polygon."""
        return self._areas[0]

    @property
    def painted(self) -> shapely.Geometry:
        """What the whole drawing covers for the eye: its ink, with closed lines filled where lines draw it."""
        return self._areas[1]

    @cached_property
    def _areas(self) -> tuple[shapely.Geometry, shapely.Geometry]:
        if self.paint is not None:
            return self.paint()
        ink = unite([polygon_of(each.z, *each.holes).buffer(0) for each in self.outlines])
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
        """Add what filling rings by a rule paints, under names; or why that is nothing, with the area at stake. The
        other arguments are those of `fill.outlines`."""
        try:
            found, refused = outlines(rings, rule, label, **how)
        except InputError as error:
            found, refused = [], [(area, error)]
        self.outlines.extend(replace(outline, names=names) for outline in found)
        self.refused.extend(refused)
