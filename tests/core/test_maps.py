"""Kernels of maps, against the same in plain Python."""

import numpy as np
import pytest

from iccm import buckets
from iccm.flips import neighbours
from iccm.maps import refinement
from iccm.maps.triangulated import adjacency
from tests.core.compare import both
from tests.core.reference import refinement as plain_refinement
from tests.triangulations import irregular

BENT = np.array([0, 3 + 0.2j, 2.8 + 1.9j, 1.1 + 0.7j, 0.9 + 2.5j, -0.3 + 1.4j])


def equal(one, other):
    assert len(one) == len(other)
    for a, b in zip(one, other):
        assert np.array_equal(a, b, equal_nan=np.asarray(a).dtype.kind in "fc")


def refine(z, n, room, faces, across, count, triangle_room, stack, stack_room, thin, tiniest2):
    assert (room, triangle_room, stack_room) == (z.size, len(faces), stack.size)
    n, count[0] = plain_refinement._mend(z, n, faces, count[0], across, stack, thin, tiniest2)
    return n


@pytest.mark.parametrize("h", [0.3, 0.15])
def test_refinement_mends_thin_triangles(monkeypatch, h):
    z, faces, _ = irregular(BENT, h, seed=4)
    # most triangles that come from stretched ones are thin
    z = z.real + 0.15j * z.imag

    def work():
        found = refinement.shaped(z, faces)
        return found.z, found.faces, found.across

    one, other = both(monkeypatch, refinement, {"_refine": refine}, work)
    assert len(one[0]) > z.size + 10
    equal(one, other)


def test_edges_of_triangles():
    rng = np.random.default_rng(5)
    z, faces, _ = irregular(BENT, 0.2, seed=5)
    faces = rng.permutation(faces)
    across = neighbours(faces, z.size)
    found = adjacency.edges_across(faces, across)
    expected = plain_refinement._numbered(faces, across)
    equal([found.ends, found.sides, found.rim, found.beside, found.opposite], expected)


def test_pairs_are_sorted_and_equal_ones_stay_in_order(monkeypatch):
    rng = np.random.default_rng(6)
    faces = rng.integers(0, 40, (200, 3))

    def order_pairs(first, second, n, bound, order):
        assert n == first.size and bound > max(first.max(), second.max())
        order[:] = plain_refinement._by_counting(
            first, plain_refinement._by_counting(second, np.arange(n), bound), bound
        )

    def work():
        found = adjacency.edges_of(faces)
        return found.ends, found.sides, found.rim, found.beside, found.opposite

    equal(*both(monkeypatch, adjacency, {"_order_pairs": order_pairs}, work))


def test_nearest_segments_are_those_of_a_look_at_all():
    rng = np.random.default_rng(7)
    draw = lambda n, size: size * (rng.standard_normal(n) + 1j * rng.standard_normal(n))  # noqa: E731
    start, w = draw(150, 1.0), draw(400, 2.0)
    along = draw(150, 0.2)
    along[7] = 0
    start[30], along[30] = start[20], along[20]  # of equals the first
    w[:20], w[20:23] = start[:20], (np.nan, complex(0, np.inf), 1e6)
    segment, part = buckets.nearest_segments(w, start, start + along)
    along = (start + along) - start
    for point, found, share in zip(w, segment, part):
        if not np.isfinite(point):
            assert (found, share) == (0, 0)
            continue
        off = point - start
        length = along.real * along.real + along.imag * along.imag
        t = along.real * off.real + along.imag * off.imag
        t = np.where(t > 0, np.minimum(t / np.where(length > 0, length, 1), 1.0), 0.0)
        x, y = off.real - t * along.real, off.imag - t * along.imag
        best = int(np.argmin(x * x + y * y))
        assert (found, share) == (best, t[best])
