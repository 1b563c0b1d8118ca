"""Pictures with invalid headers: read without them or rejected, and no library writes to stderr."""

import struct
import zlib

import numpy as np
import pytest

from iccm import InputError
from iccm.io.pictures import image_files, stmap_files
from tests import fuzz


@pytest.fixture(scope="module")
def exr(tmp_path_factory):
    path = tmp_path_factory.mktemp("exr") / "a.exr"
    metadata = {"ImageDescription": ("string", "hello there"), "Artist": ("string", "someone")}
    image = image_files.Image(np.full((4, 4, 4), 0.5, np.float32), 3, True, "lin_rec709", metadata)
    image_files.write(path, image)
    return path.read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("byte", [0xFF, 0xC3, 0x80])
def test_a_byte_of_the_header_that_is_not_text(exr, byte, tmp_path):
    noted = 0
    for position in range(8, min(700, len(exr)), 3):
        content = bytearray(exr)
        content[position] = byte
        (tmp_path / "b.exr").write_bytes(content)
        try:
            image = image_files.read(tmp_path / "b.exr", max_pixels=1 << 16)
            image_files.write(tmp_path / "c.exr", image)
            stmap_files.read(tmp_path / "b.exr", max_pixels=1 << 16)
        except InputError as error:
            assert "\n" not in str(error)
            continue
        noted += any("header" in note and "b.exr" in note for note in image.notes)
    assert noted


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


@pytest.mark.slow
def test_libraries_do_not_speak_of_a_picture(shapes, shell):
    """An invalid profile, and pixels that cannot be decompressed, with correct checksums."""
    whole = fuzz.png()
    odd = (
        whole[:33]
        + chunk(b"iCCP", b"a\0\0" + zlib.compress(b"no profile"))
        + chunk(b"gAMA", b"\0\0")
        + whole[33:]
    )
    (shapes / "odd.png").write_bytes(odd)
    head = whole[: whole.index(b"IDAT") - 4]
    (shapes / "bad.png").write_bytes(head + chunk(b"IDAT", b"nothing of zlib's") + chunk(b"IEND", b""))
    for name in ("odd.png", "bad.png"):
        result = shell(f"iccm map square.svg blob.svg --texture {name} --size 16 -q -o {name}.tif")
        assert "libpng" not in result.stderr and len(result.stderr.splitlines()) <= 1, result.stderr
        assert result.returncode == (2 if name == "bad.png" else 0)
