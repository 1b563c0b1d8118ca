"""New layouts that no single picture fits: stacked charts, tiles, repetitions; and pictures that slots share."""

import io
import json

import numpy as np
import pygltflib as gl
import pytest
from PIL import Image

from iccm.io.pictures import image_files
from tests import rich_glb

CELLS = 16
N = 256


def write(path, layout, head=""):
    """A flat mesh over the unit square whose faces have separate coordinates: layout(x, y)."""
    rows, faces = [], []
    for column in range(CELLS):
        for row in range(CELLS):
            x = (column + np.array([0, 1, 1, 0])) / CELLS
            y = (row + np.array([0, 0, 1, 1])) / CELLS
            uv = layout(x, y, (column + 0.5) / CELLS)
            first = 4 * len(faces)
            rows += [f"v {a} {b} 0" for a, b in zip(x, y)] + [f"vt {u:.9g} {v:.9g}" for u, v in uv]
            faces.append("f " + " ".join(f"{first + k}/{first + k}" for k in range(1, 5)))
    path.write_text(head + "\n".join([*rows, *faces]) + "\n")


def upright(x, y, _):
    return np.column_stack([0.05 + 0.9 * x, 0.05 + 0.9 * y])


def folded(x, y, middle):
    """The part beyond x = .75 lies mirrored on the part to its left."""
    return np.column_stack([0.1 + np.where(middle < 0.75, x, 1.5 - x), 0.2 + 0.7 * y])


def in_two_tiles(x, y, middle):
    """The part beyond x = .625 lies in the tile 1002, over a part of the other one."""
    u = np.where(middle < 0.625, 0.1 + 1.2 * x, 1.2 + 1.4 * (x - 0.625))
    return np.column_stack([u, 0.15 + 0.6 * y])


def shade(x, y):
    return 127 + 60 * np.stack([np.sin(7 * x), np.cos(6 * y + 1), np.sin(3 * x + 5 * y)], axis=-1)


def middles():
    """u and v of a picture's texels."""
    t = (np.arange(N) + 0.5) / N
    return np.meshgrid(t, 1 - t)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    u, v = middles()
    pixels = shade((u - 0.05) / 0.9, (v - 0.05) / 0.9).round().astype(np.uint8)
    image_files.write(tmp_path / "kd.png", image_files.Image(pixels))
    (tmp_path / "m.mtl").write_text("newmtl cloth\nmap_Kd kd.png\n")
    write(tmp_path / "old.obj", upright, "mtllib m.mtl\nusemtl cloth\n")
    return tmp_path


def relayout(iccm, *words, old="old.obj"):
    return iccm("relayout", old, "new.obj", *words, "--size", N, "--report", "r.json", "--force")


PICTURE = ("--texture", "kd.png", "-o", "o.png")


@pytest.mark.parametrize("words", [PICTURE, ("-o", "o.obj")])
def test_stacked_charts_that_show_different_places_have_a_status(folder, iccm, words):
    write(folder / "new.obj", folded)
    result = relayout(iccm, *words)
    report = json.loads((folder / "r.json").read_text())
    layout = report["layout"]
    assert (result.code, report["status"]) == (1, "overlapping")
    assert layout["conflicting_texels"] / layout["covered_texels"] == pytest.approx(1 / 3, abs=0.02)
    assert layout["mirrored_triangles"] == 2 * CELLS * CELLS // 4
    assert (
        f"{layout['conflicting_texels'] / layout['covered_texels']:.1%}" in result.err
        and "unwrap" in result.err
    )


@pytest.mark.parametrize("words", [PICTURE, ("-o", "o.obj")])
def test_stacked_charts_that_show_the_same_place_are_right(folder, iccm, words):
    write(folder / "new.obj", folded)
    write(
        folder / "stacked.obj", lambda x, y, m: 0.9 * folded(x, y, m) + 0.02, "mtllib m.mtl\nusemtl cloth\n"
    )
    result = relayout(iccm, *words, old="stacked.obj")
    report = json.loads((folder / "r.json").read_text())
    assert (result.code, report["status"], report["layout"]["conflicting_texels"]) == (0, "done", 0)
    assert report["layout"]["overlapping_texels"] > 0.2 * report["layout"]["covered_texels"]


@pytest.mark.parametrize("words", [PICTURE, ("-o", "o.obj")])
def test_charts_of_tiles_that_would_overlap_are_refused(folder, iccm, words):
    write(folder / "new.obj", in_two_tiles)
    result = relayout(iccm, *words)
    assert result.code == 2 and "new.obj" in result.err and "<UDIM>" in result.err, result.err
    assert not (folder / "o.png").exists() and not (folder / "o.obj").exists()


def off(picture, first):
    """Share of the texels of one of the two tiles that are off by more than 8 of 255."""
    u, v = middles()
    x, y = ((u - 0.1) / 1.2 if first else 0.625 + (u - 0.2) / 1.4), (v - 0.15) / 0.6
    inside = (y > 0.01) & (y < 0.99) & (x > (0 if first else 0.625) + 0.01) & (x < (0.615 if first else 0.99))
    assert inside.sum() > 0.2 * N * N
    return (np.abs(picture.astype(float) - shade(x, y))[inside] > 8).any(axis=-1).mean()


