"""The pictures of a material through one map: solved once, each treated by its kind."""

import json
import re

import numpy as np
import pytest

from iccm.io.meshes import gltf, gltf_materials
from iccm.io.pictures import image_files
from iccm.io.pictures.image import Image
from iccm.io.run import maps
from tests.cli.test_charts import TILES, ramp, write_sheets

pytestmark = pytest.mark.usefixtures("solve_once")

KINDS = {"texture": "colour", "normal": "normal", "data": "data"}


@pytest.fixture
def material(shapes):
    """A folder with a picture of each kind, in several sizes and depths, and a mesh with a layout."""
    x = np.linspace(0, 1, 48)
    n = np.stack(
        [0.4 * np.sin(9 * x)[None] + 0 * x[:, None], 0.3 + 0 * np.outer(x, x), 1 + 0 * np.outer(x, x)], -1
    )
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    image_files.write("texture.png", ramp())
    image_files.write("normal.png", Image((128 + 127 * n).round().astype(np.uint8)))
    image_files.write("data.tif", Image((65535 * np.outer(x, x)[..., None]).astype(np.uint16)))
    write_sheets(shapes / "tiles.obj", TILES)
    return shapes


def options(name, word):
    return [f"--{word}", name]


@pytest.mark.slow
@pytest.mark.parametrize("words", [["blob.svg"], ["tiles.obj#left", "--bake"], ["tiles.obj#uv-1"]])
def test_a_set_agrees_with_single_runs_and_is_solved_once(material, iccm, monkeypatch, words):
    names = {"texture": "texture.png", "normal": "normal.png", "data": "data.tif"}
    single = {}
    for word, name in names.items():
        run = ["map", "square.svg", *words, "--texture", name, "--kind", KINDS[word], "-o", f"one-{word}.tif"]
        ran = iccm(*run)
        assert ran.code == 0, ran.err
        single[word] = image_files.read(f"one-{word}.tif")
    solved, real = [], maps.solve
    monkeypatch.setattr(maps, "solve", lambda *args, **kwargs: solved.append(1) or real(*args, **kwargs))
    arguments = [option for word, name in names.items() for option in options(name, word)]
    result = iccm("map", "square.svg", *words, *arguments, "-o", "set-{stem}.tif", "--report", "r.json")
    assert result.code == 0, result.err
    assert len(solved) == 1
    for word, image in single.items():
        picture = image_files.read(f"set-{word}.tif")
        assert picture.pixels.dtype == image.pixels.dtype and (picture.pixels == image.pixels).all()
    report = json.loads((material / "r.json").read_text())
    assert {"texture.png", "normal.png", "data.tif"} <= {entry["path"] for entry in report["inputs"]}


def test_names_of_textures_and_of_sides_fit_together(material, iccm):
    arguments = ["--normal", "normal.png", "--data", "data.tif"]
    assert iccm("map", "square.svg", "blob.svg", *arguments).code == 0
    assert (material / "square-blob-normal.png").is_file() and (material / "square-blob-data.png").is_file()
    alone = iccm("map", "square.svg", "blob.svg", "--normal", "normal.png", "-o", "n.png")
    assert alone.code == 0
    assert (image_files.read("n.png").pixels == image_files.read("square-blob-normal.png").pixels).all()
    for more, message in (
        (["-o", "x.png"], r"2 textures\b.*\b1 picture.*-o"),
        (["--stmap", "x.exr"], r"2 textures\b.*\b0 picture.*-o"),
    ):
        result = iccm("map", "square.svg", "blob.svg", *arguments, *more)
        assert result.code == 2 and re.search(message, result.err) and not (material / more[1]).exists()
    grey = iccm(
        "map",
        "square.svg",
        "blob.svg",
        "--texture",
        "texture.png",
        "--normal",
        "data.tif",
        "-o",
        "of-{stem}.png",
    )
    assert grey.code == 2 and "data.tif" in grey.err and not (material / "of-texture.png").exists()


