"""Whole meshes unwrapped by `iccm flatten`, xatlas and Blender, measured by the same independent code.

For each GLB file, its primitives are joined and vertices at the same place merged. Blender, as the module `bpy` of
another Python, unwraps it twice: by *Smart UV Project*, and by *Minimum Stretch* on the cuts of `iccm flatten`. xatlas
also packs the charts of `iccm flatten`. Measured are

- the share of the area with coordinates of some area, without the rarer orientation in each chart (flips),
- stretch, the 95th percentile over the area of max(s₁, 1 / s₂), relative to the mean scale,
- spread, the decades of area ratio between the 5th and the 95th percentile,
- utilisation, the area of all triangles in the coordinates relative to their bounding square,
- the mean symmetric Dirichlet energy s₁² + s₂² + 1/s₁² + 1/s₂² (4 is isometric), relative to the mean scale,
- K95, the 95th percentile over the area of the dilatation s₁ / s₂,
- charts, and the length of all seams in sides of a square of the surface's area,
- overlap, the share of the area in the layout where triangles lie on each other,
- processor seconds, for iccm and Blender including the start, with Python's bytecode in its cache.

python -m tests.bench.layouts FOLDER [NAME …] [--blender PYTHON] [--sample N --seed S]

With --sample, N models of each subfolder are chosen at random, also without textures.
"""

from __future__ import annotations

import argparse
import itertools
import os
import random
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from iccm.io.options import TEXELS_BETWEEN_CHARTS

from .assets import COMMAND, File, _places, textured

MERGED_RELATIVE = 1e-6  # relative to the size: vertices this close are the same point
LIMIT = 400  # seconds
OVERLAP_SAMPLES = 5_000  # random points
SAMPLED_FACES = 16, 20_000  # fewest and most faces of models that are sampled
IN_BLENDER = """
import sys, numpy as np, bpy
way, source, target = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)  # without its cube, which would be unwrapped and packed as well
given = np.load(source)
points, faces = given["points"], given["faces"]
mesh = bpy.data.meshes.new("m")
mesh.from_pydata(points.tolist(), [], faces.tolist())
thing = bpy.data.objects.new("m", mesh)
bpy.context.collection.objects.link(thing)
bpy.context.view_layer.objects.active = thing
thing.select_set(True)
layer = mesh.uv_layers.new(name="UVMap")
if way != "smart":
    pairs = {tuple(pair) for pair in given["seams"].tolist()}
    for edge in mesh.edges:
        edge.use_seam = tuple(sorted(edge.vertices)) in pairs
bpy.ops.object.mode_set(mode="EDIT")
bpy.ops.mesh.select_all(action="SELECT")
if way == "smart":
    bpy.ops.uv.smart_project(island_margin=0.002)
else:
    bpy.ops.uv.unwrap(method="MINIMUM_STRETCH", iterations=30)
    bpy.ops.uv.pack_islands(margin=0.002)
bpy.ops.object.mode_set(mode="OBJECT")
uv = np.empty(2 * len(mesh.loops), np.float32)
mesh.uv_layers["UVMap"].data.foreach_get("uv", uv)
np.savez(target, uv=uv.reshape(-1, 3, 2))
"""


class Mesh(NamedTuple):
    """A mesh: points (n, 3) and triangles (m, 3)."""

    points: NDArray
    faces: NDArray


class Figures(NamedTuple):
    """Measurements of a layout."""

    covered: float
    stretch: float
    spread: float
    used: float
    dirichlet: float
    dilatation: float
    charts: float
    seam: float
    overlap: float
    seconds: float


