"""Whole drawings mapped onto whole drawings by the command line, judged by the resulting pictures.

python -m tests.bench.drawings [--pairs 150] [--seed 51] [--sheet FILE.png] [--beside COMMAND] [--kin]

Random pairs of icons, line icons, emoji, illustrations, logos, flags, words, maps and photos of `drawing_sets.SETS`,
which no other bench uses. Each pair is one run of `iccm map A B -o out.png --size 512 --report r.json` in its own
process. What the picture shows is measured from its alpha and from that of the target, rendered by librsvg (pip install
'pyvips[binary]'); only stretch, dilatation and certificate are taken from our report. --beside runs a second command on
the same pairs, such as the iccm of another release: '/old/bin/iccm map {source} {target}'. If an arm has a label, its
results are kept in build/bench/drawings/runs/LABEL, and not computed again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import resource
import shlex
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from . import coverage
from .assets import COMMAND
from .drawing_sets import FOLDER, SETS, Drawing, kin_pairs, random_pairs
from .rasterizer import Box, fitted, rendered

SEED = 51
PIXELS = 512  # longer side of the results
FINE_PIXELS = 2048  # longer side of drawings in which components are searched
MOST_CPU_SECONDS = 8
LIMIT_CPU_SECONDS = 120  # after which a run is stopped
ALIKE = 0.1  # difference of intersection over union below which boxes explain a picture equally well
PAGE_PAIRS = 18  # on a contact sheet
AGREES = 0.02  # largest difference to the coverage in our report
HEAD = f"{'':42} arm  exit covered reads  cracks holes spilled   p95   K95 proof CPU-s ours"


@dataclass(frozen=True)
class Row:
    """Results of one run on a pair.

    Attributes:
        code: exit code; 124 if stopped after LIMIT_CPU_SECONDS.
        seconds: processor time of the whole command.
        picture: whether a picture was written.
        p95, K95, certified, ours: from the report: stretch, dilatation, whether all maps are certified, and `covered`.
        shown: `shown` in the report.
        visible: share of the source's painted area that the picture shows, if an STMap was requested.
        reading, covered, cracks, spilled, extra_holes: as in `coverage.Seen`.
        placed: whether the box of the target's plane that the picture shows is known.
        message: output on stderr.
    """

    code: int
    seconds: float
    picture: bool
    p95: float = np.nan
    K95: float = np.nan
    certified: bool = False
    ours: float | None = None
    shown: float | None = None
    visible: float | None = None
    reading: str = ""
    covered: float = 0.0
    cracks: float = 0.0
    spilled: float = 0.0
    extra_holes: int = 0
    placed: bool = False
    message: str = ""

    def __str__(self) -> str:
        if not self.picture:
            lines = [line for line in self.message.splitlines() if line.startswith("error")]
            return f"{self.code:4} NO PICTURE {self.seconds:6.2f} {' '.join(lines)[:100]}"
        ours = "" if self.ours is None else f"{self.ours:5.2f}"
        ours += "" if self.visible is None else f" shows {self.visible:.2f}"
        place = "" if self.placed else " PLACE UNKNOWN"
        return (
            f"{self.code:4} {self.covered:7.2f} {self.reading:6} {self.cracks:6.2%} {self.extra_holes:5}"
            f" {self.spilled:7.2f} {self.p95:5.2f} {self.K95:5.2f} {'yes' if self.certified else 'NO':5}"
            f" {self.seconds:5.2f} {ours}{place}"
        )


@dataclass(frozen=True)
class Arm:
    """A command that is compared.

    Attributes:
        name: heading of its column.
        words: the words of the command.
        folder: folder for its results.
        stmap: whether it also writes an STMap, from which the visible part of the source is measured.
    """

    name: str
    words: tuple[str, ...]
    folder: Path
    stmap: bool = False

    def run(self, source: Drawing, target: Drawing) -> tuple[Row, Path]:
        """Return the row of a pair and its picture, from the folder if they exist there."""
        key = hashlib.sha256(f"{source.label} {target.label}".encode()).hexdigest()[:16]
        kept, picture = self.folder / f"{key}.json", self.folder / f"{key}.png"
        if not kept.exists():
            self.folder.mkdir(parents=True, exist_ok=True)
            picture.unlink(missing_ok=True)
            code, seconds, message, report = self._command(source, target, picture)
            row = Row(code, seconds, picture.exists(), message=message)
            kept.write_text(json.dumps(asdict(with_report(row, report)), indent=1))
        row = Row(**json.loads(kept.read_text()))
        if row.picture:
            row = with_picture(row, picture, target)
            if (places := picture.with_suffix(".exr")).exists():
                row = replace(row, visible=visible_share(places, picture, source))
        return row, picture

    def _command(self, source: Drawing, target: Drawing, picture: Path) -> tuple[int, float, str, dict]:
        report = picture.with_suffix(".report.json")
        places = {"source": source.spec, "target": target.spec}
        words = [word.format(**places) if "{" in word else word for word in self.words]
        words += ["-o", str(picture), "--size", str(PIXELS), "--report", str(report), "--force"]
        if self.stmap:
            words += ["--stmap", str(picture.with_suffix(".exr"))]
        with tempfile.TemporaryFile("w+", errors="replace") as output:
            process = subprocess.Popen(
                words,
                stdout=output,
                stderr=output,
                preexec_fn=lambda: resource.setrlimit(
                    resource.RLIMIT_CPU, (LIMIT_CPU_SECONDS, LIMIT_CPU_SECONDS)
                ),
            )
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = code = os.waitstatus_to_exitcode(status)
            output.seek(0)
            message = output.read()
        report_values = json.loads(report.read_text()) if report.exists() else {}
        return 124 if code < 0 else code, usage.ru_utime + usage.ru_stime, message, report_values


def with_report(row: Row, report: dict) -> Row:
    """Return a row with the figures of our report; with several maps, those of the worst."""
    maps = [report, *report.get("parts", [])]
    return replace(
        row,
        p95=max((part["stretch"]["p95"] for part in maps if part.get("stretch")), default=np.nan),
        K95=max((part["dilatation"]["p95"] for part in maps if part.get("dilatation")), default=np.nan),
        certified=bool(report) and all(part.get("injective", {}).get("certified") for part in maps),
        ours=report.get("covered"),
        shown=report.get("shown"),
    )


def with_picture(row: Row, path: Path, target: Drawing) -> Row:
    """Return a row with measurements of what its picture shows of the target."""
    with Image.open(path) as opened:
        result = coverage.painted(np.asarray(opened.convert("RGBA"))[..., 3])
    box, placed = shown_box(target, result)
    height, width = result.shape
    area = painted_area(target, box, (width, height))
    whole, all_of_it = fine(target)
    scale = width * height / (box[2] * box[3])
    outside = whole.mean() * all_of_it[2] * all_of_it[3] * scale - area.sum() if box != all_of_it else 0
    shares = coverage.seen(area, result, max(0.0, float(outside)))
    return replace(row, placed=placed, **asdict(shares))


def visible_share(places: Path, picture: Path, source: Drawing) -> float:
    """Return the share of the source's painted area that a picture shows, from the STMap beside it."""
    import OpenImageIO as oiio

    pixels = oiio.ImageInput.open(str(places)).read_image()
    with Image.open(picture) as opened:
        result = coverage.painted(np.asarray(opened.convert("RGBA"))[..., 3])
    return coverage.shown_share(pixels[..., :2], result & (pixels[..., 3] > 0.5), fine(source)[0])


