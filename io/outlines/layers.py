"""Layers of GeoPackage, Shapefile, KML and FlatGeobuf as GeoJSON, read and written by pyogrio, which is an extra."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from ...errors import InputError
from .. import extras, files, formats, limits
from ..isolated import process, readers

DRIVERS = {".gpkg": "GPKG", ".shp": "ESRI Shapefile", ".kml": "KML", ".fgb": "FlatGeobuf"}
BEGINNINGS = {".gpkg": b"SQLite format 3\0", ".shp": b"\0\0\x27\x0a", ".kml": b"<", ".fgb": b"fgb"}
"""What files of these formats begin with: other content is not handed to GDAL, which would choose a reader by it."""
COMPANIONS = {".shp": (".shx", ".dbf", ".prj", ".cpg")}
"""Suffixes of the further files of a format."""


@dataclass(frozen=True, eq=False)
class Layer:
    """A layer of features.

    Attributes:
        content: GeoJSON, whose features have their numbers as ids.
        name: of the layer.
        others: names of the other layers of the file.
        crs: its coordinate reference system, such as "EPSG:25832"; empty if it is not stated.
        fields: names of its columns.
        columns: their values.
        kind: type of its geometries, as OGR names it.
    """

    content: dict[str, Any]
    name: str
    others: tuple[str, ...]
    crs: str
    fields: list[str]
    columns: list[Any]
    kind: str


def read(path: Path, layer: str | None = None, *, or_only: bool = False) -> Layer:
    """Read a layer; the name may be left out if the file has only one.

    GDAL reads the file in a separate process, see `readers.layers`.

    Args:
        path: the file.
        layer: the name of the layer.
        or_only: whether the only layer of the file is read if it has another name.

    Raises:
        InputError: pyogrio is not installed, the file is damaged, or the layer is not named or does not exist.
    """
    extras.require(f"{path}: reading it", "pyogrio")
    suffix = formats.suffix_of(path)
    files.open_input(path, max_bytes=limits.GEOMETRY_BYTES)
    with files.opened(path) as file:
        beginning = file.read(64).removeprefix(b"\xef\xbb\xbf").lstrip(b"" if suffix != ".kml" else None)
    if not beginning.startswith(BEGINNINGS[suffix]):
        raise InputError(f"{path}: is not a {DRIVERS[suffix]} file")
    beside = [path.with_suffix(more) for more in COMPANIONS.get(suffix, ())]
    if absent := [name for name in beside[:2] if not name.is_file()]:
        raise InputError(f"{path}: {absent[0].name} is missing, which belongs to it")
    read = process.read(path, readers.layers, beside=beside, layer=layer)
    names, name = read["names"], read["name"]
    if name is None or (layer is not None and layer != name and not or_only):
        listed = ", ".join(names[:12]) or "no layers with geometries"
        what = f"has no layer {layer!r}" if layer else "has several layers; choose one with #layer"
        raise InputError(f"{path}: {what}: {listed}")
    columns = [np.array(column, object) if isinstance(column, list) else column for column in read["columns"]]
    starts, data = read["starts"].tolist(), read["geometries"].tobytes()
    shapes = shapely.from_wkb([data[a:b] or None for a, b in pairwise(starts)], on_invalid="ignore")
    features = [
        {
            "type": "Feature",
            "id": number,
            "properties": {field: _plain(column[number]) for field, column in zip(read["fields"], columns)},
            "geometry": None if shape is None else _listed(shapely.geometry.mapping(shape)),
        }
        for number, shape in enumerate(shapes)
    ]
    others = tuple(other for other in names if other != name)
    content = {"type": "FeatureCollection", "features": features}
    return Layer(content, name, others, read["crs"], read["fields"], columns, read["kind"])


def write(layer: Layer, path: Path) -> None:
    """Write the features that are left in a layer's content, with their columns, as a file with this only layer.

    Raises:
        InputError: the format cannot hold them.
    """
    features = layer.content["features"]
    rows = np.array([feature["id"] for feature in features], dtype=int)
    shapes = [shapely.geometry.shape(f["geometry"]) if f["geometry"] else None for f in features]
    kind = layer.kind.removesuffix(" Z").removeprefix("2.5D ")
    if kind in ("Point", "LineString", "Polygon") and any(
        shape is not None and shape.geom_type.startswith("Multi") for shape in shapes
    ):
        kind = f"Multi{kind}"
    pyogrio = extras.load(f"{path}: writing it", "pyogrio", "raw")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            pyogrio.raw.write(
                path,
                shapely.to_wkb(np.array(shapes, dtype=object)),
                [column[rows] for column in layer.columns],
                layer.fields,
                geometry_type=kind,
                crs=layer.crs or None,
                layer=layer.name,
                driver=DRIVERS[formats.suffix_of(path)],
                promote_to_multi=kind.startswith("Multi"),
            )
    except Exception as error:  # of many kinds
        raise InputError(f"{path}: cannot be written: {str(error).splitlines()[0][:120]}") from None


def _plain(value: Any) -> Any:
    """Return a value of a column as one of JSON."""
    value = value.item() if isinstance(value, np.generic) else value
    return value if isinstance(value, str | int | float | bool) or value is None else str(value)


def _listed(value: Any) -> Any:
    """Return nested tuples as lists, as in JSON, also inside dictionaries."""
    if isinstance(value, dict):
        return {key: _listed(item) for key, item in value.items()}
    return [_listed(item) for item in value] if isinstance(value, tuple | list) else value
