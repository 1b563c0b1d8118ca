"""Maps that continue from the previous one: nothing jumps when a pin is released, and saved files repeat the result."""

import base64
import json
import zlib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from iccm.io.edit import placing, saving
from iccm.io.edit.map_choice import same
from iccm.io.edit.messages import Scene
from iccm.io.edit.session import Session
from iccm.io.edit.solving import solve_scene
from iccm.io.run.job import make
from iccm.io.shapes.starts import StartingMap
from iccm.progress import tell

pytestmark = pytest.mark.usefixtures("solve_once")

AT = [40.0, 45.0]
PINS = Path(__file__).parents[3] / "samples" / "pins"
DRAGGED = {"source": "round", "target": "cat"}


def scene(*ends, **more):
    return Scene.model_validate({"pins": [{"source": a, "target": b} for a, b in ends], **more})


@pytest.fixture
def dragged(shapes):
    """A session, the scene after a long drag of one of two pins, and the last map that was shown."""
    edited = Session(make({"source": "square.svg", "target": "blob.svg"}))
    edited.solve(scene())
    ends = [
        [AT, placing.transfer(edited, "source", [AT])[0]],
        [[65, 60], placing.transfer(edited, "source", [[65, 60]])[0]],
    ]
    edited.solve(scene(*ends))
    for step in range(8):
        last = scene([AT, [ends[0][1][0] + 2 * step, ends[0][1][1] + step]], ends[1])
        assert edited.follow(last).ok
    return edited, last, edited._map


def apart(one, other):
    """The distance that 95 % of the points move at most, relative to the target's diagonal."""
    z = one.source[np.setdiff1d(np.arange(one.source.size), one.loops[0])]
    return np.nanquantile(np.abs(one(z) - other(z)), 0.95) / one.image_diagonal


@pytest.mark.slow
def test_what_is_let_go_of_stays_where_it_is_seen(dragged):
    edited, last, seen = dragged
    assert edited.solve(last).ok
    kept = edited._map
    assert apart(kept, seen) < 0.01 and edited.start(last) is not None
    fresh = edited.solve(last, "fresh")
    assert fresh.other == "kept" and edited.start(last) is None
    back = edited.solve(last, "kept")
    assert back.ok and np.array_equal(edited._map.image, kept.image)


@pytest.mark.slow
def test_a_click_where_the_map_goes_moves_nothing_that_is_seen(dragged):
    edited, last, _ = dragged
    edited.solve(last)
    before = edited._map
    more = [30, 62], placing.transfer(edited, "source", [[30, 62]])[0]
    assert edited.solve(scene(*((pin.source, pin.target) for pin in last.pins), more)).ok
    assert apart(before, edited._map) < 0.01


@pytest.mark.slow
def test_what_is_saved_gives_the_map_that_is_seen(dragged, shapes, shell):
    edited, last, _ = dragged
    edited.solve(last)
    saving.save(edited, last, "square-blob.json", replace=False)
    saving.export(edited, last, "shown.png", 200, replace=False)
    done = shell(f"{saving.command(edited, last)} --size 200")
    assert done.returncode == 0, done.stderr
    assert (shapes / "shown.png").read_bytes() == (shapes / "square-blob.png").read_bytes()
    opened = Session(make({"source": "square.svg", "target": "blob.svg", "constraints": "square-blob.json"}))
    assert opened.solve(opened.pair.first).ok
    assert np.array_equal(opened._map.image, edited._map.image)


@pytest.mark.slow
def test_undo_gives_the_map_that_was_there(dragged):
    edited, last, _ = dragged
    edited.solve(last)
    before = edited._map.image
    edited.follow(scene(*((pin.source, pin.target) for pin in last.pins[1:])))
    edited.solve(scene(*((pin.source, pin.target) for pin in last.pins[1:])))
    edited.solve(last)
    assert np.array_equal(edited._map.image, before)


