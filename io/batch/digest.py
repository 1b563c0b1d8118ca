"""What the notes of all jobs of a batch have in common, for its summary."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..spec import Spec

if TYPE_CHECKING:
    from .manifest import Task

MOST_NOTES = 5  # different notes in a summary, the most frequent ones
UNDISTORTED_DILATATION = 1.001
"""Dilatation on 95 % of a drawing up to which it looks undistorted."""


class Digest:
    """Notes of jobs that were done, each with the number of jobs that have it, and whether drawings differ in style.

    Args:
        tasks: the jobs, by their number.
    """

    def __init__(self, tasks: Mapping[int, Task]):
        self._tasks = tasks
        self._notes: Counter[str] = Counter()
        self._done = 0
        self._styles: Counter[bool] = Counter()
        """Numbers of drawings of which iccm chose the fit: undistorted ones, and bent ones."""

    def add(self, result: Mapping[str, Any]) -> None:
        """Count the result of a job, unless it failed."""
        if result["status"] not in ("done", "poor"):
            return
        self._done += 1
        job: Any = self._tasks[result["job"]].job
        names = [Spec.of(value).path.name for value in vars(job).values() if isinstance(value, str) and value]
        self._notes.update({_without_name(note, names) for note in result["notes"]})
        dilatation = result["figures"].get("dilatation")
        if dilatation and job.command == "map" and job.texture is None and _chooses_fit(job):
            self._styles[dilatation["p95"] <= UNDISTORTED_DILATATION] += 1

    def lines(self) -> list[str]:
        """Return sentences for the summary, the most important ones first."""
        lines = []
        if len(self._styles) > 1:
            lines.append(
                f"{self._styles[True]} of {self._styles.total()} drawings are placed undistorted, the others are bent "
                "into their targets; for one style add fit='box' (bent) or place='inside' (undistorted)"
            )
        lines += [
            f"{count} of {self._done} jobs: {note}" for note, count in self._notes.most_common(MOST_NOTES)
        ]
        if (more := len(self._notes) - MOST_NOTES) > 0:
            lines.append(f"{more} other note{'s' * (more > 1)} in the results")
        return lines


def _chooses_fit(job: Any) -> bool:
    return job.fit in (None, "auto") and job.place == "fill"


def _without_name(note: str, names: list[str]) -> str:
    """Return a note without the name of the file that it begins with, so that those of several jobs are equal."""
    first, colon, rest = note.partition(": ")
    return rest if colon and any(name in first for name in names) else note
