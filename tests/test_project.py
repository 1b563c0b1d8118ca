"""The project itself: types are really checked, versions agree, no large files are tracked."""

import ast
import importlib
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import iccm
import iccm.io.run

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def staged(folder: Path) -> Path:
    """A copy of the smallest modules of the package as installed, for mypy."""
    package = folder / "iccm"
    for name in (
        "iccm/__init__.py",
        "iccm/deadline.py",
        "iccm/errors.py",
        "iccm/progress.py",
        "iccm/py.typed",
        "io/__init__.py",
        "io/extensions.py",
        "io/files.py",
        "io/limits.py",
        "cli/__init__.py",
    ):
        part, _, file = name.partition("/")
        home = package if part == "iccm" else package / part
        home.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, home / file)
    for name in ("logs.py", "process.py"):
        shutil.copy(ROOT / "cli" / name, package / "cli" / name)
    return package


@pytest.mark.slow
def test_mypy_sees_an_error_in_every_layer(tmp_path):
    """From the repository's root it would only check a part of the tree, and report success."""
    package = staged(tmp_path)
    command = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml"), "-p", "iccm"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True).returncode == 0
    for name in ("errors.py", "io/files.py", "cli/logs.py"):
        original = (package / name).read_text()
        (package / name).write_text(original + "\nplanted: int = 'text'\n")
        result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert result.returncode == 1 and f"{name}:" in result.stdout and "planted" not in original
        (package / name).write_text(original)


USER = """\
import numpy as np
import iccm
import iccm.io.run

square = np.array([0, 1, 1 + 1j, 1j])
fit = iccm.fit(square, square, method="paper", pins=[(0.5, 0.5)])
w: np.ndarray = fit.map(square)
x: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = fit.map([0.25, 0.5])
pairs: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = fit.inverse(np.array([[0.25, 0.5]]))
z: np.ndarray[tuple[int, ...], np.dtype[np.complex128]] = fit.transform(np.array([0.25 + 0.5j]))
points: list[complex] = [fit.transform(0.25 + 0.5j), fit.map(0.25 + 0.5j), fit.inverse(0.25 + 0.5j)]
left, right, bottom, top = iccm.transfer(iccm.checkerboard(), square, square, edge="repeat").extent
moved: iccm.Fit = iccm.deform(square, pins=[(0.5, 0.5)], start=fit)
pixels: np.ndarray = iccm.transfer(iccm.checkerboard(), square, square, size=64).pixels
closed: bool = iccm.Curve(square).closed
both: iccm.Transform = fit.then(fit.transform.inverse).inverse
code: str = iccm.io.run.run(iccm.io.run.Job(source="a.svg", target="b.svg")).report["status"]
try:
    iccm.warp(fit, pixels)
except iccm.InputError as error:
    print(error)
"""
MISTAKES = {
    "iccm.fitt(square, square)": 'Module has no attribute "fitt"',
    "iccm.io.run.jobs": 'Module has no attribute "jobs"',
    "fit.invert(w)": '"Fit" has no attribute "invert"',
    "iccm.deform(square, start=1)": 'Argument "start" to "deform" has incompatible type "int"',
    "number: int = iccm.transfer(pixels, square, square)": '(expression has type "Transfer"',
    "iccm.fit(square, square, metod='paper')": 'Unexpected keyword argument "metod" for "fit"',
    "iccm.transfer(pixels, square, square, balance='1')": 'Argument "balance" to "transfer" has incompatible',
    "iccm.fit(square, square, axes='up')": 'Argument "axes" to "fit" has incompatible type',
    "iccm.transfer(pixels, square, square, filter='best')": 'Argument "filter" to "transfer" has incompatible',
    "iccm.fit(square, square, holes='fill')": 'Argument "holes" to "fit" has incompatible type',
    "fit.map('a')": 'has incompatible type "str"',
    "iccm.warp(square, pixels)": 'Argument 1 to "warp" has incompatible type',
}


