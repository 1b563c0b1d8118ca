"""Messages to users: help by groups, misspelt commands, the summary of a run, dry runs, and invalid files."""

import json
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest

from iccm.cli import COMMANDS
from iccm.io.option_groups import TOPICS
from iccm.io.options import of_command

pytestmark = pytest.mark.usefixtures("solve_once")


def rows_in(text, name):
    option = f"--{name.replace('_', '-')}"
    return len(re.findall(rf"^  (?:-\w, )?{option}(?: |$)", text, re.MULTILINE))


def test_help_of_all_topics_is_grouped_and_whole(iccm):
    text = iccm("map", "--help", "all").out
    assert [topic.title for topic in TOPICS.values() if f"\n{topic.title}, such as " in text] == [
        topic.title for topic in TOPICS.values()
    ]
    for name, (_, option) in of_command("map").items():
        assert rows_in(text, name) == ("map" not in option.hidden), name


def test_the_short_help_lists_the_common_options(iccm):
    text = iccm("map", "--help").out
    needed = ["texture", "output", "size", "fit", "parts", "pin", "rigid", "turn", "holes", "force", "help"]
    names = [name for name in [*of_command("map"), "help"] if rows_in(text, name)]
    assert set(needed) <= set(names) and len(names) <= 14
    assert len(re.findall(r"^  iccm map ", text, re.MULTILINE)) == 9
    assert all(re.search(rf"^  {word} ", text, re.MULTILINE) for word in (*TOPICS, "all"))
    assert len(text.splitlines()) <= 76 and max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("topic", TOPICS)
def test_the_help_of_a_topic_has_its_options_alone(iccm, topic):
    text = iccm("map", "--help", topic).out
    topic_options = [name for name, (_, option) in of_command("map").items() if option.topic == topic]
    hidden = [name for name in topic_options if "map" in of_command("map")[name][1].hidden]
    assert topic_options and all(rows_in(text, name) == (name not in hidden) for name in topic_options)
    elsewhere = set(of_command("map")) - set(topic_options)
    assert not any(rows_in(text, name) for name in elsewhere)
    assert iccm("help", "map", topic).out == text


def test_help_names_its_topics_and_every_command_its_version(iccm):
    result = iccm("map", "--help", "colours")
    assert result.code == 2 and "texture" in result.err and "limits" in result.err and not result.out
    assert iccm("help").out == iccm("--help").out
    assert iccm("help", "constraints").out == iccm("map", "--help", "constraints").out
    for command in COMMANDS:
        version = iccm(command, "--version")
        assert version.code == 0 and version.out == iccm("--version").out
        assert max(map(len, iccm(command, "--help").out.splitlines())) <= 80


def test_a_misspelt_command_names_the_nearest(iccm):
    result = iccm("flaten", "a.obj")
    assert result.code == 2 and "did you mean 'flatten'?" in result.err
    assert "did you mean" not in iccm("xyzzy").err


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_installed_once_and_nothing_else_changes(tmp_path, monkeypatch, iccm, shell):
    for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "ZDOTDIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    mine = b"alias ll='ls -l' # \xff, and no newline"
    for name in (".bashrc", ".zshrc"):
        (tmp_path / name).write_bytes(mine)
    first = iccm("completion", "install", "--shell", shell)
    contents = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert (
        first.code == 0
        and len(contents) == 3
        and any(b"_ICCM_COMPLETE" in text for text in contents.values())
    )
    for other in ("bash", "zsh"):
        settings = contents[tmp_path / f".{other}rc"]
        assert settings.startswith(mine) and (settings == mine) == (shell != other)
    assert "already installed" in iccm("completion", "install", "--shell", shell).err
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == contents
    monkeypatch.setenv("SHELL", "/bin/sh")
    result = iccm("completion", "install")
    assert result.code == 2 and result.lines[0].startswith("error: sh: ")
    assert len(result.lines) == 1 and "--shell bash|zsh|fish" in result.lines[0]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_completion_script_that_is_printed_is_the_one_that_is_installed(
    tmp_path, monkeypatch, iccm, shell
):
    for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "ZDOTDIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    printed = iccm("completion", shell)
    assert printed.code == 0
    assert iccm("completion", "install", "--shell", shell).code == 0
    installed = [path.read_text() for path in tmp_path.rglob("*") if path.is_file()]
    assert printed.out.rstrip("\n") in [text.rstrip("\n") for text in installed]
    assert iccm("completion", shell, "--shell", shell).code == 2


