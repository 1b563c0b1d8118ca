"""Stable orders in linear time, compared with NumPy's."""

from itertools import pairwise

import numpy as np

from iccm.sorting import counting_order, counting_order_of_pairs, grouped


def test_equal_numbers_stay_in_order():
    keys = np.random.default_rng(1).integers(0, 30, 200)
    assert np.array_equal(counting_order(keys, 30), np.argsort(keys, kind="stable"))
    assert np.array_equal(counting_order(keys[::3], 40), np.argsort(keys[::3], kind="stable"))
    assert counting_order(np.empty(0, np.int64), 1).size == 0


def test_groups_hold_the_places_of_each_number_in_order():
    keys = np.array([4, 1, 4, 0, 4, 1])
    indices, starts = grouped(keys, 6)
    assert [indices[a:b].tolist() for a, b in pairwise(starts)] == [[3], [1, 5], [], [], [0, 2, 4], []]
    assert [part.tolist() for part in grouped(np.empty(0, np.int64), 0)] == [[], [0]]


def test_pairs_are_ordered_by_the_first_number_then_by_the_second():
    first, second = np.random.default_rng(2).integers(0, 9, (2, 150))
    assert np.array_equal(counting_order_of_pairs(first, second, 9), np.lexsort([second, first]))
