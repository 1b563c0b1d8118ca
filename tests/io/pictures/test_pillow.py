"""Pictures read by Pillow: through one function, with an allow-list of formats."""

import io
import re
import struct
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow

from iccm import InputError
from iccm.io.meshes.embedding import picture_file
from iccm.io.pictures import image_files, pillow

ROOT = Path(__file__).parents[3]
EPS = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\n%%EndComments\n(pwned) print\n%%EOF\n"


def png_header(width, height):
    """A picture whose header declares a size, but without any pixels."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(b"\0" * 100)) + chunk(b"IEND", b"")


@pytest.fixture
def no_programs(monkeypatch):
    """Fail the test if a program is started."""

    def refuse(*args, **kwargs):
        raise AssertionError(f"starts {args}")

    monkeypatch.setattr(subprocess, "Popen", refuse)


def test_a_picture_that_holds_eps_starts_no_program(tmp_path, monkeypatch, no_programs):
    monkeypatch.chdir(tmp_path)
    for name in ("a.png", "a.jpg", "a.tif", "a.eps"):
        Path(name).write_bytes(EPS)
        with pytest.raises(InputError, match=name):
            picture_file(Path(name))
        with pytest.raises(InputError, match=name), pillow.opened(Path(name), name) as image:
            image.load()
        assert image_files.proportions(Path(name)) is None
    assert image_files.proportions(EPS) is None
    with pytest.raises(InputError):
        picture_file(EPS)


def test_formats_outside_the_list_are_refused():
    with pytest.raises(ValueError, match="EPS"), pillow.opened(EPS, "a.eps", ("EPS",)):
        pass


def test_more_pixels_than_are_decoded_are_refused_by_the_limit():
    with pytest.raises(InputError, match=r"a\.png.*limit"), pillow.opened(png_header(20000, 20000), "a.png"):
        pass


def test_errors_during_decoding_are_refused_too():
    whole = io.BytesIO()
    Pillow.fromarray(np.full((40, 30, 3), 7, np.uint8)).save(whole, "PNG")
    with (
        pytest.raises(InputError, match=r"a\.png"),
        pillow.opened(whole.getvalue()[:60], "a.png") as image,
    ):
        image.load()


def test_pictures_in_glb_files_keep_their_pixels(tmp_path):
    pixels = np.random.default_rng(3).integers(0, 256, (7, 5, 3), np.uint8)
    for suffix in ("tif", "bmp", "webp"):
        image_files.write(tmp_path / f"a.{suffix}", image_files.Image(pixels))
        data = picture_file(tmp_path / f"a.{suffix}")
        assert np.array_equal(np.asarray(Pillow.open(io.BytesIO(data))), pixels)
    image_files.write(tmp_path / "a.exr", image_files.Image(pixels.astype(np.float32)))
    with pytest.raises(InputError, match=r"a\.exr.*PNG"):
        picture_file(tmp_path / "a.exr")


def test_pictures_are_opened_with_pillow_in_one_place():
    opens = re.compile(r"\b(?:Image|Pillow|PIL)\.open\(")
    modules = {
        path.relative_to(ROOT).as_posix()
        for folder in ("iccm", "io", "cli", "extensions", "plugins")
        for path in (ROOT / folder).rglob("*.py")
        if opens.search(path.read_text(encoding="utf-8"))
    }
    assert modules == {"io/pictures/pillow.py"}