def test_a_mesh_shows_a_set_itself(material, iccm):
    write_sheets(material / "sheet.obj", {"sheet": TILES["left"]})
    arguments = ["--texture", "texture.png", "--normal", "normal.png"]
    result = iccm("map", "square.svg", "sheet.obj", *arguments, "-o", "x.glb", "-o", "x.obj")
    assert result.code == 0, result.err
    whole = gltf.read(material / "x.glb")
    (material_entry,) = whole.tree["materials"]
    slots = {
        slot: whole.image(whole.source_of(info["index"]))
        for slot, info in gltf_materials.slots(material_entry)
    }
    assert slots == {
        gltf_materials.BASE: (material / "texture.png").read_bytes(),
        gltf_materials.NORMALS: (material / "normal.png").read_bytes(),
    }
    assert (material / "x.mtl").read_text().split()[-4:] == ["map_Kd", "texture.png", "norm", "normal.png"]
    alone = iccm("map", "square.svg", "sheet.obj", *arguments[2:], "-o", "n.obj")
    assert alone.code == 0 and "map_Kd" not in (material / "n.mtl").read_text()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["-o", "x.ply"], "PLY cannot contain a normal map"),
        (["-o", "x.glb", "--data", "data.tif"], "add a picture for data"),
        (["-o", "x.glb", "--normal", "texture.png"], "a mesh takes one --texture and one --normal"),
        (["-o", "x.obj", "--carry-maps"], "leave one of the two out"),
    ],
)
def test_outputs_that_a_mesh_cannot_show_are_refused(material, iccm, more, message):
    arguments = ["--texture", "texture.png", "--normal", "normal.png"]
    result = iccm("map", "square.svg", "tiles.obj#left", *arguments, *more)
    assert result.code == 2 and message in result.err and not (material / more[1]).exists()


@pytest.mark.parametrize(
    "arguments", [["--normal-down", "normal.png"], ["--texture", "data.tif", "--kind", "data"]]
)
def test_a_mesh_does_not_show_data_as_colours(material, iccm, arguments):
    for output in (["-o", "x.glb"], []):  # by default, a mesh onto a mesh gives a mesh
        result = iccm("map", "square.svg", "tiles.obj#left", *arguments, *output)
        assert result.code == 2 and "add a picture for" in result.err, result.err
    assert not (material / "x.glb").exists()


@pytest.mark.parametrize("arguments", [["--data", "data.tif"], ["--normal-down", "normal.png"]])
def test_a_mesh_beside_a_picture_shows_colours_alone(material, iccm, arguments):
    """Data and DirectX normals become pictures; the mesh gets its coordinates, and a note reports the rest."""
    write_sheets(material / "sheet.obj", {"sheet": TILES["left"]})
    out = ["-o", "made.png", "-o", "x.glb", "-o", "x.obj"]
    alone = iccm("map", "square.svg", "sheet.obj", *arguments, *out)
    assert alone.code == 0, alone.err
    errors = [line for line in alone.lines if "cannot include" in line]
    assert len(errors) == 2 and all(arguments[1] in line and "--texture" in line for line in errors)
    assert "x.glb: " in errors[0] and "x.obj: " in errors[1]
    assert not gltf.read(material / "x.glb").tree.get("images") and not (material / "x.mtl").exists()
    result = iccm(
        "map",
        "square.svg",
        "sheet.obj",
        "--texture",
        "texture.png",
        *arguments,
        "-o",
        "t.png",
        *out,
        "--force",
    )
    errors = [line for line in result.lines if "cannot include" in line]
    assert result.code == 0 and len(errors) == 2 and all(arguments[1] in line for line in errors)
    assert "texture.png" not in "".join(errors)
    whole = gltf.read(material / "x.glb")
    (material_entry,) = whole.tree["materials"]
    assert [slot for slot, _ in gltf_materials.slots(material_entry)] == [gltf_materials.BASE]
    assert (material / "x.mtl").read_text().split()[-2:] == ["map_Kd", "texture.png"]


@pytest.mark.slow
def test_a_batch_takes_sets_and_tiles(material, iccm):
    for number in (1001, 1002, 1011):
        image_files.write(f"skin.{number}.png", ramp(size=32))
    jobs = [
        {"source": "square.svg", "target": "blob.svg", "texture": "texture.png", "normal": "normal.png"},
        {
            "source": "tiles.obj",
            "target": "tiles.obj",
            "parts": "all",
            "bake": True,
            "texture": "skin.<UDIM>.png",
            "output": "out.<UDIM>.png",
        },
    ]
    (material / "jobs.jsonl").write_text("\n".join(map(json.dumps, jobs)))
    result = iccm("batch", "jobs.jsonl", "--root", "made", "-j", "1")
    assert result.code == 0, result.err + result.out
    outputs = [
        sorted(entry["path"] for entry in json.loads(line)["outputs"]) for line in result.out.splitlines()
    ]
    assert outputs == [
        ["made/square-blob-normal.png", "made/square-blob-texture.png"],
        ["made/out.1001.png", "made/out.1002.png", "made/out.1011.png"],
    ]
    again = iccm("batch", "jobs.jsonl", "--root", "made", "-j", "1", "--resume")
    lines = [json.loads(line) for line in again.out.splitlines()]
    assert all(line["resumed"] for line in lines)
    assert [sorted(entry["path"] for entry in line["outputs"]) for line in lines] == outputs
    (material / "bad.jsonl").write_text(json.dumps(jobs[1] | {"texture": "no.<UDIM>.png"}))
    refused = iccm("batch", "bad.jsonl", "--root", "made", "--dry-run")
    assert refused.code == 2 and "no.<UDIM>.png: no such file" in refused.err
