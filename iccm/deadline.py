"""The time that a command may take: searches, untangling and loops that carry pictures ask whether it is spent.

    with limited(60):
        fit = iccm.fit(source, target)

Where a map has been found by then, it is the result, with a note; otherwise `TimeUp` says what took so long. Nothing
depends on the clock before that.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from .errors import InputError

SEARCH_TIME_SHARE = 0.7
"""Share of the time that a map may be searched for: what is made with it needs the rest."""
DEFAULT_SECONDS = 900.0
"""Seconds of a command by default: several times what the largest inputs within the other limits took."""


class TimeUp(InputError):
    """The time is spent; the message says how much there was, and what took it."""

    def named(self, place: object) -> "TimeUp":
        """Return the same with the place in front."""
        return TimeUp(f"{place}: {self}")


@dataclass
class Deadline:
    """A limit on time.

    Attributes:
        seconds: how long what is limited may take.
        began: when it began, by the monotonic clock.
        cut: whether a search was ended by it.
        doing: what is under way, in a few words.
    """

    seconds: float
    began: float
    cut: bool = False
    doing: str = ""

    def is_spent(self, share: float = 1.0) -> bool:
        """Return whether a share of the time is over."""
        return time.monotonic() - self.began > share * self.seconds

    def check(self, what: str = "", share: float = 1.0) -> None:
        """End what is under way if a share of the time is over.

        Raises:
            TimeUp: it is.
        """
        if self.is_spent(share):
            raise TimeUp(self.message(what))

    def message(self, what: str = "") -> str:
        """Return the message that the time is spent, and on what: by default on what is under way."""
        return (
            f"{what or self.doing or 'the command'}: took longer than {self.seconds:g} s; set a longer "
            "--time-limit"
        )


_current: ContextVar[Deadline | None] = ContextVar("deadline", default=None)


@contextmanager
def limited(seconds: float | None) -> Iterator[None]:
    """Limit the time of the block, in this thread and in those that carry pictures for it; None: without a limit."""
    token = _current.set(None if seconds is None else Deadline(seconds, time.monotonic()))
    try:
        yield
    finally:
        _current.reset(token)


def current() -> Deadline | None:
    """Return the limit that this thread is under."""
    return _current.get()


def ends_search() -> bool:
    """Return whether a search for a map has to end with what it has found: then this is noted, too."""
    deadline = _current.get()
    if deadline is None or not deadline.is_spent(SEARCH_TIME_SHARE):
        return False
    deadline.cut = True
    return True


def check(what: str = "") -> None:
    """End what is under way if the time is over.

    Raises:
        TimeUp: it is.
    """
    if deadline := _current.get():
        deadline.check(what)


def searching(limit: Deadline) -> str:
    """Return what a search for a map is at, for messages."""
    return f"the search for a map ({limit.doing})" if limit.doing else "the search for a map"
