"""Reading and writing pictures: what was stored comes back, and what cannot be read is one line."""

import numpy as np
import OpenImageIO as oiio
import pytest

from iccm.errors import InputError
from iccm.io import images
from iccm.io.images import Image


def noise(shape, dtype, seed=0):
    values = np.random.default_rng(seed).random(shape)
    dtype = np.dtype(dtype)
    return values.astype(dtype) if dtype.kind == "f" else (values * np.iinfo(dtype).max).astype(dtype)


LOSSLESS = [
    (".png", np.uint8, 1, -1, "sRGB"),
    (".png", np.uint16, 4, 3, "sRGB"),
    (".png", np.uint8, 2, 1, "sRGB"),
    (".tif", np.uint8, 4, 3, "sRGB"),
    (".tif", np.uint16, 6, -1, "sRGB"),
    (".tif", np.float32, 3, -1, "lin_rec709"),
    (".exr", np.float16, 3, -1, "lin_rec709"),
    (".exr", np.float32, 6, -1, "lin_rec709"),
    (".webp", np.uint8, 3, -1, "sRGB"),
    (".jxl", np.uint16, 4, 3, "sRGB"),
]


@pytest.mark.parametrize("suffix, dtype, channels, alpha, space", LOSSLESS)
def test_what_is_written_is_read_again(tmp_path, suffix, dtype, channels, alpha, space):
    image = Image(noise((7, 9, channels), dtype), alpha, False, space)
    images.write(tmp_path / f"a{suffix}", image)
    again = images.read(tmp_path / f"a{suffix}")
    assert again.pixels.dtype == dtype
    assert np.array_equal(again.pixels, image.pixels)
    assert (again.alpha, again.associated, again.colorspace) == (alpha, False, space)


def test_dark_transparent_texels_keep_their_colour(tmp_path):
    pixels = np.array([[[200, 100, 50, 0], [200, 100, 50, 1], [9, 8, 7, 255]]], np.uint8)
    for name in ("a.png", "a.tif"):
        images.write(tmp_path / name, Image(pixels, alpha=3))
        assert np.array_equal(images.read(tmp_path / name).pixels, pixels)


def test_exr_associates_alpha_and_says_so(tmp_path):
    straight = Image(np.full((2, 2, 4), 0.5, np.float32), 3, False, "lin_rec709")
    images.write(tmp_path / "a.exr", straight)
    again = images.read(tmp_path / "a.exr")
    assert again.associated
    assert np.allclose(again.pixels, [0.25, 0.25, 0.25, 0.5])


def test_metadata_and_icc_profile_are_carried_over(tmp_path):
    profile = bytes(range(40))
    spec = oiio.ImageSpec(3, 2, 3, "uint8")
    spec.attribute("ImageDescription", "a leaf")
    spec.attribute("ICCProfile", oiio.TypeDesc(f"uint8[{len(profile)}]"), np.frombuffer(profile, np.uint8))
    file = oiio.ImageOutput.create(str(tmp_path / "a.tif"))
    assert file.open(str(tmp_path / "a.tif"), spec)
    assert file.write_image(np.zeros((2, 3, 3), np.uint8))
    file.close()
    images.write(tmp_path / "b.tif", images.read(tmp_path / "a.tif"))
    copy = images.read(tmp_path / "b.tif").metadata
    assert copy["ImageDescription"][1] == "a leaf"
    assert bytes(np.asarray(copy["ICCProfile"][1], np.uint8)) == profile


def test_exif_orientation_is_applied(tmp_path):
    spec = oiio.ImageSpec(3, 2, 1, "uint8")
    spec.attribute("Orientation", 6)
    file = oiio.ImageOutput.create(str(tmp_path / "a.tif"))
    file.open(str(tmp_path / "a.tif"), spec)
    file.write_image(np.arange(6, dtype=np.uint8).reshape(2, 3, 1))
    file.close()
    image = images.read(tmp_path / "a.tif")
    assert np.array_equal(image.pixels[..., 0], [[3, 0], [4, 1], [5, 2]])
    assert "Orientation" not in image.metadata


