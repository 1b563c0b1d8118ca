"""Deformations by the balanced energy: constraints met, nothing folded, as rigid as they can be."""

import igl
import numpy as np
import pytest

import iccm
from iccm import Curve, InputError, Status
from tests.shapes import pear

LENGTH = 6.0
BAR = np.array([0, LENGTH, LENGTH + 1j, 1j])
ENDS = np.array([0.25 + 0.25j, 0.25 + 0.75j, LENGTH - 0.25 + 0.25j, LENGTH - 0.25 + 0.75j])
MIDDLE = np.linspace(0.05, 0.95, 60) * LENGTH + 0.5j
SQUARE = np.array([0, 2, 2 + 2j, 2j])
CORNERS = np.array([0.2 + 0.2j, 1.8 + 0.2j, 1.8 + 1.8j, 0.2 + 1.8j])


def bent(angle):
    """Pins at the bar's ends, the right one at its place on a bar of the same length bent to an arc."""
    radius = LENGTH / np.radians(angle)
    x, y = ENDS[2:].real, ENDS[2:].imag - 0.5
    ring = (radius - y) * np.exp(1j * x / radius)
    return np.column_stack([ENDS, np.append(ENDS[:2], 1j * radius - 1j * ring + 0.5j)])


def turned(line):
    """The total angle in degrees by which a polyline turns."""
    steps = np.diff(line)
    return np.degrees(np.sum(np.angle(steps[1:] / steps[:-1])))


def error(fit):
    return max(pin["error"] for pin in fit.report()["pins"])


def as_rigid_as_possible(fit, pins):
    """The same mesh deformed with the same pins by libigl's local-global iterations."""
    z, faces = fit.map.source, fit.map.faces
    pinned = np.array([np.argmin(np.abs(z - pin)) for pin in pins[:, 0]], np.int32)
    data = igl.ARAPData()
    data.max_iter = 2000
    igl.arap_precomputation(np.column_stack([z.real, z.imag]), faces.astype(np.int64), 2, pinned, data)
    goals, first = (np.column_stack([w.real, w.imag]) for w in (pins[:, 1], fit.map.image))
    return igl.arap_solve(goals, data, first) @ np.array([1, 1j])


