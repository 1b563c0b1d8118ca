"""The tasks whose speed `tests.bench.guard` compares, run by the Python of one version of iccm.

This file is run as a script, with no other file of this repository on the path, and uses only what `iccm` exports, so
that it works with each version. It reads the name of a task a line, and answers with the seconds of processor time.
"""

import os
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np  # noqa: E402

import iccm  # noqa: E402

POINTS = 100_000
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


def tasks():
    """Return the tasks by their names; those that this version of iccm cannot do are left out."""
    star, dented = outlines()
    fit = iccm.fit(star, dented)
    random = np.random.default_rng(1)
    points = star[random.integers(0, VERTICES, POINTS)] * np.sqrt(random.uniform(0, 0.9, POINTS))
    texture = iccm.checkerboard()
    vertices, faces = surface()
    functions = {
        "solve": lambda: iccm.fit(star, dented),
        "map": lambda: fit.inverse(fit.map(points)),
        "warp": lambda: iccm.warp(fit, texture, size=PIXELS, threads=1),
    }
    if hasattr(iccm, "flatten"):
        functions["flatten"] = lambda: iccm.flatten(vertices, faces, method="balanced")
    return functions


def main():
    """Answer requests until there are no more."""
    functions = tasks()
    for task in functions.values():  # what is compiled, loaded or cached at the first call is not measured
        task()
    print("ready", iccm.__version__, *functions, flush=True)
    for line in sys.stdin:
        start = time.process_time()
        functions[line.strip()]()
        print(time.process_time() - start, flush=True)


if __name__ == "__main__":
    main()
