"""Whether reports are correct: figures of meshes, recomputed from the written files.

For each OBJ file of a folder, small ones first: `iccm map` and `iccm flatten --method` map it onto a disk, `iccm map
--bake` fills its layout with coordinates, and `iccm relayout` transfers a picture from one layout to another. Every
figure in the reports that describes the file is recomputed by other code: a parser of its own, signs by exact
fractions, singular values by LAPACK, outlines by shapely, texels triangle by triangle, and derivatives of a baked map
by finite differences of its pixels.

python -m tests.bench.figures FOLDER [NAME …]
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from fractions import Fraction
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

COMMAND = str(Path(sys.executable).with_name("iccm"))
ANGLES = np.arange(64) * np.pi / 32
DISK = np.column_stack([50 + 40 * np.cos(ANGLES), 50 + 40 * np.sin(ANGLES)])
CORNERS = " ".join(f"{x!r},{100 - y!r}" for x, y in DISK.tolist())
DRAWING = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><polygon points="{CORNERS}"/></svg>'
CLOSE, SIDE, LIMIT = 0.01, 2048, 600  # of a figure; texels; seconds
SHARES = {"p05": 0.05, "p50": 0.5, "median": 0.5, "p95": 0.95, "max": 1.0}
Figures = dict[str, float]


class Written(NamedTuple):
    """The faces of an OBJ that have coordinates.

    Attributes:
        points: (n, 3).
        uv: (t, 2).
        exact: the coordinates as fractions.
        faces: vertices and coordinates of each face.
    """

    points: NDArray
    uv: NDArray
    exact: list[tuple[Fraction, Fraction]]
    faces: list[tuple[list[int], list[int]]]

    @property
    def triangular(self) -> bool:
        """Whether all faces are triangles."""
        return all(len(face) == 3 for face, _ in self.faces)

    @property
    def fans(self) -> tuple[NDArray, NDArray]:
        """Return (m, 3) vertices and coordinates of triangles."""
        numbers = [
            [corners[0], corners[k], corners[k + 1]]
            for part in (0, 1)
            for corners in (face[part] for face in self.faces)
            for k in range(1, len(corners) - 1)
        ]
        return np.array(numbers[: len(numbers) // 2]), np.array(numbers[len(numbers) // 2 :])


def read(path: Path) -> Written:
    """Read an OBJ file."""
    points, uv, exact, faces = [], [], [], []
    for line in path.read_text().splitlines():
        word, *arguments = line.split() or [""]
        if word == "v":
            points.append([float(item) for item in arguments[:3]])
        elif word == "vt":
            uv.append([float(item) for item in arguments[:2]])
            exact.append((Fraction(arguments[0]), Fraction(arguments[1])))
        elif word == "f":
            corners = [item.split("/") for item in arguments]
            if all(len(item) > 1 and item[1] for item in corners):
                faces.append(([int(item[0]) - 1 for item in corners], [int(item[1]) - 1 for item in corners]))
    return Written(np.array(points), np.array(uv), exact, faces)


def triangular(path: Path) -> bool:
    """Whether all faces of an OBJ file are triangles."""
    return all(len(line.split()) == 4 for line in path.read_text().splitlines() if line.startswith("f "))


def cut(path: Path, out: Path) -> Path:
    """Write an OBJ file with its polygons split into triangles."""
    lines = []
    for line in path.read_text().splitlines():
        word, *corners = line.split() or [""]
        fans = [f"f {corners[0]} {a} {b}" for a, b in pairwise(corners[1:])] if word == "f" else [line]
        lines += [] if word in ("mtllib", "usemtl") else fans
    out.write_text("\n".join([*lines, ""]))
    return out


def sign(a: tuple, b: tuple, c: tuple) -> int:
    """Return the sign of a triangle's area."""
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return (area > 0) - (area < 0)


def signs(file: Written) -> Figures:
    """Count the orientations of triangles; for polygons, those that are not convex."""
    figures: Figures = {}
    turns = [
        [sign(*(file.exact[uv[(k + j) % len(uv)]] for j in range(3))) for k in range(len(uv))]
        for _, uv in file.faces
    ]
    if file.triangular:
        figures["uv flipped"] = sum(face_turns[0] < 0 for face_turns in turns)
        figures["uv degenerate"] = sum(face_turns[0] == 0 for face_turns in turns)
    figures["concave_polygons"] = sum(len(face_turns) > 3 and min(face_turns) <= 0 for face_turns in turns)
    return figures


