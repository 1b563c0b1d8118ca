"""Closed standard streams, and what may be written to stderr."""

import json
import sys

import pytest

from iccm.cli import logs
from iccm.io.run.phases import Doubt

MAP = "iccm map square.svg blob.svg --method paper --vertices 40 --size 32 -o out.png --report r.json"


@pytest.mark.slow
@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", "<&- >&- 2>&-"])
def test_streams_may_be_closed(shapes, shell, closed):
    result = shell(f"{MAP} {closed}")
    assert result.returncode == 0 and "Traceback" not in result.stderr
    assert (shapes / "out.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((shapes / "r.json").read_text())["status"]


@pytest.mark.slow
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_a_batch_runs_without_streams(shapes, shell, closed):
    (shapes / "j.jsonl").write_text(
        json.dumps({"source": "square.svg", "target": "blob.svg", "size": 16}) + "\n"
    )
    result = shell(f"iccm batch j.jsonl -j 1 {closed}")
    assert result.returncode == 0 and "Traceback" not in result.stderr, result.stderr
    assert (shapes / "square-blob.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
@pytest.mark.parametrize(
    "command", ["info square.svg >&-", "--version 2>&-", "doctor >&- 2>&-", "map a.svg b.svg 2>&-"]
)
def test_other_commands_too(shapes, shell, command):
    result = shell(f"iccm {command}")
    assert result.returncode == (2 if command.startswith("map") else 0) and "Traceback" not in result.stderr


@pytest.mark.slow
def test_quiet_does_not_hide_that_a_result_is_doubtful(shapes, iccm):
    pins = ("--pin", "30,50:70,50", "--pin", "70,50:30,50", "--pin-weight", "1000", "--quasi", "0.001")
    result = iccm("map", "disk.svg", "disk.svg", *pins, "--vertices", "60", "--size", "16", "-q")
    assert result.code in (0, 1) and result.err, "the pins change places"
    assert all(line.startswith(("note: ", "error: ")) for line in result.lines)


@pytest.mark.slow
def test_quiet_does_not_hide_a_poor_job_of_a_batch(shapes, iccm):
    job = {
        "source": "square.svg",
        "target": "blob.svg",
        "size": 16,
        "max_iterations": 1,
        "method": "paper",
        "tolerance": 1e-9,
    }
    (shapes / "j.jsonl").write_text(json.dumps({**job, "require_injective": True, "vertices": 8}) + "\n")
    result = iccm("batch", "j.jsonl", "-j", "1", "-q")
    status = json.loads(result.out)["status"]
    assert status == "poor" and result.code == 1 and "poor" in result.err


def test_terminal_controls_in_names_are_written_out(shapes, iccm):
    result = iccm("info", "a\x1b[31m.svg")
    assert result.code == 2 and "\x1b" not in result.err and r"\x1b[31m" in result.err


@pytest.mark.skipif(sys.platform == "win32", reason="names of files")
def test_line_feeds_in_names_do_not_break_messages(shapes, iccm):
    """In names of inputs, of outputs that are reported, in notes, and in jobs of a manifest."""
    (shapes / "a\nerror: b.svg").write_bytes((shapes / "square.svg").read_bytes())
    result = iccm("map", "a\nerror: b.svg", "blob.svg", "-o", "o\n.png", "--size", "32")
    assert result.code == 0 and all(line.isprintable() for line in result.lines)
    assert any(r"o\n.png" in line for line in result.lines)
    assert iccm("map", "no\nne.svg", "blob.svg").lines == [r"error: no\nne.svg: no such file"]
    (shapes / "j.jsonl").write_text(
        json.dumps({"source": "no\nne.svg", "target": "blob.svg", "output": "o.png"})
    )
    (line,) = iccm("batch", "j.jsonl").lines
    assert line.startswith("error: j.jsonl: line 1") and r"no\nne.svg" in line


@pytest.mark.parametrize("name", ["o.png", "o.glb", "o.svg", "o.OBJ", "o.pdf"])
def test_a_report_is_not_written_under_the_name_of_something_else(shapes, iccm, name):
    mesh = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/2\n"
    (shapes / "m.obj").write_text(mesh)
    for line in (
        ("map", "square.svg", "blob.svg"),
        ("deform", "square.svg", "--pin", "20,20:30,20"),
        ("flatten", "m.obj"),
        ("relayout", "m.obj", "m.obj", "-o", "n.obj"),
    ):
        result = iccm(*line, "--report", name)
        assert result.code == 2 and result.lines == [
            f"error: {name}: the report is JSON; choose a name that ends in .json for --report"
        ]
    assert not (shapes / name).exists()


def test_info_escapes_control_characters(shapes, iccm):
    mesh = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\ng a\0b\x1b[31m\nf 1 2 3\nf 1 3 4\n"
    (shapes / "m.obj").write_bytes(mesh.encode())
    result = iccm("info", "m.obj")
    assert (
        result.code == 0 and "a\\x00b\\x1b[31m" in result.out and result.out.replace("\n", "").isprintable()
    )


def test_doubts_are_warnings_to_machines(capsys):
    logs.configure(-1, "json")
    try:
        logs.tell(Doubt("the picture overlaps itself"))
        logs.tell("nothing of that is in doubt")
    finally:
        logs.reset()
    data = json.loads(capsys.readouterr().err)
    assert data == {"level": "warning", "message": "the picture overlaps itself"}
