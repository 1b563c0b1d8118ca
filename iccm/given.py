"""Shapes and points as people have them, made the complex numbers that all of iccm computes with: x + iy, y up.

Taken are complex numbers, pairs (n, 2), `Curve`, shapes read from files, shapely's polygons and rings (also items of a
GeoSeries), GeoJSON geometries, and trimesh's paths. `axes` says what pairs and polygons mean, see `iccm.axes`. Another
kind of shape would be added to `_polygon`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from typing import Any

import numpy as np
import shapely
import shapely.geometry
from numpy.typing import ArrayLike

from .arrays import Complex, Real, as_complex
from .axes import check, complex_in
from .curve import Curve
from .errors import InputError
from .meshes.flatten import Flattening


@dataclass(frozen=True)
class Outlines:
    """A shape that was given.

    Attributes:
        outline: what is taken for its boundary.
        holes: outlines of holes that came with it.
    """

    outline: Curve | ArrayLike
    holes: tuple[Complex, ...] = ()


def outlines_of(shape: Any, name: str, axes: str = "xy") -> Outlines:
    """The boundary and the holes of a shape that somebody has.

    Args:
        shape: see the head of this module.
        name: what messages call it.
        axes: what pairs mean; polygons are of x and y, which is down unless this is "xy".

    Raises:
        InputError: several polygons, or nothing that has an outline.
    """
    check(axes)
    if isinstance(shape, str | PathLike):
        raise InputError(f"{name}: is a name; read the file first: iccm.read_shape({fspath(shape)!r})")
    if isinstance(shape, Curve):
        return Outlines(shape)
    if (flattening := flattening_of(shape)) is not None:
        return Outlines(flattening.boundary)
    if isinstance(getattr(shape, "curve", None), Curve):  # read from a file
        return Outlines(shape.curve, tuple(shape.holes[k] for k in shape.mappable_holes))
    polygon = _polygon(shape, name)
    if polygon is None:
        return Outlines(as_points_of(shape, name, axes))
    rings = [polygon.exterior, *polygon.interiors] if hasattr(polygon, "exterior") else [polygon]
    upright = [complex_in(_vertices(ring), _of_geometry(axes)) for ring in rings]
    return Outlines(upright[0], tuple(upright[1:]))


def flattening_of(shape: Any) -> Flattening | None:
    """The surface that a shape stands for: a flattening, or a mesh read from a file; None of others."""
    own = None if isinstance(shape, Curve) else getattr(shape, "domain", None)
    return next((each for each in (shape, own) if isinstance(each, Flattening)), None)


def as_points_of(points: Any, name: str, axes: str = "xy", columns: int = 0) -> Any:
    """(n,) complex points, or (n, columns), of complex ones or of pairs by their axes; also OpenCV's (n, 1, 2)."""
    if isinstance(points, Curve):
        return points.z
    geometry = points if hasattr(points, "geom_type") else None
    if geometry is not None:
        return complex_in(shapely.get_coordinates(geometry), _of_geometry(axes))
    try:
        given = np.asarray(points)
    except ValueError:
        given = np.empty(0, object)
    if given.dtype.kind not in "iuf" or not given.size:
        return points
    if given.ndim == 3 and given.shape[1:] == (1, 2) and not columns:
        given = given[:, 0]
    if axes == "xy" or given.shape[-1:] != (2,) or given.ndim != 2 + bool(columns):
        return as_complex(given, name, columns)
    return complex_in(given, axes)


def _vertices(ring: Any) -> Real:
    """(n, 2) vertices of a ring, the first of which is not repeated at its end."""
    points = shapely.get_coordinates(ring)
    return points[:-1] if len(points) > 1 and (points[0] == points[-1]).all() else points


def _of_geometry(axes: str) -> str:
    """What the coordinates of polygons mean, which are x and y always."""
    return "xy" if axes == "xy" else "screen"


def _polygon(shape: Any, name: str) -> Any:
    """A polygon or ring as shapely has it; None of what is an array.

    Raises:
        InputError: several polygons, or a geometry without area.
    """
    if hasattr(shape, "polygons_full") and hasattr(shape, "entities"):  # trimesh's paths
        return _only(list(shape.polygons_full), name)
    if hasattr(shape, "iloc") and hasattr(shape, "geometry"):  # GeoSeries, GeoDataFrame and its rows
        geometry = shape.geometry
        return _polygon(_only(list(geometry), name) if hasattr(geometry, "iloc") else geometry, name)
    if not hasattr(shape, "geom_type"):
        known = shape if isinstance(shape, Mapping) else getattr(shape, "__geo_interface__", None)
        if known is None:
            return None
        if "geometry" in known:
            known = known["geometry"]
        try:
            shape = shapely.geometry.shape(known)
        except (AttributeError, KeyError, TypeError, ValueError, shapely.errors.ShapelyError) as error:
            raise InputError(f"{name}: not a GeoJSON geometry ({error})") from None
    if shape.geom_type in ("MultiPolygon", "GeometryCollection"):
        return _only([part for part in shape.geoms if part.geom_type == "Polygon"], name)
    if shape.geom_type not in ("Polygon", "LinearRing", "LineString"):
        raise InputError(f"{name}: a {shape.geom_type} has no outline; give a polygon")
    if shape.is_empty:
        raise InputError(f"{name}: the {shape.geom_type} is empty")
    return shape


def _only(parts: Sequence[Any], name: str) -> Any:
    """The only one of several polygons.

    Raises:
        InputError: there are more, or none.
    """
    if len(parts) == 1:
        return parts[0]
    if not parts:
        raise InputError(f"{name}: no polygon in it")
    raise InputError(
        f"{name}: {len(parts)} polygons; give one, such as the largest: max(parts, key=lambda p: p.area)"
    )
