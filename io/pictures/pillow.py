"""The one place where pictures are opened with Pillow: by an allow-list of formats, and within its limit of pixels.

Left to itself Pillow chooses a decoder by the content alone, whatever a file is called, and one of its decoders (EPS)
starts another program.
"""

from __future__ import annotations

import warnings
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
"""The same of formats that Pillow opens once `decodes_heif` has found their decoder."""
EMBEDDED = FORMATS
"""Those that a drawing may hold."""


def decodes_heif() -> bool:
    """Return whether the decoder of HEIC is installed, the extra `heic`; Pillow then opens such pictures where it
    may.
    """
    try:
        import pi_heif
    except ImportError:
        return False
    pi_heif.register_heif_opener(thumbnails=False)
    return True


@contextmanager
def opened(picture: Path | bytes, where: object, formats: Sequence[str] = FORMATS) -> Iterator[Image]:
    """Yield a picture, open while the block runs: its size is known, its pixels are decoded when they are asked for.

    Args:
        picture: a file, or the content of one.
        where: what messages call it.
        formats: those of `FORMATS` and `WITH_EXTRA` that it may have.

    Raises:
        InputError: it is in none of the formats, damaged, or has more pixels than Pillow decodes, also where the block
            finds that.
    """
    from PIL import Image as Pillow

    if beyond := set(formats).difference(FORMATS, WITH_EXTRA):
        raise ValueError(f"{', '.join(beyond)}: formats that may not be opened")
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
    except (OSError, ValueError, SyntaxError, EOFError) as error:
        reason = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise InputError(f"{where}: cannot read this picture ({', '.join(formats)}): {reason}") from error