@pytest.mark.slow
def test_a_bar_bent_by_90_degrees_is_as_rigid_as_possible():
    pins = bent(90)
    fit = iccm.deform(BAR, exact_pins=True, pins=pins)
    assert fit.status is Status.MET and error(fit) < 1e-9
    assert fit.report()["injective"]["certified"]
    assert np.abs(as_rigid_as_possible(fit, pins) - fit.map.image).max() < 0.01 * fit.source.diagonal
    assert abs(Curve(fit.image).area) == pytest.approx(LENGTH, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("step", [60, 72])
def test_a_bar_closes_to_a_ring_in_five_edits(step):
    fit = None
    for edit in range(1, 6):
        fit = iccm.deform(BAR, exact_pins=True, pins=bent(edit * step), start=fit)
        assert fit.status.ok and error(fit) < 1e-9 and fit.certificate.zeros == 0
    rigid = as_rigid_as_possible(fit, fit.pins)
    assert np.abs(rigid - fit.map.image).max() < 0.04 * fit.source.diagonal
    assert turned(fit.map(MIDDLE)) == pytest.approx(5 * step * 0.9, rel=0.1)


@pytest.mark.slow
def test_more_than_one_turn_is_right_only_from_an_earlier_map():
    first = None
    for angle in (120, 240, 330, 420):
        first = iccm.deform(BAR, pins=bent(angle), start=first)
    assert turned(first.map(MIDDLE)) == pytest.approx(420 * 0.9, rel=0.1)
    assert first.status is Status.OVERLAP and first.status.ok and first.report()["injective"]["folded"] == 0
    report = first.report()
    assert not report["injective"]["certified"] and report["injective"]["zeros"] == 0


def test_the_same_pins_from_an_earlier_map_change_nothing():
    first = iccm.deform(BAR, pins=bent(150))
    again = iccm.deform(BAR, pins=bent(150), start=first.map)
    assert np.array_equal(first.map.source, again.map.source)
    assert np.abs(first.map.image - again.map.image).max() < 1e-4 * LENGTH


def test_other_pins_may_follow():
    first = iccm.deform(BAR, exact_pins=True, pins=bent(90))
    pins = np.append(bent(90), [[3 + 0.5j, first.map(np.array([3 + 0.5j]))[0] + 0.2j]], axis=0)
    second = iccm.deform(BAR, exact_pins=True, pins=pins, start=first)
    assert second.status is Status.MET and error(second) < 1e-9


def test_one_pin_translates_the_shape_and_two_rotate_it():
    z = np.array([0.5 + 0.5j, 1.5 + 1j])
    fit = iccm.deform(SQUARE, pins=[(1 + 1j, 4 + 2j)])
    assert np.abs(fit.map(z) - (z + 3 + 1j)).max() < 1e-9
    fit = iccm.deform(SQUARE, pins=[(0.5 + 1j, 1.5 + 1j), (1.5 + 1j, 0.5 + 1j)])
    assert np.abs(fit.map(z) - (2 + 2j - z)).max() < 1e-7


def test_deformations_commute_with_similarities():
    pins = np.column_stack([np.append(CORNERS, 1 + 1j), np.append(CORNERS, 1.4 + 1.1j)])
    first = iccm.deform(SQUARE, pins=pins)
    turn, shift = 30 * np.exp(0.8j), 1000 - 70j
    second = iccm.deform(SQUARE * turn + shift, pins=pins * turn + shift)
    z = first._interior
    assert np.abs(second.map(z * turn + shift) - (first.map(z) * turn + shift)).max() < 0.02 * abs(turn)


@pytest.mark.parametrize("pin", [1 + 0j, 1 + 0.0005j, 0j])
def test_pins_on_the_outline_and_next_to_it(pin):
    pins = [(pin, pin - 0.4j), (0.2 + 1.8j, 0.2 + 1.8j), (1.8 + 1.8j, 1.8 + 1.8j)]
    fit = iccm.deform(SQUARE, exact_pins=True, pins=pins)
    assert fit.status is Status.MET and error(fit) < 1e-9
    assert fit.report()["injective"]["certified"] and fit.report()["dilatation"]["max"] < 20


def test_strokes_are_met():
    stroke = (np.array([0.5 + 0.5j, 3 + 0.6j, 5.5 + 0.5j]), np.array([0.5 + 0.5j, 3 + 1.5j, 5.2 + 2.5j]))
    fit = iccm.deform(BAR, strokes=[stroke])
    goal = Curve(stroke[1], closed=False)
    image = fit.map(Curve(stroke[0], closed=False).at(np.linspace(0, 5, 200)))
    assert fit.status is Status.MET and fit.report()["injective"]["certified"]
    assert goal.distances(image).max() < 2e-4 * fit._diagonal


def test_ends_of_strokes_slide_unless_they_have_pins():
    """Onto an angle, longer by half: the bar keeps its length, and its middle goes to the corner."""
    stroke = (np.array([0.5 + 0.5j, 5.5 + 0.5j]), np.array([-1 + 0.5j, 3 + 2.5j, 7 + 0.5j]))
    fit = iccm.deform(BAR, strokes=[stroke])
    image = fit.map(Curve(stroke[0], closed=False).at(np.linspace(0, 5, 201)))
    goal = Curve(stroke[1], closed=False)
    assert fit.status is Status.MET and goal.distances(image).max() < 2e-4 * 6
    assert np.abs(np.diff(image)).sum() == pytest.approx(5, rel=0.05)
    assert abs(image[100] - stroke[1][1]) < 0.3
    stuck = iccm.deform(BAR, strokes=[stroke], pins=np.column_stack([w[[0, -1]] for w in stroke]))
    assert stuck.status is Status.MET and error(stuck) < 1e-9
    again = iccm.deform(BAR, strokes=[(stroke[0], stroke[1] + 0.3j)], start=fit)
    assert np.abs(again.map(MIDDLE) - fit.map(MIDDLE) - 0.3j).max() < 0.1


def test_strokes_may_end_on_the_outline():
    """From end to end of the bar, and across it."""
    strokes = [
        (np.array([0.5j, 2.9 + 0.5j]), np.array([0.5j, 2 + 1j])),
        (np.array([4, 4 + 1j]), np.array([3 + 2j, 3 + 3j])),
    ]
    fit = iccm.deform(BAR, strokes=strokes)
    assert fit.status is Status.MET and fit.report()["injective"]["certified"]
    for a, b in strokes:
        line, goal = Curve(a, closed=False), Curve(b, closed=False)
        image = fit.map(line.at(np.linspace(0, line.length, 100)))
        assert goal.distances(image).max() < 2e-4 * fit._diagonal
    assert np.abs(fit.map(strokes[1][0]) - strokes[1][1]).max() < 1e-9
    with pytest.raises(InputError, match="stroke 1: runs along the outline"):
        iccm.deform(BAR, strokes=[([1, 2], [1, 3])])


def test_two_points_may_be_pinned_to_one_place():
    pins = [(0.1 + 0.5j, 0.5j), (5.9 + 0.5j, 0.5j), (3 + 0.5j, 3 + 2j)]
    fit = iccm.deform(BAR, exact_pins=True, pins=pins)
    assert fit.status is Status.OVERLAP and error(fit) < 1e-9


@pytest.mark.slow
def test_overlaps_show_the_layer_farther_from_the_first_pin():
    """With the bar's ends one over the other: of two triangles that cover the same point, the later one is visible."""
    pins = np.array([(0.1 + 0.5j, 0.5j), (5.9 + 0.5j, 0.2 + 0.5j), (3 + 0.5j, 3 + 2j)])
    for order in ([0, 1, 2], [1, 0, 2]):
        fit = iccm.deform(BAR, pins=pins[order])
        seen = fit.map.faces[_last_holding(fit.map.image[fit.map.faces], 0.15 + 0.5j)]
        nearest = np.argmin(np.abs(fit.map.source[seen].mean() - pins[order[:2], 0]))
        assert nearest == 1 and any("farther from the first pin" in note for note in fit.notes)
        again = iccm.deform(BAR, pins=pins[order], start=fit)
        assert np.array_equal(fit.map.source, again.map.source)


def _last_holding(corners, point):
    a, b, c = (corners - point).T
    inside = [(p.conj() * q).imag >= 0 for p, q in ((a, b), (b, c), (c, a))]
    holders = np.flatnonzero(np.all(inside, axis=0))
    assert holders.size > 1
    return holders[-1]


@pytest.mark.slow
def test_bounds_hold_for_the_drawn_mesh():
    pins = np.column_stack([np.append(CORNERS, 1 + 1j), np.append(CORNERS, 1.25 + 1.1j)])
    fit = iccm.deform(SQUARE, pins=pins, max_dilatation=3)
    assert fit.status is Status.MET and fit.report()["dilatation"]["max"] <= 3 + 1e-6
    assert iccm.deform(SQUARE, exact_pins=True, pins=pins, max_dilatation=1.01).status is Status.BOUNDS


@pytest.mark.slow
def test_unmet_pins_are_reported_with_their_distance():
    pins = [*zip(CORNERS, CORNERS), (0.9 + 1j, 1 + 1j), (1.1 + 1j, 1 + 1j)]
    fit = iccm.deform(SQUARE, exact_pins=True, pins=pins)
    assert fit.status is Status.PINS and not fit.status.ok and error(fit) > 1e-9
    assert fit.report()["injective"]["zeros"] == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"pins": [(0.5 + 0.5j, 1), (0.5 + 0.5j, 2)]}, "pins 1 and 2: the same source point"),
        ({"pins": [(9, 9)]}, "pin 1: .* outside the source shape"),
        ({"strokes": [([0.2 + 0.2j, 1 + 3j], [0, 1])]}, "stroke vertex 2: .* outside the source shape"),
        ({"strokes": [([0.2j + 0.2, 1 + 1j], [0, 1]), ([1 + 0.2j, 0.2 + 1j], [0, 1])]}, "strokes 1 and 2"),
        ({"pins": [(1 + 1j, 1)], "turn": 30}, "turn: "),
        ({"pins": [(1 + 1j, 1)], "start": iccm.Curve(SQUARE)}, "start: "),
        ({"pins": [(1 + 1j, 1)], "method": "paper", "start": object()}, "start: .* balanced"),
    ],
)
def test_mistakes_are_named(options, message):
    with pytest.raises(InputError, match=message):
        iccm.deform(SQUARE, **options)


