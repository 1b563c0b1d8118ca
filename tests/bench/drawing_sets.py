"""Drawings for the bench `drawings`: files of 28 sets that no other bench uses, fetched by npm.

Each drawing has a file as a user would have it, and an equivalent SVG for the bench's own rasterizer.
"""

import json
import random
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from . import shapes
from .rasterizer import Box, rendered

FOLDER = shapes.CACHE / "drawings"
PICTURE_PIXELS = 512  # longer side of drawings that are written as pictures
LEAST_PAINTED = 0.004  # relative to its canvas; a drawing that paints less is considered empty
WORDS = (
    *("A", "B", "Q", "R", "a", "e", "g", "k", "s", "w", "&", "?", "2", "4", "8", "ij", "Oö", "fb"),
    *("Hello", "Sale", "Jazz", "Ahoy!", "Bold 7", "Café", "North", "River", "50%", "Big sky"),
)
SIGNS = ("水", "山", "花", "あ", "ふ", "み", "ネコ", "東京", "ありがとう", "祭り")
LINE_BOX_EMS = 0.8, 1.0  # above the baseline, and in total: the canvas of a word in our reference
KIN = (  # drawings of one kind, by set and name
    ("temaki/donut", "flatcolor/doughnut-chart"),
    ("temaki/wheel", "fontisto/flotation-ring"),
    ("temaki/hand", "emojione1/hand-with-fingers-splayed"),
    ("emojione/call-me-hand", "temaki/hand"),
    ("borders/ita", "borders/nor"),
    ("borders/jpn", "borders/gbr"),
    ("borders/bra", "borders/ind"),
    ("tabler/cat", "tabler/dog"),
    ("hugeicons/cat", "iconpark/dog"),
    ("fontisto/heart", "fontisto/star"),
    ("emojione1/cat-face", "emojione1/dog-face"),
)
REGIONS = (
    *("@svg-maps/italy@2.0.0", "@svg-maps/india@2.0.0", "@svg-maps/canada@2.0.0", "@svg-maps/spain@2.0.0"),
    *("@svg-maps/mexico@2.0.0", "@svg-maps/nigeria@2.0.0"),
)


@dataclass(frozen=True)
class DrawingSet:
    """Origin of a set of drawings.

    Attributes:
        package: npm package, one or several words.
        files: pattern of its files in the package.
        kind: "glyph", "line", "colour", "word", "map" or "photo".
        licence: of the drawings.
        suffix: of the files that are written; empty if those of the package are used unchanged.
        keep: pattern that names of a collection must match.
    """

    package: str
    files: str
    kind: str
    licence: str
    suffix: str = ""
    keep: str = ""


