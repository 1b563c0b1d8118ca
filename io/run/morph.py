"""Frames of a shape on its way to another, as pictures, drawings and animations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from ... import progress
from ...arrays import Box, Real
from ...curve import Curve
from ...errors import InputError
from ...flattening.interpolation import morph
from ...maps.triangulated.map import TriangulatedMap
from ...plane import bounding_box
from ...progress import Listener
from .. import files, formats, references
from . import framing
from .execute import solve_pairs
from .inputs import Inputs
from .job import Job
from .outputs.artwork import Artwork
from .outputs.output import Output
from .outputs.picture import Picture, displayed
from .phases import Phases
from .state import Run, Tell

NUMBER = "{number}"
ANIMATED = {".webp": "WEBP", ".gif": "GIF", ".png": "PNG"}


@dataclass(frozen=True)
class Way:
    """What is asked of a morph beside the job.

    Attributes:
        frames: how many, the source and the target among them.
        target_texture: what the target shows; the texture fades to it.
        fps: frames a second of animations.
    """

    frames: int = 24
    target_texture: str | None = None
    fps: float = 12.0


@dataclass(frozen=True)
class Frame:
    """A shape on the way.

    Attributes:
        share: of the way.
        run: with the map from the source.
        back: with that from the target, where the texture fades to another.
    """

    share: float
    run: Run
    back: Run | None

    def pixels(self) -> np.ndarray:
        """(height, width, 4) what is seen, 8 bits in sRGB, alpha straight."""
        seen = _seen(self.run)
        if self.back is not None:
            seen = (1 - self.share) * seen + self.share * _seen(self.back)
        alpha = seen[..., 3:]
        colours = np.divide(seen[..., :3], alpha, out=np.zeros_like(seen[..., :3]), where=alpha > 0)
        return np.round(255 * np.concatenate([colours, alpha], axis=2)).astype(np.uint8)


def run(
    job: Job,
    way: Way,
    *,
    threads: int | None = None,
    tell: Tell = lambda note: None,
    listener: Listener | None = None,
) -> tuple[bool, str, list[str]]:
    """Write all frames: whether the map is as good as was asked for, a sentence on it, and the files.

    Raises:
        InputError: an input or output is wrong. Nothing has been written then.
    """
    from ...blas import one_thread

    outputs = {name: _output(name, job, way) for name in job.output}
    names = {name: _names(name, way.frames) for name in outputs}
    written = [each for group in names.values() for each in group]
    if twice := [name for name in names if job.output.count(name) > 1]:
        raise InputError(f"{twice[0]}: is written twice")
    phases = Phases()
    with one_thread(), references.outside(job.allow_outside), progress.heard(listener):
        with phases.timed("read"):
            job = job.model_copy(update={"target_box": job.target_box, "output": tuple(written)})
            textures = [way.target_texture] if way.target_texture else []
            files.check_outputs(written, [*job.inputs, *textures], force=job.force)
            begun = Run.read(job, Inputs(job), threads, tell, phases)
            begun.job = job.model_copy(update={"holes": _holes(begun)})
            _check(begun, list(outputs.values()), way.frames)
        solve_pairs(begun)
        with phases.timed("morph"):
            frames = list(_frames(begun, way))
        with ExitStack() as stack:
            for name, output in outputs.items():
                paths = [stack.enter_context(files.writing(each, force=job.force)) for each in names[name]]
                with phases.timed("resample"):
                    if NUMBER not in name:
                        _animate(frames, way.fps, paths[0], formats.suffix_of(name))
                    for frame, path in zip(frames, paths if NUMBER in name else []):
                        if output is not None:
                            output.write(frame.run, path)
                        else:
                            Image.fromarray(frame.pixels()).save(path)
    status = begun.fit.status
    return status.ok, status.value, written


def _names(name: str, frames: int) -> list[str]:
    if NUMBER not in name:
        return [name]
    return [name.replace(NUMBER, f"{k:0{len(str(frames))}d}") for k in range(1, frames + 1)]


def _output(name: str, job: Job, way: Way) -> Output | None:
    """What writes a frame; None for frames that are faded, and for animations.

    Raises:
        InputError: what the suffix does not hold.
    """
    suffix = formats.suffix_of(name)
    if NUMBER not in name or way.target_texture:
        if suffix not in ANIMATED:
            need = f"is no animation; use {' '.join(ANIMATED)}, or {NUMBER} in the name for a file a frame"
            fades = f"--target-texture fades pictures; use {' '.join(ANIMATED)}"
            raise InputError(f"{name}: {need if NUMBER not in name else fades}")
        return None
    output = Artwork(name) if suffix == ".svg" else Picture(name)
    output.suit(job, False)
    return output


def _holes(begun: Run) -> str:
    """What becomes of holes: by default they are kept where both have as many.

    Raises:
        InputError: they are to be kept, and have no partners.
    """
    asked, (source, target) = begun.job.holes, begun.pairs[0]
    many = len(source.mappable_holes), len(target.mappable_holes)
    if asked in ("cut", "fill") or many[0] == many[1]:
        return "keep" if asked == "auto" else asked
    text = f"{source.spec}, {target.spec}: {many[0]} and {many[1]} holes cannot go onto each other"
    if asked == "keep":
        raise InputError(f"{text}; --holes fill ignores them")
    begun.note(f"{text}: they are filled")
    return "fill"


def _check(begun: Run, outputs: Sequence[Output | None], frames: int) -> None:
    """Refuse before the solving what cannot be morphed or written.

    Raises:
        InputError: a mesh, more pixels than an animation may have; as the outputs say.
    """
    for shape in (begun.source, begun.target):
        if shape.is_mesh or shape.is_layout:
            raise InputError(f"{shape.spec}: a morph is between shapes of the plane, and this is a mesh")
    for output in filter(None, outputs):
        output.check(begun)
    begun.image.covered()
    size = framing.canvas_size(begun.job, framing.picture_box(begun.job, begun.target))
    if None in outputs and frames * size[0] * size[1] > begun.job.max_pixels:
        text = f"{frames} pictures of about {size[0]}x{size[1]} are more than {begun.job.max_pixels} pixels"
        raise InputError(f"--frames: {text}; make --size smaller, or raise --max-pixels")


def _frames(begun: Run, way: Way) -> Iterator[Frame]:
    """The shapes, the source on the target's canvas first, all in one box."""
    fit, (source, target) = begun.fit, begun.pairs[0]
    here, there = (framing.picture_box(begun.job, shape) for shape in (source, target))
    factor = min((_size(there).real / _size(here).real), (_size(there).imag / _size(here).imag))
    shift = sum(there) / 2 - factor * sum(here) / 2
    shares = np.linspace(0, 1, way.frames)
    maps = list(morph(fit, shares.tolist(), placed=(factor, shift)))
    corners = [np.array([factor * w + shift for w in here] + list(there)), *(map.image for map in maps)]
    box = bounding_box(np.concatenate(corners))
    job = begun.job.model_copy(update={"target_box": "viewbox"})
    ahead = replace(begun, job=job)
    back = None
    if way.target_texture:
        job = job.model_copy(update={"source": job.target, "texture": way.target_texture})
        back = replace(begun, job=job, pairs=[(target, target)])
    for share, map in zip(shares.tolist(), maps):
        rings = [map.image[loop] for loop in map.loops]
        curve, holes = Curve(rings[0]), tuple(Curve(ring) for ring in rings[1:])
        shape = replace(target, curve=curve, box=box, holes=tuple(rings[1:]), extent=None)
        found = replace(fit, map=map, target=curve, target_holes=holes)
        returned = None
        if back is not None:
            onward = TriangulatedMap(maps[-1].image, map.image, map.faces, map.loops)
            on = replace(found, map=onward, source=target.curve, source_holes=fit.target_holes)
            returned = back.towards(shape, on)
        yield Frame(share, ahead.towards(shape, found), returned)


def _size(box: Box) -> complex:
    return box[1] - box[0]


def _seen(run: Run) -> Real:
    """(height, width, 4) the picture in sRGB from 0 to 1, times its alpha."""
    shown = displayed(run, run.canvas) / 255.0
    colours, alpha = (
        (shown[..., :-1], shown[..., -1:])
        if shown.shape[2] in (2, 4)
        else (shown, np.ones_like(shown[..., :1]))
    )
    return np.concatenate([np.broadcast_to(colours, (*colours.shape[:2], 3)) * alpha, alpha], axis=2)


def _animate(frames: list[Frame], fps: float, path: Path, suffix: str) -> None:
    """One file that shows all frames again and again."""
    pictures = [Image.fromarray(frame.pixels()) for frame in frames]
    more = {"lossless": True} if suffix == ".webp" else {"disposal": 2 if suffix == ".gif" else 1}
    pictures[0].save(
        path,
        ANIMATED[suffix],
        save_all=True,
        append_images=pictures[1:],
        duration=round(1000 / fps),
        loop=0,
        **more,
    )
