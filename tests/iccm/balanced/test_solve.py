"""The solver as a whole: identities, invariants, and what must hold for every map."""

from dataclasses import replace

import numpy as np
import pytest

import iccm
from iccm.balanced import NoMapError
from iccm.balanced import fit as balanced_fit
from iccm.balanced import solve as solve_problem
from iccm.balanced.errors import Stuck
from iccm.balanced.injectivity import is_simple
from iccm.balanced.meshing.transfer import interpolate
from iccm.balanced.minimise.energy import energy_of
from iccm.balanced.model.discrete_map import folds
from iccm.balanced.model.energy import UPRIGHT, WITHOUT_ROTATION
from iccm.balanced.model.measures import stretches
from iccm.balanced.search import final_mesh, initial_matches, multilevel
from iccm.balanced.search.levels import Level
from iccm.balanced.search.similarity import similarity
from iccm.balanced.search.unit_problem import UnitProblem
from iccm.curve import Curve, hausdorff
from iccm.maps import bounds, distortion
from iccm.options import Options
from iccm.plane import orientation, triangle_areas
from iccm.problem import Problem
from iccm.status import Status
from tests.cases import some_fast

SMALL = 1200  # triangles
ANGLES = 2 * np.pi * np.arange(60) / 60
BLOB = Curve.domain((1 + 0.25 * np.cos(2 * ANGLES + 0.5) + 0.15 * np.sin(3 * ANGLES)) * np.exp(1j * ANGLES))
FLAG = Curve.domain(np.array([0, 3, 2.5 + 0.6j, 3.1 + 1.5j, 1 + 1.7j, 0.9 + 3j, 0.2 + 2.9j]))
STAR = Curve.domain(1j * np.tile([1, 0.45], 5) * np.exp(2j * np.pi * np.arange(10) / 10))
SHIELD = Curve.domain(np.array([-1 + 1j, -1 - 0.2j, -1.3j, 1 - 0.2j, 1 + 1j, 1.2j]))
DISC = Curve.domain(np.exp(1j * ANGLES))
SQUARE = Curve.domain(np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j]))


def solve(source, target, **options):
    """The map of two outlines without constraints."""
    return solve_problem(Problem.of(source, target), Options(fit="whole", **options), triangles=SMALL)


def test_similar_outlines_match_where_the_target_begins_at_another_vertex():
    """Two vertices of a trapezoid are equally far from its centroid, so that an outline may begin at either."""
    trapezoid = np.array([-2 - 2j / 3, 2 - 2j / 3, 1 + 5j / 6, -1 + 5j / 6]) / np.sqrt(4.5)
    source, target = Curve(trapezoid), Curve(np.roll(trapezoid, -1))
    match = similarity(source, target, rotates=False)
    assert np.abs(source.at(match.s) - target.at(match.tau)).max() < 1e-12


@pytest.fixture(scope="module")
def solution():
    return solve(BLOB, FLAG)


@pytest.fixture(scope="module")
def free():
    return solve(BLOB, FLAG, turn="any")


def difference(first, second, place, image):
    """The largest distance of the second map from the first in the other coordinates, relative to the image's size."""
    images = interpolate(second.map.source, second.map.faces, second.map.image, place(first.map.source))
    return np.abs(images - image(first.map.image)).max() / np.ptp(second.map.image.real)


def check(solution, source, target, tolerance=5e-4):
    for w, given in ((solution.map.source, source), (solution.map.image, target)):
        assert (orientation(*w[solution.map.faces].T) > 0).all()
        loop = w[solution.map.loops[0]]
        assert is_simple(loop) and Curve(loop).area > 0
        assert hausdorff(Curve(loop), given) <= tolerance * given.diagonal
    used = np.unique(solution.map.faces)
    assert np.array_equal(used, np.arange(solution.map.source.size))


def largest(solution):
    """The largest dilatation and the largest stretch, with areas normalised."""
    z, u = (
        w / np.sqrt(triangle_areas(w[solution.map.faces]).sum())
        for w in (solution.map.source, solution.map.image)
    )
    return [float(values.max()) for values in stretches(z, u, solution.map.faces)[:2]]


