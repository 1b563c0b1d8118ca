"""Progress: who receives reports, and that every method reports what it does."""

import threading

import numpy as np
import pytest

import iccm
from iccm import progress

SQUARE = np.array([0, 1, 1 + 1j, 1j])
DROP = np.array([0, 1, 1.3 + 0.7j, 1.1 + 1.4j, 0.2 + 1.1j, -0.3 + 0.5j])


@pytest.fixture
def heard():
    messages = []
    with progress.heard(lambda *message: messages.append(message)):
        yield messages


def test_a_listener_hears_progress_inside_its_block(heard):
    progress.tell("one")
    with progress.within("outer"):
        assert list(progress.counted("two", "ab")) == ["a", "b"]
        with progress.within("inner"):
            progress.tell("three", 1, 2)
    with progress.heard(None):
        progress.tell("nobody")
    list(progress.counted("four", iter("a")))
    assert heard == [
        ("one", 0, 0),
        ("outer, two", 0, 2),
        ("outer, two", 1, 2),
        ("outer, inner, three", 1, 2),
        ("four", 0, 0),
    ]


def test_other_threads_are_not_heard(heard):
    thread = threading.Thread(target=progress.tell, args=("beside",))
    thread.start()
    thread.join()
    assert not heard


def test_nobody_need_listen():
    progress.tell("nobody")
    with progress.within("outer"):
        assert list(progress.counted("nobody", "ab")) == ["a", "b"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "stages"),
    [
        (
            {},
            [
                "starts",
                "coarse maps, 3 steps",
                "coarse maps, corners released",
                "fine map",
                "last map",
            ],
        ),
        ({"pins": [(0.5 + 0.5j, 0.5 + 0.6j)]}, ["starts", "coarse maps, 3 steps", "fine map", "last map"]),
        (
            {"pins": [(0.5 + 0.5j, 0.5 + 0.6j)], "exact_pins": True},
            ["starts", "pins moved", "fine map", "last map"],
        ),
        (
            {"method": "conformal"},
            ["harmonic measure", "Möbius maps", "Möbius maps polished", "rounds"],
        ),
        ({"method": "paper"}, ["steps"]),
    ],
)
def test_every_method_reports_its_stages_in_order_with_the_same_result(options, stages, heard):
    fit = iccm.fit(SQUARE, DROP, **options)
    names = list(dict.fromkeys(stage for stage, _, _ in heard))
    assert [name for name in names if name in stages] == stages
    assert all(0 <= done < total for _, done, total in heard if total)
    with progress.heard(None):
        alone = iccm.fit(SQUARE, DROP, **options)
    z = np.array([0.3 + 0.3j, 0.9 + 0.2j])
    assert np.array_equal(fit.map(z), alone.map(z))


def test_pictures_report_their_rows(heard):
    fit = iccm.fit(SQUARE, 2 * SQUARE)
    heard.clear()
    iccm.warp(fit, iccm.checkerboard(16), size=300)
    rows = [done for stage, done, total in heard if stage == "resample" and total == 300]
    assert rows == [0, 128, 256]
