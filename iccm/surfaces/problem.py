"""A problem with a surface on either side: checked, and transformed to unit coordinates of even layouts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arrays import Complex, Index, Real
from ..balanced.constraints.soft import PinnedPatches, bands_of, patches_of
from ..balanced.constraints.validate import Pins, check
from ..balanced.holes.given import named_partners, unequal, unit_holes
from ..balanced.model.energy import Energy
from ..balanced.model.metric import LaidMetric
from ..balanced.model.solution import SolveLog
from ..balanced.model.unit_coordinates import unit_curve, unit_similarities
from ..balanced.search import multilevel
from ..balanced.search.unit_problem import UnitProblem
from ..curve import Curve
from ..meshes.flatten import Flattening
from ..options import Options
from ..pins import Softness
from ..plane import Similarity
from ..problem import Holes, Problem
from .side import Side

ROUNDED_TOLERANCE_SHARE = 0.2
"""Of the tolerance: used for outlines between two surfaces: the rest is left to their triangles."""
Layouts = tuple[Flattening | None, Flattening | None]


@dataclass(frozen=True, eq=False)
class SurfaceProblem:
    """A checked problem.

    Attributes:
        sides: source and target.
        holes: of both, in the user's planes.
        points: (k, 2) pins that are not in a hole, in the user's planes.
        numbers: (k,) their numbers among all pins.
        softness: of these pins, in the user's planes; all exact if exact pins are requested.
        pins: these pins and the strokes, checked, in the user's planes.
        strokes: as given, in the user's planes.
        stroke_widths: of the bands around strokes that keep their form; empty for none.
        regions: rigid regions, polygons in the plane of the surface.
        options: of the solver.
        journal: log of the solver.
    """

    sides: tuple[Side, Side]
    holes: Holes
    points: Complex
    numbers: Index
    softness: Softness
    pins: Pins
    strokes: Sequence[tuple[Curve, Curve]]
    stroke_widths: Sequence[float]
    regions: tuple[Complex, ...]
    options: Options
    journal: SolveLog

    @classmethod
    def of(cls, problem: Problem, options: Options, layouts: Layouts) -> "SurfaceProblem":
        """Check a problem and set it up.

        Raises:
            InputError: pins or strokes that no one-to-one map satisfies; a surface without an even layout.
        """
        source, target = problem.outlines
        holes, points, numbers = named_partners(problem.holes, source, target, problem.pins, problem.strokes)
        pins = check(source, target, points, problem.strokes, numbers)
        sides = Side.of((source, *holes.source), layouts[0]), Side.of((target, *holes.target), layouts[1])
        journal = SolveLog(notes=[*unequal(holes), *pins.notes])
        regions = problem.rigid or problem.rigid_target
        softness = problem.softness.of_pins(numbers)
        if options.exact_pins or regions:  # pins in a rigid region determine how it moves
            softness = Softness.exact(len(points))
        elif all(layouts):  # pins between surfaces are landmarks, measured precisely
            radii = np.where(softness.is_given, softness.radii, 0.0)
            softness = replace(softness, radii=radii)
        return cls(
            sides,
            holes,
            points,
            numbers,
            softness,
            pins,
            problem.strokes,
            problem.stroke_widths,
            regions,
            options,
            journal,
        )

    @property
    def as_given(self) -> "SurfaceProblem":
        """The problem, to be solved in the user's planes instead of even layouts."""
        return replace(self, sides=(self.sides[0].as_given, self.sides[1].as_given))

    @property
    def onto(self) -> bool:
        """Whether the final map is on the target's own triangles; otherwise it is on the source's."""
        return self.sides[1].layout is not None

    @property
    def inner_holes(self) -> Holes:
        """The holes, in the planes where the problem is solved."""
        source, target = (tuple(side.solved[1:]) for side in self.sides)
        return Holes(source, target, self.holes.partners)

    @cached_property
    def inner_pins(self) -> Pins:
        """Pins and strokes, in the planes where the problem is solved."""
        source, target = self.sides

        def inward(pairs: Complex) -> Complex:
            return np.column_stack([source.inward(pairs[:, 0]), target.inward(pairs[:, 1])])

        strokes = tuple(
            replace(
                stroke, source=source.curve_inward(stroke.source), target=target.curve_inward(stroke.target)
            )
            for stroke in self.pins.strokes
        )
        return replace(
            self.pins, inner=inward(self.pins.inner), outer=inward(self.pins.outer), strokes=strokes
        )

    @cached_property
    def inner_softness(self) -> Softness:
        """Softness of the pins of `inner_pins`, those inside first, in the planes where the problem is solved."""
        inside = self.pins.inner
        numbers = np.array(
            [np.flatnonzero(self.points[:, 0] == point)[0] for point in inside[:, 0]], np.int64
        )
        scaled = _scaled(self.softness.of_pins(numbers), *self._scales(inside))
        return Softness.exact(self.pins.count).with_pins(np.arange(len(inside)), scaled)

    @cached_property
    def inner_bands(self) -> tuple[tuple[Curve, float], ...]:
        """The bands around strokes that keep their form, in the plane where the problem is solved."""
        source = self.sides[0]
        return tuple(
            (source.curve_inward(line), width * float(source.scale_inward(line.z).mean()))
            for line, width in bands_of(self.strokes, self.stroke_widths)
        )

    @cached_property
    def patches(self) -> PinnedPatches:
        """The soft pins, in the planes where the problem is solved."""
        pins = self.inner_pins
        source, target = self.sides[0].solved[0], self.sides[1].solved[0]
        points = np.concatenate([pins.inner, pins.outer])
        return patches_of(
            source, target, self.inner_holes.sides, points, self.inner_softness, pins, bands=self.inner_bands
        )

    @property
    def soft_pins(self) -> tuple[Complex, Softness]:
        """The soft pins (j, 2) in the user's planes, with the radii and tolerances that were chosen for them."""
        inside = self.pins.inner
        points = inside[self.inner_softness.is_soft[: len(inside)]]
        source_scale, target_scale = self._scales(points)
        return points, _scaled(self.patches.softness, 1 / source_scale, 1 / target_scale)

    def _scales(self, points: Complex) -> tuple[Real, Real]:
        """Return the local scales from the user's planes to those of the solver, at points (k, 2)."""
        source, target = self.sides
        return source.scale_inward(points[:, 0]), target.scale_inward(points[:, 1])

    @cached_property
    def to_unit(self) -> tuple[Similarity, Similarity]:
        """The similarities from the solver's planes to unit coordinates, for source and target."""
        source, target = (side.solved[0] for side in self.sides)
        return unit_similarities(source, target, self.options.rotation, self.inner_holes.sides)

    @cached_property
    def unit(self) -> UnitProblem:
        """The problem in unit coordinates of the layouts in which it is solved."""
        options, to_unit = self.options, self.to_unit
        if all(side.layout for side in self.sides):  # rounding in one plane may be magnified in another
            options = replace(options, tolerance=ROUNDED_TOLERANCE_SHARE * options.tolerance)
        outlines = (
            unit_curve(to_unit[0], self.sides[0].solved[0]),
            unit_curve(to_unit[1], self.sides[1].solved[0]),
        )
        patches = self.patches
        energy = Energy.of(options).in_unit(to_unit, None if patches.are_none else patches.unit(to_unit))
        holes, pins = (
            unit_holes(to_unit, self.inner_holes),
            self.inner_pins.without(patches.points[:, 0]).unit(to_unit),
        )
        unit = multilevel.simplified(UnitProblem.of(outlines, holes, pins, energy, options))
        metrics = [
            None if side.even is None else LaidMetric.of(side.even, similarity)
            for side, similarity in zip(self.sides, to_unit)
        ]
        return unit._replace(options=self.options, metrics=(metrics[0], metrics[1]))


def _scaled(softness: Softness, source_scale: Real, target_scale: Real) -> Softness:
    """Scale the lengths in the softness of k pins by their scales (k,) in the source and (k,) in the target."""
    return replace(
        softness,
        radii=source_scale * softness.radii,
        tolerances=target_scale * softness.tolerances,
        limits=target_scale * softness.limits,
    )
