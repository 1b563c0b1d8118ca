"""The energy of a balanced map and its derivatives, triangle by triangle.

With Wirtinger derivatives a = f_z, b = f_z̄ of a linear map, p = |a|² + |b|² (half the sum of the squared singular
values) and d = |a|² - |b|² (their product), the density is

    W = [ p/d · ((d + 1/d)/2)^θ ]^q · (1 + d)/2

p/d is 1 where the map is conformal, (d + 1/d)/2 is 1 where it keeps areas, and the last factor counts half the
source's area and half the target's, so that a map and its inverse have the same energy. Large q lowers the worst
stretch. W depends on |a|² and |b|² alone, hence its 4 × 4 Hessian has closed eigenvectors: a 2 × 2 block of the radial
directions of a and b, and their tangential directions by themselves; negative eigenvalues are set to zero (the
projection of Teran et al. 2005, in the form of Smith, De Goes and Kim, *Analytic Eigensystems for Isotropic Distortion
Energies*, 2019).
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Index, Real
from ...jit import in_place, inlined
from ...linalg.cholesky import BlockPattern
from ..kernels import dot

BOTH_AREAS, SOURCE_AREA, IMAGE_AREA = 0.5, 0.0, 1.0  # shares of the image's area in the measure
LOST = 5.05
"""The density at a point that has no partner: what it is where lengths change ten times as much one way as the other,
(10 + 1/10)/2. Pictures with K95 of 8 were judged usable, with 24 useless."""
VOID = 1e-3  # weight of a void's angles beside the area of its image: at rest a slit is 2 % of what was there
UNTANGLING_AREA = 0.5  # weight of the area part while untangling
NO_SLOTS = np.empty((0, 6), np.int64)
NO_AIMS = np.empty(0, np.complex128)


class Objective(NamedTuple):
    """What is minimised.

    Attributes:
        theta: weight of the area part.
        q: power that raises the worst.
        share: of the image's area in the measure: ½ where map and inverse have the same energy, or the source's area
            alone, 0, or the image's, 1.
        epsilon: 0, a barrier that no triangle folds through, or how far untangling reaches below zero.
        forward: whether the images move; else the source's vertices do, and voids keep the area of their images.
        quadratic: whether, instead, the energy is a quadratic one, of which the derivatives are given: one whole step
            leads to its least.
    """

    theta: float
    q: float
    share: float = BOTH_AREAS
    epsilon: float = 0.0
    quadratic: bool = False
    forward: bool = True

    @classmethod
    def of(cls, theta: float, q: float, share: float = BOTH_AREAS, *, forward: bool = True) -> "Objective":
        """With numbers of the one type for which kernels are compiled."""
        return cls(float(theta), float(q), float(share), forward=forward)


class RestShapes(NamedTuple):
    """Triangles as they are at rest: what their images are compared with.

    Attributes:
        corners: (m, 3) their vertices, in the order of elimination where there are slots.
        slots: (m, 6) the Hessian's blocks for the pairs 00, 01, 02, 11, 12, 22 of corners; (0, 6) without a Hessian.
        gradients: (m, 3) Wirtinger gradients of the hat functions at rest.
        weights: (m,) areas at rest, times weights if there are any; negative for voids, of whose images the area alone
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
        return float(total(self, u, objective))


@in_place
def power(base, exponent):
    """base ** exponent, without a logarithm for the exponents that are met most."""
    if exponent == 1.0:
        return base
    if exponent == 2.0:
        return base * base
    if exponent == 0.0:
        return 1.0
    return base**exponent


@in_place
def density(p, d, theta, q, share):
    """W at one triangle with d > 0; the image's area counts by its share, ½ where map and inverse are alike."""
    core = p / d * power(0.5 * (d + 1 / d), theta)
    return core * power(core, q - 1) * (1 - share + share * d)


@in_place
def density_derivatives(p, d, theta, q, share):
    """W and its derivatives W_p, W_d, W_pp, W_pd, W_dd."""
    inverse = 1 / d
    area, area1, area2 = 0.5 * (d + inverse), 0.5 * (1 - inverse * inverse), inverse * inverse * inverse
    grown, less = power(area, theta), 1 / area
    grown1 = theta * grown * less * area1
    grown2 = theta * grown * less * ((theta - 1) * less * area1 * area1 + area2)
    core_p = grown * inverse
    core, core_pd = p * core_p, (grown1 - core_p) * inverse
    core_d = p * core_pd
    core_dd = p * inverse * (grown2 - 2 * core_pd)
    value, first, second = core, 1.0, 0.0
    if q > 1:
        below = power(core, q - 2)
        first, second = q * below * core, q * (q - 1) * below
        value = below * core * core
    pp, pd = second * core_p * core_p, first * core_pd + second * core_p * core_d
    dd = first * core_dd + second * core_d * core_d
    core_p, core_d, area = first * core_p, first * core_d, 1 - share + share * d
    return (
        value * area,
        core_p * area,
        core_d * area + share * value,
        pp * area,
        pd * area + share * core_p,
        dd * area + 2 * share * core_d,
    )


