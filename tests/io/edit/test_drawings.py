"""Whole drawings on the page: the page shows the result of `iccm map`, and pins and strokes work in frames."""

import io
import json
import re
import shlex

import numpy as np
import pytest
import shapely
from PIL import Image

from iccm import load
from iccm.errors import InputError
from iccm.io.edit import placing, saving
from iccm.io.edit.map_choice import displacement
from iccm.io.edit.messages import Scene
from iccm.io.edit.session import Session
from iccm.io.edit.workspace import parts_of
from iccm.io.run.job import make
from iccm.maps.joined import images
from tests.cases import slow

pytestmark = pytest.mark.usefixtures("solve_once")

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'
BARS = '<path d="M10 10H30V90H10Z"/><path d="M40 30H60V90H40Z"/><path d="M70 60H90V90H70Z"/>'
PANES = '<path d="M5 5H95V40H5Z"/><path d="M5 50H95V95H5Z"/>'
DOTS = '<circle cx="22" cy="24" r="15"/><circle cx="80" cy="20" r="12"/><circle cx="50" cy="82" r="14"/>'
SQUARES = '<path d="M8 8H34V34H8Z"/><path d="M66 12H94V38H66Z"/><path d="M36 66H62V96H36Z"/>'
COMB = '<path d="M10 90V34H17V80H30V10H37V80H52V26H59V80H84V18H91V90Z"/><path d="M66 44H74V54H66Z"/>'
HOUSE = '<path d="M10 90V50L42 40L80 52V90Z"/><path d="M62 32H70V42H62Z"/>'
FORK = '<path d="M5 95V25H35V75L70 70V35H95V95Z"/>'
GAP = {"source": [65.0, 75.0], "target": [60.0, 46.0]}  # between parts on both sides


@pytest.fixture
def drawings(shapes):
    for name, drawn in (
        ("bars", BARS),
        ("panes", PANES),
        ("dots", DOTS),
        ("squares", SQUARES),
        ("comb", COMB),
        ("house", HOUSE),
        ("fork", FORK),
    ):
        (shapes / f"{name}.svg").write_text(SVG.format(drawn))
    return shapes


def scene(*pins, **more):
    return Scene.model_validate({"pins": pins, **more})


def session(source, target=None, **job):
    return Session(make({"source": source, **({"target": target} if target else {}), **job}))


@pytest.mark.parametrize(
    ("pair", "expected"),
    [
        (("bars.svg", "panes.svg"), scene()),
        # parts mapped separately
        slow(("dots.svg", "squares.svg"), scene()),
        slow(("bars.svg", "blob.svg"), scene(fit="frame")),
        slow(("bars.svg", "panes.svg"), scene(GAP)),
        (("square.svg", "bars.svg"), scene(fit="contain")),
    ],
)
def test_what_is_shown_is_what_the_command_writes(drawings, iccm, pair, expected):
    edited = session(*pair)
    update = edited.solve(expected)
    assert update.kind == "full", update.message
    assert saving.export(edited, expected, "page.png", 120, replace=False).ok == update.ok
    if expected.constrained:
        saving.save(edited, expected, saving.constraints_file(edited), replace=False)
    words = shlex.split(saving.command(edited, expected))[1:]
    done = iccm(*words[:-1], "typed.png", "--size", "120", "--report", "report.json")
    assert done.code in (0, 1), done.err
    assert (drawings / "typed.png").read_bytes() == (drawings / "page.png").read_bytes()
    report = json.loads((drawings / "report.json").read_text())
    for name in ("status", "stretch", "shown", "covered", "left_out"):
        assert update.figures.get(name) == report.get(name), name
    assert ("--fit" in words) == (expected.fit != "auto")