def test_tiles_become_separate_pictures(folder, iccm):
    write(folder / "new.obj", in_two_tiles)
    result = relayout(iccm, "--texture", "kd.png", "-o", "o.<UDIM>.png")
    assert result.code == 0, result.err
    for number in (1001, 1002):
        assert off(image_files.read(f"o.{number}.png").pixels, number == 1001) <= 0.005


def test_tiles_become_materials_of_a_glb(folder, iccm):
    write(folder / "new.obj", in_two_tiles)
    result = relayout(iccm, "-o", "o.glb")
    assert result.code == 0 and "2 tiles" in result.err, result.err
    file = rich_glb.read("o.glb")
    seen = set()
    for part in file.meshes[0].primitives:
        u = rich_glb.values(file, part.attributes.TEXCOORD_0)[rich_glb.values(file, part.indices)[:, 0], 0]
        first = bool(u.max() < 1)
        assert first or u.min() > 1
        texture_index = file.materials[part.material].pbrMetallicRoughness.baseColorTexture.index
        picture = np.asarray(Image.open(io.BytesIO(rich_glb.picture(file, texture_index))))
        assert off(picture, first) <= 0.005
        seen.add(first)
    assert seen == {True, False}


def test_triangles_larger_than_the_picture_are_refused(folder, iccm):
    write(folder / "new.obj", lambda x, y, _: np.column_stack([20 * x, 0.1 + 0.3 * y]))
    result = relayout(iccm, *PICTURE)
    assert result.code == 2 and "new.obj" in result.err and "repeat" in result.err, result.err


def test_a_layout_in_another_tile_is_shown_by_textures_that_repeat(folder, iccm):
    """Although the old one's are clamped."""
    points, normals, uv, faces = rich_glb.sheet(8)
    old = rich_glb.rich(
        points, normals, uv, faces, colour=(folder / "kd.png").read_bytes()
    )  # its sampler clamps and mirrors
    (folder / "old.glb").write_bytes(old)
    for name, shift in (("here", 0), ("beside", 1)):
        moved = uv @ [[0.6, 0.2], [-0.2, 0.6]] + [0.25 + shift, 0.1]
        (folder / f"{name}.glb").write_bytes(rich_glb.rich(points, normals, moved, faces))
        written = "-o", f"o-{name}.glb", "--size", 64, "--padding", 0
        assert iccm("relayout", "old.glb", f"{name}.glb", *written).code == 0
    in_place, in_next_tile = (rich_glb.read(f"o-{name}.glb") for name in ("here", "beside"))
    indices = [
        file.materials[0].pbrMetallicRoughness.baseColorTexture.index for file in (in_place, in_next_tile)
    ]
    wraps = [
        {(file.samplers[texture.sampler].wrapS, file.samplers[texture.sampler].wrapT)}
        for file, texture in zip(
            (in_place, in_next_tile), (in_place.textures[indices[0]], in_next_tile.textures[indices[1]])
        )
    ]
    assert wraps == [{(33071, 33648)}, {(10497, 10497)}]
    picture, next_picture = (
        np.asarray(Image.open(io.BytesIO(rich_glb.picture(file, index)))).astype(int)
        for file, index in zip((in_place, in_next_tile), indices)
    )
    assert np.ptp(picture) > 50 and (np.abs(picture - next_picture) > 8).mean() < 0.005


@pytest.mark.parametrize("command", ["relayout", "carry"])
def test_slots_that_share_a_picture_share_it_afterwards(folder, iccm, command):
    """Occlusion in red, roughness in green, metal in blue of one picture."""
    points, normals, uv, faces = rich_glb.sheet(8)
    u, v = middles()
    packed = io.BytesIO()
    Image.fromarray(shade(u, v).round().astype(np.uint8)).save(packed, "PNG")
    make = rich_glb.read_bytes(rich_glb.rich(points, normals, uv, faces, rough=packed.getvalue()))
    rough = make.materials[0].pbrMetallicRoughness.metallicRoughnessTexture
    make.materials[0].occlusionTexture = gl.OcclusionTextureInfo(index=rough.index)
    (folder / "old.glb").write_bytes(b"".join(make.save_to_bytes()))
    turned = uv @ [[0.6, 0.2], [-0.2, 0.6]] + [0.25, 0.1]
    (folder / "new.glb").write_bytes(rich_glb.rich(points, normals, turned, faces))
    if command == "relayout":
        result = iccm("relayout", "old.glb", "new.glb", "-o", "out.glb", "--size", N)
    else:
        result = iccm("flatten", "old.glb#body", "--uv", "out.glb", "--carry-maps")
    assert result.code == 0, result.err
    out = rich_glb.read("out.glb")
    material = out.materials[0]
    slots = (
        material.pbrMetallicRoughness.baseColorTexture,
        material.pbrMetallicRoughness.metallicRoughnessTexture,
        material.normalTexture,
        material.occlusionTexture,
    )
    colour, rough, bump, occlusion = (out.textures[slot.index].source for slot in slots)
    assert rough == occlusion and len({colour, rough, bump}) == 3
    assert len(out.images) == 3
