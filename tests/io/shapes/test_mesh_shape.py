"""Textures onto and from meshes, with files as input and output."""

import json

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io import memory, point_syntax
from iccm.io.meshes import mesh_files, obj
from iccm.io.pictures import image_files
from iccm.io.run import plots, preview
from iccm.io.run.outputs.baked import bake
from iccm.io.run.outputs.new_uvs import new_uvs
from iccm.io.shapes import mesh_reading
from iccm.maps.extended_inverse import ExtendedInverse
from iccm.maps.harmonic import HarmonicMap
from iccm.meshes import layout
from iccm.pixels import stmap
from iccm.pixels.canvas import Canvas
from iccm.pixels.sampler import Sampler
from iccm.pixels.warp import warp

pytestmark = pytest.mark.usefixtures("solve_once")


def hill(x, y):
    return 0.25 * np.exp(-6 * ((x - 0.5) ** 2 + (y - 0.5) ** 2))


def write_mesh(path, n=12, height=hill, uv=True, head="", wide=1.0):
    """An OBJ of n² quads over the unit square with UVs equal to x, y."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    k = np.arange(1, (n + 1) ** 2 + 1).reshape(n + 1, n + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    lines = [head] if head else []
    lines += [
        f"v {wide * a:.6f} {b:.6f} {c:.6f}" for a, b, c in zip(x.ravel(), y.ravel(), height(x, y).ravel())
    ]
    lines += [f"vt {a:.6f} {b:.6f}" for a, b in zip(x.ravel(), y.ravel())] if uv else []
    lines += ["f " + " ".join(f"{c}/{c}" if uv else str(c) for c in quad) for quad in quads]
    path.write_text("\n".join(lines) + "\n")
    return path


def identity(shape):
    return HarmonicMap(shape.curve.z, shape.curve.z, 0 * shape.curve.z)


def colours(size=64):
    t = (np.arange(size) + 0.5) / size
    x, y = np.meshgrid(t, 1 - t)
    return image_files.Image((255 * np.stack([x, y, 0.5 + 0.5 * x * y], axis=-1)).round().astype(np.uint8))


def test_new_coordinates_are_where_the_texture_lies_over_the_flattening(tmp_path):
    path = write_mesh(tmp_path / "hill.obj", uv=False, head="# kept\no hill")
    target = mesh_reading.read(str(path))
    box = target.box
    written = new_uvs(
        [(target, identity(target), target_plane(target))],
        stmap.flat(box),
        tmp_path / "t.obj",
        name=tmp_path / "o.obj",
    )
    content = obj.read(tmp_path / "t.obj")
    expected = target.flattening.flat
    flat = np.empty(len(content.vt), complex)
    flat = box[0] + content.vt[:, 0] * (box[1] - box[0]).real + 1j * content.vt[:, 1] * (box[1] - box[0]).imag
    assert np.abs(flat - expected).max() < 1e-6
    old = [line for line in path.read_text().splitlines() if line[0] != "f"]
    new = [line for line in (tmp_path / "t.obj").read_text().splitlines() if not line.startswith(("f", "vt"))]
    assert old == new
    assert written.figures["flattening"]["method"] == "lscm"
    assert written.files == []


def target_plane(shape):
    return preview.target_plane(shape)


def test_a_texture_next_to_the_mesh_is_bound(tmp_path):
    path = write_mesh(tmp_path / "hill.obj")
    target = mesh_reading.read(str(path))
    out = tmp_path / "o.obj"
    written = new_uvs(
        [(target, identity(target), target_plane(target))],
        stmap.flat(target.box),
        out,
        name=out,
        texture=tmp_path / "my cloth.png",
    )
    assert written.files == [str(tmp_path / "o.mtl")]
    assert "map_Kd my cloth.png" in (tmp_path / "o.mtl").read_text()
    text = out.read_text().splitlines()
    assert text[0] == "mtllib o.mtl"
    assert "usemtl iccm" in text
    assert mesh_reading.read(str(out)).pictures[0] == tmp_path / "my cloth.png"


@pytest.mark.parametrize("suffix", [".glb", ".ply"])
def test_glb_and_ply_hold_the_same_coordinates(tmp_path, suffix):
    target = mesh_reading.read(str(write_mesh(tmp_path / "hill.obj")))
    image_files.write(tmp_path / "c.png", colours())
    for name in ("o.obj", "o" + suffix):
        out = tmp_path / name
        texture = tmp_path / "c.png" if suffix == ".glb" else None
        new_uvs(
            [(target, identity(target), target_plane(target))],
            stmap.flat(target.box),
            out,
            name=out,
            texture=texture,
        )
    from_obj, converted = (mesh_reading.read(str(tmp_path / name)) for name in ("o.obj", "o" + suffix))
    places = []
    for shape in (from_obj, converted):
        uv = shape.file.mesh.uv[shape.uv_faces].reshape(-1, 2)
        points = shape.flattening.patch.points[shape.flattening.patch.faces].reshape(-1, 3)
        places.append(np.unique(np.column_stack([points, uv]).round(5), axis=0))
    assert np.abs(places[0] - places[1]).max() < 2e-5
    if suffix == ".ply":
        assert converted.pictures == ()
    else:
        assert (mesh_reading.read_texture(converted).pixels == colours().pixels).all()


def test_formats_without_coordinates_are_refused(tmp_path):
    target = mesh_reading.read(str(write_mesh(tmp_path / "hill.obj")))
    with pytest.raises(InputError, match=r"o\.stl: STL files cannot hold texture coordinates"):
        new_uvs(
            [(target, identity(target), target)],
            stmap.flat(target.box),
            tmp_path / "t",
            name=tmp_path / "o.stl",
        )


def test_pins_by_number_by_place_and_in_the_plane(tmp_path):
    shape = mesh_reading.read(str(write_mesh(tmp_path / "hill.obj")))
    corner = shape.flattening.flat[shape.flattening.patch.flat_vertex(0)]
    for vertex in ("v1", "1", 1):
        assert shape.at(point_syntax.read(vertex)) == corner
    assert shape.at(point_syntax.read("-0.01, -0.02, 0")) == corner
    assert shape.at(point_syntax.read("0.25,-0.5")) == 0.25 - 0.5j
    assert shape.to_core(np.zeros((2, 3))).tolist() == [corner, corner]
    for wrong, message in {"v0": "no vertex 0", "v9999": "no vertex 9999"}.items():
        with pytest.raises(InputError, match=message):
            shape.at(wrong)


def test_a_stroke_follows_edges(tmp_path):
    shape = mesh_reading.read(str(write_mesh(tmp_path / "flat.obj", n=4, height=lambda x, y: 0 * x)))
    stroke = shape.along(["v1", "v5", "v25"], "a")
    assert stroke.z.size == 9
    assert stroke.length == pytest.approx(2)
    with pytest.raises(InputError, match="at least 2 different"):
        shape.along(["v3", "v3"], "a")


def test_a_mesh_gives_its_texture_to_another_mesh(tmp_path):
    """Both lie over the same square: the composition of the flattenings must return the source's coordinates."""
    source = mesh_reading.read(str(write_mesh(tmp_path / "a.obj", n=24)))
    target = mesh_reading.read(str(write_mesh(tmp_path / "b.obj", n=16, uv=False)))
    shift = target.box[0] - source.box[0]
    map_ = HarmonicMap(source.curve.z, source.curve.z + shift, 0 * source.curve.z)
    out = tmp_path / "o.obj"
    written = new_uvs([(target, map_, source)], stmap.flat(source.box), out, name=out)
    content = obj.read(out)
    uv = np.empty((len(content.v), 2))
    uv[content.corners[:, 0]] = content.vt[content.corners[:, 1]]
    assert np.abs(uv - content.v[:, :2]).max() < 0.01  # the two flattenings differ by their discretisation
    assert written.figures["torn_triangles"] == 0


