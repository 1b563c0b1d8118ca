"""Start from an earlier map: on its own mesh if the pins are among its vertices, else on a new one."""

from dataclasses import replace
from itertools import permutations

import numpy as np

from ...arrays import Complex, Index, Real, distinct
from ...curve import Curve
from ...linalg.cholesky import system_of
from ..holes.outlines import manageable_holes
from ..meshing.mesh import closed_links
from ..model import mesh_sizes
from ..model.boundary import MatchedBoundary, MeshHoles
from ..model.boundary_mesh import weights_of
from ..model.boundary_pairs import Pairs, loops_of
from ..model.discrete_map import GOOD_ENOUGH, DiscreteMap, folds
from ..model.inner_constraints import InnerConstraints
from ..model.mesh_map import MeshMap
from ..model.outline import Outline, simplify
from ..model.outline_split import split_at_vertices
from .final_mesh import TRIANGLES_PER_AREA, on_finer
from .homotopy import satisfy_constraints
from .levels import (
    EVENED_SHARE,
    FINE_BACKWARD,
    FINE_POWER,
    FINE_ROUNDS,
    RELEASED_STEPS,
    Level,
    refine,
)
from .pin_continuation import aim_feet, lead_one_by_one
from .unit_problem import UnitProblem

# Relative to the root of the area: a vertex this close to a pin or an outline is on it.
SAME_PLACE_SHARE = 1e-8
SIMPLIFIED_SHARE = 0.25 * SAME_PLACE_SHARE
"""Relative to the same: distance up to which vertices of an outline are left out. These may be off by a little more."""
CLOSE_TOLERANCES = (
    0.5  # relative to the tolerance: outlines of an earlier map this close to the given ones are kept
)
AT_REST_DECREASE = 1e-3
"""Relative decrease of a Newton step below which a map that meets its constraints counts as converged while
these are dragged, and when a solve starts from it, so that it does not change visibly.
"""
LEAST_TRIANGLE_SHARE = (
    0.5  # relative to the triangles of the final mesh: an earlier map with fewer gets a new mesh
)


def continue_from(level: Level, start: MeshMap) -> DiscreteMap:
    """Return the earlier map with the problem's constraints met, or as close as it came; unchanged if it meets them.

    Raises:
        Stuck: no map without folds follows these outlines.
    """
    state = on_its_mesh(level, start)
    if state is not None and state.miss == 0:
        return state
    state = state or refine(
        level, start, mesh_sizes.graded(start.z, start.u, start.faces, 0.5 * level.size**2)
    )
    return _constrained(level, state).relax()


def met_on_its_mesh(level: Level, start: MeshMap, *, coarse: bool = False) -> DiscreteMap | None:
    """Return the earlier map unchanged if it meets the level's constraints on its own mesh; None if not.

    A mesh with too few triangles to continue from counts only if `coarse`, as for a map that is to be kept.
    """
    state = on_its_mesh(level, start, coarse=coarse)
    return state if state is not None and state.miss == 0 else None


def slide_anew(level: Level, start: MeshMap) -> DiscreteMap:
    """Return the earlier map with its outlines converged again, on a level with smooth outlines.

    Corners of both shapes hold their vertices, and no vertex passes them before they are released, and fixed
    again on a new mesh.

    Raises:
        Stuck: it folds.
    """
    state = continue_from(level, start)
    state = state.forward(FINE_POWER, RELEASED_STEPS, GOOD_ENOUGH, corners=False)
    state = on_finer(level, state).alternate(FINE_POWER, FINE_ROUNDS, FINE_BACKWARD)
    return split_at_vertices(state)


def _constrained(level: Level, state: DiscreteMap) -> DiscreteMap:
    strokes = level.problem.strokes
    if not state.inside.z.size:
        return state
    if strokes:  # vertices for the strokes' corners, at their places in the earlier map
        state = refine(level, aim_feet(strokes, state, EVENED_SHARE))
    new = satisfy_constraints(replace(state, bound=False))
    new = new if new.miss == 0 or strokes else lead_one_by_one(level, new)
    if new.miss == 0:
        return new
    return replace(state, bound=False) if strokes else new.hold_in_place()


