"""STMaps: the convention, compared with OpenImageIO's st_warp, and reading them back."""

import numpy as np
import OpenImageIO as oiio
import pytest

from iccm.errors import InputError
from iccm.io.pictures import image_files, stmap_files
from iccm.io.pictures.image_files import Image
from iccm.maps.harmonic import HarmonicMap
from iccm.pixels.canvas import Canvas
from iccm.pixels.warp import Texture, warp

BOX = (-1.4 - 1.4j, 1.4 + 1.4j)


def star(n=120):
    s = 2 * np.pi * np.arange(n) / n
    return (1 + 0.3 * np.cos(5 * s)) * np.exp(1j * s)


def curved():
    return HarmonicMap(star(), star() + 0.15 * star() ** 2, 0 * star())


def smooth(h, w):
    y, x = np.indices((h, w)) / 20
    return np.stack([np.sin(x) + 1, np.cos(y) + 1, np.sin(x + 2 * y) + 1], axis=2).astype(np.float32) / 2


def test_identity_holds_the_pixels_own_place(tmp_path):
    stmap_files.write(tmp_path / "a.exr", HarmonicMap(star(), star(), 0 * star()), BOX, Canvas(70, 50, BOX))
    st = stmap_files.read(tmp_path / "a.exr")
    assert st.dtype == np.float32
    inner = st[..., 3] == 1
    i, j = np.nonzero(inner)
    assert inner.sum() > 800
    assert np.abs(st[inner][:, 0] - (j + 0.5) / 70).max() < 1e-6
    assert np.abs(st[inner][:, 1] - (1 - (i + 0.5) / 50)).max() < 1e-6
    assert (st[st[..., 3] == 0] == 0).all()


def test_openimageio_reads_it_as_meant(tmp_path):
    picture, canvas = smooth(128, 128), Canvas(300, 260, BOX)
    stmap_files.write(tmp_path / "a.exr", curved(), BOX, canvas)
    ours = warp(curved(), Texture(picture, BOX, transfer="linear"), canvas, filter="linear").pixels
    theirs = oiio.ImageBuf(oiio.ImageSpec(300, 260, 3, "float"))
    source, map = oiio.ImageBuf(picture), oiio.ImageBuf(str(tmp_path / "a.exr"))
    assert oiio.ImageBufAlgo.st_warp(theirs, source, map, "triangle", flip_t=True)
    inner = ours[..., 3] == 1
    difference = np.abs(theirs.get_pixels(oiio.FLOAT)[inner][:, :3] - ours[inner][:, :3])
    assert difference.max() < 0.02
    assert np.median(difference) < 1e-3


@pytest.mark.parametrize("shape", [(128, 128), (96, 160)])
def test_applying_a_stored_map_agrees_with_warping(tmp_path, shape):
    picture, canvas = Image((smooth(*shape) * 65535).astype(np.uint16)), Canvas(150, 130, BOX)
    stmap_files.write(tmp_path / "a.exr", curved(), BOX, canvas)
    stmap_files.apply(stmap_files.read(tmp_path / "a.exr"), picture, tmp_path / "b.png")
    again = image_files.read(tmp_path / "b.png")
    direct = warp(curved(), picture.texture(BOX), canvas).pixels.astype(int)
    assert again.pixels.dtype == np.uint16
    assert np.abs(again.pixels[..., 3] - direct[..., 3]).max() <= 1
    inner = direct[..., 3] == 65535
    assert np.abs(again.pixels[inner].astype(int) - direct[inner]).max() < 400


def test_invalid_stmaps_are_refused(tmp_path):
    image_files.write(tmp_path / "a.png", Image(np.zeros((4, 4, 3), np.uint8)))
    with pytest.raises(InputError, match="not an STMap"):
        stmap_files.read(tmp_path / "a.png")
    with pytest.raises(InputError, match="floats"):
        stmap_files.write(tmp_path / "b.png", curved(), BOX, Canvas(4, 4, BOX))


def test_iccm_apply(tmp_path, capsys):
    from iccm.cli import run

    stmap_files.write(tmp_path / "a.exr", curved(), BOX, Canvas(60, 60, BOX))
    image_files.write(tmp_path / "p.png", Image((smooth(40, 40) * 255).astype(np.uint8)))
    files = [str(tmp_path / name) for name in ("a.exr", "p.png")]
    assert run(["apply", *files, "-o", str(tmp_path / "out.png")]) == 0
    out = image_files.read(tmp_path / "out.png")
    assert out.pixels.shape == (60, 60, 4)
    assert out.pixels.dtype == np.uint8
    assert run(["apply", *files, "-o", str(tmp_path / "out.png")]) == 2
    assert "--force" in capsys.readouterr().err
    assert run(["apply", *files[::-1], "-o", str(tmp_path / "b.png")]) == 2
    assert "not an STMap" in capsys.readouterr().err
    assert not (tmp_path / "b.png").exists()


