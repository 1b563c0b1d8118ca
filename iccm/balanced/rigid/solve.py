"""Rigid regions: parts of the source that a map moves as a whole, by a similarity each.

The map without them is carried to a mesh that has the regions' outlines as edges. There the triangles of a region
follow a similarity c z + t, of which c is given, or what the region has on average, and t is free. Their density is
quadratic and counts more and more (a penalty method: Nocedal and Wright, *Numerical Optimization*, 17.1) until what is
left of their distortion is below what anyone sees. What surrounds them gives way by the balanced energy, so that
nothing folds on the way. Where a region gets stuck it begins as small as the map has it there, and grows to its size,
or as far as there is room.
"""

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ... import progress
from ...arrays import Complex, Flags, Real
from ...maps.distortion import weighted_quantile
from ..errors import NoMapError, Stuck
from ..model import mesh_sizes
from ..model.discrete_map import DiscreteMap
from ..model.measures import derivatives
from ..model.outline_split import split_at_vertices
from ..model.settings import Settings, SolveLog
from ..model.sketch import Sketch
from ..search import warm_start
from ..search.final_mesh import LAST_DECREASE, LAST_STEPS, Meshed, final_level, meet_bounds_by
from ..search.levels import POWER, Level, UnitProblem, refine

KEPT = 5e-3  # strain of a region that no eye sees: a pixel in 200
STIFF, STIFFER, SOFTEST = 10.0, 10.0, 1e4
"""Weights of regions, times the energy without them: the first one, the factor to the next, and the one from which a
region that gives way no more is stuck."""
STUCK = 0.8  # of the strain, that is left for ten times the weight
STEPS, DECREASE = 12, 1e-3  # of Newton for a weight, and the relative decrease that ends them
SMALL, SMALLER, SHRINKS = 0.05, 0.5, 4
"""Share of a region's area that is squeezed more than by the size it begins to grow from, and by which factor and how
often that is halved where it is too large still."""
FIRST, NEXT, LEAST, FRESH = 0.25, 1.5, 0.02, 0.1  # shares of growing: as in `homotopy`, and on a new mesh
CROWDED = 1e2
"""Times the energy without regions, at which there is no room left for larger ones: at q = 3 what surrounds them is
distorted ten times as much."""
MESHES = 3  # new ones, on which regions may go on to grow
HARDENINGS = 5  # of regions that give way when the rest has settled
VARIANTS = ((True, False), (True, True), (False, False))
"""Whether the outlines' kinks come last, and if so, whether before the regions are rigid."""


@dataclass(frozen=True, eq=False)
class Rigid:
    """What is asked of rigid regions, in unit coordinates.

    Attributes:
        regions: polygons, the outer one first.
        aims: (k,) complex, the derivative of each one's similarity, as far as it is known.
        turns: (k,) whether regions may turn.
        sizes: (k,) whether they may have any size.
    """

    regions: tuple[tuple[Complex, ...], ...]
    aims: Complex
    turns: Flags
    sizes: Flags

    def aims_beside(self, own: Complex, share: Real | float = 1.0, begun: Complex | None = None) -> Complex:
        """(k,) a share of the way from `begun` to the aims, what is free being as regions have it."""
        way = np.zeros(own.size, complex) if begun is None else (1 - share) * np.log(begun / self.aims)
        wanted = self.aims * np.exp(way)
        size = np.where(self.sizes, np.abs(own), np.abs(wanted))
        turn = np.where(self.turns, own, wanted)
        return np.asarray(size * turn / np.abs(turn), np.complex128)


def keep_rigid(
    problem: UnitProblem, start: Meshed, rigid: Rigid, settings: Settings, journal: SolveLog
) -> DiscreteMap:
    """The map gone on to from one without regions; its regions may be smaller than asked for, or not quite rigid.

    Raises:
        NoMapError: none without folds follows the regions' outlines.
    """
    progress.tell("rigid regions")
    problem = problem._replace(regions=rigid.regions)
    sketch = Sketch(start.z, start.u, start.faces, start.border, loops=start.loops, weights=start.weights)
    found = []
    for smooth, split in VARIANTS:
        with suppress(Stuck):
            level = final_level(problem, settings, smooth=smooth)
            state = warm_start.continue_from(level, sketch, problem)
            if split:  # later meshes have all kinks, too
                state, level = split_at_vertices(state), final_level(problem, settings)
            state = stiffen(level, state, rigid, problem.theta)
            state = split_at_vertices(state) if smooth and not split else state
            found.append(settle(state, problem.theta, settings))
            if is_rigid(found[-1]):
                break
    if not found:
        raise NoMapError("rigid: no map without folds follows the outlines of the regions")
    best = min(found, key=lambda state: strains(state).max())
    journal.level("rigid", best, POWER)
    return best


def stiffen(level: Level, state: DiscreteMap, rigid: Rigid, theta: float) -> DiscreteMap:
    """The map with its regions rigid: at their sizes, or as large as there is room."""
    begun = replace(state, aims=np.empty(0, complex)).forward(theta, POWER, STEPS, DECREASE)
    found = harden(begun, rigid, theta, begun.energy)
    if is_rigid(found):
        return found
    own, size = mean_derivatives(begun), np.minimum(squeezed(begun), np.abs(rigid.aims))
    for _ in range(SHRINKS):
        for way in (rigid.aims, own):  # turned as they should be, or else as they are
            small, turned = (
                replace(rigid, aims=size * aims / np.abs(aims), sizes=np.zeros(own.size, bool))
                for aims in (way, rigid.aims)
            )
            found = harden(begun, small, theta, begun.energy)
            if is_rigid(found):  # to its turn first, while it is small
                for leg in (turned, rigid):
                    found = grow(level, found, leg, theta, CROWDED * begun.energy)
                return found
        size = SMALLER * size
    return found


