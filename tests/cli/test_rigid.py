"""Rigid regions from the command line: elements, drawn ones, masks, lists; and their errors."""

import json
import re

import numpy as np
import pytest

from iccm import load
from iccm.io.meshes import gltf
from iccm.io.pictures import image_files
from tests.cases import some_fast

pytestmark = pytest.mark.usefixtures("solve_once")

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'
LOGO = (
    '<path d="M10 10H90V90H10Z"/><rect id="{}" x="25" y="40" width="30" height="20"/>'
    '<path id="open" fill="none" d="M30 30L50 50L20 60"/>'
)


@pytest.fixture
def drawn(shapes):
    for name in ("logo", "rigid-logo"):
        (shapes / f"{name}.svg").write_text(SVG.format(LOGO.format(name)))
    mask = np.zeros((200, 200, 3), np.uint8)
    mask[80:120, 50:110] = 255
    image_files.write("mask.png", image_files.Image(mask))
    image_files.write("black.png", image_files.Image(0 * mask))
    polygon = [[25, 40], [55, 40], [55, 60], [25, 60]]
    (shapes / "listed.json").write_text(json.dumps({"rigid": [polygon]}))
    return shapes


@pytest.mark.slow
@pytest.mark.parametrize(
    "typed",
    [
        ("logo.svg", "--rigid", "#logo"),
        ("rigid-logo.svg",),
        ("square.svg", "--rigid", "mask.png"),
        ("square.svg", "--constraints", "listed.json"),
    ],
)
def test_a_region_can_be_given_in_four_ways(drawn, iccm, typed):
    source, *more = typed
    result = iccm("map", source, "blob.svg", *more, "--report", "r.json", "--stmap", "o.tif", "--size", "100")
    report = json.loads((drawn / "r.json").read_text())
    assert result.code == 0 and len(report["regions"]) == 1
    (region,) = report["regions"]
    assert region["dilatation"] <= 1.02 and region["scale"] == pytest.approx(1, abs=0.02)
    st = image_files.read("o.tif").pixels[..., :2].astype(float)
    s, t = st[..., 0], 1 - st[..., 1]  # of the source's canvas, from its upper left corner
    inside = (s > 0.3) & (s < 0.5) & (t > 0.44) & (t < 0.56) & (image_files.read("o.tif").pixels[..., 3] == 1)
    step = np.diff(s, axis=1)[inside[:, 1:] & inside[:, :-1]]
    assert step.size > 50 and np.ptp(step) <= 0.02 * step.mean()  # squares stay upright squares of equal size
    across = np.diff(t, axis=1)[inside[:, 1:] & inside[:, :-1]]
    assert np.abs(across).max() <= 0.02 * step.mean()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("typed", "message"),
    [
        (("logo.svg", "--rigid", "#nothing"), "--rigid #nothing: no such element in logo.svg"),
        (("logo.svg", "--rigid", "#open"), "--rigid #open: "),
        (("square.svg", "--rigid", "black.png"), "contains no white"),
        (("square.svg", "--rigid", "none.png"), "none.png"),
        (("square.svg", "--rigid", "mask.png", "--rigid-size", "tiny"), "'tiny' is not a factor"),
        (("square.svg", "--rigid", "mask.png", "--rigid-size", "3"), "rigid_size: region 1 "),
        (("square.svg", "--rigid", "mask.png", "--parts", "all"), "--rigid only works for one shape"),
    ],
)
def test_wrong_regions_are_refused_in_one_line(drawn, iccm, typed, message):
    result = iccm("map", typed[0], "blob.svg", *typed[1:], "-o", "o.png", "--size", "50")
    assert result.code == 2 and message in result.err and not (drawn / "o.png").exists()
    assert len(result.err.strip().splitlines()) <= 2


WORD = '<path d="M5 5H95V95H5Z"/><g id="word" fill="#fff">{}</g>'
LETTERS = '<path d="M20 40h10v20H20z"/><circle cx="45" cy="50" r="8"/><path d="M60 45h16v15H60z"/>'


@pytest.mark.slow
def test_a_group_moves_as_one_body_and_each_part_by_itself_if_requested(drawn, iccm):
    (drawn / "word.svg").write_text(SVG.format(WORD.format(LETTERS)))
    arguments = "word.svg", "blob.svg", "--rigid", "#word", "-o", "m.npz", "--report", "r.json"
    places = np.array([21 - 41j, 29 - 59j, 45 - 50j, 61 - 46j, 75 - 59j])
    errors = []
    for more in ([], ["--rigid-each"]):
        result = iccm("map", *arguments, "--force", *more)
        assert result.code == 0, result.err
        regions = json.loads((drawn / "r.json").read_text())["regions"]
        assert len(regions) == (3 if more else 1)
        images = load("m.npz").map(places)
        similarity = np.polyfit(places, images, 1)
        errors.append(np.abs(np.polyval(similarity, places) - images).max())
    assert errors[0] < 0.01 * 55 < 20 * errors[1]


