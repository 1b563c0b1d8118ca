"""A fuzz target: mutated inputs of every kind must be read, or rejected in one line; never a traceback, hang or crash.

    python -m tests.fuzz --count 10000            all kinds, in processes that may die
    python -m tests.fuzz --kind svg --seed 12345  one input again, with its traceback

Each input follows from its kind and seed alone. Runs of 20,000 so far began at the seeds 7,000,000, 8,000,000,
11,000,000, 12,000,000 and 51,000,000 (none of the last made trouble), and 36 of 500 each at 13,000,000, 13,001,000,
…, and 20 of 1,000 each at 31,000,000, 31,010,000, … (none either), and of the kinds whose values are changed one by
one at 71,000,000 and 72,000,000, and 1,895 of 20 kinds at 91,000,000, and 28 of 1,000 each at 131,000,000,
131,010,000, …: there a map with pins took 37 s of the processor (seed 131,120,000; 10 s since), and no other input made
trouble; and 3 of 1,500 each at 132,000,000, 132,010,000 and 132,020,000 (none
either), and some at 132,030,000 (a feature of GeoJSON that was null, mended).
20 of 1,000 each at 132,040,000, 132,050,000, … 132,230,000, and 10 more up to 132,330,000 made none, nor did
1,500 drawings at 133,000,000 and 600 of all kinds at 133,010,000, nor 6 of 1,000 each at 134,000,000, 134,010,000, …
134,050,000.
Take others for the next. CI and the tests run a slice from 0.
"""

import argparse
import base64
import contextlib
import functools
import io
import json
import random
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from iccm import InputError

LIMIT = 10  # processor seconds for an input
MEMORY = 2 << 30  # bytes that the process may hold
ADDRESSES = 8 << 30  # bytes that it may reserve, which readers of OBJ files do in advance

