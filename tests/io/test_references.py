"""Files that a mesh refers to: from its folder and below; others only with --allow-outside, as the message says."""

import json
import os

import numpy as np
import pytest
from PIL import Image

from iccm.io import references
from iccm.io.meshes import material_library
from iccm.io.pictures import image_files

pytestmark = pytest.mark.usefixtures("solve_once")

SECRET = "# password hunter2\nhunter2 4\nnewmtl other\nKd 1 0 0\nhunter2\n"
CORNERS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
FACES = "usemtl skin\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
NAMES = ("../canary/secret.txt", "{folder}/canary/secret.txt", "inner/../../canary/secret.txt", "link.txt")


def picture(path, colour):
    Image.new("RGB", (8, 8), (colour, colour, colour)).save(path)


@pytest.fixture
def meshes(tmp_path, monkeypatch):
    """The folder `mesh`, made current, with x.obj, new.obj and a library; beside it `canary` with secrets."""
    (tmp_path / "canary").mkdir()
    (tmp_path / "mesh" / "inner").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "mesh")
    (tmp_path / "canary" / "secret.txt").write_text(SECRET)
    picture(tmp_path / "canary" / "secret.png", 200)
    picture(tmp_path / "mesh" / "inner" / "own.png", 90)
    os.symlink("../canary/secret.txt", "link.txt")
    os.symlink("../canary/secret.png", "link.png")
    (tmp_path / "mesh" / "new.obj").write_text(CORNERS.replace("vt 0 1", "vt 0 .9") + FACES)
    return tmp_path / "mesh"


def written(folder):
    """The part of the secrets that occurs in the files of a folder: the text, and pictures made from the other one."""
    texts = [path.read_bytes() for path in folder.glob("o*") if path.suffix != ".png"]
    bright = [path.name for path in folder.glob("o*.png") if image_files.read(path).pixels.max() > 150]
    return b"hunter2" in b"".join(texts) or bright


@pytest.mark.parametrize("name", NAMES)
def test_a_library_outside_of_the_folder_is_not_read(meshes, iccm, name):
    name = name.format(folder=meshes.parent)
    (meshes / "x.mtl").write_text("newmtl skin\nmap_Ks inner/own.png\n")
    (meshes / "x.obj").write_text(f"mtllib x.mtl\nmtllib {name}\n" + CORNERS + FACES)
    result = iccm("relayout", "x.obj", "new.obj", "-o", "o.obj")
    assert (
        result.code == 0
        and result.err.count("refers to the material library") == 1
        and "--allow-outside" in result.err
    )
    assert not written(meshes) and "newmtl other" not in (meshes / "o.mtl").read_text()
    result = iccm("relayout", "x.obj", "new.obj", "-o", "o.obj", "--force", "--allow-outside")
    assert result.code == 0 and "--allow-outside" not in result.err
    assert not written(meshes)  # of a library that is read, only statements are


def test_a_mesh_whose_only_library_is_outside_is_refused_with_the_reason(meshes, iccm):
    (meshes / "x.obj").write_text("mtllib link.txt\n" + CORNERS + FACES)
    result = iccm("relayout", "x.obj", "new.obj", "-o", "o.obj")
    assert (
        result.code == 2
        and "have no textures" in result.err
        and "link.txt, which is outside its folder" in result.err
    )
    assert len(result.err.splitlines()) == 1


@pytest.mark.parametrize("name", ["../canary/secret.png", "inner/../../canary/secret.png", "link.png"])
def test_a_picture_outside_of_the_folder_is_not_carried(meshes, iccm, name):
    (meshes / "x.mtl").write_text(f"newmtl skin\nmap_Kd {name}\nmap_Ks inner/own.png\n")
    (meshes / "x.obj").write_text("mtllib x.mtl\n" + CORNERS + FACES)
    result = iccm("relayout", "x.obj", "new.obj", "-o", "o.obj")
    assert (
        result.code == 0 and result.err.count("allow this with --allow-outside") == 1 and not written(meshes)
    )
    assert "map_Ks o-ks.png" in (meshes / "o.mtl").read_text().splitlines()
    assert "--allow-outside" in iccm("info", "x.obj").out
    assert "--allow-outside" in iccm("flatten", "x.obj", "-o", "flat.svg", "--force").err
    result = iccm("relayout", "x.obj", "new.obj", "-o", "o.obj", "--force", "--allow-outside")
    assert result.code == 0 and "--allow-outside" not in result.err and written(meshes) == ["o-kd.png"]


