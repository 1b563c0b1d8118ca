"""Fast evaluation of a harmonic map at many points: a quadtree of local expansions, exact logarithms for near edges.

Φ(z) = 1/(2πi) ∫ φ(ζ)/(ζ - z) dζ with φ linear on every edge. On a square, the edges farther away than RHO circumradii
add up to one polynomial, accurate to RHO^-degree; the others, a handful, keep their logarithms. Squares are split
until the handful is small, so a point costs one short polynomial and a few logarithms whatever the number of vertices.
The dense sum of `harmonic.HarmonicMap` stays the reference.
"""

import math
from functools import cached_property

import numpy as np

from ..arrays import Complex
from ..jit import kernel
from ..parallel import over_slices
from .cauchy_green import edge_log
from .harmonic import HarmonicMap
from .quadtree import build, edge_under, is_inside, leaf_of


class Evaluator:
    """A map made ready for many evaluations.

    Args:
        map: the map; its polygon must be simple and counter-clockwise.
        degree: of the expansions; 28 gives about 1e-12 of the map's size, 16 about 1e-8.
    """

    def __init__(self, map: HarmonicMap, degree: int = 28):
        self.map = map
        dens = map.phi[None] if map.conformal else np.stack([map.phi, map.psi.conj()])
        self.tree = build(np.ascontiguousarray(map.polygon), np.ascontiguousarray(dens), degree)

    @property
    def polygon(self) -> Complex:
        """(n,) vertices of the source domain."""
        return self.map.polygon

    @cached_property
    def diagonal(self) -> float:
        """Length of the diagonal of the source polygon's bounding box."""
        return float(abs(np.ptp(self.map.polygon.real) + 1j * np.ptp(self.map.polygon.imag)))

    def __call__(self, z: Complex, threads: int | None = None) -> Complex:
        """f at points inside, on the boundary or as close to it as the map allows, any shape; NaN beyond."""
        return self.jet(z, threads)[0]

    def derivatives(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex]:
        """f_z and f_z̄ at points inside or on edges; NaN outside and at vertices, where they do not exist."""
        return self.jet(z, threads)[1:]

    def jet(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """f, f_z and f_z̄ at points of any shape; those outside by at most the map's slack are taken to the closest
        point of the polygon, beyond the values are NaN."""
        z = np.asarray(z, dtype=np.complex128)
        flat = np.ascontiguousarray(z.ravel())
        out = np.empty((3, flat.size), dtype=np.complex128)
        tiny = max(1e-13 * self.diagonal, 8 * float(np.spacing(np.abs(self.polygon).max())))
        over_slices(lambda part: _jets(self.tree, flat[part], tiny, out[:, part]), flat.size, threads)
        lost = np.flatnonzero(np.isnan(out[0]) & np.isfinite(flat))
        if lost.size:
            foot, found = self.map.placed(flat[lost]), np.empty((3, lost.size), dtype=np.complex128)
            over_slices(lambda part: _jets(self.tree, foot[part], tiny, found[:, part]), lost.size, threads)
            out[:, lost] = found
        return out[0].reshape(z.shape), out[1].reshape(z.shape), out[2].reshape(z.shape)


@kernel
def jet_in(t, k, z, on):
    """f, f_z, f_z̄ at z in leaf k; `on` is an edge that z lies on (the limit from inside is taken), or -1."""
    terms = t.far.shape[2]
    r = math.sqrt(2.0) * t.half[k]
    u = (z - t.centre[k]) / r
    both = t.dens.shape[0] == 2
    p, dp, q, dq = 0j, 0j, 0j, 0j
    for i in range(terms - 1, -1, -1):
        dp = dp * u + p
        p = p * u + t.far[k, 0, i]
    if both:
        for i in range(terms - 1, -1, -1):
            dq = dq * u + q
            q = q * u + t.far[k, 1, i]
    dp /= r
    dq /= r
    n = t.za.size
    after, before = 0j, 0j
    for j in range(t.start[k], t.stop[k]):
        e = t.near[j]
        a = t.za[e] - z
        b = t.za[(e + 1) % n] - z
        if (
            a == 0 or b == 0
        ):  # a vertex: its two logarithms make one, log(B_{j+1} / B_{j-1}), once both are met
            after, before = (b, before) if a == 0 else (after, a)
            p += t.rise[0, e]
            if both:
                q += t.rise[1, e]
            if after != 0 and before != 0:
                ratio = after / before
                angle = math.atan2(ratio.imag, ratio.real)
                log = complex(math.log(abs(ratio)), angle if angle > 0 else angle + 2 * math.pi)
                j0 = e if a == 0 else (e + 1) % n
                p += t.dens[0, j0] * log
                if both:
                    q += t.dens[1, j0] * log
            dp = dq = complex(np.nan, np.nan)
            continue
        log = edge_log(a, b, t.edge[e])
        if e == on and log.imag < 0:
            log = complex(log.real, log.imag + 2 * math.pi)
        p += (t.dens[0, e] - t.slope[0, e] * a) * log + t.rise[0, e]
        dp += t.slope[0, e] * log
        if both:
            q += (t.dens[1, e] - t.slope[1, e] * a) * log + t.rise[1, e]
            dq += t.slope[1, e] * log
        if t.ends[j] & 1:
            dp += t.dens[0, e] / a
            if both:
                dq += t.dens[1, e] / a
        if t.ends[j] & 2:
            dp -= (t.dens[0, e] + t.rise[0, e]) / b
            if both:
                dq -= (t.dens[1, e] + t.rise[1, e]) / b
    scale = 1 / (2j * math.pi)
    return scale * p + (scale * q).conjugate(), scale * dp, (scale * dq).conjugate()


@kernel
def _jets(t, z, tiny, out):
    for i in range(z.size):
        out[:, i] = complex(np.nan, np.nan)
        k = leaf_of(t, z[i])
        if k < 0:
            continue
        on = edge_under(t, k, z[i], tiny)
        if on >= 0 or is_inside(t, k, z[i]):
            out[0, i], out[1, i], out[2, i] = jet_in(t, k, z[i], on)


@kernel
def edge_jets(t, z, on, out):
    """Jets (3, p) at points z (p,) on the edges numbered on (p,), off the vertices: limits from inside."""
    for i in range(z.size):
        k = leaf_of(t, z[i])
        out[0, i], out[1, i], out[2, i] = jet_in(t, k, z[i], on[i])
