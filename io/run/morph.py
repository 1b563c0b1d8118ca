"""`iccm morph`: intermediate frames between two drawings, as pictures, drawings and animations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from PIL import Image

from ... import progress
from ...arrays import Box, Complex, Index, Real
from ...curve import Curve
from ...drawings.drawing import Drawing
from ...errors import InputError
from ...fits import FITS, is_of_drawings, leaves_out_parts
from ...maps.approximation import triangulated
from ...maps.triangulated.map import TriangulatedMap
from ...pixels.canvas import Canvas
from ...pixels.coverage import painted_share
from ...plane import bounding_box
from ...progress import Listener
from .. import files, formats, references
from ..artwork.areas import Area
from ..shapes.shape import Shape
from ..spec import Spec
from ..svg.document import SUFFIXES
from . import flat_colours, framing, requirements
from .between import SOURCE, TARGET, MorphPath
from .flat_colours import paint
from .inputs import Inputs
from .job import Job
from .maps import Settings, note_maps, solve_pairs
from .outputs import effects, notes_on_shapes
from .outputs.artwork import Artwork, on_canvas, painted_rings
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
T = TypeVar("T")
ANIMATED = {".webp": "WEBP", ".gif": "GIF", ".png": "PNG"}


def _has_pixels(run: Run, outputs: Sequence[Output | None]) -> bool:
    return not all(isinstance(output, Artwork) for output in outputs)


REQUIREMENTS = (
    *effects.OF_CONSTRAINTS,
    requirements.Requirement(
        ("texture", "texture_box", "filter", "size"),
        _has_pixels,
        "all outputs are drawings; write pictures or an animation of them, such as -o FILE.webp",
    ),
)


@dataclass(frozen=True)
class MorphSettings:
    """The options of a morph besides those of the job.

    Attributes:
        frames: number of frames, including the source and the target.
        target_texture: the target's picture, to which the texture fades.
        fps: frames per second of animations.
        back_and_forth: whether animations also run back to the source.
    """

    frames: int = 24
    target_texture: str | None = None
    fps: float = 12.0
    back_and_forth: bool = False

    def refuse_animation(self) -> None:
        """Refuse options of animations, if each frame is a file.

        Raises:
            InputError: one was given.
        """
        for option in ("fps", "back_and_forth"):
            if getattr(self, option) != getattr(MorphSettings, option):
                raise InputError(
                    f"--{option.replace('_', '-')}: has no effect, because each frame is a file; write an animation, "
                    "such as -o FILE.webp"
                )

    def ordered(self, frames: Sequence[T], *, is_closed: bool = False) -> list[T]:
        """Return frames in the order in which an animation shows them in a loop.

        Args:
            frames: what is shown, one value for each frame.
            is_closed: whether the way back ends with the first frame, because players interpolate between frames.
        """
        if not self.back_and_forth:
            return list(frames)
        return [*frames, *frames[-2:0:-1], *(frames[:1] if is_closed else ())]


@dataclass(frozen=True)
class MorphFrame:
    """An intermediate frame.

    Attributes:
        share: position on the path, from 0 to 1.
        ahead: the source with its picture, moved forward; None at the end, and if there are layers.
        back: the target with its picture, moved back; None at the beginning, if it would show the same, and if there
            are layers.
        artwork: the source's drawing moved forward, for outputs that are drawings.
        painted: what the frame paints; empty if both drawings paint all that they enclose, so that nothing appears or
            vanishes.
        moved: what the source and what the target paint, moved to the frame, if their pictures are mixed and show
            nothing else.
        layers: areas of flat colours that it paints, if both drawings are made of them.
        is_target: whether the source's drawing, once it is moved to the end, looks like the target.
    """

    share: float
    ahead: Run | None
    back: Run | None
    artwork: Run
    painted: Sequence[Drawing] = ()
    moved: tuple[Sequence[Drawing], ...] = ()
    layers: Sequence[Area] = ()
    is_target: bool = True

    @property
    def is_plain(self) -> bool:
        """Whether nothing appears or vanishes."""
        return not self.painted

    def pixels(self) -> np.ndarray:
        """Return the frame (height, width, 4): 8 bits, sRGB, straight alpha.

        Where only one of both drawings paints, it alone gives the colour, as if the other one was not there.
        """
        if self.layers:
            return np.round(paint(self.layers, self.artwork.canvas)).astype(np.uint8)
        layers = [layer for layer in (self.ahead, self.back) if layer is not None]
        weights = [1.0] if len(layers) == 1 else [1 - self.share, self.share]
        blended: Real = np.sum([weight * _seen(layer) for weight, layer in zip(weights, layers)], axis=0)
        if self.moved:
            shares = [_painted_share(drawings, layers[0].canvas) for drawings in self.moved]
            both: Real = np.sum([weight * share for weight, share in zip(weights, shares)], axis=0)
            blended = np.divide(blended, both, out=np.zeros_like(blended), where=both > 0)
            blended /= np.maximum(
                blended[..., 3:], 1
            )  # the edges of pictures are not quite those of the drawings
            blended *= _painted_share(self.painted, layers[0].canvas)
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
    if twice := [name for name in outputs if job.output.count(name) > 1]:
        raise InputError(f"{twice[0]}: is used for two outputs; give each a separate name")
    if leaves_out_parts(job.fit):
        able = ", ".join(name for name, mode in FITS.items() if not mode.leaves_out_parts)
        raise InputError(
            f"--fit {job.fit}: hides parts of a shape, but a morph shows all of it; use one of {able}"
        )
    if all(NUMBER in name for name in outputs):
        settings.refuse_animation()
    names = {name: _names(name, settings.frames) for name in outputs}
    written = [frame_name for group in names.values() for frame_name in group]
    phases = Phases()
    with one_thread(), references.outside(job.allow_outside), progress.heard(listener):
        with phases.timed("read"):
            # gaps of both drawings fade during the morph, so they are not filled with paper; a morph is between shapes,
            # whose edges become each other's, so the detail within them does not count
            job = job.model_copy(
                update={"output": tuple(written), "background": "transparent", "detail": 0.0}
            )
            textures = [settings.target_texture] if settings.target_texture else []
            files.check_outputs(written, [*job.inputs, *textures], force=job.force)
            job, inputs, notes = pin_same_vertices(job, Inputs(job))
            job = _with_holes(job, inputs)
            run = _with_own_pictures(Run.read(job, inputs, threads, tell, phases, notes))
            requirements.refuse(job, REQUIREMENTS, run, list(outputs.values()))
            _check(run, list(outputs.values()), settings.frames)
        run = _mapped(run)
        with phases.timed("morph"):
            frames = list(_frames(run, settings))
        with ExitStack() as stack, phases.timed("resample"):
            for name, output in outputs.items():
                paths = [
                    stack.enter_context(files.writing(frame_name, force=job.force))
                    for frame_name in names[name]
                ]
                if NUMBER in name:
                    _write_frames(run, output, frames, names[name], paths)
                else:
                    _write_animation(run, name, output, frames, settings, paths[0])
    status = next((fit.status for fit in run.fits if not fit.status.ok), run.fit.status)
    return status.ok, status.value, written


def _mapped(run: Run) -> Run:
    """Solve for the maps of a run, and return it; another run of all parts as one, if maps hide something."""
    solve_pairs(run, lambda pair: _settings(run, pair))
    if run.job.parts == "auto" and any(fit.coverage.is_partial for fit in run.fits):
        # what a map hides cannot become something else
        with run.phases.timed("read"):
            job = run.job.model_copy(update={"parts": "joined"})
            joined = _with_own_pictures(Run.read(job, run.inputs, run.threads, run.tell, run.phases, []))
        solve_pairs(joined, lambda pair: _settings(joined, pair))
        run = joined
    note_maps(run)
    return run


def _write_frames(
    run: Run,
    output: Output | None,
    frames: Sequence[MorphFrame],
    names: Sequence[str],
    paths: Sequence[Path],
) -> None:
    """Write a file for each frame.

    Args:
        run: the map.
        output: the writer of the frames.
        frames: what they show.
        names: of the files, for notes.
        paths: where they are written.
    """
    if not isinstance(output, Artwork):
        for frame, path in zip(frames, paths):
            Image.fromarray(frame.pixels()).save(path)
        return
    _write_drawings(run, output, frames, paths)
    if _differs_at_the_end(run, frames):
        _write_target(run, frames[-1].artwork, paths[-1])
        run.note(
            f"{names[-1]}: is the target's own drawing, and paths of the frames have different commands, since areas "
            "appear, vanish or change their form"
        )


def _write_animation(
    run: Run,
    name: str,
    output: Output | None,
    frames: Sequence[MorphFrame],
    settings: MorphSettings,
    path: Path,
) -> None:
    """Write all frames to one file."""
    suffix = formats.suffix_of(name)
    if not isinstance(output, Artwork):
        _animate(frames, settings, path, suffix)
    elif suffix == LOTTIE:
        run.note(*_animate_lottie(output, frames, settings, path))
    elif frames[0].layers:
        _animate_areas(name, frames, settings, path)
    else:
        run.note(*_animate_drawing(run, output, frames, settings, path))


def _with_holes(job: Job, inputs: Inputs) -> Job:
    """Keep the holes of two shapes that have the same number, also if they are drawn with lines, such as rings.

    Otherwise the areas that lines enclose would count as filled, and the holes of a ring would be squeezed shut.
    """
    if job.holes != "auto" or job.parts not in ("auto", "largest") or is_of_drawings(job.fit):
        return job
    keeping = job.model_copy(update={"holes": "keep"})
    with suppress(InputError):
        pairs = Run.read(keeping, inputs, 1, lambda note: None, Phases(), []).pairs
        counts = {tuple(len(shape.mappable_holes) for shape in pair) for pair in pairs}
        if len(pairs) == 1 and all(first == second > 0 for first, second in counts):
            return keeping
    return job


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
                f"not an animation; use {' '.join(ANIMATED)} .svg .css.svg {LOTTIE}, or {NUMBER} in the name to "
                "write one file per frame"
            )
            fades = f"--target-texture only works with pictures; use {' '.join(ANIMATED)}"
            raise InputError(f"{name}: {fades if NUMBER in name or suffix in ('.svg', LOTTIE) else need}")
        return None
    output = Artwork(name) if suffix == ".svg" else Picture(name)
    output.suit(job, False)
    return output


def _with_own_pictures(run: Run) -> Run:
    """Use both shapes as their own pictures, also two plain outlines, if both can be rendered."""
    job = run.job
    if job.texture or job.checkered:
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
    run.note(*notes_on_shapes(run))


def _frames(run: Run, settings: MorphSettings) -> Iterator[MorphFrame]:
    """Yield the frames, the first with the source on the target's canvas, all in the same box."""
    source_box = framing.picture_box(run.job, run.source)
    target_box = framing.picture_box(run.job, run.target)
    factor, shift = _onto_canvas(source_box, target_box)
    shares = np.linspace(0, 1, settings.frames).tolist()
    filled = run.job.holes == "fill"
    paths = [
        MorphPath.of(pair, fit, shares, (factor, shift), filled=filled)
        for pair, fit in zip(run.pairs, run.fits)
    ]
    corners = [np.array([factor * w + shift for w in source_box] + list(target_box))]
    corners += [map.image for path in paths for map in path.maps]
    box = bounding_box(np.concatenate(corners))
    source = replace(run, job=run.job.model_copy(update={"target_box": "viewbox"}))
    target = _of_target(source, settings, paths, box)
    plain = all(path.is_plain for path in paths)
    textures_cover_all = target is None or settings.target_texture
    flat, is_target = _flat_layers(run, settings, paths)
    everything: list[Drawing | None] = [None] * len(paths)
    for number, share in enumerate(shares):
        layer = partial(_layer, paths, number, box)
        if flat is not None:
            artwork = layer(source, SOURCE, everything)
            yield MorphFrame(share, None, None, artwork, layers=flat(number))
            continue
        limits: Sequence[Drawing | None] = everything
        if not plain:
            painted = [path.painted(number) for path in paths]
            moved = tuple([path.moved(number, side) for path in paths] for side in (SOURCE, TARGET))
            limits = painted if textures_cover_all else everything
        ahead = layer(source, SOURCE, limits) if share < 1 or target is None else None
        back = layer(target, TARGET, limits) if share > 0 and target is not None else None
        if plain:
            artwork = layer(source, SOURCE, everything)
            yield MorphFrame(share, ahead, back, artwork, is_target=is_target)
            continue
        shows_both = ahead is not None and back is not None
        mixed = moved if shows_both and not textures_cover_all else ()
        yield MorphFrame(share, ahead, back, layer(source, SOURCE, moved[TARGET]), painted, mixed)


