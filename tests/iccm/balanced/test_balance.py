"""`--balance`: the more areas count, the more even they are, and the picture stays as it is turned."""

from itertools import pairwise

import numpy as np
import pytest

import iccm
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


@pytest.mark.parametrize("name", PAIRS)
def test_sizes_become_more_even_and_the_picture_stays_upright(name):
    fits = [iccm.fit(*PAIRS[name], fit="whole", balance=balance) for balance in (0.5, 1.0, 2.0, 4.0, 10.0)]
    uneven = [float(np.average(f.triangles.energies()["area"], weights=f.triangles.area)) for f in fits]
    assert all(after < before for before, after in pairwise(uneven)), uneven
    turns = [fit.distortion.turn for fit in fits[1:]]
    assert np.ptp(turns) < 5 and all(fit.status.ok and fit.certificate.share == 1 for fit in fits)


@pytest.mark.parametrize("name", ["square to Texas"])
def test_a_bound_that_can_be_met_costs_little_elsewhere(name):
    free = iccm.fit(*PAIRS[name], fit="whole").distortion
    found = []
    for share in (0.95, 0.85):
        bound = share * float(free.stretches.max())
        fit = iccm.fit(*PAIRS[name], max_stretch=bound)
        assert fit.status.ok and fit.distortion.stretches.max() <= bound * 1.001
        found.append(fit.distortion)
    for each in found:
        assert each.quantile(each.stretches, 0.95) < 1.1 * free.quantile(free.stretches, 0.95)
