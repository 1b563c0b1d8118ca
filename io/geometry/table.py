"""Tables of points (CSV, TSV): two columns hold x and y, all others stay as they are."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from .document import NOWHERE, Document, Geometry, Images, number


@dataclass
class Table(Document):
    """Rows of cells; empty coordinates are points without a place."""

    head: list[str]
    rows: list[list[str]]
    columns: tuple[int, int]
    delimiter: str
    ending: str
    geometry: Geometry

    @classmethod
    def parse(cls, data: bytes, columns: str | None) -> Table:
        """Cells between tabs, commas or semicolons; the first row is a head unless its coordinates are numbers."""
        text = data.decode("utf-8-sig")
        first = text.partition("\n")[0]
        delimiter = max("\t;,", key=first.count)
        ending = "\r\n" if first.endswith("\r") else "\n"
        try:
            rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter))
        except csv.Error as error:
            raise InputError(f"is no table: {error}") from None
        rows = [row for row in rows if row]
        if not rows:
            raise InputError("has no rows")
        at = _columns(rows[0], columns)
        has_head = not all(_is_number(rows[0][k]) for k in at)
        head, rows = (rows[0], rows[1:]) if has_head else ([], rows)
        z = np.empty(len(rows), complex)
        i, j = at
        for k, row in enumerate(rows):
            try:
                z[k] = complex(float(row[i]), float(row[j]))
            except (ValueError, IndexError):
                z[k] = _place(row, at, k + 1 + has_head)
        if not (np.isnan(z) | (np.abs(z) < 1e100)).all():
            raise InputError("some coordinates are no finite numbers")
        return cls(head, rows, at, delimiter, ending, Geometry(z))

    def text(self, images: Images) -> str:
        """The rows with their images; of those without one none, or with empty cells."""
        out = io.StringIO(newline="")
        writer = csv.writer(out, delimiter=self.delimiter, lineterminator=self.ending)
        if self.head:
            writer.writerow(self.head)
        i, j = self.columns
        lost = np.isnan(images.points)
        x, y = images.points.real.tolist(), images.points.imag.tolist()
        for k, row in enumerate(self.rows):
            if not lost[k]:
                row[i], row[j] = repr(x[k]), repr(y[k])
            elif images.keep:
                row[i] = row[j] = ""
            else:
                continue
            writer.writerow(row)
        return out.getvalue()


def _columns(first: list[str], wanted: str | None) -> tuple[int, int]:
    """The places of the columns of x and y: as named, else those called x and y, else the first two."""
    names = [name.strip() for name in first]
    low = [name.lower() for name in names]
    if wanted is None:
        found = [low.index("x"), low.index("y")] if {"x", "y"} <= set(low) else [0, 1]
    else:
        found = []
        for name in wanted.split(","):
            if name.strip() in names:
                found.append(names.index(name.strip()))
            elif name.strip().isdecimal() and 1 <= int(name) <= len(names):
                found.append(int(name) - 1)
            else:
                raise InputError(f"--columns: no {name.strip()!r} in it; it has {', '.join(names[:12])}")
    if len(found) != 2 or max(found) >= len(names) or found[0] == found[1]:
        raise InputError("two columns are needed, of x and of y; --columns x,y names them")
    return found[0], found[1]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _place(row: list[str], at: tuple[int, int], line: int) -> complex:
    """The place of a row that is not two numbers: none where both cells are empty."""
    if max(at) >= len(row):
        raise InputError(f"row {line}: has {len(row)} cells; column {max(at) + 1} is needed")
    cells = [row[k] for k in at]
    if not any(cell.strip() for cell in cells):
        return NOWHERE
    x, y = (number(cell, f"row {line}") for cell in cells)
    return complex(x, y)
