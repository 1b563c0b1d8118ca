"""Unit coordinates in which a problem looks the same however its shapes were given.

Translation, scale, first vertex and handedness are removed (rotation too where the turn is left to the shapes), and
what rounding leaves of them: coordinates are put on a grid of 2⁻³⁶, so that the same problem gives the same bits.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Complex, Real
from ...curve import Curve
from ...plane import cross

Holes = tuple[Sequence[Curve], Sequence[Curve]]

GRID = 2.0**-36  # 1.5e-11 of the root of the area: far above rounding, far below every tolerance
UNDECIDED = 1e-6  # below this a shape's handedness is rounding


@dataclass(frozen=True)
class UnitFrame:
    """The similarity, with a mirror if `mirrored`, from the given plane to unit coordinates.

    Attributes:
        centre: the point that becomes 0.
        factor: by which differences from it are multiplied.
        mirrored: whether the result is conjugated.
    """

    centre: complex
    factor: complex
    mirrored: bool = False

    @classmethod
    def of(cls, curve: Curve, holes: Sequence[Curve] = ()) -> "UnitFrame":
        """Centroid to 0, area to 1, not turned; of the domain without its holes, whose outlines run clockwise."""
        first = curve.z[0]
        moment = sum(_moment(each.z - first) for each in (curve, *holes))
        area = sum(each.area for each in (curve, *holes))
        return cls(first + complex(moment / (6 * area)), complex(1 / np.sqrt(abs(area))))

    def turned(self, angle: float) -> "UnitFrame":
        """The frame turned counter-clockwise by radians."""
        return replace(self, factor=self.factor * complex(np.exp(1j * angle)))

    def unit(self, z: Complex) -> Complex:
        """Points in unit coordinates."""
        w = (z - self.centre) * self.factor
        return w.conj() if self.mirrored else w

    def world(self, w: Complex) -> Complex:
        """Points of unit coordinates back in the given plane."""
        return (w.conj() if self.mirrored else w) / self.factor + self.centre

    def unit_ring(self, ring: Complex) -> Complex:
        """A polygon in unit coordinates, turning as before in a mirror too."""
        w = self.unit(ring)
        return w[::-1].copy() if self.mirrored else w

    def curve(self, curve: Curve) -> Curve:
        """The curve on the grid of unit coordinates, from its farthest vertex on, turning as before in a mirror too."""
        w = self.unit(curve.z)
        w = np.round((w[::-1] if self.mirrored else w) / GRID) * GRID
        return Curve(begun_farthest(w))


def begun_farthest(w: Complex) -> Complex:
    """A polygon's vertices from the one farthest from 0 on; of several the rightmost, and highest."""
    distance = np.round(np.abs(w), 9)
    ties = np.flatnonzero(distance == distance.max())
    first = ties[np.lexsort((w[ties].imag, w[ties].real))[-1]]
    return np.roll(w, -first)


def frames_of(
    source: Curve, target: Curve, turn: float | None, holes: Holes = ((), ())
) -> tuple[UnitFrame, UnitFrame]:
    """The frames in which a map without turn is the upright one, or with `turn` None in which both shapes lie in a
    way of their own; `holes` are those of both."""
    frames = [UnitFrame.of(curve, inner) for curve, inner in zip((source, target), holes)]
    if turn is None:
        frames = [f.turned(-_farthest_angle(f, c)) for f, c in zip(frames, (source, target))]
    else:
        frames[0] = frames[0].turned(turn)
    loops = [[c.z, *(hole.z for hole in inner)] for c, inner in zip((source, target), holes)]
    signs = [handedness(*map(f.unit, each)) for f, each in zip(frames, loops)]
    sign = next((s for s in signs if abs(s) > UNDECIDED), 1.0)
    frames = [replace(f, mirrored=sign < 0) for f in frames]
    if turn is not None and _upside_down(*map(frames[0].unit, loops[0])):
        frames = [f.turned(np.pi) for f in frames]
    return frames[0], frames[1]


def _moment(w: Complex) -> complex:
    """Six times the integral of w over what a closed polyline surrounds."""
    ahead = np.roll(w, -1)
    return np.sum(cross(w, ahead) * (w + ahead))


def _upside_down(*loops: Complex) -> bool:
    """Whether most of closed polylines' weight hangs low: mirrors about different lines differ by half a turn."""
    middles, weights = _middles(*loops)
    heavy = complex(np.sum(weights * middles * np.abs(middles) ** 2))
    return heavy.imag < 0 if abs(heavy.imag) > UNDECIDED else heavy.real < -UNDECIDED


def _farthest_angle(frame: UnitFrame, curve: Curve) -> float:
    w = frame.unit(curve.z)
    distance = np.round(np.abs(w), 9)
    return float(np.angle(w[np.argmax(distance)]))


def handedness(*loops: Complex) -> float:
    """A number of closed polylines about their centroid that changes sign in every mirror and with no rotation."""
    middles, weights = _middles(*loops)
    first = np.sum(weights * middles * np.abs(middles) ** 2)
    second = np.sum(weights * middles**2)
    third = np.sum(weights * middles**3)
    return float((first**2 * second.conj()).imag + (first * second * third.conj()).imag)


def _middles(*loops: Complex) -> tuple[Complex, Real]:
    """Middles of the edges, and their shares of the length."""
    w, steps = np.concatenate(loops), np.concatenate([np.roll(z, -1) - z for z in loops])
    return w + 0.5 * steps, np.abs(steps) / np.sum(np.abs(steps))
