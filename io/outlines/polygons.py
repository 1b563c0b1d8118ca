"""Polygons in JSON: GeoJSON features, y up, and annotations of pictures by labelme and COCO, in pixels."""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Complex, complex_of
from ...errors import InputError, first_names
from ...saved.georeference import Georeference
from .. import files, limits
from ..svg.drawing_content import DrawingContent
from . import antimeridian, layers, topology

NamedRings = tuple[tuple[str, ...], list[Complex], str]  # names, rings, and their fill rule
MEMBERS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
NAMES = ("name", "id", "label", "title", "class")
"""Names, or ends of names, of properties that name a feature."""
POLYGONS = {"Polygon", "MultiPolygon"}
LONGITUDE_LATITUDE = "EPSG:4326"
"""The system of GeoJSON (RFC 7946); for historical reasons, GIS write longitudes first under this name, too."""
URN_OF_LONGITUDE_LATITUDE = "urn:ogc:def:crs:OGC:1.3:CRS84", "urn:ogc:def:crs:OGC::CRS84"
NAMED_FEATURES = 5  # features named in a note at most
RECORD_SEPARATOR = b"\x1e \t\r"


def read(
    path: Path,
    selection: str | None = None,
    *,
    flatness: float = 1e-4,
    max_bytes: int = limits.GEOMETRY_BYTES,
) -> DrawingContent:
    """Return the polygons of a file, or those of the feature, label, category or picture called `selection`.

    Coordinates are used unchanged, without a projection. `flatness` is not used, since there are no curves.

    Raises:
        InputError: the JSON has no known structure, or no valid polygon.
    """
    content = _content(path, max_bytes)
    if not isinstance(content, dict):
        raise InputError(f"{path}: not GeoJSON, nor annotations of labelme or COCO")
    crs: str | None = None  # of GeoJSON
    try:
        if isinstance(content.get("shapes"), list):
            drawing = _canvas(content.get("imageWidth"), content.get("imageHeight"))
            polygons = _labelme(content)
        elif isinstance(content.get("annotations"), list):
            drawing, polygons = _coco(content, selection)
        elif isinstance(content.get("type"), str):
            drawing = DrawingContent([], None, flip=False)
            crs = _crs_of(content)
            polygons = _geojson(topology.as_geojson(content), drawing.notes)
        else:
            raise InputError("not GeoJSON, nor annotations of labelme or COCO")
        _fill(drawing, polygons, selection)
        if crs is not None:
            usual = LONGITUDE_LATITUDE if _in_degrees(drawing) else ""
            return replace(drawing, georeference=Georeference(crs=crs or usual))
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError, OverflowError) as error:
        reason = (
            str(error)
            if isinstance(error, InputError)
            else ("its polygons do not have the structure of this format")
        )
        raise InputError(f"{path}: {reason}") from None
    return drawing


def read_layer(
    path: Path, selection: str | None = None, *, flatness: float = 1e-4, max_bytes: int = 0
) -> DrawingContent:
    """Return the polygons of a layer of a GeoPackage, Shapefile or KML, or of its feature that `selection` names.

    The selection is `layer`, `layer#feature`, or `feature` if the file has one layer. `flatness` and `max_bytes` are
    not used.

    Raises:
        InputError: the layer cannot be read, or has no valid polygon.
    """
    name, _, feature = (selection or "").partition("#")
    layer = layers.read(path, name or None, or_only=True)
    chosen = feature or (name if name != layer.name else "") or None
    drawing = DrawingContent([], None, flip=False)
    try:
        _fill(drawing, _geojson(layer.content, drawing.notes), chosen)
    except InputError as error:
        raise error.named(path) from None
    if selection:
        drawing.ids[selection] = None
    usual = LONGITUDE_LATITUDE if _in_degrees(drawing) else ""
    return replace(drawing, georeference=Georeference(crs=layer.crs or usual))


