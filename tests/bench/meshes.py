"""Meshes: OBJ files compared with libigl, the flattening compared with LSCM, a million triangles baked, and angles
against mesh size.

python -m tests.bench.meshes [files | flattening | large | repair | baking | angles …] [--rebake MESH PICTURE]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import igl
import numpy as np

from iccm.flattening import flatten as laid_out
from iccm.io.meshes import obj, obj_write
from iccm.io.pictures import image_files
from iccm.io.run.outputs import baked
from iccm.io.shapes import mesh_reading
from iccm.maps.extended_inverse import ExtendedInverse
from iccm.maps.harmonic import HarmonicMap
from iccm.meshes import bake, flatten
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.layout import layout
from iccm.meshes.mesh import Mesh
from iccm.pixels.sampler import Sampler
from iccm.pixels.warp import Texture

from . import surfaces
from .goals import goal

COMMAND = str(Path(sys.executable).with_name("iccm"))


def best(work: Callable, repeats: int = 3) -> tuple[float, float, object]:
    """Return the least wall-clock and processor seconds of some runs after a first one, and the last result."""
    result = work()
    wall, used = [], []
    for _ in range(repeats):
        start, cpu = time.perf_counter(), time.process_time()
        result = work()
        wall.append(time.perf_counter() - start)
        used.append(time.process_time() - cpu)
    return min(wall), min(used), result


def triangles(n: int, shape=surfaces.wave) -> Mesh:
    """Return 2 n² triangles of a surface over the square, with its plan as texture coordinates."""
    z, quads = surfaces.square_grid(n)
    q = np.array(quads)
    faces = np.stack([q[:, [0, 1, 2]], q[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    uv = np.column_stack([z.real, z.imag]) / 2 + 0.5
    return Mesh.triangles(f"wave {n}", shape(z), faces, uv=uv, uv_corners=faces.ravel())


def files() -> None:
    """Read and write half a million faces."""
    mesh = triangles(500)
    faces = mesh.corners.reshape(-1, 3)
    with tempfile.TemporaryDirectory() as folder:
        path, copy = str(Path(folder) / "a.obj"), Path(folder) / "b.obj"
        normals = np.zeros((0, 3)), np.zeros((0, 3), np.int64)
        write, *_ = best(lambda: igl.writeOBJ(path, mesh.points, faces, *normals, mesh.uv, faces))
        read, *_ = best(lambda: igl.readOBJ(path))
        ours, _, whole = best(lambda: obj.read(path))
        every = np.ones(len(faces), bool)

        def rewrite() -> None:
            copy.write_bytes(obj_write.retexture(whole, every, mesh.uv, faces.ravel()))

        again, *_ = best(rewrite)
    print(
        f"OBJ, {len(faces)} faces      read {ours:.2f} s (libigl {read:.2f})   write {again:.2f} s (libigl {write:.2f})"
    )
    print(f"                        together {(ours + again) / (read + write):.2f} times libigl's time")


def flattening() -> None:
    """Flatten a patch of a hundred thousand vertices."""
    mesh = triangles(316)
    checks, _, piece = best(lambda: disk_patch(mesh))
    solve, *_ = best(lambda: flatten.lscm(piece, piece.loops[0]), 1)

    def everything() -> None:
        layout = laid_out(disk_patch(mesh))
        layout.report()
        assert layout.boundary.z.size

    total, *_ = best(everything, 1)
    remainder = total - solve
    print(
        f"patch, {len(mesh.points)} vertices  checks {checks:.2f} s   LSCM {solve:.2f} s   all else {remainder:.2f} s"
    )


def large() -> None:
    """Run the command on four times the triangles; processor seconds hardly depend on other load of the machine."""
    figures_by_size = {}
    with tempfile.TemporaryDirectory() as folder:
        for n in (370, 740):
            mesh, path = triangles(n), Path(folder) / f"{n}.obj"
            with path.open("w") as file:
                np.savetxt(file, mesh.points, fmt="v %.9f %.9f %.9f")
                np.savetxt(file, mesh.corners.reshape(-1, 3) + 1, fmt="f %d %d %d")
            words = [
                "flatten",
                "--method",
                "lscm",
                "--force",
                "--uv",
                str(path.with_suffix(".uv.obj")),
                str(path),
            ]
            runs = [used([COMMAND, *words]) for _ in range(2)]
            figures_by_size[n] = [min(values) for values in zip(*runs)]
            wall, user, system, peak = figures_by_size[n]
            used_up = f"{wall:.1f} s, {user:.1f} + {system:.1f} s of processor, {peak:.2f} GB"
            print(f"flatten --method lscm, {2 * n * n} triangles   {used_up}")
    small, big = figures_by_size.values()
    goal("large meshes: processor time of four times the triangles", sum(big[1:3]) / sum(small[1:3]), 4, "x")
    goal("large meshes: memory of a million triangles", big[3], 3, "GB")


def used(words: list[str]) -> tuple[float, float, float, float]:
    """Return wall-clock seconds, processor seconds in user and system mode, and peak GB of a command."""
    start = time.perf_counter()
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = status
    assert status == 0, words
    return time.perf_counter() - start, usage.ru_utime, usage.ru_stime, usage.ru_maxrss / 1e6


def repair() -> None:
    """Flatten a patch of a hundred thousand vertices whose free flattening overlaps itself: a winding ramp."""
    t, r = np.meshgrid(np.linspace(0, 2.6 * np.pi, 447), np.linspace(0.4, 1.8, 224), indexing="ij")
    k = np.arange(t.size).reshape(t.shape)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1)
    points = np.column_stack([(r * np.cos(t)).ravel(), (r * np.sin(t)).ravel(), 0.12 * t.ravel()])
    piece = disk_patch(Mesh("ramp", points, quads, 4 * np.arange(quads.size // 4 + 1)))
    lscm, *_ = best(lambda: flatten.lscm(piece, piece.loops[0]), 1)
    start = time.perf_counter()
    layout = laid_out(piece)
    print(
        f"ramp, {len(points)} vertices   LSCM {lscm:.2f} s, flattened and repaired by {layout.method!r} "
        f"{time.perf_counter() - start:.2f} s, p95 of dilatation {layout.report()['dilatation']['p95']:.4f}"
    )


def baking(size: int = 4096) -> None:
    """Bake a million triangles into size² texels."""
    mesh = triangles(708)
    piece = disk_patch(mesh)
    flat = (piece.points[:, 0] + 1j * piece.points[:, 1]).astype(complex)
    side = np.linspace(-1, 1, 20, endpoint=False)
    square = np.concatenate([side - 1j, 1 + 1j * side, -side + 1j, -1 - 1j * side])
    map_ = HarmonicMap(square, square + 0.05 * square**2, 0 * square)
    target = flatten.Flattening(piece, map_(flat), piece.loops[0], "given")
    rng = np.random.default_rng(0)
    texture = Texture(rng.integers(0, 255, (1024, 1024, 3)).astype(np.uint8), (-1 - 1j, 1 + 1j))
    assert mesh.uv is not None
    assert mesh.uv_corners is not None
    uv, uv_faces = mesh.uv, mesh.uv_corners[piece.corner]

    def work() -> None:
        charts = layout("wave", uv, uv_faces, piece.triangles.twin, size, size)
        bake.bake([bake.BakedPart(target, ExtendedInverse(map_), texture)], charts, Sampler(texture))

    wall, cpu, _ = best(work, 2)
    print(f"bake, {len(piece.faces)} triangles into {size}²   {wall:.2f} s, {cpu:.2f} s of processor")


def angles() -> None:
    """Print the conformal error of the flattening against the mesh size."""
    for name in ("face", "sail", "wave"):
        errors = []
        for n in (16, 32, 64):
            z, quads = surfaces.square_grid(n) if name != "face" else surfaces.polar_grid(n, 2 * n)
            corners = np.concatenate([np.array(f) for f in quads])
            starts = np.concatenate([[0], np.cumsum([len(f) for f in quads])])
            layout = laid_out(disk_patch(Mesh(name, getattr(surfaces, name)(z), corners, starts)))
            errors.append(layout.report()["dilatation"]["p95"] - 1)
        rates = np.log2(np.array(errors[:-1]) / errors[1:])
        error_text = ", ".join(f"{e:.4f}" for e in errors)
        print(
            f"angles, {name:5}           p95 of dilatation - 1: {error_text}   order {rates[0]:.2f}, {rates[1]:.2f}"
        )


def rebake(mesh: str, picture: str) -> None:
    """Bake a textured mesh into its own layout, through a cut and its flattening; every texel should be unchanged."""
    shape, image = (
        mesh_reading.read(mesh, cutting=mesh_reading.Cutting(closed=True)),
        image_files.read(picture),
    )
    identity = HarmonicMap(shape.curve.z, shape.curve.z, 0 * shape.curve.z)
    height, width = image.pixels.shape[:2]
    sampler = Sampler(image.texture(shape.box))
    baked_picture, report = baked.bake([(shape, identity, shape)], sampler, (width, height), padding=0)
    reached = baked_picture.any(axis=2)
    error = np.abs(baked_picture.astype(float) - image.pixels)[reached]
    print(
        f"{mesh} into its own {report['charts']} charts, {reached.sum()} texels: "
        f"error {error.mean():.4f} in the mean, {error.max():.0f} at most"
    )


def main() -> int:
    """Run all parts, or those named."""
    parts = (files, flattening, large, repair, baking, angles)
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    names = [part.__name__ for part in parts]
    parser.add_argument("parts", nargs="*", help=f"{', '.join(names)}; all of them by default")
    parser.add_argument(
        "--rebake", nargs=2, metavar=("MESH", "PICTURE"), help="bake a textured mesh into its layout"
    )
    chosen = parser.parse_args()
    if chosen.rebake:
        rebake(*chosen.rebake)
    for part in parts:
        if part.__name__ in (chosen.parts or ([] if chosen.rebake else names)):
            part()
    return 0


if __name__ == "__main__":
    sys.exit(main())
