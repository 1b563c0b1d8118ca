"""The inverse on the pixels of a band of rows: polynomials on square tiles, Newton's method where none fits.

First the middles of coarse blocks are solved by a flood, each block from a solved neighbour and wide places first, so
that all blocks lie on one sheet of the inverse even where a poor map has several.

A tile that lies inside the image gets the inverse at (DEGREE + 1)² Chebyshev points, each found from its neighbour's
solution, and the polynomial through them; it is kept when its last coefficients and a check with the forward map say
that it is accurate, else the tile is cut in four. The smallest tiles, and those that the outline cuts, are solved
pixel by pixel, from pixel to pixel: neighbours stay on one sheet of the inverse.
"""

import heapq

import numpy as np

from ..jit import kernel
from ..maps.chebyshev import DEGREE, PixelGrid, Solved, expand, slopes, solve_nodes
from ..maps.inverse import newton
from ..maps.quadtree import is_inside, leaf_of

__all__ = ["COARSE", "SMALLEST", "TILE", "PixelGrid", "Solved", "fill", "flood"]

# Chosen by hand, and nobody knows better, where a line does not say how a number was found.
TILE = 128  # pixels, the largest tile; bands are as high
COARSE = 32  # pixels, the blocks of the flood
SMALLEST = 8  # pixels, the smallest tile


@kernel
def fill(t, grid, inside, full, some, seeds, tol, out, where):
    """Solves every pixel marked `inside`; returns how many were solved one by one.

    Args:
        t: the map's tree.
        grid: the band's pixels.
        inside: (rows, width) whether the centre is in the image.
        full, some: (blocks down, blocks across) whether a block of LEAST² pixels is all inside and uncut, or not empty.
        seeds: (coarse blocks down, across) a source point to start each block from, or NaN.
        tol: accuracy asked for, in the source's units.
        out: a Solved filled with NaN.
        where: whether `right` and `down` are wanted.
    """
    rows, width = inside.shape
    exact = 0
    values = np.empty((DEGREE + 1, DEGREE + 1), dtype=np.complex128)
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
            if whole and size > SMALLEST:
                good, last = solve_nodes(t, grid, r, c, r1, c1, last, 0.1 * tol, values)
                if good and expand(t, grid, r, c, r1, c1, values, tol, out, where):
                    continue
            if size > SMALLEST:
                h = size // 2
                for k in range(4):
                    below, beside = h if k & 2 else 0, h if k & 1 else 0
                    stack.append((r + below, c + beside, h))
            else:
                done, last = _pixels(t, grid, inside, r, c, r1, c1, last, 0.1 * tol, out)
                exact += done
    return exact


@kernel
def flood(t, grid, inside, seeds, tol):
    """Solves at the points of a coarse grid, from neighbour to neighbour, the widest places first.

    Args:
        t, grid: the tree, and the coarse grid.
        inside: (rows, columns) which points are in the image.
        seeds: (rows, columns) source points to start from where no neighbour is solved.
        tol: as for `newton`.

    Returns:
        (rows, columns) source points, NaN where none was found.
    """
    rows, width = inside.shape
    clearance = _clearance(inside)
    out = np.full((rows, width), complex(np.nan, np.nan))
    queue, ready = [(0, 1, 0, 0, 0, 0)], [(0, 0, 0, 0, 0)]  # for their types; kernels have no comprehensions
    queue.clear()
    ready.clear()
    for i in range(rows):
        for j in range(width):
            if inside[i, j]:
                heapq.heappush(queue, (-clearance[i, j], 1, i, j, i, j))
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


@kernel
def _clearance(inside):
    """How far each point is from those outside, the grid's surroundings among them: in thirds of a step, 4 aslant."""
    rows, width = inside.shape
    out = np.zeros((rows + 2, width + 2), dtype=np.int64)
    for i in range(1, rows + 1):
        for j in range(1, width + 1):
            if inside[i - 1, j - 1]:
                straight = min(out[i - 1, j], out[i, j - 1])
                out[i, j] = min(straight + 3, min(out[i - 1, j - 1], out[i - 1, j + 1]) + 4)
    for i in range(rows, 0, -1):
        for j in range(width, 0, -1):
            straight = min(out[i + 1, j], out[i, j + 1])
            aslant = min(out[i + 1, j + 1], out[i + 1, j - 1])
            out[i, j] = min(out[i, j], straight + 3, aslant + 4)
    return out[1:-1, 1:-1]


@kernel
def _state(full, some, r, c, r1, c1):
    whole, empty = True, True
    for i in range(r // SMALLEST, (r1 - 1) // SMALLEST + 1):
        for j in range(c // SMALLEST, (c1 - 1) // SMALLEST + 1):
            whole &= full[i, j]
            empty &= not some[i, j]
    return whole, empty


@kernel
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
            across, up = slopes(a, b)
            out.right[i, j], out.down[i, j] = across * grid.dx, -up * grid.dy
    return done, z


@kernel
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
