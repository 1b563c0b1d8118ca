"""Cauchy-Green coordinates of a polygon and their derivatives.

Weber, Ben-Chen, Gotsman, *Complex Barycentric Coordinates with Applications to Planar Shape Deformation*,
Eurographics 2009; Segall, Ben-Chen, *Iterative Closest Conformal Maps between Planar Domains*, SGP 2016, Appendix A.

For a counter-clockwise polygon z_0 .. z_{n-1} with A_e = z_{e+1} - z_e and B_j = z_j - z, edge e contributes

    C :  B_{e+1}/A_e · L_e  to column e,   -B_e/A_e · L_e  to column e+1,     L_e = log(B_{e+1} / B_e)
    D :  -L_e/A_e           to column e,    L_e/A_e        to column e+1

each divided by 2πi, so one logarithm per point and edge serves both.
"""

import numpy as np

from ..arrays import Complex
from ..native import function
from ..native.binding import Function
from ..parallel import over_slices

TAU_I = 2j * np.pi
# Values were chosen by hand unless a comment gives a reason.
BLOCK_ENTRIES = 1 << 21  # entries of one complex block: 32 MB, of which a few exist at a time
SLICE_POINTS, SLICE_JET_POINTS = 64, 1024  # points that a thread takes at a time, for matrices and for jets

_coordinates = function(
    """int64_t iccm_maps_coordinates(
        const Complex *vertices, int64_t n, const Complex *z, int64_t start, int64_t stop, Complex *out)"""
)
_derivatives = function(
    """int64_t iccm_maps_derivatives(
        const Complex *vertices, int64_t n, const Complex *z, int64_t start, int64_t stop, Complex *out)"""
)
_jets = function(
    """int64_t iccm_maps_jets(
        const Complex *vertices, int64_t n, const Complex *values, const Complex *slopes, int64_t m, const Complex *z,
        int64_t start, int64_t stop, int64_t p, Complex *out)"""
)


def jets(polygon: Complex, densities: Complex, z: Complex, threads: int | None = None) -> Complex:
    """Compute C(z) φ and D(z) φ without the matrices: the integrals of densities and their derivatives.

    Args:
        polygon: (n,) counter-clockwise vertices.
        densities: (m, n) values at the vertices.
        z: (p,) points inside, on edges or at vertices, where there is no derivative.
        threads: number of threads; by default one per processor. The result does not depend on it.

    Returns:
        (2, m, p) values and derivatives.
    """
    polygon, densities, z = (np.ascontiguousarray(array, np.complex128) for array in (polygon, densities, z))
    slopes = (np.roll(densities, -1, axis=1) - densities) / (np.roll(polygon, -1) - polygon)
    m, count = len(densities), z.size
    out = np.empty((2, m, count), dtype=np.complex128)
    over_slices(
        lambda part: _jets(polygon, polygon.size, densities, slopes, m, z, part.start, part.stop, count, out),
        count,
        threads,
        SLICE_JET_POINTS,
    )
    return out / TAU_I


def coordinates(polygon: Complex, z: Complex) -> Complex:
    """Return the Cauchy-Green coordinates C_j(z) (paper, Appendix A).

    Args:
        polygon: (n,) counter-clockwise vertices.
        z: (p,) points inside, on edges or at vertices (there: the limit from inside).

    Returns:
        (p, n) matrix with Σ_j C_j = 1 and Σ_j C_j z_j = z. No other memory of this size is used.
    """
    return _filled(_coordinates, polygon, z)


def derivatives(polygon: Complex, z: Complex) -> Complex:
    """Return (p, n) D_j(z) = dC_j/dz (paper, Appendix A), for points that are not vertices, where it does not exist."""
    return _filled(_derivatives, polygon, z)


def _filled(kernel: Function, polygon: Complex, z: Complex) -> Complex:
    """Return the matrix that a kernel fills, using all threads; the result does not depend on their number."""
    polygon, z = np.ascontiguousarray(polygon, dtype=complex), np.ascontiguousarray(z, dtype=complex)
    out = np.empty((z.size, polygon.size), dtype=np.complex128)
    over_slices(
        lambda rows: kernel(polygon, polygon.size, z, rows.start, rows.stop, out), z.size, step=SLICE_POINTS
    )
    return out


def second_derivatives(polygon: Complex, z: Complex) -> Complex:
    """Return (p, n) D2_j(z) = d²C_j/dz² (paper, Appendix A), for points that are not vertices."""
    out = np.empty((z.size, polygon.size), dtype=np.complex128)
    for rows in blocks(z.size, polygon.size):
        b = polygon[None, :] - z[rows, None]
        pair = 1.0 / (TAU_I * b * np.roll(b, -1, axis=1))  # 1 / (B_j B_{j+1})
        out[rows] = np.roll(pair, 1, axis=1) - pair
    return out


def blocks(rows: int, columns: int) -> list[slice]:
    """Return slices that divide `rows` into blocks of at most BLOCK_ENTRIES entries."""
    step = max(1, BLOCK_ENTRIES // max(1, columns))
    return [slice(k, min(k + step, rows)) for k in range(0, rows, step)]
