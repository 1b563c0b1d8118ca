"""Polygons in degrees that cross 180°: unwrapped, and joined where they were cut there (RFC 7946, 3.1.9)."""

from collections.abc import Sequence

import numpy as np
import shapely

from ...arrays import Complex, complex_of, xy_of
from ...polygons import polygons_of, unite

Rings = list[Complex]
NEAR_DEGREES = 1e-6  # degrees: a tenth of a metre
POLE_DEGREES = 90.0  # latitude


def joined(polygons: Sequence[Rings]) -> Sequence[Rings]:
    """Join the polygons of one feature across 180°; each is a list of its outline and holes.

    The same sequence is returned if nothing crosses, or coordinates are not degrees of longitude and latitude.
    """
    rings_of_all = [ring for rings in polygons for ring in rings]
    if not rings_of_all or not all(_is_in_degrees(ring) for ring in rings_of_all):
        return polygons
    unwrapped = [_align([_unwrapped(ring) for ring in rings]) for rings in polygons]
    turns = _turns(unwrapped)
    if not any(turns) and all(outline[0] is rings[0] for outline, rings in zip(unwrapped, polygons)):
        return polygons
    shifted = [[_snapped(ring + 360 * turn) for ring in rings] for rings, turn in zip(unwrapped, turns)]
    union = unite(
        [
            shapely.Polygon(xy_of(outline), [xy_of(hole) for hole in holes]).buffer(0)
            for outline, *holes in shifted
        ]
    )
    return [
        [complex_of(shapely.get_coordinates(ring)) for ring in (part.exterior, *part.interiors)]
        for part in polygons_of(union)
    ]


def _turns(polygons: Sequence[Rings]) -> list[int]:
    """Return the full turns of longitude by which to shift each polygon so that together they have the least extent."""
    low = np.array([rings[0].real.min() for rings in polygons])
    width = np.array([np.ptp(rings[0].real) for rings in polygons])
    if (low + width).max() - low.min() <= 180 or width.max() >= 360:
        return [0] * len(polygons)
    order = np.argsort(low % 360)
    begin = (low % 360)[order]
    reach = np.maximum.accumulate(begin + width[order])
    gaps = np.append(begin[1:], begin[0] + 360) - reach
    first = int((np.argmax(gaps) + 1) % len(begin))
    start = begin[first] if begin[first] < 180 else begin[first] - 360
    shifted = (low - start) % 360 + start
    return np.rint((shifted - low) / 360).astype(int).tolist()


def _is_in_degrees(ring: Complex) -> bool:
    return bool(
        (np.abs(ring.real) <= 180 + NEAR_DEGREES).all()
        and (np.abs(ring.imag) <= POLE_DEGREES + NEAR_DEGREES).all()
    )


def _unwrapped(ring: Complex) -> Complex:
    """Remove jumps across 180° from a ring; one around a pole, or without jumps, is returned as it is."""
    step = np.diff(ring.real, append=ring.real[:1])
    # edges along a pole belong to maps of the whole world, or to polygons closed along 180°
    turns = np.where(step > 180, -1, np.where(step < -180, 1, 0))
    if not turns.any() or turns.sum() or (np.abs(ring.imag) >= POLE_DEGREES - NEAR_DEGREES).any():
        return ring
    return ring + 360 * np.concatenate([[0], np.cumsum(turns)[:-1]])


def _align(rings: Rings) -> Rings:
    """Return the rings of one polygon, with holes shifted to the same turn of longitude as the outline."""
    middle = (rings[0].real.max() + rings[0].real.min()) / 2
    return [rings[0], *(hole + 360 * np.round((middle - hole.real.mean()) / 360) for hole in rings[1:])]


def _snapped(ring: Complex) -> Complex:
    """Move points very close to 180° exactly there, so that halves meet."""
    return np.where(
        np.abs(np.abs(ring.real) - 180) <= NEAR_DEGREES, 180 * np.sign(ring.real) + 1j * ring.imag, ring
    )
