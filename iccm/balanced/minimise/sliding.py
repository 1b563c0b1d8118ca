"""Vertices that slide along a curve: their directions, the curve's own energy, and the limits of their steps.

Each vertex of the outline, or of a stroke, has one unknown, its arclength τ on the polyline on which it slides.
It passes small corners. At a sharp corner it stops, and stays as long as the slopes on both sides hold it
there. A stroke's polyline is closed by running back along itself. Its vertices stay on the forward half, since
their order is kept, and the ends do not pass its ends.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ...native import Record, function, record

HELD, SLIDING, FREE = 0, 1, 2  # kinds of constrained vertices
# Weight of the outline's term; without it, edges of the outline cut across the tips of protrusions.
OUTLINE_WEIGHT = 0.02

RailsRecord = record(
    """struct Rails {
        const double *knots; const Complex *vertices; const double *corners; const int64_t *starts;
        const int64_t *own; const double *ends; }"""
)
BorderRecord = record(
    """struct Border {
        const int64_t *following; const double *spans; const double *stiffness; const double *laps; int64_t count; }"""
)
ConstraintsRecord = record(
    "struct Constraints { const int64_t *kinds; const Complex *goals; Rails rails; Border border; }"
)
_border_energy = function("double iccm_minimise_border_energy(const Border *border, const double *tau)")
_border_derivatives = function(
    """int64_t iccm_minimise_border_derivatives(
        const Border *border, const double *tau, double *slope, double *curvature)"""
)
_choose_directions = function(
    """int64_t iccm_minimise_choose_directions(
        const Constraints *constraints, const double *tau, const Complex *gradient, const double *slope,
        Complex *directions, double *low, double *high)"""
)
_point_at = function(
    """int64_t iccm_minimise_point_at(
        const double *knots, const Complex *vertices, int64_t size, double s, Complex *point)"""
)
_corners_beside = function(
    """int64_t iccm_minimise_corners_beside(
        const double *knots, int64_t size, const double *corners, int64_t corner_count, double s, double *distances)"""
)


class Rail(NamedTuple):
    """The closed polyline on which vertices slide.

    Attributes:
        knots: (e + 1,) arclengths of its vertices.
        vertices: (e,) complex.
        corners: (c,) arclengths of the sharp corners, ascending, at which a step ends.
    """

    knots: Real
    vertices: Complex
    corners: Real


NO_RAIL = Rail(np.array([0.0, 1.0]), np.zeros(1, np.complex128), np.empty(0))
"""Rail of vertices that do not slide."""


class Rails(NamedTuple):
    """The rails (curves on which vertices slide) of all constrained vertices, concatenated, the outline's first.

    Attributes:
        knots: of all rails.
        vertices: of all rails.
        corners: of all rails.
        starts: (r + 1, 3) the first index of each rail in these three arrays.
        rail_index: (c,) the rail of each constrained vertex.
        ends: (r,) arclength at which each rail turns back along itself, inf if it does not; vertices stay
            before it.
    """

    knots: Real
    vertices: Complex
    corners: Real
    starts: Index
    rail_index: Index
    ends: Real

    @classmethod
    def of(cls, rails: Sequence[Rail], rail_index: Index, loops: int = 1) -> "Rails":
        """Concatenate rails; the first `loops` are closed curves, the others strokes traversed forth and back."""
        ends = [np.inf if k < loops else 0.5 * rail.knots[-1] for k, rail in enumerate(rails)]
        starts = np.cumsum([(0, 0, 0), *(tuple(part.size for part in rail) for rail in rails)], axis=0)
        if len(rails) == 1:  # the usual case
            return cls(*rails[0], starts, rail_index, np.array(ends))
        knots, vertices, corners = (np.concatenate(parts) for parts in zip(*rails))
        return cls(knots, vertices, corners, starts, rail_index, np.array(ends))

    def record(self) -> Record:
        """Return the struct that is passed to the core."""
        return RailsRecord(self.knots, self.vertices, self.corners, self.starts, self.rail_index, self.ends)


class Border(NamedTuple):
    """The constrained vertices as chains, with the energy ½ β Σ (Δτ²/Δs + Δs²/Δτ) of their edges.

    Attributes:
        following: (c,) the next vertex of each one; itself at the end of a stroke and for a pin.
        spans: (c,) Δs, arclengths of the edges on the fixed side.
        stiffness: (c,) β of the edges, 0 if there is no edge.
        laps: (c,) jump of the arclength along the edge: a loop's length where the loop closes, else 0.
    """

    following: Index
    spans: Real
    stiffness: Real
    laps: Real

    @classmethod
    def still(cls, vertices: Index) -> "Border":
        """Return chains of single vertices."""
        ones = np.ones(vertices.size)
        return cls(vertices, ones, 0 * ones, ones)

    def then(self, following_border: "Border") -> "Border":
        """Return these chains, followed by others of the vertices that follow."""
        return Border(*(np.append(a, b) for a, b in zip(self, following_border)))

    def record(self) -> Record:
        """Return the struct that is passed to the core."""
        return BorderRecord(self.following, self.spans, self.stiffness, self.laps, self.following.size)


class Constraints(NamedTuple):
    """The constraints on the first c vertices of a mesh.

    Attributes:
        kinds: (c,) HELD, SLIDING or FREE.
        goals: (c,) goal positions of held vertices; ignored for others.
        rails: the rails of sliding vertices.
        border: the curves as chains.
    """

    kinds: Index
    goals: Complex
    rails: Rails
    border: Border

    @classmethod
    def of_fixed(cls, u: Complex, fixed: Flags) -> "Constraints":
        """Return constraints that hold some vertices (n,) at their positions."""
        vertices = np.arange(1 + np.flatnonzero(fixed).max(initial=-1))
        kinds = np.where(fixed[vertices], HELD, FREE)
        return cls(kinds, u[vertices], Rails.of([NO_RAIL], 0 * vertices), Border.still(vertices))

    def record(self) -> Record:
        """Return the struct that is passed to the core."""
        return ConstraintsRecord(self.kinds, self.goals, self.rails.record(), self.border.record())


def border_energy(border: Border, tau: Real) -> float:
    """Compute the curves' energy at arclengths tau (c,); infinite if two vertices are not in order."""
    return float(_border_energy(border.record(), tau))


