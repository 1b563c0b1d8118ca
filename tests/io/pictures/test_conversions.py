"""What formats do to a picture, as numbers: bit depth, associated alpha, paper, orientation, data windows."""

from base64 import b64decode

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image as Pillow
from PIL import ImageOps, JpegImagePlugin

from iccm.errors import InputError
from iccm.io import formats
from iccm.io.pictures import image_files, png
from iccm.io.pictures.image import prepare
from iccm.io.pictures.image_files import Image
from iccm.pixels.colour import decode, linear_from_srgb, srgb_from_linear
from iccm.pixels.sampler import Sampler


def prepared(image, suffix):
    return prepare(image, formats.picture(f"a{suffix}")).pixels


def test_16_bits_become_the_nearest_of_8_and_white_stays_white():
    levels = np.array([0, 1, 40, 128, 254, 255])
    around = np.concatenate(
        [levels * 257, np.maximum(levels * 257 - 128, 0), np.minimum(levels * 257 + 128, 65535)]
    )
    pixels = around.astype(np.uint16).reshape(3, 6, 1)
    for suffix in (".webp", ".jpg"):
        prepared_texture = prepared(Image(pixels), suffix)
        assert prepared_texture.dtype == np.uint8
        assert np.array_equal(prepared_texture[..., 0], [levels] * 3)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_integers_become_floats_from_0_to_1(dtype):
    top = np.iinfo(dtype).max
    pixels = np.linspace(0, top, 12).astype(dtype).reshape(3, 4, 1)
    numbers = prepared(Image(pixels, colorspace="data"), ".exr")
    assert numbers.ravel()[-1] == 1 and numbers == pytest.approx(pixels / top, abs=5e-4)
    colours = prepared(Image(pixels), ".exr")
    assert colours == pytest.approx(linear_from_srgb(pixels / top), abs=1e-3)


def test_floats_become_16_bits_where_a_format_has_them():
    values = np.linspace(0, 1, 12, dtype=np.float32).reshape(1, 4, 3)
    image = Image(values, colorspace="lin_rec709")
    for suffix, top in ((".png", 65535), (".webp", 255)):
        prepared_texture = prepared(image, suffix)
        assert prepared_texture.dtype == (np.uint16 if top > 255 else np.uint8)
        assert prepared_texture == pytest.approx(np.rint(srgb_from_linear(values) * top), abs=1)


@pytest.mark.parametrize("associated", [False, True])
def test_paper_is_white_and_mixed_in_linear_light(associated):
    straight, alpha = np.array([200, 40, 90]), 102  # 0.4
    stored = np.rint(straight * alpha / 255) if associated else straight
    pixels = np.full((2, 3, 4), [*stored, alpha], np.uint8)
    prepared_texture = prepared(Image(pixels, 3, associated), ".jpg")
    expected = 255 * srgb_from_linear(0.4 * linear_from_srgb(straight / 255) + 0.6)
    assert prepared_texture.shape == (2, 3, 3) and prepared_texture[0, 0] == pytest.approx(expected, abs=1)


def test_association_is_kept_through_other_colour_spaces():
    pixels = np.array([[[6000, 20000, 30000, 32768]]], np.uint16)
    for space in ("sRGB", "lin_rec709", "Gamma 2.2 Encoded Rec.709"):
        texture = Image(pixels, 3, True, space).texture((0j, 1 + 1j))
        assert texture.associated
    alpha = 32768 / 65535
    expected = (pixels[0, 0, :3] / 65535 / alpha) ** 2.2 * alpha
    assert texture.pixels[0, 0] == pytest.approx([*expected, alpha], abs=2e-4)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_every_exif_orientation_is_that_of_viewers(tmp_path, orientation):
    pixels = np.arange(0, 240, 40, dtype=np.uint8).reshape(2, 3)
    exif = Pillow.Exif()
    exif[0x0112] = orientation
    Pillow.fromarray(pixels).save(tmp_path / "a.png", exif=exif)
    with Pillow.open(tmp_path / "a.png") as picture:
        upright = np.asarray(ImageOps.exif_transpose(picture))
    assert np.array_equal(image_files.read(tmp_path / "a.png").pixels[..., 0], upright)
    assert image_files.proportions(tmp_path / "a.png") == upright.shape[1] / upright.shape[0]


