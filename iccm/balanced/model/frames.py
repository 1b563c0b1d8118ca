"""Unit coordinates in which a problem looks the same however its shapes were given.

Translation, scale, first vertex and handedness are removed (rotation too where the turn is left to the shapes), and
what rounding leaves of them: coordinates are put on a grid of 2⁻³⁶, so that the same problem gives the same bits.
"""

from collections.abc import Sequence

import numpy as np

from ...arrays import Complex, Real
from ...curve import Curve
from ...plane import Similarity, cross

Holes = tuple[Sequence[Curve], Sequence[Curve]]

GRID = 2.0**-36  # 1.5e-11 of the root of the area: far above rounding, far below every tolerance
UNDECIDED = 1e-6  # below this a shape's handedness is rounding


def frame_of(curve: Curve, holes: Sequence[Curve] = ()) -> Similarity:
    """Return the similarity that takes a domain's centroid to 0 and its area to 1, without a rotation.

    Args:
        curve: outline of the domain.
        holes: outlines of its holes, clockwise.
    """
    first = curve.z[0]
    moment = sum(_moment(each.z - first) for each in (curve, *holes))
    area = sum(each.area for each in (curve, *holes))
    return Similarity(complex(1 / np.sqrt(abs(area))), centre=first + complex(moment / (6 * area)))


def on_grid(frame: Similarity, z: Complex) -> Complex:
    """Return points in unit coordinates, rounded to their grid."""
    return np.round(frame(z) / GRID) * GRID


def unit_curve(frame: Similarity, curve: Curve) -> Curve:
    """Return a curve on the grid of unit coordinates, from its farthest vertex on; its direction is kept in a mirror,
    too."""
    return Curve(begun_farthest(on_grid(frame, curve.z[::-1] if frame.mirrored else curve.z)))


def unit_ring(frame: Similarity, ring: Complex) -> Complex:
    """Return a polygon in unit coordinates; its direction is kept in a mirror, too."""
    w = frame(ring)
    return w[::-1].copy() if frame.mirrored else w


def begun_farthest(w: Complex) -> Complex:
    """Return a polygon's vertices from the one farthest from 0 on; of several the rightmost, and highest."""
    distance = np.round(np.abs(w), 9)
    ties = np.flatnonzero(distance == distance.max())
    first = ties[np.lexsort((w[ties].imag, w[ties].real))[-1]]
    return np.roll(w, -first)


def frames_of(
    source: Curve, target: Curve, turn: float | None, holes: Holes = ((), ())
) -> tuple[Similarity, Similarity]:
    """Return the frames in which a map without turn is the upright one, or with `turn` None in which both shapes lie in
    a separate way; `holes` are those of both.
    """
    frames = [frame_of(curve, inner) for curve, inner in zip((source, target), holes)]
    if turn is None:
        frames = [f.rotated(-_farthest_angle(f, c)) for f, c in zip(frames, (source, target))]
    else:
        frames[0] = frames[0].rotated(turn)
    loops = [[c.z, *(hole.z for hole in inner)] for c, inner in zip((source, target), holes)]
    signs = [handedness(*(frame(z) for z in each)) for frame, each in zip(frames, loops)]
    sign = next((s for s in signs if abs(s) > UNDECIDED), 1.0)
    frames = [f._replace(mirrored=sign < 0) for f in frames]
    if turn is not None and _upside_down(*(frames[0](z) for z in loops[0])):
        frames = [f.rotated(np.pi) for f in frames]
    return frames[0], frames[1]


def _moment(w: Complex) -> complex:
    """Six times the integral of w over what a closed polyline surrounds."""
    ahead = np.roll(w, -1)
    return np.sum(cross(w, ahead) * (w + ahead))


def _upside_down(*loops: Complex) -> bool:
    """Return whether most of closed polylines' weight hangs low: mirrors about different lines differ by half a
    turn.
    """
    middles, weights = _middles(*loops)
    heavy = complex(np.sum(weights * middles * np.abs(middles) ** 2))
    return heavy.imag < 0 if abs(heavy.imag) > UNDECIDED else heavy.real < -UNDECIDED


def _farthest_angle(frame: Similarity, curve: Curve) -> float:
    w = frame(curve.z)
    distance = np.round(np.abs(w), 9)
    return float(np.angle(w[np.argmax(distance)]))


def handedness(*loops: Complex) -> float:
    """Return a number of closed polylines about their centroid that changes sign in every mirror and with no
    rotation.
    """
    middles, weights = _middles(*loops)
    first = np.sum(weights * middles * np.abs(middles) ** 2)
    second = np.sum(weights * middles**2)
    third = np.sum(weights * middles**3)
    return float((first**2 * second.conj()).imag + (first * second * third.conj()).imag)


def _middles(*loops: Complex) -> tuple[Complex, Real]:
    """Middles of the edges, and their shares of the length."""
    w, steps = np.concatenate(loops), np.concatenate([np.roll(z, -1) - z for z in loops])
    return w + 0.5 * steps, np.abs(steps) / np.sum(np.abs(steps))