@pytest.mark.slow
def test_a_map_from_scratch_that_costs_less_is_offered_and_changes_nothing_by_itself(dragged, monkeypatch):
    edited, last, _ = dragged
    edited.solve(last)
    kept, cost = edited._map, edited._fit.coverage.seen.total
    monkeypatch.setattr("iccm.io.edit.session.same", lambda one, other: False)
    offered = edited.compare(last)
    assert (offered.kind, offered.other, offered.drawn) == ("full", "fresh", None) and edited._map is kept
    assert edited.compare(last) is None  # it is known by now
    fresh = edited.solve(last, "fresh")
    assert fresh.other == "kept" and edited.start(last) is None
    assert offered.cost_ratio == pytest.approx(cost / edited._fit.coverage.seen.total) and cost > 1
    back = edited.solve(last, "kept")
    assert (back.other, back.cost_ratio) == ("fresh", offered.cost_ratio) and np.array_equal(
        edited._map.image, kept.image
    )


@pytest.fixture
def resting(dragged, monkeypatch):
    """A session whose hand rests after a drag, and the scene; a map from scratch is to replace the one that is seen."""
    edited, last, _ = dragged
    monkeypatch.setattr("iccm.io.edit.session.same", lambda one, other: False)
    monkeypatch.setattr("iccm.io.edit.session.NOTABLE_COST_RATIO", 0.0)
    assert edited.solve(last, hand="resting").kind == "full"
    return edited, last


def copied(scene):
    """The same scene as another message from the page has it."""
    return scene.model_copy(deep=True)


@pytest.mark.slow
def test_a_map_from_scratch_that_costs_less_replaces_the_one_that_is_held(resting, shapes):
    edited, last = resting
    kept = edited._map
    shown = edited.compare(last, resting=True)
    held = edited._map
    assert (shown.kind, shown.ok, shown.other) == ("full", True, "kept") and shown.drawn is not None
    assert held is not kept and edited.start(last) is None and edited.compare(last, resting=True) is None
    released = copied(last)
    update = edited.solve(released, "fresh", hand="released")
    assert (update.kind, update.other, update.cost_ratio) == ("full", "kept", shown.cost_ratio)
    assert edited._map is held and update.drawn is None  # the page keeps what it shows
    back = edited.solve(copied(last), "kept")
    assert back.other == "fresh" and np.array_equal(edited._map.image, kept.image)
    assert edited.start(last) is not None
    edited.solve(copied(last), "fresh")
    assert np.array_equal(edited._map.image, held.image)
    before = scene(*((pin.source, pin.target) for pin in last.pins[:1]))
    edited.solve(before)
    edited.solve(copied(last))  # undone and done again
    assert np.array_equal(edited._map.image, held.image)
    (shapes / "pins.json").write_text(saving.constraints_json(edited, last))
    assert "start" not in json.loads((shapes / "pins.json").read_text())
    opened = Session(make({"source": "square.svg", "target": "blob.svg", "constraints": "pins.json"}))
    assert opened.solve(opened.pair.first).ok and np.array_equal(opened._map.image, held.image)


def test_a_drag_goes_on_from_the_map_that_replaced_the_other(resting):
    edited, last = resting
    edited.compare(last, resting=True)
    held = edited._map
    edited.scene = onward = scene(*((pin.source, [pin.target[0] + 0.1, pin.target[1]]) for pin in last.pins))
    assert edited.follow(onward).ok and apart(held, edited._map) < 0.01


def test_a_map_that_costs_hardly_less_is_offered_while_the_hand_rests(resting, monkeypatch):
    edited, last = resting
    monkeypatch.setattr("iccm.io.edit.session.NOTABLE_COST_RATIO", 1e6)
    kept = edited._map
    offered = edited.compare(last, resting=True)
    assert (offered.other, offered.drawn) == ("fresh", None) and edited._map is kept
    update = edited.solve(copied(last), "kept", hand="released")
    assert (update.other, update.cost_ratio) == ("fresh", offered.cost_ratio) and edited._map is kept


@pytest.mark.slow
def test_a_map_that_leaves_parts_out_is_offered_however_little_it_costs(resting, monkeypatch):
    edited, last = resting
    monkeypatch.setattr("iccm.coverage.Coverage.is_partial", True)
    kept = edited._map
    assert edited.compare(last, resting=True).other == "fresh" and edited._map is kept


