"""What is edited: two shapes, a texture, the map at rest, and the map that follows while something is dragged."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import iccm

from ...arrays import Box, Complex
from ...balanced.constraints.live import Live
from ...balanced.solution import Settings
from ...blas import one_thread
from ...curve import Curve
from ...errors import InputError
from ...maps.distortion import of_triangles
from ...maps.triangulated.map import TriangulatedMap
from ...memory import Memory
from ..run import framing, texture
from ..run.constraints import holed, inside, solved
from ..run.inputs import Inputs
from ..run.job import Job
from ..run.report import plain
from ..shapes import constraints
from ..shapes.constraints import Listed, Pin, Stroke
from ..shapes.shape import Shape
from .messages import Scene, scene_of
from .scene import PageHalf, patches, png

MISSED = 1e-6  # of the target's diagonal; pins that are met are met to 1e-9
MISSED_STROKE = 1e-3  # likewise, of strokes, which lie on theirs to 2e-4
ON_OUTLINE = 2e-3
"""Of the diagonal: what is so close to an outline goes onto the other; twice what a pin's is."""
DIGITS = 7  # to which places are rounded, of the shape's size: the page and the files say the same


@dataclass(frozen=True, eq=False)
class Shown:
    """What the page is shown.

    Attributes:
        kind: "full" for the map that `iccm map` makes, "coarse" for one that follows, "error" where there is none.
        ok: whether the map is as good as was asked for.
        message: a sentence on it.
        figures: of the report, as far as they are known.
        wrong: numbers of the pins and strokes that are not met or cannot be.
        patches: (m, 18) see `scene.patches`; None where the map on the page stays.
    """

    kind: str
    ok: bool
    message: str
    figures: dict[str, Any] = field(default_factory=dict)
    wrong: dict[str, list[int]] = field(default_factory=dict)
    patches: NDArray[np.float32] | None = None

    def head(self, seq: int) -> dict[str, Any]:
        """All but the patches, for the page; `seq` says to what this is the answer."""
        head = {name: getattr(self, name) for name in ("kind", "ok", "message", "figures", "wrong")}
        return plain({"type": "map", "seq": seq, **head})


class Session:
    """One pair of shapes being edited. Of `follow` and `solve` one call each may run at a time."""

    def __init__(self, job: Job) -> None:
        """Reads all that a job reads.

        Raises:
            InputError: a file is wrong, a mesh, or constraints are not places of these files.
        """
        inputs = Inputs(job)
        for spec in (job.source, job.target or ""):
            if inputs.is_mesh(spec):
                raise InputError(
                    f"{spec}: iccm edit shows no meshes; pin them with iccm map --pin X,Y:v17, or flatten them"
                )
        source, target = inputs.shape(job.source), inputs.shape(job.target or "")
        self.job = job
        self.drawn = bool(source.pins or source.strokes)
        self.first = _listed(job, source, target)
        self.source, self.target = (replace(shape, pins={}, strokes={}) for shape in (source, target))
        self.core(self.first)
        self.scene = self.saved = self.first
        self.written: set[str] = set()
        self._image = texture.image_of(job, self.source, Memory())
        self._fit: iccm.Fit | None = None
        self._map: TriangulatedMap | None = None
        self._live: Live | None = None

    @cached_property
    def views(self) -> tuple[PageHalf, PageHalf]:
        """The coordinates of both halves of the page."""
        source, target = self._boxes
        return PageHalf.of(source, self.source.curve.box), PageHalf.of(target, self.target.curve.box)

    @property
    def _boxes(self) -> tuple[Box, Box]:
        """What the texture covers, and what pictures show."""
        return texture.box_of(self.job, self.source), framing.shown(self.job, self.target)

    @cached_property
    def texture(self) -> bytes:
        """The texture as PNG."""
        return png(self._image)

    @property
    def notes(self) -> list[str]:
        """Remarks on the inputs."""
        found = [f"{shape.spec}: {note}" for shape in (self.source, self.target) for note in shape.notes]
        return [*found, *framing.remarks(self.job, self.source, self.target), *self._image.notes]

    def describe(self) -> dict[str, Any]:
        """What the page must know before it draws."""
        job, shapes = self.job, (self.source, self.target)
        sides = [view.describe(shape, box) for view, shape, box in zip(self.views, shapes, self._boxes)]
        scenes = {name: getattr(self, name).model_dump(mode="json") for name in ("scene", "saved")}
        how = {"edge": job.edge, "filter": job.filter, "holes": job.holes == "keep", "digits": DIGITS}
        return plain({"source": sides[0], "target": sides[1], "notes": self.notes, **scenes, **how})

    def solve(self, scene: Scene) -> Shown:
        """The map at rest: what `iccm map` makes of the same pins and strokes, if it meets them."""
        self.scene = scene
        try:
            with one_thread():
                pins, strokes = self.core(scene)
                given = self.job.solver | {"balance": scene.balance, "turn": scene.turn}
                given |= {"pins": pins if len(pins) else None, "strokes": strokes or None}
                said: list[str] = []
                fit = solved(self.job, self.source, self.target, given, said.append)
            report = fit.report()
            report["notes"] += said
        except InputError as error:
            return _refused(error)
        wrong = _missed(report, scene)
        if any(wrong.values()) and self._map is not None:
            return Shown("error", False, fit.status.value, {}, wrong)
        if self.scene is scene:  # else something is being dragged again, from the map as it was then
            self._fit, self._map, self._live = fit, fit.map, None  # type: ignore[assignment]
        drawn = patches(fit.map, *self.views)  # type: ignore[arg-type]
        return Shown("full", fit.status.ok, fit.status.value, _figures(report), wrong, drawn)

    def follow(self, scene: Scene) -> Shown:
        """The coarse map, continued from the last one."""
        self.scene = scene
        try:
            with one_thread():
                pins, strokes = self.core(scene)
                self._live = live = self._followed(pins, strokes, scene)
                map = live.map
                found = Shown(
                    "coarse", live.met, "", of_triangles(map).report(), {}, patches(map, *self.views)
                )
        except InputError as error:
            return _refused(error)
        self._map = map
        if found.ok:
            return found
        gap = np.abs(map(pins[: len(scene.pins), 0]) - pins[: len(scene.pins), 1])
        wrong = {"pins": np.flatnonzero(~(gap <= MISSED * self.target.curve.diagonal)).tolist()}
        message = "Not there yet: the map follows as far as nothing folds. Let go to look for another way."
        return replace(found, wrong=wrong, message=message)

    def _followed(self, pins: Complex, strokes: list[tuple[Curve, Curve]], scene: Scene) -> Live:
        if self._live is not None:
            return self._live.moved(pins, strokes, scene.balance)
        if self._fit is None:
            raise InputError("there is no map yet to begin with")
        turn = None if scene.turn == "any" else float(np.radians(scene.turn))
        settings = Settings(theta=scene.balance, turn=turn, tolerance=self.job.tolerance)
        return Live.of(self._fit, settings, pins, strokes)

    def placed(self, side: str, points: list[tuple[float, float]]) -> list[list[float]]:
        """Where points of a side, in its file's units, are on the other; points on the outline stay on it.

        Raises:
            InputError: a point is outside, or there is no map yet.
        """
        if self._map is None:
            raise InputError("there is no map yet")
        here, there = (self.source, self.target) if side == "source" else (self.target, self.source)
        z = here.to_core(np.array(points))
        inside(here, "point", list(z))
        if holed(self.job) and any(Curve(hole).contains(z).any() for hole in here.holes):
            raise InputError(
                "that is in a hole; place a pin beside it, then drag both ends into holes that go together"
            )
        w = (self._map if side == "source" else self._map.inverse)(z)
        if not np.isfinite(w).all():
            raise InputError("the map does not reach that point")
        s = here.curve.closest(z)
        rim = np.abs(here.curve.at(s) - z) < ON_OUTLINE * here.curve.diagonal
        w[rim] = there.curve.at(there.curve.closest(w[rim]))
        digits = DIGITS - int(np.floor(np.log10(there.curve.diagonal)))
        return [[round(value, digits) for value in place] for place in there.to_file(w).tolist()]

    def core(self, scene: Scene) -> tuple[Complex, list[tuple[Curve, Curve]]]:
        """Pins (k, 2) and strokes in the core plane.

        Raises:
            InputError: one is not inside its shape.
        """
        listed = Listed(pins=scene.pins, strokes=scene.strokes)
        pins, strokes = constraints.pair(self.source, self.target, listed)
        for side, shape in enumerate((self.source, self.target)):
            inside(shape, "pin", list(pins[:, side]))
            for number, stroke in enumerate(strokes):
                inside(shape, f"stroke {number + 1}: point", list(stroke[side].z))
        return pins, strokes


