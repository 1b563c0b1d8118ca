"""Shapes that are similar: the similarity is the map, no energy is lower."""

import numpy as np

from ..curve import Curve
from .pairs import Match

SAME = 1e-9  # of the root of the area: outlines this close are the same
SAMPLES = 256  # of each outline, compared one by one
FARTHEST = 1e-7  # vertices this close to the farthest from the centroid may be it
MOST_STARTS = 64


def similarity(source: Curve, target: Curve, *, turns: bool) -> Match | None:
    """The correspondence under which the target is the source, turned if `turns`; None where they are not similar.

    Of several the one with the least turn. Both curves have area one and centroid 0.
    """
    if abs(source.length - target.length) > SAME * source.length:
        return None
    steps = np.arange(SAMPLES) / SAMPLES
    w = source.at(source.length * steps)
    found = []
    for start in _far_vertices(target, np.abs(source.z).max()):
        v = target.at(start + target.length * steps)
        product = complex(np.vdot(w, v))
        turn = product / abs(product) if turns else 1.0
        if np.abs(turn * w - v).max() < SAME * 10:
            found.append((abs(np.angle(turn)), start))
    if not found:
        return None
    start = min(found)[1]
    return Match(np.array([0.0, source.length]), start + np.array([0.0, target.length]))


def _far_vertices(curve: Curve, radius: float) -> np.ndarray:
    """Arclengths of the vertices where the source's first one, its farthest, may go."""
    return curve.knots[:-1][np.abs(np.abs(curve.z) - radius) < FARTHEST][:MOST_STARTS]
