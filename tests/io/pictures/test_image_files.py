"""Reading and writing pictures: stored values are preserved, and unreadable files are reported in one line."""

import struct
import sys
import tempfile
import warnings
import zlib
from dataclasses import replace

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image as Pillow

from iccm.errors import InputError
from iccm.io.pictures import image_files
from iccm.io.pictures.image import TRANSFERS, USUAL
from iccm.io.pictures.image_files import Image
from iccm.io.run.execute import run
from iccm.io.run.job import Job
from tests.cases import some_fast

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 40"><circle cx="20" cy="20" r="{}"/></svg>'


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
def test_written_pictures_are_read_back(tmp_path, suffix, dtype, channels, alpha, space):
    image = Image(noise((7, 9, channels), dtype), alpha, False, space)
    image_files.write(tmp_path / f"a{suffix}", image)
    again = image_files.read(tmp_path / f"a{suffix}")
    assert again.pixels.dtype == dtype
    assert np.array_equal(again.pixels, image.pixels)
    assert (again.alpha, again.associated, again.colorspace) == (alpha, False, space)


def test_dark_transparent_texels_keep_their_colour(tmp_path):
    pixels = np.array([[[200, 100, 50, 0], [200, 100, 50, 1], [9, 8, 7, 255]]], np.uint8)
    for name in ("a.png", "a.tif"):
        image_files.write(tmp_path / name, Image(pixels, alpha=3))
        assert np.array_equal(image_files.read(tmp_path / name).pixels, pixels)


def test_exr_associates_alpha_with_a_note(tmp_path):
    straight = Image(np.full((2, 2, 4), 0.5, np.float32), 3, False, "lin_rec709")
    image_files.write(tmp_path / "a.exr", straight)
    again = image_files.read(tmp_path / "a.exr")
    assert again.associated
    assert np.allclose(again.pixels, [0.25, 0.25, 0.25, 0.5])


def with_profile(path, colours):
    """Write a picture with an ICC profile that consists of a header only, which gives the colour model."""
    header = bytearray(128)
    header[:4], header[16:20], header[36:40] = (132).to_bytes(4), colours, b"acsp"
    profile = bytes(header) + bytes(4)
    spec = oiio.ImageSpec(3, 2, 3, "uint8")
    spec.attribute("ImageDescription", "a leaf")
    spec.attribute("ICCProfile", oiio.TypeDesc(f"uint8[{len(profile)}]"), np.frombuffer(profile, np.uint8))
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec)
    assert file.write_image(np.zeros((2, 3, 3), np.uint8))
    file.close()
    return profile


def test_metadata_and_icc_profile_are_carried_over(tmp_path):
    profile = with_profile(tmp_path / "a.tif", b"RGB ")
    image_files.write(tmp_path / "b.tif", image_files.read(tmp_path / "a.tif"))
    copy = image_files.read(tmp_path / "b.tif").metadata
    assert copy["ImageDescription"][1] == "a leaf"
    assert bytes(np.asarray(copy["ICCProfile"][1], np.uint8)) == profile
    assert not [name for name in copy if name.startswith("ICCProfile:")]


