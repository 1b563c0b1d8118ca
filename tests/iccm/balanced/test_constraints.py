"""Pins and strokes of the balanced method are met at any cost short of a fold."""

import numpy as np
import pytest

import iccm
from iccm import Curve, InputError, Status
from iccm.balanced.constraints.validate import check
from iccm.balanced.errors import Stuck
from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.balanced.search import multilevel
from iccm.balanced.search.grid_paths import route
from iccm.maps.triangulated.map import TriangulatedMap
from tests import shapes

SQUARE = np.array([0, 1, 1 + 1j, 1j])
ELL = np.array([0, 2, 2 + 1j, 1 + 1j, 1 + 2j, 2j])
TEE = np.array([0.4, 0.6, 0.6 + 0.7j, 1 + 0.7j, 1 + 1j, 1j, 0.7j, 0.4 + 0.7j])


def errors(fit):
    return [pin["error"] for pin in fit.report()["pins"]]


def one_to_one(fit):
    report = fit.report()
    return report["injective"]["certified"] and report["boundary"]["hausdorff"] < 1e-3


def off_line(fit, stroke=0):
    a, b = fit.strokes[stroke]
    image = fit.map(a.at(np.linspace(0, a.length, 200)))
    return b.distances(image).max()


@pytest.mark.slow
def test_pins_inside_are_met():
    pins = [(0.3 + 0.3j, 0.3 + 0.5j), (0.7 + 0.3j, 1.5 + 0.4j), (0.3 + 0.7j, 0.6 + 1.7j)]
    fit = iccm.fit(SQUARE, ELL, exact_pins=True, pins=pins)
    assert fit.status is Status.REACHED and max(errors(fit)) < 1e-9 and one_to_one(fit)


@pytest.mark.slow
def test_pins_far_from_where_the_map_has_them():
    fit = iccm.fit(SQUARE, TEE, exact_pins=True, pins=[(0.5 + 0.8j, 0.5 + 0.2j)])
    assert fit.status is Status.REACHED and max(errors(fit)) < 1e-9 and one_to_one(fit)


def test_pins_rotate_the_picture():
    pins = [(0.3 + 0.5j, 0.5 + 0.3j), (0.7 + 0.5j, 0.5 + 0.7j)]
    fit = iccm.fit(SQUARE, SQUARE, exact_pins=True, pins=pins)
    assert max(errors(fit)) < 1e-9 and fit.report()["turn"] == pytest.approx(90, abs=3)
    assert fit.report()["stretch"]["p95"] < 1.05


@pytest.mark.slow
def test_pins_on_the_outline_and_inside():
    pins = [(0.5, 0.5 + 0j), (0.5 + 1j, 0.2 + 1j), (0.4 + 0.4j, 0.5 + 0.8j)]
    fit = iccm.fit(SQUARE, TEE, exact_pins=True, pins=pins)
    assert fit.status is Status.REACHED and max(errors(fit)) < 1e-9 and one_to_one(fit)


@pytest.mark.slow
def test_pins_in_a_mirror_are_met_in_the_mirror():
    s, tau = np.array([0.3, 1.2, 2.4, 3.1]), np.array([0.1, 1.4, 2.9, 4.6])
    boot = np.array([0, 2, 2.3 + 0.7j, 1 + 1j, 1 + 2j, 2j])
    pins = np.column_stack([Curve(boot).at(s), Curve(ELL).at(tau)])
    first = iccm.fit(boot, ELL, pins=pins)
    second = iccm.fit(boot.conj(), ELL.conj(), pins=pins.conj())
    assert max(errors(first) + errors(second)) < 1e-9
    z = first._interior
    assert np.abs(second.map(z.conj()).conj() - first.map(z)).max() < 1e-6


STROKE = (np.array([0.2 + 0.5j, 0.5 + 0.6j, 0.8 + 0.5j]), np.array([0.4 + 1.6j, 0.5 + 0.5j, 1.6 + 0.4j]))


