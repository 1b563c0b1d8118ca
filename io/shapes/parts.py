"""Pairs of the shapes that two files draw: by name, else by place and area."""

import re
from collections.abc import Sequence

import numpy as np

from ...arrays import Complex, Real, complex_of, xy_of
from ...drawings.pairing import pair_by_cost
from .shape import Shape

NAMED = 100.0  # taken off a pair's cost for each name that both have: it outweighs place and size
# What drawing programs call things that nobody named.
UNNAMED = re.compile(
    r"(path|rect|circle|ellipse|line|poly(gon|line)|g|group|layer|svg|use|shape|XMLID|SVGID)?[\W\d_]*", re.I
)


def pair(sources: Sequence[Shape], targets: Sequence[Shape], turn: float = 0.0) -> list[tuple[int, int]]:
    """Pairs of indices, as many as there are of the fewer shapes: those that cost the least together.

    Args:
        sources, targets: the shapes of two drawings.
        turn: degrees counter-clockwise by which the source is turned.
    """
    spatial = all(shape.is_mesh for shape in (sources[0], targets[0]))
    placed, size = _fit_to_unit(sources, spatial)
    aims, large = _fit_to_unit(targets, spatial)
    placed[:, :2] = xy_of(complex_of(placed[:, :2]) * np.exp(1j * np.radians(turn)))
    names = [[words_of(shape.names) for shape in shapes] for shapes in (sources, targets)]
    shared = np.array([[len(a & b) for b in names[1]] for a in names[0]])
    return pair_by_cost((placed, aims), (size, large), NAMED * shared)


def _fit_to_unit(shapes: Sequence[Shape], spatial: bool) -> tuple[Real, Real]:
    """Centroids (k, 3) about the middle of them all in half diagonals, and areas relative to their sum."""
    middles, lows, highs = (np.array(each) for each in zip(*(shape.spread(spatial) for shape in shapes)))
    low, high = lows.min(axis=0), highs.max(axis=0)
    areas = np.array([shape.curve.area for shape in shapes])
    return (middles - (low + high) / 2) / (np.linalg.norm(high - low) / 2), areas / areas.sum()


def namesakes(source: Shape, target: Shape) -> tuple[list[str], Complex, Real]:
    """What both drawings show inside under one name: the names, where they are drawn in both (k, 2), and the radii of
    circles as large as the target's (k,)."""
    sides = [
        {name.casefold(): place for name, place in shape.elements.items() if words_of([name])}
        for shape in (source, target)
    ]
    names = [name for name in sides[0] if name in sides[1]]
    places = np.array([[side[name][0] for side in sides] for name in names], dtype=complex).reshape(-1, 2)
    return names, places, np.array([sides[1][name][1] for name in names])


def words_of(names: Sequence[str]) -> set[str]:
    """The names that somebody gave, not the drawing program."""
    return {name.casefold() for name in names if not UNNAMED.fullmatch(name)}
