"""What of the target's plane pictures show, and what of the source's plane the texture covers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...arrays import Box
from .job import Job

if TYPE_CHECKING:
    from ..shapes.shape import Shape

SMALL = 0.25  # of the canvas' sides: pictures of a shape that takes no more than that show its box instead
OFF = 0.01  # of a shape's size: what reaches out of its canvas farther than that is told


def shown(job: Job, target: Shape) -> tuple[Box, list[str]]:
    """What pictures show of the target's plane, and what is to be said about that.

    That is what --target-box names. By default it is the canvas, unless the shape takes little of it, as a country of
    a world map does, or lies beside it: then it is the shape's bounding box.
    """
    if job.target_box == "viewbox":
        return target.box, []
    if job.target_box == "bbox":
        return target.bounds, []
    outside, share = _reach(target) >= 1, _share(target)
    if not outside and share > SMALL:
        return target.box, []
    why = "lies outside its canvas" if outside else f"takes {share:.0%} of its canvas' sides"
    said = f"{target.spec}: {why}, so pictures show the shape's box; --target-box viewbox shows the canvas"
    return target.bounds, [said]


def covered(job: Job, source: Shape) -> Box:
    """What of the source a texture covers: what --texture-box names, by default the canvas."""
    return source.bounds if job.texture_box == "bbox" else source.box


def chequered(job: Job, source: Shape) -> Box:
    """What of the source the checkerboard covers: a square about the shape, or about its canvas where that is said."""
    return square(source.box if job.texture_box == "viewbox" else source.bounds)


def off_canvas(job: Job, source: Shape, target: Shape) -> list[str]:
    """Notes on shapes that reach out of what is shown, and of what the texture covers."""
    said = []
    if job.target and (out := _reach(target)) > OFF:
        text = f"{out:.0%} of its extent lies outside its canvas, where pictures end"
        said.append(f"{target.spec}: {text}; --target-box bbox shows all of it")
    if job.texture_box == "bbox" or not (job.texture or job.texture_box):
        return said
    cure = "--texture-box bbox covers it"
    if (out := _reach(source)) > OFF:
        text = f"{out:.0%} of its extent lies outside its canvas, where the texture ends"
        said.append(f"{source.spec}: {text}; {cure}")
    elif job.texture and not job.texture_box and (share := _share(source)) <= SMALL:
        text = f"takes {share:.0%} of its canvas' sides, and shows no more of the texture"
        said.append(f"{source.spec}: {text}; {cure} with all of it")
    return said


def square(box: Box) -> Box:
    """The smallest square about the middle of a box that holds it."""
    middle, size = (box[0] + box[1]) / 2, box[1] - box[0]
    half = max(size.real, size.imag) / 2 * (1 + 1j)
    return middle - half, middle + half


def _share(shape: Shape) -> float:
    """Width or height of a shape by that of its canvas, whichever is the larger part."""
    size, canvas = (high - low for low, high in (shape.bounds, shape.box))
    return max(size.real / canvas.real, size.imag / canvas.imag)


def _reach(shape: Shape) -> float:
    """How far a shape reaches out of its canvas, relative to its size in that direction; at most 1."""
    (low, high), (here, there) = shape.box, shape.bounds
    over = (low.real - here.real, there.real - high.real), (low.imag - here.imag, there.imag - high.imag)
    size = there - here
    return min(1.0, max(max(over[0]) / size.real, max(over[1]) / size.imag))
