"""`iccm morph`: intermediate frames between two drawings, as pictures, drawings and animations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from ... import progress
from ...arrays import Box, Real
from ...errors import InputError
from ...fits import FITS, is_of_drawings, leaves_out_parts
from ...plane import bounding_box
from ...progress import Listener
from .. import files, formats, references
from ..shapes.shape import Shape
from ..spec import Spec
from . import framing
from .between import SOURCE, TARGET, MorphPath
from .execute import Settings, note_maps, solve_pairs
from .inputs import Inputs
from .job import Job
from .outputs.artwork import Artwork
from .outputs.output import Output
from .outputs.picture import Picture, displayed
from .parts import Pair
from .phases import Phases
from .resolve import pin_same_vertices
from .state import Run, Tell
from .texture import is_own_picture

NUMBER = "{number}"
LOTTIE = ".json"
"""Suffix of Lottie animations."""
ANIMATED = {".webp": "WEBP", ".gif": "GIF", ".png": "PNG"}


@dataclass(frozen=True)
class MorphSettings:
    """The options of a morph besides those of the job.

    Attributes:
        frames: number of frames, including the source and the target.
        target_texture: the target's picture, to which the texture fades.
        fps: frames per second of animations.
    """

    frames: int = 24
    target_texture: str | None = None
    fps: float = 12.0


@dataclass(frozen=True)
class Frame:
    """An intermediate frame.

    Attributes:
        share: position on the path, from 0 to 1.
        ahead: the source with its picture, moved forward; None at the end.
        back: the target with its picture, moved back; None at the beginning, and if it would show the same.
        artwork: the source's drawing moved forward, for outputs that are drawings.
    """

    share: float
    ahead: Run | None
    back: Run | None
    artwork: Run

    def pixels(self) -> np.ndarray:
        """Return the frame (height, width, 4): 8 bits, sRGB, straight alpha."""
        if self.ahead is None or self.back is None:
            layer = self.ahead or self.back
            assert layer is not None
            blended = _seen(layer)
        else:
            blended = (1 - self.share) * _seen(self.ahead) + self.share * _seen(self.back)
        alpha = blended[..., 3:]
        colours = np.divide(blended[..., :3], alpha, out=np.zeros_like(blended[..., :3]), where=alpha > 0)
        return np.round(255 * np.concatenate([colours, alpha], axis=2)).astype(np.uint8)


def run(
    job: Job,
    settings: MorphSettings,
    *,
    threads: int | None = None,
    tell: Tell = lambda note: None,
    listener: Listener | None = None,
) -> tuple[bool, str, list[str]]:
    """Write all frames; return whether the map meets the requirements, a sentence about it, and the files.

    Raises:
        InputError: an input or output is invalid. In this case nothing has been written.
    """
    from ...blas import one_thread

    outputs = {name: _output(name, job, settings) for name in job.output}
    names = {name: _names(name, settings.frames) for name in outputs}
    written = [frame_name for group in names.values() for frame_name in group]
    if twice := [name for name in names if job.output.count(name) > 1]:
        raise InputError(f"{twice[0]}: is used for two outputs; give each a separate name")
    if leaves_out_parts(job.fit):
        able = ", ".join(name for name, mode in FITS.items() if not mode.leaves_out_parts)
        raise InputError(
            f"--fit {job.fit}: hides parts of a shape, but a morph shows all of it; use one of {able}"
        )
    phases = Phases()
    with one_thread(), references.outside(job.allow_outside), progress.heard(listener):
        with phases.timed("read"):
            # gaps of both drawings fade during the morph, so they are not filled with paper
            job = job.model_copy(update={"output": tuple(written), "gaps": "transparent"})
            textures = [settings.target_texture] if settings.target_texture else []
            files.check_outputs(written, [*job.inputs, *textures], force=job.force)
            job, inputs, notes = pin_same_vertices(job, Inputs(job))
            run = _with_own_pictures(Run.read(job, inputs, threads, tell, phases, notes))
            _check(run, list(outputs.values()), settings.frames)
        solve_pairs(run, lambda pair: _settings(run, pair))
        note_maps(run)
        with phases.timed("morph"):
            frames = list(_frames(run, settings))
        with ExitStack() as stack:
            for name, output in outputs.items():
                paths = [
                    stack.enter_context(files.writing(frame_name, force=job.force))
                    for frame_name in names[name]
                ]
                with phases.timed("resample"):
                    if isinstance(output, Artwork) and NUMBER not in name:
                        animate = _animate_lottie if formats.suffix_of(name) == LOTTIE else _animate_drawing
                        run.note(*animate(output, frames, settings.fps, paths[0]))
                    elif NUMBER not in name:
                        _animate(frames, settings.fps, paths[0], formats.suffix_of(name))
                    elif isinstance(output, Artwork):
                        output.write_frames(
                            [(frame.artwork, path, 1 - frame.share) for frame, path in zip(frames, paths)]
                        )
                    else:
                        for frame, path in zip(frames, paths):
                            Image.fromarray(frame.pixels()).save(path)
    status = next((fit.status for fit in run.fits if not fit.status.ok), run.fit.status)
    return status.ok, status.value, written


def _names(name: str, frames: int) -> list[str]:
    if NUMBER not in name:
        return [name]
    return [name.replace(NUMBER, f"{k:0{len(str(frames))}d}") for k in range(1, frames + 1)]


def _output(name: str, job: Job, settings: MorphSettings) -> Output | None:
    """Return the writer of single frames; None for animations.

    Raises:
        InputError: the suffix does not fit.
    """
    suffix = formats.suffix_of(name)
    if NUMBER not in name or settings.target_texture:
        if suffix in (".svg", LOTTIE) and NUMBER not in name and not settings.target_texture:
            Artwork(str(Path(name).with_suffix(".svg"))).suit(job, False)
            return Artwork(name)
        if suffix not in ANIMATED:
            need = (
                f"not an animation; use {' '.join(ANIMATED)} .svg {LOTTIE}, or {NUMBER} in the name to write one "
                "file per frame"
            )
            fades = f"--target-texture only works with pictures; use {' '.join(ANIMATED)}"
            raise InputError(f"{name}: {fades if NUMBER in name or suffix in ('.svg', LOTTIE) else need}")
        return None
    output = Artwork(name) if suffix == ".svg" else Picture(name)
    output.suit(job, False)
    return output


def _with_own_pictures(run: Run) -> Run:
    """Use both drawings as their own pictures if one of them has its own colours and the other can be rendered.

    A plain black drawing is then shown in black, not with a checkerboard.
    """
    job = run.job
    if job.texture or job.checkered or not (run.source.coloured or run.target.coloured):
        return run
    if all(_can_be_rendered(shape) for shape in (run.source, run.target)):
        run.pairs = [
            (replace(source, coloured=True), replace(target, coloured=True)) for source, target in run.pairs
        ]
    return run


def _can_be_rendered(shape: Shape) -> bool:
    """Return whether the file of a shape is a picture, or can be rendered to one."""
    suffix = formats.suffix_of(shape.path)
    return suffix in (".svg", ".svgz") or formats.of(shape.path).picture is not None


def _settings(run: Run, pair: Pair) -> Settings:
    """Return options for the map of a pair.

    Holes are mapped onto holes if both shapes have the same number; otherwise they open and close during the morph.
    Frames are chosen by cost.

    Raises:
        InputError: holes are to be kept, but their numbers differ.
    """
    job, (source, target) = run.job, pair
    many = len(source.mappable_holes), len(target.mappable_holes)
    if job.holes == "keep" and many[0] != many[1]:
        text = f"{source.spec}, {target.spec}: {many[0]} holes cannot be mapped onto {many[1]}"
        raise InputError(f"{text}; use --holes auto to let holes open and close during the morph")
    if job.holed and many[0] == many[1] > 0 and not is_of_drawings(job.fit):
        return {"fit": "whole", "holes": "keep"}, True
    is_chosen = job.fit is not None and not FITS[job.fit].compares
    return {"fit": job.fit if is_chosen else "frame"}, False


def _check(run: Run, outputs: Sequence[Output | None], frames: int) -> None:
    """Check, before solving, that everything can be morphed and written; note what is left out.

    Raises:
        InputError: a shape is a mesh, an animation would have too many pixels, or an output is not possible.
    """
    for shape in (run.source, run.target):
        if shape.is_mesh or shape.is_layout:
            raise InputError(
                f"{shape.spec}: is a mesh, but a morph needs planar shapes; use a drawing or a picture"
            )
    for output in filter(None, outputs):
        output.check(run)
    run.image.covered()
    size = framing.canvas_size(run.job, framing.picture_box(run.job, run.target))
    if None in outputs and frames * size[0] * size[1] > run.job.max_pixels:
        text = (
            f"{frames} pictures of about {size[0]}x{size[1]} exceed the limit of {run.job.max_pixels} pixels"
        )
        raise InputError(f"--frames: {text}; choose a smaller --size, or raise --max-pixels")
    run.note(*(f"{shape.spec}: {note}" for pair in run.pairs for shape in pair for note in shape.notes))


def _frames(run: Run, settings: MorphSettings) -> Iterator[Frame]:
    """Yield the frames, the first with the source on the target's canvas, all in the same box."""
    source_box = framing.picture_box(run.job, run.source)
    target_box = framing.picture_box(run.job, run.target)
    factor = min(
        (_size(target_box).real / _size(source_box).real), (_size(target_box).imag / _size(source_box).imag)
    )
    shift = sum(target_box) / 2 - factor * sum(source_box) / 2
    shares = np.linspace(0, 1, settings.frames).tolist()
    filled = run.job.holes == "fill"
    paths = [
        MorphPath.of(pair, fit, shares, (factor, shift), filled=filled)
        for pair, fit in zip(run.pairs, run.fits)
    ]
    corners = [np.array([factor * w + shift for w in source_box] + list(target_box))]
    corners += [map.image for path in paths for map in path.maps]
    box = bounding_box(np.concatenate(corners))
    job = run.job.model_copy(update={"target_box": "viewbox"})
    source = replace(run, job=job)
    target = _of_target(source, settings, paths, box)
    plain = all(path.is_plain for path in paths)
    for number, share in enumerate(shares):

        def layer(
            base: Run, picture: int, painted: int, *, cut: bool = not plain, number: int = number
        ) -> Run:
            side = painted if cut else None
            layers = [path.layer(number, box, picture=picture, painted=side) for path in paths]
            return base.with_maps([pair for pair, _ in layers], [fit for _, fit in layers])

        artwork = layer(source, SOURCE, TARGET)
        ahead = back = None
        if share < 1:
            ahead = layer(source, SOURCE, SOURCE, cut=not plain and not _paints_nothing_else(source))
        if share > 0 and target is not None:
            back = layer(target, TARGET, TARGET, cut=not plain and not _paints_nothing_else(target))
        elif share == 1 or (share > 0 and not plain):
            back = artwork
        yield Frame(share, ahead, back, artwork)


