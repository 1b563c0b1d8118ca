"""Patterns (globs) in a manifest: the files that they match, with a limit on visited entries, inside allowed folders.

Otherwise the manifest of a stranger could search the whole disk (`/**`), or read any picture on this machine.
"""

import fnmatch
import glob
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ...errors import InputError
from .. import limits


@dataclass
class Globs:
    """Patterns that share a limit on entries and time.

    Attributes:
        roots: folders that matches must lie in, after links are resolved; None for anywhere.
    """

    roots: Sequence[str] | None
    _left: int = field(default_factory=lambda: limits.GLOB_ENTRIES)
    _end: float = field(default_factory=lambda: time.monotonic() + limits.GLOB_SECONDS)

    def __post_init__(self) -> None:
        self._real = None if self.roots is None else [os.path.realpath(root or ".") for root in self.roots]

    def files(self, pattern: str) -> list[str]:
        """Return the files that a pattern matches, sorted.

        `*`, `?` and `[…]` match in names, `**` matches nested folders (but not through links). Names that begin with a
        dot only match patterns that begin with a dot.

        Raises:
            InputError: the pattern leads out of the roots, or exceeds the limits.
        """
        return sorted(set(self._below("", list(Path(pattern).parts))))

    def _below(self, folder: str, parts: list[str]) -> Iterator[str]:
        first, deeper = parts[0], parts[1:]
        if first == "**":
            yield from self._below(folder, deeper or ["*"])
            for entry in self._entries(folder):
                if entry.is_dir(follow_symlinks=False) and not entry.name.startswith("."):
                    yield from self._below(os.path.join(folder, entry.name), parts)
            return
        names = [first]
        if glob.has_magic(first):
            entries = [entry.name for entry in self._entries(folder)]
            dotted = first.startswith(".")
            names = [name for name in fnmatch.filter(entries, first) if dotted or not name.startswith(".")]
        for name in names:
            path = os.path.join(folder, name)
            if deeper:
                yield from self._below(path, deeper) if os.path.isdir(path) else ()
            elif os.path.isfile(path):
                self._check(path)
                yield path

    def _entries(self, folder: str) -> Iterator[os.DirEntry[str]]:
        """Yield the entries of a folder; none if it cannot be read."""
        self._check(folder)
        try:
            with os.scandir(folder or ".") as entries:
                for entry in entries:
                    self._left -= 1
                    if self._left < 0 or time.monotonic() > self._end:
                        raise InputError(
                            f"the pattern searches more than {limits.GLOB_ENTRIES:,} files, or longer "
                            f"than {limits.GLOB_SECONDS} s; choose a narrower folder"
                        )
                    yield entry
        except OSError:
            return

    def _check(self, path: str) -> None:
        real = os.path.realpath(path or ".")
        if self._real is not None and not any(Path(real).is_relative_to(root) for root in self._real):
            raise InputError(
                f"matches {path}, outside the manifest's folder and the root; allow this with --allow-outside"
            )