@in_place
def void_derivatives(p, d, forward):
    """The density of a void, with the derivatives of `density_derivatives`: d + VOID p/d, the area of its image and a
    barrier; by the inverse map, whose p and d these are if not `forward`, the same."""
    if not forward:
        return 1 + VOID * p, VOID, 0.0, 0.0, 0.0, 0.0
    shape = VOID / d
    return d + shape * p, shape, 1 - shape * p / d, 0.0, -shape / d, 2 * shape * p / (d * d)


@in_place
def untangling_derivatives(p, d, epsilon):
    """A density that is finite for folded triangles, with the derivatives of `density_derivatives`.

    (p + ½ (1 + d²)/2·2) / (1 + ½) with d in the denominators replaced by (d + √(ε² + d²))/2 (Garanzha et al.,
    *Foldover-free maps in 50 lines of code*, 2021).
    """
    root = np.sqrt(epsilon * epsilon + d * d)
    x = 0.5 * (d + root) if d > 0 else 0.5 * epsilon * epsilon / (root - d)
    x1, x2 = x / root, 0.5 * epsilon * epsilon / (root * root * root)
    area, share = (d * d + 1) / (2 * x), 1 / (1 + UNTANGLING_AREA)
    area1 = d / x - (d * d + 1) * x1 / (2 * x * x)
    inverse2 = 2 * x1 * x1 / (x * x * x) - x2 / (x * x)  # second derivative of 1/x
    area2 = 1 / x - 2 * d * x1 / (x * x) + 0.5 * (d * d + 1) * inverse2
    return (
        share * (p / x + UNTANGLING_AREA * area),
        share / x,
        share * (UNTANGLING_AREA * area1 - p * x1 / (x * x)),
        0.0,
        -share * x1 / (x * x),
        share * (p * inverse2 + UNTANGLING_AREA * area2),
    )


@in_place
def hat_gradients(corners, z, gradients, areas):
    """Fills in the Wirtinger gradients of the hat functions and the areas of the source's triangles.

    Args:
        corners: (m, 3) triangles of either orientation.
        z: (n,) vertices of the source.
        gradients: (m, 3) complex α, written: f_z = Σ α u and f_z̄ = Σ ᾱ u for values u at the corners.
        areas: (m,) written, positive.
    """
    for t in range(corners.shape[0]):
        a, b, c = z[corners[t, 0]], z[corners[t, 1]], z[corners[t, 2]]
        area = 0.5 * ((b - a).real * (c - a).imag - (b - a).imag * (c - a).real)
        scale = complex(0.0, -0.25 / area)
        gradients[t, 0] = scale * (c - b).conjugate()
        gradients[t, 1] = scale * (a - c).conjugate()
        gradients[t, 2] = scale * (b - a).conjugate()
        areas[t] = abs(area)


@in_place
def wirtinger(corners, gradients, u, t):
    """f_z and f_z̄ on triangle t."""
    a, b = 0j, 0j
    for k in range(3):
        value, alpha = u[corners[t, k]], gradients[t, k]
        a += alpha * value
        b += alpha.conjugate() * value
    return a, b


@in_place
def total(rest, u, objective):
    """The energy of the images u (n,); infinite where a triangle is folded, unless epsilon > 0 (untangling)."""
    theta, q, share, epsilon = objective.theta, objective.q, objective.share, objective.epsilon
    corners, gradients, weights = rest.corners, rest.gradients, rest.weights
    energy = 0.0
    for t in range(corners.shape[0]):
        a, b = wirtinger(corners, gradients, u, t)
        aa, bb = dot(a, a), dot(b, b)
        if epsilon > 0:
            energy += abs(weights[t]) * untangling_derivatives(aa + bb, aa - bb, epsilon)[0]
        elif aa > bb and rest.aims.size > 0 and rest.aims[t] != 0:
            a -= rest.aims[t]
            energy += weights[t] * (dot(a, a) + bb)
        elif aa > bb and weights[t] < 0:
            energy -= weights[t] * void_derivatives(aa + bb, aa - bb, objective.forward)[0]
        elif aa > bb:
            energy += weights[t] * density(aa + bb, aa - bb, theta, q, share)
        else:
            return np.inf
    return energy


@in_place
def least_determinant(rest, u):
    """The smallest determinant of all triangles."""
    least = np.inf
    for t in range(rest.corners.shape[0]):
        a, b = wirtinger(rest.corners, rest.gradients, u, t)
        least = min(least, dot(a, a) - dot(b, b))
    return least


@in_place
def _projected(first, second, coupling):
    """The matrix [[first, coupling], [coupling, second]] with negative eigenvalues set to zero: its three entries."""
    middle, determinant = 0.5 * (first + second), first * second - coupling * coupling
    if middle >= 0 and determinant >= 0:
        return first, second, coupling
    radius = np.sqrt(max(middle * middle - determinant, 0.0))
    if not middle + radius > 0:
        return 0.0, 0.0, 0.0
    share, small = 0.5 * (middle + radius) / radius, middle - radius
    return share * (first - small), share * (second - small), share * coupling