def test_the_map_is_one_to_one_and_follows_both_outlines(solution):
    check(solution, BLOB, FLAG)
    assert solution.reached and solution.gap <= 5e-4
    assert solution.energy == pytest.approx(
        energy_of(solution.map.image, solution.map.source, solution.map.faces), rel=1e-9
    )
    assert abs(solution.rotation) < np.radians(25)


@pytest.mark.parametrize("shape", [BLOB, FLAG, STAR], ids=["blob", "flag", "star"])
def test_a_shape_onto_itself_is_the_identity(shape):
    solution = solve(shape, shape)
    assert np.abs(solution.map.image - solution.map.source).max() < 1e-6 * shape.diagonal
    assert solution.energy == pytest.approx(1, abs=1e-9) and solution.rotation == pytest.approx(0, abs=1e-9)
    check(solution, shape, shape)


def test_a_shape_onto_a_similar_copy_is_the_similarity():
    factor = 2.5 * np.exp(0.7j)
    copy = Curve.domain(FLAG.z * factor + 5 - 2j)
    free = solve(FLAG, copy, turn="any")
    rotated = solve(FLAG, copy, turn=np.degrees(0.7))
    for solution in (free, rotated):
        assert (
            np.abs(solution.map.image - (solution.map.source * factor + 5 - 2j)).max() < 1e-6 * copy.diagonal
        )
        assert solution.rotation == pytest.approx(0.7)


def test_the_search_finds_the_rotation_of_a_copy():
    """Or a map with lower cost: slightly more energy for a slightly smaller rotation."""
    solution = solve(FLAG, Curve.domain(FLAG.z * np.exp(0.5j)))
    costs = [
        energy * (1 + 0.5 * UPRIGHT * (1 - np.cos(turn)))
        for energy, turn in ((solution.energy, solution.rotation), (1, 0.5))
    ]
    assert not solution.notes and costs[0] < costs[1]
    assert 0.3 < solution.rotation < 0.5 and solution.energy < 1.05


@pytest.mark.parametrize(("scale", "shift"), [(1e6, 0), (1e-6, 0), (1, 1e6 - 1e6j), (1e-3, 3)])
def test_scale_and_place_of_either_shape_change_nothing(solution, scale, shift):
    moved = solve(Curve.domain(BLOB.z * scale + shift), Curve.domain(FLAG.z * 2 - shift))
    gap = difference(solution, moved, lambda z: z * scale + shift, lambda w: w * 2 - shift)
    assert gap < 1e-6
    check(moved, Curve(BLOB.z * scale + shift), Curve(FLAG.z * 2 - shift))


def test_rotations_change_nothing_when_any_rotation_is_allowed(free):
    a, b = np.exp(1.1j), 3 * np.exp(-2j)
    turned = solve(Curve.domain(BLOB.z * a), Curve.domain(FLAG.z * b), turn="any")
    assert difference(free, turned, lambda z: z * a, lambda w: w * b) < 1e-6
    assert np.exp(1j * turned.rotation) == pytest.approx(np.exp(1j * (free.rotation - 3.1)))


def test_first_vertex_and_direction_change_nothing(solution):
    rolled = solve(Curve.domain(np.roll(BLOB.z, 7)), Curve.domain(np.roll(FLAG.z[::-1], 3)))
    assert difference(solution, rolled, lambda z: z, lambda w: w) < 1e-6


@pytest.mark.parametrize("mirror", [np.conj, lambda z: -np.conj(z)], ids=["upside down", "left to right"])
def test_mirrored_shapes_have_the_mirrored_map(solution, mirror):
    seen = solve(Curve.domain(mirror(BLOB.z)), Curve.domain(mirror(FLAG.z)))
    assert difference(solution, seen, mirror, mirror) < 1e-6
    assert seen.rotation == pytest.approx(-solution.rotation)
    check(seen, Curve.domain(mirror(BLOB.z)), Curve.domain(mirror(FLAG.z)))


