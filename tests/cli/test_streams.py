"""Closed streams, and who may speak on stderr."""

import json

import pytest

MAP = "iccm map square.svg blob.svg --method paper --vertices 40 --size 32 -o out.png --report r.json"


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", "<&- >&- 2>&-"])
def test_streams_may_be_closed(shapes, shell, closed):
    done = shell(f"{MAP} {closed}")
    assert done.returncode == 0 and "Traceback" not in done.stderr
    assert (shapes / "out.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((shapes / "r.json").read_text())["status"]


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_a_batch_runs_without_streams(shapes, shell, closed):
    (shapes / "j.jsonl").write_text(
        json.dumps({"source": "square.svg", "target": "blob.svg", "size": 16}) + "\n"
    )
    done = shell(f"iccm batch j.jsonl -j 1 {closed}")
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
    assert (shapes / "square-blob.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "command", ["info square.svg >&-", "--version 2>&-", "doctor >&- 2>&-", "map a.svg b.svg 2>&-"]
)
def test_other_commands_too(shapes, shell, command):
    done = shell(f"iccm {command}")
    assert done.returncode == (2 if command.startswith("map") else 0) and "Traceback" not in done.stderr


def test_quiet_does_not_hide_that_a_result_is_doubtful(shapes, iccm):
    pins = ("--pin", "30,50:70,50", "--pin", "70,50:30,50", "--pin-weight", "1000", "--quasi", "0.001")
    typed = iccm("map", "disk.svg", "disk.svg", *pins, "--vertices", "60", "--size", "16", "-q")
    assert typed.code in (0, 1) and typed.err, "the pins change places"
    assert all(line.startswith(("note: ", "error: ")) for line in typed.lines)


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
    typed = iccm("batch", "j.jsonl", "-j", "1", "-q")
    status = json.loads(typed.out)["status"]
    assert status == "poor" and typed.code == 1 and "poor" in typed.err


def test_terminal_controls_in_names_are_written_out(shapes, iccm):
    typed = iccm("info", "a\x1b[31m.svg")
    assert typed.code == 2 and "\x1b" not in typed.err and r"\x1b[31m" in typed.err
