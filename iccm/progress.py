"""Progress of a long computation, told to whoever listens: no result depends on it.

with progress.heard(print):
    iccm.fit(source, target)
"""

from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

Item = TypeVar("Item")
Listener = Callable[[str, int, int], object]
"""Is given what is done, how much of it is done, and how much there is; 0 of 0 where that is not known."""

_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)


@contextmanager
def heard(listener: Listener | None) -> Iterator[None]:
    """Tells the listener, in this thread, what is done in the block; None for nobody."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


@contextmanager
def within(what: str) -> Iterator[None]:
    """Puts `what` before all that is told in the block."""
    outer = _listener.get()
    inner = None if outer is None else lambda part, done, of: outer(f"{what}, {part}", done, of)
    with heard(inner):
        yield


def tell(what: str, done: int = 0, of: int = 0) -> None:
    """Tells the listener of this thread what is under way."""
    if listener := _listener.get():
        listener(what, done, of)


def counted(what: str, items: Iterable[Item], of: int | None = None) -> Iterator[Item]:
    """The items, telling before each how many are done."""
    total = of if of is not None else len(items) if isinstance(items, Sized) else 0
    for done, item in enumerate(items):
        tell(what, done, total)
        yield item
