"""All that a material shows in another layout: pictures against formulas, the rest as pygltflib sees it."""

import io
import json
from copy import deepcopy

import numpy as np
import pygltflib as gl
import pytest
from matplotlib.tri import LinearTriInterpolator, Triangulation
from PIL import Image

from iccm.io.meshes import mesh_files
from tests import rich_glb
from tests.io.meshes.test_gltf import body, bumps, corners, lit, whole

pytestmark = pytest.mark.usefixtures("solve_once")

N = 256
POINTS, NORMALS, UV, FACES = rich_glb.sheet(16)
C, S = np.cos(0.5), np.sin(0.5)
TURNED = (UV - 0.5) * 0.6 @ np.array([[C, -S], [S, C]]) + 0.5
LEFT = POINTS[FACES].mean(axis=1)[:, 0] < 0.5
BENT = TURNED + 0.02 * np.column_stack([np.sin(4 * UV[:, 1]), np.cos(3 * UV[:, 0])])


def shade(uv, seed):
    """(…, 3) in 0 … 255 at coordinates of the old layout."""
    u, v = uv[..., 0], uv[..., 1]
    waves = (np.sin((5 + k) * u + seed) + np.cos((4 + k + seed) * v) for k in range(3))
    return 127 + 50 * np.stack(list(waves), axis=-1)


def texels():
    t = (np.arange(N) + 0.5) / N
    return np.stack(np.meshgrid(t, t), axis=-1)


def picture(seed, channels=3):
    stream = io.BytesIO()
    pixels = shade(texels(), seed).round().astype(np.uint8)
    Image.fromarray(pixels if channels == 3 else pixels[..., 0]).save(stream, "PNG")
    return stream.getvalue()


def expected_pixels(uv, seed):
    """The expected picture in another layout (n, 2), v down; NaN outside: matplotlib finds where texels lie."""
    mesh = Triangulation(*uv.T, FACES)
    old = np.stack(
        [LinearTriInterpolator(mesh, w)(*np.moveaxis(texels(), -1, 0)).filled(np.nan) for w in UV.T], -1
    )
    return shade(old, seed)


def off(actual, uv, seed, channels=(0, 1, 2)):
    """The share of texels inside charts that are off by more than 8 of 255."""
    right = expected_pixels(uv, seed)[..., list(channels)]
    inside = np.isfinite(right).all(axis=-1)
    assert inside.sum() > 0.2 * N * N
    return (np.abs(actual.astype(float)[inside] - right[inside]) > 8).any(axis=-1).mean()


