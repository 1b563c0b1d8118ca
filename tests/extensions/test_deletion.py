"""Each folder in `extensions` can be deleted: the base works without it and without its entry points."""

import os
import shutil
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ENTRY_POINTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
FOLDERS = sorted(path.parent.name for path in (ROOT / "extensions").glob("*/__init__.py"))
BASE_TESTS = (
    "tests/io/test_formats.py",
    "tests/io/test_extensions.py",
    "tests/io/meshes/test_mesh_format.py",
    "tests/io/isolated",
    "tests/cli/test_cli.py::test_info_lists_every_format",
)
WITHOUT_CHECKOUT = """import sys
sys.meta_path = [finder for finder in sys.meta_path if not finder.__module__.startswith("__editable__")]
"""
"""Otherwise modules that are missing in a copy would be found in the checkout, which is installed."""


@pytest.fixture
def tree(tmp_path):
    """`tree(name)` copies the package as installed, and its tests, without one of the extensions."""

    def without(name):
        for folder, place in {
            "iccm": "iccm",
            "io": "iccm/io",
            "cli": "iccm/cli",
            "extensions": "iccm/extensions",
            "tests": "tests",
        }.items():
            shutil.copytree(ROOT / folder, tmp_path / place)
        for name_of_file in ("docs", "samples"):
            shutil.copytree(ROOT / name_of_file, tmp_path / name_of_file)
        shutil.copy(ROOT / "pyproject.toml", tmp_path)
        for place in ("iccm/extensions", "tests/extensions"):
            shutil.rmtree(tmp_path / place / name)
        (tmp_path / "sitecustomize.py").write_text(WITHOUT_CHECKOUT)
        info = tmp_path / "iccm-0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: iccm\nVersion: 0\n")
        lines = []
        for group, points in ENTRY_POINTS.items():
            lines.append(f"[{group}]")
            lines += [f"{point} = {place}" for point, place in points.items() if not brings(name, place)]
        (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
        return tmp_path

    return without


def brings(name, place):
    """Whether an extension has the object that an entry point names."""
    return place.startswith(f"iccm.extensions.{name}:")


def run(tree, *arguments):
    environment = os.environ | {"PYTHONPATH": str(tree)}
    line = [sys.executable, "-m", *arguments]
    return subprocess.run(line, cwd=tree, env=environment, capture_output=True, text=True, timeout=100)


@pytest.mark.slow
@pytest.mark.parametrize("name", FOLDERS)
def test_the_base_works_without_an_extension(tree, name):
    folder = tree(name)
    names = [point for point, place in ENTRY_POINTS["iccm.formats"].items() if brings(name, place)]
    suffixes = [f".{point.rpartition('.')[2].replace('*', 'white')}" for point in names]
    missing = run(folder, f"iccm.extensions.{name}")
    assert (
        suffixes and missing.returncode == 1 and f"No module named iccm.extensions.{name}" in missing.stderr
    )
    listed = run(folder, "iccm", "info", "--formats")
    rows = {line.split()[0].removeprefix(".") for line in listed.stdout.splitlines() if line}
    assert listed.returncode == 0 and "png" in rows and not rows & {*names}
    assert run(folder, "iccm", "--help").returncode == 0
    shapes = [f"tests/wheel/{shape}.svg" for shape in ("square", "blob")]
    done = run(folder, "iccm", "map", *shapes, "--size", "32", "-o", "out.png")
    assert done.returncode == 0 and (folder / "out.png").exists(), done.stderr
    for suffix in suffixes:
        (folder / f"a{suffix}").write_bytes(b"anything")
        refused = run(folder, "iccm", "flatten", f"a{suffix}", "-o", "a.svg")
        assert refused.returncode == 2 and refused.stderr.count("\n") == 1 and suffix in refused.stderr
    tests = run(folder, "pytest", "-q", "-m", "not slow", "-p", "no:cacheprovider", *BASE_TESTS)
    assert tests.returncode == 0, tests.stdout


def test_the_base_imports_no_extension():
    """Absolutely or relatively, also inside functions."""
    from tests.test_layers import graph_of_iccm

    for module, targets in graph_of_iccm().items():
        if not module.startswith("extensions"):
            assert not [target for target in targets if target.startswith("extensions.")], module


def test_the_installed_entry_points_are_those_of_the_project():
    """Otherwise the checkout is to be installed again."""
    installed = {
        (point.group, point.name): point.value for point in metadata.distribution("iccm").entry_points
    }
    for group, points in ENTRY_POINTS.items():
        assert (
            points.items()
            <= {name: value for (of_group, name), value in installed.items() if of_group == group}.items()
        ), "run make test, which installs iccm again"


def test_each_folder_has_an_entry_point():
    places = [place for points in ENTRY_POINTS.values() for place in points.values()]
    assert {place.removeprefix("iccm.extensions.").partition(":")[0] for place in places} == {*FOLDERS}
