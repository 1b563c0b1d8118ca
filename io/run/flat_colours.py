"""Drawings of a few flat colours as areas, and which areas of two drawings become each other in a morph."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from scipy.optimize import linear_sum_assignment

from ...arrays import Real
from ...drawings.drawing import Drawing
from ...pixels.canvas import Canvas
from ...pixels.coverage import painted_share
from ...polygons import polygons_of, rings_of, unite
from .. import formats, limits
from ..artwork import rendering
from ..artwork.areas import Area
from ..shapes.shape import Shape
from ..spec import Spec
from ..svg import tree
from ..svg.document import SUFFIXES, drawing_bytes
from ..svg.flat_areas import Colour, flat_areas

CHECKED_PIXELS = 256  # of the longer side of the rendering that areas are compared with
MOST_OFF_LEVELS, MOST_OFF_SHARE = 64, 0.005
"""Difference of a colour (of 255) from the rendering, and the share of pixels that may have a larger one: edges."""
SAME_COLOUR_LEVELS = 24
"""Colours of two drawings that differ by less are the same, wherever they are."""
LEAST_OVERLAP_SHARE = 0.1
"""Of the union of two areas of different colours: with less in common, one would swell from the other's small parts."""
MOST_COST = 3.0  # of pairs: above that of any pair with something in common
BEYOND_SHARE = 1e-3
"""Relative to its area: a drawing that paints more outside of the mapped part is not flat areas."""
SLIVER_SHARE = 1e-7  # relative to the drawing's area: a smaller part of an area is rounding
STRAIGHT_SHARE = 1e-7
"""Relative to the size of an area: vertices that are closer to a straight edge are left out."""
LEVELS = 255


@dataclass(frozen=True, eq=False)
class FlatArea:
    """An area of one colour.

    Attributes:
        colour: red, green, blue and alpha, 8 bits, straight.
        area: the core plane.
    """

    colour: Colour
    area: Drawing


Partners = list[tuple[FlatArea | None, FlatArea | None]]


def areas_of(shape: Shape, parts: Sequence[Drawing], *, filled: bool = False) -> list[list[FlatArea]] | None:
    """Return the areas of each part of an SVG drawing in painting order; None if it is not made of flat colours.

    Args:
        shape: a shape of the drawing.
        parts: the parts that are mapped, core plane.
        filled: whether the holes of drawings of one colour are painted over.
    """
    areas = _of_file(shape.path)
    if areas is None:
        return None
    whole = unite([area for _, area in areas])
    is_whole = Spec.of(shape.spec).selection is None and len(parts) == 1
    if is_whole and whole.difference(parts[0].painted).area > BEYOND_SHARE * whole.area:
        return None
    if filled and len(areas) == 1:
        return [[FlatArea(areas[0][0], part)] for part in parts]
    all_flat = [
        [area for colour, painted in areas for area in _within(part, colour, painted)] for part in parts
    ]
    return all_flat if all(all_flat) else None


def has_lines(path: Path) -> bool:
    """Return whether a drawing paints strokes."""
    return any(node.stroked for node in tree.parse(drawing_bytes(path, limits.SVG_BYTES)).shapes)


def _within(part: Drawing, colour: Colour, area: shapely.Geometry) -> list[FlatArea]:
    """Return what of an area lies in a part of its drawing; nothing, or one area."""
    pieces = polygons_of(shapely.intersection(area, part.painted))
    pieces = pieces[shapely.area(pieces) > SLIVER_SHARE * part.region.area]
    return [FlatArea(colour, Drawing(unite(list(pieces))))] if len(pieces) else []


def _of_file(path: Path) -> list[tuple[Colour, shapely.Geometry]] | None:
    """Return the areas of a file in the core plane; None if they do not look like the drawing as it is rendered."""
    if formats.suffix_of(path) not in SUFFIXES:
        return None
    areas = flat_areas(path)
    if not areas:
        return None
    upward = [(colour, shapely.transform(area, lambda xy: xy * [1, -1])) for colour, area in areas.items()]
    left, low, right, high = shapely.total_bounds([area for _, area in upward])
    box = complex(left, low), complex(right, high)
    size = rendering.pixels_across(box, CHECKED_PIXELS / max(right - left, high - low), CHECKED_PIXELS**2)
    rendered = _premultiplied(np.asarray(rendering.render(path, box, size).pixels, float))
    layers = [Area(colour, rings_of(area)) for colour, area in upward]
    off = np.abs(_premultiplied(paint_beside(layers, Canvas(*size, box))) - rendered).max(axis=2)
    return upward if (off > MOST_OFF_LEVELS).mean() <= MOST_OFF_SHARE else None


