"""The phases of a job: what each took; remarks that are doubts."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from ... import progress

USUAL = ("solve", "evaluate", "resample")


class Doubt(str):
    """A remark on the result itself, not on how it was made: whoever wants quiet wants to know it."""

    __slots__ = ()


class Phases:
    """A clock for the phases of a job.

    Attributes:
        seconds: by phase, in the order in which they end.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._start = time.perf_counter()

    @contextmanager
    def timed(self, part: str) -> Iterator[None]:
        """Add the block's time to a phase, and report it as under way."""
        progress.tell(part)
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[part] = self.seconds.get(part, 0.0) + time.perf_counter() - start

    def report(self) -> dict[str, float]:
        """Return the phases so far, those that every job has among them, and the total."""
        total = time.perf_counter() - self._start
        return {**dict.fromkeys(USUAL, 0.0), **self.seconds, "total": total}
