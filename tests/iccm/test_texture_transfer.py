"""Textures transferred by one call on arrays, equal to the result of the command."""

import importlib

import numpy as np
import pytest
import shapely

import iccm
from iccm.io.pictures import image_files
from iccm.io.run.execute import run
from iccm.io.run.job import Job

SQUARE = np.array([0, 1, 1 + 1j, 1j])
TURN = np.exp(1j * np.linspace(0, 2 * np.pi, 120, endpoint=False))
ELLIPSE = 2 * TURN.real + 1j * TURN.imag
DOUBLED = 2 * SQUARE + 3 - 1j


def noise(shape, dtype, seed=3):
    values = np.random.default_rng(seed).random(shape)
    dtype = np.dtype(dtype)
    return values.astype(dtype) if dtype.kind == "f" else (values * np.iinfo(dtype).max).astype(dtype)


def test_every_public_name_exists():
    for name in iccm.__all__:
        assert getattr(iccm, name) is getattr(iccm, name), name
        assert not isinstance(getattr(iccm, name), type(iccm)), f"{name} is a module"
    importlib.reload(iccm)
    assert callable(iccm.transfer)
    assert callable(iccm.transfer)  # a module of the same name would replace it after the first use


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float32])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_a_similarity_gives_the_texture_back(dtype, channels):
    texture = noise((64, 64, channels), dtype)
    full = 1 if texture.dtype.kind == "f" else np.iinfo(dtype).max
    if channels in (2, 4):
        texture[..., -1] = full
    transfer = iccm.transfer(texture, SQUARE, DOUBLED, size=64, filter="nearest")
    colours = texture[..., : channels - (channels in (2, 4))]
    assert transfer.pixels.dtype == dtype
    assert np.array_equal(transfer.pixels[..., :-1], colours)
    assert (transfer.pixels[..., -1] == full).all()
    assert transfer.box == (3 - 1j, 5 + 1j)
    assert transfer.fit.status.ok
    assert transfer.diagnostics.inside == 64 * 64


def test_grey_and_float64_are_accepted():
    grey = noise((32, 32), np.float64)
    transfer = iccm.transfer(grey, SQUARE, DOUBLED, size=32, filter="nearest")
    assert transfer.pixels.shape == (32, 32, 2)
    assert np.array_equal(transfer.pixels[..., 0], grey.astype(np.float32))


@pytest.mark.parametrize(
    ("given", "dtype", "factor"),
    [(np.bool_, np.uint8, 255), (np.int64, np.uint8, 1), (np.uint32, np.uint16, 1)],
)
def test_other_types_become_the_smallest_that_holds_them(given, dtype, factor):
    top = {np.bool_: 2, np.int64: 256, np.uint32: 65536}[given]
    texture = np.random.default_rng(0).integers(0, top, (6, 9)).astype(given)
    texture[0, 0], texture[5, 8] = 0, top - 1
    oblong = 3 * SQUARE.real + 2j * SQUARE.imag
    transfer = iccm.transfer(texture, oblong, oblong, size=(9, 6), filter="nearest")
    assert transfer.pixels.dtype == dtype
    assert np.array_equal(transfer.pixels[..., 0], factor * texture.astype(int))


@pytest.mark.parametrize(("dtype", "grey"), [(np.uint8, 188), (np.float32, 0.5)])
def test_integers_are_averaged_in_linear_light_and_floats_as_they_are(dtype, grey):
    texture = np.zeros((64, 64), dtype)
    texture[:, ::2] = 1 if dtype == np.float32 else 255
    inner = iccm.transfer(texture, SQUARE, DOUBLED, size=8).pixels[2:-2, 2:-2, 0]
    assert inner == pytest.approx(np.full((4, 4), grey), rel=0.02)


def test_grey_with_alpha_is_not_two_colours():
    texture = np.zeros((8, 8, 2), np.uint8)
    texture[:, :4] = 200, 255
    pixels = iccm.transfer(texture, SQUARE, DOUBLED, size=64).pixels
    assert pixels.shape == (64, 64, 2) and pixels[32, 8].tolist() == [200, 255] and pixels[32, 56, 1] == 0
    seen = pixels[pixels[..., 1] > 8]
    assert seen[:, 0].min() >= 198  # transparent pixels have no colour


@pytest.mark.slow
def test_the_command_makes_the_same_picture(tmp_path):
    def drawing(name, z):
        points = " ".join(f"{w.real!r},{-w.imag!r}" for w in z.tolist())
        (tmp_path / name).write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-4 -4 8 8"><polygon points="{points}"/></svg>'
        )
        return str(tmp_path / name)

    texture = noise((40, 60, 3), np.uint8)
    image_files.write(tmp_path / "t.png", image_files.Image(texture))
    boxes = {"texture_box": "bbox", "target_box": "bbox"}
    names = {
        "source": drawing("a.svg", 3 * SQUARE),
        "target": drawing("b.svg", ELLIPSE),
        "output": (str(tmp_path / "o.png"),),
    }
    run(Job(texture=str(tmp_path / "t.png"), size=(96,), **names, **boxes))
    transfer = iccm.transfer(texture, 3 * SQUARE, ELLIPSE, size=96)
    assert np.array_equal(image_files.read(str(tmp_path / "o.png")).pixels, transfer.pixels)


