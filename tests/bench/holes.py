"""Holes mapped onto holes by the command line: letters of two fonts with equal numbers of counters, a list of pairs,
and random drawings.

python -m tests.bench.holes [--letters 20] [--unequal 10] [--drawings 30] [--read 200] [--seed 15] [--sheet FILE.png]

The fonts are fetched by npm and read by fontTools; their glyphs become SVG files, and each pair is mapped by `iccm map`
with a picture and a report. Figures are over the target's area; `gap` is the largest of all loops, relative to the
target's diagonal.
"""

import argparse
import json
import os
import random
import string
import time
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from fontTools.pens.boundsPen import BoundsPen
from fontTools.pens.svgPathPen import SVGPathPen
from fontTools.ttLib import TTFont

from iccm import InputError, cli
from iccm.io.shapes import shape as files

from . import shapes

FONTS = {
    "roboto": ("@fontsource/roboto@5.3.0", "files/roboto-latin-400-normal.woff"),
    "crimson": ("@fontsource/crimson-text@5.3.0", "files/crimson-text-latin-600-normal.woff"),
}
LETTERS = string.ascii_letters + string.digits + "&@%$?!"
PAGE = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="{} {} {} {}"><path fill-rule="{}" d="{}"/></svg>\n'
CIRCLE = "M{0} {1}m-{2} 0a{2} {2} 0 1 0 {3} 0a{2} {2} 0 1 0-{3} 0z"


def circle(x: float, y: float, radius: float) -> str:
    """Return path data of a circle."""
    return CIRCLE.format(x, y, radius, 2 * radius)


DRAWN = {
    "ring": circle(50, 50, 45) + circle(50, 50, 22),
    "square-hole": circle(50, 50, 45) + "M52 30h26v26h-26z",
    "face": circle(50, 50, 45) + circle(33, 38, 7) + circle(67, 38, 7) + "M30 62q20 20 40 0q-20 8-40 0z",
    "heart-face": "M50 92C10 60 3 40 8 25C15 5 42 5 50 24C58 5 85 5 92 25C97 40 90 60 50 92Z"
    + circle(32, 32, 6) + circle(68, 32, 9) + "M40 58h22v9h-22z",
}  # fmt: skip
LISTED = (
    ("roboto/A", "roboto/R"),
    ("roboto/eight", "roboto/B"),
    ("drawn/ring", "drawn/square-hole"),
    ("drawn/face", "drawn/heart-face"),
)


@cache
def glyphs(font: str) -> dict[str, Path]:
    """Return the letters of a font as SVG files, by glyph name, without those that have no outline."""
    package, name = FONTS[font]
    shapes.PACKAGES[font] = package
    opened = TTFont(shapes.package(font) / name)
    chosen, drawn = opened.getBestCmap(), opened.getGlyphSet()
    folder = shapes.CACHE / "glyphs" / font
    folder.mkdir(parents=True, exist_ok=True)
    paths = {}
    for letter in LETTERS:
        glyph = chosen[ord(letter)]
        bounds, path = BoundsPen(drawn), SVGPathPen(drawn)
        drawn[glyph].draw(bounds)
        drawn[glyph].draw(path)
        low, bottom, high, top = bounds.bounds
        body = f'{path.getCommands()}" transform="scale(1 -1)'  # a font's y axis points up
        paths[glyph] = folder / f"{glyph}.svg"
        paths[glyph].write_text(PAGE.format(low, -top, high - low, top - bottom, "nonzero", body))
    return paths


def drawing(name: str) -> Path:
    """Return a glyph (`font/glyph`) or drawing (`drawn/name`) as a file; other names are files already."""
    if os.path.isabs(name):
        return Path(name)
    kind, _, glyph = name.partition("/")
    if kind != "drawn":
        return glyphs(kind)[glyph]
    path = shapes.CACHE / "glyphs" / f"{glyph}.svg"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(PAGE.format(0, 0, 100, 100, "evenodd", DRAWN[glyph]))
    return path


def pairs(count: int, seed: int, *, equal: bool = True) -> list[tuple[str, str]]:
    """Return random pairs of glyphs with counters, one from each font, with equal or different numbers; the same for
    each seed.
    """
    choice = random.Random(seed)
    counters = {
        f"{font}/{name}": len(files.read(str(path)).holes)
        for font in FONTS
        for name, path in glyphs(font).items()
    }
    sides = [[name for name, holes in counters.items() if name.startswith(font) and holes] for font in FONTS]
    glyph_pairs: list[tuple[str, str]] = []
    while len(glyph_pairs) < count:
        source, target = (choice.choice(side) for side in sides)
        pair = (source, target) if choice.random() < 0.5 else (target, source)
        if (counters[source] == counters[target]) == equal and pair not in glyph_pairs:
            glyph_pairs.append(pair)
    return glyph_pairs