def test_the_page_knows_all_parts_and_the_frame_around_them(drawings):
    edited = session("bars.svg", "panes.svg")
    source, target = (edited.describe()[side] for side in ("source", "target"))
    assert [len(side["painted"]) for side in (source, target)] == [3, 2]
    (left, top, right, bottom), frame = source["bounds"], np.array(source["outline"])
    corners = np.concatenate([np.array(ring) for ring in source["painted"]])
    for outline in (frame, corners):
        assert np.allclose(
            [*outline.min(axis=0), *outline.max(axis=0)], [left, top, right, bottom], atol=1e-5
        )


def test_gaps_of_a_drawing_that_is_its_own_picture_are_shown_as_the_command_shows_them(drawings):
    (drawings / "two.svg").write_text(
        SVG.format('<path d="M10 10H40V90H10Z" fill="red"/><path d="M60 20H90V80Z" fill="blue"/>')
    )
    for gaps, opaque in (("paper", True), ("transparent", False)):
        edited = Session(make({"source": "two.svg", "target": "panes.svg", "background": gaps}))
        picture = np.asarray(Image.open(io.BytesIO(edited.view.texture(64))).convert("RGBA"))
        assert (picture[..., 3].min() == 255) == opaque


@pytest.mark.slow
def test_a_pin_between_parts_is_met_and_followed(drawings):
    edited = session("bars.svg", "panes.svg")
    assert edited.solve(scene(GAP)).ok
    start = np.array(GAP["target"])
    for share in np.linspace(0.2, 1, 5):
        moved = scene({**GAP, "target": (start + share * ((64.0, 45.0) - start)).tolist()})
        coarse = edited.follow(moved)
    assert (coarse.kind, coarse.ok) == ("coarse", True), coarse.message
    update = edited.solve(moved)
    assert update.ok
    [destination] = placing.transfer(edited, "source", [GAP["source"]])
    assert np.hypot(destination[0] - 64, destination[1] - 45) < 3 * update.patches[0]["tolerance"]
    stroke = {"source": [[20.0, 80.0], [80.0, 80.0]], "target": [[20.0, 70.0], [75.0, 75.0]]}
    assert edited.solve(scene(strokes=[stroke])).ok


@pytest.mark.slow
def test_the_first_pin_changes_nothing_where_the_map_takes_it(drawings, iccm):
    edited = session("comb.svg", "panes.svg#bbox")
    assert edited.solve(scene()).ok
    shown = edited.maps[0]
    source, target = edited.pair.source, edited.pair.target
    assert edited.fit.source.area > 1.1 * source.curve.area  # the map is one of wider frames
    [place] = placing.transfer(edited, "source", [(14.0, 50.0)])
    pin = {"source": [14.0, 50.0], "target": place}
    assert edited.solve(scene(pin)).ok
    assert displacement(shown, edited.maps[0]) < 1e-6 * target.curve.diagonal
    # it is dragged by 4 % of the diagonal, and released
    moved = scene({**pin, "target": [place[0] + 4, place[1] - 3]})
    assert edited.follow(moved).ok
    followed = edited.maps[0]
    assert edited.solve(moved, hand="released").ok
    assert displacement(followed, edited.maps[0]) < 0.01 * target.curve.diagonal
    saving.save(edited, moved, saving.constraints_file(edited), replace=False)
    words = shlex.split(saving.command(edited, moved))[1:]
    assert iccm(*words[:-1], "typed.npz").code == 0
    assert displacement(load("typed.npz").map, edited.maps[0]) < 1e-3 * target.curve.diagonal


def hiding(fit="auto"):
    """Return a session whose map hides part of the source, and a pin where the map takes it."""
    # by its detail the house would be composed, in a frame that pins keep
    edited = Session(make({"source": "house.svg", "target": "fork.svg", "detail": 0}))
    assert edited.solve(scene(fit=fit)).ok and edited.fit.coverage.is_partial
    at = [70, 80]
    return edited, {"source": placing.transfer(edited, "target", [at])[0], "target": at}