SETS = {
    # glyphs: filled icons of one colour
    "game": DrawingSet("@iconify-json/game-icons@1.2.4", "icons.json", "glyph", "CC BY 3.0", ".svg"),
    "temaki": DrawingSet("@rapideditor/temaki@5.13.0", "icons/*.svg", "glyph", "CC0"),
    "gis": DrawingSet("@iconify-json/gis@1.2.5", "icons.json", "glyph", "CC BY 4.0", ".svg"),
    "fontisto": DrawingSet("@iconify-json/fontisto@1.2.1", "icons.json", "glyph", "MIT", ".svg"),
    "weather": DrawingSet("@iconify-json/wi@1.2.1", "icons.json", "glyph", "OFL 1.1", ".svg"),
    "clipart": DrawingSet("@iconify-json/raphael@1.2.1", "icons.json", "glyph", "MIT", ".white.png"),
    # lines: icons drawn with strokes
    "tabler": DrawingSet("@tabler/icons@3.51.0", "icons/outline/*.svg", "line", "MIT"),
    "feather": DrawingSet("feather-icons@4.29.2", "dist/icons/*.svg", "line", "MIT"),
    "solar": DrawingSet("@iconify-json/solar@1.2.13", "icons.json", "line", "CC BY 4.0", ".svg", "-linear$"),
    "arcticons": DrawingSet("@iconify-json/arcticons@1.2.58", "icons.json", "line", "CC BY-SA 4.0", ".svg"),
    "hugeicons": DrawingSet("@iconify-json/hugeicons@1.2.35", "icons.json", "line", "MIT", ".svg"),
    "guidance": DrawingSet("@iconify-json/guidance@1.2.2", "icons.json", "line", "CC BY 4.0", ".svg"),
    "momentum": DrawingSet("@momentum-design/illustrations@0.2.6", "dist/svg/*.svg", "line", "MIT"),
    # colours: icons, emoji, illustrations, logos, flags
    "iconpark": DrawingSet("@iconify-json/icon-park@1.2.4", "icons.json", "colour", "Apache 2.0", ".svg"),
    "flatcolor": DrawingSet("@iconify-json/flat-color-icons@1.2.3", "icons.json", "colour", "MIT", ".svg"),
    "gradients": DrawingSet(
        "@iconify-json/fluent-color@1.2.21", "icons.json", "colour", "MIT", ".svg", "-[24]"
    ),
    "emojione": DrawingSet("@iconify-json/emojione@1.2.3", "icons.json", "colour", "CC BY 4.0", ".png"),
    "emojione1": DrawingSet(
        "@iconify-json/emojione-v1@1.2.3", "icons.json", "colour", "CC BY-SA 4.0", ".svg"
    ),
    "gravity": DrawingSet("@gravity-ui/illustrations@2.1.1", "svgs/*.svg", "colour", "MIT"),
    "devicon": DrawingSet("devicon@2.17.0", "icons/*/*-original.svg", "colour", "MIT"),
    "flags": DrawingSet("flag-icons@7.5.0", "flags/4x3/*.svg", "colour", "MIT"),
    # words and letters, specified as font.ttf#text=Word
    "playfair": DrawingSet("@expo-google-fonts/playfair-display@0.4.2", "700Bold/*.ttf", "word", "OFL 1.1"),
    "bangers": DrawingSet("@expo-google-fonts/bangers@0.4.1", "400Regular/*.ttf", "word", "OFL 1.1"),
    "vibes": DrawingSet("@expo-google-fonts/great-vibes@0.4.1", "400Regular/*.ttf", "word", "OFL 1.1"),
    "kaisei": DrawingSet("@expo-google-fonts/kaisei-decol@0.4.1", "700Bold/*.ttf", "word", "OFL 1.1"),
    # maps
    "borders": DrawingSet("world-countries@5.1.0", "data/*.geo.json", "map", "ODbL 1.0"),
    "regions": DrawingSet(" ".join(REGIONS), "*.svg", "map", "CC BY 4.0"),
    # pictures without alpha, as sources: from scikit-image, public domain or CC0
    "photos": DrawingSet("", "", "photo", "CC0"),
}
PHOTOS = ("chelsea", "coffee", "astronaut", "rocket")


@dataclass(frozen=True)
class Drawing:
    """One drawing.

    Attributes:
        spec: its name on the command line.
        svg: an equivalent SVG.
        canvas: left, top, width and height of its canvas, in the SVG's units.
        part_of: name of its set.
    """

    spec: str
    svg: str
    canvas: Box
    part_of: str

    @property
    def kind(self) -> str:
        """The kind of its set."""
        return SETS[self.part_of].kind

    @property
    def label(self) -> str:
        """A short name."""
        path, _, word = self.spec.partition("#text=")
        return f"{self.part_of}/{word or Path(path).name.split('.')[0]}"


def random_pairs(count: int, seed: int, empty: list[str]) -> list[tuple[Drawing, Drawing]]:
    """Return random pairs of drawings, the same for each seed.

    Sets have equal probability. Photos are only sources. Drawings that paint nothing are appended to `empty` and
    replaced by others.
    """
    choice = random.Random(seed)
    targets = [name for name in SETS if SETS[name].kind != "photo"]
    return [
        (random_drawing(choice, list(SETS), empty), random_drawing(choice, targets, empty))
        for _ in range(count)
    ]


