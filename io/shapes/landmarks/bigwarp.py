"""Landmarks of BigWarp (`.csv`): the source is the moving picture; pixels, y down."""

from __future__ import annotations

import csv
from io import StringIO

from ....errors import InputError
from ...point_syntax import coordinate
from .landmarks_file import LandmarksFile, decoded, digits, is_off, rows_of
from .pairs import LandmarkPairs

COLUMNS = 6  # of a planar row: name, active, two coordinates in both images
SPATIAL_COLUMNS = 8  # of a row in three dimensions


class BigWarp(LandmarksFile):
    """A table without a heading: name, whether it is active, and the point in both pictures."""

    axes = ("image", "image")

    def parse(self, content: bytes) -> LandmarkPairs:
        """Return the active pairs."""
        pairs = LandmarkPairs(self.axes)
        for line, row in rows_of(decoded(content)):
            if len(row) == SPATIAL_COLUMNS:
                raise InputError(f"line {line}: landmarks in space are not supported; use two coordinates")
            if len(row) != COLUMNS:
                raise InputError(
                    f"line {line}: has {len(row)} columns instead of name, active, x, y, x, y (BigWarp)"
                )
            name, active, *cells = row
            if not is_off(active):
                x, y, u, v = (coordinate(cell, f"line {line}") for cell in cells)
                pairs.append(name, (x, y), (u, v))
        return pairs

    def text(self, pairs: LandmarkPairs) -> str:
        """Return the table; pairs without a name get BigWarp's own names."""
        file = StringIO()
        writer = csv.writer(file, quoting=csv.QUOTE_ALL, lineterminator="\n")
        for number, (name, source, target) in enumerate(zip(pairs.names, pairs.source, pairs.target)):
            writer.writerow([name or f"Pt-{number}", "true", *map(digits, (*source, *target))])
        return file.getvalue()