def _onto_canvas(source_box: Box, target_box: Box) -> tuple[float, complex]:
    """Return the factor and shift that move the source's box to the middle of the target's, as large as fits."""
    source_size, target_size = _size(source_box), _size(target_box)
    factor = min(target_size.real / source_size.real, target_size.imag / source_size.imag)
    return factor, sum(target_box) / 2 - factor * sum(source_box) / 2


def _layer(
    paths: Sequence[MorphPath],
    number: int,
    box: Box,
    base: Run,
    picture: int,
    limits: Sequence[Drawing | None],
) -> Run:
    """Return a run that shows one of the pictures in a frame, within a drawing for each path; None: everything."""
    layers = [path.layer(number, box, picture=picture, painted=limit) for path, limit in zip(paths, limits)]
    return base.with_maps([pair for pair, _ in layers], [fit for _, fit in layers])


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
    pairs, fits = zip(*(path.layer(-1, box, picture=TARGET, painted=path.drawings[TARGET]) for path in paths))
    return replace(source, job=job, pairs=list(pairs), fits=list(fits))


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


def _painted_share(drawings: Sequence[Drawing], canvas: Canvas) -> Real:
    """Return the share of each pixel (height, width, 1) that drawings paint."""
    return painted_share([ring for drawing in drawings for ring in drawing.rings], canvas)[..., None].astype(
        float
    )


