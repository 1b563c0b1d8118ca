"""The interface of all kinds of output; `io.run.execute` calls its methods in this order."""

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
        name: as given by the user; - for stdout.
        map: the texture that it shows and its kind, if it is not the job's first.
    """

    tiles: ClassVar[bool] = False  # whether it can be written tile by tile (UDIM)
    tile: complex | None = None  # lower left corner of its tile in the layout, if it is for one tile
    samples: ClassVar[bool] = False  # whether it filters the texture, which is then prepared during solving
    shows: ClassVar[bool] = False  # whether it shows the texture
    shows_target: ClassVar[bool] = False  # whether it can show the target's own drawing behind the result
    is_mesh: ClassVar[bool] = False

    map: tuple[str, str] | None = None

    def __init__(self, name: str) -> None:
        """Store the name, without checking anything."""
        self.name = name

    @abstractmethod
    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Check, before any input is read, that the suffix suits the job.

        Args:
            job: the job.
            onto_mesh: whether the target is a mesh.

        Raises:
            InputError: it does not; the message names what could be requested instead.
        """

    def check(self, run: Run) -> None:  # noqa: B027
        """Check, before solving, everything that `write` would reject afterwards, and note what will be lost.

        Raises:
            InputError: depends on the kind of output.
        """

    def companion_files(self, run: Run) -> list[str]:
        """Return the names of files that are written beside it."""
        return []

    @abstractmethod
    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Write the output to a temporary file with the suffix of its name.

        Args:
            run: the job, with its maps solved.
            path: the file.
            earlier: the reports of outputs written earlier, for a figure that shows them.
        """
