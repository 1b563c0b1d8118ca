"""OBJ files keep their bytes; errors are reported in one line."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iccm.errors import InputError
from iccm.io import limits
from iccm.io.meshes import material_library, obj, obj_write
from iccm.io.meshes.obj import parse
from iccm.meshes.charted import Charted

MIXED = """# a comment, kept
mtllib my materials.mtl
o House
v 0 0 0
v 1 0 0 1.0
v 1 1 0
v 0 1 0   0.1 0.2 0.3
v\t0.5\t1.5\t0
vt 0 0
vt 1 0 0
vt 1 1
vn 0 0 1
s 1
g walls south wing
usemtl Red Brick
f 1/1/1 2/2/1 3/3/1 4/1/1
  f -5//1 -4//1 -1//1   # indented, negative, without vt
usemtl Roof
g roof
f 4/-3 3/-2 \\
  5/-1
l 1 2 3
# the end without a line end"""

FORMS = {
    "unix": MIXED.encode(),
    "windows": MIXED.replace("\n", "\r\n").encode(),
    "line end": (MIXED + "\n").encode(),
    "latin name": MIXED.replace("House", "Häuschen").encode("latin-1"),
}


def every(parsed):
    return np.ones(len(parsed.face_at), bool)


@pytest.mark.parametrize("data", FORMS.values(), ids=FORMS.keys())
def test_a_file_is_parsed(data):
    mesh_file = parse(data, Path("m.obj"))
    assert mesh_file.v[3].tolist() == [0, 1, 0]
    assert mesh_file.vt.tolist() == [[0, 0], [1, 0], [1, 1]]
    assert np.diff(mesh_file.starts).tolist() == [4, 3, 3]
    assert mesh_file.corners[:, 0].tolist() == [0, 1, 2, 3, 0, 1, 4, 3, 2, 4]
    assert mesh_file.corners[:, 1].tolist() == [0, 1, 2, 0, -1, -1, -1, 0, 1, 2]
    assert mesh_file.parts()[1:] == ["walls", "south", "wing", "Red Brick", "Roof", "roof"]
    assert mesh_file.faces_of("wing").tolist() == [True, True, False]
    assert mesh_file.faces_of("Roof").tolist() == [False, False, True]
    assert mesh_file.mesh().lines[[0, 2]].tolist() == [16, 20]


@pytest.mark.parametrize("data", FORMS.values(), ids=FORMS.keys())
def test_no_change_gives_the_same_bytes(data, tmp_path):
    mesh_file = parse(data, Path("m.obj"))
    assert mesh_file.data == data
    # even if every texture index is replaced, all other lines are kept
    again = obj_write.retexture(
        mesh_file, every(mesh_file), mesh_file.vt, np.maximum(mesh_file.corners[:, 1], 0)
    )
    strip = [line for line in data.splitlines() if not line.strip().startswith((b"vt", b"f", b"5/"))]
    kept = [line for line in again.splitlines() if not line.strip().startswith((b"vt", b"f", b"5/"))]
    assert strip == kept
    assert (b"\r\n" in data) == (b"\r\n" in again)
    assert parse(again, Path("m.obj")).v.tobytes() == mesh_file.v.tobytes()


def test_an_obj_of_absolute_indices_written_with_its_own_coordinates_is_the_same_file():
    lines = [
        "v 0 0 0",
        "v 1 0 0",
        "v 0 1 0",
        "vt 0.25 0.5",
        "vt 1 0",
        "vt 0 1e-05",
        "f 1/1/1  2/2/1 3/3/1 # keep",
        "",
    ]
    for newline in ("\n", "\r\n"):
        data = newline.join(lines).encode()
        mesh_file = parse(data, Path("m.obj"))
        assert obj_write.retexture(mesh_file, every(mesh_file), mesh_file.vt, mesh_file.corners[:, 1]) == data


def test_only_vt_lines_and_texture_indices_change():
    mesh_file = parse(MIXED.encode(), Path("m.obj"))
    uv = np.array([[0.1, 0.2], [0.3, 0.4]])
    again = obj_write.retexture(mesh_file, every(mesh_file), uv, np.arange(10) % 2).decode().split("\n")
    expected = MIXED.split("\n")
    expected[8:11] = ["vt 0.1 0.2", "vt 0.3 0.4"]
    expected[14] = "f 1/1/1 2/2/1 3/1/1 4/2/1"
    expected[15] = "  f -5/1/1 -4/2/1 -1/1/1   # indented, negative, without vt"
    expected[18] = "f 4/2 3/1 \\"
    expected[19] = "  5/2"
    assert again == expected