def _animate_drawing(
    run: Run, output: Artwork, frames: Sequence[MorphFrame], settings: MorphSettings, path: Path
) -> tuple[str, ...]:
    """Write an animated SVG of all frames, and return notes.

    Where parts or holes vanish, the target's own drawing appears at the end, over the mapped one.
    """
    from ..artwork import animation

    with files.scratch() as folder:
        single = [folder / f"{number}.svg" for number in range(len(frames))]
        output.write_frames(
            [(frame.artwork, file, 1 - frame.share) for frame, file in zip(frames, single)], alike=True
        )
        ending = folder / "ending.svg" if _differs_at_the_end(run, frames) else None
        if ending is not None:
            _write_target(run, frames[-1].artwork, ending)
        return animation.write(
            settings.ordered(single, is_closed=True),
            path,
            settings.fps,
            ending=ending,
            ends_halfway=settings.back_and_forth,
            by_css=output.name.endswith(animation.CSS_SUFFIX),
        )


def _animate_areas(name: str, frames: Sequence[MorphFrame], settings: MorphSettings, path: Path) -> None:
    """Write an animated SVG of frames of flat colours, each with the areas that it paints."""
    from ..artwork import animation, areas

    with files.scratch() as folder:
        single = [folder / f"{number}.svg" for number in range(len(frames))]
        for frame, file in zip(frames, single):
            areas.write(frame.layers, on_canvas(frame.artwork), file)
        moving = _move(frames)
        animation.write(
            settings.ordered(single, is_closed=moving),
            path,
            settings.fps,
            by_css=name.endswith(animation.CSS_SUFFIX),
            stepped=not moving,
        )


