"""Pairs of landmarks of two shapes, with the conventions of the programs that place their points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from ....errors import InputError
from ... import limits

if TYPE_CHECKING:
    from ..shape import Shape

Axes = Literal["image", "upward", "lower-edge", "map"]
"""What the coordinates of a point mean:

"image"       the units of the shape's file; in a picture pixels from the upper left corner, y down
"upward"      y up; in pictures and SVG files negative below the upper edge
"lower-edge"  y up from the lower edge of the canvas
"map"         a place on a map of the earth, if the shape lies on one; otherwise as "upward"
"""
Point = tuple[float, float]


@dataclass(frozen=True)
class LandmarkPairs:
    """Named pairs of points of two shapes.

    Attributes:
        axes: conventions of the coordinates in the source and in the target.
        names: of each pair, possibly empty.
        source: points of the source.
        target: points of the target.
        crs: the coordinate reference system of the target's points, if they are places on a map.
    """

    axes: tuple[Axes, Axes]
    names: list[str] = field(default_factory=list)
    source: list[Point] = field(default_factory=list)
    target: list[Point] = field(default_factory=list)
    crs: str = ""

    @classmethod
    def of_pins(
        cls, pins: Sequence[Any], source: Shape, target: Shape, axes: tuple[Axes, Axes]
    ) -> LandmarkPairs:
        """Return pins as pairs with the conventions of a program.

        Args:
            pins: objects with `name`, `source` and `target`, in the units of the shapes' files.
            source, target: the shapes.
            axes: those of the program.

        Raises:
            InputError: one of the shapes is a mesh.
        """
        if source.is_mesh or target.is_mesh:
            raise InputError("landmarks on meshes can only be saved as JSON")
        source_axes, target_axes = axes
        return cls(
            axes,
            [pin.name for pin in pins],
            [_to_axes(source_axes, pin.source, source) for pin in pins],
            [_to_axes(target_axes, pin.target, target) for pin in pins],
        )

    def append(self, name: str, source: Point, target: Point) -> None:
        """Append a pair."""
        self.names.append(name)
        self.source.append(source)
        self.target.append(target)

    def check_count(self) -> None:
        """Refuse a file without landmarks, or with too many.

        Raises:
            InputError: the number is 0 or exceeds the limit.
        """
        if not self.names:
            raise InputError("contains no landmarks that are switched on")
        if len(self.names) > limits.PAGE_PINS:
            raise InputError(f"contains more than {limits.PAGE_PINS} landmarks")

    def in_file_units(self, source: Shape, target: Shape) -> list[tuple[str, Point, Point]]:
        """Return names and points, converted to the units of two shapes' files.

        Raises:
            InputError: one of them is a mesh, or they lie in different coordinate reference systems.
        """
        for shape in (source, target):
            if shape.is_mesh:
                raise InputError(
                    f"{shape.spec}: landmarks of images only work for drawings and pictures; use JSON"
                )
        target_crs = target.georeference.crs if target.georeference else ""
        if self.crs and target_crs and self.crs != target_crs:
            raise InputError(
                f"{target.spec}: is in {target_crs}, but the ground control points are in {self.crs}; reproject one of "
                "them"
            )
        source_axes, target_axes = self.axes
        return [
            (name, _from_axes(source_axes, a, source), _from_axes(target_axes, b, target))
            for name, a, b in zip(self.names, self.source, self.target)
        ]


def _from_axes(axes: Axes, point: Point, shape: Shape) -> Point:
    """Convert a point from a program's coordinates to the units of a shape's file."""
    if axes == "image":
        return point
    if axes == "map" and shape.georeference:
        return shape.georeference.from_map(*point)
    origin = shape.box[0] if axes == "lower-edge" else 0j
    x, y = shape.to_file(origin + complex(*point)).tolist()
    return x, y


def _to_axes(axes: Axes, point: Point, shape: Shape) -> Point:
    """Convert a point from the units of a shape's file to a program's coordinates."""
    if axes == "image":
        return point
    if axes == "map" and shape.georeference:
        return shape.georeference.to_map(*point)
    z = complex(shape.to_core(point)) - (shape.box[0] if axes == "lower-edge" else 0j)
    return z.real, z.imag
