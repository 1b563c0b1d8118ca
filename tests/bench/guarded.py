"""The tasks whose speed `tests.bench.guard` compares, run by the Python of one version of iccm.

This file is run as a script, with no other file of this repository on the path, and uses only what `iccm` exports, so
that it works with each version. It reads the name of a task a line, and answers with the seconds of processor time,
with those of commands that the task runs.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np  # noqa: E402

import iccm  # noqa: E402

POINTS = 100_000
COLOURED_PATHS = 1000
LETTER_ROWS = 4  # of 13 letters each, drawn as paths with a hole
PIXELS = 1024
VERTICES = 1000


def outlines():
    """Return a star with smooth arms, and an ellipse with a dent, as complex polygons."""
    angle = 2 * np.pi * np.arange(VERTICES) / VERTICES
    star = (1 + 0.35 * np.cos(5 * angle)) * np.exp(1j * angle)
    dented = (1 - 0.3 * np.exp(-8 * (angle - 1.3) ** 2)) * (1.6 * np.cos(angle) + 1j * np.sin(angle))
    return star, dented


def surface(count=60):
    """Return vertices and triangles of a hill on a rectangle."""
    x, y = np.meshgrid(np.linspace(0, 1.5, count), np.linspace(0, 1, count))
    z = 0.6 * np.exp(-12 * ((x - 0.6) ** 2 + (y - 0.5) ** 2))
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    lower = np.column_stack([corner, corner + 1, corner + count + 1])
    upper = np.column_stack([corner, corner + count + 1, corner + count])
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), np.concatenate([lower, upper])


def drawing(folder, name, content):
    """Write an SVG of 100 by 100 units, and return its path."""
    path = folder / name
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{content}</svg>')
    return str(path)


def drawings(folder):
    """Write a square, a blob, many coloured paths, and rows of rings, and return their paths."""
    square = drawing(folder, "square.svg", '<path d="M10 10H90V90H10Z"/>')
    blob = drawing(folder, "blob.svg", '<path d="M20 10C60 0 95 30 80 60S40 95 15 70Z"/>')
    random = np.random.default_rng(2)
    paths = [
        f'<path fill="#{colour:06x}" d="M{x:.2f} {y:.2f}c1 {a:.2f} 2 {b:.2f} 3 0l-1 2z"/>'
        for colour, x, y, a, b in zip(
            random.integers(0, 1 << 24, COLOURED_PATHS), *random.uniform(2, 95, (4, COLOURED_PATHS))
        )
    ]
    rings = [
        f'<path d="M{x} {y}h6l-1 8h-4zm2 2v3h2v-3z"/>'
        for x in range(5, 95, 7)
        for y in range(10, 10 + 12 * LETTER_ROWS, 12)
    ]
    return (
        square,
        blob,
        drawing(folder, "paths.svg", "".join(paths)),
        drawing(folder, "rings.svg", "".join(rings)),
    )


def command(*arguments):
    """Run an iccm command."""
    line = [sys.executable, "-P", "-m", "iccm", *arguments]
    subprocess.run(line, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def tasks(folder):
    """Return the tasks by their names; those that this version of iccm cannot do are left out.

    Args:
        folder: where files for commands are written.
    """
    star, dented = outlines()
    fit = iccm.fit(star, dented)
    random = np.random.default_rng(1)
    points = star[random.integers(0, VERTICES, POINTS)] * np.sqrt(random.uniform(0, 0.9, POINTS))
    texture = iccm.checkerboard()
    vertices, faces = surface()
    square, blob, paths, rings = drawings(folder)
    output = ["-o", str(folder / "out.svg"), "--force"]
    pins = [(0.5, 0.3), (-0.5, -0.2)]
    functions = {
        "solve": lambda: iccm.fit(star, dented),
        "conformal": lambda: iccm.fit(star, dented, method="conformal"),
        "pins": lambda: iccm.fit(star, dented, pins=pins),
        "map": lambda: fit.inverse(fit.map(points)),
        "warp": lambda: iccm.warp(fit, texture, size=PIXELS, threads=1),
    }
    if hasattr(iccm, "flatten"):
        functions["flatten"] = lambda: iccm.flatten(vertices, faces, method="balanced")
    if hasattr(iccm, "morph"):
        functions["morph"] = lambda: list(iccm.morph(fit, np.linspace(0, 1, 5)))
    functions |= {
        "read": lambda: iccm.read_shape(paths),
        "start": lambda: command("--version"),
        "command": lambda: command("map", square, blob, *output),
        "artwork": lambda: command("map", paths, square, *output),
        "letters": lambda: command("map", rings, square, *output),
    }
    return functions


def seconds():
    """Return the processor time of this process and of those that it has waited for."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def main():
    """Answer requests until there are no more."""
    with tempfile.TemporaryDirectory() as folder:
        functions = tasks(Path(folder))
        for (
            task
        ) in functions.values():  # what is compiled, loaded or cached at the first call is not measured
            task()
        print("ready", iccm.__version__, *functions, flush=True)
        for line in sys.stdin:
            start = seconds()
            functions[line.strip()]()
            print(seconds() - start, flush=True)


if __name__ == "__main__":
    main()