def _flat_layers(
    run: Run, settings: MorphSettings, paths: Sequence[MorphPath]
) -> tuple[Callable[[int], list[Area]] | None, bool]:
    """Return how drawings of flat colours look in between, and whether the moved source ends as the target.

    Returns:
        A function that gives the layers of each frame; None if a drawing is not made of areas of flat colours, or if
        both are filled outlines of the same colour, whose curves the map moves onto each other. And whether the mapped
        source looks like the target.
    """
    job = run.job
    if settings.target_texture or not all(is_own_picture(job, shape) for shape in (run.source, run.target)):
        return None, True
    first, second = (
        flat_colours.areas_of(shape, [path.drawings[side] for path in paths], filled=job.holes == "fill")
        for side, shape in ((SOURCE, run.source), (TARGET, run.target))
    )
    if first is None or second is None:
        return None, False
    both = list(zip(first, second))
    if all(path.is_plain and path.is_one_area(*flat) for path, flat in zip(paths, both)):
        colours = {flat[0].colour for sides in both for flat in sides}
        curves = job.holes != "fill" and not flat_colours.has_lines(run.source.path)
        if len(colours) == 1 and curves:
            return None, True
        return lambda number: [
            Area(flat_colours.mixed(source, target, path.shares[number]), path.outlines(number))
            for path, ((source,), (target,)) in zip(paths, both)
        ], True
    partners = [path.partners(*flat) for path, flat in zip(paths, both)]
    return lambda number: [
        layer for path, pairs in zip(paths, partners) for layer in path.layers(number, pairs)
    ], True


