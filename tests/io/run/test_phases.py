"""The phases of a job: compiling is one of its own, wherever it happens, and said once."""

import pytest
from numba.core import event

from iccm import progress
from iccm.compiling import watch
from iccm.io.run import phases
from iccm.io.run.phases import COMPILES, Phases


@pytest.fixture
def clock(monkeypatch):
    now = [0.0]

    def wait(seconds):
        now[0] += seconds

    monkeypatch.setattr(watch.time, "perf_counter", lambda: now[0])
    assert phases.time is watch.time
    return wait


def compile_for(seconds, wait):
    with event.trigger_event(watch.KIND):
        wait(seconds / 2)
        with event.trigger_event(watch.KIND):
            wait(seconds / 2)


def test_compiling_counts_as_no_other_phase(clock):
    told = []
    with Phases.of(told.append, None) as found:
        with found.timed("solve"):
            clock(2.0)
        assert not told
        with found.timed("resample"):
            clock(1.0)
            compile_for(20.0, clock)
            clock(0.5)
        with found.timed("solve"):
            compile_for(4.0, clock)
            clock(0.25)
        clock(0.25)
    assert told == [COMPILES]
    wanted = {"solve": 2.25, "resample": 1.5, "evaluate": 0, "compile": 24.0, "total": 28.0}
    assert found.report() == wanted


def test_a_listener_hears_of_compiling_and_then_of_what_it_was_for(clock):
    heard = []
    with Phases.of(lambda said: None, lambda *what: heard.append(what)) as found, found.timed("resample"):
        progress.tell("resample", 32, 64)
        compile_for(1.0, clock)
        progress.tell("resample", 64, 64)
    rows = [("resample", k, 64) for k in (32, 64)]
    assert heard == [("resample", 0, 0), rows[0], ("compile", 0, 0), rows[0], rows[1]]
