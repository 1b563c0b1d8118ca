"""Which of many coarse maps is refined."""

from dataclasses import replace

import numpy as np
import pytest

from iccm.balanced.errors import Stuck, Tangled
from iccm.balanced.model.discrete_map import folds
from iccm.balanced.model.energy import Energy
from iccm.balanced.model.solution import SolveLog
from iccm.balanced.search import candidates, initial_matches, levels, multilevel
from iccm.balanced.search.levels import Level, initial_maps
from iccm.balanced.search.unit_problem import UnitProblem
from iccm.curve import Curve
from iccm.options import Options

FLAG = np.array([0, 3, 2.5 + 0.6j, 3.1 + 1.5j, 1 + 1.7j, 0.9 + 3j, 0.2 + 2.9j])
SHIELD = np.array([-1 + 1j, -1 - 0.2j, -1.3j, 1 - 0.2j, 1 + 1j, 1.2j])


def unit(z):
    curve = Curve.domain(z - z.mean())
    return Curve(curve.z / np.sqrt(curve.area))


PROBLEM = UnitProblem(unit(FLAG), unit(SHIELD), Energy())
LEVEL = Level.of(PROBLEM, 0.15, *multilevel.COARSE_EXACTNESS, multilevel.STEEPEST)


@pytest.fixture(scope="module")
def screened():
    matches = initial_matches.candidates(LEVEL.source.curve, LEVEL.target.curve, initial_matches.TURNS)
    return candidates.screen(initial_maps(LEVEL, matches), PROBLEM.options.effort)


def test_equivalent_maps_are_refined_once(screened):
    nearly = [replace(state, value=state.value * (1 + 1e-5)) for state in screened]
    once = candidates.without_duplicates(screened)
    assert candidates.without_duplicates([*once, *nearly]) == once


def test_rotated_maps_are_not_equivalent(screened):
    first, rotated = screened[0], replace(screened[0], u=screened[0].u * np.exp(0.1j))
    assert candidates.are_equivalent(first, first) and not candidates.are_equivalent(first, rotated)


def test_the_winner_is_about_as_good_as_any_map_released_to_the_end(screened):
    won = candidates.best_of(LEVEL, screened)
    settled = (candidates.settle(LEVEL, state, candidates.ROUNDS) for state in screened)
    ends = [candidates.release_corners(LEVEL, state).value for state in settled]
    assert not folds(won.faces, won.u)
    assert won.value <= 1.01 * min(ends)


def test_without_maps_there_is_no_winner():
    with pytest.raises(Stuck):
        candidates.best_of(LEVEL, [])


def test_more_starts_are_tried_on_request():
    level, problem = LEVEL, PROBLEM._replace(options=Options(effort=3))
    few, many = (multilevel.correspondences(replace(level, problem=given)) for given in (PROBLEM, problem))
    assert len(many) >= len(few) + 2 * initial_matches.ARCLENGTH_SHIFTS
    values = [multilevel.best_of_starts(given, 0.15, SolveLog()).value for given in (PROBLEM, problem)]
    assert values[1] <= values[0]


MATCHES = initial_matches.candidates(LEVEL.source.curve, LEVEL.target.curve, initial_matches.TURNS)


def test_fewer_starts_are_tried_where_their_meshes_are_large(monkeypatch):
    every = initial_maps(LEVEL, MATCHES)
    monkeypatch.setattr(levels, "MOST_START_VERTICES", 2.5 * every[0].z.size)
    few = initial_maps(LEVEL, MATCHES)
    more = initial_maps(replace(LEVEL, problem=PROBLEM._replace(options=Options(effort=2))), MATCHES)
    assert len(few) == 3 < len(more) < len(every)
    for state, first in zip(few, every):
        np.testing.assert_array_equal(state.u, first.u)


@pytest.mark.parametrize("tangled, tried", [(4, len(MATCHES)), (len(MATCHES), 5)])
def test_starts_around_regions_end_where_none_of_the_first_has_a_map(monkeypatch, tangled, tried):
    level, seen = replace(LEVEL, problem=PROBLEM._replace(cut_out=1)), []
    first_start = initial_maps(LEVEL, MATCHES[:1])[0]

    def started(self, match):
        seen.append(match)
        if len(seen) <= tangled:
            raise Tangled(first_start.u)
        return first_start

    monkeypatch.setattr(Level, "started", started)
    starts = initial_maps(level, MATCHES)
    assert len(seen) == tried and len(starts) == max(0, tried - tangled)
