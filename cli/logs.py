"""Messages on stderr: verbosity (`-v`, `-q`) and format (`--log-format`); signals; errors as one line and an exit
code.
"""

from __future__ import annotations

import json
import logging
import os
import re
import shutil
import signal
import sys
import textwrap
import threading
import traceback
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from ..deadline import TimeUp
from ..errors import IccmError, lacks_memory, printable

if TYPE_CHECKING:
    from ..io.run.job import Outcome

log = logging.getLogger("iccm")
POOR_LEVEL = 35
"""Log level of notes about the result, which --quiet does not hide."""
IN_PARENTHESES = re.compile(r"\(([a-z_]+)\)(?=[.;:,]|$)")
"""A name of an option or figure in a note."""
KEYWORD = re.compile(r"\b([a-z_]+)='([a-z-]+)'")
"""A remedy in a note, as it is written in Python."""
NARROWEST_COLUMNS = 40
"""Columns to which messages are wrapped at least, also on narrower terminals."""
INDENTED = {
    "initial_indent": "  ",
    "subsequent_indent": "  ",
    "break_long_words": False,
    "break_on_hyphens": False,
}
EXIT_POOR, EXIT_INPUT, EXIT_INTERNAL, EXIT_PIPE = 1, 2, 70, 141
"""Exit codes besides 0 (done): the first is that of a result that is not good enough, or of none in time; a process
that is stopped by a signal exits with 128 + signal.
"""


class Terminated(BaseException):
    """Raised when a signal asks the process to stop, so that temporary files are removed."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.signal = number


class _Text(logging.Formatter):
    """Format messages as `error: …`, `note: …`, or plain text for other levels."""

    def format(self, record: logging.LogRecord) -> str:
        """Format one record as one line, whatever characters names of files contain."""
        label = ""
        if record.levelno >= logging.ERROR:
            label = styled("error:", sys.stderr, fg="red", bold=True) + " "
        elif record.levelno in (logging.WARNING, POOR_LEVEL):
            label = styled("note:", sys.stderr, fg="yellow") + " "
        return wrapped(label + printable(record.getMessage()))


def wrapped(text: str) -> str:
    """Wrap text at words to the width of the terminal; unchanged if stderr is not a terminal.

    Names of files and options are not broken, so that they can be copied.
    """
    if not sys.stderr.isatty():
        return text
    wide = max(NARROWEST_COLUMNS, shutil.get_terminal_size().columns) - 1
    if len(click.unstyle(text)) <= wide:
        return text
    hidden = len(text) - len(click.unstyle(text))  # colour codes, all of them in the label
    first, *rest = textwrap.wrap(text, wide + hidden, break_long_words=False, break_on_hyphens=False)
    return "\n".join([first, *textwrap.wrap(" ".join(rest), wide - 2, **INDENTED)])  # type: ignore[arg-type]


def styled(text: str, stream: Any, **style: Any) -> str:
    """Apply `click.style`, if the stream is a terminal with colours and NO_COLOR (no-color.org) is not set."""
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb" or not stream.isatty()
    return text if plain else click.style(text, **style)


class _Json(logging.Formatter):
    """Format messages as JSON, one object per line: level, message and additional fields."""

    def format(self, record: logging.LogRecord) -> str:
        """Format one record as one line."""
        fields = getattr(record, "fields", {})
        return json.dumps(
            {
                "level": "warning" if record.levelno == POOR_LEVEL else record.levelname.lower(),
                "message": record.getMessage(),
                **fields,
            },
            default=str,
        )


class _Stderr(logging.StreamHandler):
    """Write to the current sys.stderr, also after it was replaced."""

    def __init__(self) -> None:
        logging.Handler.__init__(self)

    @property
    def stream(self) -> Any:
        """The current stream."""
        return sys.stderr


_state = {"debug": False}


def reset() -> None:
    """Reset to text messages of level info and above."""
    _state["debug"] = False
    configure(0, "text")


def configure(verbosity: int, form: str) -> None:
    """Set the verbosity of the `iccm` logger: -1 errors and warnings about the result, 0 also notes and results, 1
    all.
    """
    handler = _Stderr()
    handler.setFormatter(_Json() if form == "json" else _Text())
    log.handlers[:] = [handler]
    root = logging.getLogger()
    if not root.handlers:  # else what libraries log about damaged files would go to stderr
        root.addHandler(logging.NullHandler())
    log.propagate = False
    levels = {-1: POOR_LEVEL, 0: logging.INFO, 1: logging.DEBUG}
    log.setLevel(levels[max(-1, min(verbosity, 1))])


def is_verbose() -> bool:
    """Return whether messages are text and include more than errors."""
    return log.isEnabledFor(logging.INFO) and isinstance(log.handlers[0].formatter, _Text)


def debug() -> bool:
    """Return whether --debug was given."""
    return _state["debug"]


def tell(remark: str) -> None:
    """Show a note. Notes about the result are shown even with --quiet."""
    from ..io.run.phases import Doubt

    log.log(POOR_LEVEL if isinstance(remark, Doubt) else logging.WARNING, with_options(remark))


def with_options(remark: str) -> str:
    """Return a note with the options that it names, in parentheses or as in Python, as they are typed.

    Figures of reports stay.

    >>> with_options("Exact pins meet theirs (exact_pins).")
    'Exact pins meet theirs (--exact-pins).'
    >>> with_options("43% of the target drawing stays bare (covered).")
    '43% of the target drawing stays bare (covered).'
    >>> with_options("fit='cover' covers all of it.")
    '--fit cover covers all of it.'
    """
    from ..io.options import options_of

    def typed(name: re.Match[str]) -> str:
        return f"(--{name[1].replace('_', '-')})" if name[1] in options_of() else name[0]

    def remedy(keyword: re.Match[str]) -> str:
        return f"--{keyword[1].replace('_', '-')} {keyword[2]}" if keyword[1] in options_of() else keyword[0]

    return KEYWORD.sub(remedy, IN_PARENTHESES.sub(typed, remark))


def conclude(name: str, outcome: Outcome, figures: Iterable[str]) -> int:
    """Show the figures of a run, the files it wrote and its problem, if any. Returns the exit code."""
    for line in (*figures, *(f"wrote {path}" for path in outcome.written)):
        log.info(line)
    if not outcome.ok:
        log.error(f"{name}: {outcome.message}")
    return int(not outcome.ok)


def silence_others() -> None:
    """Silence warnings of other libraries, such as NumPy and trimesh; `configure` silences their logs."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")


