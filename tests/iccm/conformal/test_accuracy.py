"""The conformal method compared with known conformal maps: error against vertices, and order of convergence."""

import numpy as np
import pytest

from tests.exact import DISC, ell_error, moebius_error, order, smooth_error, square_error, to_ell, to_square
from tests.shapes import circle, conformal_fit, ell, square


def test_the_exact_maps_have_the_right_corners():
    for f, polygon in ((to_square(), square()), (to_ell(), ell())):
        assert np.abs([f.corner(k) - c for k, c in enumerate(polygon)]).max() < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize(("c", "last"), [(0.2, 3e-6), (0.45, 3e-5)])
def test_the_disc_onto_an_ellipse_like_shape_and_nearly_a_cardioid(c, last):
    ns = (30, 60, 120)
    errors, rims = zip(*(smooth_error(c, n) for n in ns))
    assert errors[-1] < last and rims[-1] < 1e-3
    assert order(errors, ns) > 2.5, errors


@pytest.mark.slow
def test_the_square_onto_the_disc():
    ns = (60, 120, 240)
    errors, rims = zip(*(square_error(n) for n in ns))
    assert errors[-1] < 2e-6 and rims[-1] < 1e-4
    assert order(errors, ns) > 2.5, errors


@pytest.mark.slow
def test_the_ell_onto_the_square():
    ns = (60, 120, 240)
    errors, rims = zip(*(ell_error(n) for n in ns))
    assert errors[-1] < 1.5e-4 and rims[-1] < 2e-4
    assert order(errors, ns) > 2.5, errors


@pytest.mark.slow
def test_the_ell_onto_the_disc():
    fit = conformal_fit(ell(), circle(1000), vertices=240, tolerance=1e-6)
    assert moebius_error(fit.map(to_ell()(DISC)), DISC)[0] < 3e-5


@pytest.mark.slow
def test_a_thousand_vertices():
    """1e-6 for smooth boundaries, a few times that for the near cusp and for corners on both sides."""
    assert smooth_error(0.2, 960)[0] < 1.5e-6
    assert smooth_error(0.45, 960)[0] < 5e-6
    assert square_error(960)[0] < 1.5e-6
    assert ell_error(960)[0] < 5e-6
