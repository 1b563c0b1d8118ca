"""`iccm morph` on the command line: frames, animations, drawings, and what is rejected."""

import io
import json
import re
import shutil
import subprocess
import tarfile
from xml.etree import ElementTree

import numpy as np
import pytest
import shapely
from PIL import Image

from iccm.io.run import flat_colours, morph
from iccm.io.svg import reader
from tests import chromium

pytestmark = pytest.mark.usefixtures("solve_once")

QUICK = ("--frames", "3", "--size", "48")


def pixels(path):
    return np.asarray(Image.open(path).convert("RGBA"))


@pytest.mark.slow
def test_frames_begin_and_end_with_the_shapes(shapes, iccm):
    outputs = ("-o", "m-{number}.png", "-o", "m-{number}.svg")
    result = iccm("morph", "square.svg", "blob.svg", "--texture", "checker", *QUICK, *outputs)
    assert result.code == 0 and "wrote m-1.png to m-3.svg" in result.err
    assert iccm("map", "square.svg", "blob.svg", "--size", "48", "--fit", "whole", "-o", "t.png").code == 0
    assert iccm("map", "square.svg", "square.svg", "--size", "48", "-o", "s.png").code == 0
    for number, name in ((1, "s.png"), (3, "t.png")):
        away = np.abs(pixels(f"m-{number}.png").astype(int) - pixels(name))
        assert away.max(axis=2).mean() < 2, name
    ends = [len(re.findall("<path", (shapes / f"m-{k}.svg").read_text())) for k in (1, 2, 3)]
    assert ends[0] and ends == ends[:1] * 3


@pytest.mark.slow
def test_the_source_begins_amid_the_targets_canvas(shapes, iccm):
    """A canvas of 100 by 100 in the middle of one of 40 by 30 with another origin: 24 of 40 across, 24 of 30 down."""
    (shapes / "small.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="10 20 40 30"><path d="M12 22h36v26h-30z"/></svg>'
    )
    assert iccm("morph", "square.svg", "small.svg", *QUICK, "-o", "m-{number}.png").code == 0
    alpha = pixels("m-1.png")[..., 3]
    assert alpha.shape == (36, 48)
    for axis, share in ((0, 0.6), (1, 0.8)):
        painted = np.flatnonzero(alpha.max(axis=axis) > 127)
        size = alpha.shape[1 - axis]
        assert painted.size / size == pytest.approx(share, abs=0.04)
        assert (painted[0] + painted[-1] + 1) / 2 / size == pytest.approx(0.5, abs=0.02)


def test_animations_hold_every_frame_and_textures_fade(shapes, iccm):
    for name, colour in (("red.png", (255, 0, 0)), ("blue.png", (0, 0, 255))):
        Image.new("RGB", (8, 8), colour).save(name)
    arguments = ("--texture", "red.png", "--target-texture", "blue.png", "--fps", "10")
    outputs = ("-o", "m.webp", "-o", "m.gif", "-o", "m.png", "-o", "f-{number}.png")
    result = iccm("morph", "square.svg", "blob.svg", *QUICK, *arguments, *outputs)
    assert result.code == 0, result.err
    for name in ("m.webp", "m.gif", "m.png"):
        with Image.open(name) as file:
            assert file.n_frames == 3
    with Image.open("m.webp") as file:
        file.seek(1)
        assert np.array_equal(np.asarray(file.convert("RGBA"))[24, 24], pixels("f-2.png")[24, 24])
        assert file.info["duration"] == 100
    middles = [pixels(f"f-{k}.png")[24, 24].tolist() for k in (1, 2, 3)]
    assert middles[0] == [255, 0, 0, 255] and middles[2] == [0, 0, 255, 255]
    assert middles[1] == pytest.approx([128, 0, 128, 255], abs=1)


@pytest.mark.slow
def test_holes_go_along_where_both_have_as_many(shapes, iccm):
    ring = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path fill-rule="evenodd" d="{}"/></svg>'
    (shapes / "ring.svg").write_text(ring.format("M10 10H90V90H10ZM40 40H60V60H40Z"))
    (shapes / "other.svg").write_text(ring.format("M5 20H95V80H5ZM40 35H65V60H40Z"))
    assert iccm("morph", "ring.svg", "other.svg", *QUICK, "-o", "m-{number}.png").code == 0
    assert [pixels(f"m-{k}.png")[24, 24, 3] for k in (1, 2, 3)] == [0, 0, 0]
    assert iccm("morph", "square.svg", "other.svg", *QUICK, "-o", "f-{number}.png").code == 0
    middle = [int(pixels(f"f-{k}.png")[24, 24, 3]) for k in (1, 2, 3)]
    assert middle[0] == 255 and middle[1] in (0, 255) and middle[2] == 0  # it opens, and does not fade
    arguments = ("--holes", "fill", "-o", "g-{number}.png")
    assert iccm("morph", "square.svg", "other.svg", *QUICK, *arguments).code == 0
    assert [pixels(f"g-{k}.png")[24, 24, 3] for k in (1, 2, 3)] == [255, 255, 255]


SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'
BARS = '<path d="M10 10H30V90H10Z" {0}/><path d="M40 30H60V90H40Z" {0}/><path d="M70 60H90V90H70Z" {0}/>'
COLOURED_BARS = BARS.format('fill="red"') + '<path d="M14 20H26V40H14Z" fill="blue"/>'


@pytest.mark.slow
def test_all_parts_of_both_drawings_are_visible_and_none_fades(shapes, iccm):
    (shapes / "bars.svg").write_text(SVG.format(BARS.format("")))
    (shapes / "panes.svg").write_text(SVG.format('<path d="M5 5H95V40H5Z"/><path d="M5 50H95V95H5Z"/>'))
    result = iccm("morph", "bars.svg", "panes.svg", *QUICK, "--size", "100", "-o", "m-{number}.png")
    assert result.code == 0, result.err
    bars = [[20, 50, 80], [70, 70, 70]]  # columns and rows of points in each bar
    first, middle, last = (pixels(f"m-{k}.png")[..., 3].astype(int) for k in (1, 2, 3))
    assert first[bars[1], bars[0]].tolist() == [255] * 3 and first[20, 50] == 0 == first[70, 35]
    assert last[[20, 70], [50, 35]].tolist() == [255, 255] and last[45, 50] == 0
    for seen, painted in ((first, 20 * (80 + 60 + 30)), (last, 90 * (35 + 45))):
        assert seen.sum() / 255 == pytest.approx(painted, rel=0.01)
    # half way, parts are between those of both drawings, and nothing fades but the edges
    edges = (middle > 8) & (middle < 247)
    assert edges.mean() < 0.1 and middle.sum() > 0.5 * min(first.sum(), last.sum())
    assert middle.sum() < 1.1 * max(first.sum(), last.sum())


@pytest.mark.slow
def test_parts_that_match_go_onto_each_other_unless_they_are_joined(shapes, iccm):
    squares = ("M8 8H34V34H8Z", "M66 12H94V38H66Z", "M36 66H62V96H36Z")
    discs = ((22, 24, 15), (80, 20, 12), (50, 82, 14))
    (shapes / "bars.svg").write_text(SVG.format("".join(f'<path d="{d}"/>' for d in squares)))
    (shapes / "discs.svg").write_text(
        SVG.format("".join(f'<circle cx="{x}" cy="{y}" r="{r}"/>' for x, y, r in discs))
    )
    result = iccm("morph", "bars.svg", "discs.svg", *QUICK, "-o", "m-{number}.png")
    assert result.code == 0 and "3 parts" in result.err and "--parts joined" in result.err
    alpha = pixels("m-2.png")[..., 3]
    assert np.isin(alpha, (0, 255)).mean() > 0.85  # nothing fades except edges
    result = iccm("morph", "bars.svg", "discs.svg", "--parts", "joined", *QUICK, "-o", "j-{number}.png")
    assert result.code == 0 and "3 parts" not in result.err
    largest = iccm("morph", "bars.svg", "discs.svg", "--parts", "largest", *QUICK, "-o", "l-{number}.png")
    assert largest.code == 0 and "ignored 2 " in largest.err


@pytest.mark.slow
def test_drawings_whose_map_would_hide_something_move_as_one(shapes, iccm):
    """An eye, and one that is crossed out, drawn with lines (icons of Lucide, ISC)."""
    drawing = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 24 24" fill="none" stroke="#000" stroke-width="2" '
        'stroke-linecap="round" stroke-linejoin="round">{}</svg>'
    )
    eye = (
        '<path d="M2.062 12.348a1 1 0 0 1 0-.696 10.75 10.75 0 0 1 19.876 0 1 1 0 0 1 0 .696 10.75 '
        '10.75 0 0 1-19.876 0"/>'
        '<circle cx="12" cy="12" r="3"/>'
    )
    crossed = (
        '<path d="M10.733 5.076a10.744 10.744 0 0 1 11.205 6.575 1 1 0 0 1 0 .696 10.747 10.747 0 '
        '0 1-1.444 2.49"/>'
        '<path d="M14.084 14.158a3 3 0 0 1-4.242-4.242"/>'
        '<path d="M17.479 17.499a10.75 10.75 0 0 1-15.417-5.151 1 1 0 0 1 0-.696 10.75 10.75 0 0 1 '
        '4.446-5.143"/>'
        '<path d="m2 2 20 20"/>'
    )
    for name, content in (("eye", eye), ("crossed", crossed)):
        (shapes / f"{name}.svg").write_text(drawing.format(content))
    result = iccm("morph", "eye.svg", "crossed.svg", *QUICK, "-o", "m-{number}.png")
    assert result.code == 0, result.err
    assert pixels("m-3.png")[8, 8, 3] == 255 and pixels("m-1.png")[8, 8, 3] == 0