def quantile(values: NDArray, weights: NDArray, share: float) -> float:
    """Return the weighted quantile of values."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][min(np.searchsorted(total, share * total[-1]), values.size - 1)])


def stretches(planar: NDArray, space: NDArray) -> tuple[NDArray, NDArray]:
    """Return (m, 2) singular values of the linear maps from triangles (m, 3, 2) to (m, 3, 3), and their orientation."""
    e, d = (
        np.stack([points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]], axis=-1)
        for points in (space, planar)
    )
    upright = np.linalg.det(d) > 0
    singular_values = np.full((len(d), 2), np.nan)
    singular_values[upright] = np.linalg.svd(e[upright] @ np.linalg.inv(d[upright]), compute_uv=False)
    return singular_values, upright


def spreads(planar: NDArray, space: NDArray, *, surface: bool) -> Figures:
    """Return the figures of distortion, weighted by area in the plane, or with `surface` on the surface."""
    singular, upright = stretches(planar, space)
    d = np.stack([planar[:, 1] - planar[:, 0], planar[:, 2] - planar[:, 0]], axis=-1)
    before = np.abs(np.linalg.det(d)) / 2
    after = np.linalg.norm(np.cross(space[:, 1] - space[:, 0], space[:, 2] - space[:, 0]), axis=1) / 2
    scale = np.sqrt(after.sum() / before.sum())
    most, least = singular.T
    dilatation = np.where(upright, most / least, np.inf)
    stretch = np.where(upright, np.maximum(most / scale, scale / least), np.inf)
    figures = {
        f"dilatation {name}": quantile(dilatation, after, SHARES[name]) for name in ("median", "p95", "max")
    }
    figures |= {f"stretch {name}": quantile(stretch, after, SHARES[name]) for name in ("p50", "p95", "max")}
    size = np.sqrt(most * least) / scale
    for k in (2, 4):
        figures[f"scale within{k}"] = float(after[(size < k) & (size > 1 / k)].sum() / after.sum())
    areas, weights = (before / after * scale**2, after) if surface else (after / before, before)
    for name in ("p05", "median", "p95"):
        figures[f"log10_area {name}"] = quantile(np.log10(areas), weights, SHARES[name])
    return figures


def rim(file: Written, plane: NDArray) -> Figures:
    """Return how far the outer ring of coordinates (t, 2) is from the disk."""
    half = {(a, b) for _, uv in file.faces for a, b in zip(uv, [*uv[1:], uv[0]])}
    after = {a: b for a, b in half if (b, a) not in half}
    rings = []
    while after:
        ring = [next(iter(after))]
        while (number := after.pop(ring[-1], None)) is not None and number != ring[0]:
            ring.append(number)
        rings.append(plane[ring])
    outer = max((ring for ring in rings if len(ring) > 2), key=lambda ring: shapely.Polygon(ring).area)
    rings = shapely.LinearRing(outer), shapely.LinearRing(DISK)
    dense = [np.array(ring.segmentize(0.02).coords) for ring in rings]
    away = [
        shapely.distance(shapely.points(places), target_ring)
        for places, target_ring in zip(dense, rings[::-1])
    ]
    middles, lengths = (dense[0][1:] + dense[0][:-1]) / 2, np.linalg.norm(np.diff(dense[0], axis=0), axis=1)
    square = np.average(shapely.distance(shapely.points(middles), rings[1]) ** 2, weights=lengths)
    diagonal = float(np.linalg.norm(np.ptp(DISK, axis=0)))
    return {
        "boundary hausdorff": float(max(distances.max() for distances in away)) / diagonal,
        "boundary rms": float(np.sqrt(square)) / diagonal,
    }


def layout(file: Written, size: int) -> Figures:
    """Return figures of coordinates: charts, triangles, and texels that they cover in a square picture."""
    exact, parent = file.exact, list(range(len(file.uv)))

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = k = parent[parent[k]]
        return k

    for _, uv in file.faces:
        for vertex in uv[1:]:
            parent[root(vertex)] = root(uv[0])
    _, fans = file.fans
    turns = np.array([sign(*(exact[k] for k in fan)) for fan in fans])
    coordinates = file.uv[fans]
    outside = ((coordinates < -1e-9) | (coordinates > 1 + 1e-9)).any(axis=(1, 2))
    times = np.zeros((size, size), int)
    for z in coordinates * size - 0.5:
        low, high = np.ceil(z.min(axis=0)).astype(int), np.floor(z.max(axis=0)).astype(int)
        x, y = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high)))
        if x.size:
            edges = [(z[k], z[(k + 1) % 3]) for k in range(3)]
            side = [(b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) for a, b in edges]
            inside = np.all([s > 0 for s in side], axis=0) | np.all([s < 0 for s in side], axis=0)
            np.add.at(times, (y[inside] % size, x[inside] % size), 1)
    return {
        "charts": len({root(uv[0]) for _, uv in file.faces}),
        "mirrored_triangles": int((turns < 0).sum()),
        "flat_triangles": int((turns == 0).sum()),
        "outside_triangles": int(outside.sum()),
        "covered_texels": int((times > 0).sum()),
        "overlapping_texels": int((times > 1).sum()),
    }


def baked(file: Written, picture: Path) -> Figures:
    """Return the dilatation of the map with which a picture of coordinates was baked, from differences of its
    texels.
    """
    import OpenImageIO as oiio

    values = oiio.ImageBuf(str(picture)).get_pixels(oiio.FLOAT)[::-1].astype(float)
    size, corners = len(values), file.fans
    space, places = file.points[corners[0]], file.uv[corners[1]] * size - 0.5
    areas = np.linalg.norm(np.cross(space[:, 1] - space[:, 0], space[:, 2] - space[:, 0]), axis=1) / 2
    owner = np.full((size, size), -1)
    for k, z in enumerate(places):
        low, high = np.ceil(z.min(axis=0)).astype(int), np.floor(z.max(axis=0)).astype(int)
        x, y = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high)))
        if x.size:
            edges = [(z[j], z[(j + 1) % 3]) for j in range(3)]
            side = np.array([(b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) for a, b in edges])
            inside = (side >= 0).all(axis=0) | (side <= 0).all(axis=0)
            owner[y[inside], x[inside]] = k
    inner = owner[1:-1, 1:-1]
    good = inner >= 0
    for dy, dx in ((0, 1), (2, 1), (1, 0), (1, 2)):
        good &= owner[dy : dy + size - 2, dx : dx + size - 2] >= 0
    rows, columns = (rows_of + 1 for rows_of in np.nonzero(good))
    owners = owner[rows, columns]
    across, up = (
        (values[rows + dy, columns + dx, :2] - values[rows - dy, columns - dx, :2]) / 2
        for dy, dx in ((0, 1), (1, 0))
    )
    to_space, to_layout = (
        np.stack([rows_of[:, 1] - rows_of[:, 0], rows_of[:, 2] - rows_of[:, 0]], axis=-1)
        for rows_of in (space, places)
    )
    linear = to_space @ np.linalg.inv(to_layout)
    singular_values = np.linalg.svd(
        linear[owners] @ np.linalg.inv(np.stack([across, up], axis=-1)), compute_uv=False
    )
    weights = areas[owners] / np.bincount(owners)[owners]
    return {
        f"dilatation {name}": quantile(singular_values[:, 0] / singular_values[:, 1], weights, SHARES[name])
        for name in ("median", "p95")
    }


def value_in(report: dict[str, Any], name: str) -> float:
    """Return a figure of a report by its name; null is infinite."""
    value: Any = report
    for word in name.split():
        value = value[word]
    return np.inf if value is None else value


def off(name: str, measured: float, reported: float) -> bool:
    """Return whether a figure is off by more than a hundredth; for logarithms, of the original value."""
    if measured == reported:
        return False
    if name.startswith("log10"):
        return not abs(measured - reported) <= np.log10(1 + CLOSE)
    least = {"boundary": 1e-5, "covered_texels": 100, "overlapping_texels": 100}.get(name.split()[0], 0)
    return not abs(measured - reported) <= max(CLOSE * max(abs(measured), abs(reported)), least)


def differing(report: dict[str, Any], figures: Figures) -> list[str]:
    """Return the figures that differ in a report."""
    reported = {name: value_in(report, name) for name in figures}
    return [
        f"{name}: {measured:.5g}, said {reported[name]:.5g}"
        for name, measured in figures.items()
        if off(name, measured, reported[name])
    ]


def command(*words: object) -> int:
    """Run iccm."""
    return subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=LIMIT).returncode


def checked(path: Path, folder: Path) -> Iterator[tuple[str, int, dict[str, Any], Figures]]:
    """Yield each command, its exit code, its report, and the figures of its output."""
    disk, out, flat = folder / "disk.svg", folder / "out.obj", folder / "flat.obj"
    disk.write_text(DRAWING)
    _write_places(folder / "places.png")
    report, report_options = folder / "report.json", ("--report", folder / "report.json", "--force")

    def result(
        name: str, words: tuple[object, ...], *measures: Any
    ) -> Iterator[tuple[str, int, dict, Figures]]:
        report.unlink(missing_ok=True)
        code = command(*words, *report_options)
        whole = json.loads(report.read_text()) if report.exists() else {}
        yield (
            name,
            code,
            whole,
            dict(chain.from_iterable(measure(whole).items() for measure in measures if whole)),
        )

    def onto(place: Any) -> tuple[Any, ...]:
        def figures(whole: dict[str, Any]) -> Figures:
            file = read(out)
            plane = place(file.uv, whole)
            vertices, uv = file.fans
            inner = (
                spreads(plane[uv], file.points[vertices], surface="box" in whole) if file.triangular else {}
            )
            return signs(file) | rim(file, plane) | inner

        return (figures,)

    def placed(uv: NDArray, whole: dict[str, Any]) -> NDArray:
        low, high = np.array(whole["box"])
        return uv * (high - low).max() + low + (0, 100)

    def flattened(path: Path, kind: str) -> Iterator[tuple[str, int, dict[str, Any], Figures]]:
        words = ("map", disk, path, "--cut", "-o", out)
        yield from result(f"map{kind}", words, *onto(lambda uv, whole: 100 * uv))
        words = ("flatten", path, "--cut", "--method", disk, "--uv", out)
        yield from result(f"flatten{kind}", words, *onto(placed))

    if not triangular(path):
        yield from flattened(path, " (quads)")
        path = cut(path, folder / "triangles.obj")
    yield from flattened(path, "")
    if command("flatten", path, "--cut", "--uv", flat, "--force") not in (0, 1):
        return
    words = ("map", disk, flat, "--cut", "--bake", "--size", SIDE, "--texture", folder / "places.png")
    words = (*words, "-o", folder / "baked.png", "--padding", 0)
    file = read(flat)
    yield from result(
        "bake", words, lambda whole: layout(file, SIDE), lambda whole: baked(file, folder / "baked.png")
    )
    words = (
        "relayout",
        flat,
        out,
        "--texture",
        folder / "places.png",
        "--size",
        SIDE,
        "-o",
        folder / "re.png",
    )

    def kept(whole: dict[str, Any]) -> Figures:
        new = read(out)
        count = len(new.fans[0])
        figures = {f"layout {name}": value for name, value in layout(new, SIDE).items()}
        return figures | {"triangles": count, "same_triangles": count, "distance max": 0.0}

    yield from result("relayout", words, kept)


def main() -> None:
    """Check every OBJ of a folder, or those named."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    paths = [
        path for path in options.folder.rglob("*.obj") if not options.names or path.name in options.names
    ]
    every = wrong = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path in sorted(paths, key=lambda path: path.stat().st_size):
            for mode, code, report, figures in checked(path, folder):
                bad = differing(report, figures)
                every, wrong = every + len(figures), wrong + len(bad)
                line = f"{path.name[:30]:30} {mode:15} {code} {len(figures):3} figures"
                print("  ".join([line, *bad]), flush=True)
    print(f"{every - wrong} of {every} figures within {CLOSE:.0%}")


def _write_places(path: Path) -> None:
    import OpenImageIO as oiio

    size = 1024
    centres = (np.arange(size) + 0.5) / size
    pixels = np.stack(
        [np.tile(centres, (size, 1)), np.tile(centres[::-1, None], (1, size)), np.zeros((size, size))],
        axis=-1,
    )
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), oiio.ImageSpec(size, size, 3, oiio.UINT16))
    out.write_image(np.rint(65535 * pixels).astype(np.uint16))
    out.close()


if __name__ == "__main__":
    main()