def pixels(content):
    return np.asarray(Image.open(io.BytesIO(content)))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with old.glb and new.glb, the same surface in two layouts, and the same as OBJ."""
    monkeypatch.chdir(tmp_path)
    more = {"colour": picture(1), "rough": picture(2), "occlusion": picture(3), "light": picture(4)}
    (tmp_path / "old.glb").write_bytes(rich_glb.rich(POINTS, NORMALS, UV, FACES, bumps(), **more))
    (tmp_path / "new.glb").write_bytes(rich_glb.rich(POINTS, NORMALS, BENT, FACES))
    write_obj(tmp_path / "old.obj", UV, "mtllib old.mtl\n", "usemtl cloth\n")
    write_obj(tmp_path / "new.obj", BENT)
    names = {"kd.png": picture(1), "bump.png": bumps(), "pr.png": picture(2, 1), "ks.png": picture(3)}
    for name, content in names.items():
        (tmp_path / name).write_bytes(content)
    (tmp_path / "old.mtl").write_text(
        "newmtl cloth\nKd 0.8 0.8 0.8\nPm 0.5\nmap_Kd kd.png\nmap_Bump -bm 0.7 bump.png\nmap_Pr pr.png\nmap_Ks ks.png\n"
    )
    return tmp_path


def write_obj(path, uv, head="", use=""):
    rows = ["v {} {} {}".format(*p) for p in POINTS] + [f"vt {u} {1 - v}" for u, v in uv]
    rows += ["vn {} {} {}".format(*n) for n in NORMALS]
    faces = ["f " + " ".join(f"{k + 1}/{k + 1}/{k + 1}" for k in face) for face in FACES]
    path.write_text(head + "\n".join(rows) + "\n" + use + "\n".join(faces) + "\n")


def material_set_of(file, number=0):
    return file.materials[number]


def test_all_maps_of_a_glb_go_into_another_layout_and_the_rest_of_it_stays(folder, iccm):
    result = iccm("relayout", "old.glb", "new.glb", "-o", "out.glb", "--size", N, "--report", "r.json")
    assert result.code == 0, result.err
    assert json.loads((folder / "r.json").read_text())["same_triangles"] == len(FACES)
    old, new, out = (rich_glb.read(folder / name) for name in ("old.glb", "new.glb", "out.glb"))
    whole(new, out)
    before, after = corners(new, body(new)), corners(out, body(out))
    assert set(before) == set(after) and all((values == after[name]).all() for name, values in before.items())
    material_set, was = material_set_of(out), material_set_of(old)
    rough = material_set.pbrMetallicRoughness
    for info, seed in (
        (rough.baseColorTexture, 1),
        (rough.metallicRoughnessTexture, 2),
        (material_set.occlusionTexture, 3),
        (material_set.emissiveTexture, 4),
    ):
        assert off(pixels(rich_glb.picture(out, info.index)), BENT, seed) <= 0.005
    assert rough.baseColorFactor == was.pbrMetallicRoughness.baseColorFactor
    assert (material_set.occlusionTexture.strength, material_set.emissiveFactor) == (0.8, [1.0, 0.5, 0.5])
    assert len(out.images) == len(out.textures) == 5
    assert out.materials[1] == new.materials[1]


def test_normals_look_the_same_in_space(folder, iccm):
    assert iccm("relayout", "old.glb", "new.glb#body", "-o", "out.glb", "--size", N).code == 0
    old, out = (rich_glb.read(folder / name) for name in ("old.glb", "out.glb"))
    for weights in ([0.6, 0.3, 0.1], [1 / 3, 1 / 3, 1 / 3]):
        cosine = np.einsum("mi,mi->m", lit(old, weights), lit(out, weights))
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        assert np.median(angle) < 1 and angle.max() < 3


def test_a_given_texture_replaces_that_of_the_material(folder, iccm):
    (folder / "mine.png").write_bytes(picture(7))
    result = iccm(
        "relayout", "old.glb", "new.glb", "--texture", "mine.png", "-o", "out.glb", "--size", str(N)
    )
    assert result.code == 0, result.err
    out = rich_glb.read(folder / "out.glb")
    colours = rich_glb.picture(out, material_set_of(out).pbrMetallicRoughness.baseColorTexture.index)
    assert off(pixels(colours), BENT, 7) <= 0.005
    assert off(pixels(rich_glb.picture(out, material_set_of(out).emissiveTexture.index)), BENT, 4) <= 0.005


def test_materials_of_an_obj_become_those_of_a_glb(folder, iccm):
    result = iccm("relayout", "old.obj", "new.glb#body", "-o", "out.glb", "--size", N)
    assert result.code == 0, result.err
    assert "map_ks: dropped, because the other format" in result.err
    new, out = (rich_glb.read(folder / name) for name in ("new.glb", "out.glb"))
    whole(new, out)
    material_set = material_set_of(out)
    rough = material_set.pbrMetallicRoughness
    assert off(pixels(rich_glb.picture(out, rough.baseColorTexture.index)), BENT, 1) <= 0.005
    packed = pixels(rich_glb.picture(out, rough.metallicRoughnessTexture.index))
    assert off(packed[..., [1]], BENT, 2, channels=[0]) <= 0.005
    assert rough.metallicFactor == 0.5 and (packed[..., 2][packed[..., 1] > 0] == 255).all()
    old = rich_glb.read(folder / "old.glb")
    cosine = np.einsum("mi,mi->m", lit(old, [0.6, 0.3, 0.1]), lit(out, [0.6, 0.3, 0.1]))
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 3


@pytest.mark.parametrize("out", ["out.obj", "out.glb"])
@pytest.mark.parametrize("old", ["old.obj", "old.glb"])
def test_an_obj_gets_materials(folder, iccm, old, out):
    lines = (folder / "new.obj").read_text().splitlines()
    without_vertex_colours(folder / "old.glb")
    result = iccm("relayout", old, "new.obj", "-o", out, "--size", N)
    assert result.code == 0, result.err
    if out == "out.glb":
        file = rich_glb.read(folder / out)
        assert len(corners(file, body(file))["NORMAL"]) == FACES.size
        colours = pixels(
            rich_glb.picture(file, material_set_of(file).pbrMetallicRoughness.baseColorTexture.index)
        )
    else:
        written = (folder / out).read_text().splitlines()
        assert [line for line in written if line not in ("mtllib out.mtl", "usemtl iccm")] == lines
        colours = pixels(next(map(lambda p: p.read_bytes(), mesh_files.read(out).textures())))
        library = (folder / "out.mtl").read_text()
        assert ("map_Bump -bm 0.7 out-bump.png" if old == "old.obj" else "map_Pm out-pm.png") in library
        for line in library.splitlines():
            assert not line.endswith(".png") or (folder / line.split()[-1]).is_file()
    assert off(colours, BENT, 1) <= 0.005


def test_a_mesh_at_another_place_is_refused_without_files(folder, iccm):
    lines = (folder / "new.obj").read_text().splitlines()
    bent = [line if line[:2] != "v " else f"v {k} {k * k % 97} {k % 13}" for k, line in enumerate(lines)]
    # One face fewer: the order says nothing either.
    (folder / "new.obj").write_text("\n".join(bent[:-1]) + "\n")
    before = {path.name for path in folder.iterdir()}
    result = iccm("relayout", "old.obj", "new.obj", "-o", "out.obj", "--size", 16, "--match", "position")
    assert result.code == 2 and "no part of it matches" in result.err
    assert {path.name for path in folder.iterdir()} == before


def test_a_material_that_gets_a_bump_map_of_another_shows_it_fully(folder, iccm):
    """Blender takes a bump map without -bm as one of strength 0."""
    new = (folder / "new.obj").read_text().splitlines()
    first = next(k for k, line in enumerate(new) if line.startswith("f "))
    (folder / "new.obj").write_text("\n".join(["mtllib old.mtl", *new[:first], "usemtl cloth", *new[first:]]))
    library = (folder / "old.mtl").read_text()
    (folder / "old.mtl").write_text(library + "newmtl bare\nKd 1 1 1\n")
    old = (folder / "old.obj").read_text().splitlines()
    half = [k for k, line in enumerate(old) if line.startswith("f ")]
    old.insert(half[len(half) // 5], "usemtl bare")
    (folder / "old.obj").write_text("\n".join(old))
    (folder / "new.obj").write_text((folder / "new.obj").read_text().replace("usemtl cloth", "usemtl bare"))
    result = iccm("relayout", "old.obj", "new.obj", "-o", "out.obj", "--size", N)
    assert result.code == 0, result.err
    assert "map_Bump -bm 1 out-bump.png" in (folder / "out.mtl").read_text()


@pytest.mark.parametrize(
    ("bare", "plain"), [(False, False), (True, False), (False, True)]
)  # whether what is plain green has coordinates; whether no colours are in pictures
def test_several_materials_become_one_with_their_factors(folder, iccm, bare, plain):
    """Half of the old surface shows a picture times red, and the other half plain green."""
    make, file, halves = in_halves(folder)
    material_set = file.materials[0]
    material_set.normalTexture = material_set.occlusionTexture = material_set.emissiveTexture = None
    material_set.emissiveFactor = [0, 0, 0]
    dropped = "baseColorTexture" if plain else "metallicRoughnessTexture"
    setattr(material_set.pbrMetallicRoughness, dropped, None)
    material_set.pbrMetallicRoughness.baseColorFactor = [1, 0.25, 0.25, 1]
    green = gl.PbrMetallicRoughness(baseColorFactor=[0, 0.5, 0, 1])
    file.materials[1] = gl.Material(name="green", pbrMetallicRoughness=green)
    sheet, hat = file.meshes[0].primitives[0], file.meshes[1].primitives[0]
    sheet.indices = halves[0]
    attributes = gl.Attributes(POSITION=sheet.attributes.POSITION) if bare else sheet.attributes
    file.meshes[0].primitives.append(gl.Primitive(attributes=attributes, indices=halves[1], material=1))
    hat.material = None
    file.buffers.clear()
    (folder / "two.glb").write_bytes(make.bytes())
    result = iccm("relayout", "two.glb", "new.glb#body", "-o", "out.glb", "--size", N)
    assert result.code == 0, result.err
    out = rich_glb.read(folder / "out.glb")
    rough = material_set_of(out).pbrMetallicRoughness
    assert rough.baseColorFactor == [1, 1, 1, 1]
    colours = pixels(rich_glb.picture(out, rough.baseColorTexture.index)).astype(float)
    expected = np.full_like(colours, 255) if plain else expected_pixels(BENT, 1)
    centres = np.stack(
        [
            LinearTriInterpolator(Triangulation(*BENT.T, FACES), POINTS[:, 0])(
                *np.moveaxis(texels(), -1, 0)
            ).filled(np.nan)
        ]
    )[0]
    red, green = (centres < 0.49), (centres > 0.51)
    linear = lambda v: np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)  # noqa: E731
    assert (np.abs(colours[red] - expected[red])[:, 0] > 8).mean() <= 0.005
    assert np.abs(linear(colours[red][:, 1] / 255) - 0.25 * linear(expected[red][:, 1] / 255)).max() < 0.03
    assert (np.abs(linear(colours[green] / 255) - [0, 0.5, 0]) < 0.01).all()


def without_vertex_colours(path):
    """Those would multiply the pictures, since an OBJ has none."""
    file = rich_glb.read(path)
    file.meshes[0].primitives[0].attributes.COLOR_0 = None
    file.save_binary(str(path))


def in_halves(folder):
    """old.glb as a builder and a file, and the indices of its left half and its right."""
    make, file = rich_glb.Builder(), rich_glb.read(folder / "old.glb")
    make.file, make.data = file, file.binary_blob()
    return (
        make,
        file,
        [make.accessor(FACES[half].astype(np.uint16).reshape(-1, 1), "SCALAR") for half in (LEFT, ~LEFT)],
    )


def write_halves(folder, make, file, halves):
    """two.glb, whose first mesh has a primitive of each half and the first two materials."""
    left = file.meshes[0].primitives[0]
    file.meshes[1].primitives[0].material = None
    left.indices = halves[0]
    file.meshes[0].primitives.append(gl.Primitive(attributes=left.attributes, indices=halves[1], material=1))
    file.buffers.clear()
    (folder / "two.glb").write_bytes(make.bytes())


@pytest.fixture
def clear(folder):
    """two.glb: its left half an opaque material, its right half one of a mask, both of the same picture with alpha."""
    without_vertex_colours(folder / "old.glb")
    make, file, halves = in_halves(folder)
    png, opacity = io.BytesIO(), np.where(texels()[..., 0] < 0.5, 100, 150)
    rgba = np.dstack([shade(texels(), 1).round(), opacity]).astype(np.uint8)
    Image.fromarray(rgba).save(png, "PNG")
    texture_info = gl.TextureInfo(index=make.texture(png.getvalue()))
    for k, (name, mode) in enumerate((("wall", "OPAQUE"), ("leaf", "MASK"))):
        cutoff = 0.5 if mode == "MASK" else None
        look = gl.PbrMetallicRoughness(baseColorTexture=texture_info)
        file.materials[k] = gl.Material(
            name=name, alphaMode=mode, alphaCutoff=cutoff, pbrMetallicRoughness=look
        )
    write_halves(folder, make, file, halves)
    return folder


def test_opaque_and_transparent_parts_stay_separate_materials(clear, iccm):
    """The new mesh is one primitive."""
    result = iccm("relayout", "two.glb", "new.glb#body", "-o", "out.glb", "--size", N)
    (note,) = [line for line in result.lines if "out.glb" in line and "2 materials" in line]
    assert result.code == 0 and "transparency" in note and note.count("differ") == 1, result.err
    out = rich_glb.read(clear / "out.glb")
    parts = [p for p in out.meshes[0].primitives]
    assert {out.materials[p.material].alphaMode for p in parts} == {"OPAQUE", "MASK"}
    seen = []
    for part in parts:
        material = out.materials[part.material]
        centres = corners(out, part)["POSITION"].reshape(-1, 3, 3).mean(axis=1)
        assert ((centres[:, 0] < 0.5) == (material.alphaMode == "OPAQUE")).all()
        colours = pixels(rich_glb.picture(out, material.pbrMetallicRoughness.baseColorTexture.index))
        assert colours.shape[2] == (3 if material.alphaMode == "OPAQUE" else 4)
        seen.append(len(centres))
    assert sum(seen) == len(FACES) and min(seen) > 0


@pytest.mark.parametrize(("factor", "cutoff"), [(1, 0.5), (0.5, 0.25)])
def test_the_picture_of_an_obj_determines_its_opacity(clear, iccm, factor, cutoff):
    file = rich_glb.read(clear / "two.glb")
    file.materials[1].pbrMetallicRoughness.baseColorFactor = [1, 1, 1, factor]
    file.materials[1].alphaCutoff = cutoff
    file.save_binary(str(clear / "two.glb"))
    result = iccm("relayout", "two.glb", "new.obj", "-o", "out.obj", "--size", N)
    assert result.code == 0, result.err
    library = (clear / "out.mtl").read_text()
    assert "map_d out-d.png" in library
    cover, kd = (np.asarray(Image.open(clear / f"out-{word}.png")) for word in ("d", "kd"))
    uv = np.stack(
        [
            LinearTriInterpolator(Triangulation(*BENT.T, FACES), values)(
                *np.moveaxis(texels(), -1, 0)
            ).filled(np.nan)
            for values in (POINTS[:, 0], UV[:, 0])
        ]
    )
    left, right, low = uv[0] < 0.45, uv[0] > 0.55, uv[1] < 0.47
    assert (
        (cover[left] == 255).all()
        and (cover[right & low] == 0).all()
        and (cover[right & (uv[1] > 0.53)] == 255).all()
    )
    assert (np.abs(kd.astype(float) - expected_pixels(BENT, 1))[left] > 8).mean() <= 0.005


def test_materials_whose_normals_are_scaled_differently_stay_apart(folder, iccm):
    make, file, halves = in_halves(folder)
    file.materials[1] = deepcopy(file.materials[0])
    file.materials[0].normalTexture.scale, file.materials[1].normalTexture.scale = 0.8, 0.4
    write_halves(folder, make, file, halves)
    result = iccm("relayout", "two.glb", "new.glb#body", "-o", "out.glb", "--size", N)
    assert result.code == 0 and "has 2 materials" in result.err, result.err
    out = rich_glb.read(folder / "out.glb")
    scales = [out.materials[part.material].normalTexture.scale for part in out.meshes[0].primitives]
    assert sorted(scales) == [0.4, 0.8]


def test_colours_under_alpha_0_are_visible_where_a_material_is_opaque(folder, iccm):
    make, file, _ = in_halves(folder)
    stream = io.BytesIO()
    rgba = np.dstack([shade(texels(), 1).round(), np.zeros((N, N))]).astype(np.uint8)
    Image.fromarray(rgba).save(stream, "PNG")
    file.materials[0] = gl.Material(
        pbrMetallicRoughness=gl.PbrMetallicRoughness(
            baseColorTexture=gl.TextureInfo(index=make.texture(stream.getvalue()))
        )
    )
    file.buffers.clear()
    (folder / "old.glb").write_bytes(make.bytes())
    assert iccm("relayout", "old.glb", "new.glb#body", "-o", "out.glb", "--size", N).code == 0
    out = rich_glb.read(folder / "out.glb")
    colours = rich_glb.picture(out, out.materials[0].pbrMetallicRoughness.baseColorTexture.index)
    assert off(pixels(colours)[..., :3], BENT, 1) <= 0.005


def test_materials_of_an_obj_keep_their_opacity(folder, iccm):
    old = (folder / "old.obj").read_text().splitlines()
    half = [k for k, line in enumerate(old) if line.startswith("f ")]
    old.insert(half[len(half) // 2], "usemtl glass")
    (folder / "old.obj").write_text("\n".join(old))
    with (folder / "old.mtl").open("a") as library:
        library.write("newmtl glass\nKd 1 1 1\nTr 0.7\nmap_Kd kd.png\n")
    assert iccm("relayout", "old.obj", "new.obj", "-o", "out.glb", "--size", N).code == 0
    out = rich_glb.read(folder / "out.glb")
    modes = {m.alphaMode: m.pbrMetallicRoughness.baseColorFactor for m in out.materials}
    assert set(modes) == {"OPAQUE", "BLEND"} and modes["BLEND"] == pytest.approx([1, 1, 1, 0.3])
    assert iccm("relayout", "old.obj", "new.obj", "-o", "out.obj", "--size", N).err.count(
        "differ in more than"
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("old.glb", "new.glb", "-o", "out.obj", "--size", N), "would lose contents of new.glb; use .glb"),
        (("old.glb", "new.glb", "-o", "out.ply"), "use .glb"),
        (("old.glb", "new.glb", "-o", "a.glb", "-o", "b.glb"), "only one mesh can be written"),
        (("old.glb", "new.glb", "-o", "new.glb", "--force"), "is also an input"),
        (("new.obj", "new.glb", "-o", "out.glb", "--size", N), "new.obj: its materials have no textures"),
        (("old.glb", "new.glb", "--data", "kd.png", "-o", "out.glb", "--size", N), "--data: "),
        (("old.obj", "new.obj", "-o", "out.ply"), "use .obj and .glb"),
    ],
)
def test_wrong_options_are_refused_in_one_line(folder, iccm, words, message):
    result = iccm("relayout", *words)
    assert result.code == 2 and message in result.err and len(result.lines) == 1, result.err
    assert not list(folder.glob("out*"))


def test_pictures_beside_an_obj_are_not_replaced_without_force(folder, iccm):
    (folder / "out-kd.png").write_bytes(b"mine")
    result = iccm("relayout", "old.obj", "new.obj", "-o", "out.obj", "--size", N)
    assert result.code == 2 and "out-kd.png: the file exists" in result.err
    assert (folder / "out-kd.png").read_bytes() == b"mine" and not (folder / "out.obj").exists()


@pytest.mark.slow
def test_materials_for_a_mesh_that_is_not_an_obj_are_written_to_glb(folder, iccm):
    """An OBJ with a library is written of an OBJ's own lines; it ended with an internal error."""
    assert iccm("flatten", "new.obj", "--uv", "new.ply").code == 0
    result = iccm("relayout", "old.glb#body", "new.ply", "-o", "out.obj", "--size", N)
    assert (
        result.code == 2 and "new.ply" in result.err and "use .glb" in result.err and len(result.lines) == 1
    )
    assert iccm("relayout", "old.glb#body", "new.ply", "-o", "out.glb", "--size", N).code == 0
