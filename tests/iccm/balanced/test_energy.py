"""The energy: identities, and derivatives against finite differences."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.balanced.minimise import energy
from iccm.balanced.minimise.energy import Objective, RestShapes
from iccm.balanced.model.measures import derivatives, stretch_quantile
from iccm.linalg.cholesky import system_of
from iccm.maps.distortion import Distortion

ANGLES = 2 * np.pi * np.arange(16) / 16
OUTLINE = np.exp(1j * ANGLES) / np.sqrt(np.pi)
Z, FACES = triangulate(OUTLINE, Sizes.even(0.05))
SYSTEM = system_of(FACES, (np.arange(16) + 1) % 16, Z.size)
REST = RestShapes.of(SYSTEM, *energy.geometry(Z, SYSTEM.corners))
BENT = Z + 0.15 * Z**2 + 0.1 * Z.conj()
POWERS = [(1.0, 1.0), (1.0, 3.0), (0.5, 1.0), (2.0, 4.0), (0.1, 2.0)]


def assembled(u, theta=1.0, q=1.0, epsilon=0.0):
    matrix, gradient = np.empty((SYSTEM.columns.size, 4)), np.empty(u.size, complex)
    value = energy.assemble(REST, u, Objective(theta, q, 0.5, epsilon), matrix, gradient)
    return value, gradient, matrix


def times(matrix, w):
    """The product of the symmetric block matrix with a plane vector per vertex."""
    rows = np.repeat(np.arange(w.size), np.diff(SYSTEM.starts))
    blocks, order = matrix.reshape(-1, 2, 2), np.argsort(SYSTEM.position)
    x = np.stack([w.real, w.imag], axis=1)[order]
    y = np.zeros_like(x)
    np.add.at(y, rows, np.einsum("pij,pj->pi", blocks, x[SYSTEM.columns]))
    off = rows != SYSTEM.columns
    np.add.at(y, SYSTEM.columns[off], np.einsum("pji,pj->pi", blocks[off], x[rows[off]]))
    return (y[:, 0] + 1j * y[:, 1])[SYSTEM.position]


@pytest.mark.parametrize(("theta", "q"), POWERS)
def test_a_map_and_its_inverse_have_the_same_energy(theta, q):
    forward, back = energy.energy_of(Z, BENT, FACES, theta, q), energy.energy_of(BENT, Z, FACES, theta, q)
    assert forward > 1.01 and forward == pytest.approx(back, rel=1e-12)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.01, 100), st.floats(-3.2, 3.2), st.floats(-10, 10))
def test_a_similarity_has_energy_one(scale, angle, shift):
    u = scale * np.exp(1j * angle) * Z + shift
    assert energy.energy_of(Z, u, FACES, 1.0, 3.0) == pytest.approx(1, abs=1e-9)


def test_no_map_has_less_than_one():
    rng = np.random.default_rng(0)
    for _ in range(20):
        u = Z + 0.02 * (rng.standard_normal(Z.size) + 1j * rng.standard_normal(Z.size))
        assert energy.energy_of(Z, u, FACES) >= 1


def test_an_affine_map_by_hand():
    stretched = 2.0  # singular values √2 and 1/√2 at determinant 1
    u = np.sqrt(stretched) * Z.real + 1j * Z.imag / np.sqrt(stretched)
    p = 0.5 * (stretched + 1 / stretched)
    assert energy.energy_of(Z, u, FACES, 1.0, 3.0) == pytest.approx(p**3, rel=1e-12)
    half = energy.total(REST, 0.5 * Z, Objective(2.0, 1.0, 0.5, 0.0))  # d = 1/4
    assert half / REST.weights.sum() == pytest.approx((0.5 * (0.25 + 4)) ** 2 * 0.5 * 1.25, rel=1e-12)


def test_a_fold_is_infinite_but_not_while_untangling():
    u = BENT.copy()
    u[-1] += 3
    assert energy.total(REST, u, Objective(1.0, 1.0, 0.5, 0.0)) == np.inf
    assert np.isfinite(energy.total(REST, u, Objective(1.0, 1.0, 0.5, 0.1)))


@pytest.mark.parametrize(("theta", "q", "epsilon"), [(*p, 0.0) for p in POWERS] + [(1.0, 1.0, 0.3)])
def test_the_gradient_is_that_of_the_energy(theta, q, epsilon):
    value, gradient, _ = assembled(BENT, theta, q, epsilon)
    assert value == pytest.approx(energy.total(REST, BENT, Objective(theta, q, 0.5, epsilon)))
    rng = np.random.default_rng(3)
    for _ in range(3):
        direction = rng.standard_normal(Z.size) + 1j * rng.standard_normal(Z.size)
        ends = [
            energy.total(REST, BENT + h * direction, Objective(theta, q, 0.5, epsilon)) for h in (1e-6, -1e-6)
        ]
        assert np.sum((gradient.conj() * direction).real) == pytest.approx(
            (ends[0] - ends[1]) / 2e-6, rel=1e-5
        )


@pytest.mark.parametrize(("theta", "q"), [(1.0, 1.0), (1.0, 3.0), (2.0, 4.0)])
def test_the_hessian_is_that_of_the_gradient_where_nothing_is_projected(theta, q):
    u = 1.3 * Z.real + 1.2j * Z.imag  # stretched in both directions: all eigenvalues are positive
    _, _, matrix = assembled(u, theta, q)
    rng = np.random.default_rng(4)
    direction = rng.standard_normal(Z.size) + 1j * rng.standard_normal(Z.size)
    ends = [assembled(u + h * direction, theta, q)[1] for h in (1e-6, -1e-6)]
    expected = (ends[0] - ends[1]) / 2e-6
    assert np.abs(times(matrix, direction) - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("epsilon", [0.0, 0.2])
def test_the_projected_hessian_is_positive(epsilon):
    u = BENT.copy()
    if epsilon:
        u[-1] += 0.5
    _, _, matrix = assembled(u, epsilon=epsilon)
    rng = np.random.default_rng(5)
    for _ in range(50):
        direction = rng.standard_normal(Z.size) + 1j * rng.standard_normal(Z.size)
        assert np.sum((direction.conj() * times(matrix, direction)).real) > 0


def test_the_gradient_by_the_sources_area_alone():
    matrix, gradient = np.empty((SYSTEM.columns.size, 4)), np.empty(Z.size, complex)
    energy.assemble(REST, BENT, Objective(1.0, 3.0, 0.0, 0.0), matrix, gradient)
    direction = np.exp(1j * np.arange(Z.size))
    ends = [energy.total(REST, BENT + h * direction, Objective(1.0, 3.0, 0.0, 0.0)) for h in (1e-6, -1e-6)]
    assert np.sum((gradient.conj() * direction).real) == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5)


def test_the_stretch_of_a_share_counts_both_areas():
    """Two halves of a source, one of which has three times the area of the other in the image."""
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    z = np.array([0, 4, 4 + 2j, 2j]) / np.sqrt(8)
    u = np.array([0, 4, 4 + 2j, 6j]) / 4
    large = np.linalg.svd([[1, 0], [-1, 3]], compute_uv=False)[0] / np.sqrt(2)
    quantiles = [stretch_quantile(z, u, faces, share) for share in (0.36, 0.39)]  # (1/2 + 1/4)/2 are kept
    assert quantiles == pytest.approx([np.sqrt(2), large])


@pytest.mark.parametrize("theta", [0.3, 1.0, 2.5])
def test_the_figures_of_a_map_show_the_energy_that_is_minimised(theta):
    """The report's energies, computed by NumPy, and the solver's density, half of it weighted by the source's area."""
    f_z, f_zbar, areas = derivatives(Z, BENT, FACES)
    images = areas * (np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2)
    scale = float(np.sqrt(images.sum() / areas.sum()))
    total = Distortion(images, f_z, f_zbar, scale).energies(theta)["total"]
    mean = 0.5 * (np.average(total, weights=areas) + np.average(total, weights=images))
    assert mean == pytest.approx(energy.energy_of(Z, BENT, FACES, theta), rel=1e-12)
