"""`iccm relayout` of GLB files from the wild, with layouts rotated by 90 degrees, so that every texel is known.

Khronos' validator checks the results. The files are WebXR controllers (npm, MIT), fetched once into build.

python -m tests.bench.materials [NAME …]     needs npm and node; a name is a folder and a file: yvr-touch/right
"""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pygltflib as gl
from numpy.typing import NDArray
from PIL import Image

from iccm import cli
from iccm.io.meshes import gltf, gltf_materials
from iccm.meshes.rasterise import rasterise

FOLDER = Path(__file__).parents[2] / "build" / "materials"
PACKAGES = ("@webxr-input-profiles/assets@1.0.20", "gltf-validator@2.0.0-dev.3.10")
PROFILES = FOLDER / "node_modules" / "@webxr-input-profiles" / "assets" / "dist" / "profiles"
NAMES = (
    "generic-touchpad/right",
    "generic-trigger-squeeze/right",
    "htc-vive-focus-3/left",
    "meta-quest-touch-pro/left",
    "oculus-touch-v2/right",
    "pico-4/right",
    "pico-neo3/left",
    "samsung-odyssey/right",
    "yvr-touch/right",
)
SCRIPT = """
const validator = require("gltf-validator"), fs = require("fs");
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2])))
    .then(found => console.log(found.issues.numErrors));
"""
GOAL, LEVELS = 0.005, 8  # largest share of texels that may be off by more than so many levels of 255


def fetched() -> None:
    """Fetch the packages, beside a script that validates."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / "validate.cjs").write_text(SCRIPT)
    if not PROFILES.is_dir():
        subprocess.run(["npm", "install", "--silent", "--no-audit", *PACKAGES], cwd=FOLDER, check=True)


def turned(source: Path, out: Path) -> None:
    """Write a copy of the file with its layout rotated by 90 degrees, by pygltflib."""
    file = gl.GLTF2().load_binary(str(source))
    blob = bytearray(file.binary_blob())
    numbers = {p.attributes.TEXCOORD_0 for mesh in file.meshes for p in mesh.primitives} - {None}
    for accessor in (file.accessors[number] for number in numbers):
        view = file.bufferViews[accessor.bufferView]
        offset, stride = (view.byteOffset or 0) + (accessor.byteOffset or 0), view.byteStride or 8
        uv = np.ndarray((accessor.count, 2), "<f4", blob, offset, (stride, 4))
        uv[:] = np.stack([1 - uv[:, 1], uv[:, 0]], axis=-1)
        if accessor.min or accessor.max:
            accessor.min, accessor.max = uv.min(axis=0).tolist(), uv.max(axis=0).tolist()
    file.set_binary_blob(bytes(blob))
    file.save_binary(str(out))


def pixels(part: gltf.Primitive, info: dict) -> NDArray[np.int64]:
    """Return a picture of a material."""
    source = part.document.source_of(info["index"])
    assert source is not None
    content = part.document.image(source)
    assert content is not None
    return np.asarray(Image.open(io.BytesIO(content)).convert("RGB")).astype(int)


def off(old: gltf.Primitive, new: gltf.Primitive, slot: str) -> float:
    """Return the share of texels in charts that are off; for normals, which are rotated, it is not measured."""
    infos = [dict(gltf_materials.slots(part.material))[slot] for part in (old, new)]
    expected, actual = np.rot90(pixels(old, infos[0]), -1), pixels(new, infos[1])
    uv = new.uv(infos[1])
    assert uv is not None
    corners = uv[new.faces] * [1, -1] + [0, 1]
    corners = (corners - np.floor(corners.mean(axis=1, keepdims=True))) * actual.shape[1::-1]
    inside = rasterise(corners, actual.shape[1], actual.shape[0]).centre
    return float((np.abs(actual - expected)[inside] > LEVELS).any(axis=-1).mean())


def measured(name: str, folder: Path) -> bool:
    """Print a file's line; return whether it is as it should be."""
    source, layout, out = PROFILES / f"{name}.glb", folder / "turned.glb", folder / "out.glb"
    turned(source, layout)
    code = cli.run(["relayout", str(source), str(layout), "-o", str(out), "--force", "-q"])
    parts = [gltf.primitives(gltf.read(path)) for path in (source, out)]
    shares = [
        off(old, parts[1][key], slot)
        for key, old in parts[0].items()
        for slot, _ in gltf_materials.slots(old.material)
        if gltf_materials.kind_of(slot) != "normal"
    ]
    words = ["node", "validate.cjs", str(out)]
    errors = int(subprocess.run(words, cwd=FOLDER, check=True, capture_output=True, text=True).stdout)
    worst = max(shares, default=0.0)
    print(f"{name:32} {len(shares):2} pictures, {worst:.3%} of texels off, {errors} errors of the validator")
    return code == 0 and worst <= GOAL and not errors


def main() -> None:
    """Measure the named files, or all."""
    fetched()
    with tempfile.TemporaryDirectory() as folder:
        good = [measured(name, Path(folder)) for name in sys.argv[1:] or NAMES]
    print(
        f"{sum(good)} of {len(good)} as they should be (at most {GOAL:.1%} off by more than {LEVELS} of 255)"
    )


if __name__ == "__main__":
    main()