@pytest.mark.parametrize(("source", "target"), [(SHIELD, SQUARE), (SQUARE, DISC), (DISC, STAR)])
def test_symmetric_shapes_have_a_symmetric_map_without_rotation(source, target):
    solution = solve(source, target)
    assert solution.rotation == pytest.approx(0, abs=1e-9)
    mirrored = interpolate(
        solution.map.source, solution.map.faces, solution.map.image, -solution.map.source.conj()
    )
    assert np.abs(mirrored + solution.map.image.conj()).max() < 1e-9 * target.diagonal
    check(solution, source, target)


def test_symmetric_shapes_have_another_map_where_a_symmetric_one_is_dear():
    """The stem of a T onto the gap of an arch: it is mapped into one of the legs."""
    stem = Curve.domain(np.array([-0.2 - 1j, 0.2 - 1j, 0.2, 1, 1 + 0.5j, -1 + 0.5j, -1, -0.2]))
    arch = Curve.domain(
        np.array([-1 - 1j, -0.5 - 1j, -0.5 - 0.3j, 0.5 - 0.3j, 0.5 - 1j, 1 - 1j, 1 + 0.6j, -1 + 0.6j])
    )
    upright, free = (solve(stem, arch, turn=turn) for turn in (0.0, np.degrees(1e-3)))
    assert multilevel.ASKEW in upright.notes and upright.energy == pytest.approx(free.energy, rel=0.01)
    check(upright, stem, arch)


def test_shapes_symmetric_but_for_a_little_keep_their_own_outlines():
    bent = Curve.domain(np.where(SHIELD.z.real > 0.5, SHIELD.z + 0.004, SHIELD.z))
    solution = solve(bent, SQUARE)
    assert multilevel.ASKEW not in solution.notes and abs(solution.rotation) < np.radians(0.5)
    check(solution, bent, SQUARE)


def test_maps_onto_a_disc_are_not_rotated():
    assert abs(solve(FLAG, DISC).rotation) < np.radians(6)


def test_the_requested_rotation_is_made():
    solution = solve(BLOB, DISC, turn=np.degrees(1.0))
    assert solution.rotation == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("fit", ["auto", "contain", "cover"])
@pytest.mark.parametrize("turn", some_fast([0, 45, 90], {45}))
def test_a_requested_rotation_is_kept_or_its_change_reported(fit, turn):
    """A flag onto itself, rotated by a right angle, in whole or in part."""
    result = iccm.fit(FLAG, 1j * FLAG.z, turn=turn, fit=fit)
    notes = [note for note in result.notes if "rotated by" in note]
    away = abs(result.distortion.turn - turn)
    assert bool(notes) == (away > 5) and all(
        f"instead of {turn}" in note and "(turn)" in note for note in notes
    )
    assert turn < 90 or away < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("angle", some_fast([None, "any", 0, 90], {"any", 0}))
def test_pins_that_contradict_the_requested_rotation_get_a_note(angle):
    """A flag rotated by 40 degrees, with pins that agree with the rotation."""
    pins = np.array([0.6 + 1j, 2 + 1j])
    turned = np.exp(1j * np.radians(40))
    fit = iccm.fit(FLAG, FLAG.z * turned, pins=np.stack([pins, pins * turned], axis=1), turn=angle)
    assert fit.distortion.turn == pytest.approx(40, abs=5)
    notes = [note for note in fit.notes if "(turn)" in note]
    assert bool(notes) == (angle in (0, 90)) and all(f"instead of {angle}" in note for note in notes)


def test_a_finer_tolerance_is_met():
    fine = solve(BLOB, DISC, tolerance=1e-4)
    assert max(fine.gap, fine.source_gap) <= 1e-4
    check(fine, BLOB, DISC, 1e-4)


@pytest.mark.slow
def test_bounds_are_met_or_the_excess_is_reported():
    loose = solve(STAR, SHIELD, max_dilatation=20.0, max_stretch=10.0)
    tight = solve(STAR, SHIELD, max_dilatation=1.05)
    assert loose.reached and largest(loose)[0] <= 20
    assert not tight.reached and 1.05 < largest(tight)[0] <= largest(loose)[0] + 1e-9


def test_a_bound_at_corners_is_met_where_the_outlines_slide():
    """Near a corner of a pentagon, on a circle of sixty short edges."""
    pentagon = Curve.domain(np.array([0.24 - 1.4j, 1.1 - 1.84j, 1.8 - 1.2j, 1.6 - 0.3j, 0.4 - 0.2j]))
    free, bounded = (solve(pentagon, DISC, max_stretch=most) for most in (None, 1.75))
    assert largest(free)[1] > 2 and bounded.reached and largest(bounded)[1] <= 1.75