@pytest.mark.parametrize("is_cancelled", [True, False])
@pytest.mark.parametrize("is_released", [True, False])
def test_a_search_ends_without_a_change_when_the_hand_moves_or_lets_go(
    resting, monkeypatch, is_released, is_cancelled
):
    """The search ends where it reports its progress, or its result comes too late."""
    edited, last = resting
    kept, pin, unmoved = edited._map, *last.pins
    moved = scene([pin.source, [pin.target[0] + 1, pin.target[1]]], [unmoved.source, unmoved.target])
    later = copied(last) if is_released else moved

    def search(*arguments, **more):
        edited.scene = later
        if is_cancelled:
            tell("searching")
            pytest.fail("the search goes on")
        return solve_scene(*arguments, **more)

    with monkeypatch.context() as interrupted:
        interrupted.setattr("iccm.io.edit.session.solve_scene", search)
        assert edited.compare(last, resting=True) is None
    assert edited._map is kept and edited.start(last) is not None
    if is_released:
        assert edited.solve(later, "kept", hand="released").kind == "full" and edited._map is kept
        assert edited.compare(later).other == "fresh" and edited._map is kept


def test_a_map_that_was_not_seen_any_more_is_not_what_is_released(resting):
    edited, last = resting
    kept = edited._map
    edited.compare(last, resting=True)
    update = edited.solve(copied(last), "kept", hand="released")  # it crossed the other map on its way
    assert update.other == "fresh" and update.drawn is not None
    assert np.array_equal(edited._map.image, kept.image)


@pytest.fixture
def moving(shapes, monkeypatch):
    """A session whose map has not converged, after a pin was dragged fast, and the scene."""
    monkeypatch.setattr("iccm.balanced.interactive.BUDGET_TRIANGLE_STEPS", 0)  # two Newton steps an update
    edited = Session(make({"source": "square.svg", "target": "blob.svg"}))
    edited.solve(scene())
    (x, y), *_ = placing.transfer(edited, "source", [AT])
    edited.solve(scene([AT, [x, y]]))
    for step in range(1, 6):
        edited.scene = last = scene([AT, [x + 6 * step, y]])
        edited.follow(last)
    return edited, last


def test_what_is_let_go_of_is_the_map_that_is_seen_vertex_by_vertex(moving):
    edited, last = moving
    seen = edited._map
    update = edited.solve(last)
    assert update.ok and update.figures["injective"]["certified"]
    kept = edited._map
    assert len(kept.faces) == len(seen.faces)
    gaps = np.abs(kept(seen.source) - seen.image)
    assert np.nanmax(gaps) < 1e-4 * seen.image_diagonal  # by which saved maps are rounded


def test_after_the_hand_let_go_the_map_settles_by_no_more_than_can_be_seen(moving, monkeypatch):
    edited, last = moving
    released = edited.maps
    monkeypatch.setattr("iccm.io.edit.session.STILL_SHARE", 1e-6)
    monkeypatch.setattr("iccm.io.edit.session.MOST_SETTLING_SHARE", 5e-5)  # less than the map needs
    while edited.relax(last, released) is not None:
        pass
    assert apart(released[0], edited._map) < 6e-5
    while edited.relax(last) is not None:
        pass
    assert apart(released[0], edited._map) > 1e-4


def test_a_step_that_the_hand_has_not_seen_when_it_lets_go_is_undone(moving, monkeypatch):
    """The server was computing it at the release; what moves later is measured from what was seen."""
    edited, last = moving
    released, follow = edited._map, edited.follow

    def let_go(followed):
        update = follow(followed)
        edited.scene = last.model_copy()  # as in another request
        return update

    monkeypatch.setattr("iccm.io.edit.session.STILL_SHARE", 1e-6)
    monkeypatch.setattr(edited, "follow", let_go)
    assert edited.relax(last) is None and edited._map is released
    edited.scene = last
    monkeypatch.setattr(edited, "follow", follow)
    assert edited.relax(last) is not None and apart(released, edited._map) > 1e-6


