"""An editing session: two shapes, a texture, the converged map, and a coarse map that follows dragging.

Without a target the shape is deformed: the other half of the page shows the same shape, moved by its pins.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from typing import Any, Literal, NamedTuple

import numpy as np

from ...arrays import Complex, Index
from ...balanced.constraints.soft import MOST_LIMIT_RATIO, softness_of
from ...balanced.interactive import Live
from ...balanced.search.final_mesh import NARROW_AIM
from ...balanced.warped import TargetWarp, WarpedLive
from ...blas import one_thread
from ...errors import Cancelled, InputError
from ...fits import FITS
from ...maps.distortion import in_middles
from ...maps.joined import images, joined
from ...maps.triangulated.map import TriangulatedMap
from ...options import Options
from ...pins import Softness
from ...progress import listening
from ...result import Fit
from ...status import Status
from ..run.job import Job
from ..run.maps import cost_of_fit
from ..run.report import as_json
from ..shapes.starts import StartingMap
from .map_choice import MapChoice, greatest_displacement, same
from .map_update import (
    MISSED_DIAGONAL_SHARE,
    NOTABLE_COST_RATIO,
    MapUpdate,
    Solved,
    blocked_sentence,
    figures,
    missed_constraints,
    missed_sentence,
    reached_sentence,
    refusal,
    stopped_sentence,
    verdict,
    whole_sentence,
)
from .messages import Scene
from .page_view import PageView
from .pair import Pair, PlacedConstraints
from .short_pins import held_springs, stop_short
from .solving import fingerprint_of, softness_of_settings, solve_scene

FOLLOWED_LIMIT_RATIO = 1.5
"""How far a soft pin may be from its place while it is dragged, relative to its limit, since the map lags behind."""
STILL_SHARE = 2e-4
"""A map has converged if its displacement in a step is less than this share of the target's diagonal: a sixth of a
pixel of 800."""
MOST_SETTLING_SHARE = 0.005
"""Largest displacement by which a map settles after a pin was released, relative to the target's diagonal. What is
released stays where it was seen: further settling waits for the next drag, and a pin that is not reached stops short.
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
_Content = tuple[dict[str, Any], TriangulatedMap | None]
"""What a file of constraints holds: pins, strokes and rigid regions, and the map to continue from."""


class Left(NamedTuple):
    """What an earlier session on this computer left unsaved.

    Attributes:
        scene: its pins and strokes.
        when: time of the last change.
    """

    scene: Scene
    when: datetime


