"""Fit lines and circular arcs to the images of curves under a map, within a tolerance."""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex, Real
from .bezier_fit import Image, halved

INNER = np.array([0.1, 0.25, 0.4, 0.6, 0.75, 0.9])  # parameters at which a fit is compared with the curve
STRAIGHT_SAGITTA_SHARE = 1e-7  # of the chord: flatter arcs are lines, since their centres cannot be computed


def refit_arcs(image: Image, straight: NDArray[np.bool_], tolerance: float) -> list[tuple[Complex, Real]]:
    """Fit polylines of lines and circular arcs to many curves at once.

    An interval gets the arc through its ends and its middle. If it is farther from the curve than the tolerance, the
    interval is halved.

    Args:
        image: (which (p,), t (p,)) -> (p,) points; curve number and parameter in [0, 1].
        straight: (n,) whether a curve is fitted by lines alone.
        tolerance: largest distance, in the image's units.

    Returns:
        For each curve its vertices (k + 1,), and the bulges (k,) of its pieces: the tangent of a quarter of the angle
        of the arc, positive if it runs counter-clockwise; 0 for a line.

    >>> import numpy as np
    >>> half_circle = lambda which, t: np.exp(1j * np.pi * t)
    >>> vertices, bulges = refit_arcs(half_circle, np.array([False]), 1e-6)[0]
    >>> vertices.round(9), bulges.round(9)
    (array([ 1.+0.j, -1.+0.j]), array([1.]))
    """

    def fit(curve: NDArray[np.intp], lo: Real, hi: Real) -> tuple[Complex, Real]:
        u = np.concatenate([[0.0, 0.5, 1.0], INNER])
        t = lo[:, None] + (hi - lo)[:, None] * u
        w = image(np.repeat(curve, u.size), t.ravel()).reshape(t.shape)
        bulge = np.where(straight[curve], 0.0, _bulges(w[:, 0], w[:, 1], w[:, 2]))
        return np.column_stack([w[:, 0], w[:, 2], bulge]), _distances(w[:, 0], w[:, 2], bulge, w[:, 1:])

    pieces = halved(fit, straight.size, tolerance)
    return [(np.append(arcs[:, 0], arcs[-1:, 1]), arcs[:, 2].real) for arcs in pieces]


def _bulges(a: Complex, middle: Complex, b: Complex) -> Real:
    """Return (p,) bulges of the arcs from a to b through points between; 0 where the three are in line.

    By the theorem of the inscribed angle, the angle at `middle` determines the arc: the bulge is the tangent of half
    the angle by which the direction changes there.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.angle((b - middle) / (middle - a))
    bulge = np.tan(turn / 2)
    flat = ~(np.abs(bulge) > 2 * STRAIGHT_SAGITTA_SHARE)
    return np.where(flat, 0.0, bulge)


def _distances(a: Complex, b: Complex, bulge: Real, w: Complex) -> Real:
    """Return (p,) largest distances of points (p, k) from the lines and arcs from a to b."""
    chord = b - a
    length = np.maximum(np.abs(chord), 1e-150)  # its square must not underflow
    s = (w - a[:, None]) * (chord.conj() / length**2)[:, None]  # the chord from 0 to 1
    along = np.clip(s.real, 0, 1)
    from_line = np.abs(s - along)
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = 0.5 + 1j * (1 - bulge**2) / (4 * bulge)
        radius = (1 + bulge**2) / (4 * np.abs(bulge))
        away = np.abs(s - centre[:, None])
        # |s - centre|² - radius², without the cancellation of large squares
        power = np.abs(s) ** 2 - s.real - 2 * centre.imag[:, None] * s.imag
        from_arc = np.abs(power) / (away + radius[:, None])
    distance = np.where(bulge[:, None] == 0, from_line, from_arc)
    return distance.max(axis=1) * length
