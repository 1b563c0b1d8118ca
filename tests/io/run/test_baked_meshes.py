"""--bake with a mesh as output: its coordinates stay, and its material shows the baked picture."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests import rich_glb

pytestmark = pytest.mark.usefixtures("solve_once")

PLACES = {"apart": ((0.05, 0.1, 0.4), (0.55, 0.1, 0.4)), "mirrored": ((0.05, 0.1, 0.4), (0.45, 0.1, -0.4))}
"""Lower left corner of the charts of both halves, and their width, which is negative for a mirrored one."""


def write_halves(name, places):
    """Write an OBJ of a flat sheet of two halves, each of four squares, with a chart and a material each."""
    vertices = [f"v {x} {y} 0" for y in range(3) for x in range(5)]
    lines, coordinates = [], []
    for half, (u, v, width) in enumerate(places):
        lines.append(f"usemtl half{half}")
        for y in range(2):
            for x in range(2):
                corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
                face = []
                for a, b in corners:
                    coordinates.append(f"vt {u + width * a / 2:.4f} {v + 0.4 * b:.4f} # kept")
                    face.append(f"{5 * b + 2 * half + a + 1}/{len(coordinates)}")
                lines.append("f " + " ".join(face))
    Path(name).write_text("\n".join(["# by hand", *vertices, *coordinates, *lines]) + "\n")


@pytest.fixture
def sheet(shapes):
    for name, places in PLACES.items():
        write_halves(f"{name}.obj", places)
    red = np.linspace(20, 240, 40)[None, :] + np.zeros((40, 1))
    picture = np.stack([red, red.T, np.full_like(red, 90)], axis=2).astype(np.uint8)
    Image.fromarray(picture).save("t.png")
    normal = np.full((40, 40, 3), (180, 150, 220), np.uint8)
    Image.fromarray(normal).save("n.png")
    return shapes


@pytest.mark.slow
def test_an_obj_keeps_its_lines_and_shows_the_picture_that_is_baked_alone(sheet, iccm):
    ran = iccm(
        "map", "square.svg", "apart.obj", "--texture", "t.png", "--bake", "-o", "o.obj", "--size", "64"
    )
    assert ran.code == 0, ran.err
    assert (
        iccm(
            "map", "square.svg", "apart.obj", "--texture", "t.png", "--bake", "-o", "p.png", "--size", "64"
        ).code
        == 0
    )
    old, new = (Path(name).read_text().splitlines() for name in ("apart.obj", "o.obj"))
    assert [line for line in new if not line.startswith(("mtllib", "usemtl"))] == [
        line for line in old if not line.startswith("usemtl")
    ]
    assert "map_Kd o-texture.png" in Path("o.mtl").read_text() and f"wrote {Path('o-texture.png')}" in ran.err
    assert Path("o-texture.png").read_bytes() == Path("p.png").read_bytes()


def test_a_glb_keeps_all_but_its_material_and_normals_are_baked_too(sheet, iccm):
    points, normals, uv, faces = rich_glb.sheet(8)
    Path("old.glb").write_bytes(rich_glb.rich(points, normals, 0.1 + 0.5 * uv, faces))
    words = "--texture", "t.png", "--normal", "n.png", "--bake", "--size", "64", "-o", "o.glb"
    ran = iccm("map", "square.svg", "old.glb#body", *words)
    assert ran.code == 0, ran.err
    old, new = rich_glb.read("old.glb"), rich_glb.read("o.glb")
    for name in ("nodes", "meshes", "skins", "animations", "accessors", "scenes"):
        count = len(getattr(old, name))
        assert len(getattr(new, name)) == count and (
            name == "meshes" or getattr(old, name) == getattr(new, name)
        )
    before, after = (file.meshes[0].primitives[0].attributes for file in (old, new))
    assert vars(before) == vars(after)
    material = new.materials[new.meshes[0].primitives[0].material]
    indices = material.pbrMetallicRoughness.baseColorTexture.index, material.normalTexture.index
    colours, normal_map = (
        np.asarray(Image.open(io.BytesIO(rich_glb.picture(new, index)))).astype(int) for index in indices
    )
    assert (
        colours.shape[:2] == (64, 64) and np.ptp(colours[..., 0]) > 150 and colours[..., :3].any(axis=2).all()
    )
    # beyond the padding of four texels, normals are flat
    assert (normal_map[2, 60, :3] == (128, 128, 255)).all() and (
        normal_map[20, 20, :3] != (128, 128, 255)
    ).any()


@pytest.mark.parametrize("name", ["o.obj", pytest.param("o.png", marks=pytest.mark.slow)])
def test_mirrored_halves_are_refused_unless_they_are_meant(sheet, iccm, name):
    words = "map", "square.svg", "mirrored.obj", "--texture", "t.png", "--bake", "--size", "64", "-o", name
    ran = iccm(*words, "--report", "r.json")
    found = json.loads(Path("r.json").read_text())
    assert (ran.code, found["status"]) == (1, "stacked") and "--overlap mirror" in ran.err
    # a column where both halves meet shows the same place
    assert found["conflicting_texels"] > 0.9 * found["overlapping_texels"] > 0
    assert iccm(*words, "--overlap", "mirror", "--force").code == 0
    ran = iccm("map", "square.svg", "mirrored.obj", "--overlap", "mirror", "-o", "new.obj")
    assert ran.code == 2 and "--overlap" in ran.err


@pytest.mark.slow
def test_stacked_charts_that_show_the_same_place_are_fine(sheet, iccm):
    """A picture that is mirror symmetric, on a mesh whose texture has mirrored halves."""
    words = "mirrored.obj", "mirrored.obj", "--texture", "t.png", "--bake", "--size", "64", "-o", "o.png"
    ran = iccm("map", *words, "--report", "r.json")
    found = json.loads(Path("r.json").read_text())
    assert ran.code == 0, ran.err
    assert found["overlapping_texels"] > 100 and not found["conflicting_texels"]


def test_formats_that_contain_no_picture_are_refused(sheet, iccm):
    ran = iccm("map", "square.svg", "apart.obj", "--texture", "t.png", "--bake", "-o", "o.ply")
    assert ran.code == 2 and "o.ply" in ran.err and not Path("o.ply").exists()