@pytest.mark.slow
def test_drawings_with_colours_of_their_own_fade_into_each_other(shapes, iccm):
    red = '<circle cx="50" cy="50" r="40" fill="red"/><circle cx="50" cy="30" r="10" fill="lime"/>'
    (shapes / "red.svg").write_text(SVG.format(red))
    (shapes / "blue.svg").write_text(SVG.format('<path d="M10 20H90V80H10Z" fill="blue"/>'))
    result = iccm("morph", "red.svg", "blue.svg", *QUICK, "-o", "m-{number}.png", "-o", "m-{number}.svg")
    assert result.code == 0, result.err
    middles = [pixels(f"m-{k}.png")[30, 24].tolist() for k in (1, 2, 3)]
    assert middles[0] == [255, 0, 0, 255] and middles[2] == [0, 0, 255, 255]
    assert middles[1] == pytest.approx([128, 0, 128, 255], abs=2)
    assert pixels("m-1.png")[14, 24].tolist() == [0, 255, 0, 255]
    two = '<path d="M10 10H40V90H10Z" fill="red"/><path d="M60 20H90V80H60Z" fill="lime"/>'
    (shapes / "two.svg").write_text(SVG.format(two))
    assert iccm("morph", "two.svg", "blue.svg", *QUICK, "-o", "t-{number}.png").code == 0
    assert [int(pixels(f"t-{k}.png")[24, 24, 3]) for k in (1, 3)] == [0, 255]
    assert (
        iccm("morph", "red.svg", "blue.svg", "--texture", "checker", *QUICK, "-o", "c-{number}.png").code == 0
    )
    assert len(np.unique(pixels("c-3.png")[..., :3].reshape(-1, 3), axis=0)) > 10


@pytest.mark.slow
def test_artwork_is_cut_to_the_target_by_and_by(shapes, iccm):
    import resvg_py

    (shapes / "bars.svg").write_text(SVG.format(SHADED_BARS))
    (shapes / "panes.svg").write_text(SVG.format('<path d="M5 5H95V40H5Z"/><path d="M5 50H95V95H5Z"/>'))
    assert iccm("morph", "bars.svg", "panes.svg", "--frames", "3", "-o", "m-{number}.svg").code == 0
    first, middle = ((shapes / f"m-{k}.svg").read_text() for k in (1, 2))
    assert "clipPath" not in first and "mask" not in first
    assert 'fill-opacity="0.5"' in middle and 'mask="url(#' in middle
    drawn = [resvg_py.svg_to_bytes(svg_path=name, width=200, height=200) for name in ("m-3.svg", "panes.svg")]
    last, target = (np.asarray(Image.open(io.BytesIO(bytes(png))), int) for png in drawn)
    assert np.abs(last - target).max() <= 1


BEND = (
    '<g id="all"><path d="M10 20H80L90 60L20 85Z" fill="teal"/>'
    '<circle cx="45" cy="45" r="9" fill="none" stroke="red" stroke-width="2"/></g>'
)
DISC = '<circle cx="52" cy="47" r="40"/>'
SHADED = (
    '<linearGradient id="g"><stop stop-color="red"/><stop offset="1" stop-color="blue"/></linearGradient>{}'
)
SHADED_DISC = SHADED.format(DISC.replace("/>", ' fill="url(#g)"/>'))
SHADED_BARS = SHADED.format(BARS.format('fill="url(#g)"')) + '<path d="M14 20H26V40H14Z" fill="blue"/>'


def paths_of(text):
    """The path data of an SVG in order, without those of animations."""
    return [
        element.get("d") for element in ElementTree.fromstring(text).iter() if element.tag.endswith("}path")
    ]


@pytest.mark.slow
def test_paths_have_the_same_commands_in_all_frames_but_the_target(shapes, iccm):
    (shapes / "bend.svg").write_text(SVG.format(BEND))
    (shapes / "disc.svg").write_text(SVG.format(SHADED_DISC))
    assert iccm("morph", "bend.svg", "disc.svg", "--frames", "4", "-o", "m-{number}.svg").code == 0
    frames = [paths_of((shapes / f"m-{k}.svg").read_text()) for k in range(1, 5)]
    commands = [[re.sub("[^A-Za-z]", "", d) for d in frame] for frame in frames]
    assert len(frames[0]) == 2 and len(set(map(tuple, commands[:3]))) == 1 and "C" in commands[0][0]
    assert len({frame[0] for frame in frames}) == 4 and len(frames[3]) == 1
    last = reader.read(shapes / "m-4.svg").painted
    assert last.symmetric_difference(shapely.Point(52, 47).buffer(40, 64)).area < 0.01 * last.area


