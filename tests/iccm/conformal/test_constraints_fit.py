"""Pins, strokes and quasi-conformal maps, with and without a target boundary."""

from functools import cache, partial

import numpy as np
import pytest

import iccm
from iccm.curve import Curve
from iccm.paper.initial import similarity
from tests.shapes import blob, inside, pear

SOURCE, TARGET = pear(), blob()
Z = inside(SOURCE)
ARM = Curve(np.array([-0.6, -0.1 + 0.2j, 0.5 + 0.1j]), closed=False)
GOAL = Curve(np.array([-0.6 - 0.1j, -0.1j, 0.7 + 0.2j]), closed=False)
THREE = np.array([[0.4, 0.4 + 0.1j], [-0.4 + 0.3j, -0.6 + 0.1j], [-0.2 - 0.4j, 0.1 - 0.4j]])
deform = partial(iccm.deform, method="paper")
METHODS = {"paper": {"method": "paper", "vertices": 60}, "conformal": {"method": "conformal"}}


@cache
def freely(method):
    """The fit without constraints."""
    return iccm.fit(SOURCE, TARGET, **METHODS[method])


def as_pins(count=12):
    """The stroke as pins at equal arclengths."""
    s = np.linspace(0, 1, count)
    return np.column_stack([ARM.at(s * ARM.length), GOAL.at(s * GOAL.length)])


def misses(fit):
    return np.abs(fit.map(fit.pins[:, 0]) - fit.pins[:, 1])


def area_spread(fit):
    """The range of log10 area scale from its 5th to its 95th percentile."""
    area = fit.report()["log10_area"]
    return area["p95"] - area["p05"]


def slopes(fit):
    f_z, f_zbar = fit.map.derivatives(Z)
    assert not f_zbar.any()
    return f_z


@pytest.mark.parametrize(
    "pins", [[[0.1 + 0.1j, 0.5 + 0.7j]], [[0.1, 0.5j], [0.1, 0.5j]]], ids=["lone", "twice"]
)
def test_a_single_pin_translates_the_shape(pins):
    fit = deform(SOURCE, pins=pins)
    assert misses(fit).max() < 1e-12
    assert np.abs(slopes(fit) - 1).max() < 1e-9
    assert fit.status.ok


def test_coincident_contradictory_pins_share_the_miss_and_keep_the_shape():
    fit = deform(SOURCE, pins=[[0.1, 0.5], [0.1, 0.7]])
    assert np.allclose(misses(fit), 0.1)
    assert np.abs(slopes(fit) - 1).max() < 1e-9


def test_a_deformation_without_constraints_is_refused():
    with pytest.raises(iccm.InputError, match=r"no pins .*strokes"):
        deform(SOURCE)


@pytest.mark.parametrize("kind", ["pins", "strokes"])
def test_the_start_of_a_quasiconformal_map_is_conformal(kind):
    """From a start that is half antiholomorphic, the paper's method does not find the target again; nor from one that
    meets a dozen pins in a row (§3.1), which oscillates between them.
    """
    constraints = {"pins": as_pins(4)} if kind == "pins" else {"strokes": [(ARM, GOAL)]}
    fit = iccm.fit(SOURCE, TARGET, quasi=0.1, **constraints, **METHODS["paper"])
    assert fit.report()["boundary"]["rms"] < 0.02
    assert fit.report()["dilatation"]["p95"] < 2


def test_two_pins_make_a_similarity():
    fit = deform(SOURCE, pins=[[-0.4, -0.4], [0.4, 0.4 + 0.5j]])
    assert misses(fit).max() < 1e-12
    assert np.abs(slopes(fit) - (0.8 + 0.5j) / 0.8).max() < 1e-9


def test_two_pins_rotate_the_shape_by_180_degrees():
    fit = deform(SOURCE, pins=[[-0.4, 0.4], [0.4, -0.4]])
    assert np.abs(slopes(fit) + 1).max() < 1e-9


