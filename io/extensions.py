"""Extensions: mesh formats and commands that are found by their entry points.

Some come with iccm, in the folder `extensions`; others are those of other packages. A package declares them in its
`pyproject.toml` (docs/developers/extensions.md has an example):

    [project.entry-points."iccm.formats"]
    off2 = "package:FORMAT"

    [project.entry-points."iccm.commands"]
    measure = "package:measure"

Names of formats are suffixes without the dot, or patterns of names such as "lh.*"; objects are an
`iccm.io.formats.Format` or a command of click. Extensions are only looked for when a suffix or a command is not one of
iccm's own, so that they cost nothing otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator
from fnmatch import fnmatchcase
from functools import cache
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .extras import EXTRAS, Extra

if TYPE_CHECKING:
    from importlib import metadata

FORMATS_GROUP = "iccm.formats"
COMMANDS_GROUP = "iccm.commands"
GROUPS = {FORMATS_GROUP: "format", COMMANDS_GROUP: "command"}
"""The groups of entry points, with what is in them."""
REASON_LENGTH = 200  # characters of an extension's message, so that it fits in a line


@cache
def _entry_points(group: str) -> dict[str, metadata.EntryPoint]:
    """Return the entry points of a group by their names; of two with the same name, the first on the path."""
    from importlib import metadata  # slow to import, and seldom needed

    points: dict[str, metadata.EntryPoint] = {}
    for point in metadata.entry_points(group=group):
        points.setdefault(point.name, point)
    return points


def _by_suffix() -> dict[str, metadata.EntryPoint]:
    """Return the entry points of formats by their suffixes."""
    points = _entry_points(FORMATS_GROUP)
    return {
        name.lower() if "*" in name else f".{name.removeprefix('.').lower()}": point
        for name, point in points.items()
    }


def formats() -> tuple[str, ...]:
    """Return the suffixes of the formats of extensions, such as ".off2", and patterns of names, such as "lh.*"."""
    return tuple(_by_suffix())


def fitting(name: str, suffix: str) -> str | None:
    """Return which format of an extension fits a file's name in lower case: its suffix, a longer one, or a pattern."""
    known = _by_suffix()
    if suffix in known:
        return suffix
    patterns = [pattern if "*" in pattern else f"*{pattern}" for pattern in known]
    return next((key for key, pattern in zip(known, patterns) if fnmatchcase(name, pattern)), None)


def commands() -> dict[str, str]:
    """Return the commands of extensions, with the packages that bring them."""
    return {name: _origin(point) for name, point in _entry_points(COMMANDS_GROUP).items()}


def format_of(suffix: str) -> Any | None:
    """Return the format of an extension for a suffix; None if there is none.

    Raises:
        InputError: the extension cannot be loaded.
    """
    point = _by_suffix().get(suffix)
    return None if point is None else load(point)


def command_of(name: str) -> Any | None:
    """Return the command of an extension; None if there is none of this name.

    Raises:
        InputError: the extension cannot be loaded.
    """
    point = _entry_points(COMMANDS_GROUP).get(name)
    return None if point is None else load(point)


def load(point: metadata.EntryPoint) -> Any:
    """Import what an entry point names.

    Raises:
        InputError: this fails; the message names the package.
    """
    try:
        return point.load()
    except Exception as error:  # whatever a broken extension raises is reported in one line
        reason = " ".join(str(error).split())[:REASON_LENGTH] or type(error).__name__
        raise InputError(
            f"{_origin(point)}: the extension {point.name} cannot be loaded: {reason}; update or uninstall it"
        ) from None


def listed() -> Iterator[tuple[str, str, Exception | None]]:
    """Yield each extension of another package with this package, and the error if it cannot be loaded.

    Those that come with iccm are only listed if they cannot be loaded.
    """
    for group, kind in GROUPS.items():
        for point in _entry_points(group).values():
            error = None
            try:
                load(point)
            except InputError as failure:
                error = failure
            if error is not None or not _comes_with_iccm(point):
                yield f"{kind} {point.name}", _origin(point), error


def extras() -> tuple[Extra, ...]:
    """Return the extras of iccm itself, then those of the extensions that come with it."""
    found = dict.fromkeys(EXTRAS)
    for group in GROUPS:
        for point in filter(_comes_with_iccm, _entry_points(group).values()):
            try:
                extra = getattr(load(point), "extra", None)
            except InputError:  # `listed` returns it
                continue
            if isinstance(extra, Extra):
                found[extra] = None
    return tuple(found)


def _comes_with_iccm(point: metadata.EntryPoint) -> bool:
    return point.dist is not None and point.dist.name == "iccm"


def _origin(point: metadata.EntryPoint) -> str:
    """Return the package that brings an entry point, with its version."""
    return "unknown package" if point.dist is None else f"{point.dist.name} {point.dist.version}"
