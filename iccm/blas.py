"""Linear algebra on one thread, so that results do not depend on the machine, nor on its variables."""

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
        self.limits: dict[bool, Any] = {}  # with SciPy's library and without

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
    """BLAS on one thread, in the whole process, as long as any caller is inside; then as before.

    Its sums depend on the number of its threads, and systems of some hundred unknowns take longer on many than on one.
    SciPy has a separate library, and is slow to import: what uses it enters here, too, once it has imported it.
    """
    _users.enter()
    try:
        yield
    finally:
        _users.leave()


def on_one_thread(function: Function) -> Function:
    """Return a function inside `one_thread`."""

    @wraps(function)
    def call(*args: Any, **options: Any) -> Any:
        with one_thread():
            return function(*args, **options)

    return call  # type: ignore[return-value]


@cache
def _libraries(scipy: bool) -> ThreadpoolController:
    """Return the libraries that NumPy brought, and SciPy if it is loaded."""
    assert np
    return ThreadpoolController()