def joined(path: Path) -> Mesh:
    """Return all triangles of a GLB file with an area, vertices at the same place merged; there may be none."""
    file, points, faces, count = File(path), [], [], 0
    places = _places(file.tree)
    owners = {id(p): k for k, mesh in enumerate(file.tree.meshes) for p in mesh.primitives}
    for part in (p for mesh in file.tree.meshes for p in mesh.primitives if p.mode in (None, 4)):
        part_points = file.values(part.attributes.POSITION).astype(float)
        matrix = places.get(owners[id(part)], np.eye(4))
        points.append(part_points @ matrix[:3, :3].T + matrix[:3, 3])
        faces.append(file.faces(part) + count)
        count += len(part_points)
    if not count:
        return Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64))
    every, triangles = np.concatenate(points), np.concatenate(faces)
    step = MERGED_RELATIVE * np.ptp(every, axis=0).max()
    _, first, number = np.unique(np.round(every / step), axis=0, return_index=True, return_inverse=True)
    triangles = number.ravel()[triangles]
    corners = every[first][triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return Mesh(every[first], triangles[area > step**2])


def measured(mesh: Mesh, uv: NDArray, seconds: float) -> Figures:
    """Measure coordinates (m, 3, 2) of the corners of a mesh's triangles."""
    corners = mesh.points[mesh.faces]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.linalg.norm(a, axis=1)
    along = np.einsum("mi,mi->m", a, b) / length
    high = np.linalg.norm(np.cross(a, b), axis=1) / length
    p, q = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    x = p / length[:, None]
    y = (q - along[:, None] * x) / high[:, None]
    e, f = (x * x).sum(axis=1) + (y * y).sum(axis=1), x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]
    root = np.sqrt(np.maximum(e * e - 4 * f * f, 0))
    big, small = np.sqrt((e + root) / 2), np.sqrt(np.maximum((e - root) / 2, 0))
    area = 0.5 * length * high
    flat = np.abs(f) * area
    sound = np.isfinite(big) & (np.abs(f) > 1e-12 * np.nanmean(np.abs(f)))
    chart = charts(uv)
    turned = sum(np.minimum(*(np.bincount(chart, area * (sound & (sign * f > 0))) for sign in (1, -1))))
    scale = np.sqrt(flat[sound].sum() / area[sound].sum())
    stretch = np.where(sound, np.maximum(big / scale, scale / np.maximum(small, 1e-300)), np.inf)
    ratio = np.log10(np.maximum(np.abs(f), 1e-300) / scale**2)
    low, top = (weighted(ratio[sound], area[sound], share) for share in (0.05, 0.95))
    used = flat[sound].sum() / max(np.ptp(uv[sound].reshape(-1, 2), axis=0)) ** 2
    covered = (area[sound].sum() - turned) / area.sum()
    with np.errstate(divide="ignore", over="ignore"):
        energy = (big / scale) ** 2 + (small / scale) ** 2 + (scale / big) ** 2 + (scale / small) ** 2
        dilatation = np.where(sound, big / np.maximum(small, 1e-300), np.inf)
    return Figures(
        covered,
        weighted(stretch, area, 0.95),
        top - low,
        used,
        float((energy * area)[sound].sum() / area[sound].sum()),
        weighted(dilatation, area, 0.95),
        np.unique(chart).size,
        float(
            np.linalg.norm(np.diff(mesh.points[seams_of(mesh, uv)], axis=1), axis=2).sum()
            / np.sqrt(area.sum())
        ),
        overlapping(uv[sound], flat[sound]),
        seconds,
    )


def overlapping(uv: NDArray, area: NDArray) -> float:
    """Return the share of the area of triangles (m, 3, 2) that lies on other ones, by random points in them."""
    draw = np.random.default_rng(1)
    owner = draw.choice(len(uv), OVERLAP_SAMPLES, p=area / area.sum())
    weights = draw.dirichlet((1, 1, 1), OVERLAP_SAMPLES)
    points = np.einsum("ki,kij->kj", weights, uv[owner])
    tree = shapely.STRtree(shapely.polygons(uv))
    sample, _ = tree.query(shapely.points(points), "within")
    return float((np.bincount(sample, minlength=OVERLAP_SAMPLES) > 1).mean())


