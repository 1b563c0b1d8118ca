"""Pictures and displacement fields in formats of ITK (`.nrrd`, `.mha`, `.nii`, `.nii.gz`), read by SimpleITK in a
process apart.

ITK reads other files if a header names them, takes memory for what a header promises, and leaves it as it was where the
data end too soon. So headers are checked first: the data must be in the file itself, and complete.
"""

from __future__ import annotations

import gzip
import math
import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..arrays import Real
from ..errors import InputError
from . import extras, files, limits
from .isolated import process, readers

READERS = {
    ".nrrd": "NrrdImageIO",
    ".mha": "MetaImageIO",
    ".nii": "NiftiImageIO",
    ".nii.gz": "NiftiImageIO",
}
"""The reader of each suffix; ITK would choose one by the content, among twenty."""
SUFFIXES = tuple(READERS)
META_BYTES = {
    b"MET_CHAR": 1,
    b"MET_UCHAR": 1,
    b"MET_SHORT": 2,
    b"MET_USHORT": 2,
    b"MET_INT": 4,
    b"MET_UINT": 4,
}
META_BYTES |= {b"MET_LONG_LONG": 8, b"MET_ULONG_LONG": 8, b"MET_FLOAT": 4, b"MET_DOUBLE": 8}
META_BYTES |= {b"MET_LONG": 4, b"MET_ULONG": 4}
"""Bytes of a number of each type of MetaImage that is read."""
NRRD_BYTES = {
    **dict.fromkeys(
        (b"signed char", b"int8", b"int8_t", b"uchar", b"unsigned char", b"uint8", b"uint8_t"), 1
    ),
    **dict.fromkeys((b"short", b"short int", b"signed short", b"int16", b"int16_t"), 2),
    **dict.fromkeys((b"ushort", b"unsigned short", b"unsigned short int", b"uint16", b"uint16_t"), 2),
    **dict.fromkeys(
        (b"int", b"signed int", b"int32", b"int32_t", b"uint", b"unsigned int", b"uint32", b"uint32_t"), 4
    ),
    **dict.fromkeys((b"longlong", b"long long", b"long long int", b"int64", b"int64_t"), 8),
    **dict.fromkeys(
        (b"ulonglong", b"unsigned long long", b"unsigned long long int", b"uint64", b"uint64_t"), 8
    ),
    b"float": 4,
    b"double": 8,
}
"""The same of NRRD."""
NRRD_DOMAINS = (b"domain", b"space", b"time", b"none", b"???")  # kinds of axes that are not those of vectors
NIFTI_BYTES = {2: 1, 4: 2, 8: 4, 16: 4, 64: 8, 256: 1, 512: 2, 768: 4, 1024: 8, 1280: 8}
"""The same of NIfTI, by its codes: real numbers, as ITK ends the process for others."""
MOST_DIGITS = 12  # of a size in a header
_UNREAD = "cannot be read as a picture or field of ITK"
_ELSEWHERE = "its data are not in this file; save header and data as one file"
_META_LINE = re.compile(rb"[ \t]*([^=:\r\n]*?)[ \t]*[=:][ \t]*([^\r\n]*?)[ \t]*\r?\n")
_META_DATA = re.compile(rb"ElementDataFile", re.IGNORECASE)
_NRRD_DATA = re.compile(rb"^[ \t]*data ?file[ \t]*:", re.IGNORECASE | re.MULTILINE)
NIFTI_IN_ONE_FILE = (344, b"n+1\0", 352), (4, b"n+2\0", 544)
"""For both versions of NIfTI: place and value of the text in the header that says that the data follow in the same
file, and where they begin at the earliest."""


def is_itk(name: str | Path) -> bool:
    """Return whether a file is in a format of ITK, by its suffix."""
    return str(name).lower().endswith(SUFFIXES)


def suffix_of(name: str | Path) -> str:
    """Return the suffix of a file in a format of ITK, which may have two parts."""
    return max((suffix for suffix in SUFFIXES if str(name).lower().endswith(suffix)), key=len)


def simple_itk() -> Any:
    """Return the module SimpleITK.

    Raises:
        InputError: it is not installed.
    """
    return extras.load("reading and writing displacement fields", "SimpleITK")


@dataclass(frozen=True, eq=False)
class ItkImage:
    """A two-dimensional picture or field, at its place in space.

    Attributes:
        pixels: (h, w) numbers or (h, w, c) vectors, by their indices in ITK: the first row is that of the origin.
        components: numbers of a pixel.
        origin, spacing: (2,) place of the centre of the first pixel, and distances between pixels.
        direction: (2, 2) its columns are the directions of rows and columns.
    """

    pixels: NDArray[Any]
    components: int
    origin: Real
    spacing: Real
    direction: Real