def test_elements_named_rigid_in_a_target_get_a_note(drawn, iccm):
    result = iccm("map", "square.svg", "rigid-logo.svg", "--size", "32", "-o", "o.png")
    assert result.code == 0 and "rigid-logo.svg: elements named rigid in the target are ignored" in result.err


@pytest.mark.slow
def test_brighter_parts_become_larger_and_important_ones_stay(drawn, iccm):
    ramp = np.repeat(np.linspace(0, 255, 64).astype(np.uint8)[None, :, None], 64, axis=0)
    image_files.write("ramp.png", image_files.Image(np.repeat(ramp, 3, axis=2)))
    common = ("square.svg", "square.svg", "--balance", "4", "--stmap")
    result = iccm(
        "map", *common, "o.tif", "--size-map", "ramp.png", "--importance", "mask.png", "--size", "100"
    )
    assert result.code == 0, result.err
    s = image_files.read("o.tif").pixels[50, 12:88, 0].astype(float)
    steps = np.diff(s)
    assert (
        1.4 < steps[:10].mean() / steps[-10:].mean() < 2
    )  # not 1.1 and 1.9, for the canvas' ends of the square


@pytest.mark.parametrize("option", ["--importance", "--size-map"])
def test_unusable_pictures_are_refused(drawn, iccm, option):
    wrong = {"none.png": "none.png", "black.png": "everywhere"}
    for name, message in wrong.items():
        result = iccm("map", "square.svg", "blob.svg", option, name, "-o", "o.png", "--size", "50")
        if option == "--importance" or name == "none.png":
            assert result.code == 2 and message in result.err and not (drawn / "o.png").exists()
    result = iccm("map", "square.svg", "blob.svg", option, "mask.png", "--parts", "all")
    assert result.code == 2 and f"{option} only works for one shape" in result.err


def test_a_drawn_bone_stays_straight_while_an_arm_bends(shapes, iccm):
    arm = '<path d="M5 40H95V60H5Z"/><rect id="rigid-forearm" x="55" y="42" width="38" height="16"/>'
    (shapes / "arm.svg").write_text(SVG.format(arm))
    result = iccm(
        *("deform", "arm.svg", "--pin", "10,50:10,50", "--pin", "30,50:30,50"),
        *("--pin", "90,50:60,10", "--report", "r.json", "-o", "o.png", "--size", "60"),
    )
    (region,) = json.loads((shapes / "r.json").read_text())["regions"]
    assert result.code == 0 and region["dilatation"] <= 1.02
    assert 40 < region["turn"] < 110 and region["size"]["p95"] < 1.02 * region["size"]["p05"] * 1.02


@pytest.mark.slow
def test_grey_in_a_mask_is_partly_rigid(drawn, iccm):
    y, x = np.mgrid[:200, :200]
    away = np.hypot(x - 80, y - 100) / 70
    white = away < 0.3
    worst = []
    for name, grey in (("plain.png", 0), ("grey.png", 115)):
        mask = np.where(white, 255, np.where(away < 1, grey, 0)).astype(np.uint8)
        image_files.write(name, image_files.Image(np.repeat(mask[..., None], 3, axis=2)))
        result = iccm("map", "square.svg", "blob.svg", "--rigid", name, "-o", name.replace("png", "npz"))
        assert result.code == 0, result.err
        fit = load(name.replace("png", "npz"))
        middles = fit.map.source[fit.map.faces].mean(axis=1)
        low, high = fit.source.box
        scale = (high - low).real / 80  # the square is drawn from 10 to 90
        distance = np.abs(middles - (low + scale * (30 + 40j))) / scale
        worst.append(np.quantile(fit.triangles.dilatations[(distance > 12) & (distance < 30)], 0.95) - 1)
        assert fit.rigid[0].is_rigid
    assert worst[1] < 0.9 * worst[0]


def pipe(n=25, m=17):
    """A quarter of a pipe as OBJ, with a label in the middle: a group, and a material with another name."""
    x, y = np.meshgrid(np.linspace(0, 2, n), np.linspace(0, 1, m), indexing="ij")
    k = 1 + np.arange(n * m).reshape(n, m)
    lines = [f"v {np.cos(a)} {b} {-np.sin(a)}" for a, b in zip(x.ravel(), y.ravel())]
    for name, material, kept in (("rest", "steel", False), ("label", "paper", True)):
        lines += [f"g {name}", f"usemtl {material}"]
        for i, j in np.ndindex(n - 1, m - 1):
            if (8 <= i < 16 and 6 <= j < 11) == kept:
                lines.append(f"f {k[i, j]} {k[i + 1, j]} {k[i + 1, j + 1]} {k[i, j + 1]}")
    return "\n".join(lines) + "\n"