def apply(ctx: click.Context, parameter: click.Parameter, value: Any) -> None:
    """Apply an option of `MessageOptions` (a click callback)."""
    messages = ctx.meta.setdefault("iccm.messages", {})
    messages[parameter.name] = value
    _state["debug"] = _state["debug"] or bool(messages.get("debug"))
    configure(
        -1 if messages.get("quiet") else int(messages.get("verbose", 0)), messages.get("log_format", "text")
    )


@contextmanager
def raise_on_signals() -> Iterator[None]:
    """Raise an exception on SIGTERM, SIGHUP and SIGBREAK (Windows) while the block runs (main thread only)."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: object) -> None:
        raise Terminated(number)

    names = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]
    handlers = {
        number: signal.signal(number, stop) for number in names if signal.getsignal(number) is signal.SIG_DFL
    }
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


class Unread(Exception):
    """Raised when the reader of stdout is gone. It is not a BrokenPipeError, on which click would exit with 1."""


def explain(error: BaseException) -> int:
    """Show an error on stderr and return its exit code."""
    if isinstance(error, SystemError) and error.__cause__ is not None:
        return explain(error.__cause__)  # compiled code was entered with a signal's exception pending
    if isinstance(error, SystemExit):
        return error.code if isinstance(error.code, int) else 0
    if isinstance(error, BrokenPipeError | Unread):
        return _broken_pipe()
    if isinstance(error, Terminated):
        return _say(f"stopped by signal {error.signal}", 128 + error.signal)
    if isinstance(error, (KeyboardInterrupt, click.Abort)):
        return _say("interrupted", 130)
    if debug():
        traceback.print_exception(error)
    mistakes = [
        mistake if isinstance(mistake, str) else ": ".join(filter(None, mistake))  # of a key, from a job
        for mistake in getattr(error, "mistakes", [])
    ]
    for mistake in mistakes[:-1]:
        log.error(mistake)
    if mistakes:
        return _say(mistakes[-1], EXIT_INPUT)
    return _say(*sentence(error))


def sentence(error: BaseException) -> tuple[str, int]:
    """Return the message of an error in one line, and its exit code."""
    if isinstance(error, click.UsageError) and error.ctx is not None:
        return (
            f"{_one_line(error.format_message())} (run `{error.ctx.command_path} --help` for help)",
            EXIT_INPUT,
        )
    if isinstance(error, click.ClickException):
        return _one_line(error.format_message()), EXIT_INPUT
    if isinstance(error, TimeUp):
        return str(error), EXIT_POOR
    if isinstance(error, IccmError):
        return str(error), EXIT_INPUT
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror}", EXIT_INPUT
    if lacks_memory(error):
        return "out of memory; choose a smaller --size or fewer --vertices", EXIT_INTERNAL
    name = type(error).__name__
    return (
        f"internal error, please report it ({name}: {_one_line(str(error))}); --debug shows the traceback",
        EXIT_INTERNAL,
    )


def _say(message: str, code: int) -> int:
    log.error(message)
    return code


def _one_line(text: str) -> str:
    """Join the lines of a message of a library."""
    return " ".join(text.split())


def _broken_pipe() -> int:
    """End quietly after the reader of stdout is gone (such as `| head`), without flushing into the pipe."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return EXIT_PIPE


def explain_idle(names: Iterable[str]) -> None:
    """Report the options that have no effect in any job of a batch."""
    for name in sorted(names):
        log.error(f"--{name.replace('_', '-')}: has no effect in any job; leave it out")