def test_a_description_that_states_another_size_is_not_carried_over(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    tifffile.imwrite(tmp_path / "a.tif", np.zeros((4, 5, 3), np.uint8), metadata={"axes": "YXS"})
    assert tifffile.TiffFile(tmp_path / "a.tif").shaped_metadata[0]["shape"] == [4, 5, 3]
    source = image_files.read(tmp_path / "a.tif")
    image_files.write(tmp_path / "b.tif", replace(source, pixels=np.zeros((7, 2, 3), np.uint8)))
    with tifffile.TiffFile(tmp_path / "b.tif") as file:
        assert not file.is_shaped and file.pages[0].shape == (7, 2, 3)


@pytest.mark.parametrize("colours, suffix", [(b"CMYK", ".png"), (b"CMYK", ".tif"), (b"RGB ", ".exr")])
def test_the_icc_profile_of_other_pixels_is_not_carried_over(tmp_path, capfd, colours, suffix):
    """For a CMYK file, whose pixels are read as RGB, and for a colour space that the output does not have any more."""
    with_profile(tmp_path / "a.tif", colours)
    image_files.write(tmp_path / f"b{suffix}", image_files.read(tmp_path / "a.tif"))
    copy = image_files.read(tmp_path / f"b{suffix}").metadata
    assert copy["ImageDescription"][1] == "a leaf"
    assert "ICCProfile" not in copy
    assert capfd.readouterr().err == ""


def cmyk_profile(lab):
    """An ICC profile (ICC.1:2001-04) of a printer: (2, 2, 2, 2, 3) L*, a*, b* for each combination of inks."""
    whole = bytes(range(256))
    table = np.rint(lab * [2.55, 1, 1] + [0, 128, 128]).astype(np.uint8).tobytes()
    unit = struct.pack(">9i", *np.eye(3, dtype=int).ravel() << 16)
    lut = b"mft1" + bytes(4) + bytes([4, 3, 2, 0]) + unit + 4 * whole + table + 3 * whole
    white = b"XYZ " + bytes(4) + struct.pack(">3i", 63190, 65536, 54061)
    tags = struct.pack(">I4sII4sII", 2, b"A2B0", 156, len(lut), b"wtpt", 156 + len(lut), len(white))
    head = struct.pack(">II", 156 + len(lut + white), 0)
    head += bytes([2, 16, 0, 0]) + b"prtrCMYKLab " + struct.pack(">6H", 2026, 1, 1, 0, 0, 0) + b"acsp"
    head += bytes(28) + struct.pack(">3i", 63190, 65536, 54061)
    return head.ljust(128, b"\0") + tags + lut + white


def srgb_of_lab(lab):
    """sRGB bytes of L*a*b* under D50: the CIE definition, and the sRGB matrix adapted by Bradford."""
    f = (lab[..., :1] + 16) / 116 + lab * [0, 1 / 500, -1 / 200]
    f = np.stack([f[..., 1], f[..., 0], f[..., 2]], axis=-1)
    xyz = np.where(f > 6 / 29, f**3, (f - 4 / 29) * 3 * (6 / 29) ** 2) * [0.9642, 1, 0.8249]
    matrix = [[3.13386, -1.61687, -0.49061], [-0.97877, 1.91614, 0.03345], [0.07195, -0.22899, 1.40524]]
    light = np.clip(xyz @ np.transpose(matrix), 0, 1)
    return 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize("suffix", [".tif", ".jpg"])
def test_cmyk_is_converted_by_its_profile(tmp_path, suffix):
    rng = np.random.default_rng(1)
    lab = rng.uniform([30, -20, -20], [90, 20, 20], (2, 2, 2, 2, 3)).round()
    lab[0, 0, 0, 0], lab[1, 1, 1, 1] = (100, 0, 0), (0, 0, 0)
    inks = np.indices((2, 2, 2, 2)).reshape(4, 16).T.astype(np.uint8) * 255
    blocks = np.repeat(np.repeat(inks.reshape(4, 4, 4), 16, axis=0), 16, axis=1)
    name = tmp_path / f"a{suffix}"
    options = {"quality": 100, "subsampling": 0} if suffix == ".jpg" else {}
    Pillow.fromarray(blocks, "CMYK").save(name, icc_profile=cmyk_profile(lab), **options)
    image = image_files.read(name)
    assert (image.pixels.shape, image.colorspace, image.alpha) == ((64, 64, 3), "sRGB", -1)
    assert np.abs(image.pixels[8::16, 8::16].reshape(16, 3) - srgb_of_lab(lab.reshape(16, 3))).max() < 3
    image_files.write(tmp_path / "b.tif", image)
    assert "ICCProfile" not in image_files.read(tmp_path / "b.tif").metadata


def test_a_broken_profile_of_cmyk_is_one_line(tmp_path):
    profile = cmyk_profile(np.zeros((2, 2, 2, 2, 3)))
    Pillow.new("CMYK", (8, 8)).save(tmp_path / "a.tif", icc_profile=profile[:128] + bytes(len(profile) - 128))
    with pytest.raises(InputError, match="with its ICC profile"):
        image_files.read(tmp_path / "a.tif")


def test_lab_is_converted(tmp_path):
    """As in TIFF: L* from 0 to 255, a* and b* signed."""
    lab = np.random.default_rng(2).uniform([30, -20, -20], [90, 20, 20], (9, 7, 3)).round()
    stored = np.rint(lab * [2.55, 1, 1]).astype(int)
    Pillow.fromarray((stored & 255).astype(np.uint8), "LAB").save(tmp_path / "a.tif")
    expected = srgb_of_lab(stored / [2.55, 1, 1])
    assert np.abs(image_files.read(tmp_path / "a.tif").pixels - expected).max() < 3


def test_the_first_picture_of_an_animated_png_is_used_with_a_note(tmp_path):
    frames = [Pillow.new("RGB", (8, 8), colour) for colour in ("red", "blue")]
    frames[0].save(tmp_path / "a.png", save_all=True, append_images=frames[1:])
    frames[0].save(tmp_path / "b.png")
    image = image_files.read(tmp_path / "a.png")
    assert [note.partition(": ")[2] for note in image.notes] == [
        "contains several pictures; the first one is used"
    ]
    assert tuple(image.pixels[0, 0]) == (255, 0, 0)
    assert not image_files.read(tmp_path / "b.png").notes


@pytest.mark.parametrize(
    "brand, message",
    [
        (b"avif", r"cannot read this picture \(AVIF\)"),
        (b"heic", r"reading HEIC needs the package pi-heif: pip install 'iccm\[heic\]'"),
    ],
)
def test_forms_that_are_not_read_are_named(tmp_path, brand, message, monkeypatch):
    monkeypatch.setitem(sys.modules, "pi_heif", None)  # as if the extra were not installed
    (tmp_path / "a.avif").write_bytes(b"\0\0\0\x1cftyp" + brand + bytes(40))
    with pytest.raises(InputError, match=message):
        image_files.read(tmp_path / "a.avif")


@pytest.mark.parametrize(
    "content",
    [b"", b"xx", b"BM" + bytes(90), b"\x89PNG\r\n\x1a\n", b"\0\0\0\x1cftypavif" + bytes(40)],
)
def test_an_unreadable_embedded_picture_is_reported_once(content):
    """And without the name of the temporary file from which libraries read it."""
    with pytest.raises(InputError, match=r"^embedded: ") as caught:
        image_files.read_held(content, "embedded")
    message = str(caught.value)
    assert message.count("cannot read") == 1
    assert tempfile.gettempdir() not in message and "a.jpg" not in message


def test_ktx2_is_refused_by_name():
    """With the cure, instead of a complaint about the JPEG that it is not."""
    with pytest.raises(InputError, match=r"^a\.glb: baseColorTexture: KTX2 .*PNG"):
        image_files.read_held(b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80), "a.glb: baseColorTexture")


