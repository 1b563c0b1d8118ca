"""The energy of a balanced map and its derivatives, triangle by triangle.

With Wirtinger derivatives a = f_z, b = f_z̄ of a linear map, p = |a|² + |b|² (half the sum of the squared singular
values) and d = |a|² - |b|² (their product), the density is

    W = [ p/d · ((d + 1/d)/2)^θ ]^q · (1 + d)/2

p/d is 1 where the map is conformal, (d + 1/d)/2 is 1 where it keeps areas, and the last factor counts half the
source's area and half the target's, so that a map and its inverse have the same energy. Large q lowers the worst
stretch. W depends on |a|² and |b|² alone, hence its 4 × 4 Hessian has closed eigenvectors: a 2 × 2 block of the radial
directions of a and b, and their tangential directions on their own; negative eigenvalues are set to zero (the
projection of Teran et al. 2005, in the form of Smith, De Goes and Kim, *Analytic Eigensystems for Isotropic Distortion
Energies*, 2019).
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Index, Real
from ...linalg.cholesky import BlockPattern
from ...native import Record, function, record

BOTH_AREAS, SOURCE_AREA, IMAGE_AREA = 0.5, 0.0, 1.0  # shares of the image's area in the measure
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
    """What is minimised.

    Attributes:
        theta: weight of the area part.
        q: power that raises the worst.
        share: of the image's area in the measure: ½ where map and inverse have the same energy, or the source's area
            alone, 0, or the image's, 1.
        epsilon: 0, a barrier that no triangle folds through, or how far untangling reaches below zero.
        forward: whether the images move; else the source's vertices do, and virtual triangles keep the area of their
        images.
    """

    theta: float
    q: float
    share: float = BOTH_AREAS
    epsilon: float = 0.0
    forward: bool = True

    @classmethod
    def of(cls, theta: float, q: float, share: float = BOTH_AREAS, *, forward: bool = True) -> "Objective":
        """With nothing but these given."""
        return cls(float(theta), float(q), float(share), forward=forward)

    def record(self) -> Record:
        """For the core."""
        return ObjectiveRecord(self.theta, self.q, self.share, self.epsilon, self.forward)


class RestShapes(NamedTuple):
    """Triangles as they are in the rest shape: what their images are compared with.

    Attributes:
        corners: (m, 3) their vertices, in the order of elimination where there are slots.
        slots: (m, 6) the Hessian's blocks for the pairs 00, 01, 02, 11, 12, 22 of corners; (0, 6) without a Hessian.
        gradients: (m, 3) Wirtinger gradients of the hat functions in the rest shape.
        weights: (m,) areas in the rest shape, times weights if there are any; negative for virtual triangles, of
        whose images the area alone
            counts.
        aims: (m,) for triangles of rigid regions the derivative c of the similarity c z that they are to follow, whose
            density is |f_z - c|² + |f_z̄|²; 0 for all others. (0,) where there are no such regions.
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
        """For the triangles of a mesh, gradients at its corners in the pattern's order."""
        return cls(pattern.corners, pattern.slots, gradients, weights, aims)

    def energy(self, u: Complex, objective: Objective) -> float:
        """Of images (n,); infinite where a triangle is folded."""
        return total(self, u, objective)

    def record(self) -> Record:
        """For the core."""
        m, aimed = len(self.corners), self.aims.size > 0
        return RestShapesRecord(self.corners, self.slots, self.gradients, self.weights, self.aims, m, aimed)


def total(rest: RestShapes, u: Complex, objective: Objective) -> float:
    """Compute the energy of images u (n,); infinite where a triangle is folded, unless epsilon > 0 (untangling)."""
    return float(_total(rest.record(), u, objective.record()))


def least_determinant(rest: RestShapes, u: Complex) -> float:
    """Find the smallest determinant of all triangles."""
    return float(_least_determinant(rest.record(), u))


def assemble(rest: RestShapes, u: Complex, objective: Objective, matrix: Real, gradient: Complex) -> float:
    """Compute the energy at u, and fill in its gradient and projected Hessian.

    Args:
        rest: rest triangles.
        u: (n,) images, without folds unless epsilon > 0.
        objective: what is minimised.
        matrix: (e, 4) blocks of the upper triangle, written.
        gradient: (n,) complex, x + iy, written.
    """
    return float(
        _assemble(rest.record(), u, objective.record(), matrix, gradient, gradient.size, len(matrix))
    )


def energy_of(z: Complex, u: Complex, faces: Index, theta: float = 1.0, q: float = 1.0) -> float:
    """Return the energy of the piecewise linear map z -> u (n,) on triangles (m, 3), both domains' areas taken as one.

    Without the outline's term; 1 for a similarity, and the same for the inverse map.
    """
    _, areas = geometry(z, faces)
    _, images = geometry(u, faces)
    z, u = z / np.sqrt(areas.sum()), u / np.sqrt(images.sum())
    return RestShapes(faces, NO_SLOTS, *geometry(z, faces)).energy(u, Objective.of(theta, q))


def geometry(z: Complex, corners: Index) -> tuple[Complex, Real]:
    """Return (m, 3) Wirtinger gradients α of the hat functions, f_z = Σ α u and f_z̄ = Σ ᾱ u, and (m,) areas of the
    triangles of z.
    """
    gradients, areas = np.empty(corners.shape, np.complex128), np.empty(len(corners))
    z, corners = np.ascontiguousarray(z, np.complex128), np.ascontiguousarray(corners)
    _hat_gradients(corners, z, gradients, areas, len(corners))
    return gradients, areas
