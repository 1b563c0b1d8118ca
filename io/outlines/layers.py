"""Layers of GeoPackage, Shapefile, KML and FlatGeobuf as GeoJSON, read and written by pyogrio, which is an extra."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import shapely

from ...errors import InputError
from .. import extras, files, formats, limits

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


def read(path: Path, layer: str | None = None) -> Layer:
    """Read a layer; the name may be left out if the file has only one.

    Raises:
        InputError: pyogrio is not installed, the file is damaged, or the layer is not named or does not exist.
    """
    names = names_of(path)
    if layer is None and len(names) == 1:
        layer = names[0]
    if layer not in names:
        listed = ", ".join(names[:12]) or "no layers with geometries"
        what = f"has no layer {layer!r}" if layer else "has several layers; choose one with #layer"
        raise InputError(f"{path}: {what}: {listed}")
    with _gdal(path, "read") as pyogrio:
        meta, _, shapes, columns = pyogrio.raw.read(path, layer=layer)
    fields = [str(name) for name in meta["fields"]]
    features = []
    for number, geometry in enumerate(shapely.from_wkb(shapes, on_invalid="ignore")):
        properties = {name: _plain(column[number]) for name, column in zip(fields, columns)}
        features.append(
            {
                "type": "Feature",
                "id": number,
                "properties": properties,
                "geometry": None if geometry is None else _listed(shapely.geometry.mapping(geometry)),
            }
        )
    others = tuple(name for name in names if name != layer)
    content = {"type": "FeatureCollection", "features": features}
    return Layer(
        content, layer, others, meta["crs"] or "", fields, list(columns), meta["geometry_type"] or "Unknown"
    )


def names_of(path: Path) -> list[str]:
    """Return the names of a file's layers with geometries.

    Raises:
        InputError: pyogrio is not installed, or the file is damaged.
    """
    with _gdal(path, "read") as pyogrio:
        suffix = formats.suffix_of(path)
        files.open_input(path, max_bytes=limits.GEOMETRY_BYTES)
        with files.opened(path) as file:
            beginning = file.read(64).removeprefix(b"\xef\xbb\xbf").lstrip(b"" if suffix != ".kml" else None)
        if not beginning.startswith(BEGINNINGS[suffix]):
            raise InputError(f"{path}: is not a {DRIVERS[suffix]} file")
        missing = [path.with_suffix(more) for more in COMPANIONS.get(suffix, ())[:2]]
        if absent := [name for name in missing if not name.is_file()]:
            raise InputError(f"{path}: {absent[0].name} is missing, which belongs to it")
        return [str(name) for name, kind in pyogrio.list_layers(path) if kind is not None]


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
    with _gdal(path, "written") as pyogrio:
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


@contextmanager
def _gdal(path: Path, what: Literal["read", "written"]) -> Iterator[Any]:
    """Give pyogrio, without warnings of GDAL; its errors, of many kinds, become those of input."""
    pyogrio = extras.load(f"{path}: {'reading' if what == 'read' else 'writing'} it", "pyogrio", "raw")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield pyogrio
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{path}: cannot be {what}: {str(error).splitlines()[0][:120]}") from None


def _plain(value: Any) -> Any:
    """Return a value of a column as one of JSON."""
    value = value.item() if isinstance(value, np.generic) else value
    return value if isinstance(value, str | int | float | bool) or value is None else str(value)


def _listed(value: Any) -> Any:
    """Return nested tuples as lists, as in JSON, also inside dictionaries."""
    if isinstance(value, dict):
        return {key: _listed(item) for key, item in value.items()}
    return [_listed(item) for item in value] if isinstance(value, tuple | list) else value
