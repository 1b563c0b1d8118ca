"""What may import what, and what an import costs."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BELOW = {"iccm": {"iccm"}, "io": {"iccm", "io"}, "cli": {"iccm", "io", "cli"}}
HEAVY = ("click", "OpenImageIO", "trimesh", "pydantic", "matplotlib", "svgelements")


def layer_of(folder: str, node: ast.Import | ast.ImportFrom) -> set[str]:
    """The layers of this package that an import statement in `folder` reaches."""
    if isinstance(node, ast.Import):
        absolute = [alias.name.split(".") for alias in node.names]
    elif node.level == 0:
        absolute = [[*(node.module or "").split("."), alias.name] for alias in node.names]
    else:
        here = ["iccm"] if folder == "iccm" else ["iccm", *folder.split("/")]
        base = here[: len(here) - node.level + 1]
        absolute = [[*base, *(node.module or "").split("."), alias.name] for alias in node.names]
    names = [[part for part in parts if part] for parts in absolute]
    return {parts[1] if parts[1:2] and parts[1] in BELOW else "iccm" for parts in names if parts[0] == "iccm"}


def upward(folder: str, code: str) -> set[str]:
    """The layers above `folder` that this code imports."""
    imports = [node for node in ast.walk(ast.parse(code)) if isinstance(node, ast.Import | ast.ImportFrom)]
    return set().union(*(layer_of(folder, node) for node in imports)) - BELOW[folder.split("/")[0]]


@pytest.mark.parametrize("folder", BELOW)
def test_imports_never_go_upwards(folder):
    found = {
        str(path): upward(path.parent.relative_to(ROOT).as_posix(), path.read_text())
        for path in (ROOT / folder).rglob("*.py")
    }
    assert found and not {path: layers for path, layers in found.items() if layers}


@pytest.mark.parametrize(
    ("folder", "code", "layers"),
    [
        ("iccm", "from .io import files", {"io"}),
        ("iccm", "from . import cli", {"cli"}),
        ("iccm", "import iccm.io.files", {"io"}),
        ("io", "from ..cli import logs", {"cli"}),
        ("io", "from .. import cli", {"cli"}),
        ("io", "from iccm import cli", {"cli"}),
        ("io", "from . import files\nfrom ..errors import InputError\nimport io", set()),
        ("cli", "from ..io import files\nfrom . import logs", set()),
        ("io/artwork", "from .. import files\nfrom ... import errors\nfrom . import trim", set()),
        ("io/artwork", "from ...cli import logs", {"cli"}),
    ],
)
def test_the_scan_sees_an_upward_import(folder, code, layers):
    assert upward(folder, code) == layers


def loaded(statement: str) -> set[str]:
    code = f"{statement}\nimport sys; print(*sorted(sys.modules))"
    return set(
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.split()
    )


def test_the_core_leaves_the_outer_libraries_alone():
    names = sorted(path.stem for path in (ROOT / "iccm").glob("*.py") if path.stem != "__init__")
    modules = loaded("import " + ", ".join(f"iccm.{name}" for name in names))
    assert "iccm.cauchy" in modules
    assert not modules.intersection(HEAVY)
    assert not {name for name in modules if name.startswith(("iccm.cli", "iccm.io"))}


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