def charts(uv: NDArray) -> NDArray:
    """Return (m,) the chart of each triangle (m, 3, 2): triangles with a vertex in common are in the same one."""
    _, corner = np.unique(np.round(uv.reshape(-1, 2), 7), axis=0, return_inverse=True)
    triangle = np.repeat(np.arange(len(uv)), 3)
    graph = coo_array((np.ones(triangle.size), (triangle, len(uv) + corner.ravel())))
    graph.resize((len(uv) + corner.size, len(uv) + corner.size))
    return connected_components(graph, directed=False)[1][: len(uv)]


def weighted(values: NDArray, weights: NDArray, share: float) -> float:
    """Return the quantile of values with weights."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, share * total[-1])])


def by_iccm(mesh: Mesh, folder: Path) -> tuple[NDArray, float]:
    """Return coordinates (m, 3, 2) by `iccm flatten`, and processor seconds."""
    with (folder / "in.obj").open("w") as out:
        out.writelines("v {:.9g} {:.9g} {:.9g}\n".format(*point) for point in mesh.points.tolist())
        out.writelines("f {} {} {}\n".format(*face) for face in (mesh.faces + 1).tolist())
    seconds = spent([COMMAND, "flatten", folder / "in.obj", "--uv", folder / "out.obj", "--force"])
    places, corners = [], []
    for line in (folder / "out.obj").read_text().splitlines():
        if line.startswith("vt "):
            places.append([float(field) for field in line.split()[1:3]])
        elif line.startswith("f "):
            numbers = [word.split("/")[1] if "/" in word else "" for word in line.split()[1:]]
            corners.append([int(field) - 1 if field else -1 for field in numbers])
    number = np.array(corners)
    uv = np.concatenate([np.array(places), [[np.nan, np.nan]]])
    return uv[number], seconds


def by_xatlas(mesh: Mesh) -> tuple[NDArray, float]:
    """Return coordinates (m, 3, 2) by xatlas, and processor seconds."""
    import xatlas

    start = time.process_time()
    atlas = xatlas.Atlas()
    scale = 1000 / np.ptp(mesh.points, axis=0).max()  # xatlas considers small triangles degenerate
    atlas.add_mesh((scale * mesh.points).astype(np.float32), mesh.faces.astype(np.uint32))
    atlas.generate(xatlas.ChartOptions(), padded())
    return coordinates_of(atlas), time.process_time() - start


def packed_by_xatlas(uv: NDArray) -> tuple[NDArray, float]:
    """Return coordinates (m, 3, 2) with their charts packed by xatlas, and processor seconds."""
    import xatlas

    start = time.process_time()
    places, corner = np.unique(np.round(uv.reshape(-1, 2), 7), axis=0, return_inverse=True)
    atlas = xatlas.Atlas()
    atlas.add_uv_mesh((1000 * places).astype(np.float32), corner.reshape(-1, 3).astype(np.uint32))
    atlas.generate(xatlas.ChartOptions(), padded())
    return coordinates_of(atlas), time.process_time() - start


def padded() -> Any:
    """Return options of xatlas' packer with the margins of `iccm flatten`, in a texture of 1024."""
    import xatlas

    options = xatlas.PackOptions()
    options.resolution, options.padding = 1024, TEXELS_BETWEEN_CHARTS
    return options


def coordinates_of(atlas: Any) -> NDArray:
    """Return coordinates (m, 3, 2) in texels: xatlas divides those of a texture that is not square by both sides."""
    _, faces, uv = atlas[0]
    return uv[faces.astype(int)].astype(float) * (atlas.width, atlas.height)


def by_blender(python: Path, method: str, mesh: Mesh, uv: NDArray, folder: Path) -> tuple[NDArray, float]:
    """Return coordinates (m, 3, 2) by Blender, and processor seconds; seams are where `uv` (m, 3, 2) has them."""
    np.savez(folder / "in.npz", points=mesh.points, faces=mesh.faces, seams=seams_of(mesh, uv))
    script = folder / "script.py"
    script.write_text(IN_BLENDER)
    seconds = spent([python, script, method, folder / "in.npz", folder / "out.npz"])
    return np.load(folder / "out.npz")["uv"].astype(float), seconds


