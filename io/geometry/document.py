"""A file of points, lines or polygons."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...arrays import Complex
from ...errors import InputError, naming
from .. import files, formats, limits

NOWHERE = complex(np.nan, np.nan)


@dataclass
class Geometry:
    """What a file holds, in its own units, x + iy.

    Attributes:
        points: (p,) points; NaN for one without a place.
        lines: (k,) polylines.
        polygons: each an outer ring (k,) and those of its holes; no ring repeats its first point.
    """

    points: Complex = field(default_factory=lambda: np.empty(0, complex))
    lines: Sequence[Complex] = ()
    polygons: Sequence[list[Complex]] = ()


@dataclass
class Images:
    """What a map makes of it.

    Attributes:
        points: (p,) images, NaN where there is none.
        lines: of each line its pieces.
        polygons: of each polygon its parts.
        keep: whether what has no image keeps its entry, without a place.
        name: of the file of the shape that they are on.
    """

    points: Complex
    lines: Sequence[list[Complex]]
    polygons: Sequence[list[list[Complex]]]
    keep: bool = False
    name: str = ""


class Document(ABC):
    """A file under way.

    Attributes:
        geometry: what it holds.
        notes: what is left out of it.
    """

    upward: ClassVar[bool] = False
    """Whether y is counted upwards from the lower edge of the canvas, whatever the shape's file does."""
    keeps: ClassVar[bool] = True
    """Whether it can hold entries without a place."""

    geometry: Geometry
    notes: tuple[str, ...] = ()

    @classmethod
    @abstractmethod
    def parse(cls, data: bytes, columns: str | None) -> Document:
        """Return the document that a file's bytes are.

        Raises:
            InputError: they are none; the message begins with what is wrong.
        """

    @abstractmethod
    def text(self, images: Images) -> str:
        """Return the file with images in the place of what they are of."""


READERS = {
    ".csv": "table.Table",
    ".tsv": "table.Table",
    ".geojson": "geojson.GeoJson",
    ".json": "geojson.GeoJson",
    ".tps": "tps.Tps",
    ".obj": "polylines.Polylines",
}


def read(path: str, columns: str | None = None) -> Document:
    """Return the points, lines and polygons of a file, by its suffix.

    Args:
        path: the file.
        columns: of a table, the names or numbers of those that hold x and y.

    Raises:
        InputError: it cannot be read, or holds none.
    """
    module, _, name = READERS[formats.suffix_of(path)].partition(".")
    if columns and module != "table":
        raise InputError(f"--columns: this option is for tables, and {path} is not a table")
    data = files.read_bytes(Path(path), max_bytes=limits.GEOMETRY_BYTES)
    with naming(path):
        try:
            return getattr(import_module(f".{module}", __package__), name).parse(data, columns)
        except UnicodeDecodeError:
            raise InputError("not a UTF-8 text file; save it as UTF-8") from None
