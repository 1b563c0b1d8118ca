"""Adapt an earlier map to outlines that moved, from one frame of a sequence to the next.

Each outline is matched with its earlier form by the dynamic programming of `search.initial_matches`, in which
positions have a larger weight (relative to their mean, and to the outline's size), since consecutive frames are
similar. The displacement of the outlines is extended to the inside as a harmonic function on the map's
triangles. The solver then removes folds.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..arrays import Complex, Index, Real
from ..curve import Curve
from ..maps.triangulated.map import NEAR_SHARE, TriangulatedMap
from .errors import NoMapError
from .minimise.untangle import harmonic
from .search.initial_matches import TANGENT_CHORD_SHARE, best_path, best_scores, step_gains

OUTLINE_SAMPLES = 256  # of each outline; four times as many as for two different shapes
POSITION_WEIGHT = 20.0
"""Weight of the difference of positions: a distance of a quarter of the radius of gyration counts as much as a
tangent reversed.
"""
MATCH_ROUNDS = 2  # matchings; the second uses the rotation of the first
SMOOTHED_LENGTH_SHARE = 0.02
"""Half the window over which a match is smoothed, relative to the length: five samples."""
FARTHER_FACTOR = 2.0
"""Ratio of matched distances to the distance of the outlines above which protrusions merged or separated. For
example, when two legs meet, the crotch moves to the feet by a leg's length, although the outlines are only a
gap's width apart.
"""
HOLES = "start: belongs to shapes with other holes; use a map of these shapes"


def carry_map(
    map: TriangulatedMap,
    source: Curve,
    target: Curve,
    holes: tuple[Sequence[Curve], Sequence[Curve]] = ((), ()),
) -> TriangulatedMap:
    """Move the outlines of a map onto present ones, in each plane where they differ. The map may fold.

    Args:
        map: an earlier map.
        source: present outline of the source.
        target: present outline of the target.
        holes: present holes of source and target.

    Raises:
        NoMapError: the map has other holes.
    """
    z = move_vertices(map.source, map.faces, map.loops, source, holes[0])
    u = move_vertices(map.image, map.faces, map.loops, target, holes[1])
    return map if z is map.source and u is map.image else replace(map, source=z, image=u, bulge=None)


def move_vertices(
    w: Complex, faces: Index, loops: Sequence[Index], outer: Curve, holes: Sequence[Curve]
) -> Complex:
    """Move vertices in a plane so that those of the loops are on the outlines, and the others between them.

    Args:
        w: (n,) vertices.
        faces: (m, 3) triangles.
        loops: vertices of each loop, the outer one first.
        outer: the outer outline.
        holes: outlines of holes.

    Returns:
        (n,) vertices; the same array if they are on these outlines already.
    """
    rims = [Curve(w[loop]) for loop in loops]
    tolerance = NEAR_SHARE * outer.diagonal  # also for holes, which are simplified relative to it
    if _is_on(rims[0].z, outer, tolerance) and (
        len(rims) != 1 + len(holes)
        or all(any(_is_on(rim.z, hole, tolerance) for hole in holes) for rim in rims[1:])
    ):
        return w
    goals = [outer, *_partners(rims[1:], holes)]
    shift, on_loop = np.zeros(w.size, complex), np.zeros(w.size, bool)
    for loop, rim, goal in zip(loops, rims, goals):
        shift[loop] = goal.at(match_outlines(rim, goal)) - rim.z
        on_loop[loop] = True
    return w + harmonic(w, faces, on_loop, shift)


def _is_on(z: Complex, curve: Curve, tolerance: float) -> bool:
    return bool(curve.distances(z).max() <= tolerance)


def _partners(rims: Sequence[Curve], holes: Sequence[Curve]) -> list[Curve]:
    """Return the hole nearest to each of a map's inner loops, each hole once."""
    remaining, partners = list(holes), list[Curve]()
    if len(rims) != len(remaining):
        raise NoMapError(HOLES)
    for rim in rims:
        nearest = min(remaining, key=lambda hole: abs(hole.z.mean() - rim.z.mean()))
        remaining.remove(nearest)
        partners.append(nearest if nearest.area * rim.area > 0 else nearest.reversed())
    return partners


def match_outlines(earlier: Curve, current: Curve) -> Real:
    """Return (n,) arclengths on an outline that correspond to the vertices of its earlier form, ascending."""
    shares = np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES
    source, target = (_samples(curve, shares * curve.length) for curve in (earlier, current))
    rotation = 1.0 + 0j
    for _ in range(MATCH_ROUNDS):
        i, j, rows, columns = _path(rotation * source, target)
        pairs = (rows[:-1] + i) % OUTLINE_SAMPLES, (columns[:-1] + j) % OUTLINE_SAMPLES
        rotation = np.exp(1j * np.angle(np.sum(source[1, pairs[0]].conj() * target[1, pairs[1]])))
    grid = np.arange(4 * OUTLINE_SAMPLES) / (4 * OUTLINE_SAMPLES)
    offsets = np.interp(grid, rows / OUTLINE_SAMPLES, columns / OUTLINE_SAMPLES) - grid
    width = int(SMOOTHED_LENGTH_SHARE * grid.size)
    window = np.hanning(2 * width + 1)
    around = sliding_window_view(np.concatenate([offsets[-width:], offsets, offsets[:width]]), window.size)
    offsets = (around * (window / window.sum())).sum(axis=1)
    s = np.mod(earlier.knots[:-1] / earlier.length - i / OUTLINE_SAMPLES, 1)
    share = s + np.interp(s, np.append(grid, 1), np.append(offsets, offsets[0]))
    return (share + j / OUTLINE_SAMPLES) * current.length


def is_reshaped(earlier: Curve, current: Curve) -> bool:
    """Return whether protrusions of an outline merged or separated, so that a map that follows it has to jump."""
    directions = ((earlier, current), (current, earlier))
    nearest = max(b.distances(a.z).max() for a, b in directions)
    matched = max(np.abs(b.at(match_outlines(a, b)) - a.z).max() for a, b in directions)
    return bool(matched > FARTHER_FACTOR * max(nearest, NEAR_SHARE * current.diagonal))


def _path(source: Complex, target: Complex) -> tuple[int, int, Index, Index]:
    """Match samples (2, OUTLINE_SAMPLES) of two outlines.

    Returns the first sample of the match on both sides, and its rows and columns, counted from there.
    """
    alignment = (source[0, :, None] * target[0].conj()).real  # cosines between tangents
    score = alignment - POSITION_WEIGHT * np.abs(source[1, :, None] - target[1]) ** 2
    i, j = divmod(int(score.argmax()), OUTLINE_SAMPLES)  # where they are most similar
    gains = step_gains(np.roll(score, (-i, -j), (0, 1)))[:, :, None, : OUTLINE_SAMPLES + 1]
    return i, j, *best_path(best_scores(gains)[:, 0], gains[:, :, 0])


def _samples(curve: Curve, s: Real) -> Complex:
    """Return (2, n) unit tangents, and midpoints of equal pieces that begin at s.

    The midpoints are relative to their mean, in units of the radius of gyration.
    """
    step, reach = curve.length / s.size, TANGENT_CHORD_SHARE * curve.length
    chord = curve.at(s + step + reach) - curve.at(s - reach)
    middles = 0.5 * (curve.at(s) + curve.at(s + step))
    middles -= middles.mean()
    return np.stack(
        [chord / np.maximum(np.abs(chord), 1e-300), middles / np.sqrt(np.mean(np.abs(middles) ** 2))]
    )