def test_a_map_that_would_settle_too_far_and_off_its_pins_is_kept_as_it_was(moving, monkeypatch):
    edited, last = moving
    released, follow = edited._map, edited.follow

    def miss(followed):
        update = follow(followed)
        edited._is_met = False  # as for a pin that leaves its tolerance
        return update

    monkeypatch.setattr("iccm.io.edit.session.STILL_SHARE", 1e-6)
    monkeypatch.setattr("iccm.io.edit.session.MOST_SETTLING_SHARE", 1e-6)
    monkeypatch.setattr(edited, "follow", miss)
    assert edited.relax(last, [released]) is None
    assert edited.solve(last).ok and apart(released, edited._map) < 1e-4


def test_the_next_drag_begins_with_the_map_as_it_is(moving):
    edited, last = moving
    edited.solve(last)
    seen = edited._map
    edited.scene = onward = scene(*((pin.source, [pin.target[0] + 0.1, pin.target[1]]) for pin in last.pins))
    assert edited.follow(onward).ok and apart(seen, edited._map) < 0.01


@pytest.mark.slow
def test_a_new_pin_where_the_map_goes_changes_nothing(dragged):
    edited, last, _ = dragged
    edited.solve(last)
    before = edited._map
    more = [30, 62], placing.transfer(edited, "source", [[30, 62]])[0]
    placed = scene(*((pin.source, pin.target) for pin in last.pins), more)
    assert edited.solve(placed).ok
    assert np.array_equal(edited._map.image, before.image) and edited.start(placed).kept


@pytest.mark.slow
def test_a_kept_map_converges_again_if_pins_or_options_are_changed_by_hand(moving, shapes):
    edited, last = moving
    edited.solve(last)
    kept = edited._map
    listed = json.loads(saving.constraints_json(edited, last))

    def opened(**options):
        (shapes / "kept.json").write_text(json.dumps(listed))
        again = Session(
            make({"source": "square.svg", "target": "blob.svg", "constraints": "kept.json", **options})
        )
        assert again.solve(again.pair.first).ok
        return again._map

    assert np.array_equal(opened().image, kept.image)
    assert apart(opened(balance=2.0), kept) > 1e-3
    listed["pins"][0]["target"][0] += 1.0
    assert apart(opened(), kept) > 1e-3


@pytest.mark.slow
def test_a_pin_pulled_beyond_its_tolerance_stays_where_it_was_seen(shapes):
    """Its spring becomes stiffer during the drag; the solve, and the next drag, have to find the same stiffness."""
    edited = Session(make({"source": "square.svg", "target": "blob.svg"}))
    edited.solve(scene())
    (x, y), *_ = placing.transfer(edited, "source", [AT])

    def at(share):
        pin = {"source": AT, "target": [x, y - 30 * share], "tolerance": 1.5}
        return Scene.model_validate({"pins": [pin]})

    edited.solve(at(0))
    for step in range(1, 21):
        edited.scene = last = at(step / 20)
        edited.follow(last)
    while edited.relax(last) is not None:
        pass
    seen = edited._map
    assert edited._live.stiffening.max() > 5
    assert edited.has_followed(last) and edited.solve(last).ok
    assert apart(seen, edited._map) < 0.002
    assert not edited.has_followed(last)
    seen = edited._map
    edited.scene = at(0.99)
    assert edited.follow(edited.scene).ok and apart(seen, edited._map) < 0.01


def firm(source, target):
    """A scene with a pin that must come close to its place."""
    return Scene.model_validate({"pins": [{"source": source, "target": target, "tolerance": 1.5}]})


@pytest.fixture
def blocked(shapes, monkeypatch):
    """A session whose map has come to rest without following a pin, and the scene; springs do not become stiffer."""
    edited = Session(make({"source": "square.svg", "target": "blob.svg"}))
    edited.solve(scene())
    (x, y), *_ = placing.transfer(edited, "source", [AT])
    edited.solve(firm(AT, [x, y]))
    with monkeypatch.context() as limited:
        limited.setattr("iccm.balanced.interactive.STIFFEST", 1.0)
        for step in range(1, 9):
            edited.scene = last = firm(AT, [x, y - 4 * step])
            edited.follow(last)
        while edited.relax(last) is not None:
            pass
    return edited, last


