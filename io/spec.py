"""Specs of parts of files: `file`, `file#part`, `file#number` or `file#part#number`, the same in every command."""

from __future__ import annotations

import os
import re
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path

INVERSE = "inverse:"
"""Before the name of a saved map: the inverse of that map."""
FORMER_INVERSE = "~"
"""The same in earlier versions; shells such as zsh expand it to a folder."""
MOST_DIGITS = 9  # of the number of an outline; a longer one is the name of a part


def saved_map_of(name: str) -> tuple[str, bool]:
    """Return the file of a saved map, and whether its inverse is requested.

    >>> saved_map_of("inverse:a.npz"), saved_map_of("a.npz")
    (('a.npz', True), ('a.npz', False))
    """
    for mark in (INVERSE, FORMER_INVERSE):
        if name.startswith(mark):
            return name.removeprefix(mark), True
    return name, False


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
        if last.isdecimal() and len(last) <= MOST_DIGITS:
            return cls(Path(file), part if mark else None, int(last))
        return cls(Path(file), f"{part}{mark}{last}" or None)

    @property
    def selection(self) -> str | None:
        """The part and number after `#`, as the user wrote them."""
        return "#".join(str(word) for word in (self.part, self.number) if word is not None) or None

    def among(self, names: Collection[str]) -> Spec:
        """Return the spec for a file with these parts: the name of a part has precedence over a number."""
        return replace(self, part=self.selection, number=None) if self.selection in names else self


def path_of(text: str) -> str:
    """Return the file of a spec; an existing file with # in its own name has precedence."""
    marks = [k for k, letter in enumerate(text) if letter == "#"]
    for end in [len(text), *reversed(marks)]:
        if os.path.isfile(text[:end]):
            return text[:end]
    folder = len(os.path.dirname(text))
    return text[: next((end for end in marks if end >= folder), len(text))]


GENERATED = re.compile(r"(sheet|plane|cylinder|cone|sphere):.*|sheet", re.DOTALL)
"""Shapes that are generated from sizes instead of read, such as `cylinder:90x100`."""
MARKED = re.compile(r"(plane|cylinder|cone)=(.*)", re.DOTALL)
"""Parts of photographs that are given by points, such as `photo.jpg#plane=20,30:400,50:420,600:10,580`."""


def is_generated(text: str) -> bool:
    """Return whether a spec names a generated shape; an existing file of that name has precedence."""
    return bool(GENERATED.fullmatch(text)) and not os.path.isfile(path_of(text))


def is_marked(text: str) -> bool:
    """Return whether a spec names a sheet that is marked on a photograph."""
    return not is_generated(text) and bool(MARKED.fullmatch(Spec.of(text).selection or ""))


def is_view(text: str) -> bool:
    """Return whether a spec names a generated shape, or a sheet that is marked on a photograph."""
    return is_generated(text) or is_marked(text)


def short_name(text: str) -> str:
    """Return a name for the shape that a spec names, as a part of the names of files."""
    if is_generated(text):
        return text.partition(":")[0]
    spec = Spec.of(text)
    selection = (spec.selection or "").partition("=")[0] if is_marked(text) else spec.selection
    return spec.path.stem + (f"-{selection.replace('#', '-')}" if selection else "")
