"""Newton's method on the energy of a map between two surfaces, the one that it goes to taken as it is in space.

The stages before take the metric of the target where the map is at the beginning of some steps, and do not know that it
changes as vertices move: where it changes fast, at ears and legs, they lose what they gain. Here every vertex of the map
is a point of the target in space, an image triangle is the one that joins three of these, and the derivative of a
vertex' place in space by its place in the plane is that of the target's triangle it is in: the energy is a function of
the places in the plane, and is what line searches look at.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arrays import Complex, Flags, Index, Real
from ..balanced.discrete import DiscreteMap
from ..balanced.frames import UnitFrame
from ..balanced.metric import rest_geometry
from ..balanced.minimise.energy import BOTH_AREAS, assemble, geometry, total
from ..balanced.minimise.ldl import BlockPattern, downhill, factorise
from ..balanced.minimise.newton import (
    ARMIJO,
    LONGEST,
    REGULAR,
    SHARE_OF_FLIP,
    SHARE_OF_GAP,
    largest_step,
)
from ..balanced.minimise.newton import _moved as moved
from ..balanced.minimise.sliding import (
    HELD,
    SLIDING,
    Rails,
    border_derivatives,
    border_energy,
    choose_directions,
)
from ..flattening.scaffold import filling
from ..meshes.flatten import Flattening
from ..meshes.locate import Locator
from ..meshes.mesh import face_areas
from ..meshes.topology import Triangles

BARRIER = 0.01  # weight of the energy in the plane, which keeps triangles from folding there
STEPS, DECREASE = 40, 1e-3  # of Newton, and the relative decrease that counts as none
SHORTEST = 1e-8  # share of a step below which none is made
SHORT, LONG, DAMPED = (
    0.1,
    0.5,
    1e-4,
)  # shares of a step from which the next is damped more, or less; the first damping
PAIRS = (
    (0, 0),
    (0, 1),
    (0, 2),
    (1, 1),
    (1, 2),
    (2, 2),
)  # of a triangle's corners, as in `BlockPattern.slots`


@dataclass(frozen=True, eq=False)
class Place:
    """Where the vertices of a map are on the target.

    Attributes:
        points: (n, 3) in space, the surface's area taken as one.
        slopes: (n, 3, 2) their derivatives by the place in unit coordinates.
    """

    points: Real
    slopes: Real


class Ground:
    """The target in space.

    Args:
        layout: of it.
        frame: of unit coordinates.
    """

    def __init__(self, layout: Flattening, frame: UnitFrame):
        patch, self._frame = layout.patch, frame
        covered = _covered(layout)
        faces = covered.patch.faces
        points = patch.points / np.sqrt(face_areas(patch.points[patch.faces]).sum())
        self._locator, self._flat, self._corners = (
            Locator(covered),
            frame.unit(layout.flat)[faces],
            points[faces],
        )
        sides, edges = (w[:, 1:] - w[:, :1] for w in (self._flat, self._corners))
        matrix = np.stack([sides.real, sides.imag], axis=1)  # columns are the sides
        self._slopes = edges.transpose(0, 2, 1) @ np.linalg.inv(matrix)

    def at(self, u: Complex) -> Place:
        """Of places (n,) in unit coordinates; beside the surface it is extended linearly."""
        triangle, weights = self._locator(self._frame.world(u), 1)
        slopes = self._slopes[triangle]
        beside = u - np.einsum("pk,pk->p", weights, self._flat[triangle])
        points = np.einsum("pk,pkc->pc", weights, self._corners[triangle])
        points += np.einsum("pci,pi->pc", slopes, np.column_stack([beside.real, beside.imag]))
        return Place(points, slopes)


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
    """The energy of a map that is on the triangles of its source.

    Attributes:
        map: it, for its mesh, boundary and constraints.
        ground: its target.
        theta: weight of the area part.
        q: power that raises the worst.
    """

    map: DiscreteMap
    ground: Ground
    theta: float
    q: float

    @cached_property
    def _thetas(self) -> Real:
        return np.full(len(self.map.faces), self.theta)

    @cached_property
    def _rest(self) -> tuple[Complex, Real]:
        """Gradients of the hat functions on the surface, and areas."""
        map = self.map
        gradients, areas = rest_geometry(map.z, map.u, map.system.corners, (map.metrics[0], None))
        return gradients, areas if map.weights is None else areas * map.weights

    @cached_property
    def _plane(self) -> tuple[Complex, Real]:
        """The same in the plane, with the barrier's weights; triangles in holes rest as they do."""
        gradients, areas = geometry(self.map.z, self.map.system.corners)
        rest, weights = self._rest
        return (
            np.where(self._flat[:, None], rest, gradients),
            BARRIER * np.where(self._flat, weights, areas),
        )

    @cached_property
    def _flat(self) -> Flags:
        """(m,) triangles in holes, whose images are looked at in the plane."""
        map = self.map
        return np.zeros(len(map.faces), bool) if map.weights is None else map.weights != 1

    @cached_property
    def _soup(self) -> BlockPattern:
        """The pattern of triangles that share no vertices: blocks come out triangle by triangle."""
        m, none = len(self.map.faces), np.zeros(0, np.int64)
        each = np.arange(3 * m)
        slots = np.arange(6 * m)
        return BlockPattern(
            *(
                each,
                none,
                slots,
                each.reshape(-1, 3),
                slots.reshape(-1, 6),
                none,
                none,
                none,
                none,
                none,
                none,
            )
        )

    def _laid(self, u: Complex, place: Place) -> tuple[Complex, Real]:
        """(m, 3) image triangles laid flat, and (m, 2, 3) the directions in space of the plane that each is laid in."""
        corners = place.points[self.map.system.corners]
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        length = np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-300)
        x = first / length
        y = second - (second * x).sum(axis=1, keepdims=True) * x
        height = np.maximum(np.linalg.norm(y, axis=1, keepdims=True), 1e-300)
        y = y / height
        sign = np.sign(self._turn)[:, None]
        laid = np.zeros(corners.shape[:2], complex)
        laid[:, 1], laid[:, 2] = length[:, 0], (second * x).sum(axis=1) + 1j * (height * sign)[:, 0]
        laid[self._flat] = u[self.map.system.corners[self._flat]]
        return laid, np.stack([x, sign * y], axis=1)

    @cached_property
    def _turn(self) -> Real:
        """(m,) orientation of triangles with corners in the order of the system."""
        a, b, c = self.map.z[self.map.system.corners].T
        return ((b - a).conj() * (c - a)).imag

    def energy(self, u: Complex, tau: Real) -> float:
        """Of images (n,), the outline's vertices at tau (b,)."""
        laid, _ = self._laid(u, self.ground.at(u))
        gradients, areas = self._rest
        inside = total(
            self._soup.corners,
            gradients,
            areas,
            np.ascontiguousarray(laid.ravel()),
            self._thetas,
            self.q,
            BOTH_AREAS,
            0.0,
        )
        barrier = total(self.map.system.corners, *self._plane, u, self._thetas, 1.0, BOTH_AREAS, 0.0)
        return float(inside + barrier + border_energy(self._border[1], tau))

    @cached_property
    def _border(self):
        return self.map._border(True)

    @cached_property
    def _rails(self) -> Rails:
        rims = self.map.rims
        own = np.repeat(np.arange(len(rims)), [rim.vertices.stop - rim.vertices.start for rim in rims])
        rails = [rim.target.rail for rim in rims]
        if self.map.bound:
            own = np.append(own, self.map.inside.own + len(rims))
        return Rails.of(rails, own, len(rims))

    def assembled(self, u: Complex) -> tuple[float, Real, Complex]:
        """The energy inside, blocks (m, 6, 2, 2) of the Hessian, and the gradient (m, 3) complex, by vertices."""
        place = self.ground.at(u)
        laid, plane = self._laid(u, place)
        gradients, areas = self._rest
        m = len(laid)
        blocks, slope = np.empty((6 * m, 4)), np.empty(3 * m, np.complex128)
        soup = self._soup
        energy = assemble(
            *(
                soup,
                gradients,
                areas,
                np.ascontiguousarray(laid.ravel()),
                self._thetas,
                self.q,
                BOTH_AREAS,
                0.0,
            ),
            *(blocks, slope),
        )
        turns = np.einsum("mic,mkcj->mkij", plane, place.slopes[self.map.system.corners])
        turns[self._flat] = np.eye(2)
        blocks, slope = blocks.reshape(m, 6, 2, 2), slope.reshape(m, 3)
        light, lean = np.empty((6 * m, 4)), np.empty(3 * m, np.complex128)
        flat = np.ascontiguousarray(u[self.map.system.corners].ravel())
        assemble(soup, *self._plane, flat, self._thetas, 1.0, BOTH_AREAS, 0.0, light, lean)
        slope = np.stack([slope.real, slope.imag], axis=-1)
        lean = lean.reshape(m, 3)
        return (
            np.stack([turned(blocks, turns), light.reshape(m, 6, 2, 2)]).sum(axis=0),
            np.einsum("mkij,mki->mkj", turns, slope) + np.stack([lean.real, lean.imag], axis=-1),
        )


