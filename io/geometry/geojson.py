"""GeoJSON (RFC 7946) with coordinates in any plane, and lists of landmarks in JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...arrays import Complex
from ...errors import InputError
from ..files import parse_json
from ..outlines import topology
from ..outlines.polygons import geometries
from ..point_syntax import coordinate
from .document import Geometry, Images, TextDocument

SEPARATOR = b"\x1e"  # of records (RFC 8142)
NUCLEUS = "nucleusGeometry"  # of a cell in files of QuPath
SIMPLE = {"Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon"}
"""Types of geometries with coordinates."""
FORMS = {".geojson": "", ".geojsonl": "lines", ".geojsons": "records"}
"""The form that each suffix stands for."""
TYPES = {*SIMPLE, "GeometryCollection", "Feature", "FeatureCollection"}


@dataclass
class GeoJson(TextDocument):
    """GeoJSON, or a list or object of points, which are pairs or have members x and y.

    Attributes:
        content: the document; lines of features, bare lists of features and topologies as a feature collection.
        geometry: its geometry.
        form: how the content was written: "lines", "records" (with separators), "list", "topology" or "" for itself.
        topology: the original document of a topology.
        objects: its objects as features, by name.
    """

    content: Any
    geometry: Geometry
    notes: tuple[str, ...] = ()
    form: str = ""
    topology: dict[str, Any] | None = None
    objects: dict[str, dict[str, Any]] = field(default_factory=dict)

    @classmethod
    def parse(cls, data: bytes, columns: str | None) -> GeoJson:
        """Parse GeoJSON in any of its forms, TopoJSON, or landmarks, depending on the content."""
        form, topology_document = "", None
        try:
            content = parse_json(data)
        except InputError:
            if not (features := _of_lines(data)):
                raise
            content = {"type": "FeatureCollection", "features": features}
            form = "records" if data.lstrip().startswith(SEPARATOR) else "lines"
        if _is_list_of_features(content):
            content, form = {"type": "FeatureCollection", "features": content}, "list"
        elif isinstance(content, dict) and content.get("type") == "Topology":
            topology_document, form = content, "topology"
            content = topology.as_geojson(content)
        document = cls.of(content)
        document.form, document.topology = form, topology_document
        if topology_document:
            document.objects = dict(zip(topology.names_of(topology_document), content["features"]))
        if form == "topology":
            document.notes += ("arcs are written for each geometry, without sharing or quantization",)
        return document

    @classmethod
    def of(cls, content: Any) -> GeoJson:
        """Return a document of parsed JSON.

        Raises:
            InputError: it is neither GeoJSON nor a list of points, or has no geometry.
        """
        collected = _Found()
        if _is_geojson(content):
            names = []
            for geometry, feature in _with_nuclei(content):
                old_count = len(collected.points)
                collected.take(_simple(geometry))
                count = len(collected.points) - old_count
                names += [_name(feature)] if count == 1 else [""] * count
        else:
            marks = _landmarks(content)
            names = [name for _, _, name in marks]
            for holder, key, _ in marks:
                collected.points.append(_pair(holder[key]))
        if not (collected.points or collected.lines or collected.polygons):
            raise InputError("contains no points, lines or polygons")
        notes = ("heights of lines and polygons are dropped",) if collected.heights else ()
        return cls(
            content,
            Geometry(np.array(collected.points, complex), collected.lines, collected.polygons, names),
            notes,
        )

    def convert(self, suffix: str) -> None:
        """Choose a collection, lines or records by the suffix; other forms are kept in `.json`.

        Raises:
            InputError: the suffix is that of TopoJSON, and the content is not a topology.
        """
        if suffix == ".topojson" and self.topology is None:
            raise InputError(
                "GeoJSON is not converted to TopoJSON; choose a name that ends in .geojson for the output"
            )
        if suffix in FORMS:
            self.form, self.topology = FORMS[suffix], None

    def text(self, images: Images) -> str:
        """Return the document with the coordinates of the images, in the form that it was written in."""
        content = self.mapped(images)
        if self.form in ("lines", "records"):
            start = "\x1e" if self.form == "records" else ""
            is_collection = isinstance(content, dict) and content.get("type") == "FeatureCollection"
            lines = content["features"] if is_collection else [content]
            return "".join(f"{start}{json.dumps(line, ensure_ascii=False)}\n" for line in lines)
        if self.topology is not None:
            left = {id(feature) for feature in content["features"]}
            named = {name: feature for name, feature in self.objects.items() if id(feature) in left}
            content = topology.of_features(self.topology, named)
        content = content["features"] if self.form == "list" else content
        return json.dumps(content, ensure_ascii=False, indent=None if len(images.points) > 1000 else 1) + "\n"

    def mapped(self, images: Images) -> Any:
        """Return the content with the coordinates of the images."""
        points = iter(images.points.tolist())
        if _is_geojson(self.content):
            images_in_order = _Given(points, iter(images.lines), iter(images.polygons))
            for geometry in _geometries(self.content):
                images_in_order.give(geometry)
            content = self.content if images.keep else _dropped(self.content)
        else:
            content = self.content
            deleted: list[tuple[Any, Any]] = []
            for holder, key, _ in _landmarks(content):
                z = next(points)
                if z == z:
                    holder[key] = _moved(holder[key], z)
                elif images.keep:
                    holder[key] = _moved(holder[key], None)
                else:
                    deleted.append((holder, key))
            for holder, key in reversed(deleted):
                del holder[key]
            if deleted and isinstance(content, dict) and isinstance(content.get("shapes"), list):
                content["shapes"] = [shape for shape in content["shapes"] if shape.get("points") != []]
        return content


class _Found:
    """Collects the geometry of a document in order."""

    def __init__(self) -> None:
        self.points: list[complex] = []
        self.lines: list[Complex] = []
        self.polygons: list[list[Complex]] = []
        self.heights = False

    def take(self, geometry: dict[str, Any]) -> None:
        kind, coordinates = geometry["type"], geometry.get("coordinates")
        if coordinates is None or coordinates == []:
            return
        parts = coordinates if kind.startswith("Multi") else [coordinates]
        if not isinstance(parts, list):
            raise InputError(f"{kind}: the coordinates are not a list")
        if kind.endswith("Point"):
            self.points += [_pair(part) for part in parts]
        elif kind.endswith("LineString"):
            self.lines += [self._line(part, 2, kind) for part in parts]
        else:
            self.polygons += [[self._ring(ring, kind) for ring in self._rings(part, kind)] for part in parts]

    def _rings(self, part: Any, kind: str) -> list[Any]:
        if not isinstance(part, list) or not part:
            raise InputError(f"{kind}: a polygon has no rings")
        return part

    def _ring(self, ring: Any, kind: str) -> Complex:
        z = self._line(ring, 4, kind)
        if z[0] != z[-1]:
            raise InputError(f"{kind}: a ring is not closed (its first and last positions differ)")
        return z[:-1]

    def _line(self, line: Any, least: int, kind: str) -> Complex:
        if not isinstance(line, list) or len(line) < least:
            raise InputError(f"{kind}: a line or ring has fewer than {least} positions")
        self.heights |= any(isinstance(position, list) and len(position) > 2 for position in line)
        z = np.array([_pair(position) for position in line], complex)
        if np.isnan(z).any():
            raise InputError(f"{kind}: a position is null, which is only possible for points")
        return z


@dataclass
class _Given:
    """Assigns images to geometries, in the same order."""

    points: Iterator[complex]
    lines: Iterator[list[Complex]]
    polygons: Iterator[list[list[Complex]]]

    def give(self, geometry: dict[str, Any]) -> None:
        kind, old_coordinates = geometry["type"], geometry.get("coordinates")
        if old_coordinates is None or old_coordinates == []:
            return
        parts = old_coordinates if kind.startswith("Multi") else [old_coordinates]
        if kind.endswith("Point"):
            coordinates = [_moved(part, z) for part in parts if (z := next(self.points)) == z]
        elif kind.endswith("LineString"):
            coordinates = [_positions(z) for _ in parts for z in next(self.lines) if z.size > 1]
        else:
            coordinates = [
                [_positions(np.append(ring, ring[0])) for ring in rings]
                for _ in parts
                for rings in next(self.polygons)
            ]
        single = kind.removeprefix("Multi")
        many = kind.startswith("Multi") or len(coordinates) > 1
        geometry["type"] = f"Multi{single}" if many else single
        geometry["coordinates"] = coordinates
        if not many and coordinates:
            geometry["coordinates"] = coordinates[0]


def _is_list_of_features(content: Any) -> bool:
    """Return whether a document is a bare list of features or geometries, as QuPath writes it."""
    return (
        isinstance(content, list)
        and bool(content)
        and all(isinstance(item, dict) and ("geometry" in item or "coordinates" in item) for item in content)
    )


def _of_lines(data: bytes) -> list[Any]:
    """Return the documents of a file with one per line (GeoJSONL, RFC 8142); empty if a line is not JSON."""
    lines = [line.strip(SEPARATOR + b" \t\r") for line in data.splitlines()]
    try:
        return [parse_json(line) for line in lines if line]
    except InputError:
        return []


def _is_geojson(content: Any) -> bool:
    return isinstance(content, dict) and str(content.get("type")) in TYPES


def _geometries(content: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield every geometry with coordinates in order; bounding boxes, which become invalid, are removed."""
    for geometry, _ in _with_nuclei(content):
        yield _simple(geometry)


