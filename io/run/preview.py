"""The contact sheet of a textured mesh: views from four sides, drawn without a display, a driver or matplotlib."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...arrays import Index, Real
from ...errors import InputError
from ...maps.approximation import AnyMap
from ...maps.extended_inverse import ExtendedInverse
from ...meshes.mesh import up_and_front
from ...meshes.render import axes_towards, render
from ...pixels.checkerboard import checkerboard
from ...pixels.sampler import Sampler
from ...pixels.warp import Texture
from .. import formats
from ..pictures import image_files
from ..pictures.image import Image
from ..shapes.mesh_shape import MeshShape
from ..shapes.shape import Shape
from .framing import square

SIDES_DEGREES = 25, 115, 205, 295
"""Directions of the viewers around the model's up axis, from its front: front, right, back and left, a little turned
so that two sides of a box are seen in each."""
HEIGHT_DEGREES = 20  # of the viewers above the horizon
SIDE_PIXELS = 480  # width and height of each view
BORDER_PIXELS = 16  # around each view
GROUND = 244  # grey level of the background

Textured = tuple[Real, Index, Real]
"""(n, 3) points, (m, 3) triangles, and (m, 3, 2) positions of their corners in the texture, in texels with y down."""


def check(name: str) -> None:
    """Check that a contact sheet can be written with this name.

    Raises:
        InputError: its suffix is not .png.
    """
    if formats.suffix_of(name) != ".png":
        raise InputError(f"{name}: unknown suffix for --preview; use .png")


def write(path: Path, parts: Sequence[Textured], sampler: Sampler | None, up_axis: int) -> None:
    """Write the contact sheet of a mesh.

    Args:
        path: the PNG file.
        parts: of the mesh.
        sampler: the texture; None for plain clay.
        up_axis: the model's axis that points up: 1 for y, whose front is +z; 2 for z, whose front is -y.
    """
    firsts = np.cumsum([0, *(len(points) for points, _, _ in parts)])
    points = np.concatenate([part[0] for part in parts])
    faces = np.concatenate([part[1] + first for part, first in zip(parts, firsts)])
    uv = np.concatenate([part[2] for part in parts])
    views = [render(points, faces, uv, sampler, SIDE_PIXELS, axes) for axes in view_axes(up_axis)]
    image_files.write(path, Image(sheet(views)))


def view_axes(up_axis: int) -> list[Real]:
    """Return the view axes (3, 3) of the four sides, see `meshes.render.axes_towards`."""
    up, front = up_and_front(up_axis)
    right, above = np.cross(up, front), np.radians(HEIGHT_DEGREES)
    around = np.radians(SIDES_DEGREES)
    return [
        axes_towards(np.cos(above) * (np.cos(t) * front + np.sin(t) * right) + np.sin(above) * up, up)
        for t in around
    ]


def sheet(views: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Return (h, w, 3) the pictures (h, w, 4) beside each other, two in a row, on a grey ground."""
    cell = SIDE_PIXELS + 2 * BORDER_PIXELS
    rows = -(-len(views) // 2)
    ground = np.full((rows * cell, 2 * cell, 3), GROUND, np.uint8)
    for k, view in enumerate(views):
        height, width = view.shape[:2]
        top, left = (k // 2) * cell + (cell - height) // 2, (k % 2) * cell + (cell - width) // 2
        alpha = view[..., 3:] / 255
        place = ground[top : top + height, left : left + width]
        place[:] = np.rint(alpha * view[..., :3] + (1 - alpha) * place)
    return ground


def textured(
    target: MeshShape,
    map: AnyMap | None = None,
    source: Shape | None = None,
    texture: Texture | None = None,
) -> tuple[Textured, Texture]:
    """Return a mesh with the places of its corners in a texture, and the texture.

    Args:
        target: the mesh.
        map: from the source's plane to the target's; without one, the plane of the flattening has the texture.
        source: the map's source.
        texture: placed in the source's plane; a checkerboard if None.
    """
    piece = target.flattening.patch
    z = target.flattening.flat if map is None else ExtendedInverse(map)(target.flattening.flat)
    if texture is None:
        box = target.box if map is None or source is None else source.box
        texture = Texture(checkerboard(1024), square(box))
        source = None
    place = (source if source is not None else target_plane(target)).placing(texture)
    still = np.zeros(z.size, complex)
    return (piece.points, piece.faces, place.places(z, still, still).xy[piece.faces]), texture


def target_plane(target: MeshShape) -> Shape:
    """Return the target's plane as a plain shape."""
    return Shape(target.spec, target.path, target.curve, target.box, False, {}, {})
