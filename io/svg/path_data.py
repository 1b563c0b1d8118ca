"""Parse SVG path data strictly, and flatten its curves to polylines within a tolerance.

This is not left to svgelements, which knows the whole grammar but silently truncates malformed data, misreads numbers
such as `5.` and fails on arcs with extreme radii.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...arrays import Complex, Index, Real
from ...errors import InputError
from .. import limits
from .affine import Affine
from .batches import Batch, batches
from .budget import Budget
from .curves import Piece, Polyline, arc, bezier

_COUNTS = {"M": 2, "Z": 0, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7}
# possessive quantifiers (++, *+) avoid backtracking: a megabyte of spaces takes no longer than other text
_SPACE = re.compile(r"\s*+")
_COMMAND = re.compile(r"[A-Za-z]")
_DIGITS = r"[+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?"
_NUMBER = re.compile(rf"\s*+(?:,\s*+)?({_DIGITS})")
_BARE = re.compile(_DIGITS)
_LIST = re.compile(rf"(?:\s*+(?:,\s*+)?{_DIGITS})*+")
# Pairs of numbers, optionally with the same letter repeated: a sequence of lines.
_STRETCH = {
    letter: re.compile(rf"(?:(?:\s*+{letter})?+(?:\s*+(?:,\s*+)?{_DIGITS}){{2}})++") for letter in "Ll"
}
_FLAG = re.compile(r"\s*+(?:,\s*+)?([01])")
LINES_PER_PIECE = 8  # least number of consecutive lines that are stored as one piece
LONG_CHARACTERS = 1 << 20  # characters of path data above which numbers are counted before parsing


@dataclass(frozen=True, eq=False)
class Subpath:
    """One flattened subpath.

    `z` (n,) has its vertices in the file's directions, `closed` is whether it ends with Z, and `original_size` is the
    number of vertices before simplification, 0 if it was not simplified.
    """

    z: Complex
    closed: bool
    original_size: int = 0


def commands(d: str, faults: list[str] | None = None) -> Iterator[tuple[str, list[float]]]:
    """Yield the commands of path data with their arguments, in order.

    Args:
        d: path data.
        faults: if given, the first error is added to it, with its position (character number from 1), and the commands
            before it are yielded, including complete arguments of the malformed command.

    Raises:
        InputError: the first error, if `faults` is None.
    """
    try:
        yield from _commands(d, keep=faults is not None)
    except _FaultError as error:
        if faults is None:
            raise InputError(str(error)) from None
        faults.append(str(error))


class _FaultError(Exception):
    """A violation of SVG's grammar."""


def _commands(d: str, *, keep: bool) -> Iterator[tuple[str, list[float]]]:
    """Yield as `commands`; with `keep`, complete arguments of a malformed command are yielded before the error.

    Raises:
        _FaultError: at the first error.
    """
    position, previous, tidy = _skip(d, 0), "", True
    while position < len(d):
        match = _COMMAND.match(d, position)
        if not match or match[0].upper() not in _COUNTS:
            raise _FaultError(
                f"d: character {position + 1}: {d[position : position + 12]!r} is not a path command"
            )
        if not previous and match[0] not in "Mm":
            raise _FaultError(f"d: character {position + 1}: path data must begin with M, not {match[0]!r}")
        previous = match[0]
        stretch = _STRETCH[previous].match(d, match.end()) if previous in _STRETCH and tidy else None
        if stretch and not _NUMBER.match(d, stretch.end()):
            values = list(map(float, _BARE.findall(d, match.end(), stretch.end())))
            if all(abs(x) <= limits.SVG_NUMBER for x in values):
                yield previous, values
                position = _skip(d, stretch.end())
                continue
        tidy = tidy and not stretch  # errors are located command by command
        arguments, position, fault = _arguments(d, match.end(), previous)
        if fault and keep and arguments:
            yield previous, arguments
        if fault:
            raise _FaultError(fault)
        yield previous, arguments


