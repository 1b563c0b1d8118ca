"""Known conformal maps, and errors of fits relative to them.

A conformal map has three free real parameters, so the composition of the result with the exact maps to the disc is
compared with the best Möbius map.
"""

from functools import cache

import numpy as np
from scipy.optimize import brentq

from tests.shapes import circle, conformal_fit, ell, square

NODES, WEIGHTS = np.polynomial.legendre.leggauss(60)
NODES, WEIGHTS = 0.5 * (NODES + 1), 0.5 * WEIGHTS


class SchwarzChristoffel:
    """The map of the unit disc onto a polygon, with 0 mapped to the start of ∫: A + B ∫ Π (1 - t/p_k)^(α_k - 1) dt."""

    def __init__(self, prevertices, angles, corners):
        """Take prevertices on the circle, interior angles over π, and the first two corners."""
        self.p, self.power = np.asarray(prevertices), np.asarray(angles) - 1
        self.shift, self.scale = 0j, 1.0
        first = self.corner(0), self.corner(1)
        self.scale = (corners[1] - corners[0]) / (first[1] - first[0])
        self.shift = corners[0] - self.scale * first[0]

    def slope(self, w):
        return self.scale * np.prod((1 - w[..., None] / self.p) ** self.power, axis=-1)

    def __call__(self, w):
        return self.shift + w * np.sum(WEIGHTS * self.slope(w[..., None] * NODES), axis=-1)

    def corner(self, k):
        """Integrate along the ray to a prevertex, where t = p (1 - s²) removes the singularity."""
        integrand = self.slope(self.p[k] * (1 - NODES**2)) * 2 * NODES
        return self.shift + self.p[k] * np.sum(WEIGHTS * integrand)

    def inverse(self, z, w):
        """Invert by Newton's method from w."""
        for _ in range(50):
            w = w - (self(w) - z) / self.slope(w)
        assert np.abs(self(w) - z).max() < 1e-12 and (np.abs(w) < 1).all()
        return w


@cache
def to_square():
    p = np.exp(1j * np.pi * np.array([-3, -1, 1, 3]) / 4)
    return SchwarzChristoffel(p, [0.5] * 4, square()[:2])


@cache
def to_ell():
    """A map that is symmetric about the diagonal: one prevertex is free, and another is chosen so that two sides are
    equal.
    """
    angles = np.array([0.5, 0.5, 0.5, 1.5, 0.5, 0.5])

    def prevertices(beta):
        return np.exp(1j * np.array([np.pi, -2.2, -beta, 0, beta, 2.2]))

    def unequal(beta):
        f = SchwarzChristoffel(prevertices(beta), angles, ell()[:2])
        return abs(f.corner(2) - f.corner(1)) - abs(f.corner(3) - f.corner(2))

    return SchwarzChristoffel(prevertices(brentq(unequal, 0.05, 2.1, xtol=1e-15)), angles, ell()[:2])


DISC = 0.95 * np.sqrt((np.arange(300) + 0.5) / 300) * np.exp(2.399963j * np.arange(300))


def moebius_error(u, w):
    """Return the largest distance of points u from the best Möbius map of w, and how far that moves the circle."""
    matrix = np.column_stack([w, np.ones_like(w), -u * w])
    a, b, c = np.linalg.lstsq(matrix, u)[0]
    rim = np.exp(1j * np.arange(0, 6.28, 0.1))
    error = np.abs(u - (a * w + b) / (c * w + 1)).max()
    return error, np.abs(np.abs((a * rim + b) / (c * rim + 1)) - 1).max()


def quadratic(c):
    """w + c w² on the disc and its inverse: an ellipse-like shape, which tends to a cardioid for c = 0.5."""
    return (lambda w: w + c * w**2), (lambda z: (np.sqrt(1 + 4 * c * z) - 1) / (2 * c))


def fair(z):
    """A polygon with about the area of the smooth curve through z: otherwise its chords alone would cause an error of
    O(h²).
    """
    return z + (z - 0.5 * (np.roll(z, 1) + np.roll(z, -1))) / 6


def smooth_error(c, n, **options):
    """The error of mapping a disc of n vertices onto the image of a fine one."""
    f, back = quadratic(c)
    fit = conformal_fit(fair(circle(n)), fair(f(circle(1000))), vertices=n, tolerance=1e-6, **options)
    assert fit.map.polygon.size <= 1.1 * n
    return moebius_error(back(fit.map(DISC)), DISC)


def square_error(n, **options):
    """The error of mapping a square onto the regular polygon of 4n sides, whose difference from the disc is
    negligible.
    """
    fit = conformal_fit(square(), circle(1000), vertices=n, tolerance=1e-6, **options)
    return moebius_error(fit.map(to_square()(DISC)), DISC)


def ell_error(n, **options):
    fit = conformal_fit(ell(), square(), vertices=n, tolerance=1e-6, **options)
    image = fit.map(to_ell()(DISC))
    return moebius_error(to_square().inverse(image, 0.9 * image / np.abs(image).max()), DISC)


def order(errors, ns):
    """The slope of log error against log n."""
    return -np.polyfit(np.log(ns), np.log(errors), 1)[0]