def harden(state: DiscreteMap, rigid: Rigid, theta: float, energy: float) -> DiscreteMap:
    """The map with regions that weigh more and more, until they are rigid or stuck."""
    weight, before = STIFF * energy, np.inf
    while True:
        aims = rigid.aims_beside(mean_derivatives(state))
        state = replace(state, aims=aims, stiffness=weight).forward(theta, POWER, STEPS, DECREASE)
        strain = strains(state).max()
        if strain <= KEPT or (weight >= SOFTEST * energy and strain > STUCK * before):
            return state
        weight, before = STIFFER * weight, strain


def grow(level: Level, state: DiscreteMap, rigid: Rigid, theta: float, most: float) -> DiscreteMap:
    """The map with rigid regions as large as they should be, or as there is room for up to an energy; on a new mesh
    where they get stuck."""
    begun, share = state.aims, np.where(np.abs(state.aims - rigid.aims) > KEPT * np.abs(rigid.aims), 0.0, 1.0)
    growing, step, fresh_at, meshes = share < 1, FIRST, -1.0, MESHES
    while growing.any():
        new = np.where(growing, np.minimum(1, share + step), share)
        aims = rigid.aims_beside(mean_derivatives(state), new, begun)
        tried = replace(state, aims=aims).forward(theta, POWER, STEPS, DECREASE)
        if not is_rigid(tried) and tried.energy <= most:
            tried = replace(tried, stiffness=STIFFER * tried.stiffness)
            tried = tried.forward(theta, POWER, STEPS, DECREASE)
        if is_rigid(tried) and tried.energy <= most:
            state, share, step = tried, new, NEXT * step
            growing = share < 1
            continue
        step *= 0.5
        if step >= LEAST:
            continue
        gone_on = share.mean() > fresh_at + FRESH  # since the last new mesh
        fresh = on_new_mesh(level, state, rigid, theta) if meshes and gone_on else None
        if fresh is not None:
            state, step, fresh_at, meshes = fresh, FRESH, float(share.mean()), meshes - 1
            continue
        tight = growing & (strains(tried) > KEPT)
        growing, step = growing & ~(tight if tight.any() else growing), FIRST
    return state


def on_new_mesh(level: Level, state: DiscreteMap, rigid: Rigid, theta: float) -> DiscreteMap | None:
    """The map with its regions rigid on a mesh that is finer where it magnifies; None where that does not work."""
    sizes = mesh_sizes.graded(state.z, state.u, state.faces, 0.5 * level.size**2)
    try:
        fresh = refine(level, state, sizes)
    except Stuck:
        return None
    held = replace(rigid, aims=state.aims, sizes=np.zeros(state.aims.size, bool))
    fresh = harden(fresh, held, theta, fresh.forward(theta, POWER, 1, DECREASE).energy)
    return fresh if is_rigid(fresh) else None


def settle(state: DiscreteMap, theta: float, settings: Settings) -> DiscreteMap:
    """The map at rest with its regions rigid, and bounds met."""

    def descent(state: DiscreteMap, q: float) -> DiscreteMap:
        return state.forward(theta, q, LAST_STEPS, LAST_DECREASE)

    for _ in range(HARDENINGS):
        state = descent(state, POWER)
        if is_rigid(state):
            break
        state = replace(state, stiffness=STIFFER * state.stiffness)
    return meet_bounds_by(descent, state, settings) if settings.bounded else state


def is_rigid(state: DiscreteMap) -> bool:
    """Whether all regions keep to their aims."""
    return bool((strains(state) <= KEPT).all())


def mean_derivatives(state: DiscreteMap) -> Complex:
    """(k,) the mean f_z of each region."""
    (a, _, areas), own = _inside(state)
    return _mean(own, areas, a.real) + 1j * _mean(own, areas, a.imag)


def strains(state: DiscreteMap) -> Real:
    """(k,) root mean square distance of each region's derivatives from its aim, relative to that."""
    (a, b, areas), own = _inside(state)
    away = np.abs(a - state.aims[own]) ** 2 + np.abs(b) ** 2
    return np.sqrt(_mean(own, areas, away)) / np.abs(state.aims)


def squeezed(state: DiscreteMap) -> Real:
    """(k,) the smaller singular value that all but a SMALL share of each region exceeds."""
    (a, b, areas), own = _inside(state)
    least = np.abs(a) - np.abs(b)
    count = int(own.max()) + 1
    return np.array([weighted_quantile(least[own == k], areas[own == k], SMALL) for k in range(count)])


def _inside(state: DiscreteMap) -> tuple[tuple[Complex, Complex, Real], np.ndarray]:
    """f_z, f_z̄ and areas of the regions' triangles, and of which region each is."""
    assert state.rigid is not None
    those = state.rigid >= 0
    return derivatives(state.z, state.u, state.faces[those]), state.rigid[those]


def _mean(own: np.ndarray, areas: Real, values: Real) -> Real:
    return np.bincount(own, areas * values) / np.bincount(own, areas)
