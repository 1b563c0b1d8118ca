"""Polynomials for the inverse on square tiles: through Chebyshev points, checked, expanded to pixels."""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from ..arrays import Complex
from ..jit import NUMPY, kept, kernel
from .evaluate import jet_in
from .inverse import newton
from .quadtree import is_inside, leaf_of

DEGREE = 7  # of a tile's polynomial; chosen by hand, and nobody knows better

POINTS = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
FIT = np.linalg.inv(chebyshev.chebvander(POINTS, DEGREE))  # values at the points -> Chebyshev coefficients
POWERS = np.zeros((DEGREE + 1, DEGREE + 1))  # those -> coefficients of powers
for _k in range(DEGREE + 1):
    POWERS[: _k + 1, _k] = chebyshev.cheb2poly(np.eye(DEGREE + 1)[_k])[: _k + 1]


# Where a tile's polynomial is held against the map: near the corners and sides, where errors peak, and inside. Not on
# the rim itself, which may be the source's boundary.
CHECKS = 0.99 * np.array(
    [
        *[(-1, -1), (1, -1), (-1, 1), (1, 1), (0.1, -1), (-0.1, 1), (-1, -0.1), (1, 0.1)],
        *[(-0.6, 0.7), (0.7, 0.5), (-0.5, -0.7)],
    ]
)


class PixelGrid(NamedTuple):
    """Where pixels are: the centre of pixel (row, column) of the band is origin + column·dx - i·row·dy."""

    origin: complex
    dx: float
    dy: float


class Solved(NamedTuple):
    """What a band gets, (rows, width) each; NaN where there is no solution.

    Attributes:
        z: the source points.
        right, down: how z changes from a pixel to the next on the right and to the next one below.
    """

    z: Complex
    right: NDArray[np.complex64]
    down: NDArray[np.complex64]


@kernel
def slopes(a, b):
    """Derivatives of the inverse by w's real and imaginary part, where f_z = a and f_z̄ = b."""
    jacobian = a.real * a.real + a.imag * a.imag - b.real * b.real - b.imag * b.imag
    scale = 1 / jacobian  # of floats: a complex quotient would raise where this is infinite
    p, q = a.conjugate() * scale, -b * scale
    return p + q, 1j * (p - q)


@kernel
def solve_nodes(t, grid, r, c, r1, c1, seed, tol, values):
    """Solves at the tile's Chebyshev points, in a snake from a corner. False at the first failure."""
    hx, hy = 0.5 * (c1 - c), 0.5 * (r1 - r)
    z = seed
    n = POINTS.size
    for i in range(n):
        for k in range(n):
            j = k if i % 2 == 0 else n - 1 - k
            w = grid.origin + complex(
                (c - 0.5 + hx * (1 + POINTS[j])) * grid.dx, -(r - 0.5 + hy * (1 + POINTS[i])) * grid.dy
            )
            guess = z
            if k >= 2:
                step = 1 if i % 2 == 0 else -1
                a, b = values[i, j - step], values[i, j - 2 * step]
                guess = a + (a - b) * (POINTS[j] - POINTS[j - step]) / (
                    POINTS[j - step] - POINTS[j - 2 * step]
                )
                leaf = leaf_of(t, guess)
                if leaf < 0 or not is_inside(t, leaf, guess):
                    guess = z
            solution, residual, _, _ = newton(t, w, guess, tol, np.inf)
            if residual == np.inf:
                return False, z
            z = solution
            values[i, j] = z
    return True, z


@kernel
def expand(t, grid, r, c, r1, c1, values, tol, out, where):
    """Fills the tile from the polynomial through the values if it is accurate enough; says whether it was."""
    n = POINTS.size
    cheb = np.zeros((n, n), dtype=np.complex128)
    half = np.zeros((n, n), dtype=np.complex128)
    for i in range(n):
        for j in range(n):
            for k in range(n):
                half[i, j] += FIT[i, k] * values[k, j]
    for i in range(n):
        for j in range(n):
            for k in range(n):
                cheb[i, j] += half[i, k] * FIT[j, k]
    tail = 0.0
    for k in range(n):
        tail += abs(cheb[n - 1, k]) + abs(cheb[k, n - 1]) + abs(cheb[n - 2, k]) + abs(cheb[k, n - 2])
    if not tail <= tol:
        return False
    half[:] = 0
    mono = np.zeros((n, n), dtype=np.complex128)
    for i in range(n):
        for j in range(n):
            for k in range(i, n):
                half[i, j] += POWERS[i, k] * cheb[k, j]
    for i in range(n):
        for j in range(n):
            for k in range(j, n):
                mono[i, j] += half[i, k] * POWERS[j, k]
    if not _checked(t, grid, r, c, r1, c1, mono, tol):
        return False
    _rows(r, c, r1, c1, mono, out, where)
    return True


@kernel
def _checked(t, grid, r, c, r1, c1, mono, tol):
    """Whether the forward map agrees at points between the nodes, most of them on the rim, where errors peak."""
    n = mono.shape[0]
    for q in range(CHECKS.shape[0]):
        x, y = CHECKS[q]
        z = 0j
        for i in range(n - 1, -1, -1):
            row = 0j
            for j in range(n - 1, -1, -1):
                row = row * x + mono[i, j]
            z = z * y + row
        k = leaf_of(t, z)
        if k < 0 or not is_inside(t, k, z):
            return False
        f, a, b = jet_in(t, k, z, -1)
        across, up = slopes(a, b)
        w = grid.origin + complex(
            (c - 0.5 + 0.5 * (c1 - c) * (1 + x)) * grid.dx, -(r - 0.5 + 0.5 * (r1 - r) * (1 + y)) * grid.dy
        )
        if not abs(across * (w - f).real + up * (w - f).imag) <= tol:
            return False
    return True


@kept(**NUMPY, fastmath={"contract"})
def _rows(r, c, r1, c1, mono, out, where):
    """Evaluates the tile's polynomial, row by row: one contraction along y, then Horner's rule for all columns."""
    n, m = mono.shape[0], c1 - c
    x = np.empty(m)
    for j in range(m):
        x[j] = (2 * j + 1) / m - 1
    re, im = np.empty(m), np.empty(m)
    coefficient = np.empty(n, dtype=np.complex128)
    slope = np.empty(n, dtype=np.complex128)
    scale_x, scale_y = 2.0 / m, 2.0 / (r1 - r)
    for i in range(r, r1):
        y = (2 * (i - r) + 1) / (r1 - r) - 1
        for j in range(n):
            v, d = 0j, 0j
            for k in range(n - 1, -1, -1):
                d = d * y + v
                v = v * y + mono[k, j]
            coefficient[j], slope[j] = v, d
        _horner(coefficient, n, x, re, im)
        for j in range(m):
            out.z[i, c + j] = complex(re[j], im[j])
        if where:
            _horner(slope, n, x, re, im)
            for j in range(m):
                out.down[i, c + j] = complex(re[j], im[j]) * scale_y
            for j in range(1, n):
                slope[j - 1] = coefficient[j] * j
            _horner(slope, n - 1, x, re, im)
            for j in range(m):
                out.right[i, c + j] = complex(re[j], im[j]) * scale_x


@kept(**NUMPY, fastmath={"contract"})
def _horner(coefficient, n, x, re, im):
    a, b = coefficient[n - 1].real, coefficient[n - 1].imag
    for j in range(x.size):
        re[j], im[j] = a, b
    for k in range(n - 2, -1, -1):
        a, b = coefficient[k].real, coefficient[k].imag
        for j in range(x.size):
            re[j] = re[j] * x[j] + a
            im[j] = im[j] * x[j] + b