class Session:
    """A pair of shapes being edited. One call each of `follow`, `answer` and `compare` may run at the same time."""

    def __init__(self, job: Job) -> None:
        """Read the inputs of a job.

        Raises:
            InputError: a file is invalid, or constraints do not lie in these shapes.
        """
        self.pair = Pair(job)
        self.view = PageView(self.pair)
        self.scene = self.saved = self.pair.first
        self.left: Left | None = None
        self.written: set[str] = set()
        self._files: tuple[_Content, dict[str, str]] | None = None
        self._fit: Fit | None = None
        self._maps: list[TriangulatedMap] = []
        self._live: Live | WarpedLive | None = None
        self._warp: TargetWarp | None = None
        self._followed = self._shown_key = ""
        self._is_met, self._missed = False, np.empty(0, np.int64)
        self._last = (self.pair.first, MapUpdate("error", False, ""))
        self._choices: dict[str, MapChoice] = {}
        if self.pair.start:
            self.begin(self.pair.first, self.pair.start)
        if not job.pin and job.constraints != "-":
            self.note_files(self.pair.first, {"constraints": job.constraints} if job.constraints else {})

    def take_over(self, previous: Session) -> None:
        """Take over the edits from a session with the same shapes and another texture."""
        self.scene, self.saved, self.left = previous.scene, previous.saved, previous.left
        self.written, self._choices, self._files = previous.written, previous._choices, previous._files

    def note_files(self, scene: Scene, fields: dict[str, str]) -> None:
        """Note the files that hold a scene and the map that it continues from, as fields of a job."""
        self._files = self._content(scene), fields

    def files_with(self, scene: Scene) -> dict[str, str] | None:
        """Return the fields of a job that name files with a scene and the map that it continues from; None if it has
        not been saved.
        """
        if self._files is None:
            return None
        (parts, begins), fields = self._files
        now_parts, now_begins = self._content(scene)
        return fields if parts == now_parts and begins is now_begins else None

    def _content(self, scene: Scene) -> _Content:
        begins = self._choices.get(scene.key, MapChoice()).begins
        return scene.model_dump(include={"pins", "strokes", "rigid"}), begins

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
        scenes = {"scene": self.scene, "saved": self.saved, "left": self.left and self.left.scene}
        dumped = {name: _dumped(scene) for name, scene in scenes.items()}
        when = self.left.when.isoformat() if self.left else ""
        return as_json({**self.view.describe(), **dumped, "left_when": when})

    def begin(self, scene: Scene, start: StartingMap) -> None:
        """Set the map that the map of a scene continues from.

        Raises:
            InputError: it is not a map of these shapes.
        """
        map = start.map(self.pair.source, self.pair.target)
        is_result = bool(start.kept) and start.kept == fingerprint_of(self.pair, scene)
        places = self.pair.placed(scene).pins[:, 0].tolist()
        springs = dict(zip(places, start.springs)) if start.springs else None
        self._choices[scene.key] = MapChoice(map, kept=is_result, springs=springs)

    def start(self, scene: Scene) -> StartingMap | None:
        """Return the map that the map of a scene continues from, which must be saved to reproduce it."""
        choice = self._choices.get(scene.key, MapChoice())
        if choice.begins is None:
            return None
        fingerprint = fingerprint_of(self.pair, scene) if choice.kept else ""
        places = self.pair.placed(scene).pins[:, 0].tolist() if choice.springs else []
        springs = [(choice.springs or {}).get(place, 1.0) for place in places]
        springs = springs if any(factor > 1 for factor in springs) else []
        return StartingMap.of(
            choice.begins, self.pair.source, self.pair.target, kept=fingerprint, springs=springs
        )

    def solve(self, scene: Scene, way: Way = "", *, hand: Hand = "") -> MapUpdate:
        """Make a scene the current one, and return its map as `answer` does."""
        self.scene = scene
        return self.answer(scene, way, hand=hand)

    def answer(self, scene: Scene, way: Way = "", *, hand: Hand = "") -> MapUpdate:
        """Return the converged map, continued from the last one or from scratch, as `iccm map` computes it from saved
        files. It becomes the one that is shown if its scene is still the current one.

        Where a drag ends, no search replaces the map that is seen: a pin that it does not reach stops short.

        Args:
            scene: pins and strokes.
            way: "fresh" for the map from scratch, "kept" for the continued one, if both are known; "search" to search
                for a map that meets all pins, even if it differs from the one that is seen.
            hand: what the hand that drags something is doing; empty if nothing is being dragged. If it releases a map
                that had converged, `way` is the one that was seen.
        """
        if hand == "released" and self._is_shown(scene, way):
            return replace(self._last[1], drawn=None)
        try:
            with one_thread():
                if not way and (kept_update := self._kept(scene)) is not None:
                    return kept_update
                if not way and hand and self._can_keep(scene) and self.has_followed(scene):
                    if hand == "resting":
                        return self._blocked()
                    if (short := self._stop_short(scene)) is not None:
                        return short
                if not way and (warped_update := self._warped(scene)) is not None:
                    return warped_update
                choice = self._choices.get(scene.key) or MapChoice(self._start(scene))
                choice = replace(choice, fresh=way == "fresh") if way in ("fresh", "kept") else choice
                solved, choice = self._solve(scene, choice)
        except InputError as error:
            return refusal(error)
        earlier, last_scene = self._fit, self._last[0]
        update = self._settle(scene, solved, choice)
        first = scene.constrained and not last_scene.constrained and scene.fit == last_scene.fit
        if (
            first
            and update.ok
            and earlier is not None
            and earlier.coverage.is_partial
            and not solved.fit.coverage.is_partial
        ):
            return replace(update, message=f"{update.message} {whole_sentence()}")
        return update

    def _is_shown(self, scene: Scene, way: Way) -> bool:
        """Return whether one of the two known maps of a scene is the one that is shown."""
        choice = self._choices.get(scene.key)
        if choice is None or not way or scene.key != self._last[0].key or self.has_followed(scene):
            return False
        return choice.fresh == (way == "fresh")

    def _warps(self, scene: Scene) -> bool:
        """Return whether the map of a scene is the one that is seen, with a deformation of the target after it."""
        last_scene = self._last[0]
        settings = {"pins": last_scene.pins}
        return (
            self._warp is not None
            and not self.pair.job.exact_pins
            and self._can_keep(scene)
            and scene.model_copy(update=settings).key == last_scene.key
            and all(pin.radius != 0 and pin.turn is None and pin.scale is None for pin in scene.pins)
        )

    def _warped(self, scene: Scene) -> MapUpdate | None:
        """Make the map that is seen that of a scene, with a deformation of the target after it that moves the pins.

        Returns:
            The update; None if there is no such map, or it does not meet the pins.
        """
        if not self._warps(scene) or scene.key in self._choices:
            return None
        with suppress(InputError):
            placed = self.pair.placed(scene)
            live = self._continue(scene, placed)
            assert isinstance(live, WarpedLive)
            if self._off(live, placed, len(scene.pins)).size:
                return None
            start = self._as_saved(live.start, scene)
            choice = MapChoice(start, kept=True, springs=live.springs, warp=live.warp)
            solved = solve_scene(self.pair, scene, start, kept=True)
            is_same = self._moved_share(live.maps, solved.maps) <= MOST_SETTLING_SHARE
            if is_same and solved.status.ok and not any(missed_constraints(solved.report, scene).values()):
                return self._settle(scene, solved, choice, live=live)
        return None

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
        warp = self._warp
        if self.has_followed(scene):
            assert self._live is not None
            if self._live.coarse or not self._is_met:
                return None
            visible: TriangulatedMap = self._live.start
            springs: dict[complex, float] | None = self._live.springs
            if isinstance(self._live, WarpedLive):
                warp = self._live.warp
        elif self._only_adds_pins(scene) and self._fit is not None:
            choice = self._choices.get(self._last[0].key, MapChoice())
            is_kept = choice.kept and choice.begins is not None
            visible = choice.begins if is_kept else joined(self._maps)  # type: ignore[assignment]
            springs = choice.springs if self._live is None else self._live.springs
        else:
            return None
        with suppress(InputError):
            start = self._as_saved(visible, scene)
            choice = MapChoice(start, kept=True, springs=springs, warp=warp)
            solved = solve_scene(self.pair, scene, start, kept=True)
            if self._is_kept(scene, solved):
                return self._settle(scene, solved, choice, live=self._live)
        return None

    def _is_kept(self, scene: Scene, solved: Solved) -> bool:
        """Return whether a solve that was to keep its start did so, and the map meets all constraints.

        If the start misses a pin as the solver measures it, the result is a map that meets the pin exactly.
        """
        if not solved.status.ok or any(missed_constraints(solved.report, scene).values()):
            return False
        return self._moved_share(self._maps, solved.maps) <= MOST_SETTLING_SHARE

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
        live, missed = self._live, self._missed
        if live is None or live.coarse or not missed.size:
            return None
        dragged_pins = self.pair.placed(scene).pins
        for aim in SHORT_AIMS:
            with suppress(InputError):
                shortened = stop_short(self.pair, scene, self._last[0], live, missed, aim)
                start, pins = self._as_saved(live.start, shortened), self.pair.placed(shortened).pins
                solved = solve_scene(self.pair, shortened, start, kept=True)
                if self._is_kept(shortened, solved):
                    springs = held_springs(live, dragged_pins[missed], pins[missed])
                    warp = live.warp if isinstance(live, WarpedLive) else None
                    chosen = MapChoice(start, kept=True, springs=springs, warp=warp)
                    update = self._settle(shortened, solved, chosen, requested=scene)
                    short = missed.tolist()
                    update = replace(update, message=stopped_sentence(short), short=short)
                    if self._last[0] is shortened:
                        self._last = shortened, update
                    return replace(update, scene=shortened)
        return None

    def _off(self, live: Live | WarpedLive, placed: PlacedConstraints, count: int) -> Index:
        """Return the indices (k,) of the pins, of the first `count`, that a map which follows takes too far from their
        places.

        Soft pins are measured; exact pins are off only as long as the map that follows has not reached them.
        """
        pins = placed.pins[:count]
        softness = softness_of(placed.pins, live.patches.points, live.patches.softness).of_pins(
            np.arange(count)
        )
        gaps = np.abs(images(live.maps, pins[:, 0]) - pins[:, 1])
        is_off = np.where(
            softness.is_soft,
            gaps > MOST_LIMIT_RATIO * softness.limits,
            (not live.met) & (gaps > MISSED_DIAGONAL_SHARE * self.pair.target.curve.diagonal),
        )
        return np.flatnonzero(is_off)

    def _only_adds_pins(self, scene: Scene) -> bool:
        """Return whether a scene differs from the last one by new pins only, which are where the map takes them."""
        last_scene = self._last[0]
        if self._fit is None or not self._maps or scene.key in self._choices or not self._follows(scene):
            return False
        ends = [(pin.source, pin.target) for pin in last_scene.pins]
        new_pins = [pin for pin in scene.pins if (pin.source, pin.target) not in ends]
        without_new = scene.model_copy(update={"pins": [pin for pin in scene.pins if pin not in new_pins]})
        keeps_form = any(pin.radius for pin in new_pins)  # then the map has to change there
        if not new_pins or keeps_form or without_new.key != last_scene.key:
            return False
        placed = self.pair.placed(scene.model_copy(update={"pins": new_pins})).pins
        gaps = np.abs(images(self._maps, placed[:, 0]) - placed[:, 1])
        return bool((gaps <= PLACED_SHARE * self.pair.target.curve.diagonal).all())

    def compare(self, scene: Scene, *, resting: bool = False) -> MapUpdate | None:
        """Compare a continued map with the one from scratch; return an update of the page if there is something to
        report.

        If they look the same, the map from scratch replaces the other: then only pins and strokes have to be saved.
        Otherwise it is offered, because nothing that is seen changes without the user. Maps of meshes and of many pins
        are not compared, because each takes seconds.

        Where the hand still holds what it dragged, what replaces the map is seen before it is released. Then a map
        from scratch replaces it if that costs much less, and a map that reaches the pins if the one that
        is seen cannot.

        Args:
            scene: pins and strokes. The comparison ends without a result as soon as they change, or are released.
            resting: whether the hand still holds what it dragged.
        """
        with suppress(InputError, Cancelled), one_thread(), listening(None, lambda: self.scene is not scene):
            if resting and self.has_followed(scene):
                return self._reach(scene)
            return self._compare(scene, resting=resting)
        return None

    def _compare(self, scene: Scene, *, resting: bool) -> MapUpdate | None:
        """Compare a continued map with the one from scratch."""
        if self.pair.has_mesh or len(scene.pins) > MOST_COMPARED_PINS:
            return None
        choice, fit = self._choices.get(scene.key, MapChoice()), self._fit
        if choice.begins is None or choice.other or fit is None:
            return None
        solved = solve_scene(self.pair, scene, None)
        if any(missed_constraints(solved.report, scene).values()):
            return None
        is_alike = len(self._maps) == len(solved.maps) == 1
        if is_alike and same(fit.map, solved.maps[0]):  # type: ignore[arg-type]
            return self._replace(scene, solved, MapChoice(), live=None if self._warp else self._live)
        ratio = cost_of_fit(fit) / cost_of_fit(solved.fit) if is_alike and solved.status.ok else 1.0
        choice = replace(choice, other=True, cost_ratio=ratio)
        is_replaced = resting and self._warp is None and not solved.fit.coverage.is_partial
        if is_replaced and ratio > NOTABLE_COST_RATIO:
            return self._replace(scene, solved, replace(choice, fresh=True))
        if self.scene is not scene:
            return None
        self._choices[scene.key] = choice
        self._last = scene, replace(self._last[1], other=choice.alternative, cost_ratio=ratio)
        return replace(self._last[1], drawn=None)

    def _reach(self, scene: Scene) -> MapUpdate | None:
        """Return the update that shows a map which meets all pins, where the one that is seen cannot follow them."""
        if self._warp is not None:
            return None  # another fit is for the person to ask for
        missed = self._missed.tolist()
        solved, choice = self._solve(scene, MapChoice(self._start(scene)))
        if not solved.status.ok or any(missed_constraints(solved.report, scene).values()):
            return None
        return self._replace(scene, solved, choice, message=reached_sentence(missed) if missed else "")

    def _replace(
        self,
        scene: Scene,
        solved: Solved,
        choice: MapChoice,
        *,
        live: Live | WarpedLive | None = None,
        message: str = "",
    ) -> MapUpdate | None:
        """Return the update that shows a map in place of another one of the same scene; None if the hand has moved on
        or has released the other one.
        """
        update = self._full(scene, solved, choice)
        if message:
            update = replace(update, message=message)
        if self.scene is not scene:
            return None
        self._choices[scene.key] = choice
        return self._show(scene, solved, update, live)

    def _start(self, scene: Scene) -> TriangulatedMap | None:
        """Return the map to continue from, rounded as in a file; None to start from scratch."""
        try:
            start = self._before(scene)
            return None if start is None else self._as_saved(start, scene)
        except InputError:  # what is wrong with the scene will be reported from scratch, too
            return None

    def _as_saved(self, map: TriangulatedMap, scene: Scene) -> TriangulatedMap:
        """Return a map as a file with the pins of a scene holds it: rounded, finely where pins are."""
        sides = self.pair.source, self.pair.target
        return StartingMap.of(map, *sides, pins=self.pair.placed(scene).pins[:, 0]).map(*sides)

    def _before(self, scene: Scene) -> TriangulatedMap | None:
        """Return the coarse map that follows, or the last converged one.

        None without pins, after a change of the rotation, for partial maps and warped ones, and with rigid regions.
        """
        fit, last_scene = self._fit, self._last[0]
        if self.pair.deforming:
            return self._map if scene.constrained else None
        if scene.rigid or last_scene.rigid or self._warp is not None:
            return None
        if (
            fit is None
            or not (scene.constrained and scene.whole and self.is_whole)
            or scene.turn != last_scene.turn
        ):
            return None
        if self._live is None and scene.balance == last_scene.balance:
            return fit.map  # type: ignore[return-value]
        if self._live is not None and self._followed == scene.key:
            return self._live.start
        return self._continue(scene, self.pair.placed(scene)).start

    def _follows(self, scene: Scene) -> bool:
        """Return whether the map that is shown can follow to a scene while its pins are dragged."""
        return self._warps(scene) or (self._warp is None and scene.whole and self.is_whole)

    @property
    def is_whole(self) -> bool:
        """Whether the last converged map covers whole frames of both drawings, or the whole outlines with all holes, so
        that a map with pins and strokes may continue from it.
        """
        fit = self._fit
        if self._last[0].whole:
            return True
        if fit is None or len(self._maps) > 1 or fit.coverage.is_partial or fit.target is None:
            return False
        if self.pair.has_mesh or fit.details.drawings is not None:
            return True
        holes = len(self._maps[0].loops) - 1
        return all(
            np.array_equal(outline.z, shape.curve.z) and holes == len(shape.mappable_holes)
            for outline, shape in ((fit.source, self.pair.source), (fit.target, self.pair.target))
        )

    def _solve(self, scene: Scene, choice: MapChoice) -> tuple[Solved, MapChoice]:
        """Return the map computed in the chosen way, or from scratch if that fails."""
        continued = None
        if choice.begins is not None:
            with suppress(InputError):
                continued = solve_scene(self.pair, scene, choice.begins, kept=choice.kept), choice
                if continued[0].status not in LOST_ON_THE_WAY:
                    return continued
            choice = MapChoice()
        try:
            fresh = solve_scene(self.pair, scene, None), choice
        except InputError:
            if continued is None:
                raise
            return continued
        return fresh if continued is None or fresh[0].status.ok else continued

    def _settle(
        self,
        scene: Scene,
        solved: Solved,
        choice: MapChoice,
        *,
        live: Live | WarpedLive | None = None,
        requested: Scene | None = None,
    ) -> MapUpdate:
        """Return the update that shows a map, and make the map the current one if it meets the constraints.

        Args:
            scene: pins and strokes.
            solved: the map.
            choice: how it was computed.
            live: the same map as the next drag continues it; None to begin with the converged one.
            requested: the scene that the page requested, if it is another one.
        """
        wrong = missed_constraints(solved.report, scene)
        if any(wrong.values()) and self._map is not None:
            message = missed_sentence(wrong) if solved.status.ok else solved.status.value
            return MapUpdate("error", False, message, {}, wrong)
        update = self._full(scene, solved, choice)
        self._choices[scene.key] = choice
        if self.scene is (
            requested or scene
        ):  # else something is being dragged again, from the map as it was
            update = self._show(scene, solved, update, live)
        return update

    def _full(self, scene: Scene, solved: Solved, choice: MapChoice) -> MapUpdate:
        """Return the update for a map of a scene, computed as in `choice`."""
        report, status = solved.report, solved.status
        wrong = missed_constraints(report, scene)
        image = self.view.image_of(solved.maps)
        details = (
            figures(report) | {"regions": self.view.regions(solved.fit, report)},
            wrong,
            image,
            choice.alternative,
            choice.cost_ratio,
        )
        bent = self.view.bent(solved.maps)
        message = verdict(
            status, report, deformed=self.pair.deforming, constrained=scene.constrained, bent=len(bent)
        )
        return replace(
            MapUpdate("full", status.ok, message, *details, bent=bent),
            patches=self.view.soft_pins(scene, solved.pins, *solved.soft_pins),
            silhouette=self.view.silhouette(solved.silhouette),
        )

    def _show(
        self, scene: Scene, solved: Solved, update: MapUpdate, live: Live | WarpedLive | None
    ) -> MapUpdate:
        """Make a map the one that is shown, and return its update."""
        self._fit, self._maps, self._shown_key = solved.fit, solved.maps, ""
        self._live = None if live is None else live.released
        self._warp = self._choices.get(scene.key, MapChoice()).warp or self._begin_warp(scene, solved)
        update = replace(update, outlines=self.view.deformed_rings(solved.maps[0]))
        self._last = scene, update
        return update

    def _begin_warp(self, scene: Scene, solved: Solved) -> TargetWarp | None:
        """Return what deforms a map, or those of several parts, after it; None if the map leaves nothing out, and can
        follow alone.
        """
        fits = solved.fits
        if self.pair.deforming or self.pair.has_mesh or not solved.status.ok:
            return None
        is_alone = len(fits) == 1 and not fits[0].coverage.is_partial and not FITS[scene.fit].leaves_out_parts
        return None if is_alone or fits[0].details.place != "fill" else TargetWarp.of(fits)

    def follow(self, scene: Scene) -> MapUpdate:
        """Return the coarse map, continued from the last one. There is none if only parts of the shapes correspond."""
        if self.pair.deforming:
            return self._bend(scene)
        if not self._follows(scene):
            return MapUpdate(
                "coarse",
                True,
                "The map is updated when you release the pin, because parts of the "
                "shapes are hidden or bare.",
            )
        try:
            with one_thread():
                placed = self.pair.placed(scene)
                self._live = live = self._followed_or_kept(scene, placed)
                map, self._followed = live.map, scene.key if live.met else ""
                self._shown_key = scene.key
                maps = live.maps
                update = MapUpdate(
                    "coarse", live.met, "", in_middles(map).report(), {}, self.view.image_of(maps)
                )
        except InputError as error:
            return refusal(error)
        self._maps = maps
        pins = placed.pins
        softness = softness_of(pins, live.patches.points, live.patches.softness)
        update = replace(update, patches=self.view.soft_pins(scene, pins, pins, softness))
        gap = np.abs(images(maps, pins[:, 0]) - pins[:, 1])
        self._missed = self._off(live, placed, len(scene.pins))
        self._is_met = live.met and not self._missed.size
        is_off = np.isin(np.arange(len(pins)), self._missed)
        missed = np.where(softness.is_soft, gap > FOLLOWED_LIMIT_RATIO * softness.limits, is_off)
        if live.met and not missed.any():
            return update
        update = replace(update, ok=False)
        wrong = {"pins": np.flatnonzero(missed[: len(scene.pins)]).tolist()}
        message = "The pin is not there yet: the picture follows as far as possible without folds."
        return replace(update, wrong=wrong, message=message)

    def _followed_or_kept(self, scene: Scene, placed: PlacedConstraints) -> Live | WarpedLive:
        """Return the coarse map at the constraints `placed` of a scene; the last one where a deformation cannot follow.

        Raises:
            InputError: there is neither.
        """
        earlier = self._live
        try:
            live = self._continue(scene, placed, dragged=True)
            _ = live.map  # which may fail, too
        except InputError:
            sources = placed.pins[:, 0]
            if isinstance(earlier, WarpedLive) and np.isin(sources, earlier.patches.points[:, 0]).all():
                return earlier
            raise
        return live

    def has_followed(self, scene: Scene) -> bool:
        """Return whether the map that is shown followed a drag to the pins and strokes of a scene."""
        return self._live is not None and self._shown_key == scene.key

    def relax(self, scene: Scene, released: Sequence[TriangulatedMap] | None = None) -> MapUpdate | None:
        """Return the coarse map after further steps at the same constraints; None once it hardly moves.

        One update of a drag has no time for all Newton steps that its map needs. The rest is done while the hand rests,
        so that the map seen then is the one after the release.

        Args:
            scene: pins and strokes.
            released: the maps that were seen when the pin was released. Once the constraints are met, the map stays
                near it.
        """
        earlier, live, was_met, missed = self._maps, self._live, self._is_met, self._missed
        if self.pair.deforming or not earlier or not self._follows(scene):
            return None
        update, relaxed = self.follow(scene), self._maps
        if update.kind == "error":
            return None
        share = self._moved_share(earlier, relaxed)
        if share < STILL_SHARE:
            return None
        # the hand has released meanwhile, and has not seen this step
        is_unseen = released is None and self.scene is not scene and self.scene.key == scene.key
        is_away = released is not None and self._moved_share(released, relaxed) > MOST_SETTLING_SHARE
        if is_unseen or is_away:
            self._live, self._maps, self._is_met, self._missed = live, earlier, was_met, missed
            return None
        return update

    def is_behind(self, scene: Scene) -> bool:
        """Return whether the hand came to rest, or released, before the map had followed it to a scene."""
        follows = not self.pair.deforming and self._live is not None
        return follows and scene.key not in self._choices and not self.has_followed(scene)

    def _moved_share(self, earlier: Sequence[TriangulatedMap], later: Sequence[TriangulatedMap]) -> float:
        """Return the displacement between the maps of all parts, relative to the target's diagonal."""
        return greatest_displacement(earlier, later) / self.pair.target.curve.diagonal

    def _bend(self, scene: Scene) -> MapUpdate:
        """Return the deformation, continued from the previous one."""
        try:
            with one_thread():
                solved = solve_scene(self.pair, scene, self._map)
        except InputError as error:
            return refusal(error)
        self._maps = solved.maps
        report, image = solved.report, self.view.image_of(solved.maps)
        wrong = missed_constraints(report, scene)
        is_met = not any(wrong.values())
        message = (
            "" if is_met else "The pin is not there yet: the shape follows as far as possible without folds."
        )
        outlines = self.view.deformed_rings(solved.maps[0])
        patches = self.view.soft_pins(scene, solved.pins, solved.fit.pins, solved.fit.details.softness)
        return MapUpdate(
            "coarse", is_met, message, figures(report), wrong, image, outlines=outlines, patches=patches
        )

    def _continue(
        self, scene: Scene, placed: PlacedConstraints, *, dragged: bool = False
    ) -> Live | WarpedLive:
        """Return the coarse map at the constraints `placed` of a scene."""
        pins, strokes = placed.pins, placed.strokes
        softness = self._as_met(pins, softness_of_settings(self.pair, placed.settings))
        if self._live is not None:
            return self._live.follow(pins, strokes, softness, scene.balance, dragged=dragged)
        if self._fit is None:
            raise InputError("there is no map yet; wait for the first one")
        options = Options(balance=scene.balance, turn=scene.turn, tolerance=self.pair.job.tolerance)
        choice = self._choices.get(self._last[0].key, MapChoice())
        if self._warp is not None:
            assert softness is not None
            return WarpedLive.of(self._warp, options, pins, softness, springs=choice.springs, dragged=dragged)
        return Live.of(
            self._fit,
            options,
            pins,
            strokes,
            softness,
            covering_map=choice.begins if choice.kept else None,
            springs=choice.springs,
            dragged=dragged,
        )

    def _as_met(self, pins: Complex, softness: Softness | None) -> Softness | None:
        """Make pins exact that the last map meets exactly because they would miss their places as soft pins."""
        fit = self._fit
        if (
            softness is None
            or fit is None
            or fit.details.softness is None
            or fit.details.softness.is_soft.all()
        ):
            return softness
        # a pin that is dragged keeps one of its ends
        is_exact = np.isin(pins, fit.pins[~fit.details.softness.is_soft]).any(axis=1)
        numbers = np.flatnonzero(~softness.is_given & is_exact)
        return softness.with_pins(numbers, Softness.exact(numbers.size)) if numbers.size else softness


def _dumped(scene: Scene | None) -> dict[str, Any] | None:
    return None if scene is None else scene.model_dump(mode="json")
