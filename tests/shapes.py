"""Simple outlines for tests, as complex vertices, and an independent evaluation of Cauchy-Green coordinates."""

from functools import partial

import numpy as np

import iccm
from iccm.curve import Curve

conformal_fit = partial(iccm.fit, method="conformal")


def circle(n=200):
    """A regular polygon of n vertices on the unit circle."""
    return np.exp(2j * np.pi * np.arange(n) / n)


def square(per_edge=1):
    """The square from -1-i to 1+i."""
    return refined(np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j]), per_edge)


def ell(per_edge=1):
    """An L of three unit squares: one reflex corner, and no symmetry except about the diagonal."""
    return refined(np.array([0, 2, 2 + 1j, 1 + 1j, 1 + 2j, 2j]), per_edge)


def star(n=100, arms=5, depth=0.3):
    """A smooth star with rounded arms."""
    t = 2 * np.pi * np.arange(n) / n
    return (1 + depth * np.cos(arms * t)) * np.exp(1j * t)


def pear(n=80):
    """A smooth shape without any symmetry."""
    t = 2 * np.pi * np.arange(n) / n
    return np.exp(1j * t) * (1 + 0.2 * np.cos(t - 0.4) + 0.15 * np.cos(2 * t + 1.1) + 0.1 * np.sin(3 * t))


def blob(n=60):
    """Another smooth shape without any symmetry, longer than wide."""
    t = 2 * np.pi * np.arange(n) / n
    return (1.2 * np.cos(t) + 0.8j * np.sin(t)) * (1 + 0.15 * np.sin(2 * t + 0.7) + 0.1 * np.cos(3 * t - 0.2))


def arrow():
    """A shape of few straight edges with sharp, right and reflex corners and no symmetry."""
    return np.array([0, 3, 3 - 0.7j, 4.5 + 0.5j, 3 + 1.8j, 3 + 1j, 0.6 + 1.3j, -0.4 + 0.7j])


def refined(polygon, per_edge):
    """A polygon with each edge divided into equal parts."""
    t = np.arange(per_edge) / per_edge
    return (polygon[:, None] + (np.roll(polygon, -1) - polygon)[:, None] * t).ravel()


def radial(radii, jitter):
    """A simple polygon around 0 with the given radii, at uniform angles moved by `jitter` in (-0.5, 0.5) of a step."""
    n = len(radii)
    return np.asarray(radii) * np.exp(2j * np.pi * (np.arange(n) + np.asarray(jitter)) / n)


def random_polygon(rng, n=12):
    """A random simple polygon around 0 with convex and reflex vertices."""
    return radial(rng.uniform(0.4, 1.0, n), rng.uniform(-0.3, 0.3, n))


def inside(polygon, count=40, margin=0.05, seed=0):
    """Random points inside, at least `margin` diagonals from the boundary."""
    curve, rng = Curve(np.asarray(polygon)), np.random.default_rng(seed)
    lo, hi = curve.box
    z = rng.uniform(lo.real, hi.real, 4000) + 1j * rng.uniform(lo.imag, hi.imag, 4000)
    z = z[curve.contains(z)]
    z = z[curve.distances(z) > margin * curve.diagonal]
    return z[:count]


class CauchyIntegral:
    """The Cauchy integral of the piecewise linear function g with given vertex values, by Gauss quadrature.

    The value of g (or of its slope) at the point's own place is subtracted first, so that limits from inside exist:

        f(z)   = g₀  + 1/(2πi) ∮ (g(w)  - g₀ ) / (w - z)  dw,
        f'(z)  = g₀' + 1/(2πi) ∮ (g'(w) - g₀') / (w - z)  dw,
        f''(z) =       1/(2πi) ∮ (g'(w) - g₀') / (w - z)² dw.
    """

    def __init__(self, polygon, values, parts=64, order=12):
        self.polygon, self.values = polygon, values
        self.edge = np.roll(polygon, -1) - polygon
        self.slope = (np.roll(values, -1) - values) / self.edge
        x, weight = np.polynomial.legendre.leggauss(order)
        t = ((np.arange(parts)[:, None] + 0.5 * (x + 1)) / parts).ravel()
        self.w = polygon[:, None] + self.edge[:, None] * t
        self.dw = self.edge[:, None] * np.tile(0.5 * weight / parts, parts)
        self.g = values[:, None] + self.slope[:, None] * self.edge[:, None] * t

    def at(self, z, edge=None):
        """Return f, f' and f'' at one point, on the given edge or inside (edge None)."""
        if edge is None:
            value = slope = 0j
        else:
            slope = self.slope[edge]
            value = self.values[edge] + slope * (z - self.polygon[edge])
        kernel = self.dw / (2j * np.pi * (self.w - z))
        rise = np.broadcast_to(self.slope[:, None] - slope, self.w.shape)
        f = value + np.sum((self.g - value) * kernel)
        return f, slope + np.sum(rise * kernel), np.sum(rise * kernel / (self.w - z))

    def along(self, z, edges):
        """Return f, f' and f'' at points of the boundary, (p,) each."""
        return (np.array(part) for part in zip(*(self.at(a, e) for a, e in zip(z, edges))))
