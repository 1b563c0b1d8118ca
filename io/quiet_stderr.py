"""Redirect what C libraries write to stderr: iccm reports the relevant part in its own messages."""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

_ONE_AT_A_TIME = threading.RLock()


@contextmanager
def silence() -> Iterator[None]:
    """Discard what C libraries write to the process's stderr while the block runs."""
    with _ONE_AT_A_TIME:
        try:
            saved_stderr, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
        except OSError:  # there is no stderr, or no descriptor is free
            yield
            return
        try:
            os.dup2(nowhere, 2)
            yield
        finally:
            os.dup2(saved_stderr, 2)
            for number in (saved_stderr, nowhere):
                with suppress(OSError):
                    os.close(number)
