"""Textures that repeat beyond 0..1, as set by the material, in `relayout` and `map --bake`, compared with a formula."""

import io

import numpy as np
import pygltflib as gl
import pytest
from PIL import Image

from tests.cases import slow
from tests.rich_glb import Builder

pytestmark = pytest.mark.usefixtures("solve_once")

N = 64
WRAPS = {"repeat": 10497, "mirror": 33648, "clamp": 33071}
FOLDED = {
    "repeat": lambda x: x % 1,
    "mirror": lambda x: 1 - np.abs(x % 2 - 1),
    "clamp": lambda x: np.clip(x, 0, 1),
}
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
FACES = np.array([0, 1, 2, 0, 2, 3], np.uint16)
OLD = (SQUARE[:, :2] * 2 + (-0.5, 0.25)).astype(np.float32)  # v down


def shade(u, v):
    """Colours (…, 3) in 0 … 255 at places of the texture, with four different edges."""
    return np.stack([255 * u, 255 * v, 255 * (u + 1 - v) / 2], axis=-1)


def texels(n):
    t = (np.arange(n) + 0.5) / n
    return np.meshgrid(t, t)


def texture(n=N):
    stream = io.BytesIO()
    Image.fromarray(shade(*texels(n)).round().astype(np.uint8)).save(stream, "PNG")
    return stream.getvalue()


def glb(path, uv, across="repeat", down="repeat", picture=None):
    builder = Builder()
    attributes = gl.Attributes(
        POSITION=builder.accessor(SQUARE, "VEC3"), TEXCOORD_0=builder.accessor(uv, "VEC2")
    )
    primitive = gl.Primitive(attributes=attributes, indices=builder.accessor(FACES, "SCALAR"))
    if picture:
        builder.file.samplers.append(gl.Sampler(wrapS=WRAPS[across], wrapT=WRAPS[down]))
        texture_info = gl.TextureInfo(index=builder.texture(picture, sampler=0))
        builder.file.materials.append(
            gl.Material(pbrMetallicRoughness=gl.PbrMetallicRoughness(baseColorTexture=texture_info))
        )
        primitive.material = 0
    builder.file.meshes.append(gl.Mesh(primitives=[primitive], name="sheet"))
    builder.file.nodes.append(gl.Node(mesh=0))
    builder.file.scenes.append(gl.Scene(nodes=[0]))
    path.write_bytes(builder.bytes())


def obj(path, uv, head=""):
    lines = [head, *(f"v {x} {y} {z}" for x, y, z in SQUARE), *(f"vt {u} {1 - v}" for u, v in uv)]
    path.write_text("\n".join([*lines, "usemtl cloth", "f 1/1 2/2 3/3", "f 1/1 3/3 4/4", ""]))


def check(pixels, across, down):
    """Check (n, n, 3) pixels of a layout that is the square against the texture, except at borders of tiles."""
    x, y = texels(len(pixels))
    u, v = OLD[0, 0] + 2 * x, OLD[0, 1] + 2 * y  # the square's y points up, and so does the new layout's v
    clear = (np.abs(u - np.round(u)) > 2 / N) & (np.abs(v - np.round(v)) > 2 / N)
    expected_shade = shade(FOLDED[across](u), FOLDED[down](v))
    assert clear.mean() > 0.7
    assert np.abs(pixels[..., :3].astype(float) - expected_shade)[clear].max() < 8


@pytest.mark.parametrize(
    ("across", "down"),
    [
        slow("repeat", "repeat"),
        ("mirror", "clamp"),
        slow("clamp", "mirror"),
    ],
)
def test_gltf(iccm, tmp_path, monkeypatch, across, down):
    """With the wrap modes of its samplers, different ones in each direction."""
    monkeypatch.chdir(tmp_path)
    glb(tmp_path / "old.glb", OLD, across, down, texture())
    glb(tmp_path / "new.glb", SQUARE[:, :2])
    assert iccm("relayout", "old.glb", "new.glb", "-o", "out.glb", "--size", 2 * N).code == 0
    document = gl.GLTF2().load("out.glb")
    view = document.bufferViews[document.images[0].bufferView]
    content = document.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    check(np.asarray(Image.open(io.BytesIO(content))), across, down)
    assert iccm("map", "old.glb", "new.glb", "--bake", "-o", "baked.png", "--size", 2 * N).code == 0
    check(np.asarray(Image.open("baked.png")), across, down)


