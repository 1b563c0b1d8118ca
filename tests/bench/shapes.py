"""Real silhouettes for the benches: icons, emoji, maps and countries, fetched by npm from eight packages."""

import json
import random
import re
import subprocess
import tarfile
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import shapely

from iccm import Curve, InputError
from iccm.io.shapes import shape as files

ROOT = Path(__file__).resolve().parents[2]
CACHE = ROOT / "build" / "bench"
PACKAGES = {
    "icons": "@fortawesome/fontawesome-free@7.3.1",
    "atlas": "world-atlas@2.0.2",
    "mdi": "@mdi/svg@7.4.47",
    "bootstrap": "bootstrap-icons@1.13.2",
    "simple": "simple-icons@16.37.0",
    "twemoji": "@twemoji/svg@15.0.0",
    "openmoji": "openmoji@17.0.0",
    "svgmaps": "@svg-maps/world@2.0.0",
}
DRAWINGS = {  # folders of drawings in the packages
    "icons": "svgs/solid",
    "mdi": "svg",
    "bootstrap": "icons",
    "simple": "icons",
    "twemoji": ".",
    "openmoji": "color/svg",
}
COUNTRIES = 0.3  # share of countries among the shapes of random pairs
WILD = {  # packages on which no constant was tuned, with the folders of their drawings
    "phosphor": ("@phosphor-icons/core@2.1.1", "assets/regular/*.svg"),
    "remix": ("remixicon@4.9.1", "icons/*/*.svg"),
    "ionicons": ("ionicons@8.1.0", "dist/svg/*.svg"),
    "carbon": ("@carbon/icons@11.89.0", "svg/32/*.svg"),
    "healthicons": ("healthicons@2.0.0", "public/icons/svg/filled/*/*.svg"),
    "crypto": ("cryptocurrency-icons@0.18.1", "svg/black/*.svg"),
    "lucide": ("lucide-static@1.62.0", "icons/*.svg"),
    "iconoir": ("iconoir@7.12.1", "icons/regular/*.svg"),
    "fluent": ("@fluentui/svg-icons@1.1.343", "icons/*_24_filled.svg"),
    "noto": ("@iconify-json/noto@1.2.9", "icons.json"),
    "flat": ("@iconify-json/fluent-emoji-flat@1.2.6", "icons.json"),
    "lora": ("@expo-google-fonts/lora@0.4.2", "700Bold/*.ttf"),
    "pacifico": ("@expo-google-fonts/pacifico@0.4.1", "400Regular/*.ttf"),
    "anton": ("@expo-google-fonts/anton@0.4.2", "400Regular/*.ttf"),
    "states": ("us-atlas@3.0.1", "states-10m.json"),
    "countries": ("world-atlas@2.0.2", "countries-50m.json"),
}
WIDEST = 100  # degrees; wider outlines (Russia, Antarctica) are torn by the projection


@cache
def package(name: str) -> Path:
    """Return the folder of an unpacked npm package of PACKAGES or WILD; it is fetched at first use.

    Raises:
        subprocess.CalledProcessError, FileNotFoundError: npm is missing or cannot reach its registry.
    """
    return fetched(name, PACKAGES[name] if name in PACKAGES else WILD[name][0])


def fetched(name: str, spec: str) -> Path:
    """Return the folder of an npm package, unpacked below CACHE / name at first use.

    Raises:
        subprocess.CalledProcessError, FileNotFoundError: npm is missing or cannot reach its registry.
    """
    folder = CACHE / name
    if not (folder / "package" / "package.json").exists():
        folder.mkdir(parents=True, exist_ok=True)
        command = ["npm", "pack", "--silent", "--pack-destination", str(folder), spec]
        result = subprocess.run(command, check=True, capture_output=True, text=True)
        with tarfile.open(folder / result.stdout.strip()) as archive:
            archive.extractall(folder, filter="data")
    return folder / "package"