def dragged_to(edited, pin, at, fit="auto", steps=5):
    """Drag a pin to a place, and release it; return the scene and the update."""
    start = np.array(pin["target"], float)
    for share in np.arange(1, steps + 1) / steps:
        edited.scene = last = scene(
            {**pin, "target": (start + share * (np.array(at) - start)).tolist()}, fit=fit
        )
        assert edited.follow(last).drawn is not None
    return last, edited.solve(last, hand="released")


@pytest.mark.slow
@pytest.mark.parametrize("fit", ["auto", "cover"])
def test_the_first_pin_on_a_map_that_hides_parts_changes_nothing(drawings, fit):
    edited, pin = hiding(fit)
    before, diagonal = edited.maps[0], edited.pair.target.curve.diagonal
    first = edited.solve(scene(pin, fit=fit))
    assert first.ok and displacement(before, edited.maps[0]) < 1e-6 * diagonal
    last, released = dragged_to(edited, pin, [75, 78], fit)
    assert released.ok and released.figures["injective"]["certified"] and not released.short
    moved = np.abs(edited.maps[0](before.source) - before.image) / diagonal
    at = edited.pair.placed(last).pins[0]
    assert abs(edited.maps[0](at[:1])[0] - at[1]) < 0.01 * diagonal
    assert moved.max() > 0.03 and np.nanmedian(moved) < 0.01  # the drag stays local


@pytest.mark.slow
def test_a_drag_on_a_map_that_hides_parts_is_undone_saved_and_repeated(drawings, iccm):
    edited, pin = hiding()
    edited.solve(scene(pin))
    last, _ = dragged_to(edited, pin, [75, 78])
    seen, diagonal = edited.maps[0], edited.pair.target.curve.diagonal
    assert edited.solve(scene(pin)).ok and displacement(seen, edited.maps[0]) > 1e-3 * diagonal
    assert edited.solve(last).ok and np.array_equal(edited.maps[0].image, seen.image)
    _, further = dragged_to(edited, {**pin, "target": [75, 78]}, [72, 80])
    assert further.ok  # from the map that undo brought back
    edited.solve(last)
    saving.save(edited, last, saving.constraints_file(edited), replace=False)
    assert iccm(*shlex.split(saving.command(edited, last))[1:-1], "typed.npz").code == 0
    assert np.array_equal(load("typed.npz").map.image, edited.maps[0].image)


@pytest.mark.slow
def test_another_fit_is_offered_where_parts_are_hidden_and_shown_only_when_asked_for(drawings):
    edited, pin = hiding()
    edited.solve(scene(pin))
    last, _ = dragged_to(edited, pin, [75, 78])
    seen = edited.maps[0]
    offered = edited.compare(last, resting=True)
    assert offered.other == "fresh" and edited.maps[0] is seen
    assert edited.solve(last, "fresh").ok and displacement(seen, edited.maps[0]) > 0.01
    assert edited.solve(last, "kept").ok and np.array_equal(edited.maps[0].image, seen.image)


@pytest.mark.slow
def test_a_stroke_shows_what_was_hidden_with_a_message(drawings):
    edited, _ = hiding()
    stroke = {"source": [[14, 60], [14, 80]], "target": [[12, 60], [12, 80]]}
    update = edited.solve(Scene.model_validate({"strokes": [stroke]}))
    assert update.ok and "nothing is left out" in update.message


@pytest.mark.slow
def test_a_click_on_a_point_that_is_hidden_is_refused(drawings):
    edited = session("panes.svg#bbox", "comb.svg")
    assert edited.solve(scene(fit="frame")).ok
    gap = [22.0, 40.0]  # between two teeth
    z = edited.maps[0].inverse(np.array([edited.pair.target.at(gap)]))
    with pytest.raises(InputError):
        placing.transfer(edited, "source", edited.pair.source.to_file(z).tolist())


