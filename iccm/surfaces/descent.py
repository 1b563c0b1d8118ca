"""Newton's method on the energy of a map between two surfaces, the one that it goes to taken as it is in space.

The stages before take the metric of the target where the map is at the beginning of some steps, and do not know that
it changes as vertices move: where it changes fast, at ears and legs, they lose more than they gain. Here every vertex
of the map is a point of the target in space, the image of a triangle is the one that joins three of these, and the
derivative of a point in space by its place in the plane is that of the target's triangle it is in. So the energy is a
function of the places in the plane, and line searches look at that.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Flags, Index, Real, xy_of
from ..balanced.minimise.energy import BOTH_AREAS, assemble, geometry, total
from ..balanced.minimise.newton import (
    ARMIJO,
    LONGEST,
    REGULAR,
    SHARE_OF_FLIP,
    SHORTEST_STEP,
    gap_limit,
    largest_step,
    moved,
    regularise,
    restrict_gradient,
)
from ..balanced.minimise.sliding import (
    HELD,
    SLIDING,
    Border,
    Rails,
    border_derivatives,
    border_energy,
    choose_directions,
    restrict,
    stiffen,
)
from ..balanced.model.discrete_map import DiscreteMap
from ..balanced.model.frames import UnitFrame
from ..balanced.model.metric import rest_geometry
from ..flattening.scaffold import filling
from ..linalg.cholesky import BlockPattern, Factor, downhill, factorise
from ..meshes.flatten import Flattening
from ..meshes.locate import Locator
from ..meshes.mesh import face_areas
from ..meshes.topology import Triangles
from ..plane import triangle_areas

BARRIER = 0.01  # weight of the energy in the plane, which keeps triangles from folding there (by hand)
STEPS, DECREASE = 40, 1e-3  # of Newton's method, and the relative decrease that counts as none
SHORT, LONG = 0.1, 0.5  # of a step: after a shorter share the next is damped more, after a longer one less
DAMPED = 1e-4  # of the mean diagonal: the first damping. Without it one squeezed triangle ends the descent
PAIRS = (0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)
"""Of a triangle's corners, as in `BlockPattern.slots`."""


class Landing(NamedTuple):
    """Where the vertices of a map are on the target.

    Attributes:
        points: (n, 3) in space, the surface's area taken as one.
        slopes: (n, 3, 2) their derivatives by the place in unit coordinates.
    """

    points: Real
    slopes: Real


class Ground:
    """A target in space.

    Args:
        layout: of it.
        frame: of unit coordinates.
    """

    def __init__(self, layout: Flattening, frame: UnitFrame):
        patch, self._frame = layout.patch, frame
        covered = _covered(layout)
        faces = covered.patch.faces
        points = patch.points / np.sqrt(face_areas(patch.points[patch.faces]).sum())
        self._locator = Locator(covered)
        self._flat, self._corners = frame.unit(layout.flat)[faces], points[faces]
        sides, edges = (w[:, 1:] - w[:, :1] for w in (self._flat, self._corners))
        matrix = np.stack([sides.real, sides.imag], axis=1)  # columns are the sides
        self._slopes = edges.transpose(0, 2, 1) @ np.linalg.inv(matrix)

    def at(self, u: Complex) -> Landing:
        """Of places (n,) in unit coordinates; beside the surface it is extended linearly."""
        triangle, weights = self._locator(self._frame.world(u), 1)
        slopes = self._slopes[triangle]
        beside = u - np.einsum("pk,pk->p", weights, self._flat[triangle])
        points = np.einsum("pk,pkc->pc", weights, self._corners[triangle])
        points += np.einsum("pci,pi->pc", slopes, xy_of(beside))
        return Landing(points, slopes)


def _covered(layout: Flattening) -> Flattening:
    """The layout with triangles in its holes."""
    patch = layout.patch
    holes = [loop for loop in patch.loops if not np.isin(loop, layout.loop).all()]
    if not holes:
        return layout
    faces = np.concatenate([patch.faces, *(filling(layout.flat, hole) for hole in holes)])
    return replace(layout, patch=replace(patch, triangles=Triangles(faces, len(patch.points))))


