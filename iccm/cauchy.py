"""Cauchy-Green coordinates of a polygon and their derivatives.

Weber, Ben-Chen, Gotsman, *Complex Barycentric Coordinates with Applications to Planar Shape Deformation*,
Eurographics 2009; Segall, Ben-Chen, *Iterative Closest Conformal Maps between Planar Domains*, SGP 2016, Appendix A.

For a counter-clockwise polygon z_0 .. z_{n-1} with A_e = z_{e+1} - z_e and B_j = z_j - z, edge e contributes

    C :  B_{e+1}/A_e · L_e  to column e,   -B_e/A_e · L_e  to column e+1,     L_e = log(B_{e+1} / B_e)
    D :  -L_e/A_e           to column e,    L_e/A_e        to column e+1

each divided by 2πi, so one logarithm per point and edge serves both.
"""

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]

TAU_I = 2j * np.pi
BLOCK_ENTRIES = 1 << 21  # entries of one complex block: 32 MB, a handful of which are alive at a time
ON_EDGE = 1e-9  # radians: an edge seen under an angle this close to -π is one the point lies on
ROUNDING = (
    4e-16  # relative error of a coordinate, which turns the angle by itself over the distance to an end
)


def edge_logs(polygon: Complex, z: Complex) -> Complex:
    """L_e(z) = log((z_{e+1} - z) / (z_e - z)), the limit from inside, on edges and vertices too.

    Args:
        polygon: (n,) counter-clockwise vertices.
        z: (p,) points inside or on the boundary.

    Returns:
        (p, n) complex logarithms. On edge e the imaginary part is +π; at vertex j the pair of edges (j-1, j)
        holds (0, log(B_{j+1}/B_{j-1})) with imaginary part in (0, 2π): the principal value is wrong at convex vertices.
    """
    b = polygon[None, :] - z[:, None]
    rows, cols = np.nonzero(b == 0)
    b[rows, cols] = 1.0
    after = np.roll(b, -1, axis=1)
    logs = np.log(after / b)
    near, edge = np.nonzero(logs.imag < 1e-3 - np.pi)
    if near.size:
        ends = np.minimum(np.abs(b[near, edge]), np.abs(after[near, edge]))
        slack = ON_EDGE + ROUNDING * (1 + np.abs(z[near])) / ends
        wrong = logs.imag[near, edge] < np.minimum(slack, 1e-3) - np.pi
        logs[near[wrong], edge[wrong]] += TAU_I
    if rows.size:
        n = polygon.size
        pair = np.log((polygon[(cols + 1) % n] - z[rows]) / (polygon[cols - 1] - z[rows]))
        logs[rows, cols - 1] = 0.0
        logs[rows, cols] = np.where(pair.imag > 0, pair, pair + TAU_I)
    return logs


def coordinates(polygon: Complex, z: Complex) -> Complex:
    """Cauchy-Green coordinates C_j(z) (paper, Appendix A).

    Args:
        polygon: (n,) counter-clockwise vertices.
        z: (p,) points inside, on edges or on vertices (there: the limit from inside).

    Returns:
        (p, n) matrix with Σ_j C_j = 1 and Σ_j C_j z_j = z. Memory beyond it is bounded by blocks.
    """
    out = np.empty((z.size, polygon.size), dtype=np.complex128)
    edge = np.roll(polygon, -1) - polygon
    for rows in blocks(z.size, polygon.size):
        weight = edge_logs(polygon, z[rows]) / (TAU_I * edge)
        b = polygon[None, :] - z[rows, None]
        out[rows] = np.roll(b, -1, axis=1) * weight - np.roll(b * weight, 1, axis=1)
    return out


def derivatives(polygon: Complex, z: Complex) -> Complex:
    """D_j(z) = dC_j/dz (paper, Appendix A), (p, n), for points off the vertices, where it does not exist."""
    out = np.empty((z.size, polygon.size), dtype=np.complex128)
    edge = np.roll(polygon, -1) - polygon
    for rows in blocks(z.size, polygon.size):
        weight = edge_logs(polygon, z[rows]) / (TAU_I * edge)
        out[rows] = np.roll(weight, 1, axis=1) - weight
    return out


def second_derivatives(polygon: Complex, z: Complex) -> Complex:
    """D2_j(z) = d²C_j/dz² (paper, Appendix A), (p, n), for points off the vertices."""
    out = np.empty((z.size, polygon.size), dtype=np.complex128)
    for rows in blocks(z.size, polygon.size):
        b = polygon[None, :] - z[rows, None]
        pair = 1.0 / (TAU_I * b * np.roll(b, -1, axis=1))  # 1 / (B_j B_{j+1})
        out[rows] = np.roll(pair, 1, axis=1) - pair
    return out


def blocks(rows: int, columns: int) -> list[slice]:
    """Slices that cut `rows` into blocks of at most BLOCK_ENTRIES entries."""
    step = max(1, BLOCK_ENTRIES // max(1, columns))
    return [slice(k, min(k + step, rows)) for k in range(0, rows, step)]
