"""What pictures show and textures cover, for canvases and textures with unequal sides."""

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.options import FREE_SIDE
from iccm.io.run import framing, report
from iccm.io.run.blank_picture import Colours
from iccm.io.run.job import Job
from iccm.io.shapes import shape


@pytest.fixture
def oblong(tmp_path):
    """A shape from (6, 2) to (36, 8) on a canvas of 40 by 10, y down."""
    path = tmp_path / "oblong.svg"
    path.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 10"><path d="M6 2H36V8H16z"/></svg>'
    )
    return shape.read(str(path))


def job(**options):
    return Job(source="a.svg", target="b.svg", **options)


def test_a_texture_covers_the_canvas_scaled_and_moved(oblong):
    assert framing.texture_box(job(), oblong) == (-10j, 40 + 0j)
    assert framing.texture_box(job(texture_box="bbox"), oblong) == (6 - 8j, 36 - 2j)
    moved = framing.texture_box(job(texture_scale=(2, 3), texture_offset=(5, 1)), oblong)
    assert moved == (-15 - 21j, 65 + 9j)  # y is down in the file
    assert framing.texture_box(job(texture_scale=(2,)), oblong) == (-20 - 15j, 60 + 5j)


def test_a_texture_that_repeats_keeps_its_proportions(oblong):
    assert framing.texture_box(job(edge="repeat"), oblong, 8.0) == (-7.5j, 40 - 2.5j)
    assert framing.texture_box(job(edge="clamp"), oblong, 8.0) == (-10j, 40 + 0j)


def test_the_checkerboard_covers_a_square(oblong):
    assert framing.checkerboard_box(job(), oblong) == (6 - 20j, 36 + 10j)
    assert framing.checkerboard_box(job(texture_box="viewbox"), oblong) == (-25j, 40 + 15j)


@pytest.mark.parametrize("path, cells", [("M0 0H36V8H9z", 8), ("M3 0H10L7 70H3z", 16), ("M0 5H90V16H7z", 16)])
def test_squares_of_the_checkerboard_are_smaller_than_thin_shapes(tmp_path, path, cells):
    file = tmp_path / "bar.svg"
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="{path}"/></svg>')
    bar = shape.read(str(file))
    low, high = framing.checkerboard_box(job(), bar)
    assert framing.checkerboard_cells(bar) == cells
    assert (high - low).real / cells <= min(36, *np.ptp(bar.curve.polygon.exterior.coords, axis=0))


def test_a_texture_is_rotated_by_degrees():
    assert framing.texture_rotation(job(texture_turn=30)) == pytest.approx(3**0.5 / 2 + 0.5j)


@pytest.mark.parametrize(
    ("size", "expected"),
    [((100,), (100, 33)), ((FREE_SIDE, 50), (150, 50)), ((90, FREE_SIDE), (90, 30)), ((7, 9), (7, 9))],
)
def test_a_free_side_follows_the_proportions_of_the_frame(size, expected):
    assert framing.size_within(size, 3 + 1j, 10_000) == expected
    with pytest.raises(InputError, match="max-pixels"):
        framing.size_within(size, 3 + 1j, expected[0] * expected[1] - 1)


def test_textures_with_other_proportions_than_their_canvas_get_a_note(oblong):
    given = job(texture="t.png")
    assert framing.stretch_notes(given, oblong, (25, 100, 3)) == []
    (note,) = framing.stretch_notes(given, oblong, (100, 25, 3))
    assert "25x100" in note and "40x10" in note


def test_complex_numbers_of_a_report_are_x_and_y():
    assert report.as_json({"at": np.array([1 + 2j]), "bad": float("inf")}) == {"at": [[1, 2]], "bad": None}


def report_of(gap=0.001, certified=True, share=1.0, pins=()):
    return {
        "boundary": {"hausdorff": gap},
        "injective": {"certified": certified, "share": share, "folded": 0.0},
        "pins": pins,
        "strokes": [],
        "status": "reached",
    }


@pytest.mark.parametrize(
    ("figures", "part"),
    [({"gap": 0.5}, "boundary"), ({"certified": False}, "injective"), ({"share": 0.9}, "90.0%")],
)
def test_doubtful_figures_are_reported(figures, part):
    assert report.doubts(report_of(), 0.01, False) == []
    (doubt,) = report.doubts(report_of(**figures), 0.01, False)
    assert part in doubt
    (cured,) = report.doubts(report_of(**figures, pins=[{}]), 0.01, False)
    assert cured.startswith(doubt) and "--quasi" in cured


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_only_opaque_pixels_have_a_colour(dtype):
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    pixels = np.zeros((4, 5, 4), dtype)
    pixels[1:3] = np.array([1, 0, 0, 1]) * top
    pixels[3] = np.array([0, 1, 0, 0.5]) * top
    colours = Colours()
    colours.see(pixels, 3)
    assert colours.single and not colours.empty and "single colour" in colours.note(True, True)
    pixels[1, 1] = np.array([0, 1, 0, 1]) * top
    colours.see(pixels, 3)
    assert not colours.single and colours.note(True, True) is None
