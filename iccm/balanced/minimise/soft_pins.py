"""Soft pins, which draw small patches of a shape to their places, as terms of the energy.

A single point has zero capacity in the plane: an energy of first derivatives lets it move anywhere at no cost.
A map that is held at a point has a cusp there, which is sharper the finer the mesh, so that the map depends on
the mesh. A soft pin holds a patch around the point instead:

- The mean position of the patch's core is pulled to the pin's place by a spring.
- Distortion costs more in the patch, so that its content keeps its shape: most at the pin, and less towards the
  radius.
- If a rotation or a size is requested, the mean derivative of the core is drawn to it by another spring.

All three are integrals over the patch, which converge as the mesh is refined. Patches belong to the source and
follow its triangles, so that a map has the same energy as its inverse.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Complex, Index, Real
from ...curve import Curve
from ...plane import cross, triangle_areas
from ..meshing.transfer import interpolate, nearest_triangles
from .terms import TermOnMesh

CORE_SHARE = 0.5
"""Radius of a patch's core relative to the patch. The mean position is taken over the core; the Hessian couples
all vertices there.
"""
LARGEST_CORE_RADIUS = 0.12  # largest radius of a core, for domains of area one: some 150 vertices
CORE_MARGIN_RATIO = 1.3
"""Relative to the core: vertices within it get entries in the Hessian's pattern, so that it stays valid while
vertices move.
"""
FEWEST_CORE_VERTICES = 6
"""Vertices; with fewer, the triangle around the pin replaces the core."""
QUADRATURE = (
    np.array(
        [[i + 1 / 3, j + 1 / 3, 4 - i - j - 2 / 3] for i in range(4) for j in range(4 - i)]
        + [[i + 2 / 3, j + 2 / 3, 4 - i - j - 4 / 3] for i in range(3) for j in range(3 - i)]
    )
    / 4
)
"""(16, 3) barycentric coordinates of quadrature points with equal weights: the centroids of 16 equal parts of a
triangle.
"""
WORST_CONDITION_NUMBER = 1e6  # of the moments of a core's vertices; above it, they are collinear


@dataclass(frozen=True, eq=False)
class StrokeBand:
    """A band around a stroke of the source, which keeps its shape.

    Attributes:
        line: the stroke.
        radius: half the band's width.
    """

    line: Curve
    radius: float


@dataclass(frozen=True, eq=False)
class SoftPins:
    """Soft pins of a map between domains of area one.

    Attributes:
        source: (k,) complex points of the source.
        target: (k,) complex places in the target to which they are drawn.
        radii: (k,) radii of the patches, in the source.
        limits: (k,) distances from the places up to which pins count as met.
        springs: (k,) energy of a pin at distance one from its place; a map without distortion has energy one.
        derivative_spring: energy of a patch whose derivative differs by one from the requested one.
        stiffness: weight of distortion at a pin, relative to elsewhere.
        rotations: (k,) requested rotations of the patches in radians; NaN if free.
        scales: (k,) requested scales of the patches; NaN if free.
        bands: parts of the source along strokes that keep their shape.
        inverted: whether the map is from target to source.
    """

    source: Complex
    target: Complex
    radii: Real
    limits: Real
    springs: Real
    derivative_spring: float
    stiffness: float
    rotations: Real
    scales: Real
    bands: tuple["StrokeBand", ...] = ()
    inverted: bool = False

    def inverse(self) -> "SoftPins":
        """Return the pins for the inverse map; their patches remain those of the source."""
        return replace(self, inverted=not self.inverted)

    def stiffer(self, factors: Real) -> "SoftPins":
        """Return the pins with the stiffness of the springs multiplied by factors (k,)."""
        return replace(self, springs=self.springs * factors)

    @property
    def pairs(self) -> Complex:
        """Points of the domain of the map, and their places; shape (k, 2)."""
        pairs = np.column_stack([self.source, self.target])
        return np.ascontiguousarray(pairs[:, ::-1]) if self.inverted else pairs

    @property
    def core_radii(self) -> Real:
        """Radii of the cores of the patches; shape (k,)."""
        return np.minimum(CORE_SHARE * self.radii, LARGEST_CORE_RADIUS)

    def misses(self, z: Complex, u: Complex, faces: Index) -> Real:
        """Return the distances (k,) of the pins' images from their places in the target, for a map z -> u (n,)."""
        w, image = (u, z) if self.inverted else (z, u)
        return np.abs(interpolate(w, faces, image, self.source) - self.target)

    def cores(self, z: Complex, u: Complex, faces: Index, margin: float = 1.0) -> list[Index]:
        """Return the vertices of each patch's core, in ascending order.

        The corners of the triangle around the pin are among them.

        Args:
            z: (n,) vertices.
            u: (n,) their images.
            faces: (m, 3) triangles.
            margin: radius relative to that of the core.
        """
        w = u if self.inverted else z
        cores = []
        for pin, radius, face in zip(self.source, self.core_radii, nearest_triangles(w, faces, self.source)):
            nearby = np.flatnonzero(np.abs(w - pin) < margin * radius)
            cores.append(np.union1d(nearby, faces[face]))
        return cores

    def multipliers(self, z: Complex, u: Complex, faces: Index) -> Real:
        """Return (m,) the weight of distortion in each triangle (m, 3); 1 outside of all patches."""
        w = u if self.inverted else z
        corners = w[faces]
        middles = corners.mean(axis=1)
        # no point of a triangle is farther from its middle
        reach = np.abs(corners - middles[:, None]).max(axis=1)
        kernels = np.zeros((len(faces), len(QUADRATURE)))
        for pin, radius in zip(self.source, self.radii):
            nearby = np.flatnonzero(np.abs(middles - pin) < radius + reach)
            points = corners[nearby] @ QUADRATURE.T
            kernels[nearby] = np.maximum(kernels[nearby], _kernel(np.abs(points - pin) / radius))
        for band in self.bands:
            nearby = np.flatnonzero(band.line.distances(middles) < band.radius + reach)
            points = corners[nearby] @ QUADRATURE.T
            distances = band.line.distances(points.ravel()).reshape(points.shape)
            kernels[nearby] = np.maximum(kernels[nearby], _kernel(distances / band.radius))
        return 1 + (self.stiffness - 1) * kernels.mean(axis=1)

    def springs_on_mesh(
        self, z: Complex, u: Complex, faces: Index, cores: Sequence[Index], q: float, *, forward: bool
    ) -> list[TermOnMesh]:
        """Return the springs as terms of the energy.

        Args:
            z: (n,) vertices.
            u: (n,) their images.
            faces: (m, 3) triangles.
            cores: as returned by `cores`, or larger.
            q: power of the density to which they are added. Where distortion is small, the derivative of W^q is
                q times that of W, and so springs are made q times as strong.
            forward: whether the images move, rather than the vertices.
        """
        w = u if self.inverted else z
        triangle_shares = np.abs(triangle_areas(w[faces])) / 3
        vertex_areas = np.bincount(faces.ravel(), np.repeat(triangle_shares, 3), w.size).astype(np.float64)
        domain_places, image_places = self.pairs.T
        fixed_side, moving_side = (z, u) if forward else (u, z)
        springs: list[TermOnMesh] = []
        triangles = nearest_triangles(w, faces, self.source)
        for k, vertices in enumerate(cores):
            core_weights = _core_weights(self.source[k], self.core_radii[k], vertices, w, vertex_areas)
            if core_weights is not None:
                weights = spread = core_weights
            else:
                corners = faces[triangles[k]]
                positions = np.searchsorted(vertices, corners)
                weights, spread = np.zeros(vertices.size), np.zeros(vertices.size)
                weights[positions] = _barycentric(self.source[k], w[corners])
                # not the barycentric coordinates: at a vertex, these are those of a single point
                spread[positions] = 1 / 3
            derivative = _mean_derivative(z[vertices], u[vertices], spread)
            # Displacement of the core from its place: u - u₀ - f'·(z - z₀), which is linear in the positions
            # that move. The second difference is zero until vertices of the source move.
            factor = 1.0 if forward else -derivative
            domain_offset = weights @ z[vertices] - domain_places[k]
            residual = weights @ u[vertices] - image_places[k] - derivative * domain_offset
            constant = residual - factor * (weights @ moving_side[vertices])
            # Distances are measured in the target, also for the inverse map.
            scale = 1 / abs(derivative) if self.inverted else abs(derivative)
            spring = q * self.springs[k] * (scale**2 if self.inverted else 1.0)
            springs.append(Spring(vertices, np.asarray(factor * weights, np.complex128), constant, spring))
            aim = self._aim(k, derivative)
            if aim is not None:
                slopes = _slope_weights(fixed_side[vertices], spread)
                # The derivative of the moving side is f' or 1/f'; a deviation of 1/f' stands for one of f' that
                # is |f'|² times as large.
                is_inverse = forward == self.inverted
                stiffness = q * self.derivative_spring * (scale**4 if is_inverse else 1.0)
                springs.append(Spring(vertices, slopes, -(aim if forward else 1 / aim), stiffness))
        return springs

    def _aim(self, k: int, derivative: complex) -> complex | None:
        """Return the requested derivative of the map at a patch, given its present one; None if it is free."""
        rotation, scale = self.rotations[k], self.scales[k]
        if np.isnan(rotation) and np.isnan(scale):
            return None
        if self.inverted:
            rotation, scale = -rotation, 1 / scale
        angle = np.angle(derivative) if np.isnan(rotation) else rotation
        return complex((abs(derivative) if np.isnan(scale) else scale) * np.exp(1j * angle))


