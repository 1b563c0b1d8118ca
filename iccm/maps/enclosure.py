"""Bounds on harmonic maps between samples: enclosures of the derivatives and of the image of a curve, piece by piece.

With φ linear on every edge, Φ' has logarithms, but Φ″ is rational,

    Φ″(z) = 1/(2πi) Σ_j ρ_j / ((z_j - z) (z_{j+1} - z)),   ρ_j = φ_{j+1} - φ_j - Φ'(m) (z_{j+1} - z_j):

the linear function of slope Φ'(m), m being any point, has no second derivative. On a piece of a curve with
midpoint m and half its length r < |z_j - m| for all j, with D_j = |z_j - m| - r,

    |Φ'(z) - Φ'(m)| ≤ r |Φ″(m)| + r² R/2,   |Φ″(z)| ≤ |Φ″(m)| + r R,
    R = 1/(2π) Σ_j |ρ_j| (D_j + D_{j+1}) / (D_j D_{j+1})²,

and the same for conj Ψ. So the bounds hold between samples, too; pieces are halved until they are sharp enough.
Rounding errors are taken into account by bounds of their size (`ROUNDING_SHARE`), which are estimates.
"""

from dataclasses import dataclass, fields

import numpy as np
import shapely

from ..arrays import Complex, Index, Real, xy_of
from ..native import function
from ..parallel import over_slices
from .harmonic import HarmonicMap

MOST_DISTANCE_RATIO = 0.5  # largest half length of a piece, relative to its distance from the nearest vertex
MOST_TANGENT_RADIUS = 0.5
"""Largest radius of the disc that contains the tangents of a piece's image, relative to its centre."""
ROUNDING_SHARE = 1e-13  # relative to the sum of absolute values in the map or its derivatives
MOST_PIECES = 30_000  # a map that needs more pieces is not certified
HALVING_ROUNDS = 50  # of halving pieces: digits end before
SLICE_PIECES = 256  # pieces that a thread takes at a time: milliseconds of work

_bounds = function(
    """int64_t iccm_maps_enclosure(
        const Complex *polygon, const Complex *edge, int64_t n, const Complex *rise, int64_t densities,
        const Complex *middle, const double *half, const Complex *slope, int64_t start, int64_t stop, int64_t p,
        double *out)"""
)


@dataclass(frozen=True, eq=False)
class CurvePieces:
    """Closed curves in pieces, each a straight segment from its `start` to that of the next piece.

    Attributes:
        start: (k,) points, the rings one after the other.
        ring: (k,) number of the ring to which a piece belongs.
        image: (k,) f at the starts.
        slope: (k,) f_z at the starts.
        tangent: (k,) derivative of f along the piece, at its midpoint.
        jacobian: (k,) |f_z| - |f_z̄| there.
        quotient: (k,) |f_z̄ / f_z| there.
        spread: (k,) upper bound on the distance of the tangent from that at the midpoint; inf if unknown.
        bulge: (k,) upper bound on the distance of the image from the chord between its ends.
    """

    start: Complex
    ring: Index
    image: Complex
    slope: Complex
    tangent: Complex
    jacobian: Real
    quotient: Real
    spread: Real
    bulge: Real

    @property
    def following(self) -> Index:
        """The next piece; shape (k,)."""
        return _following(self.ring)

    @property
    def loose(self) -> np.ndarray:
        """Whether the bounds leave open if the map is injective and preserves orientation on a piece; shape (k,)."""
        return ~(self.spread <= MOST_TANGENT_RADIUS * self.jacobian)

    @property
    def half_angle(self) -> Real:
        """Upper bound on half the angle of the cone that contains the tangents; shape (k,).

        It is valid for pieces that are not loose.
        """
        return np.arcsin(np.minimum(self.spread / np.abs(self.tangent), 1.0))

    @property
    def zeros(self) -> Index:
        """(rings,) winding number of f_z along each ring, the number of its zeros inside.

        It is exact if no piece is loose.
        """
        turn = np.angle(self.slope[self.following] * self.slope.conj())
        return np.rint(np.bincount(self.ring, turn) / (2 * np.pi)).astype(int)

    def rings(self) -> list[Complex]:
        """Return the images of the starts, ring by ring."""
        return np.split(self.image, np.flatnonzero(np.diff(self.ring)) + 1)