@pytest.mark.slow
def test_bounds_hold_for_the_drawn_mesh():
    for options in ({"max_dilatation": 6.0}, {"max_stretch": 4.0}):
        fit = iccm.fit(BLOB, FLAG, **options)
        report = fit.report()
        assert fit.status is Status.REACHED
        assert report["dilatation"]["max"] <= options.get("max_dilatation", np.inf) * (1 + 1e-9)
        assert report["stretch"]["max"] <= options.get("max_stretch", np.inf) * (1 + 1e-9)


@pytest.mark.slow
def test_patches_over_a_bound_are_left_straight():
    free = iccm.fit(BLOB, FLAG).map
    free = replace(free, bulge=1.5 * free.bulges)  # so that the largest dilatation is surely in a bent patch
    bent = distortion.of_triangles(free).dilatations.max()
    straight = distortion.of_triangles(replace(free, bulge=0 * free.bulges)).dilatations.max()
    assert straight < bent
    most = 0.5 * (straight + bent)
    straightened = bounds.straighten_beyond_bounds(free, most, None)
    assert bounds.meets_bounds(straightened, most, None) and not bounds.meets_bounds(free, most, None)
    assert 0.9 < np.mean(straightened.bulges == free.bulges) < 1


@pytest.mark.slow
def test_strong_stretch_gets_a_note_and_little_none():
    bar = Curve.domain(np.array([0, 40, 40 + 1j, 1j]))
    assert any("strongly stretched" in note for note in iccm.fit(bar, SHIELD).notes)
    assert not any("strongly stretched" in note for note in iccm.fit(BLOB, FLAG).notes)


def test_a_map_that_has_not_converged_gets_a_note(monkeypatch):
    monkeypatch.setattr(final_mesh, "LAST_STEPS", 2)
    monkeypatch.setattr(final_mesh, "LAST_ROUNDS", 1)
    assert final_mesh.UNSETTLED in solve(BLOB, FLAG).notes


def test_the_map_back_is_the_inverse():
    forward, back = solve(BLOB, FLAG), solve(FLAG, BLOB)
    assert back.energy == pytest.approx(forward.energy, rel=1e-9)
    assert back.rotation == pytest.approx(-forward.rotation, abs=1e-6)
    returned = interpolate(back.map.source, back.map.faces, back.map.image, forward.map.image)
    assert np.abs(returned - forward.map.source).max() < 1e-6


def spiral(laps):
    t = np.linspace(0, 2 * np.pi * laps, 60 * laps)
    inner, outer = ((start + t / (2 * np.pi)) * np.exp(1j * t) for start in (0.5, 0.85))
    return Curve.domain(np.concatenate([outer, inner[::-1]]))


def test_a_block_onto_a_spiral_starts_from_the_inverse():
    """The harmonic map into a spiral folds beyond repair; the one out of it does not."""
    curves = (Curve((c.z - c.z.mean()) / np.sqrt(c.area)) for c in (SQUARE, spiral(3)))
    level = Level.of(
        UnitProblem(*curves, WITHOUT_ROTATION), 0.06, *multilevel.COARSE_EXACTNESS, multilevel.STEEPEST
    )
    for match in initial_matches.arclength_matches(level.source.curve, level.target.curve)[:2]:
        with pytest.raises(Stuck):
            level.mapped(match).unfold_from_harmonic()
        state = level.started(match)
        assert not folds(state.faces, state.u)


@pytest.mark.slow
def test_a_spiral_onto_a_square():
    check(solve(spiral(3), SQUARE), spiral(3), SQUARE, 1e-3)


@pytest.mark.slow
def test_more_balance_evens_the_areas():
    even = [np.var(np.log(areas(solve(STAR, SHIELD, balance=t)))) for t in (0.25, 4.0)]
    assert even[1] < 0.6 * even[0]


