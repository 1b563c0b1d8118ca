"""Pins that stop short: the map that is seen cannot follow them, and they are left where it takes them."""

from __future__ import annotations

import numpy as np

from ...arrays import Index
from ...balanced.interactive import Live
from ...maps.triangulated.map import TriangulatedMap
from ..shapes.shape import Shape
from .messages import Scene
from .pair import PLACE_DIGITS, Pair

EXACT_PLACE_DIGITS = 10
"""Significant digits of exact pins that are left at a vertex of the map, relative to the shape's size."""


def stop_short(
    pair: Pair, scene: Scene, before: Scene, live: Live, map: TriangulatedMap, missed: Index, aim: float
) -> Scene:
    """Return a scene in which the map meets all pins: the end that was dragged of each missed one moves there.

    Exact pins move to their vertices.

    Args:
        pair: the shapes.
        scene: pins and strokes.
        before: the scene when the drag began.
        live: the map that followed the drag, with the limits of its pins.
        map: the same map as it is kept, with rounded coordinates.
        missed: (k,) indices of the missed pins.
        aim: distance of soft pins from there, relative to their limits, in the direction in which they were dragged.
    """
    placed, vertices = pair.placed(scene).pins, live.exact_pins
    diagonals = pair.source.curve.diagonal, pair.target.curve.diagonal
    pins = list(scene.pins)
    for k in missed.tolist():
        if not live.is_soft(placed[k, 0]):
            away = np.abs(vertices - placed[k]) / diagonals
            vertex = vertices[away.min(axis=1).argmin()]  # one of its ends is where it should be
            ends = {
                "source": _file_place(pair.source, vertex[0], EXACT_PLACE_DIGITS),
                "target": _file_place(pair.target, vertex[1], EXACT_PLACE_DIGITS),
            }
        else:
            source, target = placed[k]
            away = target - map(np.array([source]))[0]
            pull = aim * live.limit(source) * away / abs(away)
            if _is_source_dragged(scene, before, k):
                ends = {"source": _file_place(pair.source, map.inverse(np.array([target - pull]))[0])}
            else:
                ends = {"target": _file_place(pair.target, target - away + pull)}
        pins[k] = pins[k].model_copy(update=ends)
    return scene.model_copy(update={"pins": pins})


def _is_source_dragged(scene: Scene, before: Scene, number: int) -> bool:
    """Return whether only the source's end of a pin has been moved."""
    if len(before.pins) != len(scene.pins):
        return False
    old_pin, pin = before.pins[number], scene.pins[number]
    return old_pin.source != pin.source and old_pin.target == pin.target


def _file_place(shape: Shape, z: complex, digits: int = PLACE_DIGITS) -> tuple[float, float]:
    """Return a point of a shape in file coordinates, with so many digits relative to the shape's size."""
    decimals = digits - int(np.floor(np.log10(shape.curve.diagonal)))
    x, y = (round(value, decimals) for value in shape.to_file(z).tolist())
    return x, y
