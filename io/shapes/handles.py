"""Handles of a map: a lattice of pins where the map takes them, by which a finished map is edited.

The pins alone would not determine the map: between them it could be another one. They are therefore kept together with
the map itself, as the `start` of a constraints file. While no handle is moved, the map is the result as it is; when one
is moved, the map continues from there, and the other handles hold it in place, but may yield a little.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Complex, Flags
from ...balanced.constraints.validate import NEAR_OUTLINE_SHARE
from ...curve import Curve, inside_any
from ...errors import InputError
from ...pins import size_of
from ...result import Fit
from .listing import PinEntry
from .shape import Shape

TOLERANCE_SHARE = 0.01
"""Relative to the target's size (the square root of its area): distance by which a handle may yield to others that are
moved. Without any, a moved handle would leave a sharp bend between its neighbours."""
PIN_SPACING_SHARE = 0.25  # of the lattice's smaller spacing: handles closer to a pin are left out
DIGITS = 7  # significant digits of coordinates relative to the shape's diagonal
CURE = "ask for more rows and columns"


def lattice(box: tuple[complex, complex], rows: int, columns: int) -> tuple[list[str], Complex]:
    """Return the names and the points of a lattice: the middles of the cells of a box, row by row from the top."""
    low, high = box
    x = low.real + (high - low).real * (np.arange(columns) + 0.5) / columns
    y = high.imag - (high - low).imag * (np.arange(rows) + 0.5) / rows
    names = [f"r{row + 1}c{column + 1}" for row in range(rows) for column in range(columns)]
    return names, (x + 1j * y[:, None]).ravel()


def has_room(source: Shape, rows: int, columns: int) -> bool:
    """Return whether a point of a lattice lies inside a shape."""
    return bool(_is_inside([source.curve], lattice(source.curve.box, rows, columns)[1]).any())


def handles_of(
    fit: Fit, source: Shape, target: Shape, rows: int, columns: int, pins: list[PinEntry] | None = None
) -> list[PinEntry]:
    """Return handles where a map takes them, in file units.

    Points outside of the shape, in holes, close to an outline or close to a pin are left out.

    Args:
        fit: a map between the outlines of these shapes.
        source, target: plane shapes.
        rows: of the lattice on the source's bounding box.
        columns: as above.
        pins: those that the map has already.

    Raises:
        InputError: no point of the lattice is inside.
    """
    assert fit.target is not None
    names, z = lattice(fit.source.box, rows, columns)
    usable = _is_inside([fit.source, *fit.source_holes], z)
    w = np.full(z.shape, complex(np.nan, np.nan))
    w[usable] = fit.map(z[usable])
    usable &= np.isfinite(w)
    usable[usable] = _is_inside([fit.target, *fit.target_holes], w[usable])
    if pins:
        low, high = fit.source.box
        spacing = min((high - low).real / columns, (high - low).imag / rows)
        places = np.array([source.at(pin.source) for pin in pins])
        usable &= np.abs(z[:, None] - places).min(axis=1) > PIN_SPACING_SHARE * spacing
    if not usable.any():
        raise InputError(
            f"handles: none of the {rows}x{columns} points lies inside, away from outlines; {CURE}"
        )
    tolerance = TOLERANCE_SHARE * size_of(fit.target, fit.target_holes) / target.unit_at(w[usable][0])
    used_names = {pin.name for pin in pins or []}
    weight = pins[0].weight if pins else 1.0
    return [
        PinEntry(
            name=_unused(names[k], used_names),
            weight=weight,
            source=_place(source, z[k]),
            target=_place(target, w[k]),
            tolerance=float(f"{tolerance:.4g}"),
        )
        for k in np.flatnonzero(usable)
    ]


def _is_inside(outlines: list[Curve], points: Complex) -> Flags:
    """Return which points are inside the first outline, outside of the others, and not close to any."""
    outer, *holes = outlines
    inside = outer.contains(points) & ~inside_any(holes, points)
    for outline in outlines:
        inside &= outline.distances(points) >= NEAR_OUTLINE_SHARE * outer.diagonal
    return inside


def _unused(name: str, used_names: set[str]) -> str:
    while name in used_names:
        name += "'"
    return name


def _place(shape: Shape, point: complex) -> tuple[float, float]:
    digits = DIGITS - int(np.floor(np.log10(shape.curve.diagonal)))
    x, y = shape.to_file(np.array([point]))[0].tolist()
    return round(x, digits), round(y, digits)
