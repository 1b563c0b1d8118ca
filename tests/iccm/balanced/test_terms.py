"""Further terms of the energy: derivatives, effects on maps, directions, and errors in terms."""

import ast
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import iccm
from iccm.balanced import Term, TermOnMesh
from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.balanced.minimise.energy import NO_SLOTS, RestShapes, geometry
from iccm.balanced.minimise.terms import Inverted, MapSides, Oriented, TermsOnMesh
from iccm.balanced.model.energy import Energy
from iccm.curve import Curve
from iccm.linalg.cholesky import system_of
from iccm.options import Options
from iccm.plane import Similarity
from tests.shapes import arrow, circle, ell, pear, refined, star

PAGE = Path(__file__).parents[3] / "docs" / "developers" / "terms.md"


def code_of_page():
    """The code of the page on terms."""
    blocks = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    return "\n".join(blocks)


def definitions_of_page():
    """The classes and functions that the page on terms defines."""
    tree = ast.parse(code_of_page())
    defining = ast.Import | ast.ImportFrom | ast.ClassDef | ast.FunctionDef
    tree.body = [statement for statement in tree.body if isinstance(statement, defining)]
    names = {"__name__": __name__}
    exec(compile(tree, str(PAGE), "exec"), names)
    return names


PAGE_NAMES = definitions_of_page()
ScaleGradient = PAGE_NAMES["ScaleGradient"]


@dataclass(frozen=True)
class Towards(Term):
    """Pull the picture towards an angle, in degrees counter-clockwise."""

    degrees: float
    weight: float = 1.0

    def stencils(self, faces):
        return faces

    def on_mesh(self, rest):
        return TowardsOnMesh(np.radians(self.degrees), self.weight, rest)


class TowardsOnMesh(TermOnMesh):
    """The mean of 1 - cos(arg f_z - φ), half over the source's area and half over the target's."""

    def __init__(self, angle, weight, rest):
        self.angle, self.rest, self.stencils = angle, rest, rest.corners
        self.weights = weight * np.maximum(rest.weights, 0)

    def values(self, u):
        f_z, f_zbar = self.parts(u)
        share = 0.5 * (1 + np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2)
        return self.weights * (1 - np.cos(np.angle(f_z) - self.angle)) * share

    def derivatives(self, u):
        f_z, f_zbar = self.parts(u)
        alpha, x = self.rest.gradients, np.angle(f_z) - self.angle
        share = 0.5 * (1 + np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2)
        by_angle = 1j * (alpha / f_z[:, None]).conj()
        by_share = f_z[:, None] * alpha.conj() - f_zbar[:, None] * alpha
        gradients = (self.weights * np.sin(x) * share)[:, None] * by_angle
        gradients += (self.weights * (1 - np.cos(x)))[:, None] * by_share
        vectors = np.stack([by_angle.real, by_angle.imag], axis=-1)
        curvature = self.weights * share * 0.5 * (1 + np.cos(x))  # never negative
        return gradients, curvature[:, None, None, None, None] * np.einsum("kix,kjy->kijxy", vectors, vectors)

    def parts(self, u):
        alpha, corners = self.rest.gradients, u[self.rest.corners]
        return (alpha * corners).sum(axis=1), (alpha.conj() * corners).sum(axis=1)


@dataclass(frozen=True)
class Directed(Towards):
    """`Towards` with the methods for rotated, mirrored and exchanged shapes."""

    def rotated(self, source, target):
        return replace(self, degrees=self.degrees + np.degrees(np.angle(target / source)))

    def mirrored(self):
        return replace(self, degrees=-self.degrees)

    def inverse(self):
        return replace(self, degrees=-self.degrees)


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


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_page_on_terms_runs_and_its_term_is_lowered():
    names = {"__name__": __name__}
    exec(compile(code_of_page(), str(PAGE), "exec"), names)
    assert names["smooth"].status.ok
    assert sum_of(names["smooth"]) < 0.8 * sum_of(names["plain"])


@pytest.mark.slow
def test_a_term_without_the_methods_for_directions_is_lowered():
    source = np.array([0, 3, 3 + 1j, 1 + 1j, 1 + 3j, 3j])
    target = np.exp(2j * np.pi * np.arange(40) / 40)
    plain, tilted = (
        iccm.fit(source, target, fit="whole", terms=terms) for terms in ((), [Towards(30, weight=4)])
    )
    assert tilted.status.ok
    assert tilt(tilted, 30) < tilt(plain, 30) - 0.01


# Directions: a term without methods for rotated, mirrored and exchanged shapes is computed as if they were as given.

PULL = Towards(25, 0.7)
ROTATIONS = complex(np.exp(0.6j)), complex(np.exp(-1.1j))


def sides_of(z, u, faces):
    return MapSides(
        z,
        u,
        RestShapes(faces, NO_SLOTS, *geometry(z, faces)),
        RestShapes(faces, NO_SLOTS, *geometry(u, faces)),
    )


