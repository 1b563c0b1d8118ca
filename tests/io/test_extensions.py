"""Extensions: the package on the page for developers, installed as its entry points say."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "developers" / "extensions.md"


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture
def site(tmp_path):
    """A folder with the example of the page as `pip install` leaves it: the module and its metadata."""
    project = tomllib.loads(blocks("toml")[0])["project"]
    folder = tmp_path / "site"
    info = folder / f"iccm_boxes-{project['version']}.dist-info"
    info.mkdir(parents=True)
    (folder / "iccm_boxes.py").write_text(blocks("python")[0])
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    groups = project["entry-points"].items()
    text = "".join(
        f"[{group}]\n" + "".join(f"{name} = {place}\n" for name, place in points.items())
        for group, points in groups
    )
    (info / "entry_points.txt").write_text(text)
    return folder


@pytest.fixture
def run(site, tmp_path):
    """Run a command line in a fresh process that sees the extension."""
    (tmp_path / "crates.boxes").write_text("1 2 3\n2 2 5\n")

    def run(*arguments):
        environment = os.environ | {"PYTHONPATH": str(site)}
        return subprocess.run(
            [sys.executable, "-m", "iccm", *arguments],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )

    return run


def test_a_format_of_an_extension_works_in_all_commands(run, tmp_path):
    result = run("info", "crates.boxes")
    assert result.returncode == 0 and "faces: 12" in result.stdout
    result = run("flatten", "crates.boxes", "--uv", "crates.obj")
    assert result.returncode == 0, result.stderr
    lines = (tmp_path / "crates.obj").read_text().splitlines()
    assert sum(line.startswith("v ") for line in lines) == 16 and any(
        line.startswith("vt ") for line in lines
    )
    assert ".boxes" in run("info", "--formats").stdout


def test_a_command_of_an_extension_is_listed_and_runs(run):
    result = run("volume", "crates.boxes")
    assert (result.returncode, result.stdout.strip()) == (0, "26.0")
    assert "iccm-boxes 1.0" in run("--help").stdout


def test_bad_files_and_broken_extensions_are_one_line_and_exit_2(run, site, tmp_path):
    (tmp_path / "flat.boxes").write_text("1 2\n")
    result = run("info", "flat.boxes")
    assert result.returncode == 2 and "3 sizes, not 2" in result.stderr and result.stderr.count("\n") == 1
    (site / "iccm_boxes.py").write_text("import a_module_that_is_missing\n")
    for arguments in (("info", "crates.boxes"), ("volume", "crates.boxes")):
        result = run(*arguments)
        assert result.returncode == 2 and result.stderr.count("\n") == 1, result.stderr
        assert "iccm-boxes 1.0" in result.stderr and "a_module_that_is_missing" in result.stderr


def test_an_extension_cannot_replace_what_iccm_has(run, site):
    points = next(site.glob("*.dist-info")) / "entry_points.txt"
    points.write_text(points.read_text() + "info = iccm_boxes:volume\n")
    result = run("info", "crates.boxes")
    assert "faces: 12" in result.stdout