def test_alpha_alone_is_a_grey_picture(tmp_path):
    spec = oiio.ImageSpec(3, 2, 1, "float")
    spec.channelnames, spec.alpha_channel = ("A",), 0
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert file.open(str(tmp_path / "a.exr"), spec)
    assert file.write_image(np.full((2, 3, 1), 0.5, np.float32))
    file.close()
    image = image_files.read(tmp_path / "a.exr")
    assert (image.alpha, image.associated) == (-1, False)
    covered = Image(np.full((2, 3, 2), 0.5, np.float32), 1, True, "lin_rec709", image.metadata)
    image_files.write(tmp_path / "b.exr", covered)
    again = image_files.read(tmp_path / "b.exr")
    assert (again.alpha, again.metadata["channels"]) == (1, ("Y", "A"))


def test_a_display_window_counts_as_the_pictures_size(tmp_path):
    spec = oiio.ImageSpec(3, 2, 1, "half")
    spec.full_width = spec.full_height = 100_000
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert file.open(str(tmp_path / "a.exr"), spec)
    assert file.write_image(np.zeros((2, 3, 1), np.float16))
    file.close()
    with pytest.raises(InputError, match="100000x100000 exceeds"):
        image_files.read(tmp_path / "a.exr")


def test_exif_orientation_is_applied(tmp_path):
    spec = oiio.ImageSpec(3, 2, 1, "uint8")
    spec.attribute("Orientation", 6)
    file = oiio.ImageOutput.create(str(tmp_path / "a.tif"))
    file.open(str(tmp_path / "a.tif"), spec)
    file.write_image(np.arange(6, dtype=np.uint8).reshape(2, 3, 1))
    file.close()
    image = image_files.read(tmp_path / "a.tif")
    assert np.array_equal(image.pixels[..., 0], [[3, 0], [4, 1], [5, 2]])
    assert "Orientation" not in image.metadata


