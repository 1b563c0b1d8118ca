"""Places on the other side, suggested pins, and handles: what the page asks about the map that is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...curve import Curve
from ...errors import InputError
from ...maps.joined import images
from .. import limits
from ..point_syntax import Place
from ..run.constraints import check_inside
from ..shapes.handles import handles_of
from .messages import Scene
from .pair import PLACE_DIGITS
from .session import Session
from .suggest import suggested

ON_OUTLINE_SHARE = 2e-3
"""Relative to the diagonal: points this close to an outline are carried to the other outline. Twice the tolerance of
pins.
"""
NO_MAP = "there is no map yet"


def transfer(session: Session, side: str, points: Sequence[Place]) -> list[list[float]]:
    """Carry points of one side, in file coordinates, to the other; points on the outline stay on it.

    Raises:
        InputError: a point is outside its shape, or there is no map yet.
    """
    maps, pair = session.maps, session.pair
    if not maps:
        raise InputError(NO_MAP)
    from_source = side == "source"
    shape, destination = (pair.source, pair.target) if from_source else (pair.target, pair.source)
    z = np.array([shape.at(point) for point in points])
    # the target of a deformation is the moved shape, whose outline is not that of the file
    is_moved = pair.deforming and not from_source
    if not is_moved:
        check_inside(shape, "point", list(z))
    if not is_moved and pair.job.holed and any(Curve(hole).contains(z).any() for hole in shape.holes):
        raise InputError(
            "this point is in a hole; place the pin next to it, then drag both ends into the holes to be paired"
        )
    w = images([map if from_source else map.inverse for map in maps], z)
    if not np.isfinite(w).all():
        raise InputError("this point is not part of the map; place the pin elsewhere")
    if not pair.deforming:
        outline, image = _outlines(session, from_source=from_source)
        on_outline = outline.distances(z) < ON_OUTLINE_SHARE * shape.curve.diagonal
        on_outline &= (
            len(maps) == 1
        )  # else each part has its own outline, which need not be that of the shape
        w[on_outline] = image.nearest(w[on_outline])
        is_hidden = ~destination.curve.contains(w) & (
            destination.curve.distances(w) > ON_OUTLINE_SHARE * destination.curve.diagonal
        )
        if is_hidden.any():
            raise InputError(
                "the map takes this point outside the other shape, where it is not seen; place the pin elsewhere, "
                "or both of its ends"
            )
    if surface := session.view.surfaces[1 if from_source else 0]:
        return surface.places(w, PLACE_DIGITS)
    decimals = PLACE_DIGITS - int(np.floor(np.log10(destination.curve.diagonal)))
    return [[round(value, decimals) for value in place] for place in destination.to_file(w).tolist()]


def _outlines(session: Session, *, from_source: bool) -> tuple[Curve, Curve]:
    """Return the outlines that are mapped onto each other: those of frames, where drawings are mapped by frames."""
    pair, fit = session.pair, session.fit
    outlines = pair.source.curve, pair.target.curve
    if fit is not None and fit.target is not None and len(session.maps) == 1 and not pair.has_mesh:
        outlines = fit.source, fit.target
    return outlines if from_source else outlines[::-1]


def suggest(session: Session, scene: Scene) -> list[dict[str, Any]]:
    """Return pins that both drawings suggest in addition to those of a scene.

    Raises:
        InputError: there is no map yet.
    """
    pair = session.pair
    if not session.maps:
        raise InputError(NO_MAP)
    if pair.deforming:
        return []
    pins = suggested(session.maps[0], pair.source, pair.target, pair.placed(scene).pins)
    return [pin.model_dump(mode="json") for pin in pins]


def handles(session: Session, scene: Scene, rows: int, columns: int) -> list[dict[str, Any]]:
    """Return pins in rows and columns on the source where the map takes them, in addition to those of a scene.

    Raises:
        InputError: the picture would change, there is no map yet, or there would be too many pins.
    """
    pair, fit = session.pair, session.fit
    if fit is None or not session.maps:
        raise InputError(NO_MAP)
    if pair.deforming or pair.has_mesh:
        raise InputError("handles are for maps from one planar shape to another")
    if scene.strokes or scene.rigid:
        raise InputError("handles do not work with strokes and rigid regions; remove those first")
    if not session.is_whole or fit.coverage.is_partial:
        raise InputError(
            "parts of the shapes are hidden or bare in this map, which handles would change; choose Whole "
            "outlines under Fit first"
        )
    if len(scene.pins) + rows * columns > limits.PAGE_PINS:
        raise InputError(f"at most {limits.PAGE_PINS} pins are possible; choose fewer rows and columns")
    seen_fit = replace(fit, map=session.maps[0])
    pins = handles_of(seen_fit, pair.source, pair.target, rows, columns, scene.pins)
    return [pin.model_dump(mode="json") for pin in pins]
