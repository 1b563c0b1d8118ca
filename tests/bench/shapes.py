"""Real silhouettes for the benches: icons, emoji, maps and countries, fetched by npm from eight packages."""

import json
import random
import re
import subprocess
import tarfile
from collections.abc import Sequence
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
WIDEST = 100  # degrees; wider outlines (Russia, Antarctica) are torn by the projection


@cache
def package(name: str) -> Path:
    """Folder of an unpacked npm package of PACKAGES; fetched at the first use.

    Raises:
        subprocess.CalledProcessError, FileNotFoundError: npm is missing or cannot reach its registry.
    """
    folder = CACHE / name
    if not (folder / "package" / "package.json").exists():
        folder.mkdir(parents=True, exist_ok=True)
        command = ["npm", "pack", "--silent", "--pack-destination", str(folder), PACKAGES[name]]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        with tarfile.open(folder / done.stdout.strip()) as archive:
            archive.extractall(folder, filter="data")
    return folder / "package"


def icons() -> dict[str, Path]:
    """SVG files of the solid icons by name."""
    return {path.stem: path for path in sorted((package("icons") / "svgs" / "solid").glob("*.svg"))}


def icon(name: str) -> Curve:
    """The largest outline of an icon; InputError where it is no domain."""
    return files.read(str(icons()[name])).curve


@cache
def countries(scale: str = "110m") -> dict[str, Curve]:
    """The largest outline of each country, longitudes shrunk by the cosine of its latitude.

    Args:
        scale: "110m", "50m" or "10m", how fine the atlas is.
    """
    text = (package("atlas") / f"countries-{scale}.json").read_text(encoding="utf-8")
    found = {name: max(rings, key=lambda r: abs(Curve(r).area)) for name, rings in rings_of(json.loads(text))}
    return {name: curve for name, ring in found.items() if (curve := _projected(ring)) is not None}


def rings_of(topology: dict) -> list[tuple[str, list[np.ndarray]]]:
    """Names and outer rings (longitude + i·latitude, in degrees) of the countries of a quantised TopoJSON file."""
    scale, shift = (np.array(topology["transform"][key]) for key in ("scale", "translate"))
    arcs = [
        (np.cumsum(np.array(arc), axis=0) * scale + shift) @ np.array([1, 1j]) for arc in topology["arcs"]
    ]
    out = []
    for shape in topology["objects"]["countries"]["geometries"]:
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
    # quantised outlines touch themselves: the largest of the parts they enclose is taken
    part = max(shapely.get_parts(shapely.Polygon(shrunk).buffer(0)), key=shapely.area, default=None)
    if part is None or part.area < 1:
        return None
    try:
        return Curve.domain(shapely.get_coordinates(part.exterior)[:-1] @ np.array([1, 1j]))
    except InputError:
        return None


def pick(choice: random.Random, scale: str = "110m") -> tuple[str, Curve]:
    """A random silhouette and its name."""
    atlas, drawn = countries(scale), icons()
    while True:
        if choice.random() < COUNTRIES:
            name = choice.choice(sorted(atlas))
            return name, atlas[name]
        name = choice.choice(sorted(drawn))
        try:
            return name, icon(name)
        except InputError:
            continue  # no domain: strokes only, or outlines that cross


def pairs(count: int, seed: int, scale: str = "110m") -> list[tuple[tuple[str, Curve], tuple[str, Curve]]]:
    """Random pairs of silhouettes, always the same for one seed."""
    choice = random.Random(seed)
    return [(pick(choice, scale), pick(choice, scale)) for _ in range(count)]


@cache
def drawings(name: str) -> list[str]:
    """The drawings of a package, as `file` or `file#id`, in order."""
    if name == "svgmaps":  # one drawing, a country by its id
        world = package(name) / "world.svg"
        return [f"{world}#{key}" for key in sorted(re.findall(r'id="(\w+)"', world.read_text("utf-8")))]
    return [str(path) for path in sorted((package(name) / DRAWINGS[name]).glob("*.svg"))]


def drawn_pairs(
    count: int, seed: int, refusals: list[str], packages: Sequence[str] = (*DRAWINGS, "svgmaps")
) -> list[tuple[files.Shape, files.Shape]]:
    """Random pairs of drawings of the packages alike, always the same for one seed; what no shape is read from is
    added to the refusals, and another drawing taken instead."""
    choice = random.Random(seed)
    return [
        (drawn_shape(choice, refusals, packages), drawn_shape(choice, refusals, packages))
        for _ in range(count)
    ]


def drawn_shape(choice: random.Random, refusals: list[str], packages: Sequence[str]) -> files.Shape:
    """The shape of a random drawing."""
    while True:
        spec = choice.choice(drawings(choice.choice(packages)))
        try:
            return files.read(spec)
        except InputError as error:
            refusals.append(str(error))


def label(shape: files.Shape) -> str:
    """A short name of a drawing."""
    path, _, part = shape.spec.partition("#")
    package = Path(path).relative_to(CACHE).parts[0]
    return f"{package}/{part or Path(path).stem}"


def sample(name: str) -> files.Shape:
    """A shape of the project's own, by its path below samples/."""
    return files.read(str(ROOT / "samples" / name))
