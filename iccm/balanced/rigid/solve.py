"""Make regions of a map rigid, so that each is mapped by a similarity.

The triangles of a region follow a similarity c z + t. The derivative c is given, or is the region's mean
derivative, and t is free: their density is quadratic (a penalty method: Nocedal and Wright, *Numerical
Optimization*, 17.1). If c is the mean derivative, the weight of regions is raised until their remaining
distortion is invisible. Regions that are put in their places are rigid from the beginning, with a weight so
large that no descent of their surroundings could pay for more distortion than that. The surroundings adapt by
the balanced energy, so that nothing folds on the way.

First, the map without regions is transferred to a mesh that has the regions' outlines as edges; the regions are
put into their places, and their surroundings are unfolded and converge. If a region has no room for its size,
because the map takes it into a protrusion, or if folds remain, it is cut out and put where there is room: the
map of the domains with holes, with a region's outline mapped to its image point by point, is solved from
scratch, and the regions are put into it. If that fails, too, they begin small, in the map without them or in
one around them, and grow as far as they can.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
import shapely

from ... import progress
from ...arrays import Complex, Flags, Real, xy_of
from ...curve import Curve
from ...options import Options
from ...plane import Similarity
from ...problem import Holes
from ..errors import NoMapError, OutOfTime, Stuck, first_success, successes
from ..meshing.transfer import interpolate
from ..model import mesh_sizes
from ..model.boundary_mesh import region_at
from ..model.discrete_map import DiscreteMap
from ..model.measures import derivatives
from ..model.mesh_map import MeshMap
from ..model.outline_split import split_at_vertices
from ..model.solution import SolveLog
from ..search import multilevel, warm_start
from ..search.final_mesh import LAST_DECREASE, LAST_STEPS, final_level, meet_bounds_by
from ..search.levels import FINE_POWER, Level, match_on
from ..search.unit_problem import UnitProblem
from .room import room_for

UNSEEN_STRAIN = 5e-3  # strain of a region that is invisible: one pixel in 200
STIFF, STIFFER, SOFTEST = 10.0, 10.0, 1e4
"""Weights of regions relative to the energy without them: the first one, the factor to the next, and the one
from which a region whose strain hardly decreases is stuck.
"""
STUCK_STRAIN_RATIO = 0.8  # ratio of strains, after raising the weight by ten, above which a region is stuck
# Newton steps for each weight, and the relative decrease that ends them.
WEIGHT_STEPS, WEIGHT_DECREASE = 12, 1e-3
NEXT, LEAST = 1.5, 0.02  # growth of the step, and the least step, of regions that grow; as in `homotopy`
SMALLEST_SIZE_SHARE = 0.01  # relative to its size: size at which a region begins that has no room anywhere
BEGUN = (
    0.0,
    0.5,
    0.25,
    0.125,
)  # shares of their sizes from which regions grow, tried in turn; 0 for the map without them
SAME_SHARE = 1e-6  # of the unit of length and of scales: similarities that differ by less are the same
# Rounds of steps for the surroundings of regions, after each of which the regions' weight is adapted.
WEIGHT_ROUNDS = 6
LARGE_SIZE_SHARE = 0.98  # relative to the requested size: no other place is tried for a region this large
VARIANTS = ((True, False), (True, True), (False, False))
"""Whether corners of the outlines are inserted at the end, and if so, whether before the regions become rigid."""


@dataclass(frozen=True, eq=False)
class Rigid:
    """Requested properties of rigid regions, in unit coordinates.

    Attributes:
        regions: polygons, the outer one first.
        aims: (k,) complex, the derivative of each one's similarity, as far as it is prescribed.
        rotates: (k,) whether the rotation is free.
        sizes: (k,) whether the scale is free.
        anchors: (k, 2) a point of each one and its image, if pins prescribe them; NaN otherwise.
        is_smaller_nearer: whether regions may be smaller, in order to lie nearer to where the map has them.
    """

    regions: tuple[tuple[Complex, ...], ...]
    aims: Complex
    rotates: Flags
    sizes: Flags
    anchors: Complex
    is_smaller_nearer: bool = False

    def aims_beside(self, region_derivatives: Complex) -> Complex:
        """Return (k,) the aims, with free rotations and scales taken from the regions' own derivatives."""
        size = np.where(self.sizes, np.abs(region_derivatives), np.abs(self.aims))
        direction = np.where(self.rotates, region_derivatives, self.aims)
        return np.asarray(size * direction / np.abs(direction), np.complex128)


@dataclass(frozen=True, eq=False)
class RegionPlacement:
    """Similarities of regions: z is mapped to image + factor (z - middle); (k,) each."""

    factors: Complex
    middles: Complex
    images: Complex