@pytest.mark.slow
def test_an_animated_svg_interpolates_the_frames(shapes, iccm):
    (shapes / "bend.svg").write_text(SVG.format(BEND))
    (shapes / "disc.svg").write_text(SVG.format(SHADED_DISC))
    for name, speed in (("m-{number}.svg", ()), ("m.svg", ("--fps", "4"))):
        result = iccm("morph", "bend.svg", "disc.svg", "--frames", "3", *speed, "-o", name)
        assert result.code == 0, result.err
    frames = [paths_of((shapes / f"m-{k}.svg").read_text()) for k in (1, 2, 3)]
    moving = [
        element
        for element in ElementTree.parse(shapes / "m.svg").iter()
        if element.get("attributeName") == "d"
    ]
    values = [element.get("values").split(";") for element in moving]
    assert [paths[:2] for paths in values] == [list(element) for element in zip(*frames[:2])]
    assert {element.get("dur") for element in moving} == {"0.5s"} and not any(
        element.get("calcMode") for element in moving
    )
    assert paths_of((shapes / "m.svg").read_text()) == frames[0]
    widths = [
        element
        for element in ElementTree.parse(shapes / "m.svg").iter()
        if element.get("attributeName") == "stroke-width"
    ]
    assert len(widths) == 1 and len(set(widths[0].get("values").split(";"))) == 3


@pytest.mark.slow
def test_unmatched_parts_fade_in_an_animated_svg(shapes, iccm):
    (shapes / "bars.svg").write_text(SVG.format(SHADED_BARS))
    (shapes / "panes.svg").write_text(SVG.format('<path d="M5 5H95V40H5Z"/><path d="M5 50H95V95H5Z"/>'))
    assert iccm("morph", "bars.svg", "panes.svg", "--frames", "3", "-o", "m.svg").code == 0
    text = (shapes / "m.svg").read_text()
    faded = [
        element
        for element in ElementTree.fromstring(text).iter()
        if element.get("attributeName") == "fill-opacity"
    ]
    assert [element.get("values") for element in faded] == ["1;0.5;0.001"] and "mask=" in text


@pytest.mark.slow
def test_the_target_appears_at_the_end_of_an_animated_svg_where_parts_vanish(shapes, iccm):
    """The frames keep the parts of the source; the target's own drawing is shown over the last third of them."""
    (shapes / "bars.svg").write_text(SVG.format(SHADED_BARS))
    (shapes / "disc.svg").write_text(SVG.format(DISC))
    for name in ("m.svg", "m.css.svg"):
        assert iccm("morph", "bars.svg", "disc.svg", "--frames", "3", "-o", name).code == 0
    smil, css = ((shapes / name).read_text() for name in ("m.svg", "m.css.svg"))
    assert 'values="0;0;1"' in smil and "<style" not in smil
    assert "@keyframes morph-end" in css and "<animate" not in css and 'd:path("M' in css
    (shapes / "plain.svg").write_text(SVG.format('<path d="M10 20H80L90 60L20 85Z"/>'))
    assert iccm("morph", "plain.svg", "disc.svg", "--frames", "3", "-o", "p.svg").code == 0
    assert "keyTimes" not in (shapes / "p.svg").read_text()