def kin_pairs() -> list[tuple[Drawing, Drawing]]:
    """Return fixed pairs: letters onto letters, rings onto rings, hands onto hands, countries onto countries."""
    serif, bold, script = (set_files(name)[0] for name in ("playfair", "bangers", "vibes"))
    letters = [
        *((bold, "A", serif, "R"), (serif, "8", bold, "B"), (bold, "O", serif, "D"), (serif, "P", bold, "e")),
        *(
            (serif, "g", bold, "8"),
            (bold, "A", serif, "o"),
            (serif, "Q", serif, "O"),
            (serif, "b", serif, "q"),
        ),
        *(
            (bold, "a", serif, "a"),
            (serif, "R", bold, "R"),
            (script, "B", serif, "B"),
            (bold, "I", serif, "L"),
        ),
        (bold, "Hello", serif, "Hello"),
    ]
    fonts = {serif: "playfair", bold: "bangers", script: "vibes"}
    drawing_pairs = [
        tuple(
            Drawing(f"{font}#text={text}", *word_svg(font, text), fonts[font])
            for font, text in (source, target)
        )
        for source, target in (((a, b), (c, d)) for a, b, c, d in letters)
    ]
    drawing_pairs += [(_named(a), _named(b)) for a, b in KIN]
    samples = shapes.ROOT / "samples" / "rose-leaf"
    rose, leaf = (_file(samples / f"{name}.svg", "game") for name in ("rose", "leaf"))
    return [*drawing_pairs, (rose, leaf)]


def _named(label: str) -> Drawing:
    """Return the drawing of a set named as `set/name`."""
    part_of, name = label.split("/")
    files = set_files(part_of)
    if files[0].name == "icons.json":
        svg = dict(collection(files[0], SETS[part_of].keep))[name]
        return Drawing(str(written(part_of, name, svg, SETS[part_of].suffix)), svg, svg_canvas(svg), part_of)
    return _file(next(path for path in files if path.name.split(".")[0] == name), part_of)


def _file(path: Path, part_of: str) -> Drawing:
    """Return the drawing of an SVG or GeoJSON file."""
    text = path.read_text(encoding="utf-8")
    svg, canvas = geojson_svg(text) if path.suffix == ".json" else (text, svg_canvas(text))
    return Drawing(str(path), svg, canvas, part_of)


def random_drawing(choice: random.Random, names: list[str], empty: list[str]) -> Drawing:
    """Return a random drawing from one of these sets."""
    while True:
        name = choice.choice(names)
        drawing = drawing_of(name, choice)
        if _paints(drawing):
            return drawing
        empty.append(drawing.label)


def drawing_of(name: str, choice: random.Random) -> Drawing:
    """Return a random drawing of a set."""
    kind, suffix = SETS[name].kind, SETS[name].suffix
    if kind == "photo":
        return photo(choice.choice(PHOTOS))
    files = set_files(name)
    if kind == "word":
        (font,) = files
        text = choice.choice(SIGNS if name == "kaisei" else WORDS)
        svg, canvas = word_svg(font, text)
        return Drawing(f"{font}#text={text}", svg, canvas, name)
    if files[0].name == "icons.json":
        key, svg = choice.choice(collection(files[0], SETS[name].keep))
        return Drawing(str(written(name, key, svg, suffix)), svg, svg_canvas(svg), name)
    return _file(choice.choice(files), name)


@cache
def set_files(name: str) -> list[Path]:
    """Return the files of a set in its package."""
    files = []
    for number, spec in enumerate(SETS[name].package.split()):
        package = shapes.fetched(f"drawings/packages/{name}-{number}", spec)
        files += sorted(package.glob(SETS[name].files))
    return files


@cache
def collection(path: Path, keep: str) -> list[tuple[str, str]]:
    """Return names and SVG texts of the icons of an Iconify collection that are not hidden."""
    icon_set = json.loads(path.read_text(encoding="utf-8"))
    visible_keys = {key for key, icon in icon_set["icons"].items() if not icon.get("hidden")}
    return [(key, svg) for key, svg in shapes.emoji(path) if key in visible_keys and re.search(keep, key)]


def written(name: str, key: str, svg: str, suffix: str) -> Path:
    """Return the file of a drawing of a collection, written at first use: SVG, PNG, or PNG on white."""
    path = FOLDER / name / f"{key}{suffix}"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        if suffix == ".svg":
            path.write_text(svg, encoding="utf-8")
        else:
            from PIL import Image

            picture = Image.fromarray(rendered(svg, svg_canvas(svg), PICTURE_PIXELS))
            if suffix == ".white.png":
                ground = Image.new("RGBA", picture.size, "white")
                ground.alpha_composite(picture)
                picture = ground.convert("RGB")
            picture.save(path)
    return path


