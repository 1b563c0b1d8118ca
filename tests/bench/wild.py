"""Public meshes: a heart mapped onto each, judged by the coordinates in the written file.

python -m tests.bench.wild FOLDER [NAME …]

For each mesh of a folder, small ones first: the exit code, triangles that are flipped for some triangulation of their
polygon, the shares of its surface whose scale is within a factor of 2 and 4 of the typical one, the 95th percentile of
the dilatation, processor seconds and memory. Signs are computed with rational numbers; no code for reading and counting
is shared with iccm.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import subprocess
import sys
import tempfile
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .assets import COMMAND

HEART = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">'
    '<path d="M50 90C10 60 5 30 25 15S50 25 50 30 60 0 80 15 90 60 50 90Z"/></svg>'
)
SUFFIXES = (".obj", ".off", ".ply", ".stl")
REVERSED = re.compile(r"flipped (\d+) triangles")  # in the file, and thus in the result
SLOW, LIMIT = 60, 300  # processor seconds above which a mesh counts as slow, and at which it is stopped


class Figures(NamedTuple):
    """Figures of a file with coordinates.

    Attributes:
        turned: polygons for which some triangulation has a triangle that is flipped or has no area.
        within: shares of the surface whose scale is within a factor of 2 and 4 of the typical one.
        k95: 95th percentile of the dilatation.
    """

    turned: int
    within: tuple[float, float]
    k95: float


def judged(path: Path, before: Path | None = None) -> Figures:
    """Return the figures of an OBJ file; faces with the coordinates of the file `before` are left out."""
    points, texts, polygons = _read(path)
    whole = [min(t for _, t in polygon) >= 0 for polygon in polygons]
    if before and before.suffix.lower() == ".obj":
        _, old, unchanged = _read(before)
        kept = [[old[t : t + 1] for _, t in polygon] for polygon in unchanged]
        corner_texts = [[texts[t : t + 1] for _, t in polygon] for polygon in polygons]
        whole = [is_complete and a != b for is_complete, a, b in zip(whole, corner_texts, kept, strict=True)]
    polygons = [polygon for polygon, is_complete in zip(polygons, whole) if is_complete]
    space, plane = np.array(points), np.array(texts, float)
    owner, cuts, fan = [], [], []
    for number, polygon in enumerate(polygons):
        n = len(polygon)
        fan += [(polygon[0], polygon[k], polygon[k + 1]) for k in range(1, n - 1)]
        # for others, it depends on the triangulation that a program chooses
        if n <= 4 or _convex(space[[v for v, _ in polygon]]):
            ears = [(polygon[k - 1], polygon[k], polygon[(k + 1) % n]) for k in range(n)]
            ears = [
                cut for cut in ears if len({tuple(points[v]) for v, _ in cut}) == 3
            ]  # others have no area
            cuts += ears
            owner += [number] * len(ears)
    signs = _signs(plane, texts, np.array(cuts, np.int64).reshape(-1, 3, 2)[:, :, 1])
    common = 1 if signs.sum() > 0 else -1
    turned = len(set(np.array(owner, np.int64)[signs != common].tolist()))
    triangles = np.array(fan)
    return Figures(turned, *_sizes(space[triangles[:, :, 0]], plane[triangles[:, :, 1]]))


def _read(path: Path) -> tuple[list[list[float]], list[list[str]], list[list[tuple[int, int]]]]:
    """Return points, texture coordinates, and polygons of both; -1 for a corner without coordinates."""
    points, texts, polygons = [], [], []
    for words in map(str.split, path.read_text(errors="replace").splitlines()):
        if words[:1] == ["v"]:
            points.append([float(word) for word in words[1:4]])
        elif words[:1] == ["vt"]:
            texts.append(words[1:3])
        elif words[:1] == ["f"]:
            corners = [word.split("/") for word in words[1:]]
            pairs = [
                (int(corner[0]), int(corner[1]) if corner[1:] and corner[1] else 0) for corner in corners
            ]
            polygons.append([(_place(v, len(points)), _place(t, len(texts))) for v, t in pairs])
    return points, texts, polygons


def _place(number: int, count: int) -> int:
    return number - 1 if number >= 0 else count + number


def _convex(corners: NDArray) -> bool:
    ahead, behind = np.roll(corners, -1, axis=0) - corners, corners - np.roll(corners, 1, axis=0)
    turns = np.cross(behind, ahead)
    return bool((turns @ turns.sum(axis=0) > 0).all())


def _signs(plane: NDArray, texts: list[list[str]], triangles: NDArray) -> NDArray:
    """Return -1, 0 or 1 for each triangle, by rational numbers where rounding could matter."""
    a, b, c = (plane[triangles[:, k]] for k in range(3))
    p, q = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]), (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    sign = np.sign(p - q)
    unsure = np.abs(p - q) <= 1e-12 * (np.abs(plane).max() ** 2 + np.abs(p) + np.abs(q))
    for number in np.flatnonzero(unsure):
        (ax, ay), (bx, by), (cx, cy) = ([Fraction(word) for word in texts[v]] for v in triangles[number])
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        sign[number] = (area > 0) - (area < 0)
    return sign


def _sizes(space: NDArray, plane: NDArray) -> tuple[tuple[float, float], float]:
    along, across = space[:, 1] - space[:, 0], space[:, 2] - space[:, 0]
    length = np.linalg.norm(along, axis=1)
    area = np.linalg.norm(np.cross(along, across), axis=1)
    good = area > 0
    along, across, length, area, plane = along[good], across[good], length[good], area[good], plane[good]
    flat = np.zeros((len(area), 2, 2))  # columns are the edges
    flat[:, 0, 0], flat[:, 0, 1] = length, (along * across).sum(axis=1) / length
    flat[:, 1, 1] = area / length
    sides = np.stack([plane[:, 1] - plane[:, 0], plane[:, 2] - plane[:, 0]], axis=2)
    values = np.linalg.svd(sides @ np.linalg.inv(flat), compute_uv=False)
    scale = values[:, 0] * values[:, 1] / ((values[:, 0] * values[:, 1] * area).sum() / area.sum())
    with np.errstate(divide="ignore"):
        dilatation, away = values[:, 0] / values[:, 1], np.abs(np.log(scale))
    order = np.argsort(dilatation)
    share = np.cumsum(area[order]) / area.sum()
    within = [float(area[away <= np.log(n)].sum() / area.sum()) for n in (2, 4)]
    return (within[0], within[1]), float(dilatation[order][min(np.searchsorted(share, 0.95), len(order) - 1)])


class Done(NamedTuple):
    """The result of a command: exit code (124 if it took too long), output, processor seconds, peak GB."""

    code: int
    lines: list[str]
    seconds: float
    memory: float


def command(*words: object) -> Done:
    """Run iccm."""
    with tempfile.TemporaryFile("w+", errors="replace") as output:
        process = subprocess.Popen(
            [COMMAND, *map(str, words)],
            stdout=output,
            stderr=output,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT)),
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = code = os.waitstatus_to_exitcode(status)
        output.seek(0)
        lines = output.read().splitlines()
    return Done(124 if code == -9 else code, lines, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e6)


def row(path: Path, folder: Path) -> tuple[str, bool, bool]:
    """Return the line of a mesh, whether there is a map, and whether everything is as it should be."""
    drawing, out = folder / "heart.svg", folder / "out.obj"
    drawing.write_text(HEART)
    out.unlink(missing_ok=True)
    result = command("map", drawing, path, "--cut", "-o", out, "--force")
    message = next((line for line in result.lines if line.startswith("error")), "")
    start = f"{path.name[:32]:32} {result.code:3} {result.seconds:6.1f} CPU-s {result.memory:5.2f} GB"
    if not out.exists():
        return f"{start}  {(message or ' '.join(result.lines[-1:]))[:150]}", False, result.code == 2
    try:
        verdict = judged(out, path)
    except (IndexError, ValueError) as error:
        return f"{start}  not judged: {error!r}", True, False
    message = message or next((line for line in result.lines if "convex" in line), "")
    reversed_ones = sum(int(n) for line in result.lines for n in REVERSED.findall(line))
    good = result.code == 0 and verdict.turned <= reversed_ones and result.seconds <= SLOW
    untold = "  UNTOLD" if verdict.turned > reversed_ones and not message else ""
    twice, four_times = verdict.within
    figures = f"turned {verdict.turned:4}  2x {twice:6.1%}  4x {four_times:6.1%}  K95 {verdict.k95:6.2f}"
    return f"{start}  {figures}{untold}  {message[-90:]}", True, good


def main() -> None:
    """Measure every mesh of a folder, or those named, and print totals."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    paths = [path for path in options.folder.rglob("*") if path.suffix.lower() in SUFFIXES]
    paths.sort(key=lambda path: (path.stat().st_size, path))
    surfaces = fine = 0
    with tempfile.TemporaryDirectory() as folder:
        for path in paths:
            if not options.names or path.name in options.names:
                line, surface, good = row(path, Path(folder))
                surfaces, fine = surfaces + surface, fine + (surface and good)
                print(line, flush=True)
    print(f"{fine} of {surfaces} maps: exit code 0, nothing turned over, within {SLOW} CPU-s")


if __name__ == "__main__":
    sys.exit(main())
