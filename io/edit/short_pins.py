"""Pins that stop short: the map that is seen cannot follow them, and they are left where it takes them."""

from __future__ import annotations

import numpy as np

from ...arrays import Complex, Index
from ...balanced.interactive import Live
from ...balanced.warped import WarpedLive
from ..shapes.shape import Shape
from .messages import Scene
from .pair import PLACE_DIGITS, Pair

EXACT_PLACE_DIGITS = 10
"""Significant digits of exact pins that are left at a vertex of the map, relative to the shape's size."""

LEAST_GAP_LIMITS = (
    0.5  # relative to a pin's limit: a spring is not made so stiff that it pulls more from closer by
)


def stop_short(
    pair: Pair, scene: Scene, earlier: Scene, live: Live | WarpedLive, missed: Index, aim: float
) -> Scene:
    """Return a scene in which the map meets all pins: the end that was dragged of each missed one moves there.

    Exact pins move to their vertices.

    Args:
        pair: the shapes.
        scene: pins and strokes.
        earlier: the scene when the drag began.
        live: the map that followed the drag.
        missed: (k,) indices of the missed pins.
        aim: distance of soft pins from there, relative to their limits, in the direction in which they were dragged.
    """
    placed, map, vertices = pair.placed(scene).pins, live.map, live.exact_pins
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
            if _is_source_dragged(scene, earlier, k):
                ends = {"source": _file_place(pair.source, map.inverse(np.array([target - pull]))[0])}
            else:
                ends = {"target": _file_place(pair.target, target - away + pull)}
        pins[k] = pins[k].model_copy(update=ends)
    return scene.model_copy(update={"pins": pins})


def held_springs(live: Live | WarpedLive, dragged: Complex, stopped: Complex) -> dict[complex, float]:
    """Return the stiffness of springs that pull as strongly where pins stopped short, so that nothing gives way.

    Args:
        live: the map that followed the drag.
        dragged: (k, 2) pins that it missed.
        stopped: (k, 2) the same pins where they stopped.
    """
    map, springs = live.map, live.springs_in_force
    for pin, stopped_pin in zip(dragged, stopped):
        if live.is_soft(pin[0]):
            gap, stopped_gap = (np.abs(map(ends[:1])[0] - ends[1]) for ends in (pin, stopped_pin))
            least_gap = LEAST_GAP_LIMITS * live.limit(pin[0])
            springs[complex(stopped_pin[0])] = springs[complex(pin[0])] * gap / max(stopped_gap, least_gap)
    return springs


def _is_source_dragged(scene: Scene, earlier: Scene, number: int) -> bool:
    """Return whether only the source's end of a pin has been moved."""
    if len(earlier.pins) != len(scene.pins):
        return False
    old_pin, pin = earlier.pins[number], scene.pins[number]
    return old_pin.source != pin.source and old_pin.target == pin.target


def _file_place(shape: Shape, z: complex, digits: int = PLACE_DIGITS) -> tuple[float, float]:
    """Return a point of a shape in file coordinates, with so many digits relative to the shape's size."""
    decimals = digits - int(np.floor(np.log10(shape.curve.diagonal)))
    x, y = (round(value, decimals) for value in shape.to_file(z).tolist())
    return x, y