def read(path: str) -> ItkImage:
    """Read a two-dimensional picture or field; of a volume of one slice, that slice.

    Raises:
        InputError: it cannot be read, has more slices, is incomplete or too large, or its data are in another file.
    """
    extras.require("reading and writing displacement fields", "SimpleITK")
    with files.opened(path, max_bytes=limits.GEOMETRY_BYTES) as file:
        header, content = _content(path, file)
        header.check(path, content)
    image = process.read(path, readers.itk, reader=READERS[suffix_of(path)])
    places = [np.array(image[name], float) for name in ("origin", "spacing", "direction")]
    if not all(np.isfinite(place).all() and (np.abs(place) < limits.COORDINATE).all() for place in places):
        raise InputError(f"{path}: its place in space is not given by finite numbers")
    size = image["size"]
    if len(size) < 2 or any(side != 1 for side in size[2:]):
        raise InputError(f"{path}: has {len(size)} dimensions; name a file of one slice")
    pixels, components = image["pixels"], int(image["components"])
    pixels = pixels.reshape(size[1], size[0], *([components] if components > 1 else []))
    direction = places[2].reshape(len(size), len(size))[:2, :2]
    if not all(size) or not np.linalg.det(direction) or not places[1][:2].all():
        raise InputError(f"{path}: its pixels have no extent in space")
    return ItkImage(pixels, components, places[0][:2], places[1][:2], direction)


@dataclass(frozen=True)
class _Header:
    """The fields of a header, which are not yet compared with the data.

    Attributes:
        size: pixels along each dimension.
        components: numbers of a pixel.
        bytes_each: of a number.
    """

    size: tuple[int, ...]
    components: int
    bytes_each: int

    def check(self, path: str, content: Iterator[bytes]) -> None:
        """Check that there are not too many pixels, and that the content of the file is as large as they are.

        Raises:
            InputError: otherwise.
        """
        pixels = math.prod(self.size)
        if not 1 <= len(self.size) <= limits.FIELD_DIMENSIONS or min(self.size) < 1 or self.components < 1:
            raise InputError(f"{path}: its header gives no size; the sides must be whole numbers from 1")
        if pixels > limits.PIXELS or self.components > limits.FIELD_COMPONENTS:
            raise InputError(
                f"{path}: {pixels} pixels of {self.components} values; at most {limits.PIXELS} of "
                f"{limits.FIELD_COMPONENTS} are read"
            )
        missing = pixels * self.components * self.bytes_each
        try:
            while missing > 0:
                missing -= len(next(content))
        except (StopIteration, OSError, EOFError, zlib.error):
            raise InputError(f"{path}: ends before its last pixel") from None


def _content(path: str, file: BinaryIO) -> tuple[_Header, Iterator[bytes]]:
    """Return what the header of a file promises, and blocks of the data after it.

    Raises:
        InputError: the header is damaged, or names another file.
    """
    suffix = suffix_of(path)
    if suffix in (".nrrd", ".mha"):
        data = file.read()
        return _nrrd_content(path, data) if suffix == ".nrrd" else _meta_content(path, data)
    source = gzip.GzipFile(fileobj=file) if suffix == ".nii.gz" else file
    try:
        header = source.read(files.BLOCK_BYTES)
    except (OSError, EOFError, zlib.error):
        header = b""
    begins = [
        first for offset, word, first in NIFTI_IN_ONE_FILE if header[offset : offset + len(word)] == word
    ]
    if not begins:
        raise InputError(f"{path}: {_ELSEWHERE}")
    if len(header) < begins[0]:
        raise InputError(f"{path}: ends before its header does")
    return _nifti_header(path, header), chain([header[begins[0] :]], _blocks(source))


def _blocks(source: Any) -> Iterator[bytes]:
    return iter(lambda: source.read(files.BLOCK_BYTES), b"")


def _nifti_header(path: str, header: bytes) -> _Header:
    """Return what a header of NIfTI promises; vectors are the fifth dimension.

    Raises:
        InputError: it is damaged, or the type of its numbers is not read.
    """
    if header[4:7] == b"n+2":
        order = "<" if header[:4] == (540).to_bytes(4, "little") else ">"
        (kind,), dimensions = (
            struct.unpack_from(f"{order}h", header, 12),
            struct.unpack_from(f"{order}8q", header, 16),
        )
    else:
        order = "<" if header[:4] == (348).to_bytes(4, "little") else ">"
        dimensions, (kind,) = (
            struct.unpack_from(f"{order}8h", header, 40),
            struct.unpack_from(f"{order}h", header, 70),
        )
    count = dimensions[0]
    if kind not in NIFTI_BYTES or not 1 <= count <= 7:
        raise InputError(
            f"{path}: {_UNREAD}: numbers of type {kind}, or of {count} dimensions, are not supported"
        )
    size = dimensions[1 : 1 + count]
    return _Header(tuple(size[:4]), math.prod(size[4:]), NIFTI_BYTES[kind])


