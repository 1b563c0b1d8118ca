"""The bytes of a drawing, which may be compressed (.svgz), within a bound."""

import zlib
from pathlib import Path

from ...errors import InputError
from .. import files, limits

SUFFIXES = (".svg", ".svgz")
GZIP = b"\x1f\x8b"


def drawing_bytes(path: Path, max_bytes: int = limits.SVG_BYTES) -> bytes:
    """The XML of a drawing; no more of a compressed one is unpacked than may be read.

    Raises:
        InputError: the file cannot be read, is damaged or too large.
    """
    data = files.read_bytes(path, max_bytes=max_bytes)
    if not data.startswith(GZIP):
        return data
    unpacker = zlib.decompressobj(wbits=16 + zlib.MAX_WBITS)
    try:
        found = unpacker.decompress(data, max_bytes + 1)
    except zlib.error as error:
        raise InputError(f"{path}: damaged: {error}; save it again") from error
    if len(found) > max_bytes:
        raise InputError(f"{path}: unpacks to more than {max_bytes} bytes; that is the limit")
    if not unpacker.eof:
        raise InputError(f"{path}: damaged: it ends too early; save it again")
    return found