def _of_target(source: Run, settings: MorphSettings, paths: Sequence[MorphPath], box: Box) -> Run | None:
    """Return the target's texture, which fades in, as a job; None if the source's texture is kept.

    It is --target-texture, or the target's own picture if the source shows its own.
    """
    job = source.job
    if settings.target_texture:
        job = job.model_copy(update={"texture": settings.target_texture})
    elif not (is_own_picture(job, source.source) and source.target.coloured):
        return None
    job = job.model_copy(update={"source": job.target})
    pairs, fits = zip(*(path.layer(-1, box, picture=TARGET, painted=TARGET) for path in paths))
    return replace(source, job=job, pairs=list(pairs), fits=list(fits))


def _paints_nothing_else(run: Run) -> bool:
    """Return whether the texture is the whole drawing itself, whose alpha limits what is painted."""
    return (
        is_own_picture(run.job, run.source) and len(run.pairs) == 1 and not Spec.of(run.source.spec).selection
    )


def _size(box: Box) -> complex:
    return box[1] - box[0]


def _seen(run: Run) -> Real:
    """Return the picture (height, width, 4) in sRGB from 0 to 1, with premultiplied alpha."""
    pixels = displayed(run, run.canvas) / 255.0
    colours, alpha = (
        (pixels[..., :-1], pixels[..., -1:])
        if pixels.shape[2] in (2, 4)
        else (pixels, np.ones_like(pixels[..., :1]))
    )
    return np.concatenate([np.broadcast_to(colours, (*colours.shape[:2], 3)) * alpha, alpha], axis=2)


