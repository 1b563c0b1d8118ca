"""Convert users' shapes and points to the complex numbers that iccm computes with: x + iy, y up.

Accepted are complex numbers, pairs (n, 2), `Curve`, shapes read from files, shapely's polygons and rings (also
items of a GeoSeries), GeoJSON geometries, and paths of trimesh and matplotlib. `axes` is the meaning of pairs and
polygons, see `iccm.axes`. To support another kind of shape, extend `_polygons`.
"""

from collections.abc import Mapping, Sequence, Sized
from dataclasses import dataclass, replace
from os import PathLike, fspath
from typing import Any

import numpy as np
import shapely
import shapely.geometry
from numpy.typing import ArrayLike

from .arrays import Complex, Real, as_complex
from .axes import check, complex_in
from .curve import Curve, polygon_of
from .drawings.drawing import Drawing
from .drawings.frame import close_hairlines
from .errors import InputError
from .meshes.flatten import Flattening
from .pins import Pin, Softness, Stroke
from .problem import as_domain, as_holes

PATH_UNITS = 4000.0  # of a path's longer side, in units of which curves are divided


@dataclass(frozen=True, eq=False)
class Outlines:
    """A shape as it was given.

    Attributes:
        outline: its boundary; for a drawing of several parts, that of the tightest frame around them.
        holes: outlines of its holes.
        holes_are_separate: whether these were given separately, not as holes of a polygon or drawing.
        drawing: the whole drawing that it is; None for a single outline, and for surfaces.
        layout: the flattening of the surface that it stands for; None for planar shapes.
    """

    outline: Curve | ArrayLike
    holes: tuple[Complex, ...] = ()
    holes_are_separate: bool = False
    drawing: Drawing | None = None
    layout: Flattening | None = None

    def as_drawing(self, name: str) -> Drawing:
        """Return the whole drawing; an outline with holes is a drawing of one part.

        Raises:
            InputError: they are not simple polygons, or a hole does not lie inside.
        """
        if self.drawing is not None:
            return self.drawing
        outer = as_domain(self.outline, name)
        return Drawing(polygon_of(outer.z, *(hole.z for hole in as_holes(outer, self.holes, name))))


def outlines_of(shape: Any, name: str, axes: str = "xy", separate_holes: Sequence[Any] = ()) -> Outlines:
    """Return what is given as a shape: its boundary and holes, the drawing or the surface that it is.

    Args:
        shape: see the module.
        name: name of the argument in messages.
        axes: meaning of pairs; polygons are in x and y, with y down unless this is "xy".
        separate_holes: outlines of holes, in addition to those of polygons.

    Raises:
        InputError: an object without an outline, or holes for a shape that has its own.
    """
    drawing = drawing_of(shape, name, axes)
    if drawing is None:
        given = outline_of(shape, name, axes)
    else:
        mappable = tuple(hole.z for hole in drawing.mappable_holes)
        given = Outlines(drawing.tightest.outline, mappable, drawing=drawing)
    given = replace(given, layout=flattening_of(shape))
    if not len(separate_holes):
        return given
    if given.holes:
        raise InputError(f"{name}_holes: the shape already has holes; remove one of the two")
    holes: list[Any] = [
        outline_of(hole, f"{name} hole {k + 1}", axes).outline for k, hole in enumerate(separate_holes)
    ]
    if drawing is not None:
        rings = [as_domain(hole, f"{name} hole {k + 1}").z for k, hole in enumerate(holes)]
        drawing = Drawing(polygon_of(drawing.tightest.outline.z, *rings))
    return replace(given, holes=tuple(holes), holes_are_separate=True, drawing=drawing)


def outline_of(shape: Any, name: str, axes: str = "xy") -> Outlines:
    """Return the boundary and the holes of a single outline, a polygon or a surface.

    Raises:
        InputError: several polygons, or an object without an outline.
    """
    check(axes)
    if isinstance(shape, str | PathLike):
        raise InputError(f"{name}: is the name of a file; read it first: iccm.read_shape({fspath(shape)!r})")
    if isinstance(shape, Curve):
        return Outlines(shape)
    if (flattening := flattening_of(shape)) is not None:
        return Outlines(flattening.boundary)
    if isinstance(getattr(shape, "curve", None), Curve):  # read from a file
        return Outlines(shape.curve, tuple(shape.holes[k] for k in shape.mappable_holes))
    polygon = _polygon(shape, name)
    if polygon is None:
        if not isinstance(shape, Sized):
            raise InputError(f"{name}: {shape!r} is not a shape; pass an outline, a polygon or a drawing")
        return Outlines(as_points_of(shape, name, axes))
    rings = [polygon.exterior, *polygon.interiors] if hasattr(polygon, "exterior") else [polygon]
    upright = [complex_in(_vertices(ring), _of_geometry(axes)) for ring in rings]
    return Outlines(upright[0], tuple(upright[1:]))