def test_three_pins_are_met_by_a_deformation():
    fit = deform(SOURCE, pins=THREE)
    tighter = deform(SOURCE, pins=THREE, smoothness=1e-6)
    assert misses(tighter).max() < 1e-4 < misses(fit).max() < 1e-3


def test_nearly_coincident_contradictory_pins_share_the_miss_and_keep_the_shape():
    fit = deform(SOURCE, pins=[[0.1, 0.1], [0.1 + 1e-9, 0.3]])
    assert np.allclose(misses(fit), 0.1, atol=1e-6)
    assert np.abs(np.abs(slopes(fit)) - 1).max() < 0.01


@pytest.mark.parametrize("method", METHODS)
def test_contradictory_pins_share_the_miss(method):
    fit = iccm.fit(SOURCE, TARGET, pins=[[0.1, 0.3], [0.1, 0.1]], **METHODS[method])
    assert np.allclose(misses(fit), 0.1, atol=2e-3)
    assert fit.report()["boundary"]["hausdorff"] < 2e-2


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "pins", [[[0.1 + 0.1j, 0.3 + 0.2j]], [[0.1, 0.3], [0.1, 0.3]]], ids=["lone", "twice"]
)
def test_a_lone_pin_is_met_and_the_boundary_too(method, pins):
    free = freely(method)
    fit = iccm.fit(SOURCE, TARGET, pins=pins, **METHODS[method])
    away = np.abs(free.map(fit.pins[:, 0]) - fit.pins[:, 1]).max()
    assert misses(fit).max() < 0.02 * away
    assert fit.report()["boundary"]["hausdorff"] < {"paper": 3e-2, "conformal": 2e-3}[method]


def test_the_start_from_a_lone_pin_is_upright():
    """A pin does not rotate the picture unless requested: the fitted similarity keeps the given scale."""
    assert similarity(np.array([2j]), np.array([1 + 1j]), 0.5) == (0.5, 1 + 0j)
    assert similarity(np.array([], complex), np.array([], complex), 1j) == (1j, 0)
    assert similarity(np.array([1, 1], complex), np.array([2, 4], complex), 1) == (1, 2)
    scale, shift = similarity(np.array([0, 1], complex), np.array([1, 1 + 2j]), 1)
    assert np.allclose([scale, shift], [2j, 1])


@pytest.mark.parametrize("method", METHODS)
def test_many_pins_of_a_known_map_reproduce_that_map(method):
    free = freely("conformal")
    z = inside(SOURCE, 20, 0.08)
    fit = iccm.fit(SOURCE, TARGET, pins=np.column_stack([z, free.map(z)]), **METHODS[method])
    assert np.abs(fit.map(Z) - free.map(Z)).max() < {"paper": 1e-2, "conformal": 1e-3}[method]


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_larger_pin_weight_lowers_the_pin_error(method):
    loose, tight = (iccm.fit(SOURCE, TARGET, pins=THREE, pin_weight=w, **METHODS[method]) for w in (0.1, 10))
    assert misses(tight).max() < 0.5 * misses(loose).max()
    assert loose.report()["boundary"]["rms"] < tight.report()["boundary"]["rms"]


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_quasiconformal_lowers_pin_error_and_area_distortion(method):
    """Fig. 4 of the paper, with margin."""
    conformal = iccm.fit(SOURCE, TARGET, pins=THREE, **METHODS[method])
    quasi = iccm.fit(SOURCE, TARGET, pins=THREE, quasi=0.03, **METHODS[method])
    assert conformal.map.conformal and not quasi.map.conformal
    assert misses(quasi).max() < 0.5 * misses(conformal).max()
    assert area_spread(quasi) < 0.95 * area_spread(conformal)
    assert quasi.report()["boundary"]["rms"] < conformal.report()["boundary"]["rms"]
    report = quasi.report()
    assert 1.01 < report["dilatation"]["median"] < 2
    assert conformal.report()["dilatation"]["max"] == 1


