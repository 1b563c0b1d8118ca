"""Whole drawings on the page: the page shows the result of `iccm map`, and pins and strokes work in frames."""

import io
import json
import re
import shlex

import numpy as np
import pytest
from PIL import Image

from iccm import load
from iccm.errors import InputError
from iccm.io.edit import placing, saving
from iccm.io.edit.map_choice import displacement
from iccm.io.edit.messages import Scene
from iccm.io.edit.session import Session
from iccm.io.edit.workspace import parts_of
from iccm.io.run.job import make
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
        edited = Session(make({"source": "two.svg", "target": "panes.svg", "gaps": gaps}))
        picture = np.asarray(Image.open(io.BytesIO(edited.view.texture(64))).convert("RGBA"))
        assert (picture[..., 3].min() == 255) == opaque


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


@pytest.mark.parametrize("fit", ["auto", "cover"])
def test_the_first_pin_shows_what_was_hidden_and_names_the_fit_that_hides_it_again(drawings, fit):
    # by its detail the house would be composed, in a frame that pins keep
    edited = Session(make({"source": "house.svg", "target": "fork.svg", "detail": 0}))
    assert edited.solve(scene(fit=fit)).ok and edited.fit.coverage.is_partial
    hiding, diagonal = edited.maps[0], edited.pair.target.curve.diagonal
    ends = [
        {"source": at, "target": placing.transfer(edited, "source", [at])[0]} for at in ([14, 70], [70, 80])
    ]
    first = edited.solve(scene(ends[0], fit=fit))
    assert first.ok and ("Cover all" in first.message) == (fit == "auto")
    assert edited.fit.coverage.is_partial == (fit == "cover")
    if fit == "cover":
        assert displacement(hiding, edited.maps[0]) < 0.05 * diagonal
    else:
        assert "Cover all" not in edited.solve(scene(*ends)).message


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
    pinned = edited.solve(scene({"source": [50.0, 82.0], "target": [48.0, 80.0]}))
    assert pinned.ok and len(edited._maps) == 1


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
