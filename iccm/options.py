"""The options of a solve, with their ranges and the methods to which they belong."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from numbers import Real
from typing import Any, Literal, TypedDict, get_args

from . import limits
from .errors import InputError
from .fits import FITS, FitName

MethodName = Literal["balanced", "conformal", "paper"]
"""The methods; the first one is the default."""
PlaceName = Literal["fill", "inside", "slice"]
METHODS: tuple[str, ...] = get_args(MethodName)
PLACES: tuple[str, ...] = get_args(PlaceName)
HolesName = Literal["auto", "keep"]
HOLES: tuple[str, ...] = get_args(HolesName)
BALANCED = ("balanced",)
WEIGHTED = ("conformal", "paper")
"""The methods that weight constraints in the energy."""
MAX_EFFORT = 16
"""Largest multiple of the usual number of correspondences. On four pairs of silhouettes from icon fonts, a
factor of 48 lowered the 95th percentile of the dilatation by at most 1.4 % more, and took twice the time.
"""
MAX_BALANCE = 10
"""Largest weight of areas: beyond 4, areas hardly change any more while angles get worse."""
TOLERANCE = 1e-3
"""Default gap between the image of the boundary and the target, relative to the target's diagonal: half a pixel of
a picture 500 pixels across."""
FIXED_BY_LITERAL = ("vertices", "consistency")
"""Options whose values the paper prescribes."""
ONE_OF_PLACE = ("fit", "holes", "max_left_out", "max_uncovered")
"""Options for mapping a drawing onto the target's shape; with `place`, it keeps its proportions instead."""


@dataclass(frozen=True)
class OptionRow:
    """The values that an option accepts, and the methods that have it.

    Names, types and defaults are those of the fields of `Options`.

    Attributes:
        methods: those in which it has an effect.
        selects: whether a value other than the default selects these methods, if no method is named.
        words: the words that it accepts.
        is_number: whether it accepts numbers.
        least: the smallest number.
        above: a number that must be exceeded, instead of `least`.
        most: the largest number.
    """

    methods: tuple[str, ...] = METHODS
    selects: bool = False
    words: tuple[str, ...] = ()
    is_number: bool = False
    least: float = -math.inf
    above: float | None = None
    most: float = math.inf

    def mistake(self, value: Any, default: Any) -> str:
        """Return what is wrong with a value, as the end of a sentence; an empty string if it is accepted."""
        if value is None and default is None:
            return ""
        if self.is_number:
            return self._mistake_of_number(value)
        if self.words and value not in self.words:
            return f"{value!r} is not one of {', '.join(self.words)}"
        return ""

    def _mistake_of_number(self, value: Any) -> str:
        if isinstance(value, str) and value in self.words:
            return ""
        if not isinstance(value, Real):
            also = f"neither a number nor {self.words[0]!r}" if self.words else "not a number"
            return f"{value!r} is {also}"
        try:
            number = float(value)
        except OverflowError:  # an integer of more than 308 digits
            number = math.inf
        is_inside = number >= self.least if self.above is None else number > self.above
        if math.isfinite(number) and is_inside and number <= self.most:
            return ""
        if self.above is not None:
            bounds = f"a finite number above {self.above:g}"
        elif math.isfinite(self.most):
            return f"{value} is not between {self.least:g} and {self.most:g}"
        elif math.isfinite(self.least):
            bounds = f"a finite number of at least {self.least:g}"
        else:
            bounds = "a finite number"
        return f"{value} is not {bounds}" + (f" and at most {self.most:g}" if self.most < math.inf else "")


def _field(default: Any, **row: Any) -> Any:
    """Return a field of `Options` with its default and its row in the table."""
    return field(default=default, metadata={"row": OptionRow(**row)})


def _number(default: Any, *, least: float = 0, **row: Any) -> Any:
    """Return a field for numbers, by default of at least 0."""
    return _field(default, is_number=True, least=least, **row)