def _with_nuclei(content: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every geometry of a document with its feature, also the nuclei that QuPath writes beside its cells."""
    for geometry, feature in geometries(content):
        yield geometry, feature
        if isinstance(feature, dict) and feature.get("geometry") is geometry and feature.get(NUCLEUS):
            yield feature[NUCLEUS], feature


def _simple(geometry: Any) -> dict[str, Any]:
    """Return a geometry with coordinates.

    Raises:
        InputError: it is something else.
    """
    if not _is_geojson(geometry) or geometry["type"] not in SIMPLE:
        raise InputError("not valid GeoJSON: it contains an object that is neither a feature nor a geometry")
    return geometry


def _name(feature: Any) -> str:
    """Return the name among the properties of a feature, or ""."""
    properties = feature.get("properties") if isinstance(feature, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    return name if isinstance(name, str) else ""


def _dropped(item: Any) -> Any:
    """Return the content without geometries that have become empty, and without features left without any."""
    kind = item["type"]
    if kind == "FeatureCollection":
        kept = []
        for feature in item["features"]:
            if isinstance(feature, dict) and feature.get("type") in (
                "FeatureCollection",
                "GeometryCollection",
            ):
                kept.append(_dropped(feature))
            elif feature is not None and _holds(feature.get("geometry", feature)):
                if not _holds(feature.get(NUCLEUS)):
                    del feature[NUCLEUS]
                kept.append(feature)
        item["features"] = kept
    return item


def _holds(geometry: Any) -> bool:
    if geometry is None:
        return True  # it had no position before
    if geometry["type"] == "GeometryCollection":
        geometry["geometries"] = [part for part in geometry["geometries"] if _holds(part)]
        return bool(geometry["geometries"])
    return geometry.get("coordinates", []) != []


def _landmarks(content: Any) -> list[tuple[Any, Any, str]]:
    """Return container, key and name of each point in JSON that is not GeoJSON.

    The points are annotations of labelme, or the members of a list or an object: of the content itself, or of its only
    member that has points only.
    """
    landmarks = _labelled_points(content) or _members(content)
    if landmarks is None and isinstance(content, dict):
        inner = [members for value in content.values() if (members := _members(value))]
        landmarks = inner[0] if len(inner) == 1 else None
    if landmarks is None:
        raise InputError('not GeoJSON, nor a list of points ([x, y] or {"x": …, "y": …})')
    return landmarks


def _labelled_points(content: Any) -> list[tuple[Any, Any, str]]:
    """Return the places of the points that labelme annotates; shapes of other types stay as they are."""
    shapes = content.get("shapes") if isinstance(content, dict) else None
    return [
        (shape["points"], 0, str(shape.get("label", "")))
        for shape in (shapes if isinstance(shapes, list) else [])
        if isinstance(shape, dict)
        and shape.get("shape_type") == "point"
        and isinstance(shape.get("points"), list)
        and len(shape["points"]) == 1
        and _is_point(shape["points"][0])
    ]


def _members(content: Any) -> list[tuple[Any, Any, str]] | None:
    """Return container, key and name of each point of a list or object of points; None if it is something else."""
    if isinstance(content, list):
        keys: list[Any] = list(range(len(content)))
    elif isinstance(content, dict):
        keys = list(content)
    else:
        return None
    if not keys or not all(_is_point(content[key]) for key in keys):
        return None
    return [(content, key, _name_of_member(content[key], key)) for key in keys]


def _name_of_member(item: Any, key: Any) -> str:
    """Return the name of a point: its key in an object, or what it says itself."""
    if isinstance(key, str):
        return key
    name = item.get("name", item.get("label")) if isinstance(item, dict) else None
    return name if isinstance(name, str) else ""


def _is_point(item: Any) -> bool:
    if isinstance(item, dict):
        return {"x", "y"} <= item.keys() and all(_is_coordinate(item[name]) for name in "xy")
    return isinstance(item, list) and len(item) in (2, 3) and all(map(_is_coordinate, item))


def _is_coordinate(item: Any) -> bool:
    return item is None or (isinstance(item, int | float) and not isinstance(item, bool))


def _pair(position: Any) -> complex:
    """Return a position as x + iy; NaN for null."""
    if isinstance(position, dict) and {"x", "y"} <= position.keys():
        position = [position["x"], position["y"]]
    if not isinstance(position, list) or len(position) < 2 or not all(map(_is_coordinate, position[:2])):
        raise InputError(f"{json.dumps(position)[:60]} is not a position")
    if None in position[:2]:
        return complex(np.nan, np.nan)
    x, y = (coordinate(str(value), "a position") for value in position[:2])
    return complex(x, y)


def _moved(position: Any, z: complex | None) -> Any:
    x, y = (None, None) if z is None else (z.real, z.imag)
    return position | {"x": x, "y": y} if isinstance(position, dict) else [x, y, *position[2:]]


def _positions(z: Complex) -> list[list[float]]:
    return np.column_stack([z.real, z.imag]).tolist()
