"""Every way to fail, as one line on stderr and an exit code."""

from __future__ import annotations

import os
import sys
import traceback

import click

from ..errors import IccmError
from . import logs

INPUT, INTERNAL, PIPE = 2, 70, 141
"""Exit codes beside 0 (done) and 1 (not good enough); 128 + signal when stopped by one."""


class Unread(Exception):
    """The reader of stdout went away: by a name that click does not know, which would exit with 1."""


def explain(error: BaseException) -> int:
    """Say on stderr what went wrong and return the exit code for it."""
    if isinstance(error, SystemError) and error.__cause__ is not None:
        return explain(error.__cause__)  # compiled code was entered with a signal's exception pending
    if isinstance(error, SystemExit):
        return error.code if isinstance(error.code, int) else 0
    if isinstance(error, BrokenPipeError | Unread):
        return _broken_pipe()
    if isinstance(error, logs.Terminated):
        return _say(f"stopped by signal {error.signal}", 128 + error.signal)
    if isinstance(error, (KeyboardInterrupt, click.Abort)):
        return _say("interrupted", 130)
    if logs.debug():
        traceback.print_exception(error)
    for mistake in getattr(error, "mistakes", [])[:-1]:
        logs.log.error(_one_line(mistake))
    if getattr(error, "mistakes", []):
        return _say(_one_line(error.mistakes[-1]), INPUT)  # type: ignore[attr-defined]
    return _say(*sentence(error))


def sentence(error: BaseException) -> tuple[str, int]:
    """What went wrong in one line, and the exit code."""
    if isinstance(error, click.UsageError) and error.ctx is not None:
        return f"{_one_line(error.format_message())} (see `{error.ctx.command_path} --help`)", INPUT
    if isinstance(error, click.ClickException):
        return _one_line(error.format_message()), INPUT
    if isinstance(error, IccmError):
        return _one_line(str(error)), INPUT
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror}", INPUT
    if isinstance(error, MemoryError) or _lacks_memory(error):
        return "out of memory; ask for a smaller --size or fewer --vertices", INTERNAL
    name = type(error).__name__
    return (
        f"internal error, please report it ({name}: {_one_line(str(error))}); --debug shows where",
        INTERNAL,
    )


def _lacks_memory(error: BaseException) -> bool:
    """Whether a library that cannot be loaded, a thread that cannot start or a failed allocation is what is wrong."""
    if (
        not isinstance(error, ImportError | OSError | RuntimeError | SystemError)
        and "GEOS" not in type(error).__name__
    ):
        return False
    text = str(error)
    return any(
        sign in text for sign in ("failed to map", "annot allocate memory", "bad_alloc", "start new thread")
    )


def _say(message: str, code: int) -> int:
    logs.log.error(message)
    return code


def _one_line(text: str) -> str:
    """One line; what a terminal would act on is written out."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(text.split()))


def _broken_pipe() -> int:
    """The reader of stdout went away, as `| head` does: end quietly, and keep Python from flushing into the pipe."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return PIPE
