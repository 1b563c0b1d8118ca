"""TopoJSON as GeoJSON: rings assembled from arcs that neighbours share (TopoJSON 1.0, section 2)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

MOST_NESTED_COLLECTIONS = 50  # levels of nested collections


def as_geojson(content: dict[str, Any]) -> dict[str, Any]:
    """Convert a topology to a feature collection; any other document is returned as it is.

    Raises:
        InputError: it refers to an arc that does not exist.
    """
    if content.get("type") != "Topology":
        return content
    transform = content.get("transform")
    arcs = [_arc(arc, transform) for arc in content["arcs"]]
    features = [
        _feature(geometry, arcs, str(name), 0)
        for name, geometry in content["objects"].items()
        if isinstance(geometry, dict)
    ]
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
    geometry: dict[str, Any], arcs: list[NDArray[np.float64]], name: str, depth: int
) -> dict[str, Any]:
    """Convert a geometry to a feature, or a geometry collection to a feature collection; `name` is its object's."""
    kind = geometry.get("type")
    if kind == "GeometryCollection" and depth < MOST_NESTED_COLLECTIONS:
        members = [_feature(member, arcs, "", depth + 1) for member in geometry["geometries"]]
        return {"type": "FeatureCollection", "features": members}
    converted: dict[str, Any] = {"type": kind, "coordinates": []}
    if kind in ("Polygon", "MultiPolygon"):
        polygons = [geometry["arcs"]] if kind == "Polygon" else geometry["arcs"]
        rings = [[_ring(ring, arcs) for ring in polygon] for polygon in polygons]
        converted["coordinates"] = rings[0] if kind == "Polygon" else rings
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
