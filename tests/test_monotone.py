"""Our own copies of two of scipy's methods, held against scipy's."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.optimize import minimize

from iccm.monotone import Monotone
from iccm.simplex import descend


@pytest.mark.parametrize("seed", range(20))
def test_the_interpolant_is_scipys(seed):
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.uniform(1e-3, 1, rng.integers(3, 40)))
    y = rng.normal(size=x.size).round(1) if seed % 2 else np.cumsum(rng.uniform(0, 1, x.size) ** 9)
    at = np.concatenate([x, rng.uniform(x[0] - 0.1, x[-1] + 0.1, 500)])
    assert np.allclose(Monotone(x, y)(at), PchipInterpolator(x, y)(at), rtol=1e-12, atol=1e-12)


def test_it_rises_where_the_values_rise():
    x = np.array([0, 1e-9, 1, 1.1, 5])
    y = np.array([0, 1, 1 + 1e-12, 9, 9])
    assert np.all(np.diff(Monotone(x, y)(np.linspace(0, 5, 10_000))) >= -1e-12)


@pytest.mark.parametrize("most", [20, 60, 250, 2000])
@pytest.mark.parametrize(
    "f",
    [
        lambda x: (1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2 + (x[2] - x[0]) ** 2,
        lambda x: float(np.abs(x - [1, 2, 3]).sum()),
        lambda x: float(np.cos(3 * x).sum() + 0.1 * x @ x),
    ],
)
def test_the_descent_is_scipys(f, most):
    simplex = np.array([[0, 0, 0.5], [0.3, 0, 0.5], [0, 0.3, 0.5], [0, 0, 0.7]])
    options = {"maxfev": most, "xatol": 1e-5, "fatol": 1e-7, "initial_simplex": simplex}
    theirs = minimize(f, simplex[0], method="Nelder-Mead", options=options)
    place, value = descend(f, simplex, most=most, near=1e-5, level=1e-7)
    assert abs(value - theirs.fun) <= 1e-9 + 0.02 * abs(theirs.fun)
    if theirs.success:
        assert np.allclose(place, theirs.x, atol=1e-9)