@pytest.mark.slow
def test_a_pin_that_the_map_cannot_follow_stops_short_and_nothing_jumps(blocked, shapes):
    edited, last = blocked
    seen, goal = edited._map, last.pins[0].target
    resting = edited.solve(last, hand="resting")
    assert (resting.kind, resting.ok, resting.wrong) == ("blocked", False, {"pins": [0]})
    assert edited._map is seen
    update = edited.solve(last, hand="released")
    assert (update.kind, update.ok, update.short) == ("full", True, [0]) and update.figures["injective"][
        "certified"
    ]
    assert apart(seen, edited._map) < 1e-4
    pin = update.scene.pins[0]
    assert pin.source == last.pins[0].source
    image = placing.transfer(edited, "source", [AT])[0]
    assert abs(pin.target[1] - goal[1]) > 2 and np.hypot(*np.subtract(pin.target, image)) <= 1.5
    saving.save(edited, update.scene, "short.json", replace=False)
    opened = Session(make({"source": "square.svg", "target": "blob.svg", "constraints": "short.json"}))
    assert opened.solve(opened.pair.first).ok and np.array_equal(opened._map.image, edited._map.image)
    edited.scene = onward = update.scene
    edited.follow(onward)  # the next drag begins, with a spring that pulls as strongly from closer by
    assert apart(seen, edited._map) < 0.05


@pytest.mark.slow
def test_a_map_that_reaches_the_pin_replaces_one_that_cannot_while_the_hand_rests(blocked, shapes):
    edited, last = blocked
    seen = edited._map
    assert edited.solve(last, hand="resting").kind == "blocked"
    assert edited.compare(last) is None and edited._map is seen  # after the release, the pin stops short
    update = edited.compare(last, resting=True)
    assert (update.kind, update.ok, update.wrong["pins"]) == ("full", True, []) and "pin 1" in update.message
    held = edited._map
    assert apart(seen, held) > 0.01
    released = edited.solve(copied(last), "kept", hand="released")
    assert (released.kind, released.short, released.message) == ("full", [], update.message)
    assert edited._map is held
    (shapes / "held.json").write_text(saving.constraints_json(edited, last))
    opened = Session(make({"source": "square.svg", "target": "blob.svg", "constraints": "held.json"}))
    assert opened.solve(opened.pair.first).ok and np.array_equal(opened._map.image, held.image)


def test_a_pin_that_is_released_before_another_map_was_found_stops_short(blocked, monkeypatch):
    edited, last = blocked
    seen, released = edited._map, copied(last)

    def search(*arguments, **more):
        edited.scene = released
        return solve_scene(*arguments, **more)

    with monkeypatch.context() as interrupted:
        interrupted.setattr("iccm.io.edit.session.solve_scene", search)
        assert edited.compare(last, resting=True) is None
    assert edited._map is seen
    assert edited.solve(released, hand="released").short == [0] and apart(seen, edited._map) < 1e-4


@pytest.mark.slow
def test_the_place_of_a_pin_that_stopped_short_can_be_searched_for(blocked):
    edited, last = blocked
    edited.scene = short = edited.solve(last, hand="released").scene
    before = edited._map
    update = edited.solve(last, "search")
    assert update.ok and not update.short and not update.wrong["pins"]
    assert apart(before, edited._map) > 0.01
    assert edited.solve(short).ok and np.array_equal(edited._map.image, before.image)  # as undo does


@pytest.mark.slow
def test_the_end_that_was_dragged_stops_short(shapes, monkeypatch):
    monkeypatch.setattr("iccm.balanced.interactive.STIFFEST", 1.0)
    edited = Session(make({"source": "square.svg", "target": "blob.svg"}))
    edited.solve(scene())
    target = placing.transfer(edited, "source", [AT])[0]
    edited.solve(firm(AT, target))
    for step in range(1, 9):
        edited.scene = last = firm([AT[0], AT[1] + 4 * step], target)
        edited.follow(last)
    pin = edited.solve(last, hand="released").scene.pins[0]
    assert pin.target == tuple(target) and AT[1] < pin.source[1] < AT[1] + 30
    assert np.hypot(*np.subtract(placing.transfer(edited, "source", [pin.source])[0], target)) <= 1.5


