"""Harmonic measure of a domain by finite elements: the boundary values of the Riemann map to the disc.

The harmonic measure of a boundary arc seen from a point a is the probability that a Brownian path from a first
leaves the domain through it; times 2π it is the angle of the arc's image on the unit circle. On a Delaunay
triangulation the stiffness matrix is an M-matrix, so that there is no cancellation: masses of 1e-50 in a deep
fjord have the same relative accuracy as those close to a. Boundary integral equations with the free-space
logarithm (Symm) are more accurate at the same cost, but only absolutely, which is insufficient with crowding.
"""

import numpy as np
import scipy.sparse as sparse
from scipy.interpolate import PchipInterpolator
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from ..arrays import Complex, Real, xy_of
from ..curve import Curve
from ..plane import longer_side
from . import triangulation
from .panels import CORNER

# Values were chosen by hand unless a comment gives a reason.
GROWTH_PER_DISTANCE = 0.35  # growth of the element size with the distance from the boundary
SHAKE_CELL_SHARE = 0.1  # random displacement of the points, relative to their cell
PANEL_SUBDIVISIONS = 6  # of a panel, for interpolation
REPAIR_ROUNDS = 3
"""Rounds of splitting panels that are not edges of the Delaunay triangulation."""


class HarmonicMeasure:
    """Harmonic measure of the panels of a boundary, seen from any point inside.

    Attributes:
        curve: the boundary.
        ends: (p,) arclengths at which panels start: the given ones, and more where the triangulation needs
            them.
        z: (p,) panel ends.
        lengths: (p,) panel lengths.
    """

    def __init__(self, curve: Curve, ends: Real):
        """Triangulate the inside and factor its stiffness matrix.

        If a panel is not an edge of the Delaunay triangulation, some node is close to it; it is then halved, a
        few times. The two sides of an exterior slit that is much narrower than its panels would have to be
        divided without end; there the triangulation is constrained. All of its inner edges are still Delaunay,
        as an M-matrix requires.

        Raises:
            TooThinError: the outline has slits or spikes too thin for double precision.
        """
        self.curve = curve
        inner = inner_points(curve, ends)
        for repair in range(REPAIR_ROUNDS + 1):
            nodes = np.concatenate([curve.at(ends), inner])
            mesh = triangulation.delaunay(nodes)
            missing = triangulation.missing(mesh, ends.size, nodes.size)
            if repair == REPAIR_ROUNDS or not missing.any():
                break
            following = np.append(ends[1:], ends[0] + curve.length)
            ends = np.sort(np.concatenate([ends, 0.5 * (ends + following)[missing]]))
        if missing.any():
            mesh = triangulation.constrained(nodes, mesh, missing)
        triangles = triangulation.inside(curve, nodes, mesh)
        self.ends, self.z = ends, nodes[: ends.size]
        self.lengths = np.diff(np.append(ends, ends[0] + curve.length))
        stiffness, middles = _stiffness(nodes, triangles, ends.size)
        boundary = np.concatenate([np.arange(ends.size), middles])
        unknown = stiffness.diagonal() > 0
        unknown[boundary] = False
        free = np.flatnonzero(unknown)
        self._corner = np.flatnonzero(free < nodes.size)
        self._tree = cKDTree(xy_of(nodes[free[self._corner]]))
        options = {"SymmetricMode": True, "DiagPivotThresh": 0.0}
        self._factors = splu(stiffness[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options=options)
        self._outflow = -stiffness[boundary][:, free]

    def masses(self, centres: Complex) -> Real:
        """Return (c, p) positive masses of the panels as seen from the centres; each row sums to one.

        Each centre is represented by the closest node.
        """
        source = np.zeros((self._factors.shape[0], centres.size))
        source[self._corner[self._tree.query(xy_of(centres))[1]], np.arange(centres.size)] = 1.0
        flux = (self._outflow @ self._factors.solve(source)).T
        ends, middles = flux[:, : self.ends.size], np.maximum(flux[:, self.ends.size :], 1e-300)
        previous = np.roll(middles, 1, axis=1)
        # the flux at an end is shared by the panels on both sides; for uniform density it is a quarter of that
        # at their midpoints
        ends = np.clip(ends, -0.2 * np.minimum(middles, previous), 0.5 * (middles + previous))
        share = ends * middles / (middles + previous)
        mass = np.maximum(middles + share + np.roll(ends - share, -1, axis=1), 1e-300)
        return mass / mass.sum(axis=1, keepdims=True)


class Circle:
    """A boundary as the unit circle seen from one centre.

    It maps arclength s to turns F and back, both lifted to the line and increasing.
    """

    def __init__(self, measure: HarmonicMeasure, mass: Real):
        """Compute the turns from the masses of the panels."""
        self.length = measure.curve.length
        self.lengths, self.mass = measure.lengths, mass
        turns = np.concatenate([[0.0], np.cumsum(mass)])
        self.turns = turns / turns[-1]
        self.knots = np.append(measure.ends, measure.ends[0] + self.length)
        power, falling = corner_powers(measure)
        self._subdivide(power, falling)

    def _subdivide(self, power: Real, falling: np.ndarray) -> None:
        """Fill a table finer than the panels: monotone cubic inside them, a power law in those at a corner."""
        parts = np.where(power == 1, PANEL_SUBDIVISIONS, 1)
        panel = np.repeat(np.arange(parts.size), parts)
        t = (np.arange(panel.size) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[panel]
        long_s = np.concatenate([self.knots[:-1] - self.length, self.knots, self.knots[1:] + self.length])
        long_turn = np.concatenate([self.turns[:-1] - 1, self.turns, self.turns[1:] + 1])
        s = self.knots[panel] + t * self.lengths[panel]
        turn = np.where(t == 0, self.turns[panel], PchipInterpolator(long_s, long_turn)(s))
        self._table_s, self._table_turn = np.append(s, self.knots[-1]), np.append(turn, 1.0)
        self._power, self._falling = power[panel], falling[panel]

    def turn(self, s: Real) -> Real:
        """Return F(s)."""
        lap = np.floor((s - self.knots[0]) / self.length)
        k, t = _place(self._table_s, s - lap * self.length)
        fraction = self._bend(t, k, self._power[k])
        return lap + self._table_turn[k] + (self._table_turn[k + 1] - self._table_turn[k]) * fraction

    def arclength(self, turn: Real) -> Real:
        """Return s(F)."""
        lap = np.floor(turn)
        k, t = _place(self._table_turn, turn - lap)
        fraction = self._bend(t, k, 1 / self._power[k])
        return lap * self.length + self._table_s[k] + (self._table_s[k + 1] - self._table_s[k]) * fraction

    def _bend(self, t: Real, k: np.ndarray, power: Real) -> Real:
        """Return t to a power, measured from the end of panel k that is a corner."""
        return np.where(self._falling[k], 1 - (1 - t) ** power, t**power)


def corner_powers(measure: HarmonicMeasure) -> tuple[Real, np.ndarray]:
    """Return the exponents π/angle of the harmonic measure's growth from a corner, for panels at a corner, else 1.

    Returns:
        (p,) exponents, and whether the corner is at the panel's end rather than at its start.
    """
    previous = np.roll(measure.z, 1)
    angle = np.mod(np.angle((previous - measure.z) / (np.roll(measure.z, -1) - measure.z)), 2 * np.pi)
    power = np.where(np.abs(angle - np.pi) > CORNER, np.pi / np.maximum(angle, 0.05), 1.0)
    at_end = np.roll(power, -1)
    falling = (power == 1) & (at_end != 1)
    at_both = (power != 1) & (at_end != 1)
    return np.where(at_both, 1.0, np.where(falling, at_end, power)), falling


def _place(knots: Real, x: Real) -> tuple[np.ndarray, Real]:
    """Return the interval of increasing knots that contains x, and the position in it, in [0, 1]."""
    k = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, knots.size - 2)
    return k, np.clip((x - knots[k]) / np.maximum(knots[k + 1] - knots[k], 1e-300), 0.0, 1.0)


def inner_points(curve: Curve, ends: Real) -> Complex:
    """Return points for a graded triangulation.

    They are the centres of a quadtree's leaves, which grow away from the panels.
    """
    z = curve.at(ends)
    panel = np.abs(np.roll(z, -1) - z)
    places = np.concatenate([z, 0.5 * (z + np.roll(z, -1))])
    sizes = np.concatenate([np.minimum(panel, np.roll(panel, 1)), panel])
    tree = cKDTree(xy_of(places))
    lo, hi = curve.box
    side = longer_side(lo, hi) / 8
    x = np.arange(lo.real + side / 2, hi.real + side / 2, side)
    y = np.arange(lo.imag + side / 2, hi.imag + side / 2, side)
    cells, leaves = (x[:, None] + 1j * y[None, :]).ravel(), []
    # Avoids four points on a circle, whose triangulation would depend on rounding.
    shake = np.random.default_rng(0)
    while cells.size:
        distance, k = tree.query(xy_of(cells), k=4)
        split = side > (sizes[k] + GROWTH_PER_DISTANCE * distance).min(axis=1)
        shift = (
            SHAKE_CELL_SHARE
            * side
            * (shake.uniform(-1, 1, cells.size) + 1j * shake.uniform(-1, 1, cells.size))
        )
        leaves.append((cells + shift)[~split & (distance[:, 0] > 0.55 * side)])
        cells, away = cells[split], distance[split, 0] > side
        away[away] = ~curve.contains(cells[away])
        cells = (cells[~away, None] + side / 4 * np.array([1 + 1j, 1 - 1j, -1 + 1j, -1 - 1j])).ravel()
        side /= 2
    points = np.concatenate(leaves)
    return points[curve.contains(points)]


def _stiffness(nodes: Complex, triangles: np.ndarray, panels: int):
    """Return the stiffness matrix of quadratic elements on vertices and edge midpoints.

    The second result is the indices of the panels' midpoints. With S_ij the linear elements' integrals of grad
    λ_i · grad λ_j (minus half a cotangent off the diagonal), the quadratic ones are K_ii = S_ii, K_ij =
    -S_ij/3, K_i,ij = 4/3 S_ij, K_ij,ij = 8/3 (S_ii + S_jj + S_ij), K_ij,jk = 8/3 S_ik.
    """
    middle, count = _edge_numbers(triangles, panels, nodes.size)
    s = np.empty((3, 3, len(triangles)))
    for k in range(3):
        apex = nodes[triangles[:, k]]
        corner = (nodes[triangles[:, (k + 1) % 3]] - apex).conj() * (nodes[triangles[:, (k + 2) % 3]] - apex)
        s[(k + 1) % 3, (k + 2) % 3] = s[(k + 2) % 3, (k + 1) % 3] = (
            -0.5 * corner.real / np.maximum(np.abs(corner.imag), 1e-300)
        )
    for k in range(3):
        s[k, k] = -s[k, (k + 1) % 3] - s[k, (k + 2) % 3]
    entries = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        vi, mi = triangles[:, i], middle[:, i]
        entries += [(vi, vi, s[i, i]), (mi, mi, 8 / 3 * (s[j, j] + s[k, k] + s[j, k]))]
        for a, b in ((j, k), (k, j)):
            vb, mb = triangles[:, a], middle[:, b]
            entries += [(vi, vb, -s[i, a] / 3), (vi, mb, 4 / 3 * s[i, a]), (mb, vi, 4 / 3 * s[i, a])]
            entries += [(mi, middle[:, a], 8 / 3 * s[i, a])]
    rows, columns, values = (np.concatenate(part) for part in zip(*entries))
    size = nodes.size + count
    return sparse.coo_array((values, (rows, columns)), (size, size)).tocsr(), nodes.size + np.arange(panels)


def _edge_numbers(triangles: np.ndarray, panels: int, nodes: int) -> tuple[np.ndarray, int]:
    """Return (t, 3) numbers, after the nodes', of the edges opposite to a triangle's vertices, and their count.

    Panels come first.
    """
    keys = np.stack(
        [triangulation.keys(triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3], nodes) for k in range(3)],
        axis=1,
    )
    start = np.arange(panels)
    first = triangulation.keys(start, (start + 1) % panels, nodes)
    listed = np.concatenate([first, np.setdiff1d(np.unique(keys), first)])
    order = np.argsort(listed)
    return nodes + order[np.searchsorted(listed[order], keys)], listed.size
