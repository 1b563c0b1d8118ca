"""A part of a file: `file`, `file#part`, `file#number` or `file#part#number`, the same in every command."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path


@dataclass(frozen=True)
class Spec:
    """What the user named.

    Attributes:
        path: the file.
        part: of a drawing the id or label of an element, of a mesh an object, group, material or geometry.
        number: of an outline, 1 being the largest, or of a mesh's boundary loop, 1 being the longest.
    """

    path: Path
    part: str | None = None
    number: int | None = None

    @classmethod
    def of(cls, text: str) -> Spec:
        """Return what `file#part#number` names; what ends in no number is the name of a part."""
        file = path_of(text)
        part, mark, last = text[len(file) + 1 :].rpartition("#")
        if last.isdecimal():
            return cls(Path(file), part if mark else None, int(last))
        return cls(Path(file), f"{part}{mark}{last}" or None)

    @property
    def chosen(self) -> str | None:
        """Part and number as they are written."""
        return "#".join(str(word) for word in (self.part, self.number) if word is not None) or None

    def among(self, names: Collection[str]) -> Spec:
        """Return the same in a file that has parts of these names: one that is called like a number is meant before
        it.
        """
        return replace(self, part=self.chosen, number=None) if self.chosen in names else self


def path_of(text: str) -> str:
    """Return the file of a spec; a file whose own name has a # wins."""
    marks = [k for k, letter in enumerate(text) if letter == "#"]
    for at in [len(text), *reversed(marks)]:
        if os.path.isfile(text[:at]):
            return text[:at]
    folder = len(os.path.dirname(text))
    return text[: next((at for at in marks if at >= folder), len(text))]
