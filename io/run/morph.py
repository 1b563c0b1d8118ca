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
from ...fits import FITS, is_of_drawings, is_partial
from ...plane import bounding_box
from ...progress import Listener
from .. import files, formats, references
from ..shapes.shape import Shape
from ..spec import Spec
from . import framing
from .between import SOURCE, TARGET, MorphPath
from .execute import Settings, solve_pairs
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
            seen = _seen(layer)
        else:
            seen = (1 - self.share) * _seen(self.ahead) + self.share * _seen(self.back)
        alpha = seen[..., 3:]
        colours = np.divide(seen[..., :3], alpha, out=np.zeros_like(seen[..., :3]), where=alpha > 0)
        return np.round(255 * np.concatenate([colours, alpha], axis=2)).astype(np.uint8)


def run(
    job: Job,
    asked: MorphSettings,
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

    outputs = {name: _output(name, job, asked) for name in job.output}
    names = {name: _names(name, asked.frames) for name in outputs}
    written = [each for group in names.values() for each in group]
    if twice := [name for name in names if job.output.count(name) > 1]:
        raise InputError(f"{twice[0]}: is used for two outputs; give each a separate name")
    if is_partial(job.fit):
        able = ", ".join(name for name, mode in FITS.items() if not mode.is_partial)
        raise InputError(
            f"--fit {job.fit}: hides parts of a shape, but a morph shows all of it; use one of {able}"
        )
    phases = Phases()
    with one_thread(), references.outside(job.allow_outside), progress.heard(listener):
        with phases.timed("read"):
            # gaps of both drawings fade during the morph, so they are not filled with paper
            job = job.model_copy(update={"output": tuple(written), "gaps": "transparent"})
            textures = [asked.target_texture] if asked.target_texture else []
            files.check_outputs(written, [*job.inputs, *textures], force=job.force)
            job, inputs, notes = pin_same_vertices(job, Inputs(job))
            begun = _with_own_pictures(Run.read(job, inputs, threads, tell, phases, notes))
            _check(begun, list(outputs.values()), asked.frames)
        solve_pairs(begun, lambda pair: _settings(begun, pair))
        with phases.timed("morph"):
            frames = list(_frames(begun, asked))
        with ExitStack() as stack:
            for name, output in outputs.items():
                paths = [stack.enter_context(files.writing(each, force=job.force)) for each in names[name]]
                with phases.timed("resample"):
                    if isinstance(output, Artwork) and NUMBER not in name:
                        animate = _animate_lottie if formats.suffix_of(name) == LOTTIE else _animate_drawing
                        begun.note(*animate(output, frames, asked.fps, paths[0]))
                    elif NUMBER not in name:
                        _animate(frames, asked.fps, paths[0], formats.suffix_of(name))
                    elif isinstance(output, Artwork):
                        output.write_frames(
                            [(frame.artwork, path, 1 - frame.share) for frame, path in zip(frames, paths)]
                        )
                    else:
                        for frame, path in zip(frames, paths):
                            Image.fromarray(frame.pixels()).save(path)
    status = next((fit.status for fit in begun.fits if not fit.status.ok), begun.fit.status)
    return status.ok, status.value, written


def _names(name: str, frames: int) -> list[str]:
    if NUMBER not in name:
        return [name]
    return [name.replace(NUMBER, f"{k:0{len(str(frames))}d}") for k in range(1, frames + 1)]


def _output(name: str, job: Job, asked: MorphSettings) -> Output | None:
    """Return the writer of single frames; None for animations.

    Raises:
        InputError: the suffix does not fit.
    """
    suffix = formats.suffix_of(name)
    if NUMBER not in name or asked.target_texture:
        if suffix in (".svg", LOTTIE) and NUMBER not in name and not asked.target_texture:
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


def _with_own_pictures(begun: Run) -> Run:
    """Use both drawings as their own pictures if one of them has its own colours and the other can be rendered.

    A plain black drawing is then shown in black, not with a checkerboard.
    """
    job = begun.job
    if job.texture or job.checkered or not (begun.source.coloured or begun.target.coloured):
        return begun
    if all(_can_be_rendered(shape) for shape in (begun.source, begun.target)):
        begun.pairs = [
            (replace(source, coloured=True), replace(target, coloured=True)) for source, target in begun.pairs
        ]
    return begun


def _can_be_rendered(shape: Shape) -> bool:
    """Return whether the file of a shape is a picture, or can be rendered to one."""
    suffix = formats.suffix_of(shape.path)
    return suffix in (".svg", ".svgz") or formats.of(shape.path).picture is not None


def _settings(begun: Run, pair: Pair) -> Settings:
    """Return options for the map of a pair.

    Holes are mapped onto holes if both shapes have the same number; otherwise they open and close during the morph.
    Frames are chosen by cost.

    Raises:
        InputError: holes are to be kept, but their numbers differ.
    """
    job, (source, target) = begun.job, pair
    many = len(source.mappable_holes), len(target.mappable_holes)
    if job.holes == "keep" and many[0] != many[1]:
        text = f"{source.spec}, {target.spec}: {many[0]} holes cannot be mapped onto {many[1]}"
        raise InputError(f"{text}; use --holes auto to let holes open and close during the morph")
    if job.holed and many[0] == many[1] > 0 and not is_of_drawings(job.fit):
        return {"fit": "whole", "holes": "keep"}, True
    is_chosen = job.fit is not None and not FITS[job.fit].compares
    return {"fit": job.fit if is_chosen else "frame"}, False


def _check(begun: Run, outputs: Sequence[Output | None], frames: int) -> None:
    """Check, before solving, that everything can be morphed and written; note what is left out.

    Raises:
        InputError: a shape is a mesh, an animation would have too many pixels, or an output is not possible.
    """
    for shape in (begun.source, begun.target):
        if shape.is_mesh or shape.is_layout:
            raise InputError(
                f"{shape.spec}: is a mesh, but a morph needs planar shapes; use a drawing or a picture"
            )
    for output in filter(None, outputs):
        output.check(begun)
    begun.image.covered()
    size = framing.canvas_size(begun.job, framing.picture_box(begun.job, begun.target))
    if None in outputs and frames * size[0] * size[1] > begun.job.max_pixels:
        text = f"{frames} pictures of about {size[0]}x{size[1]} exceed the limit of {begun.job.max_pixels} pixels"
        raise InputError(f"--frames: {text}; choose a smaller --size, or raise --max-pixels")
    begun.note(*(f"{shape.spec}: {note}" for pair in begun.pairs for shape in pair for note in shape.notes))


def _frames(begun: Run, asked: MorphSettings) -> Iterator[Frame]:
    """Yield the frames, the first with the source on the target's canvas, all in the same box."""
    here, there = (framing.picture_box(begun.job, shape) for shape in (begun.source, begun.target))
    factor = min((_size(there).real / _size(here).real), (_size(there).imag / _size(here).imag))
    shift = sum(there) / 2 - factor * sum(here) / 2
    shares = np.linspace(0, 1, asked.frames).tolist()
    filled = begun.job.holes == "fill"
    ways = [
        MorphPath.of(pair, fit, shares, (factor, shift), filled=filled)
        for pair, fit in zip(begun.pairs, begun.fits)
    ]
    corners = [np.array([factor * w + shift for w in here] + list(there))]
    corners += [map.image for way in ways for map in way.maps]
    box = bounding_box(np.concatenate(corners))
    job = begun.job.model_copy(update={"target_box": "viewbox"})
    source = replace(begun, job=job)
    target = _of_target(source, asked, ways, box)
    plain = all(way.is_plain for way in ways)
    for number, share in enumerate(shares):

        def layer(of: Run, picture: int, painted: int, *, cut: bool = not plain, number: int = number) -> Run:
            side = painted if cut else None
            found = [way.layer(number, box, picture=picture, painted=side) for way in ways]
            return of.with_maps([pair for pair, _ in found], [fit for _, fit in found])

        artwork = layer(source, SOURCE, TARGET)
        ahead = back = None
        if share < 1:
            ahead = layer(source, SOURCE, SOURCE, cut=not plain and not _paints_nothing_else(source))
        if share > 0 and target is not None:
            back = layer(target, TARGET, TARGET, cut=not plain and not _paints_nothing_else(target))
        elif share == 1 or (share > 0 and not plain):
            back = artwork
        yield Frame(share, ahead, back, artwork)


def _of_target(source: Run, asked: MorphSettings, ways: Sequence[MorphPath], box: Box) -> Run | None:
    """Return the target's texture, which fades in, as a job; None if the source's texture is kept.

    It is --target-texture, or the target's own picture if the source shows its own.
    """
    job = source.job
    if asked.target_texture:
        job = job.model_copy(update={"texture": asked.target_texture})
    elif not (is_own_picture(job, source.source) and source.target.coloured):
        return None
    job = job.model_copy(update={"source": job.target})
    pairs, fits = zip(*(way.layer(-1, box, picture=TARGET, painted=TARGET) for way in ways))
    return replace(source, job=job, pairs=list(pairs), fits=list(fits))


def _paints_nothing_else(run: Run) -> bool:
    """Return whether the texture is the whole drawing itself, whose alpha limits what is painted."""
    return is_own_picture(run.job, run.source) and len(run.pairs) == 1 and not Spec.of(run.source.spec).chosen


def _size(box: Box) -> complex:
    return box[1] - box[0]


def _seen(run: Run) -> Real:
    """Return the picture (height, width, 4) in sRGB from 0 to 1, with premultiplied alpha."""
    shown = displayed(run, run.canvas) / 255.0
    colours, alpha = (
        (shown[..., :-1], shown[..., -1:])
        if shown.shape[2] in (2, 4)
        else (shown, np.ones_like(shown[..., :1]))
    )
    return np.concatenate([np.broadcast_to(colours, (*colours.shape[:2], 3)) * alpha, alpha], axis=2)


def _animate_drawing(output: Artwork, frames: Sequence[Frame], fps: float, path: Path) -> tuple[str, ...]:
    """Write an animated SVG of all frames, and return notes."""
    from ..artwork import animation

    with files.scratch() as folder:
        single = [folder / f"{number}.svg" for number in range(len(frames))]
        output.write_frames(
            [(frame.artwork, each, 1 - frame.share) for frame, each in zip(frames, single)], alike=True
        )
        return animation.write(single, path, fps)


def _animate_lottie(output: Artwork, frames: Sequence[Frame], fps: float, path: Path) -> tuple[str, ...]:
    """Write a Lottie animation of all frames, and return notes."""
    from ..artwork import lottie
    from .outputs.artwork import painted_rings

    with files.scratch() as folder:
        single = [folder / f"{number}.svg" for number in range(len(frames))]
        output.write_frames([(frame.artwork, each, 1.0) for frame, each in zip(frames, single)])
        painted = [painted_rings(frame.artwork.fits) for frame in frames]
        return lottie.write(single, path, fps, painted if all(painted) else ())


def _animate(frames: list[Frame], fps: float, path: Path, suffix: str) -> None:
    """Write one file that shows all frames in a loop."""
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
