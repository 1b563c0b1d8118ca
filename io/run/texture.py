"""Where a texture comes from, and where it lies in the source's plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ...arrays import Box
from ...errors import InputError
from . import framing
from .job import Job

if TYPE_CHECKING:
    from ...memory import Memory
    from ..pictures.image_files import Image
    from ..pictures.tiles import TiledImage
    from ..shapes.shape import Shape


def on_mesh(job: Job, source: Shape) -> bool:
    """Whether the texture lies on a mesh that is the source, and not in the plane of its coordinates."""
    return source.is_mesh and not source.is_layout and textured(job, source)


def textured(job: Job, source: Shape) -> bool:
    """Whether there is a texture, other than the checkerboard."""
    return bool(job.texture or source.pictures)


def tiles_of(job: Job, sources: Sequence[Shape], room: Memory) -> TiledImage | None:
    """The pictures of the tiles (UDIM) that sources lie on, where the texture's name stands for all of them.

    Raises:
        InputError: the source is no mesh, or they cannot be read.
    """
    from ..pictures import tiles

    name = job.texture or next(iter(sources[0].pictures), None)
    if name is None or isinstance(name, bytes) or not tiles.is_pattern(name):
        return None
    if not sources[0].has_uv:
        raise InputError(f"{name}: tiles are for a mesh with texture coordinates as source")
    from ..shapes.mesh_shape import as_mesh

    wanted = set().union(*(as_mesh(source).tiles for source in sources))
    return tiles.read(name, wanted, **_limits(job, room))


def box_of(job: Job, source: Shape, tiles: Box | None = None) -> Box:
    """What of the source's plane the texture covers, given what of its layout; the checkerboard is a square."""
    if tiles is not None:
        low, high = (complex(corner.real * source.aspect, corner.imag) for corner in tiles)
        return low, high
    return framing.covered(job, source) if textured(job, source) else framing.chequered(job, source)


def image_of(job: Job, source: Shape, room: Memory) -> Image:
    """The picture to carry along: --texture, the mesh's own, or a checkerboard.

    Raises:
        InputError: it cannot be read, or has more pixels than --max-pixels.
    """
    from ..pictures import image_files

    limits = _limits(job, room)
    if job.texture:
        return image_files.read(job.texture, **limits)
    if source.pictures:
        from ..shapes import mesh_texture

        return mesh_texture.read(source, **limits)
    from ...pixels.checkerboard import checkerboard

    return image_files.Image(checkerboard(1024))


def _limits(job: Job, room: Memory) -> dict[str, Any]:
    return {"max_pixels": job.max_pixels, "colorspace": job.colorspace, "room": room}
