"""Faces in photos: which are found, and that maps neither bend nor crop them."""

from pathlib import Path

import numpy as np
import pytest
import skimage
from PIL import Image
from scipy import ndimage

from iccm import load
from iccm.drawings.detail import FACE_SHARE, Detail
from iccm.drawings.faces import faces_of
from iccm.errors import InputError
from iccm.maps.approximation import triangulated

DATA = Path(skimage.__file__).parent / "data"
FILES = Path(__file__).parents[3] / "docs" / "files"
PHOTO = DATA / "astronaut.png"
FACE = 172, 64, 277, 169
"""Left, top, right and bottom of her face, in pixels."""


def pixels_of(name):
    return np.asarray(Image.open(name).convert("RGB")) / np.float32(255)


def framed(crop, place=100 + 100j, side=75):
    """A small grey picture, enlarged, in a grey square of 200 by 200, with its upper left corner at a place."""
    picture = np.full((200, 200), 0.5)
    left, top = int(place.real), int(place.imag)
    picture[top : top + side, left : left + side] = ndimage.zoom(crop, side / crop.shape[0], order=3)
    return np.repeat(picture[..., None], 3, axis=2)


def test_a_face_is_found_where_it_is_at_any_size_of_the_photo():
    photo = pixels_of(PHOTO)
    for picture in (photo, np.kron(photo, np.ones((3, 3, 1)))):
        ((low, high),) = faces_of(picture, (0j, 512 + 512j))
        left, top, right, bottom = FACE
        assert low.real < left < right < high.real and low.imag < 512 - bottom < 512 - top < high.imag
        assert (high - low).real < 2 * (right - left) and (high - low).imag < 2 * (bottom - top)


@pytest.mark.slow
def test_most_faces_are_found_and_hardly_anything_else():
    crops = np.load(DATA / "lfw_subset.npy")  # 100 faces, then 100 other pieces of photos
    found = [bool(faces_of(framed(crop), (0j, 1 + 1j))) for crop in crops[::8]]
    assert sum(found[:13]) >= 11 and sum(found[13:]) <= 1


@pytest.mark.parametrize(
    "name", [FILES / "cat.jpg", DATA / "chelsea.png", FILES / "coffee.jpg", FILES / "stars.jpg"]
)
def test_animals_and_things_have_no_faces(name):
    assert not faces_of(pixels_of(name), (0j, 1 + 1j))


def test_a_missing_file_is_an_error_only_if_faces_are_required(monkeypatch):
    monkeypatch.setattr("skimage.data.lbp_frontal_face_cascade_filename", lambda: "gone.xml")
    assert faces_of(pixels_of(PHOTO), (0j, 1 + 1j)) == []
    with pytest.raises(InputError, match=r"^gone\.xml: missing"):
        faces_of(pixels_of(PHOTO), (0j, 1 + 1j), required=True)


def test_edges_in_faces_count_as_much_as_all_others():
    photo = np.concatenate([pixels_of(PHOTO), np.ones((512, 512, 1))], axis=2)
    plain = Detail.of_picture(photo, (0j, 512 + 512j))
    left, top, right, bottom = FACE
    box = complex(left, 512 - bottom), complex(right, 512 - top)
    detail = plain.with_faces([box])
    middle, radius = (box[0] + box[1]) / 2, (right - left) / 2
    inside = np.abs(detail.points - middle) < radius
    assert detail.weights.sum() == pytest.approx(1)
    assert detail.weights[inside].sum() == pytest.approx(FACE_SHARE, abs=0.01)
    assert plain.weights[inside].sum() < 0.2
    weights = [picture.energy_weight(has_margin=False) for picture in (plain, detail)]
    assert weights[0] < plain.energy_weight(has_margin=True) < weights[1]


def test_a_face_that_no_edge_lies_in_changes_nothing():
    photo = np.concatenate([pixels_of(PHOTO), np.ones((512, 512, 1))], axis=2)
    plain = Detail.of_picture(photo, (0j, 512 + 512j))
    assert plain.with_faces([(600 + 600j, 700 + 700j)]) is plain


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Image.open(PHOTO).resize((256, 256)).save("photo.png")
    svg = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 120 100"><path d="{}"/></svg>'
    Path("wide.svg").write_text(svg.format("M0 20H120V70H0Z"))
    return tmp_path


def dilatation_of_face(name):
    """Median over her face of the longer by the shorter axis of the images of small circles, and the share seen."""
    left, top, right, bottom = (side / 2 for side in FACE)
    x, y = np.meshgrid(np.linspace(left, right, 9), np.linspace(-top, -bottom, 9))
    _, a, b = triangulated(load(name).map).jet((x + 1j * y).ravel())
    is_mapped = np.isfinite(a)
    a, b = np.abs(a[is_mapped]), np.abs(b[is_mapped])
    return np.median((a + b) / (a - b)), is_mapped.mean()


@pytest.mark.slow
def test_a_face_is_neither_squeezed_nor_cropped_unless_faces_are_off(folder, iccm):
    outputs = "-o", "m.npz", "--force"
    result = iccm("map", "photo.png", "wide.svg", *outputs)
    assert result.code == 0 and "a face is found" in result.err
    dilatation, seen = dilatation_of_face("m.npz")
    assert dilatation < 1.15 and seen > 0.95
    result = iccm("map", "photo.png", "wide.svg", "--faces", "off", *outputs)
    assert result.code == 0 and "face" not in result.err
    without, shown = dilatation_of_face("m.npz")
    assert shown < 0.5 or without > 1.5


@pytest.mark.slow
def test_a_crop_shows_the_face(folder, iccm):
    result = iccm("map", "photo.png", "wide.svg", "--place", "slice", "-o", "m.npz")
    assert result.code == 0, result.err
    dilatation, seen = dilatation_of_face("m.npz")
    assert dilatation == pytest.approx(1) and seen > 0.95


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["wide.svg", "wide.svg"], "no effect"),
        (["photo.png", "wide.svg", "--texture", "photo.png"], "no effect"),
    ],
)
def test_faces_that_cannot_be_found_are_refused_if_they_are_asked_for(folder, iccm, arguments, reason):
    result = iccm("map", *arguments, "--faces", "on", "-o", "x.png")
    assert result.code == 2 and reason in result.err and not Path("x.png").exists()