def descended(
    map: DiscreteMap, ground: Ground, theta: float, q: float, steps: int = STEPS, tolerance: float = DECREASE
) -> DiscreteMap:
    """A map without folds after steps of Newton's method, corners of the target keeping their vertices.

    Args:
        map: on the triangles of a surface, or any mesh of it.
        ground: its target.
        theta: weight of the area part.
        q: power that raises the worst.
        steps: the most there may be.
        tolerance: relative decrease that counts as none.
    """
    between = Between(map, ground, float(theta), float(q))
    system, u = map.system, map.u.copy()
    tau, border = between._border
    tau = tau.copy()
    c, n = tau.size, u.size
    kinds = np.where(
        np.append(map.anchored | map.pairs.at_target, np.ones(c - map.border, bool)), HELD, SLIDING
    )
    rails = between._rails
    small, energy, damping = 0, between.energy(u, tau), 0.0
    for _ in range(steps):
        blocks, slopes = between.assembled(u)
        gradient = np.zeros(n, np.complex128)
        for part, unit in ((0, 1), (1, 1j)):
            gradient += unit * np.bincount(system.corners.ravel(), slopes[..., part].ravel(), n)
        slope, curvature = np.empty(c), np.empty(c)
        border_derivatives(border, tau, slope, curvature)
        directions, low, high = np.empty(c, np.complex128), np.empty(c), np.empty(c)
        choose_directions(rails, tau, kinds, gradient, slope, directions, low, high)
        ways = np.tile(np.eye(2), (n, 1, 1))
        ways[:c, :, 0], ways[:c, :, 1] = np.column_stack([directions.real, directions.imag]), 0
        matrix = _matrix(system, turned(blocks, ways[system.corners]))
        _stiffen(system, border, directions, curvature, matrix, damping)
        gradient[:c] = (gradient[:c] * directions.conj()).real + np.where(directions != 0, slope, 0)
        factor, pivots = np.empty((system.factor_rows.size, 4)), np.empty((n, 3))
        if not factorise(system, matrix, factor, pivots):
            break
        step = downhill(system, factor, pivots, gradient)
        decrease = float((gradient.conj() * step).real.sum())
        slide = step[:c].real
        slide = np.where(low == 0, np.maximum(slide, 0), slide)
        slide = np.where(high == 0, np.minimum(slide, 0), slide)
        slide = np.where(directions == 0, 0, slide)
        step[:c] = slide * directions
        t = min(1 / (1 + max(decrease / energy, -LONGEST)), _gap_limit(border, tau, slide))
        t = min(t, SHARE_OF_FLIP * largest_step(map.faces, u, step))
        while t > SHORTEST:
            new_u, new_tau = np.empty_like(u), np.empty_like(tau)
            moved(rails, u, tau, step, slide, low, high, t, new_u, new_tau)
            after = between.energy(new_u, new_tau)
            if after <= energy + ARMIJO * t * decrease:
                break
            t *= 0.5
        else:
            break
        damping = max(10 * damping, DAMPED) if t < SHORT else 0.1 * damping if t > LONG else damping
        gained = energy - after
        u, tau, energy = new_u, new_tau, after
        small = small + 1 if gained < tolerance * energy else 0
        if small == 2:
            break
    pairs = map.pairs._replace(tau=tau[: map.border])
    return replace(map, u=u, pairs=pairs, energy=energy)


