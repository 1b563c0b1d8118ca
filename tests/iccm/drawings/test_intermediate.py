"""The drawing between two drawings."""

import numpy as np
import pytest
import shapely

from iccm.drawings.drawing import Drawing
from iccm.drawings.intermediate import intermediate, signed_distances


def disc(x, y, radius):
    return shapely.Point(x, y).buffer(radius, 64)


def apart(a, b):
    """The area that one of two drawings paints and the other does not, relative to their mean."""
    difference = shapely.symmetric_difference(a.painted, b.painted).area
    return difference / (0.5 * (a.painted.area + b.painted.area))


def test_distances_are_those_to_the_boundary_negative_inside():
    drawing = Drawing(shapely.box(0, 0, 5, 2).difference(disc(1.5, 0.9, 0.6)).union(disc(7, 1, 0.5)))
    grid = np.arange(-1, 8.5, 0.05) + 1j * np.arange(-1, 3.5, 0.05)[:, None]
    distances = signed_distances(drawing, grid)
    points = shapely.points(grid.real, grid.imag)
    expected = shapely.distance(drawing.painted.boundary, points)
    assert np.abs(distances) == pytest.approx(expected, abs=0.5 * 0.05)
    near = expected < 0.2  # the contours of frames lie where both distances are small, or far from corners
    assert np.quantile(np.abs(np.abs(distances) - expected)[near], 0.99) < 0.05 * 0.05
    clear = expected > 1e-9
    assert ((distances < 0) == shapely.contains(drawing.painted, points))[clear].all()


def test_it_begins_and_ends_with_the_drawings_and_is_the_same_backwards():
    first = Drawing(shapely.box(0, 0, 5, 2).union(disc(7, 1, 0.5)))
    second = Drawing(shapely.box(1, -1, 3, 4).difference(disc(2, 2, 0.5)))
    assert intermediate(first, second, 0) is first and intermediate(first, second, 1) is second
    assert apart(intermediate(first, second, 1e-3), first) < 0.01
    assert apart(intermediate(first, second, 0.3), intermediate(second, first, 0.7)) < 1e-6


@pytest.mark.parametrize("share", [0.25, 0.5, 0.8])
def test_discs_grow_evenly(share):
    between = intermediate(Drawing(disc(2, 1, 1)), Drawing(disc(2, 1, 4)), share)
    assert np.sqrt(between.painted.area / np.pi) == pytest.approx(1 + 3 * share, abs=0.02)


def test_a_hole_closes_from_its_rim():
    """Where the distance x to the rim of the hole satisfies (1 - t) x = t (w + x), with the width w of the ring."""
    ring, full = Drawing(disc(3, 1, 5).difference(disc(3, 1, 4))), Drawing(disc(3, 1, 5))
    for share in (0.2, 0.4):
        (part,) = intermediate(ring, full, share).parts
        (hole,) = part.interiors
        radius = np.sqrt(shapely.Polygon(hole).area / np.pi)
        assert radius == pytest.approx(4 - share * 1 / (1 - 2 * share), abs=0.025 / (1 - 2 * share))
    assert not intermediate(ring, full, 0.5).parts[0].interiors


def test_what_one_leaves_out_and_the_other_paints_is_not_noise_half_way():
    """There the distances cancel out."""
    full = shapely.box(0, 0, 6, 4)
    between = intermediate(Drawing(full), Drawing(full.difference(shapely.box(1, 1, 5, 3))), 0.5)
    assert len(between.rings) == 1 and between.painted.area == pytest.approx(24, rel=0.01)


def test_parts_without_a_counterpart_shrink_and_grow_by_themselves():
    kept = shapely.box(0, 0, 2, 1)
    first, second = Drawing(kept.union(disc(5, 1, 0.5))), Drawing(kept.union(disc(9, 1, 1)))
    areas = {}
    for share in (0.2, 0.5, 0.8):
        between = intermediate(first, second, share)
        areas[share] = [
            shapely.intersection(between.painted, disc(x, 1, 1.2)).area / (np.pi * radius**2)
            for x, radius in ((5, 0.5), (9, 1))
        ]
        assert shapely.intersection(between.painted, kept).area == pytest.approx(2, rel=0.03)
    # vanished after two thirds of the time: radii fall by 1.5 of themselves in a unit of time
    assert areas[0.2] == pytest.approx([0.7**2, 0], abs=0.03)
    assert areas[0.5] == pytest.approx([0.25**2, 0.25**2], abs=0.03)
    assert areas[0.8] == pytest.approx([0, 0.7**2], abs=0.03)