def _listed(job: Job, source: Shape, target: Shape) -> Scene:
    """All constraints of a job as a list: those drawn, those in its file, those typed."""
    kept = constraints.collect(source, target)  # refuses a name without partner
    listed = constraints.read(job.constraints) if job.constraints else Listed()
    pins = [
        Pin(name=_bare(name), source=_place(source, a), target=_place(target, b))
        for name, (a, b) in zip(source.pins, kept.pins)
    ]
    strokes = [
        Stroke(
            name=_bare(name),
            source=[_place(source, z) for z in a.z],
            target=[_place(target, z) for z in b.z],
        )
        for name, (a, b) in zip(source.strokes, kept.strokes)
    ]
    typed = [Pin(source=here, target=there) for here, there in job.pin]
    return scene_of([*pins, *listed.pins, *typed], [*strokes, *listed.strokes], job.balance, job.turn)


def _bare(name: str) -> str:
    return name.partition("-")[2]


def _place(shape: Shape, z: complex) -> tuple[float, float]:
    x, y = shape.to_file(z).tolist()
    return x, y


def _figures(report: dict[str, Any]) -> dict[str, Any]:
    names = ("status", "boundary", "stretch", "dilatation", "scale", "turn", "injective", "notes")
    return {name: report[name] for name in names}


def _missed(report: dict[str, Any], scene: Scene) -> dict[str, list[int]]:
    """Numbers of the pins and strokes that a full map does not meet."""
    pins, strokes = report["pins"][: len(scene.pins)], report["strokes"]
    return {
        "pins": [k for k, pin in enumerate(pins) if not pin["error"] <= MISSED],
        "strokes": [k for k, stroke in enumerate(strokes) if not stroke["error"] <= MISSED_STROKE],
    }


def _refused(error: InputError) -> Shown:
    """What cannot be: the message counts from 1, and so names which."""
    text, wrong = str(error), {}
    for kind in ("pin", "stroke"):
        found = re.findall(rf"\b{kind}s? (?:on the outline out of order: )?(\d+(?:(?:, | and )\d+)*)", text)
        numbers = [int(n) - 1 for words in found for n in re.findall(r"\d+", words)]
        wrong[f"{kind}s"] = sorted(set(numbers))
    return Shown("error", False, text, {}, wrong)


def stem(job: Job) -> str:
    """What files of this pair are called."""
    names = [Path(spec.partition("#")[0]).stem for spec in (job.source, job.target or "")]
    return "-".join(names)
