"""Coarse maps of shapes with several holes, composed of maps to a circle domain: a disc with round holes.

Each shape is mapped to the circle domain with its outlines sliding. The one map followed by the inverse of the
other is one-to-one, and gives a correspondence of the outlines. On a mesh of the source this is true up to its
resolution; remaining folds are removed. Every domain with holes has a map to a circle domain (Koebe,
*Abhandlungen zur Theorie der konformen Abbildung*, 1918). Here the maps are balanced, and the circles are at
the mean positions of the two shapes' holes.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Complex, Index
from ...curve import Curve
from ...plane import rotation
from ..errors import Stuck
from ..meshing.mesh import Sizes
from ..meshing.transfer import interpolate
from ..model import mesh_sizes
from ..model.boundary_pairs import HoleMatch, Match
from ..model.discrete_map import GOOD_ENOUGH, DiscreteMap
from ..model.mesh_map import MeshMap
from ..model.outline import Outline
from . import initial_matches
from .hole_partners import Partners, middle_of
from .levels import Level, refine
from .unit_problem import UnitProblem
from .via_disc import CORNER_FINENESS, DISC_CORNERS, DISC_STEPS, compose_matches, disc

HOLE_RADIUS_FACTOR = (
    # Radius of the holes of a circle domain, relative to the disc's, times the root of (their number + 1).
    0.4
)
LEAST_DISTANCE_RADII = 3.0  # distance of neighbouring centres in radii; two radii from the outer circle
PUSH_ROUNDS = 200  # rounds of moving holes apart
MATCHES_TRIED = 4  # correspondences of the outer outline with the disc
SMALLER = 1.0, 0.5  # factors of the mesh size that are tried if triangles of the level's size fold
PAIRINGS_TRIED = 2  # assignments of holes that are tried
UNFOLDING_STEPS = 200  # steps of unfolding the composed map: 40 leave folds on 3 of 24 pairs


def circle_domain(middles: Complex) -> tuple[Curve, tuple[Curve, ...]]:
    """Return the outlines of a disc with round holes, scaled to area one.

    Args:
        middles: (n,) desired centres of the holes in the unit disc; they are moved apart if necessary.
    """
    radius = HOLE_RADIUS_FACTOR / np.sqrt(middles.size + 1)
    centres = _separate(middles, radius)
    between = np.abs(centres[:, None] - centres) + np.diag(np.full(centres.size, np.inf))
    radius = min(radius, between.min(initial=np.inf) / LEAST_DISTANCE_RADII, (1 - np.abs(centres).max()) / 2)
    corners = np.exp(2j * np.pi * np.arange(DISC_CORNERS) / DISC_CORNERS)
    outer, holes = Curve(corners), [Curve(c + radius * corners[::-3]) for c in centres]
    root = np.sqrt(outer.area + sum(hole.area for hole in holes))
    return Curve(outer.z / root), tuple(Curve(hole.z / root) for hole in holes)


def _separate(centres: Complex, radius: float) -> Complex:
    """Return the centres of discs of equal radius moved apart, and away from the unit circle."""
    centres = centres + 1e-6 * np.exp(2j * np.arange(centres.size))  # separates coincident centres
    for _ in range(PUSH_ROUNDS):
        away = centres[:, None] - centres
        distance = np.maximum(np.abs(away), 1e-12)
        centres = centres + 0.25 * (
            np.clip(LEAST_DISTANCE_RADII * radius - distance, 0, None) * away / distance
        ).sum(axis=1)
        size = np.maximum(np.abs(centres), 1e-12)
        centres = centres * np.minimum(1, (1 - 2 * radius) / size)
    return centres


@dataclass(frozen=True, eq=False)
class FilledMap:
    """A shape with its holes filled, mapped to a disc of area one; such a map always exists.

    Attributes:
        state: the map; its filled holes have the same weight as the rest.
        material: (m, 3) the triangles that are not in holes.
        rotation: a complex number of modulus one, by which the disc is rotated.
    """

    state: DiscreteMap
    material: Index
    rotation: complex = 1.0

    @classmethod
    def of(cls, outer: Outline, holes: Sequence[Outline], level: Level) -> "FilledMap":
        """Return the balanced map.

        Raises:
            Stuck: triangles are too thin for double precision.
        """
        goal = disc()
        problem = UnitProblem(
            outer.curve,
            goal,
            level.problem.energy.without_rotation().without_pins(),
            holes=(tuple(h.curve for h in holes), ()),
        )
        disc_level = Level.of(problem, level.size, 0.0, CORNER_FINENESS, level.steepest)
        plain = disc_level.mapped(
            initial_matches.arclength_matches(disc_level.source.curve, disc_level.target.curve)[0]
        )
        state = replace(plain, weights=None).unfolded()
        return cls(state.forward(1.0, DISC_STEPS, GOOD_ENOUGH, corners=False), plain.material)

    @property
    def u(self) -> Complex:
        """(n,) the images of the vertices in the disc."""
        return self.rotation * self.state.u

    @property
    def rims(self) -> list[Complex]:
        """The images of the outlines in the disc."""
        return [self.u[self.state.outer], *(self.u[loop.vertices] for loop in self.state.filled)]

    @property
    def middles(self) -> Complex:
        """The centroids of the holes in the disc, relative to its radius."""
        return np.sqrt(np.pi) * np.array([middle_of(Curve(rim)) for rim in self.rims[1:]])

    def onto(self, goal: tuple[Curve, tuple[Curve, ...]], level: Level) -> MeshMap:
        """Return the map to a circle domain, starting from the disc.

        Raises:
            Stuck: every start folds.
        """
        rims = self.rims
        root = np.sqrt(sum(Curve(rim).area for rim in rims))
        holes = tuple(Curve(rim / root) for rim in rims[1:]), goal[1]
        equal_numbers = tuple((k, k) for k in range(len(goal[1])))
        problem = UnitProblem(
            Curve(rims[0] / root),
            goal[0],
            level.problem.energy.without_rotation().without_pins(),
            holes=holes,
            partners=equal_numbers,
        )
        between = Level.of(problem, level.size, 0.0, 0.0, level.steepest)
        state = harmonic_map(between)
        u = interpolate(state.z, state.faces, state.u, self.u / root)
        loops = tuple(loop._replace(target=loop.source) for loop in self.state.filled)
        return MeshMap.plain(self.state.z, u, self.material, self.state.border, loops=loops)


def through_circles(level: Level, pairs: Sequence[tuple[int, int]]) -> DiscreteMap:
    """Return a map without folds that maps hole i of the source to hole j of the target for each of the pairs.

    Raises:
        Stuck: none was found.
    """
    sides = [[side[pair[k]] for pair in pairs] for k, side in enumerate(level.holes)]
    outlines = list(zip((level.source, level.target), sides))
    filled = [FilledMap.of(outer, holes, level) for outer, holes in outlines]
    filled[0] = replace(filled[0], rotation=rotation(filled[0].middles, filled[1].middles))
    goal = circle_domain(0.5 * (filled[0].middles + filled[1].middles))
    source_map, target_map = (
        onto_circles(filled_map, outer.curve, [hole.curve for hole in holes], goal, level)
        for filled_map, (outer, holes) in zip(filled, outlines)
    )
    try:
        return _compose(level, source_map, target_map, pairs)
    except Stuck:
        if len(level.holes[0]) > len(pairs):
            raise
    return _compose(level.inverse(), target_map, source_map, [(j, i) for i, j in pairs]).swap_sides()


def circle_starts(level: Level, matches: Sequence[Match]) -> list[DiscreteMap]:
    """Return maps without folds through circle domains, for the assignments of holes that occur in most matches."""
    if level.pinned or level.anchors:
        return []
    counts = Counter(frozenset((hole.source, hole.target) for hole in match.holes) for match in matches)
    maps = []
    for pairs, _ in counts.most_common(PAIRINGS_TRIED):
        with suppress(Stuck):
            maps.append(through_circles(level, sorted(pairs)))
    return maps


def onto_circles(
    filled: FilledMap,
    outer: Curve,
    holes: Sequence[Curve],
    goal: tuple[Curve, tuple[Curve, ...]],
    level: Level,
) -> DiscreteMap:
    """Return the balanced map of a shape to a circle domain, holes mapped to holes in order.

    Raises:
        Stuck: every start folds.
    """
    partners = tuple((k, k) for k in range(len(holes)))
    problem = UnitProblem(
        outer,
        goal[0],
        level.problem.energy.without_rotation().without_pins(),
        holes=(tuple(holes), goal[1]),
        partners=partners,
    )
    circle_level = Level.of(problem, level.size, 0.0, CORNER_FINENESS, level.steepest)
    try:
        start = remesh(circle_level, filled.onto(goal, level))
    except Stuck:
        start = harmonic_map(circle_level)
    return start.forward(1.0, DISC_STEPS, GOOD_ENOUGH, corners=False)


def remesh(level: Level, sketch: MeshMap) -> DiscreteMap:
    """Return the map on a new mesh, with smaller triangles where it magnifies if necessary.

    Raises:
        Stuck: folds remain.
    """
    for sizes in _finer(level, sketch.z, sketch.u, sketch.faces):
        with suppress(Stuck):
            return refine(level, sketch, sizes)
    raise Stuck("no map onto a circle domain was found")


def _finer(level: Level, z: Complex, u: Complex, faces: Index) -> Iterator[Sizes | None]:
    """Yield None for the level's triangles, then limits with smaller triangles where z -> u magnifies."""
    yield None
    for smaller in SMALLER:
        yield mesh_sizes.graded(z, u, faces, 0.5 * (smaller * level.size) ** 2)


