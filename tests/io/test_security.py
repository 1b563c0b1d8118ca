"""Hostile inputs: no unexpected file is read, and limits apply before memory is allocated."""

import json
import os
import struct
import sys
import zlib

import pytest

from iccm import InputError
from iccm.io import formats
from iccm.io.meshes import mesh_files
from iccm.io.pictures import pillow
from tests.mesh_faces import check_71_faces_are_counted, check_written_faces_are_counted

HUGE = 60_000


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png_header(width, height):
    """A picture whose header declares a size, but without any pixels."""
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(b"\0" * 100)) + chunk(b"IEND", b"")


ENTITIES = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10))
HOSTILE = {
    "entity.svg": '<!DOCTYPE s [<!ENTITY x SYSTEM "file:///etc/hostname">]><svg xmlns="http://www.w3.org/2000/svg">'
    '<path d="&x;M0 0H9V9z"/></svg>',
    "laughs.svg": f'<!DOCTYPE s [<!ENTITY l0 "M0 0H9V9z">{ENTITIES}]><svg xmlns="http://www.w3.org/2000/svg">'
    '<path d="&l9;"/></svg>',
    "quadratic.svg": f'<!DOCTYPE s [<!ENTITY x "{"M0 0H9V9z" * 2000}">]><svg xmlns="http://www.w3.org/2000/svg">'
    f'<path d="{"&x;" * 500}"/></svg>',
    "parameter.svg": '<!DOCTYPE s [<!ENTITY % x "M0 0H9V9z">]><svg xmlns="http://www.w3.org/2000/svg"/>',
    "markup.svg": '<!DOCTYPE s [<!ENTITY x "&#60;g/&#62;">]><svg xmlns="http://www.w3.org/2000/svg">&x;</svg>',
    "remote.svg": '<!DOCTYPE svg SYSTEM "http://localhost:9/x.dtd"><svg xmlns="http://www.w3.org/2000/svg">'
    '<image href="file:///etc/hostname" width="9" height="9"/></svg>',
    "loop.svg": '<svg xmlns="http://www.w3.org/2000/svg"><g id="g"><use href="#g"/></g></svg>',
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_drawings_end_at_once_in_one_line(shapes, iccm, name):
    (shapes / name).write_text(HOSTILE[name])
    result = iccm("map", name, "blob.svg")
    assert result.code == 2 and len(result.lines) == 1 and name in result.err
    with open("/etc/hostname") as file:
        assert file.read().strip() not in result.err


COMMANDS = {
    "svg": "map {} blob.svg -o o.png",
    "png": "map blob.svg blob.svg --texture {} -o o.png",
    "obj": "flatten {} --uv o.obj",
    "glb": "map blob.svg {} -o o.obj",
    "geojson": "map {} blob.svg -o o.png",
    "npz": "apply {} blob.svg -o o.svg",
    "json": "map blob.svg blob.svg --constraints {} -o o.png",
    "toml": "batch {}",
}


@pytest.mark.skipif(sys.platform == "win32", reason="kinds of files of POSIX")
@pytest.mark.parametrize("suffix", COMMANDS)
@pytest.mark.parametrize("kind", ["pipe", "endless device", "link to itself", "folder"])
def test_special_files_are_refused_in_one_line(shapes, iccm, kind, suffix):
    path = shapes / f"odd.{suffix}"
    make = {
        "pipe": lambda: os.mkfifo(path),
        "endless device": lambda: path.symlink_to("/dev/zero"),
        "link to itself": lambda: path.symlink_to(path.name),
        "folder": path.mkdir,
    }
    make[kind]()
    result = iccm(*COMMANDS[suffix].format(path.name).split())
    assert result.code == 2 and len(result.lines) == 1 and path.name in result.err
    assert not list(shapes.glob("o.*"))


EPS = b"""%!PS-Adobe-3.0 EPSF-3.0
%%BoundingBox: 0 0 40 30
%%EndComments
showpage
%%EOF
"""


@pytest.fixture
def started(monkeypatch):
    """The calls of Pillow's interpreter of PostScript, which do nothing."""
    from PIL import EpsImagePlugin

    calls = []
    monkeypatch.setattr(EpsImagePlugin, "Ghostscript", lambda *args, **kwargs: calls.append(args))
    return calls


@pytest.mark.parametrize("name", ["odd.png", "odd.jpg", "odd.tif", "odd.webp"])
@pytest.mark.parametrize("command", ["map blob.svg square.svg --texture {}", "map {} blob.svg", "info {}"])
def test_a_picture_that_holds_postscript_starts_no_interpreter(shapes, iccm, started, name, command):
    (shapes / name).write_bytes(EPS)
    result = iccm(*command.format(name).split())
    assert result.code == 2 and len(result.lines) == 1 and name in result.err
    assert not started


@pytest.mark.parametrize("as_bytes", [False, True])
def test_pillow_opens_no_postscript(tmp_path, started, as_bytes):
    path = tmp_path / "odd.png"
    path.write_bytes(EPS)
    with (
        pytest.raises(InputError, match="odd"),
        pillow.opened(EPS if as_bytes else path, path.name) as picture,
    ):
        picture.load()
    assert not started


def test_a_huge_picture_is_refused_by_its_header(shapes, iccm):
    (shapes / "huge.png").write_bytes(png_header(HUGE, HUGE))
    for arguments in (
        ("square.svg", "blob.svg", "--texture", "huge.png", "--method", "paper"),
        ("huge.png", "blob.svg"),
    ):
        result = iccm("map", *arguments)
        assert result.code == 2 and "huge.png" in result.err and "Traceback" not in result.err
    (shapes / "small.png").write_bytes(png_header(100, 100))
    result = iccm(
        "map", "square.svg", "blob.svg", "--texture", "small.png", "--max-pixels", "9999", "--size", "50"
    )
    assert result.code == 2 and "small.png" in result.err and "9999" in result.err


def test_a_huge_canvas_is_refused_before_solving(shapes, iccm):
    result = iccm("map", "square.svg", "blob.svg", "--size", "100000x100000")
    assert result.code == 2 and "--max-pixels" in result.err


FACES = {
    "a.obj": b"v 0 0 0\n" * 3 + b"f 1 2 3\n" * 70 + b"\tf 1 2 3",
    "a.ply": b"ply\nformat ascii 1.0\nelement vertex 3\nelement face 71\n",
    "a.off": b"OFF # a comment\n# another\n3 71 0\n",
    "a.stl": b"solid".ljust(80) + struct.pack("<I", 71) + bytes(50 * 71),
    "a.gltf": json.dumps(
        {"meshes": [{"primitives": [{"indices": 0}]}], "accessors": [{"count": 213}]}
    ).encode(),
}


def test_faces_of_every_format_that_is_only_read_are_counted_below():
    counted = {formats.suffix_of(name) for name in FACES}
    read_only = {suffix for suffix, form in formats.FORMATS.items() if form.mesh and not form.uv}
    assert counted >= read_only


@pytest.mark.parametrize("suffix", [suffix for suffix, form in formats.FORMATS.items() if form.uv])
def test_faces_of_every_format_that_is_written_are_counted(tmp_path, suffix):
    check_written_faces_are_counted(tmp_path / f"strip{suffix}")


@pytest.mark.parametrize("name", FACES)
def test_faces_are_counted_without_reading_the_mesh(tmp_path, name):
    (tmp_path / name).write_bytes(FACES[name])
    check_71_faces_are_counted(tmp_path / name)


def test_a_binary_gltf_is_counted(tmp_path):
    text = FACES["a.gltf"].ljust(256)
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON")
    (tmp_path / "a.glb").write_bytes(head + text)
    assert mesh_files.open_mesh(tmp_path / "a.glb").count_faces(71) == 71


@pytest.mark.parametrize("suffix", formats.holding("mesh"))
def test_nonsense_has_no_faces(tmp_path, suffix):
    path = tmp_path / (suffix.replace("*", "white") if "*" in suffix else f"a{suffix}")
    for content in (b"", b"\xff" * 30, b"{" * 40, b'{"meshes": [3]}', b"glTF" + b"\xff" * 30):
        path.write_bytes(content)
        assert mesh_files.open_mesh(path).count_faces(5) == 0


def test_too_many_faces_from_the_command_line(shapes, iccm):
    (shapes / "a.obj").write_bytes(FACES["a.obj"])
    result = iccm("map", "square.svg", "a.obj", "--max-faces", "70")
    assert result.code == 2 and "71 faces, more than the limit of 70" in result.err


def glb(accessors, views):
    scene = {
        "asset": {"version": "2.0"},
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": 12}],
    }
    scene["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}]
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    data = struct.pack("<I4s", 12, b"BIN\0") + bytes(12)
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(data), len(text), b"JSON") + text + data


@pytest.mark.parametrize("view", [{}, {"bufferView": 0}])
def test_an_accessor_without_data_is_refused_before_memory_is_allocated(shapes, iccm, view):
    claim = {"count": 10**9, "componentType": 5126, "type": "VEC3", **view}
    little = {"count": 3, "componentType": 5123, "type": "SCALAR", "bufferView": 0}
    (shapes / "a.glb").write_bytes(glb([claim, little], [{"buffer": 0, "byteLength": 12}]))
    for command in (("info", "a.glb"), ("flatten", "a.glb"), ("map", "square.svg", "a.glb")):
        result = iccm(*command)
        assert result.code == 2 and len(result.lines) == 1
        assert all(word in result.err for word in ("a.glb", "accessor 0", "1000000000 items"))


@pytest.mark.parametrize("command", [("info",), ("flatten", "-o", "o.svg")])
def test_every_command_obeys_max_faces(shapes, iccm, command):
    (shapes / "a.obj").write_bytes(FACES["a.obj"])
    result = iccm(command[0], "a.obj", *command[1:], "--max-faces", "70")
    assert result.code == 2 and "71 faces, more than the limit of 70" in result.err and len(result.lines) == 1