class Encloser:
    """A map prepared for bounds."""

    def __init__(self, f: HarmonicMap):
        """Prepare the map's arrays and a search tree of its vertices."""
        from scipy.spatial import cKDTree

        self.f = f
        self.vertices = cKDTree(xy_of(f.polygon))
        image = f(f.polygon)
        self.edge = np.roll(f.polygon, -1) - f.polygon
        densities = f.phi[None] if f.conformal else np.stack([f.phi, f.psi.conj()])
        self.rise = np.roll(densities, -1, axis=1) - densities
        self.rounding = ROUNDING_SHARE * float(np.abs(image - image[0]).max())

    def pieces(self, rings: list[Complex]) -> CurvePieces:
        """Divide rings into pieces that are short relative to their distance from the vertices.

        A ring's first point is not repeated.
        """
        start, ring = np.concatenate(rings), np.repeat(np.arange(len(rings)), [z.size for z in rings])
        for _ in range(HALVING_ROUNDS):
            middle, half = _middles(start, ring)
            distance = self.vertices.query(xy_of(middle))[0]
            is_far = half > MOST_DISTANCE_RATIO * distance
            if not is_far.any() or start.size > MOST_PIECES:
                break
            start, ring = _halved(start, middle, is_far), np.repeat(ring, 1 + is_far)
        return self._bounded(start, ring)

    def split(self, pieces: CurvePieces, marked: np.ndarray) -> CurvePieces:
        """Return the same curves with some pieces (k,) halved."""
        middle, _ = _middles(pieces.start, pieces.ring)
        fresh = np.repeat(marked, 1 + marked)
        start, ring = _halved(pieces.start, middle, marked), np.repeat(pieces.ring, 1 + marked)
        new = self._bounded(start, ring, fresh)
        parts = {}
        for field in fields(CurvePieces):
            old = np.repeat(getattr(pieces, field.name), 1 + marked)
            old[fresh] = getattr(new, field.name)
            parts[field.name] = old
        return CurvePieces(**parts)

    def _bounded(self, start: Complex, ring: Index, only: np.ndarray | None = None) -> CurvePieces:
        """Return the bounds of all pieces, or of the marked ones."""
        following = _following(ring)
        if only is None:
            only = np.ones(start.size, dtype=bool)
        a, b = start[only], start[following[only]]
        middle, half = 0.5 * (a + b), 0.5 * np.abs(b - a)
        out = np.empty((4, middle.size))
        image, slope, _ = self.f.jet(a)
        _, f_z, f_zbar = self.f.jet(middle)
        derivatives = np.stack([f_z, f_zbar.conj()])
        polygon, edge, rise = self.f.polygon, self.edge, self.rise
        arguments = polygon, edge, polygon.size, rise, len(rise), middle, half, derivatives
        over_slices(
            lambda part: _bounds(*arguments, part.start, part.stop, middle.size, out),
            middle.size,
            step=SLICE_PIECES,
        )
        first, second, noise, error = out[0], out[1], ROUNDING_SHARE * out[2], out[3]
        along = (b - a) / np.maximum(2 * half, 1e-300)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            spread = half * first + 0.5 * half**2 * second + 2 * noise
            bulge = 0.5 * half**2 * (first + half * second) + self.rounding
            jacobian, quotient = np.abs(f_z) - np.abs(f_zbar), np.abs(f_zbar) / np.abs(f_z)
        bad = ~(error == 0) | ~np.isfinite(jacobian) | ~np.isfinite(slope) | ~np.isfinite(bulge)
        spread[bad] = bulge[bad] = np.inf
        tangent = f_z * along + f_zbar * along.conj()
        return CurvePieces(a, ring[only], image, slope, tangent, jacobian, quotient, spread, bulge)


def too_close(pieces: CurvePieces, fresh: np.ndarray | None = None) -> tuple[Index, Index]:
    """Return pairs of pieces whose images the bounds cannot separate, although they must not meet.

    Neighbours share a point; their images meet only there if the cones of their tangents are far enough from
    being opposite. All others must be separated by more than the sum of their bulges. No piece may be loose.

    Args:
        pieces: the curves.
        fresh: (k,) only pairs with one of these; None for all.
    """
    following, k = pieces.following, np.arange(pieces.start.size)
    turn = np.abs(np.angle(pieces.tangent[following] / pieces.tangent))
    sharp = np.pi - turn <= pieces.half_angle + pieces.half_angle[following]
    ends = np.column_stack([pieces.image, pieces.image[following]])
    low = np.minimum(ends[:, 0].real, ends[:, 1].real), np.minimum(ends[:, 0].imag, ends[:, 1].imag)
    high = np.maximum(ends[:, 0].real, ends[:, 1].real), np.maximum(ends[:, 0].imag, ends[:, 1].imag)
    e = pieces.bulge
    boxes = shapely.box(low[0] - e, low[1] - e, high[0] + e, high[1] + e)
    recent = k if fresh is None else np.flatnonzero(fresh)
    i, j = shapely.STRtree(boxes).query(boxes[recent], predicate="intersects")
    i = recent[i]
    apart = (i != j) & (following[i] != j) & (following[j] != i)
    i, j = i[apart], j[apart]
    chords = shapely.linestrings(np.stack([ends.real, ends.imag], axis=-1))
    is_near = shapely.distance(chords[i], chords[j]) <= e[i] + e[j]
    return np.concatenate([k[sharp], i[is_near]]), np.concatenate([following[sharp], j[is_near]])


def _following(ring: Index) -> Index:
    """Return the next index in the same ring, cyclically."""
    following = np.arange(1, ring.size + 1)
    last = np.append(np.flatnonzero(np.diff(ring)), ring.size - 1)
    following[last] = np.concatenate([[0], last[:-1] + 1])
    return following


def _middles(start: Complex, ring: Index) -> tuple[Complex, Real]:
    end = start[_following(ring)]
    return 0.5 * (start + end), 0.5 * np.abs(end - start)


def _halved(start: Complex, middle: Complex, marked: np.ndarray) -> Complex:
    """Return the starts with the midpoints of some pieces inserted."""
    return np.insert(start, np.flatnonzero(marked) + 1, middle[marked])