def _animate_drawing(output: Artwork, frames: Sequence[Frame], fps: float, path: Path) -> tuple[str, ...]:
    """Write an animated SVG of all frames, and return notes."""
    from ..artwork import animation

    with files.scratch() as folder:
        single = [folder / f"{number}.svg" for number in range(len(frames))]
        output.write_frames(
            [(frame.artwork, file, 1 - frame.share) for frame, file in zip(frames, single)], alike=True
        )
        return animation.write(single, path, fps)


def _animate_lottie(output: Artwork, frames: Sequence[Frame], fps: float, path: Path) -> tuple[str, ...]:
    """Write a Lottie animation of all frames, and return notes."""
    from ..artwork import lottie
    from .outputs.artwork import painted_rings

    with files.scratch() as folder:
        single = [folder / f"{number}.svg" for number in range(len(frames))]
        output.write_frames([(frame.artwork, file, 1.0) for frame, file in zip(frames, single)])
        painted = [painted_rings(frame.artwork.fits) for frame in frames]
        return lottie.write(single, path, fps, painted if all(painted) else ())


def _animate(frames: list[Frame], fps: float, path: Path, suffix: str) -> None:
    """Write one file that shows all frames in a loop."""
    pictures = [Image.fromarray(frame.pixels()) for frame in frames]
    format_options = {"lossless": True} if suffix == ".webp" else {"disposal": 2 if suffix == ".gif" else 1}
    pictures[0].save(
        path,
        ANIMATED[suffix],
        save_all=True,
        append_images=pictures[1:],
        duration=round(1000 / fps),
        loop=0,
        **format_options,
    )