def flattening_of(shape: Any) -> Flattening | None:
    """Return the surface that a shape stands for: a flattening, or a mesh read from a file; None for other shapes."""
    domain = None if isinstance(shape, Curve) else getattr(shape, "domain", None)
    return next((candidate for candidate in (shape, domain) if isinstance(candidate, Flattening)), None)


def as_points_of(points: Any, name: str, axes: str = "xy", columns: int = 0) -> Any:
    """Convert complex points, or pairs in the given axes, to (n,) or (n, columns); also accepts OpenCV's (n, 1, 2).

    Other objects are returned unchanged.
    """
    if isinstance(points, Curve):
        return points.z
    geometry = points if hasattr(points, "geom_type") else None
    if geometry is not None:
        return complex_in(shapely.get_coordinates(geometry), _of_geometry(axes))
    try:
        array = np.asarray(points)
    except ValueError:
        array = np.empty(0, object)
    if array.dtype.kind not in "iuf" or not array.size:
        return points
    if array.ndim == 3 and array.shape[1:] == (1, 2) and not columns:
        array = array[:, 0]
    if axes == "xy" or array.shape[-1:] != (2,) or array.ndim != 2 + bool(columns):
        return as_complex(array, name, columns)
    return complex_in(array, axes)


def pins_of(pins: Any, axes: str = "xy") -> tuple[Any, Softness | None]:
    """Convert pins to complex points (k, 2), and return their softness; None if they are only pairs of points.

    Args:
        pins: pairs of points, or a sequence with `Pin` objects, as for `iccm.fit`.
        axes: meaning of pairs.
    """
    if pins is None:
        return None, None
    if not isinstance(pins, Sequence) or not any(isinstance(pin, Pin) for pin in pins):
        return as_points_of(pins, "pins", axes, 2), None
    listed = [pin if isinstance(pin, Pin) else Pin(*pin) for pin in pins]
    points = np.empty((len(listed), 2), np.complex128)
    for k, pin in enumerate(listed):
        for side, point in enumerate((pin.source, pin.target)):
            name = f"pin {k + 1}"
            points[k, side] = as_complex(as_points_of([point], name, axes), name)[0]
    return points, Softness.of(listed)


def refuse_non_sequences(**arguments: Any) -> None:
    """Raise an InputError for the first argument that cannot be a list of items."""
    for name, value in arguments.items():
        if not isinstance(value, Sized):
            raise InputError(f"{name}: {value!r} is not a list")


def strokes_of(strokes: Any, axes: str = "xy") -> tuple[Any, list[float]]:
    """Convert strokes to pairs of complex polylines, and return the widths of the bands around them.

    Items that are not pairs are returned unchanged; `Problem.of` rejects them.

    Args:
        strokes: pairs of polylines, or `Stroke` objects, as for `iccm.fit`.
        axes: meaning of pairs of numbers.
    """
    if strokes is None:
        return None, []
    pairs: list[Any] = []
    widths: list[float] = []
    for k, stroke in enumerate(strokes):
        sides: Any = (stroke.source, stroke.target) if isinstance(stroke, Stroke) else stroke
        is_pair = isinstance(sides, Sized) and len(sides) == 2
        pairs.append([as_points_of(side, f"stroke {k + 1}", axes) for side in sides] if is_pair else sides)
        widths.append(stroke.width if isinstance(stroke, Stroke) else 0.0)
    return pairs, widths


def _vertices(ring: Any) -> Real:
    """Return (n, 2) vertices of a ring, without the repeated first one at its end."""
    points = shapely.get_coordinates(ring)
    return points[:-1] if len(points) > 1 and (points[0] == points[-1]).all() else points


def _of_geometry(axes: str) -> str:
    """Return the axes of polygons' coordinates, which are always x and y."""
    return "xy" if axes == "xy" else "screen"


def drawing_of(shape: Any, name: str, axes: str = "xy") -> Drawing | None:
    """Return the whole drawing that a shape represents: several polygons, a list of rings, or a shape read from a file.

    Returns:
        The drawing; None for a single outline or polygon, and for surfaces.

    Raises:
        InputError: it has no area.
    """
    if isinstance(shape, Drawing):
        return shape
    if isinstance(shape, str | PathLike | Curve) or flattening_of(shape) is not None:
        return None
    if isinstance(getattr(shape, "drawing", None), Drawing):  # read from a file
        return shape.drawing
    if isinstance(getattr(shape, "curve", None), Curve):
        return None
    if isinstance(shape, list | tuple) and len(shape) and all(_is_ring(ring) for ring in shape):
        return Drawing.of_rings([np.asarray(outline_of(ring, name, axes).outline) for ring in shape], name)
    polygons = _polygons(shape, name)
    if polygons is None or len(polygons) < 2 or any(polygon.geom_type != "Polygon" for polygon in polygons):
        return None
    painted = close_hairlines(shapely.make_valid(shapely.union_all(polygons)))
    if _of_geometry(axes) == "screen":
        painted = shapely.transform(painted, lambda xy: xy * [1, -1])
    try:
        return Drawing(painted)
    except InputError as error:
        raise error.named(name) from None