def test_formats_convert_unsupported_pixels(tmp_path):
    linear = Image(np.full((4, 4, 4), 0.2140411, np.float32), 3, False, "lin_rec709")
    image_files.write(tmp_path / "a.png", linear)
    png = image_files.read(tmp_path / "a.png")
    assert png.colorspace == "sRGB"
    assert png.pixels.dtype == np.uint16
    assert np.abs(png.pixels[..., :3] / 65535 - 0.5).max() < 1e-4
    image_files.write(tmp_path / "a.jpg", Image(np.zeros((8, 8, 4), np.uint8), 3))
    assert image_files.read(tmp_path / "a.jpg").pixels.min() > 250  # transparent: white paper


@pytest.mark.parametrize("name", USUAL)
def test_usual_colour_spaces_agree_with_opencolorio(name):
    config = oiio.ColorConfig()
    assert config.resolve(name) in config.getColorSpaceNames()
    assert config.equivalent(name, USUAL[name])
    assert [space for space in TRANSFERS if config.equivalent(name, space)] == [USUAL[name]]


def test_other_colour_spaces_go_through_opencolorio():
    image = Image(noise((5, 5, 3), np.uint16), colorspace="Gamma 2.2 Encoded Rec.709")
    texture = image.texture((0j, 1 + 1j))
    assert texture.transfer == "linear"
    assert np.allclose(texture.pixels, (image.pixels / 65535) ** 2.2, atol=2e-4)
    again = image.with_pixels(texture.pixels, -1)
    assert np.abs(again.pixels.astype(int) - image.pixels).max() <= 1


def test_blocks_of_rows_make_the_same_file(tmp_path):
    image = Image(noise((50, 20, 4), np.uint8), alpha=3)
    image_files.write(tmp_path / "a.png", image)
    image_files.write_bands(
        tmp_path / "b.png", image, 50, 20, (image.pixels[k : k + 16] for k in range(0, 50, 16))
    )
    assert np.array_equal(
        image_files.read(tmp_path / "b.png").pixels, image_files.read(tmp_path / "a.png").pixels
    )


def test_bad_input_is_one_line(tmp_path):
    (tmp_path / "text.png").write_text("not a picture")
    image_files.write(tmp_path / "good.png", Image(noise((64, 64, 3), np.uint8)))
    whole = (tmp_path / "good.png").read_bytes()
    (tmp_path / "cut.png").write_bytes(whole[: len(whole) // 3])
    for name in ("missing.png", "text.png", "cut.png"):
        with pytest.raises(InputError) as caught:
            image_files.read(tmp_path / name)
        assert name in str(caught.value)
        assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="max-pixels"):
        image_files.read(tmp_path / "good.png", max_pixels=100)
    with pytest.raises(InputError, match="colour space"):
        image_files.read(tmp_path / "good.png", colorspace="nonsense")
    with pytest.raises(InputError, match=r"a\.xyz: .*'\.xyz'.*\.png"):
        image_files.write(tmp_path / "a.xyz", Image(noise((4, 4, 3), np.uint8)))
    with pytest.raises(InputError, match="channels"):
        image_files.write(tmp_path / "a.jpg", Image(noise((4, 4, 5), np.uint8)))


@pytest.mark.parametrize("suffix", [".png", ".tif", ".exr", ".jpg"])
def test_reading_in_strips_gives_the_same(tmp_path, monkeypatch, suffix):
    image_files.write(tmp_path / f"a{suffix}", Image(noise((70, 33, 3), np.uint8)))
    whole = image_files.read(tmp_path / f"a{suffix}").pixels
    monkeypatch.setattr(image_files, "strip_rows", lambda width, channels: 16)
    assert np.array_equal(image_files.read(tmp_path / f"a{suffix}").pixels, whole)


def test_the_time_of_day_is_in_no_file(tmp_path):
    image_files.write(tmp_path / "a.exr", Image(noise((4, 4, 3), np.float16), colorspace="lin_rec709"))
    assert b"capDate" not in (tmp_path / "a.exr").read_bytes()
    stamped = Image(noise((4, 4, 3), np.float16), metadata={"DateTime": ("string", "2001:02:03 04:05:06")})
    image_files.write(tmp_path / "b.exr", stamped)
    assert b"2001:02:03" in (tmp_path / "b.exr").read_bytes()


def save(path, pixels):
    """Write a file like another program."""
    kind = {"uint32": "uint", "float32": "float", "float16": "half"}.get(str(pixels.dtype), str(pixels.dtype))
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec), file.geterror()
    assert file.write_image(pixels)
    file.close()


