"""The drawing between two drawings."""

import itertools

import numpy as np
import pytest
import shapely

from iccm.drawings.drawing import Drawing
from iccm.drawings.intermediate import intermediate, intermediate_areas, signed_distances


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


@pytest.mark.slow
def test_a_hole_that_the_other_drawing_paints_closes_evenly():
    """It has closed after two thirds of the time, however small it is."""
    for radius, outer in ((4, 5), (1, 5)):
        ring, full = Drawing(disc(3, 1, outer).difference(disc(3, 1, radius))), Drawing(disc(3, 1, outer))
        for share in (0.2, 0.5):
            for between in (intermediate(ring, full, share), intermediate(full, ring, 1 - share)):
                (hole,) = between.parts[0].interiors
                size = np.sqrt(shapely.Polygon(hole).area / np.pi)
                assert size == pytest.approx(radius * (1 - 1.5 * share), abs=0.03)
        assert not intermediate(ring, full, 0.7).parts[0].interiors


def test_a_notch_that_the_other_drawing_paints_closes_from_its_rim():
    full = shapely.box(0, 0, 8, 4)
    notched = Drawing(full.difference(shapely.box(3, 1, 5, 4)))
    heights = []
    for share in (0.1, 0.3, 0.9):
        between = intermediate(notched, Drawing(full), share)
        assert len(between.rings) == 1
        heights.append(32 - between.painted.area)
    assert 6 > heights[0] > heights[1] > heights[2] == pytest.approx(0, abs=0.1)


def test_what_one_leaves_out_and_the_other_paints_is_not_noise_half_way():
    """Beside the common boundary of two halves, the distances cancel out."""
    bar = shapely.box(0, 0, 6, 1)
    left, right = (Drawing(bar.union(shapely.box(x, 1, x + 3, 4))) for x in (0, 3))
    between = intermediate(left, right, 0.5)
    assert len(between.rings) == 1 and 6 < between.painted.area < 25


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


@pytest.mark.slow
def test_areas_of_several_colours_fill_the_drawing_between_both_without_gaps():
    """A face with an eye that vanishes, and a mouth that moves and appears in another colour below it."""
    face = disc(0, 0, 5)
    eye, mouth, hat = disc(1, 2, 0.5), shapely.box(-2, -3, 2, -2), shapely.box(-3, 4, 3, 7)
    first = [Drawing(face.difference(eye.union(mouth))), Drawing(eye), Drawing(mouth), None]
    moved = shapely.box(-2, -3.5, 2, -1)
    second = [Drawing(face.difference(moved.union(hat))), None, Drawing(moved), Drawing(hat)]
    for share in (0.2, 0.5, 0.8):
        layers = intermediate_areas(first, second, share)
        whole = layers[0].painted
        drawn = [shapely.Polygon() if layer is None else layer.painted for layer in layers]
        for below, above in itertools.pairwise(drawn):
            assert above.difference(below).area < 1e-3 * whole.area
        without_hat = shapely.intersection(whole, shapely.box(-9, -9, 9, 3.9))
        assert (
            apart(Drawing(without_hat), Drawing(shapely.intersection(face, shapely.box(-9, -9, 9, 3.9))))
            < 0.02
        )
        eye_area, mouth_area, hat_area = (
            a.difference(b).area for a, b in zip(drawn[1:], [*drawn[2:], shapely.Polygon()])
        )
        assert eye_area == pytest.approx(np.pi / 4 * max(1 - 1.5 * share, 0) ** 2, abs=0.03)
        assert 4 < mouth_area < 10
        assert (hat_area > 1) == (share > 0.4)
