"""Logos, a face and words that must not bend, on other silhouettes: a table, and a contact sheet.

python -m tests.bench.logos SHEET.png [--count 20] [--seed 1]

Sources are, alternately, a round badge with a logo of Simple Icons, scikit-image's astronaut, whose face is kept, and a
banner with a word. Logos, words and fonts are random, and so are the targets: silhouettes from the packages in
`shapes.WILD`. A logo's region is its convex hull, a word's its bounding box.
"""

import argparse
import random
import time
from functools import reduce
from pathlib import Path

import numpy as np
import shapely
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.textpath import TextPath

import iccm
from iccm.arrays import complex_of
from iccm.io.shapes import shape as files
from iccm.io.spec import Spec
from iccm.pixels.warp import Texture

from . import pictures, shapes

WORDS = "Sunday", "Harbour", "Fresh", "Open late", "Velvet", "North 21", "Mañana", "Quick & Co"
FONTS = {"lora": "700Bold", "pacifico": "400Regular", "anton": "400Regular"}
AROUND = np.exp(2j * np.pi * np.arange(60) / 60)
HEAD = 226 - 103j + 72 * AROUND.real + 86j * AROUND.imag  # of the astronaut, in pixels
PIXELS = 768
SHADES = "#f2c14e", "#e8a33d"  # stripes behind a logo or a word, which show how it is bent


def main(words: list[str] | None = None) -> None:
    """Print the table and draw the sheet."""
    parser = argparse.ArgumentParser()
    parser.add_argument("sheet")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(words)
    choice = random.Random(options.seed)
    print(
        f"seed {options.seed}; what, onto: status, K95 and size of the region, p95 of the stretch, CPU seconds"
    )
    figure, panels = pictures.sheet(5, -(-options.count // 5), 2.6, 0.3)
    for k, axes in enumerate(panels.ravel()):
        if k >= options.count:
            axes.set_axis_off()
            continue
        name, source, texture, region = (logo, face, word)[k % 3](choice)
        target = shapes.drawn_shape(choice, [], tuple(shapes.WILD))
        label, area = f"{k + 1} {name} onto {shapes.label(target)}", pictures.around(target.curve)
        started = time.process_time()
        try:
            fit = iccm.fit(source, target.curve, rigid=[region])
        except iccm.IccmError as error:
            print(f"{label}: {error}", flush=True)
            pictures.show_picture(axes, np.full((2, 2, 3), 255, np.uint8), area)
            figures = "none"
        else:
            cpu = time.process_time() - started
            (result,) = fit.rigid
            figures = f"K {result.dilatation:.3f}, size {result.scale:.2f}"
            stretch = fit.distortion.quantile(fit.distortion.stretches, 0.95)
            print(f"{label}: {fit.status.name.lower()}, {figures}, {stretch:.1f}, {cpu:.1f}", flush=True)
            pictures.textured(axes, fit, texture, area, 400)
        pictures.outline(axes, target.curve.z, pictures.INK, 0.9)
        pictures.title(axes, f"{k + 1} {name}", figures)
    figure.savefig(options.sheet, dpi=110)


def logo(choice: random.Random) -> tuple[str, iccm.Curve, Texture, np.ndarray]:
    """Return a logo on a round badge: its name, the source's outline and texture, and the region."""
    path = Path(choice.choice(shapes.drawings("simple")))
    drawing = files.drawn(Spec(str(path), None))
    rings = [ring.conj() for outline in drawing.outlines for ring in (outline.z, *outline.holes)]
    hull = complex_of(shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(points_of(rings)))))[:-1]
    middle, size = hull.mean(), 0.5 / np.abs(hull - hull.mean()).max()
    rings, hull = [size * (ring - middle) for ring in rings], size * (hull - middle)
    return path.stem, *painted(AROUND, rings), hull


def word(choice: random.Random) -> tuple[str, iccm.Curve, Texture, np.ndarray]:
    """Return the same for a word on a banner."""
    text, font = choice.choice(WORDS), choice.choice(sorted(FONTS))
    (file,) = shapes.package(font).glob(f"{FONTS[font]}/*.ttf")
    written = TextPath((0, 0), text, 1, prop=FontProperties(fname=file))
    rings = [complex_of(np.asarray(ring)[:-1]) for ring in written.to_polygons()]
    low, high = iccm.Curve(np.concatenate(rings)).box
    middle, size = (low + high) / 2, 1.1 / (high - low).real
    low, high = size * (low - middle) - 0.03 - 0.03j, size * (high - middle) + 0.03 + 0.03j
    box = np.array([low, complex(high.real, low.imag), high, complex(low.real, high.imag)])
    banner = np.array([-1 - 0.6j, 1 - 0.6j, 1 + 0.6j, -1 + 0.6j])
    return text, *painted(banner, [size * (ring - middle) for ring in rings]), box


def face(choice: random.Random) -> tuple[str, iccm.Curve, Texture, np.ndarray]:
    """Return the same for the astronaut's face."""
    from skimage import data

    photo = data.astronaut()
    height, width = photo.shape[:2]
    corners = np.array([-height * 1j, width - height * 1j, width, 0])
    return "face", iccm.Curve(corners), Texture(photo, (complex(0, -height), complex(width, 0))), HEAD


def painted(source: np.ndarray, rings: list[np.ndarray]) -> tuple[iccm.Curve, Texture]:
    """Return a source, and its texture: stripes, with outlines filled over them."""
    low, high = iccm.Curve(source).box
    half = 0.5 * max((high - low).real, (high - low).imag)
    figure = Figure(figsize=(1, 1), dpi=PIXELS)
    axes = figure.add_axes((0, 0, 1, 1), xlim=(-half, half), ylim=(-half, half))
    axes.set_axis_off()
    for k, x in enumerate(np.linspace(-half, half, 17)[:-1]):
        axes.axvspan(x, x + half / 8, color=SHADES[k % 2], lw=0)
        axes.axhline(x, color="white", lw=0.2)
    inked = reduce(
        shapely.symmetric_difference, (shapely.Polygon(points_of([ring])).buffer(0) for ring in rings)
    )
    for part in shapely.get_parts(inked):
        lines = [shapely.get_coordinates(line) for line in (part.exterior, *part.interiors)]
        whole = Outline.make_compound_path(*map(Outline, lines))
        axes.add_patch(PathPatch(whole, facecolor=pictures.INK, lw=0, zorder=3))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., :3]
    return iccm.Curve(source), Texture(pixels.copy(), (complex(-half, -half), complex(half, half)))


def points_of(rings: list[np.ndarray]) -> np.ndarray:
    """Return (n, 2) the points of closed rings."""
    z = np.concatenate([np.append(ring, ring[0]) for ring in rings])
    return np.column_stack([z.real, z.imag])


if __name__ == "__main__":
    main()
