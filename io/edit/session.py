"""An editing session: two shapes, a texture, the converged map, and a coarse map that follows dragging.

Without a target the shape is deformed: the other half of the page shows the same shape, moved by its pins.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Box, Complex
from ...balanced.constraints.soft import MOST_LIMIT_RATIO, softness_of
from ...balanced.interactive import Live
from ...balanced.model.energy import Energy
from ...balanced.model.settings import Settings
from ...blas import one_thread
from ...curve import Curve
from ...errors import InputError
from ...maps.approximation import triangulated
from ...maps.distortion import in_middles
from ...maps.moved_rings import move_rings
from ...maps.triangulated.map import TriangulatedMap
from ...pins import Pin as SoftPin
from ...pins import Softness
from ...pixels.paper import on_paper
from ...result import Fit
from ...status import Status
from .. import limits
from ..point_syntax import Place
from ..run import framing, texture
from ..run.constraints import as_pins, as_strokes, check_inside, fingerprint
from ..run.execute import solve_pairs
from ..run.inputs import Inputs
from ..run.job import Job
from ..run.phases import Phases
from ..run.report import as_json
from ..run.resolve import suffix_for
from ..run.state import Run
from ..shapes import constraints, listing, regions
from ..shapes.handles import handles_of
from ..shapes.listing import ConstraintsFile, Pin, Stroke
from ..shapes.mesh_shape import MeshShape
from ..shapes.shape import Shape
from ..shapes.starts import StartingMap
from .map_choice import MapChoice, same
from .map_update import (
    MISSED_DIAGONAL_SHARE,
    MapUpdate,
    Solved,
    figures,
    missed_constraints,
    refusal,
    verdict,
)
from .messages import Scene, scene_of
from .own_drawing import own_drawing
from .scene import PageHalf, patches, png
from .suggest import axis, corners, suggested
from .surface_view import SurfaceView, lay_out

ON_OUTLINE_SHARE = 2e-3
"""Relative to the diagonal: points this close to an outline are carried to the other outline. Twice the tolerance of
pins.
"""
FOLLOWED_LIMIT_RATIO = 1.5
"""How far a soft pin may be from its place while it is dragged, relative to its limit, since the map lags behind."""
STILL_SHARE, STILL_QUANTILE = 2e-4, 0.95
"""A map has converged if, in a step, this quantile of its vertices moves less than this share of the target's
diagonal: a sixth of a pixel of 800."""
MOST_SETTLING_SHARE = 0.005
"""How far a map may settle after a pin was released, as the same quantile, relative to the target's diagonal. What is
released stays where it was seen; further settling waits for the next drag.
"""
PLACED_SHARE = 1e-3  # of the target's diagonal: a new pin this close to where the map takes it moves nothing
MOST_COMPARED_PINS = 12  # a map from scratch with more takes seconds
# a map from scratch with one of these statuses does not replace another map
LOST_ON_THE_WAY = (Status.PINS, Status.GAP, Status.SOURCE_GAP)
# significant digits of coordinates relative to the shape's size, the same on the page and in files
PLACE_DIGITS = 7


class PlacedConstraints(NamedTuple):
    """Pins and strokes in the core plane.

    Attributes:
        pins: (k, 2) points of the source and their images.
        strokes: pairs of curves.
        settings: of each pin, beside its places.
        stroke_widths: widths of the bands around strokes.
    """

    pins: Complex
    strokes: list[tuple[Curve, Curve]]
    settings: list[dict[str, float]]
    stroke_widths: list[float]


class Session:
    """A pair of shapes being edited. One call of `follow` and one of `solve` may run at the same time."""

    def __init__(self, job: Job) -> None:
        """Read the inputs of a job.

        Raises:
            InputError: a file is invalid, or constraints do not lie in these shapes.
        """
        inputs = Inputs(job)
        source = inputs.shape(job.source)
        self.deforming = not job.target
        if self.deforming and source.is_mesh:
            raise InputError(f"{job.source}: a mesh can only be mapped, not deformed; name a TARGET")
        target = source if self.deforming else inputs.shape(job.target or "", target=True, source=source)
        self.job, self.suffix = job, suffix_for(job, inputs)
        self.drawn = bool(source.pins or source.strokes)
        listed = listing.read(job.constraints) if job.constraints else ConstraintsFile()
        self.first = _scene(job, source, target, listed)
        bare = replace(source, pins={}, strokes={})
        other = bare if self.deforming else replace(target, pins={}, strokes={})
        self._run = Run.of_pairs(job, inputs, [(bare, other)], lambda note: None, Phases())
        self.source, self.target = self._run.pairs[0]
        self.core(self.first)
        self.scene = self.saved = self.first
        self.left: Scene | None = None
        self.written: set[str] = set()
        self._image = self._run.image
        self._fit: Fit | None = None
        self._maps: list[TriangulatedMap] = []
        self._live: Live | None = None
        self._followed = self._shown_key = ""
        self._is_met = False
        self._last = (self.first, MapUpdate("error", False, ""))
        self._choices: dict[str, MapChoice] = {}
        if listed.start:
            self.begin(self.first, listed.start)

    def go_on_from(self, before: Session) -> None:
        """Take over the edits from a session with the same shapes and another texture."""
        self.scene, self.saved, self.left = before.scene, before.saved, before.left
        self.written, self._choices = before.written, before._choices

    @property
    def _map(self) -> TriangulatedMap | None:
        """The map that is shown; if parts are mapped separately, that of the first."""
        return self._maps[0] if self._maps else None

    @cached_property
    def views(self) -> tuple[PageHalf, PageHalf]:
        """The coordinate systems of both halves of the page."""
        source, target = self._boxes
        return PageHalf.of(source, self.source.curve.box), PageHalf.of(target, self.target.curve.box)

    @cached_property
    def surfaces(self) -> tuple[SurfaceView | None, SurfaceView | None]:
        """The views of the sides that are meshes."""
        source, target = (
            SurfaceView(shape) if isinstance(shape, MeshShape) else None
            for shape in (self.source, self.target)
        )
        return source, target

    @property
    def _boxes(self) -> tuple[Box, Box]:
        """The box that the texture covers, and the box that pictures show."""
        return texture.box_of(self.job, self.source, self._image), framing.picture_box(self.job, self.target)

    @lru_cache(maxsize=1)  # noqa: B019  (there is one session)
    def texture(self, most: int) -> bytes:
        """Return the texture as PNG with at most so many pixels a side."""
        image, source = self._image, self.source
        if isinstance(source, MeshShape) and texture.on_mesh(self.job, source):
            image = lay_out(self.job, source, image, self._boxes[0], most)
        if texture.on_paper(self.job, source) and image.alpha >= 0:
            placed = image.texture(self._boxes[0], kind=self.job.kind)
            filled = on_paper(placed)  # with its antialiased edge, since the whole texture is shown
            image = image.with_pixels(filled.pixels, filled.alpha)
        return png(image, most)

    @property
    def notes(self) -> list[str]:
        """Notes on the inputs."""
        found = [f"{shape.spec}: {note}" for shape in (self.source, self.target) for note in shape.notes]
        return [
            *found,
            *self._run.notes,
            *framing.remarks(self.job, self.source, self.target),
            *self._image.notes,
        ]

    def describe(self) -> dict[str, Any]:
        """Return what the page needs to know before it draws."""
        job = self.job
        sides = []
        for shape, view, surface, box in zip(
            (self.source, self.target), self.views, self.surfaces, self._boxes
        ):
            side = view.describe(shape, box) | {"mesh": surface is not None, "canvas": view.box(shape.box)}
            side |= (
                {}
                if surface
                else {"corners": view.points(corners(shape.curve)[0]), "axis": _axis(view, shape)}
            )
            sides.append(side | (surface.describe() if surface else {}))
        scenes = {name: _dumped(getattr(self, name)) for name in ("scene", "saved", "left")}
        how: dict[str, Any] = {
            "edge": job.edge,
            "filter": job.filter,
            "holes": job.holed,
            "digits": PLACE_DIGITS,
        }
        how |= {"mean": self._magnification, "deforming": self.deforming}
        return as_json({"source": sides[0], "target": sides[1], "notes": self.notes, **scenes, **how})

    @property
    def _magnification(self) -> float:
        """The mean scale from the texture's plane to the target, in the page's coordinates of both."""
        surface, (source, target) = self.surfaces[1], self.views
        scale = surface.scale if surface else target.scale
        return float(np.sqrt(self.source.curve.area / self.target.curve.area) * scale / source.scale)

    def drawing(self, side: str) -> tuple[bytes, str] | None:
        """Return content and media type of the picture in the file of a side, if there is one."""
        return own_drawing(self.source if side == "source" else self.target)

    def triangles(self, side: str) -> bytes:
        """Return a mesh for the page: its triangles, and for the source the vertices' places in the texture plane.

        Raises:
            KeyError: that side is not a mesh.
        """
        surface = self.surfaces[side == "target"]
        if surface is None:
            raise KeyError(side)
        flat = self.views[0](surface.shape.flattening.flat) if side == "source" else np.zeros(0, "f4")
        return surface.triangles + flat.astype("<f4").tobytes()

    def image_of(self, maps: Sequence[TriangulatedMap]) -> NDArray[np.float32]:
        """Return what the page draws of the maps of all parts.

        This is `scene.patches`, or for a mesh the place (n, 2) of each vertex in the texture plane, as `iccm map`
        writes it.
        """
        if isinstance(self.target, MeshShape):
            return self.views[0](maps[0].extended_inverse(self.target.flattening.flat)[0])
        return np.concatenate([patches(map, *self.views) for map in maps])

    def begin(self, scene: Scene, start: StartingMap) -> None:
        """Set the map that the map of a scene continues from.

        Raises:
            InputError: it is not a map of these shapes.
        """
        map = start.map(self.source, self.target)
        kept = bool(start.kept) and start.kept == self._fingerprint(scene)
        places = self.core(scene).pins[:, 0].tolist()
        springs = dict(zip(places, start.springs)) if start.springs else None
        self._choices[scene.key] = MapChoice(map, kept=kept, springs=springs)

    def start(self, scene: Scene) -> StartingMap | None:
        """Return the map that the map of a scene continues from, which must be saved to reproduce it."""
        chosen = self._choices.get(scene.key, MapChoice())
        if chosen.begins is None:
            return None
        kept = self._fingerprint(scene) if chosen.kept else ""
        places = self.core(scene).pins[:, 0].tolist() if chosen.springs else []
        springs = [(chosen.springs or {}).get(place, 1.0) for place in places]
        springs = springs if any(factor > 1 for factor in springs) else []
        return StartingMap.of(chosen.begins, self.source, self.target, kept=kept, springs=springs)

    def _fingerprint(self, scene: Scene) -> str:
        placed = self.core(scene)
        return fingerprint(self._job_of(scene), placed.pins, placed.settings)

    def solve(self, scene: Scene, way: str = "") -> MapUpdate:
        """Return the converged map, continued from the last one or from scratch, as `iccm map` computes it from saved
        files.

        Args:
            scene: pins and strokes.
            way: "fresh" for the map from scratch, "kept" for the continued one, if both are known.
        """
        self.scene = scene
        try:
            with one_thread():
                if not way and (kept := self._kept(scene)) is not None:
                    return kept
                chosen = self._choices.get(scene.key) or MapChoice(self._start(scene))
                chosen = replace(chosen, fresh=way == "fresh") if way else chosen
                solved, chosen = self._solve(scene, chosen)
        except InputError as error:
            return refusal(error)
        return self._settle(scene, solved, chosen)

    def _kept(self, scene: Scene) -> MapUpdate | None:
        """Make the map that is shown that of a scene, exactly as it is, if it meets all constraints.

        It followed a drag to there, or the scene has new pins where the map takes them anyway.
        """
        if self.deforming or self.surfaces != (None, None) or not scene.pins or scene.strokes or scene.rigid:
            return None
        if self.has_followed(scene):
            assert self._live is not None
            if self._live.coarse or not self._is_met:
                return None
            seen = self._live.start
        elif self._only_adds_pins(scene) and self._fit is not None:
            chosen = self._choices[self._last[0].key]
            seen = chosen.begins if chosen.kept and chosen.begins is not None else triangulated(self._fit.map)
        else:
            return None
        pair = self.source, self.target
        with suppress(InputError):
            start = StartingMap.of(seen, *pair, pins=self.core(scene).pins[:, 0]).map(*pair)
            chosen = MapChoice(start, kept=True, springs=None if self._live is None else self._live.springs)
            solved = self._fit_scene(scene, start, kept=True)
            if solved.status.ok and not any(missed_constraints(solved.report, scene).values()):
                return self._settle(scene, solved, chosen, live=self._live)
        return None

    def _only_adds_pins(self, scene: Scene) -> bool:
        """Return whether a scene differs from the last one by new pins only, which are where the map takes them."""
        last, map = self._last[0], self._map
        if (
            self._fit is None
            or map is None
            or scene.key in self._choices
            or not (scene.whole and self._is_whole)
        ):
            return False
        ends = [(pin.source, pin.target) for pin in last.pins]
        more = [pin for pin in scene.pins if (pin.source, pin.target) not in ends]
        others = scene.model_copy(update={"pins": [pin for pin in scene.pins if pin not in more]})
        if not more or others.key != last.key:
            return False
        placed = self.core(scene.model_copy(update={"pins": more})).pins
        gaps = np.abs(map(placed[:, 0]) - placed[:, 1])
        return bool((gaps <= PLACED_SHARE * self.target.curve.diagonal).all())

    def compare(self, scene: Scene) -> MapUpdate | None:
        """Compare a continued map with the one from scratch; return an update of the page if there is something to
        report.

        If they look the same, the map from scratch replaces the other: then only pins and strokes have to be saved.
        Otherwise it is offered, because nothing that is seen changes without the user. Maps of meshes and of many pins
        are not compared, because each takes seconds.
        """
        if (
            self.source.is_mesh
            or (self.target and self.target.is_mesh)
            or len(scene.pins) > MOST_COMPARED_PINS
        ):
            return None
        chosen, before = self._choices.get(scene.key, MapChoice()), self._fit
        if chosen.begins is None or chosen.other or before is None or self.scene is not scene:
            return None
        try:
            with one_thread():
                solved = self._fit_scene(scene, None)
        except InputError:
            return None
        if any(missed_constraints(solved.report, scene).values()) or self.scene is not scene:
            return None
        if same(before.map, solved.maps[0]):  # type: ignore[arg-type]
            return self._settle(scene, solved, MapChoice(), live=self._live)
        gain = before.distortion.stretch_p95 / solved.fit.distortion.stretch_p95
        chosen = replace(chosen, other=True, gain=gain if solved.status.ok else 1.0)
        self._choices[scene.key] = chosen
        return replace(self._last[1], drawn=None, other=chosen.alternative, gain=chosen.gain)

    def _start(self, scene: Scene) -> TriangulatedMap | None:
        """Return the map to continue from, rounded as in a file; None to start from scratch."""
        pair = self.source, self.target
        try:
            found = self._before(scene)
            if found is None:
                return None
            return StartingMap.of(found, *pair, pins=self.core(scene).pins[:, 0]).map(*pair)
        except InputError:  # what is wrong with the scene will be reported from scratch, too
            return None

    def _before(self, scene: Scene) -> TriangulatedMap | None:
        """Return the coarse map that follows, or the last converged one.

        None without pins, after a change of the rotation, for partial maps, and with rigid regions.
        """
        fit, last = self._fit, self._last[0]
        if self.deforming:
            return self._map if scene.constrained else None
        if scene.rigid or last.rigid:
            return None
        if (
            fit is None
            or not (scene.constrained and scene.whole and self._is_whole)
            or scene.turn != last.turn
        ):
            return None
        if self._live is None and scene.balance == last.balance:
            return fit.map  # type: ignore[return-value]
        if self._live is not None and self._followed == scene.key:
            return self._live.start
        return self._continue(scene, self.core(scene)).start

    @property
    def _is_whole(self) -> bool:
        """Whether the last converged map covers the whole outlines, or the tightest frames, with all holes, so that a
        map with pins and strokes may continue from it.
        """
        fit = self._fit
        if self._last[0].whole:
            return True
        if fit is None or len(self._maps) > 1 or fit.is_partial or fit.target is None:
            return False
        if self.surfaces != (None, None):
            return True
        holes = len(self._maps[0].loops) - 1
        return all(
            np.array_equal(outline.z, shape.curve.z) and holes == len(shape.mappable_holes)
            for outline, shape in ((fit.source, self.source), (fit.target, self.target))
        )

    def _solve(self, scene: Scene, chosen: MapChoice) -> tuple[Solved, MapChoice]:
        """Return the map computed in the chosen way, or from scratch if that fails."""
        gone_on = None
        if chosen.begins is not None:
            with suppress(InputError):
                gone_on = self._fit_scene(scene, chosen.begins, kept=chosen.kept), chosen
                if gone_on[0].status not in LOST_ON_THE_WAY:
                    return gone_on
            chosen = MapChoice()
        try:
            fresh = self._fit_scene(scene, None), chosen
        except InputError:
            if gone_on is None:
                raise
            return gone_on
        return fresh if gone_on is None or fresh[0].status.ok else gone_on

    def _job_of(self, scene: Scene) -> Job:
        """Return the job with the settings of a scene, and without constraints."""
        asked: dict[str, Any] = {"balance": scene.balance, "pin": (), "constraints": None}
        if not self.deforming:
            asked |= {"turn": scene.turn or None, "fit": None if scene.fit == "auto" else scene.fit}
        return self.job.model_copy(update=asked)

    def _fit_scene(self, scene: Scene, start: TriangulatedMap | None, *, kept: bool = False) -> Solved:
        """Return the maps of all parts, as `iccm map` computes them, and their report.

        Args:
            scene: pins and strokes.
            start: the map to continue from; None to start from scratch.
            kept: whether the start is the map as it is.
        """
        pins, strokes, settings, widths = self.core(scene)
        if self.deforming and not (scene.pins or scene.strokes):
            pins = np.tile(self.source.curve.z[:1], (1, 2))  # a pin that stays in place: then everything does
            settings = []
        settings = [] if self.job.exact_pins else settings
        given: dict[str, Any] = {"pins": as_pins(pins, settings), "strokes": as_strokes(strokes, widths)}
        given |= {} if start is None else {"start": start}
        given |= {"keep_start": True} if kept else {}
        if rigid := self._rigid(scene):
            given |= {"rigid": rigid, **regions.greys(self.source, scene.rigid)}
        run = replace(
            self._run,
            job=self._job_of(scene),
            pairs=[(self.source, self.target)],
            constraints=given,
            notes=[],
            figures={},
            fits=[],
        )
        vars(run)["image"] = self._image
        solve_pairs(run)
        report = run.fit_report
        report["notes"] = [*dict.fromkeys([*run.notes, *report["notes"]])]
        return Solved(run.fits, report, pins)

    def _softness(self, settings: Sequence[dict[str, float]]) -> Softness | None:
        """Return the softness of pins, from the settings of each; None if all pins are exact."""
        if self.job.exact_pins or (self.source.is_mesh and self.target.is_mesh):
            return None
        return Softness.of([SoftPin(0, 0, **each) for each in settings])

    def _rigid(self, scene: Scene) -> list[Complex]:
        """Return the rigid regions of a scene, and those drawn in the file, in the core plane.

        Raises:
            InputError: a region is invalid, or is the name of one that the session did not begin with.
        """
        if any(isinstance(each, str) and each not in self.first.rigid for each in scene.rigid):
            raise InputError("rigid: only regions from the command line or drawn on this page are possible")
        return regions.read(self.source, (), scene.rigid)

    def _regions(self, fit: Fit, report: dict[str, Any]) -> dict[str, Any]:
        """Return the figures of rigid regions with their outlines on both sides in page coordinates."""
        found = []
        for region, said in zip(fit.rigid, report.get("regions", ())):
            outline = fit.outline_of(region)
            images = [] if self.surfaces[1] else self.views[1].points(fit.map(outline))
            found.append({**said, "source": self.views[0].points(outline), "target": images})
        return {"regions": found}

    def _settle(
        self, scene: Scene, solved: Solved, chosen: MapChoice, *, live: Live | None = None
    ) -> MapUpdate:
        """Return the update that shows a map, and make the map the current one if it meets the constraints.

        Args:
            scene: pins and strokes.
            solved: the map.
            chosen: how it was computed.
            live: the same map as the next drag continues it; None to begin with the converged one.
        """
        report, status = solved.report, solved.status
        wrong = missed_constraints(report, scene)
        if any(wrong.values()) and self._map is not None:
            return MapUpdate("error", False, status.value, {}, wrong)
        drawn = self.image_of(solved.maps)
        said = (
            figures(report) | self._regions(solved.fit, report),
            wrong,
            drawn,
            chosen.alternative,
            chosen.gain,
        )
        shown = MapUpdate("full", status.ok, verdict(status, report, deformed=self.deforming), *said)
        shown = replace(
            shown, patches=self._patches(scene, solved.pins, solved.fit.pins, solved.fit.softness)
        )
        self._choices[scene.key] = chosen
        if self.scene is scene:  # else something is being dragged again, from the map as it was
            self._fit, self._maps, self._live, self._shown_key = solved.fit, solved.maps, live, ""
            self._last = scene, shown = scene, replace(shown, outlines=self._outlines(solved.fit))
        return shown

    def follow(self, scene: Scene) -> MapUpdate:
        """Return the coarse map, continued from the last one. There is none if only parts of the shapes correspond."""
        if self.deforming:
            return self._bend(scene)
        if not (scene.whole and self._is_whole):
            return MapUpdate(
                "coarse",
                True,
                "The map is updated when you release the pin, because parts of the "
                "shapes are hidden or bare.",
            )
        try:
            with one_thread():
                placed = self.core(scene)
                self._live = live = self._continue(scene, placed, dragged=True)
                map, self._followed = live.map, scene.key if live.met else ""
                self._shown_key = scene.key
                found = MapUpdate("coarse", live.met, "", in_middles(map).report(), {}, self.image_of([map]))
        except InputError as error:
            return refusal(error)
        self._maps = [map]
        pins = placed.pins
        softness = softness_of(pins, live.patches.points, live.patches.softness)
        found = replace(found, patches=self._patches(scene, pins, pins, softness))
        gap = np.abs(map(pins[:, 0]) - pins[:, 1])
        limits = np.where(softness.is_soft, MOST_LIMIT_RATIO * softness.limits, np.inf)
        self._is_met = live.met and bool((gap <= limits).all())
        far = gap > FOLLOWED_LIMIT_RATIO * softness.limits
        missed = np.where(
            softness.is_soft, far, (not live.met) & (gap > MISSED_DIAGONAL_SHARE * self.target.curve.diagonal)
        )
        if live.met and not missed.any():
            return found
        found = replace(found, ok=False)
        wrong = {"pins": [k for k in np.flatnonzero(missed).tolist() if k < len(scene.pins)]}
        message = (
            "The pin is not there yet: the map follows as far as possible without folds. Release "
            "the pin to search for another map."
        )
        return replace(found, wrong=wrong, message=message)

    def has_followed(self, scene: Scene) -> bool:
        """Return whether the map that is shown followed a drag to the pins and strokes of a scene."""
        return self._live is not None and self._shown_key == scene.key

    def relax(self, scene: Scene, released: TriangulatedMap | None = None) -> MapUpdate | None:
        """Return the coarse map after further steps at the same constraints; None once it hardly moves.

        One update of a drag has no time for all Newton steps that its map needs. The rest is done while the hand rests,
        so that the map seen then is the one after the release.

        Args:
            scene: pins and strokes.
            released: the map that was seen when the pin was released. Once the constraints are met, the map stays
                near it.
        """
        before, live, was_met = self._map, self._live, self._is_met
        if self.deforming or before is None or not (scene.whole and self._is_whole):
            return None
        shown, after = self.follow(scene), self._map
        if shown.kind == "error" or after is None:
            return None
        if self._moved_share(before, after) < STILL_SHARE:
            return None
        if released is not None and was_met and self._moved_share(released, after) > MOST_SETTLING_SHARE:
            self._live, self._maps, self._is_met = live, [before], was_met
            return None
        return shown

    def is_behind(self, scene: Scene) -> bool:
        """Return whether the pin was released before the map had followed it to a scene."""
        follows = not self.deforming and self._live is not None
        return follows and scene.key not in self._choices and not self.has_followed(scene)

    def seen(self) -> TriangulatedMap | None:
        """Return the map that is shown."""
        return self._map

    def _moved_share(self, before: TriangulatedMap, after: TriangulatedMap) -> float:
        """Return how far most vertices moved relative to the target's diagonal; infinite on another mesh."""
        if after.image.size != before.image.size:
            return np.inf
        moved = np.abs(after.image - before.image)
        return float(np.quantile(moved, STILL_QUANTILE)) / self.target.curve.diagonal

    def _bend(self, scene: Scene) -> MapUpdate:
        """Return the deformation, continued from the previous one."""
        try:
            with one_thread():
                solved = self._fit_scene(scene, self._map)
        except InputError as error:
            return refusal(error)
        self._maps = solved.maps
        report, drawn = solved.report, self.image_of(solved.maps)
        wrong = missed_constraints(report, scene)
        met = not any(wrong.values())
        message = (
            "" if met else "The pin is not there yet: the shape follows as far as possible without folds."
        )
        outlines = self._outlines(solved.fit)
        patches = self._patches(scene, solved.pins, solved.fit.pins, solved.fit.softness)
        return MapUpdate(
            "coarse", met, message, figures(report), wrong, drawn, outlines=outlines, patches=patches
        )

    def _outlines(self, fit: Fit) -> list[list[list[float]]]:
        """Return the rings of a deformed shape: the outline of its frame and what is painted, or its outline and holes.
        Empty for shapes that are mapped onto a target.
        """
        if not self.deforming:
            return []
        map = self._maps[0]
        rings = [map.image[loop] for loop in map.loops]
        if self.source.drawing is not None:
            rings = [rings[0], *move_rings(map, self.source.drawing.rings)]
        return [self.views[1].points(ring) for ring in rings]

    def _continue(self, scene: Scene, placed: PlacedConstraints, *, dragged: bool = False) -> Live:
        """Return the coarse map at the constraints `placed` of a scene."""
        pins, strokes = placed.pins, placed.strokes
        softness = self._as_met(pins, self._softness(placed.settings))
        if self._live is not None:
            return self._live.moved(pins, strokes, softness, scene.balance, dragged=dragged)
        if self._fit is None:
            raise InputError("there is no map yet; wait for the first one")
        turn = None if scene.turn == "any" else float(np.radians(scene.turn))
        asked = Settings(energy=Energy(scene.balance), turn=turn, tolerance=self.job.tolerance)
        springs = self._choices.get(self._last[0].key, MapChoice()).springs
        return Live.of(self._fit, asked, pins, strokes, softness, springs=springs, dragged=dragged)

    def _as_met(self, pins: Complex, softness: Softness | None) -> Softness | None:
        """Make pins exact that the last map meets exactly because they would miss their places as soft pins."""
        fit = self._fit
        if softness is None or fit is None or fit.softness is None or fit.softness.is_soft.all():
            return softness
        met = {tuple(pin) for pin in fit.pins[~fit.softness.is_soft].tolist()}
        is_exact = [tuple(pin) in met for pin in pins.tolist()]
        numbers = np.flatnonzero(~softness.is_given & np.array(is_exact))
        return softness.with_pins(numbers, Softness.exact(numbers.size)) if numbers.size else softness

    def transfer(self, side: str, points: Sequence[Place]) -> list[list[float]]:
        """Carry points of one side, in file coordinates, to the other; points on the outline stay on it.

        Raises:
            InputError: a point is outside its shape, or there is no map yet.
        """
        if not self._maps:
            raise InputError("there is no map yet")
        shape, other = (self.source, self.target) if side == "source" else (self.target, self.source)
        z = np.array([shape.at(point) for point in points])
        moving = self.deforming and side == "target"
        if not moving:
            check_inside(shape, "point", list(z))
        if not moving and self.job.holed and any(Curve(hole).contains(z).any() for hole in shape.holes):
            raise InputError(
                "this point is in a hole; place the pin next to it, then drag both ends into the holes to be paired"
            )
        w = np.full(z.shape, complex(np.nan, np.nan))
        for map in self._maps:
            w = np.where(np.isfinite(w), w, (map if side == "source" else map.inverse)(z))
        if not np.isfinite(w).all():
            raise InputError("this point is not part of the map; place the pin elsewhere")
        s = shape.curve.closest(z)
        rim = (np.abs(shape.curve.at(s) - z) < ON_OUTLINE_SHARE * shape.curve.diagonal) & (not self.deforming)
        w[rim] = other.curve.nearest(w[rim])
        if surface := self.surfaces[side == "source"]:
            return surface.places(w, PLACE_DIGITS)
        digits = PLACE_DIGITS - int(np.floor(np.log10(other.curve.diagonal)))
        return [[round(value, digits) for value in place] for place in other.to_file(w).tolist()]

    def read_pins(self, name: str, text: str) -> list[dict[str, Any]]:
        """Return the pins in a file chosen in the browser, in the units of the shapes' files.

        Raises:
            InputError: the file is invalid, or one of the pins is outside its shape.
        """
        listed = listing.parse(name, text.encode())
        target = self.source if self.deforming else self.target
        listed.check(self.source, target)
        pins = [_on_surface(pin, self.source, target) for pin in listed.pins_of(self.source, target)]
        self.core(scene_of(pins, [], []))
        return [pin.model_dump(mode="json") for pin in pins]

    def suggest(self, scene: Scene) -> list[dict[str, Any]]:
        """Return pins that both drawings suggest in addition to those of a scene.

        Raises:
            InputError: there is no map yet.
        """
        if self._map is None:
            raise InputError("there is no map yet")
        if self.deforming:
            return []
        pins = suggested(self._map, self.source, self.target, self.core(scene).pins)
        return [pin.model_dump(mode="json") for pin in pins]

    def handles(self, scene: Scene, rows: int, columns: int) -> list[dict[str, Any]]:
        """Return pins in rows and columns on the source where the map takes them, in addition to those of a scene.

        Raises:
            InputError: the picture would change, there is no map yet, or there would be too many pins.
        """
        if self._fit is None or self._map is None:
            raise InputError("there is no map yet")
        if self.deforming or self.surfaces != (None, None):
            raise InputError("handles are for maps from one planar shape to another")
        if scene.strokes or scene.rigid:
            raise InputError("handles do not work with strokes and rigid regions; remove those first")
        if not self._is_whole or self._fit.is_partial:
            raise InputError(
                "parts of the shapes are hidden or bare in this map, which handles would change; choose Whole "
                "outlines under Fit first"
            )
        if len(scene.pins) + rows * columns > limits.PAGE_PINS:
            raise InputError(f"at most {limits.PAGE_PINS} pins are possible; choose fewer rows and columns")
        shown = replace(self._fit, map=self._map)
        pins = handles_of(shown, self.source, self.target, rows, columns, scene.pins)
        return [pin.model_dump(mode="json") for pin in pins]

    def core(self, scene: Scene) -> PlacedConstraints:
        """Return the pins and strokes of a scene in the core plane.

        Raises:
            InputError: one of them is not inside its shape.
        """
        listed = ConstraintsFile(pins=scene.pins, strokes=scene.strokes)
        target = self.source if self.deforming else self.target
        found = constraints.collect(self.source, target, listed, exact=self.job.exact_pins)
        found.check_weights()
        pins, strokes = found.pins, found.strokes
        for side, shape in enumerate((self.source, self.target)[: 1 if self.deforming else 2]):
            check_inside(shape, "pin", list(pins[:, side]))
            for number, stroke in enumerate(strokes):
                check_inside(shape, f"stroke {number + 1}: point", list(stroke[side].z))
        return PlacedConstraints(pins, strokes, found.settings, found.stroke_widths)

    def _patches(
        self, scene: Scene, pins: Complex, known: Complex, softness: Softness | None
    ) -> list[dict[str, float] | None]:
        """Return the radius and tolerance of each soft pin of a scene in file units; None for exact pins.

        Args:
            scene: the pins as listed.
            pins: (k, 2) those pins in the core plane; more may follow.
            known: (j, 2) the pins of the map, without those in holes.
            softness: of the map's pins; None if all are exact.
        """
        if softness is None:
            return []
        target = self.source if self.deforming else self.target
        found: list[dict[str, float] | None] = []
        for here, there in pins[: len(scene.pins)]:
            own = np.flatnonzero((known[:, 0] == here) & softness.is_soft)
            if not own.size:
                found.append(None)
                continue
            radius, tolerance = (float(each[own[0]]) for each in (softness.radii, softness.tolerances))
            found.append(
                {"radius": radius / self.source.unit_at(here), "tolerance": tolerance / target.unit_at(there)}
            )
        return found