def seams_of(mesh: Mesh, uv: NDArray) -> NDArray:
    """Return (s, 2) edges, the smaller vertex first, that have different coordinates on their two sides."""
    places_of_edges: dict[tuple[int, int], tuple] = {}
    apart = set()
    for face, places in zip(mesh.faces.tolist(), np.round(uv, 7).tolist()):
        for k in range(3):
            ends = sorted([(face[k], tuple(places[k])), (face[k - 2], tuple(places[k - 2]))])
            key, value = (ends[0][0], ends[1][0]), (ends[0][1], ends[1][1])
            if places_of_edges.setdefault(key, value) != value:
                apart.add(key)
    return np.array(sorted(apart), np.int64).reshape(-1, 2)


def spent(words: list) -> float:
    """Run a program and return the processor seconds that it takes."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([*map(str, words)], check=True, capture_output=True, timeout=LIMIT, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime


def main() -> None:
    """Print a line per mesh and method, and medians."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--blender", type=Path)
    parser.add_argument("--sample", type=int)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    every: dict[str, list[Figures]] = {}
    models = (path for path in options.folder.rglob("*.glb") if "downloads" not in path.parts)
    paths = sorted(models, key=lambda path: (path.stat().st_size, path))
    chosen = sampled(paths, options.sample, options.seed) if options.sample else filter(textured, paths)
    for path in chosen:
        if options.names and path.name not in options.names:
            continue
        mesh = joined(path)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            row: dict[str, Figures | str] = {}
            try:
                uv, seconds = by_iccm(mesh, folder)
                row["iccm"] = measured(mesh, np.nan_to_num(uv), seconds)
                row["xatlas"] = measured(mesh, *by_xatlas(mesh))
                has_uv = np.isfinite(uv).all(axis=(1, 2))
                charted_mesh = Mesh(mesh.points, mesh.faces[has_uv])
                row["iccm, packed by xatlas"] = measured(charted_mesh, *packed_by_xatlas(uv[has_uv]))
                for way in ("smart", "minimum stretch") if options.blender else ():
                    layout = by_blender(options.blender, way, mesh, uv, folder)
                    row[f"Blender, {way}"] = measured(mesh, *layout)
            except (subprocess.SubprocessError, RuntimeError) as error:
                print(f"{path.name}: {error}", file=sys.stderr, flush=True)
        for method, figures in row.items():
            every.setdefault(method, []).append(figures)
            print(f"{path.stem[-32:]:32} {len(mesh.faces):6} {method:26}", text_of(figures), flush=True)
    for method, figures in every.items():
        for name, share in (("median", 0.5), ("90 %", 0.9)):
            middle = Figures(*np.quantile(np.array(figures), share, axis=0))
            print(f"{name:6} of {len(figures):3} {'':26} {method:26}", text_of(middle))


def sampled(paths: list[Path], count: int, seed: int) -> list[Path]:
    """Return models of each folder, chosen at random among those of a size that all programs take."""
    draw, chosen = random.Random(seed), list[Path]()
    for folder in sorted({path.parent for path in paths}):
        candidates = sorted(path for path in paths if path.parent == folder)
        draw.shuffle(candidates)
        least, most = SAMPLED_FACES
        fitting = (path for path in candidates if least <= len(joined(path).faces) <= most)
        chosen += list(itertools.islice(fitting, count))
    print("sample of seed", seed, *(f"{path.parent.name}/{path.stem}" for path in chosen), flush=True)
    return chosen


def text_of(figures: Figures) -> str:
    """Return figures as text."""
    covered, stretch, spread, used, dirichlet, dilatation, charts, seam, overlap, seconds = figures
    return (
        f"covered {covered:6.1%}  stretch {stretch:6.2f}  spread {spread:5.2f}  used {used:4.2f}  "
        f"dirichlet {dirichlet:6.3f}  K95 {dilatation:5.2f}  charts {charts:4.0f}  seam {seam:5.1f}  "
        f"overlap {overlap:5.1%}  {seconds:6.2f} s"
    )


if __name__ == "__main__":
    main()
