"""Editing sessions without a browser: the converged map is that of `iccm map`, and saved files reproduce it."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.fit_data import with_details
from iccm.io.edit import placing, saving, solving
from iccm.io.edit.map_choice import MapChoice
from iccm.io.edit.map_update import LOST
from iccm.io.edit.messages import Scene, read
from iccm.io.edit.scene import PageHalf
from iccm.io.edit.session import Session
from iccm.io.edit.workspace import SAMPLES, samples_of
from iccm.io.pictures import image_files
from iccm.io.run.job import make
from iccm.io.shapes import shape
from iccm.pins import Softness

pytestmark = pytest.mark.usefixtures("solve_once")

PIN = {"name": "nose", "source": [40, 45], "target": [45, 50]}
OTHER = {"source": [65, 60], "target": [60, 62]}
STROKE = {"name": "arm", "source": [[30, 30], [60, 32]], "target": [[32, 32], [45, 35], [60, 33]]}


REGION = [[40.0, 40.0], [60.0, 40.0], [60.0, 55.0], [40.0, 55.0]]


def session(**job):
    return Session(make({"source": "square.svg", "target": "blob.svg", **job}))


def scene(*pins, **more):
    return Scene.model_validate({"pins": pins, **more})


def test_the_map_at_rest_is_whole_and_a_dragged_one_follows(shapes):
    edited = session()
    full = edited.solve(scene())
    assert (full.kind, full.ok, full.wrong) == ("full", True, {"pins": [], "strokes": []})
    assert full.drawn.shape[1] == 18 and full.drawn.dtype == np.float32
    assert full.figures["injective"]["certified"] and full.figures["boundary"]["hausdorff"] < 1e-3
    coarse = edited.follow(scene(PIN))
    assert (coarse.kind, coarse.ok) == ("coarse", True) and len(coarse.drawn) <= len(full.drawn)
    moved = edited.follow(scene({**PIN, "target": [50, 52]}))
    assert moved.ok and np.abs(moved.drawn - coarse.drawn).max() < 0.2


def test_patches_are_the_map(shapes):
    edited = session()
    update = edited.solve(scene(PIN))
    corners, control = update.drawn[:, :6].reshape(-1, 3, 2), update.drawn[:, 6:].reshape(-1, 6, 2)
    middle = control[:, :3].mean(axis=1) + 2 / 9 * control[:, 3:].sum(axis=1)
    source, target = edited.view.halves
    z = edited._map.inverse(_core(corners.mean(axis=1), target))
    assert np.nanmax(np.abs(_core(middle, source) - z)) < 1e-4 * edited.pair.source.curve.diagonal


def _core(points, view):
    return view.centre + view.scale * (points[..., 0] - 1j * points[..., 1])


def test_a_view_is_about_one_large_and_upside_down():
    view = PageHalf.of((100 + 50j, 300 + 100j), (120 + 0j, 180 + 60j))
    assert view.box((100 + 0j, 300 + 100j)) == [-0.5, -0.25, 0.5, 0.25]
    assert view.vectors(np.array([20 + 10j])).tolist() == [[pytest.approx(0.1), pytest.approx(-0.05)]]


@pytest.mark.parametrize("flip", [True, False])
def test_the_page_says_how_its_points_are_points_of_the_file(tmp_path, flip):
    corners = [[10, 20], [90, 20], [90, 50], [10, 40]]
    if flip:
        path = tmp_path / "a.svg"
        points = " ".join(f"{x},{y}" for x, y in corners)
        path.write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 99 60"><polygon points="{points}"/></svg>'
        )
    else:
        path = tmp_path / "a.geojson"
        path.write_text(json.dumps({"type": "Polygon", "coordinates": [[*corners, corners[0]]]}))
    read_shape = shape.read(str(path))
    side = PageHalf.of(read_shape.box).describe(read_shape, read_shape.box)
    places = np.array(side["outline"]) * side["signs"] * side["scale"] + side["origin"]
    assert sorted(places.round(4).tolist()) == sorted(map(list, corners)) and read_shape.flip == flip


def test_a_point_is_found_on_the_other_side_and_back(shapes):
    edited = session()
    edited.solve(scene())
    destination = placing.transfer(edited, "source", [(40, 45), (60, 61)])
    assert np.allclose(placing.transfer(edited, "target", destination), [(40, 45), (60, 61)], atol=1e-3)
    [[x, y]] = placing.transfer(edited, "source", [(10, 50)])
    z = complex(x, -y)
    curve = edited.pair.target.curve
    assert abs(curve.nearest(np.array([z]))[0] - z) < 1e-5
    rim = {"source": [10, 50], "target": [x, y]}
    assert edited.solve(scene(rim)).ok
    with pytest.raises(InputError, match="outside"):
        placing.transfer(edited, "source", [(5, 5)])


@pytest.mark.slow
def test_holes_are_carried_and_take_pins_that_name_partners(shapes):
    for name in ("square.svg", "blob.svg"):
        hole = 'M40 40V60H60V40Z"/>' if name == "square.svg" else 'M45 45V60H60V45Z"/>'
        (shapes / name).write_text((shapes / name).read_text().replace('Z"/>', f"Z{hole}"))
    edited = session()
    full = edited.solve(scene(fit="whole"))
    assert full.ok and len(edited._map.loops) == 2 and len(edited.describe()["target"]["holes"]) == 1
    with pytest.raises(InputError, match="in a hole"):
        placing.transfer(edited, "source", [(50, 50)])
    [[x, y]] = placing.transfer(edited, "source", [(25, 30)])
    pin = {"source": [25, 30], "target": [x + 2, y]}
    coarse = edited.follow(scene(pin, {"source": [50, 50], "target": [50, 50]}))
    assert coarse.ok and len(edited._map.loops) == 2
    assert edited.solve(scene(pin, {"source": [50, 50], "target": [50, 50]})).ok
    wrong = edited.follow(scene(pin, {"source": [50, 50], "target": [30, 50]}))
    assert wrong.wrong["pins"] == [1] and "hole" in wrong.message


@pytest.mark.parametrize("how", ["solve", "follow"])
@pytest.mark.parametrize(
    ("pins", "wrong", "message"),
    [
        ([PIN, {**PIN, "target": [60, 60]}], [0, 1], "pins 1 and 2"),
        ([PIN, {**OTHER, "target": [1, 1]}], [1], "outside"),
        ([PIN, {**OTHER, "source": [10, 50]}], [1], "outline"),
    ],
)
def test_what_cannot_be_is_told_and_the_map_stays(shapes, how, pins, wrong, message):
    edited = session()
    edited.solve(scene())
    before = edited._map
    update = getattr(edited, how)(scene(*pins))
    assert (update.kind, update.ok, update.drawn) == ("error", False, None)
    assert update.wrong["pins"] == wrong and message in update.message and edited._map is before
    assert edited.follow(scene(PIN)).ok


@pytest.mark.slow
def test_what_is_not_met_is_told_and_the_map_stays(shapes):
    edited = session(target="square.svg")
    edited.solve(scene())
    before = edited._map
    places = ((30, 46), (50, 46), (70, 46), (50, 54))
    pins = [{"source": [x, y], "target": [x, y], "radius": 0} for x, y in places]
    stroke = {"source": [[26, 50], [74, 50]], "target": [[26, 58], [74, 58]]}
    update = edited.solve(scene(*pins, strokes=[stroke]))
    assert (update.kind, update.ok, update.drawn) == ("error", False, None) and edited._map is before
    assert update.wrong["strokes"] == [0] and "could be met" in update.message


@pytest.mark.slow
def test_the_message_names_pins_that_a_good_map_misses(shapes):
    edited = session()
    edited.solve(scene())
    solved = solving.solve_scene(edited.pair, scene(PIN, OTHER), None)
    assert solved.status.ok
    solved.report["pins"][1]["error"] = 0.2  # as if the map missed it
    update = edited._settle(scene(PIN, OTHER), solved, MapChoice())
    assert (update.kind, update.ok, update.wrong["pins"]) == ("error", False, [1])
    assert "pin 2" in update.message and "pin 1" not in update.message


@pytest.mark.slow
def test_saved_constraints_repeat_the_map(shapes, shell):
    edited = session(balance=1.5)
    expected_scene = scene(PIN, OTHER, strokes=[STROKE], balance=2.0, turn=10.0)
    assert edited.solve(expected_scene).ok
    name = saving.save(edited, expected_scene, "square-blob.json", replace=False)
    assert saving.export(edited, expected_scene, "shown.png", 200, replace=False).ok
    line = saving.command(edited, expected_scene)
    options = f"--constraints {name} --balance 2.0 --turn 10.0 -o square-blob.png"
    assert sorted(shlex.split(line)) == sorted(f"iccm map square.svg blob.svg {options}".split())
    done = shell(f"{line} --size 200")
    assert done.returncode == 0, done.stderr
    assert (shapes / "shown.png").read_bytes() == (shapes / "square-blob.png").read_bytes()
    again = session(constraints=name).pair.first
    assert (again.pins, again.strokes) == (expected_scene.pins, expected_scene.strokes)
    data = json.loads((shapes / name).read_text())
    assert data["files"]["source"] == {"file": "square.svg", "size": [100.0, 100.0]}


def test_constraints_of_other_sizes_are_refused(shapes, iccm):
    edited = session()
    saving.save(edited, scene(PIN), "c.json", replace=False)
    text = (shapes / "square.svg").read_text().replace("0 0 100 100", "0 0 200 100")
    (shapes / "square.svg").write_text(text)
    typed = iccm("map", "square.svg", "blob.svg", "--constraints", "c.json", "-q")
    assert typed.code == 2 and "square.svg" in typed.err and '"files"' in typed.err
    assert typed.err.index("100 x 100") < typed.err.index("200 x 100")


@pytest.mark.slow
def test_copies_repeat_the_map_too(shapes, shell):
    edited = session()
    expected_scene = scene(PIN, OTHER, strokes=[STROKE])
    fields = saving.copies(edited, expected_scene, saving.copy_names(edited, "-pins"), replace=False)
    assert fields == {"source": "square-pins.svg", "target": "blob-pins.svg"}
    saving.export(edited, expected_scene, "shown.png", 150, replace=False)
    done = shell(f"{saving.command(edited, expected_scene, fields)} --size 150")
    assert done.returncode == 0, done.stderr
    assert (shapes / "shown.png").read_bytes() == (shapes / "square-blob.png").read_bytes()


@pytest.mark.slow
def test_drawn_pins_are_edited_in_copies(shapes, shell):
    for name, place in (("square.svg", "40 45"), ("blob.svg", "45 50")):
        x, y = place.split()
        pin = f'<circle id="pin-nose" cx="{x}" cy="{y}" r="2"/></svg>'
        (shapes / name).write_text((shapes / name).read_text().replace("</svg>", pin))
    edited = session()
    assert [pin.name for pin in edited.pair.first.pins] == ["nose"] and edited.pair.drawn
    moved = scene({**PIN, "target": [50, 55]})
    with pytest.raises(InputError, match="already contains pins"):
        saving.save(edited, moved, "c.json", replace=False)
    saving.export(edited, moved, "shown.png", 100, replace=False)
    saving.copies(edited, moved, saving.copy_names(edited, saving.ENDING), replace=False)
    done = shell(f"{saving.command(edited, moved)} --size 100")
    assert done.returncode == 0, done.stderr
    assert (shapes / "shown.png").read_bytes() == (shapes / "square-blob.png").read_bytes()


def test_names_are_made_different():
    named_scene = saving.with_names(
        scene({**PIN, "name": "a"}, {**PIN, "name": ""}, {**PIN, "name": "a"}, {**PIN, "name": "2"})
    )
    assert [pin.name for pin in named_scene.pins] == ["a", "2", "a'", "2'"]


@pytest.mark.parametrize(
    "name", ["../c.json", "/tmp/c.json", ".c.json", "-c.json", "a\\c.json", "c.txt", "a/b.json", "c\n.json"]
)
def test_only_plain_names_are_written(shapes, name):
    edited, before = session(), set(shapes.iterdir())
    with pytest.raises(InputError):
        saving.save(edited, scene(PIN), name, replace=True)
    assert set(shapes.iterdir()) == before


def test_the_file_that_was_opened_may_lie_elsewhere(shapes):
    (shapes / "deep").mkdir()
    (shapes / "deep" / "c.json").write_text(json.dumps({"pins": [PIN]}))
    edited = session(constraints="deep/c.json")
    assert saving.constraints_file(edited) == "deep/c.json"
    saving.save(edited, scene(OTHER), "deep/c.json", replace=True)
    assert json.loads((shapes / "deep" / "c.json").read_text())["pins"] == [
        {"source": [65.0, 60.0], "target": [60.0, 62.0]}
    ]


@pytest.mark.parametrize("name", ["out.tif", "map-stmap.exr", "art.svg"])
def test_exports_are_of_every_kind(shapes, name):
    edited = session()
    assert saving.export(edited, scene(PIN), name, 60, replace=False).written == (name,)
    assert (shapes / name).stat().st_size > 0
    with pytest.raises(InputError):
        saving.export(edited, scene(PIN), name, 60, replace=False)


def test_a_large_texture_is_made_smaller_for_the_browser(shapes):
    pixels = np.zeros((10, 9000, 3), np.uint16)
    pixels[:, 4500:] = 65535
    image_files.write("wide.png", image_files.Image(pixels))
    (shapes / "t.png").write_bytes(session(texture="wide.png").view.texture(4096))
    smaller = image_files.read("t.png").pixels
    assert smaller.shape == (5, 4096, 3) and smaller[0, 0, 0] == 0 and smaller[0, -1, 0] == 65535


@pytest.mark.parametrize(
    ("job", "message"),
    [
        ({"target": "no.svg"}, "no such file"),
        ({"texture": "no.png"}, "no such file"),
        ({"pin": ["40,40:200,200"]}, "outside"),
        ({"pin": ["40,40:v3"]}, "mesh"),
        ({"balance": 0}, "balance"),
    ],
)
def test_wrong_inputs_are_told_at_once(shapes, job, message):
    with pytest.raises(InputError, match=message):
        session(**job)


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", "null", "{", '{"type": "drop"}', '{"type": "solve", "seq": 1}',
     '{"type": "solve", "seq": 1, "scene": 3}',
     '{"type": "place", "id": 1, "side": "top", "points": [[1, 2]]}',
     '{"type": "place", "id": 1, "side": "source", "points": []}',
     '{"type": "place", "id": 1, "side": "source", "points": [[1, NaN]]}',
     '{"type": "solve", "seq": 1, "scene": {"pins": [{"source": "x5", "target": [1, 2]}]}}',
     '{"type": "solve", "seq": 1, "way": "other", "scene": {}}',
     '{"type": "solve", "seq": 1, "scene": {"pins": [{"source": [1e400, 2], "target": [1, 2]}]}}',
     '{"type": "solve", "seq": 1, "scene": {"balance": 0}}', '{"type": "solve", "seq": 1, "scene": {"turn": "some"}}',
     '{"type": "solve", "seq": 1, "scene": {"more": 1}}',
     '{"type": "save", "id": 1, "scene": {}, "name": ""}', "[" * 10000,
     json.dumps({"type": "solve", "seq": 1, "scene": {"pins": [PIN] * 501}}),
     json.dumps({"type": "solve", "seq": 1, "scene": {"strokes": [{**STROKE, "source": [[1, 2]] * 2001}]}})],
)  # fmt: skip
def test_what_is_no_message_is_refused(text):
    with pytest.raises(InputError, match="invalid message") as caught:
        read(text)
    assert str(caught.value).count("message") == 1


LIMB = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="M10 40H45V2H55V40H90V90H10Z"/></svg>'


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fit", "pair", "lost"),
    [
        ("whole", ("limb", "square"), set()),
        ("contain", ("limb", "square"), {"uncovered"}),
        ("cover", ("square", "limb"), {"left_out"}),
        ("auto", ("limb", "square"), set()),
    ],
)
def test_parts_may_be_left_out_and_the_command_says_so(shapes, shell, fit, pair, lost):
    """A block with a long protrusion between concavities, and a square."""
    (shapes / "limb.svg").write_text(LIMB)
    edited = session(source=f"{pair[0]}.svg", target=f"{pair[1]}.svg")
    expected_scene = scene(fit=fit)
    full = edited.solve(expected_scene)
    assert full.kind == "full" and {key for key in LOST if full.figures.get(key, 0) > 1e-3} == lost
    saving.export(edited, expected_scene, "shown.png", 100, replace=False)
    done = shell(f"{saving.command(edited, expected_scene)} --size 100")
    assert (shapes / "shown.png").read_bytes() == (shapes / f"{pair[0]}-{pair[1]}.png").read_bytes(), (
        done.stderr
    )
    pins = scene({"source": [50, 60], "target": [50, 65]}, fit=fit)
    assert edited.follow(pins).kind == "coarse"
    assert edited.solve(pins).kind == "full" and not edited.solve(pins).wrong["pins"]


def test_a_pin_that_is_met_exactly_is_followed_exactly(shapes):
    edited = session()
    pins = scene(PIN, OTHER)
    edited.solve(pins)
    # as of pins that would miss their places as soft ones
    softness = edited._fit.details.softness.with_pins(np.array([0]), Softness.exact(1))
    edited._fit = with_details(edited._fit, softness=softness)
    for side in ("source", "target"):
        moved = {**PIN, side: [PIN[side][0] + 2, PIN[side][1]]}
        edited.follow(scene(moved, OTHER))
        assert edited._live.met and not edited._live.coarse
        assert edited._live.exact.inner.shape[1:] == (2,) and len(edited._live.exact.inner) == 1


def test_handles_lie_where_the_map_takes_them_and_keep_it(shapes):
    edited = session()
    assert edited.solve(scene()).ok
    seen = edited._map
    handles = scene(*placing.handles(edited, scene(), 3, 4))
    assert len(handles.pins) > 6 and edited.solve(handles).ok
    inner = np.setdiff1d(np.arange(seen.source.size), seen.loops[0])
    gap = np.abs(edited._map(seen.source[inner]) - seen.image[inner])
    assert gap.max() < 1e-6 * seen.image_diagonal
    assert edited.start(handles).kept  # is saved with the pins
    assert len(placing.handles(edited, handles, 3, 5)) > 3  # between those that are there


def test_handles_that_would_change_the_picture_are_refused(shapes):
    edited = session()
    with pytest.raises(InputError, match="no map"):
        placing.handles(edited, scene(), 3, 3)
    edited.solve(scene())
    line = {"source": [[30, 30], [50, 50]], "target": [[30, 30], [50, 50]]}
    with pytest.raises(InputError, match="strokes"):
        placing.handles(edited, scene(strokes=[line]), 3, 3)
    with pytest.raises(InputError, match="at most 500"):
        placing.handles(edited, scene(), 30, 30)
    with pytest.raises(InputError, match="inside"):
        placing.handles(edited, scene(*placing.handles(edited, scene(), 1, 1)), 1, 1)
    deformed = Session(make({"source": "square.svg"}))
    deformed.solve(scene())
    with pytest.raises(InputError, match="planar"):
        placing.handles(deformed, scene(), 3, 3)


FACE = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">
  <path id="head" d="M20 20H80V{bottom}H20Z"/><circle id="eye" cx="{x}" cy="45" r="6"/></svg>"""