def areas(solution):
    """Ratios of the areas of image and source of each triangle."""
    parts = [
        (w[solution.map.faces[:, 1]] - w[solution.map.faces[:, 0]]).conj()
        * (w[solution.map.faces[:, 2]] - w[solution.map.faces[:, 0]])
        for w in (solution.map.image, solution.map.source)
    ]
    return parts[0].imag / parts[1].imag


@pytest.mark.slow
@pytest.mark.parametrize("length", [20, 200])
def test_thin_bars(length):
    bar = Curve.domain(np.array([0, length, length + 1j, 1j]))
    check(solve(bar, SHIELD), bar, SHIELD, 1e-3)


def test_a_spike_is_followed():
    spiked = Curve.domain(np.array([0, 1, 1 + 1j, 0.501 + 1j, 0.5 + 1.5j, 0.499 + 1j, 1j]))
    check(solve(spiked, FLAG), spiked, FLAG)


def test_ten_thousand_vertices():
    angles = 2 * np.pi * np.arange(10000) / 10000
    smooth = Curve.domain((1 + 0.2 * np.cos(5 * angles + 1)) * np.exp(1j * angles))
    check(solve(smooth, FLAG), smooth, FLAG)


def test_failure_is_an_error_with_its_cause(monkeypatch):
    def stuck(*_, **limits):
        raise Stuck("no start")

    monkeypatch.setattr(multilevel, "best_of_starts", stuck)
    with pytest.raises(NoMapError, match="too thin or too intricate"):
        solve(BLOB, FLAG)


@pytest.mark.parametrize("height", [100, 137])
def test_a_square_onto_a_rectangle_is_symmetric(height):
    """Left and right halves are the same, as are upper and lower ones, and nothing is rotated."""
    square, rectangle = np.array([0, 1, 1 + 1j, 1j]), np.array([0, 160, 160 + 1j * height, 1j * height])
    fit = iccm.fit(square, rectangle)
    x, y = np.meshgrid(np.linspace(0.05, 0.95, 9), np.linspace(0.05, 0.95, 9))
    images, diagonal = fit.map(x + 1j * y), abs(rectangle[2])
    across, over = fit.map(1 - x + 1j * y), fit.map(x + 1j * (1 - y))
    assert np.abs(across - (160 - images.conj())).max() < 1e-3 * diagonal  # the requested gap
    assert np.abs(over - (images.conj() + 1j * height)).max() < 1e-3 * diagonal
    assert abs(fit.report()["turn"]) < 0.1


@pytest.mark.slow
def test_an_unrequested_rotation_gets_a_note():
    """A lying bar onto a standing one: upright would cost far more, and the picture ends up on its side."""
    bar = np.array([-3 - 0.3j, 3 - 0.3j, 3 + 0.3j, -3 + 0.3j])
    standing = 1j * bar + np.array([0, 0, 0, 0.1j])
    upright, free, rotated = (iccm.fit(bar, standing, turn=turn) for turn in (0.0, "any", 90.0))
    turn = upright.distortion.turn
    assert abs(turn) > 60
    (note,) = (note for note in upright.notes if "(turn)" in note)
    assert f"rotated by {turn:.0f} degrees instead of 0" in note
    assert not [note for note in (*free.notes, *rotated.notes) if "rotated by" in note]


def test_the_message_names_the_figure_that_misses():
    """A map whose own outline leaves out some of the source differs from one whose image misses the target."""
    fit = iccm.fit(SQUARE, DISC)
    assert "source" not in fit._boundary
    spike = Curve.domain(np.array([-1 - 1j, 1 - 1j, 1 - 0.001j, 1.02, 1 + 0.001j, 1 + 1j, -1 + 1j]))
    missed = replace(fit, source=spike, _ended=Status.SOURCE_GAP)
    assert missed._boundary["source"] == pytest.approx(0.02 / spike.diagonal, rel=1e-3)
    assert missed._boundary["hausdorff"] < 1e-9
    assert "boundary.source" in missed.report()["message"] and missed.report()["status"] == "source_gap"
    short = replace(solve(SQUARE, DISC), source_gap=0.0085)
    assert balanced_fit._status(short, True, Options()) is Status.SOURCE_GAP
    assert balanced_fit._status(replace(short, gap=0.002), True, Options()) is Status.GAP
