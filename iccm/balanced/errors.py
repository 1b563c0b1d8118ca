"""Errors of the solver."""

from .. import deadline
from ..arrays import Complex
from ..deadline import TimeUp
from ..errors import InputError


class Stuck(Exception):
    """One attempt failed; the next one may not."""


class Tangled(Stuck):
    """Folds remain.

    Attributes:
        u: (n,) images, as few folded as could be.
    """

    def __init__(self, u: Complex):
        super().__init__("no map without folds was found for this correspondence of the outlines")
        self.u = u


class OutOfTime(Stuck, TimeUp):
    """The time for the search is over: every further attempt fails, and the best map so far is the result."""


def check_time() -> None:
    """End an attempt if the time for the search is over.

    Raises:
        OutOfTime: it is.
    """
    limit = deadline.current()
    if limit is not None and deadline.ends_search():
        raise OutOfTime(limit.message("the search for a map"))


class NoMapError(InputError):
    """No map without folds was found; the message says why in a sentence."""
