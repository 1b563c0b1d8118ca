"""Times of various tasks: python -m tests.bench.speed [first imports growth pixels whole]

Times on a shared machine mean little alone: the load is printed with them, and ratios are taken within one run.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import iccm
from iccm import Curve
from iccm.balanced import method
from iccm.io.pictures import image_files
from iccm.pixels import preimages
from iccm.pixels.warp import Canvas, Sampler, Texture, Warp
from iccm.problem import Problem

from .goals import goal, unmeasured

try:
    import cv2
except ImportError:
    cv2 = None

ROSE = Path(__file__).parents[2] / "samples" / "rose-leaf"
ICCM = str(Path(sys.executable).parent / "iccm")


def load() -> str:
    """Return the number of processes that are ready to run, as a note."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores" if hasattr(os, "getloadavg") else ""


def took(line: list[str], **more: str) -> tuple[float, float]:
    """Return wall-clock and CPU seconds of a command and its children; the first run compiles their modules."""
    env = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"} | more
    before, start = os.times(), time.perf_counter()
    subprocess.run(line, env=env, check=True, capture_output=True)
    after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return time.perf_counter() - start, cpu


def first(times: int = 3) -> None:
    """Measure the README's first command: medians of some runs."""
    print(f"## The first run: rose → leaf, 1024²; {load()}")
    with tempfile.TemporaryDirectory() as folder:
        job = [ICCM, "map", str(ROSE / "rose.svg"), str(ROSE / "leaf.svg"), "-q", "--force"]
        runs = [took([*job, "-o", f"{folder}/out.png"]) for _ in range(times)]
    wall, cpu = np.median(runs, axis=0)
    print(f"{wall:.1f} s, {cpu:.1f} CPU-s (medians of {times})")
    goal("the first run, wall clock", wall, 8, "s")


LISTED = "from iccm import cli; import sys; cli.run(sys.argv[1:]); print(*sys.modules)"
AGAIN = "import importlib, sys\nfor name in sys.argv[1:]: importlib.import_module(name)"


def imports() -> None:
    """Measure the imports of the common path beyond those of NumPy, in CPU-seconds, which -X importtime only gives on
    an idle machine.
    """
    print(f"## Start-up; {load()}")
    with tempfile.TemporaryDirectory() as folder:
        job = ["map", str(ROSE / "rose.svg"), str(ROSE / "leaf.svg"), "-q", "--size", "64"]
        job += ["--texture", str(ROSE / "petals.jpg"), "-o", f"{folder}/out.png", "--force"]
        line = [sys.executable, "-c", LISTED, *job]
        listed = subprocess.run(line, capture_output=True, text=True, check=True).stdout.split()
    again = [sys.executable, "-c", AGAIN]
    rounds = [(took([*again, "numpy"])[1], took([*again, *listed])[1]) for _ in range(7)]
    base, all_of_it = np.median(rounds, axis=0)
    print(f"numpy {base:.2f} CPU-s, iccm map {all_of_it:.2f}, {len(listed)} modules (medians of 7); {load()}")
    goal("imports beyond numpy", all_of_it - base, 0.35, "CPU-s")


def star(count: int, spikes: int = 5, depth: float = 0.3) -> np.ndarray:
    """Return (count,) a rounded star."""
    s = 2 * np.pi * np.arange(count) / count
    return (1 + depth * np.cos(spikes * s)) * np.exp(1j * s)


def cpu(work) -> float:
    """Return the CPU-seconds of some work in this process."""
    start = time.process_time()
    work()
    return time.process_time() - start


def timed(work) -> tuple[float, float]:
    """Return wall-clock and CPU seconds of some work in this process."""
    wall, start = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - start


def growth() -> None:
    """Measure time against the size of the outline, and against the triangles of the last mesh, for whole solutions."""
    print(f"## Growth of balanced solves, CPU-seconds; {load()}\noutline vertices   seconds   exponent")
    iccm.fit(star(50), star(50, 3))
    rows = [(n, cpu(lambda n=n: iccm.fit(star(n), star(n, 3)))) for n in (100, 1000, 10_000, 100_000)]
    table(rows)
    goal("time against outline vertices, exponent from 10,000 to 100,000", exponent(*rows[-2:]), 1)
    print("triangles   seconds   exponent")
    # asymmetric: otherwise only one half would be solved
    uneven = Curve(star(400) + 0.2 * np.exp(1j) * star(400) ** 2)
    rows = []
    for triangles in (2000, 6000, 20_000, 60_000, 200_000):
        start = time.process_time()
        solution = method.solve(Problem.of(uneven, Curve(star(400, 3))), triangles=triangles)
        rows.append((len(solution.map.faces), time.process_time() - start))
    table(rows)
    coarse = rows[0][1]
    grown = exponent(*[(count, seconds - coarse) for count, seconds in rows[-2:]])
    goal("time against triangles, exponent from 60,000 to 200,000 without coarse maps", grown, 1.5)


def table(rows: list[tuple[int, float]]) -> None:
    """Print sizes, seconds, and the exponent from one row to the next."""
    for k, (size, seconds) in enumerate(rows):
        grown = exponent(rows[k - 1], rows[k]) if k else np.nan
        print(f"{size:10} {seconds:10.2f} {grown:10.2f}", flush=True)


