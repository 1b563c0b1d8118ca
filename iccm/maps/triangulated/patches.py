"""A quadratic patch for each triangle of the image, together a map from the image back to the source that is nearly C¹.

With barycentric coordinates L of a triangle of the image, whose corners come from z_k of the source,

    g(L) = Σ L_k z_k + 2 (L_1 L_2 d_0 + L_2 L_0 d_1 + L_0 L_1 d_2),

d_k being the bulge of the side opposite to corner k: how far its middle control point lies from its middle. Both
triangles of an edge share its bulge, so g is continuous; it is as in a quadratic Bézier triangle (Farin, *Triangular
Bernstein-Bézier patches*, CAGD 3, 1986, §1).

A bulge comes from the gradients at the edge's ends, area-weighted means over the triangles around: e·(∇g_i - ∇g_j)/4
makes the derivative along the edge right at both ends to first order. On the rim only its part along the source's edge
is taken, so that the outline stays the polyline that it is; so it is on edges that are to stay straight.
"""

import numpy as np

from ...arrays import Complex, Real
from ...native import function
from ...plane import cross
from .adjacency import Edges, Index

MOST_DEVIATION = 0.5
"""Of a patch's derivative from that of its triangle, relative: at most half, so that slivers beside an outline's
corners stretch no more than their neighbours, and every patch has one solution."""
SLIVER_AREA_RATIO = (
    1e-9  # of the squared sides: a smaller area leaves too few digits for the Bernstein coefficients
)

_shrink = function(
    """int64_t iccm_maps_shrink_bulges(
        const Complex *corners, const double *most, const bool *flat, const int64_t *sides, int64_t m, Complex *bulge,
        int64_t edges)"""
)


def gradients(faces: Index, image: Complex, source: Complex) -> tuple[Complex, Complex]:
    """Return (m,) p and q of the linear map image -> source on each triangle, dz = p dw + q conj(dw); 0 without
    area.
    """
    a, b, c = image[faces].T
    u, v, (x, y, z) = b - a, c - a, source[faces].T
    area = cross(u, v)
    scale = np.divide(0.5j, area, out=np.zeros_like(u), where=area != 0)
    return ((y - x) * v.conj() - (z - x) * u.conj()) * scale, ((z - x) * u - (y - x) * v) * scale


def vertex_gradients(faces: Index, image: Complex, source: Complex) -> tuple[Complex, Complex]:
    """Return (n,) p and q at each vertex: area-weighted means over its triangles."""
    a, b, c = image[faces].T
    area = np.abs(cross(b - a, c - a))
    at, weight, n = faces.ravel(), np.repeat(area, 3), image.size
    total = np.maximum(np.bincount(at, weight, n), 1e-300)

    def mean(values: Complex) -> Complex:
        spread, out = weight * np.repeat(values, 3), np.empty(n, np.complex128)
        out.real, out.imag = np.bincount(at, spread.real, n), np.bincount(at, spread.imag, n)
        return out / total

    p, q = gradients(faces, image, source)
    return mean(p), mean(q)


NO_LINES = np.empty((0, 2), np.int64)
NO_FACES = np.empty(0, np.int64)


def bulges(
    faces: Index,
    image: Complex,
    source: Complex,
    edges: Edges,
    straight: Index = NO_LINES,
    linear: Index = NO_FACES,
) -> Complex:
    """Return (e,) bulge of each edge, shrunk until no patch's derivative is farther from the linear one's than the
    means at its corners are from each other, nor than MOST_DEVIATION.

    Those between the pairs of vertices `straight` (l, 2) go straight, as those of the rim do; triangles `linear` (k,)
    have none.
    """
    p, q = vertex_gradients(faces, image, source)
    i, j = edges.ends.T
    along = image[j] - image[i]
    free = 0.25 * ((p[i] - p[j]) * along + (q[i] - q[j]) * along.conj())
    lines = np.flatnonzero(np.isin(keys(edges.ends, image.size), keys(straight, image.size)))
    cut = np.concatenate([edges.rim, lines])
    given = tangential(free, source, edges, cut)
    given[edges.sides[linear]] = 0
    return shrunk(faces, image, source, edges, given, differences(faces, image, source, p, q))