def painted_area(drawing: Drawing, box: Box, size: tuple[int, int]) -> coverage.Mask:
    """Return what a drawing paints in a box of its plane, at (width, height) pixels."""
    return coverage.painted(rendered(drawing.svg, box, size)[..., 3])


def part_count(drawing: Drawing) -> int:
    """Return the number of components of a drawing at the size of the results."""
    return coverage.parts(painted_area(drawing, drawing.canvas, fitted(drawing.canvas, PIXELS)))


@cache
def fine(drawing: Drawing) -> tuple[coverage.Mask, Box]:
    """Return everything that a drawing paints, at high resolution, and its canvas."""
    size = fitted(drawing.canvas, FINE_PIXELS)
    return painted_area(drawing, drawing.canvas, size), drawing.canvas


def shown_box(target: Drawing, result: coverage.Mask) -> tuple[Box, bool]:
    """Return the box of the target's plane that a result shows, and whether it is certain.

    It is the canvas, the box of everything painted, or that of a component: the box with the picture's proportions that
    matches the picture best. The report is not used.
    """
    height, width = result.shape
    mask, canvas = fine(target)
    boxes = [canvas]
    for x, y, across, down in coverage.component_boxes(mask):
        left, top = canvas[0] + x * canvas[2], canvas[1] + y * canvas[3]
        boxes.append((left, top, across * canvas[2], down * canvas[3]))
    longer = max(width, height)
    fits = [box for box in boxes if np.abs(np.subtract(fitted(box, longer), (width, height))).max() <= 2]
    if not fits:
        return canvas, False
    if len(fits) == 1:
        return fits[0], True
    # boxes are in order of size; of those that match about equally well the largest is used, since dots resemble discs
    scores = [coverage.agreement(painted_area(target, box, (width, height)), result) for box in fits]
    return next(box for box, score in zip(fits, scores, strict=True) if score > max(scores) - ALIKE), True


