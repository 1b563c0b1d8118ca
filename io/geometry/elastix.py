"""Point sets of elastix and transformix: the input file, and the table of results that transformix writes."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ..point_syntax import coordinate
from .document import Geometry, Images, TextDocument

HEADS = ("point", "index")
"""First lines of an input file: points in the units of the image, or numbers of its pixels."""
_COUNT = re.compile("[0-9]{1,9}")
_RESULT = re.compile(r"\bOutputPoint\s*=\s*\[([^\]]*)\]")


@dataclass
class PointSet(TextDocument):
    """Points in the plane, one a line."""

    keeps = False

    head: str
    geometry: Geometry

    @classmethod
    def parse(cls, data: bytes, columns: str | None) -> PointSet:
        """Read an input file (`point` or `index`, the number of points, the points), or the `OutputPoint` of each line
        of `outputpoints.txt`.
        """
        lines = [line.strip() for line in data.decode("utf-8-sig").splitlines()]
        rows = [(number, line) for number, line in enumerate(lines, 1) if line]
        if not rows:
            raise InputError("is empty")
        if all(_RESULT.search(line) for _, line in rows):
            return cls(HEADS[0], Geometry(_points([(n, _RESULT.findall(line)[-1]) for n, line in rows])))
        head = rows[0][1].lower()
        if head not in HEADS or len(rows) < 2 or not _COUNT.fullmatch(rows[1][1]):
            raise InputError("does not begin with point or index and the number of points (elastix)")
        count, places = int(rows[1][1]), rows[2:]
        if len(places) != count:
            raise InputError(f"announces {count} points, but contains {len(places)}")
        if not count:
            raise InputError("contains no points")
        return cls(head, Geometry(_points(places)))

    def text(self, images: Images) -> str:
        """Return an input file with the images of the points; those without one are dropped."""
        z = images.points[~np.isnan(images.points)]
        rows = [f"{x!r} {y!r}" for x, y in zip(z.real.tolist(), z.imag.tolist())]
        return "\n".join([self.head, str(len(rows)), *rows]) + "\n"


def _points(rows: list[tuple[int, str]]) -> np.ndarray:
    """Return the positions in some lines, each with its number for messages."""
    positions = list[complex]()
    for number, row in rows:
        words = row.split()
        if len(words) != 2:
            raise InputError(f"line {number}: has {len(words)} coordinates; points in the plane have two")
        x, y = (coordinate(word, f"line {number}") for word in words)
        positions.append(complex(x, y))
    return np.array(positions)