def test_a_run_is_summed_up_in_one_line(shapes, iccm):
    result = iccm("map", "square.svg", "disk.svg", "--size", "32", "-o", "out.png")
    assert len(result.lines) == 1 and result.lines[0].startswith("out.png  32×32 · scale within 2× on ")
    assert " · no folds · " in result.lines[0]
    more = iccm("map", "square.svg", "disk.svg", "--size", "32", "-o", "out.png", "--force", "-v")
    assert any(line.startswith("dilatation ") for line in more.lines)


def test_a_dry_run_checks_and_writes_nothing(shapes, iccm):
    before = sorted(shapes.iterdir())
    arguments = ("map", "square.svg", "disk.svg", "-o", "out.png", "--report", "out.json", "--dry-run")
    result = iccm(*arguments)
    assert result.code == 0 and result.lines == ["would write out.png", "would write out.json"]
    assert iccm("map", "square.svg", "none.svg", "--dry-run").code == 2
    assert sorted(shapes.iterdir()) == before
    (shapes / "out.png").touch()
    result = iccm(*arguments)
    assert result.code == 2 and "out.png: the file exists" in result.err


@pytest.mark.slow
def test_an_input_that_changes_is_mapped_again_until_ctrl_c(shapes):
    command = [sys.executable, "-c", "from iccm.cli import main; main()", "map", "square.svg", "disk.svg"]
    command += ["--size", "32", "-o", "out.png", "--watch"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as running:

        def wait_for(until):
            lines = []
            while not lines or until not in lines[-1]:
                lines.append(running.stderr.readline())
                assert lines[-1], "it ended"
            return lines

        try:
            wait_for("Ctrl-C")
            first = (shapes / "out.png").read_bytes()
            (shapes / "disk.svg").write_text("<svg")
            wait_for("error: disk.svg")
            shutil.copy("blob.svg", "disk.svg")
            wait_for("no folds")
            assert (shapes / "out.png").read_bytes() != first
            time.sleep(0.5)  # so that the run has already returned its exit code
            running.send_signal(signal.SIGINT)
            assert running.wait(30) == 0
        finally:
            running.kill()


def test_open_without_a_display_gets_a_note(shapes, iccm, monkeypatch):
    arguments = ("map", "square.svg", "disk.svg", "--size", "32", "-o", "out.png", "--open", "--force")
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    result = iccm(*arguments)
    assert (
        result.code == 0 and "note: --open: cannot show out.png: this computer has no display" in result.lines
    )
    opened = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("click.launch", lambda name: opened.append(name) or 0)
    assert iccm(*arguments).code == 0 and opened == ["out.png"]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "code"), [("blob.svg", 0), ("m.obj", 0), ("jobs.toml", 2)])
