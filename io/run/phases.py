"""The phases of a job with their times, and notes that express doubts."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from ... import progress

USUAL = ("solve", "evaluate", "resample")


class Doubt(str):
    """A note that casts doubt on the result, which is shown even with --quiet."""

    __slots__ = ()


class Phases:
    """A clock for the phases of a job.

    Attributes:
        seconds: time by phase, in the order in which the phases end.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._start = time.perf_counter()

    @contextmanager
    def timed(self, part: str) -> Iterator[None]:
        """Add the block's time to a phase, and report the phase as being under way."""
        progress.tell(part)
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[part] = self.seconds.get(part, 0.0) + time.perf_counter() - start

    def report(self) -> dict[str, float]:
        """Return the times of all phases so far, including those that every job has, and the total."""
        total = time.perf_counter() - self._start
        return {**dict.fromkeys(USUAL, 0.0), **self.seconds, "total": total}
