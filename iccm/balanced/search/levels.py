"""One level of the search, with outlines of one fineness and one mesh size.

It makes maps without folds from correspondences of the outlines, and transfers maps from other levels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ... import progress
from ...arrays import Complex, Real, distinct
from ...curve import Curve
from ..constraints.strokes import inside
from ..errors import Stuck, Tangled, check_time, first_success
from ..holes.bays import bays_within
from ..holes.outlines import FEWEST_RIM_VERTICES, outlines_of, rim_spacing, space_out
from ..meshing.mesh import Sizes
from ..meshing.transfer import interpolate
from ..minimise.untangle import STEPS
from ..model.boundary import MatchedBoundary, MeshHoles
from ..model.boundary_mesh import mesh_boundary
from ..model.boundary_pairs import (
    HoleMatch,
    Loop,
    Match,
    Pairs,
    boundary_pairs,
    limit_slope,
    loops_of,
    pass_through,
    subdivide,
)
from ..model.discrete_map import DiscreteMap
from ..model.inner_constraints import InnerConstraints
from ..model.mesh_map import MeshMap
from ..model.mesh_sizes import coarser_in_bays, finer_at_pins
from ..model.outline import Outline
from .unit_problem import UnitProblem

SPACING_MESH_SIZES = 0.75  # distance of the outline's vertices, in mesh sizes
BACKWARD_STEPS = 3  # Newton steps on the inverse of a coarse map, after those on the map
RELEASED_STEPS = 8  # Newton steps after each release of corners; the next mesh continues from there
FINE_POWER = 3.0
"""Power q of the density on fine meshes. At q = 1 a pin pulls out a spike: the largest K of a square with its
centre moved is 7.4, and 3.4 at q = 3.
"""
# Rounds of steps on the map, and steps on its inverse; most pairs need 2 or 3 rounds.
FINE_ROUNDS, FINE_BACKWARD = 8, 4
EVENED_SHARE = 0.02  # share of even spacing mixed into closest points, which accumulate at corners
SPREAD_SHARE = (
    # Share of even spacing mixed in between pins on outlines, which could squeeze a match to zero length.
    0.02
)
MOST_PAIRS = 3000  # vertices of an outline: those of a bar of 4000 : 1 at the fine mesh size
# Steps of unfolding if fewer leave folds: these unfold 7 of 10 meshes that 40 steps leave folded.
PATIENT_STEPS = 200
MOST_START_VERTICES = 12_000
"""Vertices of the meshes of all starts together. Usual outlines need about 200 vertices per start, for 13
starts. Outlines that nearly touch themselves need 5,000, and the best of three starts differs little from the
best of nine.
"""
MOST_TANGLED_AROUND_REGIONS = 5
"""Failed starts after which no others are tried around rigid regions that are cut out: regions that are in each
other's way are so for every correspondence of the outlines.
"""


@dataclass(frozen=True, eq=False)
class Level:
    """A problem with outlines of one fineness, and one size of triangles.

    Attributes:
        problem: the problem.
        source: outline of the source.
        target: outline of the target.
        size: edge length h of the triangles.
        anchors: pairs of arclengths on the outer outlines that must correspond; None if there are none.
        steepest: largest slope of a match, relative to the mean.
        holes: outlines of holes of the source and of the target.
        bays: the polylines of the problem's filled concavities, simplified like the outlines.
        smooth: whether vertices slide past all but sharp corners.
    """

    problem: UnitProblem
    source: Outline
    target: Outline
    size: float
    anchors: Match | None
    steepest: float
    holes: tuple[tuple[Outline, ...], tuple[Outline, ...]] = ((), ())
    bays: tuple[Complex, ...] = ()
    smooth: bool = False

    @classmethod
    def of(
        cls,
        problem: UnitProblem,
        size: float,
        fineness: float,
        corner_fineness: float,
        steepest: float,
        *,
        smooth: bool = False,
    ) -> "Level":
        """Return the level of mesh size h.

        Args:
            problem: the problem.
            size: edge length h.
            fineness: of the outlines, relative to their diagonals.
            corner_fineness: of the corners, in the same way.
            steepest: largest slope of a match, relative to the mean.
            smooth: whether corners are only where the outlines bend sharply for the mesh size.
        """
        mesh_spacing = SPACING_MESH_SIZES * size
        spacing = mesh_spacing if smooth else np.inf
        (holes, goal_holes), (always, always_target) = problem.holes.sides, problem.fixed_vertices
        detail = fineness, corner_fineness
        source, *rims = outlines_of(problem.source, holes, *detail, always, spacing)
        target, *goals = outlines_of(problem.target, goal_holes, *detail, always_target, spacing)
        anchors = None
        if problem.anchors[0]:
            s, tau = source.arclengths(problem.anchors[0]), target.arclengths(problem.anchors[1])
            order = np.argsort(s)  # in a mirrored frame, pins have the opposite order
            s, tau = s[order], tau[order]
            anchors = Match(s, tau[0] + np.mod(tau - tau[0], target.length))
        return cls(
            *(problem, source, target, size, anchors, steepest),
            holes=(tuple(rims), tuple(goals)),
            bays=bays_within(source, problem.bays, fineness if smooth else corner_fineness, mesh_spacing)
            if problem.bays
            else (),
            smooth=smooth,
        )

    @property
    def is_too_long(self) -> bool:
        """Whether an outline needs more vertices than a mesh may have on its boundary, so that there is no mesh."""
        return max(self.source.length, self.target.length) > MOST_PAIRS * SPACING_MESH_SIZES * self.size

    def mapped(
        self, match: Match, sizes: Sizes | None = None, matches: list[Match] | None = None
    ) -> DiscreteMap:
        """Mesh the source for a match of the outlines; images are given on the boundary only.

        Args:
            match: the correspondence of the outlines.
            sizes: limits on the triangles' areas; by default those of the level's mesh size.
            matches: the correspondence of each stroke; by default proportional to arclength.
        """
        boundary, spacing, problem = self.boundary(match), SPACING_MESH_SIZES * self.size, self.problem
        sizes = sizes or Sizes.even(0.5 * self.size**2)
        if self.bays:
            sizes = coarser_in_bays(sizes, self.source.curve.z, self.bays)
        if problem.energy.pins is not None:
            pins = problem.energy.pins
            sizes = finer_at_pins(sizes, self.source.curve.z, pins.pairs[:, 0], pins.radii)
        inner = InnerConstraints.of_pins(problem.pins)
        if problem.strokes:
            matches = matches or [stroke.even for stroke in problem.strokes]
            inner = inside(problem.strokes, matches, spacing, problem.pins)
        alone = self.alone(match.holes)  # holes whose outlines do not slide
        filled = [space_out(self.holes[0][k], spacing, every_vertex=self.smooth) for k in alone]
        sizes_of_filled = [(k, -1, rim.size) for k, rim in zip(alone, filled)]
        sizes_of_filled += [(-1, -1, bay.size - 2) for bay in self.bays]
        boundary = boundary.with_filled(loops_of(sizes_of_filled, boundary.size + inner.z.size))
        state = mesh_boundary(
            boundary, sizes, inner, filled, self.bays, subdivide_rings(problem.regions, spacing)
        )
        return replace(state, metrics=problem.metrics).with_energy(problem.energy)

    def boundary(self, match: Match, fewest: int = FEWEST_RIM_VERTICES) -> MatchedBoundary:
        """Return the boundary of a mesh for a match of the outlines, with at least `fewest` vertices on each hole."""
        outer = pass_through(
            limit_slope(match, self.steepest), self.anchors, 0.0 if self.problem.halved else SPREAD_SHARE
        )
        spacing = SPACING_MESH_SIZES * self.size
        if self.is_too_long:
            raise Stuck("an outline is too long for its area")
        outlines = tuple((self.holes[0][hole.source], self.holes[1][hole.target]) for hole in match.holes)
        pairs = [boundary_pairs(self.source, self.target, outer, spacing, self.anchors)]
        for hole, pair in zip(match.holes, outlines):
            pairs.append(
                boundary_pairs(
                    *pair, limit_slope(hole.match, self.steepest), rim_spacing(pair, spacing, fewest)
                )
            )
        sizes = [(hole.source, hole.target, rim.s.size) for hole, rim in zip(match.holes, pairs[1:])]
        holes = MeshHoles(outlines, loops_of(sizes, pairs[0].s.size))
        axis = self.anchors.s[-1] if self.anchors and self.problem.halved else np.inf
        joined = Pairs.joined(pairs)
        boundary = MatchedBoundary.of(self.source, self.target, joined, self.anchors, holes, axis)
        for loop in holes.loops:
            boundary.anchored[loop.vertices] = self.keeps(loop.source)
        return boundary

    def keeps(self, hole: int) -> bool:
        """Return whether a hole of the source is one that is cut out (around a rigid region)."""
        return hole >= len(self.holes[0]) - self.problem.cut_out

    def prescribed_match(self, source: int, target: int) -> Match | None:
        """Return the match of a cut-out hole with its partner, by shares of the length; None for other holes."""
        if not self.keeps(source):
            return None
        hole, partner = self.holes[0][source], self.holes[1][target]
        shares = distinct(np.round(np.concatenate([[0.0, 1.0], hole.shares, partner.shares]), 12))
        return Match(hole.at_shares(shares), partner.at_shares(shares))

    def outlines(self, loops: Sequence[Loop]) -> tuple[list[Outline], list[Outline]]:
        """Return the outer outlines, and those of holes, in the source and in the target."""
        source = [self.source, *(self.holes[0][loop.source] for loop in loops)]
        return source, [self.target, *(self.holes[1][loop.target] for loop in loops)]

    def inverse(self) -> "Level":
        """Return the level of the inverse map."""
        return replace(
            self,
            problem=self.problem.inverse(),
            source=self.target,
            target=self.source,
            anchors=self.anchors and self.anchors.inverse(),
            holes=self.holes[::-1],
        )

    def started(self, match: Match) -> DiscreteMap:
        """Return a map without folds for a match.

        If the harmonic map cannot be unfolded, which is frequent with holes, the inverse is tried.

        Raises:
            Stuck: none was found, or the time is over.
        """
        check_time()
        try:
            return self.mapped(match).unfold_from_harmonic()
        except Stuck:
            if (
                len(match.holes) != max(map(len, self.holes))
                or self.problem.halved
                or self.pinned
                or self.bays
            ):
                raise
        return self.inverse().mapped(match.inverse()).unfold_from_harmonic().swap_sides()

    def alone(self, partnered: Sequence[HoleMatch | Loop]) -> list[int]:
        """Return the holes of the source without a partner."""
        return sorted(set(range(len(self.holes[0]))) - {hole.source for hole in partnered})

    @property
    def domains(self) -> tuple[tuple[Outline, ...], tuple[Outline, ...]]:
        """The outlines of the source and of the target, the outer one first."""
        return (self.source, *self.holes[0]), (self.target, *self.holes[1])

    @property
    def pinned(self) -> bool:
        """Whether there are pins or strokes inside."""
        return bool(self.problem.strokes) or bool(len(self.problem.pins))


def subdivide_rings(regions: Sequence[Sequence[Complex]], spacing: float) -> list[list[Complex]]:
    """Return the rings of regions with edges no longer than the spacing."""

    def ring(z: Complex) -> Complex:
        edge, share = subdivide(Curve(z).lengths, spacing)
        return Curve(z).at(Curve(z).knots[edge] + share * Curve(z).lengths[edge])

    return [[ring(z) for z in region] for region in regions]


def initial_maps(level: Level, matches: list[Match]) -> list[DiscreteMap]:
    """Return maps without folds for those matches that have one.

    Fewer matches are tried if the outlines need very large meshes, and, around rigid regions that are cut out,
    if the first matches have none.
    """
    states: list[DiscreteMap] = []
    vertices = tangled = 0
    for match in progress.counted("starts", matches):
        if states and vertices > MOST_START_VERTICES * level.problem.options.effort:
            break
        if level.problem.cut_out and not states and tangled == MOST_TANGLED_AROUND_REGIONS:
            break
        try:
            states.append(level.started(match))
            vertices += states[-1].z.size
        except Tangled as error:
            tangled += 1
            vertices += error.u.size
        except Stuck:
            tangled += 1
    return states


def project(curve: Curve, points: Complex) -> Real:
    """Return arclengths of the closest points of a curve, made monotone, for points in order along it."""
    s = np.mod(curve.closest(points), curve.length)
    steps = np.mod(np.diff(s) + 0.5 * curve.length, curve.length) - 0.5 * curve.length
    s = s[0] + np.append(0, np.cumsum(steps))
    if (np.diff(s) < 0).any():
        from scipy.optimize import isotonic_regression  # slow to import, and seldom needed

        s = isotonic_regression(s).x
    even = s[0] + curve.length * np.arange(s.size) / s.size
    return (1 - EVENED_SHARE) * s + EVENED_SHARE * even  # strictly ascending


def match_on(level: Level, state: MeshMap) -> Match:
    """Return the match of a map's outlines on the outlines of another level.

    Vertices with known arclengths on the given outlines are transferred linearly, others by closest points.
    """
    sources, targets = level.outlines(state.loops)
    vertices = [state.outer, *(loop.vertices for loop in state.loops)]
    matches = []
    for number, (source, target) in enumerate(zip(sources, targets)):
        loop_vertices = vertices[number]
        if isinstance(state.boundary, MatchedBoundary):
            rim, pairs = state.boundary.loops[number], state.boundary.pairs
            s = source.simplified_from(rim.source.original(pairs.s[loop_vertices]))
            tau = target.simplified_from(rim.target.original(pairs.tau[loop_vertices]))
        else:
            s = project(source.curve, state.z[loop_vertices])
            tau = project(target.curve, state.u[loop_vertices])
        matches.append(_closed(source, target, s, tau))
    outer, *inner = matches
    holes = tuple(HoleMatch(loop.source, loop.target, match) for loop, match in zip(state.loops, inner))
    return outer._replace(holes=holes)


def _closed(source: Outline, target: Outline, s: Real, tau: Real) -> Match:
    return Match(np.append(s, s[0] + source.length), np.append(tau, tau[0] + target.length))


def refine(level: Level, state: MeshMap, sizes: Sizes | None = None, *, only: int = 0) -> DiscreteMap:
    """Return the map on the mesh of another level, without folds.

    Args:
        level: the other level.
        state: the map.
        sizes: limits on the triangles' areas; by default those of the level.
        only: if not 0, the only attempt is local unfolding in this many steps.

    Raises:
        Stuck: folds remain.
    """
    fine = interpolate_on(level, state, sizes)
    weighed = bool(level.bays)
    attempts = (
        lambda: fine.unfold_locally(steps=only or STEPS, weighed=weighed),
        lambda: fine.unfold_from_harmonic(),
        lambda: fine.unfold_locally(steps=PATIENT_STEPS, weighed=weighed),
    )
    return first_success(*(attempts[:1] if only else attempts))


def interpolate_on(level: Level, state: MeshMap, sizes: Sizes | None = None) -> DiscreteMap:
    """Return the map interpolated on the mesh of another level; it may fold."""
    fine = level.mapped(match_on(level, state), sizes, state.inside.matches)
    if state.bound:
        # Unmet goals are kept.
        fine = replace(fine, bound=True, inside=fine.inside.with_pins_of(state.inside))
    return fine.move_to_border(interpolate(state.z, state.faces, state.u, fine.z))