@pytest.mark.slow
def test_exact_pins_stop_short_at_their_vertices(shapes, monkeypatch):
    monkeypatch.setattr("iccm.balanced.interactive.BUDGET_TRIANGLE_STEPS", 0)  # two Newton steps an update
    edited = Session(make({"source": "square.svg", "target": "blob.svg", "exact_pins": True}))
    edited.solve(scene())
    (x, y), *_ = placing.transfer(edited, "source", [AT])
    edited.solve(scene([AT, [x, y]]))
    edited.scene = last = scene([AT, [x, y - 32]])
    edited.follow(last)
    seen = edited._map
    update = edited.solve(last, hand="released")
    assert update.ok and update.short == [0] and apart(seen, edited._map) < 1e-4
    assert update.scene.pins[0].target[1] > y - 31
    edited.scene = onward = update.scene
    edited.follow(onward)
    assert apart(seen, edited._map) < 0.01


@pytest.mark.slow
def test_the_map_comes_to_rest_while_the_hand_does(shapes):
    edited = Session(make({"source": "square.svg", "target": "blob.svg"}))
    edited.solve(scene())
    ends = [[[40.0, 45.0], [45.0, 50.0]], [[65.0, 60.0], [60.0, 62.0]]]
    edited.solve(scene(*ends))
    for step in (1, 2, 3):
        ends[0][1] = [45.0 - 5 * step, 50.0 + 4 * step]
        edited.scene = last = scene(*ends)
        edited.follow(last)
    steps, update = 0, edited.follow(last)
    while update is not None and steps < 40:
        seen, update, steps = edited._map, edited.relax(last), steps + 1
    assert steps < 40 and edited.relax(last) is None
    assert edited.solve(last).ok and apart(seen, edited._map) < 0.01


def test_maps_that_agree_need_no_start_and_others_are_told(dragged):
    edited, last, _ = dragged
    edited.solve(last)
    kept, fresh = edited._map, solve_scene(edited.pair, last, None).fit.map
    update = edited.compare(last)
    if same(kept, fresh):
        assert update.other == "" and update.drawn is not None and edited.start(last) is None
    else:
        assert update.other == "fresh" and update.drawn is None and edited._map is kept
        assert edited.compare(last) is None  # it is known by now
    assert same(kept, kept)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4, 7, 8])
def test_what_a_long_drag_met_is_met_when_it_is_let_go_of(seed):
    """Corners of the outlines pass each other during the drag; the map still continues from what is shown."""
    rng = np.random.default_rng(seed)
    edited = Session(make({side: str(PINS / f"{name}.svg") for side, name in DRAGGED.items()}))
    edited.solve(scene())
    here = inside(edited.pair.source, rng)
    begin = np.array(placing.transfer(edited, "source", [here])[0])
    edited.solve(scene([here, begin.tolist()]))
    goal = np.array(inside(edited.pair.target, rng))
    for share in np.arange(1, 61) / 60:
        edited.scene = last = scene([here, (begin + share * (goal - begin)).tolist()])
        assert edited.follow(last).ok, seed
    assert edited.solve(last).ok and edited.start(last) is not None, seed


def inside(shape, rng):
    """A point of a shape in file coordinates, away from its outline."""
    (low, high), curve = shape.curve.box, shape.curve
    while True:
        z = np.array([complex(*rng.uniform([low.real, low.imag], [high.real, high.imag]))])
        if curve.contains(z)[0] and curve.distances(z)[0] > 0.02 * curve.diagonal:
            return shape.to_file(z)[0].tolist()


@pytest.mark.slow
def test_without_pins_and_when_turned_it_is_made_from_scratch(dragged):
    edited, last, _ = dragged
    edited.solve(last)
    for other in (scene(), last.model_copy(update={"turn": 30.0})):
        assert edited.solve(other).ok and edited.start(other) is None