def keep_rigid(problem: UnitProblem, start: MeshMap, rigid: Rigid, journal: SolveLog) -> DiscreteMap:
    """Return the map with rigid regions, starting from one without.

    Its regions may be smaller than requested, or not quite rigid.

    Raises:
        NoMapError: no map without folds follows the regions' outlines.
    """
    progress.tell("rigid regions")
    sketch = MeshMap.plain(
        start.z, start.u, start.faces, start.border, loops=start.loops, weights=start.weights
    )
    places, is_far_from_map, fitting_shares = places_of(problem, sketch, rigid)
    patient = bool((fitting_shares == 1).all())

    def from_map() -> list[DiscreteMap]:
        return solve_variants(problem, rigid, FromMap(sketch, rigid, places), again=False)

    def around_places() -> list[DiscreteMap]:
        beginning = AroundPlaces.of(problem, sketch, rigid, places, patient=patient)
        return solve_variants(problem, rigid, beginning, again=True)

    def growing(share: float) -> list[DiscreteMap]:
        beginning = Growing.of(problem, sketch, rigid, fitting_shares, share)
        return solve_variants(problem, rigid, beginning, again=False)

    usual = [around_places, from_map] if is_far_from_map else [from_map, around_places]
    attempts: list[Callable[[], list[DiscreteMap]]] = [*usual, *(partial(growing, share) for share in BEGUN)]
    states: list[DiscreteMap] = []
    for number, attempt in enumerate(attempts):
        with suppress(Stuck, NoMapError):
            states += attempt()
        is_large = states and shortfall(states[-1], np.abs(places.factors)) <= 1 - LARGE_SIZE_SHARE
        is_enough = number >= len(usual) and any(is_rigid(state) for state in states)
        if is_large or is_enough:
            break
    if not states:
        raise NoMapError("rigid: found no map without folds that follows the outlines of the regions")
    best = min(states, key=lambda state: shortfall(state, np.abs(places.factors)))
    journal.energies.append(best.value)
    return best


def is_rigid_similarity(map: MeshMap, rigid: Rigid) -> bool:
    """Return whether a map that is a similarity moves regions as requested, so that it is the map to find."""
    similar = Similarity.fit(map.z, map.u)
    aims = rigid.aims_beside(np.full(len(rigid.regions), similar.factor))
    is_pinned = ~np.isnan(rigid.anchors[:, 0])
    points, images = rigid.anchors[is_pinned].T
    errors = np.concatenate([np.abs(aims - similar.factor), np.abs(similar(points) - images)])
    return bool((errors <= SAME_SHARE).all())


def solve_variants(
    problem: UnitProblem, rigid: Rigid, beginning: "Beginning", *, again: bool
) -> list[DiscreteMap]:
    """Return the maps with rigid regions from one beginning: of the first variant that keeps them, and of those before.

    Args:
        problem: the problem.
        rigid: the regions.
        beginning: makes the map to start from.
        again: whether to try the next variant if one is stuck.
    """
    states: list[DiscreteMap] = []
    for smooth, split in VARIANTS:
        level = final_level(problem._replace(regions=rigid.regions), smooth=smooth)
        try:
            state = beginning.on(level, split=split)
        except Stuck:  # if regions fold the map without them, corners are not the reason
            if again:
                continue
            break
        try:
            state = split_at_vertices(state) if smooth and not split else state
            states.append(settle(state, problem.options))
        except OutOfTime:
            states.append(state)
        except Stuck:
            continue
        if is_rigid(states[-1]):
            break
    return states


def keep_on_mesh(state: DiscreteMap, rigid: Rigid, options: Options) -> DiscreteMap:
    """Return the map with rigid regions on its own mesh, in which the regions consist of triangles.

    The regions may be smaller than requested, or not quite rigid.

    Raises:
        NoMapError: none without folds was found.
    """
    progress.tell("rigid regions")
    placing = placing_of(state, rigid)
    goal = replace(placing, factors=rigid.aims_beside(placing.factors))

    def settled_by(attempt: Callable[[], DiscreteMap]) -> DiscreteMap:
        return settle(attempt(), options)

    attempts: tuple[Callable[[], DiscreteMap], ...] = (
        lambda: harden(state, rigid, state.value),
        lambda: relax_regions(place_regions(state, goal)),
        lambda: grow_regions(state, lambda shares: replace(goal, factors=shares * goal.factors)),
    )
    states = []
    for settled in successes(partial(settled_by, attempt) for attempt in attempts):
        if shortfall(settled, np.abs(goal.factors)) <= 1 - LARGE_SIZE_SHARE:
            return settled
        states.append(settled)
    if not states:
        raise NoMapError("rigid: found no map without folds that keeps the regions rigid")
    return min(states, key=lambda state: shortfall(state, np.abs(goal.factors)))


