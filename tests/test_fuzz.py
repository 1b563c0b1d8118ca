"""A slice of the fuzzing for every run; `python -m tests.fuzz --count 10000` does more."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests import fuzz


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="limits of processes")
@pytest.mark.parametrize("kind", fuzz.SEEDS)
def test_mutated_inputs_are_read_or_refused_in_one_line(kind):
    assert fuzz.hunt(kind, 0, 20 // fuzz.SLOW.get(kind, 1)) == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", fuzz.SEEDS)
def test_the_seeds_themselves_are_read(kind, tmp_path):
    fuzz.read(kind, tmp_path, fuzz.SEEDS[kind])


def test_the_hunt_sees_trouble(tmp_path, monkeypatch):
    def fail(kind, folder, data):
        raise IndexError("planted")

    monkeypatch.setattr(fuzz, "read", fail)
    assert "IndexError: planted" in fuzz.refusal("svg", 1, tmp_path)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="elsewhere only the peak of both is known")
def test_memory_of_the_process_that_hunts_is_not_counted():
    """A test's process may have held gigabytes before it starts the child."""
    held = bytearray(fuzz.MEMORY + (64 << 20))
    held[::4096] = bytes(len(range(0, len(held), 4096))).replace(b"\0", b"\1")
    assert fuzz.hunt("jsonl", 0, 1) == []
