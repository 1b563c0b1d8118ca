"""Quadratic patches on the triangles of the image: together a map from the image to the source that is nearly C¹.

With barycentric coordinates L of a triangle of the image, whose corners are the images of z_k in the source,

    g(L) = Σ L_k z_k + 2 (L_1 L_2 d_0 + L_2 L_0 d_1 + L_0 L_1 d_2).

Here d_k is the *bulge* of the side opposite to corner k: the displacement of its middle control point from its
midpoint. Both triangles at an edge share its bulge, so that g is continuous, as for quadratic Bézier triangles
(Farin, *Triangular Bernstein-Bézier patches*, CAGD 3, 1986, §1).

A bulge is computed from the gradients at the edge's ends, which are area-weighted means over the triangles
around: e·(∇g_i - ∇g_j)/4 makes the derivative along the edge correct at both ends to first order. On the
boundary only its component along the source's edge is used, so that the outline remains a polyline; the same is
done on edges that should stay straight.
"""

import numpy as np

from ...arrays import Complex, Real
from ...native import function
from ...plane import cross
from .adjacency import Edges, Index

MOST_DEVIATION = 0.5
"""Largest relative difference of a patch's derivative from that of its triangle: one half, so that slivers at
an outline's corners are not stretched more than their neighbours, and each point of a patch has one solution.
"""
SLIVER_AREA_RATIO = (
    # Relative to the squared sides: a smaller area leaves too few digits for the Bernstein coefficients.
    1e-9
)

_shrink = function(
    """int64_t iccm_maps_shrink_bulges(
        const Complex *corners, const double *most, const bool *flat, const int64_t *sides, int64_t m, Complex *bulge,
        int64_t edges)"""
)


def gradients(faces: Index, image: Complex, source: Complex) -> tuple[Complex, Complex]:
    """Return (m,) p and q of the linear map image -> source on each triangle.

    It is dz = p dw + q conj(dw); both are 0 if the triangle has no area.
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
    corners, weight, n = faces.ravel(), np.repeat(area, 3), image.size
    total = np.maximum(np.bincount(corners, weight, n), 1e-300)

    def mean(values: Complex) -> Complex:
        spread, out = weight * np.repeat(values, 3), np.empty(n, np.complex128)
        out.real, out.imag = np.bincount(corners, spread.real, n), np.bincount(corners, spread.imag, n)
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
    """Return (e,) the bulge of each edge, limited so that patches stay close to their triangles.

    Bulges are shrunk until no patch's derivative differs more from that of its triangle than the means at its
    corners differ from each other, nor by more than MOST_DEVIATION.

    Args:
        faces: (m, 3) triangles.
        image: (n,) vertices in the image.
        source: (n,) vertices in the source.
        edges: of the triangulation.
        straight: (l, 2) vertex pairs of edges that stay straight, like boundary edges.
        linear: (k,) triangles that stay linear.
    """
    p, q = vertex_gradients(faces, image, source)
    i, j = edges.ends.T
    along = image[j] - image[i]
    free = 0.25 * ((p[i] - p[j]) * along + (q[i] - q[j]) * along.conj())
    lines = np.flatnonzero(np.isin(keys(edges.ends, image.size), keys(straight, image.size)))
    cut = np.concatenate([edges.rim, lines])
    bulge = tangential(free, source, edges, cut)
    bulge[edges.sides[linear]] = 0
    return shrunk(faces, image, source, edges, bulge, differences(faces, image, source, p, q))


def differences(faces: Index, image: Complex, source: Complex, p: Complex, q: Complex) -> Real:
    """Return (m,) the largest relative differences of p and q at vertices from those of the triangle.

    The arguments p and q (n,) are derivatives at vertices.
    """
    own_p, own_q = gradients(faces, image, source)
    own_p, own_q = own_p[:, None], own_q[:, None]
    previous = np.roll(faces, 1, axis=1)
    dp, dq = p[faces] - p[previous], q[faces] - q[previous]
    size = np.abs(dp * own_p.conj() - dq * own_q.conj()) + np.abs(dq * own_p - dp * own_q)
    with np.errstate(over="ignore"):  # infinite for triangles with almost no area
        return size.max(axis=1) / np.maximum(np.abs(np.abs(own_p) ** 2 - np.abs(own_q) ** 2)[:, 0], 1e-300)


def keys(ends: Index, count: int) -> Index:
    """Return a key for each unordered pair of vertices (l, 2)."""
    return ends.min(axis=1) * count + ends.max(axis=1)


def tangential(bulge: Complex, source: Complex, edges: Edges, cut: Index) -> Complex:
    """Return the bulges, with those of the edges `cut` reduced to their component along the source's edge."""
    i, j = edges.ends[cut].T
    along = source[j] - source[i]
    out = bulge.copy()
    out[cut] = (bulge[cut] * along.conj()).real / np.maximum(np.abs(along) ** 2, 1e-300) * along
    return out


def slides(bulge: Complex, source: Complex, edges: Edges) -> Real:
    """Return (r,) the bulges of the boundary edges along the source's edge, in units of it."""
    i, j = edges.ends[edges.rim].T
    along = source[j] - source[i]
    length = np.abs(along)
    unit = along / np.maximum(length, 1e-300)
    return (bulge[edges.rim] * unit.conj()).real / np.maximum(length, 1e-300)


def shrunk(
    faces: Index, image: Complex, source: Complex, edges: Edges, bulge: Complex, limits: Real | None = None
) -> Complex:
    """Return the bulges shrunk until every patch's derivative is close enough to that of its triangle.

    The relative difference is at most the patch's limit (m,), and MOST_DEVIATION. Triangles that are not
    clearly positive stay linear.
    """
    bulge = np.array(bulge, np.complex128)
    most = np.full(len(faces), MOST_DEVIATION) if limits is None else np.minimum(limits, MOST_DEVIATION)
    corners = np.ascontiguousarray(source[faces], np.complex128)
    flat = _sliver(corners) | _sliver(image[faces])
    bulge[edges.sides[flat]] = 0
    _shrink(corners, most, flat, edges.sides, len(faces), bulge, bulge.size)
    return bulge


def _sliver(corners: Complex) -> np.ndarray:
    """Return whether triangles (m, 3) have almost no area, or a negative one."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return ~(cross(u, v) > SLIVER_AREA_RATIO * (np.abs(u) ** 2 + np.abs(v) ** 2))


def tangents(corners: Complex, bulge: Complex) -> tuple[list[Complex], list[Complex]]:
    """Return the values of ∂g/∂L_1 and ∂g/∂L_2 (with dependent L_0), which are linear, at the three corners; (m,) each.

    Args:
        corners: (m, 3) source points of the corners.
        bulge: (m, 3) of the opposite sides.
    """
    (x, y, z), (d0, d1, d2) = corners.T, bulge.T
    u, v = y - x, z - x
    return [u + 2 * d2, u - 2 * d2, u + 2 * (d0 - d1)], [v + 2 * d1, v + 2 * (d0 - d2), v - 2 * d1]


def bernstein(corners: Complex, bulge: Complex) -> Real:
    """Return (6, m) Bernstein coefficients of degree 2 of each patch's Jacobian, in units of twice the source's area.

    They belong to the three corners, and to the sides 12, 20, 01. The Jacobian lies between the least and the
    greatest.
    """
    a, b = tangents(corners, bulge)
    at_corners = [cross(a[k], b[k]) for k in range(3)]
    at_sides = [0.5 * (cross(a[i], b[j]) + cross(a[j], b[i])) for i, j in ((1, 2), (2, 0), (0, 1))]
    return np.stack(at_corners + at_sides)
