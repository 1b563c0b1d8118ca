"""Landmarks of many specimens: in one file for all, or in a file for each."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...arrays import Complex
from ...errors import InputError, naming
from .. import files, formats, limits
from ..geometry import document
from ..geometry.table import Table
from ..geometry.tps import specimens_of

STEM = "{stem}"
"""Placeholder in the name of a file for the specimen's name."""
SPECIMEN_COLUMNS = ("specimen", "image", "picture", "file", "filename", "id")
"""Names, in lower case, of the column of a table that names the specimen of each point."""
SEPARATORS = "_-. "  # after the specimen's name in longer names of files, as in BC0004_landmarks.txt


@dataclass(frozen=True, eq=False)
class SpecimenLandmarks:
    """The landmarks of a specimen.

    Attributes:
        path: the file.
        names: of the landmarks; their numbers from 1 if the file has no names.
        points: (k,) in the file's units; NaN for missing ones.
        upward: whether y points up from the lower edge of the picture; otherwise it points down from the upper edge.
    """

    path: str
    names: tuple[str, ...]
    points: Complex
    upward: bool


class LandmarkFiles:
    """Finds the landmarks of specimens.

    Args:
        given: a file with the landmarks of all specimens (TPS, or a table with a column of specimens), a folder with a
            file for each specimen, or the name of such a file with {stem}; None for files beside the pictures.
        pictures: the specimens' files.

    Raises:
        InputError: the file or folder does not exist, or cannot be read.
    """

    def __init__(self, name: str | None, pictures: Sequence[Path]):
        self._given, self._pictures = name, pictures
        self._listed: dict[str, list[str]] = {}
        self._all: dict[str, SpecimenLandmarks] | list[SpecimenLandmarks] | None = None
        if name is not None and STEM not in name and not os.path.isdir(name):
            self._all = _all_of(name)
            if isinstance(self._all, list) and len(self._all) != len(pictures):
                raise InputError(
                    f"{name}: has {len(self._all)} specimens without names, but there are {len(pictures)} pictures; "
                    "name the pictures in IMAGE= lines"
                )

    def of(self, number: int) -> SpecimenLandmarks:
        """Return the landmarks of the specimen with a number, from 0.

        Raises:
            InputError: there are none, or their file cannot be read.
        """
        picture = self._pictures[number]
        if isinstance(self._all, list):
            return self._all[number]
        if self._all is not None:
            for name in (picture.name, picture.stem):
                if name.casefold() in self._all:
                    return self._all[name.casefold()]
            raise InputError(f"{self._given}: has no landmarks for {picture.name}")
        return _read(self._file_of(picture))

    def _file_of(self, picture: Path) -> str:
        """Return the file with the landmarks of a specimen.

        Raises:
            InputError: there is none, or more than one.
        """
        if self._given is not None and STEM in self._given:
            return self._given.replace(STEM, picture.stem)
        folder = self._given if self._given is not None else str(picture.parent)
        if folder not in self._listed:
            names = sorted(os.listdir(folder))
            self._listed[folder] = [name for name in names if formats.suffix_of(name) in document.READERS]
        stem = picture.stem
        listed = [name for name in self._listed[folder] if name != picture.name and name.startswith(stem)]
        matching = [name for name in listed if Path(name).stem == stem]
        if not matching:
            # names with more after the specimen's name, but not those of specimens with longer names
            longer_stems = tuple(
                {path.stem for path in self._pictures if path.stem.startswith(stem)} - {stem}
            )
            separated = tuple(stem + mark for mark in SEPARATORS)
            matching = [
                name for name in listed if name.startswith(separated) and not name.startswith(longer_stems)
            ]
        if not matching:
            raise InputError(
                f"{picture}: no file with its landmarks in {folder}; name it with --landmarks, such as "
                f"--landmarks 'landmarks/{STEM}.csv'"
            )
        if len(matching) > 1:
            raise InputError(
                f"{picture}: {', '.join(matching[:4])} could all contain its landmarks; choose with --landmarks, such "
                f"as --landmarks '{os.path.join(folder, matching[0].replace(stem, STEM))}'"
            )
        return os.path.join(folder, matching[0])


def _all_of(path: str) -> dict[str, SpecimenLandmarks] | list[SpecimenLandmarks]:
    """Return the landmarks of all specimens in a file, by names in lower case, or in order if they have no names.

    Raises:
        InputError: it cannot be read, or does not list specimens.
    """
    if formats.suffix_of(path) == ".tps":
        data = files.read_bytes(Path(path), max_bytes=limits.GEOMETRY_BYTES)
        with naming(path):
            blocks = specimens_of(data)
        specimens = [
            (name, SpecimenLandmarks(path, _numbered(points), points, upward=True)) for name, points in blocks
        ]
        if not any(name for name, _ in specimens):
            return [landmarks for _, landmarks in specimens]
        return _by_name(path, specimens)
    table = document.read(path) if formats.suffix_of(path) in document.READERS else None
    low = [name.strip().lower() for name in table.head] if isinstance(table, Table) else []
    column = next((low.index(name) for name in SPECIMEN_COLUMNS if name in low), None)
    if not isinstance(table, Table) or column is None:
        raise InputError(
            f"{path}: does not list several specimens; use a TPS file, a table with a column {SPECIMEN_COLUMNS[0]!r}, "
            "or a folder with a file for each specimen"
        )
    rows: dict[str, list[int]] = {}
    for k, row in enumerate(table.rows):
        rows.setdefault(row[column].strip() if column < len(row) else "", []).append(k)
    names, points = table.names_of_rows, table.geometry.points
    specimens = []
    for name, numbers in rows.items():
        called = _numbered(points[numbers], [names[k] for k in numbers] if names else ())
        specimens.append((name, SpecimenLandmarks(path, called, points[numbers], upward=False)))
    return _by_name(path, specimens)


def _by_name(path: str, specimens: list[tuple[str, SpecimenLandmarks]]) -> dict[str, SpecimenLandmarks]:
    names = [name.casefold() for name, _ in specimens]
    repeated = next((name for name, count in Counter(names).items() if count > 1), None)
    if repeated is not None:
        raise InputError(f"{path}: has more than one specimen named {repeated!r}")
    return {Path(name).name: landmarks for name, (_, landmarks) in zip(names, specimens)}


def _read(path: str) -> SpecimenLandmarks:
    """Read a file with the landmarks of one specimen.

    Raises:
        InputError: it cannot be read, or has no points.
    """
    if formats.suffix_of(path) not in document.READERS:
        suffixes = ", ".join(sorted(document.READERS))
        raise InputError(f"{path}: not a file of landmarks; iccm reads {suffixes}")
    file = document.read(path)
    if not file.geometry.points.size:
        raise InputError(f"{path}: contains no points")
    return SpecimenLandmarks(
        path, _numbered(file.geometry.points, file.geometry.names), file.geometry.points, file.upward
    )


def _numbered(points: Complex, names: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the names of landmarks; their numbers from 1 if they have none."""
    return (
        tuple(names) if all(names) and names else tuple(str(number) for number in range(1, points.size + 1))
    )