def test_a_picture_that_repeats_often_across_a_triangle(iccm, tmp_path, monkeypatch):
    """Twenty times in each direction: the old layout is sampled, not filled."""
    n = 16
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.png").write_bytes(texture(n))
    glb(tmp_path / "old.glb", 20 * SQUARE[:, :2])
    glb(tmp_path / "new.glb", SQUARE[:, :2])
    result = iccm("relayout", "old.glb", "new.glb", "--texture", "t.png", "-o", "out.png", "--size", 20 * n)
    assert result.code == 0, result.err
    picture = np.asarray(Image.open("out.png")).astype(float)
    expected = np.tile(shade(*texels(n)), (20, 20, 1))
    inside = np.tile(np.pad(np.ones((n - 4, n - 4), bool), 2), (20, 20))
    assert np.abs(picture[..., :3] - expected)[inside].max() < 8


@pytest.mark.parametrize(("message", "wrap"), [slow("", "repeat"), ("-clamp on ", "clamp")])
def test_obj(iccm, tmp_path, monkeypatch, message, wrap):
    """`-clamp` of a material library."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kd.png").write_bytes(texture())
    (tmp_path / "old.mtl").write_text(f"newmtl cloth\nmap_Kd {message}kd.png\n")
    obj(tmp_path / "old.obj", OLD, "mtllib old.mtl")
    obj(tmp_path / "new.obj", SQUARE[:, :2])
    assert iccm("relayout", "old.obj", "new.obj", "-o", "out.obj", "--size", 2 * N).code == 0
    check(np.asarray(Image.open("out-kd.png")), wrap, wrap)
    assert "-clamp" not in (tmp_path / "out.mtl").read_text()
    assert iccm("map", "old.obj", "new.obj", "--bake", "-o", "baked.png", "--size", 2 * N).code == 0
    check(np.asarray(Image.open("baked.png")), wrap, wrap)


@pytest.mark.parametrize("wrap", ["repeat", "clamp"])
def test_a_picture_that_repeats_more_often_than_pictures_can_show(iccm, tmp_path, monkeypatch, wrap):
    """Two thousand times: the new picture is small, with mean colours, and a note reports the number."""
    monkeypatch.chdir(tmp_path)
    glb(tmp_path / "old.glb", 2000 * SQUARE[:, :2], wrap, "repeat", texture())
    flattened = iccm("flatten", "old.glb", "--uv", "flat.glb", "--carry-maps")
    assert flattened.code == 0, flattened.err
    glb(tmp_path / "new.glb", SQUARE[:, :2])
    relaid = iccm("relayout", "old.glb", "new.glb", "-o", "out.glb")
    for done, name in ((flattened, "flat.glb"), (relaid, "out.glb")):
        assert f"{N}×{N}" in done.out + done.err and "2000 times" in done.out + done.err
        document = gl.GLTF2().load(name)
        view = document.bufferViews[document.images[0].bufferView]
        content = document.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
        assert max(Image.open(io.BytesIO(content)).size) <= 256


def test_pictures_of_small_textures_have_room_for_many_repetitions(iccm, tmp_path, monkeypatch):
    """Thirty repetitions are shown in full, without a note, in the next power of two."""
    n = 16
    monkeypatch.chdir(tmp_path)
    glb(tmp_path / "old.glb", 30 * SQUARE[:, :2], picture=texture(n))
    result = iccm("flatten", "old.glb", "--uv", "flat.glb", "--carry-maps")
    document = gl.GLTF2().load("flat.glb")
    view = document.bufferViews[document.images[0].bufferView]
    content = document.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    assert Image.open(io.BytesIO(content)).size == (32 * n, 32 * n)
    assert "repeats" not in result.out + result.err and "detail" not in result.out + result.err