def test_a_gif_is_read(tmp_path):
    from PIL import Image as Pillow

    index = np.zeros((6, 8), np.uint8)
    index[:, 4:] = 1
    picture = Pillow.fromarray(index, "P")
    picture.putpalette([0, 0, 0, 255, 0, 0])
    picture.save(tmp_path / "a.gif", transparency=0)
    image = image_files.read(tmp_path / "a.gif")
    assert image.alpha == 3
    assert np.array_equal(image.pixels, np.array([[0, 0, 0, 0], [255, 0, 0, 255]], np.uint8)[index])


def test_parts_omitted_from_a_file_get_a_note(tmp_path):
    spec = oiio.ImageSpec(3, 2, 1, "uint8")
    file = oiio.ImageOutput.create(str(tmp_path / "a.tif"))
    assert file.open(str(tmp_path / "a.tif"), (spec, spec))
    for page in range(2):
        assert page == 0 or file.open(str(tmp_path / "a.tif"), spec, "AppendSubimage")
        assert file.write_image(np.full((2, 3, 1), 50 * page, np.uint8))
    file.close()
    several = image_files.read(tmp_path / "a.tif")
    assert several.pixels.max() == 0
    assert several.notes == (f"{tmp_path / 'a.tif'}: contains several pictures; the first one is used",)
    save(tmp_path / "b.tif", np.array([[[0], [1 << 31]]], np.uint32))
    (note,) = image_files.read(tmp_path / "b.tif").notes
    assert "32-bit integers" in note
    save(tmp_path / "c.png", np.zeros((2, 2, 3), np.uint8))
    assert image_files.read(tmp_path / "c.png").notes == ()


def test_texels_that_are_not_finite_are_counted(tmp_path, monkeypatch):
    pixels = np.ones((20, 5, 3), np.float32)
    pixels[3, 2] = np.nan
    pixels[17, 4, 1] = np.inf
    save(tmp_path / "a.exr", pixels)
    monkeypatch.setattr(image_files, "strip_rows", lambda width, channels: 8)
    image = image_files.read(tmp_path / "a.exr")
    assert image.holes == 2
    (note,) = image.notes
    assert "a.exr: 2 texels are not finite" in note


def test_a_deep_picture_is_refused(tmp_path):
    spec = oiio.ImageSpec(2, 1, 2, "float")
    spec.channelnames, spec.deep = ("A", "Z"), True
    samples = oiio.DeepData()
    samples.init(2, 2, [oiio.TypeFloat] * 2, spec.channelnames)
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert file.open(str(tmp_path / "a.exr"), spec)
    assert file.write_deep_image(samples)
    file.close()
    with pytest.raises(InputError, match="deep picture"):
        image_files.read(tmp_path / "a.exr")


