"""The table of formats is correct: every picture format returns what it is declared to store."""

import numpy as np
import pytest

from iccm import InputError
from iccm.io import formats
from iccm.io.pictures import image_files
from iccm.io.pictures.image_files import Image
from tests.cases import some_fast

pytestmark = pytest.mark.usefixtures("solve_once")


def noise(kind, channels):
    values = np.random.default_rng(2).random((9, 11, channels))
    if channels in (2, 4):
        values[..., -1] = np.rint(values[..., -1])  # colours where alpha is 0
    whole = np.iinfo(kind).max if np.dtype(kind).kind == "u" else 1
    return Image((values * whole).astype(kind), channels - 1 if channels in (2, 4) else -1)


@pytest.mark.parametrize("suffix", formats.holding("picture", written=True))
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_integers_are_read_back(tmp_path, suffix, channels):
    format = formats.picture(suffix and f"a{suffix}")
    exact = suffix not in (".jpg", ".jpeg") and (format.grey or channels > 1)
    for bits in format.bits if exact and (format.alpha or channels != 4) else ():
        image = noise(f"uint{bits}", channels)
        image_files.write(tmp_path / f"a{suffix}", image)
        again = image_files.read(tmp_path / f"a{suffix}")
        is_visible = np.ones(image.pixels.shape, bool)
        if channels == 4 and not format.hidden:
            is_visible[image.pixels[..., 3] == 0] = False
        assert again.pixels.dtype == image.pixels.dtype and again.alpha == image.alpha
        assert (again.pixels == image.pixels)[is_visible].all()


@pytest.mark.parametrize("suffix", [s for s in formats.holding("picture") if formats.picture(f"a{s}").named])
def test_a_format_that_names_colour_spaces_does(tmp_path, suffix):
    depth = np.float32 if suffix == ".exr" else np.uint8
    image_files.write(tmp_path / f"a{suffix}", Image(noise(depth, 3).pixels, colorspace="lin_rec709"))
    assert image_files.read(tmp_path / f"a{suffix}").colorspace == "lin_rec709"


@pytest.mark.slow
@pytest.mark.parametrize("suffix", some_fast(formats.holding("picture", written=True), {".png", ".exr"}))
def test_map_and_apply_write_the_same_pictures(shapes, iccm, suffix):
    quick = ("--method", "paper", "--order", "0", "--vertices", "40", "--size", "24", "-q")
    image_files.write("t.png", noise(np.uint8, 3))
    ran = iccm(
        "map", "square.svg", "blob.svg", *quick, "--stmap", "s.exr", "-o", f"m{suffix}", "--texture", "t.png"
    )
    assert ran.code == 0, ran.err
    assert iccm("apply", "s.exr", "t.png", "-o", f"a{suffix}", "-q", "--filter", "spline").code == 0
    pictures = [image_files.read(f"{name}{suffix}").pixels for name in "ma"]
    assert pictures[0].shape == pictures[1].shape == (24, 24, 3 + formats.picture(f"a{suffix}").alpha)


def test_an_unknown_suffix_is_refused_by_both(shapes, iccm):
    image_files.write("t.png", noise(np.uint8, 3))
    image_files.write("s.exr", Image(np.zeros((4, 4, 3), np.float32)))
    for words in (("map", "square.svg", "blob.svg"), ("apply", "s.exr", "t.png")):
        ran = iccm(*words, "-o", "x.gif")
        assert ran.code == 2 and "x.gif: " in ran.err and ".png" in ran.err


def test_an_output_that_cannot_hold_it_is_refused_with_those_that_can():
    formats.check("a.PNG", "plot", "unknown suffix for --plot")
    with pytest.raises(InputError, match=r"a\.gif: unknown suffix for --plot; use one of \.png \.svg \.pdf"):
        formats.check("a.gif", "plot", "unknown suffix for --plot")
