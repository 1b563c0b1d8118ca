"""The areas of each colour that a drawing of flat colours shows."""

from collections.abc import Iterator
from pathlib import Path

import shapely
from tinycss2.color3 import RGBA, parse_color

from ...errors import InputError
from ...polygons import polygons_of, unite
from .. import limits
from . import tree
from .budget import Budget
from .crossings import TooMuch
from .document import drawing_bytes
from .reader import CurveFlattener, is_constraint
from .strokes import painted_by_stroke
from .tree import Node

Colour = tuple[int, int, int, int]
MOST_SHAPES, MOST_COLOURS = 400, 12
"""Of a drawing whose areas are computed: each shape is subtracted from all colours below it."""
FLATNESS = 1e-4  # tolerance of flattened curves, relative to the diagonal of each subpath
OPAQUE_SHARE = 0.998  # an opacity above it is less than 1/255 from 1


def flat_areas(path: Path) -> dict[Colour, shapely.Geometry] | None:
    """Compute the areas of each colour that an SVG shows.

    Overlapping translucent shapes are areas of the blended colour. Group opacity, filters and blend modes are not
    considered; compare the result with a rendering.

    Args:
        path: the drawing.

    Returns:
        Disjoint areas in the file's units by colour: red, green, blue and alpha, 8 bits, straight; None if the drawing
        has gradients, patterns, pictures, markers, dashes or text that cannot be set, or too many shapes or colours.
    """
    document = tree.parse(drawing_bytes(path, limits.SVG_BYTES))
    nodes = [node for node in document.shapes if not is_constraint(node)]
    if document.pictures or document.unset_texts or len(nodes) > MOST_SHAPES:
        return None
    flattener = CurveFlattener(FLATNESS, Budget(limits.SEGMENTS))
    seen: dict[Colour, shapely.Geometry] = {}
    try:
        for node in nodes:
            for kind in _order(node):
                colour = _flat_colour(node, kind)
                if colour is None:
                    return None
                for area in _areas(node, kind, flattener):
                    _paint(seen, colour, area)
                if len(seen) > MOST_COLOURS:
                    return None
    except (InputError, TooMuch, shapely.GEOSException):
        return None
    return {colour: area for colour, area in seen.items() if area.area}


def _order(node: Node) -> list[str]:
    """Return what a shape paints, "fill" and "stroke", in order."""
    kinds = [kind for kind, painted in (("fill", node.filled), ("stroke", node.stroked)) if painted]
    return kinds[::-1] if node.properties.get("paint-order", "").strip().startswith("stroke") else kinds


def _flat_colour(node: Node, kind: str) -> Colour | None:
    """Return the colour of a shape's fill or stroke; None if it is not one colour, or the stroke is not one line."""
    default = "black" if kind == "fill" else "none"
    paint = css_colour(node.properties.get(kind, default), node)
    markers = (node.properties.get(f"marker-{place}", "none").strip() for place in ("start", "mid", "end"))
    if paint is None or node.dashed or any(marker != "none" for marker in markers):
        return None
    red, green, blue = (round(255 * channel) for channel in paint[:3])
    alpha = paint.alpha * node.alpha(kind)
    return red, green, blue, 255 if alpha > OPAQUE_SHARE else round(255 * alpha)


def css_colour(paint: str, node: Node) -> RGBA | None:
    """Return the colour that a paint of a shape means; None for gradients and patterns."""
    colour = parse_color(paint.strip())
    if colour == "currentColor":
        colour = parse_color(node.properties.get("color", "black").strip())
        colour = parse_color("black") if colour == "currentColor" else colour
    return colour if isinstance(colour, RGBA) else None


def _areas(node: Node, kind: str, flattener: CurveFlattener) -> Iterator[shapely.Geometry]:
    """Yield the areas that a fill or stroke paints, cut by clip paths."""
    runs = flattener.runs(node)
    regions = flattener.fills.of(node, runs) if kind == "fill" else [painted_by_stroke(node, runs)]
    for region in regions:
        yield flattener.clips.cut(node, region)


def _paint(seen: dict[Colour, shapely.Geometry], colour: Colour, area: shapely.Geometry) -> None:
    """Paint an area over those that are seen."""
    remaining = area
    for below, region in list(seen.items()):
        covered = _polygonal(shapely.intersection(region, area))
        if not covered.area:
            continue
        seen[below] = _polygonal(shapely.difference(region, area))
        if colour[3] < 255:
            remaining = _polygonal(shapely.difference(remaining, covered))
            _add(seen, _over(colour, below), covered)
    _add(seen, colour, remaining)


def _add(seen: dict[Colour, shapely.Geometry], colour: Colour, area: shapely.Geometry) -> None:
    seen[colour] = unite([seen[colour], area]) if colour in seen else area


def _over(above: Colour, below: Colour) -> Colour:
    """Return the colour that a translucent colour over another one gives."""
    top = above[3] / 255
    bottom = below[3] / 255 * (1 - top)
    red, green, blue = (round((top * a + bottom * b) / (top + bottom)) for a, b in zip(above[:3], below[:3]))
    return red, green, blue, round(255 * (top + bottom))


def _polygonal(region: shapely.Geometry) -> shapely.Geometry:
    """Return the region without the points and lines along which others touch it."""
    return unite(list(polygons_of(region)))