def icons() -> dict[str, Path]:
    """Return SVG files of the solid icons by name."""
    return {path.stem: path for path in sorted((package("icons") / "svgs" / "solid").glob("*.svg"))}


def icon(name: str) -> Curve:
    """Return the largest outline of an icon; raise InputError if it is not a valid shape."""
    return files.read(str(icons()[name])).curve


@cache
def countries(scale: str = "110m") -> dict[str, Curve]:
    """Return the largest outline of each country, with longitudes shrunk by the cosine of its latitude.

    Args:
        scale: "110m", "50m" or "10m": the resolution of the atlas.
    """
    text = (package("atlas") / f"countries-{scale}.json").read_text(encoding="utf-8")
    largest_rings = {
        name: max(rings, key=lambda r: abs(Curve(r).area)) for name, rings in rings_of(json.loads(text))
    }
    return {name: curve for name, ring in largest_rings.items() if (curve := _projected(ring)) is not None}


def rings_of(topology: dict) -> list[tuple[str, list[np.ndarray]]]:
    """Return names and outer rings (longitude + i·latitude, in degrees) of the countries in a quantised TopoJSON
    file.
    """
    scale, shift = (np.array(topology["transform"][key]) for key in ("scale", "translate"))
    arcs = [
        (np.cumsum(np.array(arc), axis=0) * scale + shift) @ np.array([1, 1j]) for arc in topology["arcs"]
    ]
    out = []
    objects = topology["objects"]
    for shape in objects["countries" if "countries" in objects else "states"]["geometries"]:
        parts = {"Polygon": [shape["arcs"]], "MultiPolygon": shape["arcs"]}.get(shape["type"], [])
        # ~k is arc k backwards; an arc's last point is the next one's first
        joined = [np.concatenate([(arcs[k] if k >= 0 else arcs[~k][::-1])[:-1] for k in p[0]]) for p in parts]
        if joined:
            out.append((shape["properties"]["name"], joined))
    return out


def _projected(ring: np.ndarray) -> Curve | None:
    low, high = Curve(ring).box
    if ring.size < 3 or abs(high - low) > WIDEST:
        return None
    shrunk = np.column_stack([ring.real * np.cos(np.radians((low + high).imag / 2)), ring.imag])
    # quantised outlines touch themselves: use the largest of the parts that they enclose
    part = max(shapely.get_parts(shapely.Polygon(shrunk).buffer(0)), key=shapely.area, default=None)
    if part is None or part.area < 1:
        return None
    try:
        return Curve.domain(shapely.get_coordinates(part.exterior)[:-1] @ np.array([1, 1j]))
    except InputError:
        return None


def pick(choice: random.Random, scale: str = "110m") -> tuple[str, Curve]:
    """Return a random silhouette and its name."""
    atlas, drawn = countries(scale), icons()
    while True:
        if choice.random() < COUNTRIES:
            name = choice.choice(sorted(atlas))
            return name, atlas[name]
        name = choice.choice(sorted(drawn))
        try:
            return name, icon(name)
        except InputError:
            continue  # not a valid shape: strokes only, or outlines that cross


def pairs(count: int, seed: int, scale: str = "110m") -> list[tuple[tuple[str, Curve], tuple[str, Curve]]]:
    """Return random pairs of silhouettes, the same for each seed."""
    choice = random.Random(seed)
    return [(pick(choice, scale), pick(choice, scale)) for _ in range(count)]


@cache
def drawings(name: str) -> list[str]:
    """Return the drawings of a package, as `file` or `file#id`, in order."""
    if name in WILD:
        return wild_drawings(name)
    if name == "svgmaps":  # one drawing, with one country per id
        world = package(name) / "world.svg"
        return [f"{world}#{key}" for key in sorted(re.findall(r'id="(\w+)"', world.read_text("utf-8")))]
    return [str(path) for path in sorted((package(name) / DRAWINGS[name]).glob("*.svg"))]


