"""The quadtree behind `evaluate`: squares with the far edges summed into polynomials, and lists of the near ones."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex
from ..jit import kernel
from .cauchy_green import edge_log

# Chosen by hand, and nobody knows better, where a line does not say how a number was found.
RHO = 3.0  # edges nearer than this many circumradii keep their logarithm
MOST_NEAR = 7  # a square with no more near edges than this is a leaf
DEPTH = 60  # at most: 2 ** -60 of the square is below round-off
ASIDE = 0.0031415 - 0.0027183j
"""Half sides from the middle: no side of an edge is that of a square centred on it."""
GAUSS = 8  # nodes for an edge seen from far: (1/8)^16 of it is round-off


class Tree(NamedTuple):
    """The quadtree as flat arrays, for the kernels.

    Attributes:
        za, edge, rise, slope: (n,) vertices, edge vectors, and (m, n) rise and slope of the densities on the edges.
        dens: (m, n) densities at the vertices: φ, and conj ψ when the map is not conformal.
        centre, half: (q,) squares.
        child: (q,) index of the first of four children, -1 for a leaf.
        inside: (q,) whether the centre is in the polygon.
        start, cross, stop: (q,) a leaf's edges: near[start:cross] may cross the square, near[cross:stop] are only near.
        near: (t,) edge numbers.
        ends: (t,) 1 where the edge before is far, plus 2 where the edge after is.
        far: (q, m, degree + 1) coefficients of the far edges in (z - centre) / (√2 half).
    """

    za: Complex
    edge: Complex
    dens: Complex
    rise: Complex
    slope: Complex
    centre: Complex
    half: NDArray[np.float64]
    child: NDArray[np.int64]
    inside: NDArray[np.bool_]
    start: NDArray[np.int64]
    cross: NDArray[np.int64]
    stop: NDArray[np.int64]
    near: NDArray[np.int64]
    ends: NDArray[np.int64]
    far: Complex


def build(polygon: Complex, dens: Complex, degree: int) -> Tree:
    """The tree of a counter-clockwise polygon (n,) with densities (m, n)."""
    edge = np.roll(polygon, -1) - polygon
    rise = np.ascontiguousarray(np.roll(dens, -1, axis=1) - dens)
    slope = rise / edge
    lo = complex(polygon.real.min(), polygon.imag.min())
    hi = complex(polygon.real.max(), polygon.imag.max())
    half = 0.505 * max((hi - lo).real, (hi - lo).imag)
    root = 0.5 * (lo + hi) + ASIDE * half
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
    parts = _grow(polygon, edge, dens, rise, slope, root, half, degree, nodes, weights)
    return Tree(polygon, edge, dens, rise, slope, *parts)


@kernel
def distance(z, a, edge):
    """Distance of z to the segment from a along edge."""
    w = (z - a) / edge
    t = min(max(w.real, 0.0), 1.0)
    return abs(z - a - t * edge)


@kernel
def crosses(p, q, a, b):
    """Whether segments pq and ab cross, half-open so that a path through a shared vertex counts once."""
    d = q - p
    sa = (d.real * (a.imag - p.imag) - d.imag * (a.real - p.real)) >= 0
    sb = (d.real * (b.imag - p.imag) - d.imag * (b.real - p.real)) >= 0
    if sa == sb:
        return False
    e = b - a
    sp = (e.real * (p.imag - a.imag) - e.imag * (p.real - a.real)) >= 0
    sq = (e.real * (q.imag - a.imag) - e.imag * (q.real - a.real)) >= 0
    return sp != sq


@kernel
def _expand(out, c, r, a, edge, dens, rise, slope, e, n, gap, nodes, weights):
    """Adds the integral over the far edge e, as a polynomial in (z - c) / r, to out (m, degree + 1)."""
    m, terms = out.shape
    if abs(edge) < 0.5 * gap:
        for q in range(nodes.size):
            t = 0.5 * (nodes[q] + 1)
            inverse = 1 / (a + t * edge - c)
            power = 0.5 * weights[q] * edge * inverse
            step = r * inverse
            for k in range(terms):
                for i in range(m):
                    out[i, k] += power * (dens[i, e] + t * rise[i, e])
                power *= step
        return
    a0, b0 = a - c, a + edge - c
    log = edge_log(a0, b0, edge)
    pa, pb = r / a0, r / b0
    before, ta, tb = 0j, 1.0 + 0j, 1.0 + 0j
    for k in range(terms):
        now = log
        if k > 0:
            ta *= pa
            tb *= pb
            now = (ta - tb) / k
        for i in range(m):
            out[i, k] += (dens[i, e] - slope[i, e] * a0) * now + slope[i, e] * r * before
            if k == 0:
                out[i, k] += rise[i, e]
        before = now


@kernel
def _grow(za, edge, dens, rise, slope, root, half0, degree, nodes, weights):
    n, m, terms = za.size, dens.shape[0], degree + 1
    centre, half = [root], [half0]
    child, inside = [-1], [False]
    start, cross, stop, depth = [0], [0], [0], [0]
    near = [0]
    lists = [np.arange(n)]
    polys = [np.zeros((m, terms), dtype=np.complex128)]
    odd = False
    for e in range(n):  # is the root's centre inside? count crossings of a ray
        b = za[e] + edge[e]
        if (za[e].imag > root.imag) != (b.imag > root.imag):
            x = za[e].real + (root.imag - za[e].imag) / edge[e].imag * edge[e].real
            odd ^= x > root.real
    inside[0] = odd
    near.pop()
    k = 0
    while k < len(centre):
        r = math.sqrt(2.0) * half[k]
        edges = lists[k]
        count = 0
        for e in edges:
            count += distance(centre[k], za[e], edge[e]) <= r
        dead = count == 0 and not inside[k] and k > 0
        if (edges.size > MOST_NEAR and depth[k] < DEPTH and not dead) or k == 0:
            child[k] = len(centre)
            for quad in range(4):
                h = 0.5 * half[k]
                c = centre[k] + complex(h if quad & 1 else -h, h if quad & 2 else -h)
                flip = inside[k]
                for e in edges:
                    if crosses(centre[k], c, za[e], za[(e + 1) % n]):
                        flip = not flip
                poly = _shifted(polys[k], complex(0.5 if quad & 1 else -0.5, 0.5 if quad & 2 else -0.5))
                keep = np.empty(edges.size, dtype=np.int64)
                kept = 0
                for e in edges:
                    gap = distance(c, za[e], edge[e])
                    if gap < RHO * 0.5 * r:
                        keep[kept] = e
                        kept += 1
                    else:
                        _expand(
                            poly, c, 0.5 * r, za[e], edge[e], dens, rise, slope, e, n, gap, nodes, weights
                        )
                centre.append(c)
                half.append(h)
                child.append(-1)
                inside.append(flip)
                start.append(0)
                cross.append(0)
                stop.append(0)
                depth.append(depth[k] + 1)
                lists.append(keep[:kept].copy())
                polys.append(poly)
        else:
            start[k] = len(near)
            for e in edges:
                if distance(centre[k], za[e], edge[e]) <= r:
                    near.append(e)  # noqa: PERF401 (a kernel)
            cross[k] = len(near)
            if not dead:
                for e in edges:
                    if not distance(centre[k], za[e], edge[e]) <= r:
                        near.append(e)  # noqa: PERF401
            stop[k] = len(near)
        k += 1
    far = np.empty((len(centre), m, terms), dtype=np.complex128)
    for k in range(len(centre)):
        far[k] = polys[k]
    return (
        np.array(centre),
        np.array(half),
        np.array(child),
        np.array(inside),
        np.array(start),
        np.array(cross),
        np.array(stop),
        np.array(near),
        _run_ends(np.array(start), np.array(stop), np.array(near), n),
        far,
    )


@kernel
def _run_ends(start, stop, near, n):
    """Where a leaf's runs of consecutive near edges begin and end: only there do the vertex terms of f' not cancel."""
    ends = np.zeros(near.size, dtype=np.int64)
    held = np.zeros(n, dtype=np.bool_)
    for k in range(start.size):
        for j in range(start[k], stop[k]):
            held[near[j]] = True
        for j in range(start[k], stop[k]):
            ends[j] = (0 if held[near[j] - 1] else 1) + (0 if held[(near[j] + 1) % n] else 2)
        for j in range(start[k], stop[k]):
            held[near[j]] = False
    return ends


@kernel
def _shifted(poly, s):
    """p((s + t / 2)·…): the coefficients of p(u) with u = s·(1/√2)… for a child square.

    The parent's variable is u = (z - c) / r and the child's t = (z - c') / (r / 2), c' = c + s·√½·r, so
    u = √½ s + t / 2. Horner with polynomials keeps it exact.
    """
    m, terms = poly.shape
    s = s * math.sqrt(0.5)
    out = np.zeros((m, terms), dtype=np.complex128)
    for i in range(m):
        for k in range(terms - 1, -1, -1):
            for q in range(terms - 1 - k, 0, -1):
                out[i, q] = s * out[i, q] + 0.5 * out[i, q - 1]
            out[i, 0] = s * out[i, 0] + poly[i, k]
    return out


@kernel
def leaf_of(t, z):
    """The leaf that holds z, -1 outside the root square."""
    d = z - t.centre[0]
    if not (abs(d.real) <= t.half[0] and abs(d.imag) <= t.half[0]):
        return -1
    k = 0
    while t.child[k] >= 0:
        d = z - t.centre[k]
        k = t.child[k] + (1 if d.real > 0 else 0) + (2 if d.imag > 0 else 0)
    return k


@kernel
def is_inside(t, k, z):
    """Whether z, a point of leaf k, lies in the polygon."""
    inside = t.inside[k]
    n = t.za.size
    for j in range(t.start[k], t.cross[k]):
        e = t.near[j]
        if crosses(t.centre[k], z, t.za[e], t.za[(e + 1) % n]):
            inside = not inside
    return inside


@kernel
def edge_under(t, k, z, tiny):
    """The edge of leaf k on which z lies to within tiny, or -1."""
    best, on = tiny, -1
    for j in range(t.start[k], t.cross[k]):
        e = t.near[j]
        gap = distance(z, t.za[e], t.edge[e])
        if gap <= best:
            best, on = gap, e
    return on
