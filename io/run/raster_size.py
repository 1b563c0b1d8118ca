"""How large a raster is, and whether shapes lie in their canvas."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...errors import InputError
from .job import Job

if TYPE_CHECKING:
    from ..shapes.shape import Shape

LONGER_SIDE = 1024
OFF = 0.01  # of a shape's size: what reaches out of its canvas farther than that is told


def off_canvas(job: Job, source: Shape, target: Shape, textured: bool) -> list[str]:
    """Notes on shapes that reach out of their canvas: nothing of the target is seen there, no texture covers the
    source."""
    said = []
    if job.target and (out := _reach(target)) > OFF:
        said.append(f"{target.spec}: {out:.0%} of its extent lies outside its canvas, where pictures end")
    if textured and job.texture_box == "viewbox" and (out := _reach(source)) > OFF:
        cure = "use --texture-box bbox to cover it"
        said.append(
            f"{source.spec}: {out:.0%} of its extent lies outside its canvas, where the texture ends; {cure}"
        )
    return said


def _reach(shape: Shape) -> float:
    """How far a shape reaches out of its canvas, relative to its size in that direction; at most 1."""
    (low, high), (here, there) = shape.box, shape.curve.box
    over = (low.real - here.real, there.real - high.real), (low.imag - here.imag, there.imag - high.imag)
    size = there - here
    return min(1.0, max(max(over[0]) / size.real, max(over[1]) / size.imag))


def canvas_size(job: Job, target: Shape) -> tuple[int, int]:
    """Width and height of the target's raster, as far as they are known before the map.

    Raises:
        InputError: more pixels than --max-pixels.
    """
    low, high = target.box
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
