"""Pictures and displacement fields in formats of ITK (`.nrrd`, `.mha`, `.nii`, `.nii.gz`), read by SimpleITK.

ITK reads other files if a header names them, takes memory for what a header promises, and leaves it as it was where the
data end too soon. So headers are checked first: the data must be in the file itself, and complete.
"""

from __future__ import annotations

import gzip
import math
import re
import zlib
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

from ..errors import InputError
from . import extras, files, limits
from .quiet_stderr import silence

READERS = {
    ".nrrd": "NrrdImageIO",
    ".mha": "MetaImageIO",
    ".nii": "NiftiImageIO",
    ".nii.gz": "NiftiImageIO",
}
"""The reader of each suffix; ITK would choose one by the content, among twenty."""
SUFFIXES = tuple(READERS)
MOST_COMPONENTS = 4  # of a pixel: more than vectors and colours with alpha have
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


def read(path: str) -> Any:
    """Read a two-dimensional picture or field; of a volume of one slice, that slice.

    Raises:
        InputError: it cannot be read, has more slices, is incomplete or too large, or its data are in another file.
    """
    itk = simple_itk()
    with files.opened(path, max_bytes=limits.GEOMETRY_BYTES) as file:
        content = _content(path, file)
        reader = itk.ImageFileReader()
        reader.SetImageIO(READERS[suffix_of(path)])
        reader.SetFileName(str(path))
        itk.ProcessObject.SetGlobalWarningDisplay(False)
        try:
            with silence():
                reader.ReadImageInformation()
                _check_size(path, itk, reader, content)
                image = reader.Execute()
        except RuntimeError:
            raise InputError(f"{path}: {_UNREAD}") from None
    if not all(
        abs(x) < limits.COORDINATE for x in (*image.GetOrigin(), *image.GetSpacing(), *image.GetDirection())
    ):
        raise InputError(f"{path}: its place in space is not given by finite numbers")
    if image.GetDimension() > 2 and all(side == 1 for side in image.GetSize()[2:]):
        while image.GetDimension() > 2:
            image = image[(slice(None),) * (image.GetDimension() - 1) + (0,)]
    if image.GetDimension() != 2:
        raise InputError(f"{path}: has {image.GetDimension()} dimensions; name a file of one slice")
    return image


def _check_size(path: str, itk: Any, reader: Any, content: Iterator[bytes] | None) -> None:
    """Check that there are not too many pixels, and that the content of the file is as large as they are.

    Raises:
        InputError: otherwise.
    """
    pixels, components = math.prod(reader.GetSize()), reader.GetNumberOfComponents()
    if pixels > limits.PIXELS or components > MOST_COMPONENTS:
        raise InputError(
            f"{path}: has {pixels} pixels of {components} values; at most {limits.PIXELS} of {MOST_COMPONENTS} are read"
        )
    bits = re.search(r"(\d+)-bit", itk.GetPixelIDValueAsString(reader.GetPixelID()))
    if bits is None:
        raise InputError(f"{path}: {_UNREAD}")
    missing = pixels * components * int(bits[1]) // 8
    try:
        while content is not None and missing > 0:
            missing -= len(next(content))
    except (StopIteration, OSError, EOFError, zlib.error):
        raise InputError(f"{path}: ends before its last pixel") from None


def _content(path: str, file: BinaryIO) -> Iterator[bytes] | None:
    """Check the header of a file; return blocks of the data after it, or None if SimpleITK checks their length itself.

    Raises:
        InputError: the header is damaged, or names another file.
    """
    suffix = suffix_of(path)
    if suffix == ".nrrd":
        if _NRRD_DATA.search(file.read()):
            raise InputError(f"{path}: {_ELSEWHERE}")
        return None
    if suffix == ".mha":
        return _meta_content(path, file.read())
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
    return chain([header[begins[0] :]], iter(lambda: source.read(files.BLOCK_BYTES), b""))


def _meta_content(path: str, data: bytes) -> Iterator[bytes]:
    """Check the header of a MetaImage, and return blocks of its data.

    Raises:
        InputError: as for `_content`.
    """
    fields, position = dict[bytes, bytes](), 0
    while b"ElementDataFile" not in fields:
        line = _META_LINE.match(data, position)
        if line is None:
            raise InputError(f"{path}: {_UNREAD}")
        fields[line[1]], position = line[2], line.end()
    # a second one could be what ITK finds, which splits lines in its own way
    if fields[b"ElementDataFile"].upper() != b"LOCAL" or len(_META_DATA.findall(data)) != 1:
        raise InputError(f"{path}: {_ELSEWHERE}")
    if fields.get(b"BinaryData", b"True").lower() != b"true" or b"HeaderSize" in fields:
        raise InputError(f"{path}: {_UNREAD}; save it with binary data and without HeaderSize")
    size = fields.get(b"CompressedDataSize", b"0")
    if not size.isdigit() or int(size[:20]) > len(data):
        raise InputError(f"{path}: {_UNREAD}")
    if fields.get(b"CompressedData", b"False").lower() == b"true":
        return _inflated(data[position:])
    return iter([data[position:]])


def _inflated(data: bytes) -> Iterator[bytes]:
    """Yield blocks of compressed data, decompressed."""
    stream = zlib.decompressobj(zlib.MAX_WBITS | 32)  # zlib or gzip, as MetaIO accepts both
    while data and not stream.eof:
        yield stream.decompress(data, files.BLOCK_BYTES)
        data = stream.unconsumed_tail
