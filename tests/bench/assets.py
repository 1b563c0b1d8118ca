"""GLB files from the wild: a drawing mapped onto each, and `iccm relayout` to another unwrap, judged independently.

For each textured file of a folder, small ones first: how much of it plain `iccm map` covers, the dilatation and
uniformity of scale, and whether triangles are flipped although the exit code is 0. Then its parts are unwrapped again
by xatlas (`pip install xatlas`), its materials are transferred, and the colours of 20,000 points of its surface are
compared between both files. Files are read and colours sampled without code of iccm.

With `--validator`, outputs of `map` are checked by the Khronos validator, the npm package `gltf-validator` unpacked in
a folder. `--keep` keeps them, to be rendered. The sources are those of `tests.bench.asset_sources`.

python -m tests.bench.asset_sources FOLDER
python -m tests.bench.assets FOLDER [NAME …] [--only map | relayout] [--validator FOLDER] [--keep FOLDER]
"""

from __future__ import annotations

import argparse
import io
import json
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pygltflib as gl
from numpy.typing import NDArray
from PIL import Image

COMMAND = str(Path(sys.executable).with_name("iccm"))
DRAWING = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="M10 40C10 10 40 5 60 12S98 40 90 60 60 95 '
    '40 90 10 70 10 40Z"/></svg>'
)
MOST_DILATED, LEAST_WITHIN2 = (
    8.0,
    0.8,
)  # p95 of the dilatation, share of the area within a factor of 2 of the mean
PLACES, SHARE, OFF, LIMIT = 20_000, 0.95, 4.0, 400  # of a surface, of triangles, of 255, seconds
WRAPS = {33071: lambda x: np.clip(x, 0, 1), 33648: lambda x: 1 - np.abs(x % 2 - 1), 10497: lambda x: x % 1}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


class File:
    """A GLB file as pygltflib reads it."""

    def __init__(self, path: Path) -> None:
        """Read the file."""
        self.tree = gl.GLTF2().load_binary(str(path))
        self.blob = self.tree.binary_blob() or b""

    def values(self, number: int) -> NDArray:
        """Return (n, k) the values of an accessor; normalized integers are converted to 0 … 1."""
        accessor = self.tree.accessors[number]
        view, kind, width = (
            self.tree.bufferViews[accessor.bufferView],
            TYPES[accessor.componentType],
            WIDTHS[accessor.type],
        )
        offset, size = (view.byteOffset or 0) + (accessor.byteOffset or 0), np.dtype(kind).itemsize
        strides = (view.byteStride or size * width, size)
        values = np.ndarray((accessor.count, width), kind, self.blob, offset, strides)
        return values / np.iinfo(kind).max if accessor.normalized else values.copy()

    @property
    def primitives(self) -> list[gl.Primitive]:
        """The primitives made of triangles with texture coordinates."""
        every = [p for mesh in self.tree.meshes for p in mesh.primitives]
        return [p for p in every if p.mode in (None, 4) and p.attributes.TEXCOORD_0 is not None]

    def faces(self, primitive: gl.Primitive) -> NDArray:
        """Return (m, 3) vertices of the triangles."""
        if primitive.indices is None:
            return np.arange(self.tree.accessors[primitive.attributes.POSITION].count).reshape(-1, 3)
        return self.values(primitive.indices).reshape(-1, 3).astype(np.int64)

    def colours(self, primitive: gl.Primitive, triangles: NDArray, weights: NDArray) -> NDArray:
        """Return (p, 3) base colours, 0 … 255, at points of triangles.

        Texels are decoded before they are interpolated, as glTF requires (§3.9.2).
        """
        return 255 * encoded(self.light(primitive, triangles, weights))

    def light(self, primitive: gl.Primitive, triangles: NDArray, weights: NDArray) -> NDArray:
        """Return (p, 3) the same in linear light, 0 … 1."""
        material = None if primitive.material is None else self.tree.materials[primitive.material]
        physical = material and material.pbrMetallicRoughness
        if not physical:
            return np.full((triangles.size, 3), 1.0)
        factor = np.array(physical.baseColorFactor or (1, 1, 1, 1))[:3]
        texture_info = physical.baseColorTexture
        texels = np.full((triangles.size, 3), 1.0)
        if texture_info is not None:
            texels = self._texels(primitive, texture_info, triangles, weights)
        return texels * factor

    def _texels(
        self, primitive: gl.Primitive, texture_info: gl.TextureInfo, triangles: NDArray, weights: NDArray
    ) -> NDArray:
        texture = self.tree.textures[texture_info.index]
        sampler = None if texture.sampler is None else self.tree.samplers[texture.sampler]
        view = self.tree.bufferViews[self.tree.images[texture.source].bufferView]
        data = self.blob[view.byteOffset or 0 :][: view.byteLength]
        pixels = np.asarray(Image.open(io.BytesIO(data)).convert("RGBA"), float) / 255
        mode = self.tree.materials[primitive.material].alphaMode
        # composited over black
        pixels = _linear(pixels[..., :3]) * (1.0 if mode in (None, "OPAQUE") else pixels[..., 3:])
        uv = self.values(getattr(primitive.attributes, f"TEXCOORD_{texture_info.texCoord or 0}"))
        places = np.einsum("pk,pkc->pc", weights, uv[self.faces(primitive)[triangles]])
        transform = (texture_info.extensions or {}).get("KHR_texture_transform", {})
        c, s = np.cos(transform.get("rotation", 0)), np.sin(transform.get("rotation", 0))
        places = (places * transform.get("scale", (1, 1))) @ np.array([[c, -s], [s, c]]) + transform.get(
            "offset", (0, 0)
        )
        return _bilinear(
            pixels, places, [getattr(sampler, name, None) or 10497 for name in ("wrapS", "wrapT")]
        )


