"""Compare `iccm map` with the warps of other programs, as whole commands.

python -m tests.bench.warps [--sizes 1024 4096 8192 16384] [--rounds 9] [--exact 1024]

All commands read a PNG of a size and write a picture of that size, by turns. The control points, 400 on the outline of
a star, and the coordinates that `cv2.remap` and `oiiotool --st_warp` read are those of the same quadratic map. A line
tells the median and the range of the time, the median of the processor time, and the most memory, of which the process
that starts the commands is the least that can be told, .11 GB. Programs that are not installed are left out
(apt-get install gdal-bin imagemagick openimageio-tools).
"""

import argparse
import multiprocessing
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from iccm.io.pictures import image_files

from .resampling import bent, drawn, shape
from .speed import ICCM, cv2, load

CONTROL_POINTS = 400
BEND = 0.2
RADIUS_SHARE = 360 / 1024  # of the star of `drawn`, relative to the width of the page
LARGEST_COORDINATES = 8192  # the files of coordinates of larger pictures take gigabytes
LARGEST_SHEPARDS = 1024  # ImageMagick takes minutes for larger pictures
REMAP = """
import cv2, numpy, sys
picture, x, y, out = sys.argv[1:]
cv2.imwrite(out, cv2.remap(cv2.imread(picture), numpy.load(x), numpy.load(y), cv2.INTER_CUBIC))
"""


def write_inputs(folder, size):
    """Write a smooth texture with noise, both outlines, and the coordinates of each pixel of the target."""
    random = np.random.default_rng(0)
    coarse = random.integers(0, 200, (64, 64, 3), dtype=np.uint8).repeat(size // 64, 0).repeat(size // 64, 1)
    coarse += random.integers(0, 56, coarse.shape, dtype=np.uint8)
    image_files.write(folder / "t.png", image_files.Image(coarse))
    drawn(folder / "a.svg", shape(CONTROL_POINTS))
    drawn(folder / "b.svg", bent(shape(CONTROL_POINTS), BEND))
    if size > LARGEST_COORDINATES:
        return
    axis = ((np.arange(size) + 0.5) / size - 0.5) / RADIUS_SHARE
    w = (axis - 1j * axis[:, None]).astype(np.complex64)
    z = (np.sqrt(1 + 4 * BEND * w) - 1) / (2 * BEND)  # the inverse of `bent`
    x, y = 0.5 + RADIUS_SHARE * z.real, 0.5 - RADIUS_SHARE * z.imag
    st = np.stack([x, y, np.zeros_like(x)], axis=-1).astype(np.float32)
    image_files.write(folder / "st.exr", image_files.Image(st, colorspace="data"))
    np.save(folder / "x.npy", (x * size - 0.5).astype(np.float32))
    np.save(folder / "y.npy", (y * size - 0.5).astype(np.float32))


def commands(folder, size, exact):
    """Return the commands by name."""
    texture = str(folder / "t.png")
    ours = [ICCM, "map", str(folder / "a.svg"), str(folder / "b.svg"), "--texture", texture, "-q", "--force"]
    lines = {"iccm map": [*ours, "--size", f"{size}x{size}", "-o", str(folder / "ours.png")]}
    z = shape(CONTROL_POINTS)
    sides = [
        (size / 2 + RADIUS_SHARE * size * p.real, size / 2 - RADIUS_SHARE * size * p.imag)
        for p in (z, bent(z, BEND))
    ]
    pairs = np.column_stack([*sides[0], *sides[1]])
    if shutil.which("gdalwarp"):
        points = [str(v) for x, y, u, v in pairs for v in ("-gcp", x, y, u, size - v)]
        subprocess.run(["gdal_translate", "-q", *points, texture, str(folder / "t.tif")], check=True)
        warp = ["gdalwarp", "-q", "-tps", "-r", "cubic", "-overwrite", "-te", "0", "0", str(size), str(size)]
        warp += ["-ts", str(size), str(size)]
        files = [str(folder / "t.tif"), str(folder / "gdal.tif")]
        every = ["-multi", "-wo", "NUM_THREADS=ALL_CPUS"]
        lines |= {"gdalwarp": [*warp, *files], "gdalwarp -multi": [*warp, *every, *files]}
        if size <= exact:
            lines["gdalwarp -et 0 -multi"] = [*warp, *every, "-et", "0", *files]
    tool = shutil.which("magick") or shutil.which("convert")
    if tool and size <= LARGEST_SHEPARDS:
        points = " ".join(f"{x:.2f},{y:.2f} {u:.2f},{v:.2f}" for x, y, u, v in pairs)
        lines["ImageMagick -distort Shepards"] = [
            tool,
            texture,
            "-distort",
            "Shepards",
            points,
            str(folder / "m.png"),
        ]
    if size <= LARGEST_COORDINATES and cv2 is not None:
        columns = [str(folder / name) for name in ("x.npy", "y.npy", "cv2.png")]
        lines["cv2.remap"] = [sys.executable, "-c", REMAP, texture, *columns]
    if size <= LARGEST_COORDINATES and shutil.which("oiiotool"):
        lines["oiiotool --st_warp"] = [
            *["oiiotool", texture, str(folder / "st.exr"), "--st_warp:filter=cubic"],
            *["-o", str(folder / "oiio.png")],
        ]
    return lines


def measure(line):
    """Run a command, and return its time, its processor time, and its memory in GB.

    Raises:
        RuntimeError: it fails.
    """
    start = time.perf_counter()
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"exit code {process.returncode}")
    return time.perf_counter() - start, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024e-9


def compare(size, rounds, exact):
    """Print a line for each command."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # The memory that is measured for a command is at least that of this process, so arrays are made in another one.
        writer = multiprocessing.get_context("spawn").Process(target=write_inputs, args=(folder, size))
        writer.start()
        writer.join()
        lines = commands(folder, size, exact)
        taken = {command: [] for command in lines}
        print(f"## {size}², medians of {rounds}; {load()}", flush=True)
        for _ in range(rounds):
            for command in list(taken):
                try:
                    taken[command].append(measure(lines[command]))
                except RuntimeError as error:
                    print(f"{command} is left out: {error}")
                    del taken[command]
    for command, runs in taken.items():
        seconds, processor, memory = zip(*runs)
        spread = f"{statistics.median(seconds):7.2f} s ({min(seconds):.2f} to {max(seconds):.2f})"
        print(f"{command:30} {spread}  {statistics.median(processor):7.2f} CPU-s  {max(memory):5.2f} GB")
    print(f"afterwards: {load()}\n", flush=True)


def main():
    """Compare at each size."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.bench.warps", description=__doc__.partition("\n")[0]
    )
    parser.add_argument("--sizes", type=int, nargs="+", default=[1024, 4096, 8192, 16384])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument(
        "--exact", type=int, default=1024, help="the largest size for gdalwarp's exact form [1024]"
    )
    options = parser.parse_args()
    for size in options.sizes:
        compare(size, options.rounds, options.exact)


if __name__ == "__main__":
    main()
