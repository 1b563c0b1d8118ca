"""The server's answer to the page: the figures and picture of a map, or why there is none."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Complex
from ...balanced.constraints.soft import MOST_LIMIT_RATIO
from ...errors import InputError, all_names
from ...frames.choice import GOOD_STRETCH_P95
from ...maps.joined import joined
from ...maps.summary import WELL_SEEN_SHARE
from ...maps.triangulated.map import TriangulatedMap
from ...pins import Softness
from ...result import Fit
from ...status import Status
from ..run.report import as_json
from .messages import Scene

SEEN = ("shown", "covered")  # figures of maps of whole drawings
LOST = ("left_out", "uncovered")  # figures of partial maps
MISSED_DIAGONAL_SHARE = 1e-6  # relative to the target's diagonal; exact pins are met to 1e-9
MISSED_STROKE_SHARE = 1e-3  # the same for strokes, whose points lie on their images to 2e-4
NOTABLE_COST_RATIO = 1.2
"""Cost of a continued map relative to that of the map from scratch, above which the latter is recommended, and replaces
the other while the hand rests. Smaller differences are not worth a change of the whole picture.
"""


class ShownSilhouette(NamedTuple):
    """What pictures show of a target: more than it paints, which is then a tone on the paper.

    Attributes:
        rings: the boundaries of what is shown.
        toned: those of the tone.
        colors: of the paper and of the tone, as in SVG; empty without a tone.
    """

    rings: list[Complex]
    toned: list[Complex]
    colors: tuple[str, str]


@dataclass(frozen=True, eq=False)
class Solved:
    """The converged maps of a scene.

    Attributes:
        fits: one for each part; a single one unless parts are mapped separately.
        report: figures of the first fit, with those of the others as its parts.
        pins: (k, 2) in the core plane; those of the scene come first.
        silhouette: what pictures show of the target, if that is more than it paints; else None.
    """

    fits: list[Fit]
    report: dict[str, Any]
    pins: Complex
    silhouette: ShownSilhouette | None = None

    @property
    def fit(self) -> Fit:
        """The fit of the first part."""
        return self.fits[0]

    @property
    def maps(self) -> list[TriangulatedMap]:
        """The map of each part."""
        return [fit.map for fit in self.fits if isinstance(fit.map, TriangulatedMap)]

    @property
    def map(self) -> TriangulatedMap:
        """The maps of all parts as one."""
        return joined(self.maps)

    @property
    def soft_pins(self) -> tuple[Complex, Softness | None]:
        """The pins (k, 2) of all maps, and their softness; None if all are exact."""
        pinned = [(fit.pins, softness) for fit in self.fits if (softness := fit.details.softness) is not None]
        if not pinned:
            return self.fit.pins, None
        pins, softnesses = zip(*pinned)
        return np.concatenate(pins), Softness.joined(softnesses)

    @property
    def status(self) -> Status:
        """The status of the first part that was not solved successfully."""
        return next((fit.status for fit in self.fits if not fit.status.ok), self.fit.status)


@dataclass(frozen=True, eq=False)
class MapUpdate:
    """What the page shows after a change.

    Attributes:
        kind: "full" for the map that `iccm map` computes from the saved constraints, "coarse" for one that follows
            dragging, "blocked" if the map that is seen has come to rest without reaching a pin, "error" if there is
            none.
        ok: whether the map meets all requirements.
        message: a sentence about the map.
        figures: those of the report that are known.
        wrong: indices of the pins and strokes that are not or cannot be met.
        drawn: what the page draws, see `PageView.image_of`; None if the page keeps its map.
        patches: radius and tolerance of each soft pin, in the units of the files; None for exact pins.
        outlines: of a deformed shape, rings of [x, y] in the page's coordinates.
        other: "fresh" if the map from scratch differs, "kept" if the map continued from the last one does.
        cost_ratio: cost of the continued map relative to that of the map from scratch, if they differ.
        short: indices of the pins that stopped short: they were moved from where they were dragged to where the map
            takes them.
        scene: the scene whose map this is, if pins stopped short; else the one that was requested.
        bent: middle and radius of each feature of the picture that is bent, in file units; see `bent`.
        silhouette: rings of what pictures show of the target if that is more than it paints, and the tone that it
            paints below, in the page's coordinates; empty if it is not.
    """

    kind: str
    ok: bool
    message: str
    figures: dict[str, Any] = field(default_factory=dict)
    wrong: dict[str, list[int]] = field(default_factory=dict)
    drawn: NDArray[np.float32] | None = None
    other: str = ""
    cost_ratio: float = 1.0
    outlines: list[list[list[float]]] = field(default_factory=list)
    patches: list[dict[str, float] | None] = field(default_factory=list)
    short: list[int] = field(default_factory=list)
    scene: Scene | None = None
    bent: list[dict[str, Any]] = field(default_factory=list)
    silhouette: dict[str, Any] = field(default_factory=dict)

    def head(self, seq: int) -> dict[str, Any]:
        """Return all fields except `drawn` for the page; `seq` is the number of the request that this answers."""
        names = (
            "kind",
            "ok",
            "message",
            "figures",
            "wrong",
            "other",
            "outlines",
            "patches",
            "short",
            "bent",
            "silhouette",
        )
        head = {name: getattr(self, name) for name in names}
        head["message"] += _sentence_about_other(self.other, self.cost_ratio)
        if self.scene is not None:
            head["pins"] = self.scene.model_dump(mode="json")["pins"]
        return as_json({"type": "map", "seq": seq, **head})


def _sentence_about_other(other: str, cost_ratio: float) -> str:
    """Return a sentence about the other map that the user can choose, which follows the one about the map."""
    better = f"{cost_ratio:.2g} times better" if cost_ratio > NOTABLE_COST_RATIO else ""
    if other == "fresh":
        return f" A map from scratch would be {better or 'different'}."
    if other == "kept":
        return " This map was computed from scratch" + (
            f", and is {better} than the continued one." if better else "."
        )
    return ""


def figures(report: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of a report that the page shows."""
    names = ("status", "boundary", "stretch", "dilatation", "scale", "turn", "injective", "notes")
    return {name: report[name] for name in (*names, *SEEN, *LOST) if name in report}


