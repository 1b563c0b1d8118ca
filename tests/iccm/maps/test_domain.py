"""Where a map is defined: inside, on the boundary, and as far outside as its polygon approximates the outline."""

import numpy as np
import pytest

import iccm
from iccm.maps.harmonic import HarmonicMap
from tests.cases import some_fast
from tests.shapes import arrow, blob, conformal_fit, inside, pear, star


def outside(f, away):
    """Points next to the midpoints of the polygon's edges, outside by a share of its diagonal."""
    curve = f.outline
    return curve.sample(1) + away * curve.diagonal * curve.normals


@pytest.mark.parametrize("evaluated", [lambda f: f, lambda f: lambda z: f.jet(z)[0]])
def test_points_just_outside_are_projected_onto_the_boundary(evaluated):
    f = HarmonicMap(pear(), np.exp(pear()), 0.2 * pear().conj(), slack=0.02)
    g, edge = evaluated(f), f.outline.sample(1)
    for away in (1e-12, 1e-9, 1e-3):
        assert np.abs(g(outside(f, away)) - f(edge)).max() < 1e-8
    assert np.isnan(g(outside(f, 0.1))).all() and np.isnan(f.jet(outside(f, 0.1))).all()
    assert np.isnan(g(np.array([complex(np.nan, 0)]))).all()
    exact = HarmonicMap(f.polygon, f.phi, f.psi)
    assert np.isnan(evaluated(exact)(outside(f, 1e-3))).all()
    assert np.abs(evaluated(exact)(outside(f, 1e-12)) - f(edge)).max() < 1e-8


@pytest.mark.parametrize("method", ["conformal", "paper"])
@pytest.mark.parametrize("n", some_fast([1200, 3000], 1))
def test_the_given_vertices_are_on_the_map_of_a_simplified_outline(method, n):
    source = star(n, 5, 0.5)
    fit = iccm.fit(source, blob(), method=method, max_iterations=10)
    assert fit.map.polygon.size < n
    image, fast = fit.map(source), fit.map.jet(source)[0]
    assert np.abs(image - fast).max() < 1e-8
    edge = fit.map.outline
    foot = np.where(edge.contains(source), source, edge.nearest(source))
    assert np.abs(image - fit.map(foot)).max() < 1e-8
    gap = fit.target.distances(image).max() / fit._diagonal
    assert gap == pytest.approx(fit._boundary["given"], rel=1e-6)
    assert np.isnan(fit.map(1.05 * source)).any()


def test_the_gap_of_the_given_outline_is_reported():
    """A notch that the map's polygon omits is missed by the image, though the polygon's image is not."""
    notch = np.insert(arrow(), 1, [1, 1.1 + 0.4j, 1.2])
    whole = conformal_fit(arrow(), arrow())
    fit = type(whole)(whole.map, whole._ended, [], iccm.Curve.domain(notch), whole.target, whole.pins, [])
    assert whole._boundary["given"] < 1e-3 < 0.05 < fit._boundary["given"]


def test_the_inside_is_unchanged():
    f = HarmonicMap(pear(), np.exp(pear()), 0.2 * pear().conj())
    z = inside(pear())
    assert np.abs(f(z) - f.jet(z)[0]).max() < 1e-11 and np.isfinite(f(pear())).all()
