"""Soft pins: springs for patches, their derivatives and limits, and the resulting maps."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest

import iccm
from iccm.balanced.interactive import Live
from iccm.balanced.minimise.soft_pins import QUADRATURE, SoftPins, Spring
from iccm.balanced.model.energy import Energy
from iccm.balanced.search import final_mesh
from iccm.options import Options
from iccm.pins import RADIUS_PIN_DISTANCES, RADIUS_SHARE, Pin, Softness, choose_radii
from tests import shapes

TURNS = np.exp(2j * np.pi * np.arange(60) / 60)
EGG = 60 * TURNS.real * (1 + 0.2 * TURNS.imag) + 80j * TURNS.imag
PEAR = 70 * TURNS.real * (1 + 0.15 * np.cos(3 * np.angle(TURNS))) + 65j * TURNS.imag + 4 * TURNS.real
STAR = (50 + 22 * np.cos(5 * np.angle(TURNS) + 0.3)) * TURNS
BEAN = (55 + 9 * np.cos(2 * np.angle(TURNS) + 0.5) + 6 * np.cos(3 * np.angle(TURNS))) * TURNS
PINS = np.array([[-20 + 20j, -27 + 24j], [22 + 18j, 30 + 27j], [1 - 30j, -3 - 41j]])
PROBES = np.array([10 + 10j, -20 - 30j, 30 + 3j, -31 + 33j])
DIAGONAL = 195.0


def triangles(count, seed=3):
    """A Delaunay mesh of scattered points in a square, and a smooth image of it without folds."""
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(seed)
    side = int(np.sqrt(count))
    steps = np.linspace(-0.5, 0.5, side)
    grid = np.stack(np.meshgrid(steps, steps), -1).reshape(-1, 2)
    inside = (np.abs(grid) < 0.499).all(axis=1)
    mesh = Delaunay(grid + 0.3 / side * inside[:, None] * rng.uniform(-1, 1, grid.shape))
    z = mesh.points[:, 0] + 1j * mesh.points[:, 1]
    faces = mesh.simplices.astype(np.int64)
    crossed = (z[faces[:, 1]] - z[faces[:, 0]]).conj() * (z[faces[:, 2]] - z[faces[:, 0]])
    faces[crossed.imag < 0] = faces[crossed.imag < 0][:, ::-1]
    return z, z * (1.1 + 0.2j) + 0.15 * z**2 + 0.1 * z.conj(), faces


def some_pins(**changed):
    options = {
        "source": np.array([0.1 + 0.05j, -0.2 - 0.15j]),
        "target": np.array([0.2 + 0.15j, -0.25 - 0.1j]),
        "radii": np.array([0.3, 0.2]),
        "limits": np.array([0.1, 0.2]),
        "springs": np.array([7.0, 11.0]),
        "derivative_spring": 3.0,
        "stiffness": 8.0,
        "rotations": np.array([0.4, np.nan]),
        "scales": np.array([np.nan, 0.8]),
    }
    return SoftPins(**options | changed)


@pytest.mark.parametrize("forward", [True, False])
@pytest.mark.parametrize("inverted", [False, True])
def test_derivatives_agree_with_differences(forward, inverted):
    z, u, faces = triangles(300)
    z, u = (u, z) if inverted else (z, u)
    pins = some_pins(inverted=inverted)
    springs = pins.springs_on_mesh(z, u, faces, pins.cores(z, u, faces), 3.0, forward=forward)
    assert len(springs) == 4  # two places, a rotation and a scale
    moving, step = (u if forward else z), 1e-6
    for spring in springs:
        gradients, hessians = spring.derivatives(moving)
        vertices = spring.stencils[0]
        for number in (0, vertices.size // 2):
            for direction in (1, 1j):
                ahead, behind = moving.copy(), moving.copy()
                ahead[vertices[number]] += step * direction
                behind[vertices[number]] -= step * direction
                slope = (spring.values(ahead) - spring.values(behind)).sum() / (2 * step)
                assert slope == pytest.approx((gradients[0, number] * np.conj(direction)).real, abs=1e-6)
                change = (spring.derivatives(ahead)[0] - spring.derivatives(behind)[0])[0] / (2 * step)
                column = hessians[0, :, number] @ [direction.real, np.imag(direction)]
                assert np.allclose(change, column[:, 0] + 1j * column[:, 1], atol=1e-5)


def test_a_map_and_its_inverse_have_the_same_springs():
    z, u, faces = triangles(400)
    pins = some_pins(rotations=np.full(2, np.nan), scales=np.full(2, np.nan))
    cores = pins.cores(z, u, faces)
    forward = pins.springs_on_mesh(z, u, faces, cores, 1.0, forward=True)
    back = pins.inverse().springs_on_mesh(u, z, faces, cores, 1.0, forward=False)
    for springs, inverse_springs in zip(forward, back):
        assert (
            springs.values(u)[0] == pytest.approx(inverse_springs.values(u)[0], rel=1e-9)
            and springs.values(u)[0] > 1e-3
        )
    assert np.allclose(pins.multipliers(z, u, faces), pins.inverse().multipliers(u, z, faces))
    assert np.array_equal(pins.inverse().pairs, pins.pairs[:, ::-1])


def test_a_similarity_that_meets_the_pins_costs_nothing():
    z, _, faces = triangles(500)
    factor = 0.9 * np.exp(0.4j)
    source = np.array([0.1 + 0.05j, -0.2 - 0.15j])
    pins = some_pins(
        source=source,
        target=factor * source + 2j,
        rotations=np.full(2, 0.4),
        scales=np.array([0.9, np.nan]),
    )
    u = factor * z + 2j
    for forward in (True, False):
        springs = pins.springs_on_mesh(z, u, faces, pins.cores(z, u, faces), 1.0, forward=forward)
        moving = u if forward else z
        assert sum(spring.values(moving)[0] for spring in springs) < 1e-24


@pytest.mark.parametrize("forward", [True, False])
def test_a_pin_at_a_vertex_of_a_mesh_much_coarser_than_its_patch_has_a_derivative(forward):
    z, _, faces = triangles(100)
    factor = 0.9 * np.exp(0.4j)
    source = z[np.argsort(np.abs(z))[:2]]
    pins = some_pins(source=source, target=factor * source, radii=np.full(2, 0.01), scales=np.full(2, 0.9))
    u = factor * z
    springs = pins.springs_on_mesh(z, u, faces, pins.cores(z, u, faces), 1.0, forward=forward)
    assert sum(spring.values(u if forward else z)[0] for spring in springs) < 1e-24


def test_patches_count_more_by_an_integral_that_does_not_depend_on_the_mesh():
    radius, stiffness = 0.2, 8.0
    pins = some_pins(source=np.array([0.03 - 0.06j]), target=np.zeros(1), radii=np.array([radius]))
    integrals = []
    for count in (500, 2000, 8000):
        z, u, faces = triangles(count)
        areas = (
            np.abs(((z[faces[:, 1]] - z[faces[:, 0]]).conj() * (z[faces[:, 2]] - z[faces[:, 0]])).imag) / 2
        )
        integrals.append(areas @ (pins.multipliers(z, u, faces) - 1))
    exact = (stiffness - 1) * np.pi * radius**2 / 3  # the integral of (1 - ρ²)² over a disc
    errors = np.abs(np.array(integrals) / exact - 1)
    assert errors[-1] < 2e-3 and errors[-1] < errors[0]
    assert np.allclose(QUADRATURE.sum(axis=1), 1)


def test_the_energy_between_two_vertex_sets_includes_the_springs():
    z, u, faces = triangles(400)
    u = u / np.sqrt(_areas(u, faces).sum())
    assert _areas(u, faces).min() > 0
    pins = some_pins(rotations=np.full(2, np.nan), scales=np.full(2, np.nan))
    plain, pinned = Energy().between(z, u, faces), Energy(pins=pins).between(z, u, faces)
    springs = pins.springs_on_mesh(z, u, faces, pins.cores(z, u, faces), 1.0, forward=True)
    assert pinned - plain == pytest.approx(sum(spring.values(u)[0] for spring in springs))
    assert all(isinstance(spring, Spring) for spring in springs)


def _areas(z, faces):
    a, b, c = z[faces].T
    return ((b - a).conj() * (c - a)).imag / 2


@pytest.mark.slow
def test_pins_come_close_and_maps_stay_smooth():
    soft = iccm.fit(EGG, PEAR, pins=PINS)
    exact = iccm.fit(EGG, PEAR, pins=PINS, exact_pins=True)
    free = iccm.fit(EGG, PEAR)
    assert soft.status.ok and soft.report()["injective"]["certified"]
    missed, before = (np.abs(fit.map(PINS[:, 0]) - PINS[:, 1]) / DIAGONAL for fit in (soft, free))
    assert 1e-6 < missed.max() < 0.05 and missed.max() < 0.5 * before.max()
    assert np.abs(exact.map(PINS[:, 0]) - PINS[:, 1]).max() < 1e-9 * DIAGONAL
    worst = [np.max(fit.distortion.stretches) for fit in (soft, exact)]
    assert worst[0] < 0.8 * worst[1]
    assert any("exact_pins" in note for note in soft.notes)
    still = iccm.deform(EGG, pins=[(10 + 5j, 10 + 5j)])
    assert not any("exact_pins" in note for fit in (exact, still) for note in fit.notes)


@pytest.mark.slow
def test_smaller_tolerances_bring_pins_closer():
    missed = []
    for tolerance in (12.0, 4.0, 1.5):
        pins = [iccm.Pin(*pin, radius=10, tolerance=tolerance) for pin in PINS]
        missed.append(np.abs(iccm.fit(EGG, PEAR, pins=pins).map(PINS[:, 0]) - PINS[:, 1]).max())
    assert missed == sorted(missed, reverse=True)
    assert missed[-1] < 0.2 * missed[0]


@pytest.mark.slow
def test_a_radius_of_zero_is_exact_for_that_pin_alone():
    pins = [iccm.Pin(*PINS[0], radius=0), iccm.Pin(*PINS[1]), PINS[2].tolist()]
    fit = iccm.fit(EGG, PEAR, pins=pins)
    missed = np.abs(fit.map(PINS[:, 0]) - PINS[:, 1])
    assert missed[0] < 1e-9 * DIAGONAL < missed[1]


@pytest.mark.slow
@pytest.mark.parametrize("target", [PEAR, STAR], ids=["pear", "star"])
def test_a_patch_is_rotated_and_scaled_as_requested(target):
    pins = [iccm.Pin(PINS[0, 0], PINS[0, 1] / 2, radius=14, turn=35, scale=0.7)]
    fit = iccm.fit(EGG, target, pins=pins, turn="any")
    circle = PINS[0, 0] + 3 * TURNS
    derivative = np.vdot(3 * TURNS, fit.map(circle)) / (9 * TURNS.size)
    mean = np.sqrt(iccm.Curve(target).area / iccm.Curve(EGG).area)
    assert np.degrees(np.angle(derivative)) == pytest.approx(35, abs=6)
    assert abs(derivative) / mean == pytest.approx(0.7, abs=0.08)


@pytest.mark.slow
def test_a_map_does_not_depend_on_the_frame():
    base = iccm.fit(EGG, PEAR, pins=PINS).map(PROBES)
    factor, shift = 3 * np.exp(0.7j), 500 - 80j
    moved = iccm.fit(factor * EGG + shift, PEAR, pins=PINS * [factor, 1] + [shift, 0], turn="any")
    assert np.abs(moved.map(factor * PROBES + shift) - base).max() < 2e-3 * DIAGONAL
    bent = iccm.fit(BEAN, PEAR, pins=PINS / 2).map(PROBES / 2)
    mirrored = iccm.fit(BEAN.conj()[::-1], PEAR.conj()[::-1], pins=PINS.conj() / 2)
    assert np.abs(mirrored.map(PROBES.conj() / 2).conj() - bent).max() < 1e-6 * DIAGONAL


def test_noise_in_the_outline_hardly_moves_a_deformation():
    corners = np.exp(2j * np.pi * np.arange(6) / 6) * [1, 1, 1, 1, 1, 1.2]
    pins = np.array(
        [
            [0.5 + 0.1j, 0.9 + 0.5j],
            [-0.5 + 0.2j, -0.6 - 0.1j],
            [0.1 - 0.5j, 0.3 - 0.4j],
            [0.05 + 0.55j, -0.1 + 0.9j],
        ]
    )
    probes = np.array([0.2 + 0.2j, -0.3 - 0.3j, 0.4 - 0.1j])
    noisy = corners.copy()
    noisy[2] += 1e-6 * (1 + 0.7j)
    moved = iccm.deform(noisy, pins=pins).map(probes) - iccm.deform(corners, pins=pins).map(probes)
    assert np.abs(moved).max() < 1e-4


@pytest.mark.slow
def test_deformations_converge_as_meshes_are_refined(monkeypatch):
    """For maps onto a target, this would only measure the correspondence of the outlines, which depends on their
    vertices.
    """

    def steps(**options):
        images = []
        for triangle_count in (1500, 6000, 24000):
            monkeypatch.setattr("iccm.balanced.deform.method.FINAL_TRIANGLES", triangle_count)
            images.append(iccm.deform(EGG, pins=PINS, **options).map(PROBES))
        return [np.abs(after - before).max() / DIAGONAL for before, after in pairwise(images)]

    soft, exact = steps(), steps(exact_pins=True)
    assert max(soft) < 4e-4 and soft[1] < 0.3 * exact[1]


def test_radii_leave_room():
    source, target = iccm.Curve(EGG), iccm.Curve(PEAR)
    size = np.sqrt(source.area)
    alone = choose_radii(source, target, ((), ()), np.array([[0, 0]], complex))
    assert alone == pytest.approx([RADIUS_SHARE * size])
    close = choose_radii(source, target, ((), ()), np.array([[0, 0], [9, 30j]], complex))
    assert close == pytest.approx([9 * RADIUS_PIN_DISTANCES] * 2)
    deformed = choose_radii(
        source, None, ((), ()), np.array([[0, 5], [40j, 5]], complex)
    )  # the same place for both
    assert deformed == pytest.approx([RADIUS_SHARE * size] * 2)


@pytest.mark.slow
def test_a_pin_far_from_its_goal_is_reported_by_the_status():
    corners = np.array(
        [[-20, -30j], [20, 30j], [-25j, 25], [25j, -25]]
    )  # of a square: a reflection, not a rotation
    mirrored = corners.copy()
    mirrored[:, 1] = corners[:, 0].conj() * 1j
    pins = [iccm.Pin(*pin, tolerance=1.0) for pin in mirrored]
    fit = iccm.fit(EGG, PEAR, pins=pins)
    assert fit.status is iccm.Status.PINS
    assert np.abs(fit.map(mirrored[:, 0]) - mirrored[:, 1]).max() > 1.05


@pytest.mark.slow
def test_pins_that_would_miss_their_places_are_exact():
    """Two points side by side, drawn to both ends of a bar: no patch that keeps its form gets there."""
    bar = np.array([0, 2, 2 + 1j, 1j])
    pins = np.array([[0.5 + 0.5j, 0.3 + 0.5j], [0.62 + 0.5j, 1.7 + 0.5j]])
    fit = iccm.fit(bar, bar, pins=pins)
    assert fit.status.ok and fit.certificate.certified and not fit.details.softness.is_soft.all()
    exact = ~fit.details.softness.is_soft
    assert np.abs(fit.map(pins[exact, 0]) - pins[exact, 1]).max() < 1e-9
    assert any(f"{np.flatnonzero(exact)[0] + 1}" in note and "exactly, because" in note for note in fit.notes)
    soft = iccm.fit(bar, bar, pins=[iccm.Pin(start, end, radius=0.1) for start, end in pins])
    assert (
        soft.details.softness.is_soft.all() and soft.status is iccm.Status.PINS
    )  # their radius was asked for


def test_a_deformation_follows_its_pins_to_any_distance():
    pins = np.array([[-20, -20], [20, 130 + 60j]])
    fit = iccm.deform(EGG, pins=pins)
    tolerance = 0.01 * np.sqrt(iccm.Curve(EGG).area)
    assert fit.status.ok and np.abs(fit.map(pins[:, 0]) - pins[:, 1]).max() < 3 * tolerance


@pytest.mark.parametrize(
    "changed", [{"radius": -1.0}, {"tolerance": 0.0}, {"scale": -0.5}, {"turn": np.inf}, {"radius": np.nan}]
)
def test_settings_out_of_range_are_refused(changed):
    (name,) = changed
    with pytest.raises(iccm.InputError, match=name):
        iccm.Pin(0, 1, **changed)


def test_settings_are_refused_where_they_have_no_effect():
    pins = [iccm.Pin(*PINS[0], radius=5)]
    with pytest.raises(iccm.InputError, match="pin"):
        iccm.fit(EGG, PEAR, pins=pins, method="conformal")


@pytest.mark.slow
def test_a_huge_patch_makes_the_shape_stiff_and_no_more():
    fit = iccm.fit(EGG, PEAR, pins=[iccm.Pin(*PINS[0], radius=1e9)])
    usual = iccm.fit(EGG, PEAR, pins=[iccm.Pin(*PINS[0])])
    assert fit.status.ok and np.abs(fit.map(PROBES) - usual.map(PROBES)).max() < 0.1 * DIAGONAL
    pins = some_pins(radii=np.array([1e9, 0.2]))
    z, u, faces = triangles(2000)
    large, small = pins.cores(z, u, faces)
    assert large.size < 0.1 * z.size and small.size < large.size


LINE = np.array([-0.5 - 0.1j, 0, 0.5 + 0.05j])


def dilatations_along(fit, line):
    """Dilatations of a map at points around a polyline."""
    share = np.linspace(0, 1, 100)
    z = np.interp(share, np.linspace(0, 1, line.size), line.real) + 1j * np.interp(
        share, np.linspace(0, 1, line.size), line.imag
    )
    _, p, q = fit.map.jet(z + 0.04j)[:3]
    return (np.abs(p) + np.abs(q)) / (np.abs(p) - np.abs(q))


@pytest.mark.slow
def test_the_surroundings_of_a_wide_stroke_keep_their_form():
    source, target = shapes.pear(), shapes.blob()
    goal = iccm.fit(source, target).map(LINE) + np.array([0, 0.12j, 0])
    bare, wide = (
        iccm.fit(source, target, strokes=[iccm.Stroke(LINE, goal, width=width)]) for width in (0, 0.3)
    )
    plain = iccm.fit(source, target, strokes=[(LINE, goal)])
    assert np.array_equal(plain.map.image, bare.map.image)
    assert wide.status.ok and wide.map.injectivity.certified
    middle = [np.median(dilatations_along(fit, LINE)) for fit in (bare, wide)]
    assert middle[1] - 1 < 0.5 * (middle[0] - 1)
    error = [fit.report()["strokes"][0]["error"] for fit in (bare, wide)]
    assert max(error) < 2e-3


def test_wide_strokes_bend_a_shape_without_a_target():
    bar = np.array([0, 4, 4 + 1j, 1j])
    line, goal = np.array([0.5 + 0.5j, 2 + 0.5j, 3.5 + 0.5j]), np.array([0.5 + 0.5j, 2 + 1.2j, 3.5 + 0.5j])
    bare, wide = (iccm.deform(bar, strokes=[iccm.Stroke(line, goal, width=width)]) for width in (0, 0.5))
    assert wide.status.ok
    assert np.median(dilatations_along(wide, line)) < np.median(dilatations_along(bare, line))


@pytest.mark.parametrize(
    ("width", "options", "message"),
    [(-1.0, {}, "width"), (np.nan, {}, "width"), (0.3, {"method": "conformal"}, "balanced")],
)
def test_invalid_widths_are_refused(width, options, message):
    with pytest.raises(iccm.InputError, match=message):
        iccm.fit(shapes.pear(), shapes.pear(), strokes=[iccm.Stroke(LINE, LINE, width=width)], **options)


def test_a_pin_on_the_outline_has_no_rotation():
    square = np.array([0, 2, 2 + 1j, 1j])
    with pytest.raises(iccm.InputError, match=r"pin 2.*turn"):
        iccm.fit(square, square, pins=[iccm.Pin(1 + 0.5j, 1.1 + 0.5j), iccm.Pin(1, 1, turn=20)])


@pytest.mark.slow
def test_a_pin_pulled_far_is_met_within_its_tolerance():
    source, target = shapes.pear(), shapes.blob()
    point = 0.2 + 0.1j
    goal = iccm.fit(source, target).map(np.array([point]))[0] - 0.7
    fit = iccm.fit(source, target, pins=[iccm.Pin(point, goal, tolerance=0.02)])
    assert fit.status.ok and fit.details.softness.tolerances[0] == 0.02
    assert abs(fit.map(np.array([point]))[0] - goal) < 0.021
    assert fit.report()["pins"][0]["tolerance"] == pytest.approx(0.02 / fit._diagonal)


@pytest.mark.slow
def test_a_saved_map_knows_how_its_pins_hold(tmp_path):
    square = np.array([0, 2, 2 + 1j, 1j])
    fit = iccm.fit(
        square,
        1.5 * square,
        pins=[iccm.Pin(1 + 0.5j, 1.6 + 0.7j), iccm.Pin(0.4 + 0.5j, 0.6 + 0.75j, radius=0)],
    )
    fit.save(tmp_path / "m.npz")
    again = iccm.load(tmp_path / "m.npz")
    for name in ("radii", "tolerances", "rotations", "scales", "limits"):
        assert np.array_equal(
            getattr(again.details.softness, name), getattr(fit.details.softness, name), equal_nan=True
        ), name
    assert again.report()["pins"] == fit.report()["pins"]


@dataclass
class Pulled:
    """Stands for a map after some rounds of stiffer springs, by the errors and the energy that it has."""

    misses: list[float]
    values: list[float]
    rounds: int = 0

    z = u = faces = None

    @property
    def energy(self):
        return SimpleEnergy(SimplePins(self.misses[self.rounds]))

    @property
    def value(self):
        return self.values[self.rounds]

    def with_energy(self, energy):
        return replace(self, rounds=self.rounds + 1)


@dataclass
class SimplePins:
    miss: float
    source = limits = np.ones(1)

    def misses(self, z, u, faces):
        return np.array([self.miss])

    def stiffer(self, factors):
        return self


@dataclass
class SimpleEnergy:
    pins: SimplePins


@pytest.mark.parametrize(
    ("misses", "values", "rounds"),
    [
        ([9, 5, 2, 0.9, 0.5], [1, 1, 2, 4, 9], 3),  # met
        ([9, 8.9, 8.8, 5, 0.9, 0.5], [1, 1, 1.1, 1.5, 3, 3], 4),  # weak at first, then met
        ([9, 8.9, 8.8, 8.7, 0.5], [1, 1.2, 3, 30, 300], 2),  # blocked
    ],
)
def test_springs_are_made_stiffer_until_pins_are_met_or_blocked(misses, values, rounds):
    assert final_mesh.follow_pins(Pulled(misses, values), lambda state: state).rounds == rounds


@pytest.mark.slow
def test_springs_of_a_converged_map_are_found_again():
    source, target = shapes.pear(), shapes.blob()
    free = iccm.fit(source, target)
    inner = np.array([0.2 + 0.1j, -0.3 - 0.2j])
    pairs = np.column_stack([inner, free.map(inner) - np.array([0.7, 0.0])])
    softness = Softness.of([Pin(0, 0, tolerance=0.05), Pin(0, 0, tolerance=0.5)])
    live = Live.of(free, Options(), pairs, softness=softness)
    for _ in range(30):
        live = live.follow(pairs, softness=softness)
    pins = live.state.energy.pins
    soft = replace(pins, springs=pins.springs / live.stiffening)
    bare = live.state.with_energy(replace(live.state.energy, pins=soft))
    again, factors = final_mesh.with_present_springs(bare)
    assert live.stiffening[0] > 2 and live.stiffening[1] == 1
    assert np.abs(np.log(again.energy.pins.springs / pins.springs)).max() < 0.05
    assert np.array_equal(again.energy.pins.springs, soft.springs * factors)
