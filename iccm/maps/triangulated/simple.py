"""Test by exact signs whether loops bound a region: simple, disjoint, and all holes inside the outer one."""

import numpy as np
import shapely
from numpy.typing import NDArray

from ...arrays import Complex, xy_of
from ...plane import orientation


def fault(loops: list[Complex]) -> str:
    """Return why loops, the outer one first, do not bound a region on their left; an empty string if they do.

    Args:
        loops: (k,) finite vertices of each.
    """
    if any(loop.size < 3 for loop in loops) or _touching(loops):
        return "crosses or touches itself"
    if _turn(loops[0]) <= 0 or any(_turn(hole) >= 0 for hole in loops[1:]):
        return "has the wrong orientation"
    for i, hole in enumerate(loops[1:], 1):
        around = [_surrounds(loop, hole[0]) for k, loop in enumerate(loops) if k != i]
        if not around[0] or any(around[1:]):
            return "has a hole outside it or inside another hole"
    return ""


def _touching(loops: list[Complex]) -> bool:
    """Return whether two edges that are not consecutive meet, or one has no length.

    An edge that folds back on its predecessor meets others, too, or forms a triangle without area.
    """
    a = np.concatenate(loops)
    after = np.concatenate([np.roll(loop, -1) for loop in loops])
    first = np.repeat(np.cumsum([0, *(loop.size for loop in loops[:-1])]), [loop.size for loop in loops])
    size = np.repeat([loop.size for loop in loops], [loop.size for loop in loops])
    following = first + (np.arange(a.size) - first + 1) % size
    if np.any(a == after):
        return True
    i, j = _near(a, after)
    apart = (following[i] != j) & (following[j] != i)
    i, j = i[apart], j[apart]
    return bool(np.any(_meeting(a[i], after[i], a[j], after[j])))


def _near(a: Complex, b: Complex) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return pairs i < j of segments whose bounding boxes meet."""
    ends = np.stack([a, b], axis=1)
    segments = shapely.linestrings(xy_of(ends))
    i, j = shapely.STRtree(segments).query(segments)
    return i[i < j], j[i < j]


def _meeting(a: Complex, b: Complex, c: Complex, d: Complex) -> NDArray[np.bool_]:
    """Return whether segments ab and cd whose bounding boxes meet have a point in common."""
    across = orientation(a, b, c) * orientation(a, b, d) <= 0
    out = np.zeros(a.size, bool)
    k = np.flatnonzero(across)
    out[k] = orientation(c[k], d[k], a[k]) * orientation(c[k], d[k], b[k]) <= 0
    return out


def _turn(loop: Complex) -> int:
    """Return 1 for a counter-clockwise simple loop, -1 for a clockwise one.

    The turn at its leftmost lowest vertex decides.
    """
    k = int(np.lexsort([loop.imag, loop.real])[0])
    neighbours = np.arange(k - 1, k + 2) % loop.size
    return int(orientation(*(loop[neighbours[n : n + 1]] for n in range(3)))[0])


def _surrounds(loop: Complex, point: complex) -> bool:
    """Return whether a point that is not on a simple loop is inside.

    Edges that cross the ray to its right are counted.
    """
    a, b = loop, np.roll(loop, -1)
    crossing = (a.imag <= point.imag) != (b.imag <= point.imag)
    a, b = a[crossing], b[crossing]
    up = np.where(b.imag > a.imag, 1, -1)
    return bool(np.sum(orientation(a, b, np.full(a.size, point)) == up) % 2)