def share(rows: Sequence[Row], holds: Callable[[Row], bool]) -> float:
    """Return the share of rows with a property."""
    return float(np.mean([holds(row) for row in rows]))


def goals(arms: dict[str, list[Row]]) -> None:
    """Print the goals of the first arm, with the second for comparison."""
    requirements: list[tuple[str, float, Callable[[Row], bool]]] = [
        ("has a picture", 1, lambda r: r.picture),
        ("covered at least .85", 0.92, lambda r: r.covered >= 0.85),
        ("covered at least .70", 0.98, lambda r: r.covered >= 0.70),
        ("cracks at most .5 %", 0.98, lambda r: r.picture and r.cracks <= 0.005),
        ("p95 stretch at most 3", 0.97, lambda r: r.p95 <= 3),
        ("K95 at most 5", 0.96, lambda r: r.K95 <= 5),
        ("certified one-to-one", 1, lambda r: r.certified),
        (f"at most {MOST_CPU_SECONDS} CPU-seconds", 1, lambda r: r.seconds <= MOST_CPU_SECONDS),
        ("no hole of its own", 0, lambda r: r.picture and not r.extra_holes),
        ("exit code 0", 0, lambda r: r.code == 0),
    ]
    first, *other_arms = arms
    print(f"\ngoals: share of the pairs in {first}, asked for{''.join(f', {name}' for name in other_arms)}")
    for name, least, holds in requirements:
        shares = {arm: share(rows, holds) for arm, rows in arms.items()}
        verdict = "      " if not least else "holds " if shares[first] >= least - 1e-9 else "FAILS "
        other_shares = " ".join(f"{shares[arm]:7.1%}" for arm in other_arms)
        print(
            f"  {verdict} {name:24} {shares[first]:7.1%} {f'{least:.0%}' if least else '':>5} {other_shares}"
        )
    for arm, rows in arms.items():
        pictured = [row for row in rows if row.picture and row.ours is not None]
        if pictured:
            agree = share(pictured, lambda r: abs(r.covered - r.ours) <= AGREES)
            print(
                f"  {arm}: our `covered` within {AGREES} of the measured one on {agree:.1%} of {len(pictured)}"
            )


