"""Memory for pictures within a bound: what does not fit lies in a file, of which little is resident at a time."""

from __future__ import annotations

import mmap
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import memory
from ..errors import InputError
from ..parallel import thread_count

SHARE = 0.25  # of what is left when the first picture is read: for arrays that stay; the rest is for work
MIB = 1 << 20
MARGIN = 64 * MIB  # for what libraries take, and what the allocator does not give back
SOLVED = 340 * MIB  # what a process holds once it has solved for a map, without pictures


class Bounded(memory.Memory):
    """Arrays in memory as far as a bound on the whole process allows, then in a scratch file.

    Args:
        limit: bytes that the process may hold.
        folder: where the scratch file goes; it has no name and leaves nothing behind.
    """

    def __init__(self, limit: int, folder: str | Path | None = None):
        self.limit, self.folder = limit, folder
        self.kept, self.left = 0, max(0, int(SHARE * (limit - resident())))
        self._maps: list[mmap.mmap] = []

    def __call__(self, shape: tuple[int, ...], dtype: Any) -> NDArray:
        """Return an array of any content.

        Raises:
            InputError: the disk has no room for it.
        """
        wanted = int(np.prod(shape, dtype=np.int64)) * np.dtype(dtype).itemsize
        if wanted <= self.left:
            self.kept, self.left = self.kept + wanted, self.left - wanted
            return np.empty(shape, dtype)
        try:
            with tempfile.TemporaryFile(dir=self.folder) as file:
                if hasattr(os, "posix_fallocate"):
                    os.posix_fallocate(file.fileno(), 0, wanted)
                else:
                    file.truncate(wanted)
                self._maps.append(mmap.mmap(file.fileno(), wanted))
        except OSError as error:
            raise InputError(
                f"--memory: cannot write {wanted // MIB}M of temporary data to {self.folder}: {error.strerror}"
            ) from error
        return np.frombuffer(self._maps[-1], dtype).reshape(shape)

    def release(self) -> None:
        """Let the system take back the resident pages of the scratch file."""
        for pages in self._maps:
            if hasattr(pages, "madvise"):  # not on Windows, which takes them back on its own
                pages.madvise(mmap.MADV_DONTNEED)

    def threads(self, asked: int | None, each: int, what: str) -> int | None:
        """Return how many threads fit, each taking so many bytes, at most as many as asked.

        Raises:
            InputError: not even one.
        """
        return min(thread_count(asked), self._free(resident(), each, what) // each)

    def check(self, each: int, what: str) -> None:
        """Refuses, before a map is solved for, work for which there will be no room; arguments as for `threads`.

        Raises:
            InputError: there will not be.
        """
        self._free(max(resident(), SOLVED + self.kept), each, what)

    def _free(self, held: int, each: int, what: str) -> int:
        """Bytes left for work of which each piece takes so many."""
        free = self.limit - held - MARGIN
        if free < each:
            takes = -(-(self.limit - free + each) // MIB)
            raise InputError(
                f"--memory: {self.limit // MIB}M is too little for {what}, which needs "
                f"{takes}M; raise --memory"
            )
        return free


def within(limit: int | None, output: str | None) -> memory.Memory:
    """Memory within --memory, if given; the disk that has room for an output has it for the scratch file."""
    if not limit:
        return memory.Memory()
    return Bounded(limit, Path(output).resolve().parent if output else tempfile.gettempdir())


def resident() -> int:
    """Bytes of this process that are in memory."""
    try:
        return int(Path("/proc/self/statm").read_bytes().split()[1]) * mmap.PAGESIZE
    except OSError:  # not Linux: the most that it ever was
        try:
            import resource
        except ImportError:  # Windows
            return 0
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
