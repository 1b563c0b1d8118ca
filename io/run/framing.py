"""Framing: which part of the target's plane pictures show, at which size, and which part of the source's plane the
texture covers.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Box
from ...errors import InputError
from ...pixels.canvas import LONGER_SIDE_PIXELS, proportional
from ..options import FREE_SIDE
from .job import Job

if TYPE_CHECKING:
    from ..shapes.shape import Shape

# relative to the canvas: pictures of a shape that takes up no more show its bounding box instead
SMALL_CANVAS_SHARE = 0.25
UNLIKE_LOG_RATIO = 0.05  # logarithm of the ratio of proportions: larger stretch is reported
SQUARES_PER_SIDE = 8  # squares along a side of the checkerboard
# squares that should at least lie on a shape's bounding box; with fewer, squares are smaller
FEWEST_SQUARES = 10
OFF_CANVAS_SHARE = 0.01  # relative to a shape's size: parts that reach out of the canvas farther are reported


def picture_box(job: Job, target: Shape) -> Box:
    """Return the box of the target's plane that pictures show, as set by --target-box.

    By default this is the canvas; if the shape takes up little of it, like a country on a world map, or lies beside it,
    it is the shape's bounding box. For a chart it is always the whole layout, because a part would be of no use.
    """
    return target.bounds if job.target_box == "bbox" or _why_not_canvas(job, target) else target.box


def _why_not_canvas(job: Job, target: Shape) -> str:
    """Return why pictures do not show the canvas by default; empty if they do, or if an option sets the box."""
    if job.target_box or target.is_layout or target.view is not None:
        return ""
    if _reach(target, target.box) >= 1:
        return "lies outside its canvas"
    share = _share(target)
    return f"takes up {share:.0%} of the sides of its canvas" if share <= SMALL_CANVAS_SHARE else ""


def texture_box(job: Job, source: Shape, proportions: float | None = None) -> Box:
    """Return the box of the source that a texture covers: set by --texture-box, by default the canvas, scaled and
    moved.

    A repeated texture has the width of that box, and keeps its proportions (width by height) if they are known.
    """
    low, high = source.bounds if job.texture_box == "bbox" else source.box
    if repeats(job) and proportions:
        half = complex(0, (high - low).real / proportions / 2)
        middle = (low + high).imag / 2
        low, high = low.real + middle * 1j - half, high.real + middle * 1j + half
    return placed(job, source, (low, high))


def placed(job: Job, source: Shape, box: Box) -> Box:
    """Return a box scaled by --texture-scale about its middle, and moved by --texture-offset."""
    across, down = (*(job.texture_scale or (1.0,)), *(job.texture_scale or (1.0,)))[:2]
    x, y = job.texture_offset or (0.0, 0.0)
    middle, half = (box[0] + box[1]) / 2, (box[1] - box[0]) / 2
    middle, half = (
        middle + complex(x, -y if source.flip else y),
        complex(half.real * across, half.imag * down),
    )
    return middle - half, middle + half


def repeats(job: Job) -> bool:
    """Return whether the texture is repeated beyond its edges."""
    return job.edge in ("repeat", "mirror")


def texture_rotation(job: Job) -> complex:
    """Return the rotation of the texture about the centre of its box, as a unit complex number."""
    return complex(np.exp(1j * np.radians(job.texture_turn))) if job.texture_turn else 1


def placing_options(job: Job) -> list[str]:
    """Return the options that place the texture on the source and were given."""
    placing = {"scale": job.texture_scale, "offset": job.texture_offset, "turn": job.texture_turn}
    return [f"--texture-{name}" for name, value in placing.items() if value]


def stretch_notes(job: Job, source: Shape, shape: tuple[int, ...]) -> list[str]:
    """Return a note if a texture of (height, width, …) pixels has other proportions than the canvas that it covers."""
    if not job.texture or source.is_mesh or job.texture_box == "bbox" or repeats(job) or job.texture_scale:
        return []
    height, width = shape[:2]
    size = source.box[1] - source.box[0]
    if abs(math.log(width / height * size.imag / size.real)) <= UNLIKE_LOG_RATIO:
        return []
    text = f"{width}x{height} pixels are stretched to the canvas of {size.real:g}x{size.imag:g}"
    return [f"{job.texture}: {text}; crop the picture to these proportions to avoid this"]


def checkerboard_box(job: Job, source: Shape) -> Box:
    """Return the box that the checkerboard covers: a square about the shape, or about its canvas if that is
    requested.
    """
    return placed(job, source, square(source.box if job.texture_box == "viewbox" else source.bounds))


def checkerboard_cells(source: Shape) -> int:
    """Return the number of squares along a side of the checkerboard.

    It is doubled for long, thin shapes, which would otherwise be narrower than a square, and cut through all numbers.
    """
    size = source.bounds[1] - source.bounds[0]
    squares = SQUARES_PER_SIDE**2 * min(size.real, size.imag) / max(size.real, size.imag)
    return SQUARES_PER_SIDE if squares >= FEWEST_SQUARES else 2 * SQUARES_PER_SIDE


def remarks(job: Job, source: Shape, target: Shape) -> list[str]:
    """Return notes on the part of the target that is shown, and on shapes that reach out of it or out of the
    texture.
    """
    notes = []
    if why := _why_not_canvas(job, target):
        text = "pictures show the shape's bounding box; use --target-box viewbox to show the canvas"
        notes.append(f"{target.spec}: {why}, so {text}")
    if job.target and (out := _reach(target, picture_box(job, target))) > OFF_CANVAS_SHARE:
        text = f"{out:.0%} of its extent lies outside its canvas and is not shown"
        cure = (
            "use names with <UDIM> to write a picture for each tile"
            if target.is_layout
            else "use --target-box bbox to show all of it"
        )
        notes.append(f"{target.spec}: {text}; {cure}")
    is_placed = repeats(job) or placing_options(job)
    if job.texture_box == "bbox" or is_placed or not (job.texture or job.texture_box):
        return notes
    cure = "use --texture-box bbox to cover it"
    if source.is_layout:  # outside of the canvas the texture repeats or continues
        return notes
    if (out := _reach(source, source.box)) > OFF_CANVAS_SHARE:
        text = f"{out:.0%} of its extent lies outside its canvas, beyond the texture"
        notes.append(f"{source.spec}: {text}; {cure}")
    elif job.texture and not job.texture_box and (share := _share(source)) <= SMALL_CANVAS_SHARE:
        text = f"takes up {share:.0%} of the sides of its canvas, and shows only that part of the texture"
        notes.append(f"{source.spec}: {text}; {cure} with the whole texture")
    return notes


def square(box: Box) -> Box:
    """Return the smallest square about the centre of a box that contains it."""
    middle, size = (box[0] + box[1]) / 2, box[1] - box[0]
    half = max(size.real, size.imag) / 2 * (1 + 1j)
    return middle - half, middle + half


def canvas_size(job: Job, box: Box) -> tuple[int, int]:
    """Return width and height in pixels of a picture of a box of the target's plane.

    Raises:
        InputError: more pixels than --max-pixels.
    """
    return size_within(job.size or (LONGER_SIDE_PIXELS,), box[1] - box[0], job.max_pixels)


def size_within(size: tuple[int, ...], extent: complex, most: int) -> tuple[int, int]:
    """Return width and height from --size: both, one of them, or the longer side; the other follows from the extent.

    Raises:
        InputError: there are more pixels than `most`.
    """
    width, height = size if len(size) == 2 else proportional(size[0], extent)
    if width == FREE_SIDE:
        width = max(1, round(height * extent.real / extent.imag))
    elif height == FREE_SIDE:
        height = max(1, round(width * extent.imag / extent.real))
    if width * height > most:
        raise InputError(f"--size: {width}x{height} exceeds the limit of {most} pixels; raise --max-pixels")
    return width, height


def _share(shape: Shape) -> float:
    """Return width or height of a shape relative to its canvas, whichever is larger."""
    size, canvas = (high - low for low, high in (shape.bounds, shape.box))
    return max(size.real / canvas.real, size.imag / canvas.imag)


def _reach(shape: Shape, box: Box) -> float:
    """Return how far a shape reaches out of a box, relative to its size in that direction; at most 1."""
    (low, high), (lower, upper) = box, shape.bounds
    over = (low.real - lower.real, upper.real - high.real), (low.imag - lower.imag, upper.imag - high.imag)
    size = upper - lower
    return min(1.0, max(max(over[0]) / size.real, max(over[1]) / size.imag))