def reach(fit):
    """The positions of the image's ends, relative to the target stroke's length."""
    a, b = fit.strokes[0]
    return b.closest(fit.map(a.z[[0, -1]])) / b.length


@pytest.mark.parametrize("turn", [1, -1])
def test_a_stroke_is_met_and_ends_with_pins_go_to_ends(turn):
    stroke = [side[::turn] for side in STROKE]
    pins = np.column_stack([side[[0, -1]] for side in stroke])
    fit = iccm.fit(SQUARE, ELL, strokes=[stroke], pins=pins)
    assert fit.status is Status.REACHED and one_to_one(fit)
    assert off_line(fit) < 2e-4 * fit._diagonal and max(errors(fit)) < 1e-9


@pytest.mark.slow
def test_ends_without_pins_slide_to_where_the_map_is_best():
    pins = np.column_stack([side[[0, -1]] for side in STROKE])
    free, stuck, half = (
        iccm.fit(SQUARE, ELL, strokes=[STROKE], exact_pins=True, pins=p) for p in (None, pins, pins[:1])
    )
    assert free.status is Status.REACHED and one_to_one(free) and off_line(free) < 2e-4 * free._diagonal
    assert free.energies[-1]["total"] < half.energies[-1]["total"] < stuck.energies[-1]["total"]
    assert reach(free)[0] > 0.1 and reach(half)[0] < 1e-9 and reach(half)[1] < 0.99
    assert reach(stuck) == pytest.approx([0, 1], abs=1e-9)


def test_a_short_stroke_keeps_its_length_on_a_long_straight_one():
    stroke = (np.array([0.4 + 0.5j, 0.6 + 0.5j]), np.array([0.1 + 0.5j, 0.9 + 0.5j]))
    fit = iccm.fit(SQUARE, SQUARE, strokes=[stroke])
    assert np.abs(fit.map(stroke[0]) - stroke[0]).max() < 0.02 and fit.report()["stretch"]["p95"] < 1.05


def test_ends_slide_past_corners_of_the_target():
    """On an arc of fifteen points, longer by a third; the shape is its own mirror image, and so is the map."""
    arc = 0.5 + 0.3j + 0.4 * np.exp(1j * np.linspace(2.9, np.pi - 2.9, 15))
    fit = iccm.fit(SQUARE, SQUARE, strokes=[(np.array([0.35 + 0.6j, 0.65 + 0.6j]), arc)])
    first, last = reach(fit)
    assert fit.status is Status.REACHED and off_line(fit) < 2e-4 * fit._diagonal and one_to_one(fit)
    assert first > 0.15 and last < 0.85 and last - first < 0.6


@pytest.fixture(scope="module")
def plain():
    return iccm.fit(SQUARE, ELL, fit="whole")


@pytest.mark.slow
@pytest.mark.parametrize("fresh", [True, False])
def test_a_map_continues_from_an_earlier_one(fresh):
    """On the same mesh if the pins are the same points of the source, else on another."""
    pins = np.array([(0.3 + 0.3j, 0.3 + 0.5j), (0.7 + 0.3j, 1.5 + 0.4j), (0.5, 1 + 0j)])
    first = iccm.fit(SQUARE, ELL, exact_pins=True, pins=pins[1:] if fresh else pins)
    moved = pins + np.array([[0, 0.05 + 0.03j], [0, 0.1], [0, 0]])
    second = iccm.fit(SQUARE, ELL, exact_pins=True, pins=moved, start=first)
    assert second.status is Status.REACHED and max(errors(second)) < 1e-9 and one_to_one(second)
    assert fresh or np.isin(first.map.source[:200], second.map.source).all()
    alone = iccm.fit(SQUARE, ELL, exact_pins=True, pins=moved)
    assert second.energies[-1]["total"] < 1.1 * alone.energies[-1]["total"]


