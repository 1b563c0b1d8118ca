"""Drawings of real programs, mapped as artwork by the identity and by a bend, and compared by rendering.

python -m tests.bench.carried [--drawings 30] [--seed 58] [--keep FOLDER]

Random drawings from packages of illustrations, as exported by the authors' programs (Illustrator, Figma, Sketch,
Inkscape), are fetched by npm. Each is mapped as artwork from its canvas onto the same canvas, and onto a bent one, by
`iccm map` as a user would run it. Both results are rendered by resvg at 512 pixels. The result of the identity is
compared with the drawing itself. The result of the bend is compared with the drawing rendered at 2048 pixels and warped
as a picture by the same map, which does not depend on paths, paints and clips. A pixel counts as different if no pixel
next to it is within 24 of 255 in all premultiplied channels, because edges are resampled in one of the two.
"""

from __future__ import annotations

import argparse
import random
import subprocess
import tempfile
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iccm import InputError
from iccm.io.artwork import rendering
from iccm.io.svg import tree

from . import shapes
from .assets import COMMAND

PACKAGES = {  # pattern of files, licence
    "@streetmix/illustrations@2.1.1": ("images/*/*.svg", "CC BY-SA 4.0"),
    "devicon@2.17.0": ("icons/*/*-original.svg", "MIT"),
    "@gravity-ui/illustrations@2.1.1": ("svgs/*.svg", "MIT"),
    "flag-icons@7.5.0": ("flags/4x3/*.svg", "MIT"),
    "@momentum-design/illustrations@0.2.6": ("dist/svg/*.svg", "MIT"),
}
PIXELS, FINE_PIXELS = 512, 2048  # longer side of compared pictures, and of pictures that are bent
TOLERANCE = 24  # of 255
MOST_DIFFERENT = 0.01  # of the pixels
GOAL = 0.95  # share of the drawings
LARGEST_BYTES = 400_000  # size of a drawing
BENT = "M0 {a}Q{m} -{a} {w} {a}L{r} {b}Q{m} {c} {l} {b}Z"


def bent(box: tuple[float, float, float, float]) -> str:
    """Return a canvas with a bulging top and sides that lean inwards."""
    x, y, w, h = box
    path = BENT.format(a=0.08 * h, m=w / 2, w=w, r=0.93 * w, l=0.04 * w, b=0.95 * h, c=0.8 * h)
    shape = f'<path transform="translate({x} {y})" d="{path}"/>'
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{x} {y} {w} {h}">{shape}</svg>'


def run(*words: str | Path) -> str:
    """Run the command; return what it wrote to stderr."""
    result = subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, timeout=300)
    if result.returncode not in (0, 1):
        raise RuntimeError(result.stderr.strip().splitlines()[-1][:200])
    return result.stderr


def drawn(path: Path, box: tuple[float, float, float, float], longer: int) -> NDArray[np.uint8]:
    """Render a drawing with resvg, premultiplied."""
    x, y, w, h = box
    size = round(longer * w / max(w, h)), round(longer * h / max(w, h))
    pixels = rendering.render(path, (complex(x, -y - h), complex(x + w, -y)), size).pixels
    return pixels.copy()


def premultiplied(pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return colours times alpha, and alpha."""
    colours = pixels.astype(np.float32)
    colours[..., :3] *= colours[..., 3:] / 255
    return colours


def different(first: NDArray[np.uint8], second: NDArray[np.uint8]) -> float:
    """Return the share of pixels of a picture that no pixel near the same place of the other resembles."""
    a, b = premultiplied(first), premultiplied(second)
    kernel = np.ones((3, 3), np.uint8)
    low, high = cv2.erode(b, kernel), cv2.dilate(b, kernel)
    return float(((a < low - TOLERANCE) | (a > high + TOLERANCE)).any(axis=2).mean())


def carried(path: Path, folder: Path) -> tuple[float, float, str]:
    """Return the shares of pixels that differ after the identity and after the bend, and the notes of the first run."""
    canvas = tree.parse(path.read_bytes()).canvas
    if canvas is None:
        raise RuntimeError("no canvas")
    unchanged, target, moved, fine, picture = (
        folder / name for name in ("same.svg", "target.svg", "bent.svg", "fine.png", "bent.png")
    )
    target.write_text(bent(canvas))
    notes = run("map", f"{path}#canvas", f"{path}#canvas", "-o", unchanged, "--force")
    run("map", f"{path}#canvas", target, "-o", moved, "--force")
    Image.fromarray(drawn(path, canvas, FINE_PIXELS)).save(fine)
    run("map", f"{path}#canvas", target, "--texture", fine, "-o", picture, "--size", str(PIXELS), "--force")
    first = different(drawn(path, canvas, PIXELS), drawn(unchanged, canvas, PIXELS))
    pixels = np.asarray(Image.open(picture).convert("RGBA"))
    artwork = drawn(moved, canvas, PIXELS)
    height, width = pixels.shape[:2]
    if artwork.shape[:2] != (height, width):
        artwork = cv2.resize(artwork, (width, height), interpolation=cv2.INTER_AREA)
    second = max(different(pixels, artwork), different(artwork, pixels))
    return max(first, different(drawn(unchanged, canvas, PIXELS), drawn(path, canvas, PIXELS))), second, notes


def chosen(count: int, seed: int) -> list[Path]:
    """Return random drawings, equally many from each package."""
    choice = random.Random(seed)
    files_chosen: list[Path] = []
    sets = []
    for spec, (pattern, _) in PACKAGES.items():
        folder = shapes.fetched(f"carried/{spec.rpartition('@')[0].strip('@').replace('/', '-')}", spec)
        files = [file for file in sorted(folder.glob(pattern)) if file.stat().st_size <= LARGEST_BYTES]
        choice.shuffle(files)
        sets.append(files)
    while len(files_chosen) < count and any(sets):
        for files in sets:
            if files and len(files_chosen) < count:
                files_chosen.append(files.pop())
    return files_chosen


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--drawings", type=int, default=30)
    parser.add_argument("--seed", type=int, default=58)
    parser.add_argument("--keep", type=Path, help="a folder for what was written")
    options = parser.parse_args()
    rows: list[tuple[float, float]] = []
    with tempfile.TemporaryDirectory() as scratch:
        for number, path in enumerate(chosen(options.drawings, options.seed)):
            folder = (options.keep or Path(scratch)) / f"{number:02}"
            folder.mkdir(parents=True, exist_ok=True)
            name = f"{path.parent.name}/{path.name}"
            try:
                identity, bend, notes = carried(path, folder)
            except (RuntimeError, InputError, subprocess.TimeoutExpired) as error:
                print(f"{number:3} {name:60} FAILED {error}", flush=True)
                rows.append((1.0, 1.0))
                continue
            rows.append((identity, bend))
            note = next((line for line in notes.splitlines() if "omitted" in line or "ignored" in line), "")
            print(f"{number:3} {name:60} {identity:8.3%} {bend:8.3%}  {note[:70]}", flush=True)
    for k, how in enumerate(("identity", "bend")):
        share = float(np.mean([row[k] <= MOST_DIFFERENT for row in rows]))
        verdict = "holds" if share >= GOAL else "FAILS"
        summary = f"{share:.1%} of {len(rows)} drawings differ by at most {MOST_DIFFERENT:.0%} of the pixels"
        print(f"{verdict} {how}: {summary}, asked for {GOAL:.0%}")


if __name__ == "__main__":
    main()
