"""Vertices that slide along a curve: their directions, the curve's own energy, and how far they may go.

Each vertex of the outline, or of a stroke, has one unknown, its arclength τ on the polyline it slides on. It passes
small kinks; at a corner it stops, and stays as long as the slopes to both sides hold it. A stroke's polyline is closed
by running back along itself; vertices stay on the way there: the order is kept, and the ends do not pass its ends.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ...jit import in_place
from ..kernels import dot, located, move

HELD, SLIDING, FREE = 0, 1, 2  # kinds of constrained vertices
SHARE_OF_GAP = 0.9  # by which two neighbours of the outline may approach in one step
BETA = 0.02  # weight of the outline's term; without it outline edges cut across the tips of limbs
SAME_PLACE = 1e-8  # of the length: a vertex this close to a corner is on it


class Rail(NamedTuple):
    """The closed polyline that vertices slide on.

    Attributes:
        knots: (e + 1,) arclengths of its vertices.
        vertices: (e,) complex.
        corners: (c,) arclengths of the corners, ascending, where a step ends.
    """

    knots: Real
    vertices: Complex
    corners: Real


NO_RAIL = Rail(np.array([0.0, 1.0]), np.zeros(1, np.complex128), np.empty(0))
"""For vertices that are on none."""


class Rails(NamedTuple):
    """The rails of all constrained vertices, one after the other, the outline's first.

    Attributes:
        knots: those of all rails.
        vertices: likewise.
        corners: likewise.
        starts: (r + 1, 3) where each rail begins in the three.
        own: (c,) the rail of each constrained vertex.
        ends: (r,) arclength at which each rail turns back along itself, inf where it does not: vertices stay between.
    """

    knots: Real
    vertices: Complex
    corners: Real
    starts: Index
    own: Index
    ends: Real

    @classmethod
    def of(cls, rails: Sequence[Rail], own: Index, loops: int = 1) -> "Rails":
        """The rails put together; the first `loops` are closed curves, the others strokes there and back again."""
        ends = [np.inf if k < loops else 0.5 * rail.knots[-1] for k, rail in enumerate(rails)]
        starts = np.cumsum([(0, 0, 0), *(tuple(part.size for part in rail) for rail in rails)], axis=0)
        if len(rails) == 1:  # as a rule
            return cls(*rails[0], starts, own, np.array(ends))
        knots, vertices, corners = (np.concatenate(parts) for parts in zip(*rails))
        return cls(knots, vertices, corners, starts, own, np.array(ends))


class Border(NamedTuple):
    """The constrained vertices as chains, with the energy ½ β Σ (Δτ²/Δs + Δs²/Δτ) of their edges.

    Attributes:
        following: (c,) the next vertex of each one; itself at the end of a stroke and for a pin.
        spans: (c,) Δs, arclengths of the edges on the side that is kept.
        stiffness: (c,) β of the edges, 0 where there is none.
        laps: (c,) what the arclength jumps by along the edge: a loop's length where it closes, else 0.
    """

    following: Index
    spans: Real
    stiffness: Real
    laps: Real

    @classmethod
    def still(cls, vertices: Index) -> "Border":
        """Vertices that no edge joins to others."""
        ones = np.ones(vertices.size)
        return cls(vertices, ones, 0 * ones, ones)

    def then(self, more: "Border") -> "Border":
        """These chains and others, of the vertices that follow."""
        return Border(*(np.append(a, b) for a, b in zip(self, more)))


class Constraints(NamedTuple):
    """What holds the first c vertices of a mesh.

    Attributes:
        kinds: (c,) HELD, SLIDING or FREE.
        goals: (c,) where held vertices are to be; elsewhere of no account.
        rails: what sliding ones slide on.
        border: the curves as chains.
    """

    kinds: Index
    goals: Complex
    rails: Rails
    border: Border

    @classmethod
    def held(cls, u: Complex, held: Flags) -> "Constraints":
        """Some vertices (n,) held where they are."""
        those = np.arange(1 + np.flatnonzero(held).max(initial=-1))
        kinds = np.where(held[those], HELD, FREE)
        return cls(kinds, u[those], Rails.of([NO_RAIL], 0 * those), Border.still(those))


@in_place
def rail_of(rails, v):
    """The rail of constrained vertex v."""
    a, b = rails.starts[rails.own[v]], rails.starts[rails.own[v] + 1]
    return Rail(rails.knots[a[0] : b[0]], rails.vertices[a[1] : b[1]], rails.corners[a[2] : b[2]])


@in_place
def point_at(rail, s):
    """The point at arclength s."""
    edge, along = located(rail.knots, s)
    share = min(along / (rail.knots[edge + 1] - rail.knots[edge]), 1.0)
    end = rail.vertices[(edge + 1) % rail.vertices.size]
    return rail.vertices[edge] + share * (end - rail.vertices[edge])


@in_place
def tangent(rail, s):
    """The unit tangent at arclength s."""
    edge, _ = located(rail.knots, s)
    step = rail.vertices[(edge + 1) % rail.vertices.size] - rail.vertices[edge]
    return step * (1 / abs(step))


@in_place
def way_to_corners(rail, s):
    """Whether s is on a corner, and the distances (negative, positive) to the corners behind and ahead."""
    length, corners = rail.knots[-1], rail.corners
    count = corners.size
    if count == 0:
        return False, -length, length
    near = SAME_PLACE * length
    s -= np.floor(s / length) * length
    k, end = 0, count
    while k < end:  # the first corner not before s: a bisection, since NumPy's compiles slowly
        middle = (k + end) // 2
        if corners[middle] < s - near:
            k = middle + 1
        else:
            end = middle
    behind = (corners[k - 1] if k > 0 else corners[count - 1] - length) - s
    on = k < count and corners[k] <= s + near
    k += 1 if on else 0
    ahead = (corners[k] if k < count else corners[k - count] + length) - s
    return on or behind > -near or ahead < near, behind, ahead


@in_place
def gap_ahead(border, tau, v):
    """Arclength from outline vertex v to the next one."""
    return tau[border.following[v]] - tau[v] + border.laps[v]


@in_place
def border_energy(border, tau):
    """The outline's energy; infinite where two vertices have changed places."""
    energy = 0.0
    for v in range(tau.size):
        gap, span = gap_ahead(border, tau, v), border.spans[v]
        if gap <= 0:
            return np.inf
        energy += 0.5 * border.stiffness[v] * (gap * gap / span + span * span / gap)
    return energy


