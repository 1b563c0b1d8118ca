"""Memory for pictures within a limit: arrays that do not fit are kept in a file, of which little is resident at a
time.
"""

from __future__ import annotations

import mmap
import os
import sys
import tempfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .. import memory
from ..errors import InputError
from ..parallel import thread_count

# relative to the memory left when the first picture is read: for arrays that are kept; the rest is for temporary ones
CACHE_MEMORY_SHARE = 0.25
MIB = 1 << 20  # bytes of a mebibyte
MARGIN = 64 * MIB  # for memory that libraries take, or that the allocator does not return
SOLVED = 340 * MIB  # memory of a process after solving for a map, without pictures


class Bounded(memory.Memory):
    """Arrays in memory within a limit for the whole process, beyond that in a scratch file.

    Args:
        limit: bytes for the whole process.
        folder: of the scratch file, which has no name and leaves nothing behind.
    """

    def __init__(self, limit: int, folder: str | Path | None = None):
        self.limit, self.folder = limit, folder
        self.in_memory, self.remaining = 0, max(0, int(CACHE_MEMORY_SHARE * (limit - resident())))
        self._maps: list[mmap.mmap] = []

    def __call__(self, shape: tuple[int, ...], dtype: Any) -> NDArray:
        """Return an uninitialised array.

        Raises:
            InputError: there is no space on the disk.
        """
        byte_count = int(np.prod(shape, dtype=np.int64)) * np.dtype(dtype).itemsize
        if byte_count <= self.remaining:
            self.in_memory, self.remaining = self.in_memory + byte_count, self.remaining - byte_count
            return np.empty(shape, dtype)
        try:
            with tempfile.TemporaryFile(dir=self.folder) as file:
                allocate(file, byte_count)
                self._maps.append(mmap.mmap(file.fileno(), byte_count))
        except OSError as error:
            raise InputError(
                f"--memory: cannot write {byte_count // MIB}M of temporary data to {self.folder}: {error.strerror}"
            ) from error
        return np.frombuffer(self._maps[-1], dtype).reshape(shape)

    def release(self) -> None:
        """Let the system release the resident pages of the scratch file."""
        for pages in self._maps:
            if hasattr(pages, "madvise"):  # Windows, which has no madvise, releases them automatically
                pages.madvise(mmap.MADV_DONTNEED)

    def threads(self, requested: int | None, bytes_each: int, what: str) -> int | None:
        """Return the number of threads that fit if each takes `bytes_each` bytes, at most `requested`.

        Raises:
            InputError: not even one fits.
        """
        return min(thread_count(requested), self._free(resident(), bytes_each, what) // bytes_each)

    def check(self, bytes_each: int, what: str) -> None:
        """Check, before a map is solved, that work will fit; arguments as in `threads`.

        Raises:
            InputError: it will not.
        """
        self._free(max(resident(), SOLVED + self.in_memory), bytes_each, what)

    def _free(self, in_use: int, bytes_each: int, what: str) -> int:
        """Return the bytes left for work that takes `bytes_each` bytes per piece."""
        free = self.limit - in_use - MARGIN
        if free < bytes_each:
            takes = -(-(self.limit - free + bytes_each) // MIB)
            raise InputError(
                f"--memory: {self.limit // MIB}M is too little for {what}, which needs "
                f"{takes}M; raise --memory"
            )
        return free


def within(limit: int | None, output: str | None) -> memory.Memory:
    """Return memory within --memory, if given; the scratch file is on the disk of the output."""
    if not limit:
        return memory.Memory()
    return Bounded(limit, os.path.dirname(os.path.realpath(output)) if output else tempfile.gettempdir())


def allocate(file: IO[bytes], size: int) -> None:
    """Give an empty file a size, and reserve its space on the disk: a full disk would end the process later, when the
    mapped file is written.

    Raises:
        OSError: there is no space on the disk.
    """
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file.fileno(), 0, size)
    elif os.name == "nt":  # which reserves the space of a larger size
        file.truncate(size)
    else:  # macOS: a larger size alone would be a hole
        zeros = bytes(MIB)
        for start in range(0, size, MIB):
            file.write(zeros[: size - start])
        file.flush()


def resident() -> int:
    """Return the resident memory of this process in bytes."""
    try:
        return int(Path("/proc/self/statm").read_bytes().split()[1]) * mmap.PAGESIZE
    except OSError:  # not Linux: the peak so far
        try:
            import resource
        except ImportError:  # Windows
            return 0
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