def test_iccm_apply_averages_normals_as_directions(tmp_path, monkeypatch, iccm):
    """Columns that lean to the left and to the right by turns: from afar, the surface faces the viewer."""
    monkeypatch.chdir(tmp_path)
    stmap_files.write("a.exr", curved(), BOX, Canvas(20, 20, BOX))
    leaning = np.tile(np.array([[218, 128, 218], [37, 128, 218]], np.uint8), (400, 200, 1))
    image_files.write("p.png", Image(leaning))
    blue = {}
    for kind in ("normal", "data"):
        assert iccm("apply", "a.exr", "p.png", "--kind", kind, "-o", f"{kind}.png").code == 0
        pixels = image_files.read(f"{kind}.png").pixels
        blue[kind] = pixels[pixels[..., 3] == 255][:, 2].astype(int)
    assert blue["normal"].min() > 250 and np.abs(blue["data"] - 218).max() <= 2


def test_iccm_apply_reports_omissions_and_refuses_at_once(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    stmap_files.write("a.exr", curved(), BOX, Canvas(60, 60, BOX))
    picture = np.ones((8, 8, 5), np.float32)
    picture[2, 3] = np.nan
    image_files.write("p.exr", Image(picture, colorspace="lin_rec709"))
    result = iccm("apply", "a.exr", "p.exr", "-o", "o.exr")
    assert result.code == 0
    assert "note: p.exr: 1 texels are not finite" in result.err
    assert np.isfinite(image_files.read("o.exr").pixels).all()
    monkeypatch.setattr(stmap_files, "Sampler", lambda *args, **kwargs: pytest.fail("prepared"))
    result = iccm("apply", "a.exr", "p.exr", "-o", "o.png")
    assert result.code == 2
    assert "1 or 3 channels beside alpha, not 5" in result.err
    assert not (tmp_path / "o.png").exists()


@pytest.mark.slow
def test_iccm_apply_writes_to_stdout_and_keeps_its_inputs(tmp_path, monkeypatch, iccm, shell):
    monkeypatch.chdir(tmp_path)
    stmap_files.write("a.exr", curved(), BOX, Canvas(30, 30, BOX))
    image_files.write("p.png", Image((smooth(20, 20) * 255).astype(np.uint8)))
    result = shell("iccm apply a.exr p.png -o - > o.png && iccm apply a.exr p.png -o same.png", cwd=tmp_path)
    assert result.returncode == 0 and result.stderr == "wrote same.png\n"
    assert (tmp_path / "o.png").read_bytes() == (tmp_path / "same.png").read_bytes()
    for name in ("a.exr", "./p.png"):
        before = (tmp_path / name).read_bytes()
        result = iccm("apply", "a.exr", "p.png", "-o", name, "--force")
        assert result.code == 2 and result.lines == [
            f"error: {name}: is also an input; choose another output"
        ]
        assert (tmp_path / name).read_bytes() == before
    result = iccm("apply", "a.exr", "p.png", "-o", "o.obj")
    assert result.code == 2 and result.lines[-1].startswith("error: o.obj: unknown picture format '.obj'")


def test_a_picture_of_several_tiles_is_read_at_the_stored_coordinates(tmp_path):
    """An STMap whose places are the texels of a picture of 3 by 2 tiles starting at (1, 0) gives the picture itself."""
    rng = np.random.default_rng(0)
    pixels = rng.integers(0, 256, (10, 36, 3), np.uint8)
    rows, columns = np.indices((10, 36))
    st = np.dstack([1 + (columns + 0.5) / 12, 2 - (rows + 0.5) / 5, 0 * rows, 0 * rows + 1]).astype(
        np.float32
    )
    stmap_files.apply(st, Image(pixels), tmp_path / "a.png", tiles=(1 + 0j, 4 + 2j), filter="nearest")
    result = image_files.read(tmp_path / "a.png").pixels
    assert np.array_equal(result[..., :3], pixels) and (result[..., 3] == 255).all()


def test_places_on_the_edge_of_a_tile_belong_to_no_tile():
    st = np.array(
        [[[0.5, 0.25, 0, 1], [1.0, 0.5, 0, 1], [1.5, 1.99999, 0, 1], [1.5, 0.7, 0, 0], [2.5, 0.7, 0, 1]]]
    )
    assert stmap_files.places(st).tolist() == [[0.5, 0.25], [2.5, 0.7]]