SVG = b"""<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 100 80"
width="10cm">
<style>.a{fill:none;transform:rotate(3)} #b{display:none} g>rect:not(.a)+[r~="4"], svg :is(g path){x:2}</style>
<defs><path id="p" d="M1 2C3 4 5 6 7 8S9 10 11 12Q13 14 15 16T17 18A5 6 30 0 1 40 50z"/></defs>
<g transform="matrix(1 .1 -.1 1 3 4) scale(2,-1) translate(1)"><use xlink:href="#p" x="3" y="4%"/>
<rect x="1" y="2" width="30" height="40" rx="3"/><circle cx="50%" cy="5" r="4"/><ellipse rx="4" ry="5" id="pin-a"/>
<polygon points="1,2 30,4 5,60" fill-rule="evenodd"/><polyline points="1 2 3 4"/><line x1="1" x2="9"/></g>
<path id="stroke-b" d="m1 1h3v4l-5-6"/><text x="3">hi</text>
<svg viewBox="0 0 5 5" x="2"><path d="M0 0H5V5z"/></svg></svg>"""
ART = b"""<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 100 100">
<style>@import "http://away.example/a.css";.a{fill:url(http://away.example/b);stroke:red}
@media print{b{fill:url(#g)}}g>.a:not([r]),:root path~*{fill:url(http://away.example/d)}</style>
<defs><clipPath id="c"><path d="M20 20H70V80Z"/></clipPath>
<mask id="k"><circle cx="40" cy="40" r="30" fill="#fff"/></mask>
<linearGradient id="g" x2="50%"><stop stop-color="red" onclick="away()"/></linearGradient>
<marker id="m" markerWidth="3">
<path d="M0 0H3V3Z"/></marker><pattern id="p" width="9" height="9"><rect width="5" height="5"/></pattern>
<filter id="f"><feOffset dx="3" dy="1"/><feImage href="http://away.example/c"/></filter></defs>
<path id="o" d="M10 10H90V90H10Z"/><g clip-path="url(#c)" style="mask:url(#k);filter:url('file:///away')">
<circle class="a" cx="50" cy="40" r="20" stroke-width="2" stroke-dasharray="3 1"/></g><use href="#o" x="5"/>
<path d="M20 20C30 40 50 60 60 30" fill="url(#g)" marker-mid="url(#m)" filter="url(#f)" stroke="url(#p)"/>
<image href="data:image/png;base64,AAAA" x="20" y="20" width="9" height="9"/></svg>"""
DRAWN = b"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 40">
<circle id="pin-a" cx="15" cy="16" r="1"/><path id="stroke-b" d="M20 20L24 21"/>
<path d="M5 5L20 4Q32 2 33 12C36 18 30 22 34 30A4 4 0 0 1 30 35L18 33 14 36 4 34 8 20Z M18 12h6v4h-6z"
fill-rule="evenodd"/>
</svg>"""
PLAIN = re.sub(rb"(?m)^<circle.*\n", b"", DRAWN)
"""The same shape without pins and strokes, which a mesh could not match."""
OBJ = b"""# a comment
mtllib m.mtl
o sheet
v 0 0 0
v 1 0 .1
v 2 0 0
v 0 1 0
v 1 1 0.3
v 2 1 0
v 0 2 0
v 1 2 0
vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
usemtl red
s 1
f 1/1/1 2/2/1 5/3/1 4/1/1
f 2 3 6 5
g part
f -5//1 -4//1 -1//1
f 4 8 \\
7
l 1 2 3
"""
SHEET = b"""mtllib m.mtl
v 0 0 0
v 1 0 0
v 1 1 .2
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
usemtl red
f 1/1/1 2/2/1 3/3/1
usemtl blue
f 1/1 3/3 4/4
"""
MTL = b"newmtl red\nKd 1 0 0\nmap_Kd -s 1 1 1 -o 0.5 a b.png\nnewmtl blue\nillum 2\n"
TOML = b"""[defaults]
size = "64x48"
output = "o/{source.stem}-{target.stem}-{number}.png"
[[job]]
source = "*.svg"
target = "a.svg#x"
pin = ["1,2:3,4", [[1, 2], [3, 4]], [1, 2, 3, 4]]
quasi = 1e-3
[[job]]
source = "a.svg"
target = "a.svg"
name = "n {source.id}"
"""
JSONL = b'{"defaults": {"size": 64}}\n{"source": "a.svg", "target": "a.svg", "pin": ["1,2:3,4"]}\n{"source": "a.svg"}\n'
JSON = b"""{"pins": [{"name": "nose", "source": [120, 80], "target": [310.5, 42], "weight": 1}],
"strokes": [{"source": [[10, 10], [40, 12]], "target": [[5, 90], [9, 70]], "ends": "free"}]}"""
PLY = b"""ply
format ascii 1.0
comment TextureFile a.png
element vertex 4
property float x
property float y
property float z
property float s
property float t
element face 2
property list uchar int vertex_indices
property list uchar float texcoord
end_header
0 0 0 0 0
1 0 .1 1 0
1 1 0 1 1
0 1 0 0 1
3 0 1 2 6 0 0 1 0 1 1
3 0 2 3 6 0 0 1 1 0 1
"""
OFF = b"OFF\n# a comment\n4 2 5\n0 0 0\n1 0 0.1\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3\n"
STL = b"solid a\n" + b"".join(
    b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex %d 1 0\nvertex %d 1 0\nendloop\nendfacet\n" % pair
    for pair in ((1, 0), (2, 1))
) + b"endsolid a\n"  # fmt: skip
SECRET = b"# password hunter2\nnewmtl red\nKd 1 0 0\nmap_Kd secret.png\n"
INDICES = [
    b"0",
    b"-1",
    b"-9",
    b"9",
    b"10",
    b"760",
    b"999999998",
    b"2147483648",
    b"-2147483649",
    b"1.5",
    b"nan",
]
JSON_NUMBER = rb"(?<=[ \[])\d+"
ACCESSED = [*INDICES[:8], b"1", b"2", b"3", b"5121", b"5125", b"5126", b"80", b"4294967296"]
ITEMS = [b"SCALAR", b"VEC2", b"VEC3", b"VEC4", b"MAT4", b"VEC9"]
REFERENCES = [
    b"../canary/secret.txt", b"../canary/secret.png", b"/etc/hostname", b"..", b".", b"x.obj", b"x.mtl", b"missing",
    b"/dev/zero", b"a\0b", b"\xff", b"~/.bashrc", b"file:///etc/hostname", b"https://away.example/a.png", b"a" * 300,
    b"",
]  # fmt: skip
GLOBS = [
    "/**",
    "**",
    "../*",
    "*/../**",
    "[",
    "/proc/*/fd/*",
    "~/*",
    "*" * 200,
    "**/**/**/x",
    "/dev/*",
    "[!a]*",
    "**/../*",
]
OUT_OF_IT = re.compile(r"""(?<![\w-])url\(\s*["']?(?!\s*(?:#|data:))|@import""", re.IGNORECASE)
NO_NUMBER = re.compile(r"(?:^|[\s(,;:MLCZ-])(?:nan|inf)(?:$|[\s,;)LCZ])", re.IGNORECASE)
WORDED = {"id", "class", "style"}
WORDS = [
    b"NaN",
    b"inf",
    b"-1",
    b"0",
    b"1e999",
    b"1e-999",
    b"99999999999999999999",
    b"2147483648",
    b"#p",
    b"\xff\xfe",
    b"\0",
]
WORDS += [
    b"&lol;",
    b'<!DOCTYPE x [<!ENTITY lol "lol">]>',
    b"file:///etc/passwd",
    b"]]>",
    b"<![CDATA[",
    b"{",
    b"[",
    b'"',
    b"../",
]
WORDS += [
    b"M",
    b"z",
    b"A",
    b"e5",
    b",",
    b"%",
    b"\r\n",
    b"f 1 1 1\n",
    b"f 1 2\n",
    b"v 1 nan 2\n",
    b"<use href='#p'/>",
    b"<g>",
    b"//",
]


def png() -> bytes:
    """A small picture with alpha, written by hand so that no chunk depends on a library."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    def row(y: int) -> bytes:
        return bytes(v for x in range(24) for v in (200, x, y, 255 if 3 < x < 20 and 3 < y < 20 else 0))

    rows = b"".join(b"\0" + row(y) for y in range(24))
    head = struct.pack(">IIBBBBB", 24, 24, 8, 6, 0, 0, 0)
    parts = (
        chunk(b"IHDR", head)
        + chunk(b"tEXt", b"a\0b")
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )
    return b"\x89PNG\r\n\x1a\n" + parts


def exr() -> bytes:
    """A small picture of half floats with a header, uncompressed, so that byte offsets are fixed."""

    def entry(name: str, kind: str, value: bytes) -> bytes:
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(value)) + value

    channels = (
        b"".join(name + b"\0" + struct.pack("<IIII", 1, 0, 1, 1) for name in (b"A", b"B", b"G", b"R")) + b"\0"
    )
    window, side = struct.pack("<4i", 0, 0, 7, 7), 8
    head = entry("channels", "chlist", channels) + entry("compression", "compression", b"\0")
    head += entry("dataWindow", "box2i", window) + entry("displayWindow", "box2i", window)
    head += entry("lineOrder", "lineOrder", b"\0") + entry("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += entry("screenWindowCenter", "v2f", bytes(8)) + entry(
        "screenWindowWidth", "float", struct.pack("<f", 1)
    )
    head += entry("owner", "string", b"somebody") + entry("comments", "string", b"a few words") + b"\0"
    start = 8 + len(head) + 8 * side
    inner = range(2, side - 2)

    def line(y: int) -> bytes:
        cover = [float(x in inner and y in inner) for x in range(side)]
        values = [part * value for value in (1, 0.25, 0.5, 0.75) for part in cover]
        return struct.pack("<ii", y, 8 * side) + struct.pack(f"<{4 * side}e", *values)

    rows = [line(y) for y in range(side)]
    table = struct.pack(f"<{side}Q", *(start + y * len(rows[0]) for y in range(side)))
    return struct.pack("<II", 20000630, 2) + head + table + b"".join(rows)


def glb() -> bytes:
    """Two triangles with texture coordinates."""
    points = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0.5)
    data = points + struct.pack("<8f", 0, 0, 1, 0, 0, 1, 1, 1) + struct.pack("<6H", 0, 1, 2, 1, 3, 2)
    views = [(0, 48), (48, 32), (80, 12)]
    scene = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2}]}],
        "accessors": [
            {"bufferView": k, "count": count, "componentType": kind, "type": type}
            for k, (count, kind, type) in enumerate(
                [(4, 5126, "VEC3"), (4, 5126, "VEC2"), (6, 5123, "SCALAR")]
            )
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": size} for start, size in views],
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def gltf() -> bytes:
    """The same as text, with a material that refers to a picture beside it."""
    data = glb()
    (size,) = struct.unpack_from("<I", data, 12)
    scene = json.loads(data[20 : 20 + size])
    payload = base64.b64encode(data[28 + size :]).decode()
    scene["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{payload}"
    scene["meshes"][0]["primitives"][0]["material"] = 0
    scene["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    scene |= {"textures": [{"source": 0}], "images": [{"uri": "a b.png"}]}
    return json.dumps(scene).encode()


def shown_glb() -> bytes:
    """Two triangles with a material whose embedded picture is placed by a transform, in nodes that scale and rotate."""
    data, picture = glb(), png()
    (size,) = struct.unpack_from("<I", data, 12)
    scene, payload = json.loads(data[20 : 20 + size]), data[28 + size :]
    scene["bufferViews"].append({"buffer": 0, "byteOffset": len(payload), "byteLength": len(picture)})
    scene["meshes"][0]["primitives"][0]["material"] = 0
    transform = {"KHR_texture_transform": {"offset": [0.1, 0.2], "scale": [1.5, 1.0], "rotation": 0.3}}
    texture_info = {"index": 0, "texCoord": 0, "extensions": transform}
    scene["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": texture_info, "roughnessFactor": 0.5}}
    ]
    scene |= {"textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 33071, "wrapT": 10497}]}
    scene["images"] = [{"bufferView": len(scene["bufferViews"]) - 1, "mimeType": "image/png"}]
    scene["nodes"] = [
        {"children": [1], "scale": [1.0, 2.0, 1.5]},
        {"mesh": 0, "rotation": [0.0, 0.6, 0.0, 0.8], "translation": [1.0, 0.0, -2.0]},
    ]
    return packed_glb(scene, payload + picture)


def packed_glb(scene: dict, data: bytes) -> bytes:
    """A GLB with a tree and its only buffer."""
    data += bytes(-len(data) % 4)
    scene["buffers"] = [{"byteLength": len(data)}]
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def npz() -> bytes:
    """A saved map: a square of eight triangles, bent."""
    from iccm.maps.triangulated.map import TriangulatedMap
    from iccm.saved.map_file import RINGS, MapFile, SavedPlane

    x, y = np.meshgrid(np.arange(3.0), np.arange(3.0))
    z = (x + 1j * y).ravel()
    faces = np.array([[a, a + 1, a + 4] for a in (0, 1, 3, 4)] + [[a, a + 4, a + 3] for a in (0, 1, 3, 4)])
    rim = np.array([0, 1, 2, 5, 8, 7, 6, 3])
    map = TriangulatedMap(z, z + 0.1 * (z.real**2 - z.imag), faces, (rim,))
    planes = [SavedPlane(w[rim], (w.real.min() + 1j * w.imag.min() - 1 - 1j, 3 + 4j), name=name)
              for w, name in ((map.source, "a.svg"), (map.image, "b.svg"))]  # fmt: skip
    about = {"ended": "REACHED", "notes": ["a note"], "energies": [{"total": 1.5}], "rigid": []}
    about |= {"rigid_of_target": False, "job": {"method": "balanced", "holes": "auto", "target_box": None}}
    arrays = {"pins": np.array([[1 + 1j, 1 + 1j]]), "hole_partners": np.empty((0, 2))}
    map_file = MapFile(map, (planes[0], planes[1]), arrays, dict.fromkeys(RINGS, ()), about)
    with tempfile.TemporaryDirectory() as folder:
        map_file.write(f"{folder}/m.npz")
        return Path(folder, "m.npz").read_bytes()


LABELME = {
    "imageWidth": 60,
    "imageHeight": 40,
    "shapes": [
        {"label": "a", "points": [[5, 5], [50, 6], [40, 30], [20, 35]], "shape_type": "polygon"},
        {"label": "b", "points": [[1, 1], [4, 3]], "shape_type": "rectangle"},
        {"label": "c", "points": [[30, 20], [33, 20]], "shape_type": "circle"},
    ],
}
RING = [[0.2, 0.2], [1.5, 0.3], [1.2, 1.6], [0.4, 1.1], [0.2, 0.2]]
GEOJSON = {
    "type": "FeatureCollection",
    "features": [
        {"type": "Feature", "id": "a", "properties": {"name": "p"},
         "geometry": {"type": "Polygon", "coordinates": [RING]}},
        {"type": "Feature", "properties": {}, "geometry": {"type": "LineString", "coordinates": RING[:3]}},
        {"type": "Feature", "properties": None, "geometry": {"type": "MultiPoint", "coordinates": RING[:2]}},
        {"type": "Feature", "properties": {}, "geometry": {"type": "GeometryCollection", "geometries": [
            {"type": "MultiPolygon", "coordinates": [[RING]]}]}},
    ],
}  # fmt: skip
CONSTRAINTS = {
    "pins": [{"name": "nose", "source": [14, 16], "target": [15, 17], "weight": 1.0}],
    "strokes": [
        {"name": "arm", "source": [[10, 22], [18, 24]], "target": [[10, 23], [18, 23]], "ends": "free"}
    ],
    "landmarks": {"source": {"a": [24, 12]}, "target": {"a": [24, 13]}},
    "rigid": [[[20, 26], [24, 26], [22, 30]]],
}
JOBS = {
    "source": "a.svg", "target": "a.svg", "output": ["o/{source.stem}.png"], "size": [16, 12], "turn": 10.0,
    "pin": ["1,2:3,4", [[1, 2], [3, 4]]], "quasi": 0.001, "name": "n", "command": "map", "holes": "auto",
}  # fmt: skip
PINNED = {
    "pins": CONSTRAINTS["pins"],
    "strokes": [],
    "rigid": [],
    "balance": 1.0,
    "turn": 0.0,
    "fit": "whole",
}
MESSAGES = [
    {"type": "follow", "seq": 1, "scene": PINNED},
    {"type": "solve", "seq": 2, "scene": PINNED, "way": ""},
    {"type": "place", "id": 3, "side": "source", "points": [[14, 16], [20, 22]]},
    {"type": "suggest", "id": 4, "scene": PINNED},
    {"type": "save", "id": 5, "scene": PINNED, "name": "c.json", "replace": True},
    {"type": "draw", "id": 6, "scene": PINNED, "name": "-drawn", "replace": True},
    {"type": "export", "id": 7, "scene": PINNED, "name": "o.png", "replace": True, "size": 16, "write": True},
    {"type": "export", "id": 8, "scene": PINNED, "name": "o.png", "size": 16, "write": False},
    {"type": "forget", "id": 9},
]
ODD = [
    None, True, False, 0, -1, 1, 3, 0.5, -0.0, 1e-300, 1e60, 1e99, 1e101, 1e308, float("nan"), float("inf"), 10**400,
    2**31, 2**63, "", "a", "nan", "1e999", "a" * 300, "../x", "/etc", "a\nb", "a\0b", "\ud800", "v3", "-", "#a",
    [], [[]], [None], [0], [0, 0], [1, 2, 3], {}, {"x": 1}, [[0, 0], [0, 0], [0, 0]],
]  # fmt: skip
FLOATS = [0.0, -0.0, 1.0, -1.0, 0.5, 1e-40, 1e-7, 1e7, 1e20, 3e38, float("inf"), float("nan")]

SEEDS = {"svg": SVG, "obj": OBJ, "mtl": MTL, "png": png(), "toml": TOML, "jsonl": JSONL, "json": JSON}
SEEDS |= {"ply": PLY, "off": OFF, "stl": STL, "relayout": SHEET, "gltf": gltf()}
SEEDS |= {"art": ART, "exr": exr(), "stmap": exr(), "glb": glb(), "map": DRAWN, "flatten": OBJ}
SEEDS |= {"npz": npz(), "glbnum": shown_glb(), "constraints": json.dumps(CONSTRAINTS).encode()}
SEEDS |= {"labelme": json.dumps(LABELME).encode(), "geojson": json.dumps(GEOJSON).encode()}
SEEDS |= {"jobs": json.dumps(JOBS).encode(), "edit": json.dumps(MESSAGES).encode()}
MILD = ("npz", "glbnum", "constraints", "labelme", "geojson", "jobs", "edit")
"""Kinds of which single values are changed, so that most inputs pass the first check."""
SUFFIXES = {"glbnum": "glb", "constraints": "json", "labelme": "json", "jobs": "jsonl", "edit": "json"}
SUFFIXES |= {"art": "svg", "stmap": "exr", "map": "svg", "flatten": "obj", "relayout": "obj"}
SLOW = {
    "map": 8,
    "flatten": 4,
    "relayout": 4,
    "gltf": 4,
    "glbnum": 8,
    "constraints": 8,
    "edit": 8,
    "npz": 2,
}  # kinds that are solved, not only read; fewer of them are tried by this factor


def mutated(kind: str, seed: int) -> bytes:
    """Return the input for a kind and seed."""
    rng = random.Random(f"{kind} {seed}")
    data = bytearray(SEEDS[kind])
    for _ in range(rng.choice((1, 1, 2, 3, 6, 12))):
        if kind in MILD and rng.random() < 0.95:
            data[:] = changed(kind, rng, bytes(data))
        elif rng.random() < 0.4:
            misdirect(kind, rng, data)
        else:
            mutate(rng, data)
    if kind == "png" and rng.random() < 0.7:
        mend(data)
    return bytes(data)


def mutate(rng: random.Random, data: bytearray) -> None:
    """Make one change: bytes, words, numbers, a cut, or a copy."""
    start = rng.randrange(len(data) + 1)
    end = min(len(data), start + rng.choice((1, 2, 5, 20, 200)))
    choice = rng.randrange(7)
    if choice == 0 and start < len(data):
        data[start] ^= 1 << rng.randrange(8)
    elif choice == 1:
        del data[start:end]
    elif choice == 2:
        data[start:start] = rng.choice(WORDS) * rng.choice((1, 1, 1, 2, 500))
    elif choice == 3:
        data[start:start] = data[start:end] * rng.choice((1, 3, 100))
    elif choice == 4 and rng.random() < 0.3:
        del data[start:]
    elif choice == 5:
        numbers = list(re.finditer(rb"\d+(\.\d+)?", data))
        if numbers:
            match = rng.choice(numbers)
            data[match.start() : match.end()] = rng.choice(WORDS)
    elif choice == 6 and start < len(data):
        data[start] = rng.randrange(256)


def misdirect(kind: str, rng: random.Random, data: bytearray) -> None:
    """Make one change that the format's own reader understands: an index, a reference, a pattern, or a missing
    statement.
    """
    choice = rng.randrange(3)
    if kind == "glb":
        renumber(rng, data)
    elif kind == "gltf":
        places, words = rng.choice(
            [(JSON_NUMBER, ACCESSED), (rb'(?<="uri": ")[^"]*', REFERENCES), (rb'(?<="type": ")\w+', ITEMS)]
        )
        swap(rng, data, places, words)
    elif kind in ("toml", "jsonl"):
        swap(
            rng, data, rb'(?<="source": ")[^"]*|(?<="target": ")[^"]*|(?<=e = ")[^"]*|(?<=t = ")[^"]*', GLOBS
        )
    elif choice == 0:
        swap(rng, data, rb"(?m)(?<=^(?:f|l) )[^\r\n]*|(?<=^3 )\d.*", INDICES, rb"-?\d+")
    elif choice == 1:
        swap(
            rng,
            data,
            rb"(?m)(?<=^mtllib )[^\r\n]*|(?<=^usemtl )[^\r\n]*|(?<=^map_Kd )[^\r\n]*|(?<=File )\S*",
            REFERENCES,
        )
    else:
        words = sorted(set(re.findall(rb"(?m)^[a-z]+(?= )", data)))
        if words:
            word = rng.choice(words)
            data[:] = re.sub(rb"(?m)^%s .*\n" % word, b"", bytes(data), count=rng.choice((0, 1)))


def changed(kind: str, rng: random.Random, data: bytes) -> bytes:
    """Change one value of JSON, or of what is packed with it; return the data unchanged if it cannot be parsed any
    more.
    """
    try:
        if kind == "npz":
            return changed_npz(rng, data)
        if kind == "glbnum":
            return changed_glb(rng, data)
        return json.dumps(odd(rng, json.loads(data))).encode()
    except (
        *(ValueError, LookupError, TypeError, ArithmeticError),
        *(struct.error, zipfile.BadZipFile, zlib.error, tokenize.TokenError),
        *(NotImplementedError, MemoryError),
    ):
        return data


def odd(rng: random.Random, tree: object) -> object:
    """Return JSON with one value replaced by an unusual one, removed, repeated, or changed a little."""
    places = list(inside(tree))
    if not places:
        return rng.choice(ODD)
    holder, key = rng.choice(places)
    choice, value = rng.randrange(6), holder[key]
    if choice == 0:
        del holder[key]
    elif choice == 1 and isinstance(holder, list):
        holder.insert(key, json.loads(json.dumps(value)))
    elif choice <= 3 and isinstance(value, int | float) and not isinstance(value, bool):
        holder[key] = value * rng.choice((-1, 0, 0.5, 1.01, 3, 1e3, 1e-6))
    elif choice == 4:
        holder[key] = json.loads(json.dumps(rng.choice(places)[0]))
    else:
        holder[key] = rng.choice(ODD)
    return tree


def inside(tree: object) -> Iterator[tuple]:
    """Yield the container and the key of each value of JSON."""
    keys = tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    for key in list(keys):
        yield tree, key
        yield from inside(tree[key])


def changed_npz(rng: random.Random, data: bytes) -> bytes:
    """Change one array of an archive: its values, its header, its bytes, or its name."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = rng.choice(["about.npy"] * 8 + sorted(members))
    member_bytes, choice = bytearray(members.pop(name)), rng.randrange(5)
    if name == "about.npy":
        about = odd(rng, json.loads(str(np.load(io.BytesIO(member_bytes)))))
        member_bytes = io.BytesIO()
        np.save(member_bytes, np.array(json.dumps(about, ensure_ascii=rng.random() < 0.9)))
        members[name] = member_bytes.getvalue()
    elif choice == 0:
        members[rng.choice([name[:-4], "x.npy", name.upper()])] = bytes(member_bytes)
    elif choice == 1:
        swap(
            rng,
            member_bytes,
            rb"\d+(?=[,)])|(?<=')[|<][a-zA-Z]\d*(?=')",
            [*INDICES, b"<f4", b"|O", b"<U9", b"|V8", b">c16"],
        )
        members[name] = bytes(member_bytes)
    elif choice == 2:
        mutate(rng, member_bytes)
        members[name] = bytes(member_bytes)
    else:
        values = np.load(io.BytesIO(member_bytes)).copy()
        if values.size and values.dtype.kind in "cfi":
            index = rng.randrange(values.size)
            choices = [*FLOATS, 1e99, 1e101] if values.dtype.kind in "cf" else [-2, -1, 0, 1, 7, 2**31 - 1]
            values.flat[index] = (
                rng.choice(choices) if rng.random() < 0.5 else values.flat[rng.randrange(values.size)]
            )
        out = io.BytesIO()
        np.save(out, values)
        members[name] = out.getvalue()
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for member, content in members.items():
            archive.writestr(member, content)
    return out.getvalue()


def changed_glb(rng: random.Random, data: bytes) -> bytes:
    """Change one number in the JSON of a GLB, or of its vertices."""
    (size,) = struct.unpack_from("<I", data, 12)
    scene, payload = json.loads(data[20 : 20 + size]), bytearray(data[28 + size :])
    if rng.random() < 0.5:
        struct.pack_into("<f", payload, 4 * rng.randrange(min(20, len(payload) // 4)), rng.choice(FLOATS))
    else:
        scene = odd(rng, scene)
    return packed_glb(scene, bytes(payload))


def swap(rng: random.Random, data: bytearray, places: bytes, words: list, inside: bytes = b"") -> None:
    """Put another word in one of the places that patterns match, or inside one of them."""
    spans = [match.span() for match in re.finditer(places, data)]
    if spans and inside:
        low, high = rng.choice(spans)
        spans = [match.span() for match in re.compile(inside).finditer(data, low, high)]
    if spans:
        low, high = rng.choice(spans)
        word = rng.choice(words)
        data[low:high] = word if isinstance(word, bytes) else word.encode()


def renumber(rng: random.Random, data: bytearray) -> None:
    """Change a number in the JSON of a GLB, and correct its lengths."""
    if len(data) < 20:
        return
    (size,) = struct.unpack_from("<I", data, 12)
    text = bytearray(data[20 : 20 + size])
    swap(rng, text, JSON_NUMBER, ACCESSED)
    text += b" " * (-len(text) % 4)
    data[20 : 20 + size] = text
    struct.pack_into("<I", data, 12, len(text))
    struct.pack_into("<I", data, 8, len(data))


def mend(data: bytearray) -> None:
    """Correct the checksums, so that a changed PNG passes the first check."""
    start = 8
    while start + 12 <= len(data):
        (size,) = struct.unpack_from(">I", data, start)
        if start + 12 + size > len(data):
            break
        struct.pack_into(">I", data, start + 8 + size, zlib.crc32(data[start + 4 : start + 8 + size]))
        start += 12 + size


def read(kind: str, folder: Path, data: bytes) -> None:
    """Read an input as the command line would."""
    from iccm.io import describe
    from iccm.io.batch import manifest
    from iccm.io.pictures import image_files, stmap_files
    from iccm.io.shapes import listing, mesh_reading, shape

    path = folder / f"x.{SUFFIXES.get(kind, kind)}"
    path.write_bytes(data)
    if kind == "art":
        carry(path)
    elif kind == "npz":
        through_map(folder)
    elif kind in ("labelme", "geojson"):
        describe.describe(path)
        with contextlib.suppress(InputError):
            shape.read(str(path))
        (folder / "m.npz").write_bytes(SEEDS["npz"])
        command("apply", "m.npz", path.name, "-o", f"o{path.suffix}", folder=folder)
    elif kind == "constraints":
        (folder / "a.svg").write_bytes(DRAWN)
        command(
            "map", "a.svg", "a.svg", "--constraints", "x.json", "-o", "o.png", "--size", "24", folder=folder
        )
    elif kind == "edit":
        converse(folder, data)
    elif kind == "glbnum":
        (folder / "y.obj").write_bytes(SHEET)
        (folder / "a.svg").write_bytes(PLAIN)
        (folder / "m.mtl").write_bytes(MTL)
        for typed in (
            ("flatten", "x.glb", "--uv", "o.glb", "--carry-maps"),
            ("map", "a.svg", "x.glb", "-o", "o.obj", "--size", "24"),
            ("map", "x.glb", "a.svg", "-o", "o.png", "--size", "24"),
            ("relayout", "x.glb", "y.obj", "-o", "o.obj"),
        ):
            command(*typed, folder=folder)
    elif kind == "map":
        (folder / "a.svg").write_bytes(DRAWN)
        pair = ("x.svg", "x.svg") if len(data) % 3 == 0 else ("a.svg", "x.svg")
        command(
            "map",
            *pair[:: 1 if len(data) % 2 else -1],
            "-o",
            "o.png",
            "-o",
            "o.svg",
            "--size",
            "24",
            folder=folder,
        )
    elif kind == "flatten":
        (folder / "m.mtl").write_bytes(MTL)
        command("flatten", "x.obj", "-o", "o.svg", folder=folder)
    elif kind in ("relayout", "gltf"):
        relayout(folder, f"x.{'obj' if kind == 'relayout' else kind}", data)
    elif kind == "stmap":
        st = stmap_files.read(path, max_pixels=1 << 20)
        stmap_files.apply(st, image_files.Image(np.zeros((9, 9, 3), np.uint8)), folder / "o.png")
    elif kind == "glb":
        describe.describe(path)
        mesh_reading.read(str(path), cutting=mesh_reading.Cutting(closed=True))
    elif kind == "svg":
        describe.describe(path)
        shape.read(str(path))
    elif kind in ("obj", "ply", "off", "stl"):
        (folder / "m.mtl").write_bytes(MTL)
        describe.describe(path)
        mesh_reading.read(str(path), cutting=mesh_reading.Cutting(closed=True))
    elif kind == "mtl":
        (folder / "o.obj").write_bytes(OBJ.replace(b"m.mtl", b"x.mtl"))
        _ = mesh_reading.read(str(folder / "o.obj")).pictures
    elif kind in ("png", "exr"):
        image = image_files.read(path, max_pixels=1 << 20)
        image_files.write(folder / f"o.{kind}", image)
        shape.read(str(path))
    elif kind == "json":
        listing.read(path)
    else:
        (folder / "a.svg").write_bytes(SVG)
        manifest.read(manifest.load(str(path)), str(path), root=folder)


def through_map(folder: Path) -> None:
    """Carry a picture through a saved map, which must write that picture and nothing else."""
    inner = folder / "in"
    inner.mkdir(exist_ok=True)
    (inner / "t.png").write_bytes(png())
    (inner / "o.png").unlink(missing_ok=True)
    (folder / "x.npz").replace(inner / "x.npz")
    before = {path for path in folder.rglob("*")}
    command("info", "x.npz", folder=inner)
    command("apply", "x.npz", "t.png", "-o", "o.png", "--size", "24", folder=inner)
    if extra_files := {path for path in folder.rglob("*")} - before - {inner / "o.png"}:
        raise AssertionError(f"{sorted(extra_files)} was written")


@functools.cache
def edited():  # -> Session, which is slow to import
    """Return a session of the editor with a map."""
    from iccm.io.edit import messages
    from iccm.io.edit.session import Session
    from iccm.io.run.job import make

    Path("a.svg").write_bytes(DRAWN)
    Path("b.svg").write_bytes(DRAWN.replace(b"M5 5L20 4", b"M5 5L20 3"))
    session = Session(make({"source": "a.svg", "target": "b.svg"}))
    session.solve(messages.Scene.model_validate(PINNED))
    return session


def converse(folder: Path, data: bytes) -> None:
    """Send messages to the editor like its page: each is answered, or rejected in one line."""
    from iccm.io.edit import messages
    from iccm.io.edit.link import _Link

    try:
        received = json.loads(data)
    except ValueError:
        received = [data.decode("utf-8", "replace")]
    with contextlib.chdir(folder):
        session = edited()
        link = _Link(session, None, {}, lambda scene: None)
        for part in received if isinstance(received, list) else [received]:
            with contextlib.suppress(InputError):
                message = messages.read(json.dumps(part))
                if isinstance(message, messages.Solve):
                    session.solve(message.scene)
                elif isinstance(message, messages.Follow):
                    session.follow(message.scene)
                else:
                    link._answer(message)


def relayout(folder: Path, name: str, data: bytes) -> None:
    """Transfer a material from one layout to another, one of which is changed; no file beside them may be included."""
    inner, canary = folder / "in", folder / "canary"
    for path in (inner, canary):
        path.mkdir(exist_ok=True)
    (canary / "secret.txt").write_bytes(SECRET)
    (canary / "secret.png").write_bytes(png())
    (inner / "m.mtl").write_bytes(MTL)
    (inner / "a b.png").write_bytes(png())
    (inner / name).write_bytes(data)
    (inner / "y.obj").write_bytes(SHEET)
    pair = (name, "y.obj") if len(data) % 2 else ("y.obj", name)
    out = "o.obj" if len(data) % 3 else "o.glb"
    for old in inner.glob("o*"):
        old.unlink()
    command("relayout", *pair, "-o", out, "--size", "16", folder=inner)
    for output in inner.glob("o*"):
        if b"hunter2" in output.read_bytes():
            raise AssertionError(f"{output.name} holds what stands in ../canary")


def command(*typed: str, folder: Path) -> None:
    """Run a command as a user would: it must end with a valid exit code, and report errors in one line."""
    from iccm import cli  # in this process, for speed

    output = io.StringIO()
    with (
        contextlib.chdir(folder),
        contextlib.redirect_stderr(output),
        contextlib.redirect_stdout(io.StringIO()),
    ):
        code = cli.run(
            [*typed, "--force", "-q", "--threads", "1"]
            if typed[0] == "map"
            else [*typed, "--force"]
            if typed[0] != "info"
            else [*typed]
        )
    lines = output.getvalue().splitlines()
    if code not in (0, 1, 2) or (
        code == 2 and [line[:7] for line in lines if line[:6] != "note: "] != ["error: "]
    ):
        raise AssertionError(f"exit code {code}: {lines[-3:]}")


def carry(path: Path) -> None:
    """Carry a drawing, and check that the result has no references to other files, and contains only finite numbers."""
    from iccm.io import artwork
    from iccm.io.shapes import shape
    from iccm.maps.harmonic import HarmonicMap

    source = shape.read(str(path))
    z = source.curve.resample(60).z
    middle = z.mean()
    image = z + 0.05 * (z - middle) ** 2 / abs(z - middle).max()
    out = path.with_name("out.svg")
    artwork.carry(source, HarmonicMap(z, image, 0 * z), source, out)
    text = out.read_text(encoding="utf-8")
    for element in ElementTree.fromstring(text).iter():
        style = element.text or "" if element.tag.endswith("}style") else ""
        for name, value in [*element.attrib.items(), ("style", style)]:
            link = name.rpartition("}")[2] == "href"
            away = OUT_OF_IT.search(value) or (link and not value.strip().startswith(("#", "data:")))
            if away or name.startswith("on") or (not link and name not in WORDED and NO_NUMBER.search(value)):
                raise AssertionError(f"{name}={value!r} was written")


def refusal(kind: str, seed: int, folder: Path) -> str | None:
    """Return what is wrong with how an input was handled; None if it was read, or rejected in one line."""
    began = time.process_time()
    try:
        read(kind, folder, mutated(kind, seed))
    except InputError as error:
        lines = getattr(error, "mistakes", None) or [str(error)]
        if any("\n" in line for line in lines):
            return f"a message of several lines: {error}"
        if any(len(line) > 2000 for line in lines):
            return f"a message of {max(map(len, lines))} characters: {str(error)[:200]}"
    except Exception as error:
        return f"{type(error).__name__}: {str(error)[:200]}"
    took = time.process_time() - began
    return f"took {took:.1f} s" if took > LIMIT else None


def peak_memory() -> int:
    """Return the most bytes that this process has held; `getrusage` also counts the process that started it."""
    status = Path("/proc/self/status")
    if status.exists():
        return int(re.search(r"VmHWM:\s+(\d+)", status.read_text())[1]) << 10
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << (0 if sys.platform == "darwin" else 10)


def child(kind: str, first: int, count: int) -> None:
    """Go through seeds, printing each before it is tried: if the process dies, the last one is the cause."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            print(json.dumps({"try": seed}), flush=True)
            signal.setitimer(
                signal.ITIMER_PROF, LIMIT + 5
            )  # the default action ends the process even in compiled code
            wrong = refusal(kind, seed, Path(folder))
            if peak_memory() > MEMORY:
                print(json.dumps({"seed": seed, "wrong": f"took more than {MEMORY >> 30} GB"}), flush=True)
                sys.exit(1)
            if wrong:
                print(json.dumps({"seed": seed, "wrong": wrong}), flush=True)
    print(json.dumps({"end": True}), flush=True)


def hunt(kind: str, first: int, count: int) -> list[str]:
    """Return what went wrong for `count` seeds of a kind, one line each."""
    troubles, last = [], first + count
    while first < last:
        command = [
            sys.executable,
            "-W",
            "ignore",
            "-m",
            "tests.fuzz",
            "--child",
            kind,
            str(first),
            str(last - first),
        ]
        result = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[1])
        troubles += [
            f"{kind} {first}…: a library says {line[:200]!r}" for line in result.stderr.splitlines()[:3]
        ]
        records = [json.loads(line) for line in result.stdout.splitlines()]
        troubles += [f"{kind} {line['seed']}: {line['wrong']}" for line in records if "wrong" in line]
        if records and records[-1].get("end"):
            break
        attempts = [line["try"] for line in records if "try" in line]
        if not attempts:
            return [*troubles, f"{kind}: the child did not start: {result.stderr[-500:]}"]
        how = "hung" if result.returncode == -signal.SIGPROF else f"died with {result.returncode}"
        troubles.append(f"{kind} {attempts[-1]}: {how}")
        first = attempts[-1] + 1
    return troubles


def main() -> int:
    """Search for errors, or try one input again."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=1000, help="inputs in all")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--kind", choices=SEEDS, help="one kind only")
    parser.add_argument("--seed", type=int, help="one input, with its traceback")
    parser.add_argument("--child", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        child(options.child[0], int(options.child[1]), int(options.child[2]))
        return 0
    kinds = [options.kind] if options.kind else list(SEEDS)
    if options.seed is not None:
        with tempfile.TemporaryDirectory() as folder:
            data = mutated(kinds[0], options.seed)
            sys.stdout.buffer.write(data[:4000] + b"\n")
            read(kinds[0], Path(folder), data)
        return 0
    shares = {kind: 1 / SLOW.get(kind, 1) for kind in kinds}
    counts = {kind: round(options.count * share / sum(shares.values())) for kind, share in shares.items()}
    troubles = [line for kind in kinds for line in hunt(kind, options.first, counts[kind])]
    print("\n".join(troubles) or f"{options.count} inputs: none made trouble")
    return 1 if troubles else 0


if __name__ == "__main__":
    sys.exit(main())
