"""Whether two maps with the same pins can be deformed into each other while the pins stay where they are.

A pin that is dragged around another one winds the picture around it. If the picture must not jump, it stays wound,
while a map computed from scratch is not; no relaxation leads from one to the other, unless pins are let go.
"""

from itertools import pairwise

import numpy as np

from iccm.arrays import Complex


def word(path: Complex, punctures: Complex) -> list[int]:
    """Return the homotopy class of a closed polyline in the plane without some points.

    Args:
        path: (n,) corners; the last one is joined to the first.
        punctures: (m,) points that are not on the path.

    Returns:
        The reduced word in the generators of the free group: k + 1 where the path crosses the ray that goes up
        from puncture k from left to right, and -(k + 1) from right to left. It is empty for paths that can be
        contracted to a point.
    """
    letters: list[int] = []
    for a, b in pairwise(np.append(path, path[:1])):
        left, right = min(a.real, b.real), max(a.real, b.real)
        # half open, so that a corner above a puncture counts once
        crossed = np.flatnonzero((left <= punctures.real) & (punctures.real < right))
        share = (punctures[crossed].real - a.real) / (b.real - a.real) if crossed.size else np.empty(0)
        above = a.imag + share * (b.imag - a.imag) > punctures[crossed].imag
        for k in crossed[above][np.argsort(share[above])]:
            letter = int(k + 1) if b.real > a.real else -int(k + 1)
            if letters and letters[-1] == -letter:
                letters.pop()
            else:
                letters.append(letter)
    return letters


def wound(first: list[Complex], second: list[Complex], pins: Complex) -> bool:
    """Return whether two maps lie in different isotopy classes relative to their pins.

    Args:
        first: the images, by one map, of arcs of the source: polylines from pin 0 to pin 1, 2, …
        second: the images of the same arcs by the other map.
        pins: (k,) where both maps take the pins.

    The arcs determine the class, except for turns of the outline and of the surroundings of single pins, which are
    not counted.
    """
    for k, (first_path, second_path) in enumerate(zip(first, second), start=1):
        punctures = np.delete(pins, [0, k])
        if word(np.concatenate([first_path, second_path[::-1]]), punctures):
            return True
    return False