def _bilinear(pixels: NDArray, uv: NDArray, wraps: list[int]) -> NDArray:
    height, width, _ = pixels.shape
    colours = np.zeros((len(uv), 3))
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    for dx in (0, 1):
        for dy in (0, 1):
            columns, rows = np.floor(x) + dx, np.floor(y) + dy
            weight = np.abs(1 - dx - (x - np.floor(x))) * np.abs(1 - dy - (y - np.floor(y)))
            u, v = (
                WRAPS[w]((k + 0.5) / n) for k, n, w in ((columns, width, wraps[0]), (rows, height, wraps[1]))
            )
            texel = (
                np.minimum((v * height).astype(int), height - 1),
                np.minimum((u * width).astype(int), width - 1),
            )
            colours += weight[:, None] * pixels[texel]
    return colours


def _linear(values: NDArray) -> NDArray:
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def encoded(values: NDArray) -> NDArray:
    """Return linear light, 0 … 1, as sRGB."""
    values = np.clip(values, 0, 1)
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * values ** (1 / 2.4) - 0.055)


class Done(NamedTuple):
    """The result of a command.

    Attributes:
        code: its exit code; 124 if it took too long.
        messages: what it printed to standard error.
        seconds: processor time.
    """

    code: int
    messages: str
    seconds: float


