"""The interface of every kind of output; `io.run.execute` calls its methods in this order."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from ..report import OutputReport

if TYPE_CHECKING:
    from ..job import Job
    from ..state import Run


class Output(ABC):
    """One file that a run writes.

    Attributes:
        name: as the user gave it; - for stdout.
        map: the texture that it shows and its kind, where that is not the job's first.
    """

    tiles: ClassVar[bool] = False  # whether it can be written tile by tile (UDIM)
    tile: complex | None = None  # the one that it is of: its lower left corner in the layout
    samples: ClassVar[bool] = False  # whether it filters the texture, which is made ready beside the solving
    shows: ClassVar[bool] = False  # whether the texture is seen in it

    map: tuple[str, str] | None = None

    def __init__(self, name: str) -> None:
        """Nothing is checked here."""
        self.name = name

    @abstractmethod
    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Refuse, before any input is read, what the suffix cannot hold or the job cannot give.

        Args:
            job: what to do.
            onto_mesh: whether the target is a mesh.

        Raises:
            InputError: naming what could be asked for instead.
        """

    def check(self, run: Run) -> None:  # noqa: B027
        """Refuse, before the solving, what `write` would refuse after it, and note what will be lost.

        Raises:
            InputError: as each kind says.
        """

    def beside(self, run: Run) -> list[str]:
        """Return the files that come with it."""
        return []

    @abstractmethod
    def write(self, run: Run, path: Path, before: Sequence[OutputReport] = ()) -> OutputReport:
        """Write it into a temporary file with the suffix of its name.

        Args:
            run: the job, its maps solved for.
            path: the file.
            before: what was found in writing the outputs before it, for a figure that shows it.
        """
