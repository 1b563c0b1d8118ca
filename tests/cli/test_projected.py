"""Mock-ups and rectified photographs: `cylinder:90x100`, `photo.jpg#plane=…`, `sheet:210x297`."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.cases import pixels

FILES = Path(__file__).parents[2] / "docs" / "files"
CORNERS = (
    "155,15:360,95:260,130:65,40"  # of a rectangle of the page, see scikit-image's example of this photograph
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for name in ("page.png", "coffee.jpg", "sign.svg"):
        (tmp_path / name).write_bytes((FILES / name).read_bytes())
    monkeypatch.chdir(tmp_path)


def test_a_photo_of_a_page_is_rectified_as_by_scikit_image(folder, iccm):
    transform = pytest.importorskip("skimage.transform")
    assert (
        iccm("map", f"page.png#plane={CORNERS}", "sheet:300x50", "-o", "flat.png", "--size", "300x50").code
        == 0
    )
    corners = np.array([[float(x) for x in word.split(",")] for word in CORNERS.split(":")])
    # pixels are counted from the centre of the first one there
    flat = np.array([[0, 0], [300, 0], [300, 50], [0, 50]])
    reference = transform.ProjectiveTransform.from_estimate(flat - 0.5, corners - 0.5)
    page = np.asarray(Image.open("page.png"), float)
    expected = transform.warp(page, reference, output_shape=(50, 300), order=1)[2:-2, 2:-2]
    picture = pixels("flat.png")[2:-2, 2:-2, 0]
    assert np.corrcoef(expected.ravel(), picture.ravel())[0, 1] > 0.995
    assert np.abs(expected - picture).mean() < 1.5


def test_a_page_on_a_plain_background_keeps_its_print(folder, iccm):
    """Parts of the page that have the background's colour, grey, are not background."""
    photo = Image.new("RGB", (400, 300), (90, 90, 90))
    photo.paste((250, 250, 250), (50, 40, 350, 260))
    photo.paste((90, 90, 90), (80, 60, 300, 110))
    photo.save("table.png")
    page = "table.png#plane=50,40:350,40:350,260:50,260"
    assert iccm("map", page, "sheet:300x220", "-o", "flat.png", "--size", "300x220").code == 0
    flat = np.asarray(Image.open("flat.png").convert("RGBA"))
    assert (flat[..., 3] == 255).all()
    assert np.abs(flat[30:60, 40:240, :3].astype(int) - 90).max() <= 2
    assert np.abs(flat[90:210, 40:280, :3].astype(int) - 250).max() <= 2


@pytest.mark.slow
def test_a_picture_laid_on_a_photo_comes_back_flat(folder, iccm):
    place = "coffee.jpg#plane=30,180:120,200:100,250:5,220"
    assert (
        iccm("map", "sign.svg", place, "-o", "on.png", "-o", "map.npz", "-o", "on.svg", "--size", "1600").code
        == 0
    )
    assert Image.open("on.png").size == (1600, 1068)
    assert np.argwhere(pixels("on.png")[..., 3] > 128).mean(axis=0)[::-1] / 4 == pytest.approx(
        (63, 213), abs=3
    )
    assert iccm("apply", "map.npz", "on.png", "--inverse", "-o", "back.png", "--size", "320").code == 0
    assert iccm("map", "sign.svg", "sheet:160x96", "-o", "sign.png", "--size", "320").code == 0
    back, sign = pixels("back.png"), pixels("sign.png")
    assert back.shape == sign.shape
    assert np.abs(back - sign)[8:-8, 8:-8, :3].mean() < 6


@pytest.mark.slow
def test_a_label_on_a_bottle_is_unrolled_in_its_proportions(folder, iccm):
    """A photograph is made by tracing rays, which knows nothing of the points that are marked."""
    width, height, pitch, distance, focal = 800, 600, 0.25, 330.0, 1500.0
    radius, size = 41.0, (70.0, 46.7)
    x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, height / 2 - np.arange(height) - 0.5)
    ray = np.stack(
        [x, y * np.cos(pitch) - focal * np.sin(pitch), -y * np.sin(pitch) - focal * np.cos(pitch)], -1
    )
    eye = distance * np.array([0, np.sin(pitch), np.cos(pitch)])
    a, b = ray[..., 0] ** 2 + ray[..., 2] ** 2, ray[..., 2] * eye[2]
    with np.errstate(invalid="ignore"):
        t = (-b - np.sqrt(b * b - a * (eye[2] ** 2 - radius**2))) / a
    hit = eye + t[..., None] * ray
    s, v = radius * np.arctan2(hit[..., 0], hit[..., 2]) / size[0] + 0.5, 0.5 - hit[..., 1] / size[1]
    label = np.asarray(Image.open("coffee.jpg"), float)
    on = (s > 0) & (s < 1) & (v > 0) & (v < 1)
    photo = np.full((height, width, 3), 90.0)
    photo[on] = label[(v[on] * 267).astype(int), (s[on] * 400).astype(int)]
    Image.fromarray(photo.astype(np.uint8)).save("bottle.png")

    rows, columns = np.nonzero(on)

    def mark(near_s, near_v):
        k = np.argmin((s[rows, columns] - near_s) ** 2 + (v[rows, columns] - near_v) ** 2)
        return f"{columns[k] + 0.5},{rows[k] + 0.5}"

    marks = ":".join(mark(*place) for place in [(0, 0), (0.55, 0), (1, 0), (1, 1), (0.45, 1), (0, 1)])
    result = iccm("map", f"bottle.png#cylinder=82x46.7:{marks}", "sheet", "-o", "flat.png", "--size", "400")
    assert result.code == 0, result.err
    flat = Image.open("flat.png").convert("RGB")
    assert flat.width / flat.height == pytest.approx(size[0] / size[1], rel=0.03)
    picture = np.asarray(flat.resize((400, 267)), float)[8:-8, 8:-8]
    assert np.corrcoef(picture.ravel(), label[8:-8, 8:-8].ravel())[0, 1] > 0.97


