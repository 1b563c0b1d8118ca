"""What people are told: help by groups, misspelt commands, a run in two lines, what would be written, wrong files."""

import json
import shutil

import pytest

from iccm.io.option_groups import GROUPS


def test_help_is_grouped_and_whole(iccm):
    from iccm.io.options import of_command

    text = iccm("map", "--help").out
    titles = [title for title in GROUPS if f"\n{title}, such as " in text]
    assert titles == list(GROUPS)
    for name in of_command("map"):
        assert (
            text.count(f"\n  --{name.replace('_', '-')} ") + text.count(f", --{name.replace('_', '-')} ") == 1
        ), name


def test_a_misspelt_command_names_the_nearest(iccm):
    typed = iccm("flaten", "a.obj")
    assert typed.code == 2 and "did you mean 'flatten'?" in typed.err
    assert "did you mean" not in iccm("xyzzy").err


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_installed_once_and_nothing_else_changes(tmp_path, monkeypatch, iccm, shell):
    for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "ZDOTDIR", "BASH_COMPLETION_USER_DIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    mine = b"alias ll='ls -l' # \xff, and no newline"
    (tmp_path / ".zshrc").write_bytes(mine)
    first = iccm("completion", "install", "--shell", shell)
    found = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert first.code == 0 and len(found) == 2 and any(b"_ICCM_COMPLETE" in text for text in found.values())
    assert found[tmp_path / ".zshrc"].startswith(mine)
    assert (found[tmp_path / ".zshrc"] == mine) == (shell != "zsh")
    assert "is there already" in iccm("completion", "install", "--shell", shell).err
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == found
    monkeypatch.setenv("SHELL", "/bin/sh")
    typed = iccm("completion", "install")
    assert typed.code == 2 and typed.lines == [
        "error: sh: no shell that iccm knows; name one: --shell bash|zsh|fish"
    ]


def test_a_run_is_told_in_two_lines(shapes, iccm):
    typed = iccm("map", "square.svg", "disk.svg", "--size", "32", "-o", "out.png")
    assert typed.lines[0] == "wrote out.png" and len(typed.lines) == 2
    assert typed.lines[1].startswith("sizes even on ") and ", no folds, " in typed.lines[1]
    more = iccm("map", "square.svg", "disk.svg", "--size", "32", "-o", "out.png", "--force", "-v")
    assert any(line.startswith("dilatation ") for line in more.lines)


def test_a_dry_run_checks_and_writes_nothing(shapes, iccm):
    before = sorted(shapes.iterdir())
    given = ("map", "square.svg", "disk.svg", "-o", "out.png", "--report", "out.json", "--dry-run")
    typed = iccm(*given)
    assert typed.code == 0 and typed.lines == ["would write out.png", "would write out.json"]
    assert iccm("map", "square.svg", "none.svg", "--dry-run").code == 2
    assert sorted(shapes.iterdir()) == before
    (shapes / "out.png").touch()
    typed = iccm(*given)
    assert typed.code == 2 and "out.png: the file exists" in typed.err


def test_an_existing_output_hides_no_other_mistake(shapes, iccm):
    (shapes / "out.png").touch()
    typed = iccm("map", "square.svg", "none.svg", "-o", "out.png")
    assert typed.code == 2 and "none.svg: no such file" in typed.err


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("map", "folder", "disk.svg"), "folder: is a folder"),
        (("map", "square.xyz", "disk.svg"), ".glb"),
        (("map", "square.svg", "disk.svg", "--texture", "square.svg"), "-o out.svg"),
        (("map", "square.svg", "disk.svg", "--texture", "square.xyz"), "is no picture; use one of .png"),
        (("map", "square.svg", "disk.svg", "-o", "folder"), "folder: is a folder"),
        (("map", "square.svg", "disk.svg", "-o", "out.xyz"), ".svg .svgz .obj .glb"),
        (("flatten", "none.obj", "-o", "old.svg"), "none.obj: no such file"),
        (
            ("relayout", "none.obj", "none.obj", "--texture", "none.png", "-o", "old.png"),
            "none.obj: no such file",
        ),
        (("apply", "none.exr", "none.png", "-o", "old.png"), "none.png: no such file"),
    ],
)
def test_a_wrong_file_is_called_what_it_is(shapes, iccm, given, said):
    (shapes / "folder").mkdir()
    for name in ("old.svg", "old.png"):
        (shapes / name).touch()
    shutil.copy("square.svg", "square.xyz")
    typed = iccm(*given)
    assert typed.code == 2 and said in typed.err and "OpenImageIO" not in typed.err


def test_info_knows_reports(shapes, iccm):
    iccm("map", "square.svg", "disk.svg", "--size", "32", "-o", "out.png", "--report", "out.json")
    facts = json.loads(iccm("info", "out.json", "--json").out)
    assert facts["kind"] == "iccm.report/1" and facts["inputs"] == ["square.svg", "disk.svg"]
    assert facts["status"] == json.loads((shapes / "out.json").read_text())["status"]


def test_info_knows_stmaps_and_results(shapes, iccm):
    iccm("map", "square.svg", "disk.svg", "--size", "32", "--stmap", "map.exr")
    assert json.loads(iccm("info", "map.exr", "--json").out)["kind"] == "STMap"
    (shapes / "empty.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
    (shapes / "jobs.jsonl").write_text('{"source": "square.svg", "target": "empty.svg"}\n')
    (shapes / "results.jsonl").write_text(iccm("batch", "jobs.jsonl", "-j", "1").out)
    facts = json.loads(iccm("info", "results.jsonl", "--json").out)
    assert facts["kind"] == "iccm.result/1" and facts["ended"] == {"failed": 1}
