"""The texture that a mesh shows, and where it lies on it."""

from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...meshes import layout
from ..pictures import image_files
from ..pictures.image_files import Image
from .mesh_shape import as_mesh
from .shape import Shape


def read(shape: Shape, **options: Any) -> Image:
    """The texture that a mesh file names or holds; of several the first.

    Args:
        shape: the mesh.
        options: as in `image_files.read`, for a texture in a file of its own.

    Raises:
        InputError: there is none.
    """
    if not shape.pictures:
        raise InputError(f"{shape.spec}: names no texture; give one with --texture")
    picture = shape.pictures[0]
    if not isinstance(picture, bytes):
        return image_files.read(picture, **options)
    pixels = _decode(shape.spec, picture)
    opaque = bool((pixels[..., 3] == 255).all())
    return Image(pixels[..., :3].copy() if opaque else pixels, alpha=-1 if opaque else 3)


def _decode(spec: str, picture: bytes) -> NDArray[np.uint8]:
    from PIL import Image as Pillow

    try:
        return np.asarray(Pillow.open(BytesIO(picture)).convert("RGBA"))
    except (OSError, ValueError, SyntaxError, Pillow.DecompressionBombError) as error:
        reason = " ".join(str(error).split())[:120]
        raise InputError(f"{spec}: the texture in the file cannot be read: {reason}") from error


def beyond_unit(shape: Shape) -> int:
    """How many triangles of a mesh have texture coordinates outside 0..1.

    Raises:
        InputError: it has none, or some that are not finite.
    """
    mesh = as_mesh(shape)
    return int(layout.outside(mesh.uv[mesh.uv_faces]).sum())