def pipe_glb(path):
    """The same as GLB: one mesh with a primitive for each material, beside another, larger mesh."""
    lines = [line.split() for line in pipe().splitlines()]
    points = np.array([line[1:] for line in lines if line[0] == "v"], float)
    faces: list[list] = []
    for word, *arguments in lines:
        if word == "usemtl":
            faces.append([])
        elif word == "f":
            a, b, c, d = (int(index) - 1 for index in arguments)
            faces[-1] += [[a, b, c], [a, c, d]]
    views: list[bytes] = []
    tree: dict = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": []}

    def accessor(values, component, kind):
        description = {
            "bufferView": len(views),
            "componentType": component,
            "count": len(values),
            "type": kind,
        }
        if kind == "VEC3":
            description |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        tree["bufferViews"].append({"buffer": 0, "byteLength": values.nbytes})
        tree["accessors"].append(description)
        views.append(values.tobytes())
        return len(views) - 1

    primitives = []
    for material, material_faces in enumerate(faces):
        used, number = np.unique(material_faces, return_inverse=True)
        position = accessor(points[used].astype(np.float32), 5126, "VEC3")
        indices = accessor(number.ravel().astype(np.uint32), 5125, "SCALAR")
        primitives.append({"attributes": {"POSITION": position}, "indices": indices, "material": material})
    lid = accessor(9 * np.eye(3, dtype=np.float32), 5126, "VEC3")
    tree["meshes"] = [
        {"name": "pipe", "primitives": primitives},
        {"name": "lid", "primitives": [{"attributes": {"POSITION": lid}}]},
    ]
    tree["materials"] = [{"name": "steel"}, {"name": "paper"}]
    tree["nodes"], tree["scenes"] = [{"mesh": 0}, {"mesh": 1}], [{"nodes": [0, 1]}]
    path.write_bytes(gltf.glb(tree, views))


@pytest.mark.slow
@pytest.mark.parametrize("name", some_fast(["#paper", "#pipe_1"], 1))
def test_a_material_of_a_glb_is_a_region_like_that_of_an_obj(drawn, iccm, name):
    (drawn / "pipe.obj").write_text(pipe())
    pipe_glb(drawn / "pipe.glb")
    regions = []
    for source, region in (("pipe.obj", "#paper"), ("pipe.glb#pipe", name)):
        common = ("--report", "r.json", "--stmap", "o.tif", "--size", "60", "--force")
        result = iccm("map", source, "blob.svg", "--rigid", region, *common)
        assert result.code == 0, result.err
        regions += json.loads((drawn / "r.json").read_text())["regions"]
    obj, glb = regions
    for key in ("dilatation", "scale"):  # positions in a GLB have single precision
        assert glb[key] == pytest.approx(obj[key], abs=2e-3)
    assert "1 geometry of other meshes" in result.err


@pytest.mark.parametrize(
    ("source", "message"),
    [("pipe.glb#pipe", "'paper', 'pipe', 'pipe_1', 'steel'"), ("pipe.glb", "'lid'")],
)
def test_a_name_that_a_glb_has_not_is_refused_with_those_that_it_has(drawn, iccm, source, message):
    pipe_glb(drawn / "pipe.glb")
    result = iccm("map", source, "blob.svg", "--rigid", "#label", "-o", "o.png", "--size", "50")
    assert result.code == 2 and "--rigid #label: " in result.err and result.err.rstrip().endswith(message)
    assert "geometry or material" in result.err


