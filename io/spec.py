"""Specs of parts of files: `file`, `file#part`, `file#number` or `file#part#number`, the same in every command."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path


@dataclass(frozen=True)
class Spec:
    """A file, or a part of it, as the user named it.

    Attributes:
        path: the file.
        part: for a drawing the ID or label of an element, for a mesh an object, group, material or geometry.
        number: of an outline, where 1 is the largest, or of a mesh's boundary loop, where 1 is the longest.
    """

    path: Path
    part: str | None = None
    number: int | None = None

    @classmethod
    def of(cls, text: str) -> Spec:
        """Parse `file#part#number`; if it does not end in a number, everything after the file is the name of a part."""
        file = path_of(text)
        part, mark, last = text[len(file) + 1 :].rpartition("#")
        if last.isdecimal():
            return cls(Path(file), part if mark else None, int(last))
        return cls(Path(file), f"{part}{mark}{last}" or None)

    @property
    def chosen(self) -> str | None:
        """The part and number as written."""
        return "#".join(str(word) for word in (self.part, self.number) if word is not None) or None

    def among(self, names: Collection[str]) -> Spec:
        """Return the spec for a file with these parts: the name of a part has precedence over a number."""
        return replace(self, part=self.chosen, number=None) if self.chosen in names else self


def path_of(text: str) -> str:
    """Return the file of a spec; an existing file with # in its own name has precedence."""
    marks = [k for k, letter in enumerate(text) if letter == "#"]
    for at in [len(text), *reversed(marks)]:
        if os.path.isfile(text[:at]):
            return text[:at]
    folder = len(os.path.dirname(text))
    return text[: next((at for at in marks if at >= folder), len(text))]