def svg_canvas(svg: str) -> Box:
    """Return the viewBox of an SVG text, else its size."""
    root = ElementTree.fromstring(svg.encode())
    if view := root.get("viewBox"):
        x, y, width, height = (float(word) for word in view.replace(",", " ").split())
        return x, y, width, height
    width, height = (float(re.match(r"[\d.]+", root.get(side, "100"))[0]) for side in ("width", "height"))
    return 0.0, 0.0, width, height


def photo(name: str) -> Drawing:
    """Return a photo of scikit-image as a PNG file, which paints its rectangle."""
    from PIL import Image
    from skimage import data

    path = FOLDER / "photos" / f"{name}.png"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(getattr(data, name)()).save(path)
    width, height = Image.open(path).size
    svg = f'<svg xmlns="http://www.w3.org/2000/svg"><rect width="{width}" height="{height}"/></svg>'
    return Drawing(str(path), svg, (0.0, 0.0, float(width), float(height)), "photos")


def word_svg(font: Path, text: str) -> tuple[str, Box]:
    """Return a word shaped by HarfBuzz, and the box of its line, extended to letters that reach out of it."""
    import uharfbuzz
    from fontTools.misc.transform import Offset
    from fontTools.pens.boundsPen import BoundsPen
    from fontTools.pens.svgPathPen import SVGPathPen
    from fontTools.pens.transformPen import TransformPen
    from fontTools.ttLib import TTFont

    opened = TTFont(font)
    outlines, names = opened.getGlyphSet(), opened.getGlyphOrder()
    buffer = uharfbuzz.Buffer()
    buffer.add_str(text)
    buffer.guess_segment_properties()
    uharfbuzz.shape(uharfbuzz.Font(uharfbuzz.Face(font.read_bytes())), buffer)
    path, bounds, pen_x = [], BoundsPen(outlines), 0
    for info, place in zip(buffer.glyph_infos, buffer.glyph_positions, strict=True):
        offset = Offset(pen_x + place.x_offset, place.y_offset)
        pen = SVGPathPen(outlines)
        outlines[names[info.codepoint]].draw(TransformPen(pen, offset))
        outlines[names[info.codepoint]].draw(TransformPen(bounds, offset))
        # one path each, so that overlapping glyphs stay filled
        path.append(f'<path d="{pen.getCommands()}"/>')
        pen_x += place.x_advance
    left, bottom, right, top = bounds.bounds
    left, right = min(0, left), max(pen_x, right)
    above, all_of_it = (share * opened["head"].unitsPerEm for share in LINE_BOX_EMS)
    top, bottom = max(above, top), min(above - all_of_it, bottom)
    body = f'<g transform="scale(1 -1)">{"".join(path)}</g>'
    return f'<svg xmlns="http://www.w3.org/2000/svg">{body}</svg>', (left, -top, right - left, top - bottom)


def geojson_svg(text: str) -> tuple[str, Box]:
    """Return all polygons of a GeoJSON file, y up, and their box."""
    paths, points = [], []
    for rings in _polygons(json.loads(text)):
        flipped = [np.array(ring, float)[:, :2] * (1, -1) for ring in rings]
        lines = [" ".join(f"{x:.9g},{y:.9g}" for x, y in ring) for ring in flipped]
        paths.append(f'<path fill-rule="evenodd" d="{"".join(f"M{line}Z" for line in lines)}"/>')
        points += flipped
    low, high = np.concatenate(points).min(0), np.concatenate(points).max(0)
    box = (float(low[0]), float(low[1]), float(high[0] - low[0]), float(high[1] - low[1]))
    return f'<svg xmlns="http://www.w3.org/2000/svg">{"".join(paths)}</svg>', box


def _polygons(tree: dict) -> Iterator[list]:
    """Return the polygons of a GeoJSON object."""
    below: dict[str, Callable[[], list]] = {
        "FeatureCollection": lambda: tree["features"],
        "GeometryCollection": lambda: tree["geometries"],
        "Feature": lambda: [tree["geometry"]],
    }
    if tree["type"] in below:
        for child in below[tree["type"]]():
            yield from _polygons(child)
    elif tree["type"] == "MultiPolygon":
        yield from tree["coordinates"]
    elif tree["type"] == "Polygon":
        yield tree["coordinates"]


def _paints(drawing: Drawing) -> bool:
    alpha = rendered(drawing.svg, drawing.canvas, 128)[..., 3]
    return float((alpha > 127).mean()) >= LEAST_PAINTED