@pytest.mark.slow
def test_drawings_of_one_colour_are_animated_as_areas_that_grow_and_shrink(shapes, iccm):
    import resvg_py

    (shapes / "bars.svg").write_text(SVG.format(BARS.format('fill="red"')))
    (shapes / "panes.svg").write_text(
        SVG.format('<path d="M5 5H95V40H5Z" fill="#0040ff"/><path d="M5 50H95V95H5Z" fill="#0040ff"/>')
    )
    names = ["m.svg", "m.css.svg", "m.json", "m-{number}.svg", "m-{number}.png"]
    outputs = [word for name in names for word in ("-o", name)]
    assert iccm("morph", "bars.svg", "panes.svg", "--frames", "5", "--size", "200", *outputs).code == 0
    smil = ElementTree.parse(shapes / "m.svg").getroot()
    (path,) = smil.findall(".//{*}path")
    moving = {element.get("attributeName"): element for element in path}
    assert moving["d"].get("calcMode") == "discrete" and len(moving["d"].get("values").split(";")) == 5
    assert moving["fill"].get("values").split(";") == ["#ff0000", "#bf1040", "#802080", "#4030bf", "#0040ff"]
    assert moving["d"].get("dur") == f"{5 / 12:.9g}s"  # each frame for 1/12 s
    assert (shapes / "m.css.svg").read_text().count("step-end") == 1
    lottie = json.loads((shapes / "m.json").read_text())
    assert [(layer["ip"], layer["op"]) for layer in lottie["layers"]] == [(k, k + 1) for k in range(5)]
    for number, data in enumerate(moving["d"].get("values").split(";"), 1):
        drawing = SVG.format(f'<path d="{data}" fill-rule="evenodd"/>')
        png = resvg_py.svg_to_bytes(svg_string=drawing, width=200, height=200)
        in_animation = np.asarray(Image.open(io.BytesIO(bytes(png))))[..., 3].astype(int)
        alone = resvg_py.svg_to_bytes(svg_path=f"m-{number}.svg", width=200, height=200)
        in_file = np.asarray(Image.open(io.BytesIO(bytes(alone))))[..., 3].astype(int)
        picture = pixels(f"m-{number}.png").astype(int)
        for seen in (in_animation, in_file):  # at both ends, pictures are resampled drawings
            assert (np.abs(seen - picture[..., 3]) > 32).mean() < (0.01 if number in (1, 5) else 0.002)
        shown = picture[picture[..., 3] > 0][:, :3]
        assert (shown == list(bytes.fromhex(moving["fill"].get("values").split(";")[number - 1][1:]))).all()
        assert np.isin(in_animation, (0, 255)).mean() > 0.97  # nothing fades but the edges


@pytest.mark.slow
@chromium.needed
@pytest.mark.parametrize(
    "pair",
    [
        ("burger", "cross"),
        ("pause", "play"),
        ("ring", "square"),
        ("plus badge", "minus badge"),
        ("check", "square"),
        ("duotone", "minus badge"),
    ],
)
def test_css_animations_begin_and_end_with_the_drawings(shapes, iccm, pair):
    """Chromium shows the animation stopped at its beginning and end like both drawings."""
    for name in pair:
        (shapes / f"{name}.svg").write_text(SVG.replace("0 0 100 100", "0 0 24 24").format(ICONS[name]))
    source, target = (f"{name}.svg" for name in pair)
    assert iccm("morph", source, target, "--frames", "9", "-o", "m.css.svg").code == 0
    text = (shapes / "m.css.svg").read_text()
    (duration,) = set(re.findall(r"animation:\S+ ([\d.]+)s", text))
    for number, seconds in enumerate((0, float(duration) - 1e-5)):
        stopped = f"*{{animation-play-state:paused!important;animation-delay:-{seconds}s!important}}</style>"
        (shapes / f"at-{number}.svg").write_text(text.replace("</style>", stopped, 1))
    first, last, *drawings = chromium.pictures(
        [shapes / name for name in ("at-0.svg", "at-1.svg", source, target)]
    )
    assert chromium.differing(first, drawings[0]) < 0.002
    assert chromium.differing(last, drawings[1]) < 0.002
    assert chromium.differing(*drawings) > 0.02


@pytest.mark.slow
def test_colours_of_drawings_grow_and_shrink_and_do_not_fade(shapes, iccm):
    """The square becomes a disc, and the plus in it a minus of the same white; only the ground changes its colour."""
    for name in ("plus badge", "minus badge"):
        drawing = SVG.replace("0 0 100 100", "0 0 24 24").format(ICONS[name])
        (shapes / f"{name}.svg").write_text(drawing)
    outputs = ("-o", "m-{number}.png", "-o", "m.svg")
    result = iccm("morph", "plus badge.svg", "minus badge.svg", "--frames", "5", "--size", "240", *outputs)
    assert result.code == 0, result.err
    grounds = ["#cc3333", "#a63359", "#803380", "#5933a6", "#3333cc"]
    whites = []
    for number, ground in enumerate(grounds, 1):
        picture = pixels(f"m-{number}.png").astype(int)
        opaque = picture[picture[..., 3] == 255][:, :3]
        white = (opaque == 255).all(axis=1)
        is_ground = (np.abs(opaque - list(bytes.fromhex(ground[1:]))) <= 1).all(axis=1)
        assert (white | is_ground).mean() > 0.96  # all but the edges
        whites.append(white.mean())
    assert max(whites) == whites[0] and min(whites) > 0.95 * whites[-1]
    below, above = ElementTree.parse(shapes / "m.svg").getroot().findall(".//{*}path")
    moving = {element.get("attributeName"): element.get("values").split(";") for element in below}
    assert moving["fill"] == grounds and above.get("fill") == "#ffffff"