def test_lettering_on_a_cylinder_keeps_its_proportions_in_front(folder, iccm):
    assert iccm("map", "sign.svg", "cylinder:90x40,label=40x24", "-o", "mug.png", "--size", "900").code == 0
    is_painted = pixels("mug.png")[..., 3] > 128
    rows, columns = np.flatnonzero(is_painted.any(axis=1)), np.flatnonzero(is_painted.any(axis=0))
    assert not is_painted[rows[0] : rows[0] + 2, columns[0] : columns[0] + 2].any()  # its corners are round
    # in the middle a label is as high as it is, a little more because it is nearer; its width is that of its chord
    middle, angle = 24 / (450 - 45), 20 / 45
    chord = 90 * np.sin(angle) / (450 - 45 * np.cos(angle))
    assert rows.size / columns.size == pytest.approx(middle / chord, rel=0.01)


def test_a_sheet_without_a_size_of_its_own_keeps_the_proportions_of_the_picture(folder, iccm):
    assert iccm("map", "coffee.jpg", "plane:90x200", "-o", "wall.png", "--size", "450x1000").code == 0
    is_painted = pixels("wall.png")[..., 3] > 128
    assert (is_painted.any(axis=0).sum() / is_painted.any(axis=1).sum()) == pytest.approx(400 / 267, rel=0.01)


@pytest.mark.parametrize(
    ("target", "about"),
    [
        ("cylinder:90", "2 sizes"),
        ("cylinder:90x-1", "greater than 0"),
        ("cylinder:90x100,colour=3", "turn"),
        ("cylinder:90x100,label=300x20", "300 by 20"),
        ("cylinder:90xhigh", "high"),
        ("sphere:10,distance=3", "behind the camera"),
        ("plane:20x30,turn=120", "not seen"),
        ("sheet", "sheet:WIDTHxHEIGHT"),
        ("coffee.jpg#plane=1,2:3,4", "2 points"),
        ("coffee.jpg#plane=1,2:30,4:5,60:80,70", "top left"),
        ("coffee.jpg#plane=1,2:30,4:5,60:80,70,focal=9", "setting"),
        ("sign.svg#plane=1,2:30,4:5,60:80,70", "not one"),
        ("none.jpg#plane=1,2:30,4:5,60:80,70", "none.jpg"),
    ],
)
def test_wrong_targets_are_refused_in_one_line(folder, iccm, target, about):
    result = iccm("map", "sign.svg", target, "-o", "wrong.png")
    assert result.code == 2 and about in result.err and result.err.count("\n") == 1
    assert not Path("wrong.png").exists()


def test_an_outline_that_would_be_ignored_is_refused(folder, iccm):
    result = iccm("map", "sign.svg", "sheet:160x96", "--texture", "coffee.jpg", "-o", "wrong.png")
    assert result.code == 2 and "coffee.jpg#plane=" in result.err and not Path("wrong.png").exists()


@pytest.mark.parametrize("kind", ["plane", "cylinder", "cone"])
def test_the_points_of_a_marked_sheet_are_asked_for(folder, iccm, kind):
    result = iccm("map", f"coffee.jpg#{kind}", "sheet:160x96", "-o", "wrong.png")
    assert result.code == 2 and f"photo.jpg#{kind}=" in result.err and result.err.count("\n") == 1


@pytest.mark.parametrize("arguments", [("--pin", "1,2:3,4"), ("--method", "conformal"), ("--fit", "cover")])
def test_options_of_a_search_are_refused(folder, iccm, arguments):
    result = iccm("map", "sign.svg", "cylinder:90x100", *arguments, "-o", "wrong.png")
    assert result.code == 2 and arguments[0] in result.err


@pytest.mark.slow
def test_a_batch_maps_onto_generated_shapes_and_marked_photographs(folder, iccm):
    Path("jobs.toml").write_text(
        f"""
        [[job]]
        source = "sign.svg"
        target = "cylinder:90x100,pitch=15"
        size = 64
        [[job]]
        source = "page.png#plane={CORNERS}"
        target = "sheet"
        output = "{{source.stem}}-flat.png"
        size = 64
        """
    )
    result = iccm("batch", "jobs.toml", "--root", "out")
    assert result.code == 0, result.err
    assert {path.name for path in Path("out").glob("*.png")} == {"sign-cylinder.png", "page-flat.png"}


def test_default_names_are_those_of_files(folder, iccm):
    assert iccm("map", f"page.png#plane={CORNERS}", "sheet", "--size", "64").code == 0
    assert Path("page-plane-sheet.png").exists()
