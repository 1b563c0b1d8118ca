"""Write lists that follow from tables of the code into files that cannot read them: python docs/lists.py

These are the values of `--fit` in the menus of `iccm edit` and of the plug-ins, the commands in the README, the mesh
formats in the reference, what is kept of files of other programs, and the extras on the page on installation.
"""

import ast
import re
from collections.abc import Callable
from html import escape
from pathlib import Path

from iccm.cli import COMMANDS
from iccm.fits import FITS, FitMode
from iccm.io.extras import PURPOSES
from iccm.io.formats import FORMATS

ROOT = Path(__file__).resolve().parent.parent


def menu_of_page(fits: dict[str, FitMode] = FITS) -> str:
    """Return the options of the menu on the page, with the sentence that is shown below it."""
    return "".join(
        f'        <option value="{name}" data-hint="{escape(mode.help)}">{_line(mode)}</option>\n'
        for name, mode in fits.items()
    )


def menu_of_inkscape(fits: dict[str, FitMode] = FITS) -> str:
    """Return the options of the menu in Inkscape's dialog."""
    return "".join(f'        <option value="{name}">{_line(mode)}</option>\n' for name, mode in fits.items())


def menu_of_blender(fits: dict[str, FitMode] = FITS) -> str:
    """Return the items of the menu in Blender: value, title and description; islands have no frames."""
    return "".join(
        f'    ("{name}", "{mode.title.title()}", "{mode.summary.capitalize()}"),\n'
        for name, mode in fits.items()
        if not mode.of_drawings
    )


def _line(mode: FitMode) -> str:
    return escape(f"{mode.title}: {mode.summary}")


def commands() -> str:
    """Return the rows of the README's table of commands."""
    return "".join(f"| `iccm {name}` | {text[0].lower()}{text[1:-1]} |\n" for name, text in COMMANDS.items())


def mesh_formats(*, written: bool) -> str:
    """Return the suffixes of the mesh formats that are written with texture coordinates, or of the others."""
    suffixes = [suffix for suffix, row in FORMATS.items() if row.mesh and row.uv == written]
    return ", ".join(f"`{suffix}`" for suffix in suffixes) + ".\n"


def extras() -> str:
    """Return the rows of the table of extras."""
    return "".join(f"| `pip install '.[{name}]'` | {purpose} |\n" for name, purpose in PURPOSES.items())


OTHER_PROGRAMS = {
    "svg": ("Inkscape, Illustrator, Affinity, Figma", "`.svg` as a target"),
    "dxf": ("CAD, cutters", "lines of `.svg` as `.dxf`, and back"),
    "units": ("Blender, modelers", "`.glb` `.usd` `.3mf`, flattened as `.svg` `.dxf`"),
    "plain": ("modelers", "`.obj` `.stl` `.ply`, flattened"),
    "tables": ("QuPath, TrackMate, CellProfiler, napari, scikit-image, QGIS, Excel", "`.csv` `.tsv`"),
    "gdal": ("GDAL, QGIS", "GeoTIFF"),
    "imagej": ("ImageJ, Fiji", "`.tif`"),
    "ome": ("OME writers", "`.ome.tif`"),
    "labels": ("Cellpose, ilastik, QuPath", "labels in `.tif` `.png`"),
    "geojson": ("QuPath, mapshaper, tippecanoe", "bare lists, TopoJSON, lines of GeoJSON"),
    "gis": ("QGIS, ArcGIS, Google Earth", "`.gpkg#layer` `.shp` `.kml` `.fgb`"),
}
"""Programs and files, by the names that the marks `keeps` and `loses` of tests give them."""


def files_of_programs() -> str:
    """Return the rows of the table of what is kept and lost of files of other programs, from the marks of tests."""
    stated: dict[tuple[str, str], dict[str, None]] = {}
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        if "pytest.mark.keeps(" not in text and "pytest.mark.loses(" not in text:
            continue
        for node in ast.walk(ast.parse(text)):
            for mark in node.decorator_list if isinstance(node, ast.FunctionDef) else []:
                kind = ast.unparse(mark.func).rpartition(".")[2] if isinstance(mark, ast.Call) else ""
                if kind in ("keeps", "loses"):
                    files, *what = [ast.literal_eval(argument) for argument in mark.args]
                    stated.setdefault((files, kind), {}).update(dict.fromkeys(what))
    if unknown := {files for files, _ in stated} - {*OTHER_PROGRAMS}:
        raise ValueError(f"{min(unknown)}: is marked in a test, but not in OTHER_PROGRAMS")
    cells = {
        key: ["; ".join(stated.get((key, kind), {})) for kind in ("keeps", "loses")] for key in OTHER_PROGRAMS
    }
    return "".join(f"| {' | '.join([*columns, *cells[key]])} |\n" for key, columns in OTHER_PROGRAMS.items())


LISTS: list[tuple[str, str, str, Callable[[], str]]] = [
    (
        "io/edit/page/index.html",
        '<select id="how" aria-describedby="how-hint">\n',
        "      </select>",
        menu_of_page,
    ),
    (
        "plugins/inkscape/iccm_fit.inx",
        '<param name="fit" type="optiongroup" appearance="combo" gui-text="Fit:">\n',
        "    </param>",
        menu_of_inkscape,
    ),
    ("plugins/blender/__init__.py", "FITS = [\n", "]", menu_of_blender),
    ("README.md", "| command | purpose |\n|---|---|\n", "\n", commands),
    (
        "docs/reference/shapes.md",
        "Meshes in these formats are read, and written with new texture coordinates:\n",
        "\n",
        lambda: mesh_formats(written=True),
    ),
    (
        "docs/reference/shapes.md",
        "Meshes in these formats are only read:\n",
        "\n",
        lambda: mesh_formats(written=False),
    ),
    (
        "docs/reference/formats.md",
        "| program | file | kept | lost |\n|---|---|---|---|\n",
        "\n",
        files_of_programs,
    ),
    ("docs/start.md", "| extra | adds |\n|---|---|\n", "\n", extras),
]
"""For each list: its file, the line before it, the line after it, and the function that writes it."""


def with_list(text: str, before: str, after: str, items: str) -> str:
    """Return the text of a file with a list replaced.

    Raises:
        ValueError: the lines around the list are not in the text.
    """
    pattern = re.compile(f"({re.escape(before)}).*?(^{re.escape(after)})", re.DOTALL | re.MULTILINE)
    replaced, count = pattern.subn(lambda match: match[1] + items + match[2], text)
    if count != 1:
        raise ValueError(f"{before.strip()}: {count} lists begin with this line; there must be one")
    return replaced


def files() -> dict[Path, str]:
    """Return the text of each file with its lists as they should be."""
    texts = {ROOT / name: (ROOT / name).read_text(encoding="utf-8") for name, *_ in LISTS}
    for name, before, after, items in LISTS:
        texts[ROOT / name] = with_list(texts[ROOT / name], before, after, items())
    return texts


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