@inlined
def _add(matrix, slot, r, s, x, y, a, b):
    """Adds the block r aᵀ + s bᵀ + (i x)(i a)ᵀ + (i y)(i b)ᵀ of complex numbers taken as vectors."""
    matrix[slot, 0] += r.real * a.real + s.real * b.real + x.imag * a.imag + y.imag * b.imag
    matrix[slot, 1] += r.real * a.imag + s.real * b.imag - x.imag * a.real - y.imag * b.real
    matrix[slot, 2] += r.imag * a.real + s.imag * b.real - x.real * a.imag - y.real * b.imag
    matrix[slot, 3] += r.imag * a.imag + s.imag * b.imag + x.real * a.real + y.real * b.real


@in_place
def assemble(rest, u, objective, matrix, gradient):
    """The energy at u; fills in its gradient and projected Hessian.

    Args:
        rest: triangles at rest.
        u: (n,) images, without folds unless epsilon > 0.
        objective: what is minimised.
        matrix: (e, 4) blocks of the upper triangle, written.
        gradient: (n,) complex, x + iy, written.
    """
    theta, q, share, epsilon = objective.theta, objective.q, objective.share, objective.epsilon
    corners, slots, gradients, weights = rest.corners, rest.slots, rest.gradients, rest.weights
    for p in range(matrix.shape[0]):
        matrix[p, 0] = matrix[p, 1] = matrix[p, 2] = matrix[p, 3] = 0.0
    for v in range(gradient.size):
        gradient[v] = 0j
    energy = 0.0
    for t in range(corners.shape[0]):
        a, b = wirtinger(corners, gradients, u, t)
        aimed = epsilon == 0 and rest.aims.size > 0 and rest.aims[t] != 0
        if aimed:  # quadratic: its derivatives by a - c and b are those of p
            a -= rest.aims[t]
        aa, bb, weight = dot(a, a), dot(b, b), abs(weights[t])
        if aimed:
            w, w_p, w_d, w_pp, w_pd, w_dd = aa + bb, 1.0, 0.0, 0.0, 0.0, 0.0
        elif epsilon > 0:
            w, w_p, w_d, w_pp, w_pd, w_dd = untangling_derivatives(aa + bb, aa - bb, epsilon)
        elif weights[t] < 0:
            w, w_p, w_d, w_pp, w_pd, w_dd = void_derivatives(aa + bb, aa - bb, objective.forward)
        else:
            w, w_p, w_d, w_pp, w_pd, w_dd = density_derivatives(aa + bb, aa - bb, theta, q, share)
        energy += weight * w
        size_a, size_b = np.sqrt(aa), np.sqrt(bb)
        # directions of a and b; any do where one vanishes, since the derivatives along them do then
        unit_a = a * (1 / size_a) if size_a > 1e-140 else 1 + 0j
        unit_b = b * (1 / size_b) if size_b > 1e-140 else 1 + 0j
        # the chain rule for |a| and |b|, p = |a|² + |b|² and d = |a|² - |b|²: slopes over |a| and |b|, which are
        # the tangential eigenvalues too, then the 2 × 2 block of the radial directions
        along_a, along_b = 2 * weight * (w_p + w_d), 2 * weight * (w_p - w_d)
        radial_a, radial_b, both = _projected(
            along_a + 4 * weight * (w_pp + 2 * w_pd + w_dd) * aa,
            along_b + 4 * weight * (w_pp - 2 * w_pd + w_dd) * bb,
            4 * weight * (w_pp - w_dd) * size_a * size_b,
        )
        around_a, around_b = max(along_a, 0.0), max(along_b, 0.0)
        along_a, along_b = along_a * size_a, along_b * size_b
        # by the corners' values: a = Σ α u and b = Σ ᾱ u take the eigenvectors to multiples of the hats' gradients
        pair = 0
        for k in range(3):
            alpha = gradients[t, k]
            a, b = unit_a * alpha.conjugate(), unit_b * alpha
            gradient[corners[t, k]] += along_a * a + along_b * b
            r, s = radial_a * a + both * b, both * a + radial_b * b
            x, y = around_a * a, around_b * b
            for m in range(k, 3):
                alpha = gradients[t, m]
                _add(matrix, slots[t, pair], r, s, x, y, unit_a * alpha.conjugate(), unit_b * alpha)
                pair += 1
    return energy


def energy_of(z: Complex, u: Complex, faces: Index, theta: float = 1.0, q: float = 1.0) -> float:
    """The energy of the piecewise linear map z -> u (n,) on triangles (m, 3), both domains' areas taken as one.

    Without the outline's term; 1 for a similarity, and the same for the inverse map.
    """
    _, areas = geometry(z, faces)
    _, images = geometry(u, faces)
    z, u = z / np.sqrt(areas.sum()), u / np.sqrt(images.sum())
    return RestShapes(faces, NO_SLOTS, *geometry(z, faces)).energy(u, Objective.of(theta, q))


def geometry(z: Complex, corners: Index) -> tuple[Complex, Real]:
    """(m, 3) gradients of the hat functions and (m,) areas of the triangles of z."""
    gradients, areas = np.empty(corners.shape, np.complex128), np.empty(len(corners))
    hat_gradients(corners, z, gradients, areas)
    return gradients, areas
