"""Progress of long computations, reported to a listener; results do not depend on it.

with progress.heard(print):
    iccm.fit(source, target)
"""

from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple, TypeVar

from . import deadline
from .errors import Cancelled

Item = TypeVar("Item")
Listener = Callable[[str, int, int], object]
"""A function of the current step, the amount done, and the total amount; 0 and 0 if that is unknown."""


class Progress(NamedTuple):
    """The progress of a long computation.

    Attributes:
        what: the current step, in words.
        done: the amount that is done.
        of: the total amount; 0 if it is unknown.
    """

    what: str
    done: int
    of: int

    def __str__(self) -> str:
        return f"{self.what}, {self.done} of {self.of}" if self.of else self.what


_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)


@contextmanager
def heard(listener: Listener | None) -> Iterator[None]:
    """Report progress of the block, in this thread, to a listener; None for nobody."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


@contextmanager
def listening(
    progress: Callable[[Progress], object] | None, cancel: Callable[[], bool] | None
) -> Iterator[None]:
    """Call a user's functions while the block runs; an outer listener is called, too.

    Raises:
        Cancelled: in the block, after `cancel` returned true.
    """
    if progress is None and cancel is None:
        yield
        return
    outer = _listener.get()

    def hear(what: str, done: int, of: int) -> None:
        if outer is not None:
            outer(what, done, of)
        if cancel is not None and cancel():
            raise Cancelled("cancelled")
        if progress is not None and what:
            progress(Progress(what, done, of))

    with heard(hear):
        tell("start")
        yield


@contextmanager
def within(what: str) -> Iterator[None]:
    """Put `what` in front of all steps that are reported in the block."""
    outer = _listener.get()
    inner = None if outer is None else lambda part, done, of: outer(f"{what}, {part}", done, of)
    with heard(inner):
        yield


def tell(what: str, done: int = 0, of: int = 0) -> None:
    """Report the current step to the listener of this thread, and in a loop of length `of` check the time limit.

    Raises:
        TimeUp: the time is over (see `deadline`).
    """
    if listener := _listener.get():
        listener(what, done, of)
    if limit := deadline.current():
        limit.doing = what or limit.doing
        if of:
            limit.check(what)


def counted(what: str, items: Iterable[Item], of: int | None = None) -> Iterator[Item]:
    """Yield the items, and report before each how many are done."""
    total = of or 0
    if of is None and isinstance(items, Sized):
        total = len(items)
    for done, item in enumerate(items):
        tell(what, done, total)
        yield item