def _in_degrees(drawing: DrawingContent) -> bool:
    """Return whether coordinates can be degrees; across 180°, longitudes increase beyond it."""
    return all(
        (np.abs(outline.z.real) <= 360).all() and (np.abs(outline.z.imag) <= 90).all()
        for outline in drawing.outlines
    )


def _crs_of(content: dict[str, Any]) -> str:
    """Return the coordinate reference system that GeoJSON names, as GDAL and QGIS write it; empty if it names none."""
    crs = content.get("crs")
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    if not isinstance(name, str):
        return ""
    if name in URN_OF_LONGITUDE_LATITUDE:
        return LONGITUDE_LATITUDE
    authority = re.fullmatch(r"urn:ogc:def:crs:EPSG:[\d.]*:(\d{1,6})|EPSG:(\d{1,6})", name)
    return f"EPSG:{authority[1] or authority[2]}" if authority else ""


def holds(path: Path) -> bool:
    """Return whether a JSON file contains polygons rather than constraints."""
    try:
        content = _content(path, limits.GEOMETRY_BYTES)
    except InputError:
        return False
    return isinstance(content, dict) and bool({"shapes", "annotations", "type"} & content.keys())


def _content(path: Path, max_bytes: int) -> Any:
    """Return a file's content as one document; lists of features (QuPath) and lines of features become collections.

    Raises:
        InputError: it is not JSON.
    """
    try:
        content = files.read_json(path, max_bytes=max_bytes)
    except InputError:
        features = _of_lines(path, max_bytes)
        if not features:
            raise
        content = features
    listed = isinstance(content, list) and content and all(isinstance(item, dict) for item in content)
    if listed and all("geometry" in item or "coordinates" in item for item in content):
        return {"type": "FeatureCollection", "features": content}
    return content


def _of_lines(path: Path, max_bytes: int) -> list[Any]:
    """Return the documents of a file with one per line (RFC 8142, GeoJSONL); empty if a line is not JSON."""
    lines = [
        line.strip(RECORD_SEPARATOR) for line in files.read_bytes(path, max_bytes=max_bytes).splitlines()
    ]
    try:
        return [files.parse_json(line) for line in lines if line]
    except InputError:
        return []


def _fill(drawing: DrawingContent, polygons: Iterator[NamedRings], selection: str | None) -> None:
    """Add the chosen outlines, or all, to the drawing, the largest first."""
    number = 0
    for names, rings, rule in polygons:
        number += 1
        drawing.ids.update(dict.fromkeys(names))
        if selection is not None and selection not in names:
            continue
        drawing.add(rings, rule, repr(names[0]) if names else f"polygon {number}", names)
    drawing.outlines.sort(key=lambda outline: -outline.area)
    if not number:
        raise InputError(f"contains no polygons{'; ' + drawing.notes[0] if drawing.notes else ''}")


def geometries(
    item: Any, feature: dict[str, Any] | None = None, depth: int = 0
) -> Iterator[tuple[Any, dict[str, Any] | None]]:
    """Yield every GeoJSON geometry that is not a collection, in order, with its feature.

    Objects that are neither features nor collections are yielded as well. Bounding boxes are removed from the document.

    Raises:
        InputError: a collection has no list of members.
    """
    kind = ""
    if isinstance(item, dict) and depth <= limits.COLLECTION_DEPTH:
        item.pop("bbox", None)
        kind = str(item.get("type"))
    if kind == "Feature":
        yield from geometries(item.get("geometry"), item, depth + 1)
    elif kind in MEMBERS:
        members = item.get(MEMBERS[kind])
        if not isinstance(members, list):
            raise InputError(f"not valid GeoJSON: a {kind} without members")
        for member in members:
            yield from geometries(member, feature, depth + 1)
    elif item is not None:
        yield item, feature


