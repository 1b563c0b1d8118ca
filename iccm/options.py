"""The options of a solve, with their ranges and the methods that they belong to."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Literal, TypedDict

import numpy as np

from .errors import InputError
from .fits import FITS

MAX_EFFORT = 16  # times the usual number of correspondences: more were never better on hard pairs
MAX_POLYGON_VERTICES = 4000
"""Of a map's polygon in the conformal and the paper's method, whose equations are a dense matrix of that size."""
METHODS = ("balanced", "conformal", "paper")
PLACES = ("fill", "inside", "slice")
HOLES = ("auto", "keep")
TOLERANCE = 1e-3
"""Default gap between the image of the boundary and the target, relative to the target's diagonal: half a pixel of
a picture 500 pixels across."""
FIXED_BY_LITERAL = ("vertices", "consistency")
"""Options whose values the paper prescribes."""
WEIGHTED_ONLY = (
    "order",
    "quasi",
    "smoothness",
    "vertices",
    "samples_per_edge",
    "max_iterations",
    "decrease",
    "pin_weight",
    "stroke_weight",
)
"""Options of the conformal and the paper's method, which weigh constraints."""
BALANCED_ONLY = (
    "balance",
    "turn",
    "fit",
    "place",
    "holes",
    "max_left_out",
    "max_uncovered",
    "effort",
    "max_dilatation",
    "max_stretch",
    "rigid_size",
    "exact_pins",
    "terms",
)
"""Options of the balanced method."""


class OptionValues(TypedDict, total=False):
    """The attributes of `Options` as keyword arguments, for type checkers."""

    method: str | None
    balance: float
    turn: float | Literal["any"] | None
    fit: str
    place: str
    holes: str
    max_left_out: float
    max_uncovered: float
    effort: int
    max_dilatation: float | None
    max_stretch: float | None
    rigid_size: float | Literal["free"] | None
    exact_pins: bool
    terms: Sequence[object]
    order: int | None
    quasi: float | None
    pin_weight: float
    stroke_weight: float
    smoothness: float
    consistency: float | None
    tangential: float
    literal: bool
    vertices: int | str | None
    samples_per_edge: int | None
    max_iterations: int
    decrease: float | None
    threshold: float
    tolerance: float