def _nrrd_fields(path: str, text: bytes) -> dict[bytes, bytes]:
    """Return the fields of an NRRD's header, without comments and key/value pairs (`key:=value`)."""
    fields = dict[bytes, bytes]()
    for line in text.splitlines()[1:]:
        name, colon, value = line.partition(b":")
        if not colon or line.startswith(b"#") or value.startswith(b"="):
            continue
        name = name.strip().lower()
        if name in fields:
            raise InputError(f"{path}: {_UNREAD}: its header has {name.decode(errors='replace')!r} twice")
        fields[name] = value.strip()
    return fields


def _nrrd_header(path: str, fields: dict[bytes, bytes]) -> _Header:
    """Return what the fields of an NRRD's header promise; axes that are not of space or time are components."""
    words, kind = fields.get(b"sizes", b"").split(), fields.get(b"type", b"").lower()
    are_numbers = all(
        word.isdigit() and len(word) < MOST_DIGITS for word in [*words, fields.get(b"dimension", b"")]
    )
    if not are_numbers or int(fields[b"dimension"]) != len(words) or kind not in NRRD_BYTES:
        raise InputError(f"{path}: {_UNREAD}: its type or sizes are wrong; sizes are whole numbers")
    axis_kinds = fields.get(b"kinds", b"").lower().split()
    sides, components = list[int](), 1
    for k, word in enumerate(words):
        if k < len(axis_kinds) and axis_kinds[k] not in NRRD_DOMAINS:
            components *= int(word)
        else:
            sides.append(int(word))
    return _Header(tuple(sides), components, NRRD_BYTES[kind])


def _nrrd_content(path: str, data: bytes) -> tuple[_Header, Iterator[bytes]]:
    """Return what the header of an NRRD promises, and blocks of its data.

    Raises:
        InputError: the header is damaged or names another file, or its encoding is not read.
    """
    end = re.search(rb"\r?\n\r?\n", data)
    if _NRRD_DATA.search(data):
        raise InputError(f"{path}: {_ELSEWHERE}")
    if not data.startswith(b"NRRD") or end is None:
        raise InputError(f"{path}: {_UNREAD}")
    fields = _nrrd_fields(path, data[: end.start()])
    header = _nrrd_header(path, fields)
    content, encoding = data[end.end() :], fields.get(b"encoding", b"").lower()
    if encoding == b"raw":
        return header, iter([content])
    if encoding in (b"gz", b"gzip"):
        return header, _inflated(content)
    raise InputError(f"{path}: {_UNREAD}; save it with the encoding raw or gzip")


def _meta_content(path: str, data: bytes) -> tuple[_Header, Iterator[bytes]]:
    """Return what the header of a MetaImage promises, and blocks of its data.

    Raises:
        InputError: as for `_content`.
    """
    fields, position = dict[bytes, bytes](), 0
    while b"ElementDataFile" not in fields:
        line = _META_LINE.match(data, position)
        if line is None:
            raise InputError(f"{path}: {_UNREAD}")
        if line[1] in fields:
            raise InputError(f"{path}: {_UNREAD}: its header has {line[1].decode(errors='replace')!r} twice")
        fields[line[1]], position = line[2], line.end()
    # a second one could be what ITK finds, which splits lines in its own way
    if fields[b"ElementDataFile"].upper() != b"LOCAL" or len(_META_DATA.findall(data)) != 1:
        raise InputError(f"{path}: {_ELSEWHERE}")
    if fields.get(b"BinaryData", b"True").lower() != b"true" or b"HeaderSize" in fields:
        raise InputError(f"{path}: {_UNREAD}; save it with binary data and without HeaderSize")
    size = fields.get(b"CompressedDataSize", b"0")
    if not size.isdigit() or int(size[:20]) > len(data):
        raise InputError(f"{path}: {_UNREAD}")
    sizes, kind = fields.get(b"DimSize", b"").split(), fields.get(b"ElementType", b"")
    counts = [fields.get(b"NDims", b""), fields.get(b"ElementNumberOfChannels", b"1"), *sizes]
    whole = all(count.isdigit() and len(count) < MOST_DIGITS for count in counts)
    if not whole or int(counts[0]) != len(sizes) or kind not in META_BYTES:
        raise InputError(
            f"{path}: {_UNREAD}: its ElementType, NDims or DimSize is wrong; sizes are whole numbers"
        )
    header = _Header(tuple(map(int, sizes)), int(counts[1]), META_BYTES[kind])
    if fields.get(b"CompressedData", b"False").lower() == b"true":
        return header, _inflated(data[position:])
    return header, iter([data[position:]])


def _inflated(data: bytes) -> Iterator[bytes]:
    """Yield blocks of compressed data, decompressed."""
    stream = zlib.decompressobj(zlib.MAX_WBITS | 32)  # zlib or gzip, as MetaIO accepts both
    while data and not stream.eof:
        yield stream.decompress(data, files.BLOCK_BYTES)
        data = stream.unconsumed_tail