def pairs(first: Sequence[FlatArea], second: Sequence[FlatArea]) -> list[tuple[int | None, int | None]]:
    """Pair the areas of two drawings in the same plane by colour and overlap; the others have None as a partner.

    Areas that neither have the same colour nor overlap by LEAST_OVERLAP_SHARE are not paired.
    """
    costs = np.array([[_cost(one, other) for other in second] for one in first])
    found = {
        int(k): int(j)
        for k, j in zip(*linear_sum_assignment(np.minimum(costs, MOST_COST)))
        if costs[k, j] < MOST_COST
    }
    together: list[tuple[int | None, int | None]] = [(k, found.get(k)) for k in range(len(first))]
    return together + [(None, j) for j in range(len(second)) if j not in found.values()]


def _cost(one: FlatArea, other: FlatArea) -> float:
    """Return the difference of two areas, from 0 to 2; infinity if they have nothing in common."""
    off = np.abs(np.subtract(one.colour, other.colour)).max()
    common = shapely.intersection(one.area.painted, other.area.painted).area
    overlap = common / (one.area.region.area + other.area.region.area - common)
    if off > SAME_COLOUR_LEVELS and overlap < LEAST_OVERLAP_SHARE:
        return float("inf")
    return float(off / LEVELS + 1 - overlap)


def mixed(first: FlatArea | None, second: FlatArea | None, share: float) -> Colour:
    """Return the colour between those of two areas, or of the only one."""
    one, other = (area.colour for area in (first or second, second or first) if area is not None)
    blended = (1 - share) * np.array(one) + share * np.array(other)
    red, green, blue, alpha = np.rint(blended).astype(int).tolist()
    return red, green, blue, alpha


def covering(areas: Sequence[Drawing | None]) -> list[Drawing | None]:
    """Return for each area the union of it and of all areas after it, without vertices on straight edges.

    None stands for areas that paint nothing.
    """
    after = [[area.painted for area in areas[number:] if area is not None] for number in range(len(areas))]
    unions = [unite(painted) for painted in after]
    return [
        None if union.is_empty else Drawing(shapely.simplify(union, STRAIGHT_SHARE * math.sqrt(union.area)))
        for union in unions
    ]


def layers_of(colours: Sequence[Colour], covering: Sequence[Drawing | None]) -> list[Area]:
    """Return layers of areas that are given as for `covering`.

    An opaque area continues below those that cover it, so that no seams show; a translucent one ends at them.
    """
    layers = []
    for number, (colour, area) in enumerate(zip(colours, covering)):
        opaque = all(later[3] == LEVELS for later in colours[number:])
        above = None if opaque else next((later for later in covering[number + 1 :] if later), None)
        painted = area.painted if area is not None else shapely.Polygon()
        layers.append(
            Area(colour, rings_of(painted if above is None else unite(painted.difference(above.painted))))
        )
    return layers


def paint(layers: Sequence[Area], canvas: Canvas) -> Real:
    """Return a picture (height, width, 4) of layers, each over those before it: straight alpha, from 0 to 255."""
    pixels = np.zeros((canvas.height, canvas.width, 4))
    for layer in layers:
        red, green, blue, alpha = layer.colour
        share = painted_share(layer.rings, canvas)[..., None] * alpha / LEVELS if layer.rings else 0.0
        pixels = share * np.array([red, green, blue, LEVELS]) + (1 - share) * pixels
    return _straight(pixels)


def paint_beside(layers: Sequence[Area], canvas: Canvas) -> Real:
    """Return a picture of areas that do not overlap, without seams between them; see `paint`."""
    pixels = np.zeros((canvas.height, canvas.width, 4))
    for layer in layers:
        red, green, blue, alpha = layer.colour
        if layer.rings:
            share = painted_share(layer.rings, canvas)[..., None] * alpha / LEVELS
            pixels += share * np.array([red, green, blue, LEVELS])
    return _straight(np.minimum(pixels, LEVELS))


def _straight(pixels: Real) -> Real:
    alpha = pixels[..., 3:] / LEVELS
    colours = np.divide(pixels[..., :3], alpha, out=np.zeros_like(pixels[..., :3]), where=alpha > 0)
    return np.concatenate([colours, pixels[..., 3:]], axis=2)


def _premultiplied(pixels: Real) -> Real:
    return np.concatenate([pixels[..., :3] * pixels[..., 3:] / LEVELS, pixels[..., 3:]], axis=2)
