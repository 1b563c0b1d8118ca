"""The energy of a balanced map and its derivatives, triangle by triangle.

With Wirtinger derivatives a = f_z, b = f_z̄ of a linear map, p = |a|² + |b|² (half the sum of the squared singular
values) and d = |a|² - |b|² (their product), the density is

    W = [ p/d · ((d + 1/d)/2)^θ ]^q · (1 + d)/2

p/d is 1 where the map is conformal, (d + 1/d)/2 is 1 where it preserves areas, and the last factor weighs the
source's and the target's area by one half each, so that a map and its inverse have the same energy. Large q
lowers the worst stretch. W depends on |a|² and |b|² only, hence its 4 × 4 Hessian has closed-form eigenvectors:
a 2 × 2 block of the radial directions of a and b, and separately their tangential directions. Negative
eigenvalues are set to zero (the projection of Teran et al. 2005, in the form of Smith, De Goes and Kim,
*Analytic Eigensystems for Isotropic Distortion Energies*, 2019).
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Index, Real
from ...linalg.cholesky import BlockPattern
from ...native import Record, function, record

BOTH_AREAS, SOURCE_AREA, IMAGE_AREA = 0.5, 0.0, 1.0  # share of the image's area in the measure
NO_SLOTS = np.empty((0, 6), np.int64)
NO_AIMS = np.empty(0, np.complex128)

ObjectiveRecord = record(
    "struct Objective { double theta; double q; double share; double epsilon; bool forward; }"
)
RestShapesRecord = record(
    """struct RestShapes {
        const int64_t *corners; const int64_t *slots; const Complex *gradients; const double *weights;
        const Complex *aims; int64_t m; bool aimed; }"""
)
_total = function(
    "double iccm_minimise_total(const RestShapes *rest, const Complex *u, const Objective *objective)"
)
_assemble = function(
    """double iccm_minimise_assemble(
        const RestShapes *rest, const Complex *u, const Objective *objective, double *matrix, Complex *gradient,
        int64_t n, int64_t e)"""
)
_least_determinant = function(
    "double iccm_minimise_least_determinant(const RestShapes *rest, const Complex *u)"
)
_hat_gradients = function(
    """int64_t iccm_minimise_hat_gradients(
        const int64_t *corners, const Complex *z, Complex *gradients, double *areas, int64_t m)"""
)


class Objective(NamedTuple):
    """An objective of Newton's method.

    Attributes:
        theta: θ, the weight of the area part.
        q: power of the density; large values lower the worst distortion.
        share: of the image's area in the measure: ½ gives a map and its inverse the same energy, 0 counts only
            the source's area, and 1 only the image's.
        epsilon: 0 for a barrier against folds; for untangling, the distance by which the smoothed determinant
            extends below zero.
        forward: whether the images move, rather than the source's vertices. If the latter move, virtual
            triangles keep the area of their images.
    """

    theta: float
    q: float
    share: float = BOTH_AREAS
    epsilon: float = 0.0
    forward: bool = True

    @classmethod
    def of(cls, theta: float, q: float, share: float = BOTH_AREAS, *, forward: bool = True) -> "Objective":
        """Return an objective without untangling."""
        return cls(float(theta), float(q), float(share), forward=forward)

    def record(self) -> Record:
        """Return the struct that is passed to the core."""
        return ObjectiveRecord(self.theta, self.q, self.share, self.epsilon, self.forward)


class RestShapes(NamedTuple):
    """Triangles in the rest shape, with which their images are compared.

    Attributes:
        corners: (m, 3) their vertices, in the order of elimination if there are slots.
        slots: (m, 6) the Hessian's blocks for the pairs 00, 01, 02, 11, 12, 22 of corners; (0, 6) without a
            Hessian.
        gradients: (m, 3) Wirtinger gradients of the hat functions in the rest shape.
        weights: (m,) areas in the rest shape, times weights if there are any. They are negative for virtual
            triangles, for which only the area of the image counts.
        aims: (m,) for triangles of rigid regions the derivative c of the similarity c z that they should
            follow, whose density is |f_z - c|² + |f_z̄|²; 0 for all others. (0,) if there are no such regions.
    """

    corners: Index
    slots: Index
    gradients: Complex
    weights: Real
    aims: Complex = NO_AIMS

    @classmethod
    def of(
        cls, pattern: BlockPattern, gradients: Complex, weights: Real, aims: Complex = NO_AIMS
    ) -> "RestShapes":
        """Return the rest shapes of a mesh's triangles; gradients are at its corners in the pattern's order."""
        return cls(pattern.corners, pattern.slots, gradients, weights, aims)

    def energy(self, u: Complex, objective: Objective) -> float:
        """Return the energy of images (n,); infinite if a triangle is folded."""
        return total(self, u, objective)

    def record(self) -> Record:
        """Return the struct that is passed to the core."""
        m, aimed = len(self.corners), self.aims.size > 0
        return RestShapesRecord(self.corners, self.slots, self.gradients, self.weights, self.aims, m, aimed)


def total(rest: RestShapes, u: Complex, objective: Objective) -> float:
    """Compute the energy of images u (n,); infinite if a triangle is folded, unless epsilon > 0 (untangling)."""
    return float(_total(rest.record(), u, objective.record()))


def least_determinant(rest: RestShapes, u: Complex) -> float:
    """Return the smallest determinant of all triangles for images u (n,)."""
    return float(_least_determinant(rest.record(), u))


def assemble(rest: RestShapes, u: Complex, objective: Objective, matrix: Real, gradient: Complex) -> float:
    """Compute the energy at u, and fill in its gradient and projected Hessian.

    Args:
        rest: rest triangles.
        u: (n,) images, without folds unless epsilon > 0.
        objective: the objective.
        matrix: (e, 4) blocks of the upper triangle, written.
        gradient: (n,) complex, x + iy, written.

    Returns:
        The energy.
    """
    return float(
        _assemble(rest.record(), u, objective.record(), matrix, gradient, gradient.size, len(matrix))
    )


def energy_of(z: Complex, u: Complex, faces: Index, theta: float = 1.0, q: float = 1.0) -> float:
    """Return the energy of the piecewise linear map z -> u (n,) on triangles (m, 3).

    Both domains are scaled to area one. It does not include the outline's term. A similarity has energy 1, and
    a map has the energy of its inverse.
    """
    _, areas = geometry(z, faces)
    _, images = geometry(u, faces)
    z, u = z / np.sqrt(areas.sum()), u / np.sqrt(images.sum())
    return RestShapes(faces, NO_SLOTS, *geometry(z, faces)).energy(u, Objective.of(theta, q))


def geometry(z: Complex, corners: Index) -> tuple[Complex, Real]:
    """Return the Wirtinger gradients of the hat functions, and the areas, of triangles.

    Args:
        z: (n,) vertices.
        corners: (m, 3) triangles.

    Returns:
        (m, 3) gradients α, with which f_z = Σ α u and f_z̄ = Σ ᾱ u, and (m,) areas.
    """
    gradients, areas = np.empty(corners.shape, np.complex128), np.empty(len(corners))
    z, corners = np.ascontiguousarray(z, np.complex128), np.ascontiguousarray(corners)
    _hat_gradients(corners, z, gradients, areas, len(corners))
    return gradients, areas
