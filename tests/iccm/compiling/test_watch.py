"""Compiling is watched: in all threads, once however it nests, and not where the cache has what is asked for."""

import threading

import numpy as np
from numba import njit
from numba.core import event

from iccm.compiling import watch


def nested():
    @njit
    def inner(x):
        return x + 1

    @njit
    def outer(x):
        return inner(x) * 2

    return outer


def test_compiling_is_seen_once_with_all_that_it_needs():
    seen = []
    with watch.watched(seen.append) as clock:
        assert clock.seconds == 0
        function = nested()
        assert not seen
        assert function(3) == 8
        first = clock.seconds
        function(4)
        assert clock.seconds == first > 0
    assert seen == [True, False]
    nested()(3)
    assert seen == [True, False]


def test_other_threads_are_seen():
    seen = []
    with watch.watched(seen.append):
        thread = threading.Thread(target=nested(), args=(3,))
        thread.start()
        thread.join()
    assert seen == [True, False]


def test_what_comes_from_the_cache_is_not_compiled():
    from iccm.maps import cauchy_green

    square = np.array([0, 1, 1 + 1j, 1j])
    cauchy_green.coordinates(square, np.array([0.5 + 0.5j]))  # compiled by now, and in the cache
    seen = []
    with watch.watched(seen.append) as clock:
        cauchy_green.coordinates(square, np.array([0.4 + 0.5j]))
    assert not seen
    assert clock.seconds == 0


def test_what_began_before_the_watch_does_not_upset_it(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(watch.time, "perf_counter", lambda: now[0])
    event.start_event(watch.KIND)
    with watch.watched() as clock:
        now[0] = 1.0
        event.end_event(watch.KIND)
        event.start_event(watch.KIND)
        now[0] = 3.0
        assert clock.seconds == 2.0
        event.end_event(watch.KIND)
        now[0] = 9.0
        assert clock.seconds == 2.0
