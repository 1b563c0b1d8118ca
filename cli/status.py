"""A status line on the terminal that shows the current step and the time it has taken."""

from __future__ import annotations

import shutil
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..errors import printable
from ..progress import Listener, heard, tell
from . import logs

QUIET_SECONDS = 1.0  # seconds of work before the line appears
UPDATE_SECONDS = 0.5  # seconds between updates
LEAST_REMAINING_SECONDS = 2.0
"""Seconds: a shorter remaining time is not shown, since the following steps take as long."""
BAR_CHARACTERS = 16  # characters of the bar


@contextmanager
def show_status() -> Iterator[Listener | None]:
    """Show reports of progress while the block runs: those sent to the returned listener and those of `iccm.progress`.

    Returns None without a terminal, and with --quiet or --log-format json.
    """
    if not (sys.stderr.isatty() and logs.is_verbose()):
        yield None
        return
    line = StatusLine()
    with heard(line), line.ticking():
        yield line


@contextmanager
def show_phases(step: str) -> Iterator[None]:
    """Show what the block does, as `show_status`."""
    with show_status():
        tell(step)
        yield


class StatusLine:
    """The status line, with the latest report of progress."""

    def __init__(self) -> None:
        self._start, self._latest = time.monotonic(), ("start", 0, 0)
        self._began = self._start, 0  # time when the counted step began, and its number then
        self._hidden, self._over = False, threading.Event()
        self._bar: Any = None  # tqdm's

    def __call__(self, what: str, done: int, of: int) -> None:
        """Receive a report, as `iccm.progress.Listener`. An empty name removes the line at once."""
        _, previous_count, previous_total = self._latest
        if what:
            if of != previous_total or done < previous_count:
                self._began = time.monotonic(), done
            self._latest = what, done, of
        self._hidden = not what
        if not what and self._bar is not None:
            self._bar.clear()

    def __str__(self) -> str:
        what, done, of = self._latest
        time_now, (began, first_count) = time.monotonic(), self._began
        what = printable(what)
        if not of:
            return f"{what}, {time_now - self._start:.0f} s"
        seconds = (time_now - began) / (done - first_count) * (of - done) if done > first_count else 0.0
        remaining = f", about {seconds:.0f} s left" if seconds >= LEAST_REMAINING_SECONDS else ""
        return f"{self._drawn(done / of)} {done}/{of}, {time_now - self._start:.0f} s{remaining}: {what}"

    @staticmethod
    def _drawn(share: float) -> str:
        """Draw a bar, with block characters if the terminal's encoding has them."""
        from tqdm.std import Bar
        from tqdm.utils import _supports_unicode

        return (
            f"{Bar(min(1.0, share), BAR_CHARACTERS, Bar.UTF if _supports_unicode(sys.stderr) else Bar.ASCII)}"
        )

    @contextmanager
    def ticking(self) -> Iterator[None]:
        """Redraw the line from a thread until the block ends."""
        ticker = threading.Thread(target=self._tick, daemon=True)
        ticker.start()
        try:
            yield
        finally:
            self._over.set()
            ticker.join()

    def _tick(self) -> None:
        if self._over.wait(QUIET_SECONDS):
            return
        from tqdm import tqdm
        from tqdm.contrib.logging import logging_redirect_tqdm

        size = shutil.get_terminal_size()  # falls back to a guess, for instance in containers
        shape = {"ncols": size.columns - 1, "nrows": size.lines, "bar_format": "{desc}", "leave": False}
        with logging_redirect_tqdm([logs.log]), tqdm(desc=str(self), file=sys.stderr, **shape) as self._bar:
            while not self._over.wait(UPDATE_SECONDS):
                if not self._hidden:
                    self._bar.set_description_str(str(self))
