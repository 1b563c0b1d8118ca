"""Install iccm with the lowest and the newest versions of its dependencies, on each Python at hand, and run tests.

python -m tests.bounds [--python 3.11 3.12 3.13] [--versions lowest newest] [--wheel FILE] [tests/io …]

It needs uv (`pip install uv`). Each environment is fresh, has the lowest (or newest) versions that `pyproject.toml`
claims for iccm and its extras, and iccm from a wheel. The tests are run from a copy without the sources, so that they
test what was installed, and warnings about deprecations are errors. Where no tests are named, those of REPRESENTATIVE
are run, which use each dependency. A Python is named by its version, or by its path where it is not on the PATH.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from iccm.io.extensions import extras as every_extra

ROOT = Path(__file__).parents[1]
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
RESOLUTIONS = {"lowest": "lowest-direct", "newest": "highest"}
TEST_REQUIREMENTS = (
    "pytest>=8.3",
    "pytest-timeout>=2.3",
    "pytest-xdist>=3.6",
    "hypothesis>=6.120",
    "jsonschema>=4.26",
)
HELPERS = ("httpx2>=2.0", "svgelements>=1.9.6", "pygltflib>=1.16")
COPIED = ("tests", "docs", "samples", "man", "pyproject.toml", "README.md", "CHANGELOG.md")
WARNINGS = "error::RuntimeWarning:iccm\nerror::DeprecationWarning:(iccm|tests|test_)"
REPRESENTATIVE = (
    "tests/cli/test_holes.py",
    "tests/io/batch/test_commands.py",
    "tests/io/edit/test_server.py",
    "tests/io/meshes/test_gltf.py",
    "tests/io/outlines/test_outlines.py",
    "tests/io/pictures/test_image_files.py",
    "tests/io/svg/test_lettering.py",
    "tests/io/test_spec.py",
    "tests/iccm/drawings/test_placing.py",
    "tests/iccm/saved/test_map_file.py",
    "tests/iccm/test_given.py",
)


def uv(*arguments: str, **options) -> subprocess.CompletedProcess:
    """Run uv."""
    return subprocess.run(["uv", *arguments], capture_output=True, text=True, **options)


def build(folder: Path) -> Path:
    """Build a wheel of what is committed, and return it."""
    tree = folder / "tree"
    tree.mkdir()
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", str(tree)], input=archive, check=True)
    uv("build", "--wheel", "--out-dir", str(folder), str(tree), check=True)
    return next(folder.glob("*.whl"))


def claimed_requirements() -> list[str]:
    """Return what iccm and its extras require: uv takes the lowest versions only of what it is asked for directly."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    return [*project["dependencies"], *(line for extra in every_extra() for line in extras[extra.name])]


def run(python: str, versions: str, wheel: Path, tests: list[str], folder: Path) -> tuple[bool, str]:
    """Install and test in one fresh environment; whether all passed, and the last line of the tests or the mistake."""
    environment = folder / "venv"
    created = uv("venv", "--quiet", "--python", python, "--no-python-downloads", str(environment))
    if created.returncode:
        return True, "not installed here"
    interpreter = environment / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    install = ["pip", "install", "--quiet", "--python", str(interpreter), "--only-binary", ":all:"]
    claimed = uv(*install, "--resolution", RESOLUTIONS[versions], str(wheel), *claimed_requirements())
    helpers = uv(*install, *TEST_REQUIREMENTS, *HELPERS) if not claimed.returncode else claimed
    if helpers.returncode:
        return False, f"cannot install: {helpers.stderr.strip()}"
    copy = folder / "copy"
    copy.mkdir()
    for name in COPIED:
        place = ROOT / name
        shutil.copytree(place, copy / name) if place.is_dir() else shutil.copy(place, copy / name)
    command = [str(interpreter), "-m", "pytest", "-q", "-n", "0", "-m", "not slow", "-p", "no:cacheprovider"]
    command += ["-o", f"filterwarnings={WARNINGS}", *tests]
    result = subprocess.run(command, cwd=copy, capture_output=True, text=True)
    lines = result.stdout.strip().splitlines() or [result.stderr.strip()]
    failures = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    return result.returncode == 0, "\n".join([*failures, lines[-1]])


def main() -> int:
    """Print one line for each environment; return 1 if a test failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.bounds", description=__doc__.partition("\n")[0])
    parser.add_argument("tests", nargs="*", default=REPRESENTATIVE, help="files or folders of tests")
    parser.add_argument("--python", nargs="+", default=PYTHONS, metavar="VERSION")
    parser.add_argument("--versions", nargs="+", default=list(RESOLUTIONS), choices=RESOLUTIONS)
    parser.add_argument("--wheel", type=Path, help="a wheel of iccm [default: built from the last commit]")
    options = parser.parse_args()
    all_passed = True
    with tempfile.TemporaryDirectory() as name:
        wheel = options.wheel.resolve() if options.wheel else build(Path(name))
        for python in options.python:
            for versions in options.versions:
                folder = Path(name) / f"{Path(python).name}-{versions}"
                folder.mkdir()
                passed, words = run(python, versions, wheel, list(options.tests), folder)
                print(f"{python}, {versions} versions: {words}", flush=True)
                shutil.rmtree(folder)
                all_passed &= passed
    return not all_passed


if __name__ == "__main__":
    sys.exit(main())
