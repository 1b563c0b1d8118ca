"""Unit coordinates, in which a problem has the same numbers however its shapes were given.

Translation, scale, first vertex and handedness are removed, and rotation too if it is left to the shapes.
Coordinates are rounded to a grid of 2⁻³⁶, which also removes rounding errors: equal problems get equal bits.
"""

from collections.abc import Sequence

import numpy as np

from ...arrays import Complex, Real
from ...curve import Curve
from ...plane import Similarity, cross

Holes = tuple[Sequence[Curve], Sequence[Curve]]

GRID = 2.0**-36  # 1.5e-11 relative to the root of the area: far above rounding, far below every tolerance
UNDECIDED = 1e-6  # below this, the sign of a shape's handedness is due to rounding


def unit_similarity(curve: Curve, holes: Sequence[Curve] = ()) -> Similarity:
    """Return the similarity that moves a domain's centroid to 0 and scales its area to 1, without a rotation.

    Args:
        curve: outline of the domain.
        holes: outlines of its holes, clockwise.
    """
    first = curve.z[0]
    moment = sum(_moment(outline.z - first) for outline in (curve, *holes))
    area = sum(outline.area for outline in (curve, *holes))
    return Similarity(complex(1 / np.sqrt(abs(area))), centre=first + complex(moment / (6 * area)))


def round_to_unit_grid(similarity: Similarity, z: Complex) -> Complex:
    """Return points in unit coordinates, rounded to the grid."""
    return np.round(similarity(z) / GRID) * GRID


def unit_curve(similarity: Similarity, curve: Curve) -> Curve:
    """Return a curve on the grid of unit coordinates, starting at its farthest vertex.

    Its orientation is kept even if the similarity mirrors it.
    """
    return Curve(
        begun_farthest(round_to_unit_grid(similarity, curve.z[::-1] if similarity.mirrored else curve.z))
    )


def unit_ring(similarity: Similarity, ring: Complex) -> Complex:
    """Return a polygon in unit coordinates. Its orientation is kept even if the similarity mirrors it."""
    w = similarity(ring)
    return w[::-1].copy() if similarity.mirrored else w


def begun_farthest(w: Complex) -> Complex:
    """Return a polygon's vertices starting at the one farthest from 0.

    Ties go to the rightmost, then the highest vertex.
    """
    distance = np.round(np.abs(w), 9)
    ties = np.flatnonzero(distance == distance.max())
    first = ties[np.lexsort((w[ties].imag, w[ties].real))[-1]]
    return np.roll(w, -first)


def unit_similarities(
    source: Curve, target: Curve, rotation: float | None, holes: Holes = ((), ())
) -> tuple[Similarity, Similarity]:
    """Return the similarities of source and target to unit coordinates in which the desired map has no rotation.

    Args:
        source: outline of the source.
        target: outline of the target.
        rotation: desired rotation in radians. If None, each shape is rotated so that its farthest vertex lies on
            the positive real axis.
        holes: of source and target.
    """
    to_unit = [unit_similarity(curve, inner) for curve, inner in zip((source, target), holes)]
    if rotation is None:
        to_unit = [f.rotated(-_farthest_angle(f, c)) for f, c in zip(to_unit, (source, target))]
    else:
        to_unit[0] = to_unit[0].rotated(rotation)
    loops = [[c.z, *(hole.z for hole in inner)] for c, inner in zip((source, target), holes)]
    signs = [handedness(*(similarity(z) for z in rings)) for similarity, rings in zip(to_unit, loops)]
    sign = next((s for s in signs if abs(s) > UNDECIDED), 1.0)
    to_unit = [f._replace(mirrored=sign < 0) for f in to_unit]
    if rotation is not None and _upside_down(*(to_unit[0](z) for z in loops[0])):
        to_unit = [f.rotated(np.pi) for f in to_unit]
    return to_unit[0], to_unit[1]


def _moment(w: Complex) -> complex:
    """Return six times the integral of w over the inside of a closed polyline."""
    ahead = np.roll(w, -1)
    return np.sum(cross(w, ahead) * (w + ahead))


def _upside_down(*loops: Complex) -> bool:
    """Return whether most of the closed polylines' weight lies below the centroid.

    Shapes mirrored about different axes differ by a rotation. Unit coordinates are mirrored about one axis, which can
    leave a rotation by 180°; this detects it.
    """
    middles, weights = _middles(*loops)
    heavy = complex(np.sum(weights * middles * np.abs(middles) ** 2))
    return heavy.imag < 0 if abs(heavy.imag) > UNDECIDED else heavy.real < -UNDECIDED


def _farthest_angle(similarity: Similarity, curve: Curve) -> float:
    w = similarity(curve.z)
    distance = np.round(np.abs(w), 9)
    return float(np.angle(w[np.argmax(distance)]))


def handedness(*loops: Complex) -> float:
    """Return a number that changes its sign when closed polylines are mirrored, and is invariant under rotation.

    Coordinates have to be relative to the centroid.
    """
    middles, weights = _middles(*loops)
    first = np.sum(weights * middles * np.abs(middles) ** 2)
    second = np.sum(weights * middles**2)
    third = np.sum(weights * middles**3)
    return float((first**2 * second.conj()).imag + (first * second * third.conj()).imag)


def _middles(*loops: Complex) -> tuple[Complex, Real]:
    """Return the midpoints of the edges, and their shares of the total length."""
    w, steps = np.concatenate(loops), np.concatenate([np.roll(z, -1) - z for z in loops])
    return w + 0.5 * steps, np.abs(steps) / np.sum(np.abs(steps))
