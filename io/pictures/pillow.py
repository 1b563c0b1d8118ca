"""The only place where pictures are opened with Pillow: restricted to an allow-list of formats and a number of pixels.

By default Pillow chooses a decoder by content, whatever the file's name, and one of its decoders (EPS) starts another
program.
"""

from __future__ import annotations

import struct
import warnings
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import InputError

if TYPE_CHECKING:
    from PIL.Image import Image

FORMATS = ("PNG", "JPEG", "WEBP", "TIFF", "GIF", "BMP", "AVIF")
"""Pillow's names of the formats that may be opened; their decoders start no programs and read no other files."""
WITH_EXTRA = ("HEIF",)
"""Further formats, which Pillow opens once the package pi_heif has registered their decoder."""
EMBEDDED = FORMATS
"""Formats that may be embedded in a drawing."""


DECODER_ERRORS = (
    OSError,
    EOFError,
    SyntaxError,
    ValueError,
    LookupError,
    TypeError,
    ArithmeticError,
    AssertionError,
    RuntimeError,
    struct.error,
    zlib.error,
)
"""What decoders of Pillow raise for damaged pictures."""


@contextmanager
def opened(picture: Path | bytes, where: object, formats: Sequence[str] = FORMATS) -> Iterator[Image]:
    """Yield an open picture, whose size is known; pixels are decoded on access.

    Args:
        picture: a file, or the content of one.
        where: its name in messages.
        formats: those of `FORMATS` and `WITH_EXTRA` that are allowed.

    Raises:
        InputError: it has none of the formats, is damaged, or has more pixels than Pillow decodes; also for such errors
            inside the block.
    """
    from PIL import Image as Pillow

    if not_allowed := set(formats).difference(FORMATS, WITH_EXTRA):
        raise ValueError(f"{', '.join(not_allowed)}: formats that may not be opened")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            source = BytesIO(picture) if isinstance(picture, bytes) else picture
            with Pillow.open(source, formats=tuple(formats)) as image:
                yield image
    except Pillow.DecompressionBombError as error:
        most = 2 * (Pillow.MAX_IMAGE_PIXELS or 0)
        raise InputError(f"{where}: has more than {most} pixels, the limit for this format") from error
    except InputError:
        raise
    except DECODER_ERRORS as error:
        reason = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise InputError(f"{where}: cannot read this picture ({', '.join(formats)}): {reason}") from error
