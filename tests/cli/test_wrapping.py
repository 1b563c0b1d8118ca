"""Messages on a terminal are wrapped at words; names that users may copy are not broken."""

import sys

import click
import pytest

from iccm.cli import logs
from iccm.cli.status import StatusLine

LONG = (
    "drawings/a-rather-long-name.svg: ignored 2 other outlines, the largest with 1.5% of this one's "
    "area; #id or #2 selects another, --parts all maps all of them"
)


@pytest.fixture
def terminal(monkeypatch):
    def with_columns(columns):
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
        monkeypatch.setenv("COLUMNS", str(columns))

    return with_columns


@pytest.mark.parametrize("columns", [80, 120, 60])
@pytest.mark.parametrize("label", ["note: ", click.style("note:", fg="yellow") + " "])
def test_lines_fit_and_words_stay_whole(terminal, columns, label):
    terminal(columns)
    lines = logs.wrapped(label + LONG).split("\n")
    assert len(lines) > 1 and max(len(click.unstyle(line)) for line in lines) < columns
    assert click.unstyle(" ".join(line.strip() for line in lines)) == "note: " + LONG
    assert lines[0].startswith(label) and all(line.startswith("  ") for line in lines[1:])


def test_names_longer_than_a_line_are_not_broken(terminal):
    terminal(50)
    name = "folder/" + "x" * 70 + ".svg"
    assert any(
        name in line for line in logs.wrapped(f"error: {name}: no such file, name another one").split("\n")
    )


def test_notes_are_not_wrapped_without_a_terminal(monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: False, raising=False)
    assert logs.wrapped(LONG) == LONG


def test_short_remaining_times_are_not_shown(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("iccm.cli.status.time.monotonic", lambda: now[0])
    line = StatusLine()
    line("steps", 0, 10)
    now[0] = 104.0
    line("steps", 1, 10)
    assert "about 36 s left" in str(line)
    line("steps", 9, 10)
    assert "left" not in str(line)
    line("steps", 10, 10)
    assert "left" not in str(line) and "0 s left" not in str(line)
