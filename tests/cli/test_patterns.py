"""--edge, --texture-scale, --texture-offset, --texture-turn: textures repeated to fill a shape."""

import json

import numpy as np
import pytest

from iccm.io.pictures import image_files

pytestmark = pytest.mark.usefixtures("solve_once")

OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"


@pytest.fixture
def tile(shapes):
    pixels = np.random.default_rng(0).integers(0, 256, (16, 16, 3), dtype=np.uint8)
    image_files.write("tile.png", image_files.Image(pixels))
    (shapes / "mesh.obj").write_text(OBJ)
    return shapes


SQUARE = ("map", "square.svg", "square.svg", "--texture", "tile.png", "--size", "100")


def inside(name: str) -> np.ndarray:
    return image_files.read(name).pixels[12:88, 12:88, :3].astype(int)


def test_a_tile_repeats_without_a_seam_and_keeps_its_proportions(tile, iccm):
    (tile / "wide.svg").write_text((tile / "square.svg").read_text().replace("100 100", "100 90"))
    result = iccm("map", "wide.svg", "wide.svg", *SQUARE[3:-2], "-o", "o.png", "--edge", "repeat", "--texture-scale",
                ".2", "--size", "100x90")  # fmt: skip
    assert result.code == 0 and "stretched" not in result.err
    pixels = inside("o.png")[:60]
    assert (
        np.abs(pixels[20:] - pixels[:-20]).max() <= 1 and np.abs(pixels[:, 20:] - pixels[:, :-20]).max() <= 1
    )
    assert pixels.std() > 20


def test_a_mirrored_tile_is_even_about_its_edges(tile, iccm):
    assert iccm(*SQUARE, "-o", "o.png", "--edge", "mirror", "--texture-scale", ".2,.4").code == 0
    pixels = image_files.read("o.png").pixels[12:88, :, :3].astype(int)
    assert np.abs(pixels[:, 40:60] - pixels[:, 20:40][:, ::-1]).max() <= 1  # edges at 40, 60, …
    assert np.abs(pixels[:, 60:80] - pixels[:, 40:60][:, ::-1]).max() <= 1


def test_offset_and_turn_move_the_pattern(tile, iccm):
    placed = (*SQUARE, "--edge", "repeat", "--texture-scale", ".2")
    assert iccm(*placed, "-o", "a.png").code == 0
    assert iccm(*placed, "-o", "b.png", "--texture-offset", "7,3").code == 0
    assert iccm(*placed, "-o", "c.png", "--texture-turn", "90").code == 0
    a, b, c = (inside(f"{name}.png") for name in "abc")
    assert np.abs(b[3:, 7:] - a[:-3, :-7]).max() <= 1
    assert np.abs(c - np.rot90(a)).max() <= 1


def test_a_map_written_as_a_picture_places_the_tile_alike(tile, iccm):
    placed = ("--edge", "repeat", "--texture-scale", ".3", "--texture-turn", "20", "--texture-offset", "3,-4")
    done = iccm("map", "square.svg", "blob.svg", "--texture", "tile.png", *placed, "-o", "o.png", "--stmap", "st.tif",
                "--size", "200")  # fmt: skip
    assert (
        done.code == 0
        and iccm("apply", "st.tif", "tile.png", "--edge", "repeat", "-o", "again.png").code == 0
    )
    result, again = (image_files.read(name).pixels.astype(int) for name in ("o.png", "again.png"))
    core = (result[..., 3] == 255) & (again[..., 3] == 255)
    assert np.abs(result - again)[core].mean() < 0.2


@pytest.mark.slow
def test_a_mesh_shows_tiles_by_its_coordinates_or_baked(tile, iccm):
    onto = (
        "map",
        "square.svg",
        "mesh.obj",
        "--texture",
        "tile.png",
        "--edge",
        "repeat",
        "--texture-scale",
        ".25",
    )
    assert iccm(*onto, "-o", "o.obj").code == 0
    uv = [line.split()[1:] for line in (tile / "o.obj").read_text().splitlines() if line.startswith("vt ")]
    assert np.ptp(np.array(uv, float), axis=0) == pytest.approx([0.8 / 0.25] * 2, abs=1e-5)
    assert iccm(*onto, "--bake", "-o", "o.png", "--size", "80").code == 0  # 80 of the 100 units of the canvas
    baked = image_files.read("o.png").pixels.astype(int)
    assert np.abs(baked[25:] - baked[:-25]).max() <= 1 and baked.std() > 20


@pytest.mark.parametrize(
    "command, message",
    [
        ("map mesh.obj square.svg --texture tile.png --texture-scale .5 -o o.png", "--texture-scale does not apply"),
        ("map mesh.obj square.svg --texture tile.png --edge mirror -o o.png", "--edge mirror does not apply"),
        ("map square.svg mesh.obj --texture tile.png --texture-turn 9 -o o.obj", "use --edge repeat, or --bake"),
        ("map square.svg mesh.obj --texture tile.png --edge mirror -o o.obj", "use --edge repeat, or --bake"),
        ("map square.svg blob.svg --texture-scale 0 -o o.png", "'--texture-scale': a factor"),
        ("map square.svg blob.svg --texture-scale 1,2,3 -o o.png", "'--texture-scale': '1,2,3' is not a factor"),
        ("map square.svg blob.svg --texture-offset 1 -o o.png", "'--texture-offset': '1' is not two numbers"),
        ("map square.svg blob.svg --texture-turn 9 -o o.svg", "--texture-turn: has no effect"),
        ("map square.svg blob.svg --texture-turn nan -o o.png", "--texture-turn"),
    ],
)  # fmt: skip
def test_textures_that_cannot_be_placed_are_refused_in_one_line(tile, iccm, command, message):
    result = iccm(*command.split())
    assert result.code == 2 and message in result.err and len(result.lines) == 1


def test_the_options_stand_in_the_report(tile, iccm):
    result = iccm(*SQUARE, "--edge", "repeat", "--texture-scale", ".5", "--texture-offset", "1,2", "-o", "o.png",
                "--report", "r.json")  # fmt: skip
    assert result.code == 0
    job = json.loads((tile / "r.json").read_text())["job"]
    assert job["texture_scale"] == [0.5] and job["texture_offset"] == [1, 2] and job["edge"] == "repeat"
