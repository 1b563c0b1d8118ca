"""Holes of shapes: pairs with the same name, maps that take holes to holes, and deformations that leave them open."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

import iccm

from ...arrays import Complex
from ...balanced.errors import NoMapError
from ...curve import Curve, polygon_of
from ...drawings.drawing import Drawing
from ...fit_data import with_details
from ...maps.triangulated.map import TriangulatedMap
from ...plane import polygon_area
from ...solve import Fit
from . import parts
from .shape import Shape

FILLED_BY_LINES_SHARE = 0.01
"""Of a drawing's area: if lines enclose less than this, filling them makes no visible difference."""
LINES_AREA_SHARE = 1 / 3  # of a silhouette's area: drawings that paint less are line drawings
UNMAPPED = (
    "found no map without folds that takes holes onto holes, so the map ignores them and the target's "
    "holes stay transparent"
)


def named_partners(
    source: Shape, target: Shape, holes: tuple[Sequence[int], Sequence[int]]
) -> list[tuple[int, int]]:
    """Return pairs of positions in the lists of holes that share a name which is unique on both sides."""
    names_by_side = [
        [parts.words_of(shape.hole_names[k] if shape.hole_names else ()) for k in numbers]
        for shape, numbers in zip((source, target), holes)
    ]
    unique_names = [
        {name for name in set().union(*side) if sum(name in hole_names for hole_names in side) == 1}
        for side in names_by_side
    ]
    partners: dict[int, int] = {}
    for i, names in enumerate(names_by_side[0]):
        shared = [
            j
            for j, target_names in enumerate(names_by_side[1])
            if names & target_names & unique_names[0] & unique_names[1]
        ]
        if len(shared) == 1 and shared[0] not in partners.values():
            partners[i] = shared[0]
    return list(partners.items())


def is_drawn_by_lines(shape: Shape) -> bool:
    """Return whether a shape's holes are much larger than its painted area, as in a line drawing."""
    if shape.drawing is not None and shape.ink is not None:
        return shape.ink.region.area < (1 - FILLED_BY_LINES_SHARE) * shape.drawing.region.area
    holes = sum(abs(polygon_area(hole)) for hole in shape.holes)
    return holes > (1 - LINES_AREA_SHARE) * shape.curve.area


def filled(shape: Shape) -> Shape:
    """Return a drawing with its holes filled; other shapes unchanged."""
    return shape if shape.drawing is None else drawn_as(shape, shape.drawing.filled())


def as_drawn(shape: Shape) -> Shape:
    """Return a drawing with its lines as lines, without what they enclose; other shapes unchanged."""
    if shape.ink is None or shape.drawing is None or shape.ink.region.area == shape.drawing.region.area:
        return shape
    return drawn_as(shape, shape.ink)


def drawn_as(shape: Shape, drawing: Drawing) -> Shape:
    """Return the shape with another interpretation of what its file paints."""
    names = shape.hole_names if len(drawing.holes) == len(shape.holes) else ()
    return replace(
        shape, curve=drawing.tightest.outline, holes=tuple(drawing.holes), hole_names=names, drawing=drawing
    )


def without_holes(shape: Shape, tell: Callable[[str], None]) -> Shape:
    """Return the silhouette of a line drawing, with a note; other shapes unchanged."""
    if not is_drawn_by_lines(shape):
        return shape
    tell(
        f"{shape.spec}: drawn with lines only, so the areas that they enclose count as filled (use "
        "--holes keep to treat them as holes)"
    )
    return shape if shape.drawing else replace(shape, holes=(), hole_names=())


def unmapped(shape: Shape, mapped: Sequence[Curve]) -> tuple[Complex, ...]:
    """Return the holes of a shape that are not among those of a map."""
    corners = np.array([_corner(hole.z) for hole in mapped])
    same_distance = 1e-9 * shape.curve.diagonal
    return tuple(hole for hole in shape.holes if not np.any(np.abs(corners - _corner(hole)) < same_distance))