@in_place
def border_derivatives(border, tau, slope, curvature):
    """Fills in the derivative by each τ and the second derivative by each gap."""
    for v in range(tau.size):
        slope[v] = 0.0
    for v in range(tau.size):
        gap, span, beta = gap_ahead(border, tau, v), border.spans[v], border.stiffness[v]
        pull = 0.5 * beta * (2 * gap / span - span * span / (gap * gap))
        slope[v] -= pull
        slope[border.following[v]] += pull
        curvature[v] = beta * (1 / span + span * span / (gap * gap * gap))


@in_place
def choose_directions(rails, tau, kinds, gradient, slope, directions, low, high):
    """Fills in where each constrained vertex may slide: a unit tangent, 0 to stay, and the limits of its step.

    Args:
        rails: what they slide on.
        tau: (c,) arclengths.
        kinds: (c,) HELD, SLIDING or FREE.
        gradient: (n,) of the energy in the plane.
        slope: (c,) of the curves' energy.
        directions: (c,) complex, written.
        low: (c,) most negative step, written.
        high: (c,) largest step, written.
    """
    for v in range(tau.size):
        directions[v], low[v], high[v] = 0j, 0.0, 0.0
        if kinds[v] != SLIDING:
            continue
        rail = rail_of(rails, v)
        nudge = 1e-9 * rail.knots[-1]
        on, behind, ahead = way_to_corners(rail, tau[v])
        forward = tangent(rail, tau[v] + nudge)
        directions[v], low[v], high[v] = forward, behind, ahead
        if not on:
            continue
        backward = tangent(rail, tau[v] - nudge)
        slope_ahead, slope_behind = (
            dot(gradient[v], forward) + slope[v],
            dot(gradient[v], backward) + slope[v],
        )
        low[v] = 0.0
        if tau[v] >= rails.ends[rails.own[v]] - nudge:
            slope_ahead = 0.0
        elif rails.ends[rails.own[v]] < np.inf and tau[v] <= nudge:
            slope_behind = 0.0
        if slope_ahead >= 0 and slope_behind <= 0:
            directions[v], high[v] = 0j, 0.0
        elif slope_ahead >= 0 or slope_behind > -slope_ahead > 0:
            directions[v], low[v], high[v] = backward, behind, 0.0


@in_place
def restrict(system, kinds, directions, matrix):
    """Rewrites the blocks of constrained vertices: first unknown along the direction, the missing ones 1.

    Args:
        system: pattern.
        kinds: (c,) of the first c vertices; FREE ones keep their blocks.
        directions: (c,) of these vertices; 0 holds one.
        matrix: (e, 4), changed in place.
    """
    count = directions.size
    for k in range(system.order.size):
        v = system.order[k]
        for p in range(system.starts[k], system.starts[k + 1]):
            w = system.order[system.columns[p]]
            if v < count and kinds[v] != FREE:
                for b in range(2):
                    matrix[p, b] = directions[v].real * matrix[p, b] + directions[v].imag * matrix[p, 2 + b]
                    matrix[p, 2 + b] = 0.0
            if w < count and kinds[w] != FREE:
                for b in range(0, 4, 2):
                    matrix[p, b] = directions[w].real * matrix[p, b] + directions[w].imag * matrix[p, b + 1]
                    matrix[p, b + 1] = 0.0
    for v in range(directions.size):
        if kinds[v] == FREE:
            continue
        matrix[system.diagonal[v], 3] = 1.0
        if directions[v] == 0:
            matrix[system.diagonal[v], 0] = 1.0


