"""Pins that two drawings suggest: corners of both outlines, and parts with the same name."""

from __future__ import annotations

import numpy as np

from ...arrays import Complex, Real
from ...balanced.model.outline import kept_vertices
from ...curve import Curve
from ...maps.triangulated.map import TriangulatedMap
from ...symmetry import MOST_ASYMMETRY_SHARE, asymmetry
from ..shapes import parts
from ..shapes.listing import PinEntry
from ..shapes.shape import Shape

ROUGHLY, SHARP = 0.01, np.pi / 4
"""An outline simplified to this tolerance, relative to its diagonal, turns by at least this angle at a corner."""
NEAR_DIAGONAL_SHARE = 0.05
"""Relative to the diagonal: corners that are farther apart after mapping are not paired."""
APART_DIAGONAL_SHARE = 0.1
"""Relative to the diagonal: if pins were closer, their handles would overlap in a small window."""
MOST_SUGGESTED_PINS = 12  # pins that are suggested at most


def corners(curve: Curve) -> tuple[Complex, Real]:
    """Return the vertices at which an outline turns sharply, and the direction: 1 for left, -1 for right."""
    rough = Curve(curve.z[kept_vertices(curve, ROUGHLY)])
    turns = np.angle(rough.edges / np.roll(rough.edges, 1))
    sharp = np.abs(turns) > SHARP
    return rough.z[sharp], np.sign(turns[sharp])


def axis(curve: Curve) -> float | None:
    """Return the abscissa of a shape's vertical mirror axis; None if it is not symmetric."""
    low, high = curve.box
    middle = 0.5 * (low.real + high.real)
    return middle if asymmetry(curve, middle, 1j) <= MOST_ASYMMETRY_SHARE else None


def suggested(map: TriangulatedMap, source: Shape, target: Shape, existing: Complex) -> list[PinEntry]:
    """Return pins between plane shapes in file units: those with names first, then corners, the closest first.

    Args:
        map: between the shapes; corners are paired with the closest corner to their image.
        source, target: the shapes.
        existing: (k, 2) existing pins; nothing is suggested near them.
    """
    if source.is_mesh or target.is_mesh:
        return []
    pins: list[PinEntry] = []
    names, places, _ = parts.namesakes(source, target)
    named_pins = [(name, *pair) for name, pair in zip(names, places.tolist())]
    for name, z, w in (*named_pins, *_corners(map, source, target)):
        is_close = np.abs(existing - [z, w]) < APART_DIAGONAL_SHARE * np.array(
            [source.curve.diagonal, target.curve.diagonal]
        )
        if not is_close.any():
            existing = np.append(existing, [[z, w]], axis=0)
            ends = (tuple(shape.to_file(x).tolist()) for shape, x in ((source, z), (target, w)))
            pins.append(PinEntry(name=name, source=next(ends), target=next(ends)))
    return pins[:MOST_SUGGESTED_PINS]


def _corners(map: TriangulatedMap, source: Shape, target: Shape) -> list[tuple[str, complex, complex]]:
    """Return pairs of corners that turn the same way and are each other's closest."""
    (sources, ways), (targets, turns) = corners(source.curve), corners(target.curve)
    if not sources.size or not targets.size:
        return []
    carried = map.image[map.loops[0]][_closest(sources, map.source[map.loops[0]])]
    away = np.where(ways[:, None] == turns, np.abs(carried[:, None] - targets), np.inf)
    nearest, back = away.argmin(axis=1), away.argmin(axis=0)
    order = np.argsort(away.min(axis=1), kind="stable")
    candidates = [
        k
        for k in order
        if back[nearest[k]] == k and away[k, nearest[k]] < NEAR_DIAGONAL_SHARE * target.curve.diagonal
    ]
    s, tau = source.curve.closest(sources), target.curve.closest(targets)[nearest]
    selected: list[int] = []
    for k in candidates:
        if _turning_once(s[[*selected, k]], tau[[*selected, k]]):
            selected.append(k)
    return [("", complex(sources[k]), complex(targets[nearest[k]])) for k in selected]


def _turning_once(s: Real, tau: Real) -> bool:
    """Return whether points are in the same cyclic order on two outlines."""
    tau = tau[np.argsort(s)]
    return bool(np.count_nonzero(np.diff(tau, append=tau[0]) < 0) <= 1)


def _closest(z: Complex, among: Complex) -> np.ndarray:
    return np.abs(z[:, None] - among).argmin(axis=1)
