"""TopoJSON as GeoJSON: rings assembled from arcs that neighbours share (TopoJSON 1.0, section 2)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .. import limits


def as_geojson(content: dict[str, Any]) -> dict[str, Any]:
    """Convert a topology to a feature collection; any other document is returned as it is.

    Raises:
        InputError: it is not valid, or refers to an arc that does not exist.
    """
    if content.get("type") != "Topology":
        return content
    transform = content.get("transform")
    try:
        arcs = [_arc(arc, transform) for arc in content["arcs"]]
        features = [
            _feature(geometry, arcs, str(name), 0, transform)
            for name, geometry in content["objects"].items()
            if isinstance(geometry, dict)
        ]
    except InputError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError):
        raise InputError("not valid TopoJSON") from None
    return {"type": "FeatureCollection", "features": features}


def _arc(points: Any, transform: Any) -> NDArray[np.float64]:
    """Return (n, 2) points of an arc; in a quantized topology, they are stored as differences of integers."""
    arc = np.array([point[:2] for point in points], dtype=float).reshape(-1, 2)
    if transform is None:
        return arc
    return np.cumsum(arc, axis=0) * np.array(transform["scale"], float) + np.array(
        transform["translate"], float
    )


def _feature(
    geometry: dict[str, Any], arcs: list[NDArray[np.float64]], name: str, depth: int, transform: Any = None
) -> dict[str, Any]:
    """Convert a geometry to a feature, or a geometry collection to a feature collection; `name` is its object's."""
    kind = geometry.get("type")
    if kind == "GeometryCollection" and depth < limits.COLLECTION_DEPTH:
        members = [_feature(member, arcs, "", depth + 1, transform) for member in geometry["geometries"]]
        return {"type": "FeatureCollection", "features": members}
    converted: dict[str, Any] = {"type": kind, "coordinates": []}
    if kind in ("Polygon", "MultiPolygon"):
        polygons = [geometry["arcs"]] if kind == "Polygon" else geometry["arcs"]
        rings = [[_ring(ring, arcs) for ring in polygon] for polygon in polygons]
        converted["coordinates"] = rings[0] if kind == "Polygon" else rings
    elif kind in ("LineString", "MultiLineString"):
        lines = [geometry["arcs"]] if kind == "LineString" else geometry["arcs"]
        joined = [_ring(line, arcs) for line in lines]
        converted["coordinates"] = joined[0] if kind == "LineString" else joined
    elif kind in ("Point", "MultiPoint"):
        points = [geometry["coordinates"]] if kind == "Point" else geometry["coordinates"]
        moved = [_arc([point], transform)[0].tolist() + list(point[2:]) for point in points]
        converted["coordinates"] = moved[0] if kind == "Point" else moved
    elif kind is None:
        return {"type": "Feature", "properties": dict(geometry.get("properties") or {}), "geometry": None}
    properties = dict(geometry.get("properties") or {})
    if name and not properties:
        properties["name"] = name
    return {"type": "Feature", "id": geometry.get("id"), "properties": properties, "geometry": converted}


def _ring(numbers: list[int], arcs: list[NDArray[np.float64]]) -> list[list[float]]:
    """Return the points of a ring of arcs, each of which begins where the one before ends; ~k is arc k reversed."""
    points = list[list[float]]()
    for number in numbers:
        index = ~number if number < 0 else number
        if index >= len(arcs):
            raise InputError(f"refers to arc {index}, but there are only {len(arcs)} arcs")
        arc = arcs[index][::-1] if number < 0 else arcs[index]
        points += arc.tolist()[1 if points else 0 :]
    return points


def names_of(content: dict[str, Any]) -> list[str]:
    """Return the names of the objects that `as_geojson` converts, in order."""
    return [str(name) for name, geometry in content["objects"].items() if isinstance(geometry, dict)]


def of_features(content: dict[str, Any], features: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return a topology whose objects are features, each ring and line with a separate arc.

    Args:
        content: the original topology, from which `as_geojson` made the features.
        features: those of its objects that are left, by name; a collection is a feature collection.
    """
    arcs = list[Any]()
    objects = {name: _geometry(item, arcs, content["objects"][name]) for name, item in features.items()}
    kept = {
        key: value for key, value in content.items() if key not in ("transform", "bbox", "objects", "arcs")
    }
    return kept | {"objects": objects, "arcs": arcs}


def _geometry(
    item: dict[str, Any], arcs: list[Any], original: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Return the geometry of a feature or collection, with its lines added to the arcs."""
    if item["type"] == "FeatureCollection":
        members = [_geometry(feature, arcs) for feature in item["features"]]
        return {"type": "GeometryCollection", "geometries": members}
    geometry = item.get("geometry") or {"type": None}
    converted: dict[str, Any] = {"type": geometry["type"]}
    if original is None or original.get("properties"):
        converted["properties"] = item.get("properties") or {}
    if item.get("id") is not None:
        converted["id"] = item["id"]
    kind = str(geometry["type"])
    if kind.endswith("Point"):
        converted["coordinates"] = geometry["coordinates"]
    elif geometry["type"] is not None:
        depth = {"LineString": 0, "MultiLineString": 1, "Polygon": 1, "MultiPolygon": 2}[kind]
        converted["arcs"] = _numbered(geometry["coordinates"], depth, arcs)
    return converted


def _numbered(lines: Any, depth: int, arcs: list[Any]) -> list[Any]:
    """Add the lines in nested lists to the arcs, and return their numbers, nested in the same way."""
    if depth:
        return [_numbered(part, depth - 1, arcs) for part in lines]
    arcs.append(lines)
    return [len(arcs) - 1]
