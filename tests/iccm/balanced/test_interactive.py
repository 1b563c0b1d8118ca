"""The coarse map that follows pins: it meets them, has no folds, and continues from its last state."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import iccm
from iccm.arrays import xy_of
from iccm.balanced import interactive
from iccm.balanced.errors import NoMapError
from iccm.balanced.interactive import BUDGET_TRIANGLE_STEPS, STEPS_PER_MESH, Live
from iccm.balanced.minimise import newton
from iccm.curve import Curve
from iccm.errors import InputError
from iccm.options import Options
from iccm.pins import Softness
from tests import shapes


def begun(mirror=False):
    z, w = shapes.pear(), shapes.blob()
    source, target = (Curve.domain(c.conj() if mirror else c) for c in (z, w))
    fit = iccm.fit(source, target)
    inner = fit._interior[:: fit._interior.size // 3][:3]
    pins = np.column_stack([inner, fit.map(inner)])
    return fit, Live.of(fit, Options(), pins), pins


def sound(live, pins):
    found = live.map
    assert live.met and found.injectivity.certified
    assert np.abs(found(pins[:, 0]) - pins[:, 1]).max() < 1e-8
    return found


@pytest.mark.parametrize("mirror", [False, True])
def test_it_begins_close_to_the_map_it_comes_from(mirror):
    fit, live, pins = begun(mirror)
    found, z = sound(live, pins), fit._interior
    assert np.nanmax(np.abs(found(z) - fit.map(z))) < 0.05 * fit._diagonal
    assert len(found.faces) < 0.4 * len(fit.map.faces)


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("side", [0, 1])
def test_it_follows_either_end_of_a_pin_on_the_same_mesh(mirror, side):
    _, live, pins = begun(mirror)
    faces = live.state.faces
    for _ in range(8):
        pins = pins + 0j
        pins[1, side] *= 1 - 0.06
        live = live.follow(pins)
        sound(live, pins)
    assert live.state.faces is faces


def test_a_step_is_small_where_the_pin_moves_little():
    _, live, pins = begun()
    z, before = pins[:, 0] * 0.5, live.map
    pins[0, 1] += 1e-4
    after = live.follow(pins).map
    assert np.abs(after(z) - before(z)).max() < 2e-3


def test_pins_come_and_go():
    _, live, pins = begun()
    more = np.vstack([pins, [0.1 + 0.1j, live.map(np.array([0.1 + 0.1j]))[0]]])
    sound(live.follow(more), more)
    sound(live.follow(more).follow(pins[:1]), pins[:1])
    assert live.follow(pins[:0]).met


def test_a_pin_on_the_outline_slides_along_it():
    fit, live, pins = begun()
    s = 0.3 * fit.source.length
    start = fit.source.at(np.array([s]))
    tau = fit.target.closest(fit.map(start))
    for step in np.linspace(0, 0.05, 4) * fit.target.length:
        rim = np.array([[start[0], fit.target.at(tau + step)[0]]])
        all_pins = np.vstack([pins, rim])
        live = live.follow(all_pins)
        sound(live, all_pins)


def test_a_stroke_is_met():
    fit, live, pins = begun()
    line = np.linspace(-0.2 + 0.3j, 0.3 + 0.35j, 6)
    goal = fit.map(line) + 0.03j
    live = live.follow(pins[:0], [(Curve.stroke(line), Curve.stroke(goal))])
    found = live.map
    assert live.met and found.injectivity.certified
    image, goal = found(Curve(line, False).at(np.linspace(0, 0.5, 20))), Curve(goal, False)
    assert goal.distances(image).max() < 2e-3


def test_another_balance_changes_it():
    _, live, pins = begun()
    areas = [live.follow(pins, balance=balance).map for balance in (0.2, 4.0)]
    scales = [np.ptp(np.log(np.abs(np.abs(p) ** 2 - np.abs(q) ** 2))) for p, q in
              (m.derivatives(np.array([0, 0.2, 0.3j, -0.3])) for m in areas)]  # fmt: skip
    assert scales[1] < scales[0]


def test_holes_go_along():
    z, w = shapes.circle(80), shapes.circle(90) * 1.2
    inner = {"source_holes": [0.3 * shapes.circle(40)], "target_holes": [0.2 + 0.5 * shapes.circle(50)]}
    fit = iccm.fit(z, w, **inner)
    pins = np.array([[0.6j, fit.map(np.array([0.6j]))[0] * np.exp(0.05j)]])
    live = Live.of(fit, Options(), pins)
    found = sound(live, pins)
    assert len(found.loops) == 2
    rim = found.image[found.loops[1]]
    assert np.abs(np.abs(rim - 0.2) - 0.5).max() < 5e-3
    pins[0, 1] *= np.exp(0.1j)
    sound(live.follow(pins), pins)


@pytest.mark.slow
@pytest.mark.parametrize("more", ["source_holes", "target_holes"])
def test_a_hole_without_partner_is_followed_too(more):
    fit = iccm.fit(shapes.pear(), shapes.blob(), **{more: [0.25 * shapes.circle(40)]})
    z = 0.6j
    pins = np.array([[z, fit.map(np.array([z]))[0]]])
    live = Live.of(fit, Options(), pins)
    assert live.met
    pins[0, 1] += 0.05
    assert live.follow(pins).met


@pytest.mark.parametrize("side", [0, 1])
def test_a_drag_waits_for_a_new_mesh_and_lags_behind_without_folds(side):
    _, live, pins = begun()
    faces = live.state.faces
    pins = pins + 0j
    # too close to the other one to be reached immediately
    pins[1, side] -= 0.9 * (pins[1, side] - pins[2, side])
    steps = 0
    while steps < STEPS_PER_MESH - 1:
        live, steps = live.follow(pins, dragged=True), steps + 1
        assert live.map.injectivity.certified
        assert live.state.faces is faces
    gap = np.abs(live.map(pins[:, 0]) - pins[:, 1]).max()
    assert gap < 1e-8 or not live.met
    sound(live.follow(pins), pins)


@pytest.mark.slow
@pytest.mark.parametrize("side", [0, 1])
def test_a_step_of_a_drag_keeps_to_its_budget_and_goes_on_with_the_next(side, monkeypatch):
    fit, _, pins = begun()
    live = Live.of(iccm.fit(fit.source, fit.target, pins=pins, exact_pins=True), Options(), pins)
    assert live.met and not live.coarse
    descend, made = newton.descend, []

    def counted(*given):
        end = descend(*given)
        made.append(end[1])
        return end

    monkeypatch.setattr(newton, "descend", counted)
    pins, meshes = pins + 0j, []
    pins[1, side] *= 0.7
    for _ in range(STEPS_PER_MESH // 2):
        made.clear()
        meshes.append(live.state.faces)
        live = live.follow(pins, dragged=True)
        assert live.state.faces is not meshes[-1] or 0 < sum(made) * len(meshes[-1]) <= BUDGET_TRIANGLE_STEPS
    assert len({id(faces) for faces in meshes}) <= 2
    sound(live, pins)


@pytest.mark.slow
@pytest.mark.parametrize("more, side", [("source_holes", "source"), ("target_holes", "image")])
def test_a_map_with_a_filled_hole_rests_on_the_mesh_it_was_dragged_on(more, side):
    hole = {more: [0.25 * shapes.circle(40)]}
    fit = iccm.fit(shapes.pear(), shapes.blob(), **hole)
    pins = np.array([[0.6j, fit.map(np.array([0.6j]))[0]]])
    fit = iccm.fit(shapes.pear(), shapes.blob(), exact_pins=True, pins=pins, **hole)
    live = Live.of(fit, Options(), pins)
    for _ in range(4):
        pins[0, 1] += 0.02
        live = live.follow(pins, dragged=True)
    seen = sound(live, pins)
    rested = iccm.fit(shapes.pear(), shapes.blob(), exact_pins=True, pins=pins, start=live.start, **hole)
    assert rested.status.ok
    before, after = (xy_of(getattr(map, side)) for map in (seen, rested.map))  # if a hole is filled
    away = cKDTree(before).query(after)[0]
    assert away.max() < 1e-6 * fit._diagonal and len(before) == len(after)
    z = fit._interior
    assert np.nanquantile(np.abs(rested.map(z) - seen(z)), 0.95) < 0.01 * fit._diagonal


@pytest.mark.slow
def test_a_drag_begins_where_the_last_one_ended_also_around_a_hole_of_the_target():
    outlines, holes = (shapes.pear(), shapes.blob()), [0.25 * shapes.circle(40)]
    fit = iccm.fit(*outlines, target_holes=holes)
    pins = np.array([[0.6j, fit.map(np.array([0.6j]))[0]]])
    live = Live.of(fit, Options(), pins, softness=soft(pins))
    pins[0, 1] += 0.1
    live = live.follow(pins, softness=soft(pins))
    kept = iccm.fit(*outlines, target_holes=holes, pins=pins, start=live.start, keep_start=True)
    begun_again = Live.of(kept, Options(), pins, softness=soft(pins), covering_map=live.start, dragged=True)
    z = fit._interior
    away = np.abs(begun_again.map(z) - live.map(z))
    assert begun_again.state.fills_holes and np.nanquantile(away, 0.95) < 0.01 * fit._diagonal


@pytest.mark.slow
def test_a_drag_begins_on_the_mesh_of_the_map_from_scratch_around_a_hole_of_the_target():
    holes = [0.1 + 0.25 * shapes.circle(40)]
    given = shapes.pear(), shapes.blob()
    pins = np.array([[0.6j, 0.65j]])
    fit = iccm.fit(*given, target_holes=holes, pins=pins, exact_pins=True)
    live = Live.of(fit, Options(), pins, dragged=True)
    assert live.state.fills_holes and len(live.map.faces) == len(fit.map.faces)
    away = np.abs(live.map(fit._interior) - fit.map(fit._interior))
    assert np.nanquantile(away, 0.95) < 2e-3 * fit._diagonal


@pytest.mark.slow
def test_a_map_stays_on_its_mesh_where_it_would_fold_on_a_new_one(monkeypatch):
    fit, _, pins = begun()
    live = Live.of(iccm.fit(fit.source, fit.target, pins=pins, exact_pins=True), Options(), pins)
    faces = live.state.faces

    def refuse(*args, **options):
        raise NoMapError("folds")

    monkeypatch.setattr(interactive, "final_level", refuse)
    pins = pins + 0j
    pins[1, 1] += 0.999 * (pins[2, 1] - pins[1, 1])
    for _ in range(STEPS_PER_MESH + 5):
        live = live.follow(pins, dragged=True)
    assert live.state.faces is faces and not live.coarse and live.map.injectivity.certified


def test_what_cannot_be_is_refused_by_name():
    _, live, pins = begun()
    pins[1, 1] = pins[0, 1]
    with pytest.raises(InputError, match="pins 1 and 2"):
        live.follow(pins)


def soft(pins, **settings):
    return Softness.of([iccm.Pin(*pair, **settings) for pair in pins])


def begun_softly():
    fit, _, pins = begun()
    return Live.of(fit, Options(), pins, softness=soft(pins)), pins


@pytest.mark.slow
@pytest.mark.parametrize("side", [0, 1])
def test_soft_pins_are_followed_on_the_mesh_of_the_map(side):
    live, pins = begun_softly()
    faces, pins = live.state.faces, pins + 0j
    for _ in range(6):
        pins[1, side] *= 1 - 0.06
        live = live.follow(pins, softness=soft(pins), dragged=True)
        assert live.map.injectivity.certified and live.met
    assert live.state.faces is faces
    gap = np.abs(live.map(pins[:, 0]) - pins[:, 1])
    assert (gap < 2 * live.patches.softness.tolerances).all()


@pytest.mark.slow
def test_what_is_released_is_the_map_that_was_dragged_to():
    live, pins = begun_softly()
    pins = pins + 0j
    for _ in range(5):
        pins[1, 1] *= 0.94
        live = live.follow(pins, softness=soft(pins), dragged=True)
    seen = live.map
    fit = iccm.fit(live.pair.source, live.pair.target, pins=pins, start=live.start)
    z = fit._interior
    assert np.nanmax(np.abs(fit.map(z) - seen(z))) < 0.01 * fit._diagonal


def test_a_soft_pin_more_needs_no_other_mesh():
    live, pins = begun_softly()
    faces = live.state.faces
    more = np.append(pins, [[0.5j, live.map(np.array([0.5j]))[0] + 0.05]], axis=0)
    live = live.follow(more, softness=soft(more))
    assert live.state.faces is faces and len(live.patches.points) == 4
    assert abs(live.map(more[3:, 0])[0] - more[3, 1]) < live.patches.softness.tolerances[3]


def test_exact_pins_go_with_soft_ones():
    fit, _, pins = begun()
    softness = Softness.of([iccm.Pin(*pins[0], radius=0), iccm.Pin(*pins[1]), iccm.Pin(*pins[2])])
    live = Live.of(fit, Options(), pins, softness=softness)
    pins = pins + 0j
    pins[0, 1] *= 0.95
    live = live.follow(pins, softness=softness)
    assert live.met and abs(live.map(pins[:1, 0])[0] - pins[0, 1]) < 1e-8
    assert len(live.patches.points) == 2