def changed(z, u, faces, *, mirrored):
    """The map between rotated shapes, mirrored afterwards."""
    z, u = z * ROTATIONS[0], u * ROTATIONS[1]
    return (z.conj(), u.conj(), np.ascontiguousarray(faces[:, ::-1])) if mirrored else (z, u, faces)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_term_without_directions_of_its_own_keeps_its_value_in_rotated_and_mirrored_shapes(mirrored):
    term = PULL.rotated(*ROTATIONS)
    term = term.mirrored() if mirrored else term
    z, u, faces = changed(Z, BENT, FACES, mirrored=mirrored)
    expected = PULL.on_sides(sides_of(Z, BENT, FACES)).values(BENT)
    np.testing.assert_allclose(term.on_sides(sides_of(z, u, faces)).values(u), expected, atol=1e-12)
    rest = RestShapes(faces, NO_SLOTS, *geometry(z, faces))
    np.testing.assert_allclose(term.on_mesh(rest).values(u), expected, atol=1e-12)


@pytest.mark.parametrize("mirrored", [False, True])
def test_such_a_term_is_the_one_that_defines_its_directions(mirrored):
    terms = []
    for term in (PULL, Directed(25, 0.7)):
        rotated = term.rotated(*ROTATIONS)
        terms.append(rotated.mirrored() if mirrored else rotated)
    assert isinstance(terms[0], Oriented) and isinstance(terms[1], Directed)
    z, u, faces = changed(Z, BENT, FACES, mirrored=mirrored)
    given, defined = (term.on_sides(sides_of(z, u, faces)) for term in terms)
    order = [np.argsort(term.stencils, axis=1) for term in (given, defined)]
    assert (np.sort(given.stencils) == np.sort(defined.stencils)).all()
    rows = np.arange(len(faces))[:, None]
    for ours, theirs, block in zip(given.derivatives(u), defined.derivatives(u), (False, True)):
        if block:
            ours, theirs = (
                hessian[rows[:, :, None], k[:, :, None], k[:, None, :]]
                for hessian, k in zip((ours, theirs), order)
            )
        else:
            ours, theirs = (gradient[rows, k] for gradient, k in zip((ours, theirs), order))
        np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_changes_that_cancel_return_the_term():
    s, t = 1j, -1.0
    assert PULL.rotated(1.0, 1.0) is PULL
    assert PULL.mirrored().mirrored() is PULL
    assert PULL.inverse().inverse() is PULL
    assert PULL.rotated(s, t).rotated(-1j, t) is PULL
    assert PULL.mirrored().rotated(s, t) == PULL.rotated(-1j, t).mirrored()
    assert PULL.inverse().rotated(s, t) == PULL.rotated(t, s).inverse()


def test_the_energy_of_the_inverse_is_that_of_the_map():
    for term in (PULL, Directed(25, 0.7), ScaleGradient(0.3)):
        energy = Energy(terms=(term,))
        assert energy.inverse().between(BENT, Z, FACES) == pytest.approx(
            energy.between(Z, BENT, FACES), rel=1e-9
        )


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_energy_in_unit_coordinates_is_that_of_the_given_shapes(mirrored):
    frames = tuple(Similarity(3 * rotation, 1 - 2j, 0.5j, mirrored) for rotation in ROTATIONS)
    z, u = frames[0](Z), frames[1](BENT)
    faces = np.ascontiguousarray(FACES[:, ::-1]) if mirrored else FACES
    for term in (PULL, Directed(25, 0.7)):
        options = Options(terms=(term,))
        forward, back = Energy.of(options), Energy.of(options.inverse())
        for energy, unit in (
            (forward.between(Z, BENT, FACES), forward.in_unit(frames).between(z, u, faces)),
            (back.between(BENT, Z, FACES), back.in_unit(frames[::-1]).between(u, z, faces)),
        ):
            assert unit == pytest.approx(energy, rel=1e-9)


def test_derivatives_of_an_inverted_term_are_those_of_its_sum_and_close_to_those_of_the_map():
    z, faces = triangulate(refined(arrow() / 3, 16), Sizes.even(0.002))
    u = z + 0.12 * z**2 + 0.08 * z.conj()
    sides = sides_of(u, z, faces)  # of the inverse: z moves
    term = PULL.inverse().on_sides(sides)
    assert isinstance(PULL.inverse(), Inverted)
    assert term.values(z).sum() == pytest.approx(PULL.on_sides(sides.inverse()).values(u).sum())
    gradient = np.zeros(z.size, complex)
    slopes, blocks = term.derivatives(z)
    np.add.at(gradient, term.stencils, slopes)
    inwards = Curve(arrow() / 3).distances(z)  # the outline stays, as it does where vertices slide along it
    direction = inwards * (1.3 + np.sin(2 * z) + 0.2j * z.conj())
    slope = (gradient.conj() * direction).real.sum()
    step = 1e-6
    by_term = [term.values(z + h * direction).sum() for h in (step, -step)]
    assert slope == pytest.approx((by_term[0] - by_term[1]) / (2 * step), rel=1e-5)
    exact = [PULL.on_sides(sides_of(z + h * direction, u, faces)).values(u).sum() for h in (step, -step)]
    assert slope == pytest.approx((exact[0] - exact[1]) / (2 * step), rel=1e-3)
    flat = blocks.transpose(0, 1, 3, 2, 4).reshape(len(blocks), 6, 6)
    assert np.linalg.eigvalsh(flat).min() > -1e-12