def test_a_shape_with_a_round_outline_keeps_its_parts():
    """A pear's top is pulled up; its bottom, held by three pins, does not move."""
    outline = pear()
    pins = [(0.3 - 0.2j, 0.3 - 0.2j), (-0.3 - 0.2j, -0.3 - 0.2j), (0j, 0j), (0.5 + 0.1j, 0.6 + 0.3j)]
    fit = iccm.deform(outline, pins=pins)
    assert fit.status is Status.MET and fit.report()["injective"]["certified"]
    still = np.array([-0.3 - 0.1j, -0.2 - 0.2j])
    assert np.abs(fit.map(still) - still).max() < 0.1


PUNCHED = [
    1.5 + 0.5j + 0.2 * np.exp(2j * np.pi * np.arange(24) / 24),
    np.array([4, 4.5, 4.5 + 0.5j, 4 + 0.5j]) + 0.25j,
]


@pytest.mark.slow
def test_a_bar_with_free_holes_bends_as_rigidly_as_possible():
    pins = bent(90)
    fit = iccm.deform(BAR, exact_pins=True, pins=pins, source_holes=PUNCHED)
    assert fit.status is Status.MET and error(fit) < 1e-9 and not fit.notes
    assert fit.report()["injective"]["certified"] and "holes" not in fit.report()
    for hole, loop in zip(PUNCHED, fit.map.loops[1:]):
        assert np.abs(np.sort_complex(fit.map.source[loop])[0] - np.sort_complex(hole)[0]) < 1e-9
    assert np.abs(as_rigid_as_possible(fit, pins) - fit.map.image).max() < 0.01 * fit.source.diagonal
    assert np.isnan(fit.map(np.array([1.5 + 0.5j]))).all()
    again = iccm.deform(BAR, exact_pins=True, pins=pins, source_holes=PUNCHED, start=fit)
    assert np.abs(again.map.image - fit.map.image).max() < 1e-5