@pytest.mark.slow
def test_parts_that_are_mapped_one_by_one_each_take_points(drawings):
    edited = session("dots.svg", "squares.svg", texture="checker")
    assert edited.solve(scene()).ok and len(edited._maps) == 3
    destination = placing.transfer(edited, "source", [(22, 24), (80, 20), (50, 82)])
    for (x, y), (left, top, right, bottom) in zip(
        destination, ((8, 8, 34, 34), (66, 12, 94, 38), (36, 66, 62, 96))
    ):
        assert left < x < right and top < y < bottom
    assert np.allclose(
        placing.transfer(edited, "target", destination), [(22, 24), (80, 20), (50, 82)], atol=1e-3
    )
    # the outline that they are displayed with is not theirs
    source, target = edited.pair.source, edited.pair.target
    middle = source.curve.z.mean()
    rim = source.curve.z + 1e-3 * (middle - source.curve.z)
    rim = rim[source.curve.contains(rim) & np.isfinite(images(edited.maps, rim))]
    assert rim.size
    carried = placing.transfer(edited, "source", source.to_file(rim).tolist())
    assert np.allclose(carried, target.to_file(images(edited.maps, rim)), atol=1e-3)


def exported(edited, of_scene, name):
    """Return the bytes of the picture that the command writes for a scene."""
    return saving.download(edited, of_scene, name, 120).content


@pytest.mark.slow
def test_the_first_pin_on_parts_that_are_mapped_one_by_one_changes_nothing(drawings, iccm):
    edited = session("dots.svg", "squares.svg", texture="checker")
    assert edited.solve(scene()).ok
    before, picture, diagonal = (
        edited.maps,
        exported(edited, scene(), "a.png"),
        edited.pair.target.curve.diagonal,
    )
    place = [52.0, 84.0]
    pin = {"source": place, "target": placing.transfer(edited, "source", [place])[0]}
    first = edited.solve(scene(pin))
    assert first.ok and [displacement(*maps) for maps in zip(before, edited.maps)] == pytest.approx(
        [0] * 3, abs=1e-7
    )
    assert exported(edited, scene(pin), "b.png") == picture
    # dragged, it moves its own part, and nothing else
    x, y = pin["target"]
    last, released = dragged_to(edited, pin, [x - 4, y - 3])
    assert released.ok and released.figures["injective"]["certified"] and not released.short
    moved = [displacement(*maps) / diagonal for maps in zip(before, edited.maps)]
    assert np.sort(moved) == pytest.approx([0, 0, max(moved)], abs=1e-7) and max(moved) > 0.01
    # saved, and repeated by the command line
    saving.save(edited, last, saving.constraints_file(edited), replace=False)
    saving.export(edited, last, "page.png", 120, replace=False)
    done = iccm(*shlex.split(saving.command(edited, last))[1:-1], "typed.png", "--size", "120")
    assert done.code == 0, done.err
    assert (drawings / "typed.png").read_bytes() == (drawings / "page.png").read_bytes()
    assert exported(edited, last, "c.png") != picture


@pytest.mark.slow
def test_a_pin_in_a_second_part_leaves_the_first_ones_where_they_are(drawings):
    edited = session("dots.svg", "squares.svg", texture="checker")
    edited.solve(scene())
    pins = []
    for place, offset in (((52.0, 84.0), -4), ((20.0, 22.0), 4)):
        [[x, y]] = placing.transfer(edited, "source", [place])
        pins.append({"source": place, "target": [x, y]})
        assert edited.solve(scene(*pins)).ok
        for share in (0.25, 0.5, 0.75, 1):
            pins[-1] = {"source": place, "target": [x + share * offset, y]}
            edited.scene = last = scene(*pins)
            assert edited.follow(last).drawn is not None
        assert edited.solve(last, hand="released").ok
    assert len(edited.maps) == 3
    placed = edited.pair.placed(last).pins
    gaps = np.abs(images(edited.maps, placed[:, 0]) - placed[:, 1]) / edited.pair.target.curve.diagonal
    assert gaps.max() < 0.01