def outlines_followed(
    start: MeshMap, given: UnitProblem
) -> tuple[Curve, Curve, tuple[tuple[Curve, ...], tuple[Curve, ...]]] | None:
    """Return the outlines and holes of a problem as an earlier map follows them; None if it does not follow them.

    If the given outlines were simplified again, they would have other corners, at which the map's mesh has no
    vertices. Holes without a partner have no loop in the map. Of these, vertices that the mesh has are kept.
    """
    tolerance = given.options.tolerance
    sides = (start.z, given.source, given.holes.source), (start.u, given.target, given.holes.target)
    followed: list[list[Curve]] = []
    for side, (w, outer, inner) in enumerate(sides):
        rings = {(loop.source, loop.target)[side]: w[loop.vertices] for loop in start.loops}
        tolerance_length = CLOSE_TOLERANCES * tolerance * outer.diagonal
        curves = [_followed(w[start.outer], outer, tolerance_length)]
        all_have_loops = all(k in rings for k in range(len(inner)))
        simplified = inner if all_have_loops else manageable_holes(outer, inner, tolerance)
        for k, rim in enumerate(inner):
            if k in rings:
                curves.append(_followed(rings[k], rim, tolerance_length))
            else:
                curves.append(_followed(_present(rim, w), rim, tolerance_length) or simplified[k])
        outlines = [curve for curve in curves if curve is not None]
        if len(outlines) < 1 + len(inner):
            return None
        followed.append(outlines)
    (source, *rims), (target, *goals) = followed
    return source, target, (tuple(rims), tuple(goals))


def _present(outline: Curve, w: Complex) -> Complex:
    """Return the vertices of an outline that are among the vertices w of a mesh."""
    is_present = [float(np.abs(w - vertex).min()) <= SAME_PLACE_SHARE for vertex in outline.z]
    return outline.z[is_present]


def _followed(rim: Complex, outline: Curve, tolerance: float) -> Curve | None:
    """Return the polygon of an outline's vertices; None if it is not close to the given one."""
    if rim.size < 3:
        return None
    curve = Curve(rim)
    curve = simplify(curve, SIMPLIFIED_SHARE / curve.diagonal)
    away = max(a.distances(b.z).max() for a, b in permutations((curve, outline)))
    return curve if away <= tolerance else None