class Beginning(Protocol):
    """Makes a map with rigid regions, not yet converged, on the mesh of any level."""

    def on(self, level: Level, *, split: bool) -> DiscreteMap:
        """Return the map; `split` adds the outlines' vertices to the mesh before regions become rigid.

        Raises:
            Stuck: folds remain.
        """
        ...


@dataclass(frozen=True, eq=False)
class FromMap:
    """The map without regions, in which they are put into their places.

    Regions with a free rotation or scale become stiff where they are.
    """

    sketch: MeshMap
    rigid: Rigid
    places: RegionPlacement

    def on(self, level: Level, *, split: bool) -> DiscreteMap:
        """Return the map with its regions put into their places; see `Beginning`."""
        state = carry_over(level, self.sketch, split=split)
        if (self.rigid.rotates | self.rigid.sizes).any():
            hardened = harden(state, self.rigid, state.value)
            if is_rigid(hardened):
                return hardened
        return relax_regions(place_regions(state, self.places))


@dataclass(frozen=True, eq=False)
class AroundPlaces:
    """The map of the surroundings of regions, which are cut out and put in their places.

    Attributes:
        around: the map of the source without the regions.
        places: of the regions.
    """

    around: MeshMap
    places: RegionPlacement

    @classmethod
    def of(
        cls, problem: UnitProblem, sketch: MeshMap, rigid: Rigid, places: RegionPlacement, *, patient: bool
    ) -> "AroundPlaces":
        """Solve for the map of the domains with the regions cut out; see `coarse_to_fine` for `patient`.

        Raises:
            Stuck: a region has a hole, there are strokes, or the map had to fill a region that was cut out.
            NoMapError: none was found.
        """
        if problem.strokes or any(len(rings) > 1 for rings in rigid.regions):
            raise Stuck("only what surrounds regions without holes is mapped separately")
        cut = [Curve(rings[0][::-1]) for rings in rigid.regions]
        placements = zip(cut, places.factors, places.middles, places.images)
        placed = [Curve(image + factor * (ring.z - middle)) for ring, factor, middle, image in placements]
        holes = problem.holes
        first_source, first_target = len(holes.source), len(holes.target)
        partners = [(first_source + k, first_target + k) for k in range(len(cut))]
        free = problem.pins[region_at(problem.pins[:, 0], rigid.regions) < 0]
        with_regions_cut = problem._replace(
            holes=Holes((*holes.source, *cut), (*holes.target, *placed), (*holes.partners, *partners)),
            pins=free,
            cut_out=len(cut),
        )
        used_problem, solution = multilevel.coarse_to_fine(with_regions_cut, SolveLog(), patient=patient)
        whole: MeshMap = solution.inverse() if used_problem.inverted else solution
        # The regions' outlines come last on its boundary; in the map with regions they are inner vertices.
        loops = tuple(loop for loop in whole.loops if loop.source < first_source)
        if len(whole.loops) < len(loops) + len(cut):
            raise Stuck("the map around a region fills it, so the region is not in its place")
        border = whole.loops[len(loops)].first
        return cls(MeshMap.plain(whole.z, whole.u, whole.faces, border, loops=loops), places)

    def on(self, level: Level, *, split: bool) -> DiscreteMap:
        """Return the map around the regions on a mesh that includes them, in their places; see `Beginning`."""
        around = self.around
        sizes = mesh_sizes.graded(around.z, around.u, around.faces, 0.5 * level.size**2)
        fine = level.mapped(match_on(level, around), sizes)
        fine = replace(fine, bound=bool(fine.inside.z.size))
        fine = fine.move_to_border(interpolate(around.z, around.faces, around.u, fine.z))
        fine = split_at_vertices(fine) if split else fine
        return relax_regions(place_regions(fine, self.places))


