"""Vertex colors of an old mesh in the pictures of a new layout, against a formula."""

import io

import numpy as np
import pygltflib as gl
import pytest
from matplotlib.tri import LinearTriInterpolator, Triangulation
from PIL import Image

from tests import rich_glb

N = 128
POINTS, _, UV, FACES = rich_glb.sheet(24)
TURNED = UV @ [[0.7, 0.25], [-0.25, 0.7]] + [0.3, 0.05]
LINEAR = np.column_stack(
    [0.2 + 0.6 * POINTS[:, 0], 0.9 - 0.7 * POINTS[:, 1] ** 2, 0.5 * POINTS[:, 0] * POINTS[:, 1]]
)
FACTOR = np.array([1.0, 0.5, 0.25])


def encoded(linear):
    return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def mesh(uv, colours=None, picture=None, factor=(1, 1, 1, 1), mode=None):
    """A GLB of the surface, with linear vertex colors and one texture, perhaps."""
    make = rich_glb.Builder()
    attributes = gl.Attributes(POSITION=make.accessor(POINTS.astype(np.float32), "VEC3"))
    if uv is not None:
        attributes.TEXCOORD_0 = make.accessor(uv.astype(np.float32), "VEC2")
    if colours is not None:
        attributes.COLOR_0 = make.accessor(colours.astype(np.float32), f"VEC{colours.shape[1]}", plain=True)
    look = gl.PbrMetallicRoughness(baseColorFactor=list(factor))
    if picture is not None:
        look.baseColorTexture = gl.TextureInfo(index=make.texture(picture))
    make.file.materials.append(gl.Material(pbrMetallicRoughness=look, alphaMode=mode))
    indices = make.accessor(FACES.astype(np.uint16).reshape(-1, 1), "SCALAR")
    make.file.meshes.append(
        gl.Mesh(primitives=[gl.Primitive(attributes=attributes, indices=indices, material=0)])
    )
    make.file.nodes.append(gl.Node(mesh=0))
    make.file.scenes.append(gl.Scene(nodes=[0]))
    return make.bytes()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def relaid(iccm, folder, old, new, out="out.glb"):
    """Transfer an old file to the layout of a new one; return the new file, its picture and the command's result."""
    (folder / "old.glb").write_bytes(old)
    (folder / "new.glb").write_bytes(new)
    result = iccm("relayout", "old.glb", "new.glb", "-o", out, "--size", N)
    assert result.code == 0, result.err
    file = rich_glb.read(folder / out)
    texture_index = file.materials[
        file.meshes[0].primitives[0].material
    ].pbrMetallicRoughness.baseColorTexture.index
    return (
        file,
        np.asarray(Image.open(io.BytesIO(rich_glb.picture(file, texture_index)))).astype(float),
        result,
    )


def off(picture, linear):
    """Share of the texels inside the new layout whose colors are off by more than 3 of 255."""
    t = (np.arange(N) + 0.5) / N
    mesh = Triangulation(*TURNED.T, FACES)
    right = np.stack(
        [LinearTriInterpolator(mesh, channel)(*np.meshgrid(t, t)).filled(np.nan) for channel in linear.T], -1
    )
    inside = np.isfinite(right).all(axis=-1)
    assert inside.sum() > 0.2 * N * N
    return (np.abs(picture[inside][:, : linear.shape[1]] - encoded(right[inside])) > 3).any(axis=-1).mean()


@pytest.mark.parametrize("coloured", [False, True])  # the new mesh
@pytest.mark.parametrize("unwrapped", [False, True])  # the old mesh
def test_vertex_colours_alone_become_a_texture(folder, iccm, coloured, unwrapped):
    new = mesh(TURNED, 0.5 * LINEAR[::-1] if coloured else None)
    file, picture, done = relaid(iccm, folder, mesh(UV if unwrapped else None, LINEAR), new)
    assert off(picture, LINEAR) <= 0.01
    assert file.meshes[0].primitives[0].attributes.COLOR_0 is None
    assert "vertex colors" in done.err and "old.glb" in done.err
    assert ("removed" in done.err) == coloured


def test_factors_of_the_material_multiply_vertex_colours(folder, iccm):
    file, picture, _ = relaid(iccm, folder, mesh(UV, LINEAR, factor=(*FACTOR, 1)), mesh(TURNED))
    assert off(picture, LINEAR) <= 0.01
    assert file.materials[0].pbrMetallicRoughness.baseColorFactor == [*FACTOR, 1]


