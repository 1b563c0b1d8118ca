"""Find the columns of x and y in a table, by their names first."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from ...errors import InputError
from ..point_syntax import is_number

AXES = (
    *(("x", "y"), ("cx", "cy"), ("xm", "ym"), ("xc", "yc"), ("u", "v")),
    *(("lon", "lat"), ("lng", "lat"), ("long", "lat"), ("longitude", "latitude")),
    *(("easting", "northing"), ("eastings", "northings"), ("e", "n"), ("east", "north")),
    *(("col", "row"), ("cols", "rows"), ("column", "row"), ("pxl col", "pxl row")),
    *(("xcoord", "ycoord"), ("posx", "posy"), ("xpos", "ypos"), ("pointx", "pointy"), ("centerx", "centery")),
    *(("centroidx", "centroidy"), ("coordx", "coordy"), ("imagecol", "imagerow")),
)
"""Words for both axes, in lower case."""
PLACES = frozenset([
    "position", "positions", "pos", "center", "centre", "centroid", "coord", "coords", "coordinate",
    "coordinates", "location", "loc", "point", "landmark", "vertex", "weighted", "geographic", "decimal",
    "wgs84", "utm", "global", "local", "spatial", "area", "shape", "pxl", "in", "fullres",
])  # fmt: skip
"""Words beside those of the axes that say that a column is a position."""
UNITS = frozenset([
    "px", "pixel", "pixels", "um", "\u00b5m", "\u03bcm", "micron", "microns", "micrometer", "nm", "mm", "cm",
    "m", "deg", "degree", "degrees", "in",
])  # fmt: skip
PIXELS = frozenset(["px", "pixel", "pixels"])
COUNTS = frozenset([
    "id", "ids", "fid", "index", "idx", "label", "number", "num", "nr", "no", "cell", "spot", "track",
    "frame", "object", "particle", "slice", "t", "time", "z", "channel", "count", "layer", "level", "plane",
    "image", "specimen", "sample", "page", "group", "class", "cluster", "type", "rank", "order",
])  # fmt: skip
"""Words of columns that number something, which are never coordinates."""
NOT_PLACES = frozenset([
    "min", "max", "minimum", "maximum", "bounding", "bbox", "size", "width", "height", "std", "sd", "var", "error",
    "velocity", "speed", "acceleration", "scale", "rotation", "resolution", "spacing", "shift", "delta", "d",
])  # fmt: skip
"""Words of columns that have an axis, but are not positions."""
TYPES = frozenset([
    "float", "double", "int", "integer", "string", "number", "real", "float64", "float32", "int64",
])  # fmt: skip
MISSING = frozenset(["na", "n/a", "#n/a", "nan", "null", "none", "missing"])
"""Cells, in lower case, that mean a missing value."""
LISTED_NAMES = 12
MOST_WORDS = 12  # of a column's name; longer texts do not name coordinates
MOST_DIGITS = 15  # of a number that could be that of a row
UNSURE = 2  # kind of columns whose names have an axis beside words that are not of positions
_WORD = re.compile(r"[a-zµμ]+[0-9]*|[0-9]+")
_CAMEL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
_NUMBERED = re.compile(r"(axis|dim|centroid|weighted centroid|local centroid|coord) ?(\d)")


class Columns(NamedTuple):
    """The columns of a table with coordinates.

    Attributes:
        x, y: their numbers, from 0.
        note: how they were chosen, if they could be others; else empty.
        unit: the unit in their names, in lower case; else empty.
    """

    x: int
    y: int
    note: str = ""
    unit: str = ""


def named(head: Sequence[str], names_given: str) -> Columns:
    """Return the columns that the user named by their names or numbers.

    Raises:
        InputError: there are no such columns.
    """
    names = [name.strip() for name in head]
    indices = []
    for name in names_given.split(","):
        if name.strip() in names:
            indices.append(names.index(name.strip()))
        elif _is_count(name) and 1 <= int(name) <= len(names):
            indices.append(int(name) - 1)
        else:
            raise InputError(
                f"--columns: there is no column {name.strip()!r}; the table has {_listed(names)}"
            )
    if len(indices) != 2 or indices[0] == indices[1]:
        raise InputError("a table needs a column of x and one of y; name them with --columns X,Y")
    return Columns(indices[0], indices[1], unit=unit_of(names[indices[0]]))


def of_names(head: Sequence[str]) -> Columns | None:
    """Return the columns whose names say that they are x and y; None if there are none.

    Names that are only those of axes come before those with other words of positions, and these before others. Of
    several pairs of the same kind, the first is taken, with a note.

    >>> of_names(["id", "Centroid X µm", "Centroid Y µm"])
    Columns(x=1, y=2, note='', unit='µm')
    """
    words = [_words(name) for name in head]
    alike_columns: dict[tuple[str, tuple[str, ...]], list[int]] = {}
    for k, name in enumerate(words):
        alike_columns.setdefault((unit_of(head[k]), tuple(name)), []).append(k)
    pairs = list[tuple[int, int, int]]()
    for i, first in enumerate(words):
        for second in _counterparts(first):
            kind = _kind(first, second)
            if kind is not None:  # of columns with equal names, the first two are enough for the note
                pairs += [(kind, i, j) for j in alike_columns.get((unit_of(head[i]), second), [])[:2]]
    numbered = {
        (match[1], int(match[2])): k
        for k, name in enumerate(words)
        if (match := _NUMBERED.fullmatch(" ".join(name)))
    }
    for axis, number in sorted(numbered, reverse=True):  # of arrays, the last axis is x
        if (axis, number - 1) in numbered and (axis, number + 1) not in numbered:
            pairs.append((1, numbered[axis, number], numbered[axis, number - 1]))
    if not pairs:
        return None
    pairs.sort()
    kind, i, j = pairs[0]
    alike = [(a, b) for other, a, b in pairs if other == kind]
    note = ""
    if len(alike) > 1:
        others = " and ".join(head[k].strip() for k in alike[1])
        note = f"coordinates are {_both(head, i, j)}; {others} are kept as they are (--columns chooses)"
    elif kind == UNSURE:
        note = f"coordinates are taken from {_both(head, i, j)}; --columns names others"
    return Columns(i, j, note, unit_of(head[i]))


def guessed(head: Sequence[str], rows: Sequence[Sequence[str]], *, has_head: bool) -> Columns:
    """Return columns that can only be x and y, although their names do not say so, with a note.

    These are the only two columns of numbers that do not number the rows; without names, the first two of these.

    Raises:
        InputError: it cannot be known.
    """
    width = len(head)
    numeric = [
        k
        for k in range(width)
        if any(is_number(row[k]) for row in rows if k < len(row))
        and all(k >= len(row) or is_number(row[k]) or not _letters(row[k]) for row in rows)
        and not (has_head and set(_words(head[k])) & COUNTS)
    ]
    if (
        not has_head
        and len(numeric) > 2
        and _counts_rows([row[numeric[0]] for row in rows if numeric[0] < len(row)])
    ):
        del numeric[0]
    need = "a table needs a column of x and one of y; name them with --columns X,Y"
    if len(numeric) < 2 or (has_head and len(numeric) > 2):
        names = f"; the table has {_listed([name.strip() for name in head])}" if has_head else ""
        raise InputError(need + names)
    i, j = numeric[:2]
    if not has_head and width == 2:
        return Columns(i, j)
    what = _both(head, i, j) if has_head else f"columns {i + 1} and {j + 1}"
    return Columns(i, j, f"coordinates are taken from {what}; --columns names others")


def is_heading(cell: str) -> bool:
    """Return whether a cell below the name of a column explains it, such as `(micron)`, `X` or `float`."""
    text = cell.strip().lower()
    words = set(_words(text))
    axes = {word for pair in AXES for word in pair}
    return bool(words) and (
        text.startswith(("(", "[")) or words <= axes | PLACES | UNITS | TYPES or text in TYPES | UNITS
    )


def _words(name: str) -> list[str]:
    """Return the words of a name in lower case, without units in brackets and at the end."""
    words = _WORD.findall(_CAMEL.sub(" ", name.strip().lstrip("#")).lower())
    return [word for k, word in enumerate(words) if not (word in UNITS and k and word != "m")]


def unit_of(name: str, *, alone: bool = False) -> str:
    """Return the unit in a column's name, as its last word; with `alone` also if it is the only one. Else empty."""
    words = _WORD.findall(name.lower())
    return words[-1] if len(words) > (not alone) and words[-1] in UNITS - PIXELS else ""


