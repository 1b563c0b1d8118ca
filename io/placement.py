"""Where a texture comes from and lies in the source's plane, and the raster that it is carried to."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .job import Job

if TYPE_CHECKING:
    from ..resample import Canvas
    from .images import Image
    from .run import Run
    from .shapes import Shape

Box = tuple[complex, complex]
PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".webp", ".hdr", ".bmp")
LONGER_SIDE = 1024


def on_mesh(run: Run) -> bool:
    """Whether the texture lies on a mesh that is the source."""
    return _textured(run.job, run.source)


def _textured(job: Job, source: Any) -> bool:
    if getattr(source, "file", None) is None:
        return False
    from . import transfer

    return bool(job.texture or source.file.picture is not None or transfer.texture_file(source) is not None)


def texture(run: Run) -> tuple[Image, Box]:
    """The texture and its place in the source's plane."""
    box = run.source.box if run.job.texture_box == "viewbox" else run.source.curve.box
    return run.image, box if run.job.texture or on_mesh(run) else square(box)


def image_of(job: Job, source: Shape) -> Image:
    """The picture to carry along: --texture, the mesh's own, or a checkerboard.

    Raises:
        InputError: it cannot be read, or has more pixels than --max-pixels.
    """
    from . import images

    if job.texture:
        return images.read(job.texture, max_pixels=job.max_pixels, colorspace=job.colorspace)
    if _textured(job, source):
        from . import transfer

        return transfer.own_texture(source)  # type: ignore[arg-type]
    from ..checkerboard import checkerboard

    return images.Image(checkerboard(1024))


def foreseen(job: Job, source: Shape, target: Shape) -> Image | None:
    """The texture, read before the solving; what is wrong with it or with --size is told without a wait.

    Raises:
        InputError: see `image_of`; or more pixels than --max-pixels are asked for.
    """
    pictured = [name for name in job.output if name == "-" or Path(name).suffix.lower() in PICTURES]
    if pictured and not job.bake:
        low, high = target.box
        size_of(job, job.size or (LONGER_SIDE,), high - low)
    return image_of(job, source) if pictured or job.texture else None


def square(box: Box) -> Box:
    """The smallest square about the middle of a box that holds it."""
    middle, size = (box[0] + box[1]) / 2, box[1] - box[0]
    half = max(size.real, size.imag) / 2 * (1 + 1j)
    return middle - half, middle + half


def raster(run: Run) -> Canvas:
    """The target's raster: its canvas, grown about its middle to the proportions of --size.

    Raises:
        InputError: more pixels than --max-pixels.
    """
    from ..resample import Canvas

    low, high = _extent(run)
    width, height = size_of(run.job, run.job.size or (LONGER_SIDE,), high - low)
    scale = max((high - low).real / width, (high - low).imag / height)
    middle, half = (low + high) / 2, scale * complex(width, height) / 2
    return Canvas(width, height, (middle - half, middle + half))


def _extent(run: Run) -> Box:
    """The target's canvas; a deformed shape may leave that of the source, which grows."""
    low, high = run.target.box
    if run.job.target is not None:
        return low, high
    image = run.fit.image
    return (
        complex(min(low.real, image.real.min()), min(low.imag, image.imag.min())),
        complex(max(high.real, image.real.max()), max(high.imag, image.imag.max())),
    )


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
