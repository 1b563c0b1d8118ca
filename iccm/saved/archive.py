"""Archives (zip) that are not trusted, and those of NumPy arrays (.npz).

Nothing is unpickled, and the size of an array is compared with that of its file before memory is allocated.
"""

import math
import os
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy

from .. import limits
from ..errors import InputError, MissingFileError, naming

BLOCK_BYTES = 1 << 20  # of an array that are unpacked at a time
COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Compression methods that are accepted: those that NumPy and most other programs use."""
ERRORS = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    NotImplementedError,
    OverflowError,
    RuntimeError,  # encrypted
    ValueError,
)
"""Exceptions of `zipfile`, besides OSError, for a damaged archive."""
HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
"""Functions that read an array's header, by the version of NumPy's format."""


@contextmanager
def opened(
    path: str | PathLike | BinaryIO, *, otherwise: str, damaged: str, most_bytes: int = limits.ARCHIVE_BYTES
) -> Iterator[zipfile.ZipFile]:
    """Yield an archive, opened for the block.

    Args:
        path: the file; with an open one, messages have no name of a file.
        otherwise: end of the message if it is not an archive.
        damaged: beginning of the message for an error in the block, such as of a damaged array.
        most_bytes: limit on the uncompressed size of all its members.

    Raises:
        InputError: the file is missing, is not an archive, or unpacks to more bytes; or there was an error in the
            block.
    """
    place = f"{path}: " if isinstance(path, str | PathLike) else ""
    try:
        with zipfile.ZipFile(path) as archive:
            assert archive.fp is not None
            most_bytes = most_unpacked(archive.fp.seek(0, os.SEEK_END), most_bytes)
            size = sum(entry.file_size for entry in archive.infolist())
            if size > most_bytes:
                raise InputError(
                    f"contains {size} bytes, more than the limit of {most_bytes} for a file of its size"
                )
            for entry in archive.infolist():
                if entry.compress_type not in COMPRESSIONS:
                    raise InputError(f"{entry.filename}: unsupported compression")
            yield archive
    except FileNotFoundError as error:
        raise MissingFileError(f"{place}cannot read this file: {error.strerror or error}") from error
    except OSError as error:
        raise InputError(f"{place}cannot read this file: {error.strerror or error}") from error
    except zipfile.BadZipFile as error:
        raise InputError(f"{place}{otherwise}") from error
    except (*ERRORS, KeyError, TypeError) as error:
        reason = str(error).splitlines()[0][:200] if str(error) else type(error).__name__
        raise InputError(f"{place}{damaged}: {reason}") from error


def most_unpacked(size: int, most_bytes: int) -> int:
    """Return how many bytes a compressed file of `size` bytes may unpack to, at most `most_bytes`."""
    return min(most_bytes, max(limits.UNPACKED_BYTES, limits.UNPACKED_RATIO * size))


def gunzip(data: bytes, most_bytes: int) -> bytes:
    """Return what compressed data unpack to.

    Raises:
        InputError: they are damaged, or unpack to more than `most_unpacked` bytes.
    """
    most_bytes = most_unpacked(len(data), most_bytes)
    unpacker = zlib.decompressobj(wbits=16 + zlib.MAX_WBITS)
    try:
        unpacked = unpacker.decompress(data, most_bytes + 1)
    except zlib.error as error:
        raise InputError(f"damaged: {error}; save it again") from error
    if len(unpacked) > most_bytes:
        raise InputError(f"unpacks to more than {most_bytes} bytes, which is the limit")
    if not unpacker.eof:
        raise InputError("damaged: the file is truncated; save it again")
    return unpacked


class Archive:
    """The arrays of an archive, read on demand."""

    def __init__(self, archive: zipfile.ZipFile):
        self.archive = archive
        self.names = set(archive.namelist())

    def __contains__(self, name: str) -> bool:
        """Return whether there is an array of this name."""
        return f"{name}.npy" in self.names

    def member(self, name: str) -> Any:
        """Return an array as it is stored, after checking that its size is that of its file."""
        if name not in self:
            raise InputError(f"{name}: missing")
        entry = self.archive.getinfo(f"{name}.npy")
        with self.archive.open(entry) as file, naming(name):
            return _read_array(file, entry.file_size)


def _read_array(file: Any, size: int) -> Any:
    """Read an array from a file of `size` bytes in NumPy's format (NEP 1), whose header must match this size.

    Raises:
        InputError: it does not match, or the array contains Python objects.
    """
    counted = _Counted(file)
    try:
        shape, by_columns, dtype = HEADERS[npy.read_magic(counted)](counted)
    except Exception as error:  # whatever exception NumPy's header parser raises, the file is at fault
        raise InputError("not an array in NumPy's format 1.0 or 2.0") from error
    if dtype.hasobject or not dtype.itemsize or min(shape, default=0) < 0:
        raise InputError("contains Python objects, or values without a size")
    available, claimed = size - counted.count, math.prod(shape) * dtype.itemsize
    if claimed != available:
        raise InputError(f"its header promises {claimed} bytes, but {available} follow")
    data = np.empty(available, np.uint8)
    room, position = data.data, 0
    while position < available:
        if not (count := file.readinto(room[position : position + BLOCK_BYTES])):
            raise EOFError("truncated")
        position += count
    array = data.view(dtype)
    return array.reshape(shape[::-1]).T if by_columns else array.reshape(shape)


class _Counted:
    """A file that counts the bytes read from it."""

    def __init__(self, file: BinaryIO):
        self.file, self.count = file, 0

    def read(self, size: int = -1) -> bytes:
        """Read from the file."""
        data = self.file.read(size)
        self.count += len(data)
        return data
