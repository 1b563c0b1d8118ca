"""PNG files: compatibility with other readers, chunks before the pixels, full disks."""

import subprocess
import sys

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image as Pillow

from iccm.io.formats import PNG
from iccm.io.pictures.png import PngOutput, chunks


def noise(shape, dtype):
    """Half smooth, so that it can be compressed."""
    values = np.random.default_rng(1).integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)
    values[: shape[0] // 2] = np.linspace(0, 200, shape[1])[:, None]
    return values


def spec_of(pixels):
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, str(pixels.dtype))
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("oiio:ColorSpace", "sRGB")
    spec.attribute("ImageDescription", "a leaf")
    spec.attribute("XResolution", 300.0)
    return spec


def write(path, pixels, rows=7):
    file = PngOutput(oiio.ImageOutput.create(str(path)))
    assert file.open(str(path), spec_of(pixels)), file.geterror()
    for first in range(0, len(pixels), rows):
        part = pixels[first : first + rows]
        assert file.write_scanlines(first, first + len(part), 0, part), file.geterror()
    assert file.close()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("height", [1, 7, 30])
def test_pixels_are_read_back(tmp_path, dtype, channels, height):
    pixels = noise((height, 41, channels), dtype)
    write(tmp_path / "a.png", pixels)
    read = oiio.ImageBuf(str(tmp_path / "a.png"))
    config = oiio.ImageSpec()
    config["oiio:UnassociatedAlpha"] = 1
    read.reset(str(tmp_path / "a.png"), 0, 0, config)
    assert np.array_equal(read.get_pixels(str(np.dtype(dtype))), pixels)
    if dtype == np.uint8:
        with Pillow.open(tmp_path / "a.png") as file:
            assert np.array_equal(np.asarray(file).reshape(pixels.shape), pixels)


def test_everything_except_the_pixels_agrees_with_openimageio(tmp_path):
    pixels = noise((30, 41, 4), np.uint8)
    write(tmp_path / "a.png", pixels)
    file = oiio.ImageOutput.create(str(tmp_path / "b.png"))
    assert file.open(str(tmp_path / "b.png"), spec_of(pixels))
    assert file.write_image(pixels)
    assert file.close()
    ours, theirs = ((tmp_path / name).read_bytes() for name in ("a.png", "b.png"))
    assert ours.startswith(PNG)
    first, second = ([part for part in chunks(content) if part[0] != b"IDAT"] for content in (ours, theirs))
    assert first == second
    assert {b"IHDR", b"sRGB", b"tEXt", b"pHYs", b"IEND"} <= {name for name, _ in first}


def test_smooth_pictures_compress_well(tmp_path):
    pixels = np.broadcast_to(np.arange(200, dtype=np.uint8)[:, None, None], (200, 300, 3))
    write(tmp_path / "a.png", np.ascontiguousarray(pixels), rows=64)
    assert (tmp_path / "a.png").stat().st_size < 0.02 * pixels.size


def test_a_missing_folder_is_reported(tmp_path):
    pixels = noise((3, 4, 3), np.uint8)
    file = PngOutput(oiio.ImageOutput.create("a.png"))
    assert not file.open(str(tmp_path / "missing" / "a.png"), spec_of(pixels))
    assert file.geterror()
    file.close()


FULL = """
import sys, resource, signal
import numpy as np
from iccm.errors import InputError
from iccm.io.pictures.image_files import Image, write
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
try:
    write(sys.argv[1], Image(np.random.default_rng(0).integers(0, 256, (300, 300, 3), np.uint8)))
except InputError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limits on files there")
def test_a_full_disk_is_reported(tmp_path):
    line = [sys.executable, "-c", FULL, str(tmp_path / "a.png")]
    process = subprocess.run(line, capture_output=True, text=True, check=True)
    assert process.stdout.startswith(f"{tmp_path / 'a.png'}: cannot write this picture: ")
    assert not process.stderr
