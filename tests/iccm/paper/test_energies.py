"""Every energy's matrix compared with its definition, evaluated by Gauss quadrature of Cauchy integrals on random
input.
"""

import numpy as np
import pytest

from iccm.curve import Curve
from iccm.maps import cauchy_green
from iccm.options import Options
from iccm.paper.algorithm1 import assemble
from iccm.paper.energies import (
    Basis,
    closeness,
    closest,
    consistency,
    fixed,
    points,
    quasiconformal,
    smoothness,
    stroke,
)
from iccm.paper.normalised import NormalisedProblem, measure_of
from iccm.problem import Problem
from tests.shapes import CauchyIntegral, arrow, inside, random_polygon, square


def complex_normal(rng, n):
    return rng.normal(size=n) + 1j * rng.normal(size=n)


@pytest.fixture(params=[False, True], ids=["conformal", "harmonic"])
def setting(request):
    """A random polygon, a random harmonic or conformal map on it, and samples of its boundary."""
    return Setting(request.param)


class Setting:
    def __init__(self, harmonic):
        self.rng = np.random.default_rng(5)
        self.polygon = Curve(random_polygon(self.rng, 9))
        self.basis = Basis(self.polygon.z, harmonic)
        self.phi = complex_normal(self.rng, 9)
        self.psi = complex_normal(self.rng, 9) if harmonic else np.zeros(9, complex)
        self.x = self.basis.coefficients(self.phi, self.psi)
        self.z, self.edge = self.polygon.sample(3), np.repeat(np.arange(9), 3)
        self.measure = measure_of(self.polygon, 3)
        # Ψ = conj(C) ψ is the conjugate of the Cauchy integral of conj(ψ)
        self.holomorphic = CauchyIntegral(self.polygon.z, self.phi)
        self.conjugate = CauchyIntegral(self.polygon.z, self.psi.conj())

    def along(self, z, edge):
        """Compute f, f_z, f_z̄ and the second derivatives ∂²Φ, conj(∂²conj Ψ) by quadrature."""
        a = list(self.holomorphic.along(z, edge))
        b = [part.conj() for part in self.conjugate.along(z, edge)]
        return a[0] + b[0], a[1], b[1], a[2], b[2]

    def within(self, z):
        return self.along(z, [None] * z.size)[0]


def test_closeness_is_the_weighted_square_distance_of_the_boundary(setting):
    term = closeness(setting.basis, setting.z, setting.measure, Curve(square()))
    aim = complex_normal(setting.rng, setting.z.size)
    f = setting.along(setting.z, setting.edge)[0]
    expected = np.sum(setting.measure * np.abs(f - aim) ** 2)
    assert term.energy(setting.x, fixed(aim)(f)) == pytest.approx(expected, rel=1e-10)


def test_pins_are_the_mean_square_miss_times_the_weight(setting):
    z = inside(setting.polygon.z, 4)
    aim = complex_normal(setting.rng, 4)
    term = points(setting.basis, z, aim, 2.5)
    expected = 2.5 * np.mean(np.abs(setting.within(z) - aim) ** 2)
    assert term.energy(setting.x, term.follow(z)) == pytest.approx(expected, rel=1e-10)


def test_strokes_are_the_mean_square_distance_to_the_target_stroke(setting):
    z = np.linspace(-0.2, 0.2 + 0.1j, 12)
    goal = Curve(np.array([-1, 0.5j, 1 + 1j]), closed=False)
    term = stroke(setting.basis, z, goal, 0.7)
    image = setting.within(z)
    expected = 0.7 * np.mean([distance(goal, w) ** 2 for w in image])
    assert term.energy(setting.x, term.follow(term.matrix @ setting.x)) == pytest.approx(expected, rel=1e-9)


def distance(curve, w):
    """Distance of a point to a polyline, by brute force over a fine sampling refined twice."""
    s = np.linspace(0, curve.length, 20_001)
    step = s[1]
    for _ in range(3):
        best = s[np.argmin(np.abs(curve.at(s) - w))]
        s, step = np.linspace(best - step, best + step, 2001), step / 1000
    return np.abs(curve.at(s) - w).min()