@dataclass(frozen=True, eq=False)
class Growing:
    """Regions that grow, each where there is room for its size.

    They grow in the map without them, or around regions that begin with a share of the size for which there is
    room.

    Attributes:
        problem: the problem.
        sketch: the map without regions.
        rigid: the regions.
        room: (k,) the share of its size for which each region has room.
        begun: the share of that with which they begin.
        around: the map around them then; None if they begin with 0.
    """

    problem: UnitProblem
    sketch: MeshMap
    rigid: Rigid
    room: Real
    begun: float
    around: AroundPlaces | None = None

    @classmethod
    def of(cls, problem: UnitProblem, sketch: MeshMap, rigid: Rigid, room: Real, begun: float) -> "Growing":
        """Return the growing regions, with the map around them if they begin with more than 0.

        Raises:
            Stuck, NoMapError: as in `AroundPlaces.of`.
        """
        growing = cls(problem, sketch, rigid, room, begun)
        if not begun:
            return growing
        places = growing.places(begun)
        return replace(growing, around=AroundPlaces.of(problem, sketch, rigid, places, patient=False))

    def places(self, shares: Real | float) -> RegionPlacement:
        """Return the places of regions with shares (k,) of the sizes for which there is room."""
        return places_of(self.problem, self.sketch, self.rigid, shares * self.room)[0]

    def on(self, level: Level, *, split: bool) -> DiscreteMap:
        """Return the map after the regions have grown; see `Beginning`."""
        if self.around is not None:
            state = self.around.on(level, split=split)
        else:
            state = carry_over(level, self.sketch, split=split)
        return grow_regions(state, self.places, self.begun)


def carry_over(level: Level, sketch: MeshMap, *, split: bool) -> DiscreteMap:
    """Return the map without regions, converged on a mesh that has their outlines as edges.

    See `Beginning` for `split`.
    """
    state = warm_start.continue_from(level, sketch)
    state = state.forward(FINE_POWER, WEIGHT_STEPS, WEIGHT_DECREASE)
    return split_at_vertices(state) if split else state


def places_of(
    problem: UnitProblem, sketch: MeshMap, rigid: Rigid, sizes: Real | float = 1.0
) -> tuple[RegionPlacement, bool, Real]:
    """Find room for regions close to where a map has them.

    They have shares (k,) of their sizes, or as much of these as possible.

    Returns:
        The similarities, whether a place is far from the region's image, and (k,) the share of these sizes that
        fits.
    """
    domain = shapely.Polygon(xy_of(problem.target.z), [xy_of(hole.z) for hole in problem.holes.target])
    goals = [interpolate(sketch.z, sketch.faces, sketch.u, rings[0]) for rings in rigid.regions]
    map_factors = [Similarity.fit(rings[0], goal).factor for rings, goal in zip(rigid.regions, goals)]
    aims = sizes * rigid.aims_beside(np.array(map_factors))
    middles, images, factors, shares, moved_away = [], [], [], [], False
    for rings, aim, (pin, place) in zip(rigid.regions, aims, rigid.anchors):
        corners = shapely.Polygon(xy_of(rings[0])).centroid
        middle = complex(corners.x, corners.y) if np.isnan(pin) else pin
        (expected,) = interpolate(sketch.z, sketch.faces, sketch.u, np.array([middle]))
        shape, share, image = aim * (rings[0] - middle), 1.0, complex(place)
        if np.isnan(place):
            nearer = rigid.is_smaller_nearer
            share, image = room_for(shape, domain, complex(expected), is_smaller_nearer=nearer)
            moved_away |= abs(image - expected) > share * np.abs(shape).max()
        share = max(share, SMALLEST_SIZE_SHARE)
        middles.append(middle)
        images.append(image)
        factors.append(share * aim)
        shares.append(share)
        domain = domain.difference(shapely.Polygon(xy_of(image + share * shape)))
        domain = max(shapely.get_parts(domain), key=lambda part: part.area)
    return (
        RegionPlacement(np.array(factors), np.array(middles), np.array(images)),
        bool(moved_away),
        np.array(shares),
    )


def placing_of(state: DiscreteMap, rigid: Rigid) -> RegionPlacement:
    """Return the similarities that regions follow on average."""
    factors = mean_derivatives(state)
    (_, _, areas), regions = _region_triangles(state)
    assert state.rigid is not None
    corners = state.faces[state.rigid >= 0]

    def centroids(w: Complex) -> Complex:
        z = w[corners].mean(axis=1)
        return _mean(regions, areas, z.real) + 1j * _mean(regions, areas, z.imag)

    is_pinned = ~np.isnan(rigid.anchors[:, 0])
    middles = np.where(is_pinned, rigid.anchors[:, 0], centroids(state.form))
    images = np.where(is_pinned, rigid.anchors[:, 1], centroids(state.u))
    return RegionPlacement(factors, middles, images)


def place_regions(state: DiscreteMap, places: RegionPlacement) -> DiscreteMap:
    """Return the map with regions in their places, and with their surroundings unfolded.

    Raises:
        Stuck: folds remain.
    """
    assert state.rigid is not None
    inside, region = state.rigid >= 0, np.full(state.z.size, -1)
    region[state.faces[inside]] = state.rigid[inside, None]
    fixed, k = np.flatnonzero(region >= 0), region[region >= 0]
    u = state.u.copy()
    u[fixed] = places.images[k] + places.factors[k] * (state.form[fixed] - places.middles[k])
    placed = replace(state, u=u, aims=places.factors)
    return first_success(
        lambda: placed.unfold_locally(further=fixed), lambda: placed.unfold_from_harmonic(further=fixed)
    )


