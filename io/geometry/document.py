"""The interface of files with points, lines or polygons."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...arrays import Complex
from ...errors import InputError, naming
from .. import files, formats, limits
from ..spec import path_of

NOWHERE = complex(np.nan, np.nan)


@dataclass
class Geometry:
    """The geometry in a file, in its own units, x + iy.

    Attributes:
        points: (p,) points; NaN for those without a position.
        lines: (k,) polylines.
        polygons: each a list of the outer ring (k,) and the rings of holes, without repeated end points.
        names: (p,) names of the points, empty where a point has none; or nothing.
    """

    points: Complex = field(default_factory=lambda: np.empty(0, complex))
    lines: Sequence[Complex] = ()
    polygons: Sequence[list[Complex]] = ()
    names: Sequence[str] = ()

    def scaled(self, factor: float) -> Geometry:
        """Return the geometry with its coordinates times a factor."""
        if factor == 1:
            return self
        polygons = [[factor * ring for ring in rings] for rings in self.polygons]
        return Geometry(factor * self.points, [factor * line for line in self.lines], polygons, self.names)


@dataclass
class Images:
    """The geometry mapped by a map.

    Attributes:
        points: (p,) images, NaN where there is none.
        lines: for each line, its mapped pieces.
        polygons: for each polygon, its mapped parts.
        keep: whether geometry without an image keeps its entry, without a position.
        name: of the file of the target shape.
    """

    points: Complex
    lines: Sequence[list[Complex]]
    polygons: Sequence[list[list[Complex]]]
    keep: bool = False
    name: str = ""

    def scaled(self, factor: float) -> Images:
        """Return the images with their coordinates times a factor."""
        if factor == 1:
            return self
        lines = [[factor * piece for piece in pieces] for pieces in self.lines]
        polygons = [[[factor * ring for ring in rings] for rings in parts] for parts in self.polygons]
        return replace(self, points=factor * self.points, lines=lines, polygons=polygons)

    @property
    def counts(self) -> dict[str, int]:
        """The numbers of points, lines and polygons that are written."""
        return {
            "points": len(self.points) if self.keep else int((~np.isnan(self.points)).sum()),
            "lines": sum(bool(pieces) or self.keep for pieces in self.lines),
            "polygons": sum(bool(parts) or self.keep for parts in self.polygons),
        }


class GeometryDocument(ABC):
    """A parsed file that can be written back with mapped geometry.

    Attributes:
        geometry: its content.
        notes: what was ignored.
        unit: of the coordinates, as the file names it, such as "micron"; empty if it does not.
    """

    upward: ClassVar[bool] = False
    """Whether y points up from the lower edge of the canvas, whatever the shape's file does."""
    is_database: ClassVar[bool] = False
    """Whether it is read from and written to files by a library, instead of bytes."""
    keeps: ClassVar[bool] = True
    """Whether it can represent entries without a position."""

    geometry: Geometry
    notes: tuple[str, ...] = ()
    unit: str = ""

    @classmethod
    def of_file(cls, text: str) -> GeometryDocument:
        """Read `file` or `file#layer`, if it is a database.

        Raises:
            InputError: it cannot be read.
        """
        raise NotImplementedError

    @classmethod
    @abstractmethod
    def parse(cls, data: bytes, columns: str | None) -> GeometryDocument:
        """Parse the content of a file; `columns` selects columns of a table.

        Raises:
            InputError: it is invalid; the message starts with what is wrong.
        """

    def write(self, images: Images, path: Path) -> None:
        """Write the file with its geometry replaced by the images."""
        path.write_bytes(self.encode(images))

    def convert(self, suffix: str) -> None:
        """Choose the form of another suffix of the same format.

        Raises:
            InputError: there is no such form of the content.
        """
        return

    @staticmethod
    def companions(output: str) -> Sequence[str]:
        """Return the names of further files of an output."""
        return ()

    @abstractmethod
    def encode(self, images: Images) -> bytes:
        """Return the file's content with its geometry replaced by the images."""


class TextDocument(GeometryDocument):
    """A document that is text in UTF-8."""

    def encode(self, images: Images) -> bytes:
        """Return the file's content with its geometry replaced by the images."""
        return self.text(images).encode()

    @abstractmethod
    def text(self, images: Images) -> str:
        """Return the file's text with its geometry replaced by the images."""


READERS = {
    ".csv": "table.Table",
    ".tsv": "table.Table",
    ".txt": "table.Table",
    ".geojson": "geojson.GeoJson",
    ".json": "geojson.GeoJson",
    ".geojsonl": "geojson.GeoJson",
    ".geojsons": "geojson.GeoJson",
    ".topojson": "geojson.GeoJson",
    **dict.fromkeys((".gpkg", ".shp", ".kml", ".fgb"), "layers.LayerDocument"),
    ".tps": "tps.Tps",
    ".obj": "polylines.Polylines",
    ".pts": "elastix.PointSet",
    ".roi": "rois.Rois",
    ".zip": "rois.Rois",
}


def read(path: str, columns: str | None = None) -> GeometryDocument:
    """Read the points, lines and polygons of a file in the format of its suffix.

    Args:
        path: the file.
        columns: for a table, names or numbers of the columns with x and y.

    Raises:
        InputError: it cannot be read, or has no geometry.
    """
    suffix = formats.suffix_of(path_of(path))
    if suffix not in READERS:
        files.open_input(path_of(path))
        raise InputError(f"{path}: points are not read from {suffix!r}; use one of {', '.join(READERS)}")
    module, _, name = READERS[suffix].partition(".")
    kind: type[GeometryDocument] = getattr(import_module(f".{module}", __package__), name)
    if columns and module != "table":
        raise InputError(f"--columns: this option is for tables, and {path} is not a table")
    if kind.is_database:
        return kind.of_file(path)
    data = files.read_bytes(Path(path), max_bytes=limits.GEOMETRY_BYTES)
    with naming(path):
        try:
            return kind.parse(data, columns)
        except UnicodeDecodeError:
            raise InputError("not a UTF-8 text file; save it as UTF-8") from None