@pytest.mark.slow
def test_continuing_without_a_change_changes_little():
    first = iccm.fit(SQUARE, TEE, pins=[(0.4 + 0.4j, 0.5 + 0.8j)])
    second = iccm.fit(SQUARE, TEE, pins=[(0.4 + 0.4j, 0.5 + 0.8j)], start=first.map)
    z = first._interior
    assert np.abs(first.map(z) - second.map(z)).max() < 0.01


@pytest.mark.slow
def test_a_kept_start_is_the_result_if_it_meets_the_pins():
    first = iccm.fit(SQUARE, TEE, pins=[(0.4 + 0.4j, 0.5 + 0.8j)])
    pins = [(0.4 + 0.4j, 0.52 + 0.8j)]  # within the tolerance of a soft pin
    kept = iccm.fit(SQUARE, TEE, pins=pins, start=first, keep_start=True)
    assert kept.status is Status.REACHED and one_to_one(kept)
    z = first._interior
    assert np.abs(first.map(z) - kept.map(z)).max() < 1e-12
    moved = iccm.fit(SQUARE, TEE, pins=pins, start=first)
    assert np.abs(first.map(z) - moved.map(z)).max() > 1e-4
    solved = iccm.fit(SQUARE, TEE, pins=[(0.4 + 0.4j, 0.5 + 0.2j)], start=first, keep_start=True)
    assert solved.status is Status.REACHED and np.abs(first.map(z) - solved.map(z)).max() > 0.1


@pytest.mark.slow
def test_a_start_is_kept_however_coarse_its_mesh_is():
    """So are maps that fold on finer meshes."""
    count = 5
    x, y = np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count))
    grid = (x + 1j * y).ravel()
    image = 2 * grid + (0.2 + 0.1j) * np.sin(np.pi * grid.real) * np.sin(np.pi * grid.imag)
    lower_left = (np.arange(count - 1) + count * np.arange(count - 1)[:, None]).ravel()
    right, up = 1, count
    faces = np.concatenate(
        [
            np.stack([lower_left, lower_left + right, lower_left + right + up], 1),
            np.stack([lower_left, lower_left + right + up, lower_left + up], 1),
        ]
    )
    edge, last = np.arange(count - 1), count * count - 1
    rim = np.concatenate([edge, count - 1 + up * edge, last - edge, up * (count - 1 - edge)])
    start = TriangulatedMap(grid, image, faces, (rim,))
    pins = [(0.45 + 0.6j, start(np.array([0.45 + 0.6j]))[0])]
    kept = iccm.fit(SQUARE, 2 * SQUARE, pins=pins, start=start, keep_start=True)
    z = np.array([0.3 + 0.2j, 0.7 + 0.4j, 0.55 + 0.9j])
    assert kept.status is Status.REACHED and np.abs(kept.map(z) - start(z)).max() < 1e-12
    continued = iccm.fit(SQUARE, 2 * SQUARE, pins=pins, start=start)
    assert np.abs(continued.map(z) - start(z)).max() > 1e-3


@pytest.mark.slow
def test_keeping_needs_a_start_and_applies_to_maps_onto_a_target(plain):
    with pytest.raises(InputError, match="keep_start: needs"):
        iccm.fit(SQUARE, ELL, keep_start=True)
    with pytest.raises(InputError, match="keep_start: does not apply"):
        iccm.deform(SQUARE, pins=[(0.5 + 0.5j, 0.6 + 0.5j)], keep_start=True)
    with pytest.raises(InputError, match="keep_start: only works"):
        iccm.fit(SQUARE, ELL, method="conformal", keep_start=True)


