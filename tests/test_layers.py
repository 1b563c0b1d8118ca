"""Which modules may import which, and the cost of imports.

ORDER lists the layers from top to bottom: a module may import those below it, also inside
functions, and there are no circular imports. Modules of `io` that it does not list, such as those of a
single command, are in the layer `io`, so that only `cli` may import them.
"""

import ast
import functools
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.scripts import script

ROOT = Path(__file__).parents[1]
MODULES = script("docs/modules.py")
ORDER = (
    "extensions",
    "cli __main__",
    "io",
    "io.edit",
    "io.check io.standardize",
    "io.batch",
    "io.fields io.cartogram",
    "io.apply io.compose io.itk_files",
    "io.run",
    "io.artwork",
    "io.materials",
    "io.shapes",
    "io.geometry",
    "io.meshes",
    "io.outlines",
    "io.pictures",
    "io.svg",
    "io.memory io.quiet_stderr io.checked",
    "io.isolated",
    "io.options io.option_groups io.figure_table io.page io.spec io.formats io.point_syntax io.references io.values",
    "io.extensions io.extras io.files io.lengths io.limits io.projections",
    "texture_transfer",
    "solve cartograms",
    "projection",
    "frames",
    "surfaces",
    "flattening",
    "conformal",
    "balanced",
    "paper",
    "problem result figures fit_data fit_files coverage status given capabilities options",
    "saved",
    "drawings",
    "meshes",
    "pixels",
    "maps",
    "pins",
    "procrustes",
    "symmetry",
    "curve linalg polygons",
    "buckets plane transform axes",
    "sorting",
    "arrays native",
    "parallel memory blas progress fits",
    "deadline",
    "errors limits",
)
FLOOR = {room: number for number, rooms in enumerate(ORDER) for room in rooms.split()}
HEAVY = ("click", "OpenImageIO", "trimesh", "pydantic", "matplotlib", "svgelements")
TEXTURE = "samples/rose-leaf/petals.jpg"


