"""Tables of points (CSV, TSV): two columns contain x and y, all others are kept."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import takewhile

import numpy as np

from ...errors import InputError
from .. import limits
from ..point_syntax import coordinate, is_number
from .columns import MISSING, Columns, guessed, is_heading, named, of_names, unit_of
from .document import NOWHERE, Geometry, Images, TextDocument

NAME_COLUMNS = ("name", "landmark", "label")
MOST_TITLES = 5
"""Rows of titles above the names of columns, such as those of Imaris and DeepLabCut."""
SNIFFED_ROWS = 50  # rows in which delimiter and decimal commas are detected
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_SEPARATOR = re.compile(
    r"sep=([,;\t])\r?\n", re.IGNORECASE
)  # a first line by which Excel knows the delimiter
_INNER_COMMA = re.compile(r"(?<=\d),(?=\d)")


@dataclass
class Table(TextDocument):
    """Rows of cells; empty coordinates are points without a position.

    Attributes:
        head: names of the columns; empty if there are none.
        rows: the rows of points.
        columns: those of x and y.
        delimiter, ending: between cells, and at the end of lines.
        decimal_comma: whether coordinates have decimal commas.
        comments: rows above the names: those that begin with #, titles, and further names.
        explained: rows below the names with units or other names, as in files of TrackMate.
        separator: the line above everything that names the delimiter, as Excel writes it.
    """

    head: list[str]
    rows: list[list[str]]
    columns: tuple[int, int]
    delimiter: str
    ending: str
    geometry: Geometry
    decimal_comma: bool = False
    comments: list[list[str]] = field(default_factory=list)
    explained: list[list[str]] = field(default_factory=list)
    separator: str = ""

    @classmethod
    def parse(cls, data: bytes, columns: str | None) -> Table:
        """Parse cells separated by tabs, commas or semicolons; the first row is a header unless it has coordinates.

        Rows that begin with # and titles above it, and rows with units below it, are kept.
        """
        text = _decoded(data)
        named_delimiter = _SEPARATOR.match(text)
        text = text[named_delimiter.end() :] if named_delimiter else text
        first = text.partition("\n")[0]
        delimiter = named_delimiter[1] if named_delimiter else _delimiter(text)
        ending = "\r\n" if first.endswith("\r") else "\n"
        try:
            rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter))
        except csv.Error as error:
            raise InputError(f"not a table: {error}") from None
        rows = [row for row in rows if row]
        if (count := max(map(len, rows), default=0)) > limits.TABLE_COLUMNS:
            raise InputError(f"a row has {count} columns, more than {limits.TABLE_COLUMNS}")
        comments = list(takewhile(_is_comment, rows))
        rows = rows[len(comments) :]
        if comments and rows and len(comments[-1]) == len(rows[0]) and of_names(comments[-1]):
            rows.insert(0, comments.pop())  # names of the columns, as NumPy writes them
        if not rows:
            raise InputError("has no rows")
        titles = _titles(rows)
        comments, rows = comments + rows[:titles], rows[titles:]
        chosen = _choose(rows, columns)
        xy_columns = chosen.x, chosen.y
        comma = delimiter != "," and _has_decimal_commas(rows, xy_columns)
        if comma:
            for row in rows:
                for k in xy_columns:
                    if k < len(row) and _DECIMAL_COMMA.fullmatch(row[k].strip()):
                        row[k] = row[k].replace(",", ".")
        has_head = not all(k < len(rows[0]) and is_number(rows[0][k]) for k in xy_columns)
        head, rows = (rows[0], rows[1:]) if has_head else ([], rows)
        explained = list(takewhile(lambda row: _is_explanation(row, xy_columns), rows)) if has_head else []
        rows = rows[len(explained) :]
        first_line = 1 + has_head + len(comments) + len(explained)
        z = np.empty(len(rows), complex)
        i, j = xy_columns
        for k, row in enumerate(rows):
            try:
                x, y = float(row[i]), float(row[j])
                z[k] = complex(x, y) if x == x and y == y else _place(row, xy_columns, k + first_line)
            except (ValueError, IndexError):
                z[k] = _place(row, xy_columns, k + first_line)
        if not (np.isnan(z) | (np.abs(z) < 1e100)).all():
            raise InputError("some coordinates are not finite numbers")
        geometry = Geometry(z, names=_names(head, rows))
        table = cls(head, rows, xy_columns, delimiter, ending, geometry, comma, comments, explained)
        table.separator = named_delimiter[0] if named_delimiter else ""
        table.notes = (chosen.note,) if chosen.note else ()
        table.unit = next((unit for row in explained if (unit := unit_of(row[i], alone=True))), chosen.unit)
        return table

    @property
    def names_of_rows(self) -> list[str]:
        """The cells of the first column called name, landmark or label, also if they repeat; empty without one."""
        return next(_columns_of_names(self.head, self.rows), [])

    def text(self, images: Images) -> str:
        """Return the rows with their images; rows without one are dropped, or get empty cells."""
        out = io.StringIO(newline="")
        out.write(self.separator)
        writer = csv.writer(out, delimiter=self.delimiter, lineterminator=self.ending)
        writer.writerows([*self.comments, *([self.head] if self.head else []), *self.explained])
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
    """Return the delimiter of cells.

    It is the tab if the first row has one. It is the semicolon if the first row has more of them than commas, or if
    all rows have equally many, unless the first row has more commas and some are not inside numbers. Else it is the
    comma.
    """
    rows = [row for row in text.split("\n", SNIFFED_ROWS)[:SNIFFED_ROWS] if row.strip()]
    first = text.partition("\n")[0]
    if "\t" in first:
        return "\t"
    semicolons, commas = first.count(";"), first.count(",")
    if semicolons > commas:
        return ";"
    counts = {row.count(";") for row in rows}
    is_even = len(counts) == 1 and 0 not in counts
    are_decimal = not any("," in _INNER_COMMA.sub(".", row) for row in rows)
    return ";" if is_even and (are_decimal or commas == semicolons) else ","


def _has_decimal_commas(rows: list[list[str]], xy_columns: tuple[int, int]) -> bool:
    """Return whether coordinates have decimal commas."""
    cells = (row[k].strip() for row in rows[:SNIFFED_ROWS] for k in xy_columns if k < len(row))
    return any(_DECIMAL_COMMA.fullmatch(cell) for cell in cells)


def _choose(rows: list[list[str]], names_given: str | None) -> Columns:
    """Return the columns of x and y: as named by the user, else by their names, else the only ones that it can be.

    Raises:
        InputError: it cannot be known.
    """
    first = rows[0]
    if names_given is not None:
        return named(first, names_given)
    if chosen := of_names(first):
        return chosen
    cells = [[_INNER_COMMA.sub(".", cell.strip()) for cell in row] for row in rows[:SNIFFED_ROWS]]
    # numbers that are names, such as years, are not considered: a first row with any number is not a header
    has_head = not any(map(is_number, cells[0]))
    return guessed(first, cells[1:] if has_head else cells, has_head=has_head)


def _titles(rows: list[list[str]]) -> int:
    """Return how many rows without numbers lie above one by whose names the columns of x and y are known."""
    for number, row in enumerate(rows[: MOST_TITLES + 1]):
        if any(map(is_number, row)):
            break
        if of_names(row):
            return number
    return 0


def _is_comment(row: list[str]) -> bool:
    return row[0].lstrip().startswith("#")


def _is_explanation(row: list[str], xy_columns: tuple[int, int]) -> bool:
    """Return whether a row below the names of the columns explains them instead of a point."""
    return max(xy_columns) < len(row) and all(is_heading(row[k]) for k in xy_columns)


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
