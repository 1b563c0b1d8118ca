"""Pins that two drawings suggest: where both have a corner, and what both call by the same name."""

from __future__ import annotations

import numpy as np

from ...arrays import Complex, Real
from ...balanced.model.outline import kept_vertices
from ...balanced.search.symmetry import MOST_ASYMMETRY_SHARE, asymmetry
from ...curve import Curve
from ...maps.triangulated.map import TriangulatedMap
from ..shapes import parts
from ..shapes.listing import Pin
from ..shapes.shape import Shape

ROUGHLY, SHARP = 0.01, np.pi / 4
"""An outline simplified so far, of its diagonal, turns by so much at a corner."""
NEAR = 0.05  # of the diagonal: corners that are farther apart, once carried, do not form a pair
APART = 0.1  # of the diagonal: closer to another, handles would cover each other in a small window
MOST = 12  # pins that are suggested


def corners(curve: Curve) -> tuple[Complex, Real]:
    """Return the vertices at which an outline turns sharply, and which way: 1 to the left, -1 to the right."""
    rough = Curve(curve.z[kept_vertices(curve, ROUGHLY)])
    turns = np.angle(rough.edges / np.roll(rough.edges, 1))
    sharp = np.abs(turns) > SHARP
    return rough.z[sharp], np.sign(turns[sharp])


def axis(curve: Curve) -> float | None:
    """Return the abscissa of the vertical line about which a shape is its own mirror image; None where it is not."""
    low, high = curve.box
    middle = 0.5 * (low.real + high.real)
    return middle if asymmetry(curve, middle) <= MOST_ASYMMETRY_SHARE else None


def suggested(map: TriangulatedMap, source: Shape, target: Shape, taken: Complex) -> list[Pin]:
    """Pins between plane shapes, in their files' units: those with names first, then corners, the closest first.

    Args:
        map: between the shapes: what it carries a corner close to is its partner.
        source, target: the shapes.
        taken: (k, 2) pins that there are: nothing is suggested beside them.
    """
    if source.is_mesh or target.is_mesh:
        return []
    found: list[Pin] = []
    names, places, _ = parts.namesakes(source, target)
    named = [(name, *pair) for name, pair in zip(names, places.tolist())]
    for name, z, w in (*named, *_corners(map, source, target)):
        beside = np.abs(taken - [z, w]) < APART * np.array([source.curve.diagonal, target.curve.diagonal])
        if not beside.any():
            taken = np.append(taken, [[z, w]], axis=0)
            ends = (tuple(shape.to_file(x).tolist()) for shape, x in ((source, z), (target, w)))
            found.append(Pin(name=name, source=next(ends), target=next(ends)))
    return found[:MOST]


def _corners(map: TriangulatedMap, source: Shape, target: Shape) -> list[tuple[str, complex, complex]]:
    """Corners that turn the same way, and are each other's closest ones."""
    (here, ways), (there, turns) = corners(source.curve), corners(target.curve)
    if not here.size or not there.size:
        return []
    carried = map.image[map.loops[0]][_closest(here, map.source[map.loops[0]])]
    away = np.where(ways[:, None] == turns, np.abs(carried[:, None] - there), np.inf)
    nearest, back = away.argmin(axis=1), away.argmin(axis=0)
    order = np.argsort(away.min(axis=1), kind="stable")
    near = [k for k in order if back[nearest[k]] == k and away[k, nearest[k]] < NEAR * target.curve.diagonal]
    s, tau = source.curve.closest(here), target.curve.closest(there)[nearest]
    kept: list[int] = []
    for k in near:
        if _turning_once(s[[*kept, k]], tau[[*kept, k]]):
            kept.append(k)
    return [("", complex(here[k]), complex(there[nearest[k]])) for k in kept]


def _turning_once(s: Real, tau: Real) -> bool:
    """Return whether points follow each other on a second outline as they do on the first."""
    tau = tau[np.argsort(s)]
    return bool(np.count_nonzero(np.diff(tau, append=tau[0]) < 0) <= 1)


def _closest(z: Complex, among: Complex) -> np.ndarray:
    return np.abs(z[:, None] - among).argmin(axis=1)
