"""The process: its standard streams and memory, and stopping within two seconds of a signal.

Daemons and cron close standard streams. Closed ones are replaced by the null device; otherwise a file opened later
would get their number, and what a library prints would end up in a picture. Signals also stop compiled code, in which
Python raises no exception.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

LEAST_LIMIT_BYTES = 5 << 28
"""Bytes of address space below which libraries abort the process while loading, or when they write a picture."""
STREAMS = ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w"))
GRACE_SECONDS = 1.2
"""Seconds in which a run may end on its own; between calls of compiled code that takes milliseconds."""
_state = {"patient": False}


def mend() -> None:
    """Replace missing standard streams."""
    for number, name, mode in STREAMS:
        if getattr(sys, name) is not None:
            continue
        try:
            os.fstat(number)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
        setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115


def unread() -> bool:
    """Return whether the reader of stdout is gone, which otherwise shows only when the next line is written."""
    if not hasattr(select, "poll"):  # Windows
        return False
    output = select.poll()
    output.register(1, 0)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in output.poll(0))


def lacks_memory() -> bool:
    """Return whether the limit on address space (`ulimit -v`) may be too low."""
    with suppress(ImportError):  # Windows has no such limits
        import resource

        soft, _ = resource.getrlimit(resource.RLIMIT_AS)
        return soft != resource.RLIM_INFINITY and soft < LEAST_LIMIT_BYTES
    return False


def leave_signals() -> None:
    """Leave signals to the command, which has to end processes or connections itself."""
    _state["patient"] = True


@contextmanager
def watch_signals() -> Iterator[None]:
    """Let a thread end the process on a signal while the block runs, in case the main thread does not.

    The main thread receives its exceptions as usual. The thread reads the pipe to which Python's signal handler
    writes, also while the main thread executes compiled code. It removes incomplete output files before it ends the
    process.
    """
    if threading.current_thread() is not threading.main_thread() or os.name == "nt":
        yield
        return
    _state["patient"] = False
    inlet, outlet = os.pipe()
    os.set_blocking(outlet, False)
    previous, over = signal.set_wakeup_fd(outlet, warn_on_full_buffer=False), threading.Event()
    threading.Thread(target=_watch, args=(inlet, over), daemon=True).start()
    try:
        yield
    finally:
        over.set()
        signal.set_wakeup_fd(previous)
        os.close(outlet)


def _watch(inlet: int, over: threading.Event) -> None:
    ends = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    while received := os.read(inlet, 1):
        if received[0] in ends and not _state["patient"] and not over.wait(GRACE_SECONDS):
            _end(received[0])
    os.close(inlet)


def _end(number: int) -> None:
    from ..io import files

    files.abandon()
    with suppress(OSError, ValueError):
        message = "interrupted" if number == signal.SIGINT else f"stopped by signal {number}"
        sys.stderr.write(f"error: {message}\n")
        sys.stderr.flush()
    os._exit(128 + number)
