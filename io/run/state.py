"""The state of a job that is running: its inputs, maps, and results so far."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Box, Complex, Index, complex_of
from ...errors import InputError
from ...memory import Memory
from ...parallel import in_background, thread_count
from ...pixels.texture import Wrapped
from ...plane import bounding_box
from ...polygons import rings_of
from .. import files
from ..memory import within
from ..shapes.holes import as_drawn
from ..shapes.shape import BBOX, CANVAS
from . import along, framing, parts, projected, texture
from .constraints import constrain
from .job import Job
from .parts import Pairs
from .phases import Phases

if TYPE_CHECKING:
    from ...drawings.detail import Detail
    from ...drawings.drawing import Drawing
    from ...frames.choice import Choice
    from ...pixels.preimages import AnyMap
    from ...pixels.texture import Placing, Texture
    from ...pixels.warp import Canvas, Sampler
    from ...solve import Fit
    from ..materials.carried_maps import CarriedMaps
    from ..pictures.image_files import Image
    from ..pictures.tiles import TiledImage
    from ..shapes.shape import Shape
    from .inputs import Inputs

FADED_OPACITY = 0.5
"""Of a picture without margin outside what the target paints: both are recognised."""
LEAST_TONED_SHARE = 1e-3
"""Of the area on which a picture is shown: if the target paints all but this, no tone would be seen."""

Tell = Callable[[str], None]


@dataclass
class Run:
    """The state of a job that is running.

    Attributes:
        job: the job.
        inputs: the files that it reads.
        pairs: its shapes, source and target: one pair, or several with --parts, the largest target first. For a
            deformation, source and target are the same.
        room: allocates large arrays, within --memory.
        tell: called with each note as it is made.
        phases: times of the phases, and the current one.
        threads: for the pixels; None for all cores.
        notes: on the inputs and on solving.
        figures: what reading and solving add to the solver's report.
        fits: the map of each pair, once solved.
        known: the maps of pairs that need not be solved, by their number.
        idle: options without effect, see `outputs.effects`.
        solve: solves for the maps of a run, for outputs that compare several; None until the run is solved.
        pins_of_parts: for each pair, the numbers of its pins; empty unless parts with pins are mapped separately.
        constraints: pins, strokes and an earlier map, as arguments of `iccm.fit`.
        called: the names of pins and strokes.
        start: an earlier map to continue from.
        choices: for each pair, ways to map its drawings, as an argument of `iccm.fit`; empty if they were not compared.
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
    choices: list[Sequence[Choice]] = field(default_factory=list)
    pins_of_parts: list[Index] = field(default_factory=list)
    fits: list[Fit] = field(default_factory=list)
    known: dict[int, Fit] = field(default_factory=dict)
    idle: tuple[str, ...] = ()
    solve: Callable[[Run], None] | None = None
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
        """Read the shapes and constraints of a job; `notes` are those of `resolve`.

        Raises:
            InputError: a file is invalid, or constraints do not lie in its shapes.
        """
        from ..shapes.silhouette import handed

        handed.clear()  # left by an earlier job
        figures, band = dict[str, Any](), None
        if job.several:
            pairs, notes, figures = parts.read(job, inputs)
        elif projected.is_projected(job):
            pairs = [projected.read(job)]
        elif job.along is not None:
            bent, band = along.read(job, inputs)
            pairs = [(bent, band.shape)]
            notes = [*notes, band.note] if band.note else notes
        else:
            source = inputs.shape(job.source)
            target = source
            if job.target:
                target = inputs.target(job.target, source, fills_holes=_fills_holes(source, job))
            pairs = [(source, target)]
        run = cls.of_pairs(job, inputs, pairs, tell, phases, threads, figures)
        run.note(*notes)
        if not job.several:
            run.constraints, run.called = constrain(job, run.source, run.target, inputs.listed)
            if job.rigid_size is not None and run.constraints.keys().isdisjoint({"rigid", "rigid_target"}):
                raise InputError("--rigid-size: only works with rigid regions, see --rigid")
            if job.target and run.target.rigid and not job.rigid_target:
                text = (
                    "elements named rigid in the target are ignored; mark regions in the source, or "
                    "use --rigid-target"
                )
                run.note(f"{run.target.spec}: {text}")
            if band is not None:
                run.constraints |= along.constraints(run.source, band)
        if job.start:
            run.start = _read_start(job)
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
        """Return a job with these shapes, and with their holes treated as the job requests."""
        notes = list[str]()
        accepted = Pairs()
        for source, target in pairs:
            if target is not source:
                source = texture.as_own_picture(job, source, target)
            from_source = _with_holes_as_asked(source, job, notes)
            accepted.append(
                (from_source, from_source if target is source else _with_holes_as_asked(target, job, notes))
            )
        room = within(job.memory, next(iter(job.outputs), None))
        run = cls(job, inputs, accepted, room, tell, phases, threads, figures=figures or {})
        if texture.is_own_picture(job, run.source) and run.source.ink is not None:
            drawn_sources = [as_drawn(source) for source, _ in accepted]
            run.pairs = [
                (drawn, drawn if target is source else target)
                for drawn, (source, target) in zip(drawn_sources, accepted)
            ]
        run.note(*notes)
        return run

    def with_texture(self, map: tuple[str, str] | None) -> Run:
        """Return the same job with another texture and its kind; only one of these is kept."""
        if map is None or map == (self.job.texture, self.job.kind):
            return self
        if map not in self._other:
            self._other.clear()
            job = self.job.model_copy(update={"texture": map[0], "kind": map[1]})
            self._other[map] = replace(self, job=job, _begun={}, _other={})
        return self._other[map]

    def with_maps(self, pairs: Pairs, fits: list[Fit]) -> Run:
        """Return the same texture in the same place, carried by other maps."""
        run = replace(self, pairs=pairs, fits=fits, _begun={}, _other={})
        vars(run).update({name: getattr(self, name) for name in ("image", "box", "sampler")})
        return run

    @cached_property
    def carried_maps(self) -> CarriedMaps:
        """The further textures of the target's materials for --carry-maps, read once for all meshes that are written.

        Raises:
            InputError: the target is not a mesh.
        """
        from ..materials.carried_maps import CarriedMaps
        from ..shapes.mesh_shape import as_mesh

        return CarriedMaps(as_mesh(self.whole(1)).file)

    @property
    def source(self) -> Shape:
        """The source, or that of the largest part."""
        return self.pairs[0][0]

    @property
    def target(self) -> Shape:
        """The target, or that of the largest part."""
        return self.pairs[0][1]

    @property
    def fit(self) -> Fit:
        """The map, or that of the largest part."""
        return self.fits[0]

    @cached_property
    def mapping(self) -> AnyMap:
        """The map, or the maps of all parts joined into one, cut off at holes of the target.

        The texture of a chart lies in its layout, which may be mirrored; a checkerboard on a single chart is not
        mirrored.
        """
        return (
            self.in_layout
            if texture.has_texture(self.job, self.source) or len(self.pairs) > 1
            else self._compose(False)
        )

    @cached_property
    def in_layout(self) -> AnyMap:
        """The same map, with charts of the source where they lie in their layout."""
        return self._compose(True)

    def _compose(self, in_layout: bool) -> AnyMap:
        from ...pixels.composed import Faded, Holed, Reflected

        maps: list[AnyMap] = []
        for (source, target), fit, holes in zip(self.pairs, self.fits, self._holes):
            lines = (
                source.mirror if in_layout else None,
                target.mirror if self.job.target or in_layout else None,
            )
            is_holed = fit.details.drawings is None and holes
            map: AnyMap = Holed(fit.map, holes) if is_holed else fit._visible_map
            if self.faded:
                map = Faded(map, self.faded, FADED_OPACITY)
            maps.append(Reflected(map, *lines) if lines != (None, None) else map)
        return maps[0] if len(maps) == 1 else parts.compose(self.pairs, self.fits, maps)

    @property
    def _holes(self) -> list[tuple[Complex, ...]]:
        """For each part, the holes that pictures leave transparent although its map ignores them.

        Holes of a deformed shape move with it.
        """
        if self.job.holes == "fill":
            return [()] * len(self.pairs)
        from ..shapes.holes import unmapped

        if self.job.target is None:
            openings = unmapped(self.source, self.fit.source_holes)
            return [tuple(self.fit.map(hole) for hole in openings)]
        return [unmapped(target, fit.target_holes) for (_, target), fit in zip(self.pairs, self.fits)]

    @property
    def opaque(self) -> bool:
        """Whether the texture also covers the gaps between the source's parts, as a picture without alpha does."""
        if not texture.has_texture(self.job, self.source) or texture.has_ground(self.job, self.source):
            return True
        return self.image.alpha < 0

    @cached_property
    def toned(self) -> list[Complex]:
        """The boundaries of what the target paints, if a picture on paper is shown on more than that, as on its
        silhouette. This area is then a tone on the paper, except below the drawing and in its holes. Empty otherwise.
        """
        if self.image.alpha < 0 or self.faded:
            return []
        found = self._painted_in_silhouette(self.target.ink or self.target.drawing)
        if found is None:
            return []
        area, shown = found
        if self.source.drawing is None:
            return area.rings
        from ...maps.moved_rings import move_rings
        from ...pixels.paper import cleared

        outlines = [complex_of(part.exterior.coords[:-1]) for part in self.source.drawing.parts]
        return cleared(area.painted, move_rings(self.fit.map, outlines), shown.painted)

    @cached_property
    def faded(self) -> list[Complex]:
        """The boundaries of the area outside of which a picture without margin is faded, if it is shown on more than
        the target paints; see `frames.silhouettes.clear_part`. Empty otherwise.
        """
        if self.detail is None or not self.detail.is_full:
            return []
        found = self._painted_in_silhouette(self.target.drawing)
        if found is None:
            return []
        from ...frames.silhouettes import clear_part

        return rings_of(clear_part(*found))

    def _painted_in_silhouette(self, painted: Drawing | None) -> tuple[Drawing, Drawing] | None:
        """Return what the target paints, and what the picture is shown on if that is more; else None."""
        drawings = [fit.details.drawings for fit in self.fits]
        if len(drawings) != 1 or drawings[0] is None or not texture.on_paper(self.job, self.source):
            return None
        if self.image.raster is not None or framing.placing_options(self.job):
            return None
        shown = drawings[0][1]
        if painted is None or painted.region.area > (1 - LEAST_TONED_SHARE) * shown.region.area:
            return None
        return painted, shown

    @cached_property
    def paper(self) -> str:
        """The colour of the paper in the gaps of a drawing that is its own picture, as in SVG; empty if none."""
        return self._ground[0]

    @cached_property
    def tone(self) -> str:
        """The colour of `toned` on the paper, as in SVG; empty if it is not shown."""
        return self._ground[1]

    @cached_property
    def _ground(self) -> tuple[str, str]:
        """The colours of paper and tone as in SVG."""
        if not texture.on_paper(self.job, self.source) or self.image.alpha < 0:
            return "", ""
        from ...pixels.paper import ground_of

        placed = self.image.texture(self.box, kind=self.job.kind, room=self.room)
        ground = ground_of(placed, toned=bool(self.toned))
        return _hexadecimal(ground.paper), "" if ground.tone is None else _hexadecimal(ground.tone)

    @property
    def free_gaps(self) -> bool:
        """Whether gaps of the source may be shown at no cost.

        This is so for the checkerboard, which has no background around the shape as a photo has, and for drawings with
        several parts, none of which determines where the drawing ends. Paper around a drawing of one part, on the other
        hand, costs as much as leaving the target bare: it is better to bend more of the drawing there.
        """
        if not self.opaque:
            return False
        several = self.source.drawing is not None and not self.source.drawing.is_one_part
        return several or not texture.has_texture(self.job, self.source)

    @cached_property
    def detail(self) -> Detail | None:
        """The edges of the picture that the source shows, by which maps are compared; None if shapes alone count.

        By default they do with --texture, so that one map serves many textures.
        """
        job, source = self.job, self.source
        is_asked = job.detail is not None and job.detail > 0
        if job.detail == 0 or not (is_asked or texture.is_own_picture(job, source)):
            return None
        if job.target is None or self.target.is_mesh or source.drawing is None or job.place == "inside":
            return None
        if job.source.rpartition("#")[2] in (BBOX, CANVAS):
            return None  # the box is what is meant
        if job.kind != "colour" or framing.repeats(job) or job.texture_box or framing.placing_options(job):
            return None
        detail = texture.detail_of(job, source, self.image, self.box)
        # where there are several targets, such as letters, the form of each is what they are recognised by
        return replace(detail, canvas=framing.picture_box(job, self.target), keeps_form=job.repeated)

    @cached_property
    def tiled(self) -> TiledImage | None:
        """The pictures of the tiles (UDIM) that the source lies on, if the texture's name is a pattern."""
        return texture.tiles_of(self.job, self.shapes(0), self.room)

    @property
    def tiles(self) -> Box | None:
        """The box of the source's layout that the tiles cover."""
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
        """The visible box of a drawing that is its own texture; stored, because a map may change the outline of the
        shape.
        """
        return texture.own_box_of(self.source)

    @cached_property
    def box(self) -> Box:
        """The place of the texture in the source's plane."""
        return texture.box_of(self.job, self.source, self.image, self.tiles, self._own_box)

    @property
    def flat(self) -> Texture:
        """The place of the texture as a texture of one texel, whose coordinates are s and t."""
        from ...pixels.stmap import flat

        has_texture = texture.has_texture(self.job, self.source)
        shape = self.image.pixels.shape if has_texture and framing.repeats(self.job) else (1, 1)
        proportions = shape[1] / shape[0] if has_texture else None
        box = framing.texture_box(self.job, self.source, proportions)
        return flat(box, framing.texture_rotation(self.job))

    @cached_property
    def on_mesh(self) -> bool:
        """Whether the texture lies on a mesh that is the source."""
        return texture.on_mesh(self.job, self.source)

    @cached_property
    def placing(self) -> Placing | None:
        """Where points of the source, as `mapping` returns them, lie in the texture, unless it lies flat in the
        plane.
        """
        placed = self.sampler.texture
        if self.on_mesh:
            return self.whole(0).placing(placed, self.tiles)
        repeats = self.source.is_layout and not self.tiled and texture.has_texture(self.job, self.source)
        return Wrapped(placed, self.whole(0).wrap) if repeats else None

    def shapes(self, side: int) -> list[Shape]:
        """Return all parts of the source (0) or the target (1), each once."""
        return list(dict.fromkeys(pair[side] for pair in self.pairs))

    def whole(self, side: int) -> Shape:
        """Return all parts of a side as one shape, which is a mesh if there are several."""
        shapes = self.shapes(side)
        if len(shapes) == 1:
            return shapes[0]
        from ..shapes.mesh_parts import join
        from ..shapes.mesh_shape import as_mesh

        return join([as_mesh(shape) for shape in shapes])

    def begin(self, part: str) -> None:
        """Start computing `sampler` or `fit_report` in another thread, if there may be several.

        A drawing as the texture has to wait for the map, which determines its resolution.
        """
        if part == "sampler" and texture.is_rendered(self.job, self.source):
            return
        if thread_count(self.threads) > 1:
            make = self._early_sampler if part == "sampler" else self._fit_report
            self._begun[part] = in_background(make)

    @cached_property
    def sampler(self) -> Sampler:
        """The texture, prepared for filtering."""
        sampler: Sampler | None = self._begun["sampler"].result() if "sampler" in self._begun else None
        return sampler or self._sampler()

    def _early_sampler(self) -> Sampler | None:
        """Return the sampler before the map is known; None if it depends on the map.

        This is so for a whole drawing with alpha. Its transparent edges are those of the chosen frame; any other
        transparent region is a gap that belongs to the picture.
        """
        if self.source.drawing is not None and self.image.alpha >= 0:
            return None
        return self._sampler()

    def _sampler(self) -> Sampler:
        with self.phases.timed("prepare"):
            outlines = texture.outlines_of(self.job, self.shapes(0), self.fits)
            image = self._rendered() if texture.is_rendered(self.job, self.source) else self.image
            on_paper = texture.on_paper(self.job, self.source)
            painted = [self.fit.inverse(ring) for ring in self.toned]
            sampler = texture.sampler_of(
                self.job,
                image,
                self.box,
                outlines,
                self.room,
                self.threads,
                on_paper=on_paper,
                painted=painted,
            )
        if sampler.faded:
            self.note(
                f"{self.job.texture}: there is not enough memory to remove its edge, so the result may "
                "fade at the outline; raise --memory"
            )
        return sampler

    @cached_property
    def fit_report(self) -> dict[str, Any]:
        """The solver's own report."""
        return self._begun["fit_report"].result() if "fit_report" in self._begun else self._fit_report()

    def _rendered(self) -> Image:
        """Render the drawing that is the texture at the resolution that the map needs, and not less than before."""
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
        """The drawing that is the texture as a PNG file, for meshes that contain it or refer to it."""
        return texture.held_drawing(self.job, self.source)

    def _fit_report(self) -> dict[str, Any]:
        with self.phases.timed("evaluate"):
            reports = [fit.report() for fit in self.fits]
        if len(reports) == 1 and "without_map" not in self.figures:
            return reports[0]
        figures = {"parts": parts.figures(self.pairs, reports)}
        if self.pins_of_parts:
            figures["pins"] = parts.pins_in_order(reports, self.pins_of_parts)
        return reports[0] | parts.shares_seen(self.fits) | figures

    @cached_property
    def canvas(self) -> Canvas:
        """The target's raster: its canvas, extended on both sides to the proportions of --size.

        Raises:
            InputError: there are more pixels than --max-pixels.
        """
        from ...pixels.canvas import Canvas

        box = self._extent()
        return Canvas.about(*framing.canvas_size(self.job, box), box)

    def canvas_of(self, tile: complex | None) -> Canvas:
        """Return the raster of a tile of the target's layout, by its lower left corner; None: the default raster."""
        if tile is None:
            return self.canvas
        aspect = self.target.aspect
        low = complex(tile.real * aspect, tile.imag)
        return replace(self.canvas, box=(low, low + complex(aspect, 1)))

    def _extent(self) -> Box:
        """Return the box that pictures show; it is extended for a deformed shape that leaves the source's canvas."""
        box = framing.picture_box(self.job, self.target)
        return box if self.job.target is not None else bounding_box(np.append(self.fit.image, box))

    def note(self, *remarks: str) -> None:
        """Add notes, each only once."""
        for remark in remarks:
            if remark not in self.notes:
                self.notes.append(remark)
                self.tell(remark)