@pytest.mark.slow
def test_continuing_after_outline_pins_slid_and_with_strokes(plain):
    pins = [(0.5, 0.5 + 0j), (0.5 + 1j, 0.2 + 1j)]
    first = iccm.fit(SQUARE, TEE, pins=pins)
    second = iccm.fit(SQUARE, TEE, pins=[pins[0], (0.5 + 1j, 0.4 + 1j)], start=first)
    assert second.status is Status.REACHED and max(errors(second)) < 1e-9
    third = iccm.fit(SQUARE, ELL, strokes=[STROKE], start=plain)
    assert third.status is Status.REACHED and off_line(third) < 2e-4 * third._diagonal and one_to_one(third)


def test_only_the_balanced_method_continues_from_a_map(plain):
    with pytest.raises(InputError, match=r"start: .* balanced"):
        iccm.fit(SQUARE, ELL, method="conformal", start=plain)
    with pytest.raises(InputError, match=r"start: .* balanced map"):
        iccm.fit(SQUARE, ELL, start=iccm.fit(SQUARE, ELL, method="paper"))


def test_a_path_avoids_obstacles():
    """From one arm of a U to the other, and around a point in the middle of a square."""
    you = Curve(np.array([0, 3, 3 + 3j, 2 + 3j, 2 + 1j, 1 + 1j, 1 + 3j, 3j]))
    path = np.append(0.5 + 2.5j, route(you, 0.5 + 2.5j, 2.5 + 2.5j, np.empty(0, complex)))
    line = Curve(path, closed=False)
    points = line.at(np.linspace(0, line.length, 300))
    assert path[-1] == 2.5 + 2.5j and you.contains(points).all() and 5 < line.length < 6.5
    assert you.distances(points).min() > 0.25
    path = route(Curve(SQUARE), 0.2 + 0.5j, 0.8 + 0.5j, np.array([0.5 + 0.5j]))
    line = Curve(np.append(0.2 + 0.5j, path), closed=False)
    assert np.abs(line.at(np.linspace(0, line.length, 300)) - 0.5 - 0.5j).min() > 0.1


@pytest.mark.slow
def test_pins_that_change_places_are_led_around_each_other():
    pins = [(0.35 + 0.5j, 0.65 + 0.5j), (0.65 + 0.5j, 0.35 + 0.5j), (0.5 + 0.15j, 0.5 + 0.15j)]
    fit = iccm.fit(SQUARE, SQUARE, exact_pins=True, pins=pins)
    assert fit.status is Status.REACHED and max(errors(fit)) < 1e-9 and one_to_one(fit)


def test_a_stroke_with_pins():
    stroke = (np.array([0.2 + 0.5j, 0.8 + 0.5j]), np.array([0.25 + 0.6j, 0.5 + 0.55j, 0.75 + 0.6j]))
    pins = [
        (0.5 + 0.2j, 0.5 + 0.3j),
        (0.5 + 1j, 0.6 + 1j),
        (0.2 + 0.5j, 0.25 + 0.6j),
    ]  # the last: a stroke's end
    fit = iccm.fit(SQUARE, SQUARE, exact_pins=True, pins=pins, strokes=[stroke])
    assert fit.status is Status.REACHED and one_to_one(fit)
    assert off_line(fit) < 2e-4 * fit._diagonal and max(errors(fit)) < 1e-9


@pytest.mark.parametrize(
    ("pins", "message"),
    [
        ([(0.5 + 0.5j, 0.4 + 0.5j), (0.5 + 0.5j, 0.6 + 0.5j)], "pins 1 and 2: the same source point"),
        ([(0.4 + 0.5j, 0.5 + 0.5j), (0.6 + 0.5j, 0.5 + 0.5j)], "pins 1 and 2: two source points"),
        ([(0.5 + 0.5j, 2)], "pin 1: .* outside the target shape"),
        ([(0.5, 0.5 + 0.5j)], "pin 1: is on the outline in the source but not in the target"),
        ([(0.5, 0.5), (1 + 0.5j, 0.5j), (0.5 + 1j, 0.5 + 1j), (0.5j, 1 + 0.5j)], "out of order: "),
    ],
)
def test_pins_that_no_map_can_meet_are_named(pins, message):
    with pytest.raises(InputError, match=message):
        iccm.fit(SQUARE, SQUARE, pins=pins)