@in_place
def stiffen(system, border, directions, curvature, matrix):
    """Adds the outline's second derivatives to a restricted matrix."""
    for v in range(directions.size):
        w = border.following[v]
        if directions[v] != 0:
            matrix[system.diagonal[v], 0] += curvature[v]
        if directions[w] != 0:
            matrix[system.diagonal[w], 0] += curvature[v]
        if directions[v] != 0 and directions[w] != 0:
            matrix[system.ahead[v], 0] -= curvature[v]


@in_place
def _remaining(kinds, goals, u, way):
    """Fills in the way (n,) of held vertices to their goals; whether there is any."""
    moving = False
    for v in range(way.size):
        way[v] = 0j
    for v in range(goals.size):
        if kinds[v] == HELD and goals[v] != u[v]:
            way[v], moving = goals[v] - u[v], True
    return moving


@in_place
def add_product(system, matrix, way, gradient):
    """Adds the matrix times the way (n,) to the gradient (n,), both x + iy of each vertex."""
    for k in range(system.order.size):
        row = system.order[k]
        for p in range(system.starts[k], system.starts[k + 1]):
            column = system.order[system.columns[p]]
            if way[column] != 0:
                x, y = way[column].real, way[column].imag
                gradient[row] += complex(
                    matrix[p, 0] * x + matrix[p, 1] * y, matrix[p, 2] * x + matrix[p, 3] * y
                )
            if row != column and way[row] != 0:
                x, y = way[row].real, way[row].imag
                gradient[column] += complex(
                    matrix[p, 0] * x + matrix[p, 2] * y, matrix[p, 1] * x + matrix[p, 3] * y
                )


@in_place
def along_directions(kinds, directions, gradient):
    """Rewrites the gradient of constrained vertices along their directions, 0 where they are held."""
    for v in range(directions.size):
        if kinds[v] != FREE:
            gradient[v] = complex(dot(gradient[v], directions[v]), 0.0)


@in_place
def constrain(pattern, constraints, u, tau, space):
    """Rewrites the derivatives by all vertices' places as those by what may change: places of free vertices, and
    arclengths along curves; whether held vertices have a way to go to their goals.

    Args:
        pattern: of the Hessian.
        constraints: what holds the first c vertices.
        u: (n,) positions.
        tau: (c,) arclengths.
        space: matrix and gradient are rewritten, and what a step along the curves needs is filled in.
    """
    matrix, gradient, slope, directions = space.matrix, space.gradient, space.slope, space.directions
    rails, border, kinds = constraints.rails, constraints.border, constraints.kinds
    border_derivatives(border, tau, slope, space.curvature)
    choose_directions(rails, tau, kinds, gradient, slope, directions, space.low, space.high)
    # the whole way of held vertices is imposed: the others' gradient is that at its end, g + H way
    moving = _remaining(kinds, constraints.goals, u, space.way)
    if moving:
        add_product(pattern, matrix, space.way, gradient)
    restrict(pattern, kinds, directions, matrix)
    stiffen(pattern, border, directions, space.curvature, matrix)
    along_directions(kinds, directions, gradient)
    for v in range(directions.size):
        if directions[v] != 0:
            gradient[v] += slope[v]
    return moving


@in_place
def release(constraints, space):
    """Rewrites the step of constrained vertices as one in the plane, and fills in their steps along curves; those on a
    corner do not leave it to the wrong side."""
    step, slide = space.step, space.slide
    for v in range(slide.size):
        if constraints.kinds[v] == FREE:
            slide[v] = 0.0
            continue
        slide[v] = step[v].real
        if space.low[v] == 0:
            slide[v] = max(slide[v], 0.0)
        if space.high[v] == 0:
            slide[v] = min(slide[v], 0.0)
        step[v] = slide[v] * space.directions[v] + space.way[v]


@in_place
def gap_limit(border, tau, slide, most):
    """The largest share of the step, at most `most`, that keeps the outline's vertices well in order."""
    for v in range(tau.size):
        closing = slide[v] - slide[border.following[v]]
        if closing > 0:
            most = min(most, SHARE_OF_GAP * gap_ahead(border, tau, v) / closing)
    return most


@in_place
def moved(constraints, u, tau, t, space):
    """Fills in where a share t of the step leads, new_u and new_tau; a whole one takes held vertices to their goals."""
    new_u, new_tau = space.new_u, space.new_tau
    move(u, space.step, t, new_u)
    for v in range(tau.size):
        s = min(max(t * space.slide[v], space.low[v]), space.high[v])
        new_tau[v] = tau[v] + s
        if s != 0:
            new_u[v] = point_at(rail_of(constraints.rails, v), new_tau[v])
        if t == 1.0 and constraints.kinds[v] == HELD:
            new_u[v] = constraints.goals[v]