def test_a_sheet_shows_numbered_parts(shapes, iccm, name, code):
    (shapes / "jobs.toml").write_text('[[job]]\nsource = "disk.svg"\ntarget = "blob.svg"')
    (shapes / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\nf 1 2 3\nf 1 3 4\n")
    result = iccm("info", name, "--plot", "sheet.svg")
    assert result.code == code and (shapes / "sheet.svg").exists() == (code == 0)
    if not code:
        text = (shapes / "sheet.svg").read_text()
        assert {"blob.svg": "#1 ", "m.obj": "#piece-1"}[name] in text
    assert iccm("info", name, name, "--plot", "two.svg").code == 2


def test_an_existing_output_hides_no_other_mistake(shapes, iccm):
    (shapes / "out.png").touch()
    result = iccm("map", "square.svg", "none.svg", "-o", "out.png")
    assert result.code == 2 and "none.svg: no such file" in result.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("map", "folder", "disk.svg"), "folder: is a folder"),
        (("map", "square.xyz", "disk.svg"), ".glb"),
        (("map", "square.svg", "disk.svg", "--texture", "square.xyz"), "not an image; use one of .png"),
        (("map", "square.svg", "disk.svg", "-o", "folder"), "folder: is a folder"),
        (("map", "square.svg", "disk.svg", "-o", "out.xyz"), ".png .svg"),
        (("flatten", "none.obj", "-o", "old.svg"), "none.obj: no such file"),
        (
            ("relayout", "none.obj", "none.obj", "--texture", "none.png", "-o", "old.png"),
            "none.obj: no such file",
        ),
        (("apply", "none.exr", "none.png", "-o", "old.png"), "none.png: no such file"),
        (("map", "logo.pdf", "disk.svg"), "logo.pdf: cannot read a shape from '.pdf'; export it as .svg"),
        (("map", "square.svg", "car.fbx"), "export it as .glb or .obj"),
        (("flatten", "car.blend"), "export it as .glb or .obj"),
        (("flatten", "logo.pdf"), "use one of .obj"),
        (("map", "square.svg", "disk.svg", "--texture", "layers.psd"), "export it as .png or .tif"),
        (("map", "square.svg", "disk.svg", "--texture", "drawing.png"), "is an SVG drawing, not a picture"),
        (("map", "square.svg", "disk.svg", "--texture", "old.png"), "old.png: the file is empty"),
        (("map", "https://example.org/a.svg", "disk.svg"), "is an address, not a file"),
        (("map", "-", "disk.svg"), "not read from standard input"),
        (("--size", "300", "map", "square.svg", "disk.svg"), "--size; options follow the command"),
        (("square.svg", "disk.svg", "map"), "run: iccm map square.svg disk.svg (run"),
    ],
)
def test_the_error_for_a_wrong_file_names_its_kind(shapes, iccm, arguments, message):
    (shapes / "folder").mkdir()
    for name in ("old.svg", "old.png"):
        (shapes / name).touch()
    shutil.copy("square.svg", "square.xyz")
    shutil.copy("square.svg", "drawing.png")
    for name in ("logo.pdf", "car.fbx", "car.blend", "layers.psd"):
        (shapes / name).write_text("content of another program")
    result = iccm(*arguments)
    assert result.code == 2 and message in result.err and "OpenImageIO" not in result.err


def test_info_knows_reports(shapes, iccm):
    iccm("map", "square.svg", "disk.svg", "--size", "32", "-o", "out.png", "--report", "out.json")
    facts = json.loads(iccm("info", "out.json", "--json").out)
    assert facts["kind"] == "iccm.report/1" and facts["inputs"] == ["square.svg", "disk.svg"]
    assert facts["status"] == json.loads((shapes / "out.json").read_text())["status"]


@pytest.mark.slow
def test_info_knows_stmaps_and_results(shapes, iccm):
    iccm("map", "square.svg", "disk.svg", "--size", "32", "--stmap", "map.exr")
    assert json.loads(iccm("info", "map.exr", "--json").out)["kind"] == "STMap"
    (shapes / "empty.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
    (shapes / "jobs.jsonl").write_text('{"source": "square.svg", "target": "empty.svg"}\n')
    (shapes / "results.jsonl").write_text(iccm("batch", "jobs.jsonl", "-j", "1").out)
    facts = json.loads(iccm("info", "results.jsonl", "--json").out)
    assert facts["kind"] == "iccm.result/1" and facts["ended"] == {"failed": 1}


def test_batch_shows_the_options_of_map_that_each_job_needs_most(iccm):
    text = iccm("batch", "--help").out
    assert "-o, --output FILE" in text and "--size WxH|N" in text and "--texture IMAGE" in text
    assert "--balance" not in text and "--output" not in iccm("batch", "--help", "limits").out