@pytest.mark.slow
@pytest.mark.parametrize("region", ["#label", "#paper", "whole.png"])
def test_nothing_is_bent_on_a_region_of_a_mesh(drawn, iccm, region):
    (drawn / "pipe.obj").write_text(pipe())
    white = np.zeros((100, 100, 3), np.uint8)
    white[36:62, 34:66] = 255  # of its layout, which lies unchanged
    image_files.write("whole.png", image_files.Image(white))
    common = ("--texture", "mask.png", "-o", "uv.obj", "--report", "r.json")
    result = iccm("map", "blob.svg", "pipe.obj", "--rigid-target", region, *common)
    assert result.code == 0, result.err
    (reported,) = json.loads((drawn / "r.json").read_text())["regions"]
    assert reported["of"] == "target" and reported["dilatation"] <= 1.02
    lines = (drawn / "uv.obj").read_text().splitlines()
    v, vt = (
        np.array([line.split()[1:] for line in lines if line.split()[0] == key], float) for key in ("v", "vt")
    )
    label = lines.index("g label")
    faces = [
        [corner.split("/")[:2] for corner in line.split()[1:]] for line in lines[label:] if line[0] == "f"
    ]
    corners = np.array(faces, int) - 1
    # edges in the picture relative to those in space; without the label's outermost quads, which the mask cuts
    space, flat = (
        np.linalg.norm(np.diff(p[corners[..., k]][:, [0, 1, 2, 3, 0]], axis=1), axis=2)
        for k, p in enumerate((v, vt[:, :2]))
    )
    inner = np.isin(corners[..., 0], np.flatnonzero(np.bincount(corners[..., 0].ravel()) == 4)).all(axis=1)
    ratio = (flat / space)[inner]
    assert inner.sum() == 6 * 3 and np.ptp(ratio) <= 0.03 * ratio.mean()


def test_a_group_of_a_mesh_keeps_its_form_in_a_drawing(drawn, iccm):
    (drawn / "pipe.obj").write_text(pipe())
    result = iccm(
        "map",
        "pipe.obj",
        "blob.svg",
        "--rigid",
        "#label",
        "--stmap",
        "o.tif",
        "--size",
        "60",
        "--report",
        "r.json",
    )
    assert result.code == 0, result.err
    (region,) = json.loads((drawn / "r.json").read_text())["regions"]
    assert (
        region["dilatation"] <= 1.02 and region["scale"] == pytest.approx(1, abs=0.02) and "of" not in region
    )


@pytest.mark.slow
def test_a_region_of_a_mesh_without_room_is_smaller_and_reported(drawn, iccm):
    (drawn / "pipe.obj").write_text(pipe())
    (drawn / "bar.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 400 10"><rect width="400" height="10"/></svg>'
    )
    common = ("--rigid", "#label", "--stmap", "o.tif", "--size", "60", "--report", "r.json")
    result = iccm("map", "pipe.obj", "bar.svg", *common)
    assert result.code == 0 and re.search(r"region 1 .*mapped at 0\.\d\d", result.err)
    (region,) = json.loads((drawn / "r.json").read_text())["regions"]
    label = 5 / 16 * np.sqrt(400 * 10 / (2 * 1))  # its height at the mean scale
    assert region["dilatation"] <= 1.02 and 0.5 * 10 / label < region["scale"] < 10 / label


@pytest.mark.slow
def test_an_element_of_a_target_is_kept(drawn, iccm):
    result = iccm(
        "map", "blob.svg", "rigid-logo.svg", "--rigid-target", "mask.png", "--report", "r.json", "-o", "o.npz"
    )
    assert result.code == 0, result.err
    # the mask's region, and those drawn as rigid
    regions = json.loads((drawn / "r.json").read_text())["regions"]
    assert all(region["of"] == "target" and region["dilatation"] <= 1.02 for region in regions)
    again = load("o.npz").report()["regions"]
    assert again == regions


@pytest.mark.parametrize(
    ("source", "target", "typed", "message"),
    [
        ("pipe.obj", "blob.svg", ("--rigid", "#lid"), "no part 'lid'"),
        (
            "blob.svg",
            "pipe.obj",
            ("--rigid", "mask.png"),
            "rigid_target, ",
        ),
        (
            "pipe.obj",
            "blob.svg",
            ("--rigid-target", "mask.png"),
            " rigid, ",
        ),
        (
            "square.svg",
            "blob.svg",
            ("--rigid", "mask.png", "--rigid-target", "mask.png"),
            "rigid, rigid_target: ",
        ),
        ("square.svg", "blob.svg", ("--rigid-target", "#no"), "--rigid-target #no: "),
        (
            "square.svg",
            "blob.svg",
            ("--rigid-target", "mask.png", "--size-map", "mask.png"),
            "rigid_target: ",
        ),
        (
            "square.svg",
            "blob.svg",
            ("--rigid-target", "mask.png", "--parts", "all"),
            "--rigid-target only works for one",
        ),
    ],
)
def test_regions_that_are_not_kept_are_refused_in_a_line(drawn, iccm, source, target, typed, message):
    (drawn / "pipe.obj").write_text(pipe())
    output = "o.obj" if target == "pipe.obj" else "o.png"
    texture = () if source == "pipe.obj" else ("--texture", "mask.png")
    result = iccm("map", source, target, *typed, *texture, "-o", output, "--size", "50")
    assert result.code == 2 and message in result.err and not (drawn / output).exists()
