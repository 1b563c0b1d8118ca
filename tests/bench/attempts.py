"""Try what a newcomer would type: 41 commands and Python lines, written down before the code was read.

Run ``python -m tests.bench.attempts [--files FOLDER] [--only N ...]``. Every attempt runs in a
fresh folder of ordinary files (a photo, icons, a word, meshes). It **works** when it exits with code 0, leaves the
files it promises and writes no traceback; it **helps** when it ends with exit code 1 or 2 and at most three lines of
errors, and they or a note name the cure. Everything else **fails**. Files in FOLDER replace those made here.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import skimage.data
import trimesh
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
"""The project, for its pictures and drawings."""

LONGEST_S = 600
"""Seconds after which an attempt counts as failed; a newcomer has given up long before."""

MOST_LINES_OF_AN_ERROR = 3
"""A message that is longer than this many lines does not name one cure."""


@dataclass(frozen=True)
class Attempt:
    """One line that a newcomer types."""

    job: str
    line: str
    files: Sequence[str] = ()
    """Patterns that must match a file afterwards."""
    shows: str = ""
    """A pattern that must be in the output."""
    cure: str = ""
    """A pattern that a helpful error message contains, where an error is acceptable."""
    code: int = 0
    """The exit code of what works."""
    python: bool = field(default=False)


def _command(job: str, line: str, *files: str, shows: str = "", cure: str = "") -> Attempt:
    return Attempt(job, line, files, shows, cure)


def _python(job: str, line: str, *files: str, shows: str = "", cure: str = "") -> Attempt:
    return Attempt(job, line, files, shows, cure, python=True)


SHAPES = "import iccm; s = iccm.read_shape('heart.svg'); t = iccm.read_shape('shield.svg'); "
"""How the lines in Python begin that need two shapes."""

ATTEMPTS = (
    Attempt("Look around", "iccm", shows="map", code=2),
    _command("Look around", "iccm help map", shows="--texture"),
    _command("Look around", "iccm map --version", shows=r"\d+\.\d+"),
    _command("Look around", "python -m iccm map heart.svg shield.svg", "*.png"),
    _command("Two shapes", "iccm map heart.svg shield.svg", "*.png"),
    _command("Two shapes", "iccm map heart.svg shield.svg && iccm map heart.svg shield.svg", "*.png"),
    _command("Two shapes", "iccm heart.svg shield.svg", cure="iccm map"),
    _command("Photo", "iccm map photo.jpg heart.svg", "*.png"),
    _command("Photo", "iccm map photo.jpg horse.png", "*.png"),
    _command("Photo", "iccm map heart.svg shield.svg --texture photo.jpg -o out.png", "out.png"),
    _command("Photo", "iccm map heart.svg shield.svg --texture photo.jpg --width 800 --overwrite", "*.png"),
    _command("Logo", "iccm map logo.svg shield.svg -o out.svg", "out.svg"),
    _command("Logo", "iccm map logo.svg shield.svg -o out.pdf", cure=r"\.svg|\.png"),
    _command("Logo", "iccm map logo.svg shield.svg --rotate 30 -o out.png", "out.png"),
    _command(
        "Logo",
        "iccm map logo.svg shield.svg --smoothness 1 -o out.png",
        "out.png",
        cure="because of --smoothness",
    ),
    _command("Logo", "iccm map logo.svg shield.svg --pin 12,12:9999,9999 -o out.png", cure="outside|not in"),
    _command("Word", "iccm map word.svg leaf.svg -o out.png", "out.png", cure="#text="),
    _command(
        "Icons",
        "iccm batch 'icons/*.svg' shield.svg -o 'out/{source.stem}.svg'",
        "out/bell.svg",
        "out/fish.svg",
    ),
    _command("Icons", "iccm batch icons shield.svg -o out/", "out/*bell*", "out/*fish*"),
    _command("Icons", "iccm map icons/*.svg shield.svg -o out/", cure="iccm batch"),
    _command("Icons", "iccm batch", cure="iccm init"),
    _command("Icons", "iccm init", "*.toml"),
    _command(
        "Mesh",
        "iccm map heart.svg ball.obj -o ball-heart.glb --texture photo.jpg",
        "ball-heart.glb",
        cure="uv|flatten",
    ),
    _command("Mesh", "iccm flatten box.glb -o box-flat.glb", "box-flat.glb", cure="--cut|--seams"),
    _command("Mesh", "iccm flatten half.obj -o half-flat.obj", "half-flat.obj"),
    _command("Mesh", "iccm map heart.svg half.obj -o half-heart.obj --texture photo.jpg", "half-heart.obj"),
    _command("Morph", "iccm morph heart.svg shield.svg -o morph.gif", "morph.gif"),
    _command("Pipeline", "iccm map heart.svg shield.svg -o map.exr --stmap", "map.exr"),
    _command(
        "Pipeline",
        "iccm map heart.svg shield.svg -o map.npz && iccm apply map.npz photo.jpg -o warped.png",
        "warped.png",
    ),
    _python("Readers", SHAPES + "f = iccm.fit(s, t); print(f.summary())", shows="folds|scale"),
    _python(
        "Arrays",
        "import iccm, numpy as np; a = np.linspace(0, 2 * np.pi, 60)[:-1]; s = np.c_[np.cos(a), np.sin(a)]; "
        "f = iccm.fit(s, s * [2, 1]); print('shape', np.shape(f.map(s * .5)))",
        shows=r"shape \(59, 2\)",
    ),
    _python(
        "shapely",
        "import iccm; from shapely import Point, box; f = iccm.fit(Point(0, 0).buffer(1), box(0, 0, 3, 1)); print(f)",
        shows="Fit",
    ),
    _python(
        "skimage",
        "import iccm; from skimage import io, measure; im = io.imread('horse.png', as_gray=True) < .5; "
        "c = max(measure.find_contours(im), key=len); "
        "f = iccm.fit(c, iccm.read_shape('shield.svg'), axes='image'); print(1 - f.coverage.bare)",
        shows=r"0\.9|1\.0",
    ),
    _python(
        "skimage",
        SHAPES
        + "import numpy as np; from skimage.transform import warp; from skimage.data import astronaut; "
        "f = iccm.fit(s, t); w = warp(astronaut(), f.transform.inverse, cval=np.nan); "
        "yy, xx = np.mgrid[:512, :512]; inside = f.target.contains(xx + 1j * yy); "
        "print('missing', np.isnan(w[inside]).sum())",
        shows="missing 0$",
    ),
    _python(
        "trimesh",
        "import iccm, trimesh; p = trimesh.load_path('heart.svg'); "
        "f = iccm.fit(p, iccm.read_shape('shield.svg')); print(f)",
        shows="Fit",
    ),
    _python(
        "Pictures",
        SHAPES + "import skimage as sk; from skimage import data; im = data.horse(); f = iccm.fit(s, t); "
        "out = iccm.transfer(f, im); print(type(out).__name__)",
        shows="ndarray|Raster|Image|Transfer",
        cure=r"uint8|float|iccm\.warp",
    ),
    _python(
        "Plots",
        SHAPES + "import matplotlib.pyplot as plt; fig, ax = plt.subplots(); iccm.fit(s, t).plot(ax=ax); "
        "fig.savefig('plot.png')",
        "plot.png",
    ),
    _python("Notebook", SHAPES + "f = iccm.fit(s, t); print(len(f._repr_html_()))", shows=r"\d{3}"),
    _python(
        "Progress",
        SHAPES + "n = []; iccm.fit(s, t, progress=n.append); print('steps', len(n))",
        shows=r"steps [1-9]",
    ),
    _python(
        "Mesh",
        "import iccm, trimesh; m = trimesh.load('half.obj'); f = iccm.flatten(m.vertices, m.faces); print(f)",
        shows=".",
    ),
    _python("Help", "import iccm; help(iccm.fit)", shows=r"Args:\n +source: "),
)


def prepare(folder: Path) -> None:
    """Write the files that a newcomer might have to a folder."""
    drawings = ROOT / "docs/files"
    for name in ("heart", "shield", "badge"):
        shutil.copy(drawings / f"{name}.svg", folder / f"{name}.svg")
    shutil.copy(drawings / "badge.svg", folder / "logo.svg")
    shutil.copy(ROOT / "samples/rose-leaf/leaf.svg", folder / "leaf.svg")
    (folder / "word.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 240 80">'
        '<text x="10" y="60" font-family="Arial" font-size="64" font-weight="bold">Hello</text></svg>',
        encoding="utf-8",
    )
    icons = folder / "icons"
    icons.mkdir()
    for name in ("bell", "mug", "home", "medal", "window", "hand"):
        shutil.copy(drawings / f"{name}.svg", icons / f"{name}.svg")
    shutil.copy(drawings / "heart.svg", icons / "fish.svg")
    Image.fromarray(skimage.data.rocket()).save(folder / "photo.jpg")
    horse = skimage.data.horse()
    Image.fromarray(np.where(horse, 255, 0).astype(np.uint8)).save(folder / "horse.png")
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.export(folder / "ball.obj")
    trimesh.creation.box(extents=(1, 2, 3)).export(folder / "box.glb")
    half = ball.submesh([np.flatnonzero(ball.triangles_center[:, 2] > 0.1)], append=True)
    half.export(folder / "half.obj")


def verdict(attempt: Attempt, folder: Path, result: "subprocess.CompletedProcess[str]") -> str:
    """Judge what one attempt left behind: ``works``, ``helps`` or ``fails``."""
    output = result.stdout + result.stderr
    if "Traceback" in output and not attempt.python:
        return "fails"
    promised = all(any(folder.glob(pattern)) for pattern in attempt.files)
    promised &= not attempt.files or _has_new_file(attempt, folder)
    is_shown = not attempt.shows or re.search(
        attempt.shows, result.stdout if attempt.python else output, re.MULTILINE
    )
    if result.returncode == attempt.code and promised and is_shown and (attempt.files or attempt.shows):
        return "works"
    lines = result.stderr.strip().splitlines()
    errors = lines[-1:] if attempt.python else [line for line in lines if line.startswith("error:")]
    is_short = 0 < len(errors) <= MOST_LINES_OF_AN_ERROR
    text = "\n".join(errors if attempt.python else lines)
    if attempt.cure and result.returncode in (1, 2) and is_short and re.search(attempt.cure, text):
        return "helps"
    return "fails"


def _has_new_file(attempt: Attempt, folder: Path) -> bool:
    """Whether a promised file is newer than the files that were given."""
    given = (folder / "heart.svg").stat().st_mtime
    return all(any(f.stat().st_mtime > given for f in folder.glob(pattern)) for pattern in attempt.files)


def run(attempt: Attempt, files: Path | None) -> tuple[str, str, float]:
    """Run one attempt in a fresh folder; return its verdict, the last lines it wrote and its seconds."""
    with tempfile.TemporaryDirectory() as directory:
        folder = Path(directory)
        prepare(folder)
        if files:
            shutil.copytree(files, folder, dirs_exist_ok=True)
        time.sleep(0.02)
        bin_folder = Path(sys.executable).parent
        environment = os.environ | {
            "PATH": f"{bin_folder}{os.pathsep}{os.environ['PATH']}",
            "MPLBACKEND": "agg",
        }
        command = [sys.executable, "-c", attempt.line] if attempt.python else ["bash", "-c", attempt.line]
        began = time.monotonic()
        try:
            result = subprocess.run(
                command,
                cwd=folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=LONGEST_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return "fails", "(no end)", float(LONGEST_S)
        took = time.monotonic() - began
        last = (result.stderr.strip().splitlines() or result.stdout.strip().splitlines() or [""])[-1]
        return verdict(attempt, folder, result), f"{last} (exit {result.returncode})", took


def main() -> None:
    """Run the attempts and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=Path)
    parser.add_argument("--only", type=int, nargs="*")
    options = parser.parse_args()
    verdicts = []
    for number, attempt in enumerate(ATTEMPTS, 1):
        if options.only and number not in options.only:
            continue
        judged, last, took = run(attempt, options.files)
        print(f"{number:2} {judged:6} {took:5.1f} s  {attempt.job}: {attempt.line}\n     {last}", flush=True)
        verdicts.append(judged)
    good = len(verdicts) - verdicts.count("fails")
    print(f"{good} of {len(verdicts)} work or help")


if __name__ == "__main__":
    main()
