"""How many threads linear algebra takes: one, so that results do not depend on the machine, nor on its variables."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from threading import Lock
from typing import Any, TypeVar

import numpy as np
import scipy.linalg  # brings a BLAS of its own, and is imported by Numba with its first kernel anyway
from threadpoolctl import ThreadpoolController

Function = TypeVar("Function", bound=Callable[..., Any])


class _Users:
    """How many callers want one thread, and what to go back to when the last is done."""

    def __init__(self) -> None:
        self.lock, self.count = Lock(), 0
        self.limits: Any = None

    def enter(self) -> None:
        with self.lock:
            if not self.count:
                self.limits = _libraries().limit(limits=1, user_api="blas")
            self.count += 1

    def leave(self) -> None:
        with self.lock:
            self.count -= 1
            if not self.count:
                self.limits.restore_original_limits()


_users = _Users()


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
def _libraries() -> ThreadpoolController:
    """The libraries that NumPy and SciPy, loaded by now, brought."""
    assert np and scipy.linalg
    return ThreadpoolController()