def quantiles(arms: dict[str, list[Row]]) -> None:
    """Print median, 90 % quantile and worst value of each figure, for each arm."""
    print(f"\nmedian, 10 % worst, worst{'':7}" + "".join(f"{arm:>30}" for arm in arms))
    for name in ("covered", "visible", "cracks", "spilled", "p95", "K95", "seconds"):
        cells = []
        for rows in arms.values():
            values = [getattr(row, name) for row in rows if row.picture and getattr(row, name) is not None]
            levels = (0.5, 0.1, 0.0) if name in ("covered", "visible") else (0.5, 0.9, 1.0)
            values_found = np.nanquantile(values, levels, method="inverted_cdf") if values else [np.nan] * 3
            cells.append("".join(f"{value:10.3g}" for value in values_found))
        print(f"  {name:30}" + "".join(cells))


def by_kind(arms: dict[str, list[Row]], kinds: list[str]) -> None:
    """Print the share of pairs with coverage of .85 or more, by kind of target."""
    print("\ncovered at least .85, by the target's kind")
    for kind, count in sorted(Counter(kinds).items()):
        cells = [
            share([row for row, k in zip(rows, kinds, strict=True) if k == kind], lambda r: r.covered >= 0.85)
            for rows in arms.values()
        ]
        print(f"  {kind:8} {count:4}" + "".join(f"{cell:9.0%}" for cell in cells))


def sheets(lines: list[tuple[str, list[NDArray | None], list[str]]], path: Path) -> None:
    """Write contact sheets of PAGE_PAIRS pairs: FILE.png, or FILE-1.png, FILE-2.png, …"""
    for start in range(0, len(lines), PAGE_PAIRS):
        page = path if len(lines) <= PAGE_PAIRS else path.with_stem(f"{path.stem}-{start // PAGE_PAIRS + 1}")
        sheet(lines[start : start + PAGE_PAIRS], page)