@pytest.mark.slow
def test_a_lottie_animation_has_the_paths_and_paints_of_the_frames(shapes, iccm):
    (shapes / "bend.svg").write_text(SVG.format(BEND.replace("<g ", '<g opacity="0.4" ')))
    (shapes / "disc.svg").write_text(SVG.format(SHADED_DISC))
    result = iccm(
        "morph", "bend.svg", "disc.svg", "--frames", "3", "--fps", "4", "-o", "m.json", "-o", "m-{number}.svg"
    )
    assert result.code == 0, result.err
    animation = json.loads((shapes / "m.json").read_text())
    assert (animation["fr"], animation["ip"], animation["op"], animation["w"], animation["h"]) == (
        4,
        0,
        3,
        512,
        512,
    )
    (layer,) = animation["layers"]
    ring, bend = layer["shapes"]  # the first is on top
    assert [element["ty"] for element in ring["it"]] == ["sh", "st", "tr"] and ring["it"][-1]["o"]["k"] == 40
    assert [element["ty"] for element in bend["it"]] == ["sh", "fl", "tr"]
    assert bend["it"][1]["c"]["k"] == pytest.approx([0, 128 / 255, 128 / 255, 1], abs=1e-3)
    assert len(ring["it"][1]["w"]["k"]) == 3
    for number, key in enumerate(bend["it"][0]["ks"]["k"], start=1):
        (shape,) = key["s"]
        vertices = np.array(shape["v"]) / 5.12
        frame = reader.read(shapes / f"m-{number}.svg")
        away = shapely.distance(shapely.points(vertices), frame.painted.boundary)
        assert key["t"] == number - 1 and shape["c"] and away.max() < 0.1
        assert len(shape["v"]) == len(shape["i"]) == len(shape["o"]) > 4


CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


@pytest.mark.slow
@pytest.mark.skipif(
    not (CHROMIUM and shutil.which("npm")), reason="NO TEST OF LOTTIE: needs Chromium and npm"
)
@pytest.mark.parametrize("flat", [True, False])
def test_lottie_web_shows_the_frames(shapes, iccm, monkeypatch, flat):
    """lottie-web, fetched from npm, plays an animation in which a part shrinks, or fades if colours are not flat."""
    import resvg_py

    if not flat:
        monkeypatch.setattr(flat_colours, "areas_of", lambda *args, **kwargs: None)

    try:
        subprocess.run(["npm", "pack", "lottie-web@5.13.0"], check=True, timeout=60, capture_output=True)
    except (OSError, subprocess.SubprocessError) as error:
        pytest.skip(f"NO TEST OF LOTTIE: lottie-web cannot be fetched from npm ({error})")
    with tarfile.open("lottie-web-5.13.0.tgz") as package:
        player = package.extractfile("package/build/player/lottie.min.js").read().decode()
    (shapes / "bars.svg").write_text(SVG.format(COLOURED_BARS))
    (shapes / "panes.svg").write_text(SVG.format('<path d="M5 5H95V40H5Z"/><path d="M5 50H95V95H5Z"/>'))
    options = ("--frames", "3", "--fps", "2", "-o", "m.json", "-o", "m-{number}.svg")
    assert iccm("morph", "bars.svg", "panes.svg", *options).code == 0
    blocks = "".join(f'<div id="d{k}" style="width:200px;height:200px;float:left"></div>' for k in range(3))
    show = (
        "for (let k = 0; k < 3; k++) lottie.loadAnimation({container: document.getElementById('d' + k), "
        "renderer: 'svg', autoplay: false, animationData: JSON.parse(JSON.stringify(data))}).goToAndStop(k, true)"
    )
    data = (shapes / "m.json").read_text()
    scripts = f"<script>{player}</script><script>const data={data};{show}</script>"
    page = f"<body style='margin:0;background:#fff'>{blocks}{scripts}"
    (shapes / "page.html").write_text(page)
    command = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        "--screenshot=shot.png",
    ]
    subprocess.run(
        [*command, "--window-size=600,200", "page.html"], check=True, timeout=100, capture_output=True
    )
    shot = pixels("shot.png")[..., :3].astype(int)
    assert shot.shape == (200, 600, 3)
    # the last SVG is the target's own drawing; the last frame of what fades is the source's, cut to the target
    for k in range(3 if flat else 2):
        drawn = resvg_py.svg_to_bytes(svg_path=f"m-{k + 1}.svg", width=200, height=200, background="white")
        expected = np.asarray(Image.open(io.BytesIO(bytes(drawn))).convert("RGB"), int)
        away = np.abs(shot[:, 200 * k : 200 * (k + 1)] - expected)
        assert expected.std() > 30 and away.mean() < 4 and np.quantile(away, 0.95) < 30


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("square.svg", "blob.svg", "-o", "m.jpg"), "m.jpg: not an animation; use .webp .gif .png"),
        (("square.svg", "blob.svg", "-o", "m.png", "-o", "m.png"), "two outputs"),
        (("square.svg", "blob.svg", "--target-texture", "t.png", "-o", "{number}.svg"), "--target-texture "),
        (("square.svg", "none.svg", "-o", "m.webp"), "none.svg: no such file"),
        (
            ("square.svg", "ring.svg", "--holes", "keep", "-o", "m.webp"),
            "0 holes cannot be mapped onto 1",
        ),
        (("square.svg", "sheet.obj", "-o", "m.webp"), "a morph needs planar shapes"),
        (("square.svg", "blob.svg", "-o", "square.svg"), "square.svg"),
        (("square.svg", "blob.svg", "--target-texture", "t.png", "-o", "m.svg"), "--target-texture "),
        (("square.svg", "blob.svg", "-o", "old.webp"), "old.webp"),
        (("square.svg", "blob.svg", "--fit", "cover", "-o", "m.webp"), "--fit cover"),
        (
            ("square.svg", "blob.svg", "--frames", "9999", "-o", "m.webp"),
            "--frames: 9999 pictures of about 1024x1024",
        ),
    ],
)
def test_impossible_requests_are_refused_in_one_line(shapes, iccm, words, message):
    (shapes / "ring.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path fill-rule="evenodd" '
        'd="M10 10H90V90H10ZM40 40H60V60H40Z"/></svg>'
    )
    (shapes / "sheet.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 0\nf 1 2 3\nf 1 3 4\n")
    (shapes / "old.webp").write_bytes(b"old")
    Image.new("RGB", (8, 8)).save("t.png")
    result = iccm("morph", *words)
    assert result.code == 2 and len(result.lines) == 1 and message in result.err, result.err
    assert (shapes / "old.webp").read_bytes() == b"old" and not list(shapes.glob("m*.png"))


