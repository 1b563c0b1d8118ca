"""Batches without a manifest, and `iccm init`, which writes an example of one."""

import json
import re
import shutil
from pathlib import Path

import pytest

from iccm.cli import batch
from iccm.io.batch import manifest
from tests.cases import slow

SMALL = ("--size", "24", "--method", "paper", "--vertices", "40", "-j", "1")


@pytest.fixture
def icons(shapes):
    """square.svg, blob.svg and disk.svg; the first two also in icons/, which contains another file."""
    (shapes / "icons").mkdir()
    for name in ("square.svg", "blob.svg"):
        shutil.copy(name, f"icons/{name}")
    (shapes / "icons" / "notes.txt").write_text("no shape")
    return shapes


def results(typed):
    return {
        name: line["status"] for line in map(json.loads, typed.out.splitlines()) for name in [line["name"]]
    }


@pytest.mark.parametrize(
    "sources",
    [
        ("icons/*.svg",),
        slow(("icons",)),
        slow(("icons/square.svg", "icons/blob.svg")),
    ],
)
def test_every_file_of_a_pattern_or_folder_becomes_a_job(icons, iccm, sources):
    result = iccm("batch", *sources, "disk.svg", *SMALL, "-o", "out/{source.stem}-on-{target.stem}.png")
    assert result.code == 0 and results(result) == {"square-disk": "done", "blob-disk": "done"}
    pictures = sorted(path.name for path in (icons / "out").glob("*.png"))
    assert pictures == ["blob-on-disk.png", "square-on-disk.png"]


@pytest.mark.slow
def test_an_output_may_be_a_folder_and_options_of_the_map_hold(icons, iccm):
    result = iccm("batch", "icons", "[bd]*.svg", *SMALL, "-o", "out/")
    assert result.code in (0, 1) and len(results(result)) == 4
    assert (icons / "out" / "square-disk.png").is_file() and (icons / "out" / "square-blob.png").is_file()
    again = iccm("batch", "icons", "disk.svg", "-o", "out2/", "--dry-run", "--resolution", "4")
    assert again.code == 2 and "--size" in again.err


def test_one_mistake_of_a_pattern_is_reported_once(icons, iccm):
    job = {"source": "icons/*.svg", "target": "disk.svg", "sizes": 3, "colour": 1, "turn": "x"}
    (icons / "jobs.jsonl").write_text(json.dumps(job))
    result = iccm("batch", "jobs.jsonl")
    assert result.code == 2 and len(result.lines) == 3
    assert any("sizes" in line and "did you mean size" in line for line in result.lines)
    result = iccm("batch", "icons/*.svg", "disk.svg", "-o", "out.png")
    assert result.code == 2 and len(result.lines) == 1 and "{source.stem}" in result.err


@pytest.mark.parametrize(
    ("arguments", "cure"),
    [
        ((), "iccm init"),
        (("icons",), "'icons' shield.svg"),
        (("square.svg",), "'square.svg' shield.svg"),
        (("jobs.toml", "--size", "64"), "size = "),
        (("empty", "disk.svg", "-o", "out/"), "empty: no shapes"),
        (("icons/*.obj", "disk.svg", "-o", "out/"), "no file matches"),
    ],
)
def test_incomplete_batches_are_refused_with_the_cure(icons, iccm, arguments, cure):
    (icons / "empty").mkdir()
    (icons / "jobs.toml").write_text('[[job]]\nsource = "disk.svg"\ntarget = "blob.svg"\n')
    before = sorted(icons.iterdir())
    result = iccm("batch", *arguments)
    assert (
        result.code == 2
        and len(result.lines) == 1
        and cure in result.err
        and sorted(icons.iterdir()) == before
    )


def test_the_generated_manifest_runs_unchanged(icons, iccm):
    (icons / "shield.svg").write_text((icons / "disk.svg").read_text())
    result = iccm("init")
    assert result.code == 0 and "iccm batch jobs.toml" in result.err
    tasks = manifest.read((icons / "jobs.toml").read_text(), "jobs.toml", root=icons)
    assert [task.name for task in tasks] == ["blob-shield", "square-shield"]
    assert iccm("batch", "jobs.toml", "--dry-run").code == 0
    mine = (icons / "jobs.toml").read_bytes()
    again = iccm("init")
    assert again.code == 2 and len(again.lines) == 1 and (icons / "jobs.toml").read_bytes() == mine
    assert iccm("init", "jobs.json").code == 2 and iccm("init", "other.toml").code == 0


def test_every_key_that_the_starter_shows_in_comments_is_valid(icons, iccm):
    iccm("init")
    text = (icons / "jobs.toml").read_text()
    for name in ("shield.svg", "icons/bell.svg"):
        shutil.copy("disk.svg", icons / name)
    (icons / "petals.jpg").touch()
    body = re.sub(r"^# (?=\w+ = |\[\[)", "", text, flags=re.MULTILINE)
    tasks = manifest.read(body, "jobs.toml", root=icons)
    assert [task.job.command for task in tasks] == ["map"] * 4


@pytest.mark.parametrize("force", [True, False])
def test_force_holds_for_every_job_of_a_manifest(icons, force):
    Path("two.jsonl").write_text('{"source": "icons/*.svg", "target": "disk.svg"}')
    tasks = batch._tasks("two.jsonl", Path("."), outside=False, force=force)
    assert len(tasks) > 1 and all(task.job.force == force for task in tasks)
