"""Examples on pages that `test_pages` does not run work as shown."""

import re
import shutil
from pathlib import Path

import pytest

from iccm.cli import COMMANDS
from iccm.io.batch import manifest
from iccm.io.check import compare
from iccm.io.options import options_of

from .scripts import script

DOCS = Path(__file__).parents[1] / "docs"
SITE = script("docs/site.py")
TOOLS = ("jq", "xargs", "make")


@pytest.fixture
def folder(shapes):
    """leaf.svg, rose.svg and shapes/ with two files."""
    (shapes / "shapes").mkdir()
    for old, new in (("blob.svg", "leaf.svg"), ("square.svg", "rose.svg"), ("disk.svg", "shapes/disk.svg")):
        shutil.move(old, new)
    shutil.copy("rose.svg", "shapes/rose.svg")
    return shapes


def blocks(page, kind):
    text = (DOCS / "reference" / page).read_text(encoding="utf-8")
    return re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL)


def test_there_are_recipes_for_every_tool():
    text = (DOCS / "cookbook" / "pipelines.md").read_text(encoding="utf-8")
    assert all(f"{tool} " in text for tool in TOOLS)


def test_the_manifest_shown_is_valid(folder):
    for name in ("petals.jpg", "shapes/rose.svg"):
        (folder / name).write_text("")
    tasks = manifest.read(blocks("batch.md", "toml")[0], "jobs.toml", root=folder)
    assert [task.name for task in tasks] == ["disk-leaf", "rose-leaf", "two pins"]


def test_the_tolerances_shown_are_valid(folder):
    (folder / "t.toml").write_text(blocks("check.md", "toml")[0])
    assert compare.tolerances(folder / "t.toml").figure("injective.depth").ignore


def test_the_constraints_shown_are_valid(folder):
    from iccm.io.shapes import listing

    (folder / "c.json").write_text(blocks("constraints.md", "json")[0])
    assert len(listing.read(folder / "c.json").pins) == 1


def test_the_pages_know_every_command_and_option():
    readme = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    assert all(f"iccm {command}" in readme for command in COMMANDS)
    detail = "".join(
        SITE.on_page_markdown(page.read_text(encoding="utf-8")) for page in (DOCS / "reference").glob("*.md")
    )
    visible = {name for name, (_, option) in options_of().items() if not option.hidden}
    for field in visible - {"output"}:
        assert f"--{field.replace('_', '-')}" in detail, field


@pytest.mark.slow
def test_the_ci_sample_is_as_its_baselines(shell, tmp_path):
    sample = Path(__file__).parents[1] / "samples" / "ci"
    shutil.copytree(sample, tmp_path / "ci", ignore=shutil.ignore_patterns("out"))
    lines = re.findall(r"run: (iccm .*)", (sample / "workflow.yml").read_text())
    assert len(lines) == 2
    result = shell(f"cd {tmp_path}/ci && {' && '.join(lines)}")
    assert result.returncode == 0, result.stderr
    picture = tmp_path / "ci" / "out" / "kite-drop.png"
    picture.write_bytes((tmp_path / "ci" / "out" / "kite-pebble.png").read_bytes())
    assert shell(f"cd {tmp_path}/ci && {lines[1]}").returncode == 1
    assert (tmp_path / "ci" / "diff" / "kite-drop.png.diff.png").exists()