def grow_regions(
    state: DiscreteMap, places: Callable[[Real], RegionPlacement], begun: float = 0.0
) -> DiscreteMap:
    """Return the map with rigid regions as large as possible, first growing together, then each separately.

    Args:
        state: the map.
        places: returns the similarities of regions with shares (k,) of their sizes.
        begun: the share with which they have begun.

    Raises:
        Stuck: a region cannot grow at all.
    """
    assert state.rigid is not None
    count = int(state.rigid.max()) + 1
    shares = np.full(count, begun)
    for growing in [np.ones(count), *(np.eye(count) if count > 1 else ())]:
        step = 1.0
        while step >= LEAST and (growing * (shares < 1)).any():
            larger = np.minimum(1, shares + step * growing)
            try:
                state = relax_regions(place_regions(state, places(larger)))
                shares, step = larger, NEXT * step
            except Stuck:
                step *= 0.5
        if not shares.all():
            raise Stuck("regions find no room")
    return state


def relax_regions(state: DiscreteMap) -> DiscreteMap:
    """Return the map after Newton's method has converged, with regions kept so stiff that they stay rigid."""
    state = state.with_firm_regions(1.0, UNSEEN_STRAIN).relax()
    for _ in range(WEIGHT_ROUNDS):
        state = state.with_firm_regions(FINE_POWER, UNSEEN_STRAIN).forward(
            FINE_POWER, WEIGHT_STEPS, WEIGHT_DECREASE
        )
        if state.settled:
            break
    return state


def shortfall(state: DiscreteMap, sizes: Real) -> float:
    """Return the largest relative amount by which a region is smaller than sizes (k,); over 1 if one is not rigid."""
    if not is_rigid(state):
        return 1 + float(strains(state).max())
    return float(np.max(1 - np.abs(mean_derivatives(state)) / sizes))


def harden(state: DiscreteMap, rigid: Rigid, energy: float) -> DiscreteMap:
    """Return the map with regions whose weight is raised until they are rigid or stuck."""
    weight, previous_strain = STIFF * energy, np.inf
    while True:
        aims = rigid.aims_beside(mean_derivatives(state))
        state = replace(state, aims=aims, stiffness=weight).forward(FINE_POWER, WEIGHT_STEPS, WEIGHT_DECREASE)
        strain = strains(state).max()
        if strain <= UNSEEN_STRAIN or (
            weight >= SOFTEST * energy and strain > STUCK_STRAIN_RATIO * previous_strain
        ):
            return state
        weight, previous_strain = STIFFER * weight, strain


def settle(state: DiscreteMap, options: Options) -> DiscreteMap:
    """Return the converged map with its regions rigid, and with bounds met."""

    def descent(state: DiscreteMap, q: float) -> DiscreteMap:
        return state.with_firm_regions(q, UNSEEN_STRAIN).forward(q, LAST_STEPS, LAST_DECREASE)

    return meet_bounds_by(descent, state, options)


def is_rigid(state: DiscreteMap) -> bool:
    """Return whether all regions follow their aims."""
    return bool((strains(state) <= UNSEEN_STRAIN).all())


def mean_derivatives(state: DiscreteMap) -> Complex:
    """Return (k,) the mean f_z of each region."""
    (a, _, areas), regions = _region_triangles(state)
    return _mean(regions, areas, a.real) + 1j * _mean(regions, areas, a.imag)


def strains(state: DiscreteMap) -> Real:
    """Return (k,) the root mean square distance of each region's derivatives from its aim, relative to the aim."""
    (a, b, areas), regions = _region_triangles(state)
    errors = np.abs(a - state.aims[regions]) ** 2 + np.abs(b) ** 2
    return np.sqrt(_mean(regions, areas, errors)) / np.abs(state.aims)


def _region_triangles(state: DiscreteMap) -> tuple[tuple[Complex, Complex, Real], np.ndarray]:
    """Return f_z, f_z̄ and areas of the regions' triangles, and the region of each."""
    assert state.rigid is not None
    in_region = state.rigid >= 0
    return derivatives(state.form, state.u, state.faces[in_region]), state.rigid[in_region]


def _mean(regions: np.ndarray, areas: Real, values: Real) -> Real:
    return np.bincount(regions, areas * values) / np.bincount(regions, areas)