@pytest.mark.parametrize(("x", "y"), [(1, 2), (-2, -1), (4, -2)])
def test_a_data_window_is_placed_in_its_display_window(tmp_path, x, y):
    """5 by 4 stored pixels at (x, y) of a picture of 7 by 5; those outside of it are omitted."""
    stored = np.arange(1, 21, dtype=np.float32).reshape(4, 5, 1)
    spec = oiio.ImageSpec(5, 4, 1, "float")
    spec.x, spec.y, spec.full_width, spec.full_height = x, y, 7, 5
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert file.open(str(tmp_path / "a.exr"), spec) and file.write_image(stored)
    file.close()
    expected = np.zeros((5, 7))
    for i in range(4):
        for j in range(5):
            if 0 <= i + y < 5 and 0 <= j + x < 7:
                expected[i + y, j + x] = stored[i, j, 0]
    assert np.array_equal(image_files.read(tmp_path / "a.exr").pixels[..., 0], expected)


def test_numbers_of_floats_without_a_colour_space_are_linear(tmp_path):
    spec = oiio.ImageSpec(2, 1, 3, "float")
    file = oiio.ImageOutput.create(str(tmp_path / "a.tif"))
    assert file.open(str(tmp_path / "a.tif"), spec) and file.write_image(np.zeros((1, 2, 3), np.float32))
    file.close()
    assert image_files.read(tmp_path / "a.tif").colorspace == "lin_rec709"


def test_jpeg_keeps_colours_at_full_resolution(tmp_path):
    image_files.write(tmp_path / "a.jpg", Image(np.zeros((16, 16, 3), np.uint8)))
    with Pillow.open(tmp_path / "a.jpg") as picture:
        assert JpegImagePlugin.get_sampling(picture) == 0  # 4:4:4


def test_clipping_of_negative_colours_gets_a_note():
    pixels = np.full((2, 5, 1), 0.5, np.float32)
    pixels[0, 0] = -0.25
    clipped, depth = image_files.losses("a.png", Image(pixels, colorspace="lin_rec709"))
    assert "10.0%" in clipped and "16 bits" in depth
    assert image_files.losses("a.exr", Image(pixels)) == []


def test_precision_that_hdr_does_not_store_gets_a_note():
    exact = np.array([[[1, 0.5, 3 / 128], [0, 0, 0], [96, 1, 0.5]]], np.float32)
    assert image_files.losses("a.hdr", Image(exact)) == []
    (note,) = image_files.losses("a.hdr", Image(exact + np.float32(1 / 512)))
    assert "8 bits" in note and "32" in note


def test_other_programs_read_straight_alpha(tmp_path):
    pixels = np.array([[[200, 100, 50, 64], [1, 2, 3, 255]]], np.uint8)
    for name in ("a.png", "a.tif"):
        image_files.write(tmp_path / name, Image(pixels, alpha=3))
        with Pillow.open(tmp_path / name) as picture:
            assert picture.mode == "RGBA" and np.array_equal(np.asarray(picture), pixels)


def png_with(path, name, content):
    """A PNG of one colour with an additional chunk."""
    Pillow.fromarray(np.full((4, 6, 3), (128, 64, 200), np.uint8)).save(path)
    raw = path.read_bytes()
    path.write_bytes(raw[:33] + png.chunk(name, content) + raw[33:])
    return path


SAID = {
    "linear gAMA": (b"gAMA", (100000).to_bytes(4), [128 / 255, 64 / 255, 200 / 255]),
    "gAMA of 1/1.8": (b"gAMA", (55556).to_bytes(4), [(v / 255) ** 1.8 for v in (128, 64, 200)]),
    "linear cICP": (b"cICP", bytes([1, 8, 0, 1]), [128 / 255, 64 / 255, 200 / 255]),
    # Display P3 to Rec. 709 in linear light, by the matrix of their primaries
    "cICP of Display P3": (b"cICP", bytes([12, 13, 0, 1]), [0.2529, 0.0443, 0.6260]),
}


@pytest.mark.parametrize("kind", SAID)
def test_colour_chunks_of_a_png_are_respected(tmp_path, kind):
    """In linear light, and in every output format, with or without a name for the colour space."""
    name, content, light = SAID[kind]
    image = image_files.read(png_with(tmp_path / "a.png", name, content))

    def light_of(picture):
        texture = picture.texture((0j, 1 + 1j))
        return decode(
            texture.pixels, -1, srgb=texture.transfer == "srgb", associated=False, premultiply=False
        )[0, 0]

    assert light_of(image) == pytest.approx(light, abs=2e-3)
    for suffix, off in ((".png", 2e-3), (".tif", 2e-3), (".exr", 2e-3), (".webp", 8e-3)):
        image_files.write(tmp_path / f"b{suffix}", image)
        assert light_of(image_files.read(tmp_path / f"b{suffix}")) == pytest.approx(light, abs=off), suffix