def wild_drawings(name: str) -> list[str]:
    """Return the drawings of a package of WILD; glyphs, emoji and outlines on a map are written as SVG files at first
    use.
    """
    files = sorted(package(name).glob(WILD[name][1]))
    if files[0].suffix == ".svg":
        return [str(path) for path in files]
    folder = CACHE / name / "drawn"
    if not folder.exists():
        make = {".ttf": glyphs, ".json": emoji}[files[0].suffix] if "atlas" not in WILD[name][0] else on_maps
        partial = folder.with_name("partial")
        partial.mkdir(exist_ok=True)
        for key, text in make(files[0]):
            (partial / f"{key}.svg").write_text(text, encoding="utf-8")
        partial.rename(folder)
    return [str(path) for path in sorted(folder.glob("*.svg"))]


def glyphs(font: Path) -> Iterator[tuple[str, str]]:
    """Yield names and drawings of the Latin letters, digits and signs of a font."""
    from fontTools.pens.svgPathPen import SVGPathPen
    from fontTools.ttLib import TTFont

    opened = TTFont(font)
    outlines, names = opened.getGlyphSet(), opened.getBestCmap()
    height = opened["head"].unitsPerEm
    for code in (*range(0x21, 0x7F), *range(0xC0, 0x17F)):
        pen = SVGPathPen(outlines)
        if code in names:
            outlines[names[code]].draw(pen)
        if path := pen.getCommands():
            width = outlines[names[code]].width
            view = f'viewBox="0 {-height} {width} {1.4 * height}"'
            yield names[code], _svg(view, f'<path transform="scale(1 -1)" d="{path}"/>')


def emoji(collection: Path) -> Iterator[tuple[str, str]]:
    """Yield names and silhouettes of an Iconify collection."""
    icon_set = json.loads(collection.read_text(encoding="utf-8"))
    for key, icon in icon_set["icons"].items():
        width, height = (icon.get(side, icon_set.get(side, 16)) for side in ("width", "height"))
        yield key, _svg(f'viewBox="0 0 {width} {height}"', icon["body"])


def on_maps(atlas: Path) -> Iterator[tuple[str, str]]:
    """Yield the largest outline of each country or state."""
    regions = rings_of(json.loads(atlas.read_text(encoding="utf-8")))
    for key, rings in regions:
        curve = _projected(max(rings, key=lambda r: abs(Curve(r).area)))
        if curve is not None:
            low, high = curve.box
            path = " ".join(f"{z.real:.9g},{-z.imag:.9g}" for z in curve.z)
            view = f'viewBox="{low.real} {-high.imag} {(high - low).real} {(high - low).imag}"'
            yield re.sub(r"\W", "_", key), _svg(view, f'<path d="M{path}Z"/>')


def _svg(view: str, body: str) -> str:
    return f'<svg xmlns="http://www.w3.org/2000/svg" {view}>{body}</svg>'


def drawn_pairs(
    count: int, seed: int, refusals: list[str], packages: Sequence[str] = (*DRAWINGS, "svgmaps")
) -> list[tuple[files.Shape, files.Shape]]:
    """Return random pairs of drawings, with packages equally likely; the same for each seed. Drawings that cannot be
    read as shapes are appended to the refusals, and replaced by others.
    """
    choice = random.Random(seed)
    return [
        (drawn_shape(choice, refusals, packages), drawn_shape(choice, refusals, packages))
        for _ in range(count)
    ]


def drawn_shape(choice: random.Random, refusals: list[str], packages: Sequence[str]) -> files.Shape:
    """Return the shape of a random drawing."""
    while True:
        spec = choice.choice(drawings(choice.choice(packages)))
        try:
            return files.read(spec)
        except InputError as error:
            refusals.append(str(error))


def label(shape: files.Shape) -> str:
    """Return a short name of a drawing."""
    path, _, part = shape.spec.partition("#")
    package = Path(path).relative_to(CACHE).parts[0]
    return f"{package}/{part or Path(path).stem}"


def sample(name: str) -> files.Shape:
    """Return one of the project's own shapes, by its path below samples/."""
    return files.read(str(ROOT / "samples" / name))