def test_pins_on_a_holes_outline_move_it_and_in_it_close_it():
    on = [[1.3 + 0.5j, 1.2 + 0.5j], [1.7 + 0.5j, 1.9 + 0.5j], [5.5 + 0.5j, 5.5 + 0.5j]]
    fit = iccm.deform(BAR, exact_pins=True, pins=on, source_holes=PUNCHED)
    assert fit.status is Status.MET and error(fit) < 1e-9 and len(fit.map.loops) == 3
    inside = [[1.5 + 0.5j, 1.5 + 0.7j], [5.5 + 0.5j, 5.5 + 0.5j]]
    fit = iccm.deform(BAR, exact_pins=True, pins=inside, source_holes=PUNCHED)
    assert fit.status is Status.MET and error(fit) < 1e-9 and len(fit.map.loops) == 2
    assert fit.notes == ["A hole contains pins or strokes: the shape is deformed as if it were filled there."]
    stroke = [np.array([1 + 0.5j, 2 + 0.5j]), np.array([1 + 0.5j, 2 + 0.6j])]
    assert len(iccm.deform(BAR, strokes=[stroke], source_holes=PUNCHED).map.loops) == 2
    with pytest.raises(InputError, match=r"source_holes: .* balanced method"):
        iccm.deform(BAR, pins=on, source_holes=PUNCHED, method="paper")


def test_a_shape_that_is_too_thin_is_refused_before_it_is_meshed():
    thin = [0, 1e6, 1e6 + 1j, 1j]
    with pytest.raises(InputError, match="too thin"):
        iccm.deform(thin, pins=[(5e5 + 0.5j, 5e5 + 10j)])