@pytest.mark.slow
def test_copies_of_drawings_hold_pins_and_a_file_beside_them_the_start(shapes, shell):
    for name, place in (("square.svg", "40 45"), ("blob.svg", "45 50")):
        x, y = place.split()
        pin = f'<circle id="pin-nose" cx="{x}" cy="{y}" r="2"/></svg>'
        (shapes / name).write_text((shapes / name).read_text().replace("</svg>", pin))
    edited = Session(make({"source": "square.svg", "target": "blob.svg"}))
    edited.solve(edited.pair.first)
    moved = scene([AT, [54, 55]])
    edited.follow(moved)
    edited.solve(moved)
    fields = saving.copies(edited, moved, saving.copy_names(edited, saving.ENDING), replace=False)
    assert fields["constraints"] == "square-blob-pins.json"
    assert json.loads((shapes / "square-blob-pins.json").read_text()).keys() == {"files", "start"}
    saving.export(edited, moved, "shown.png", 100, replace=False)
    done = shell(f"{saving.command(edited, moved)} --size 100")
    assert done.returncode == 0, done.stderr
    assert (shapes / "shown.png").read_bytes() == (shapes / "square-blob.png").read_bytes()


SQUARE = [[20, 20], [80, 20], [80, 80], [20, 80]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"triangles": [[0, 1, 2], [0, 2, 3]]}, "is flipped"),
        ({"triangles": [[0, 2, 1]]}, "each"),
        ({"triangles": [[0, 2, 1], [0, 3, 2], [0, 2, 1]]}, "do not form a disk"),
        ({"triangles": [[0, 2, 1], [0, 3, 2], [4, 6, 5], [4, 7, 6]], "double": True}, "do not form a disk"),
        ({"triangles": [[0, 1, 9]]}, "each"),
        ({"triangles": [[0, -1, 2]]}, "at least 0"),
        ({"target": SQUARE[:3]}, "4 vertices in the source but 3 in the target"),
        ({"source": [[20, 20]] * 4}, "no area"),
        ({"source": 5}, "a list"),
    ],
)
def test_a_start_that_is_no_map_is_refused_in_a_line(shapes, iccm, change, message):
    start = {"source": SQUARE, "target": SQUARE, "triangles": [[0, 2, 1], [0, 3, 2]]} | change
    if start.pop("double", False):
        start |= {side: SQUARE + [[x + 1, y] for x, y in SQUARE] for side in ("source", "target")}
    (shapes / "c.json").write_text(json.dumps({"start": start}))
    typed = iccm("map", "square.svg", "blob.svg", "--constraints", "c.json", "-q")
    assert typed.code == 2 and len(typed.lines) == 1 and message in typed.err


def test_a_start_of_other_outlines_is_refused_or_used(shapes, iccm):
    start = {"source": SQUARE, "target": SQUARE, "triangles": [[0, 2, 1], [0, 3, 2]]}
    (shapes / "c.json").write_text(json.dumps({"start": start}))
    typed = iccm("map", "square.svg", "blob.svg", "--constraints", "c.json", "-q", "--size", "40")
    assert typed.code in (0, 2) and len(typed.lines) <= 1


def test_a_start_is_for_the_balanced_method(shapes, iccm):
    start = {"source": SQUARE, "target": SQUARE, "triangles": [[0, 2, 1], [0, 3, 2]]}
    (shapes / "c.json").write_text(json.dumps({"start": start}))
    typed = iccm("map", "square.svg", "blob.svg", "--constraints", "c.json", "--method", "paper")
    assert typed.code == 2 and "balanced" in typed.err


@pytest.mark.parametrize(
    "text", ["", "nonsense", "é", "0" * 20, base64.b85encode(zlib.compress(b"icm1")).decode()]
)
def test_a_damaged_start_is_refused_in_a_line(shapes, iccm, text):
    (shapes / "c.json").write_text(json.dumps({"start": {"packed": text}}))
    typed = iccm("map", "square.svg", "blob.svg", "--constraints", "c.json", "-q")
    assert typed.code == 2 and len(typed.lines) == 1 and "start" in typed.err and "c.json" in typed.err


