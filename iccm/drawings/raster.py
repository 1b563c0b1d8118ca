"""Rasterize painted regions."""

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from ..arrays import Complex, complex_of
from ..pixels.canvas import Canvas
from ..pixels.coverage import coverage_box
from ..plane import polygon_area


def rings_of(region: shapely.Geometry) -> list[Complex]:
    """Return the rings of a region, those of parts counter-clockwise, those of holes clockwise."""
    parts = [part for part in shapely.get_parts(region) if part.geom_type == "Polygon" and not part.is_empty]
    oriented = shapely.orient_polygons(np.array(parts, dtype=object))
    rings = [ring for part in oriented for ring in (part.exterior, *part.interiors)]
    return [complex_of(shapely.get_coordinates(ring)[:-1]) for ring in rings]


def painted_share(rings: Sequence[Complex], canvas: Canvas) -> NDArray[np.float32]:
    """Return the share of each pixel that a region covers, (height, width) in [0, 1].

    Parameters
    ----------
    rings
        The region's boundaries, closed polylines: those of parts counter-clockwise, those of holes clockwise.
    canvas
        The raster.
    """
    covered = np.zeros((canvas.height, canvas.width), np.float32)
    for ring in rings:
        area = coverage_box(canvas.pixels(ring), 0, canvas.height, canvas.width)
        covered += area if polygon_area(ring) > 0 else -area
    return np.clip(covered, 0, 1)
