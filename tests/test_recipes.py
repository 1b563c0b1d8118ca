"""What the README shows works as it stands there."""

import re
import shutil
from pathlib import Path

import pytest

from iccm.cli import COMMANDS
from iccm.io.batch import manifest
from iccm.io.check import compare
from iccm.io.options import options_of

README = (Path(__file__).parents[1] / "README.md").read_text()
RECIPES = re.findall(r"<!-- tested -->\n```sh\n(.*?)```", README, re.DOTALL)
TOOLS = ("jq", "xargs", "parallel", "make")


@pytest.fixture
def folder(shapes):
    """leaf.svg, rose.svg and shapes/ with two files."""
    (shapes / "shapes").mkdir()
    for old, new in (("blob.svg", "leaf.svg"), ("square.svg", "rose.svg"), ("disk.svg", "shapes/disk.svg")):
        shutil.move(old, new)
    shutil.copy("rose.svg", "shapes/rose.svg")
    return shapes


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda text: text.split("\n")[0])
def test_a_recipe_runs(folder, shell, recipe):
    missing = [tool for tool in TOOLS if re.search(rf"\b{tool}\b", recipe) and not shutil.which(tool)]
    if missing:
        pytest.skip(f"{missing[0]} is not installed")
    done = shell(f"set -eo pipefail; {recipe}")
    assert done.returncode == 0, done.stderr
    if "out" in recipe:
        assert len(list((folder / "out").glob("*.png"))) == 2
    else:
        assert 0 < float(done.stdout) < 0.01


def test_there_are_recipes_for_every_tool():
    assert len(RECIPES) == 5 and all(any(tool in recipe for recipe in RECIPES) for tool in TOOLS)


def blocks(kind):
    return re.findall(rf"```{kind}\n(.*?)```", README, re.DOTALL)


def test_the_manifest_of_the_readme_is_valid(folder):
    for name in ("petals.jpg", "shapes/rose.svg"):
        (folder / name).write_text("")
    tasks = manifest.read(blocks("toml")[0], "jobs.toml", root=folder)
    assert [task.name for task in tasks] == ["disk-leaf", "rose-leaf", "two pins"]


def test_the_tolerances_of_the_readme_are_valid(folder):
    (folder / "t.toml").write_text(blocks("toml")[1])
    assert compare.tolerances(folder / "t.toml").figure("injective.depth").ignore


def test_the_python_of_the_readme_runs():
    scope: dict = {}
    exec(blocks("python")[0], scope)
    assert scope["fit"].status.ok


def test_the_constraints_of_the_readme_are_valid(folder):
    from iccm.io.shapes import listing

    (folder / "c.json").write_text(blocks("json")[0])
    assert len(listing.read(folder / "c.json").pins) == 1


def test_the_readme_knows_every_command_and_option():
    for command in COMMANDS:
        assert f"iccm {command}" in README, command
    for field in set(options_of()) - {"output"}:
        assert f"--{field.replace('_', '-')}" in README, field


def test_the_pictures_of_the_readme_are_there():
    pictures = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", README)
    assert len(pictures) >= 8
    assert all((Path(__file__).parents[1] / name).is_file() for name in pictures)


def test_the_ci_sample_is_as_its_baselines(shell, tmp_path):
    sample = Path(__file__).parents[1] / "samples" / "ci"
    shutil.copytree(sample, tmp_path / "ci", ignore=shutil.ignore_patterns("out"))
    lines = re.findall(r"run: (iccm .*)", (sample / "workflow.yml").read_text())
    assert len(lines) == 2
    done = shell(f"cd {tmp_path}/ci && {' && '.join(lines)}")
    assert done.returncode == 0, done.stderr
    picture = tmp_path / "ci" / "out" / "kite-drop.png"
    picture.write_bytes((tmp_path / "ci" / "out" / "kite-pebble.png").read_bytes())
    assert shell(f"cd {tmp_path}/ci && {lines[1]}").returncode == 1
    assert (tmp_path / "ci" / "diff" / "kite-drop.png.diff.png").exists()