@pytest.mark.slow
def test_a_users_type_checker_sees_the_signatures(tmp_path):
    """So are the examples of all pages. mypy does not follow the import hooks of an editable installation, so it gets a
    copy.
    """
    for name in ("iccm", "iccm.io", "iccm.cli"):
        home = Path(importlib.import_module(name).__file__).parent
        shutil.copytree(home, tmp_path / name.replace(".", "/"), dirs_exist_ok=True)
    lines = [*USER.splitlines(), *MISTAKES, "reveal_type(iccm.fit)"]
    (tmp_path / "user.py").write_text("\n".join(lines))
    texts = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").rglob("*.md"))]
    blocks = re.findall(r"^```python\n(.*?)^```", "".join(texts), re.DOTALL | re.MULTILINE)
    pages = [f"page_{number}.py" for number in range(len(blocks))]
    for name, block in zip(pages, blocks):
        (tmp_path / name).write_text(block)
    quick = ["--follow-imports", "silent", "--ignore-missing-imports", "--cache-dir", "cache"]
    quick += ["--allow-untyped-calls", "--implicit-reexport"]  # for other libraries that pages use
    result = subprocess.run(
        [sys.executable, "-m", "mypy", *quick, "--strict", "user.py", *pages],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert len(pages) > 10
    messages = {}
    for line in result.stdout.splitlines()[:-1]:
        file, number, text = line.split(":", 2)
        assert file == "user.py", line
        messages[lines[int(number) - 1]] = messages.get(lines[int(number) - 1], "") + text
    assert messages.keys() == {*MISTAKES, "reveal_type(iccm.fit)"}, result.stdout
    assert all(text in messages[line] for line, text in MISTAKES.items()), result.stdout
    revealed = messages["reveal_type(iccm.fit)"]
    assert "def (source:" in revealed and revealed.endswith('-> iccm.result.Fit"')


@pytest.mark.parametrize("module", [iccm, iccm.io.run])
def test_the_names_a_type_checker_sees_are_those_that_are_there(module):
    tree = ast.parse(Path(module.__file__).read_text())
    checked = next(node for node in tree.body if isinstance(node, ast.If)).body
    seen = [alias for node in checked for alias in node.names]
    assert sorted(alias.asname for alias in seen) == module.__all__
    assert {*module.__all__, "__name__"} <= set(dir(module))
    assert "import_module" not in dir(module)  # an implementation detail
    for node in checked:
        for alias in node.names:
            home = importlib.import_module("." * node.level + node.module, module.__name__)
            assert getattr(module, alias.asname) is getattr(home, alias.name)
    with pytest.raises(AttributeError, match="has no attribute 'nosuch'"):
        module.nosuch  # noqa: B018


def test_the_lint_target_checks_the_staged_tree():
    recipe = (ROOT / "Makefile").read_text().partition("\nlint-types:")[2].partition("\n\n")[0]
    for part in (
        "cp -R iccm build/typecheck/iccm",
        "cp -R cli extensions io build/typecheck/iccm",
        "cd build/typecheck &&",
        "-p iccm",
    ):
        assert part in recipe


def test_every_folder_of_code_is_a_package(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "core"))
    finder = importlib.import_module("package_folders")
    packages = finder.package_folders(ROOT)
    code = [path for folder in ("iccm", "io", "cli", "extensions") for path in (ROOT / folder).rglob("*.py")]
    folders = {path.parent.relative_to(ROOT).as_posix() for path in code}
    assert {folder for name, folder in packages.items() if name not in finder.DATA} == folders
    for name, folder in packages.items():
        assert (ROOT / folder).is_dir()
        if name not in finder.DATA:
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


def test_tests_of_large_libraries_run_in_the_slow_stage():
    large = {"usd-core": "pxr", "vtk": "vtkmodules"}
    names = [re.match(r"[\w-]+", line)[0] for line in PROJECT["project"]["optional-dependencies"]["large"]]
    imported = "|".join(large.get(name, name) for name in names)
    users = [
        path
        for path in (ROOT / "tests").rglob("test_*.py")
        if re.search(rf'(?:import|from|importorskip\(")\s*(?:{imported})\b', path.read_text(encoding="utf-8"))
    ]
    assert users
    marked = re.compile(r"pytest\.mark\.(large|slow)|from tests\.cases import .*slow")
    assert [path.name for path in users if not marked.search(path.read_text(encoding="utf-8"))] == []


def test_nothing_large_is_tracked():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a git checkout")
    sizes = {
        name: (ROOT / name).stat().st_size for name in listed.stdout.split("\0") if (ROOT / name).is_file()
    }
    assert sizes and max(sizes.values()) <= 2_000_000


def test_the_man_pages_are_those_of_the_options(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    man = importlib.import_module("man")
    kept = {path.name: path.read_text(encoding="utf-8") for path in man.FOLDER.iterdir()}
    assert kept == man.pages(), "run docs/man.py"
