"""Pair the shapes that two files draw: by name, else by place and area."""

import re
from collections.abc import Sequence

import numpy as np

from ...arrays import Complex, Real, complex_of, xy_of
from ...drawings.pairing import pair_by_cost
from .shape import Shape

NAME_GAIN = 100.0  # reduction of a pair's cost for each common name, which outweighs place and size
LEAST_COMMON_NAMES_SHARE = 1 / 3
"""Of the named elements of the drawing with fewer of them: maps of India and Canada share two of 13 ids, the provinces
`nl` and `sk`, by accident."""
LEAST_ARRANGED_SHARE = 0.5
"""Of the variance of positions in the target: mirror images of four corners share none, poses of a figure most."""
# Names that drawing programs assign automatically.
UNNAMED = re.compile(
    r"(path|rect|circle|ellipse|line|poly(gon|line)|g|group|layer|svg|use|shape|XMLID|SVGID)?[\W\d_]*", re.I
)


def pair(sources: Sequence[Shape], targets: Sequence[Shape], turn: float = 0.0) -> list[tuple[int, int]]:
    """Return pairs of indices with the least total cost, as many as the side with fewer shapes has.

    Args:
        sources, targets: the shapes of two drawings.
        turn: rotation of the source in degrees, counter-clockwise.
    """
    spatial = all(shape.is_mesh for shape in (sources[0], targets[0]))
    positions, size = _fit_to_unit(sources, spatial)
    aims, large = _fit_to_unit(targets, spatial)
    positions[:, :2] = xy_of(complex_of(positions[:, :2]) * np.exp(1j * np.radians(turn)))
    names = [[words_of(shape.names) for shape in shapes] for shapes in (sources, targets)]
    shared = np.array([[len(a & b) for b in names[1]] for a in names[0]])
    return pair_by_cost((positions, aims), (size, large), NAME_GAIN * shared)


def _fit_to_unit(shapes: Sequence[Shape], spatial: bool) -> tuple[Real, Real]:
    """Return centroids (k, 3) relative to the middle of all, in half diagonals, and shares of the area (k,)."""
    middles, lows, highs = (np.array(values) for values in zip(*(shape.spread(spatial) for shape in shapes)))
    low, high = lows.min(axis=0), highs.max(axis=0)
    areas = np.array([shape.curve.area for shape in shapes])
    return (middles - (low + high) / 2) / (np.linalg.norm(high - low) / 2), areas / areas.sum()


def namesakes(source: Shape, target: Shape) -> tuple[list[str], Complex, Real]:
    """Find the elements that have the same name in both drawings.

    Names that drawings share by accident do not count: nothing is returned if fewer than `LEAST_COMMON_NAMES_SHARE` of
    the names are common, or the elements are arranged differently.

    Returns
    -------
    names
        (k,) the names.
    places
        (k, 2) positions of the elements in both drawings.
    radii
        (k,) radii of circles with the area of the target's elements.
    """
    sides = [
        {name.casefold(): place for name, place in shape.elements.items() if words_of([name])}
        for shape in (source, target)
    ]
    names = [name for name in sides[0] if name in sides[1]]
    if len(names) < LEAST_COMMON_NAMES_SHARE * min(map(len, sides)):
        names = []
    places = np.array([[side[name][0] for side in sides] for name in names], dtype=complex).reshape(-1, 2)
    if not _are_arranged_alike(places):
        names, places = [], places[:0]
    return names, places, np.array([sides[1][name][1] for name in names])


def _are_arranged_alike(places: Complex) -> bool:
    """Return whether a similarity explains `LEAST_ARRANGED_SHARE` of the variance of the second positions.

    It always does for up to two positions.
    """
    if len(places) <= 2:
        return True
    start, end = (places - places.mean(axis=0)).T
    variances = (np.abs(start) ** 2).sum() * (np.abs(end) ** 2).sum()
    return bool(np.abs(np.vdot(start, end)) ** 2 >= LEAST_ARRANGED_SHARE * variances)


def words_of(names: Sequence[str]) -> set[str]:
    """Return the names that a person gave, not a drawing program."""
    return {name.casefold() for name in names if not UNNAMED.fullmatch(name)}
