"""A single-line bug that the tests of its folder must catch."""

from typing import NamedTuple


class Mutant(NamedTuple):
    """A single-line bug, and the tests that must fail with it.

    Parameters
    ----------
    file
        The file it is put into, relative to the repository.
    old
        Text that occurs exactly once in the file. It may span lines to be unique.
    new
        The text that replaces it.
    tests
        What pytest runs, separated by spaces: test files (or `file::test`) of the file's own folder.
    effect
        What users would see.
    """

    file: str
    old: str
    new: str
    tests: str
    effect: str

    @property
    def compiled(self) -> bool:
        """Whether the file is part of the compiled core."""
        return self.file.endswith((".cpp", ".h"))

    def mutate(self, text: str) -> str | None:
        """Return the text of the file with the bug; None if the old text does not occur exactly once."""
        if text.count(self.old) != 1:
            return None
        return text.replace(self.old, self.new)