@pytest.mark.slow
def test_a_pin_that_is_dragged_out_of_its_part_stops_at_the_rim(drawings):
    edited = session("dots.svg", "squares.svg", texture="checker")
    edited.solve(scene())
    place = [52.0, 84.0]
    pin = {"source": place, "target": placing.transfer(edited, "source", [place])[0]}
    edited.solve(scene(pin))
    _, released = dragged_to(edited, pin, [49.0, 58.0])  # between the squares
    assert released.kind == "full" and released.ok and released.short == [0] and len(edited.maps) == 3
    x, y = released.scene.pins[0].target
    assert 36 <= x <= 62 and 66 <= y < 72


def area_of(rings):
    """The area within an odd number of rings."""
    area = shapely.Polygon()
    for ring in rings:
        area = area.symmetric_difference(shapely.Polygon(ring))
    return area


@pytest.mark.slow
def test_the_first_pin_keeps_the_silhouette_on_which_a_drawing_is_shown(drawings):
    (drawings / "sign.svg").write_text(
        SVG.format(
            '<path fill-rule="evenodd" d="M10 10H90V90H10ZM16 16V84H84V16Z"/><path d="M30 46H70V54H30Z"/>'
        )
    )
    (drawings / "ring.svg").write_text(
        SVG.format(
            '<path fill-rule="evenodd" d="M18 6H81L100 62V94H0V62ZM23 12L7 62H93L77 12ZM6 69V87H94V69Z"/>'
            '<path d="M12 75H19V81H12Z"/>'
        )
    )
    edited = session("sign.svg", "ring.svg")
    shown = edited.solve(scene())
    assert shown.ok and len(shown.silhouette["rings"]) == 1 and len(shown.silhouette["toned"]) >= 2
    picture, place = exported(edited, scene(), "a.png"), [50.0, 50.0]
    pin = {"source": place, "target": placing.transfer(edited, "source", [place])[0]}
    pinned = edited.solve(scene(pin))
    assert pinned.ok and pinned.silhouette["rings"] == shown.silhouette["rings"]
    paper = tuple(bytes.fromhex(shown.silhouette["colors"][0][1:]))
    for data in (edited.view.texture(256, toned=True), picture):
        image = Image.open(io.BytesIO(data))
        colours = {colour[:3] for _, colour in image.convert("RGBA").getcolors(2**20)}
        assert paper in colours  # on the page as in the export
    toned, before = (area_of(update.silhouette["toned"]) for update in (pinned, shown))
    assert toned.symmetric_difference(before).area < 1e-3 * before.area  # whose outline has other vertices
    assert exported(edited, scene(pin), "b.png") == picture
    _, released = dragged_to(edited, pin, [pin["target"][0] + 5, pin["target"][1]])
    assert released.ok and released.silhouette["rings"] == shown.silhouette["rings"]


def test_all_parts_of_a_drawing_are_deformed(drawings):
    edited = session("bars.svg")
    pins = [{"source": [20, 80], "target": [20, 80]}, {"source": [80, 80], "target": [84, 70]}]
    update = edited.solve(scene(*pins))
    assert update.ok and len(update.outlines) == 4  # the frame, and each bar after the deformation
    before, after = edited.describe()["target"]["painted"], update.outlines[1:]
    far = [np.abs(np.mean(a, axis=0) - np.mean(b, axis=0)).max() for a, b in zip(before, after)]
    assert max(far) > 0.05 and min(far) < 0.05


def test_the_thumbnail_of_a_whole_drawing_shows_the_frame_around_its_parts(drawings):
    whole, *parts = parts_of("bars.svg")
    xs, ys = (
        np.array(re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", whole[name]), float).T for name in ("d", "frame")
    )
    assert whole["name"] == "all" and whole["frame"].count("M") == 1 < whole["d"].count("M")
    for of_parts, of_frame in zip(xs, ys):  # around all parts
        assert of_frame.min() <= of_parts.min() + 2e-3 and of_frame.max() >= of_parts.max() - 2e-3
    assert [part["frame"] for part in parts if part["name"] != "silhouette"] == [""] * 3
