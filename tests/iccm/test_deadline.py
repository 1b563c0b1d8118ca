"""Time limits: the best map so far, or one line; no effect if there is enough time."""

import numpy as np
import pytest

import iccm
from iccm import deadline, parallel, progress
from iccm.balanced.errors import OutOfTime, check_time, until_time_is_over
from iccm.flattening import even_layout, flatten
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.mesh import Mesh
from iccm.status import Status
from tests.cases import some_fast
from tests.clock import Clock

SQUARE = np.array([0, 1, 1 + 1j, 1j])
T = np.exp(2j * np.pi * np.arange(90) / 90)
FLOWER = T * (2 + 0.6 * np.cos(5 * np.angle(T)) + 0.2 * np.cos(2 * np.angle(T) + 1))


@pytest.fixture
def clock(monkeypatch):
    return Clock(monkeypatch)


def test_without_a_limit_the_clock_is_not_read(clock):
    iccm.fit(SQUARE, T)
    assert clock.checks == 0


@pytest.mark.slow
def test_enough_time_changes_nothing(clock):
    plain = iccm.fit(SQUARE, FLOWER)
    with deadline.limited(1.0):
        limited = iccm.fit(SQUARE, FLOWER)
    assert clock.checks > 10
    assert limited.map.image.tobytes() == plain.map.image.tobytes() and limited.notes == plain.notes


@pytest.mark.slow
@pytest.mark.parametrize("method", ["balanced", "paper"])
def test_an_interrupted_search_gives_the_best_map_so_far_with_a_note(clock, method):
    options = {"method": method} | ({"vertices": 60} if method == "paper" else {})
    with deadline.limited(1.0):
        iccm.fit(SQUARE, FLOWER, **options)
    checks, maps = clock.checks, 0
    for share in (0.1, 0.3, 0.5, 0.7, 0.9):
        clock.now, clock.step = 0.0, 1 / (share * checks)
        with deadline.limited(deadline.SEARCH_TIME_SHARE * 1.4):
            try:
                fit = iccm.fit(SQUARE, FLOWER, **options)
            except deadline.TimeUp as error:
                assert "--time-limit" in str(error)
                continue
        maps += 1
        assert fit._ended in (Status.LIMIT, Status.GAP) and not fit.status.ok
        assert any("--time-limit" in note for note in fit.notes)
        if method == "balanced":
            assert fit.certificate.share == 1  # an unfinished map does not fold either
    assert maps >= 2


def layout_of(height, n):
    """The layout of a sheet of n × n points of the unit square, lifted by `height(x, y)`."""
    x, y = (w.ravel() for w in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n)))
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = (w.ravel() for w in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    mesh = Mesh.triangles("sheet", np.column_stack([x, y, height(x, y)]), faces)
    return even_layout(flatten(disk_patch(mesh)))


def hill(x, y):
    return 0.9 * np.exp(-9 * ((x - 0.6) ** 2 + (y - 0.45) ** 2))


def slope(x, y):
    return 0.4 * x * x - 0.2 * y


MOVED = [(0.3 + 0.4j, 0.5 + 0.6j), (0.7 + 0.6j, -0.5 - 0.3j)]
CORNER = 0.35 + 0.3j + np.array([0, 0.2, 0.2 + 0.16j, 0.12j])
PROBLEMS = {
    "a surface onto an outline": lambda: (layout_of(hill, 11), FLOWER, {}),
    "an outline onto a surface": lambda: (SQUARE, layout_of(hill, 11), {}),
    "a surface onto a surface": lambda: (layout_of(hill, 11), layout_of(slope, 9), {}),
    "a rigid region": lambda: (SQUARE, FLOWER, {"rigid": [CORNER]}),
    "pins": lambda: (SQUARE, FLOWER, {"pins": MOVED}),
    "exact pins": lambda: (SQUARE, FLOWER, {"pins": MOVED, "exact_pins": True}),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", some_fast(PROBLEMS, {"an outline onto a surface", "pins"}))
def test_ended_searches_with_surfaces_or_constraints_give_a_map_or_a_line(clock, name):
    """A map is the best one so far: it does not fold, and is not reported as finished. A region is rigid, or there is
    an error: maps from before it was are not results.
    """
    source, target, options = PROBLEMS[name]()
    with deadline.limited(1.0):
        iccm.fit(source, target, **options)
    checks, maps, lines = clock.checks, 0, 0
    for share in (
        0.2,
        1.2 if name == "exact pins" else 0.9,
    ):  # pins move to their places after the search for frames
        clock.now, clock.step = 0.0, 1 / (share * checks)
        with deadline.limited(deadline.SEARCH_TIME_SHARE * 1.4):
            try:
                fit = iccm.fit(source, target, **options)
            except deadline.TimeUp as error:
                assert "--time-limit" in str(error)
                lines += 1
                continue
        maps += 1
        assert fit._ended in (Status.LIMIT, Status.GAP) and not fit.status.ok
        assert any("--time-limit" in note for note in fit.notes)
        assert fit.certificate.share == 1
    assert lines >= 1
    if name not in ("a rigid region", "a surface onto a surface"):
        assert maps >= 1


def test_no_map_before_the_time_is_over_is_a_line(clock):
    clock.step = 10.0
    for options in ({}, {"method": "conformal"}, {"pins": [(0.5 + 0.5j, 0.1j)]}):
        with deadline.limited(1.0), pytest.raises(deadline.TimeUp, match="took longer than 1 s"):
            iccm.fit(SQUARE, FLOWER, **options)


def test_loops_and_threads_end_when_the_time_is_over(clock):
    done = []
    with deadline.limited(10.0):
        clock.now = 11.0
        with pytest.raises(deadline.TimeUp, match="rows"):
            list(progress.counted("rows", range(9)))
        for threads in (1, 3):
            with pytest.raises(deadline.TimeUp):
                parallel.over_slices(done.append, 100, threads, 10)
            with pytest.raises(deadline.TimeUp):
                list(parallel.in_order(done.append, range(9), threads))
        with pytest.raises(OutOfTime):
            check_time()
        with deadline.limited(None):
            check_time()
    assert not done


def test_an_expired_deadline_names_the_last_stage(clock):
    with deadline.limited(1.0):
        progress.tell("pins moved")
        clock.now = 0.8
        with pytest.raises(OutOfTime, match="pins moved"):
            check_time()
        clock.now = 2.0
        with pytest.raises(deadline.TimeUp, match="pins moved"):
            parallel.over_slices(lambda part: None, 9, 1)


def test_attempts_before_the_end_are_kept(clock):
    def attempts():
        yield 1
        clock.now = 9.0
        check_time()
        yield 2

    with deadline.limited(1.0):
        assert list(until_time_is_over(attempts())) == [1]


def test_reading_a_drawing_ends_when_the_time_is_over(clock, tmp_path):
    from iccm.io.shapes import shape

    file = tmp_path / "two.svg"
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0H5V3Z"/><path d="M9 0H8V3Z"/></svg>'
    )
    with deadline.limited(1.0):
        clock.now = 2.0
        with pytest.raises(deadline.TimeUp, match=r"two\.svg: .*--time-limit"):
            shape.read(str(file), whole=True)
