"""Limit the number of crossings of lines, since the time of geometric operations grows with it."""

from collections.abc import Sequence

import numpy as np
import shapely

from ...arrays import Complex
from ...errors import InputError
from ...plane import cross
from .. import limits

FEW_SEGMENTS = 300  # segments: fewer cannot cross too often
NESTED = "too many subpaths are nested; split the path (Inkscape: Path > Break Apart)"
PAIRS_AT_ONCE = 200_000  # pairs that are tested at once
FIRST_SEGMENTS = 16  # segments that are tested first, before the density of neighbours is known


class TooMuch(InputError):
    """Lines that would take too much work."""


def check(lines: Sequence[Complex], *, reach: float = 0.0, before: int | None = None) -> int:
    """Refuse lines that cross each other or themselves too often, or have too many segments near each other.

    Args:
        lines: polylines; a closed one repeats its first point.
        reach: distance up to which two segments count as near.
        before: number of crossings that other lines of the same file have, which share the limit. If given, all lines
            are examined; otherwise lines with few segments, which cannot exceed it, are not.

    Returns:
        The number of crossings, with those before.

    Raises:
        TooMuch: there are too many; the message is a sentence.
    """
    _nested(lines)
    a = np.concatenate([*(z[:-1] for z in lines), np.empty(0, complex)])
    b = np.concatenate([*(z[1:] for z in lines), np.empty(0, complex)])
    if before is None and a.size <= FEW_SEGMENTS:
        return 0
    x, y = np.sort([a.real, b.real], axis=0), np.sort([a.imag, b.imag], axis=0)
    boxes = shapely.box(x[0], y[0], x[1] + reach, y[1] + reach)
    tree = shapely.STRtree(boxes)
    order = np.random.default_rng(0).permutation(a.size)
    crossing_pairs, near_pairs, start = before or 0, 0, 0
    step = FIRST_SEGMENTS
    while start < a.size:
        part = order[start : start + step]
        i, j = tree.query(boxes[part])
        i = part[i]
        crossing_pairs += int(_cross(a[i], b[i], a[j], b[j]).sum()) // 2
        near_pairs += i.size // 2
        start += step
        if crossing_pairs > limits.CROSSINGS or crossing_pairs * a.size > limits.WINDINGS:
            raise TooMuch(
                "lines cross each other too often; unite the shapes, or remove the crossings (Inkscape: Path > Union)"
            )
        if near_pairs > limits.NEAR_SEGMENTS:
            raise TooMuch("too many lines lie close together; simplify the path (Inkscape: Path > Simplify)")
        step = max(1, min(a.size, PAIRS_AT_ONCE * start // max(2 * near_pairs, 1)))
    return crossing_pairs


def _nested(lines: Sequence[Complex]) -> None:
    """Refuse lines whose bounding boxes overlap too often, since each such pair is tested for crossings."""
    if len(lines) ** 2 <= 2 * limits.NESTED_RUNS:
        return
    points, starts = np.concatenate(lines), np.cumsum([0, *(z.size for z in lines[:-1])])
    low_x, low_y = (np.minimum.reduceat(axis, starts) for axis in (points.real, points.imag))
    high_x, high_y = (np.maximum.reduceat(axis, starts) for axis in (points.real, points.imag))
    boxes = shapely.box(low_x, low_y, high_x, high_y)
    tree, pairs = shapely.STRtree(boxes), 0
    step = max(1, limits.NESTED_RUNS // len(lines))
    for start in range(0, len(lines), step):
        pairs += tree.query(boxes[start : start + step]).shape[1]
        if pairs > 2 * limits.NESTED_RUNS:
            raise TooMuch(NESTED)


def _cross(a: Complex, b: Complex, c: Complex, d: Complex) -> np.ndarray:
    """Mark pairs of segments ab and cd that cross properly, not at a common end."""

    def side(p: Complex, q: Complex, r: Complex) -> np.ndarray:
        return np.sign(cross(q - p, r - p))

    return (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