def _geojson(content: dict[str, Any], notes: list[str]) -> Iterator[NamedRings]:
    """Yield the polygons of features and geometries with their names; add notes on what was ignored or joined."""
    ignored: Counter[str] = Counter()
    joined = list[str]()
    for geometry, feature in geometries(content):
        kind = geometry["type"]
        if kind not in POLYGONS:
            ignored[f"{kind}"] += 1
            continue
        feature = feature or {}
        properties = (feature.get("properties") or {}).items()
        called = [feature.get("id"), *(value for key, value in properties if key.lower().endswith(NAMES))]
        names = tuple(dict.fromkeys(str(value) for value in called if isinstance(value, str | int)))
        polygon_coordinates = geometry["coordinates"] if kind == "MultiPolygon" else [geometry["coordinates"]]
        polygons = [[_ring(ring) for ring in rings] for rings in polygon_coordinates if rings]
        if not polygons:
            ignored[f"empty {kind}"] += 1
        united = antimeridian.joined(polygons)
        if united is not polygons:
            joined.append(names[0] if names else "a polygon without name")
        for rings in united:
            yield names, rings, "evenodd"
    if ignored:
        notes.append("left out " + ", ".join(f"{count} {kind}" for kind, count in ignored.items()))
    if joined:
        notes.append(f"{first_names(joined, NAMED_FEATURES)}: joined across the 180° meridian")


def _labelme(content: dict[str, Any]) -> Iterator[NamedRings]:
    """Yield the shapes that enclose an area."""
    for shape in content["shapes"]:
        kind, points = shape.get("shape_type", "polygon"), _ring(shape["points"])
        if kind == "rectangle":
            a, c = points
            points = np.array([a, complex(c.real, a.imag), c, complex(a.real, c.imag)])
        elif kind == "circle":
            middle, edge = points
            points = middle + abs(edge - middle) * np.exp(2j * np.pi * np.arange(256) / 256)
        elif kind != "polygon":
            continue
        yield (str(shape["label"]),), [points], "nonzero"


def _coco(content: dict[str, Any], selection: str | None) -> tuple[DrawingContent, Iterator[NamedRings]]:
    """Return all annotations, on the canvas of the picture that has those of the selection.

    Raises:
        InputError: several pictures have some.
    """
    pictures = {picture["id"]: picture for picture in content.get("images", [])}
    categories = {category["id"]: str(category["name"]) for category in content.get("categories", [])}
    polygons: list[tuple[Any, NamedRings]] = []
    runs = 0
    for annotation in content["annotations"]:
        picture_id, parts = annotation.get("image_id"), annotation["segmentation"]
        if not isinstance(parts, list):
            runs += 1
            continue
        names = (
            str(annotation.get("id", "")),
            categories.get(annotation.get("category_id"), ""),
            str(pictures.get(picture_id, {}).get("file_name", "")),
        )
        rings = [_sound(complex_of(np.asarray(part, float).reshape(-1, 2))) for part in parts]
        polygons.append((picture_id, (tuple(filter(None, names)), rings, "nonzero")))
    annotated = {key for key, (names, _, _) in polygons if selection is None or selection in names}
    if len(annotated) > 1:
        raise InputError(
            f"contains annotations of {len(annotated)} pictures; choose one, such as #{_name(pictures, annotated)}"
        )
    size = pictures.get(next(iter(annotated), None), {})
    drawing = _canvas(size.get("width"), size.get("height"))
    if runs:
        drawing.notes.append(
            f"ignored {runs} run-length encoded mask{'s' * (runs > 1)} (RLE); only polygons are read"
        )
    return drawing, (rings for _, rings in polygons)


def _name(pictures: dict[Any, Any], annotated: set[Any]) -> str:
    return str(pictures.get(min(annotated, key=str), {}).get("file_name", "file_name"))


def _canvas(width: Any, height: Any) -> DrawingContent:
    is_given = all(isinstance(size, int | float) and 0 < size < limits.SVG_NUMBER for size in (width, height))
    return DrawingContent([], (0.0, 0.0, float(width), float(height)) if is_given else None, flip=True)


def _ring(points: Any) -> Complex:
    return _sound(np.array([complex(float(point[0]), float(point[1])) for point in points]))


def _sound(z: Complex) -> Complex:
    if not (np.abs(z) <= limits.SVG_NUMBER).all():
        raise InputError("a vertex is not finite or too large")
    return z