def fit_with_holes(
    source: Shape,
    target: Shape,
    tell: Callable[[str], None],
    start: TriangulatedMap | None = None,
    **options: Any,
) -> Fit:
    """Call `iccm.fit` with two shapes and their holes.

    If that finds no map, or `start` has no holes, fit without holes and give a note.
    """
    mappable = source.mappable_holes, target.mappable_holes
    inner = [[shape.holes[k] for k in side] for shape, side in zip((source, target), mappable)]
    partners = named_partners(source, target, mappable)
    if not (source.is_mesh or target.is_mesh):
        return _fit_drawings(source, target, tell, partners, start, **options)
    plain = start is not None and len(start.loops) == 1
    if not any(inner) or (plain and all(inner)):
        if any(inner):
            tell(f"{target.spec}: {UNMAPPED}")
        return iccm.fit(source.domain, target.domain, start=start, **options)
    holes: dict[str, Any] = dict(
        source_holes=inner[0], target_holes=inner[1], hole_partners=partners, **options
    )
    try:
        return iccm.fit(source.domain, target.domain, start=start, **holes)
    except NoMapError:
        tell(f"{target.spec}: {UNMAPPED}")
        return iccm.fit(source.domain, target.domain, start=start if plain else None, **options)


def _fit_drawings(
    source: Shape,
    target: Shape,
    tell: Callable[[str], None],
    partners: Sequence[tuple[int, int]],
    start: TriangulatedMap | None,
    **options: Any,
) -> Fit:
    """Call `iccm.fit` with two drawings; names pair their holes if both have a single part."""
    drawings = as_drawing(source), as_drawing(target)
    both_are_one_part = drawings[0].is_one_part and drawings[1].is_one_part
    try:
        return iccm.fit(
            *drawings,
            start=start,
            hole_partners=partners if both_are_one_part else (),
            **options,
        )
    except NoMapError:
        if not (source.holes or target.holes):
            raise
        tell(f"{target.spec}: {UNMAPPED}")
        return iccm.fit(filled(source).domain, filled(target).domain, start=start, **options)


def as_drawing(shape: Shape) -> Drawing:
    """Return the whole drawing of a planar shape; for an outline that was selected, the drawing of that part."""
    return shape.drawing or Drawing(
        polygon_of(shape.curve.z, *(shape.holes[k] for k in shape.mappable_holes))
    )


def deform_with_holes(source: Shape, **options: Any) -> Fit:
    """Call `iccm.deform` with a shape and its holes; with filled holes if it cannot be meshed otherwise."""
    holes = [source.holes[k] for k in source.mappable_holes]
    try:
        fit = iccm.deform(source.curve, source_holes=holes, **options)
    except NoMapError:
        if not holes:
            raise
        fit = iccm.deform(source.curve, **options)
    if source.drawing is None or source.drawing.is_one_part:
        return fit
    return with_details(fit, drawings=(source.drawing, source.drawing))


def about(pairs: Sequence[tuple[Shape, Shape]], *, keep: bool, mapped: bool) -> list[str]:
    """Return notes on holes that the map treats as part of the inside.

    Args:
        pairs: the shapes.
        keep: whether pictures leave the target's holes transparent.
        mapped: whether the map takes holes to holes.
    """
    notes = []
    for k, cure in enumerate(("", ", which pictures leave transparent" if keep else ", which pictures fill")):
        shapes = {id(pair[k]): pair[k] for pair in pairs if pair[k].holes}.values()
        count = sum(len(shape.holes) for shape in shapes)
        ignored = count - sum(len(shape.mappable_holes) for shape in shapes) if mapped else count
        if ignored:
            many = (
                f"its {ignored} hole{'s' * (ignored > 1)}"
                if ignored == count
                else f"{ignored} of its {count} holes"
            )
            why = ", too small or too close to an outline" if mapped else ""
            notes.append(f"{pairs[0][k].spec}: the map ignores {many}{why}{cure}")
    return notes[-1:] if pairs[0][0].spec == pairs[0][1].spec else notes


def _corner(z: Complex) -> complex:
    """Return the leftmost vertex, or the lowest of several: it identifies a hole in either direction."""
    return complex(z.min())
