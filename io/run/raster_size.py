"""How large a raster is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...errors import InputError
from ...pixels.canvas import LONGER_SIDE, proportional
from . import framing
from .job import Job

if TYPE_CHECKING:
    from ..shapes.shape import Shape


def canvas_size(job: Job, target: Shape) -> tuple[int, int]:
    """Width and height of the target's raster, as far as they are known before the map.

    Raises:
        InputError: more pixels than --max-pixels.
    """
    low, high = framing.picture_box(job, target)
    return size_within(job.size or (LONGER_SIDE,), high - low, job.max_pixels)


def size_within(size: tuple[int, ...], extent: complex, most: int) -> tuple[int, int]:
    """Width and height from --size: both, or the longer side of something with the extent's proportions.

    Raises:
        InputError: more pixels than `most`.
    """
    width, height = size if len(size) == 2 else proportional(size[0], extent)
    if width * height > most:
        raise InputError(f"--size: {width}x{height} is more than {most} pixels; raise --max-pixels")
    return width, height
