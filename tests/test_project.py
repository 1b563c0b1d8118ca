"""The project itself: types are really checked, versions agree, nothing large is tracked."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import iccm

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def staged(folder: Path) -> Path:
    """A copy of the package as it is installed, of its smallest modules, for mypy."""
    package = folder / "iccm"
    for name in (
        "iccm/__init__.py",
        "iccm/errors.py",
        "iccm/py.typed",
        "io/__init__.py",
        "io/files.py",
        "cli/__init__.py",
    ):
        part, _, file = name.partition("/")
        home = package if part == "iccm" else package / part
        home.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, home / file)
    for name in ("logs.py", "failures.py", "stopping.py", "streams.py"):
        shutil.copy(ROOT / "cli" / name, package / "cli" / name)
    return package


def test_mypy_sees_an_error_in_every_layer(tmp_path):
    """From the repository's root it would see a part of the tree only, and report success."""
    package = staged(tmp_path)
    command = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml"), "-p", "iccm"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True).returncode == 0
    for name in ("errors.py", "io/files.py", "cli/failures.py"):
        original = (package / name).read_text()
        (package / name).write_text(original + "\nplanted: int = 'text'\n")
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 1 and f"{name}:" in done.stdout and "planted" not in original
        (package / name).write_text(original)


def test_the_lint_target_checks_the_staged_tree():
    recipe = (ROOT / "Makefile").read_text().partition("\nlint:")[2].partition("\n\n")[0]
    for part in (
        "cp -R iccm build/typecheck/iccm",
        "cp -R cli io build/typecheck/iccm",
        "cd build/typecheck &&",
        "-p iccm",
    ):
        assert part in recipe


def test_packages_are_mapped_to_the_folders():
    given = PROJECT["tool"]["setuptools"]["package-dir"]
    assert {given[name] for name in ("iccm", "iccm.cli", "iccm.io")} == {"iccm", "cli", "io"}
    code = [path for folder in ("iccm", "io", "cli") for path in (ROOT / folder).rglob("*.py")]
    folders = {path.parent.relative_to(ROOT).as_posix() for path in code}
    mapping = {"iccm." + f.replace("/", ".").removeprefix("iccm.") if f != "iccm" else f: f for f in folders}
    assert sorted(PROJECT["tool"]["setuptools"]["packages"]) == sorted(mapping)
    for name, folder in mapping.items():
        module = __import__(name, fromlist=["x"])
        assert Path(module.__file__).parent == ROOT / folder
    assert re.fullmatch(r"\d+\.\d+\.\d+", iccm.__version__)


def test_ci_calls_the_test_command_of_the_readme():
    assert "make test" in (ROOT / "README.md").read_text()
    lines = (ROOT / ".ci" / "run").read_text().splitlines()
    assert "make test" in lines and (ROOT / ".ci" / "run").stat().st_mode & 0o111


def test_every_dependency_has_a_tested_lower_bound():
    extras = PROJECT["project"]["optional-dependencies"].values()
    listed = [*PROJECT["project"]["dependencies"], *(name for extra in extras for name in extra)]
    assert listed and all(re.fullmatch(r"[\w.-]+>=\d[\d.]*", name) for name in listed)
    assert (ROOT / "iccm" / "py.typed").exists()


def test_nothing_large_is_tracked():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a git checkout")
    sizes = {
        name: (ROOT / name).stat().st_size for name in listed.stdout.split("\0") if (ROOT / name).is_file()
    }
    assert sizes and max(sizes.values()) <= 2_000_000
