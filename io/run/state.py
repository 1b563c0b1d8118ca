"""A job under way: its inputs, the map, and what has been found so far."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Box, Complex
from ...memory import Memory
from ...parallel import beside, thread_count
from ...pixels.texture import Wrapped
from ...plane import bounding_box
from .. import formats
from ..memory import within
from ..shapes.holes import as_drawn
from . import framing, parts, texture
from .constraints import constrain, read_start
from .job import Job
from .parts import Pairs
from .phases import Phases

if TYPE_CHECKING:
    from ...pixels.preimages import AnyMap
    from ...pixels.texture import Placing, Texture
    from ...pixels.warp import Canvas, Sampler
    from ...solve import Fit
    from ..materials.carried_maps import CarriedMaps
    from ..pictures.image_files import Image
    from ..pictures.tiles import TiledImage
    from ..shapes.shape import Shape
    from .inputs import Inputs

Tell = Callable[[str], None]


@dataclass
class Run:
    """A job under way.

    Attributes:
        job: what to do.
        inputs: the files that it reads.
        pairs: its shapes, source and target: one pair, or with --parts several, the largest target first; for a
            deformation source and target are the same.
        room: makes the large arrays, within --memory.
        tell: is given each remark as it is made.
        phases: what each part took, and what is under way.
        threads: for the pixels; None for all cores.
        notes: remarks on the inputs and on the solving.
        figures: what reading and solving add to the solver's report.
        fits: the map of each pair, once it is there.
        constraints: pins and strokes that must meet, and an earlier map to continue from, as `iccm.fit` takes them.
        called: the names of pins and strokes.
        start: an earlier map to continue from.
    """

    job: Job
    inputs: Inputs
    pairs: Pairs
    room: Memory
    tell: Tell
    phases: Phases
    threads: int | None = None
    notes: list[str] = field(default_factory=list)
    figures: dict[str, Any] = field(default_factory=dict)
    constraints: dict[str, Any] = field(default_factory=dict)
    called: tuple[list[str], list[str]] = field(default_factory=lambda: ([], []))
    start: Fit | None = None
    fits: list[Fit] = field(default_factory=list)
    _begun: dict[str, Future] = field(default_factory=dict)
    _other: dict[tuple[str, str], Run] = field(default_factory=dict)

    @classmethod
    def read(
        cls,
        job: Job,
        inputs: Inputs,
        threads: int | None,
        tell: Tell,
        phases: Phases,
        notes: Sequence[str] = (),
    ) -> Run:
        """Return a job whose shapes and constraints are read; `notes` are remarks on what was filled in, see `resolve`.

        Raises:
            InputError: a file is wrong, or constraints are not places of it.
        """
        from ..shapes.silhouette import handed

        handed.clear()  # what an earlier job left
        figures = dict[str, Any]()
        if job.several:
            pairs, notes, figures = parts.read(job, inputs)
        else:
            source = inputs.shape(job.source)
            target = source
            if job.target:
                whole = inputs.whole_target(job.target, source)
                target = whole or inputs.shape(job.target, target=True, source=source)
            pairs = [(source, target)]
        run = cls.of_pairs(job, inputs, pairs, tell, phases, threads, figures)
        run.note(*notes)
        if not job.several:
            run.constraints, run.called = constrain(job, run.source, run.target, inputs.listed)
            if job.target and run.target.rigid and not job.rigid_target:
                text = (
                    "elements named rigid in the target are ignored; mark regions in the source, or "
                    "use --rigid-target"
                )
                run.note(f"{run.target.spec}: {text}")
        if job.start:
            run.start = read_start(job)
        return run

    @classmethod
    def of_pairs(
        cls,
        job: Job,
        inputs: Inputs,
        pairs: Pairs,
        tell: Tell,
        phases: Phases,
        threads: int | None = None,
        figures: dict[str, Any] | None = None,
    ) -> Run:
        """Return a job whose shapes are read, with their holes and lines taken as it says."""
        notes = list[str]()
        taken = Pairs()
        for source, target in pairs:
            from_source = _with_holes_as_asked(source, job, notes)
            taken.append(
                (from_source, from_source if target is source else _with_holes_as_asked(target, job, notes))
            )
        room = within(job.memory, next(iter(job.outputs), None))
        run = cls(job, inputs, taken, room, tell, phases, threads, figures=figures or {})
        if texture.is_own_picture(job, run.source) and run.source.ink is not None:
            run.pairs = [
                (drawn := as_drawn(source), drawn if target is source else target) for source, target in taken
            ]
        run.note(*notes)
        return run

    def with_texture(self, map: tuple[str, str] | None) -> Run:
        """Return the same with another texture, of the kind named; one of these is kept at a time."""
        if map is None or map == (self.job.texture, self.job.kind):
            return self
        if map not in self._other:
            self._other.clear()
            job = self.job.model_copy(update={"texture": map[0], "kind": map[1]})
            self._other[map] = replace(self, job=job, _begun={}, _other={})
        return self._other[map]

    def with_maps(self, pairs: Pairs, fits: list[Fit]) -> Run:
        """Return the same texture on the same plane, carried by other maps."""
        made = replace(self, pairs=pairs, fits=fits, _begun={}, _other={})
        vars(made).update({name: getattr(self, name) for name in ("image", "box", "sampler")})
        return made

    @cached_property
    def carried_maps(self) -> CarriedMaps:
        """The maps of the target's materials, for --carry-maps: read once, for all meshes that are written.

        Raises:
            InputError: the target is not a mesh.
        """
        from ..materials.carried_maps import CarriedMaps
        from ..shapes.mesh_shape import as_mesh

        return CarriedMaps(as_mesh(self.whole(1)).file)

    @property
    def source(self) -> Shape:
        """The source, or the largest part's."""
        return self.pairs[0][0]

    @property
    def target(self) -> Shape:
        """The target, or its largest part."""
        return self.pairs[0][1]

    @property
    def fit(self) -> Fit:
        """The map, or the largest part's."""
        return self.fits[0]

    @cached_property
    def mapping(self) -> AnyMap:
        """The map, or those of all parts as one, without what it takes into holes of the target.

        A chart's texture lies in its layout, which it may be mirrored against; a checkerboard on one chart need not be.
        """
        return (
            self.in_layout
            if texture.has_texture(self.job, self.source) or len(self.pairs) > 1
            else self._compose(False)
        )

    @cached_property
    def in_layout(self) -> AnyMap:
        """The same from where charts of the source lie in their layout."""
        return self._compose(True)

    def _compose(self, in_layout: bool) -> AnyMap:
        from ...pixels.composed import Holed, Reflected

        maps: list[AnyMap] = []
        for (source, target), fit, holes in zip(self.pairs, self.fits, self._holes):
            lines = (
                source.mirror if in_layout else None,
                target.mirror if self.job.target or in_layout else None,
            )
            is_holed = fit.drawings is None and holes
            made: AnyMap = Holed(fit.map, holes) if is_holed else fit.visible_map
            maps.append(Reflected(made, *lines) if lines != (None, None) else made)
        return maps[0] if len(maps) == 1 else parts.compose(self.pairs, self.fits, maps)

    @property
    def _holes(self) -> list[tuple[Complex, ...]]:
        """The holes that pictures leave transparent, of each part, and that its map does not know of; those of a shape
        that is deformed move with it."""
        if self.job.holes == "fill":
            return [()] * len(self.pairs)
        from ..shapes.holes import unmapped

        if self.job.target is None:
            left = unmapped(self.source, self.fit.source_holes)
            return [tuple(self.fit.map(hole) for hole in left)]
        return [unmapped(target, fit.target_holes) for (_, target), fit in zip(self.pairs, self.fits)]

    @property
    def opaque(self) -> bool:
        """Whether what is carried also covers the gaps between the source's parts, as a picture without alpha does."""
        if any(formats.of(name).drawing for name in self.job.output):
            return False
        if not texture.has_texture(self.job, self.source) or texture.on_paper(self.job, self.source):
            return True
        return self.image.alpha < 0

    @property
    def free_gaps(self) -> bool:
        """Whether gaps of the source may be shown at no cost. The checkerboard has no background around the shape, as
        a photo has; and where a drawing has several parts, none of them says where it ends. Paper around a drawing of
        one part costs as much as leaving the target bare: more of the drawing is better where it can be bent to it."""
        if not self.opaque:
            return False
        several = self.source.drawing is not None and not self.source.drawing.is_one_part
        return several or not texture.has_texture(self.job, self.source)

    @cached_property
    def tiled(self) -> TiledImage | None:
        """The pictures of the tiles (UDIM) that the source lies on, where the texture is called so."""
        return texture.tiles_of(self.job, self.shapes(0), self.room)

    @property
    def tiles(self) -> Box | None:
        """What of the source's layout they cover."""
        return self.tiled.box if self.tiled else None

    @cached_property
    def image(self) -> Image:
        """The texture."""
        return (
            self.tiled.image
            if self.tiled
            else texture.image_of(self.job, self.source, self.room, self._own_box)
        )

    @cached_property
    def _own_box(self) -> Box:
        """What is shown of a drawing that is its own texture: kept, since a map may change the outline of the shape."""
        return texture.own_box_of(self.source)

    @cached_property
    def box(self) -> Box:
        """Its place in the source's plane."""
        return texture.box_of(self.job, self.source, self.image, self.tiles, self._own_box)

    @property
    def flat(self) -> Texture:
        """The same as a texture of one texel, by which places in it are s and t."""
        from ...pixels.stmap import flat

        known = texture.has_texture(self.job, self.source)
        shape = self.image.pixels.shape if known and framing.repeats(self.job) else (1, 1)
        proportions = shape[1] / shape[0] if known else None
        box = framing.texture_box(self.job, self.source, proportions)
        return flat(box, framing.texture_turn(self.job))

    @cached_property
    def on_mesh(self) -> bool:
        """Whether it lies on a mesh that is the source."""
        return texture.on_mesh(self.job, self.source)

    @cached_property
    def placing(self) -> Placing | None:
        """Where points of the source, as `mapping` gives them, lie in the texture, if it does not just lie there."""
        placed = self.sampler.texture
        if self.on_mesh:
            return self.whole(0).placing(placed, self.tiles)
        repeats = self.source.is_layout and not self.tiled and texture.has_texture(self.job, self.source)
        return Wrapped(placed, self.whole(0).wrap) if repeats else None

    def shapes(self, side: int) -> list[Shape]:
        """Return all parts of the source (0), or of the target (1), each once."""
        return list(dict.fromkeys(pair[side] for pair in self.pairs))

    def whole(self, side: int) -> Shape:
        """Return these as one shape, where it is a mesh."""
        shapes = self.shapes(side)
        if len(shapes) == 1:
            return shapes[0]
        from ..shapes.mesh_parts import join
        from ..shapes.mesh_shape import as_mesh

        return join([as_mesh(shape) for shape in shapes])

    def begin(self, part: str) -> None:
        """Make `sampler` or `fit_report` beside what follows, if there may be threads; a drawing as a texture waits for
        the map, which says how finely it is rendered."""
        if part == "sampler" and texture.drawing_of(self.job, self.source):
            return
        if thread_count(self.threads) > 1:
            make = self._early_sampler if part == "sampler" else self._fit_report
            self._begun[part] = beside(make)

    @cached_property
    def sampler(self) -> Sampler:
        """The texture ready to be filtered."""
        made: Sampler | None = self._begun["sampler"].result() if "sampler" in self._begun else None
        return made or self._sampler()

    def _early_sampler(self) -> Sampler | None:
        """Return the same before the map is known; None if it depends on that: transparent edges of a whole drawing are
        those of the frame that is chosen, and where they are not, a gap begins that is part of the picture.
        """
        if self.source.drawing is not None and self.image.alpha >= 0:
            return None
        return self._sampler()

    def _sampler(self) -> Sampler:
        with self.phases.timed("prepare"):
            outlines = texture.outlines_of(self.job, self.shapes(0), self.fits)
            image = self._rendered() if texture.drawing_of(self.job, self.source) else self.image
            on_paper = texture.on_paper(self.job, self.source)
            made = texture.sampler_of(
                self.job, image, self.box, outlines, self.room, self.threads, on_paper=on_paper
            )
        if made.faded:
            self.note(
                f"{self.job.texture}: with this --memory its edge cannot be removed, so the result "
                "may fade at the outline"
            )
        return made

    @cached_property
    def fit_report(self) -> dict[str, Any]:
        """The solver's own report."""
        return self._begun["fit_report"].result() if "fit_report" in self._begun else self._fit_report()

    def _rendered(self) -> Image:
        """Return the drawing that is the texture, as finely as the map samples it; never less than before."""
        if not self.fits:
            return self.image
        density = texture.density_needed(self.fits, min(self.canvas.step))
        height, width = self.image.pixels.shape[:2]
        extent = self.box[1] - self.box[0]
        if density <= min(width / extent.real, height / extent.imag):
            return self.image
        pixels = self.canvas.width * self.canvas.height
        return texture.rendered(self.job, self.source, self.room, density, self._own_box, pixels)

    @cached_property
    def held_drawing(self) -> bytes | None:
        """The drawing that is the texture as a PNG file, for meshes, which hold it or stand beside it."""
        return texture.held_drawing(self.job, self.source)

    def _fit_report(self) -> dict[str, Any]:
        with self.phases.timed("evaluate"):
            found = [fit.report() for fit in self.fits]
        if len(found) == 1 and "without_map" not in self.figures:
            return found[0]
        return found[0] | parts.shares_seen(self.fits) | {"parts": parts.figures(self.pairs, found)}

    @cached_property
    def canvas(self) -> Canvas:
        """The target's raster: its canvas, grown about its middle to the proportions of --size.

        Raises:
            InputError: more pixels than --max-pixels.
        """
        from ...pixels.canvas import Canvas

        box = self._extent()
        return Canvas.about(*framing.canvas_size(self.job, box), box)

    def canvas_of(self, tile: complex | None) -> Canvas:
        """Return the raster of a tile of the target's layout, by its lower left corner; None: the usual one."""
        if tile is None:
            return self.canvas
        aspect = self.target.aspect
        low = complex(tile.real * aspect, tile.imag)
        return replace(self.canvas, box=(low, low + complex(aspect, 1)))

    def _extent(self) -> Box:
        """Return what pictures show of the target; a deformed shape may leave that of the source, which grows."""
        box = framing.picture_box(self.job, self.target)
        return box if self.job.target is not None else bounding_box(np.append(self.fit.image, box))

    def note(self, *remarks: str) -> None:
        """Add remarks, each once."""
        for remark in remarks:
            if remark not in self.notes:
                self.notes.append(remark)
                self.tell(remark)


def _with_holes_as_asked(shape: Shape, job: Job, notes: list[str]) -> Shape:
    """Return a shape with its holes as --holes has them; by default lines that surround an area draw that area."""
    from ..shapes.holes import filled, without_holes

    if job.holes == "fill":
        count = len(shape.holes)
        if count and shape.drawing:
            many = f"{count} holes" if count > 1 else "hole"
            notes.append(f"{shape.spec}: the map ignores its {many}, which pictures fill")
        return filled(shape)
    if job.holes == "auto" and job.holed and job.target and not (job.pin or job.constraints):
        return without_holes(shape, notes.append)
    return as_drawn(shape)