def test_a_quasiconformal_deformation_lowers_area_distortion():
    """Fig. 8: with the same pins, which both meet."""
    conformal, quasi = (deform(SOURCE, pins=THREE, smoothness=1e-6, quasi=q) for q in (None, 1e-5))
    assert misses(conformal).max() < 1e-3 and misses(quasi).max() < 1e-3
    assert area_spread(quasi) < 0.8 * area_spread(conformal)


def test_a_large_quasiconformal_weight_gives_the_conformal_map():
    conformal = freely("paper")
    rigid = iccm.fit(SOURCE, TARGET, quasi=1e6, **METHODS["paper"])
    f_z, f_zbar = rigid.map.derivatives(Z)
    assert np.abs(f_zbar / f_z).max() < 1e-3
    assert np.abs(rigid.map(Z) - conformal.map(Z)).max() < 1e-2


STROKE_JOBS = {
    "paper": lambda **k: iccm.fit(SOURCE, TARGET, **METHODS["paper"], **k),
    "paper, first order": lambda **k: iccm.fit(SOURCE, TARGET, **METHODS["paper"], order=1, **k),
    "conformal": lambda **k: iccm.fit(SOURCE, TARGET, method="conformal", **k),
    # closest points let a stroke contract along its target without end, so the number of iterations is fixed
    "deform": lambda **k: deform(SOURCE, max_iterations=100, **k),
}


@pytest.mark.slow
@pytest.mark.parametrize("job", STROKE_JOBS)
def test_strokes_distort_areas_less_than_the_same_points_pinned(job):
    """Fig. 5 of the paper: points may slide along a stroke, so that a conformal map meets it with less distortion."""
    stroked = STROKE_JOBS[job](strokes=[(ARM, GOAL)])
    pinned = STROKE_JOBS[job](pins=as_pins())
    assert area_spread(stroked) < 0.95 * area_spread(pinned)
    assert stroked.report()["strokes"][0]["error"] < 0.03
    if job != "deform":
        assert stroked.report()["boundary"]["rms"] < pinned.report()["boundary"]["rms"]


def test_strokes_alone_deform_without_folding():
    fit = deform(SOURCE, strokes=[(ARM, GOAL)])
    assert fit.target is None and fit.report()["boundary"] is None
    assert fit.report()["strokes"][0]["error"] < 0.01
    assert set(fit.energies[-1]) == {"strokes", "smoothness", "total"}
    total = np.array([e["total"] for e in fit.energies])
    assert np.all(np.diff(total) <= 1e-14 * total[:-1])
    before = GOAL.nearest(ARM.z) - ARM.z
    assert fit.report()["strokes"][0]["error"] < 0.2 * np.abs(before).max() / fit._diagonal


def test_strokes_alone_keep_the_shape_about_as_large_as_the_target_stroke():
    fit = deform(SOURCE, strokes=[(ARM, GOAL)], max_iterations=100)
    image = fit.map(ARM.at(np.linspace(0, ARM.length, 50)))
    assert np.abs(np.diff(image)).sum() > 0.7 * GOAL.length


def test_a_stroke_onto_itself_moves_nothing():
    fit = deform(SOURCE, strokes=[(ARM, ARM)])
    assert np.abs(fit.map(Z) - Z).max() < 1e-9


def test_a_stroke_and_a_pin_together():
    fit = deform(SOURCE, strokes=[(ARM, GOAL)], pins=[[-0.2 - 0.4j, -0.2 - 0.5j]])
    assert fit.report()["strokes"][0]["error"] < 0.02 and misses(fit).max() < 0.05
    assert {"pins", "strokes"} <= set(fit.energies[-1])


def test_errors_of_constraints_on_the_outline_are_those_of_the_nearest_point_of_the_map():
    """The map's polygon cuts corners of a fine outline, and a map is not defined outside its polygon."""
    circle = np.exp(2j * np.pi * np.arange(400) / 400)
    stroke = circle[1:4], 2 * circle[1:4]
    fit = deform(circle, pins=[[1, 2], [circle[201], 2 * circle[201]]], strokes=[stroke], vertices=40)
    report = fit.report()
    assert max(entry["error"] for entry in [*report["pins"], *report["strokes"]]) < 5e-3