def name_of(path: Path) -> str:
    """The module of a file, without the leading `iccm.`; for a package's `__init__.py` the package."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    parts = parts[1:] if parts[0] == "iccm" else parts
    return ".".join(parts).removesuffix("__init__").rstrip(".")


FILES = {
    name_of(path): path
    for part in ("iccm", "io", "cli", "extensions")
    for path in (ROOT / part).rglob("*.py")
}


def room_of(module: str) -> str:
    """The layer of a module: itself, or its folder."""
    parts = module.split(".")
    return next((".".join(parts[:k]) for k in (2, 1) if ".".join(parts[:k]) in FLOOR), module)


def targets(module: str, package: bool, node: ast.AST, modules=FILES) -> set[str]:
    """The modules of this package that an import statement imports."""
    if isinstance(node, ast.Import):
        dotted = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom):
        package_path = ["iccm", *(part for part in module.split(".") if part)]
        base = package_path[: len(package_path) - node.level + package] if node.level else []
        dotted = [".".join([*base, *filter(None, [node.module]), alias.name]) for alias in node.names]
    else:
        return set()
    relative_names = {
        name.removeprefix("iccm").lstrip(".") for name in dotted if name.split(".")[0] == "iccm"
    }
    return {name if name in modules else name.rpartition(".")[0] for name in relative_names}


def imports(module: str) -> set[str]:
    path = FILES[module]
    tree = ast.parse(path.read_text(encoding="utf-8"))
    all_targets = (targets(module, path.name == "__init__.py", node) for node in ast.walk(tree))
    return set().union(*all_targets) - {module}


@functools.cache
def graph_of_iccm() -> dict[str, set[str]]:
    """The imports of each module; parsing them all takes seconds, which workers without these tests save."""
    return {module: imports(module) for module in FILES}


def backwards(graph: dict[str, set[str]]) -> list[tuple[str, str]]:
    """Upward imports, except those of the package itself (documentation and lazy names)."""
    pairs = [(a, b) for a, reached in graph.items() for b in reached if room_of(a) in FLOOR]
    return [(a, b) for a, b in pairs if b in FLOOR or room_of(b) in FLOOR if floor(a) > floor(b)]


def floor(module: str) -> int:
    return FLOOR[room_of(module)]


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """Sets of modules that import each other."""
    reach = {module: reached(graph, module) for module in graph}
    return [{a, b} for a in graph for b in reach[a] if a < b and a in reach.get(b, ())]


def reached(graph: dict[str, set[str]], start: str) -> set[str]:
    seen: set[str] = set()
    left = [start]
    while left:
        new = graph.get(left.pop(), set()) - seen
        seen |= new
        left += new
    return seen


def test_every_module_is_in_a_room():
    rooms = {room_of(module) for module in FILES if module not in ("", "io")}
    assert rooms <= set(FLOOR), rooms - set(FLOOR)


@pytest.mark.slow
def test_imports_run_one_way():
    assert not backwards(graph_of_iccm())


def test_nothing_imports_in_a_circle():
    assert not circles(graph_of_iccm())


def parts_of(folder: str) -> dict[str, set[str]]:
    """The modules and folders in a folder, each as one node, with those that it imports."""

    def part(module: str) -> str | None:
        start = f"{folder}." if folder else ""
        return start + module[len(start) :].split(".")[0] if module.startswith(start) and module else None

    graph: dict[str, set[str]] = {}
    for module, reached in graph_of_iccm().items():
        if module_part := part(module):
            graph.setdefault(module_part, set()).update({p for p in map(part, reached) if p} - {module_part})
    return graph


@pytest.mark.parametrize("folder", sorted({name.rpartition(".")[0] for name in FILES}))
def test_no_arrow_runs_back_up_between_the_parts_of_a_folder(folder):
    assert not circles(parts_of(folder))


FOLDERS = sorted(name for name, path in FILES.items() if path.name == "__init__.py")


def listed(docstring: str) -> list[str]:
    """The modules and folders (`name/`) listed in a docstring: names, two or more spaces, and a description."""
    rows = re.findall(r"^(\w+/?(?:, \w+/?)*) {2,}\S", docstring, re.MULTILINE)
    return [name for names in rows for name in names.split(", ")]


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_folder_lists_its_contents(folder):
    names = {name for name in FILES if name and name.rpartition(".")[0] == folder}
    modules = {name.rpartition(".")[2] + "/" * (name in FOLDERS) for name in names}
    docstring = ast.get_docstring(ast.parse(FILES[folder].read_text(encoding="utf-8")))
    assert sorted(listed(docstring)) == sorted(modules), "run make generated"


def test_a_new_module_is_added_to_the_list_and_a_removed_one_leaves_it(tmp_path):
    before = '"""Fruit.\n\npear   sweet and soft\nplum   blue\nnuts/  hard\n"""\n\nROOT = 1\n'
    (tmp_path / "__init__.py").write_text(before)
    (tmp_path / "pear.py").write_text('"""Pears."""\n')
    (tmp_path / "quince.py").write_text('"""The fruit that is cooked. It is hard.\n"""\n')
    (tmp_path / "nuts").mkdir()
    (tmp_path / "nuts/__init__.py").write_text("")
    after = MODULES.completed(before, MODULES.modules_in(tmp_path))
    assert after == (
        '"""Fruit.\n\npear   sweet and soft\nnuts/  hard\nquince  the fruit that is cooked\n"""\n\nROOT = 1\n'
    )


@pytest.mark.parametrize(
    ("module", "code", "expected"),
    [
        ("maps.inverse", "from ..io import files", {"io.files"}),
        ("solve", "from . import cli", {"cli"}),
        ("solve", "import iccm.io.files", {"io.files"}),
        ("io.run.job", "def f():\n    from ...cli import logs", {"cli.logs"}),
        ("io.files", "from iccm import curve", {"curve"}),
        (
            "io.svg.reader",
            "from . import tree\nfrom ...errors import InputError\nimport io",
            {"io.svg.tree", "errors"},
        ),
    ],
)
def test_the_scan_sees_an_import(module, code, expected):
    assert set().union(*(targets(module, False, node) for node in ast.walk(ast.parse(code)))) == expected


def test_the_scan_sees_arrows_that_run_back_and_circles():
    graph = {"curve": {"maps.inverse"}, "maps.inverse": {"curve"}}
    assert backwards(graph) == [("curve", "maps.inverse")]
    assert circles(graph) == [{"curve", "maps.inverse"}]


def loaded(statement: str) -> set[str]:
    code = f"{statement}\nimport sys; print(*sorted(sys.modules))"
    return set(
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.split()
    )


@pytest.mark.slow
def test_the_core_leaves_the_outer_libraries_alone():
    """Except for the figure, which is imported when needed."""
    names = sorted(
        name
        for name in FILES
        if name not in ("", "__main__", "maps.figure")
        and name.split(".")[0] not in ("io", "cli", "extensions")
    )
    modules = loaded("import " + ", ".join(f"iccm.{name}" for name in names))
    assert "iccm.maps.cauchy_green" in modules
    assert not modules.intersection(HEAVY)
    assert not {name for name in modules if name.startswith(("iccm.cli", "iccm.io", "iccm.extensions"))}


def test_help_imports_no_command_and_no_numerics():
    modules = loaded("from iccm import cli\ncli.run(['--help'])")
    assert "click" in modules
    assert not modules.intersection({"numpy", "scipy", "pydantic", "iccm.cli.map", *HEAVY} - {"click"})


def test_help_of_a_command_imports_no_numerics():
    modules = loaded("from iccm import cli\ncli.run(['map', '--help'])")
    assert "iccm.cli.map" in modules
    assert not modules.intersection({"numpy", "scipy", *HEAVY} - {"click"})


def test_import_iccm_is_free():
    assert not loaded("import iccm").intersection({"numpy", "scipy", *HEAVY})


@pytest.mark.parametrize("method", ["conformal", "paper"])
def test_a_method_is_entered_by_its_package(method):
    """Modules outside of it import the package, not its modules."""
    entered = {
        module: {target for target in graph_of_iccm()[module] if target.startswith(f"{method}.")}
        for module in FILES
        if module and room_of(module) != method
    }
    assert {module: targets for module, targets in entered.items() if targets} == {}


NOT_FOR_A_PICTURE = {
    *("scipy.sparse", "scipy.optimize", "scipy.ndimage", "scipy.spatial", "scipy.interpolate", "skimage"),
    *("igl", "cv2", "trimesh", "cssselect2"),
    *("matplotlib", "PIL", "networkx", "iccm.paper.algorithm1", "iccm.conformal.method", "iccm.io.batch"),
}


@pytest.mark.slow
def test_a_picture_by_the_default_method_imports_only_what_it_needs(tmp_path):
    picture, shapes = tmp_path / "out.png", ROOT / "tests" / "wheel"
    job = ["map", shapes / "square.svg", shapes / "blob.svg", "--texture", shapes.parents[1] / TEXTURE]
    line = [*map(str, job), "--size", "32", "-q", "-o", str(picture)]
    modules = loaded(f"from iccm import cli\nassert cli.run({line!r}) == 0")
    assert picture.exists()
    assert "iccm.balanced.method" in modules
    assert not modules & NOT_FOR_A_PICTURE
