"""The status line on a terminal, tested with a pseudo-terminal."""

import os
import re
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from iccm.cli import status
from iccm.progress import heard

pty = pytest.importorskip("pty")
WHEEL = Path(__file__).parents[1] / "wheel"


def typed(command, **environment):
    """What a terminal shows of a command (stdout and stderr), and the exit code."""
    master, slave = pty.openpty()
    process = subprocess.Popen(
        command, stdin=slave, stdout=slave, stderr=slave, env={**os.environ, **environment}, close_fds=True
    )
    os.close(slave)
    output = b""
    while chunk := read(master):
        output += chunk
    os.close(master)
    return output.decode(), process.wait()


def read(end):
    try:
        return os.read(end, 1 << 16)
    except OSError:  # raised by Linux at the end of a terminal
        return b""


MAIN = "from iccm.cli import main; main()"
SCRIPT = """
import sys, time
from iccm.cli import logs, status
logs.configure({verbosity}, {form!r})
with status.show_status() as listener:
    assert (listener is None) == {silent}, listener
    if listener:
        listener("solve, starts", 3, 44)
        time.sleep(3.2)
        logs.tell("a note")
        time.sleep(0.7)
        listener("", 0, 0)
        print("result", flush=True)
        time.sleep(0.7)
logs.log.info("the end")
"""


def script(verbosity=0, form="text", silent=False):
    text = SCRIPT.format(verbosity=verbosity, form=form, silent=silent)
    return typed([sys.executable, "-c", text])


@pytest.mark.slow
def test_work_is_shown_with_its_seconds_between_messages(monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    output, code = script()
    assert code == 0, output
    frames = re.split(r"[\r\n]+", output)
    seconds = [
        int(m[1]) for f in frames if (m := re.fullmatch(r"\S+ *\|? 3/44, (\d+) s: solve, starts *", f))
    ]
    assert len(set(seconds)) > 1 and seconds == sorted(seconds)
    assert "note: a note" in frames  # on a separate line
    after = frames[frames.index("note: a note") + 1 :]
    assert "3/44" in after[0]  # the line is back
    assert [f.strip() for f in after if f.strip()][-2:] == ["result", "the end"]


def test_remaining_time_is_estimated_from_finished_work(monkeypatch):
    times = iter(range(0, 100, 10))
    monkeypatch.setattr(status.time, "monotonic", lambda: next(times))
    line = status.StatusLine()
    line("a.svg", 0, 4)  # at 10
    line("b.svg, \x1b[2J", 1, 4)
    assert str(line).endswith(" 1/4, 20 s, about 30 s left: b.svg, \\x1b[2J")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("environment", "coloured"), [({}, True), ({"NO_COLOR": "1"}, False), ({"TERM": "dumb"}, False)]
)
def test_a_terminal_that_takes_colours_gets_them(environment, coloured):
    output, code = typed([sys.executable, "-c", MAIN, "info", "none.svg"], **{"TERM": "xterm", **environment})
    assert code == 2 and ("\x1b[" in output) == coloured and "none.svg" in output


@pytest.mark.parametrize("options", [{"verbosity": -1}, {"form": "json"}])
def test_nothing_is_shown_to_who_wants_less(options):
    output, code = script(**options, silent=True)
    assert code == 0, output
    assert "solve" not in output


def test_without_a_terminal_nothing_is_shown(capsys):
    from iccm.cli import status

    with status.show_status() as listener:
        assert listener is None


def test_commands_that_may_take_long_have_a_line(monkeypatch, tmp_path, iccm):
    lines_shown, names = [], []

    @contextmanager
    def recorded():
        lines_shown.append(True)
        with heard(lambda stage, done, total: names.append(stage)):
            yield None

    monkeypatch.setattr(status, "show_status", recorded)
    for folder in ("run", "baselines"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a.txt").write_text("the same")
    assert iccm("info", str(WHEEL / "square.svg")).code == 0
    assert iccm("check", str(tmp_path / "run"), str(tmp_path / "baselines")).code == 0
    assert len(lines_shown) == 2
    assert [stage.split()[0] for stage in names if stage] == ["read", "compare"]
