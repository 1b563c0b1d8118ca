"""The interface of a format of landmark pairs, and the table of formats."""

from __future__ import annotations

import csv
from abc import ABC, abstractmethod
from importlib import import_module
from io import StringIO
from pathlib import Path
from typing import ClassVar

from ....errors import InputError, naming
from ... import files, formats, limits
from .pairs import Axes, LandmarkPairs

FORMATS = {
    ".csv": "bigwarp.BigWarp",
    ".points": "qgis.Qgis",
    ".tps": "tps_pairs.TpsPairs",
    **dict.fromkeys(formats.TIFF_SUFFIXES, "control_points.ControlPoints"),
}
"""Module and class of each format, by its suffix."""


class LandmarksFile(ABC):
    """A file of landmark pairs of another program.

    Args:
        name: the file.

    Attributes:
        axes: conventions of its coordinates in the source and in the target.
    """

    axes: ClassVar[tuple[Axes, Axes]]

    def __init__(self, name: str):
        self.name = name

    def read(self) -> LandmarkPairs:
        """Return the pairs in the file; those that are switched off are left out.

        Raises:
            InputError: it cannot be read, or is invalid; the message starts with its name.
        """
        content = files.read_bytes(self.name, max_bytes=limits.CONSTRAINTS_BYTES)
        with naming(self.name):
            return self.parse(content)

    @abstractmethod
    def parse(self, content: bytes) -> LandmarkPairs:
        """Return the pairs in the content of the file, as `read`.

        Raises:
            InputError: the content is invalid; the message starts with what is wrong.
        """

    def text(self, pairs: LandmarkPairs) -> str:
        """Return the content of a file with pairs, whose axes are those of the format.

        Raises:
            InputError: the format is only read.
        """
        raise InputError(f"{self.name}: landmarks are not written in this format; use .json")


def file_of(name: str) -> LandmarksFile | None:
    """Return a file of landmark pairs by its suffix; None if no program's landmarks have that suffix."""
    place = FORMATS.get(Path(name).suffix.lower())
    if place is None:
        return None
    module, _, kind = place.partition(".")
    file: LandmarksFile = getattr(import_module(f".{module}", __package__), kind)(name)
    return file


def decoded(content: bytes) -> str:
    """Return the text of a file in UTF-8.

    Raises:
        InputError: it has another encoding.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("not a text file in UTF-8") from error


def rows_of(text: str) -> list[tuple[int, list[str]]]:
    """Return the rows of a table with their line numbers, without empty lines and comments.

    Raises:
        InputError: it is not a table.
    """
    lines = csv.reader(StringIO(text))
    try:
        rows = [(lines.line_num, [cell.strip() for cell in row]) for row in lines]
    except csv.Error as error:
        raise InputError(f"not a table: {error}") from error
    return [(number, row) for number, row in rows if any(row) and not row[0].startswith("#")]


def is_off(cell: str) -> bool:
    """Return whether a cell says that a landmark is not used."""
    return cell.lower() in ("false", "0", "no")


def digits(value: float) -> str:
    """Return a coordinate as text, with the 12 digits that are written."""
    return f"{value:.12g}"