@dataclass(frozen=True)
class Options:
    """Options of the solver. Weights are relative to the closeness of the boundary, lengths to the radius of a shape.

    Attributes:
        method: "balanced" (default: uniform scale, no folds, the outline is met), "conformal" (angles are kept exactly)
            or "paper" (Algorithm 1 as published).
        balance: θ of the balanced method: 0 keeps only angles (the conformal method), 1 balances angles and areas,
            larger values keep areas.
        turn: desired rotation in degrees counter-clockwise (balanced); "any" leaves it to the shapes; None is 0, or the
            rotation given by two pins or strokes. A note reports a contradiction between them.
        fit: "whole", outline onto outline with all concavities; "contain", all of the source is shown, and the target
            may stay bare where concavities of the source open; "cover", the target is covered, and parts of the source
            beyond its concavities are hidden; "frame", for whole drawings, a region around all parts of one onto a
            region around the other; "auto", the cheapest of these (whole with pins, strokes, bounds, surfaces and a
            balance above 1).
        place: "fill", the source takes the form of the target; "inside", it keeps its proportions and is as large as
            fits inside the target; "slice", it keeps its proportions and covers the target, and the rest is cut off.
        holes: "keep", all are mapped onto each other or shrink to slits; "auto", partial maps may ignore some, if that
            costs less.
        max_left_out: largest share of the source's area that may be hidden.
        max_uncovered: largest share of the target's area that may stay bare.
        effort: factor for the number of correspondences of the outlines that are tried, 1 to 16.
        max_dilatation: upper bound for s1/s2 (balanced).
        max_stretch: upper bound for max(s1, 1/s2), relative to the mean scale (balanced).
        rigid_size: size of rigid regions relative to the mean scale; "free" for the size that distorts the rest least;
            None for the mean scale, or as large as there is room.
        exact_pins: whether pins are met exactly, whatever distortion that takes; otherwise those inside are soft, see
            `iccm.Pin` (balanced, in the plane).
        terms: additional terms of the balanced energy, instances of subclasses of `iccm.balanced.Term`.
        order: 0 for the distance to closest points, 1 for the first-order distance of §3.4.
        quasi: None for a conformal map, else the weight of E_q.
        pin_weight: β of §3.1.
        stroke_weight: γ of §3.3.
        smoothness: α of §3.3.
        consistency: μ of the consistency energy.
        tangential: λ of §3.4, with order 1.
        literal: follow the paper exactly: the source's own vertices, samples there (with samples_per_edge also between
            them, the vertex being the first of its edge), energies as sums over samples in the given coordinates,
            Eq. 13 as written, full steps. Otherwise vertices are evenly spaced, and energies are means over the
            boundary, so that weights depend neither on the number of samples nor on the size of the shapes; a step of
            first order is halved until the energy decreases.
        vertices: number of vertices of the source polygon; "source" for exactly those of the outline; None chooses.
        samples_per_edge: number of boundary samples per source edge, at the middles of equal parts; None is 4.
        max_iterations: largest number of local and global steps.
        decrease: stop when a step lowers the energy by less than this share; None is 1e-4, and 2e-3 for the constraints
            of the conformal method.
        threshold: stop when the energy is below this value.
        tolerance: boundary gap to reach, relative to the diagonal of the target (conformal).
    """

    method: str | None = None
    balance: float = 1.0
    turn: float | Literal["any"] | None = None
    fit: str = "auto"
    place: str = "fill"
    holes: str = "auto"
    max_left_out: float = 1.0
    max_uncovered: float = 1.0
    effort: int = 1
    max_dilatation: float | None = None
    max_stretch: float | None = None
    rigid_size: float | Literal["free"] | None = None
    exact_pins: bool = False
    terms: Sequence[object] = ()
    order: int | None = None
    quasi: float | None = None
    pin_weight: float = 1.0
    stroke_weight: float = 1.0
    smoothness: float = 0.0
    consistency: float | None = None
    tangential: float = 0.05
    literal: bool = False
    vertices: int | str | None = None
    samples_per_edge: int | None = None
    max_iterations: int = 300
    decrease: float | None = None
    threshold: float = 1e-16
    tolerance: float = TOLERANCE

    def __post_init__(self):
        """Reject values outside their range."""
        if self.method not in (None, *METHODS):
            raise InputError(f"method: {self.method!r} is not one of {', '.join(METHODS)}")
        if isinstance(self.turn, str) and self.turn != "any":
            raise InputError(f"turn: {self.turn!r} is not an angle in degrees, nor 'any'")
        if self.order not in (None, 0, 1):
            raise InputError(f"order: {self.order!r} is not allowed; use 0 or 1")
        for f in fields(self):
            value = getattr(self, f.name)
            least = -np.inf if f.name == "turn" else 0
            if isinstance(value, float | int) and not (np.isfinite(value) and value >= least):
                raise InputError(f"{f.name}: {value} is not a finite number of at least 0")
        if self.literal and self.method != "paper":
            raise InputError("literal: needs method paper")
        if self.literal and (free := self._given(FIXED_BY_LITERAL)):
            raise InputError(
                f"{free[0]}: cannot be combined with literal, which uses the paper's value; "
                "remove one of the two"
            )
        for name, words in (("fit", tuple(FITS)), ("place", PLACES), ("holes", HOLES)):
            if getattr(self, name) not in words:
                raise InputError(f"{name}: {getattr(self, name)!r} is not one of {', '.join(words)}")
        if self.place != "fill" and (
            others := self._given(("fit", "holes", "max_left_out", "max_uncovered"))
        ):
            raise InputError(
                f"{others[0]}: cannot be combined with place {self.place}, which keeps the drawing's "
                "proportions; remove one of the two"
            )
        if max(self.max_left_out, self.max_uncovered) > 1:
            raise InputError("max_left_out, max_uncovered: must be shares of the area, at most 1")
        if not 1 <= self.effort <= MAX_EFFORT:
            raise InputError(f"effort: {self.effort} is not between 1 and {MAX_EFFORT}")
        if isinstance(self.rigid_size, str) and self.rigid_size != "free":
            raise InputError(f"rigid_size: {self.rigid_size!r} is not a factor, nor 'free'")
        if self.rigid_size == 0:
            raise InputError("rigid_size: must be above 0")
        if isinstance(self.vertices, str):
            if self.vertices != "source":
                raise InputError(f"vertices: {self.vertices!r} is neither a number nor 'source'")
        elif self.vertices is not None and not 3 <= self.vertices <= MAX_POLYGON_VERTICES:
            raise InputError(f"vertices: {self.vertices} is not between 3 and {MAX_POLYGON_VERTICES}")
        for name in ("max_dilatation", "max_stretch"):
            bound = getattr(self, name)
            if bound is not None and bound < 1:
                raise InputError(f"{name}: {bound:g} is below 1, the least possible value; use a larger one")
        self._refuse_others()
        if self.tolerance == 0:
            raise InputError("tolerance: 0 cannot be reached; use a number above 0")
        if not (self.samples_per_edge != 0 and self.max_iterations >= 1 and 0 < self.tangential <= 1):
            raise InputError(
                "samples_per_edge and max_iterations must be at least 1, tangential above 0 and at most 1"
            )

    @property
    def is_balanced(self) -> bool:
        """Whether the balanced method solves, which meets pins and strokes instead of weighing them."""
        balanced = self.method == "balanced" or not (self.method or self._given(WEIGHTED_ONLY))
        return balanced and self.balance != 0

    @property
    def switched_by(self) -> str:
        """The option that makes another method than the default one solve, where none was named; else nothing."""
        others = self._given(WEIGHTED_ONLY)
        return others[0] if others and self.method is None else ""

    def _given(self, names: Iterable[str]) -> list[str]:
        """Those of the options that are not as they are by default."""
        return [name for name in names if getattr(self, name) != getattr(Options, name)]

    def _refuse_others(self) -> None:
        """Reject options that the method does not have, so that none is without effect."""
        others = self._given(WEIGHTED_ONLY)
        if self.method == "balanced" and others:
            raise InputError(f"{others[0]}: an option of --method conformal or paper, not of balanced")
        own = [name for name in self._given(BALANCED_ONLY) if self.balance or name != "balance"]
        if own and not self.is_balanced:
            asked = others[0] if others else "balance 0"
            other = (
                self.method
                if self.method != "balanced" and self.method
                else f"conformal, which {asked} asks for"
            )
            raise InputError(f"{own[0]}: needs the balanced method, not of {other}")
