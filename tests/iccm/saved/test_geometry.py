"""Points, lines and polygons carried by maps that are known in closed form."""

from itertools import pairwise

import numpy as np
import pytest
import shapely

from iccm.arrays import xy_of
from iccm.saved.geometry import Carrier

SQUARE = np.array([0, 1, 1 + 1j, 1j])
HOLE = np.array([0.4 + 0.4j, 0.4 + 0.6j, 0.6 + 0.6j, 0.6 + 0.4j])


def bent(z):
    """The square bent to a half ring by z → exp, one-to-one on it; NaN outside."""
    inside = (z.real >= -1e-6) & (z.real <= 1 + 1e-6) & (z.imag >= -1e-6) & (z.imag <= 1 + 1e-6)
    return np.where(inside, np.exp(z * (1 + 2j)), np.nan)


def carrier(tolerance=1e-4, rims=(SQUARE,), map=bent):
    return Carrier(map, rims, 1e-6, tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
def test_lines_stay_within_the_tolerance_of_their_images(tolerance):
    line = np.array([0.1 + 0.1j, 0.9 + 0.2j, 0.8 + 0.9j])
    ((image,),) = carrier(tolerance).lines([line])
    t = np.linspace(0, 1, 20001)
    true = bent(np.concatenate([a + t * (b - a) for a, b in pairwise(line)]))
    off = shapely.distance(shapely.LineString(xy_of(image)), shapely.points(xy_of(true))).max()
    assert tolerance / 50 < off <= tolerance  # no closer than requested, and with no more points than needed
    assert np.isin(bent(line), image).all()


def test_an_affine_map_adds_no_points():
    lines = [np.array([0.1 + 0.1j, 0.9 + 0.2j, 0.8 + 0.9j]), np.array([0.5j, 1 + 0.5j])]
    images = carrier(map=lambda z: 3 * z + 0.5 * z.conj() + 1).lines(lines)
    assert [[piece.size for piece in pieces] for pieces in images] == [[3], [2]]


def test_lines_are_cut_where_they_leave_and_counted():
    work = carrier(rims=(SQUARE, HOLE))
    images = work.lines(
        [np.array([-1 + 0.5j, 2 + 0.5j]), np.array([2 + 2j, 3 + 3j]), np.array([0.1 + 0.1j, 0.9 + 0.1j])]
    )
    assert [len(pieces) for pieces in images] == [2, 0, 1]
    assert work.counts["lines cut"] == 1 and work.counts["lines outside"] == 1
    ends = np.array([[piece[0], piece[-1]] for piece in images[0]])
    assert np.abs(ends - bent(np.array([[0.5j, 0.4 + 0.5j], [0.6 + 0.5j, 1 + 0.5j]]))).max() < 1e-4


def test_polygons_are_simple_and_keep_their_holes_and_areas():
    work = carrier(1e-5)
    outer, hole = 0.1 + 0.1j + 0.8 * SQUARE, 0.4 + 0.4j + 0.2 * SQUARE
    ((rings,),) = work.polygons([[outer, hole]])
    polygon = shapely.Polygon(xy_of(rings[0]), [xy_of(ring) for ring in rings[1:]])

    def area(low, high):
        """Return the area of the image of a square: ∫ |f'|² over it, |f'|² = 5 exp(2x - 4y)."""
        return 5 * (np.exp(2 * high) - np.exp(2 * low)) / 2 * (np.exp(-4 * low) - np.exp(-4 * high)) / 4

    assert (
        polygon.is_valid
        and len(polygon.interiors) == 1
        and abs(polygon.area - area(0.1, 0.9) + area(0.4, 0.6)) < 1e-4
    )
    assert not +work.counts


def test_thin_or_crossing_polygons_become_simple():
    thin = np.array([0.1 + 0.5j, 0.9 + 0.5j, 0.9 + 0.50001j, 0.1 + 0.50001j])
    bow = np.array([0.2 + 0.2j, 0.8 + 0.8j, 0.8 + 0.2j, 0.2 + 0.8j])
    over = np.array([-1 + 0.4j, 2 + 0.4j, 2 + 0.6j, -1 + 0.6j])
    work = carrier(1e-2, rims=(SQUARE, HOLE))
    images = work.polygons([[thin + 0.3j], [bow], [over]])
    polygons = [
        shapely.Polygon(xy_of(rings[0]), [xy_of(r) for r in rings[1:]]) for parts in images for rings in parts
    ]
    assert all(polygon.is_valid for polygon in polygons)
    assert [len(parts) for parts in images] == [1, 2, 2]
    assert work.counts["polygons repaired"] == 1 and work.counts["polygons cut"] == 2