def test_starts_of_earlier_versions_are_read(dragged, shapes):
    edited, last, _ = dragged
    edited.solve(last)
    start = edited.start(last)
    listed = {"pins": [pin.model_dump(mode="json", exclude_defaults=True) for pin in last.pins]}
    listed["start"] = {name: getattr(start, name) for name in ("source", "target", "triangles", "kept")}
    (shapes / "old.json").write_text(json.dumps(listed))
    opened = Session(make({"source": "square.svg", "target": "blob.svg", "constraints": "old.json"}))
    assert opened.solve(opened.pair.first).ok
    assert np.array_equal(opened._map.image, edited._map.image)


def test_a_saved_map_is_small(dragged, shapes):
    edited, last, _ = dragged
    edited.solve(last)
    name = saving.save(edited, last, "square-blob.json", replace=False)
    assert edited.start(last) is not None
    assert len((shapes / name).read_bytes()) < 16 * len(edited._map.faces)  # lists of numbers took 60


@pytest.mark.slow
def test_a_start_is_read_as_it_was_written(dragged):
    edited, last, _ = dragged
    edited.solve(last)
    start, pair = edited.start(last), (edited.pair.source, edited.pair.target)
    map = start.map(*pair)
    again = StartingMap.model_validate_json(start.model_dump_json()).map(*pair)
    assert np.array_equal(again.source, map.source) and np.array_equal(again.faces, map.faces)
    assert set(again.loops[0]) == set(map.loops[0])


RING = '<svg xmlns="http://www.w3.org/2000/svg"><path fill-rule="evenodd" d="{}"/></svg>'


@pytest.mark.slow
def test_maps_with_holes_go_on_from_the_one_before_and_the_file_repeats_them(shapes):
    (shapes / "a.svg").write_text(RING.format("M10 10H90V90H10Z M35 35H60V60H35Z"))
    (shapes / "b.svg").write_text(RING.format("M50 5L95 50L50 95L5 50Z M45 45H65V70H45Z"))
    edited = Session(make({"source": "a.svg", "target": "b.svg"}))
    edited.solve(scene(fit="whole"))
    here = [20.0, 20.0]
    (x, y), *_ = placing.transfer(edited, "source", [here])
    for step in (1, 2):
        last = scene((here, [x + 3 * step, y + 2 * step]))
        assert edited.follow(last).ok
        seen = edited._map
        assert edited.solve(last).ok
        assert edited.start(last) is not None and apart(edited._map, seen) < 0.01
    (shapes / "kept.json").write_text(saving.constraints_json(edited, last))
    again = Session(make({"source": "a.svg", "target": "b.svg", "constraints": "kept.json"}))
    assert again.solve(again.pair.first).ok
    assert np.abs(again._map.image - edited._map.image).max() < 1e-9 * edited._map.image_diagonal


@pytest.mark.slow
def test_a_map_that_had_not_converged_relaxes_gradually_when_the_next_drag_begins(shapes, monkeypatch):
    edited = Session(make({"source": "square.svg", "target": "blob.svg"}))
    edited.solve(scene())
    (x, y), *_ = placing.transfer(edited, "source", [AT])
    edited.solve(scene([AT, [x, y]]))
    with monkeypatch.context() as limited:
        limited.setattr("iccm.balanced.interactive.BUDGET_TRIANGLE_STEPS", 0)  # two Newton steps an update
        edited.scene = last = scene([AT, [x, y - 32]])
        edited.follow(last)
        last = edited.solve(last, hand="released").scene
    (pin,) = last.pins
    maps = [edited._map]
    edited.scene = onward = scene([AT, [pin.target[0] + 0.1, pin.target[1]]])
    update = edited.follow(onward)
    while update is not None:
        assert edited._map.injectivity.certified
        maps.append(edited._map)
        update = edited.relax(onward)
    motions = [apart(before, after) for before, after in pairwise(maps)]
    assert apart(maps[0], maps[-1]) > 0.03 and motions[0] < 0.01 and max(motions) < 0.02
    assert motions[-1] < 0.003  # it converges while the hand rests