def border_derivatives(border: Border, tau: Real, slope: Real, curvature: Real) -> None:
    """Fill in derivatives of the curves' energy.

    `slope` (c,) is the first derivative with respect to each τ, `curvature` (c,) the second with respect to
    each gap.
    """
    _border_derivatives(border.record(), tau, slope, curvature)


def choose_directions(
    constraints: Constraints,
    tau: Real,
    gradient: Complex,
    slope: Real,
    directions: Complex,
    low: Real,
    high: Real,
) -> None:
    """Fill in the direction in which each constrained vertex may slide, and the limits of its step.

    Args:
        constraints: the constraints.
        tau: (c,) arclengths.
        gradient: (n,) of the energy in the plane.
        slope: (c,) of the curves' energy.
        directions: (c,) complex unit tangents, 0 for vertices that do not move, written.
        low: (c,) most negative step, written.
        high: (c,) largest step, written.
    """
    _choose_directions(constraints.record(), tau, gradient, slope, directions, low, high)


def point_at(rail: Rail, s: float) -> complex:
    """Return the point of a rail at arclength s."""
    point = np.empty(1, np.complex128)
    _point_at(rail.knots, rail.vertices, rail.vertices.size, s, point)
    return complex(point[0])


def corners_beside(rail: Rail, s: float) -> tuple[bool, float, float]:
    """Return whether arclength s is at a corner, and the distances to the previous (< 0) and the next corner."""
    distances = np.empty(2)
    on = _corners_beside(rail.knots, rail.vertices.size, rail.corners, rail.corners.size, s, distances)
    return bool(on), float(distances[0]), float(distances[1])