@pytest.mark.slow
def test_a_mesh_as_source_shows_no_picture_from_outside(meshes, iccm):
    (meshes / "x.mtl").write_text("newmtl skin\nmap_Kd ../canary/secret.png\n")
    (meshes / "x.obj").write_text("mtllib x.mtl\n" + CORNERS + FACES)
    line = ["map", "x.obj", "new.obj", "--bake", "--size", "16", "--report", "o.json", "--force"]
    result = iccm(*line, "-o", "o.png")
    assert result.code == 2 and "--allow-outside" in result.err and not (meshes / "o.png").exists()
    result = iccm(*line, "-o", "o.png", "--allow-outside")
    hashed = [input["path"] for input in json.loads((meshes / "o.json").read_text())["inputs"]]
    assert (
        result.code == 0
        and "--allow-outside" not in result.err
        and [name for name in hashed if "canary" in name]
    )
    assert (image_files.read(meshes / "o.png").pixels[6:10, 6:10, :3] == 200).all()


def test_gltf_reads_no_file_outside_its_folder(meshes, iccm):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]], "<f4").tobytes()
    (meshes.parent / "canary" / "points.bin").write_bytes(points)
    os.symlink("../canary/points.bin", "link.bin")
    for uri in ("../canary/points.bin", "link.bin", str(meshes.parent / "canary" / "points.bin")):
        tree = {
            "asset": {"version": "2.0"},
            "buffers": [{"uri": uri, "byteLength": len(points)}],
            "bufferViews": [{"buffer": 0, "byteLength": len(points)}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        }
        (meshes / "x.gltf").write_text(json.dumps(tree))
        result = iccm("flatten", "x.gltf", "-o", "o.svg", "--force")
        assert result.code == 2 and len(result.lines) == 1 and "--allow-outside" in result.err
        assert iccm("flatten", "x.gltf", "-o", "o.svg", "--force", "--allow-outside").code == 0


def test_ply_reads_no_picture_outside_its_folder(meshes, iccm):
    text = "ply\nformat ascii 1.0\ncomment TextureFile ../canary/secret.png\nelement vertex 3\n"
    text += "".join(f"property float {name}\n" for name in "xyzst")
    text += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (meshes / "x.ply").write_text(text + "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n3 0 1 2\n")
    output = iccm("info", "x.ply").out
    assert "../canary/secret.png" in output and "--allow-outside" in output
    result = iccm("flatten", "x.ply", "--uv", "o.glb", "--carry-maps")
    assert "--allow-outside" in result.err and not written(meshes)


def test_lines_that_are_not_statements_are_removed_from_a_library(tmp_path):
    kept = [
        "newmtl a b",
        "Kd 1 1 1",
        "d -halo 0.5",
        "",
        "map_Kd -s 1 1 a b.png",
        "bump x.png",
        "illum 2",
        "Pr .5",
    ]
    left = ["# hunter2", "hunter2", "Kd hunter2", "password 12", "Ns 1 hunter2", "map hunter2", "map_kd"]
    (tmp_path / "x.mtl").write_text("\n".join([*kept, *left[:-1]]))
    library = material_library.read(tmp_path, ["x.mtl"])
    assert list(library.lines) == kept and not library.missing and not library.outside


def test_only_files_in_the_folder_may_be_read(tmp_path):
    inside, outside = tmp_path / "a" / "b.png", tmp_path / "c.png"
    assert references.may_be_read(inside, tmp_path / "a") and not references.may_be_read(
        outside, tmp_path / "a"
    )
    assert not references.may_be_read(tmp_path / "ab", tmp_path / "a")
    assert not references.may_be_read(tmp_path / "a" / "\0", tmp_path / "a")
    with references.outside(True):
        assert references.may_be_read(outside, tmp_path / "a")
    assert not references.may_be_read(outside, tmp_path / "a")
