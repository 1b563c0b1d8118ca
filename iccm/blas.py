"""How many threads linear algebra takes: one, so that results do not depend on the machine, nor on its variables.

SciPy brings a BLAS of its own beside NumPy's, and takes long to import: modules that compute with it call `joined`.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from threading import Lock
from typing import Any, TypeVar

import numpy as np
from threadpoolctl import ThreadpoolController

Function = TypeVar("Function", bound=Callable[..., Any])


class _Users:
    """How many callers want one thread, and what to go back to when the last is done."""

    def __init__(self) -> None:
        self.lock, self.count = Lock(), 0
        self.limits: dict[bool, Any] = {}

    def enter(self) -> None:
        with self.lock:
            self.count += 1
            self._limit()

    def joined(self) -> None:
        with self.lock:
            if self.count:
                self._limit()

    def leave(self) -> None:
        with self.lock:
            self.count -= 1
            while not self.count and self.limits:
                self.limits.popitem()[1].restore_original_limits()

    def _limit(self) -> None:
        """All libraries; once without SciPy's, once with it, whichever come."""
        scipy = "scipy.linalg" in sys.modules
        if scipy not in self.limits:
            self.limits[scipy] = _libraries(scipy).limit(limits=1, user_api="blas")


_users = _Users()


def joined() -> None:
    """SciPy's BLAS has been imported: inside `one_thread` it is put on one thread too."""
    _users.joined()


@contextmanager
def one_thread() -> Iterator[None]:
    """BLAS on one thread, in the whole process, as long as any caller is inside; then as before.

    Its sums depend on the number of its threads, and systems of some hundred unknowns take longer on many than on one.
    """
    _users.enter()
    try:
        yield
    finally:
        _users.leave()


def on_one_thread(function: Function) -> Function:
    """A function inside `one_thread`."""

    @wraps(function)
    def call(*args: Any, **options: Any) -> Any:
        with one_thread():
            return function(*args, **options)

    return call  # type: ignore[return-value]


@cache
def _libraries(scipy: bool) -> ThreadpoolController:
    """Those loaded by now; looking for them takes milliseconds, so it is done once with SciPy and once without."""
    assert np
    return ThreadpoolController()