def _counterparts(name: Sequence[str]) -> set[tuple[str, ...]]:
    """Return the names of columns of y that would belong to a column of x, all as words."""
    if len(name) > MOST_WORDS:
        return set()
    return {
        (*name[:k], other, *name[k + 1 :])
        for k, word in enumerate(name)
        for other in (
            *(y for x, y in AXES if x == word),
            *(["y" + word[1:]] if word[0] == "x" else []),
            *([word[:-1] + "y"] if word[-1] == "x" else []),
        )
    }


def _kind(first: Sequence[str], second: Sequence[str]) -> int | None:
    """Return how surely two names are those of x and y: 0 for axes alone, 1 beside words of positions, 2 beside others.

    None if they are not: they must differ in one word, that of the axis.
    """
    if len(first) != len(second):
        return None
    apart = [(a, b) for a, b in zip(first, second) if a != b]
    if len(apart) != 1 or not (apart[0] in AXES or _glued(*apart[0])):
        return None
    rest = [a for a, b in zip(first, second) if a == b]
    if not rest:
        return 0 if apart[0] in AXES else UNSURE
    if set(rest) & NOT_PLACES:
        return None
    return 1 if set(rest) & PLACES else UNSURE


def _glued(first: str, second: str) -> bool:
    """Return whether two words are x and y glued to the same word, such as `xlocation` and `ylocation`."""
    return (first[0] == "x" and second == "y" + first[1:]) or (
        first[-1] == "x" and second == first[:-1] + "y"
    )


def _counts_rows(cells: Sequence[str]) -> bool:
    """Return whether cells are consecutive integers."""
    return (
        len(cells) > 1
        and all(map(_is_count, cells))
        and all(int(b) == int(a) + 1 for a, b in pairwise(cells))
    )


def _is_count(cell: str) -> bool:
    """Return whether a text is a whole number without a sign that could number a row or column."""
    return cell.strip().isdecimal() and len(cell.strip()) <= MOST_DIGITS


def _letters(cell: str) -> bool:
    return bool(cell.strip()) and cell.strip().lower() not in MISSING


def _both(head: Sequence[str], i: int, j: int) -> str:
    return f"{head[i].strip()} and {head[j].strip()}"


def _listed(names: Sequence[str]) -> str:
    more = ", …" if len(names) > LISTED_NAMES else ""
    return ", ".join(names[:LISTED_NAMES]) + more
