"""Exceptions of the balanced solver, and checks of its time limit."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import TypeVar

from .. import deadline
from ..arrays import Complex
from ..deadline import TimeUp, searching
from ..errors import InputError

Result = TypeVar("Result")


class Stuck(Exception):
    """An attempt failed; another one may succeed."""


class Tangled(Stuck):
    """Folds remain.

    Attributes:
        u: (n,) images with as few folds as could be reached.
    """

    def __init__(self, u: Complex):
        super().__init__("found no map without folds for this correspondence of the outlines")
        self.u = u


class OutOfTime(Stuck, TimeUp):
    """The time for the search is over. Every further attempt fails, and the best map so far is the result."""


def check_time() -> None:
    """End an attempt if the time for the search is over.

    Raises:
        OutOfTime: the time is over.
    """
    limit = deadline.current()
    if limit is not None and deadline.ends_search():
        raise OutOfTime(limit.message(searching(limit)))


def until_time_is_over(attempts: Iterator[Result]) -> Iterator[Result]:
    """Yield the results of attempts until the time for the search is over."""
    with suppress(OutOfTime):
        yield from attempts


class NoMapError(InputError):
    """No map without folds was found; the message is a sentence with the reason."""


def first_success(*attempts: Callable[[], Result]) -> Result:
    """Return the result of the first attempt that succeeds; later ones are not made.

    Raises:
        Stuck: the last one fails, too.
    """
    for attempt in attempts[:-1]:
        with suppress(Stuck):
            return attempt()
    return attempts[-1]()


def successes(attempts: Iterable[Callable[[], Result]]) -> Iterator[Result]:
    """Yield the results of the attempts that succeed, each when it is asked for."""
    for attempt in attempts:
        try:
            result = attempt()
        except (Stuck, NoMapError):
            continue
        yield result