def torn(path):
    """A mesh whose left half has separate coordinates, far from those of the right one."""
    write_mesh(path, n=4)
    text = path.read_text().splitlines()
    faces = [k for k, line in enumerate(text) if line.startswith("f")]
    for k in faces[:8]:  # the left half gets separate coordinates
        text[k] = " ".join(
            ["f", *(f"{c.split('/')[0]}/{int(c.split('/')[0]) + 25}" for c in text[k].split()[1:])]
        )
    first = next(k for k, line in enumerate(text) if line.startswith("f"))
    text[first:first] = [f"vt {5 + k} {k * k}" for k in range(25)]
    path.write_text("\n".join(text))
    return path


def test_faces_keep_to_one_chart_of_a_source(tmp_path):
    """A mesh mapped onto itself has its coordinates at every corner, including the seam between charts."""
    source = mesh_reading.read(str(torn(tmp_path / "a.obj")))
    out = tmp_path / "o.obj"
    written = new_uvs([(source, identity(source), source)], stmap.flat(source.box), out, name=out)
    before, content = obj.read(tmp_path / "a.obj"), obj.read(out)
    assert content.vt[content.corners[:, 1]] == pytest.approx(before.vt[before.corners[:, 1]], abs=1e-6)
    assert written.figures["torn_triangles"] == 0


def test_a_torn_source_is_reported(tmp_path):
    source = mesh_reading.read(str(torn(tmp_path / "a.obj")))
    target = mesh_reading.read(str(write_mesh(tmp_path / "b.obj", n=5)))
    out = tmp_path / "o.obj"
    written = new_uvs([(target, identity(source), source)], stmap.flat(source.box), out, name=out)
    assert written.figures["torn_triangles"] == 10
    assert "10 triangles lie across seams" in written.notes[0]


def test_a_mesh_rebaked_through_itself_keeps_its_texture(tmp_path):
    shape = mesh_reading.read(str(write_mesh(tmp_path / "a.obj", n=20)))
    image = colours(128)
    sampler = Sampler(image.texture(shape.box))
    picture, figures = bake([(shape, identity(shape), shape)], sampler, (128, 128))
    error = np.abs(picture.astype(int) - image.pixels)
    assert figures["charts"] == 1
    assert error.max() <= 2
    assert error.mean() < 0.2


def warped_texture(shape, image, canvas):
    """The picture as the shape's own texture, on a canvas in the plane of its flattening."""
    texture = image.texture(shape.box)
    return warp(identity(shape), texture, canvas, placing=shape.placing(texture))