class Spring(TermOnMesh):
    """A spring: the term s |Σ aᵢ uᵢ + b|² in the images uᵢ of vertices."""

    def __init__(self, vertices: Index, weights: Complex, constant: complex, stiffness: float):
        """Store the vertices (s,), the complex weights a (s,), the constant b, and the stiffness s."""
        self.stencils = vertices[None]
        self.weights, self.constant, self.stiffness = weights, constant, stiffness
        # second derivative of |a u|² by both coordinates: conj(aᵢ) aⱼ as a real matrix
        products = 2 * stiffness * np.outer(np.conj(weights), weights)
        self.hessian = np.stack(
            [np.stack([products.real, -products.imag], -1), np.stack([products.imag, products.real], -1)], -2
        )[None]

    def _residual(self, u: Complex) -> complex:
        return complex(self.weights @ u[self.stencils[0]] + self.constant)

    def values(self, u: Complex) -> Real:
        """See `TermOnMesh`."""
        return np.array([self.stiffness * abs(self._residual(u)) ** 2])

    def derivatives(self, u: Complex) -> tuple[Complex, Real]:
        """See `TermOnMesh`."""
        gradient = 2 * self.stiffness * np.conj(self.weights) * self._residual(u)
        return np.asarray(gradient[None], np.complex128), self.hessian


