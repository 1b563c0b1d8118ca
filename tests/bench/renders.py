"""Renders of textured GLB files before and after `iccm relayout` to an unwrap by xatlas, with the same cameras.

For each model of a folder, small ones first and copies of a shape only once: the share of the pixels of four views in
which no channel of the base colour differs by more than 4 of 255. Colours are read by `tests.bench.assets`, not by
iccm; a pixel is the mean of 3 × 3 samples with bilinear interpolation in linear light, as a renderer takes them, and
there is no shading, which would hide differences. `--keep` writes pictures: before, after, and the difference eight
times as large.

python -m tests.bench.asset_sources FOLDER
python -m tests.bench.renders FOLDER [NAME …] [--keep FOLDER]     needs `pip install xatlas`
"""

from __future__ import annotations

import argparse
import hashlib
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iccm.meshes.render import axes_towards, visible_triangles

from .assets import File, command, encoded, textured, unwrapped

PIXELS, SAMPLES = 384, 3  # longer side of a view; samples per pixel and axis
LEVELS, GOAL = 4, 0.97  # of 255; share of pixels
DIRECTIONS = ((0.8, 0.5, 0.9), (-0.9, 0.6, 0.4), (0.5, -0.6, -0.9), (-0.4, 0.2, -1.0))
"""Towards the viewers: front right and left from above, and the back from below and straight."""
UPWARDS = np.array([0.0, 1.0, 0.0])


class Seen(NamedTuple):
    """What a camera sees.

    Attributes:
        shape: height and width in samples.
        hits: (p,) samples with a surface, in rows.
        triangle: (p,) the triangle in each.
        weights: (p, 3) barycentric coordinates there.
    """

    shape: tuple[int, int]
    hits: NDArray[np.int64]
    triangle: NDArray[np.int64]
    weights: NDArray


def view(corners: NDArray, axes: NDArray) -> Seen:
    """Return the view of triangles (m, 3, 3) by a camera (3, 3)."""
    turned = corners @ axes.T
    low, high = turned[..., :2].min(axis=(0, 1)), turned[..., :2].max(axis=(0, 1))
    scale = SAMPLES * PIXELS / max(*(high - low), 1e-300)
    width, height = (SAMPLES * max(1, int(np.ceil(extent * scale / SAMPLES))) for extent in high - low)
    screen = (turned[..., :2] - low) * scale
    screen[..., 1] = height - screen[..., 1]
    screen = np.ascontiguousarray(screen)
    owner = visible_triangles(screen, turned[..., 2], width, height)
    samples = np.flatnonzero(owner >= 0)
    triangle = owner.ravel()[samples].astype(np.int64)
    a, b, c = np.moveaxis(screen[triangle], 1, 0)
    p = np.column_stack([samples % width + 0.5, samples // width + 0.5])
    area = _cross(b - a, c - a)
    second, third = _cross(p - a, c - a) / area, _cross(b - a, p - a) / area
    weights = np.stack([1 - second - third, second, third], axis=1)
    return Seen((height, width), samples, triangle, weights)


def _cross(a: NDArray, b: NDArray) -> NDArray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def picture(file: File, seen: Seen) -> NDArray:
    """Return (h, w, 4) base colours and covered shares of pixels, 0 … 255 and 0 … 1."""
    height, width = seen.shape
    samples = np.zeros((height * width, 4))
    first = 0
    for part in file.primitives:
        count = len(file.faces(part))
        of_part = np.flatnonzero((seen.triangle >= first) & (seen.triangle < first + count))
        if of_part.size:
            light = file.light(part, seen.triangle[of_part] - first, seen.weights[of_part])
            samples[seen.hits[of_part], :3], samples[seen.hits[of_part], 3] = light, 1
        first += count
    pixels = samples.reshape(height // SAMPLES, SAMPLES, width // SAMPLES, SAMPLES, 4).mean(axis=(1, 3))
    pixels[..., :3] = 255 * encoded(pixels[..., :3] / np.maximum(pixels[..., 3:], 1e-9))
    return pixels


def triangles(file: File) -> NDArray:
    """Return (m, 3, 3) the corners of all triangles of a file without transforms."""
    return np.concatenate(
        [file.values(part.attributes.POSITION).astype(float)[file.faces(part)] for part in file.primitives]
    )


def compare(path: Path, folder: Path, kept: Path | None) -> NDArray | str:
    """Return (p,) the largest difference of a channel in each pixel of all views, or why there is none."""
    layout, out = folder / "layout.glb", folder / "out.glb"
    try:
        unwrapped(path, layout)  # its points are where the scene's transforms place them
    except Exception as error:
        return f"no unwrap: {error}"
    result = command("relayout", path, layout, "-o", out, "--force")
    if result.code:
        return f"exit code {result.code}: {result.messages.strip().splitlines()[-1][:120]}"
    corners, old, new = triangles(File(layout)), File(path), File(out)
    differences, rows = [], []
    for direction in DIRECTIONS:
        seen = view(corners, axes_towards(np.array(direction), UPWARDS))
        before, after = picture(old, seen), picture(new, seen)
        off = np.abs(before[..., :3] - after[..., :3])
        differences.append(off.max(axis=2)[before[..., 3] > 0])
        rows.append(np.concatenate([before[..., :3], after[..., :3], 8 * off], axis=1))
    if kept is not None:
        width = max(row.shape[1] for row in rows)
        padded = [np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0))) for row in rows]
        sheet = np.clip(np.concatenate(padded), 0, 255).astype(np.uint8)
        Image.fromarray(sheet).save(kept / f"{path.parent.name}-{path.stem}.png")
    return np.concatenate(differences)


def shape_of(path: Path) -> str:
    """Return a key that is equal for files with the same points in the same order."""
    file, key = File(path), hashlib.sha256()
    for part in file.primitives:
        key.update(file.values(part.attributes.POSITION).tobytes())
    return key.hexdigest()


def main() -> None:
    """Print a line for each model, and totals."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    paths = [
        path for path in options.folder.rglob("*.glb") if not options.names or path.name in options.names
    ]
    paths.sort(key=lambda path: (path.stat().st_size, path))
    compared, shares, pixels = set[str](), [], 0
    alike = 0
    with tempfile.TemporaryDirectory() as folder:
        for path in filter(textured, paths):
            if (key := shape_of(path)) in compared:
                continue
            compared.add(key)
            differences = compare(path, Path(folder), options.keep)
            name = f"{path.parent.name[:12]:12} {path.name[:50]:50}"
            if isinstance(differences, str):
                print(f"{name} {differences}", flush=True)
                continue
            share = float((differences <= LEVELS).mean())
            shares.append(share)
            pixels += differences.size
            alike += int((differences <= LEVELS).sum())
            print(
                f"{name} {share:7.2%} mean {differences.mean():5.2f} p99 {np.quantile(differences, 0.99):6.1f}",
                flush=True,
            )
    print(f"{alike / max(pixels, 1):.2%} of the pixels of {len(shares)} models within {LEVELS} of 255")
    print(f"{sum(share >= GOAL for share in shares)} of {len(shares)} models with {GOAL:.0%} of their pixels")


if __name__ == "__main__":
    main()
