"""How large a raster is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...errors import InputError
from . import framing
from .job import Job

if TYPE_CHECKING:
    from ..shapes.shape import Shape

LONGER_SIDE = 1024


def canvas_size(job: Job, target: Shape) -> tuple[int, int]:
    """Width and height of the target's raster, as far as they are known before the map.

    Raises:
        InputError: more pixels than --max-pixels.
    """
    low, high = framing.shown(job, target)
    return size_of(job, job.size or (LONGER_SIDE,), high - low)


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
