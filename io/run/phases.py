"""The phases of a job: what each took, what is under way, and compiling as one of its own; remarks that are doubts."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ... import progress
from ...compiling import watch
from ...progress import Listener

USUAL = ("solve", "evaluate", "resample")
COMPILES = "compiling, which is done once; this may take a minute"


class Doubt(str):
    """A remark on the result itself, not on how it was made: whoever wants quiet wants to know it."""

    __slots__ = ()


class Phases:
    """A clock for the phases of a job.

    Attributes:
        seconds: by phase, in the order in which they end, without the time in which anything was compiled.
    """

    def __init__(self, tell: Callable[[str], None], listener: Listener | None):
        self.seconds: dict[str, float] = {}
        self._start = time.perf_counter()
        self._tell, self._listener = tell, listener
        self._watch = watch.Watch()
        self._compiling, self._told, self._last = False, False, ("", 0, 0)

    @classmethod
    @contextmanager
    def of(cls, tell: Callable[[str], None], listener: Listener | None) -> Iterator[Phases]:
        """The phases of what is done in the block.

        Args:
            tell: is given a sentence when compiling begins.
            listener: is told what is under way.
        """
        phases = cls(tell, listener)
        with watch.watched(phases._changed) as phases._watch, progress.heard(phases._hear):
            yield phases

    @contextmanager
    def timed(self, part: str) -> Iterator[None]:
        """Add the block's time to a phase, and tell that it is under way."""
        progress.tell(part)
        start, compiled = time.perf_counter(), self._watch.seconds
        try:
            yield
        finally:
            took = time.perf_counter() - start - (self._watch.seconds - compiled)
            self.seconds[part] = self.seconds.get(part, 0.0) + max(0.0, took)

    def report(self) -> dict[str, float]:
        """The phases so far, those that every job has among them, compiling, and the total."""
        usual = dict.fromkeys(USUAL, 0.0)
        total = time.perf_counter() - self._start
        # the latter: waiting for other processes
        compiled = self._watch.seconds + self.seconds.get("compile", 0.0)
        return {**usual, **self.seconds, "compile": compiled, "total": total}

    def _hear(self, what: str, done: int, of: int) -> None:
        self._last = what, done, of
        if self._listener and not self._compiling:
            self._listener(what, done, of)

    def _changed(self, compiling: bool) -> None:
        self._compiling = compiling
        if compiling and not self._told:
            self._told = True
            self._tell(COMPILES)
        if self._listener:
            self._listener(*(("compile", 0, 0) if compiling else self._last))