def test_a_part_leaves_the_other_faces_their_coordinates():
    data = MIXED.replace("f -5//1 -4//1 -1//1", "f 1/3 2/-2 5/1").encode()
    mesh_file = parse(data, Path("m.obj"))
    roof = mesh_file.faces_of("roof")
    again = parse(
        obj_write.retexture(mesh_file, roof, np.array([[7.0, 8], [9, 9]]), np.array([0, 1, 1])), Path("m.obj")
    )
    for face in (0, 1):
        old, new = (o.vt[o.corners[o.starts[face] : o.starts[face + 1], 1]] for o in (mesh_file, again))
        assert old.tolist() == new.tolist()
    assert again.vt[again.corners[again.starts[2] :, 1]].tolist() == [[7, 8], [9, 9], [9, 9]]
    assert again.data.count(b"\n") == data.count(b"\n") + 2


def test_a_part_before_the_others_moves_their_indices():
    data = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\ng a\nf 1/1 2/1 3/1\nvt 5 5\ng b\nf 1/2 2/-1 3/1\nf 1/-2 2/2 3/2\n"
    mesh_file = parse(data, Path("m.obj"))
    again = parse(
        obj_write.retexture(mesh_file, mesh_file.faces_of("a"), np.array([[3.0, 3]]), np.zeros(3, int)),
        Path("m"),
    )
    assert again.vt[again.corners[:, 1], 0].tolist() == [3, 3, 3, 5, 5, 0, 0, 5, 5]


NUMBERS = [
    "0.1",
    "-1e-7",
    "+.5",
    "5.",
    "1E3",
    "123456789012345678",
    "0.12345678901234567",
    "1e300",
    "2.5e-320",
    "-0",
]


def test_numbers_are_converted_exactly():
    text = "\n".join(f"v {a} {a} 1" for a in NUMBERS)
    mesh_file = parse(text.encode(), Path("m.obj"))
    assert mesh_file.v[:, 0].tobytes() == np.array([float(a) for a in NUMBERS]).tobytes()


@pytest.mark.parametrize("seed", range(3))
def test_random_numbers_are_converted_exactly(seed):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(200, 3)) * 10.0 ** rng.integers(-12, 12, size=(200, 3))
    digits = [3, 12, 17][seed]
    text = "\n".join("v " + " ".join(f"{x:.{digits}g}" for x in row) for row in values)
    expected = [[float(f"{x:.{digits}g}") for x in row] for row in values]
    assert parse(text.encode(), Path("m.obj")).v.tolist() == expected


CUBE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
WRONG = {
    "line 4: a corner must have the form v, v/vt": CUBE + b"f 1 2 x\n",
    "line 4: a corner must have the form v": CUBE + b"f 1 2 0\n",
    "line 4: a corner must have the form": CUBE + b"f 1 2 3.5\n",
    "line 4: a face needs at least 3 corners": CUBE + b"f 1 2",
    "line 2: too few numbers": b"v 0 0 0\nv 1 0\n",
    "line 2: 'abc' is not a number": b"v 0 0 0\nv 1 abc 0\n",
    "line 1: '0x10' is not a number": b"v 0x10 1 0\n",
    "line 1: '1.5.2' is not a number": b"v 1.5.2 1 0\n",
}


@pytest.mark.parametrize("message", WRONG)
def test_a_wrong_line_is_named(message):
    with pytest.raises(InputError) as error:
        parse(WRONG[message], Path("m.obj"))
    assert f"m.obj: {message}" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_part_is_refused_with_a_list_of_parts():
    with pytest.raises(InputError, match=r"m\.obj.*'door'.*'House', 'walls', 'south'"):
        parse(MIXED.encode(), Path("m.obj")).mesh("door")


@pytest.mark.parametrize("seed", range(20))
def test_noise_is_refused_or_read_but_never_crashes(seed):
    rng = np.random.default_rng(seed)
    data = bytearray(FORMS["windows"] * 3)
    for k in rng.integers(0, len(data), 12):
        data[k] = rng.integers(0, 256)
    data = bytes(data[: rng.integers(1, len(data))])
    try:
        mesh_file = parse(data, Path("m.obj"))
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert mesh_file.corners.shape[0] == mesh_file.starts[-1]


def test_a_file_that_is_missing_or_empty_is_refused(tmp_path):
    (tmp_path / "empty.obj").write_bytes(b"")
    for name in ("empty.obj", "missing.obj"):
        with pytest.raises(InputError, match=name):
            obj.read(tmp_path / name)


