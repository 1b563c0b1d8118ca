"""Certificates compared with dense sampling, on random harmonic maps for which the depth of folds is known.

    python -m tests.bench.certificates [COUNT]

A map is judged without the certificate's code: by |f_z̄| < |f_z| at thousands of samples on rings at many depths, and
by the images of those rings as polygons. A certificate is false if a fold is found in the part that it covers. A
rejection is unnecessary if 99 % of the area are free of folds but less is certified.
"""

import sys
import time

import numpy as np
import shapely

from iccm.maps.harmonic import HarmonicMap
from iccm.maps.injectivity import certify
from tests.shapes import random_polygon

COUNT, SAMPLES, ENOUGH = 1000, 4_000, 0.99
DEPTHS = np.concatenate([[1e-4, 1e-3, 2e-3, 3e-3, 4e-3], np.geomspace(5e-3, 0.9, 15)])


def drawn(rng: np.random.Generator) -> HarmonicMap:
    """Draw a random polygon of 6 to 40 vertices, some edges divided, with smooth or rough values added to a
    similarity.
    """
    polygon = random_polygon(rng, int(rng.integers(6, 41)))
    parts = int(rng.integers(1, 4))
    t = np.arange(parts) / parts
    polygon = (polygon[:, None] + (np.roll(polygon, -1) - polygon)[:, None] * t).ravel()
    strength = 10 ** rng.uniform(-3, 0, 2)
    if rng.random() < 0.5:
        noise = rng.normal(size=(2, polygon.size)) + 1j * rng.normal(size=(2, polygon.size))
    else:
        c = rng.normal(size=(2, 5)) + 1j * rng.normal(size=(2, 5))
        powers = polygon ** np.arange(1, 6)[:, None]
        noise = np.stack([c[0] @ powers, (c[1] @ powers).conj()])
    return HarmonicMap(polygon, polygon + strength[0] * noise[0], strength[1] * noise[1])


def fold_depth(f: HarmonicMap) -> float:
    """Return the largest of DEPTHS at which dense samples find a fold, relative to the inradius; 0 if there is none."""
    for depth in DEPTHS[::-1]:
        if folded(f, depth):
            return float(depth)
    return 0.0


def folded(f: HarmonicMap, depth: float) -> bool:
    """Return whether dense samples of the part at some depth show that the map is not one-to-one there."""
    inner, _ = moved_in(f.polygon, depth)
    images = []
    for part in shapely.get_parts(inner):
        if part.is_empty:
            continue
        along = np.linspace(0, part.exterior.length, SAMPLES, endpoint=False)
        z = shapely.get_coordinates(shapely.line_interpolate_point(part.exterior, along)) @ np.array([1, 1j])
        w, f_z, f_zbar = f.jet(z)
        turns = np.angle(np.roll(f_z, -1) / f_z)
        if not (np.abs(f_zbar) < np.abs(f_z)).all() or round(abs(turns.sum()) / (2 * np.pi)):
            return True
        images.append(shapely.Polygon(np.column_stack([w.real, w.imag])))
    if not all(image.is_valid for image in images):
        return True
    if len(images) < 2:
        return False
    i, j = shapely.STRtree(images).query(images, predicate="intersects")
    return bool(np.any(i != j))


def moved_in(polygon: np.ndarray, depth: float) -> tuple[shapely.Geometry, float]:
    """Return the part at some depth, and its share of the area."""
    outline = shapely.Polygon(np.column_stack([polygon.real, polygon.imag]))
    radius = shapely.maximum_inscribed_circle(outline, tolerance=1e-3 * np.sqrt(outline.area)).length
    inner = outline.buffer(-depth * radius, join_style="mitre")
    return inner, inner.area / outline.area


def measure(count: int = COUNT, seed: int = 16) -> dict[str, float]:
    """Draw maps, certify them, and count the errors."""
    rng = np.random.default_rng(seed)
    false, rejected, injective, seconds = 0, 0, 0, []
    for _ in range(count):
        f = drawn(rng)
        start = time.perf_counter()
        certificate = certify(f)
        seconds.append(time.perf_counter() - start)
        fold = fold_depth(f)
        false += certificate.certified and folded(f, certificate.depth)
        good = moved_in(
            f.polygon, DEPTHS[np.searchsorted(DEPTHS, fold, side="right")] if fold < 0.9 else 1.0
        )[1]
        if good >= ENOUGH:
            injective += 1
            rejected += certificate.share < ENOUGH
    return {
        "maps": count,
        "false certificates": false,
        "injective on 99 %": injective,
        "of them rejected": rejected,
        "median seconds": float(np.median(seconds)),
        "longest": max(seconds),
    }


if __name__ == "__main__":
    for name, value in measure(*map(int, sys.argv[1:])).items():
        print(f"{name:20} {value:g}")