@pytest.mark.parametrize(("ok", "code"), [(True, 0), (False, 1)])
def test_a_morph_that_misses_its_target_is_not_good_enough(shapes, iccm, monkeypatch, ok, code):
    monkeypatch.setattr(morph, "run", lambda *args, **kwargs: (ok, "how it ended", ["m.webp"]))
    result = iccm("morph", "square.svg", "blob.svg", "-o", "m.webp")
    assert result.code == code and "how it ended" in result.err


ICONS = {
    "plus badge": '<path d="M2 2H22V22H2z" fill="#c33"/><path d="M10 6h4v4h4v4h-4v4h-4v-4H6v-4h4z" fill="#fff"/>',
    "minus badge": '<circle cx="12" cy="12" r="10" fill="#33c"/><path d="M6 10h12v4H6z" fill="#fff"/>',
    "duotone": '<path d="M12 2 22 21H2z" opacity=".25"/><path d="M12 2 22 21H2z" fill="none" stroke="#000"/>',
    "check": '<circle cx="12" cy="12" r="10" fill="none" stroke="currentColor" stroke-width="2"/>'
    '<path d="M8 12l3 3 5-6" fill="none" stroke="currentColor" stroke-width="2"/>',
    "burger": '<path d="M3 5h18v2H3zM3 11h18v2H3zM3 17h18v2H3z"/>',
    "cross": '<path d="M5 4L4 5 11 12 4 19 5 20 12 13 19 20 20 19 13 12 20 5 19 4 12 11z"/>',
    "pause": '<path d="M6 5h4v14h-4zM14 5h4v14h-4z"/>',
    "play": '<path d="M8 5v14l11-7z"/>',
    "ring": '<path fill-rule="evenodd" '
    'd="M12 2a10 10 0 1 1 0 20a10 10 0 1 1 0-20zM12 4a8 8 0 1 0 0 16a8 8 0 1 0 0-16z"/>',
    "square": '<path fill-rule="evenodd" d="M6 2H18L22 6V18L18 22H6L2 18V6zM7 4 4 7V17L7 20H17L20 17V7L17 4z"/>',
}  # fmt: skip


@pytest.mark.slow
def test_a_ring_stays_as_thick_as_it_is_in_both_drawings(shapes, iccm):
    """A round ring becomes one with flat sides, both of them with a line of 10 units."""
    drawn = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 160 160"><path fill-rule="evenodd" d="{}"/></svg>'
    round_ring = "M80 5a75 75 0 1 1 0 150a75 75 0 1 1 0-150zM80 15a65 65 0 1 0 0 130a65 65 0 1 0 0-130z"
    flat_ring = (
        "M45 5H115A40 40 0 0 1 155 45V115A40 40 0 0 1 115 155H45A40 40 0 0 1 5 115V45A40 40 0 0 1 45 5z"
        "M45 15A30 30 0 0 0 15 45V115A30 30 0 0 0 45 145H115A30 30 0 0 0 145 115V45A30 30 0 0 0 115 15z"
    )
    for name, data in (("round", round_ring), ("flat", flat_ring)):
        (shapes / f"{name}.svg").write_text(drawn.format(data))
    assert iccm("morph", "round.svg", "flat.svg", "--frames", "3", "-o", "m-{number}.svg").code == 0
    for number in (1, 2, 3):
        (ring,) = shapely.get_parts(reader.read(shapes / f"m-{number}.svg").ink)
        (hole,) = ring.interiors
        outside = shapely.points(shapely.get_coordinates(ring.exterior.segmentize(1)))
        thickness = shapely.distance(outside, hole)
        assert thickness.min() > 9 and thickness.max() < 11, number