def command(*words: object) -> Done:
    """Run iccm."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    try:
        result = subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, timeout=LIMIT)
        code, messages = result.returncode, result.stderr
    except subprocess.TimeoutExpired:
        code, messages = 124, f"over {LIMIT} s"
    return Done(code, messages, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)


def unwrapped(path: Path, out: Path) -> None:
    """Write a copy of the file with a layout of all its parts by xatlas, without textures."""
    import xatlas

    file, document, blob = File(path), gl.GLTF2(), bytearray()
    atlas, parts = xatlas.Atlas(), file.primitives
    for part in parts:
        points = file.values(part.attributes.POSITION).astype(np.float32)
        size = max(float(np.ptp(points, axis=0).max()), 1e-30)  # xatlas considers small triangles degenerate
        atlas.add_mesh(1000 / size * points, file.faces(part).astype(np.uint32))
    atlas.generate()
    document.buffers, document.scenes, document.scene = (
        [gl.Buffer()],
        [gl.Scene(nodes=list(range(len(parts))))],
        0,
    )

    def put(values: NDArray, kind: str, component: int) -> int:
        document.bufferViews.append(gl.BufferView(buffer=0, byteOffset=len(blob), byteLength=values.nbytes))
        blob.extend(values.tobytes() + bytes(-values.nbytes % 4))
        extent = {"min": values.min(0).tolist(), "max": values.max(0).tolist()} if kind == "VEC3" else {}
        view = len(document.bufferViews) - 1
        document.accessors.append(
            gl.Accessor(bufferView=view, componentType=component, count=len(values), type=kind, **extent)
        )
        return len(document.accessors) - 1

    owners = {id(p): mesh for mesh in range(len(file.tree.meshes)) for p in file.tree.meshes[mesh].primitives}
    places = _places(file.tree)
    for k, part in enumerate(parts):
        vertex, faces, uv = atlas[k]
        points = file.values(part.attributes.POSITION).astype(float)[vertex]
        matrix = places.get(owners[id(part)], np.eye(4))
        points = (points @ matrix[:3, :3].T + matrix[:3, 3]).astype("<f4")
        attributes = gl.Attributes(
            POSITION=put(points, "VEC3", 5126), TEXCOORD_0=put(uv.astype("<f4"), "VEC2", 5126)
        )
        flat = faces.astype("<u4").reshape(-1, 1)
        primitive = gl.Primitive(attributes=attributes, indices=put(flat, "SCALAR", 5125))
        document.meshes.append(gl.Mesh(primitives=[primitive], name=f"part {k}"))
        document.nodes.append(gl.Node(mesh=k))
    document.buffers[0].byteLength = len(blob)
    document.set_binary_blob(bytes(blob))
    document.save_binary(str(out))


def _places(tree: gl.GLTF2) -> dict[int, NDArray]:
    """Return the transform (4, 4) of the first node with each mesh."""
    places: dict[int, NDArray] = {}
    waiting = [(root, np.eye(4)) for root in reversed(tree.scenes[tree.scene or 0].nodes)]
    while waiting:
        number, above = waiting.pop()
        node = tree.nodes[number]
        if node.matrix:
            local = np.array(node.matrix).reshape(4, 4).T
        else:
            x, y, z, w = node.rotation or (0, 0, 0, 1)
            local = np.eye(4)
            local[:3, :3] = [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
            local[:3, :3] *= np.array(node.scale or (1, 1, 1))
            local[:3, 3] = node.translation or (0, 0, 0)
        if node.mesh is not None:
            places.setdefault(node.mesh, above @ local)
        waiting += [(child, above @ local) for child in reversed(node.children or [])]
    return places


def differences(old: Path, new: Path) -> NDArray:
    """Return (p,) differences of colours at the same points of all parts, whose triangles are in the same order."""
    before, after = File(old), File(new)
    rng, distances = np.random.default_rng(0), []
    for a, b in zip(before.primitives, after.primitives, strict=True):
        corners = before.values(a.attributes.POSITION).astype(float)[before.faces(a)]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        if not area.sum() > 0:
            continue
        triangles = rng.choice(len(area), PLACES // len(before.primitives) + 1, p=area / area.sum())
        weights = rng.dirichlet((1, 1, 1), triangles.size)
        distances.append(
            np.abs(before.colours(a, triangles, weights) - after.colours(b, triangles, weights)).mean(axis=1)
        )
    return np.concatenate(distances)


def mapped(path: Path, folder: Path) -> dict[str, Any]:
    """Measure the first command that users type for a file: `iccm map drawing.svg file.glb -o out.glb`."""
    (folder / "drawing.svg").write_text(DRAWING)
    out, report = folder / "out.glb", folder / "report.json"
    report.unlink(missing_ok=True)
    mapping = command("map", folder / "drawing.svg", path, "-o", out, "--report", report, "--force")
    figures = json.loads(report.read_text()) if report.exists() else {}
    share, flips = figures.get("mapped", 0.0), sum(figures.get("uv", {}).values())
    return {
        "map": mapping,
        "share": share,
        "covers": mapping.code == 0 and share >= SHARE,
        "dilatation": figures["dilatation"]["p95"] if figures else np.inf,
        "within2": figures["scale"]["within2"] if figures else 0.0,
        "untold": flips > 0 and mapping.code == 0,
    }


def validator_errors(path: Path, package: Path) -> list[str]:
    """Return the codes of a GLB file's errors, by the Khronos validator."""
    script = (
        "const [, at, file] = process.argv; const fs = require('fs');"
        "require(at).validateBytes(new Uint8Array(fs.readFileSync(file)), {maxIssues: 0}).then(found => "
        "console.log(JSON.stringify(found.issues.messages.filter(each => each.severity === 0).map(each => each.code))))"
    )
    words = ["node", "-e", script, str(package.absolute()), str(path)]
    return json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)


