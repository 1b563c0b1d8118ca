"""Framing: what pictures show of the target's plane, how large, and what of the source's plane the texture covers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Box
from ...errors import InputError
from ...pixels.canvas import LONGER_SIDE, proportional
from ..options import FREE
from .job import Job

if TYPE_CHECKING:
    from ..shapes.shape import Shape

SMALL = 0.25  # of the canvas' sides: pictures of a shape that takes no more than that show its box instead
UNLIKE = 0.05  # of one side by the other: what is stretched more is reported
CELLS = 8  # squares along a side of the checkerboard
FEWEST_SQUARES = 10  # of it that lie on a shape's bounding box: with fewer, squares are smaller
OFF = 0.01  # of a shape's size: what reaches out of its canvas farther than that is reported


def picture_box(job: Job, target: Shape) -> Box:
    """Return what pictures show of the target's plane: what --target-box names.

    By default that is the canvas, unless the shape takes little of it, as a country of a world map does, or lies beside
    it: then it is the shape's bounding box. A chart's picture is of use on all of its layout only.
    """
    return target.bounds if job.target_box == "bbox" or _why_not_canvas(job, target) else target.box


def _why_not_canvas(job: Job, target: Shape) -> str:
    """Why the default is not the canvas; empty where it is, or where it is said what is to be shown."""
    if job.target_box or target.is_layout:
        return ""
    if _reach(target, target.box) >= 1:
        return "lies outside its canvas"
    share = _share(target)
    return f"takes up {share:.0%} of the sides of its canvas" if share <= SMALL else ""


def texture_box(job: Job, source: Shape, proportions: float | None = None) -> Box:
    """Return what of the source a texture covers: what --texture-box names, by default the canvas, scaled and moved.

    One that repeats is as wide as that, and keeps its proportions, width by height, if they are known.
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
    """Return whether the texture is there again beyond its edges."""
    return job.edge in ("repeat", "mirror")


def texture_turn(job: Job) -> complex:
    """By what the texture is turned about the middle of what it covers."""
    return complex(np.exp(1j * np.radians(job.texture_turn))) if job.texture_turn else 1


def placing_options(job: Job) -> list[str]:
    """Return those given that say where the texture lies on the source."""
    given = {"scale": job.texture_scale, "offset": job.texture_offset, "turn": job.texture_turn}
    return [f"--texture-{name}" for name, value in given.items() if value]


def stretch_notes(job: Job, source: Shape, shape: tuple[int, ...]) -> list[str]:
    """Return a note where a texture of (height, width, …) pixels has other proportions than the canvas that it
    covers.
    """
    if not job.texture or source.is_mesh or job.texture_box == "bbox" or repeats(job) or job.texture_scale:
        return []
    height, width = shape[:2]
    size = source.box[1] - source.box[0]
    if abs(math.log(width / height * size.imag / size.real)) <= UNLIKE:
        return []
    text = f"{width}x{height} pixels are stretched to the canvas of {size.real:g}x{size.imag:g}"
    return [f"{job.texture}: {text}; crop the picture to these proportions to avoid this"]


def checkerboard_box(job: Job, source: Shape) -> Box:
    """Return what of the source the checkerboard covers: a square about the shape, or about its canvas where that is
    said.
    """
    return placed(job, source, square(source.box if job.texture_box == "viewbox" else source.bounds))


def checkerboard_cells(source: Shape) -> int:
    """Return how many squares the checkerboard has along a side: twice as many for a long, thin shape, which would be
    narrower than a square and cut all numbers."""
    size = source.bounds[1] - source.bounds[0]
    squares = CELLS**2 * min(size.real, size.imag) / max(size.real, size.imag)
    return CELLS if squares >= FEWEST_SQUARES else 2 * CELLS


def remarks(job: Job, source: Shape, target: Shape) -> list[str]:
    """Return notes on what is shown of the target, and on shapes that reach out of that, or out of the texture."""
    said = []
    if why := _why_not_canvas(job, target):
        text = "pictures show the shape's bounding box; use --target-box viewbox to show the canvas"
        said.append(f"{target.spec}: {why}, so {text}")
    if job.target and (out := _reach(target, picture_box(job, target))) > OFF:
        text = f"{out:.0%} of its extent lies outside its canvas and is not shown"
        cure = (
            "use names with <UDIM> to write a picture for each tile"
            if target.is_layout
            else "use --target-box bbox to show all of it"
        )
        said.append(f"{target.spec}: {text}; {cure}")
    own = repeats(job) or placing_options(job)
    if job.texture_box == "bbox" or own or not (job.texture or job.texture_box):
        return said
    cure = "use --texture-box bbox to cover it"
    if source.is_layout:  # where the texture repeats, or continues
        return said
    if (out := _reach(source, source.box)) > OFF:
        text = f"{out:.0%} of its extent lies outside its canvas, beyond the texture"
        said.append(f"{source.spec}: {text}; {cure}")
    elif job.texture and not job.texture_box and (share := _share(source)) <= SMALL:
        text = f"takes up {share:.0%} of the sides of its canvas, and shows only that part of the texture"
        said.append(f"{source.spec}: {text}; {cure} with the whole texture")
    return said


def square(box: Box) -> Box:
    """Return the smallest square about the middle of a box that holds it."""
    middle, size = (box[0] + box[1]) / 2, box[1] - box[0]
    half = max(size.real, size.imag) / 2 * (1 + 1j)
    return middle - half, middle + half


def canvas_size(job: Job, box: Box) -> tuple[int, int]:
    """Width and height of the raster of a box of the target's plane.

    Raises:
        InputError: more pixels than --max-pixels.
    """
    return size_within(job.size or (LONGER_SIDE,), box[1] - box[0], job.max_pixels)


def size_within(size: tuple[int, ...], extent: complex, most: int) -> tuple[int, int]:
    """Width and height from --size: both, one of them, or the longer side, the other by the extent's proportions.

    Raises:
        InputError: more pixels than `most`.
    """
    width, height = size if len(size) == 2 else proportional(size[0], extent)
    if width == FREE:
        width = max(1, round(height * extent.real / extent.imag))
    elif height == FREE:
        height = max(1, round(width * extent.imag / extent.real))
    if width * height > most:
        raise InputError(f"--size: {width}x{height} exceeds the limit of {most} pixels; raise --max-pixels")
    return width, height


def _share(shape: Shape) -> float:
    """Width or height of a shape by that of its canvas, whichever is the larger part."""
    size, canvas = (high - low for low, high in (shape.bounds, shape.box))
    return max(size.real / canvas.real, size.imag / canvas.imag)


def _reach(shape: Shape, box: Box) -> float:
    """Return how far a shape reaches out of a box, relative to its size in that direction; at most 1."""
    (low, high), (lower, upper) = box, shape.bounds
    over = (low.real - lower.real, upper.real - high.real), (low.imag - lower.imag, upper.imag - high.imag)
    size = upper - lower
    return min(1.0, max(max(over[0]) / size.real, max(over[1]) / size.imag))