@pytest.mark.parametrize(
    ("strokes", "message"),
    [
        (
            [([0.2 + 0.2j, 0.8 + 0.8j], [0.2 + 0.2j, 0.8 + 0.8j])] * 2,
            "strokes 1 and 2: cross or touch in the source",
        ),
        (  # a frame
            [([0.2 + 0.2j, 0.8 + 0.2j],) * 2, ([0.8 + 0.2j, 0.5 + 0.7j],) * 2],
            "strokes 1 and 2: cross or touch in the source",
        ),
        (
            [
                (
                    0.5 + 0.5j + 0.2 * np.exp(2j * np.pi * np.arange(25) / 24),
                    np.array([0.2 + 0.2j, 0.8 + 0.8j]),
                )
            ],
            "stroke 1: is closed in the source",
        ),
        (
            [([0.2 + 0.2j, 0.8 + 0.8j], [0.2 + 0.2j, 0.8 + 0.2j, 0.5 + 0.8j, 0.2 + 0.2j])],
            "stroke 1: is closed in the target",
        ),
        ([([0.2 + 0.2j, 0.8 + 0.8j], [0.5 + 0.5j, 2])], "stroke 1: leaves .* target"),
        (
            [([0.2 + 0.2j, 0.8 + 0.8j, 0.8 + 0.2j, 0.2 + 0.8j], [0.2 + 0.2j, 0.8j + 0.8])],
            "stroke 1: crosses .* source",
        ),
    ],
)
def test_strokes_that_no_map_can_meet_are_named(strokes, message):
    with pytest.raises(InputError, match=message):
        iccm.fit(SQUARE, SQUARE, strokes=strokes)


@pytest.mark.parametrize("turn", [1, -1])
def test_a_stroke_may_begin_on_the_outline(turn):
    stroke = tuple(np.array(side)[::turn] for side in ([0.5, 0.5 + 0.5j], [1, 0.6 + 0.9j]))
    fit = iccm.fit(SQUARE, ELL, strokes=[stroke])
    assert fit.status is Status.REACHED and one_to_one(fit) and off_line(fit) < 2e-4 * fit._diagonal
    misses = np.abs(fit.map(stroke[0]) - stroke[1])[::turn]
    assert misses[0] < 1e-9 and misses[1] > 0.05


def test_strokes_from_outline_to_outline_part_the_shape():
    strokes = [
        (np.array([x, x + 0.1 + 0.5j, x + 1j]), np.array([x + 0.1, x - 0.1 + 0.4j, x + 1j]))
        for x in (0.3, 0.7)
    ]
    pins = [(0.1 + 0.5j, 0.05 + 0.4j), (0.6 + 0.3j, 0.5 + 0.3j), (1 + 0.5j, 1 + 0.4j)]
    fit = iccm.fit(SQUARE, SQUARE, strokes=strokes, exact_pins=True, pins=pins)
    assert fit.status is Status.REACHED and one_to_one(fit) and max(errors(fit)) < 1e-9
    for k, (a, b) in enumerate(strokes):
        assert (
            off_line(fit, k) < 2e-4 * fit._diagonal and np.abs(fit.map(a[[0, -1]]) - b[[0, -1]]).max() < 1e-9
        )


@pytest.mark.slow
def test_a_stroke_across_is_met_in_the_mirror():
    boot = np.array([0, 2, 2.3 + 0.7j, 1 + 1j, 1 + 2j, 2j])
    stroke = np.array([0.5, 0.6 + 0.5j, 0.5j + 0.5, 0.8j]), np.array([0.8, 0.7 + 0.6j, 0.9j])
    first = iccm.fit(boot, ELL, strokes=[stroke])
    second = iccm.fit(boot.conj(), ELL.conj(), strokes=[tuple(side.conj() for side in stroke)])
    assert one_to_one(first) and off_line(first) < 2e-4 * first._diagonal
    assert np.abs(second.map(first._interior.conj()).conj() - first.map(first._interior)).max() < 1e-6