def _gap_limit(border, tau: Real, slide: Real) -> float:
    """The largest share of a step that keeps the outline's vertices in order."""
    closing = slide - slide[border.following]
    gap = tau[border.following] - tau + border.laps
    at = closing > 0
    return float((SHARE_OF_GAP * gap[at] / closing[at]).min(initial=np.inf))


def turned(blocks: Real, turns: Real) -> Real:
    """Blocks (m, 6, 2, 2) of triangles' corners in other coordinates, which turns (m, 3, 2, 2) take to these."""
    found = [turns[:, i].transpose(0, 2, 1) @ blocks[:, k] @ turns[:, j] for k, (i, j) in enumerate(PAIRS)]
    return np.stack(found, axis=1)


def _matrix(system: BlockPattern, blocks: Real) -> Real:
    """The Hessian from blocks of triangles."""
    slots, flat = system.slots.ravel(), blocks.reshape(-1, 4)
    return np.column_stack([np.bincount(slots, flat[:, k], system.rows.size) for k in range(4)])


def _stiffen(
    system: BlockPattern, border, directions: Complex, curvature: Real, matrix: Real, damping: float
) -> None:
    """The outline's part, ones where there is no unknown, and a little more on the diagonal."""
    slides, after = directions != 0, border.following
    own = system.diagonal[: directions.size]
    np.add.at(matrix[:, 0], own[slides], curvature[slides])
    ahead = slides[after]
    np.add.at(matrix[:, 0], system.diagonal[after[ahead]], curvature[ahead])
    both = slides & ahead
    np.add.at(matrix[:, 0], system.ahead[both], -curvature[both])
    matrix[own, 3] += 1
    matrix[own[~slides], 0] += 1
    little = (REGULAR + damping) * 0.5 * (
        matrix[system.diagonal, 0] + matrix[system.diagonal, 3]
    ).mean() + 1e-12
    matrix[system.diagonal, 0] += little
    matrix[system.diagonal, 3] += little
