"""Tables of points (CSV, TSV): two columns contain x and y, all others are kept."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ..point_syntax import coordinate
from .document import NOWHERE, Geometry, Images, TextDocument

MISSING = frozenset(["na", "n/a", "#n/a", "nan", "null", "none", "missing"])
"""Cells, in lower case, that mean a missing value."""
COORDINATE_COLUMNS = (("x", "y"), ("axis-2", "axis-1"), ("axis-1", "axis-0"))
"""Names of the columns of x and y, in lower case: the usual ones, and those of napari, whose last axis is x."""
NAME_COLUMNS = ("name", "landmark", "label")
SNIFFED_ROWS = 50  # rows in which delimiter and decimal commas are detected
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_INNER_COMMA = re.compile(r"(?<=\d),(?=\d)")


@dataclass
class Table(TextDocument):
    """Rows of cells; empty coordinates are points without a position."""

    head: list[str]
    rows: list[list[str]]
    columns: tuple[int, int]
    delimiter: str
    ending: str
    geometry: Geometry
    decimal_comma: bool = False

    @classmethod
    def parse(cls, data: bytes, columns: str | None) -> Table:
        """Parse cells separated by tabs, commas or semicolons; the first row is a header unless it has coordinates."""
        text = _decoded(data)
        first = text.partition("\n")[0]
        delimiter = _delimiter(text)
        ending = "\r\n" if first.endswith("\r") else "\n"
        try:
            rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter))
        except csv.Error as error:
            raise InputError(f"not a table: {error}") from None
        rows = [row for row in rows if row]
        if not rows:
            raise InputError("has no rows")
        xy_columns = _columns(rows[0], columns)
        comma = delimiter != "," and _has_decimal_commas(rows, xy_columns)
        if comma:
            for row in rows:
                for k in xy_columns:
                    if k < len(row) and _DECIMAL_COMMA.fullmatch(row[k].strip()):
                        row[k] = row[k].replace(",", ".")
        has_head = not all(_is_number(rows[0][k]) for k in xy_columns)
        head, rows = (rows[0], rows[1:]) if has_head else ([], rows)
        z = np.empty(len(rows), complex)
        i, j = xy_columns
        for k, row in enumerate(rows):
            try:
                x, y = float(row[i]), float(row[j])
                z[k] = complex(x, y) if x == x and y == y else _place(row, xy_columns, k + 1 + has_head)
            except (ValueError, IndexError):
                z[k] = _place(row, xy_columns, k + 1 + has_head)
        if not (np.isnan(z) | (np.abs(z) < 1e100)).all():
            raise InputError("some coordinates are not finite numbers")
        return cls(head, rows, xy_columns, delimiter, ending, Geometry(z, names=_names(head, rows)), comma)

    @property
    def names_of_rows(self) -> list[str]:
        """The cells of the first column called name, landmark or label, also if they repeat; empty without one."""
        return next(_columns_of_names(self.head, self.rows), [])

    def text(self, images: Images) -> str:
        """Return the rows with their images; rows without one are dropped, or get empty cells."""
        out = io.StringIO(newline="")
        writer = csv.writer(out, delimiter=self.delimiter, lineterminator=self.ending)
        if self.head:
            writer.writerow(self.head)
        i, j = self.columns
        is_unmapped = np.isnan(images.points)
        x, y = images.points.real.tolist(), images.points.imag.tolist()
        for k, row in enumerate(self.rows):
            if not is_unmapped[k]:
                row[i], row[j] = repr(x[k]), repr(y[k])
                if self.decimal_comma:
                    row[i], row[j] = row[i].replace(".", ","), row[j].replace(".", ",")
            elif images.keep:
                row[i] = row[j] = ""
            else:
                continue
            writer.writerow(row)
        return out.getvalue()


def _decoded(data: bytes) -> str:
    """Decode the text of a table: UTF-8, UTF-16 (as in spreadsheets' "Unicode text"), else Western Windows encoding.

    Raises:
        InputError: it has none of these encodings.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encodings = ["utf-16"]
    elif data[1:2] == b"\0":
        encodings = ["utf-16-le"]
    elif data[:1] == b"\0":
        encodings = ["utf-16-be"]
    else:
        encodings = ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        with suppress(UnicodeDecodeError):
            return data.decode(encoding)
    raise InputError(f"is not text in {' or '.join(encodings)}")


def _delimiter(text: str) -> str:
    """Return the delimiter: tab if there is any, semicolon if commas occur only inside numbers, else comma."""
    lines = text.split("\n", SNIFFED_ROWS)[:SNIFFED_ROWS]
    first = lines[0]
    if "\t" in first:
        return "\t"
    bare = [_INNER_COMMA.sub(".", line) for line in lines if line.strip()]
    semicolons = {line.count(";") for line in bare}
    return (
        ";" if first.count(";") > first.count(",") or (0 not in semicolons and len(semicolons) == 1) else ","
    )


def _has_decimal_commas(rows: list[list[str]], xy_columns: tuple[int, int]) -> bool:
    """Return whether coordinates have decimal commas."""
    cells = (row[k].strip() for row in rows[:SNIFFED_ROWS] for k in xy_columns if k < len(row))
    return any(_DECIMAL_COMMA.fullmatch(cell) for cell in cells)


def _columns(first: list[str], names_given: str | None) -> tuple[int, int]:
    """Return the indices of the columns of x and y: as named, else those called x and y (or as in napari), else the
    first two.
    """
    names = [name.strip() for name in first]
    low = [name.lower() for name in names]
    if names_given is None:
        indices = next(
            (list(map(low.index, pair)) for pair in COORDINATE_COLUMNS if {*pair} <= {*low}), [0, 1]
        )
    else:
        indices = []
        for name in names_given.split(","):
            if name.strip() in names:
                indices.append(names.index(name.strip()))
            elif name.strip().isdecimal() and 1 <= int(name) <= len(names):
                indices.append(int(name) - 1)
            else:
                raise InputError(
                    f"--columns: there is no column {name.strip()!r}; the table has {', '.join(names[:12])}"
                )
    if len(indices) != 2 or max(indices) >= len(names) or indices[0] == indices[1]:
        raise InputError("a table needs a column of x and one of y; name them with --columns X,Y")
    return indices[0], indices[1]


def _names(head: list[str], rows: list[list[str]]) -> list[str]:
    """Return the cells of the column called name, landmark or label, unless they repeat; else nothing."""
    for names in _columns_of_names(head, rows):
        if len({*names}) == len(names):
            return names
    return []


def _columns_of_names(head: list[str], rows: list[list[str]]) -> Iterator[list[str]]:
    """Yield the cells of columns called name, landmark or label."""
    low = [name.strip().lower() for name in head]
    for column in NAME_COLUMNS:
        if column in low:
            k = low.index(column)
            yield [row[k].strip() if k < len(row) else "" for row in rows]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _place(row: list[str], xy_columns: tuple[int, int], line: int) -> complex:
    """Return the position of a row whose cells are not two numbers: NaN if both are empty, or one means missing."""
    if max(xy_columns) >= len(row):
        raise InputError(f"row {line}: has only {len(row)} cells, but column {max(xy_columns) + 1} is needed")
    cells = [row[k] for k in xy_columns]
    words = [cell.strip().lower() for cell in cells]
    if not any(words) or any(word in MISSING for word in words):
        return NOWHERE
    x, y = (coordinate(cell, f"row {line}") for cell in cells)
    return complex(x, y)