def test_a_stroke_along_the_outline_is_met_from_end_to_end():
    stroke = (np.array([0.8, 1, 1 + 0.5j]), np.array([1.5, 2, 2 + 0.2j]))
    inwards = (np.array([1 + 0.5j, 0.5 + 0.5j]), np.array([2 + 0.2j, 0.5 + 0.5j]))
    fit = iccm.fit(SQUARE, ELL, strokes=[stroke, inwards])
    assert fit.status is Status.REACHED and one_to_one(fit)
    assert max(off_line(fit), off_line(fit, 1)) < 2e-4 * fit._diagonal
    assert np.abs(fit.map(stroke[0][[0, -1]]) - stroke[1][[0, -1]]).max() < 1e-9


@pytest.mark.parametrize("out", [5e-4j, -5e-4j])
def test_ends_close_to_the_outline_are_on_it(out):
    stroke = (np.array([0.5 + out, 0.5 + 0.5j]), np.array([1 - out, 0.6 + 0.9j]))
    fit = iccm.fit(SQUARE, ELL, strokes=[stroke])
    assert fit.status is Status.REACHED and np.abs(fit.map(np.array([0.5 + 0j])) - 1).max() < 1e-3
    line, goal = (Curve(side, closed=False) for side in stroke)
    image = fit.map(line.at(np.linspace(0.01, line.length, 100)))
    assert goal.distances(image).max() < 2e-4 * fit._diagonal


def test_an_end_stays_off_the_outline_of_the_target():
    fit = iccm.fit(SQUARE, ELL, strokes=[([0.5 + 0.2j, 0.5 + 0.5j], [1, 0.6 + 0.9j])])
    assert fit.status is Status.REACHED and one_to_one(fit) and off_line(fit) < 2e-4 * fit._diagonal


ACROSS = ([0.5, 0.5 + 1j], [0.5, 0.5 + 1j])


@pytest.mark.parametrize(
    ("strokes", "pins", "message"),
    [
        (
            [([0.5, 0.5 + 0.5j], [0.5 + 0.1j, 0.5 + 0.5j])],
            None,
            "stroke 1: ends on the outline in the source",
        ),
        (
            [([0.5 + 0.1j, 0.5 + 0.5j], [0.5, 0.5 + 0.5j])],
            [(0.5 + 0.1j, 0.5)],
            "stroke 1: ends on the outline in the target",
        ),
        ([([0.3 + 0.2j, 0.5, 0.7 + 0.2j], [0.3 + 0.2j, 0.7 + 0.2j])], None, "stroke 1: leaves the shape"),
        ([([0.2, 0.8], [0.8, 0.2])], None, "stroke 1: .* opposite directions"),
        ([([0.2, 0.8], [0.2 + 0.5j, 0.8 + 0.5j])], None, "stroke 1: runs along the outline in the source"),
        ([ACROSS], [(0.3 + 0.5j, 0.7 + 0.5j)], "pin 1: .* sides of stroke 1"),
        ([([0.3, 0.3 + 1j], [0.7, 0.7 + 1j]), ACROSS], None, "stroke 2: .* sides of stroke 1"),
        ([ACROSS], [(0.2, 0.8), (1 + 0.5j, 1 + 0.5j)], "out of order: stroke 1"),
        (
            [([0.2, 0.8], [0.2, 0.8]), ([0.8, 0.9], [0.7, 0.9])],
            None,
            "stroke 1 and stroke 2: at the same place",
        ),
    ],
)
def test_strokes_at_the_outline_that_no_map_can_meet_are_named(strokes, pins, message):
    with pytest.raises(InputError, match=message):
        iccm.fit(SQUARE, SQUARE, strokes=strokes, pins=pins)