def test_negative_light_is_kept(tmp_path):
    values = np.full((4, 6, 3), (-0.5, 0.25, 2.0), np.float32)
    image_files.write(tmp_path / "a.exr", Image(values, colorspace="lin_rec709"))
    image = image_files.read(tmp_path / "a.exr")
    sampler = Sampler(image.texture((0j, 6 + 4j)))
    z, step = np.array([3.3 + 1.7j]), np.array([1.5 + 0j])
    stored = sampler.stored(sampler.values(sampler.texture.places(z, step, -1j * step)))
    assert stored[0] == pytest.approx([-0.5, 0.25, 2.0], abs=1e-3)


@pytest.mark.parametrize("suffix", [".gif", ".jp2", ".ppm", ".dds", ".tga", ".avif"])
def test_formats_that_are_only_read(tmp_path, suffix, iccm):
    path = tmp_path / f"a{suffix}"
    pixels = np.full((32, 48, 3), (128, 64, 200), np.uint8)
    pixels[:, :24] = 20, 200, 90
    Pillow.fromarray(pixels).save(path)
    image = image_files.read(path)
    assert image.pixels.shape[:2] == (32, 48)
    assert image.pixels[16, 40, :3].astype(int) == pytest.approx((128, 64, 200), abs=4)
    if suffix != ".tga":
        result = iccm("map", str(path), str(path), "-o", str(tmp_path / f"b{suffix}"))
        assert result.code == 2 and ".png" in result.err and not (tmp_path / f"b{suffix}").exists()


HEIC = b64decode(
    "AAAAHGZ0eXBoZWljAAAAAG1pZjFoZWljbWlhZgAAAX1tZXRhAAAAAAAAACFoZGxyAAAAAAAAAABwaWN0AAAAAAAAAAAAAAAA"
    "AAAAACJpbG9jAAAAAERAAAEAAQAAAAABoQABAAAAAAAAAKAAAAAjaWluZgAAAAAAAQAAABVpbmZlAgAAAAABAABodmMxAAAA"
    "AA5waXRtAAAAAAABAAAA/WlwcnAAAADdaXBjbwAAAHZodmNDAQNwAAAAkAAAAAAAHvAA/P34+AAADwNgAAEAGEABDAH//wNw"
    "AAADAJAAAAMAAAMAHroCQGEAAQAqQgEBA3AAAAMAkAAAAwAAAwAeoCCBBZbq5Ka5uAhoMCAAAAMDIAAAAwAhYgABAAZEAcFz"
    "wIkAAAATY29scm5jbHgAAQANAAaAAAAAFGlzcGUAAAAAAAAAQAAAAEAAAAAoY2xhcAAAADAAAAABAAAAIAAAAAH////wAAAA"
    "Av///+AAAAACAAAAEHBpeGkAAAAAAwgICAAAABhpcG1hAAAAAAAAAAEAAQWBAgMFhAAAAKhtZGF0AAAAnCgBrwY44+e969eS"
    "T///Pcf//0TKgh8Ek386j777+SLf8GgijhLKdkKZeYUOUCZ6Cq8yvHORYGruOIZAkT5eZgZkrh1EsOCH6mFME3vP8PHQlvDw"
    "3ZE+FWApW5yZtid3aq7/1xWHSonAe3nKzk5rsliNOQlyMltUpq8YhfJ79CcnzecO6TjRjm5S+yVZ3+ldSklc2LxOOj/rHjvl"
    "WA=="
)
"""48 by 32 pixels, with the left half (20, 200, 90) and the right half (128, 64, 200)."""


def test_heic_is_read_with_its_extra(tmp_path, iccm):
    pytest.importorskip("pi_heif", reason="the extra heic is not installed")
    path = tmp_path / "a.heic"
    path.write_bytes(HEIC)
    image = image_files.read(path)
    assert image.pixels.shape == (32, 48, 3) and image.pixels.dtype == np.uint8
    assert image.pixels[16, 6].astype(int) == pytest.approx((20, 200, 90), abs=6)
    assert image.pixels[16, 40].astype(int) == pytest.approx((128, 64, 200), abs=6)
    with pytest.raises(InputError, match=r"exceeds the limit of 100 pixels"):
        image_files.read(path, max_pixels=100)
    path.write_bytes(HEIC[:500])
    with pytest.raises(InputError, match=r"a\.heic: cannot read this picture"):
        image_files.read(path)
