"""Further terms of the energy: derivatives, effects on maps, and errors in terms."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import iccm
from iccm.balanced import Term, TermOnMesh
from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.balanced.minimise.energy import NO_SLOTS, RestShapes, geometry
from iccm.balanced.minimise.terms import TermsOnMesh
from iccm.balanced.model.energy import Energy
from iccm.linalg.cholesky import system_of
from tests.shapes import arrow, ell, pear


def neighbours(faces):
    """The pairs of triangles that share an edge."""
    edges = np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    twice = np.flatnonzero((edges[order[1:]] == edges[order[:-1]]).all(axis=1))
    return order[twice] // 3, order[twice + 1] // 3


@dataclass(frozen=True)
class ScaleGradient(Term):
    """Squared differences of logarithmic area scales between neighbouring triangles."""

    weight: float

    def stencils(self, faces):
        return np.concatenate([faces[k] for k in neighbours(faces)], axis=1)

    def on_mesh(self, shapes):
        return ScaleGradientOnMesh(self.weight, shapes)

    def of_part(self, share):
        return ScaleGradient(self.weight / share)


class ScaleGradientOnMesh(TermOnMesh):
    def __init__(self, weight, shapes):
        self.weight, self.shapes, self.pairs = weight, shapes, neighbours(shapes.corners)
        self.stencils = np.concatenate([shapes.corners[k] for k in self.pairs], axis=1)

    def scales(self, u):
        alpha, corners = self.shapes.gradients, u[self.shapes.corners]
        f_z, f_zbar = (alpha * corners).sum(axis=1), (alpha.conj() * corners).sum(axis=1)
        determinant = np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2
        slope = 2 * (f_z[:, None] * alpha.conj() - f_zbar[:, None] * alpha) / determinant[:, None]
        return np.log(determinant), slope

    def values(self, u):
        scale, _ = self.scales(u)
        return self.weight * (scale[self.pairs[0]] - scale[self.pairs[1]]) ** 2

    def derivatives(self, u):
        scale, slope = self.scales(u)
        difference = scale[self.pairs[0]] - scale[self.pairs[1]]
        by_vertex = np.concatenate([slope[self.pairs[0]], -slope[self.pairs[1]]], axis=1)
        vectors = np.stack([by_vertex.real, by_vertex.imag], axis=-1)
        gradients = 2 * self.weight * difference[:, None] * by_vertex
        return gradients, 2 * self.weight * np.einsum("kix,kjy->kijxy", vectors, vectors)


Z, FACES = triangulate(arrow() / 3, Sizes.even(0.05))
BENT = Z + 0.12 * Z**2 + 0.08 * Z.conj()
PATTERN = system_of(FACES, np.empty(0, np.int64), Z.size, [ScaleGradient(1.0).stencils(FACES)])


def assembled(u, weight=0.3):
    shapes = RestShapes(FACES, NO_SLOTS, *geometry(Z, FACES))
    terms = TermsOnMesh([ScaleGradient(weight).on_mesh(shapes)], PATTERN)
    matrix, gradient = np.zeros((PATTERN.columns.size, 4)), np.zeros(Z.size, complex)
    return terms.add_derivatives(u, matrix, gradient), gradient, matrix


def dense(matrix):
    """The matrix (2n, 2n) given by blocks of the upper triangle, in the order of the vertices."""
    n = Z.size
    result = np.zeros((n, 2, n, 2))
    rows = np.repeat(np.arange(n), np.diff(PATTERN.starts))
    for row, column, block in zip(
        PATTERN.order[rows], PATTERN.order[PATTERN.columns], matrix.reshape(-1, 2, 2)
    ):
        result[row, :, column] = block
        result[column, :, row] = block.T
    return result.reshape(2 * n, 2 * n)


def test_the_gradient_is_that_of_the_sum():
    value, gradient, _ = assembled(BENT)
    assert value > 1e-3
    rng = np.random.default_rng(5)
    direction = rng.normal(size=Z.size) + 1j * rng.normal(size=Z.size)
    ends = [assembled(BENT + h * direction)[0] for h in (1e-6, -1e-6)]
    assert (gradient.conj() * direction).real.sum() == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-6)


def test_blocks_of_the_matrix_are_those_of_all_pairs_of_a_stencil():
    """If all residuals vanish, the Gauss-Newton Hessian is the Hessian, the derivative of the gradient."""
    u = (1.1 + 0.2j) * Z
    _, _, matrix = assembled(u)
    hessian = dense(matrix)
    assert np.linalg.eigvalsh(hessian).min() > -1e-9
    rng = np.random.default_rng(6)
    direction = rng.normal(size=Z.size) + 1j * rng.normal(size=Z.size)
    ends = [assembled(u + h * direction)[1] for h in (1e-6, -1e-6)]
    change = (ends[0] - ends[1]) / 2e-6
    product = (hessian @ np.column_stack([direction.real, direction.imag]).ravel()).reshape(-1, 2)
    assert np.abs(product[:, 0] + 1j * product[:, 1] - change).max() < 1e-5 * np.abs(change).max()


def test_a_pattern_without_the_stencils_of_a_term_is_refused():
    plain = system_of(FACES, np.empty(0, np.int64), Z.size)
    shapes = RestShapes(FACES, NO_SLOTS, *geometry(Z, FACES))
    terms = TermsOnMesh([ScaleGradient(1.0).on_mesh(shapes)], plain)
    with pytest.raises(ValueError, match="stencils"):
        terms.add_derivatives(BENT, np.zeros((plain.columns.size, 4)), np.zeros(Z.size, complex))


def sum_of(fit, weight=1.0):
    z, u, faces = fit.map.source, fit.map.image, fit.map.faces
    z, u = (w / np.sqrt(iccm.curve.Curve(w[fit.map.loops[0]]).area) for w in (z, u))
    shapes = RestShapes(faces, NO_SLOTS, *geometry(z, faces))
    return float(ScaleGradient(weight).on_mesh(shapes).values(u).sum())


def test_a_term_is_lowered_in_the_map():
    plain, smooth = (
        iccm.fit(ell(), pear(), fit="whole", terms=terms) for terms in ((), [ScaleGradient(0.05)])
    )
    assert smooth.status.ok and smooth.report()["injective"]["certified"]
    assert sum_of(smooth) < 0.7 * sum_of(plain)
    energies = [
        Energy(terms=(ScaleGradient(0.05),)).between(f.map.source, f.map.image, f.map.faces)
        for f in (plain, smooth)
    ]
    assert energies[1] < energies[0]
    assert energies[1] == pytest.approx(
        Energy().between(smooth.map.source, smooth.map.image, smooth.map.faces) + sum_of(smooth, 0.05)
    )


def test_the_energy_of_a_half_is_that_of_the_whole():
    """Two mirrored halves have twice the sum of one, and each is scaled by √2."""
    z = np.concatenate([Z, -Z.conj()]) + np.repeat([1.0, -1.0], Z.size)
    faces = np.concatenate([FACES, Z.size + FACES[:, ::-1]])
    u = np.concatenate([BENT, -BENT.conj()])
    energy = Energy(terms=(ScaleGradient(0.3),))
    assert energy.between(z, u, faces) == pytest.approx(
        energy.of_part(0.5).between(Z, BENT, FACES), rel=1e-12
    )


class Broken(ScaleGradient):
    """A term whose derivatives fail."""

    def on_mesh(self, shapes):
        term = super().on_mesh(shapes)
        term.derivatives = lambda u: [][0]
        return term


def test_an_error_in_a_term_is_raised():
    with pytest.raises(IndexError):
        iccm.fit(ell(), pear(), fit="whole", terms=[Broken(0.1)])


def test_objects_that_are_not_terms_are_refused():
    with pytest.raises(iccm.InputError, match=r"terms: .*\b2\b.*Term"):
        iccm.fit(ell(), pear(), terms=[ScaleGradient(0.1), "smooth"])
    with pytest.raises(iccm.InputError, match="terms"):
        iccm.fit(ell(), pear(), method="conformal", terms=[ScaleGradient(0.1)])


@pytest.mark.slow
def test_deformations_have_terms_too():
    pins = [(0.2 + 0.7j, 0.2 + 0.7j), (4 + 0.5j, 4 + 1.8j), (2 + 0.5j, 2 + 0.2j)]
    plain, smooth = (iccm.deform(arrow(), pins=pins, terms=terms) for terms in ((), [ScaleGradient(0.2)]))
    assert smooth.status.ok and sum_of(smooth) < 0.9 * sum_of(plain)


def test_a_term_changes_with_its_weight_alone():
    assert Energy(terms=(ScaleGradient(1.0),)) == Energy(terms=(replace(ScaleGradient(2.0), weight=1.0),))
