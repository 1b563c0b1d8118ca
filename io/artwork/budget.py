"""How much of a drawing may be carried: what is more is refused before the map is solved for."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...errors import InputError
from .element import MappedElement

MAX_CARRIED = 100_000  # lines and curves, each of which takes up to a millisecond
MAX_COVERED = 3 * MAX_CARRIED  # of these, as often as each lies under a clip path, mask or filter: 10 µs


@dataclass
class Load:
    """What there is to carry so far.

    Attributes:
        carried: lines and curves.
        covered: of these, each as often as a clip path, mask or filter applies to it or to a group around it.
    """

    carried: int = 0
    covered: int = 0

    def check(self, pieces: int) -> None:
        """Refuse so many more lines and curves, without counting them.

        Raises:
            InputError: they are too many.
        """
        if self.carried + pieces > MAX_CARRIED:
            raise InputError(
                f"as artwork these are more than {MAX_CARRIED} lines and curves, with clip paths, masks and parts of "
                "pictures for each place that uses them; simplify the drawing, or carry a picture of it (--texture)"
            )

    def carry(self, pieces: int) -> None:
        """Count lines and curves.

        Raises:
            InputError: they are too many.
        """
        self.check(pieces)
        self.carried += pieces

    def cover(self, shapes: Sequence[MappedElement]) -> None:
        """Count shapes that a clip path, mask or filter applies to.

        Raises:
            InputError: they are too many.
        """
        self.covered += sum(len(run.pieces) for shape in shapes for run in shape.runs)
        if self.covered > MAX_COVERED:
            raise InputError(
                f"as artwork more than {MAX_COVERED} lines and curves lie under clip paths, masks and filters, counted "
                "for each group around them that has one; use these in fewer groups"
            )