def differences(faces: Index, image: Complex, source: Complex, p: Complex, q: Complex) -> Real:
    """Return (m,) how far, relative to a triangle's derivative, those at its vertices p and q (n,) are from each
    other.
    """
    own_p, own_q = (each[:, None] for each in gradients(faces, image, source))
    dp, dq = (each[faces] - each[np.roll(faces, 1, axis=1)] for each in (p, q))
    size = np.abs(dp * own_p.conj() - dq * own_q.conj()) + np.abs(dq * own_p - dp * own_q)
    with np.errstate(over="ignore"):  # infinite where a triangle has all but no area
        return size.max(axis=1) / np.maximum(np.abs(np.abs(own_p) ** 2 - np.abs(own_q) ** 2)[:, 0], 1e-300)


def keys(ends: Index, count: int) -> Index:
    """Return a number for each pair of vertices (l, 2), whichever comes first."""
    return ends.min(axis=1) * count + ends.max(axis=1)


def tangential(bulge: Complex, source: Complex, edges: Edges, cut: Index) -> Complex:
    """Return the bulges with those of the edges `cut` reduced to their part along the source's edge."""
    i, j = edges.ends[cut].T
    along = source[j] - source[i]
    out = bulge.copy()
    out[cut] = (bulge[cut] * along.conj()).real / np.maximum(np.abs(along) ** 2, 1e-300) * along
    return out


def slides(bulge: Complex, source: Complex, edges: Edges) -> Real:
    """Return (r,) bulges of the rim's edges in units of the source's edge, along it."""
    i, j = edges.ends[edges.rim].T
    along = source[j] - source[i]
    length = np.abs(along)
    unit = along / np.maximum(length, 1e-300)
    return (bulge[edges.rim] * unit.conj()).real / np.maximum(length, 1e-300)


def shrunk(
    faces: Index, image: Complex, source: Complex, edges: Edges, bulge: Complex, limits: Real | None = None
) -> Complex:
    """Return the bulges shrunk until every patch's derivative is within its limit (m,), and MOST_DEVIATION, of the
    linear one's. Triangles that are not clearly positive stay linear.
    """
    bulge = np.array(bulge, np.complex128)
    most = np.full(len(faces), MOST_DEVIATION) if limits is None else np.minimum(limits, MOST_DEVIATION)
    corners = np.ascontiguousarray(source[faces], np.complex128)
    flat = _sliver(corners) | _sliver(image[faces])
    bulge[edges.sides[flat]] = 0
    _shrink(corners, most, flat, edges.sides, len(faces), bulge, bulge.size)
    return bulge


def _sliver(corners: Complex) -> np.ndarray:
    """Return whether triangles (m, 3) have no area to speak of, or a negative one."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return ~(cross(u, v) > SLIVER_AREA_RATIO * (np.abs(u) ** 2 + np.abs(v) ** 2))


def tangents(corners: Complex, bulge: Complex) -> tuple[list[Complex], list[Complex]]:
    """Return values at the three corners of ∂g/∂L_1 and of ∂g/∂L_2 (L_0 following), which are linear; each (m,).

    Args:
        corners: (m, 3) source points of the corners.
        bulge: (m, 3) of the opposite sides.
    """
    (x, y, z), (d0, d1, d2) = corners.T, bulge.T
    u, v = y - x, z - x
    return [u + 2 * d2, u - 2 * d2, u + 2 * (d0 - d1)], [v + 2 * d1, v + 2 * (d0 - d2), v - 2 * d1]


def bernstein(corners: Complex, bulge: Complex) -> Real:
    """Return (6, m) Bernstein coefficients of degree 2 of each patch's Jacobian, in units of twice the source's area.

    Those of the three corners, and of the sides 12, 20, 01. The Jacobian lies between the least and the greatest.
    """
    a, b = tangents(corners, bulge)
    at_corners = [cross(a[k], b[k]) for k in range(3)]
    at_sides = [0.5 * (cross(a[i], b[j]) + cross(a[j], b[i])) for i, j in ((1, 2), (2, 0), (0, 1))]
    return np.stack(at_corners + at_sides)
