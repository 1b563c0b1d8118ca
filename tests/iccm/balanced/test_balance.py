"""`--balance`: the larger it is, the more uniform the areas, while the rotation of the picture is kept."""

from itertools import pairwise

import numpy as np
import pytest

import iccm
from iccm.balanced.model.measures import least_dilatations
from iccm.maps.bounds import angle_ratio
from iccm.maps.triangulated.map import TriangulatedMap
from tests.cases import slow, some_fast
from tests.shapes import arrow, blob, ell, pear, square, star

TEXAS = np.array(
    [0, 3, 3 + 2j, 5 + 1.6j, 7 + 1.2j, 7.2 - 1j, 6 - 2j, 5.4 - 4j, 4.2 - 3j, 3.4 - 1.8j, 2 - 2j, 1.2 - 1j]
)
PAIRS = {
    "square to Texas": (square(), TEXAS),
    "L to star": (ell(), star()),
    "arrow to blob": (arrow(), blob()),
    "star to pear": (star(arms=7), pear()),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", some_fast(PAIRS, 1))
def test_sizes_become_more_even_and_the_picture_stays_upright(name):
    fits = [iccm.fit(*PAIRS[name], fit="whole", balance=balance) for balance in (0.5, 1.0, 3.0, 10.0)]
    uneven = [float(np.average(f.triangles.energies()["area"], weights=f.triangles.area)) for f in fits]
    assert all(after < before for before, after in pairwise(uneven)), uneven
    turns = [fit.distortion.turn for fit in fits[1:]]
    assert np.ptp(turns) < 5 and all(fit.status.ok and fit.certificate.share == 1 for fit in fits)


def mean_energy(distortion):
    energy, inner = distortion.energies()["total"], distortion.area > 0
    return np.average(energy[inner], weights=distortion.area[inner])


@pytest.mark.parametrize("name", ["square to Texas", slow("arrow to blob")])
def test_a_bound_that_can_be_met_is_met_at_little_cost_elsewhere(name):
    free = iccm.fit(*PAIRS[name], fit="whole").distortion
    for share in (0.9, 0.7):
        bound = share * float(free.stretches.max())
        fit = iccm.fit(*PAIRS[name], max_stretch=bound)
        assert fit.status.ok and fit.distortion.stretches.max() <= bound * (1 + 1e-9)
        assert fit.distortion.quantile(fit.distortion.stretches, 0.95) < 1.03 * free.quantile(
            free.stretches, 0.95
        )
        assert mean_energy(fit.distortion) < 1.01 * mean_energy(free)
        assert f"is at most {bound:g}" in fit.notes[-1]


@pytest.mark.slow
def test_limiting_corners_are_reported_and_everything_else_meets_the_bound():
    fit = iccm.fit(*PAIRS["square to Texas"], max_dilatation=2.235)
    least, distortion = angle_ratio(fit.map), fit.distortion
    assert fit.status is iccm.Status.BOUNDS and 2.235 < least <= distortion.dilatations.max()
    assert distortion.area @ (distortion.dilatations > 2.236) < 1e-3 * distortion.area.sum()
    assert f"than {least:.3g} (max_dilatation)" in fit.notes[-1]


def test_angles_onto_angles():
    """Two right isosceles triangles that are flattened at two corners: a right angle onto a straight one."""
    z, u = np.array([0, 1, 1 + 1j, 1j]), np.array([0, 1, 0.5 + 0.5j, 1j])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    map = TriangulatedMap(z, u, faces, (np.arange(4),))
    assert angle_ratio(map) == pytest.approx(2)
    least = np.tan(np.pi / 4) / np.tan(np.pi / 8)
    assert least_dilatations(z, u, faces, 4) == pytest.approx([least, least])