def exponent(a: tuple[int, float], b: tuple[int, float]) -> float:
    """Return the exponent of the size with which seconds grow from one row to another."""
    return float(np.log(b[1] / a[1]) / np.log(b[0] / a[0]))


def scene(size: int, share: float):
    """Return a balanced map, and a canvas that shows a share of the target's box."""
    fit = iccm.fit(star(300), star(300) + 0.2 * star(300) ** 2, method="balanced")
    image = fit.map.image
    low, high = complex(image.real.min(), image.imag.min()), complex(image.real.max(), image.imag.max())
    middle, half = (low + high) / 2, share * (high - low) / 2
    return fit.map, Canvas(size, size, (middle - half, middle + half))


def pixels(size: int = 4096) -> None:
    """Compare source points of every pixel with cv2.remap, on one thread, in CPU-seconds."""
    print(f"## Coordinates of {size}² pixels of a triangulated map, one thread; {load()}")
    if cv2 is None:
        without_opencv("coordinates, all inside", "coordinates, with the border")
        return
    cv2.setNumThreads(1)
    picture = np.random.default_rng(0).random((size, size, 4), dtype=np.float32)
    x, y = np.meshgrid(*[np.arange(size, dtype=np.float32) + np.float32(0.3)] * 2)
    for name, share in (("all inside", 0.35), ("with the border", 1.1)):
        map, canvas = scene(size, share)

        def ours(slopes: bool, map=map, canvas=canvas) -> None:
            source = preimages.of(map, canvas, 1e-9, slopes)
            for row in range(0, size, 128):
                source(row)

        rounds = [
            (
                cpu(lambda: cv2.remap(picture, x, y, cv2.INTER_CUBIC)),
                cpu(lambda: ours(False)),
                cpu(lambda: ours(True)),
            )
            for _ in range(5)
        ]
        remap, plain, sloped = (min(times) for times in zip(*rounds))
        print(
            f"{name:16} remap {remap:.2f} s; coordinates {plain / remap:.2f} ×, with slopes {sloped / remap:.2f} ×"
        )
        goal(f"coordinates, {name}, by cv2.remap cubic", plain / remap, 0.3)


def whole(size: int = 4096) -> None:
    """Compare the warp of an 8-bit RGBA picture into a PNG with cv2.remap and its encoder, wall clock on all cores."""
    print(f"## Warp of {size}² RGBA, 8 bit, into a PNG, on all cores; {load()}")
    names = [f"whole warp by cv2.remap and encode, {kind}" for kind in ("wall clock", "CPU")]
    if cv2 is None:
        without_opencv(*names, "PNG encoding")
        return
    cv2.setNumThreads(-1)
    map, canvas = scene(size, 1.02)
    y, x = np.indices((size, size))
    rgba = [(x // 64 + y // 64) % 2 * 200 + 20, x % 256, y % 256, np.full_like(x, 255)]
    texture = np.stack(rgba, axis=2).astype(np.uint8)
    low, high = (complex(f(map.source.real), f(map.source.imag)) for f in (np.min, np.max))
    columns = [v.astype(np.float32) for v in (x, y)]
    with tempfile.TemporaryDirectory() as folder:
        like = image_files.Image(texture, 3)

        def ours() -> None:
            blocks = Warp(map, Sampler(Texture(texture, (low, high), 3)), canvas).blocks()
            image_files.write_bands(f"{folder}/a.png", like, size, size, blocks)

        def theirs() -> None:
            cv2.imwrite(f"{folder}/b.png", cv2.remap(texture, *columns, cv2.INTER_CUBIC))

        def encoded(picture: np.ndarray) -> None:
            bands = (picture[row : row + 128] for row in range(0, size, 128))
            image_files.write_bands(f"{folder}/c.png", like, size, size, bands)

        rounds = [[timed(work) for work in (ours, theirs)] for _ in range(3)]
        pixels = image_files.read(f"{folder}/a.png").pixels
        encode = np.min([timed(lambda: encoded(pixels)) for _ in range(3)], axis=0)
    mine, reference = np.min(rounds, axis=0)
    print(
        f"ours                 {mine[0]:.2f} s, {mine[1]:.2f} CPU-s, encoding alone {encode[0]:.2f}, {encode[1]:.2f}"
    )
    print(f"cv2.remap and encode {reference[0]:.2f} s, {reference[1]:.2f} CPU-s")
    for name, a, b in zip(names, mine, reference):
        goal(name, a / b, 2)
    goal("PNG encoding, its share of the whole warp's processor time", encode[1] / mine[1], 0.5)


def without_opencv(*names: str) -> None:
    """Report that a peer is missing."""
    for name in names:
        unmeasured(name, "cv2 is not installed: pip install opencv-python-headless")


def main(names: list[str]) -> None:
    """Run the named parts, or all."""
    parts = {"first": first, "imports": imports, "growth": growth, "pixels": pixels, "whole": whole}
    for name in names or parts:
        parts[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
