"""Certify that a harmonic map is injective (argument principle, Lewy, Darboux-Picard)."""

from dataclasses import dataclass, replace

import numpy as np
import shapely

from ..arrays import Complex, Real, complex_of
from ..curve import Curve, polygon_of
from .enclosure import HALVING_ROUNDS, MOST_PIECES, CurvePieces, Encloser, too_close
from .harmonic import HarmonicMap

DEPTHS = np.concatenate([10 ** np.arange(-4.0, -1.0, 0.25), 10 ** np.arange(-1.0, -0.04, 0.05)])
"""Depths that are tried, relative to the inradius of the source."""
DEPTH_BISECTIONS = 3  # between two depths: the depth is then right to an eighth of their ratio
TINIEST_ROUNDINGS = 8  # smallest image of a piece, in units of rounding
CLOSER_ROUNDS = 12  # rounds of halving pieces whose images are close to each other
SHORTEST_EDGE_SHARE = 1e-12  # of a ring moved inwards, relative to its length


@dataclass(frozen=True)
class Certificate:
    """The proof that a map f is one-to-one on the source moved inwards by `depth` times its inradius.

    Attributes:
        certified: whether f is injective there.
        depth: the least of the tried depths at which f is certified, else the last one tried.
        zeros: number of zeros of f_z inside at that depth.
        beltrami: largest |f_z̄ / f_z| found on the boundary of that part.
        simple: whether the image of that boundary is simple.
        obstacle: the reason why f is not certified closer to the boundary, or at all; empty if there is none.
        share: share of the source's area on which f is certified; 0 if it is not.
    """

    certified: bool
    depth: float
    zeros: int = 0
    beltrami: float = 0.0
    simple: bool = False
    obstacle: str = ""
    share: float = 0.0

    def report(self) -> dict:
        """Return the certificate as in the JSON report."""
        return {
            "certified": self.certified,
            "depth": self.depth,
            "share": self.share,
            "zeros": self.zeros,
            "max_beltrami": self.beltrami,
            "simple_image": self.simple,
            "obstacle": self.obstacle,
        }


def certify(f: HarmonicMap, depths: Real = DEPTHS) -> Certificate:
    """Find the least depth at which f is certainly injective.

    A map that is certified at a depth is also certified deeper, so the depths are bisected, and then the
    interval between the last two.

    A harmonic map with |f_z̄| < |f_z| on the boundary and no zero of f_z inside preserves orientation inside,
    because f_z̄ / f_z is holomorphic there; if it also maps the boundary to a simple curve, it is injective
    (degree theory; for holomorphic f, Darboux-Picard). All three conditions are proven between samples too
    (`enclosure`).
    """
    source, certified = InsetDomain.of(f), None
    failed = source.at_depth(float(depths[0]))
    if failed.certified:
        return failed
    low, high = 0, depths.size
    while high - low > 1:
        middle = (low + high) // 2
        trial = source.at_depth(float(depths[middle]))
        if trial.certified:
            high, certified = middle, trial
        else:
            low, failed = middle, trial
    if certified is None:
        return failed
    for _ in range(DEPTH_BISECTIONS):
        trial = source.at_depth(float(np.sqrt(failed.depth * certified.depth)))
        if trial.certified:
            certified = trial
        else:
            failed = trial
    return replace(certified, obstacle=failed.obstacle)


def at_depth(f: HarmonicMap, depth: float) -> Certificate:
    """Return the certificate on the source moved inwards by `depth` times its inradius."""
    return InsetDomain.of(f).at_depth(depth)