def test_an_inverted_term_refuses_positions_whose_images_would_fold():
    term = PULL.inverse().on_sides(sides_of(BENT, Z, FACES))
    moved = Z.copy()
    moved[np.argmin(np.abs(Z - Z.mean()))] += 1.0
    assert np.isinf(term.values(moved)).all()


def tilt(fit, degrees):
    """The mean of 1 - cos of the angle between the picture's rotation and the given one, over the source's area."""
    gradients, areas = geometry(fit.map.source, fit.map.faces)
    f_z = (gradients * fit.map.image[fit.map.faces]).sum(axis=1)
    return float(areas @ (1 - np.cos(np.angle(f_z) - np.radians(degrees))) / areas.sum())


def flipped(z):
    """A shape mirrored about the real axis."""
    return z.conj()[::-1]


def pulled(source, target, degrees, **options):
    fit = iccm.fit(source, target, fit="whole", terms=[Towards(degrees)], **options)
    assert fit.status.ok
    return fit


@pytest.fixture(scope="module")
def pulled_pair():
    return pulled(ell(), pear(), 40)


@pytest.mark.slow
def test_a_direction_is_followed_and_the_mirror_image_follows_the_opposite_one(pulled_pair):
    plain = iccm.fit(ell(), pear(), fit="whole")
    assert tilt(pulled_pair, 40) < tilt(plain, 40) - 0.02
    mirrored = pulled(flipped(ell()), flipped(pear()), -40)
    assert tilt(mirrored, -40) == pytest.approx(tilt(pulled_pair, 40), rel=1e-6)
    points = ell().mean() + np.array([0.1, -0.2j, 0.2 + 0.1j])
    np.testing.assert_allclose(mirrored.map(points.conj()), pulled_pair.map(points).conj(), atol=1e-6)


@pytest.mark.slow
def test_methods_for_directions_change_the_speed_and_hardly_the_map(pulled_pair):
    defined = iccm.fit(ell(), pear(), fit="whole", terms=[Directed(40)])
    assert tilt(defined, 40) == pytest.approx(tilt(pulled_pair, 40), abs=0.01)


@pytest.mark.slow
def test_a_rotated_source_follows_the_direction_relative_to_it(pulled_pair):
    """The source is rotated by 30°, the picture rotated back by the same angle, and so is the direction."""
    rotated = pulled(ell() * np.exp(1j * np.pi / 6), pear(), 40 - 30, turn=-30)
    assert tilt(rotated, 40 - 30) == pytest.approx(tilt(pulled_pair, 40), rel=1e-5)


@pytest.mark.slow
def test_similar_shapes_follow_a_direction():
    plain, fit = iccm.fit(arrow(), 2 * arrow(), fit="whole"), pulled(arrow(), 2 * arrow(), 40)
    assert tilt(plain, 40) == pytest.approx(1 - np.cos(np.radians(40)))
    assert tilt(fit, 40) < tilt(plain, 40) - 0.005


@pytest.mark.slow
def test_symmetric_shapes_follow_a_direction_to_either_side():
    shapes = 1j * star(), circle()  # both are symmetric about the vertical axis
    plain = iccm.fit(*shapes, fit="whole")
    for degrees in (40, -40):
        assert tilt(pulled(*shapes, degrees), degrees) < tilt(plain, degrees) - 0.02


def test_terms_without_a_direction_let_symmetric_shapes_be_mapped_by_halves():
    assert Energy(terms=(ScaleGradient(0.3), Directed(0.0))).is_mirror_symmetric
    assert not Energy(terms=(Directed(10.0),)).is_mirror_symmetric
    assert not Energy(terms=(PULL,)).is_mirror_symmetric


@pytest.mark.slow
def test_a_direction_is_followed_with_rigid_regions_of_the_target():
    region = 0.2 * np.exp(2j * np.pi * np.arange(12) / 12)
    options = {"fit": "whole", "rigid_target": [region], "rigid_size": "free", "turn": "any"}
    plain = iccm.fit(ell(), pear(), **options)
    fit = iccm.fit(ell(), pear(), terms=[Towards(40)], **options)
    assert fit.status.ok and fit.rigid[0].is_rigid
    assert tilt(fit, 40) < tilt(plain, 40) - 0.02


@pytest.mark.slow
def test_a_direction_is_followed_where_the_target_has_more_holes():
    hole = 0.2 * np.exp(-2j * np.pi * np.arange(12) / 12) + 0.1
    options = {"fit": "whole", "target_holes": [hole]}
    plain = iccm.fit(ell(), pear(), **options)
    fit = iccm.fit(ell(), pear(), terms=[Towards(40)], **options)
    assert fit.status.ok
    assert tilt(fit, 40) < tilt(plain, 40) - 0.02
