"""--place: drawings that keep their proportions, in every kind of output."""

import json

import numpy as np
import pytest
import resvg_py

from iccm.io.pictures import image_files

pytestmark = pytest.mark.usefixtures("solve_once")

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} {}">{}</svg>'
SIGN = (
    '<rect x="0" y="0" width="100" height="60" fill="#204080"/><circle cx="30" cy="25" r="16" fill="#fc0"/>'
)
SHIELD = '<path d="M5 10L75 5V60L45 95L5 70z"/>'


@pytest.fixture
def drawings(shapes):
    (shapes / "sign.svg").write_text(SVG.format(100, 60, SIGN))
    (shapes / "shield.svg").write_text(SVG.format(80, 100, SHIELD))
    (shapes / "panes.svg").write_text(
        SVG.format(90, 40, '<path d="M5 5h30v30h-30z"/><path d="M45 5h40v30h-40z"/>')
    )
    return shapes


def disc(name):
    """Width, height and centre of the yellow disc in a picture, in pixels, and the share that is painted."""
    pixels = image_files.read(name).pixels.astype(int)
    yellow = (pixels[..., 0] > 200) & (pixels[..., 3] > 128)
    rows, columns = np.nonzero(yellow)
    size = np.ptp(columns) + 1, np.ptp(rows) + 1
    return *size, columns.mean(), rows.mean(), (pixels[..., 3] > 128).mean()


@pytest.mark.slow
def test_a_circle_stays_one_inside_and_when_sliced(drawings, iccm):
    report = {}
    for place in ("fill", "inside", "slice"):
        result = iccm(
            *("map", "sign.svg", "shield.svg", "--place", place, "--size", "400x500"),
            *("--detail", "0", "-o", f"{place}.png", "--report", f"{place}.json"),
        )
        assert result.code == 0, result.err
        report[place] = json.loads((drawings / f"{place}.json").read_text())
    width, height, *_ = disc("fill.png")
    assert height > 1.15 * width
    width, height, _, _, painted = disc("inside.png")
    assert height == pytest.approx(width, abs=2)
    assert width / (5 * 32) == pytest.approx(70 / 100, abs=0.02)  # as wide as the shield
    assert painted == pytest.approx(0.7 * 0.7 * 100 * 60 / 8000, rel=0.03)
    assert report["inside"]["shown"] == pytest.approx(1, abs=1e-3)
    assert report["slice"]["covered"] == pytest.approx(1, abs=1e-3)
    shield = disc("slice.png")[-1]
    assert shield == pytest.approx(disc("fill.png")[-1], abs=2e-3)
    assert 0.3 < report["slice"]["shown"] < 0.6
    assert all(value["injective"]["share"] > 0.999 for value in report.values())
    assert report["inside"]["job"]["place"] == "inside"


def test_artwork_and_stmap_are_placed_alike(drawings, iccm):
    result = iccm(
        *("map", "sign.svg", "shield.svg", "--place", "inside", "--size", "400x500"),
        *("-o", "o.png", "-o", "o.svg", "--stmap", "o.exr", "-o", "o.npz"),
    )
    assert result.code == 0, result.err
    _, _, column, row, painted = disc("o.png")
    st = image_files.read("o.exr").pixels
    assert np.allclose(st[round(row), round(column), :2], (0.30, 1 - 25 / 60), atol=0.01)
    assert (st[..., 3] > 0.5).mean() == pytest.approx(painted, abs=2e-3)
    assert iccm("apply", "o.npz", "sign.svg", "-o", "applied.svg").code == 0
    for name in ("o", "applied"):
        rendered = resvg_py.svg_to_bytes(svg_path=f"{name}.svg", width=400)
        (drawings / f"{name}-svg.png").write_bytes(bytes(rendered))
        assert disc(f"{name}-svg.png") == pytest.approx(disc("o.png"), abs=1)


def test_gaps_between_placed_parts_stay_empty(drawings, iccm):
    parts = '<path d="M0 0h40v60h-40z" fill="#204080"/><path d="M60 0h40v50h-40z" fill="#fc0"/>'
    (drawings / "two.svg").write_text(SVG.format(100, 60, parts))
    result = iccm("map", "two.svg", "shield.svg", "--place", "inside", "-o", "o.png", "--size", "400x500")
    assert result.code == 0, result.err
    pixels = image_files.read("o.png").pixels
    painted = pixels[..., 3] > 128
    row = np.flatnonzero(painted.any(axis=1))[20]
    columns = np.flatnonzero(painted[row])
    gaps = np.diff(columns)
    assert gaps.max() == pytest.approx(0.2 * (columns[-1] - columns[0]), abs=3) and (gaps > 1).sum() == 1


def test_each_part_of_the_target_has_a_copy(drawings, iccm):
    result = iccm(
        *("map", "sign.svg#1", "panes.svg", "--place", "inside", "--parts", "each", "--texture", "checker"),
        *("--size", "900", "-o", "o.png"),
    )
    assert result.code == 0, result.err
    alpha = image_files.read("o.png").pixels[..., 3] > 128
    heights = [alpha[:, x].sum() for x in (200, 650)]
    assert heights[0] == pytest.approx(0.6 * 300, abs=3) and heights[1] == pytest.approx(0.6 * 400, abs=3)


def test_rigid_regions_and_pins_go_with_it(drawings, iccm):
    (drawings / "face.svg").write_text(SVG.format(100, 60, SIGN.replace("<circle", '<circle id="sun"')))
    result = iccm(
        *("map", "face.svg", "shield.svg", "--place", "inside", "--rigid", "#sun", "--pin", "30,25:35,40"),
        *("-o", "o.png", "--size", "400x500", "--report", "r.json"),
    )
    assert result.code == 0, result.err
    width, height, column, row, _ = disc("o.png")
    assert height == pytest.approx(width, abs=2)
    assert (column / 5, row / 5) == (pytest.approx(35, abs=0.3), pytest.approx(40, abs=0.3))
    assert json.loads((drawings / "r.json").read_text())["pins"][0]["error"] < 1e-6


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--fit", "cover"), "fit"),
        (("--pin", "10,10:6,11", "--pin", "90,10:6,60"), "place"),
        (("--start", "o.npz"), "--start"),
        (("--method", "conformal"), "place"),
    ],
)
def test_incompatible_options_are_refused_in_one_line(drawings, iccm, options, named):
    assert iccm("map", "sign.svg", "shield.svg", "-o", "o.npz").code == 0
    result = iccm("map", "sign.svg", "shield.svg", "--place", "inside", *options, "-o", "o.png")
    errors = [line for line in result.lines if line.startswith("error:")]
    assert result.code == 2 and len(errors) == 1 and named in errors[0]
    assert not (drawings / "o.png").exists()


@pytest.mark.slow
def test_meshes_are_filled_or_sliced(drawings, iccm):
    (drawings / "two.obj").write_text("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n")
    assert iccm("map", "sign.svg", "two.obj", "--place", "slice", "-o", "o.obj").code == 0
    result = iccm("map", "sign.svg", "two.obj", "--place", "inside", "-o", "p.obj")
    assert result.code == 2 and "two.obj" in result.err and "--place" in result.err