def _is_ring(value: Any) -> bool:
    """Return whether a value is an outline: an array of at least three points, complex or pairs."""
    if not isinstance(value, np.ndarray):
        return False
    pairs = value.ndim == 2 and value.shape[1] == 2
    return len(value) > 2 and (pairs or (value.ndim == 1 and value.dtype.kind == "c"))


def _polygon(shape: Any, name: str) -> Any:
    """Return the polygon or ring of a shape as a shapely geometry; None for arrays.

    Raises:
        InputError: several polygons, or a geometry without area.
    """
    polygons = _polygons(shape, name)
    return None if polygons is None else _only(polygons, name)


def _polygons(shape: Any, name: str) -> list[Any] | None:
    """Return the polygons or rings of a shape as shapely geometries; None for arrays.

    Raises:
        InputError: a geometry without area.
    """
    if hasattr(shape, "polygons_full") and hasattr(shape, "entities"):  # trimesh's paths
        return list(shape.polygons_full)
    if hasattr(shape, "to_polygons") and hasattr(shape, "codes"):  # matplotlib's paths
        return _polygons_of_path(shape, name)
    if hasattr(shape, "iloc") and hasattr(shape, "geometry"):  # GeoSeries, GeoDataFrame and its rows
        geometry = shape.geometry
        if not hasattr(geometry, "iloc"):
            return _polygons(geometry, name)
        return [polygon for row in geometry for polygon in _polygons(row, name) or []]
    if not hasattr(shape, "geom_type"):
        mapping = shape if isinstance(shape, Mapping) else getattr(shape, "__geo_interface__", None)
        if mapping is None:
            return None
        if "geometry" in mapping:
            mapping = mapping["geometry"]
        try:
            shape = shapely.geometry.shape(mapping)
        except (AttributeError, KeyError, TypeError, ValueError, shapely.errors.ShapelyError) as error:
            raise InputError(f"{name}: not a valid GeoJSON geometry ({error})") from None
    if shape.geom_type in ("MultiPolygon", "GeometryCollection"):
        return [part for part in shape.geoms if part.geom_type == "Polygon"]
    if shape.geom_type not in ("Polygon", "LinearRing", "LineString"):
        raise InputError(f"{name}: a {shape.geom_type} has no outline; pass a polygon")
    if shape.is_empty:
        raise InputError(f"{name}: the {shape.geom_type} is empty")
    return [shape]


def _polygons_of_path(path: Any, name: str) -> list[Any]:
    """Return the polygons that a path of matplotlib encloses by the even-odd rule.

    Raises:
        InputError: it has no area.
    """
    # Curves are divided into pieces of about one unit, so that the path is enlarged first.
    size = float(np.ptp(path.vertices, axis=0).max()) if len(path.vertices) else 0.0
    if not (size > 0 and np.isfinite(size)):
        raise InputError(f"{name}: the path has no area")
    # Subclasses, such as TextPath, are made from other arguments than vertices and codes.
    base: Any = next(kind for kind in type(path).__mro__ if "to_polygons" in vars(kind))
    larger = base(path.vertices * (PATH_UNITS / size), path.codes)
    polygons = map(np.asarray, larger.to_polygons(closed_only=True))  # some are lists
    rings = [ring * (size / PATH_UNITS) for ring in polygons if len(ring) > 3]
    enclosed = shapely.Polygon()
    for ring in rings:
        enclosed = shapely.symmetric_difference(enclosed, shapely.make_valid(shapely.Polygon(ring)))
    parts = [
        part for part in shapely.get_parts(enclosed).tolist() if part.geom_type == "Polygon" and part.area
    ]
    if not parts:
        raise InputError(f"{name}: the path has no area")
    return parts


def _only(parts: Sequence[Any], name: str) -> Any:
    """Return the only item of a list of polygons.

    Raises:
        InputError: there are several, or none.
    """
    if len(parts) == 1:
        return parts[0]
    if not parts:
        raise InputError(f"{name}: contains no polygon")
    raise InputError(
        f"{name}: contains {len(parts)} polygons; pass one, such as the largest: max(parts, key=lambda p: p.area)"
    )
