"""Pictures as mesh files store them: the content of PNG and JPEG files."""

from pathlib import Path

from ...errors import InputError
from .. import files, formats, limits


def picture_file(texture: Path | bytes) -> bytes:
    """Return the content of a PNG or JPEG file; other pictures are converted to PNG.

    Args:
        texture: a file, or the content of one.

    Raises:
        InputError: it cannot be read, or has floating-point pixels.
    """
    content = texture if isinstance(texture, bytes) else files.open_input(texture).read_bytes()
    if formats.suffix_of_content(content) in (".png", ".jpg"):
        return content
    from ..pictures import image_files

    where = "a picture" if isinstance(texture, bytes) else str(texture)
    image = image_files.read_held(texture, where, max_pixels=limits.PIXELS)
    if image.pixels.dtype.kind == "f":
        raise InputError(
            f"{where}: contains floats, which a GLB file cannot store; use a PNG or JPEG texture"
        )
    return image_files.as_png(image)