def _axis(view: PageHalf, shape: Shape) -> float | None:
    """Return the abscissa of a mirror axis in page coordinates, if there is one."""
    found = axis(shape.curve)
    return None if found is None else float(view(np.array(found))[0])


def _dumped(scene: Scene | None) -> dict[str, Any] | None:
    return None if scene is None else scene.model_dump(mode="json")


def _scene(job: Job, source: Shape, target: Shape, listed: ConstraintsFile) -> Scene:
    """Return all constraints of a job as a list: those drawn, those in its file, and those on the command line."""
    kept = constraints.collect(source, target)  # rejects names that occur in one file only
    listed.check(source, target)
    pins = [
        Pin(name=_bare(name), source=_place(source, a), target=_place(target, b), **said)
        for name, (a, b), said in zip(source.pins, kept.pins, kept.settings)
    ]
    strokes = [
        Stroke(
            name=_bare(name),
            source=[_place(source, z) for z in a.z],
            target=[_place(target, z) for z in b.z],
        )
        for name, (a, b) in zip(source.strokes, kept.strokes)
    ]
    further = [*listed.pins_of(source, target), *listing.typed_pins(job.pin)]
    pins += [_on_surface(pin, source, target) for pin in further]
    strokes += [_on_surface(stroke, source, target) for stroke in listed.strokes]
    return scene_of(pins, strokes, listed.rigid, balance=job.balance, turn=job.turn or 0.0)


def _on_surface(entry: Any, source: Shape, target: Shape) -> Any:
    """Return a pin or stroke with its places in a mesh's plane replaced by points on the surface."""
    sides = (("source", source), ("target", target))
    meshes = [(side, SurfaceView(shape)) for side, shape in sides if isinstance(shape, MeshShape)]
    found = {side: _on(surface, getattr(entry, side)) for side, surface in meshes}
    return entry.model_copy(update=found)


def _on(surface: SurfaceView, given: Any) -> Any:
    if isinstance(given, list):
        return [_on(surface, place) for place in given]
    flat = isinstance(given, tuple) and len(given) == 2
    return tuple(surface.places(surface.shape.to_core([given]), PLACE_DIGITS)[0]) if flat else given


def _bare(name: str) -> str:
    return name.partition("-")[2]


def _place(shape: Shape, z: complex) -> tuple[float, float]:
    x, y = shape.to_file(z).tolist()
    return x, y


def stem(job: Job) -> str:
    """Return the stem of the file names of a pair."""
    names = [Path(spec.partition("#")[0]).stem for spec in (job.source, job.target) if spec]
    return "-".join(names if job.target else [*names, "deformed"])
