"""Where a texture comes from and lies in the source's plane, and how large a raster is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...arrays import Box
from ...errors import InputError
from .. import formats
from . import framing
from .job import Job

if TYPE_CHECKING:
    from ...memory import Room
    from ..pictures.image_files import Image
    from ..shapes.shape import Shape

LONGER_SIDE = 1024


def on_mesh(job: Job, source: Any) -> bool:
    """Whether the texture lies on a mesh that is the source."""
    if getattr(source, "file", None) is None:
        return False
    from ..shapes import mesh_shape

    return bool(job.texture or mesh_shape.texture_in(source) is not None)


def texture_box(job: Job, source: Shape) -> Box:
    """What of the source's plane the texture covers; the checkerboard is a square."""
    textured = job.texture or on_mesh(job, source)
    return framing.covered(job, source) if textured else framing.chequered(job, source)


def image_of(job: Job, source: Shape, room: Room) -> Image:
    """The picture to carry along: --texture, the mesh's own, or a checkerboard.

    Raises:
        InputError: it cannot be read, or has more pixels than --max-pixels.
    """
    from ..pictures import image_files

    limits: dict[str, Any] = {"max_pixels": job.max_pixels, "colorspace": job.colorspace, "room": room}
    if job.texture:
        return image_files.read(job.texture, **limits)
    if on_mesh(job, source):
        from ..shapes import mesh_shape

        return mesh_shape.own_texture(source, **limits)  # type: ignore[arg-type]
    from ...pixels.checkerboard import checkerboard

    return image_files.Image(checkerboard(1024))


def pictured(job: Job) -> bool:
    """Whether the job writes a picture of the texture on the target's canvas."""
    return bool(pictures(job)) and not job.bake


def pictures(job: Job) -> list[str]:
    """The outputs that are pictures."""
    return [name for name in job.output if name == "-" or formats.of(name).picture]


def size_of(job: Job, size: tuple[int, ...], extent: complex) -> tuple[int, int]:
    """Width and height from --size: both, or the longer side of something with the extent's proportions.

    Raises:
        InputError: more pixels than --max-pixels.
    """
    if len(size) == 1:
        scale = size[0] / max(extent.real, extent.imag)
        size = max(1, round(extent.real * scale)), max(1, round(extent.imag * scale))
    width, height = size
    if width * height > job.max_pixels:
        raise InputError(f"--size: {width}x{height} is more than {job.max_pixels} pixels; raise --max-pixels")
    return width, height