@dataclass(frozen=True, eq=False)
class Between:
    """The energy of a map between surfaces, as a function of where its vertices are.

    Attributes:
        map: it, on a mesh of its source, for its triangles, boundary and constraints.
        ground: its target.
        theta: weight of the area part.
        q: power that raises the worst.
    """

    map: DiscreteMap
    ground: Ground
    theta: float
    q: float

    @property
    def _corners(self) -> Index:
        return self.map.system.corners

    @cached_property
    def _rest(self) -> tuple[Complex, Real]:
        """Gradients of the hat functions on the source, and its areas."""
        map = self.map
        gradients, areas = rest_geometry(map.z, map.u, self._corners, (map.metrics[0], None))
        return gradients, areas if map.weights is None else areas * map.weights

    @cached_property
    def _plane(self) -> tuple[Complex, Real]:
        """The same in the plane, with the barrier's weights; triangles in holes rest as they do."""
        (rest, weights), (gradients, areas) = self._rest, geometry(self.map.z, self._corners)
        gradients = np.where(self._flat[:, None], rest, gradients)
        return gradients, BARRIER * np.where(self._flat, weights, areas)

    @cached_property
    def _flat(self) -> Flags:
        """(m,) triangles in holes, whose images are looked at in the plane."""
        map = self.map
        return np.zeros(len(map.faces), bool) if map.weights is None else map.weights != 1

    @cached_property
    def _turns(self) -> Real:
        """(m, 1) orientation of triangles with corners in the order of the system."""
        return np.sign(triangle_areas(self.map.z[self._corners]))[:, None]

    @cached_property
    def border(self) -> Border:
        """The boundary's vertices as chains."""
        return self.map.chains(True)[1]

    def energy(self, u: Complex, tau: Real) -> float:
        """Of images (n,), the boundary's vertices at arclengths tau."""
        soup = _soup(self.map.system)
        laid = self._laid(u, self.ground.at(u))[0].ravel()
        inside = total(soup.corners, *self._rest, laid, float(self.theta), self.q, BOTH_AREAS, 0.0)
        barrier = total(self._corners, *self._plane, u, float(self.theta), 1.0, BOTH_AREAS, 0.0)
        return float(inside + barrier + border_energy(self.border, tau))

    def derivatives(self, u: Complex) -> tuple[Real, Real]:
        """(m, 3, 2) gradients at the corners of triangles, without the boundary's own, and (m, 6, 2, 2) blocks of
        Hessians, projected to be positive semidefinite."""
        place = self.ground.at(u)
        laid, plane = self._laid(u, place)
        turns = np.einsum("mic,mkcj->mkij", plane, place.slopes[self._corners])
        turns[self._flat] = np.eye(2)
        soup = _soup(self.map.system)
        slopes, blocks = _assembled(soup, laid, *self._rest, float(self.theta), self.q)
        more, light = _assembled(soup, u[self._corners], *self._plane, float(self.theta), 1.0)
        return np.einsum("mkij,mki->mkj", turns, slopes) + more, turned(blocks, turns) + light

    def _laid(self, u: Complex, place: Landing) -> tuple[Complex, Real]:
        """(m, 3) images of triangles laid flat, and (m, 2, 3) the directions in space that become x and y."""
        corners = place.points[self._corners]
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        length, x = _normalised(first)
        along = (second * x).sum(axis=1, keepdims=True)
        height, y = _normalised(second - along * x)
        laid = np.column_stack([0 * length, length, along + 1j * height * self._turns])
        laid[self._flat] = u[self._corners[self._flat]]
        return laid, np.stack([x, self._turns * y], axis=1)


def _normalised(vectors: Real) -> tuple[Real, Real]:
    """(m, 1) lengths and (m, 3) directions."""
    length = np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
    return length, vectors / length


def _soup(system: BlockPattern) -> BlockPattern:
    """The pattern of triangles that share no vertices, for derivatives triangle by triangle."""
    m = len(system.corners)
    return system._replace(corners=np.arange(3 * m).reshape(m, 3), slots=np.arange(6 * m).reshape(m, 6))


def _assembled(
    soup: BlockPattern, laid: Complex, gradients: Complex, areas: Real, theta: float, q: float
) -> tuple[Real, Real]:
    """(m, 3, 2) gradients and (m, 6, 2, 2) blocks of the Hessians of triangles (m, 3)."""
    m = len(laid)
    blocks, slopes = np.empty((6 * m, 4)), np.empty(3 * m, np.complex128)
    assemble(soup, gradients, areas, laid.ravel(), theta, q, BOTH_AREAS, 0.0, blocks, slopes)
    return xy_of(slopes).reshape(m, 3, 2), blocks.reshape(m, 6, 2, 2)


def turned(blocks: Real, turns: Real) -> Real:
    """Blocks (m, 6, 2, 2) of triangles' corners in other coordinates, which turns (m, 3, 2, 2) take to these."""
    found = [turns[:, i].transpose(0, 2, 1) @ blocks[:, k] @ turns[:, j] for k, (i, j) in enumerate(PAIRS)]
    return np.stack(found, axis=1)


class _State(NamedTuple):
    """Images (n,), arclengths of the boundary's vertices (c,), and their energy."""

    u: Complex
    tau: Real
    energy: float


class _Slide(NamedTuple):
    """Directions (c,) in which the boundary's vertices may move, limits of their steps, and slope and curvature of the
    boundary's own energy."""

    directions: Complex
    low: Real
    high: Real
    slope: Real
    curvature: Real


