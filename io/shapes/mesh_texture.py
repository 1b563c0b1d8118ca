"""The texture that a mesh shows, and where it lies on it."""

from typing import Any

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
        options: as in `image_files.read`.

    Raises:
        InputError: there is none.
    """
    if not shape.pictures:
        raise InputError(f"{shape.spec}: names no texture; give one with --texture")
    return image_files.read_held(shape.pictures[0], f"{shape.spec}: the texture in the file", **options)


def beyond_unit(shape: Shape) -> int:
    """How many triangles of a mesh have texture coordinates outside 0..1.

    Raises:
        InputError: it has none, or some that are not finite.
    """
    mesh = as_mesh(shape)
    return int(layout.outside(mesh.uv[mesh.uv_faces]).sum())
