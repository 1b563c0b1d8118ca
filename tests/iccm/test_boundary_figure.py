"""The distance of the boundary's image from the target, as accurate as the densest sampling."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import shapely

import iccm
from iccm.arrays import xy_of
from iccm.curve import Curve, boundary_samples, hausdorff
from iccm.maps.boundary_image import outline
from tests.shapes import arrow, blob, ell, pear, refined, square, star

SHAPES = {"arrow": arrow(), "ell": ell(), "star": star(), "blob": blob(), "square": 1.5 * square()}


def densest(a, b):
    """The Hausdorff distance in both directions, from 10,000 points of each."""
    rings = [shapely.LinearRing(xy_of(z)) for z in (a, b)]
    points = [boundary_samples(z, max(2, 10_000 // z.size)) for z in (a, b)]
    away = [shapely.distance(shapely.points(xy_of(z)), ring) for z, ring in zip(points, reversed(rings))]
    return max(distances.max() for distances in away)


@pytest.mark.parametrize(("first", "second"), list(combinations(SHAPES, 2)))
def test_the_distance_of_two_outlines_is_the_densest_samplings(first, second):
    a, b = SHAPES[first], SHAPES[second]
    distance, truth = hausdorff(Curve(a), Curve(b)), densest(a, b)
    assert 0.99 * truth - 1e-9 <= distance <= truth + 1e-3
    assert hausdorff(Curve(b), Curve(a)) == distance


def test_more_vertices_do_not_change_the_distance():
    a, b = Curve(arrow()), Curve(refined(arrow(), 7))
    assert hausdorff(a, b) < 1e-12 and hausdorff(a, Curve(b.z + 0.25j)) == pytest.approx(0.25, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["paper", "conformal", "balanced"])
def test_the_figure_of_a_map_is_that_of_its_whole_boundary(method):
    fit = iccm.fit(arrow(), 2 * pear(), method=method, **({"fit": "whole"} if method == "balanced" else {}))
    z, u = fit.map.polygon, np.linspace(0, 1, 80, False)
    close = u**4 / (u**4 + (1 - u) ** 4)  # denser at the vertices, where a harmonic map is like z log z
    image = fit.map((z[:, None] + (np.roll(z, -1) - z)[:, None] * close).ravel())
    truth = densest(image, fit.target.z) / fit._diagonal
    assert fit._boundary["hausdorff"] == pytest.approx(truth, rel=0.02, abs=2e-4)
    if method == "paper":
        assert truth > 2e-3


def test_the_image_of_the_boundary_is_measured_between_samples():
    """With few vertices it leaves the target between them, which two samples per edge did not detect."""
    fit = iccm.fit(square(), arrow(), method="paper", literal=True)
    at_samples = np.abs(fit.map(square()) - fit.target.at(fit.target.closest(fit.map(square())))).max()
    assert at_samples < 1e-9 and fit._boundary["hausdorff"] > 0.1


def test_far_from_the_origin_the_image_of_the_boundary_is_the_same():
    at_origin = iccm.fit(pear(), arrow(), method="paper").map
    shifted = replace(at_origin, polygon=at_origin.polygon + 3e7, phi=at_origin.phi - 2e7j)
    image, moved = (Curve(outline(map, 1e-3)) for map in (at_origin, shifted))
    assert hausdorff(image, Curve(moved.z + 2e7j)) < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("target", [arrow(), star(), pear(), ell()])
def test_balanced_maps_hold_the_outline_as_stated(target):
    """docs: to 2e-4 of the target's diagonal."""
    assert iccm.fit(blob(), target)._boundary["hausdorff"] <= 2.05e-4


@pytest.mark.parametrize("method", ["balanced", "conformal", "paper"])
def test_farther_outside_than_stated_maps_are_nan(method):
    """docs: NaN more than 1e-3 of the diagonal outside."""
    source = Curve(star())
    fit = iccm.fit(source, blob(), method=method)
    middle, across = source.z + 0.5 * source.edges, source.normals * source.diagonal
    assert np.isnan(fit.map(middle + 1.5e-3 * across)).all()
    assert np.isfinite(fit.map(middle - 1e-3 * across)).all()
