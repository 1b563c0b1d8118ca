"""Numba's compiling, watched: that it begins, and how long it takes. What comes from its cache is not compiled."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba.core import event

KIND = "numba:compile"  # "broadcast when a dispatcher is compiling", inside the compiler's lock, also when nested


class Watch(event.Listener):
    """A clock that runs while any thread of the process compiles.

    Args:
        changed: is told True when compiling begins, and False when it ends, by the thread that compiles.
    """

    def __init__(self, changed: Callable[[bool], object] = lambda compiling: None):
        self._changed, self._lock = changed, threading.Lock()
        self._depth, self._since, self._past = 0, 0.0, 0.0

    @property
    def seconds(self) -> float:
        """Time in which something was compiled, so far."""
        with self._lock:
            return self._past + (time.perf_counter() - self._since if self._depth else 0.0)

    def on_start(self, event: event.Event) -> None:
        """A function begins to be compiled, perhaps for another one."""
        with self._lock:
            self._depth += 1
            begins = self._depth == 1
            if begins:
                self._since = time.perf_counter()
        if begins:
            self._changed(True)

    def on_end(self, event: event.Event) -> None:
        """It is compiled."""
        with self._lock:
            ends = self._depth == 1
            self._depth = max(0, self._depth - 1)  # it may have begun before the watch did
            if ends:
                self._past += time.perf_counter() - self._since
        if ends:
            self._changed(False)


@contextmanager
def watched(changed: Callable[[bool], object] = lambda compiling: None) -> Iterator[Watch]:
    """A watch on what is compiled in the block."""
    with event.install_listener(KIND, Watch(changed)) as watch:
        yield watch