def test_quasiconformal_energy_is_the_square_of_f_zbar():
    setting = Setting(True)
    term = quasiconformal(setting.basis, setting.z, setting.measure, 0.3)
    f_zbar = setting.along(setting.z, setting.edge)[2]
    expected = 0.3 * np.sum(setting.measure * np.abs(f_zbar) ** 2)
    assert term.energy(setting.x, term.follow(setting.z)) == pytest.approx(expected, rel=1e-9)


def test_smoothness_is_the_square_of_the_second_derivatives(setting):
    """At interior points both are well defined; Φ″ and Ψ″ count separately."""
    z = inside(setting.polygon.z, 12)
    measure = np.full(z.size, 1 / z.size)
    term = smoothness(setting.basis, z, measure, 0.2)
    second = setting.along(z, [None] * z.size)[3:]
    expected = 0.2 * np.mean(sum(np.abs(part) ** 2 for part in second))
    assert term.energy(setting.x, term.follow(z)) == pytest.approx(expected, rel=1e-8)


def test_smoothness_on_the_boundary_is_the_square_of_the_second_derivatives(setting):
    term = smoothness(setting.basis, setting.z, setting.measure, 0.2)
    second = list(setting.along(setting.z, setting.edge))[3:]
    expected = 0.2 * np.sum(setting.measure * sum(np.abs(part) ** 2 for part in second))
    assert term.energy(setting.x, term.follow(setting.z)) == pytest.approx(expected, rel=1e-8)


def test_consistency_is_the_difference_that_coordinates_do_not_reproduce(setting):
    """Values just inside the vertices compared with the coefficients there, separately for Φ and Ψ."""
    n = setting.polygon.z.size
    share = setting.rng.uniform(0.5, 1.5, n) / n
    term = consistency(setting.basis, share, 0.4)
    inner = setting.polygon.z * (1 - 1e-9)  # the random polygons are stars around 0
    defects = []
    for integral, values in ((setting.holomorphic, setting.phi), (setting.conjugate, setting.psi.conj())):
        g = values * (1 - 1e-9)
        whole = [at_vertex(integral, z, v) for z, v in zip(inner, g)]
        defects.append(np.sum(share * np.abs(np.array(whole) - values) ** 2))
    assert term.energy(setting.x, term.follow(share)) == pytest.approx(0.4 * sum(defects), rel=1e-5)


def at_vertex(integral, z, value):
    """The Cauchy integral just inside a vertex, with its value there subtracted, so that the quotient stays bounded."""
    return value + np.sum((integral.g - value) * integral.dw / (2j * np.pi * (integral.w - z)))


def test_consistency_vanishes_for_similarities(setting):
    term = consistency(setting.basis, np.full(9, 1 / 9), 1.0)
    assert term.energy(setting.basis.similarity(2 - 1j, 3), term.follow(setting.z)) < 1e-25


def test_boundary_samples_are_a_quadrature_of_the_boundary_integral():
    """‖f - w‖² over the boundary, per length: the midpoint sums converge to the Gauss quadrature."""
    setting = Setting(False)
    curve, per_edge = setting.polygon, 400
    x, weight = np.polynomial.legendre.leggauss(20)
    t = (x + 1) ** 3 / 16  # graded: f has logarithms at the vertices
    t, weight = np.concatenate([t, 1 - t]), np.tile(weight * 3 / 16 * (x + 1) ** 2, 2)
    z = (curve.z[:, None] + curve.edges[:, None] * t).ravel()
    f = np.abs(setting.along(z, np.repeat(np.arange(9), t.size))[0]) ** 2
    integral = np.sum(f * (curve.lengths[:, None] * weight).ravel()) / curve.length
    samples = curve.sample(per_edge)
    term = closeness(setting.basis, samples, measure_of(curve, per_edge), curve)
    assert term.energy(setting.x, fixed(np.zeros(samples.size, complex))(z)) == pytest.approx(
        integral, rel=1e-4
    )