@pytest.mark.slow
def test_one_map_carries_many_textures():
    fit = iccm.fit(SQUARE, ELLIPSE)
    colour, normals = noise((32, 32, 3), np.uint8), noise((32, 32, 3), np.float32)
    first = iccm.warp(fit, colour, size=(80, 40))
    assert first.pixels.shape == (40, 80, 4)
    assert first.fit is fit
    whole = iccm.transfer(colour, SQUARE, ELLIPSE, size=(80, 40))
    assert np.array_equal(first.pixels, whole.pixels)
    turned = iccm.warp(fit, normals, size=40, kind="normal").pixels
    inside = turned[..., 3] == 1
    length = np.linalg.norm(2 * turned[inside][:, :3] - 1, axis=1)
    assert np.abs(length - 1).max() < 1e-5


def test_a_deformed_shape_shows_all_of_itself():
    fit = iccm.deform(SQUARE, pins=[(0.2 + 0.2j, 0.2 + 0.2j), (0.8 + 0.8j, 2 + 2j)])
    picture = iccm.warp(fit, iccm.checkerboard(64), size=50)
    image = fit.image
    assert picture.box[0].real <= image.real.min() + 1e-12
    assert picture.box[1].imag >= image.imag.max() - 1e-12
    cover = picture.pixels[..., 3] > 0
    assert cover.any(0).all()
    assert cover.any(1).all()


def test_boxes_are_kept_to():
    texture = noise((20, 20, 3), np.uint8)
    box = (0.25 + 0.25j, 0.75 + 0.75j)
    transfer = iccm.transfer(
        texture,
        SQUARE,
        DOUBLED,
        size=20,
        texture_box=box,
        target_box=(3.5 - 0.5j, 4.5 + 0.5j),
        filter="nearest",
        edge="transparent",
    )
    assert np.array_equal(transfer.pixels[..., :3], texture)
    wide = iccm.transfer(texture, SQUARE, DOUBLED, size=(40, 20))
    assert wide.box == (2 - 1j, 6 + 1j)
    assert not wide.pixels[:, :9, 3].any()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"texture": np.full((2, 2, 3), -1)}, "int64"),
        ({"texture": np.zeros((2, 2, 3, 1), np.uint8)}, r"\(2, 2, 3, 1\)"),
        ({"texture": np.zeros((0, 2, 3), np.uint8)}, r"\(0, 2, 3\)"),
        ({"texture": "face.png"}, "type"),
        ({"size": 0}, "size"),
        ({"size": (3, 4, 5)}, "size"),
        ({"size": 2.5}, "size"),
        ({"size": "large"}, "size"),
        ({"texture_box": (0, 1)}, "texture_box"),
        ({"target_box": (0, 1j, 2)}, "target_box"),
        ({"target_box": (0, np.nan + 1j)}, "target_box"),
        ({"filter": "box"}, "filter"),
        ({"kind": "colors"}, "kind"),
        ({"edge": "wrap"}, "edge"),
        ({"encoding": "rec709"}, "encoding"),
        ({"kind": "normal", "texture": np.zeros((2, 2), np.uint8)}, "normal map needs 3"),
        ({"source": [0, 1]}, "source"),
        ({"method": "none"}, "method"),
    ],
)
def test_mistakes_are_input_errors(change, message):
    options = {"texture": np.zeros((2, 2, 3), np.uint8), "source": SQUARE, "target": ELLIPSE} | change
    with pytest.raises(iccm.InputError, match=message):
        iccm.transfer(**options)


@pytest.mark.slow
def test_whole_drawings_are_cut_to_the_painted_target():
    target = shapely.MultiPolygon([shapely.box(0, 0, 2, 3), shapely.box(3, 1, 5, 4)])
    carried = iccm.transfer(iccm.checkerboard(64), shapely.box(0, 0, 5, 4.5), target, size=100)
    assert carried.pixels.shape == (80, 100, 4)
    alpha = carried.pixels[..., 3] / 255
    assert abs(alpha.mean() - target.area / 20) < 0.005
    assert alpha[40, 50] == 0 and alpha[40, 20] == alpha[30, 80] == 1
    np.testing.assert_allclose(iccm.stmap(carried.fit, size=100)[..., 3], alpha, atol=1 / 255)


@pytest.mark.parametrize(
    ("pixels", "options", "message"),
    [
        (np.zeros((4, 6), complex), {}, "complex128"),
        (np.zeros((4, 6), np.uint8), {"filter": "sharp"}, "filter"),
        (np.zeros((4, 6), np.uint8), {"size": 0}, "size"),
        (np.zeros((4, 6), np.uint8), {"texture_box": (2, 1)}, "texture_box"),
    ],
)
def test_a_texture_that_cannot_be_carried_is_refused_before_drawings_are_mapped(
    monkeypatch, pixels, options, message
):
    def solved(*args, **kwargs):
        raise AssertionError("the map was solved for")

    monkeypatch.setattr("iccm.solve.fit", solved)
    two_parts = shapely.MultiPolygon([shapely.box(0, 0, 2, 1), shapely.box(3, 0, 4, 1)])
    with pytest.raises(iccm.InputError, match=message):
        iccm.transfer(pixels, two_parts, shapely.box(0, 0, 1, 3), **options)
