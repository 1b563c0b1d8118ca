"""Write lists that follow from tables of the code into files that cannot read them: python docs/lists.py

These are the values of `--fit` in the menus of `iccm edit` and of the plug-ins, the commands in the README, the mesh
formats in the reference, what is kept of files of other programs, the extras on the page on installation, the
limits on inputs, the figures of reports with their JSON schemas, and the constants of the solver that the demo's search
shares.
"""

import ast
import importlib
import json
import re
from collections.abc import Callable
from functools import partial
from html import escape
from itertools import pairwise
from pathlib import Path

from iccm.cli import COMMANDS
from iccm.fits import FITS, FitMode
from iccm.io import formats
from iccm.io.extensions import extras as every_extra
from iccm.io.figure_table import REPORTS, page_rows, schema_of

ROOT = Path(__file__).resolve().parent.parent


def menu_of_page(fits: dict[str, FitMode] = FITS) -> str:
    """Return the buttons of the dialog on the page; the page fills in the picture and figures of each."""
    return "".join(
        f'      <button type="button" data-fit="{name}"><span class="picture"></span>'
        f'<span class="names">{mode.title}</span><span class="hint">{escape(mode.help)}</span>'
        '<span class="figures"></span></button>\n'
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
    suffixes = [suffix for suffix, row in formats.every().items() if row.mesh and row.uv == written]
    return ", ".join(f"`{suffix}`" for suffix in suffixes) + ".\n"


def extras() -> str:
    """Return the rows of the table of extras."""
    return "".join(f"| `pip install '.[{extra.name}]'` | {extra.purpose} |\n" for extra in every_extra())


OTHER_PROGRAMS = {
    "svg": ("Inkscape, Illustrator, Affinity, Figma", "`.svg` as a target"),
    "inkstitch": ("Ink/Stitch", "`.svg`"),
    "dxf": ("CAD, cutters", "lines of `.svg` as `.dxf`, and back"),
    "units": ("Blender, modelers", "`.glb` `.usd` `.3mf`, flattened as `.svg` `.dxf`"),
    "plain": ("modelers", "`.obj` `.stl` `.ply`, flattened"),
    "tables": ("QuPath, TrackMate, CellProfiler, napari, scikit-image, QGIS, Excel", "`.csv` `.tsv`"),
    "gdal": ("GDAL, QGIS", "GeoTIFF"),
    "imagej": ("ImageJ, Fiji", "`.tif`"),
    "ome": ("OME writers", "`.ome.tif`"),
    "labels": ("Cellpose, ilastik, QuPath", "labels in `.tif` `.png`"),
    "geojson": ("QuPath, mapshaper, tippecanoe", "lists of features, TopoJSON, one feature per line"),
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


IN_SCHEMA_ONLY = ("Rigid regions", "Meshes", "Pictures")
"""Sections of the report's schema that few readers look up, which the page leaves out."""
FIGURE_HEADER = "| key | unit | meaning |\n|---|---|---|\n"


def limits() -> str:
    """Return the rows of the table of limits: the constants of both modules with their descriptions."""
    rows = ""
    for path in (ROOT / "io" / "limits.py", ROOT / "iccm" / "limits.py"):
        statements = ast.parse(path.read_text(encoding="utf-8")).body
        module = importlib.import_module(f"iccm.{'io.' * (path.parent.name == 'io')}limits")
        for statement, description in pairwise(statements):
            if isinstance(statement, ast.Assign):
                names = [name.id for name in ast.walk(statement.targets[0]) if isinstance(name, ast.Name)]
                values = ", ".join(_amount(name, getattr(module, name)) for name in names)
                meaning = " ".join(ast.literal_eval(description.value).split()).rstrip(".")
                rows += f"| {meaning.replace('<', '&lt;')} | {values} |\n"
    return rows


def _amount(name: str, value: float) -> str:
    """Return a limit with its unit, if its name has one."""
    if name.endswith("BYTES"):
        for shift, unit in ((30, "GiB"), (20, "MiB"), (10, "KiB")):
            if value >= 1 << shift:
                return f"{int(value) >> shift} {unit}"
        return f"{value} bytes"
    unit = " s" if name.endswith("SECONDS") else ""
    return (f"{value:g}" if isinstance(value, float) or value >= 1e15 else f"{value:,}") + unit


def figures(report: str, section: str) -> str:
    """Return the rows of the figures in a section of a kind of report."""
    return page_rows(REPORTS[report].sections[section])


LISTS: list[tuple[str, str, str, Callable[[], str]]] = [
    (
        "io/edit/page/index.html",
        '<div id="fits-shown">\n',
        "    </div>",
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
    ("docs/limitations.md", "| quantity | limit |\n|---|---|\n", "\n", limits),
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
    *(
        (
            "docs/reference/report.md",
            f"## {section}\n\n{FIGURE_HEADER}",
            "\n",
            partial(figures, "report", section),
        )
        for section in REPORTS["report"].sections
        if section not in IN_SCHEMA_ONLY
    ),
    ("docs/start.md", "| extra | adds |\n|---|---|\n", "\n", extras),
]
"""For each list: its file, the line before it, the line after it, and the function that writes it."""


WEB_CONSTANTS = {
    "linalg.fronts": "LEAST_FRONT_VERTICES MOST_ZEROS_SHARE",
    "linalg.ordering": "FIRST_ENTRIES_PER_VERTEX",
    "pins": "MOST_TOLERANCES RADIUS_OUTLINE_DISTANCES RADIUS_PIN_DISTANCES RADIUS_SHARE TOLERANCE_SHARE",
    "balanced.constraints.soft": "COST_AT_TOLERANCE STIFFNESS",
    "balanced.minimise.energy": "BOTH_AREAS",
    "balanced.minimise.sliding": "HELD OUTLINE_WEIGHT SLIDING",
    "balanced.minimise.soft_pins": "CORE_MARGIN_RATIO CORE_SHARE FEWEST_CORE_VERTICES LARGEST_CORE_RADIUS "
    "WORST_CONDITION_NUMBER",
    "balanced.minimise.unfold": "BARE RINGS STEPS=LOCAL_STEPS POLISHING=LOCAL_POLISHING",
    "balanced.minimise.untangle": "DEEP ENOUGH LEAST_EPSILON LEAST_WEIGHT PACE POLISHED SHRINK SLOW "
    "STEPS=UNTANGLE_STEPS",
    "balanced.model.boundary_pairs": "BOTH MERGED_SPACING_SHARE SOURCE TARGET",
    "balanced.model.discrete_map": "BADLY_STRETCHED EASED EASING_STEPS FORWARD GOOD_ENOUGH SETTLED SMOOTHED_RINGS "
    "SMOOTHINGS LOCAL=LOCAL_SHARE",
    "balanced.model.energy": "UPRIGHT",
    "balanced.model.mesh_sizes": "GRID_CELLS_ACROSS MOST_FINER_AT_PINS MOST_MAGNIFIED MOST_MORE_AT_PINS "
    "TRIANGLES_A_RADIUS",
    "balanced.model.outline": "SHARP_CORNER_RADIANS",
    "balanced.model.outline_split": "SAME_PLACE_SHARE SNAPPED_EDGE_SHARE",
    "balanced.search.candidates": "ALIKE CLOSE FINALISTS PROMISING_ENERGY_RATIO RELEASE_GAIN_SHARE RELEASE_ROUNDS "
    "ROUNDS SCREENING SETTLING",
    "balanced.search.final_mesh": "AIMED_LIMITS BLOCKED_ENERGY BLOCKED_MISS FINE_EXACTNESS LAST_DECREASE "
    "LAST_DECREASE_WITH_PINS LAST_ROUNDS LAST_STEPS MOST_STIFFENED NARROW_AIM STEEPEST_FINE STIFFENINGS "
    "TRIANGLES_PER_AREA",
    "balanced.search.initial_matches": "ANY_TURN ARCLENGTH_SHIFTS CYCLIC_SHIFTS DIFFERENT_MATCH_DISTANCE MOST_TURNED "
    "OUTLINE_SAMPLES POSITION_WEIGHT TANGENT_CHORD_SHARE TURNS STEPS=MATCH_STEPS",
    "balanced.search.levels": "BACKWARD_STEPS FINE_BACKWARD FINE_POWER FINE_ROUNDS MOST_PAIRS MOST_START_VERTICES "
    "PATIENT_STEPS RELEASED_STEPS SPACING_MESH_SIZES",
    "balanced.search.multilevel": "COARSE_EXACTNESS COARSE_MESH_SIZE COARSE_SIZE_BY_LENGTH FINE_MESH_SIZE STEEPEST",
    "balanced.search.pin_continuation": "TURNED_STARTS",
    "balanced.search.unit_problem": "FINAL_TRIANGLES",
    "io.edit.map_choice": "AGREED_DIAGONAL_SHARE MOST_POINTS_SHARE",
    "io.edit.session": "STILL_SHARE",
}
"""By module of iccm: the constants that the demo's search shares, where needed with another name there."""


def web_constants() -> str:
    """Return the text of the demo's module of constants."""
    lines = [
        "// Constants that the search shares with iccm, where they are explained. Written by `make generated`."
    ]
    for module, names in WEB_CONSTANTS.items():
        lines += ["", f"// iccm.{module}"]
        values = vars(importlib.import_module(f"iccm.{module}"))
        for name in names.split():
            python_name, _, web_name = name.partition("=")
            value = json.dumps(values[python_name], default=lambda array: array.tolist())
            lines.append(f"export const {web_name or python_name} = {value};")
    return "\n".join(lines) + "\n"


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
    texts[ROOT / "web" / "constants.js"] = web_constants()
    for name in REPORTS:
        schema = json.dumps(schema_of(name), indent=1, ensure_ascii=False)
        texts[ROOT / "docs" / "reference" / "schemas" / f"iccm.{name}-1.json"] = f"{schema}\n"
    return texts


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
