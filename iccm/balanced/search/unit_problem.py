"""The problem in unit coordinates, which all levels of the search solve."""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex
from ...curve import Curve
from ..constraints.strokes import StrokePair
from ..constraints.validate import NO_PINS
from ..model.energy import Energy
from ..model.metric import PLANES, Metrics

STROKE_SAMPLES = 8  # points of each stroke that align starts: enough to see its bends


class UnitProblem(NamedTuple):
    """A problem in unit coordinates.

    Attributes:
        source: boundary of the source, of area one.
        target: boundary of the target, of area one.
        energy: the energy that maps minimise, and by which they are compared.
        anchors: vertices of the source and of the target, in order, that must correspond.
        halved: whether these are halves of symmetric shapes, with the mirror axis between the two anchors.
        pins: (k, 2) points inside the source and the target that must correspond.
        strokes: polylines inside that must correspond.
        holes: outlines of holes of the source and of the target, clockwise.
        partners: (i, j) if hole i of the source is to be mapped to hole j of the target.
        metrics: of the surfaces that the two planes stand for.
        bays: polylines of filled concavities of the source, as in `holes.bays.Filled`.
        starts: multiple of the usual number of correspondences to try.
        inverted: whether this is the inverse of the given problem, so that `source` is the given target.
        regions: rigid regions of the source, as polygons, the outer one first.
        cut_out: number of the last holes that are similar to their partners and keep that similarity: points of
            their outlines correspond at equal shares of the length.
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
        stroke_pairs = [
            np.column_stack(
                [
                    stroke.source.at(shares * stroke.source.length),
                    stroke.target.at(shares * stroke.target.length),
                ]
            )
            for stroke in self.strokes
        ]
        return np.concatenate(
            [self.pins, np.array(self.anchors, np.complex128).T.reshape(-1, 2), *stroke_pairs]
        )

    @property
    def fixed_vertices(self) -> tuple[tuple[complex, ...], tuple[complex, ...]]:
        """The vertices of both outlines that are in every level."""
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
            metrics=self.metrics[::-1],
            energy=self.energy.inverse(),
            inverted=not self.inverted,
        )