def test_the_pin_that_is_out_of_order_is_named():
    square = Curve(SQUARE)
    s = np.array([0.3, 1.1, 1.9, 2.7, 3.5])
    pins = np.column_stack([square.at(s), square.at(s[[0, 1, 4, 2, 3]])])
    with pytest.raises(InputError, match="out of order: 3;"):
        check(square, square, pins)


def test_a_pin_close_to_the_outline_gets_a_note():
    fit = iccm.fit(SQUARE, SQUARE, exact_pins=True, pins=[(0.5 + 0.02j, 0.55 + 0.02j)])
    assert any("very close to the outline" in note for note in fit.notes) and max(errors(fit)) < 1e-9


def test_the_mesh_keeps_points_and_lines():
    points = np.array([0.2 + 0.2j, 0.5 + 0.45j, 0.8 + 0.3j, 0.5 + 0.8j])
    z, faces = triangulate(SQUARE.astype(complex), Sizes.even(0.01), points, np.array([1, 2, -1, -1]))
    edges = {frozenset(pair) for face in faces.tolist() for pair in zip(face, face[1:] + face[:1])}
    assert np.array_equal(z[4:8], points)
    assert {frozenset((4, 5)), frozenset((5, 6))} <= edges
    assert not any(
        len(edge & set(range(8))) == 2 and min(edge) >= 4
        for edge in edges - {frozenset((4, 5)), frozenset((5, 6))}
    )
    a, b, c = z[faces].T
    assert ((b - a).conj() * (c - a)).imag.sum() == pytest.approx(2) and (
        (b - a).conj() * (c - a)
    ).imag.min() > 0


def test_weights_are_for_the_methods_that_weigh():
    pins = [(0.3 + 0.3j, 0.32 + 0.3j)]
    with pytest.raises(InputError, match="pin_weight"):
        iccm.fit(SQUARE, SQUARE, pins=pins, method="balanced", pin_weight=2)


@pytest.mark.slow
def test_a_stroke_blocked_by_pins_is_reported_as_not_met():
    square = shapes.square(8)
    pins = [(p, p) for p in (-0.5 + 0.1j, 0.1j, 0.5 + 0.1j, -0.1j)]
    fit = iccm.fit(
        square, square, exact_pins=True, pins=pins, strokes=[([-0.6, 0.6], [-0.6 - 0.2j, 0.6 - 0.2j])]
    )
    assert fit.status is Status.PINS and fit.certificate.certified
    assert fit.report()["strokes"][0]["error"] > 1e-3


@pytest.mark.slow
def test_no_smaller_triangles_are_tried_for_a_map_that_pins_make_useless(monkeypatch):
    """A house onto a strip, 200 times as long as wide: one coarse search without pins, which chooses the frames, and
    one with pins in each direction.
    """
    house = np.array([0, 1, 1 + 0.8j, 0.4 + 1j, 0.8j])  # a square would be stretched
    searches = []
    search = multilevel.best_of_starts

    def refused(*args):
        raise Stuck("folds")

    monkeypatch.setattr(
        multilevel, "best_of_starts", lambda *args, **kwargs: searches.append(1) or search(*args, **kwargs)
    )
    monkeypatch.setattr(multilevel, "fine_map", refused)
    strip = np.array([0, 40, 40 + 0.2j, 0.2j])
    fit = iccm.fit(house, strip, exact_pins=True, pins=[(0.2 + 0.3j, 20 + 0.1j), (0.7 + 0.6j, 9 + 0.1j)])
    assert len(searches) == 3 and fit.map.injectivity.certified and max(errors(fit)) < 1e-9
    strip = np.array([0, 4, 4 + 2j, 2j])
    fit = iccm.fit(house, strip, exact_pins=True, pins=[(0.2 + 0.3j, 2 + 1j), (0.7 + 0.6j, 0.9 + 1j)])
    assert len(searches) > 5 and fit.map.injectivity.certified
