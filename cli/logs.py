"""Messages on stderr: how many (`-v`, `-q`), in which form (`--log-format`); stopping on SIGTERM; every way to fail, as
one line and an exit code."""

from __future__ import annotations

import json
import logging
import os
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

from ..errors import IccmError

if TYPE_CHECKING:
    from ..io.run.job import Outcome

log = logging.getLogger("iccm")
POOR = 35
"""The level of remarks on the result itself: notes that --quiet does not hide."""
NARROWEST = 40
"""Columns of a terminal: on narrower ones lines are as long as on such."""
INDENTED = {
    "initial_indent": "  ",
    "subsequent_indent": "  ",
    "break_long_words": False,
    "break_on_hyphens": False,
}
INPUT, INTERNAL, PIPE = 2, 70, 141
"""Exit codes beside 0 (done) and 1 (not good enough); 128 + signal when stopped by one."""


class Terminated(BaseException):
    """A signal asked the process to stop; raised so that temporary files are removed on the way out."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.signal = number


class _Text(logging.Formatter):
    """`error: …`, `note: …`; plain text for what is asked for with -v."""

    def format(self, record: logging.LogRecord) -> str:
        """One record, one line."""
        label = ""
        if record.levelno >= logging.ERROR:
            label = styled("error:", sys.stderr, fg="red", bold=True) + " "
        elif record.levelno in (logging.WARNING, POOR):
            label = styled("note:", sys.stderr, fg="yellow") + " "
        return wrapped(label + " ".join(record.getMessage().split("\n")))


def wrapped(text: str) -> str:
    """Text broken at words where it is wider than a terminal; as it is where nobody sees it on one.

    Names of files and options stay whole, so that they can be copied.
    """
    if not sys.stderr.isatty():
        return text
    wide = max(NARROWEST, shutil.get_terminal_size().columns) - 1
    if len(click.unstyle(text)) <= wide:
        return text
    hidden = len(text) - len(click.unstyle(text))  # codes of colours, all of which are in the label
    first, *rest = textwrap.wrap(text, wide + hidden, break_long_words=False, break_on_hyphens=False)
    return "\n".join([first, *textwrap.wrap(" ".join(rest), wide - 2, **INDENTED)])  # type: ignore[arg-type]


def styled(text: str, stream: Any, **style: Any) -> str:
    """Text as `click.style` makes it, on a terminal that takes colours and where NO_COLOR (no-color.org) is not set."""
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb" or not stream.isatty()
    return text if plain else click.style(text, **style)


class _Json(logging.Formatter):
    """One object a line: level, message, and whatever fields the message came with."""

    def format(self, record: logging.LogRecord) -> str:
        """One record, one line."""
        fields = getattr(record, "fields", {})
        return json.dumps(
            {
                "level": "warning" if record.levelno == POOR else record.levelname.lower(),
                "message": record.getMessage(),
                **fields,
            },
            default=str,
        )


class _Stderr(logging.StreamHandler):
    """Writes to whatever sys.stderr is at the time."""

    def __init__(self) -> None:
        logging.Handler.__init__(self)

    @property
    def stream(self) -> Any:
        """The stream of the moment."""
        return sys.stderr


_state = {"debug": False}


def reset() -> None:
    """Messages of level info and above, as text."""
    _state["debug"] = False
    configure(0, "text")


def configure(verbosity: int, form: str) -> None:
    """Set what the `iccm` logger shows: -1 errors and doubts about the result, 0 notes and results, 1 and more all."""
    handler = _Stderr()
    handler.setFormatter(_Json() if form == "json" else _Text())
    log.handlers[:] = [handler]
    log.propagate = False
    log.setLevel(POOR if verbosity < 0 else logging.DEBUG if verbosity > 0 else logging.INFO)


def is_verbose() -> bool:
    """Whether messages are for a person who wants more than errors."""
    return log.isEnabledFor(logging.INFO) and isinstance(log.handlers[0].formatter, _Text)


def debug() -> bool:
    """Whether --debug was given."""
    return _state["debug"]


def tell(remark: str) -> None:
    """Show a remark: on the inputs as a note, on the result itself so that no --quiet hides it."""
    from ..io.run.phases import Doubt

    log.log(POOR if isinstance(remark, Doubt) else logging.WARNING, remark)


def conclude(name: str, outcome: Outcome, figures: Iterable[str]) -> int:
    """Tell the figures of a run on a file, what it wrote, and what is wrong with it; the exit code."""
    for line in (*figures, *(f"wrote {path}" for path in outcome.written)):
        log.info(line)
    if not outcome.ok:
        log.error(f"{name}: {outcome.message}")
    return int(not outcome.ok)


def silence_others() -> None:
    """Let nobody but iccm speak on stderr: no warnings of NumPy, no log of trimesh."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    logging.getLogger().addHandler(logging.NullHandler())


def apply(ctx: click.Context, parameter: click.Parameter, value: Any) -> None:
    """Take over an option of `MessageOptions`, as click calls it."""
    said = ctx.meta.setdefault("iccm.messages", {})
    said[parameter.name] = value
    _state["debug"] = _state["debug"] or bool(said.get("debug"))
    configure(-1 if said.get("quiet") else int(said.get("verbose", 0)), said.get("log_format", "text"))


@contextmanager
def raise_on_signals() -> Iterator[None]:
    """Turn SIGTERM and SIGHUP into an exception while the block runs (main thread only)."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: object) -> None:
        raise Terminated(number)

    names = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {
        number: signal.signal(number, stop) for number in names if signal.getsignal(number) is signal.SIG_DFL
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


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
    if isinstance(error, Terminated):
        return _say(f"stopped by signal {error.signal}", 128 + error.signal)
    if isinstance(error, (KeyboardInterrupt, click.Abort)):
        return _say("interrupted", 130)
    if debug():
        traceback.print_exception(error)
    for mistake in getattr(error, "mistakes", [])[:-1]:
        log.error(_one_line(mistake))
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
    log.error(message)
    return code


def _one_line(text: str) -> str:
    """One line; what a terminal would act on is written out."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(text.split()))


def _broken_pipe() -> int:
    """The reader of stdout went away, as `| head` does: end quietly, and keep Python from flushing into the pipe."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return PIPE