def descended(
    map: DiscreteMap,
    ground: Ground,
    theta: float,
    q: float,
    steps: int = STEPS,
    tolerance: float = DECREASE,
) -> DiscreteMap:
    """A map without folds after steps of Newton's method, corners of the target keeping their vertices.

    Args:
        map: on a mesh of its source, pins at their goals.
        ground: its target.
        theta: weight of the area part.
        q: power that raises the worst.
        steps: the most there may be.
        tolerance: relative decrease that counts as none.
    """
    between, tau = Between(map, ground, float(theta), float(q)), map.chains(True)[0]
    rails = map.rails(True, tau.size)
    kinds = np.full(tau.size, HELD)
    kinds[: map.border] = np.where(map.anchored | map.pairs.at_target, HELD, SLIDING)
    state, damping, small = _State(map.u, tau, between.energy(map.u, tau)), 0.0, 0
    for _ in range(steps):
        new, share = _stepped(between, rails, kinds, state, damping)
        damping = max(10 * damping, DAMPED) if share < SHORT else 0.1 * damping if share > LONG else damping
        small = small + 1 if state.energy - new.energy < tolerance * new.energy else 0
        state = new
        if share == 0 or small == 2:
            break
    pairs = map.pairs._replace(tau=state.tau[: map.border])
    return replace(map, u=state.u, pairs=pairs, energy=state.energy, settled=small == 2)


def _stepped(
    between: Between, rails: Rails, kinds: Index, state: _State, damping: float
) -> tuple[_State, float]:
    """The map a step on, and the share of the step that was made."""
    map, border, (u, tau, energy) = between.map, between.border, state
    slopes, blocks = between.derivatives(u)
    gradient = _gradient(map.system, slopes)
    slide = _slide(rails, border, kinds, tau, gradient)
    step, decrease = _newton(map.system, border, kinds, blocks, gradient, slide, damping)
    way = _limited(step[: tau.size].real, slide)
    step[: tau.size] = way * slide.directions
    share = min(
        gap_limit(border, tau, way, 1 / (1 + max(decrease / energy, -LONGEST))),
        SHARE_OF_FLIP * largest_step(map.faces, u, step),
    )
    while share > SHORTEST_STEP:
        new_u, new_tau = np.empty_like(u), np.empty_like(tau)
        moved(rails, u, tau, step, way, slide.low, slide.high, share, new_u, new_tau)
        after = between.energy(new_u, new_tau)
        if after <= energy + ARMIJO * share * decrease:
            return _State(new_u, new_tau, after), share
        share *= 0.5
    return state, 0.0


def _gradient(system: BlockPattern, slopes: Real) -> Complex:
    """(n,) from those at the corners of triangles."""
    corners, n = system.corners.ravel(), system.position.size
    x, y = (np.bincount(corners, slopes[..., part].ravel(), n) for part in range(2))
    return x + 1j * y


def _slide(rails: Rails, border: Border, kinds: Index, tau: Real, gradient: Complex) -> _Slide:
    """How the boundary's vertices may move."""
    c = tau.size
    found = _Slide(np.empty(c, np.complex128), *(np.empty(c) for _ in range(4)))
    border_derivatives(border, tau, found.slope, found.curvature)
    choose_directions(rails, tau, kinds, gradient, found.slope, found.directions, found.low, found.high)
    return found


def _newton(
    system: BlockPattern,
    border: Border,
    kinds: Index,
    blocks: Real,
    gradient: Complex,
    slide: _Slide,
    damping: float,
) -> tuple[Complex, float]:
    """Newton's step, of the boundary's vertices by the way along their directions, and the decrease it promises."""
    matrix, gradient = _matrix(system, blocks), gradient.copy()
    restrict(system, kinds, slide.directions, matrix)
    stiffen(system, border, slide.directions, slide.curvature, matrix)
    regularise(system, matrix, REGULAR + damping)
    restrict_gradient(kinds, slide.directions, slide.slope, gradient)
    factor, step = Factor.of(system), np.empty_like(gradient)
    if not factorise(system, matrix, gradient, factor):
        return np.zeros_like(gradient), 0.0
    downhill(system, factor, step)
    return step, float((gradient.conj() * step).real.sum())


def _limited(way: Real, slide: _Slide) -> Real:
    """(c,) ways along the directions that do not leave a corner to the wrong side."""
    way = np.where(slide.low == 0, np.maximum(way, 0), way)
    way = np.where(slide.high == 0, np.minimum(way, 0), way)
    return np.where(slide.directions == 0, 0, way)


def _matrix(system: BlockPattern, blocks: Real) -> Real:
    """(e, 4) the Hessian from blocks of triangles."""
    slots, flat = system.slots.ravel(), blocks.reshape(-1, 4)
    return np.column_stack([np.bincount(slots, flat[:, k], system.columns.size) for k in range(4)])