def _arguments(d: str, position: int, command: str) -> tuple[list[float], int, str]:
    """Return the complete arguments of a command, the position where they end, and the error if any."""
    count, start = _COUNTS[command.upper()], position
    arguments: list[float] = []
    fault = ""
    while True:
        flag = command in "Aa" and len(arguments) % 7 in (3, 4)
        match = (_FLAG if flag else _NUMBER).match(d, position) if count else None
        if not match:
            break
        if not abs(float(match[1])) <= limits.SVG_NUMBER:
            fault = f"d: character {position + 1}: the number is too large"
            break
        arguments.append(float(match[1]))
        position = match.end()
    position = _skip(d, position)
    if count and not fault and (not arguments or len(arguments) % count):
        fault = (
            f"d: character {position + 1}: command {command} (character {start}) takes {count} numbers at "
            f"a time, but {len(arguments)} are given before {d[position : position + 12] or 'the end'!r}"
        )
    return arguments[: len(arguments) // count * count] if count else arguments, position, fault


def _skip(d: str, position: int) -> int:
    return _SPACE.match(d, position).end()  # type: ignore[union-attr]


def numbers(text: str, faults: list[str] | None = None) -> list[float]:
    """Parse a list of numbers as in `points` and `viewBox`.

    Args:
        text: the list.
        faults: if given, the first error is added to it, with its position, and the numbers before it are returned.

    Raises:
        InputError: the first error, if `faults` is None.
    """
    position = _LIST.match(text).end()  # type: ignore[union-attr]
    values = list(map(float, _BARE.findall(text, 0, position)))
    large = next((k for k, x in enumerate(values) if not abs(x) <= limits.SVG_NUMBER), None)
    if text[position:].strip() or large is not None:
        fault = f"character {position + 1}: {text[position:].strip()[:12]!r} is not a number in range"
        if faults is None:
            raise InputError(fault)
        faults.append(f"points: {fault}")
    return values[:large]


@dataclass(eq=False)
class PenPath:
    """One subpath: its start point, its segments, and whether Z closed it."""

    start: complex
    pieces: list[Piece] = field(default_factory=list)
    closed: bool = False


def least(d: str) -> int:
    """Return a lower bound on the number of segments in path data, or of points in a list, without parsing it."""
    letters = sum(map(d.count, "LlHhVvCcSsQqTtAa"))
    return max(letters, sum(1 for _ in _BARE.finditer(d)) // 7) if len(d) > LONG_CHARACTERS else letters


def runs(
    d: str, budget: Budget | None = None, *, joined: bool = False, faults: list[str] | None = None
) -> list[PenPath]:
    """Return the subpaths ("runs") of path data in its own coordinates; one begins at every M, and after every Z.

    Args:
        d: path data.
        budget: limit that segments count towards.
        joined: whether a sequence of lines may be stored as one piece, `Polyline`.
        faults: as for `commands`.

    Raises:
        InputError: as for `commands`, or the budget is exceeded.
    """
    budget = budget or Budget()
    budget.segments.check(least(d))
    pens: list[PenPath] = []
    pen = _Pen()
    for command, values in commands(d, faults):
        kind, count = command.upper(), _COUNTS[command.upper()]
        budget.segments.spend(len(values) // count if count else 0)
        budget.runs.spend(kind == "M")
        if kind == "Z":
            if pen.down:
                pens[-1].closed = True
            pen = _Pen(pen.start, pen.start)
        if joined and kind == "L" and len(values) > LINES_PER_PIECE:
            if not pen.down:
                pen.down = True
                pens.append(PenPath(pen.position))
            pens[-1].pieces.append(pen.stretch(command.islower(), values))  # type: ignore[arg-type]
            continue
        for k in range(0, len(values), count or 1):
            group = values[k : k + count]
            if kind == "M" and k == 0:
                to = (pen.position if command == "m" else 0) + complex(*group)
                pen = _Pen(to, to)
                continue
            if not pen.down:
                pen.down = True
                pens.append(PenPath(pen.position))
            pens[-1].pieces.append(pen.draw("L" if kind == "M" else kind, command.islower(), group))
    return pens


@dataclass
class _Pen:
    """The state of a path: current point, start of the subpath, last command and last control point."""

    position: complex = 0j
    start: complex = 0j
    last: str = ""
    control: complex = 0j
    down: bool = False

    def stretch(self, relative: bool, values: list[float]) -> Polyline:
        """Return the lines of one command as one piece."""
        z = np.concatenate([[self.position], np.array(values).view(np.complex128)])
        z = np.cumsum(z) if relative else z
        self.position, self.last, self.control = complex(z[-1]), "L", complex(z[-1])
        return Polyline(z)

    def draw(self, kind: str, relative: bool, values: list[float]) -> Piece:
        """Return the segment of one command, given its numbers."""
        origin = self.position if relative else 0j
        if kind in "HV":
            x = values[0] + origin.real if kind == "H" else self.position.real
            y = values[0] + origin.imag if kind == "V" else self.position.imag
            points = [complex(x, y)]
        else:
            tail = values[5:] if kind == "A" else values
            points = [origin + complex(x, y) for x, y in zip(tail[::2], tail[1::2])]
        if kind in "ST":  # reflect the control point of the previous curve if it is of the same kind
            continues = self.last in ("CS" if kind == "S" else "QT")
            points.insert(0, 2 * self.position - self.control if self.last and continues else self.position)
        start, self.position, self.last = self.position, points[-1], kind
        self.control = points[-2] if len(points) > 1 else self.position
        if kind != "A":
            return bezier([start, *points])
        rx, ry, rotation, large, sweep = values[:5]
        return arc(start, rx, ry, rotation, large, sweep, self.position)


def subpaths(d: str, affine: Affine, flatness: float, budget: Budget | None = None) -> list[Subpath]:
    """Return the subpaths of path data under an affine map, each flattened to `flatness` times its own diagonal.

    A polyline deviates from its curve by at most this tolerance, and every end of a segment stays a vertex.

    Raises:
        InputError: as for `commands`, or the budget is exceeded.
    """
    budget = budget or Budget()
    return flatten(runs(d, budget, joined=True), affine, flatness, budget)


def flatten(pens: Sequence[PenPath], affine: Affine, flatness: float, budget: Budget) -> list[Subpath]:
    """Return subpaths under an affine map as polylines, see `subpaths`.

    The segments of all subpaths are flattened together: text consists of thousands of subpaths of a few segments.

    Raises:
        InputError: the budget is exceeded.
    """
    if not pens:
        return []
    groups = batches([piece for run in pens for piece in run.pieces], affine)
    lengths = np.array([len(run.pieces) for run in pens])
    run_of = np.repeat(np.arange(len(pens)), lengths)
    starts = affine(np.array([run.start for run in pens]))
    tolerance = flatness * _diagonals(starts, groups, run_of)
    counts = np.empty(run_of.size, dtype=np.int64)
    for group in groups:
        counts[group.number] = group.counts(tolerance[run_of[group.number]])
    budget.points.spend(int(counts.sum()))
    z = np.empty(len(pens) + counts.sum(), dtype=np.complex128)
    ends = 1 + run_of + np.cumsum(counts)  # of each piece in z, where each run also has its start
    for group in groups:
        own_counts = counts[group.number]
        first = np.cumsum(own_counts) - own_counts
        z[np.repeat(ends[group.number] - own_counts - first, own_counts) + np.arange(own_counts.sum())] = (
            group.points(own_counts)
        )
    sizes = 1 + np.bincount(run_of, counts, len(pens)).astype(np.int64)
    last = np.cumsum(sizes)
    z[last - sizes] = starts
    return [Subpath(part, run.closed) for part, run in zip(np.split(z, last[:-1]), pens)]


def _diagonals(starts: Complex, groups: Sequence[Batch], run_of: Index) -> Real:
    """Return (r,) diagonals of the boxes of subpaths, from their start points and rough points of their segments."""
    low_x, high_x = starts.real.copy(), starts.real.copy()
    low_y, high_y = starts.imag.copy(), starts.imag.copy()
    for group in groups:
        points, piece = group.rough()
        run = run_of[piece]
        np.minimum.at(low_x, run, points.real)
        np.maximum.at(high_x, run, points.real)
        np.minimum.at(low_y, run, points.imag)
        np.maximum.at(high_y, run, points.imag)
    return np.hypot(high_x - low_x, high_y - low_y)