def test_a_meshs_texture_on_a_planar_target(tmp_path):
    shape = mesh_reading.read(str(write_mesh(tmp_path / "a.obj", n=16, height=lambda x, y: 0 * x)))
    image = colours(64)
    warped = warped_texture(shape, image, Canvas(64, 64, shape.box))
    assert warped.pixels.shape == (64, 64, 4)
    assert np.abs(warped.pixels[2:-2, 2:-2, :3].astype(int) - image.pixels[2:-2, 2:-2]).max() <= 1
    assert (warped.pixels[2:-2, 2:-2, 3] == 255).all()


def test_a_mesh_without_coordinates_or_texture_is_refused(tmp_path):
    bare = mesh_reading.read(str(write_mesh(tmp_path / "a.obj", uv=False)))
    with pytest.raises(InputError, match="has no texture coordinates"):
        bake([(bare, identity(bare), bare)], Sampler(colours().texture(bare.box)), (8, 8))
    with pytest.raises(InputError, match="has no texture; name one with --texture"):
        mesh_reading.read_texture(bare)


def test_the_picture_of_a_surface_shows_its_texture(tmp_path):
    shape = mesh_reading.read(str(write_mesh(tmp_path / "a.obj", n=16)))
    seen = plots.surface(shape, identity(shape), target_plane(shape), colours().texture(shape.box), size=120)
    solid = seen[..., 3] == 255
    assert 0.4 < solid.mean() < 0.95
    y, x = np.nonzero(solid)
    red, green = (seen[..., k][solid].astype(float) for k in (0, 1))
    assert np.corrcoef(x, red)[0, 1] > 0.8
    assert np.corrcoef(-y, green)[0, 1] > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("with_map", [False, True])
def test_a_figure_is_drawn_the_same_every_time(tmp_path, with_map):
    shape = mesh_reading.read(str(write_mesh(tmp_path / "a.obj", n=6)))
    more = {"map": identity(shape), "source": target_plane(shape)} if with_map else {}
    for name in ("1.png", "2.png"):
        plots.draw(shape, tmp_path / name, ["said"], **more)
    assert (tmp_path / "1.png").read_bytes() == (tmp_path / "2.png").read_bytes()


# ---- the command line


@pytest.mark.slow
@pytest.mark.parametrize(
    "words", [("a.obj", "blob.svg"), ("square.svg", "a.obj", "--bake"), ("a.obj", "a.obj", "--bake")]
)
def test_a_bound_on_memory_does_not_change_a_picture_from_or_for_a_mesh(shapes, iccm, monkeypatch, words):
    write_mesh(shapes / "a.obj", n=8)
    image_files.write(shapes / "t.png", colours(300))
    options = ("--texture", "t.png", "--size", "200", "--method", "paper", "--tolerance", "0.1")
    assert iccm("map", *words, *options, "-o", "free.png").code == 0
    monkeypatch.setattr(memory, "CACHE_MEMORY_SHARE", 0)  # nothing is kept in memory
    assert iccm("map", *words, *options, "-o", "bound.png", "--memory", "4G").code == 0
    assert (shapes / "bound.png").read_bytes() == (shapes / "free.png").read_bytes()


def test_a_bake_that_a_bound_on_memory_cannot_hold_is_refused_before_the_solving(shapes, iccm):
    write_mesh(shapes / "a.obj", n=3)
    result = iccm("map", "square.svg", "a.obj", "--bake", "--size", "8000", "-o", "o.png", "--memory", "2G")
    assert result.code == 2 and "too little for the whole picture at once (--bake)" in result.err