def on_its_mesh(level: Level, start: MeshMap, *, coarse: bool = False) -> DiscreteMap | None:
    """Return the earlier map on its own mesh.

    Returns:
        The map; None unless its outlines are the level's, all pins are among its vertices, and it has enough
        triangles or may be `coarse`.
    """
    problem = level.problem
    if not coarse and len(start.faces) < LEAST_TRIANGLE_SHARE * TRIANGLES_PER_AREA / level.size**2:
        return None
    if folds(start.faces, start.u) or folds(start.faces, start.z):  # possible if outlines moved
        return None
    if problem.strokes or problem.regions or len(start.loops) < len(level.holes[1]):
        return None
    vertices = [start.outer, *(loop.vertices for loop in start.loops)]
    outlines = list(zip(*level.outlines(start.loops)))
    located = [_pairs_on(*pair, start.z[v], start.u[v]) for pair, v in zip(outlines, vertices)]
    rims = [pairs for pairs in located if pairs is not None]
    if len(rims) < len(located):
        return None
    pairs = Pairs.joined(rims)
    anchored = np.zeros(start.border, bool)
    if level.anchors is not None:
        at_anchor = anchored[start.outer] = _at(level.anchors.s, rims[0].s, level.source.length)
        if at_anchor.sum() < level.anchors.s.size or np.any(
            at_anchor != _at(level.anchors.tau, rims[0].tau, level.target.length)
        ):
            return None
    alone = level.alone(start.loops)
    filled = [_vertices_on(level.holes[0][k], start.z) for k in alone]
    order = _kept_first(start, problem.pins[:, 0], [rim for rim in filled if rim is not None])
    if order is None or any(rim is None for rim in filled):
        return None
    place = np.argsort(order)
    faces, z = place[start.faces], start.z[order]
    sizes = [(k, -1, rim.size) for k, rim in zip(alone, filled) if rim is not None]
    first = start.border + len(problem.pins)
    around = closed_links([rim.s.size for rim in rims])
    following = [
        around,
        start.border + np.arange(len(problem.pins)),
        first + closed_links([n for *_, n in sizes]),
    ]
    loops = loops_of(sizes, first)
    holes = MeshHoles(tuple(outlines[1:]), start.loops, loops)
    return DiscreteMap(
        faces,
        z,
        start.u[order],
        boundary=MatchedBoundary(level.source, level.target, pairs, anchored, holes=holes),
        pattern=system_of(faces, np.concatenate(following), order.size),
        inside=InnerConstraints.of_pins(problem.pins),
        bound=True,
        weights=weights_of(z, faces, [z[loop.vertices] for loop in loops]) if loops else None,
        metrics=problem.metrics,
    ).with_energy(problem.energy)


def _pairs_on(source: Outline, target: Outline, z: Complex, u: Complex) -> Pairs | None:
    """Return the vertices of an outline as pairs; None if they are not on it, or a corner has no vertex."""
    s, tau = _along(source.curve, z), _along(target.curve, u)
    if s is None or tau is None:
        return None
    at_source, at_target = (_at(o.corners, x, o.length) for o, x in ((source, s), (target, tau)))
    whole = at_source.sum() >= source.corners.size and at_target.sum() >= target.corners.size
    return Pairs(s, tau, at_source, at_target) if whole else None


def _kept_first(start: MeshMap, pins: Complex, filled: list[Index]) -> Index | None:
    """Return an order of the vertices in which those of pins and of filled holes follow the outlines' vertices.

    Returns:
        (n,) vertices; None if a pin has none.
    """
    away = np.abs(start.z[start.border :] - pins[:, None])
    retained = np.concatenate([start.border + away.argmin(axis=1), *filled])
    if np.any(away.min(axis=1) > SAME_PLACE_SHARE) or distinct(retained).size < retained.size:
        return None
    remaining = np.setdiff1d(np.arange(start.border, start.z.size), retained)
    return np.concatenate([np.arange(start.border), retained, remaining])


def _vertices_on(outline: Outline, z: Complex) -> Index | None:
    """Return the vertices on a closed outline, in its order; None if a corner has none."""
    s = outline.curve.closest(z)
    on = np.flatnonzero(np.abs(outline.curve.at(s) - z) <= SAME_PLACE_SHARE)
    on = on[np.argsort(s[on])]
    return on if _at(s[on], outline.corners, outline.length).all() else None


def _along(curve: Curve, w: Complex) -> Real | None:
    """Return ascending arclengths of points in order on a closed curve; None if they are not on it, or not in order."""
    s = curve.closest(w)
    if np.abs(curve.at(s) - w).max() > SAME_PLACE_SHARE:
        return None
    steps = np.mod(np.diff(s, append=s[0]), curve.length)
    if abs(steps.sum() - curve.length) > 0.5 * curve.length or steps.min() <= 0:
        return None
    return s[0] + np.append(0, np.cumsum(steps[:-1]))


def _at(places: Real, s: Real, length: float) -> np.ndarray:
    """Return which arclengths are among the places."""
    gap = np.mod(s[:, None] - places + 0.5 * length, length) - 0.5 * length
    return np.any(np.abs(gap) < SAME_PLACE_SHARE, axis=1)
