"""The problem in unit coordinates: what all levels of the search solve."""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex
from ...curve import Curve
from ..constraints.strokes import StrokePair
from ..constraints.validate import NO_PINS
from ..model.energy import Energy
from ..model.metric import PLANES, Metrics

STROKE_SAMPLES = 8  # points of each stroke by which starts are compared (by hand)

Numbers = tuple[tuple[int, ...], tuple[int, ...]]  # of holes of the source and of the target


class UnitProblem(NamedTuple):
    """What is solved, in unit coordinates.

    Attributes:
        source: boundary of the source, of area one.
        target: boundary of the target, of area one.
        energy: what maps minimise, and are compared by.
        anchors: vertices of the source and of the target, in order, that must correspond.
        halved: whether these are half shapes, with a mirror axis between the two anchors.
        pins: (k, 2) points inside the source and the target that must correspond.
        strokes: polylines inside that must.
        holes: outlines of holes of the source and of the target, clockwise.
        partners: (i, j) that hole i of the source is to go to hole j of the target.
        passed: the outlines of holes of the source, and of the target, that the map ignores.
        numbers: which of the given holes `holes` are.
        metrics: of the surfaces that the two planes stand for.
        bays: of the source, as of `holes.bays.Filled`.
        starts: times as many correspondences are tried as usual.
        inverted: whether this is the inverse of what was given, so that the target's area is that of `source`.
        regions: of the source that are to be rigid, polygons each, the outer one first.
        cut_out: how many of the last holes are similar to their partners and keep to that: each point of their outlines
            goes to the one at the same share of the length.
    """

    source: Curve
    target: Curve
    energy: Energy
    anchors: tuple[tuple[complex, ...], tuple[complex, ...]] = ((), ())
    halved: bool = False
    pins: Complex = NO_PINS
    strokes: tuple[StrokePair, ...] = ()
    holes: tuple[tuple[Curve, ...], tuple[Curve, ...]] = ((), ())
    partners: tuple[tuple[int, int], ...] = ()
    passed: tuple[tuple[Curve, ...], tuple[Curve, ...]] = ((), ())
    numbers: Numbers = ((), ())
    metrics: Metrics = PLANES
    bays: tuple[Complex, ...] = ()
    starts: int = 1
    inverted: bool = False
    regions: tuple[tuple[Complex, ...], ...] = ()
    cut_out: int = 0

    @property
    def holed(self) -> bool:
        """Whether there are holes."""
        return any(self.holes)

    @property
    def constrained(self) -> bool:
        """Whether there are strokes or pins, inside or on the outlines."""
        return bool(self.strokes) or bool(len(self.pins)) or bool(self.anchors[0] and not self.halved)

    @property
    def all_pins(self) -> Complex:
        """(k, 2) pins inside and on the outlines, and points of strokes."""
        shares = np.arange(STROKE_SAMPLES) / (STROKE_SAMPLES - 1)
        drawn = [
            np.column_stack(
                [
                    stroke.source.at(shares * stroke.source.length),
                    stroke.target.at(shares * stroke.target.length),
                ]
            )
            for stroke in self.strokes
        ]
        return np.concatenate([self.pins, np.array(self.anchors, np.complex128).T.reshape(-1, 2), *drawn])

    @property
    def kept(self) -> tuple[tuple[complex, ...], tuple[complex, ...]]:
        """The vertices of both outlines that every level keeps."""
        ends = dict.fromkeys(complex(end) for bay in self.bays for end in (bay[0], bay[-1]))
        return (*self.anchors[0], *ends), self.anchors[1]

    def inverse(self) -> "UnitProblem":
        """Return the problem of the inverse map; it has the same energy."""
        pins = np.ascontiguousarray(self.pins[:, ::-1])
        strokes = tuple(stroke.inverse() for stroke in self.strokes)
        return self._replace(
            source=self.target,
            target=self.source,
            anchors=self.anchors[::-1],
            pins=pins,
            strokes=strokes,
            holes=self.holes[::-1],
            partners=tuple((j, i) for i, j in self.partners),
            passed=self.passed[::-1],
            numbers=self.numbers[::-1],
            metrics=self.metrics[::-1],
            energy=self.energy.inverse(),
            inverted=not self.inverted,
        )