def verdict(
    status: Status, report: dict[str, Any], *, deformed: bool, constrained: bool, bent: int = 0
) -> str:
    """Return a sentence about a converged map, for users who have never seen a report.

    Whether a picture that was changed by hand is good, only the person can tell: then the sentence is about what was
    kept.

    Args:
        status: of the map.
        report: figures of the map.
        deformed: whether there is no target.
        constrained: whether there are pins, strokes or rigid regions.
        bent: number of features of the picture that the map bends.
    """
    if not status.ok:
        return status.value
    folds = "nothing folds" if report["injective"]["certified"] else "the absence of folds is not certified"
    stretch = report["stretch"]["p95"]
    is_even = stretch <= GOOD_STRETCH_P95
    flaws = [
        f"{1 - report[name]:.0%} of the {side} {loss}"
        for name, side, loss in (("shown", "source", "is hidden"), ("covered", "target", "stays bare"))
        if report.get(name, 1) < WELL_SEEN_SHARE
    ]
    if not is_even:
        flaws.append(f"it is stretched by a factor of {stretch:.2g} or more on 5 % of its area")
    if deformed:
        sentence = f"Pins and strokes are met, {folds}."
    elif flaws:
        sentence = f"The shapes fit, {folds}, but {' and '.join(flaws)}."
    else:
        subject = "The picture follows" if constrained else "The shapes fit" if bent else "Good fit"
        sentence = f"{subject}: the scale is nearly uniform, {folds}."
    if not bent:
        return sentence
    places = "one place" if bent == 1 else f"{bent} places"
    return f"{sentence} The picture is bent in {places}, marked by dashed rings."


def blocked_sentence(pins: Sequence[int]) -> str:
    """Return a sentence about pins (indices) that the map cannot follow to where the hand rests."""
    they, do = ("it", "stays") if len(pins) == 1 else ("they", "stay")
    return (
        f"The picture cannot follow {_named(pins)} to here without folds; if you release now, {they} {do} where the "
        "picture is. Keep still to search for another picture."
    )


def whole_sentence() -> str:
    """Return a sentence about a map of whole shapes that replaced an earlier one, which left parts out."""
    return "With these pins, strokes or regions nothing is left out, so the picture changed."


def reached_sentence(pins: Sequence[int]) -> str:
    """Return a sentence about pins (indices) that were reached by another map while the hand rested."""
    return (
        f"The picture could not follow {_named(pins)} to here without folds, so it was replaced by another one; undo "
        "returns to the picture before."
    )


def stopped_sentence(pins: Sequence[int]) -> str:
    """Return a sentence about pins (indices) that were left where the map takes them."""
    they, do = ("it", "stays") if len(pins) == 1 else ("they", "stay")
    return (
        f"The picture could not follow {_named(pins)} to where you put {'it' if len(pins) == 1 else 'them'}, so {they} "
        f"{do} where the picture is."
    )


def missed_sentence(wrong: dict[str, list[int]]) -> str:
    """Return a sentence about pins and strokes (indices) that a map misses although it is good otherwise."""
    names = [_named(wrong[f"{kind}s"], kind) for kind in ("pin", "stroke") if wrong[f"{kind}s"]]
    return f"No map was found that meets {' and '.join(names)}."


def _named(indices: Sequence[int], kind: str = "pin") -> str:
    """Return the numbers of pins or strokes (indices), as the page shows them, for a sentence."""
    numbers = [str(k + 1) for k in indices]
    return f"{kind if len(numbers) == 1 else kind + 's'} {all_names(numbers)}"


def missed_constraints(report: dict[str, Any], scene: Scene) -> dict[str, list[int]]:
    """Return the indices of the pins and strokes that a full map does not meet."""
    pins, strokes = report["pins"][: len(scene.pins)], report["strokes"]
    return {
        "pins": [
            k
            for k, pin in enumerate(pins)
            if not pin["error"] <= MOST_LIMIT_RATIO * pin.get("tolerance", 0) + MISSED_DIAGONAL_SHARE
        ],
        "strokes": [k for k, stroke in enumerate(strokes) if not stroke["error"] <= MISSED_STROKE_SHARE],
    }


def refusal(error: InputError) -> MapUpdate:
    """Return the answer for constraints that cannot be met; their numbers are read from the message, which counts from
    1.
    """
    text, wrong = str(error), {}
    for kind in ("pin", "stroke"):
        matches = re.findall(rf"\b{kind}s? (?:on the outline out of order: )?(\d+(?:(?:, | and )\d+)*)", text)
        numbers = [int(n) - 1 for words in matches for n in re.findall(r"\d+", words)]
        wrong[f"{kind}s"] = sorted(set(numbers))
    return MapUpdate("error", False, text, {}, wrong)