def sheet(lines: list[tuple[str, list[NDArray | None], list[str]]], path: Path) -> None:
    """Draw a contact sheet: three pairs per row, with source, target and the result of each arm."""
    side, gap, text, across = 150, 4, 14, 3
    cells = max(len(pictures) for _, pictures, _ in lines)
    wide, high = cells * (side + gap) + 2 * gap, side + 2 * text + gap
    rows = -(-len(lines) // across)
    page = Image.new("RGB", (across * wide, rows * high), "white")
    pen = ImageDraw.Draw(page)
    for k, (title, pictures, captions) in enumerate(lines):
        left, top = k % across * wide + gap, k // across * high
        pen.text((left, top), title[: wide // 6], fill="black")
        for n, pixels in enumerate(pictures):
            x, y = left + n * (side + gap), top + text
            pen.rectangle((x, y, x + side - 1, y + side - 1), fill="#aec2b6")
            if pixels is None:
                pen.line((x, y, x + side, y + side), fill="#c0143c", width=3)
            else:
                picture = Image.fromarray(pixels).convert("RGBA")
                picture.thumbnail((side, side), Image.Resampling.LANCZOS)
                place = (x + (side - picture.width) // 2, y + (side - picture.height) // 2)
                page.paste(picture, place, picture)
            pen.text((x, y + side), captions[n][: side // 6], fill="black")
    page.save(path)


def line_of(number: int, source: Drawing, target: Drawing, arm_results: list[tuple[Row, Path]]) -> tuple:
    """Return the entry of a pair on the sheet."""
    pictures: list[NDArray | None] = [look(source), look(target)]
    captions = ["", ""]
    for row, path in arm_results:
        pictures.append(np.asarray(Image.open(path).convert("RGBA")) if row.picture else None)
        captions.append(f"cov {row.covered:.2f} cr {100 * row.cracks:.1f} p{row.p95:.1f} K{row.K95:.1f}")
    return f"{number}. {source.label} > {target.label}", pictures, captions


def look(drawing: Drawing) -> NDArray:
    """Return a drawing as a person sees it."""
    if drawing.kind == "photo":
        return np.asarray(Image.open(drawing.spec).convert("RGBA"))
    return rendered(drawing.svg, drawing.canvas, 300)


def numbers(text: str) -> set[int]:
    """Return the numbers in a list such as 3,7,20-30."""
    selection: set[int] = set()
    for word in text.split(","):
        first, _, last = word.partition("-")
        selection.update(range(int(first), int(last or first) + 1))
    return selection


def arm(name: str, command: str, label: str | None, scratch: Path, stmap: bool) -> Arm:
    """Return an arm for a command line; SOURCE and TARGET are appended if it does not name them."""
    words = shlex.split(command)
    if not any("{source}" in word for word in words):
        words += ["{source}", "{target}"]
    folder = FOLDER / "runs" / re.sub(r"[^\w.-]", "_", label) if label else scratch / name
    return Arm(name, tuple(words), folder, stmap)


def main(words: list[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=150)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument(
        "--kin", action="store_true", help="letters onto letters, rings onto rings, … instead"
    )
    parser.add_argument("--only", type=numbers, help="numbers of pairs, such as 3,7,20-30")
    parser.add_argument("--command", default=f"{COMMAND} map", help="what is judged")
    parser.add_argument("--label", help="under which its results are kept")
    parser.add_argument("--beside", metavar="COMMAND", help="a second command")
    parser.add_argument("--beside-label", metavar="LABEL")
    parser.add_argument(
        "--shown", action="store_true", help="measure what of the source is seen; adds --stmap"
    )
    parser.add_argument("--sheet", type=Path, help=f"contact sheets, {PAGE_PAIRS} pairs on each")
    parser.add_argument("--sheet-pairs", type=int, default=60, help="how many of them")
    options = parser.parse_args(words)
    empty: list[str] = []
    pairs = kin_pairs() if options.kin else random_pairs(options.pairs, options.seed, empty)
    sets = Counter(drawing.part_of for pair in pairs for drawing in pair)
    chosen = [k for k in range(1, len(pairs) + 1) if not options.only or k in options.only]
    kind = "pairs of a kind" if options.kin else f"random pairs (seed {options.seed})"
    print(f"## {len(pairs)} {kind} of {len(sets)} sets: {', '.join(sorted(sets))}")
    print(f"drawings that paint nothing, passed over: {len(empty)} {empty[:8]}")
    several = [any(part_count(drawing) > 1 for drawing in pair) for pair in pairs]
    kinds = [{drawing.kind for drawing in pair} for pair in pairs]
    print(f"pairs with several parts: {np.mean(several):.0%}", end="")
    print(f", with a line icon or glyph: {np.mean([bool(k & {'line', 'glyph'}) for k in kinds]):.0%}", end="")
    print(f", with colours: {np.mean(['colour' in k for k in kinds]):.0%}")
    with tempfile.TemporaryDirectory() as scratch:
        arms = [arm("new", options.command, options.label, Path(scratch), options.shown)]
        if options.beside:
            arms.append(arm("old", options.beside, options.beside_label, Path(scratch), options.shown))
        for one_arm in arms:
            print(f"{one_arm.name}: {shlex.join(one_arm.words)}")
            if not one_arm.folder.exists():
                replace(one_arm, folder=Path(scratch) / "first").run(*pairs[0])  # for compilation
                for file in (Path(scratch) / "first").glob("*"):
                    file.unlink()
        print(HEAD)
        rows: dict[str, list[Row]] = {one_arm.name: [] for one_arm in arms}
        lines = []
        for k in chosen:
            source, target = pairs[k - 1]
            arm_results = [one_arm.run(source, target) for one_arm in arms]
            for one_arm, (row, _) in zip(arms, arm_results, strict=True):
                rows[one_arm.name].append(row)
                name = f"{k} {source.label[:18]} > {target.label[:18]}"
                print(f"{name:42} {one_arm.name:4} {row}", flush=True)
            if len(lines) < options.sheet_pairs:
                lines.append(line_of(k, source, target, arm_results))
        if options.sheet:
            sheets(lines, options.sheet)
    by_kind(rows, [pairs[k - 1][1].kind for k in chosen])
    quantiles(rows)
    goals(rows)
    print(f"\nlicences: {', '.join(f'{name} {SETS[name].licence}' for name in sorted(sets))}")


if __name__ == "__main__":
    sys.exit(main())