def test_the_local_step_finds_closest_points_and_unit_normals_there():
    curve = Curve(arrow())
    w = np.random.default_rng(3).uniform(-1, 5, 40) + 1j * np.random.default_rng(4).uniform(-2, 3, 40)
    target = closest(curve, tangent=True)(w)
    assert np.allclose(np.abs(target.points - w), [distance(curve, p) for p in w], atol=1e-6)
    assert np.allclose(np.abs(target.normals), 1)
    assert np.abs(np.angle(target.normals * (w - target.points).conj())).max() < 1e-6
    on = closest(curve, tangent=True)(curve.sample(1))
    assert np.allclose(on.normals, curve.normals)
    assert closest(curve, tangent=False)(w).normals is None


def test_all_terms_of_a_problem_are_assembled_with_their_weights():
    problem = NormalisedProblem.of(
        Problem.of(arrow(), square(), pins=[[1 + 0.5j, 0]], strokes=[([1 + 0.2j, 2 + 0.2j], [0, 0.5])])
    )
    options = Options(
        method="paper", quasi=0.3, pin_weight=2, stroke_weight=3, smoothness=4, consistency=5, order=1
    )
    polygon = problem.source.resample(60)
    terms = assemble(problem, options, Basis(polygon.z, True), polygon)
    weights = {t.name: t.weight for t in terms}
    assert weights == {
        "closeness": 1.0,
        "pins": 2,
        "strokes": 3,
        "quasiconformal": 0.3,
        "smoothness": 4,
        "consistency": 5,
    }
    assert {t.name for t in terms if t.tangent} == {"closeness", "strokes"}
    for term in terms:
        total = 2 if term.name in ("consistency", "smoothness") else 1
        assert term.measure.sum() == pytest.approx(total, rel=1e-12), term.name
    plain = assemble(problem, Options(method="paper"), Basis(polygon.z), polygon)
    assert [t.name for t in plain] == ["closeness", "pins", "strokes"]


def test_the_papers_weights_are_sums_in_the_coordinates_as_given():
    """E = ‖C f̂ - ŵ‖² + β‖C_P f̂ - v̂‖² + ‖conj(D) ψ‖² + α‖D2 f̂‖², with weight one for each sample, relative to the
    squared radius of the target.
    """
    source, target = 30 * arrow() + 5, 7 * square()
    given = Problem.of(source, target, pins=[[35 + 15j, 1], [65 + 15j, 2]])
    problem = NormalisedProblem.of(given, as_begun=True)
    options = Options(method="paper", quasi=0.3, pin_weight=2, smoothness=4, literal=True)
    polygon, n = Curve(problem.source.z), source.size
    terms = {t.name: t for t in assemble(problem, options, Basis(polygon.z, True), polygon)}
    rng = np.random.default_rng(2)
    phi, psi = complex_normal(rng, n), complex_normal(rng, n)
    f = problem.in_plane(polygon.z, phi, psi)
    radius = 1 / abs(problem.target_frame.factor)

    def energy(name, aim=0):
        term = terms[name]
        goal = np.full(term.matrix.shape[0], problem.target_frame(aim) if aim else 0)
        return radius**2 * term.energy(np.concatenate([phi, psi]), fixed(goal)(goal))

    world = Curve(problem.source_frame.pull_back(polygon.z))
    z = world.sample(1)
    assert energy("closeness", 1j) == pytest.approx(np.sum(np.abs(f(world.z) - 1j) ** 2))
    assert energy("pins", 1j) == pytest.approx(
        2 * np.sum(np.abs(f(np.array([35 + 15j, 65 + 15j])) - 1j) ** 2)
    )
    assert energy("quasiconformal") == pytest.approx(0.3 * np.sum(np.abs(f.derivatives(z)[1]) ** 2))
    d2 = cauchy_green.second_derivatives(world.z, world.sample(1))
    bends = np.concatenate([d2 @ f.phi, d2 @ f.psi.conj()])
    assert energy("smoothness") == pytest.approx(4 * np.sum(np.abs(bends) ** 2))