def test_alpha_of_vertices_shows_where_the_material_does(folder, iccm):
    alpha = 0.3 + 0.5 * POINTS[:, :1]
    old = mesh(UV, np.hstack([LINEAR, alpha]), mode="BLEND")
    _, picture, _ = relaid(iccm, folder, old, mesh(TURNED))
    assert picture.shape[2] == 4 and off(picture, LINEAR) <= 0.01
    inside = picture[..., 3][N // 2 - 9 : N // 2 + 9, N // 2 - 9 : N // 2 + 9]
    assert 0.3 * 255 < inside.min() < inside.max() < 0.8 * 255 and np.ptp(inside) > 5


def plain(colour):
    stream = io.BytesIO()
    Image.fromarray(np.tile(np.array(colour, np.uint8), (8, 8, 1))).save(stream, "PNG")
    return stream.getvalue()


def test_vertex_colours_multiply_the_texture_where_the_new_mesh_has_none(folder, iccm):
    grey = 0.2158605  # linear, of 128
    _, picture, done = relaid(iccm, folder, mesh(UV, LINEAR, plain([128] * 3)), mesh(TURNED))
    assert off(picture, grey * LINEAR) <= 0.01 and "vertex colors" in done.err


def test_a_new_mesh_with_vertex_colours_keeps_them_beside_the_texture(folder, iccm):
    new = mesh(TURNED, LINEAR)
    file, picture, _ = relaid(iccm, folder, mesh(UV, LINEAR, plain([128, 90, 40])), new)
    assert (picture[N // 2, N // 2] == [128, 90, 40]).all()
    kept = rich_glb.values(file, file.meshes[0].primitives[0].attributes.COLOR_0)
    assert np.allclose(kept, LINEAR, atol=1e-6)


def test_vertex_colours_that_only_the_new_mesh_has_are_reported(folder, iccm):
    _, picture, done = relaid(iccm, folder, mesh(UV, None, plain([128, 90, 40])), mesh(TURNED, LINEAR))
    assert (picture[N // 2, N // 2] == [128, 90, 40]).all() and "vertex colors" in done.err


def test_vertex_colours_of_a_ply_are_srgb(folder, iccm):
    rows = [
        "{} {} {} {} {} {} {} {}".format(*p, u, 1 - v, *c)
        for p, (u, v), c in zip(POINTS, UV, encoded(LINEAR).round().astype(int))
    ]
    properties = [f"property float {name}" for name in ("x", "y", "z", "s", "t")]
    properties += [f"property uchar {name}" for name in ("red", "green", "blue")]
    head = ["ply", "format ascii 1.0", f"element vertex {len(POINTS)}", *properties]
    head += [f"element face {len(FACES)}", "property list uchar int vertex_indices", "end_header"]
    faces = ["3 {} {} {}".format(*face) for face in FACES]
    (folder / "old.ply").write_text("\n".join([*head, *rows, *faces]) + "\n")
    (folder / "new.glb").write_bytes(mesh(TURNED))
    result = iccm("relayout", "old.ply", "new.glb", "-o", "out.glb", "--size", N)
    assert result.code == 0, result.err
    file = rich_glb.read(folder / "out.glb")
    texture_index = file.materials[0].pbrMetallicRoughness.baseColorTexture.index
    picture = np.asarray(Image.open(io.BytesIO(rich_glb.picture(file, texture_index)))).astype(float)
    assert off(picture, LINEAR) <= 0.01


@pytest.mark.parametrize("top", [1, 255])
def test_vertex_colours_of_an_obj_are_srgb_and_need_no_coordinates(folder, iccm, top):
    """Numbers after the positions, as MeshLab, Blender and scanners write them."""
    colours = encoded(LINEAR) / 255 * top
    rows = ["v {} {} {} {:.6f} {:.6f} {:.6f}".format(*p, *c) for p, c in zip(POINTS, colours)]
    faces = ["f {} {} {}".format(*face) for face in np.array(FACES) + 1]
    (folder / "old.obj").write_text("\n".join([*rows, *faces]) + "\n")
    (folder / "new.glb").write_bytes(mesh(TURNED))
    result = iccm("relayout", "old.obj", "new.glb", "-o", "out.glb", "--size", N)
    assert result.code == 0, result.err
    file = rich_glb.read(folder / "out.glb")
    colours = file.materials[0].pbrMetallicRoughness.baseColorTexture.index
    picture = np.asarray(Image.open(io.BytesIO(rich_glb.picture(file, colours)))).astype(float)
    assert off(picture, LINEAR) <= 0.01


def test_an_obj_with_colours_of_some_vertices_only_has_none(folder, iccm):
    """It is refused for its missing coordinates, as one without colours."""
    rows = ["v {} {} {}".format(*p) + " .1 .2 .3" * (k > 0) for k, p in enumerate(POINTS)]
    faces = ["f {} {} {}".format(*face) for face in np.array(FACES) + 1]
    (folder / "old.obj").write_text("\n".join([*rows, *faces]) + "\n")
    (folder / "new.glb").write_bytes(mesh(TURNED))
    result = iccm("relayout", "old.obj", "new.glb", "-o", "out.glb", "--size", N)
    assert result.code == 2 and "old.obj" in result.err and not (folder / "out.glb").exists()