def test_overlong_numbers_and_names_with_spaces(tmp_path):
    path = tmp_path / "a name with spaces.obj"
    path.write_bytes(b"v 0." + b"1" * 90 + b" 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    mesh_file = obj.read(path)
    assert mesh_file.v[0, 0] == pytest.approx(1 / 9)


LIBRARY = [
    "# mine",
    "newmtl Red Brick",
    "Kd 1 0 0",
    "map_Kd -s 2 2 2 old brick.png",
    "",
    "newmtl Roof",
    "Kd 0 0 1",
]
LIBRARY += ["map_bump -bm 0.5 deep/bump map.png"]


def showing(materials, name):
    return {material: {"map_kd": name} for material in materials}


def test_a_library_changes_in_map_kd_alone(tmp_path):
    library = material_library.Library(tuple(LIBRARY), tmp_path)
    rename = {"Red Brick": "Red Brick"}
    text = material_library.bind(library, rename, "", showing(rename, "my fabric.png"), tmp_path / "out.mtl")
    expected = list(LIBRARY)
    expected[3] = "map_Kd my fabric.png"
    assert text == "\n".join(expected) + "\n"


def test_a_new_picture_is_not_tinted_by_the_colour_of_its_material(tmp_path):
    library = material_library.Library(
        ("newmtl a", "Kd .9 .3 0", "Ks .5 .5 .5", "newmtl b", "Kd 0 0 1"), tmp_path
    )
    text = material_library.bind(
        library, {"a": "a"}, "", showing({"a"}, "f.png"), tmp_path / "o.mtl", untinted=True
    )
    assert text.splitlines() == [
        "newmtl a",
        "Kd 1 1 1",
        "Ks .5 .5 .5",
        "map_Kd f.png",
        "newmtl b",
        "Kd 0 0 1",
    ]


def test_a_moved_library_gets_relative_file_names(tmp_path):
    out = tmp_path / "sub"
    out.mkdir()
    library = material_library.Library(tuple(LIBRARY), tmp_path)
    text = material_library.bind(
        library, {"Roof": "Roof"}, "", showing({"Roof"}, "../f.png"), out / "out.mtl"
    )
    assert "map_Kd -s 2 2 2 ../old brick.png" in text
    assert "map_bump -bm 0.5 ../deep/bump map.png" in text
    assert text.endswith("map_Kd ../f.png\n")


def test_a_shared_or_missing_material_gets_a_copy(tmp_path):
    library = material_library.Library(tuple(LIBRARY), tmp_path)
    rename = {"Roof": "Roof_iccm", None: "iccm"}
    text = material_library.bind(library, rename, "iccm_plain", showing(rename, "f.png"), tmp_path / "o.mtl")
    shared = material_library.Library(tuple(text.splitlines()), tmp_path)
    assert list(shared.materials) == ["Red Brick", "Roof", "Roof_iccm", "iccm", "iccm_plain"]
    assert shared.texture("Roof") is None
    assert shared.texture("Red Brick") == (tmp_path / "old brick.png", ("repeat", "repeat"))
    assert [shared.texture(n)[0].name for n in ("Roof_iccm", "iccm")] == ["f.png", "f.png"]
    assert "Kd 0 0 1" in shared.materials["Roof_iccm"]


def test_a_library_that_is_named_repeatedly_is_read_once(tmp_path):
    """A line of a few bytes must not stand for a whole library each time."""
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 1 0 0\nnewmtl b\nmap_Kd x.png\n")
    once = material_library.read(tmp_path, ["m.mtl"])
    again = material_library.read(tmp_path, ["m.mtl", "m.mtl m.mtl", "missing.mtl", "missing.mtl"])
    assert again.lines == once.lines and len(again.missing) == 1
    assert once.texture("b")[0] == tmp_path / "x.png"


def test_libraries_share_one_limit(tmp_path, monkeypatch):
    for name in ("a", "b"):
        (tmp_path / f"{name}.mtl").write_text(f"newmtl {name}\n")
    monkeypatch.setattr(limits, "LIBRARY_BYTES", 12)
    library = material_library.read(tmp_path, ["a.mtl", "b.mtl"])
    assert list(library.materials) == ["a"] and len(library.missing) == 1


def test_usemtl_lines_go_around_the_part(tmp_path):
    data = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl M\ng a\nf 1 2 3\ng b\nf 1 2 3\ng c\nf 2 3 1\n"
    mesh_file = parse(data, tmp_path / "m.obj")
    binding = obj_write.Binding("new.mtl", {"M": "M_iccm"}, "")
    text = obj_write.retexture(
        mesh_file, mesh_file.faces_of("b"), np.zeros((1, 2)), np.zeros(3, int), binding
    ).decode()
    assert text.splitlines() == [
        *["mtllib new.mtl", "v 0 0 0", "v 1 0 0", "v 0 1 0", "usemtl M", "g a", "f 1 2 3", "g b"],
        *["vt 0 0", "usemtl M_iccm", "f 1/1 2/1 3/1", "g c", "usemtl M", "f 2 3 1"],
    ]


def test_carriage_returns_as_line_ends_are_kept(shapes, iccm):
    text = "o a\rv 0 0 0\rv 1 0 0\rv 1 1 0\rv 0 1 0\rv 2 0 0\rf 1 2 3 4\rf 2 5 3\r"
    (shapes / "a.obj").write_bytes(text.encode())
    assert "kind: mesh" in iccm("info", "a.obj").out
    assert iccm("flatten", "a.obj", "--uv", "b.obj").code == 0
    written = (shapes / "b.obj").read_bytes()
    assert b"\n" not in written and written.count(b"\rvt ") == 5
    assert iccm("map", "square.svg", "b.obj", "-o", "c.obj").code == 0


TILTED = (
    b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    b"vn 0 0 2\nvn 3 0 4\nvn 1e-30 0 -1\nf 1/1/2 2/2/2 3/3/2\nf 1/1/2 3/3/-1 4/4/1\n"
)


def test_normals_of_corners_are_those_that_tangents_are_square_to():
    mesh = obj.parse(TILTED, Path("t.obj")).mesh()
    stated = np.array([[0, 0, 1], [0.6, 0, 0.8], [0, 0, -1]])
    assert mesh.normals == pytest.approx(stated, abs=1e-12)
    assert mesh.normal_corners.tolist() == [1, 1, 1, 1, 2, 0]
    normal, tangent = Charted.of(mesh).frames
    assert normal == pytest.approx(stated[[[1, 1, 1], [1, 2, 0]]])
    assert tangent[0] == pytest.approx(
        np.tile([0.8, 0, -0.6], (3, 1))
    )  # u increases along x, made perpendicular to the normal
    assert np.einsum("mki,mki->mk", normal, tangent) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    "old, new", [(b"vn 0 0 2", b"vn 0 0"), (b"/-1", b""), (b"4/4/1", b"4/4/9"), (b"3 0 4", b"x 0 4")]
)
def test_normals_that_are_none_are_not_used(old, new):
    mesh = obj.parse(TILTED.replace(old, new, 1), Path("t.obj")).mesh()
    assert mesh.normals is None and mesh.normal_corners is None
    assert Charted.of(mesh).frames[0] == pytest.approx(np.broadcast_to([0, 0, 1], (2, 3, 3)))


