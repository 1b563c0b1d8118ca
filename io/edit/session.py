"""An editing session: two shapes, a texture, the converged map, and a coarse map that follows dragging.

Without a target the shape is deformed: the other half of the page shows the same shape, moved by its pins.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from ...arrays import Complex, Index
from ...balanced.constraints.soft import MOST_LIMIT_RATIO, softness_of
from ...balanced.interactive import Live
from ...balanced.model.energy import Energy
from ...balanced.model.settings import Settings
from ...balanced.search.final_mesh import NARROW_AIM
from ...blas import one_thread
from ...errors import InputError
from ...maps.approximation import triangulated
from ...maps.distortion import in_middles
from ...maps.triangulated.map import TriangulatedMap
from ...pins import Softness
from ...result import Fit
from ...status import Status
from ..run.job import Job
from ..run.report import as_json
from ..shapes.starts import StartingMap
from .map_choice import MapChoice, same
from .map_update import (
    MISSED_DIAGONAL_SHARE,
    MapUpdate,
    Solved,
    blocked_sentence,
    figures,
    missed_constraints,
    refusal,
    stopped_sentence,
    verdict,
)
from .messages import Scene
from .page_view import PageView
from .pair import Pair, PlacedConstraints
from .short_pins import held_springs, stop_short
from .solving import fingerprint_of, softness_of_settings, solve_scene

FOLLOWED_LIMIT_RATIO = 1.5
"""How far a soft pin may be from its place while it is dragged, relative to its limit, since the map lags behind."""
STILL_SHARE, STILL_QUANTILE = 2e-4, 0.95
"""A map has converged if, in a step, this quantile of its vertices moves less than this share of the target's
diagonal: a sixth of a pixel of 800."""
MOST_SETTLING_SHARE = 0.005
"""How far a map may settle after a pin was released, as the same quantile, relative to the target's diagonal. What is
released stays where it was seen; further settling waits for the next drag.
"""
MOST_PICTURE_SHARE = 0.01
"""How far a released map may move from one picture to the next, in the same way, while it has not reached its pins. If
it would move farther, it stays, and the pins stop short.
"""
SHORT_AIMS = (NARROW_AIM, 0.0)
"""Distances at which soft pins stop short of their places, relative to their limits. At the first one their springs
still pull, so that the map does not give way when the next drag begins; the second one is for maps stretched so much
that the solver measures another distance.
"""
PLACED_SHARE = 1e-3  # of the target's diagonal: a new pin this close to where the map takes it moves nothing
MOST_COMPARED_PINS = 12  # a map from scratch with more takes seconds
# a map from scratch with one of these statuses does not replace another map
LOST_ON_THE_WAY = (Status.PINS, Status.GAP, Status.SOURCE_GAP)
Way = Literal["", "fresh", "kept", "search"]
Hand = Literal["", "resting", "released"]


class Session:
    """A pair of shapes being edited. One call of `follow` and one of `solve` may run at the same time."""

    def __init__(self, job: Job) -> None:
        """Read the inputs of a job.

        Raises:
            InputError: a file is invalid, or constraints do not lie in these shapes.
        """
        self.pair = Pair(job)
        self.view = PageView(self.pair)
        self.scene = self.saved = self.pair.first
        self.left: Scene | None = None
        self.written: set[str] = set()
        self._fit: Fit | None = None
        self._maps: list[TriangulatedMap] = []
        self._live: Live | None = None
        self._followed = self._shown_key = ""
        self._is_met, self._missed = False, np.empty(0, np.int64)
        self._last = (self.pair.first, MapUpdate("error", False, ""))
        self._choices: dict[str, MapChoice] = {}
        if self.pair.start:
            self.begin(self.pair.first, self.pair.start)

    def go_on_from(self, before: Session) -> None:
        """Take over the edits from a session with the same shapes and another texture."""
        self.scene, self.saved, self.left = before.scene, before.saved, before.left
        self.written, self._choices = before.written, before._choices

    @property
    def fit(self) -> Fit | None:
        """The last converged map with its figures; None before the first one."""
        return self._fit

    @property
    def maps(self) -> list[TriangulatedMap]:
        """The maps of all parts that are shown, converged or following a drag; empty before the first one."""
        return self._maps

    @property
    def _map(self) -> TriangulatedMap | None:
        """The map that is shown; if parts are mapped separately, that of the first."""
        return self._maps[0] if self._maps else None

    def describe(self) -> dict[str, Any]:
        """Return what the page needs to know before it draws: the pair, and the scenes."""
        scenes = {name: _dumped(getattr(self, name)) for name in ("scene", "saved", "left")}
        return as_json({**self.view.describe(), **scenes})

    def begin(self, scene: Scene, start: StartingMap) -> None:
        """Set the map that the map of a scene continues from.

        Raises:
            InputError: it is not a map of these shapes.
        """
        map = start.map(self.pair.source, self.pair.target)
        kept = bool(start.kept) and start.kept == fingerprint_of(self.pair, scene)
        places = self.pair.placed(scene).pins[:, 0].tolist()
        springs = dict(zip(places, start.springs)) if start.springs else None
        self._choices[scene.key] = MapChoice(map, kept=kept, springs=springs)

    def start(self, scene: Scene) -> StartingMap | None:
        """Return the map that the map of a scene continues from, which must be saved to reproduce it."""
        chosen = self._choices.get(scene.key, MapChoice())
        if chosen.begins is None:
            return None
        kept = fingerprint_of(self.pair, scene) if chosen.kept else ""
        places = self.pair.placed(scene).pins[:, 0].tolist() if chosen.springs else []
        springs = [(chosen.springs or {}).get(place, 1.0) for place in places]
        springs = springs if any(factor > 1 for factor in springs) else []
        return StartingMap.of(chosen.begins, self.pair.source, self.pair.target, kept=kept, springs=springs)

    def solve(self, scene: Scene, way: Way = "", *, hand: Hand = "") -> MapUpdate:
        """Return the converged map, continued from the last one or from scratch, as `iccm map` computes it from saved
        files.

        Where a drag ends, no search replaces the map that is seen: a pin that it does not reach stops short.

        Args:
            scene: pins and strokes.
            way: "fresh" for the map from scratch, "kept" for the continued one, if both are known; "search" to search
                for a map that meets all pins, even if it differs from the one that is seen.
            hand: what the hand that drags something is doing; empty if nothing is being dragged.
        """
        self.scene = scene
        try:
            with one_thread():
                if not way and (kept := self._kept(scene)) is not None:
                    return kept
                if not way and hand and self._can_keep(scene) and self.has_followed(scene):
                    if hand == "resting":
                        return self._blocked()
                    if (short := self._stop_short(scene)) is not None:
                        return short
                chosen = self._choices.get(scene.key) or MapChoice(self._start(scene))
                chosen = replace(chosen, fresh=way == "fresh") if way in ("fresh", "kept") else chosen
                solved, chosen = self._solve(scene, chosen)
        except InputError as error:
            return refusal(error)
        return self._settle(scene, solved, chosen)

    def _can_keep(self, scene: Scene) -> bool:
        """Return whether the map that is shown can become that of a scene as it is; strokes need other vertices."""
        is_plane = not self.pair.deforming and not self.pair.has_mesh
        return is_plane and bool(scene.pins) and not scene.strokes and not scene.rigid

    def _kept(self, scene: Scene) -> MapUpdate | None:
        """Make the map that is shown that of a scene, exactly as it is, if it meets all constraints.

        It followed a drag to there, or the scene has new pins where the map takes them anyway.
        """
        if not self._can_keep(scene):
            return None
        if self.has_followed(scene):
            assert self._live is not None
            if self._live.coarse or not self._is_met:
                return None
            seen: TriangulatedMap = self._live.start
            springs: dict[complex, float] | None = self._live.springs
        elif self._only_adds_pins(scene) and self._fit is not None:
            chosen = self._choices[self._last[0].key]
            seen = chosen.begins if chosen.kept and chosen.begins is not None else triangulated(self._fit.map)
            springs = chosen.springs if self._live is None else self._live.springs
        else:
            return None
        pair = self.pair.source, self.pair.target
        with suppress(InputError):
            start = StartingMap.of(seen, *pair, pins=self.pair.placed(scene).pins[:, 0]).map(*pair)
            chosen = MapChoice(start, kept=True, springs=springs)
            solved = solve_scene(self.pair, scene, start, kept=True)
            if self._is_kept(scene, start, solved):
                return self._settle(scene, solved, chosen, live=self._live)
        return None

    def _is_kept(self, scene: Scene, start: TriangulatedMap, solved: Solved) -> bool:
        """Return whether a solve that was to keep its start did so, and the map meets all constraints.

        If the start misses a pin as the solver measures it, the result is a map that meets the pin exactly.
        """
        if not solved.status.ok or any(missed_constraints(solved.report, scene).values()):
            return False
        return self._moved_share(self._map or start, solved.maps[0]) <= MOST_SETTLING_SHARE

    def _blocked(self) -> MapUpdate:
        """Return the update for a hand that rests where the map cannot follow."""
        missed = self._missed.tolist()
        message = blocked_sentence(missed) if missed else ""
        return MapUpdate("blocked", not missed, message, wrong={"pins": missed})

    def _stop_short(self, scene: Scene) -> MapUpdate | None:
        """Keep the map that followed a drag, and move pins that it does not reach to where it takes them.

        Returns:
            The update, with the scene whose map this is; None if the map cannot be kept.
        """
        live, shapes, missed = self._live, (self.pair.source, self.pair.target), self._missed
        if live is None or live.coarse or not missed.size:
            return None
        for aim in SHORT_AIMS:
            with suppress(InputError):
                shortened = stop_short(self.pair, scene, self._last[0], live, missed, aim)
                dragged_pins, pins = self.pair.placed(scene).pins, self.pair.placed(shortened).pins
                kept = StartingMap.of(live.start, *shapes, pins=pins[:, 0]).map(*shapes)
                solved = solve_scene(self.pair, shortened, kept, kept=True)
                if self._is_kept(shortened, kept, solved):
                    springs = held_springs(live, dragged_pins[missed], pins[missed])
                    chosen = MapChoice(kept, kept=True, springs=springs)
                    shown = self._settle(shortened, solved, chosen, asked=scene)
                    short = missed.tolist()
                    shown = replace(shown, message=stopped_sentence(short), short=short)
                    if self._last[0] is shortened:
                        self._last = shortened, shown
                    return replace(shown, scene=shortened)
        return None

    def _off(self, live: Live, map: TriangulatedMap, placed: PlacedConstraints, count: int) -> Index:
        """Return the indices (k,) of the pins, of the first `count`, that a map takes too far from their places.

        Soft pins are measured; exact pins are off only as long as the map that follows has not reached them.
        """
        pins = placed.pins[:count]
        softness = softness_of(placed.pins, live.patches.points, live.patches.softness).of_pins(
            np.arange(count)
        )
        gaps = np.abs(map(pins[:, 0]) - pins[:, 1])
        is_off = np.where(
            softness.is_soft,
            gaps > MOST_LIMIT_RATIO * softness.limits,
            (not live.met) & (gaps > MISSED_DIAGONAL_SHARE * self.pair.target.curve.diagonal),
        )
        return np.flatnonzero(is_off)

    def _only_adds_pins(self, scene: Scene) -> bool:
        """Return whether a scene differs from the last one by new pins only, which are where the map takes them."""
        last, map = self._last[0], self._map
        if (
            self._fit is None
            or map is None
            or scene.key in self._choices
            or not (scene.whole and self.is_whole)
        ):
            return False
        ends = [(pin.source, pin.target) for pin in last.pins]
        more = [pin for pin in scene.pins if (pin.source, pin.target) not in ends]
        others = scene.model_copy(update={"pins": [pin for pin in scene.pins if pin not in more]})
        if not more or others.key != last.key:
            return False
        placed = self.pair.placed(scene.model_copy(update={"pins": more})).pins
        gaps = np.abs(map(placed[:, 0]) - placed[:, 1])
        return bool((gaps <= PLACED_SHARE * self.pair.target.curve.diagonal).all())

    def compare(self, scene: Scene) -> MapUpdate | None:
        """Compare a continued map with the one from scratch; return an update of the page if there is something to
        report.

        If they look the same, the map from scratch replaces the other: then only pins and strokes have to be saved.
        Otherwise it is offered, because nothing that is seen changes without the user. Maps of meshes and of many pins
        are not compared, because each takes seconds.
        """
        if self.pair.has_mesh or len(scene.pins) > MOST_COMPARED_PINS:
            return None
        chosen, before = self._choices.get(scene.key, MapChoice()), self._fit
        if chosen.begins is None or chosen.other or before is None or self.scene is not scene:
            return None
        try:
            with one_thread():
                solved = solve_scene(self.pair, scene, None)
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
        pair = self.pair.source, self.pair.target
        try:
            found = self._before(scene)
            if found is None:
                return None
            return StartingMap.of(found, *pair, pins=self.pair.placed(scene).pins[:, 0]).map(*pair)
        except InputError:  # what is wrong with the scene will be reported from scratch, too
            return None

    def _before(self, scene: Scene) -> TriangulatedMap | None:
        """Return the coarse map that follows, or the last converged one.

        None without pins, after a change of the rotation, for partial maps, and with rigid regions.
        """
        fit, last = self._fit, self._last[0]
        if self.pair.deforming:
            return self._map if scene.constrained else None
        if scene.rigid or last.rigid:
            return None
        if (
            fit is None
            or not (scene.constrained and scene.whole and self.is_whole)
            or scene.turn != last.turn
        ):
            return None
        if self._live is None and scene.balance == last.balance:
            return fit.map  # type: ignore[return-value]
        if self._live is not None and self._followed == scene.key:
            return self._live.start
        return self._continue(scene, self.pair.placed(scene)).start

    @property
    def is_whole(self) -> bool:
        """Whether the last converged map covers the whole outlines, or the tightest frames, with all holes, so that a
        map with pins and strokes may continue from it.
        """
        fit = self._fit
        if self._last[0].whole:
            return True
        if fit is None or len(self._maps) > 1 or fit.is_partial or fit.target is None:
            return False
        if self.pair.has_mesh:
            return True
        holes = len(self._maps[0].loops) - 1
        return all(
            np.array_equal(outline.z, shape.curve.z) and holes == len(shape.mappable_holes)
            for outline, shape in ((fit.source, self.pair.source), (fit.target, self.pair.target))
        )

    def _solve(self, scene: Scene, chosen: MapChoice) -> tuple[Solved, MapChoice]:
        """Return the map computed in the chosen way, or from scratch if that fails."""
        gone_on = None
        if chosen.begins is not None:
            with suppress(InputError):
                gone_on = solve_scene(self.pair, scene, chosen.begins, kept=chosen.kept), chosen
                if gone_on[0].status not in LOST_ON_THE_WAY:
                    return gone_on
            chosen = MapChoice()
        try:
            fresh = solve_scene(self.pair, scene, None), chosen
        except InputError:
            if gone_on is None:
                raise
            return gone_on
        return fresh if gone_on is None or fresh[0].status.ok else gone_on

    def _settle(
        self,
        scene: Scene,
        solved: Solved,
        chosen: MapChoice,
        *,
        live: Live | None = None,
        asked: Scene | None = None,
    ) -> MapUpdate:
        """Return the update that shows a map, and make the map the current one if it meets the constraints.

        Args:
            scene: pins and strokes.
            solved: the map.
            chosen: how it was computed.
            live: the same map as the next drag continues it; None to begin with the converged one.
            asked: the scene that the page requested, if it is another one.
        """
        report, status = solved.report, solved.status
        wrong = missed_constraints(report, scene)
        if any(wrong.values()) and self._map is not None:
            return MapUpdate("error", False, status.value, {}, wrong)
        drawn = self.view.image_of(solved.maps)
        said = (
            figures(report) | {"regions": self.view.regions(solved.fit, report)},
            wrong,
            drawn,
            chosen.alternative,
            chosen.gain,
        )
        shown = MapUpdate("full", status.ok, verdict(status, report, deformed=self.pair.deforming), *said)
        shown = replace(
            shown, patches=self.view.soft_pins(scene, solved.pins, solved.fit.pins, solved.fit.softness)
        )
        self._choices[scene.key] = chosen
        if self.scene is (asked or scene):  # else something is being dragged again, from the map as it was
            self._fit, self._maps, self._live, self._shown_key = solved.fit, solved.maps, live, ""
            self._last = scene, shown = (
                scene,
                replace(shown, outlines=self.view.deformed_rings(solved.maps[0])),
            )
        return shown

    def follow(self, scene: Scene) -> MapUpdate:
        """Return the coarse map, continued from the last one. There is none if only parts of the shapes correspond."""
        if self.pair.deforming:
            return self._bend(scene)
        if not (scene.whole and self.is_whole):
            return MapUpdate(
                "coarse",
                True,
                "The map is updated when you release the pin, because parts of the "
                "shapes are hidden or bare.",
            )
        try:
            with one_thread():
                placed = self.pair.placed(scene)
                self._live = live = self._continue(scene, placed, dragged=True)
                map, self._followed = live.map, scene.key if live.met else ""
                self._shown_key = scene.key
                found = MapUpdate(
                    "coarse", live.met, "", in_middles(map).report(), {}, self.view.image_of([map])
                )
        except InputError as error:
            return refusal(error)
        self._maps = [map]
        pins = placed.pins
        softness = softness_of(pins, live.patches.points, live.patches.softness)
        found = replace(found, patches=self.view.soft_pins(scene, pins, pins, softness))
        gap = np.abs(map(pins[:, 0]) - pins[:, 1])
        self._missed = self._off(live, map, placed, len(scene.pins))
        self._is_met = live.met and not self._missed.size
        is_off = np.isin(np.arange(len(pins)), self._missed)
        missed = np.where(softness.is_soft, gap > FOLLOWED_LIMIT_RATIO * softness.limits, is_off)
        if live.met and not missed.any():
            return found
        found = replace(found, ok=False)
        wrong = {"pins": np.flatnonzero(missed[: len(scene.pins)]).tolist()}
        message = "The pin is not there yet: the picture follows as far as possible without folds."
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
        before, live, was_met, missed = self._map, self._live, self._is_met, self._missed
        if self.pair.deforming or before is None or not (scene.whole and self.is_whole):
            return None
        shown, after = self.follow(scene), self._map
        if shown.kind == "error" or after is None:
            return None
        moved = self._moved_share(before, after)
        if moved < STILL_SHARE:
            return None
        if released is None:
            return shown
        settled = (
            self._moved_share(released, after) > MOST_SETTLING_SHARE
            if was_met
            else moved > MOST_PICTURE_SHARE
        )
        if settled:
            self._live, self._maps, self._is_met, self._missed = live, [before], was_met, missed
            return None
        return shown

    def is_behind(self, scene: Scene) -> bool:
        """Return whether the hand came to rest, or released, before the map had followed it to a scene."""
        follows = not self.pair.deforming and self._live is not None
        return follows and scene.key not in self._choices and not self.has_followed(scene)

    def seen(self) -> TriangulatedMap | None:
        """Return the map that is shown."""
        return self._map

    def _moved_share(self, before: TriangulatedMap, after: TriangulatedMap) -> float:
        """Return how far the images of most points moved, relative to the target's diagonal."""
        inner = np.setdiff1d(np.arange(before.source.size), np.concatenate(before.loops))
        moved = np.abs(after(before.source[inner]) - before.image[inner])
        return float(np.nanquantile(moved, STILL_QUANTILE)) / self.pair.target.curve.diagonal

    def _bend(self, scene: Scene) -> MapUpdate:
        """Return the deformation, continued from the previous one."""
        try:
            with one_thread():
                solved = solve_scene(self.pair, scene, self._map)
        except InputError as error:
            return refusal(error)
        self._maps = solved.maps
        report, drawn = solved.report, self.view.image_of(solved.maps)
        wrong = missed_constraints(report, scene)
        met = not any(wrong.values())
        message = (
            "" if met else "The pin is not there yet: the shape follows as far as possible without folds."
        )
        outlines = self.view.deformed_rings(solved.maps[0])
        patches = self.view.soft_pins(scene, solved.pins, solved.fit.pins, solved.fit.softness)
        return MapUpdate(
            "coarse", met, message, figures(report), wrong, drawn, outlines=outlines, patches=patches
        )

    def _continue(self, scene: Scene, placed: PlacedConstraints, *, dragged: bool = False) -> Live:
        """Return the coarse map at the constraints `placed` of a scene."""
        pins, strokes = placed.pins, placed.strokes
        softness = self._as_met(pins, softness_of_settings(self.pair, placed.settings))
        if self._live is not None:
            return self._live.moved(pins, strokes, softness, scene.balance, dragged=dragged)
        if self._fit is None:
            raise InputError("there is no map yet; wait for the first one")
        turn = None if scene.turn == "any" else float(np.radians(scene.turn))
        asked = Settings(energy=Energy(scene.balance), turn=turn, tolerance=self.pair.job.tolerance)
        chosen = self._choices.get(self._last[0].key, MapChoice())
        return Live.of(
            self._fit,
            asked,
            pins,
            strokes,
            softness,
            covering_map=chosen.begins if chosen.kept else None,
            springs=chosen.springs,
            dragged=dragged,
        )

    def _as_met(self, pins: Complex, softness: Softness | None) -> Softness | None:
        """Make pins exact that the last map meets exactly because they would miss their places as soft pins."""
        fit = self._fit
        if softness is None or fit is None or fit.softness is None or fit.softness.is_soft.all():
            return softness
        met = {tuple(pin) for pin in fit.pins[~fit.softness.is_soft].tolist()}
        is_exact = [tuple(pin) in met for pin in pins.tolist()]
        numbers = np.flatnonzero(~softness.is_given & np.array(is_exact))
        return softness.with_pins(numbers, Softness.exact(numbers.size)) if numbers.size else softness


def _dumped(scene: Scene | None) -> dict[str, Any] | None:
    return None if scene is None else scene.model_dump(mode="json")