@pytest.mark.slow
def test_flatten_writes_outline_flat_mesh_and_coordinates(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    write_mesh(tmp_path / "hill.obj")
    assert iccm("flatten", "hill.obj").code == 0
    assert (tmp_path / "hill-flat.svg").exists()
    result = iccm(
        "flatten",
        "hill.obj",
        "-o",
        "f.svg",
        "-o",
        "f.obj",
        "--uv",
        "u.obj",
        "--report",
        "-",
        "--plot",
        "p.png",
    )
    assert result.code == 0, result.err
    report = json.loads(result.out)
    assert report["schema"] == "iccm.flatten/1"
    assert report["boundary_loops"] == [48]
    assert 1 < report["dilatation"]["p95"] < 1.1
    flat = mesh_reading.read("f.obj")
    assert flat.flattening.report()["dilatation"]["max"] == pytest.approx(1, abs=1e-6)
    assert flat.curve.area == pytest.approx(mesh_reading.read("hill.obj").curve.area, rel=1e-6)
    lines = zip(
        (tmp_path / "hill.obj").read_text().splitlines(), (tmp_path / "u.obj").read_text().splitlines()
    )
    assert {a.split()[0] for a, b in lines if a != b} <= {"vt", "f"}


def test_flatten_refuses_meshes_that_it_cannot_flatten_or_write(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    write_mesh(tmp_path / "hill.obj")
    (tmp_path / "tetra.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    (tmp_path / "drawing.svg").write_text("<svg/>")
    for words, message in {
        ("tetra.obj", "--no-cut"): "is closed",
        ("hill.obj", "-o", "hill.obj", "--force"): "is also an input",
        ("hill.obj", "-o", "x.stl"): "cannot hold texture coordinates",
        ("hill.obj", "--uv", "x.stl"): "cannot hold texture coordinates",
        ("hill.obj", "--plot", "x.gif"): "unknown suffix for --plot",
        ("missing.obj",): "no such file",
        ("drawing.svg",): "cannot read a mesh from '.svg'",
        ("hill.obj#9",): "no boundary 9",
    }.items():
        result = iccm("flatten", *words)
        assert result.code == 2
        assert message in result.err
        assert len(result.lines) == 1
    (tmp_path / "drawing.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg"><rect width="9" height="9"/></svg>'
    )
    result = iccm("map", "drawing.svg", "hill.obj", "-o", "x.stl")
    assert result.code == 2 and "STL files cannot hold texture coordinates" in result.err
    assert iccm("flatten", "tetra.obj").code == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        *("drawing.svg", "hill.obj", "tetra-flat.svg", "tetra.obj")
    ]


def test_pull_back_is_threads_free(tmp_path):
    shape = mesh_reading.read(str(write_mesh(tmp_path / "a.obj", n=9)))
    z = shape.flattening.flat
    one_thread, two_threads = (ExtendedInverse(identity(shape), threads)(z) for threads in (1, 2))
    assert (one_thread == two_threads).all()


def test_constraints_name_vertices_and_points_in_space(tmp_path, shapes):
    from iccm.io.shapes import constraints, listing
    from iccm.io.shapes import shape as planar

    mesh = mesh_reading.read(str(write_mesh(tmp_path / "hill.obj", n=4)))
    plane = planar.read("square.svg")
    pins = [{"source": [30, 40], "target": "v13"}, {"source": [50, 50], "target": [0.26, 0.01, 0]}]
    strokes = [{"source": [[20, 20], [80, 20]], "target": [1, 5, 25]}]
    (tmp_path / "c.json").write_text(json.dumps({"pins": pins, "strokes": strokes}))
    collected = constraints.collect(plane, mesh, listing.read(tmp_path / "c.json"))
    assert collected.pins[:, 0].tolist() == [30 - 40j, 50 - 50j]
    assert collected.pins[0, 1] == mesh.vertex(13)
    assert (
        abs(collected.pins[1, 1] - mesh.vertex(6)) < 0.05
    )  # the nearest point of the surface, not of its vertices
    assert collected.strokes[0][1].z.tolist() == mesh.along(["v1", "v5", "v25"], "a").z.tolist()
    with pytest.raises(InputError, match=r"square\.svg: v13 is a point on a mesh"):
        constraints.collect(plane, plane, listing.read(tmp_path / "c.json"))


def test_points_of_the_surface_are_located_and_other_points_by_the_nearest(tmp_path):
    mesh = mesh_reading.read(str(write_mesh(tmp_path / "hill.obj", n=6)))
    patch, flat = mesh.flattening.patch, mesh.flattening.flat
    weights = np.random.default_rng(1).dirichlet(np.ones(3), len(patch.faces))
    z = np.einsum("pk,pk->p", weights, flat[patch.faces])
    space = mesh.to_space(z)
    assert np.allclose(space, np.einsum("pk,pkc->pc", weights, patch.points[patch.faces]), atol=1e-12)
    assert np.allclose(mesh.to_core(space), z, atol=1e-12)
    assert np.allclose(mesh.to_core(patch.points), flat, atol=1e-12)
    off_surface = np.add(space[:40], (0, 0, 0.1))
    result = mesh.to_space(mesh.to_core(off_surface))
    nearest = np.linalg.norm(off_surface[:, None] - space[None], axis=2).min(axis=1)
    assert (np.linalg.norm(result - off_surface, axis=1) <= nearest + 1e-12).all()


@pytest.mark.slow
def test_a_texture_is_mapped_onto_a_mesh_with_pins_of_the_command_line(tmp_path, shapes, iccm):
    write_mesh(tmp_path / "hill.obj", n=8)
    image_files.write(tmp_path / "c.png", colours())
    words = [
        "map",
        "square.svg",
        "hill.obj",
        "--texture",
        "c.png",
        "--method",
        "paper",
        "-o",
        "o.obj",
        "-o",
        "o.glb",
    ]
    result = iccm(*words, "--pin", "50,50:v41", "--report", "r.json", "--plot", "p.png")
    assert result.code in (0, 1), result.err
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["flattening"]["triangles"] == 128
    assert report["pins"][0]["error"] < 0.05
    assert {"o.obj", "o.mtl", "o.glb", "p.png"} <= {p.name for p in tmp_path.iterdir()}
    uv = obj.read(tmp_path / "o.obj").vt
    assert ((uv > -0.01) & (uv < 1.01)).all()
    assert iccm(*words[:-4], "-o", "x.stl").code == 2


@pytest.fixture
def embedded(tmp_path):
    """A GLB whose texture is a JPEG inside it, and that JPEG's bytes."""
    target = mesh_reading.read(str(write_mesh(tmp_path / "hill.obj", n=6)))
    image_files.write(tmp_path / "c.jpg", colours())
    out = tmp_path / "a.glb"
    plane = target_plane(target)
    new_uvs(
        [(target, identity(target), plane)], stmap.flat(target.box), out, name=out, texture=tmp_path / "c.jpg"
    )
    return (tmp_path / "c.jpg").read_bytes()


def test_a_texture_is_embedded_byte_by_byte(tmp_path, embedded):
    assert embedded in (tmp_path / "a.glb").read_bytes()
    assert mesh_reading.read(str(tmp_path / "a.glb")).pictures[0].rstrip(b"\0") == embedded


def test_a_mesh_that_holds_its_texture_passes_it_on(tmp_path, monkeypatch, embedded, iccm):
    monkeypatch.chdir(tmp_path)
    write_mesh(tmp_path / "b.obj", n=5, uv=False)
    words = ["map", "a.glb", "b.obj", "--method", "paper", "--vertices", "60"]
    result = iccm(*words, "-o", "o.obj", "-o", "o.glb", "-o", "o.ply")
    assert result.code in (0, 1), result.err
    assert embedded in (tmp_path / "o.glb").read_bytes()
    assert (tmp_path / "o-texture.jpg").read_bytes().rstrip(b"\0") == embedded
    assert "map_Kd o-texture.jpg" in (tmp_path / "o.mtl").read_text()
    assert "o.ply: a PLY file contains no texture" in result.err
    texture = mesh_reading.read_texture(mesh_reading.read("o.obj"))
    assert (
        np.abs(texture.pixels.astype(int) - image_files.read("c.jpg").pixels).max() <= 2
    )  # two JPEG decoders


def test_a_damaged_embedded_texture_is_refused_before_the_solving(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("iccm.fit", lambda *args, **options: pytest.fail("solved"))
    target = mesh_reading.read(str(write_mesh(tmp_path / "hill.obj", n=6)))
    image_files.write(tmp_path / "c.png", colours())
    whole = (tmp_path / "c.png").read_bytes()
    cut = whole[: len(whole) // 2].ljust(len(whole), b"\0")
    out, plane = tmp_path / "a.glb", target_plane(target)
    new_uvs([(target, identity(target), plane)], stmap.flat(target.box), out, name=out, texture=cut)
    result = iccm("map", "a.glb", "hill.obj", "--bake", "-o", "o.png")
    assert result.code == 2
    assert len(result.lines) == 1
    assert "a.glb: the texture in the file: cannot read" in result.err


@pytest.mark.parametrize(
    ("bare", "words"),
    [
        ("source", ["-o", "o.obj"]),
        ("source", ["--bake", "-o", "o.png"]),
        ("target", ["--bake", "-o", "o.png"]),
    ],
)
def test_a_missing_layout_is_refused_before_the_solving(tmp_path, monkeypatch, iccm, bare, words):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("iccm.fit", lambda *args, **options: pytest.fail("solved"))
    for name in ("source", "target"):
        write_mesh(tmp_path / f"{name}.obj", n=5, uv=name != bare)
    result = iccm("map", "source.obj", "target.obj", *words)
    assert result.code == 2
    assert result.lines == [
        f"error: {bare}.obj: has no texture coordinates; create them with iccm flatten --uv"
    ]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--texture", "c.exr", "-o", "o.glb"], "c.exr: contains floats"),
        (
            ["--texture", "-c.png", "-o", "o.obj"],
            "-c.png: a material library cannot refer to a file of this name",
        ),
        (
            ["--bake", "--size", "64", "--max-pixels", "4000", "-o", "o.png"],
            "--size: 64x64 exceeds the limit of 4000",
        ),
        (["--bake", "-o", "o.png"], "far.obj: face 1"),
    ],
)
def test_outputs_that_a_mesh_cannot_hold_are_refused_before_the_solving(
    tmp_path, monkeypatch, iccm, words, message
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("iccm.fit", lambda *args, **options: pytest.fail("solved"))
    for name in ("c.exr", "-c.png"):
        image_files.write(f"./{name}", colours(8))
    write_mesh(tmp_path / "a.obj", n=5)
    wrong = (tmp_path / "a.obj").read_text().replace("vt 0.000000 0.000000", "vt 1e9 0", 1)
    (tmp_path / "far.obj").write_text(wrong)
    target = "far.obj" if "far" in message else "a.obj"
    (tmp_path / "a.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><rect width="9" height="9"/></svg>'
    )
    result = iccm("map", "a.svg", target, *words)
    assert result.code == 2
    assert len(result.lines) == 1
    assert message in result.err


def test_padding_of_a_meshs_texture_on_a_planar_target(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    write_mesh(tmp_path / "a.obj", n=5)
    image_files.write("c.png", image_files.Image(np.full((8, 8, 3), 200, np.uint8)))
    (tmp_path / "b.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><circle cx="4" cy="4" r="3"/></svg>'
    )
    words = ["--method", "paper", "--vertices", "60", "--size", "32", "--padding", "-1", "-o", "o.png"]
    result = iccm("map", "a.obj", "b.svg", "--texture", "c.png", *words)
    assert result.code in (0, 1), result.err
    pixels = image_files.read("o.png").pixels
    assert (pixels[..., 3] == 0).any()
    assert (pixels[..., :3] == 200).all()


def test_a_mesh_without_a_texture_is_noted(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    for name in ("a.obj", "b.obj"):
        write_mesh(tmp_path / name, n=5)
    result = iccm("map", "a.obj", "b.obj", "--method", "paper", "--vertices", "60", "-o", "o.obj")
    assert result.code in (0, 1), result.err
    assert sum("a.obj: has no texture; name one with --texture" in line for line in result.lines) == 1


@pytest.mark.parametrize(
    ("source", "name"),
    [("a.glb", "o.mtl"), ("a.glb", "o-texture.jpg"), ("hill.obj", "o.mtl"), ("hill.obj", "c.mtl")],
)
def test_files_beside_an_output_are_checked_before_any_work(
    tmp_path, monkeypatch, embedded, iccm, source, name
):
    """Existing files need --force; a file that an input consists of is never replaced."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("iccm.fit", lambda *args, **options: pytest.fail("solved"))
    write_mesh(tmp_path / "b.obj", n=5, uv=False, head="mtllib c.mtl")
    (tmp_path / name).write_text("newmtl mine\n")
    words = ["map", source, "b.obj", "-o", f"{name[0]}.obj", "--texture", "c.jpg"][
        : 5 if source == "a.glb" else 7
    ]
    result = iccm(*words, *(["--force"] if name == "c.mtl" else []))
    assert result.code == 2
    assert len(result.lines) == 1
    expected = "is also an input" if name == "c.mtl" else "the file exists; use --force"
    assert f"{name}: {expected}" in result.err
    assert (tmp_path / name).read_text() == "newmtl mine\n"


def test_an_embedded_texture_is_read_like_a_separate_one(tmp_path):
    """With all its bits, and within the size limit."""
    target = mesh_reading.read(str(write_mesh(tmp_path / "hill.obj", n=4)))
    deep = np.arange(8 * 8 * 3, dtype=np.uint16).reshape(8, 8, 3) * 300
    image_files.write(tmp_path / "c.png", image_files.Image(deep))
    out = tmp_path / "o.glb"
    options = {"name": out, "texture": tmp_path / "c.png"}
    new_uvs([(target, identity(target), target_plane(target))], stmap.flat(target.box), out, **options)
    mesh = mesh_reading.read(str(out))
    assert np.array_equal(mesh_reading.read_texture(mesh).pixels, deep)
    with pytest.raises(InputError, match=r"o\.glb: the texture in the file: .*8x8 exceeds"):
        mesh_reading.read_texture(mesh, max_pixels=63)


def test_a_texture_of_another_format_becomes_png(tmp_path):
    """WebP may be inside a GLB, but few programs read it beside an OBJ."""
    from PIL import Image

    target = mesh_reading.read(str(write_mesh(tmp_path / "hill.obj", n=4)))
    Image.fromarray(colours().pixels).save(tmp_path / "c.webp", lossless=True)
    content = (tmp_path / "c.webp").read_bytes()
    out, plane = tmp_path / "o.obj", target_plane(target)
    written = new_uvs(
        [(target, identity(target), plane)], stmap.flat(target.box), out, name=out, texture=content
    )
    assert written.files == [str(tmp_path / name) for name in ("o.mtl", "o-texture.png")]
    assert (mesh_reading.read_texture(mesh_reading.read(str(out))).pixels == colours().pixels).all()
    out = tmp_path / "o.glb"
    new_uvs(
        [(target, identity(target), plane)],
        stmap.flat(target.box),
        out,
        name=out,
        texture=tmp_path / "c.webp",
    )
    assert (mesh_reading.read_texture(mesh_reading.read(str(out))).pixels == colours().pixels).all()
    (tmp_path / "c.tif").write_text("no picture")
    with pytest.raises(InputError, match=r"c\.tif: cannot read"):
        new_uvs(
            [(target, identity(target), plane)],
            stmap.flat(target.box),
            out,
            name=out,
            texture=tmp_path / "c.tif",
        )


def test_a_deformation_writes_no_mesh_and_bakes_nothing(shapes, iccm):
    write_mesh(shapes / "a.obj", n=5)
    result = iccm("deform", "a.obj", "--pin", "v1:v2", "-o", "o.obj")
    assert result.code == 2 and "a deformation cannot be written as a mesh" in result.lines[-1]
    assert "No such option" in iccm("deform", "a.obj", "--pin", "v1:v2", "--bake").lines[-1]


def test_texture_coordinates_that_are_not_finite_are_refused(shapes, iccm):
    text = write_mesh(shapes / "a.obj", n=5).read_text()
    (shapes / "a.obj").write_text(text.replace("vt 0.000000 0.000000", "vt nan 0", 1))
    image_files.write("c.png", colours(8))
    result = iccm("map", "a.obj", "square.svg", "--texture", "c.png", "-o", "o.png")
    assert (
        result.code == 2
        and "a.obj: face 1 (line 73): its texture coordinates are not finite" in result.lines[-1]
    ), result.err


@pytest.mark.slow
def test_omitted_geometries_are_reported(shapes, iccm):
    import trimesh

    scene = trimesh.Scene(
        {name: trimesh.creation.icosahedron().slice_plane([0, 0, 0], [0, 0, 1]) for name in "ab"}
    )
    scene.export("two.glb")
    note = "ignored 1 other geometry"
    words = ["--texture", "c.png", "--method", "paper", "--vertices", "60", "-o"]
    image_files.write("c.png", colours(8))
    result = iccm("map", "square.svg", "two.glb#b", *words, "o.glb")
    assert f"note: two.glb#b: {note}" in result.lines, result.err
    assert f"note: two.glb#a: {note}" in iccm("flatten", "two.glb#a", "-o", "a.svg").lines
    cure = "is the largest; two.glb#name selects one, --parts all or each uses all of them"
    lines = iccm("map", "square.svg", "two.glb", "--parts", "largest", *words, "p.glb").lines
    assert any(line.startswith(f"note: two.glb: {note}: '") and line.endswith(cure) for line in lines)


def put_on_two(folder, name="a.obj"):
    """A mesh whose lower faces show red.png and whose upper ones show blue.png."""
    for colour, pixel in (("red", (255, 0, 0)), ("blue", (0, 0, 255))):
        image_files.write(folder / f"{colour}.png", image_files.Image(np.full((4, 4, 3), pixel, np.uint8)))
    text = [f"newmtl {colour}\nmap_Kd {colour}.png" for colour in ("red", "blue")]
    (folder / "a.mtl").write_text("\n".join(["newmtl plain", *text, ""]))
    lines = write_mesh(folder / name, n=6, head="mtllib a.mtl").read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("f"))
    for index, material in ((first + 24, "blue"), (first + 6, "red"), (first, "plain")):
        lines.insert(index, f"usemtl {material}")
    (folder / name).write_text("\n".join(lines) + "\n")


@pytest.mark.slow
def test_one_of_several_textures_is_carried_with_a_note(tmp_path, shapes, iccm):
    put_on_two(shapes)
    words = ["square.svg", "--method", "paper", "--vertices", "60", "--size", "32", "-o"]
    whole = iccm("map", "a.obj", *words, "both.png")
    note = "note: a.obj: red.png replaces all of its 2 textures; choose one part with file#part"
    assert note in whole.lines and image_files.read("both.png").pixels[16, 16].tolist() == [255, 0, 0, 255]
    part = iccm("map", "a.obj#blue", *words, "one.png")
    assert "textures" not in part.err and image_files.read("one.png").pixels[16, 16].tolist() == [
        0,
        0,
        255,
        255,
    ]


def test_a_texture_repeats_beyond_its_edges(tmp_path):
    """Coordinates two pictures to the right and one down show the same, up to the outline, and so do triangles across
    edges.
    """
    flat = {"height": lambda x, y: 0 * x, "n": 2}
    inside, shifted, across = (
        mesh_reading.read(str(write_mesh(tmp_path / f"{k}.obj", **flat))) for k in "abc"
    )
    shifted.file.mesh.uv[:] += (2, -1)
    across.file.mesh.uv[:] *= 1.45
    border = 0.013 * (1 + 1j)  # pixels on the outline have their centres outside
    canvas = Canvas(64, 64, (inside.box[0] - border, inside.box[1] + border))
    texture = [warped_texture(s, colours(64), canvas).pixels for s in (inside, shifted, across)]
    assert np.abs(texture[0].astype(int) - texture[1]).max() <= 1
    u = 1.45 * (canvas.centres(32, 1).real.ravel() - inside.box[0].real)
    clear = np.abs(u - np.round(u)) > 0.05  # the filter reads both sides of an edge of the texture
    clear &= u < 1.45  # pixels on the outline show a nearby boundary point, not the nearest
    assert np.abs(texture[2][32, clear, 0] - 255 * np.mod(u[clear], 1)).max() < 3
    assert [s.beyond_unit > 0 for s in (inside, shifted, across)] == [False, True, True]


@pytest.mark.parametrize("words", [["a.obj", "square.svg"], ["square.svg", "a.obj", "--bake"]])
def test_an_stmap_through_texture_coordinates_agrees_with_the_run(shapes, iccm, words):
    """A material's pictures need one solution: the STMap gives the same result in `apply` as `map` itself."""
    write_mesh(shapes / "a.obj", n=9)
    image_files.write("t.png", colours(64))
    options = ["--texture", "t.png", "--size", "128", "--stmap", "m.exr", "-o", "o.png"]
    assert iccm("map", *words, *options).code == 0
    assert iccm("apply", "m.exr", "t.png", "-o", "p.png").code == 0
    direct, by_stmap = (image_files.read(name).pixels.astype(int) for name in ("o.png", "p.png"))
    seen = by_stmap[..., 3] == 255
    assert seen.mean() > 0.5
    assert np.abs(direct[..., :3] - by_stmap[..., :3])[seen].max() <= 3


def test_a_layout_that_overlaps_or_leaves_the_unit_square_gets_a_note(shapes, iccm):
    text = write_mesh(shapes / "a.obj", n=6).read_text()
    (shapes / "a.obj").write_text(text.replace("vt 1.0", "vt 1.5").replace("vt 0.833333", "vt 1.25"))
    words = ["--bake", "--method", "paper", "--vertices", "60", "--size", "32", "-o", "o.png"]
    result = iccm("map", "square.svg", "a.obj", *words)
    assert any(
        "a.obj: 24 triangles have texture coordinates outside 0..1" in line for line in result.lines
    ), result.err
    assert any("texels lie in several triangles" in line for line in result.lines)


def steep(x, y):
    return 10 * np.random.default_rng(5).random(x.size).reshape(x.shape)


@pytest.mark.slow
def test_flipped_triangles_in_the_output_are_reported(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    write_mesh(tmp_path / "steep.obj", 5, steep, uv=False)
    poor = iccm("flatten", "steep.obj", "--method", "lscm", "--uv", "poor.obj", "--report", "poor.json")
    report = json.loads((tmp_path / "poor.json").read_text())
    content = mesh_reading.read(str(tmp_path / "poor.obj"))
    u, v = np.moveaxis(content.uv[content.uv_faces], -1, 0)
    area = (u[:, 1] - u[:, 0]) * (v[:, 2] - v[:, 0]) - (u[:, 2] - u[:, 0]) * (v[:, 1] - v[:, 0])
    assert poor.code == 1
    assert report["status"] == "flipped"
    assert report["uv"] == {"flipped": int((area < 0).sum()), "degenerate": 0}
    assert report["uv"]["flipped"] > 0
    assert f"{report['uv']['flipped']} triangles are flipped" in poor.err
    sound = iccm("flatten", "steep.obj", "--uv", "sound.obj", "--report", "sound.json")
    assert sound.code == 0
    assert json.loads((tmp_path / "sound.json").read_text())["uv"] == {"flipped": 0, "degenerate": 0}


def test_a_tube_is_cut_from_hole_to_hole_for_a_layout_and_keeps_its_hole_for_a_map(
    tmp_path, monkeypatch, iccm
):
    monkeypatch.chdir(tmp_path)
    sheet = write_mesh(tmp_path / "sheet.obj", 24, uv=False).read_text().splitlines()
    x, y, _ = np.array([line.split()[1:] for line in sheet if line.startswith("v ")], float).T
    around = np.column_stack([np.cos(2 * np.pi * x), 6 * y, -np.sin(2 * np.pi * x)]).round(6) + 0.0
    points = ["v {:f} {:f} {:f}".format(*place) for place in around[:600]]  # the rest closes the tube
    quads = np.array([line.split()[1:] for line in sheet if line.startswith("f ")], int)
    faces = ["f {} {} {} {}".format(*quad) for quad in np.where(quads > 600, quads - 600, quads)]
    (tmp_path / "tube.obj").write_text("\n".join(points + faces))
    result = {}
    for name, words in {"cut": [], "whole": ["--no-cut"]}.items():
        assert iccm("flatten", "tube.obj", *words, "--report", f"{name}.json").code == 0
        result[name] = json.loads((tmp_path / f"{name}.json").read_text())
    assert result["whole"]["holes"] == 1 and result["whole"]["seam_length"] == 0
    assert result["cut"]["holes"] == 0 and result["cut"]["overlap"] is None
    assert result["cut"]["seam_length"] == pytest.approx(6 / np.sqrt(6 * 48 * np.sin(np.pi / 24)), rel=1e-4)
    assert result["cut"]["dilatation"]["max"] < 1.001
    last = result["cut"]["notes"][-1]
    assert "boundary" in last and "1 of 2 is the outline" in last and "cut joins 1 of the others" in last
    assert len(mesh_reading.read("tube.obj", cutting=mesh_reading.Cutting(closed=True)).holes) == 1


def test_rounding_of_the_file_counts(tmp_path):
    """A triangle that has no area in single precision."""
    uv = np.array([[0.5, 0.5], [0.5 + 1e-9, 0.5], [0.5, 0.5 + 1e-9]])
    for name, degenerate in (("a.obj", 0), ("a.glb", 1)):
        result = layout.turned_over(mesh_files.as_written(uv, name)[None])
        assert result == {"flipped": 0, "degenerate": degenerate}
    assert layout.turned_over(uv[None, [0, 2, 1]]) == {"flipped": 1, "degenerate": 0}


def test_a_map_that_flips_triangles_is_poor(tmp_path, monkeypatch, iccm):
    """Two triangles of a square with all corners on the outline: the map bends, its coordinates do not."""
    monkeypatch.chdir(tmp_path)
    points = [(0, 0), (4, 0), (4, 4), (0, 4)]
    text = "".join(f"v {x} {y} 0\n" for x, y in points) + "f 1 2 3\nf 1 3 4\n"
    (tmp_path / "sheet.obj").write_text(text)
    (tmp_path / "ell.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 4 4"><path d="M0 0H4V1H1V4H0Z"/></svg>'
    )
    result = iccm("map", "ell.svg", "sheet.obj", "-o", "out.obj", "--report", "out.json")
    report = json.loads((tmp_path / "out.json").read_text())
    assert report["uv"]["flipped"] > 0
    assert (result.code, report["status"]) == (1, "flipped")
    errors = [line for line in result.err.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1 and "flip triangles" in errors[0] and "(uv)" in errors[0]