def _kernel(rho: Real) -> Real:
    """Return (1 - ρ²)² for distances relative to the radius; 0 beyond it."""
    return np.clip(1 - rho**2, 0, None) ** 2


def _core_weights(
    pin: complex, radius: float, vertices: Index, w: Complex, vertex_areas: Real
) -> Real | None:
    """Return weights (s,) with which the pin is the mean of a core's vertices; None if these are too few.

    They are the kernel, times the areas around the vertices, times a linear function that moves the mean to the
    pin: the weighted mean of a linear map is then its value at the pin.
    """
    offsets = (w[vertices] - pin) / radius
    masses = vertex_areas[vertices] * _kernel(np.abs(offsets))
    if np.count_nonzero(masses) < FEWEST_CORE_VERTICES:
        return None
    linear = np.stack([np.ones(offsets.size), offsets.real, offsets.imag])
    moments = (linear * masses) @ linear.T
    if np.linalg.cond(moments) > WORST_CONDITION_NUMBER:
        return None
    weights = masses * (np.linalg.solve(moments, [1.0, 0.0, 0.0]) @ linear)
    return weights if weights.min() >= 0 else None


def _barycentric(point: complex, corners: Complex) -> Real:
    """Return the barycentric coordinates (3,) of a point, clipped if it is outside of the triangle."""
    a, b, c = corners - point
    shares = np.clip([cross(b, c), cross(c, a), cross(a, b)], 0, None)
    return shares / shares.sum()


def _slope_weights(z: Complex, weights: Real) -> Complex:
    """Return b (s,) such that Σ b u is the derivative of the similarity closest to z -> u, with weights (s,)."""
    offsets = z - weights @ z
    return weights * offsets.conj() / (weights @ np.abs(offsets) ** 2)


def _mean_derivative(z: Complex, u: Complex, weights: Real) -> complex:
    """Return the derivative of the similarity closest to z -> u (s,), with weights (s,)."""
    return complex(_slope_weights(z, weights) @ u)
