"""The time limit of a command, checked by searches, untangling and loops over pictures.

    with limited(60):
        fit = iccm.fit(source, target)

If a map has been found in time, it is the result, with a note; otherwise `TimeUp` names the step that took too
long. Results do not depend on the clock before that.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from .errors import InputError

SEARCH_TIME_SHARE = 0.7
"""Share of the time for the search of a map; the outputs need the rest."""
DEFAULT_SECONDS = 900.0
"""Default limit of a command: several times what the largest inputs within the other limits took."""


class TimeUp(InputError):
    """The time limit was exceeded; the message names the step and the limit."""

    def named(self, place: object) -> "TimeUp":
        """Return the error with a place in front of its message."""
        return TimeUp(f"{place}: {self}")


@dataclass
class Deadline:
    """A time limit.

    Attributes:
        seconds: the limit.
        began: start, by the monotonic clock.
        cut: whether it ended a search.
        doing: the current step, in a few words.
    """

    seconds: float
    began: float
    cut: bool = False
    doing: str = ""

    def is_spent(self, share: float = 1.0) -> bool:
        """Return whether the given share of the time is over."""
        return time.monotonic() - self.began > share * self.seconds

    def check(self, what: str = "", share: float = 1.0) -> None:
        """Raise if the given share of the time is over.

        Raises:
            TimeUp: it is over.
        """
        if self.is_spent(share):
            raise TimeUp(self.message(what))

    def message(self, what: str = "") -> str:
        """Return the message that the time is over, and during which step; by default the current one."""
        return (
            f"{what or self.doing or 'the command'}: took longer than {self.seconds:g} s; set a longer "
            "--time-limit"
        )


_current: ContextVar[Deadline | None] = ContextVar("deadline", default=None)


@contextmanager
def limited(seconds: float | None) -> Iterator[None]:
    """Limit the time of the block, in this thread and in worker threads of the block; None for no limit."""
    token = _current.set(None if seconds is None else Deadline(seconds, time.monotonic()))
    try:
        yield
    finally:
        _current.reset(token)


def current() -> Deadline | None:
    """Return the time limit of this thread."""
    return _current.get()


def ends_search() -> bool:
    """Return whether a search for a map has to end with its best map so far, and record that it had to."""
    deadline = _current.get()
    if deadline is None or not deadline.is_spent(SEARCH_TIME_SHARE):
        return False
    deadline.cut = True
    return True


def check(what: str = "") -> None:
    """Raise if the time is over.

    Raises:
        TimeUp: it is over.
    """
    if deadline := _current.get():
        deadline.check(what)


def searching(limit: Deadline) -> str:
    """Return a description of the current search for a map, for messages."""
    return f"the search for a map ({limit.doing})" if limit.doing else "the search for a map"
