"""Bounds on the distortion of triangulated maps: make quadratic patches meet those that straight triangles meet."""

from dataclasses import replace

import numpy as np

from ..arrays import Real, distinct
from . import distortion
from .triangulated.map import TriangulatedMap
from .triangulated.patches import shrunk

ROUNDING_SHARE = 1e-9  # relative to a bound: if it is exceeded by less, it is met
STRAIGHTENING_ROUNDS = (
    # Of straightening; a straightened edge may make its neighbour exceed a bound, which takes one or two more
    # rounds.
    20
)


def straighten_beyond_bounds(
    map: TriangulatedMap, max_dilatation: float | None, max_stretch: float | None
) -> TriangulatedMap:
    """Return the map with straight triangles where their patches exceed a requested bound."""
    for _ in range(STRAIGHTENING_ROUNDS):
        sides = distinct(map.edges.sides[_excess(map, max_dilatation, max_stretch) > 1])
        curved_sides = sides[map.bulges[sides] != 0]
        if not curved_sides.size:
            break
        bulge = map.bulges.copy()
        bulge[curved_sides] = 0
        map = replace(map, bulge=shrunk(map.faces, map.image, map.source, map.edges, bulge))
    return map


def meets_bounds(map: TriangulatedMap, max_dilatation: float | None, max_stretch: float | None) -> bool:
    """Return whether the patches meet the requested bounds, within rounding."""
    return bool(_excess(map, max_dilatation, max_stretch).max() <= 1 + ROUNDING_SHARE)


def bound_notes(map: TriangulatedMap, max_dilatation: float | None, max_stretch: float | None) -> list[str]:
    """Return a note for each requested bound.

    It states the share of the target where the bound is exceeded, and the least possible value. The least
    possible value follows from the outlines' angles, see `angle_ratio`.
    """
    measured, ratio = distortion.of_triangles(map), angle_ratio(map)
    bounds = [
        ("dilatation", max_dilatation, measured.dilatations, ratio),
        ("stretch", max_stretch, measured.stretches, np.sqrt(ratio)),
    ]
    notes = []
    for name, bound, values, least in bounds:
        if bound is None:
            continue
        share = measured.area @ (values > bound * (1 + ROUNDING_SHARE)) / measured.area.sum()
        over = f"is up to {values.max():.3g}, more than {bound:g} on {share:.2%} of the target"
        within = f"is at most {bound:g}"
        allowed = (
            f"the angles of the outlines at matching corners do not allow less than {least:.3g} (max_{name})."
        )
        notes.append(
            f"The {name} {within if values.max() <= bound * (1 + ROUNDING_SHARE) else over}; {allowed}"
        )
    return notes


def angle_ratio(map: TriangulatedMap) -> float:
    """Return the largest ratio, at a vertex of the outline and its image, of the larger inner angle to the smaller.

    Around a vertex, a piecewise smooth map is r e^{it} -> r ρ(t) e^{iφ(t)}. Its dilatation is at least φ' or
    1/φ', and the mean of φ' is the ratio of the angles. So no such map has a smaller dilatation, nor a smaller
    stretch than its root.
    """
    loop = map.loops[0]
    angles = [
        np.angle((np.roll(z, 1) - z) / (np.roll(z, -1) - z)) % (2 * np.pi)
        for z in (map.source[loop], map.image[loop])
    ]
    return float(np.exp(np.abs(np.log(angles[0] / angles[1])).max()))


def _excess(map: TriangulatedMap, max_dilatation: float | None, max_stretch: float | None) -> Real:
    """Return (m,) the largest ratio of each patch's dilatation and stretch to their bounds."""
    worst = np.zeros(len(map.faces))
    if max_dilatation is None and max_stretch is None:
        return worst
    measured = distortion.of_triangles(map)
    for bound, values in (
        (max_dilatation, measured.dilatations),
        (max_stretch, measured.stretches),
    ):
        if bound is not None:
            worst = np.maximum(worst, values.reshape(worst.size, -1).max(axis=1) / bound)
    return worst
