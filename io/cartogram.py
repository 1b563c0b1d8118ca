"""Cartograms of the regions in a GeoJSON file."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from ..arrays import Real
from ..cartograms.method import Cartogram, cartogram, digits_for
from ..errors import InputError, first_names, naming
from . import files, formats, limits
from .outlines import topology
from .outlines.polygons import POLYGONS, geometries
from .projections import EqualArea
from .run.report import write as write_report

SCHEMA = "iccm.cartogram/1"
NAMED_REGIONS = 5  # largest number of names in a message
RAISED_RATIO = 1.02  # of a region's area to that in proportion to its value, above which a note is written
LARGEST_ERROR_SHARE = 0.02  # of a region's area: a larger difference ends with exit code 1
URN_OF_DEGREES = "CRS84"  # in names of the coordinate system of longitudes and latitudes


def write(
    path: str,
    output: str,
    *,
    by: str,
    values: str | None = None,
    key: str | None = None,
    max_points: int = 10000,
    save: str | None = None,
    report: str | None = None,
    force: bool = False,
    tell: Callable[[str], None] = lambda note: None,
) -> Cartogram:
    """Write the cartogram of the polygons in a GeoJSON file, and return it.

    Args:
        path: GeoJSON or TopoJSON with a feature for each region.
        output: the GeoJSON to write; properties of features are kept.
        by: the property, or the column of `values`, to which areas are proportional.
        values: a CSV file of values, with a header.
        key: the column of `values` that has the name of the property by which rows and features are matched.
        max_points: number of vertices to which borders are simplified.
        save: the saved map to write, for `iccm apply` to layers in the same coordinates.
        report: the report to write.
        force: whether existing files may be replaced.
        tell: called with each note.

    Raises:
        InputError: a file or a value is invalid.
    """
    formats.check_report(report)
    output_paths = [name for name in (output, save, report) if name not in (None, "-")]
    files.check_outputs(output_paths, [path, *([values] if values else [])], force=force)
    if [output, save, report].count("-") > 1 or save == "-":
        raise InputError(
            "-: only the cartogram or the report can be written to stdout; name files for the others"
        )
    if save and not formats.of(save).map:
        raise InputError(f"{save}: a saved map; choose a name that ends in .npz")
    if output != "-" and Path(output).suffix.lower() not in (".geojson", ".json"):
        raise InputError(f"{output}: a cartogram is GeoJSON; choose a name that ends in .geojson")
    if key is not None and values is None:
        raise InputError(
            "--key: has no effect, because values are read from the regions; name a table with --values"
        )
    with naming(path):
        content = topology.as_geojson(_content(path))
        features = _features(content, tell)
    if values is not None:
        _join(features, values, key, by)
    numbers = _numbers(path, features, by, tell)
    with naming(path):
        shapes = [_polygons(feature) for feature in features]
        is_degrees = _is_in_degrees(content, shapes)
        if save and is_degrees:
            raise InputError(
                "--save: longitudes and latitudes are projected first, so the map would not take layers in degrees; "
                "export the file with a projected coordinate system"
            )
        projection = EqualArea.of(shapes) if is_degrees else None
        shapes = [_valid(shape, feature) for shape, feature in zip(shapes, features)]
        if projection is not None:
            projected = [projection.project(shape) for shape in shapes]
            shapes = [_valid(shape, feature) for shape, feature in zip(projected, features)]
        result = cartogram(shapes, numbers, max_points)
    shares = numbers / np.nansum(numbers)
    raised = (numbers > 0) & (
        result.target_areas > RAISED_RATIO * shares * result.target_areas[~np.isnan(numbers)].sum()
    )
    if raised.any():
        tell(
            f"{path}: {by} of {_listed(features, raised)} is too small to be visible; they have the least area"
        )
    for feature, region in zip(features, result.regions(digits_for(result.image))):
        feature["geometry"] = shapely.geometry.mapping(region)
    members = {name: value for name, value in content.items() if name not in ("features", "bbox", "type")}
    if projection is not None:
        members["crs"] = {"type": "name", "properties": {"name": projection.name}}
    collection = {"type": "FeatureCollection", **members, "features": features}
    figures = _report(path, by, result, features, projection)
    with ExitStack() as stack:
        written = stack.enter_context(files.writing(output, force=force, suffix=".geojson"))
        written.write_text(json.dumps(collection, ensure_ascii=False) + "\n", encoding="utf-8")
        if save:
            result.fit().save(stack.enter_context(files.writing(save, force=force)))
        if report:
            write_report(figures, report, stack, force=force)
    return result


def _content(path: str) -> dict[str, Any]:
    content = files.parse_json(files.read_bytes(path, max_bytes=limits.GEOMETRY_BYTES))
    if not isinstance(content, dict) or not isinstance(content.get("type"), str):
        raise InputError("not GeoJSON; iccm cartogram reads features with polygons")
    return content


def _features(content: dict[str, Any], tell: Callable[[str], None]) -> list[dict[str, Any]]:
    """Return copies of the features with polygons."""
    features, ignored = list[dict[str, Any]](), 0
    by_feature = dict[int, int]()
    for geometry, feature in geometries(content):
        kind = str(geometry.get("type")) if isinstance(geometry, dict) else ""
        if feature is None or kind not in POLYGONS or not (coordinates := geometry.get("coordinates")):
            ignored += 1
            continue
        if not isinstance(coordinates, list):
            raise InputError(f"{kind}: the coordinates are not a list")
        parts = list(coordinates) if kind == "MultiPolygon" else [coordinates]
        if id(feature) in by_feature:
            features[by_feature[id(feature)]]["geometry"]["coordinates"] += parts
            continue
        by_feature[id(feature)] = len(features)
        properties = feature.get("properties")
        copy = {**feature, "properties": dict(properties) if isinstance(properties, dict) else {}}
        features.append({**copy, "geometry": {"type": "MultiPolygon", "coordinates": parts}})
    if not features:
        raise InputError("contains no features with polygons")
    if ignored:
        tell(f"left out {ignored} geometries that are not polygons of a feature")
    return features


def _polygons(feature: dict[str, Any]) -> shapely.Geometry:
    """Return the polygons of a feature as one geometry.

    Raises:
        InputError: they do not have the structure of GeoJSON.
    """
    try:
        parts = []
        for polygon in feature["geometry"]["coordinates"]:
            rings = [[position[:2] for position in ring] for ring in polygon]
            parts.append(shapely.Polygon(rings[0], rings[1:]) if rings else shapely.Polygon())
        xy = shapely.get_coordinates(np.array(parts))
    except (TypeError, ValueError, IndexError, LookupError, AttributeError, shapely.errors.ShapelyError):
        raise InputError(f"{_name(feature)}: not polygons as GeoJSON describes them") from None
    if not (np.abs(xy) <= limits.SVG_NUMBER).all():
        raise InputError(f"{_name(feature)}: a vertex is not finite or too large")
    return shapely.MultiPolygon(parts)


def _valid(shape: shapely.Geometry, feature: dict[str, Any]) -> shapely.Geometry:
    """Return the polygons of a region with crossings repaired."""
    if not shape.is_valid:
        shape = shapely.make_valid(shape, method="structure")
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon" and part.area > 0]
    if not parts:
        raise InputError(f"{_name(feature)}: has no area")
    return shapely.union_all(parts)


def _is_in_degrees(content: dict[str, Any], shapes: Sequence[shapely.Geometry]) -> bool:
    """Return whether coordinates are longitudes and latitudes.

    They are unless the file names another coordinate system, or they are out of range."""
    crs = content.get("crs")
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    if isinstance(name, str) and not (URN_OF_DEGREES in name or name.endswith(":4326")):
        return False
    xy = np.abs(shapely.get_coordinates(np.array(shapes)))
    return bool((xy <= (360, 90 + 1e-6)).all())


def _join(features: list[dict[str, Any]], path: str, key: str | None, by: str) -> None:
    """Add a column of a CSV file to the properties of features.

    Raises:
        InputError: the columns do not exist, or a value of the key occurs twice.
    """
    text = files.read_bytes(path, max_bytes=limits.GEOMETRY_BYTES).decode("utf-8-sig", errors="replace")
    try:
        rows = list(csv.DictReader(io.StringIO(text)))
    except csv.Error as error:
        raise InputError(f"{path}: not a CSV table: {error}") from None
    columns = [name for name in (rows[0] if rows else {}) if name]
    key = key or (columns[0] if columns else "")
    for name in (key, by):
        if name not in columns:
            raise InputError(
                f"{path}: no column {name!r}; there are {', '.join(map(repr, columns)) or 'none'}"
            )
    if not any(key in feature["properties"] for feature in features):
        names = _property_names(features)
        raise InputError(f"--key {key}: no feature has this property; there are {', '.join(names) or 'none'}")
    table = dict[str, Any]()
    for row in rows:
        if row[key] in table:
            raise InputError(f"{path}: {row[key]!r} occurs twice in the column {key!r}")
        table[row[key]] = row[by]
    for feature in features:
        feature["properties"][by] = _number(table.get(str(feature["properties"].get(key))))


def _number(value: Any) -> Any:
    """Return text of a number as a number, and anything else unchanged; empty text is None."""
    if not isinstance(value, str):
        return value
    text = value.strip().replace(",", "") if value.count(",") else value.strip()
    try:
        number = float(text)
    except ValueError:
        return None if text.lower() in ("", "na", "nan", "null") else value
    return int(number) if number.is_integer() and abs(number) < 2**53 else number


def _property_names(features: Sequence[dict[str, Any]]) -> list[str]:
    return list(dict.fromkeys(str(name) for feature in features for name in feature["properties"]))


def _numbers(path: str, features: Sequence[dict[str, Any]], by: str, tell: Callable[[str], None]) -> Real:
    """Return (r,) the values of a property, NaN where it is missing.

    Raises:
        InputError: no feature has it, or values are text, negative, or all zero.
    """
    if not any(by in feature["properties"] for feature in features):
        usable = [
            name
            for name in _property_names(features)
            if any(_is_number(_number(feature["properties"].get(name))) for feature in features)
        ]
        listed = ", ".join(usable) or "none"
        raise InputError(f"{path}: no feature has a property {by!r}; properties with numbers: {listed}")
    values = [_number(feature["properties"].get(by)) for feature in features]
    wrong = [(feature, v) for feature, v in zip(features, values) if v is not None and not _is_number(v)]
    if wrong:
        feature, value = wrong[0]
        raise InputError(f"{path}: {by} of {_name(feature)} is {str(value)[:40]!r}, not a number")
    numbers = np.array([math.nan if value is None else float(value) for value in values])
    if (numbers < 0).any():
        raise InputError(f"{path}: {by} of {_listed(features, numbers < 0)} is negative")
    if not np.nansum(numbers) > 0:
        raise InputError(f"{path}: {by} is zero or missing everywhere")
    if np.isnan(numbers).any():
        tell(f"{path}: without {by}, {_listed(features, np.isnan(numbers))} keep the mean density")
    if (numbers == 0).any():
        tell(f"{path}: {by} of {_listed(features, numbers == 0)} is 0; they have the least area")
    return numbers


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def _name(feature: dict[str, Any]) -> str:
    """Return a name for a feature in messages."""
    properties = feature["properties"]
    for name, value in properties.items():
        if str(name).lower().endswith("name") and isinstance(value, str) and value:
            return value
    return str(feature.get("id") or next((v for v in properties.values() if isinstance(v, str)), "a feature"))


def _listed(features: Sequence[dict[str, Any]], is_listed: Any) -> str:
    """Return the names of some of the features (r,) for a message."""
    names = [_name(feature) for feature, is_named in zip(features, is_listed) if is_named]
    return first_names(names, NAMED_REGIONS)


def _report(
    path: str, by: str, result: Cartogram, features: Sequence[dict[str, Any]], projection: EqualArea | None
) -> dict[str, Any]:
    mean, p95 = result.dilatations
    worst = int(np.argmax(result.errors))
    return {
        "schema": SCHEMA,
        "input": path,
        "by": by,
        "regions": len(features),
        "crs": None if projection is None else projection.name,
        "area_error": {
            "max": float(result.errors.max()),
            "mean": float(result.errors.mean()),
            "worst": _name(features[worst]),
        },
        "dilatation": {"mean": float(mean), "p95": float(p95)},
        "folds": result.folds,
        "certified": bool(result.map.injectivity.certified),
        "vertices": int(result.mesh.z.size),
        "steps": result.steps,
    }