def test_formats_convert_what_they_cannot_hold(tmp_path):
    linear = Image(np.full((4, 4, 4), 0.2140411, np.float32), 3, False, "lin_rec709")
    images.write(tmp_path / "a.png", linear)
    png = images.read(tmp_path / "a.png")
    assert png.colorspace == "sRGB"
    assert png.pixels.dtype == np.uint16
    assert np.abs(png.pixels[..., :3] / 65535 - 0.5).max() < 1e-4
    images.write(tmp_path / "a.jpg", Image(np.zeros((8, 8, 4), np.uint8), 3))
    assert images.read(tmp_path / "a.jpg").pixels.min() > 250  # transparent: white paper


def test_other_colour_spaces_go_through_opencolorio():
    image = Image(noise((5, 5, 3), np.uint16), colorspace="Gamma 2.2 Encoded Rec.709")
    texture = image.texture((0j, 1 + 1j))
    assert texture.transfer == "linear"
    assert np.allclose(texture.pixels, (image.pixels / 65535) ** 2.2, atol=2e-4)
    again = image.with_pixels(texture.pixels, -1)
    assert np.abs(again.pixels.astype(int) - image.pixels).max() <= 1


def test_blocks_of_rows_make_the_same_file(tmp_path):
    image = Image(noise((50, 20, 4), np.uint8), alpha=3)
    images.write(tmp_path / "a.png", image)
    images.write_bands(
        tmp_path / "b.png", image, 50, 20, (image.pixels[k : k + 16] for k in range(0, 50, 16))
    )
    assert np.array_equal(images.read(tmp_path / "b.png").pixels, images.read(tmp_path / "a.png").pixels)


def test_bad_input_is_one_line(tmp_path):
    (tmp_path / "text.png").write_text("not a picture")
    images.write(tmp_path / "good.png", Image(noise((64, 64, 3), np.uint8)))
    whole = (tmp_path / "good.png").read_bytes()
    (tmp_path / "cut.png").write_bytes(whole[: len(whole) // 3])
    for name in ("missing.png", "text.png", "cut.png"):
        with pytest.raises(InputError) as caught:
            images.read(tmp_path / name)
        assert name in str(caught.value)
        assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="max-pixels"):
        images.read(tmp_path / "good.png", max_pixels=100)
    with pytest.raises(InputError, match="colour space"):
        images.read(tmp_path / "good.png", colorspace="nonsense")
    with pytest.raises(InputError, match="suffix"):
        images.write(tmp_path / "a.xyz", Image(noise((4, 4, 3), np.uint8)))
    with pytest.raises(InputError, match="channels"):
        images.write(tmp_path / "a.jpg", Image(noise((4, 4, 5), np.uint8)))


@pytest.mark.parametrize("suffix", [".png", ".tif", ".exr", ".jpg"])
def test_reading_in_strips_gives_the_same(tmp_path, monkeypatch, suffix):
    images.write(tmp_path / f"a{suffix}", Image(noise((70, 33, 3), np.uint8)))
    whole = images.read(tmp_path / f"a{suffix}").pixels
    monkeypatch.setattr(images, "strip_rows", lambda width, channels: 16)
    assert np.array_equal(images.read(tmp_path / f"a{suffix}").pixels, whole)


def test_the_time_of_day_is_in_no_file(tmp_path):
    images.write(tmp_path / "a.exr", Image(noise((4, 4, 3), np.float16), colorspace="lin_rec709"))
    assert b"capDate" not in (tmp_path / "a.exr").read_bytes()
    stamped = Image(noise((4, 4, 3), np.float16), metadata={"DateTime": ("string", "2001:02:03 04:05:06")})
    images.write(tmp_path / "b.exr", stamped)
    assert b"2001:02:03" in (tmp_path / "b.exr").read_bytes()