def harmonic_map(level: Level) -> DiscreteMap:
    """Return a map to a circle domain without folds.

    Raises:
        Stuck: every start folds.
    """
    partners = Partners(*level.domains, level.problem.partners)
    curves = level.source.curve, level.target.curve
    matches = [
        next(initial_matches.elastic_matches(*curves, 0.0)),
        *initial_matches.arclength_matches(*curves)[: MATCHES_TRIED - 1],
    ]
    for match in matches:
        with suppress(Stuck):
            return level.started(partners.of(match))
    raise Stuck("no map onto a circle domain was found")


def _compose(
    level: Level, source_map: DiscreteMap, target_map: DiscreteMap, pairs: Sequence[tuple[int, int]]
) -> DiscreteMap:
    """Compose a map to a circle domain with the inverse of another.

    If the result folds, triangles are refined where it magnifies them.
    """
    matches_back = {hole.target: hole.match for hole in target_map.match.holes}
    holes = tuple(
        HoleMatch(*pairs[hole.target], compose_matches(hole.match, matches_back[hole.target], 0.0))
        for hole in source_map.match.holes
    )
    match = compose_matches(source_map.match, target_map.match, 0.0)._replace(holes=holes)

    def images(middle: Complex) -> Complex:
        return interpolate(target_map.u, target_map.faces, target_map.z, middle)

    for sizes in _finer(level, source_map.z, images(source_map.u), source_map.faces):
        new = level.mapped(match, sizes)
        state = new.moved_to_border(images(interpolate(source_map.z, source_map.faces, source_map.u, new.z)))
        with suppress(Stuck):
            return state.unfolded(harmonic=False, steps=UNFOLDING_STEPS)
    raise Stuck("no map without folds was found by way of a circle domain")
