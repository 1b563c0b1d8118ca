"""Tangents compared with MikkTSpace's own code (compiled to WebAssembly, npm's `mikktspace`; fetched once by npm).

python -m tests.bench.tangents        needs npm and node
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import trimesh

from iccm.arrays import Index, Real
from iccm.meshes.charted import Charted

FOLDER = Path(__file__).parents[2] / "build" / "mikktspace"
PACKAGE = "mikktspace@1.1.1"
SCRIPT = """
const fs = require("fs"), mikktspace = require("mikktspace");
const all = new Float32Array(fs.readFileSync("in").buffer.slice(0)), n = all.length / 8;
const found = mikktspace.generateTangents(all.slice(0, 3 * n), all.slice(3 * n, 6 * n), all.slice(6 * n));
fs.writeFileSync("out", Buffer.from(found.buffer, found.byteOffset, found.byteLength));
"""


def fetched() -> None:
    """Fetch the package, beside a script that calls it."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / "ask.cjs").write_text(SCRIPT)
    if not (FOLDER / "node_modules" / "mikktspace").is_dir():
        subprocess.run(["npm", "install", "--silent", "--no-audit", PACKAGE], cwd=FOLDER, check=True)


def theirs(points: Real, normals: Real, uv: Real) -> Real:
    """Return (m, 3, 4) MikkTSpace's tangents at the corners of triangles, with their handedness."""
    parts = [values.astype("<f4").tobytes() for values in (points, normals, uv)]
    (FOLDER / "in").write_bytes(b"".join(parts))
    subprocess.run(["node", "ask.cjs"], cwd=FOLDER, check=True)
    return np.fromfile(FOLDER / "out", "<f4").reshape(-1, 3, 4)


def coordinates(points: Real) -> Real:
    """Return (m, 3, 2) coordinates around the axis, with a seam and the lower half mirrored."""
    turn = np.arctan2(points[..., 1], points[..., 0]) / (2 * np.pi)
    turn -= np.round(turn - turn[:, :1])
    upper = points[..., 2].mean(axis=1, keepdims=True) > 0
    uv = np.stack(
        [np.where(upper, turn, -turn), 0.3 * points[..., 2] + 0.05 * np.sin(5 * points[..., 0])], axis=-1
    )
    return uv.astype(np.float32).astype(float)


def compared(name: str, points: Real, faces: Index, normals: Real) -> None:
    """Print the angles between both."""
    corner_points, corner_faces = points[faces], np.arange(faces.size).reshape(-1, 3)
    uv = coordinates(corner_points)
    sheet = Charted(
        name, points, faces, uv.reshape(-1, 2), corner_faces, normals.reshape(-1, 3), corner_faces
    )
    tangents, reference = sheet.frames[1], theirs(corner_points, normals, uv)
    angle = np.degrees(np.arccos(np.clip(np.sum(tangents * reference[..., :3], axis=-1), -1, 1)))
    agreement = (np.sign(reference[..., 3]) == sheet.mirrored[:, None]).mean()
    summary = f"median {np.median(angle):.4f}°   worst {angle.max():.3f}°   hands {agreement:.0%}"
    print(f"{name:22} {len(faces):6} triangles   {summary}")


def main() -> None:
    """Compare smooth and hard normals on four surfaces."""
    fetched()
    shapes = {
        "sphere": trimesh.creation.icosphere(3),
        "torus": trimesh.creation.torus(1, 0.3),
        "box": trimesh.creation.box().subdivide(),
        "cylinder": trimesh.creation.cylinder(1, 2),
    }
    for name, mesh in shapes.items():
        points = np.asarray(mesh.vertices, np.float32).astype(float)
        faces = np.asarray(mesh.faces)
        smooth, hard = mesh.vertex_normals[faces], np.repeat(mesh.face_normals[:, None], 3, axis=1)
        for kind, normals in (("smooth", smooth), ("hard", hard)):
            compared(f"{name}, {kind}", points, faces, np.asarray(normals, np.float32).astype(float))


if __name__ == "__main__":
    main()
