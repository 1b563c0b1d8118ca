"""Exceptions for wrong input."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager


def printable(text: str) -> str:
    r"""Escape control characters, which file names can contain, so that the text is one harmless line.

    >>> printable("a\nb \x1b[31m.svg")
    'a\\nb \\x1b[31m.svg'
    """
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


MESSAGE_CHARACTERS = 1500
"""Length of a message at most: it may quote a value of the input, which can be as long as its file."""


def shortened(text: str) -> str:
    """Leave out the middle of a text that is longer than `MESSAGE_CHARACTERS`; the remedy is at its end.

    >>> len(shortened("a" * 10000))
    1500
    """
    half = MESSAGE_CHARACTERS // 2 - 1
    return text if len(text) <= MESSAGE_CHARACTERS else f"{text[:half]} … {text[1 - half :]}"


def first_names(names: Sequence[str], most: int) -> str:
    """Return the first of some names, separated by commas, and the number of the others.

    >>> first_names(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    others = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + others


def all_names(names: Sequence[str]) -> str:
    """Return all of some names for a sentence.

    >>> all_names(["1", "2", "3"])
    '1, 2 and 3'
    """
    return " and ".join([", ".join(names[:-1]), *names[-1:]]) if len(names) > 1 else "".join(names)


class IccmError(Exception):
    """Base of every error that `iccm` raises deliberately; its text is one line of limited length."""

    def __str__(self) -> str:
        return shortened(printable(super().__str__()))


class InputError(IccmError, ValueError):
    """The input is wrong. The message is one line: file, place, what is wrong, what to do."""

    def named(self, place: object) -> "InputError":
        """Return the error with a place in front of its message."""
        return InputError(f"{place}: {self}")


class MissingFileError(InputError, FileNotFoundError):
    """A file does not exist."""


class Cancelled(IccmError):
    """The `cancel` function of a call returned true, so the computation ended."""


@contextmanager
def naming(place: object) -> Iterator[None]:
    """Add a place to the messages of InputErrors that are raised in the block.

    >>> with naming("a.svg"):
    ...     raise InputError("is empty")
    Traceback (most recent call last):
    iccm.errors.InputError: a.svg: is empty
    """
    try:
        yield
    except InputError as error:
        raise error.named(place) from error


class ConstraintError(InputError):
    """Pins or strokes are wrong; the message counts them from 1.

    Args:
        message: as in `InputError`.
        pins: indices of the pins concerned, from 0.
        strokes: indices of the strokes concerned, from 0.
    """

    def __init__(self, message: str, pins: Iterable[int] = (), strokes: Iterable[int] = ()):
        super().__init__(message)
        self.pins, self.strokes = tuple(int(k) for k in pins), tuple(int(k) for k in strokes)


class JobError(ValueError):
    """Invalid values of a job.

    Attributes:
        mistakes: (key, what is wrong) for each.
    """

    def __init__(self, mistakes: list[tuple[str, str]]):
        super().__init__("; ".join(f"{key}: {text}" if key else text for key, text in mistakes))
        self.mistakes = mistakes


def lacks_memory(error: BaseException) -> bool:
    """Return whether an error is due to a lack of memory, including failures to load a library or to start a thread."""
    if isinstance(error, MemoryError):
        return True
    if (
        not isinstance(error, ImportError | OSError | RuntimeError | SystemError)
        and "GEOS" not in type(error).__name__
    ):
        return False
    text = str(error)
    return any(
        sign in text for sign in ("failed to map", "annot allocate memory", "bad_alloc", "start new thread")
    )