def test_a_picture_in_another_folder_comes_along(shapes, iccm):
    """Also where the mesh is written again into a third folder; the first picture has another name there."""
    for name in ("photos", "out", "again"):
        (shapes / name).mkdir()
    Image.new("RGB", (5, 3), (200, 30, 90)).save("photos/Rose.PNG")
    (shapes / "tent.obj").write_text("v 0 0 0\nv 3 0 0\nv 3 2 1\nv 0 2 1\nv 0 4 0\nf 1 2 3 4\nf 4 3 5\n")
    mapped = iccm("map", "square.svg", "tent.obj", "--texture", "photos/Rose.PNG", "-o", "out/t.obj")
    assert mapped.code == 0 and "out/t-texture.png" in mapped.err.replace("\\", "/"), mapped.err
    assert "map_Kd t-texture.png" in (shapes / "out/t.mtl").read_text()
    assert (shapes / "out/t-texture.png").read_bytes() == (shapes / "photos/Rose.PNG").read_bytes()
    flattened = iccm("flatten", "out/t.obj", "--uv", "again/t.obj")
    assert flattened.code == 0 and "outside" not in flattened.err
    assert "mtllib t.mtl" in (shapes / "again/t.obj").read_text()
    assert "map_Kd t-texture.png" in (shapes / "again/t.mtl").read_text()
    assert (shapes / "again/t-texture.png").read_bytes() == (shapes / "photos/Rose.PNG").read_bytes()
    shown = iccm("map", "again/t.obj", "square.svg", "--size", "24", "-o", "shown.png")
    assert shown.code == 0, shown.err
    pixels = np.asarray(Image.open("shown.png").convert("RGBA"))
    assert (np.abs(pixels[pixels[..., 3] == 255][:, :3].astype(int) - [200, 30, 90]) <= 1).all()


def test_pictures_below_the_mesh_and_allowed_ones_stay(shapes, iccm):
    (shapes / "out" / "maps").mkdir(parents=True)
    for name in ("out/maps/a.png", "b.png"):
        Image.new("RGB", (5, 3), (200, 30, 90)).save(name)
    (shapes / "tent.obj").write_text("v 0 0 0\nv 3 0 0\nv 3 2 1\nv 0 2 1\nv 0 4 0\nf 1 2 3 4\nf 4 3 5\n")
    arguments = ("map", "square.svg", "tent.obj", "--force", "-o", "out/t.obj", "--texture")
    assert iccm(*arguments, "out/maps/a.png").code == 0
    assert "map_Kd maps/a.png" in (shapes / "out/t.mtl").read_text()
    assert iccm(*arguments, "b.png", "--allow-outside").code == 0
    assert "map_Kd ../b.png" in (shapes / "out/t.mtl").read_text()
    assert not list(shapes.glob("out/*.png"))