@pytest.mark.parametrize("broken", ["cut", "changed", "no chunk"])
def test_libraries_print_nothing_about_a_broken_png(tmp_path, capfd, broken):
    save(tmp_path / "a.png", noise((64, 64, 3), np.uint8))
    content = bytearray((tmp_path / "a.png").read_bytes())
    if broken == "changed":
        content[len(content) // 2] ^= 0x55
    (tmp_path / "a.png").write_bytes(content[: {"cut": -3000, "no chunk": 8}.get(broken)])
    with pytest.raises(InputError, match=r"a\.png: the picture is damaged: .*(truncated|checksum of IDAT)"):
        image_files.read(tmp_path / "a.png")
    assert capfd.readouterr().err == ""


def test_a_png_whose_comment_is_broken_is_read(tmp_path):
    save(tmp_path / "a.png", np.full((4, 4, 3), 77, np.uint8))
    content = (tmp_path / "a.png").read_bytes()
    comment = b"tEXt" + b"Title\0a leaf"
    chunk = (len(comment) - 4).to_bytes(4) + comment + (zlib.crc32(comment) ^ 1).to_bytes(4)
    (tmp_path / "a.png").write_bytes(content[:33] + chunk + content[33:])
    assert (image_files.read(tmp_path / "a.png").pixels == 77).all()


def test_nan_is_black_in_integers(tmp_path):
    pixels = np.array([[[np.nan], [np.inf], [-np.inf], [0.5]]], np.float32)
    with warnings.catch_warnings(action="error"):
        image_files.write(tmp_path / "a.png", Image(pixels, colorspace="data"))
    assert image_files.read(tmp_path / "a.png").pixels.ravel().tolist() == [0, 65535, 0, 32768]


def test_a_format_without_colour_space_gets_srgb(tmp_path):
    dark = Image(np.full((8, 8, 3), 55, np.uint8), colorspace="lin_rec709")
    for name, expected in (("a.png", 55), ("a.webp", 128), ("a.jpg", 128)):
        image_files.write(tmp_path / name, dark)
        assert np.abs(image_files.read(tmp_path / name).pixels.astype(int) - expected).max() <= 1
    image_files.write(tmp_path / "b.webp", Image(dark.pixels, colorspace="data"))
    assert (image_files.read(tmp_path / "b.webp").pixels == 55).all()


CHANNELS = [
    (".png", 4, -1), (".png", 2, -1), (".png", 3, 2), (".webp", 5, 4), (".bmp", 4, -1), (".jpg", 2, -1),
    (".hdr", 4, -1), (".tif", 2, -1), (".tif", 3, 2),
]  # fmt: skip


@pytest.mark.parametrize("suffix, channels, alpha", CHANNELS)
def test_channels_that_would_become_others_are_refused(tmp_path, suffix, channels, alpha):
    image = Image(noise((4, 4, channels), np.uint8), alpha)
    for refuse in (
        lambda path: image_files.write(path, image),
        lambda path: image_files.check(path, image, 4, 4),
    ):
        with pytest.raises(InputError, match=rf"a{suffix}: {suffix} can store 1.* channels.*; use .exr"):
            refuse(tmp_path / f"a{suffix}")
    image_files.check(tmp_path / "a.exr", image, 4, 4)
    assert not list(tmp_path.glob("*.exr"))


def test_a_picture_too_large_for_its_format_is_refused_by_a_trial(tmp_path):
    like = Image(np.zeros((1, 1, 3), np.uint8))
    image_files.check(tmp_path / "a.webp", like, 16383, 5)
    with pytest.raises(InputError, match=r"a\.webp: .* 16383x16383, you asked for 5x16384"):
        image_files.check(tmp_path / "a.webp", like, 16384, 5)


@pytest.fixture
def circles(tmp_path, monkeypatch):
    """Two drawings and textures in the current folder."""
    monkeypatch.chdir(tmp_path)
    for name, radius in (("a", 15), ("b", 18)):
        (tmp_path / f"{name}.svg").write_text(SVG.format(radius))
    image_files.write("five.tif", Image(noise((9, 9, 5), np.uint8)))
    image_files.write("straight.png", Image(noise((9, 9, 4), np.uint8), 3))
    image_files.write("associated.exr", Image(noise((9, 9, 4), np.float32), 3, True, "lin_rec709"))
    image_files.write(
        "holes.exr", Image(np.full((3000, 3000, 1), np.nan, np.float16), colorspace="lin_rec709")
    )
    image_files.write("grey.png", Image(noise((9, 9, 1), np.uint8)))
    return Job(source="a.svg", target="b.svg", output=("o.png",), size=(64,))


REFUSED = {
    "channels": ({"texture": "five.tif"}, "1 or 3 channels"),
    "stdout": ({"texture": "five.tif", "output": ("-",)}, "1 or 3 channels"),
    "side": ({"output": ("o.webp",), "size": (20000, 4)}, "may not exceed 16383"),
    "normals": ({"texture": "grey.png", "kind": "normal"}, "grey.png has 1 channel; a normal map needs 3"),
    "pixels": ({"output": (), "stmap": "o.exr", "size": (40000,)}, "--max-pixels"),
    "memory": ({"memory": 1 << 20}, "too little for the texture"),
    "memory for holes": ({"texture": "holes.exr", "memory": 1 << 29}, "not finite"),
    "stmap's memory": ({"output": (), "stmap": "o.exr", "memory": 1 << 20}, "too little for rows of 64"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_unwritable_pictures_are_refused_before_the_solving(circles, monkeypatch, case):
    change, message = REFUSED[case]
    monkeypatch.setattr("iccm.io.run.execute.solve_pairs", lambda state: pytest.fail("solved"))
    monkeypatch.setattr("iccm.io.memory.resident", lambda: 100 << 20)  # whatever ran before in this process
    with pytest.raises(InputError, match=message):
        run(circles.model_copy(update=change))


def test_padding_of_associated_alpha_divides_it_out(circles):
    """Colours beyond the outline, and those under alpha, are straight, and neither brighter nor darker."""
    pixels = np.full((9, 9, 4), 0.5, np.float32) * [0.8, 0.6, 0.4, 1]
    image_files.write("half.exr", Image(pixels.astype(np.float32), 3, True, "lin_rec709"))
    run(circles.model_copy(update={"texture": "half.exr", "padding": -1, "output": ("o.tif",)}))
    image = image_files.read("o.tif")
    assert not image.associated
    assert image.pixels[..., 3].min() == 0
    assert image.pixels[..., 3].max() == pytest.approx(0.5)
    assert np.abs(image.pixels[..., :3] - [0.8, 0.6, 0.4]).max() < 1e-5


@pytest.mark.parametrize("suffix", [".png", ".tif", ".exr", ".webp", ".bmp"])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("associated", [False, True])
def test_colours_over_alpha_mean_the_same_in_every_format(tmp_path, suffix, dtype, associated):
    from iccm.pixels import colour

    def light(image):
        srgb = image.colorspace == "sRGB"
        return colour.decode(image.pixels, 3, srgb=srgb, associated=image.associated, premultiply=True)

    values = np.array(
        [[[0.7, 0.3, 0.1, 1], [0.7, 0.3, 0.1, 0.5], [0, 0.1, 0.9, 0.2], [0, 0, 0, 0]]], np.float32
    )
    values[..., :3] *= values[..., 3:] if associated else 1
    pixels = values if dtype == np.float32 else np.rint(values * 255).astype(dtype)
    image = Image(pixels, 3, associated, "sRGB" if dtype == np.uint8 else "lin_rec709")
    image_files.write(tmp_path / f"a{suffix}", image)
    again = image_files.read(tmp_path / f"a{suffix}")
    assert np.abs(light(again) - light(image)).max() < 0.01


@pytest.mark.parametrize(
    "change, warned",
    [
        ({"output": ("o.tif",)}, 1),
        ({"output": ("o.tif",), "colorspace": "ACEScg"}, 0),
        ({"output": ("o.png",)}, 0),
    ],
)
def test_a_format_without_colour_space_gets_a_note(circles, change, warned):
    image_files.write("linear.png", Image(noise((9, 9, 3), np.uint8), colorspace="lin_rec709"))
    notes = run(circles.model_copy(update={"texture": "linear.png", **change})).notes
    assert sum("colour space lin_rec709" in note for note in notes) == warned


@pytest.mark.parametrize(
    "name, top, warned",
    some_fast(
        [("o.png", 9.5, 1), ("o.webp", -1, 1), ("o.png", 1, 0), ("o.exr", 9.5, 0), ("o.tif", 9.5, 0)],
        {("o.png", 9.5, 1), ("o.tif", 9.5, 0)},
    ),
)
def test_a_format_that_clips_gets_a_note(circles, iccm, name, top, warned):
    image_files.write("bright.exr", Image(np.full((8, 8, 3), top, np.float32), colorspace="lin_rec709"))
    job = circles.model_copy(update={"texture": "bright.exr", "output": (name,)})
    assert sum("stores values from 0 to 1; 100.0% of the texels" in note for note in run(job).notes) == warned
    assert iccm("map", "a.svg", "b.svg", "--stmap", "map.exr", "--size", "9", "-q").code == 0
    applied = iccm("apply", "map.exr", "bright.exr", "-o", f"again-{name}")
    notes = [line for line in applied.lines if f"again-{name}: " in line and "clipped" in line]
    assert applied.code == 0 and len(notes) == warned
    assert all("0 to 1" in note and "100.0%" in note and ".exr" in note for note in notes)


LOSING = [
    ({}, 0),
    ({"kind": "data"}, 1),
    ({"filter": "nearest"}, 1),
    ({"kind": "data", "output": ("o.exr",)}, 1),
    ({"kind": "data", "output": ("o.exr",), "texture": "associated.exr"}, 0),
]


@pytest.mark.parametrize("change, warned", LOSING)
def test_lost_colours_under_alpha_0_get_a_note_where_alpha_is_straight(circles, change, warned):
    job = circles.model_copy(update={"texture": "straight.png", "output": ("o.webp",), **change})
    notes = [note for note in run(job).notes if "does not keep colours where alpha is 0" in note]
    assert len(notes) == warned
