"""Whole drawings for the gallery: a photo, a word and an icon mapped as a whole, and random drawings compared with
mapping their largest outlines.
"""

import random
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path as MplPath
from matplotlib.textpath import TextPath
from PIL import Image

from iccm.io.run.execute import run
from iccm.io.run.job import Job, Outcome
from iccm.io.shapes import shape as files

from . import pictures, shapes

FILES = shapes.ROOT / "docs" / "files"
LEAF = shapes.ROOT / "samples" / "rose-leaf" / "leaf.svg"
COLOURS = ("#c0143c", "#d1662b", "#3c8a3f", "#2a78b8", "#6b3fa0")  # of the letters of a word
SEED, PAIRS, COLUMNS = 8, 8, 2  # for random drawings
SIZE = 600  # longer side of a picture in pixels


def teaser() -> list[tuple[str, str]]:
    """Whole drawings: a photo in a heart, a word in a leaf, a medal in a bell, by `iccm map SOURCE TARGET`."""
    figure, panels = pictures.sheet(9, 1, 1.45, 0.1)
    rows = []
    with TemporaryDirectory() as folder:
        word = Path(folder) / "word.svg"
        word.write_text(spelt("Hello"), encoding="utf-8")
        pairs = (
            ("a photo", FILES / "cat.jpg", FILES / "heart.svg"),
            ("a word", word, LEAF),
            ("an icon", FILES / "medal.svg", FILES / "bell.svg"),
        )
        for line, (name, source, target) in zip(panels.reshape(3, 3), pairs):
            carried(line[0], folder, source=str(source), target=str(source))
            silhouette(line[1], str(target))
            done = carried(line[2], folder, source=str(source), target=str(target))
            for axes, head in zip(line, (name, "a shape", "the result")):
                pictures.title(axes, head)
            rows.append((f"{name}: {source.stem} → {target.stem}", caption(done)))
    pictures.save(figure, "teaser", dpi=200)
    return rows


def fits() -> list[tuple[str, str]]:
    """Whole drawings, the default, next to the largest outline of each alone, for random drawings of several parts."""
    figure, panels = pictures.sheet(3 * COLUMNS, PAIRS // COLUMNS, 1.6)
    cells, rows, choice = panels.reshape(-1, 3), list[tuple[str, str]](), random.Random(SEED)
    while len(rows) < 2 * PAIRS:
        pair = [shapes.drawn_shape(choice, [], shapes_shown()) for _ in range(2)]
        if all(drawing.is_one_part for drawing in map(drawing_of, pair)):
            continue
        line = cells[len(rows) // 2]
        source, target = (outline.spec for outline in pair)
        options = {"source": source, "target": target, "texture": "checker"}
        with TemporaryDirectory() as folder:
            carried(line[0], folder, **options | {"target": source})
            largest = carried(line[1], folder, **options, parts="largest", fit="whole", target_box="viewbox")
            whole = carried(line[2], folder, **options, target_box="viewbox")
        names = " → ".join(shapes.label(outline) for outline in pair)
        for axes, head in zip(line, (shapes.label(pair[0]), "largest, whole", "auto")):
            pictures.title(axes, head)
        rows += [(f"{names}, largest outlines", caption(largest)), (f"{names}, auto", caption(whole))]
    pictures.save(figure, "fits", dpi=70)
    return rows


def shapes_shown() -> tuple[str, ...]:
    """Return packages whose licences let pictures of their drawings be shown here, with the attribution in the
    gallery.
    """
    from .methods import WILD_FREE

    return WILD_FREE


def drawing_of(shape: files.Shape):
    """Return everything that a shape's file paints."""
    return files.read(shape.spec, whole=True).drawing


def carried(axes: Axes, folder: str, **job) -> Outcome:
    """Draw the result of `iccm map` for a job on white."""
    path = Path(folder) / "carried.png"
    result = run(Job(output=(str(path),), size=(SIZE,), force=True, **job))
    picture = Image.open(path).convert("RGBA")
    on_white = np.asarray(Image.alpha_composite(Image.new("RGBA", picture.size, "white"), picture))
    pictures.show_picture(axes, on_white, (0j, complex(*picture.size)))
    return result


def silhouette(axes: Axes, spec: str) -> None:
    """Draw in grey what a file paints."""
    target = files.read(spec, whole=True)
    # lines that enclose an area count as filled, but are seen as lines
    painted = target.ink or target.drawing
    assert painted is not None
    rings = [np.append(ring, ring[:1]) for ring in painted.rings]
    path = MplPath.make_compound_path(
        *(MplPath(np.column_stack([z.real, z.imag]), closed=True) for z in rings)
    )
    axes.add_patch(PathPatch(path, facecolor=pictures.SOFT, edgecolor="none"))
    low, high = target.box
    axes.set_xlim(low.real, high.real)
    axes.set_ylim(low.imag, high.imag)
    axes.set_aspect("equal")
    axes.set_anchor("N")
    axes.set_axis_off()


def spelt(word: str) -> str:
    """Return a word in DejaVu Sans, which matplotlib includes, as an SVG with a colour for each letter."""
    letters, across = [], 0.0
    for letter, colour in zip(word, COLOURS):
        rings = TextPath(
            (across, 0), letter, size=100, prop={"family": "DejaVu Sans", "weight": "bold"}
        ).to_polygons()
        d = "".join("M" + "L".join(f"{x:.2f} {100 - y:.2f}" for x, y in ring) + "Z" for ring in rings)
        letters.append(f'<path fill="{colour}" d="{d}"/>')
        across = max(x for ring in rings for x, _ in ring) + 6
    space = 'xmlns="http://www.w3.org/2000/svg"'
    return f'<svg {space} viewBox="-5 -5 {across + 10:.0f} 120">{"".join(letters)}</svg>'


def caption(done: Outcome) -> str:
    """Return the figures of a run as text."""
    report = done.report
    seen = [f"{name} {report[name]:.0%}" for name in ("shown", "covered") if name in report]
    figures = f"p95 stretch {report['stretch']['p95']:.1f}, K95 {report['dilatation']['p95']:.1f}"
    proof = "certified" if report["injective"]["certified"] else "not certified"
    return ", ".join([*seen, figures, proof])