def carried(path: Path, folder: Path) -> dict[str, Any]:
    """Measure how far colours are off after a relayout."""
    try:
        unwrapped(path, folder / "new.glb")
    except Exception as error:
        return {"relayout": Done(-1, f"no unwrap: {error}", 0.0), "mean": np.nan}
    carrying = command("relayout", path, folder / "new.glb", "-o", folder / "carried.glb", "--force")
    mean = float(differences(path, folder / "carried.glb").mean()) if carrying.code == 0 else np.nan
    return {"relayout": carrying, "mean": mean}


def textured(path: Path) -> bool:
    """Return whether a file really is a GLB with pictures and coordinates for them."""
    with path.open("rb") as file:
        if file.read(8) != b"glTF\2\0\0\0":
            return False
    tree = gl.GLTF2().load_binary(str(path))
    return bool(tree.images) and any(
        p.attributes.TEXCOORD_0 is not None for mesh in tree.meshes for p in mesh.primitives
    )


def main() -> None:
    """Measure every textured GLB file of a folder, or those named, and print totals."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument("--validator", type=Path)
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    package, kept = options.validator, options.keep
    paths = [
        path for path in options.folder.rglob("*.glb") if not options.names or path.name in options.names
    ]
    paths.sort(key=lambda path: (path.stat().st_size, path))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for path in filter(textured, paths):
            parts = [make(path, Path(folder)) for name, make in PARTS.items() if options.only in (None, name)]
            rows.append(row := {key: value for part in parts for key, value in part.items()})
            line = [f"{path.parent.name[:12]:12} {path.name[:50]:50}"]
            output = Path(folder) / "out.glb"
            row["invalid"] = []
            if "map" in row and row["map"].code < 2:
                if package is not None and (errors := validator_errors(output, package)):
                    # what is wrong with the input stays wrong
                    row["invalid"] = sorted(set(errors) - set(validator_errors(path, package)))
                if kept is not None:
                    shutil.copy(output, kept / f"{path.parent.name}-{path.name}")
            if "map" in row:
                flag = " FLIPS UNTOLD" if row["untold"] else ""
                line.append(
                    f"map {row['map'].code} {row['share']:6.1%} K95 {row['dilatation']:6.2f} within 2x "
                    f"{row['within2']:4.2f}{flag} {row['map'].seconds:6.1f} CPU-s {' '.join(row['invalid'])}"
                )
            if "relayout" in row:
                line.append(
                    f"relayout {row['relayout'].code} {row['mean']:6.2f} {row['relayout'].seconds:6.1f} CPU-s"
                )
            ended = [row[name] for name in PARTS if name in row]
            line += [done.messages.strip().splitlines()[-1][:120] for done in ended if done.code]
            print("  ".join(line), flush=True)
    if options.only != "relayout":
        even = [row["dilatation"] <= MOST_DILATED and row["within2"] >= LEAST_WITHIN2 for row in rows]
        print(f"{sum(row['covers'] for row in rows)} of {len(rows)} mapped by {SHARE:.0%} at exit 0")
        print(f"{sum(even)} of {len(rows)} with K95 <= {MOST_DILATED:g} and within 2x >= {LEAST_WITHIN2:g}")
        print(f"{sum(row['untold'] for row in rows)} with flips at exit 0")
        print(
            f"{sum(bool(row['invalid']) for row in rows)} with errors of the validator that the input has not"
        )
    if options.only != "map":
        good = [row["mean"] < OFF for row in rows if row["relayout"].code == 0]
        print(f"{sum(good)} of {len(good)} relayouts at exit 0 within {OFF:g} of 255, of {len(rows)}")


PARTS = {"map": mapped, "relayout": carried}

if __name__ == "__main__":
    main()
