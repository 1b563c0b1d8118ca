"""Run linear algebra on one thread, so that results depend neither on the machine nor on environment variables."""

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
    """The number of callers that need one thread, and the limits to restore after the last one."""

    def __init__(self) -> None:
        self.lock, self.count = Lock(), 0
        self.limits: dict[bool, Any] = {}  # keyed by whether SciPy is loaded

    def enter(self) -> None:
        with self.lock:
            scipy = "scipy.linalg" in sys.modules
            if scipy not in self.limits:
                self.limits[scipy] = _libraries(scipy).limit(limits=1, user_api="blas")
            self.count += 1

    def leave(self) -> None:
        with self.lock:
            self.count -= 1
            while not self.count and self.limits:
                self.limits.popitem()[1].restore_original_limits()


_users = _Users()


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit BLAS to one thread in the whole process while any caller is inside.

    Its sums depend on the number of threads, and systems of some hundred unknowns take longer on many threads
    than on one. SciPy has a separate library and is slow to import; code that uses it enters here again after
    importing it.
    """
    _users.enter()
    try:
        yield
    finally:
        _users.leave()


def on_one_thread(function: Function) -> Function:
    """Decorate a function so that it runs inside `one_thread`."""

    @wraps(function)
    def call(*args: Any, **options: Any) -> Any:
        with one_thread():
            return function(*args, **options)

    return call  # type: ignore[return-value]


@cache
def _libraries(scipy: bool) -> ThreadpoolController:
    """Return the controller of NumPy's BLAS, and of SciPy's if that is loaded."""
    assert np
    return ThreadpoolController()
