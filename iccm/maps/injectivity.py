"""A certificate that a map is injective (argument principle, Lewy, Darboux-Picard)."""

from dataclasses import dataclass, replace

import numpy as np
import shapely

from ..arrays import Complex
from ..curve import Curve
from .evaluate import Evaluator
from .harmonic import HarmonicMap

DEPTHS = 10.0 ** -np.arange(5.0, 0.9, -0.5)  # relative to the diagonal of the source
LARGEST_TURN = np.pi / 3  # of the phase of f_z between neighbouring samples, before samples are added
MOST_SAMPLES = 40_000


@dataclass(frozen=True)
class Certificate:
    """What was proven of a map f on the source moved inwards by `depth` times its diagonal.

    Attributes:
        certified: f is injective there.
        depth: the least of the depths tried at which that holds, else the largest tried.
        zeros: zeros of f_z inside at that depth.
        beltrami: max |f_z̄ / f_z| on the boundary of that part.
        simple: whether the image of that boundary is simple.
        obstacle: what stands in the way closer to the boundary, or at all; empty where nothing does.
    """

    certified: bool
    depth: float
    zeros: int
    beltrami: float
    simple: bool
    obstacle: str = ""

    def report(self) -> dict:
        """As in the JSON report."""
        return {
            "certified": self.certified,
            "depth": self.depth,
            "zeros": self.zeros,
            "max_beltrami": self.beltrami,
            "simple_image": self.simple,
            "obstacle": self.obstacle,
        }

    @property
    def failure(self) -> str:
        """What failed, as a sentence; empty if certified."""
        what = [f"f_z has {self.zeros} zero{'s' * (self.zeros > 1)}"] if self.zeros else []
        what += [f"|f_z̄/f_z| is up to {self.beltrami:.3g}"] if self.beltrami >= 1 else []
        what += [] if self.simple else ["the image of the boundary crosses itself"]
        return "" if self.certified else f"at depth {self.depth:.0e}: {', '.join(what)}"


def certify(f: HarmonicMap | Evaluator, depths: np.ndarray = DEPTHS) -> Certificate:
    """The least of `depths` at which f is certainly injective.

    A harmonic map with |f_z̄| < |f_z| on the boundary and no zero of f_z inside keeps its orientation inside,
    because f_z̄ / f_z
    is holomorphic there; if it also takes the boundary to a simple curve, it is injective (degree theory; for
    holomorphic f, Darboux-Picard).
    """
    obstacle = ""
    for depth in depths:
        found = at_depth(f, float(depth))
        obstacle = found.failure or obstacle
        if found.certified:
            break
    return replace(found, obstacle=obstacle)


def at_depth(f: HarmonicMap | Evaluator, depth: float) -> Certificate:
    """What holds on the source moved inwards by `depth` times its diagonal."""
    curve = Curve(f.polygon)
    outline = shapely.Polygon(np.column_stack([curve.z.real, curve.z.imag]))
    inner = outline.buffer(-depth * curve.diagonal, join_style="mitre")
    rings = [part.exterior for part in shapely.get_parts(inner) if part.area > 0]
    zeros, beltrami, images = 0, 0.0, []
    for ring in rings:
        z = _refined(f, sampled(ring, f.polygon))
        f_z, f_zbar = f.derivatives(z)
        if not np.isfinite(f_z).all():
            return Certificate(False, depth, zeros, beltrami, False)
        zeros += abs(_winding(f_z))
        beltrami = max(beltrami, float(np.max(np.abs(f_zbar) / np.maximum(np.abs(f_z), 1e-300))))
        images.append(f(z))
    simple = bool(rings) and _simple(images)
    return Certificate(simple and zeros == 0 and beltrami < 1, depth, zeros, beltrami, simple)


def sampled(ring: shapely.LinearRing, polygon: Complex) -> Complex:
    """A counter-clockwise ring (first vertex repeated), as dense as the polygon's vertices next to it.

    f_z changes no faster than from vertex to vertex, so no turn hides between two samples.
    """
    places = shapely.line_locate_point(ring, shapely.points(polygon.real, polygon.imag))
    own = shapely.line_locate_point(ring, shapely.points(shapely.get_coordinates(ring)[:-1]))
    places = np.unique(np.concatenate([[0.0], places, own]))
    apart = np.diff(places, append=ring.length) > 1e-9 * ring.length  # closer ones would cross by rounding
    places = np.append(places[apart], ring.length)
    places[0] = 0.0
    between = places[:-1, None] + np.diff(places)[:, None] * np.array([0.0, 1 / 3, 2 / 3])
    along = np.append(between.ravel(), ring.length)
    z = shapely.get_coordinates(shapely.line_interpolate_point(ring, along)) @ np.array([1, 1j])
    z[-1] = z[0]
    return z if Curve(z[:-1]).area > 0 else z[::-1]


def _refined(f: HarmonicMap | Evaluator, ring: Complex) -> Complex:
    """The ring with samples added until f_z turns and grows by little between neighbours."""
    value = f.derivatives(ring)[0]
    while ring.size < MOST_SAMPLES:
        size = np.log(np.maximum(np.abs(value), 1e-300))
        smooth = (np.abs(_turns(value)) < LARGEST_TURN) & (np.abs(np.diff(size)) < 1)
        coarse = np.flatnonzero(~smooth & (np.abs(np.diff(ring)) > 1e-12 * np.abs(ring).max()))
        if not coarse.size:
            break
        middle = 0.5 * (ring[coarse] + ring[coarse + 1])
        ring = np.insert(ring, coarse + 1, middle)
        value = np.insert(value, coarse + 1, f.derivatives(middle)[0])
    return ring


def _turns(value: Complex) -> np.ndarray:
    """Change of phase from each value to the next."""
    return np.angle(value[1:] * value[:-1].conj())


def _winding(value: Complex) -> int:
    """Turns of a closed sequence about zero."""
    return round(float(np.sum(_turns(value))) / (2 * np.pi))


def _simple(images: list[Complex]) -> bool:
    """Whether the rings are simple, one after the other, and do not meet or nest."""
    polygons = [shapely.Polygon(np.column_stack([w.real, w.imag])) for w in images]
    if not all(p.is_valid for p in polygons):
        return False
    tree = shapely.STRtree(polygons)
    a, b = tree.query(polygons, predicate="intersects")
    return not np.any(a != b)
