"""Drawings that are their own picture are placed by what is seen of them: --detail and --fit box."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} {}">{}</svg>'
DRAWINGS = {
    "figure": SVG.format(
        320,
        340,
        '<path fill="#e70" d="M110 130H210V250H110Z"/><path fill="#fc9" d="M110 132C90 150 80 200 20 262C60 300 '
        '110 300 160 300C210 300 260 300 300 264C240 200 230 150 210 132V240H110Z"/>'
        '<circle fill="#fc9" cx="160" cy="80" r="52"/>'
        '<circle cx="142" cy="78" r="6"/><circle cx="178" cy="78" r="6"/>',
    ),
    "bell": SVG.format(
        320,
        340,
        '<path fill="#fa3" d="M160 20C175 20 180 35 178 48C240 60 250 130 252 190C254 230 290 240 290 280H30C30 240 66 '
        '230 68 190C70 130 80 60 142 48C140 35 145 20 160 20Z"/><circle fill="#e66" cx="160" cy="288" r="26"/>',
    ),
    "logo": SVG.format(90, 60, '<path d="M5 5h20v50H5zM40 5h15v15h20v10H40z"/>'),
    "blob": SVG.format(90, 60, '<path d="M5 5h60v20h20v30H5z"/>'),
    "square": SVG.format(400, 400, '<rect fill="#567" x="20" y="20" width="360" height="360"/>'),
    "wide": SVG.format(600, 380, '<rect fill="#567" x="20" y="20" width="560" height="340" rx="40"/>'),
    "heart": SVG.format(
        480,
        440,
        '<path fill="#c22" d="M240 420C60 300 20 200 20 140C20 70 75 20 140 20C185 20 222 45 240 85C258 45 295 20 340 '
        '20C405 20 460 70 460 140C460 200 420 300 240 420Z"/>',
    ),
    "ring": SVG.format(
        400,
        360,
        '<path fill-rule="evenodd" d="M20 20H360V300H20ZM50 50V270H330V50Z"/><path d="M150 40h20v240h-20z"/>',
    ),
    "app": SVG.format(
        300, 300, '<path fill="#c12" d="M0 0H300V300H0Z"/><path fill="#fff" d="M90 90H190V130H130V210H90Z"/>'
    ),
    "no": SVG.format(
        400,
        400,
        '<path fill-rule="evenodd" d="M200 10A190 190 0 1 0 200 390A190 190 0 1 0 200 10ZM200 40A160 160 0 1 1 200 '
        '360A160 160 0 1 1 200 40Z"/><path d="M110 190H290V215H110Z"/>',
    ),
    "tag": SVG.format(90, 70, '<path fill="#06c" fill-rule="evenodd" d="M5 5H85V65H5ZM15 15V55H75V15Z"/>'),
    "hook": SVG.format(
        320, 320, '<path d="M50 280V40H270V160H220V90H100V280Z"/><path d="M240 200h50v80h-50z" fill="#123"/>'
    ),
}


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in DRAWINGS.items():
        (tmp_path / f"{name}.svg").write_text(text)
    return tmp_path


def picture(iccm, source, target, *options):
    words = source.split()
    result = iccm(
        "map", *words, target, "-o", "out.png", "--report", "out.json", "--force", "--size", "160", *options
    )
    assert result.code == 0, result.err
    return np.asarray(Image.open("out.png").convert("RGBA")).astype(int), json.loads(
        Path("out.json").read_text()
    )


def test_a_figure_is_whole_upright_and_symmetric_on_a_square(iccm, files):
    pixels, report = picture(iccm, "figure.svg", "square.svg")
    assert report["shown"] > 0.99 and abs(report["turn"]) < 0.5
    assert report["dilatation"]["p95"] < 1.25
    assert abs(pixels - pixels[:, ::-1])[..., :3].mean() < 6  # the arms differ by four units
    eyes = (pixels[..., :3].max(axis=2) < 60) & (pixels[..., 3] == 255)
    assert 8 < eyes.sum() < 200


def test_a_bell_stays_a_bell_on_a_rectangle(iccm, files):
    pixels, report = picture(iccm, "bell.svg", "wide.svg")
    orange = (abs(pixels[..., :3] - [255, 170, 51]).max(axis=2) < 30) & (pixels[..., 3] > 0)
    rows = np.flatnonzero(orange.any(axis=1))
    top, bottom = (orange[round(rows[0] + part * (rows[-1] - rows[0]))].sum() for part in (0.2, 0.8))
    assert bottom > 1.3 * top > 0
    assert report["covered"] > 0.99


@pytest.mark.slow
def test_detail_0_maps_outlines_as_textures_are(iccm, files):
    _, composed = picture(iccm, "bell.svg", "wide.svg")
    _, outlines = picture(iccm, "bell.svg", "wide.svg", "--detail", "0")
    assert outlines["dilatation"]["p95"] > 1.2 * composed["dilatation"]["p95"]


@pytest.mark.parametrize(
    ("source", "target", "own"),
    [
        ("logo.svg", "heart.svg", True),
        ("blob.svg", "heart.svg", False),
        ("blob.svg", "app.svg", True),
        ("--text Ab", "heart.svg", True),
    ],
)
def test_only_plain_outlines_get_the_checkerboard(iccm, files, source, target, own):
    _, report = picture(iccm, source, target)
    assert report["pixels"].get("checkerboard", False) is not own


@pytest.mark.slow
def test_a_repeated_pattern_of_one_colour_shows_itself(iccm, files):
    dots = np.full((40, 40, 3), 255, np.uint8)
    dots[5:15, 5:15] = dots[25:35, 20:30] = 0
    Image.fromarray(dots).save("dots.png")
    _, report = picture(iccm, "dots.png", "heart.svg", "--edge", "repeat", "--texture-scale", ".2")
    assert "checkerboard" not in report["pixels"]


@pytest.mark.slow
def test_a_picture_on_a_window_is_whole_on_its_silhouette(iccm, files):
    pixels, report = picture(iccm, "bell.svg", "ring.svg")
    rows, columns = np.nonzero(pixels[..., 3] == 255)
    box = pixels[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    assert (box[..., 3] > 250).mean() > 0.99  # antialiased twice at the rim
    assert report["shown"] > 0.99 and any("silhouette" in note for note in report["notes"])
    kept, report = picture(iccm, "bell.svg", "ring.svg", "--holes", "keep")
    assert kept[60, 40, 3] == 0 and not any("silhouette" in note for note in report["notes"])


def test_the_target_is_not_seen_through_holes_of_the_drawing(iccm, files):
    pixels, _ = picture(iccm, "tag.svg", "no.svg")
    blue = (abs(pixels[..., :3] - [0, 102, 204]).max(axis=2) < 12) & (pixels[..., 3] == 255)
    rows, columns = np.nonzero(blue)
    hole = pixels[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    hole = hole[hole.shape[0] // 3 : -(hole.shape[0] // 3), hole.shape[1] // 4 : -(hole.shape[1] // 4)]
    assert abs(hole - hole[0, 0]).max() <= 1 and hole[0, 0, 3] == 255  # paper, without the bar
    bar = pixels[80, 10:150]
    assert abs(bar - hole[0, 0]).max() > 20  # the ring beside it


def test_the_flat_colour_of_a_picture_continues_it(iccm, files):
    pixels, _ = picture(iccm, "app.svg", "heart.svg")
    seen = pixels[pixels[..., 3] == 255][:, :3]
    red, white = (abs(seen - colour).max(axis=1) < 12 for colour in ([204, 17, 34], [255, 255, 255]))
    assert (red | white).mean() > 0.97 and 0.05 < white.mean() < 0.4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "target"),
    [
        ("figure", "heart"),
        ("figure", "hook"),
        ("bell", "wide"),
        ("bell", "ring"),
        ("app", "heart"),
        ("tag", "no"),
    ],
)
def test_the_svg_shows_what_the_picture_does(iccm, files, source, target):
    resvg = pytest.importorskip("resvg_py")
    result = iccm("map", f"{source}.svg", f"{target}.svg", "-o", "o.png", "-o", "o.svg", "--size", "300")
    assert result.code == 0, result.err
    shown = np.asarray(Image.open("o.png").convert("RGBA")).astype(int)
    content = bytes(resvg.svg_to_bytes(svg_path="o.svg", width=shown.shape[1]))
    drawn = np.asarray(Image.open(io.BytesIO(content)).convert("RGBA")).astype(int)
    # as it is seen: the colour of a pixel that is almost transparent does not count
    shown, drawn = (
        np.dstack([p[..., :3] * p[..., 3:] / 255, p[..., 3]]) for p in (shown, drawn[: shown.shape[0]])
    )
    differing = abs(shown - drawn).max(axis=2) > 32
    # an edge may be off by a pixel
    assert ndimage.binary_erosion(differing, np.ones((3, 3))).mean() < 0.002
    around = (3, 3, 1)
    contrast = ndimage.maximum_filter(drawn, around) - ndimage.minimum_filter(drawn, around)
    assert (differing & (contrast.max(axis=2) <= 32)).mean() < 0.002


@pytest.mark.slow
def test_fit_box_maps_the_box_of_the_drawing(iccm, files):
    _, report = picture(iccm, "logo.svg", "hook.svg", "--fit", "box")
    assert report["covered"] > 0.9
    pixels, _ = picture(iccm, "blob.svg#bbox", "square.svg", "--texture", "blob.svg")
    boxed, _ = picture(
        iccm, "blob.svg", "square.svg", "--fit", "box", "--texture", "blob.svg", "--texture-box", "viewbox"
    )
    assert abs(pixels - boxed)[..., 3].mean() < 3


@pytest.mark.slow
def test_the_first_pin_in_its_place_changes_nothing(iccm, files):
    without, _ = picture(iccm, "bell.svg", "square.svg", "--detail", "1")
    result = iccm("map", "bell.svg", "square.svg", "-o", "m.npz")
    assert result.code == 0, result.err
    import iccm as library

    z = 160 - 150j
    image = complex(library.load("m.npz").map(z))
    pin = f"160,150:{image.real},{-image.imag}"
    pinned, _ = picture(iccm, "bell.svg", "square.svg", "--pin", pin)
    assert abs(pinned - without)[..., :3].mean() < 6