class OptionValues(TypedDict, total=False):
    """The attributes of `Options` as keyword arguments, for type checkers."""

    method: MethodName | None
    balance: float
    turn: float | Literal["any"] | None
    fit: FitName
    place: PlaceName
    holes: HolesName
    max_left_out: float
    max_uncovered: float
    effort: int
    max_dilatation: float | None
    max_stretch: float | None
    rigid_size: float | Literal["free"] | None
    exact_pins: bool
    keep_start: bool
    terms: Sequence[Any]
    order: int | None
    quasi: float | None
    pin_weight: float
    stroke_weight: float
    smoothness: float
    consistency: float | None
    tangential: float
    literal: bool
    vertices: int | Literal["source"] | None
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
        fit: how shapes that differ are mapped onto each other: a name in `iccm.fits.FITS`, which describes each. "auto"
            is the cheapest of them ("whole" with strokes, rigid regions, bounds, surfaces and a balance above 1).
        place: "fill", the source takes the form of the target; "inside", it keeps its proportions and is as large as
            fits inside the target; "slice", it keeps its proportions and covers the target, and the rest is cut off.
        holes: "keep", all are mapped onto each other or shrink to slits; "auto", they are ignored if that costs less,
            and mapped onto each other only if both shapes have as many.
        max_left_out: largest share of the source that may be hidden, relative to the area inside its outline without
            holes; for drawings, relative to the area that they paint.
        max_uncovered: largest share of the target that may stay bare, measured alike.
        effort: factor for the number of correspondences of the outlines that are tried, 1 to 16.
        max_dilatation: upper bound for s1/s2 (balanced).
        max_stretch: upper bound for max(s1, 1/s2), relative to the mean scale (balanced).
        rigid_size: size of rigid regions relative to the mean scale; "free" for the size that distorts the rest least;
            None for the mean scale, or as large as there is room.
        exact_pins: whether pins are met exactly, whatever distortion that takes; otherwise those inside are soft, see
            `iccm.Pin` (balanced, in the plane).
        keep_start: whether the map given as `start` is the result, if it meets all constraints on its own mesh;
            otherwise the search continues from it until it has converged (balanced, in the plane).
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

    method: str | None = _field(None, words=METHODS)
    balance: float = _number(1.0, methods=BALANCED, selects=True, most=MAX_BALANCE)
    turn: float | Literal["any"] | None = _number(
        None, methods=BALANCED, selects=True, least=-math.inf, words=("any",)
    )
    fit: str = _field("auto", methods=BALANCED, selects=True, words=tuple(FITS))
    place: str = _field("fill", methods=BALANCED, selects=True, words=PLACES)
    holes: str = _field("auto", methods=BALANCED, selects=True, words=HOLES)
    max_left_out: float = _number(1.0, methods=BALANCED, selects=True, most=1)
    max_uncovered: float = _number(1.0, methods=BALANCED, selects=True, most=1)
    effort: int = _number(1, methods=BALANCED, selects=True, least=1, most=MAX_EFFORT)
    max_dilatation: float | None = _number(None, methods=BALANCED, selects=True, least=1)
    max_stretch: float | None = _number(None, methods=BALANCED, selects=True, least=1)
    rigid_size: float | Literal["free"] | None = _number(
        None, methods=BALANCED, selects=True, above=0, words=("free",)
    )
    exact_pins: bool = _field(False, methods=BALANCED, selects=True)
    keep_start: bool = _field(False, methods=BALANCED, selects=True)
    terms: Sequence[Any] = _field((), methods=BALANCED, selects=True)
    order: int | None = _number(None, methods=WEIGHTED, selects=True, most=1)
    quasi: float | None = _number(None, methods=WEIGHTED, selects=True)
    pin_weight: float = _number(1.0, methods=WEIGHTED, selects=True)
    stroke_weight: float = _number(1.0, methods=WEIGHTED, selects=True)
    smoothness: float = _number(0.0, methods=WEIGHTED, selects=True)
    consistency: float | None = _number(None, methods=WEIGHTED)
    tangential: float = _number(0.05, methods=WEIGHTED, above=0, most=1)
    literal: bool = _field(False, methods=("paper",))
    vertices: int | str | None = _number(
        None, methods=WEIGHTED, selects=True, least=3, most=limits.VERTICES, words=("source",)
    )
    samples_per_edge: int | None = _number(None, methods=WEIGHTED, selects=True, least=1)
    max_iterations: int = _number(300, methods=WEIGHTED, selects=True, least=1)
    decrease: float | None = _number(None, methods=WEIGHTED, selects=True)
    threshold: float = _number(1e-16, methods=WEIGHTED)
    tolerance: float = _number(TOLERANCE, above=0)

    def __post_init__(self):
        """Reject values that an option does not accept, and options that exclude each other."""
        if self.order not in (None, 0, 1):
            raise InputError(f"order: {self.order!r} is not allowed; use 0 or 1")
        for option in fields(self):
            if mistake := option.metadata["row"].mistake(getattr(self, option.name), option.default):
                raise InputError(f"{option.name}: {mistake}")
        if self.literal and self.method != "paper":
            raise InputError("literal: needs method paper")
        if self.literal and (prescribed := self._given(FIXED_BY_LITERAL)):
            raise InputError(
                f"{prescribed[0]}: cannot be combined with literal, which uses the paper's value; "
                "remove one of the two"
            )
        if self.place != "fill" and (conflicting := self._given(ONE_OF_PLACE)):
            raise InputError(
                f"{conflicting[0]}: cannot be combined with place {self.place}, which keeps the drawing's "
                "proportions; remove one of the two"
            )
        self._refuse_others()

    @property
    def is_balanced(self) -> bool:
        """Whether the balanced method solves, for which pins and strokes are hard constraints."""
        balanced = self.method == "balanced" or not (self.method or self._given(WEIGHTED_ONLY))
        return balanced and self.balance != 0

    @property
    def switched_by(self) -> str:
        """The option that selects another method than the default one, if no method is named; else an empty string."""
        weighted_only = self._given(WEIGHTED_ONLY)
        return weighted_only[0] if weighted_only and self.method is None else ""

    @property
    def rotation(self) -> float | None:
        """Requested rotation in radians; None if any will do.

        Examples:
            >>> round(Options(turn=90).rotation, 4), Options().rotation, Options(turn="any").rotation
            (1.5708, 0.0, None)
        """
        return None if self.turn == "any" else math.radians(self.turn or 0.0)

    @property
    def rigid_scale(self) -> float | None:
        """Scale of rigid regions relative to the mean scale; None if it is free."""
        return None if self.rigid_size == "free" else float(self.rigid_size or 1.0)

    @property
    def has_bounds(self) -> bool:
        """Whether there are bounds on the distortion."""
        return self.max_dilatation is not None or self.max_stretch is not None

    def inverse(self) -> "Options":
        """Return the options of the inverse map.

        Examples:
            >>> options = Options(turn=30, rigid_size=2)
            >>> options.inverse().turn, options.inverse().rigid_size, options.inverse().inverse() == options
            (-30, 0.5, True)
        """
        size = self.rigid_size
        return replace(
            self,
            turn=self.turn if self.turn is None or self.turn == "any" else -self.turn,
            rigid_size=size if size is None or size == "free" else 1 / size,
            terms=tuple(term.inverse() for term in self.terms),
        )

    def _given(self, names: Iterable[str]) -> list[str]:
        """Return those of the options that differ from their defaults."""
        return [name for name in names if getattr(self, name) != getattr(Options, name)]

    def _refuse_others(self) -> None:
        """Reject options that the method does not have, so that none is ignored silently."""
        weighted_only = self._given(WEIGHTED_ONLY)
        if self.method == "balanced" and weighted_only:
            raise InputError(f"{weighted_only[0]}: only works with method conformal or paper, not balanced")
        balanced_only = [name for name in self._given(BALANCED_ONLY) if self.balance or name != "balance"]
        if balanced_only and not self.is_balanced:
            reason = weighted_only[0] if weighted_only else "balance 0"
            method = (
                self.method
                if self.method != "balanced" and self.method
                else f"conformal, which {reason} requires"
            )
            raise InputError(f"{balanced_only[0]}: only works with method balanced, not {method}")


ROWS: dict[str, OptionRow] = {option.name: option.metadata["row"] for option in fields(Options)}
"""The options by name."""
DEFAULTS: dict[str, Any] = {option.name: option.default for option in fields(Options)}
WEIGHTED_ONLY = tuple(name for name, row in ROWS.items() if row.selects and row.methods == WEIGHTED)
"""Options of the conformal and the paper's method that select one of these."""
BALANCED_ONLY = tuple(name for name, row in ROWS.items() if row.selects and row.methods == BALANCED)
"""Options of the balanced method."""
