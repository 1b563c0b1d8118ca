"""Polylines with far more vertices than anything shows of them, in fewer."""

import numpy as np

from ...arrays import Complex, Real

LEFT = 0.99  # of the vertices after a round: when no more go, the rest is worth no other round


def thinned(z: Complex, tolerance: float, *, closed: bool) -> Complex:
    """A polyline without vertices that it hardly needs: it stays within the tolerance of the one that was given.

    Every other vertex goes in a round where that moves the line little enough. A segment knows a bound on what is
    already missing from it; where two become one, that is the larger of theirs and how far the vertex is away.
    Linear in the number of vertices, whatever they do.
    """
    missing = np.zeros(z.size)  # from each vertex to the next
    parity = 0
    while z.size > 4:
        at = np.arange(1 + parity, z.size - 1, 2)
        worst = np.maximum(missing[at - 1], missing[at]) + _away(z[at], z[at - 1], z[at + 1])
        gone = worst <= tolerance
        missing[at[gone] - 1] = worst[gone]
        keep = np.ones(z.size, dtype=bool)
        keep[at[gone]] = False
        before = z.size
        z, missing = z[keep], missing[keep]
        if z.size > LEFT * before and parity:
            break
        parity = 1 - parity
    return z[:-1] if closed and z[0] == z[-1] else z


def _away(point: Complex, a: Complex, b: Complex) -> Real:
    """Distances of points from segments."""
    chord = b - a
    square = np.maximum(np.abs(chord) ** 2, 1e-300)
    t = np.clip(((point - a) * chord.conj()).real / square, 0, 1)
    return np.abs(point - a - t * chord)
