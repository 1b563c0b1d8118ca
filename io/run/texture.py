"""Where a texture comes from, and where it lies in the source's plane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...arrays import Box
from . import framing
from .job import Job

if TYPE_CHECKING:
    from ...memory import Memory
    from ..pictures.image_files import Image
    from ..shapes.shape import Shape


def on_mesh(job: Job, source: Shape) -> bool:
    """Whether the texture lies on a mesh that is the source, and not in the plane of its coordinates."""
    return source.is_mesh and not source.is_layout and textured(job, source)


def textured(job: Job, source: Shape) -> bool:
    """Whether there is a texture, other than the checkerboard."""
    return bool(job.texture or source.pictures)


def box_of(job: Job, source: Shape) -> Box:
    """What of the source's plane the texture covers; the checkerboard is a square."""
    return framing.covered(job, source) if textured(job, source) else framing.chequered(job, source)


def image_of(job: Job, source: Shape, room: Memory) -> Image:
    """The picture to carry along: --texture, the mesh's own, or a checkerboard.

    Raises:
        InputError: it cannot be read, or has more pixels than --max-pixels.
    """
    from ..pictures import image_files

    limits: dict[str, Any] = {"max_pixels": job.max_pixels, "colorspace": job.colorspace, "room": room}
    if job.texture:
        return image_files.read(job.texture, **limits)
    if source.pictures:
        from ..shapes import mesh_texture

        return mesh_texture.read(source, **limits)
    from ...pixels.checkerboard import checkerboard

    return image_files.Image(checkerboard(1024))
