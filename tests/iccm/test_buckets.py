"""Nearest segments, compared with a search through all of them."""

import numpy as np
import pytest

from iccm.buckets import BucketGrid, nearest_segments


def distances(w, start, end):
    along, off = (end - start)[None], w[:, None] - start[None]
    length = np.abs(along) ** 2
    t = np.clip(
        np.divide((off * along.conj()).real, length, out=np.zeros_like(off.real), where=length > 0), 0, 1
    )
    return np.abs(off - t * along)


@pytest.mark.parametrize("count", [1, 2, 7, 200])
@pytest.mark.parametrize("spread", [0.1, 1.0, 30.0])
def test_nearest_is_nearest(count, spread):
    rng = np.random.default_rng(count)
    draw = lambda n, size: size * (rng.standard_normal(n) + 1j * rng.standard_normal(n))  # noqa: E731
    start, w = draw(count, 1.0), draw(300, spread)
    end = start + draw(count, 0.3)
    nearest, part = nearest_segments(w, start, end)
    away = distances(w, start, end)
    assert np.all((part >= 0) & (part <= 1))
    assert np.allclose(
        np.abs(start[nearest] + part * (end - start)[nearest] - w), away.min(axis=1), rtol=1e-12
    )
    assert np.allclose(away[np.arange(300), nearest], away.min(axis=1), rtol=1e-12)


def test_the_first_of_equally_near_segments_is_used():
    corners = np.array([0, 1, 1 + 1j, 1j])
    nearest, part = nearest_segments(np.array([0.5 + 0.5j, 0]), corners, np.roll(corners, -1))
    assert nearest.tolist() == [0, 0] and part.tolist() == [0.5, 0.0]


def test_segments_without_length_or_on_a_line_and_points_nowhere():
    start = np.array([0, 1, 1, 3], complex)
    end = np.array([1, 1, 3, 4], complex)
    nearest, part = nearest_segments(np.array([2 + 5j, np.nan, np.inf, -7]), start, end)
    assert nearest.tolist() == [2, 0, 0, 0] and part[[0, 3]].tolist() == [0.5, 0.0]


def test_a_bucket_holds_every_box_that_touches_it():
    boxes = np.array([[0, 0, 1, 1], [0.5, 0.5, 4, 0.6], [3, 3, 4, 4]])
    grid = BucketGrid.of(boxes)
    for box, (left, low, right, top) in enumerate(boxes):
        for x, y in ((left, low), (right, top), ((left + right) / 2, (low + top) / 2)):
            bucket = int((y - grid.low.imag) // grid.size) * grid.columns + int(
                (x - grid.low.real) // grid.size
            )
            assert box in grid.patches[grid.begin[bucket] : grid.begin[bucket + 1]]