def _hexadecimal(colour: NDArray) -> str:
    """Return a colour (c,) as in SVG, given its one or three values from 0 to 1."""
    values = np.rint(255 * np.clip(colour, 0, 1)).astype(int)
    return "#" + "".join(f"{value:02x}" for value in (values if values.size == 3 else values[:1].repeat(3)))


def _fills_lines(job: Job) -> bool:
    """Return whether what closed lines enclose counts as filled: by default, unless pins are given."""
    return job.holes == "auto" and job.holed and job.target is not None and not job.has_pins


def _fills_holes(shape: Shape, job: Job) -> bool:
    """Return whether the map treats the holes of a shape as parts of it."""
    from ..shapes.holes import is_drawn_by_lines

    return job.holes == "fill" or (_fills_lines(job) and is_drawn_by_lines(shape))


def _with_holes_as_asked(shape: Shape, job: Job, notes: list[str]) -> Shape:
    """Return a shape with its holes treated as --holes requests; by default, closed lines count as filled areas."""
    from ..shapes.holes import filled, without_holes

    if job.holes == "fill":
        count = len(shape.holes)
        if count and shape.drawing:
            many = f"{count} holes" if count > 1 else "hole"
            notes.append(f"{shape.spec}: the map ignores its {many}, which pictures fill")
        return filled(shape)
    if _fills_lines(job):
        return without_holes(shape, notes.append)
    return as_drawn(shape)


def _read_start(job: Job) -> Fit:
    """Return the map that a job continues from.

    Raises:
        InputError: the file cannot be read, the map is not of the balanced method, or the job cannot use such a map.
    """
    from ...maps.triangulated.map import TriangulatedMap
    from ...result import load

    if job.several or not job.exact:
        needed = f"--parts {job.parts}" if job.exact else "--method balanced"
        raise InputError(
            f"--start: only works with one balanced map, {'not with' if job.exact else 'so add'} {needed}"
        )
    files.open_input(job.start or "")
    fit = load(job.start or "")
    if not isinstance(fit.map, TriangulatedMap):
        raise InputError(f"{job.start}: not a balanced map, so --start cannot continue from it")
    return fit
