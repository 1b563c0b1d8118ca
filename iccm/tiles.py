"""The inverse on the pixels of a band of rows: polynomials on square tiles, Newton's method where none fits.

First the middles of coarse blocks are solved by a flood, each block from a solved neighbour and wide places first, so
that all blocks lie on one sheet of the inverse even where a poor map has several.

A tile that lies inside the image gets the inverse at (DEGREE + 1)² Chebyshev points, each found from its neighbour's
solution, and the polynomial through them; it is kept when its last coefficients and a check with the forward map say
that it is accurate, else the tile is cut in four. The smallest tiles, and those that the outline cuts, are solved
pixel by pixel, from pixel to pixel: neighbours stay on one sheet of the inverse.
"""

import heapq
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from .cauchy import Complex
from .evaluate import is_inside, jet_in, leaf_of
from .inverse import newton

DEGREE = 7
TILE = 128  # pixels; bands are as high
COARSE = 32
LEAST = 8

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


class Grid(NamedTuple):
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


@njit(cache=True, nogil=True, error_model="numpy")
def fill(t, grid, inside, full, some, seeds, tol, out, fit, powers, points, where):
    """Solves every pixel marked `inside`; returns how many were solved one by one.

    Args:
        t: the map's tree.
        grid: the band's pixels.
        inside: (rows, width) whether the centre is in the image.
        full, some: (blocks down, blocks across) whether a block of LEAST² pixels is all inside and uncut, or not empty.
        seeds: (coarse blocks down, across) a source point to start each block from, or NaN.
        tol: accuracy asked for, in the source's units.
        out: a Solved filled with NaN.
        fit, powers, points: FIT, POWERS and POINTS.
        where: whether `right` and `down` are wanted.
    """
    rows, width = inside.shape
    exact = 0
    values = np.empty((points.size, points.size), dtype=np.complex128)
    for first in range(0, width, TILE):
        stack = [(0, first, TILE)]
        last = complex(np.nan, np.nan)
        while len(stack) > 0:
            r, c, size = stack.pop()
            if r >= rows or c >= width:
                continue
            r1, c1 = min(r + size, rows), min(c + size, width)
            whole, empty = _state(full, some, r, c, r1, c1)
            if empty:
                continue
            seed = seeds[r // COARSE, c // COARSE]
            if not np.isnan(seed.real):
                last = seed
            if whole and size > LEAST:
                good, last = _nodes(t, grid, r, c, r1, c1, last, 0.1 * tol, points, values)
                if good and _expand(t, grid, r, c, r1, c1, values, tol, fit, powers, out, where):
                    continue
            if size > LEAST:
                h = size // 2
                for k in range(4):
                    below, beside = h if k & 2 else 0, h if k & 1 else 0
                    stack.append((r + below, c + beside, h))
            else:
                done, last = _pixels(t, grid, inside, r, c, r1, c1, last, 0.1 * tol, out)
                exact += done
    return exact


@njit(cache=True, nogil=True, error_model="numpy")
def flood(t, grid, inside, clearance, seeds, tol):
    """Solves at the points of a coarse grid, from neighbour to neighbour.

    Args:
        t, grid: the tree, and the coarse grid.
        inside: (rows, columns) which points are in the image.
        clearance: (rows, columns) how far from the outline; the widest places are solved first.
        seeds: (rows, columns) source points to start from where no neighbour is solved.
        tol: as for `newton`.

    Returns:
        (rows, columns) source points, NaN where none was found.
    """
    rows, width = inside.shape
    out = np.full((rows, width), complex(np.nan, np.nan))
    queue = [(-clearance[i, j], 1, i, j, i, j) for i in range(rows) for j in range(width) if inside[i, j]]
    heapq.heapify(queue)
    ready = [(0.0, i, i, i, i) for i in range(0)]
    while len(ready) > 0 or len(queue) > 0:
        if len(ready) > 0:
            _, i, j, a, b = heapq.heappop(ready)
        else:
            _, _, i, j, a, b = heapq.heappop(queue)
        if not np.isnan(out[i, j].real):
            continue
        w = grid.origin + complex(j * grid.dx, -i * grid.dy)
        z, residual, _, _ = newton(t, w, seeds[i, j] if (a, b) == (i, j) else out[a, b], tol, np.inf)
        if residual == np.inf:
            continue
        out[i, j] = z
        for k in range(4):
            p, q = i + (k == 0) - (k == 1), j + (k == 2) - (k == 3)
            if 0 <= p < rows and 0 <= q < width and inside[p, q] and np.isnan(out[p, q].real):
                heapq.heappush(ready, (-clearance[p, q], p, q, i, j))
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _state(full, some, r, c, r1, c1):
    whole, empty = True, True
    for i in range(r // LEAST, (r1 - 1) // LEAST + 1):
        for j in range(c // LEAST, (c1 - 1) // LEAST + 1):
            whole &= full[i, j]
            empty &= not some[i, j]
    return whole, empty


@njit(cache=True, nogil=True, error_model="numpy")
def _slopes(a, b):
    """Derivatives of the inverse by w's real and imaginary part, where f_z = a and f_z̄ = b."""
    jacobian = a.real * a.real + a.imag * a.imag - b.real * b.real - b.imag * b.imag
    scale = 1 / jacobian  # of floats: a complex quotient would raise where this is infinite
    p, q = a.conjugate() * scale, -b * scale
    return p + q, 1j * (p - q)


@njit(cache=True, nogil=True, error_model="numpy")
def _nodes(t, grid, r, c, r1, c1, seed, tol, points, values):
    """Solves at the tile's Chebyshev points, in a snake from a corner. False at the first failure."""
    hx, hy = 0.5 * (c1 - c), 0.5 * (r1 - r)
    z = seed
    n = points.size
    for i in range(n):
        for k in range(n):
            j = k if i % 2 == 0 else n - 1 - k
            w = grid.origin + complex(
                (c - 0.5 + hx * (1 + points[j])) * grid.dx, -(r - 0.5 + hy * (1 + points[i])) * grid.dy
            )
            guess = z
            if k >= 2:
                step = 1 if i % 2 == 0 else -1
                a, b = values[i, j - step], values[i, j - 2 * step]
                guess = a + (a - b) * (points[j] - points[j - step]) / (
                    points[j - step] - points[j - 2 * step]
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


@njit(cache=True, nogil=True, error_model="numpy")
def _expand(t, grid, r, c, r1, c1, values, tol, fit, powers, out, where):
    """Fills the tile from the polynomial through the values if it is accurate enough; says whether it was."""
    n = fit.shape[0]
    cheb = np.zeros((n, n), dtype=np.complex128)
    half = np.zeros((n, n), dtype=np.complex128)
    for i in range(n):
        for j in range(n):
            for k in range(n):
                half[i, j] += fit[i, k] * values[k, j]
    for i in range(n):
        for j in range(n):
            for k in range(n):
                cheb[i, j] += half[i, k] * fit[j, k]
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
                half[i, j] += powers[i, k] * cheb[k, j]
    for i in range(n):
        for j in range(n):
            for k in range(j, n):
                mono[i, j] += half[i, k] * powers[j, k]
    if not _checked(t, grid, r, c, r1, c1, mono, tol):
        return False
    _rows(r, c, r1, c1, mono, out, where)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
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
        across, up = _slopes(a, b)
        w = grid.origin + complex(
            (c - 0.5 + 0.5 * (c1 - c) * (1 + x)) * grid.dx, -(r - 0.5 + 0.5 * (r1 - r) * (1 + y)) * grid.dy
        )
        if not abs(across * (w - f).real + up * (w - f).imag) <= tol:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
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


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _horner(coefficient, n, x, re, im):
    a, b = coefficient[n - 1].real, coefficient[n - 1].imag
    for j in range(x.size):
        re[j], im[j] = a, b
    for k in range(n - 2, -1, -1):
        a, b = coefficient[k].real, coefficient[k].imag
        for j in range(x.size):
            re[j] = re[j] * x[j] + a
            im[j] = im[j] * x[j] + b


@njit(cache=True, nogil=True, error_model="numpy")
def _pixels(t, grid, inside, r, c, r1, c1, seed, tol, out):
    """Solves the block's pixels one by one, each from a solved neighbour where there is one."""
    done = 0
    z = seed
    for i in range(r, r1):
        for k in range(c1 - c):
            j = c + k if (i - r) % 2 == 0 else c1 - 1 - k
            if not inside[i, j]:
                continue
            w = grid.origin + complex(j * grid.dx, -i * grid.dy)
            solution, residual, a, b = newton(t, w, _guess(t, out, i, j, z), tol, np.inf)
            if residual == np.inf:
                solution, residual, a, b = newton(t, w, z, tol, np.inf)
            if residual == np.inf:
                continue
            done += 1
            z = solution
            out.z[i, j] = z
            across, up = _slopes(a, b)
            out.right[i, j], out.down[i, j] = across * grid.dx, -up * grid.dy
    return done, z


@njit(cache=True, nogil=True, error_model="numpy")
def _guess(t, out, i, j, otherwise):
    """The source point expected for pixel (i, j) from a neighbour, if it lies inside the source."""
    rows, width = out.z.shape
    for di, dj in ((0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1)):
        a, b = i + di, j + dj
        if 0 <= a < rows and 0 <= b < width and not np.isnan(out.z[a, b].real):
            guess = out.z[a, b] - dj * complex(out.right[a, b]) - di * complex(out.down[a, b])
            k = leaf_of(t, guess)
            if k >= 0 and is_inside(t, k, guess):
                return guess
            return out.z[a, b]
    return otherwise
