"""What is seen behind the result: --background."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.cases import slow

pytestmark = pytest.mark.usefixtures("solve_once")

TWO_BARS = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 60">
  <rect x="5" y="5" width="25" height="50" fill="#c01818"/><rect x="55" y="5" width="30" height="50" fill="#1830a0"/>
</svg>"""
PLATE = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 80 50"><rect width="80" height="50"/></svg>'


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bars.svg").write_text(TWO_BARS)
    (tmp_path / "plate.svg").write_text(PLATE)
    return tmp_path


def picture(iccm, *options):
    result = iccm(
        "map", "bars.svg", "plate.svg", "-o", "out.png", "--report", "out.json", "--force", *options
    )
    assert result.code == 0, result.err
    report = json.loads(Path("out.json").read_text())
    return np.asarray(Image.open("out.png").convert("RGBA")).astype(int), report


@pytest.mark.slow
def test_paper_fills_the_gap_between_two_bars(iccm, files):
    pixels, report = picture(iccm, "--detail", "0")
    height, width = pixels.shape[:2]
    assert (pixels[2:-2, 2:-2, 3] == 255).all()
    assert report["covered"] > 0.99
    left, middle, right = (pixels[height // 2, round(share * width)] for share in (0.1, 0.44, 0.9))
    assert left[0] > left[2] + 80 and right[2] > right[0] + 80
    assert middle[:3].min() > 200
    # no bright line where the outlines of drawing and target coincide: the drawing's antialiased edge is not on paper
    assert abs(pixels[height // 2, 1:4, :3] - left[:3]).max() <= 3


@pytest.mark.slow
def test_transparent_gaps_stay_transparent(iccm, files):
    pixels, report = picture(iccm, "--background", "transparent")
    gap = (pixels[..., 3] == 0).mean()
    assert 0.2 < gap < 0.45
    assert abs(report["covered"] - (1 - gap)) < 0.03


def test_a_texture_that_is_given_keeps_its_transparent_parts(iccm, files):
    given = np.zeros((30, 40, 4), np.uint8)
    given[:, :17] = 10, 200, 30, 255
    Image.fromarray(given).save("given.png")
    pixels, _ = picture(iccm, "--texture", "given.png")
    assert 0.3 < (pixels[..., 3] == 0).mean() < 0.8


@pytest.mark.slow
def test_gaps_of_a_picture_are_not_filled_with_colours_from_beside_them(iccm, files):
    """A hook with a hole: its frame closes the concavity, into which neither the colour beside it nor that of the hole
    extends.
    """
    hook = np.zeros((60, 90, 4), np.uint8)
    hook[4:56, 6:84] = 30, 120, 40, 255
    hook[4:30, 6:84] = 150, 40, 30, 255
    hook[18:42, 30:90] = 0
    hook[24:36, 12:22] = 0
    Image.fromarray(hook).save("hook.png")
    pixels = {}
    for gaps in ("paper", "transparent"):
        arguments = (
            "hook.png",
            "plate.svg",
            "--fit",
            "frame",
            "--background",
            gaps,
            "-o",
            "out.png",
            "--force",
        )
        result = iccm("map", *arguments, "--report", "out.json")
        assert result.code == 0, result.err
        pixels[gaps] = np.asarray(Image.open("out.png").convert("RGBA")).astype(int)
        report = json.loads(Path("out.json").read_text())
    open_share = (pixels["transparent"][..., 3] < 128).mean()
    assert abs(report["covered"] - (1 - open_share)) < 0.03
    assert open_share > 0.15
    gap = pixels["transparent"][..., 3] == 0
    assert np.median(pixels["paper"][gap][:, :3].min(axis=1)) > 200


@pytest.mark.parametrize("texture", [(), ("--texture", "bars.svg")])
def test_a_drawing_of_one_colour_with_several_parts_shows_itself_on_paper(iccm, files, texture):
    (files / "bars.svg").write_text(TWO_BARS.replace("#1830a0", "#c01818"))
    _, report = picture(iccm, "--texture", "checker")
    assert report["pixels"]["checkerboard"]
    pixels, report = picture(iccm, "--detail", "0", *texture)
    assert "checkerboard" not in report["pixels"] and not any("colour" in note for note in report["notes"])
    left, middle = (pixels[pixels.shape[0] // 2, round(share * pixels.shape[1])] for share in (0.1, 0.44))
    assert left[0] > left[2] + 80 and middle[:3].min() > 200


ARROWS = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 60"><g fill="none" stroke-width="{width}">
  <path d="M5 10L85 14M70 4L85 14L74 26" stroke="#c01818"/><path d="M8 50L80 40M10 22L60 32" stroke="#1830a0"/>
</g></svg>"""
COMB = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 60">
  <path d="M4 2h4v48h16V2h4v48h16V2h4v48h16V2h4v56H4z"/></svg>"""


@pytest.mark.parametrize(
    ("width", "target", "noted"),
    [
        slow(2, "comb", True),
        (2, "plate", False),
        slow(14, "comb", False),
    ],
)
def test_a_note_reports_where_a_thin_target_shows_pieces_of_lines(iccm, files, width, target, noted):
    Path("arrows.svg").write_text(ARROWS.format(width=width))
    Path("comb.svg").write_text(COMB)
    result = iccm("map", "arrows.svg", f"{target}.svg", "-o", "out.png", "--size", "90", "--detail", "0")
    assert result.code == 0, result.err
    assert ("arrows.svg: drawn with lines" in result.err and "--texture checker" in result.err) == noted
    if noted:
        plain = iccm("map", "arrows.svg", "comb.svg", "-o", "b.png", "--size", "90", "--texture", "checker")
        assert plain.code == 0 and "drawn with lines" not in plain.err


@slow
def test_a_flag_is_faded_on_a_line_and_clear_inside_alike_in_picture_and_svg(iccm, files):
    resvg_py = pytest.importorskip("resvg_py")
    stripes = "".join(
        f'<rect y="{10 * k}" width="90" height="10" fill="{colour}"/>'
        for k, colour in enumerate(("#c01818", "#104010", "#1830a0", "#404000", "#c01818", "#104060"))
    )
    Path("flag.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 60">{stripes}</svg>'
    )
    Path("ring.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 60">'
        '<path fill-rule="evenodd" d="M0 0h90v60h-90z M6 6v48h78v-48z"/></svg>'
    )
    for name in ("out.png", "out.svg"):
        result = iccm(
            "map", "flag.svg", "ring.svg", "-o", name, *(("--size", "180") if name == "out.png" else ())
        )
        assert result.code == 0, result.err
    picture = Image.open("out.png").convert("RGBA")
    drawn = Image.open(io.BytesIO(bytes(resvg_py.svg_to_bytes(svg_path="out.svg", width=picture.width))))
    picture, drawn = (np.asarray(image.convert("RGBA"), int)[..., 3] for image in (picture, drawn))
    assert picture.shape == drawn.shape == (120, 180)
    for alpha in (picture, drawn):
        assert alpha[2:11, 5:-5].min() > 110 and alpha[2:11, 5:-5].max() < 145  # what the ring paints
        assert (alpha[20:100, 20:160] > 250).all()


MUG = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 80 50">
  <style>path {fill: #2060c0} .dot {fill: url(#g)}</style>
  <linearGradient id="g"><stop stop-color="#e0e000"/></linearGradient>
  <path d="M0 0H80V50H0Z"/><rect class="dot" x="60" y="5" width="15" height="10"/>
  <path id="body" style="fill:#10a040" d="M10 10H50V40H10Z"/></svg>"""
SPOT = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 30"><style>path {fill: url(#g)}</style>
  <linearGradient id="g"><stop stop-color="#c01010"/></linearGradient><path d="M5 5H20V25H5Z"/>
  <path style="fill:#400000" d="M24 8H36V22H24Z"/></svg>"""


def seen(pixels, x, y):
    """Return the colour at a place of the target, given in the units of its file."""
    height, width = pixels.shape[:2]
    return pixels[round(y / 50 * height), round(x / 80 * width)].tolist()


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_the_target_is_seen_behind_the_result(iccm, files, suffix):
    Path("mug.svg").write_text(MUG)
    Path("spot.svg").write_text(SPOT)
    drawn = "spot.svg", "mug.svg#body", "--background", "target", "--size", "160"
    result = iccm("map", *drawn, "-o", f"out.{suffix}", "--report", "out.json")
    assert result.code == 0, result.err
    assert json.loads(Path("out.json").read_text())["pixels"]["background"] == "target"
    pixels = np.asarray(Image.open(f"out.{suffix}").convert("RGBA")).astype(int)
    assert (pixels[..., 3] == 255).all()
    assert seen(pixels, 5, 45) == [0x20, 0x60, 0xC0, 255] and seen(pixels, 66, 9) == [0xE0, 0xE0, 0, 255]
    inside = pixels[24:76, 24:96, :3].reshape(-1, 3)
    colours = {tuple(colour) for colour in inside[::7]}
    assert {(0xC0, 0x10, 0x10), (0x40, 0, 0), (0x10, 0xA0, 0x40)} <= colours


def test_an_svg_with_the_target_behind_it_looks_like_the_picture(iccm, files):
    """Both files use the id `g` and style their paths: neither may change the other."""
    Path("mug.svg").write_text(MUG)
    Path("spot.svg").write_text(SPOT)
    drawn = "spot.svg", "mug.svg#body", "--background", "target"
    assert iccm("map", *drawn, "-o", "out.png", "--size", "160").code == 0
    assert iccm("map", *drawn, "-o", "out.svg").code == 0
    from iccm.io.artwork import rendering

    picture = np.asarray(Image.open("out.png").convert("RGBA")).astype(int)
    box = rendering.canvas_of(Path("out.svg"))
    drawing = rendering.render(Path("out.svg"), box, (160, 100)).pixels.astype(int)
    assert (abs(picture - drawing).max(axis=2) > 40).mean() < 0.01


def test_a_photo_is_seen_where_the_result_is_not(iccm, files):
    photo = np.random.default_rng(3).integers(0, 255, (50, 80, 3), np.uint8)
    Image.fromarray(photo).save("photo.png")
    spec = "photo.png#plane=20,10:60,12:58,40:22,38"
    assert iccm("map", "bars.svg", spec, "--background", "target", "-o", "out.png", "--size", "80").code == 0
    pixels = np.asarray(Image.open("out.png").convert("RGB")).astype(int)
    assert abs(pixels[:8] - photo[:8]).max() <= 1 and abs(pixels[25, 30] - [0xC0, 0x18, 0x18]).max() <= 3
    assert iccm("map", "bars.svg", spec, "--background", "target", "-o", "out.svg").code == 0
    assert "data:image/png" in Path("out.svg").read_text()


@pytest.mark.parametrize(
    ("command", "named"),
    [
        ("bars.svg plate.svg -o out.npz --background target", "--background: has no effect"),
        ("bars.svg cylinder:8x9 -o out.png --background target", "--background: has no effect"),
        ("bars.svg plate.svg -o out.png --background target --padding 4", "--padding: has no effect"),
        ("bars.svg plate.svg -o out.png --background white", "--background"),
    ],
)
def test_a_background_without_effect_is_refused(iccm, files, command, named):
    result = iccm("map", *command.split())
    assert result.code == 2 and named in result.err
    assert not [*files.glob("out*")]


def test_a_texture_with_alpha_is_carried_onto_a_layout(iccm, files):
    """Its sampler is made before there is a map."""
    Path("card.obj").write_text(
        "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nvt .2 .1\nvt .8 .1\nvt .8 .9\nvt .2 .9\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    )
    Path("canvas.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 6 8"><path d="M0 0H6V8H0Z"/></svg>'
    )
    Image.new("RGBA", (30, 40), (200, 100, 20, 255)).save("texture.png")
    result = iccm(
        "map", "canvas.svg", "card.obj#uv", "--texture", "texture.png", "-o", "out.png", "--size", "50"
    )
    assert result.code == 0, result.err
    assert np.asarray(Image.open("out.png").convert("RGBA"))[25, 25].tolist() == [200, 100, 20, 255]
