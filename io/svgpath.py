"""SVG path data to polylines: the grammar checked strictly, curves flattened to a tolerance.

svgelements cuts malformed data short without a word, so that the grammar is checked here first; the geometry of the
commands (relative, smooth, elliptical) is svgelements' own.
"""

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import svgelements

from ..cauchy import Complex
from ..errors import InputError
from .affine import Affine

_COUNTS = {"M": 2, "Z": 0, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7}
# possessive quantifiers (++, *+): no backtracking, so that a megabyte of spaces is read as fast as any other
_SPACE = re.compile(r"\s*+")
_COMMAND = re.compile(r"[A-Za-z]")
_NUMBER = re.compile(r"\s*+(?:,\s*+)?([+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?)")
_FLAG = re.compile(r"\s*+(?:,\s*+)?([01])")
_LARGEST = 1e100  # beyond this, areas overflow


@dataclass(frozen=True, eq=False)
class Subpath:
    """One run of a path: complex vertices in the file's directions, and whether it was closed by Z."""

    z: Complex
    closed: bool


def commands(d: str) -> Iterator[tuple[str, list[str]]]:
    """The commands of path data with their arguments, in order.

    Raises:
        InputError: anything that SVG's grammar does not allow, with the place (a character number from 1).
    """
    position, previous = _skip(d, 0), ""
    while position < len(d):
        match = _COMMAND.match(d, position)
        if not match or match[0].upper() not in _COUNTS:
            raise InputError(
                f"d: character {position + 1}: {d[position : position + 12]!r} is not a path command"
            )
        if not previous and match[0] not in "Mm":
            raise InputError(f"d: character {position + 1}: path data must begin with M, not {match[0]!r}")
        previous = match[0]
        arguments, position = _arguments(d, match.end(), previous)
        yield previous, arguments


def _arguments(d: str, position: int, command: str) -> tuple[list[str], int]:
    count, start = _COUNTS[command.upper()], position
    found: list[str] = []
    while True:
        flag = command in "Aa" and len(found) % 7 in (3, 4)
        match = (_FLAG if flag else _NUMBER).match(d, position) if count else None
        if not match:
            break
        if not abs(float(match[1])) <= _LARGEST:
            raise InputError(f"d: character {position + 1}: the number is too large")
        found.append(match[1])
        position = match.end()
    position = _skip(d, position)
    if count and (not found or len(found) % count):
        raise InputError(
            f"d: character {position + 1}: command {command} (character {start}) takes {count} numbers a time,"
            f" {len(found)} are given before {d[position : position + 12] or 'the end'!r}"
        )
    return found, position


def _skip(d: str, position: int) -> int:
    return _SPACE.match(d, position).end()  # type: ignore[union-attr]


def numbers(text: str) -> list[float]:
    """A list of numbers separated as in SVG, as in `points` and `viewBox`.

    Raises:
        InputError: anything else in it, with its place.
    """
    found, position = [], 0
    while match := _NUMBER.match(text, position):
        found.append(float(match[1]))
        position = match.end()
    if text[position:].strip() or not all(abs(x) <= _LARGEST for x in found):
        raise InputError(
            f"character {position + 1}: {text[position:].strip()[:12]!r} is not a number in range"
        )
    return found


def subpaths(d: str, affine: Affine, flatness: float) -> list[Subpath]:
    """The runs of path data under an affine map, each flattened to `flatness` times its own diagonal.

    A run never deviates from its curve by more than the tolerance, and every end of a segment stays a vertex: with
    uniform parameter steps h the error of a chord is at most h² max|f''| / 8.

    Raises:
        InputError: as `commands`.
    """
    normal = " ".join(" ".join((c, *arguments)) for c, arguments in commands(d))
    return [_flatten(run, affine, flatness) for run in _runs(svgelements.Path(normal))]


def _runs(segments: Iterable) -> Iterator[list]:
    """Segments split at every M, and after every Z; the last one of a closed run is its Close."""
    run: list = []
    for segment in segments:
        if isinstance(segment, svgelements.Move):
            if run:
                yield run
            run = []
        else:
            run.append(segment)
            if isinstance(segment, svgelements.Close):
                yield run
                run = []
    if run:
        yield run


def _flatten(run: list, affine: Affine, flatness: float) -> Subpath:
    closed = isinstance(run[-1], svgelements.Close)
    pieces = [_Piece(segment, affine) for segment in run if not isinstance(segment, svgelements.Close)]
    start = affine(complex(run[0].start))
    rough = np.array([start, *(point for piece in pieces for point in piece.rough())])
    tolerance = flatness * math.hypot(np.ptp(rough.real), np.ptp(rough.imag))
    parts = [np.array([start]), *(piece.points(tolerance) for piece in pieces)]
    return Subpath(np.concatenate(parts), closed)


class _Piece:
    """One segment under an affine map: a point for every parameter in [0, 1], and a bound on |f''|."""

    def __init__(self, segment, affine: Affine):
        self.end = affine(complex(segment.end))
        self.bend = 0.0
        self.arc = isinstance(segment, svgelements.Arc)
        if self.arc:
            self._set_arc(segment, affine)
        else:
            names = [n for n in ("start", "control", "control1", "control2", "end") if hasattr(segment, n)]
            self.p = [affine(complex(getattr(segment, n))) for n in names]
            degree = len(self.p) - 1
            second = np.abs(np.diff(self.p, 2)) if degree > 1 else np.zeros(1)
            self.bend = degree * (degree - 1) * float(second.max())

    def _set_arc(self, arc, affine: Affine) -> None:
        centre = complex(arc.center)
        self.p = [affine(centre)]
        self.p += [affine(complex(axis)) - self.p[0] for axis in (arc.prx, arc.pry)]
        self.begin, self.sweep = arc.get_start_t(), arc.sweep
        self.bend = math.hypot(abs(self.p[1]), abs(self.p[2])) * self.sweep**2

    def at(self, t: np.ndarray) -> Complex:
        if self.arc:
            angle = self.begin + self.sweep * t
            return self.p[0] + self.p[1] * np.cos(angle) + self.p[2] * np.sin(angle)
        points = [np.full(t.shape, p) for p in self.p]  # de Casteljau
        while len(points) > 1:
            points = [a * (1 - t) + b * t for a, b in pairwise(points)]
        return points[0]

    def rough(self) -> list[complex]:
        """A few points that are on the segment: their box is never larger than the segment's."""
        return [*self.at(np.array([0.25, 0.5, 0.75])), self.end] if self.bend else [self.end]

    def points(self, tolerance: float) -> Complex:
        """The vertices after the start, at most `tolerance` from the segment."""
        if not self.bend or not tolerance:
            return np.array([self.end])
        count = max(1, math.ceil(math.sqrt(self.bend / (8 * tolerance))))
        points = self.at(np.arange(1, count + 1) / count)
        points[-1] = self.end
        return points