@pytest.mark.slow
@pytest.mark.parametrize(
    "pair", [("burger", "cross"), ("pause", "play"), ("ring", "square"), ("check", "plus badge")]
)
def test_the_first_and_the_last_frame_are_the_drawings(shapes, iccm, pair):
    import resvg_py

    def drawn(path):
        picture = resvg_py.svg_to_bytes(svg_path=str(path), width=240, height=240, background="white")
        return np.asarray(Image.open(io.BytesIO(bytes(picture))).convert("L"), int)

    for name in pair:
        (shapes / f"{name}.svg").write_text(SVG.replace("0 0 100 100", "0 0 24 24").format(ICONS[name]))
    first, last = (f"{name}.svg" for name in pair)
    assert iccm("morph", first, last, "--frames", "2", "-o", "i-{number}.svg").code == 0
    for number, name in ((1, first), (2, last)):
        frame, drawing = drawn(f"i-{number}.svg"), drawn(name)
        # curves may lie apart by a third of a pixel, straight edges not at all
        limit = 0 if "burger" in pair or "pause" in pair else 255 // 3
        assert drawing.std() > 50 and np.abs(frame - drawing).max() <= limit, name


@pytest.mark.slow
def test_an_animation_runs_back_and_forth(shapes, iccm):
    """Pictures show each frame once on each way, and the ends once; drawings end with the first outline."""
    outputs = [f"m{suffix}" for suffix in (".webp", ".svg", ".css.svg", ".json")]
    arguments = ["morph", "square.svg", "blob.svg", "--frames", "4", "--size", "48", "--fps", "2"]
    result = iccm(*arguments, "--back-and-forth", *(word for name in outputs for word in ("-o", name)))
    assert result.code == 0, result.err
    with Image.open("m.webp") as file:
        shown = []
        for number in range(file.n_frames):
            file.seek(number)
            shown.append(np.asarray(file.convert("RGBA")).astype(int))
    assert len(shown) == 6
    assert all(np.array_equal(shown[3 - k], shown[3 + k]) for k in (1, 2))
    assert all(np.abs(shown[k] - shown[k + 1]).max() > 50 for k in range(3))
    values = re.search(r'attributeName="d" values="([^"]*)" dur="3s"', (shapes / "m.svg").read_text())[1]
    paths = values.split(";")
    assert len(paths) == 7 and paths == paths[::-1] and len(set(paths)) == 4
    sheet = (shapes / "m.css.svg").read_text()
    assert "3s linear infinite" in sheet and re.findall(r"([\d.]+)%\{d:", sheet)[-1] == "100"
    lottie = json.loads((shapes / "m.json").read_text())
    assert lottie["op"] == 6 and lottie["fr"] == 2


@pytest.mark.slow
def test_an_ending_is_seen_in_the_middle_of_the_way_back_and_forth(shapes, iccm):
    """A part that vanishes: the target's own drawing appears over the last sixth of the way, and leaves likewise."""
    (shapes / "two.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">'
        '<linearGradient id="g"><stop stop-color="red"/><stop offset="1" stop-color="blue"/></linearGradient>'
        '<path fill="url(#g)" d="M10 10h50v70h-50z"/><path fill="url(#g)" d="M75 60h15v25h-15z"/></svg>'
    )
    arguments = (
        "morph",
        "two.svg",
        "square.svg",
        "--frames",
        "3",
        "--back-and-forth",
        "-o",
        "m.svg",
        "-o",
        "m.css.svg",
    )
    assert iccm(*arguments).code == 0
    last = re.findall(r"<[^<]*animate [^>]*>", (shapes / "m.svg").read_text())[-1]
    assert 'values="0;0;1;0;0"' in last and 'keyTimes="0;0.333333;0.5;0.666667;1"' in last
    rule = re.search(r"@keyframes morph-end\{(.*)\}", (shapes / "m.css.svg").read_text())[1]
    assert re.findall(r"([\d.]+)%\{opacity:(\d)\}", rule) == [
        *[("0", "0"), ("33.3333", "0"), ("50", "1"), ("66.6667", "0"), ("100", "0")]
    ]