def mapped(source: Path, target: Path, picture: Path) -> tuple[int, dict, float]:
    """Run `iccm map`; return exit code, report and CPU-seconds of this process."""
    start = time.process_time()
    figures = picture.with_suffix(".json")
    figures.unlink(missing_ok=True)
    typed = ["map", source, target, "-o", picture, "--report", figures, "--size", "400", "--force", "-q"]
    code = cli.run(list(map(str, typed)))
    report = json.loads(figures.read_text()) if figures.exists() else {}
    return code, report, time.process_time() - start


def short(name: str) -> str:
    """Return a short name for the table."""
    return "/".join(Path(name).relative_to(shapes.CACHE).parts[::3]) if os.path.isabs(name) else name


def refusals(count: int, seed: int) -> None:
    """Read random drawings from two packages of emoji, and print why some are rejected."""
    choice = random.Random(seed)
    why: Counter[str] = Counter()
    for k in range(count):
        spec = choice.choice(shapes.drawings(("openmoji", "twemoji")[k % 2]))
        try:
            why[f"read, {len(files.read(spec).holes)} holes"] += 1
        except InputError as error:
            why[f"refused: {str(error).removeprefix(spec)}"] += 1
    print(f"{count} random drawings of openmoji and twemoji:", dict(why.most_common()), flush=True)


def rows(kind: str, chosen: list[tuple[str, str]]) -> Iterator[Path]:
    """Map each pair and print a line for it; yield the pictures."""
    good_count = 0
    for source, target in chosen:
        name = " → ".join(map(short, (source, target)))
        picture = shapes.CACHE / "glyphs" / f"{name}.png".replace("/", "-")
        code, report, seconds = mapped(drawing(source), drawing(target), picture)
        if "boundary" not in report:
            print(f"{name:42} exit code {code}", flush=True)
            continue
        sure, gap = report["injective"]["certified"], report["boundary"]["hausdorff"]
        met = len(report.get("holes", [])) == max(
            len(files.read(str(drawing(drawing_name))).holes) for drawing_name in (source, target)
        )
        good = code == 0 and sure and met and gap <= 1e-3
        good_count += good
        print(
            f"{name:42} {'ok' if good else 'NO'} gap {gap:.0e} loops {len(report.get('holes', []))} "
            f"p50 {report['stretch']['p50']:.2f} p95 {report['stretch']['p95']:.2f} "
            f"K95 {report['dilatation']['p95']:.2f} turn {report['turn']:.0f}° {seconds:.1f} s",
            flush=True,
        )
        yield picture
    print(
        f"{kind}: {good_count} of {len(chosen)} certified one-to-one with every gap at most 1e-3\n",
        flush=True,
    )


def sheet(pictures: list[Path], path: Path, columns: int = 8, size: int = 200) -> None:
    """Draw the pictures side by side."""
    from PIL import Image

    page = Image.new("RGB", (columns * size, -(-len(pictures) // columns) * size), "white")
    for k, name in enumerate(pictures):
        picture = Image.open(name).convert("RGBA")
        picture.thumbnail((size - 8, size - 8))
        page.paste(picture, (k % columns * size + 4, k // columns * size + 4), picture)
    page.save(path)


def main() -> None:
    """Print the table, and draw the pictures if requested."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--letters", type=int, default=20)
    parser.add_argument("--unequal", type=int, default=10)
    parser.add_argument("--drawings", type=int, default=30)
    parser.add_argument("--read", type=int, default=200)
    parser.add_argument("--seed", type=int, default=15)
    parser.add_argument("--sheet", type=Path)
    options = parser.parse_args()
    print(f"seed {options.seed}")
    pictures = [*rows("listed", list(LISTED))]
    pictures += rows("as many counters", pairs(options.letters, options.seed))
    pictures += rows("not as many", pairs(options.unequal, options.seed, equal=False))
    refusals(options.read, options.seed)
    drawn = shapes.drawn_pairs(options.drawings, options.seed, [])
    pictures += rows("drawings", [(a.spec, b.spec) for a, b in drawn])
    if options.sheet:
        sheet(pictures, options.sheet)


if __name__ == "__main__":
    main()