@dataclass(frozen=True, eq=False)
class InsetDomain:
    """A map on the inside of its polygon.

    Attributes:
        encloser: bounds of the map.
        outline: its polygon.
        inradius: radius of the largest disc inside.
    """

    encloser: Encloser
    outline: shapely.Polygon
    inradius: float

    @classmethod
    def of(cls, f: HarmonicMap) -> "InsetDomain":
        """Prepare a map."""
        outline = polygon_of(f.polygon)
        radius = shapely.maximum_inscribed_circle(outline, tolerance=1e-3 * np.sqrt(outline.area)).length
        return cls(Encloser(f), outline, float(radius))

    def at_depth(self, depth: float) -> Certificate:
        """Return the certificate for the part that lies deeper."""
        inner = self.outline.buffer(-depth * self.inradius, join_style="mitre")
        parts = [part for part in shapely.get_parts(inner) if part.area > 0]
        if not parts:
            return _failed(depth, "no part of the source lies deeper")
        pieces = self.encloser.pieces([ring_of(part) for part in parts])
        if obstacle := _fold_between(pieces):
            return _failed(depth, obstacle, pieces)
        for _ in range(HALVING_ROUNDS):
            loose = pieces.loose
            if not loose.any():
                break
            pieces = self.encloser.split(pieces, loose)
            if obstacle := _fold_between(pieces):
                return _failed(depth, obstacle, pieces)
            if pieces.start.size > MOST_PIECES:
                return _failed(depth, "no proof between samples was possible", pieces)
        zeros = int(np.abs(pieces.zeros).sum())
        if zeros:
            return _failed(depth, f"f_z has {zeros} zero{'s' * (zeros > 1)}", pieces, zeros)
        pieces, obstacle = self._simple(pieces)
        if obstacle:
            return _failed(depth, obstacle, pieces)
        share = float(sum(part.area for part in parts) / self.outline.area)
        return Certificate(True, depth, 0, float(pieces.quotient.max()), True, share=share)

    def _simple(self, pieces: CurvePieces) -> tuple[CurvePieces, str]:
        """Halve pieces until their images are known to be simple and disjoint.

        Returns:
            The pieces, and the reason if that failed; else an empty string.
        """
        if not _apart(pieces.rings()):
            return pieces, "the image of the boundary crosses itself"
        fresh = None
        for _ in range(CLOSER_ROUNDS):
            chord = np.abs(pieces.image[pieces.following] - pieces.image)
            if chord.min() < TINIEST_ROUNDINGS * self.encloser.rounding:
                break  # with thousands of pieces in one place, crossings are rounding noise
            i, j = too_close(pieces, fresh)
            if not i.size:
                return pieces, "" if _apart(pieces.rings()) else "the image of the boundary crosses itself"
            split = np.zeros(pieces.start.size, dtype=bool)
            split[i] = split[j] = True
            fresh = np.repeat(split, 1 + split)
            pieces = self.encloser.split(pieces, split)
            if pieces.loose.any() or pieces.start.size > MOST_PIECES:
                break
        return pieces, "the image of the boundary crosses itself, or nearly does, within rounding"


def ring_of(part: shapely.Polygon) -> Complex:
    """Return (k,) vertices of a polygon's boundary, counter-clockwise, without those that coincide within rounding."""
    z = complex_of(shapely.get_coordinates(part.exterior)[:-1])
    ring = z[np.abs(z - np.roll(z, 1)) > SHORTEST_EDGE_SHARE * part.exterior.length]
    return ring if Curve(ring).area > 0 else ring[::-1]


def _fold_between(pieces: CurvePieces) -> str:
    """Return an obstacle that the samples themselves show; an empty string if there is none."""
    if not np.isfinite(pieces.jacobian).all():
        return "the map cannot be evaluated"
    if pieces.jacobian.min() > 0:
        return ""
    worst = float(np.nanmax(pieces.quotient)) if np.isfinite(pieces.quotient).any() else 1.0
    return f"|f_z̄/f_z| is up to {worst:.3g}"


def _failed(depth: float, reason: str, pieces: CurvePieces | None = None, zeros: int = 0) -> Certificate:
    """Return a certificate that nothing is certified at a depth, with the reason `reason`."""
    beltrami = float(np.nanmax(pieces.quotient, initial=0.0)) if pieces is not None else 0.0
    return Certificate(False, depth, zeros, beltrami, False, f"at depth {depth:.1e}: {reason}")


def _apart(images: list[Complex]) -> bool:
    """Return whether the rings are simple, and neither meet nor contain each other."""
    polygons = [polygon_of(w) for w in images]
    if not all(p.is_valid for p in polygons):
        return False
    tree = shapely.STRtree(polygons)
    a, b = tree.query(polygons, predicate="intersects")
    return not np.any(a != b)
