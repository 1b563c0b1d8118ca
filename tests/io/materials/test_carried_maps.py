"""--carry-maps for OBJ: with new coordinates, materials show the same at each point of the surface."""

import io

import numpy as np
import pytest
from PIL import Image

from tests import rich_glb
from tests.io.materials.test_relaid import picture, shade

pytestmark = pytest.mark.usefixtures("solve_once")

POINTS, NORMALS, UV, FACES = rich_glb.sheet(16)
LEFT = POINTS[FACES].mean(axis=1)[:, 0] < 0.5
LIBRARY = """# by hand
newmtl left side
Kd 0.8 0.8 0.8
map_Kd kd.png
map_Bump -bm 0.7 bump.png
newmtl right
map_Kd -s 0.5 0.5 1 kd.png
map_Pr grey.png
newmtl other
map_Kd kd.png
"""


def parsed(path):
    """Coordinates, and by material the vertices and coordinates (m, 3, 2) of corners, read by a few lines of Python."""
    vt, faces, material = [], {}, None
    for line in path.read_text().splitlines():
        word, _, arguments = line.partition(" ")
        if word == "vt":
            vt.append([float(x) for x in arguments.split()])
        elif word == "usemtl":
            material = arguments
        elif word == "f":
            faces.setdefault(material, []).append(
                [[int(k) - 1 for k in c.split("/")[:2]] for c in arguments.split()]
            )
    return np.array(vt), {name: np.array(corners) for name, corners in faces.items()}


def looked_up(name, uv):
    pixels = np.asarray(Image.open(name).convert("RGB")).astype(float)
    pixel = (np.column_stack([uv[:, 0], 1 - uv[:, 1]]) * pixels.shape[1::-1]).astype(int)
    return pixels[pixel[:, 1], pixel[:, 0]]


@pytest.fixture
def painted(shapes):
    rows = ["mtllib p.mtl"] + ["v {} {} {}".format(*p) for p in POINTS] + [f"vt {u} {1 - w}" for u, w in UV]
    for name, half in (("left side", LEFT), ("right", ~LEFT)):
        rows += [f"usemtl {name}"] + [
            "f " + " ".join(f"{k + 1}/{k + 1}" for k in face) for face in FACES[half]
        ]
    (shapes / "p.obj").write_text("\n".join(rows) + "\n")
    (shapes / "p.mtl").write_text(LIBRARY)
    flat = io.BytesIO()
    Image.new("RGB", (64, 64), (128, 128, 255)).save(flat, "PNG")
    contents = {"kd.png": picture(1), "bump.png": flat.getvalue(), "grey.png": picture(2, 1)}
    for name, content in contents.items():
        (shapes / name).write_bytes(content)
    return shapes


def test_pictures_of_several_materials_are_where_they_were(painted, iccm):
    result = iccm("flatten", "p.obj", "--uv", "o.obj", "--carry-maps")
    assert result.code == 0 and "old coordinates" not in result.err, result.err
    old, before = parsed(painted / "p.obj")
    new, after = parsed(painted / "o.obj")
    weights = np.array([0.5, 0.3, 0.2])
    for name, picture_name, scale in (
        ("left side", "o-left_side-Kd.png", 1.0),
        ("right", "o-right-Kd.png", 0.5),
    ):
        assert (before[name][..., 0] == after[name][..., 0]).all()
        old_uv, new_uv = (
            np.einsum("k,mkc->mc", weights, vt[f[name][..., 1]]) for vt, f in ((old, before), (new, after))
        )
        old_uv = old_uv * scale
        expected_shade = shade(np.column_stack([old_uv[:, 0], 1 - old_uv[:, 1]]), 1)
        assert (
            np.quantile(
                np.abs(looked_up(painted / picture_name.replace("Kd", "kd"), new_uv) - expected_shade), 0.99
            )
            < 8
        )
    lines = (painted / "o.mtl").read_text().splitlines()
    assert "# by hand" not in lines  # statements are kept, but not arbitrary lines
    assert "map_Bump -bm 0.7 o-left_side-bump.png" in lines
    assert "map_Kd o-right-kd.png" in lines and "map_Pr o-right-pr.png" in lines
    assert lines[-2:] == ["newmtl other", "map_Kd kd.png"]
    assert looked_up(painted / "o-left_side-bump.png", np.array([[0.5, 0.5]])).tolist() == [[128, 128, 255]]


@pytest.mark.slow
def test_a_new_texture_comes_beside_the_maps_that_are_carried(painted, iccm):
    words = ["map", "square.svg", "p.obj", "--texture", "grey.png", "-o", "o.obj"]
    result = iccm(*words)
    assert (
        "map_Bump, map_Pr of its materials still belong to the old coordinates; use --carry-maps"
        in result.err
    )
    assert iccm(*words, "--force", "--carry-maps").code == 0
    library = (painted / "o.mtl").read_text()
    assert library.count("map_Kd grey.png") == 2 and "o-right-pr.png" in library
    assert not (painted / "o-right-kd.png").exists()


def test_maps_that_cannot_be_carried_are_refused_in_one_line(painted, iccm):
    (painted / "o-right-pr.png").write_bytes(b"mine")
    for mesh, out, message in (
        ("p.obj", "o.obj", "o-right-pr.png: the file exists"),
        ("p.obj", "o.glb", "materials of p.obj (--carry-maps); use .obj"),
    ):
        result = iccm("flatten", mesh, "--uv", out, "--carry-maps")
        assert result.code == 2 and message in result.err and len(result.lines) == 1
        assert not (painted / out).exists()
    (painted / "kd.png").write_bytes(b"none")
    result = iccm("flatten", "p.obj", "--uv", "x.obj", "--carry-maps")
    assert result.code == 2 and "kd.png" in result.err and not (painted / "x.obj").exists()


@pytest.mark.slow
def test_carried_maps_are_padded_as_asked(painted, iccm):
    words = ["map", "disk.svg", "p.obj", "--texture", "grey.png", "-o", "o.obj", "--carry-maps", "--force"]
    black = []
    for texels in ("0", "-1"):
        result = iccm(*words, "--padding", texels)
        assert result.code == 0, result.err
        carried = np.asarray(Image.open(painted / "o-right-pr.png").convert("L"))
        black.append((carried == 0).mean())
    assert black[0] > 0.5 and black[1] < 0.1  # half a disk covers two fifths of the picture