def _move(frames: Sequence[MorphFrame]) -> bool:
    """Return whether the layers of frames have the same numbers of vertices, so that players can move them."""
    return len({tuple(ring.size for layer in frame.layers for ring in layer.rings) for frame in frames}) == 1


def _write_drawings(run: Run, output: Artwork, frames: Sequence[MorphFrame], paths: Sequence[Path]) -> None:
    """Write a drawing for each frame."""
    from ..artwork import areas

    if not frames[0].layers:
        output.write_frames([(frame.artwork, path, 1 - frame.share) for frame, path in zip(frames, paths)])
        return
    first = [(frames[0].artwork, paths[0], 1.0)]
    moving = _move(frames)
    if not moving:
        output.write_frames(first)
    for frame, path in list(zip(frames, paths))[not moving :]:
        areas.write(frame.layers, on_canvas(frame.artwork), path)


def _differs_at_the_end(run: Run, frames: Sequence[MorphFrame]) -> bool:
    """Return whether the source mapped onto the target is not the target, since parts vanish or colours differ."""
    is_drawing = formats.suffix_of(run.target.path) in SUFFIXES
    if frames[-1].layers:
        return is_drawing and not _move(frames)
    return is_drawing and not (frames[-1].is_plain and frames[-1].is_target)


def _write_target(run: Run, frame: Run, path: Path) -> None:
    """Write the target's drawing on the canvas of the frames."""
    from ..artwork import carry_parts

    canvas = on_canvas(frame)
    low, high = canvas.box
    if Spec.of(run.target.spec).selection:  # a part of a drawing, without what lies beside it
        maps = [triangulated(fit.map) for fit in frame.fits]
        parts = [
            (target, _identity(map.image, map.faces, map.loops)) for (_, target), map in zip(run.pairs, maps)
        ]
    else:
        corners = np.array([low, complex(high.real, low.imag), high, complex(low.real, high.imag)])
        sheet = replace(run.target, curve=Curve(corners), holes=(), drawing=None, ink=None)
        faces = np.array([[0, 1, 2], [0, 2, 3]])
        parts = [(sheet, _identity(corners, faces, (np.arange(4),)))]
    carry_parts(parts, canvas, path, tolerance=run.job.max_line_error)


def _identity(vertices: Complex, faces: Index, loops: tuple[Index, ...]) -> TriangulatedMap:
    """Return the identity on a triangulation."""
    return TriangulatedMap(vertices, vertices, faces, loops)


def _animate_lottie(
    output: Artwork, frames: Sequence[MorphFrame], settings: MorphSettings, path: Path
) -> tuple[str, ...]:
    """Write a Lottie animation of all frames, and return notes."""
    from ..artwork import lottie

    if frames[0].layers:
        lottie.write_areas(
            [frame.layers for frame in settings.ordered(frames)],
            on_canvas(frames[0].artwork).box,
            path,
            settings.fps,
            stepped=not _move(frames),
        )
        return ()
    with files.scratch() as folder:
        single = [folder / f"{number}.svg" for number in range(len(frames))]
        output.write_frames([(frame.artwork, file, 1.0) for frame, file in zip(frames, single)])
        painted = [painted_rings(frame.artwork.fits) for frame in frames]
        return lottie.write(
            settings.ordered(single),
            path,
            settings.fps,
            settings.ordered(painted) if all(painted) else (),
            settings.ordered([frame.share for frame in frames]),
        )


def _animate(frames: Sequence[MorphFrame], settings: MorphSettings, path: Path, suffix: str) -> None:
    """Write one file that shows all frames in a loop."""
    pictures = settings.ordered([Image.fromarray(frame.pixels()) for frame in frames])
    format_options = {"lossless": True} if suffix == ".webp" else {"disposal": 2 if suffix == ".gif" else 1}
    pictures[0].save(
        path,
        ANIMATED[suffix],
        save_all=True,
        append_images=pictures[1:],
        duration=round(1000 / settings.fps),
        loop=0,
        **format_options,
    )