@pytest.mark.slow
def test_corners_and_what_both_drawings_name_are_suggested(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, x, bottom in (("a", 40, 80), ("b", 55, 90)):
        (tmp_path / f"{name}.svg").write_text(FACE.format(x=x, bottom=bottom))
    edited = Session(make({"source": "a.svg#head", "target": "b.svg#head"}))
    edited.solve(scene())
    suggestions = placing.suggest(edited, scene())
    assert [pin["name"] for pin in suggestions] == ["eye", "", "", "", ""]
    assert np.allclose([suggestions[0]["source"], suggestions[0]["target"]], [[40, 45], [55, 45]], atol=0.1)
    ends = sorted((*pin["source"], *pin["target"]) for pin in suggestions[1:])
    assert np.allclose(
        ends, [[20, 20, 20, 20], [20, 80, 20, 90], [80, 20, 80, 20], [80, 80, 80, 90]], atol=1e-6
    )
    assert edited.solve(scene(*suggestions)).kind == "full"
    assert placing.suggest(edited, scene(*suggestions)) == []
    sides = edited.describe()
    assert len(sides["source"]["corners"]) == 4 and sides["source"]["axis"] == pytest.approx(0, abs=1e-6)


def test_rigid_regions_are_shown_saved_and_taken_up_again(shapes):
    (shapes / "c.json").write_text(json.dumps({"rigid": [REGION]}))
    edited = session(constraints="c.json")
    update = edited.solve(edited.scene)
    (region,) = update.figures["regions"]
    assert update.ok and region["dilatation"] <= 1.02 and region["scale"] == pytest.approx(1, abs=0.02)
    assert len(region["source"]) == len(region["target"]) > 3
    more = scene(rigid=[REGION, "mask.png"])
    refused = edited.solve(more)
    assert refused.kind == "error" and "only regions " in refused.message
    assert saving.save(edited, edited.pair.first, "c.json", replace=True) == "c.json"
    assert json.loads((shapes / "c.json").read_text())["rigid"] == [REGION]
    assert "--constraints c.json" in saving.command(edited, edited.pair.first)


@pytest.mark.slow
def test_without_a_target_the_shape_is_deformed_and_nothing_jumps(shapes, shell):
    edited = Session(make({"source": "square.svg"}))
    assert edited.solve(scene()).ok and np.allclose(
        placing.transfer(edited, "source", [(40, 45)]), [[40, 45]]
    )
    pin = {"source": [30, 50], "target": [30, 50]}
    edited.solve(scene(pin, {"source": [70, 50], "target": [70, 50]}))
    for step in range(1, 6):
        bent = scene(pin, {"source": [70, 50], "target": [70 + step, 50 + 5 * step]})
        update = edited.follow(bent)
        assert (
            update.kind == "coarse" and update.ok and len(update.outlines) == 2
        )  # its frame, and what it paints
    seen = edited._map
    hardly = 1e-5 * edited.pair.source.curve.diagonal
    assert edited.solve(bent).ok and np.abs(edited._map.image - seen.image).max() < hardly
    near = pytest.approx([70, 50], abs=update.patches[1]["tolerance"])
    assert placing.transfer(edited, "target", [(75, 75)])[0] == near
    name = saving.save(edited, bent, "square-deformed.json", replace=False)
    saving.export(edited, bent, "shown.png", 100, replace=False)
    line = saving.command(edited, bent)
    assert line == f"iccm deform square.svg --constraints {name} -o square-deformed.png"
    done = shell(f"{line} --size 100")
    assert done.returncode == 0, done.stderr
    assert (shapes / "shown.png").read_bytes() == (shapes / "square-deformed.png").read_bytes()
    with pytest.raises(InputError, match="JSON"):
        saving.copy_names(edited, saving.ENDING)


def test_a_pin_turns_a_shape_without_a_target_and_is_saved_so(shapes, iccm):
    edited = Session(make({"source": "square.svg"}))
    held = {"source": [30, 50], "target": [30, 50]}
    free, turned = ({"source": [70, 50], "target": [70, 50], "turn": turn} for turn in (None, 40))
    core = edited.pair.placed(scene(free)).pins[0, 0]
    around = 3 * np.exp(2j * np.pi * np.arange(6) / 6)
    for pin, angle in ((free, 0), (turned, 40)):
        derivative = edited.solve(scene(held, pin))
        assert derivative.ok and edited._map.injectivity.certified
        found = np.mean(edited._map(core + around) / around) - core * np.mean(1 / around)
        assert abs(np.degrees(np.angle(found)) - angle) < 3
        assert abs(edited._map(np.array([core]))[0] - core) < derivative.patches[1]["tolerance"]
    seen = edited._map.image
    name = saving.save(edited, scene(held, turned), "turned.json", replace=False)
    again = Session(make({"source": "square.svg", "constraints": name}))
    assert again.pair.first.pins[1].turn == 40 and again.solve(again.pair.first).ok
    assert np.array_equal(again._map.image, seen)
    done = iccm("map", "square.svg", "blob.svg", "--constraints", name, "--exact-pins", "-o", "a.png")
    assert done.code == 2 and "turn" in done.err


def test_a_pin_on_the_outline_turns_nothing(shapes):
    edited = Session(make({"source": "square.svg"}))
    corner = edited.pair.source.to_file(edited.pair.source.curve.z[:1])[0].tolist()
    update = edited.solve(scene({"source": corner, "target": corner, "turn": 10}))
    assert update.kind == "error" and update.wrong["pins"] == [0]
    assert update.message.startswith("pin 1:") and "outline" in update.message


@pytest.mark.parametrize("name", SAMPLES)
def test_a_sample_opens_the_sides_that_its_texture_was_drawn_for(name):
    files = samples_of(name)
    words = shlex.split((Path(files[0]).parent / "command.txt").read_text())
    assert [Path(file).name for file in files] == [*words[2:4], words[words.index("--texture") + 1]]
