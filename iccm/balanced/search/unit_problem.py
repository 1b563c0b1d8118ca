"""The problem in unit coordinates, which all levels of the search solve."""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex
from ...curve import Curve
from ...options import Options
from ...plane import triangle_areas
from ...problem import NO_HOLES, Holes
from ..constraints.strokes import StrokePair
from ..constraints.validate import NO_PINS, Pins
from ..model.discrete_map import DiscreteMap
from ..model.energy import Energy
from ..model.metric import PLANES, Metric, Metrics

DEFAULT = Options()
FINAL_TRIANGLES = 6000  # of the final mesh
STROKE_SAMPLES = 8  # points of each stroke that align starts: enough to see its bends


def energy_with(pins: Pins, energy: Energy) -> Energy:
    """Return an energy without the cost of rotation if exact pins and strokes, or its soft pins, determine it."""
    is_determined = pins.count + energy.pin_count > 1 or bool(pins.strokes)
    return energy.without_rotation() if is_determined else energy


class UnitProblem(NamedTuple):
    """A problem in unit coordinates.

    Attributes:
        source: boundary of the source, of area one.
        target: boundary of the target, of area one.
        energy: the energy that maps minimise, and by which they are compared.
        options: those of the given problem, also if this is its inverse.
        anchors: vertices of the source and of the target, in order, that must correspond.
        halved: whether these are halves of symmetric shapes, with the mirror axis between the two anchors.
        pins: (k, 2) points inside the source and the target that must correspond.
        strokes: polylines inside that must correspond.
        holes: of both domains.
        metrics: of the surfaces that the two planes stand for.
        bays: polylines of filled concavities of the source, as in `holes.bays.Filled`.
        inverted: whether this is the inverse of the given problem, so that `source` is the given target.
        regions: rigid regions of the source, as polygons, the outer one first.
        cut_out: number of the last holes that are similar to their partners and keep that similarity: points of
            their outlines correspond at equal shares of the length.
        triangles: approximate number of triangles of the final mesh.
    """

    source: Curve
    target: Curve
    energy: Energy
    options: Options = DEFAULT
    anchors: tuple[tuple[complex, ...], tuple[complex, ...]] = ((), ())
    halved: bool = False
    pins: Complex = NO_PINS
    strokes: tuple[StrokePair, ...] = ()
    holes: Holes = NO_HOLES
    metrics: Metrics = PLANES
    bays: tuple[Complex, ...] = ()
    inverted: bool = False
    regions: tuple[tuple[Complex, ...], ...] = ()
    cut_out: int = 0
    triangles: int = FINAL_TRIANGLES

    @classmethod
    def of(
        cls,
        outlines: tuple[Curve, Curve],
        holes: Holes,
        pins: Pins,
        energy: Energy,
        options: Options,
        metric: Metric | None = None,
    ) -> "UnitProblem":
        """Return the problem of two domains; rotations cost nothing if pins determine them.

        Args:
            outlines: of the source and of the target, in unit coordinates.
            holes: of both.
            pins: exact pins and strokes.
            energy: in unit coordinates, with the soft pins.
            options: those of the given problem.
            metric: of the source; None for the Euclidean plane.
        """
        return cls(
            *outlines,
            energy_with(pins, energy),
            options,
            anchors=(tuple(pins.outer[:, 0].tolist()), tuple(pins.outer[:, 1].tolist())),
            pins=pins.inner,
            strokes=pins.strokes,
            holes=holes,
            metrics=(metric, None),
        )

    @property
    def outline_pins(self) -> Complex:
        """The vertices of both outlines that must correspond; shape (l, 2)."""
        return np.array(self.anchors, np.complex128).T.reshape(-1, 2)

    @property
    def holed(self) -> bool:
        """Whether there are holes."""
        return any(self.holes.sides)

    @property
    def constrained(self) -> bool:
        """Whether there are strokes or pins, inside or on the outlines."""
        return bool(self.strokes) or bool(len(self.pins)) or bool(self.anchors[0] and not self.halved)

    @property
    def all_pins(self) -> Complex:
        """Pins inside and on the outlines, and points of strokes; shape (k, 2)."""
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
        return np.concatenate([self.pins, self.outline_pins, *stroke_pairs])

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
            holes=self.holes.inverse(),
            metrics=self.metrics[::-1],
            energy=self.energy.inverse(),
            inverted=not self.inverted,
        )


class SolvedProblem(NamedTuple):
    """A problem, which may be the inverse of the given one, and a map that solves it.

    Attributes:
        problem: the problem.
        state: the map, on a mesh of any size.
    """

    problem: UnitProblem
    state: DiscreteMap

    @property
    def cost(self) -> float:
        """The cost of the map of outlines (see `drawings.cost`), without the outline's term of the energy.

        All of both outlines is painted, except what virtual triangles cover.
        """
        problem, state = self
        shares = self._lost_shares
        return problem.energy.cost(state.z, state.u, state.material, shares, state.metrics, state.rotation)

    @property
    def _lost_shares(self) -> tuple[float, float]:
        """The share of the given source's area that is hidden, and of the given target's that is bare.

        These are the images of virtual triangles.
        """
        state = self.state
        if state.weights is None:
            return 0.0, 0.0
        areas = np.abs(triangle_areas(state.u[state.faces]))
        bare = float(areas[state.weights != 1].sum() / areas.sum())
        return (bare, 0.0) if self.problem.inverted else (0.0, bare)

    @property
    def meets_constraints(self) -> bool:
        """Whether the map meets all exact pins and strokes."""
        inside = self.state.inside
        goals = inside.goals[inside.stroke_index < 0]
        is_bound = self.state.bound or not inside.z.size
        return is_bound and bool(np.all(goals == self.problem.pins[:, 1]))
