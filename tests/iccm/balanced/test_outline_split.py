"""Outlines that slide on the last mesh, and are then split at their vertices."""

import numpy as np
import pytest

import iccm
from iccm.balanced.model.boundary_pairs import Match
from iccm.balanced.model.discrete_map import folds
from iccm.balanced.model.energy import WITHOUT_ROTATION
from iccm.balanced.model.outline import Outline
from iccm.balanced.model.outline_split import split_at_vertices
from iccm.balanced.search.levels import Level
from iccm.balanced.search.unit_problem import UnitProblem
from iccm.curve import Curve
from iccm.plane import triangle_areas


def ellipse(vertices: int, axis: float = 1.0, shift: float = 0.0) -> Curve:
    t = 2 * np.pi * (np.arange(vertices) + shift) / vertices
    return Curve(axis * np.cos(t) + 1j * np.sin(t))


@pytest.mark.parametrize(
    ("source_vertices", "target_vertices", "axis"), [(60, 5000, 1.0), (300, 60, 1.0), (200, 333, 2.0)]
)
def test_a_smooth_shape_onto_itself_with_other_vertices_is_the_identity(
    source_vertices, target_vertices, axis
):
    report = iccm.fit(ellipse(source_vertices, axis), ellipse(target_vertices, axis, 0.37)).report()
    assert report["stretch"]["p95"] < 1.01
    assert report["boundary"]["hausdorff"] < 2e-4
    assert report["injective"]["certified"]


def unit(curve: Curve) -> Curve:
    return Curve(curve.z / np.sqrt(curve.area))


def coarse_map(source: Curve, target: Curve):
    level = Level.of(UnitProblem(source, target, WITHOUT_ROTATION), 0.1, 0.0, 6e-4, 20.0, smooth=True)
    even = np.linspace(0, 1, 9)
    return level.started(Match(even * source.length, even * target.length))


def test_a_split_boundary_holds_every_vertex_of_both_outlines():
    source, target = unit(ellipse(75, 1.3)), unit(ellipse(64, 0.8, 0.2))
    state = coarse_map(source, target)
    split = split_at_vertices(state)
    for curve, w in ((source, split.z), (target, split.u)):
        assert np.abs(curve.z[:, None] - w[: split.border]).min(axis=1).max() < 1e-6
    assert split.border < state.border + source.z.size + target.z.size
    assert not folds(split.faces, split.z) and not folds(split.faces, split.u)
    assert triangle_areas(split.z[split.faces]).sum() == pytest.approx(source.area, rel=1e-9)
    assert triangle_areas(split.u[split.faces]).sum() == pytest.approx(target.area, rel=1e-9)
    inner = np.arange(state.border, state.z.size) + split.border - state.border
    assert np.array_equal(split.z[inner], state.z[state.border :])


def test_corners_are_where_the_outline_turns_sharply_for_the_spacing():
    square = Curve(np.array([0, 1, 1 + 1j, 1j]))
    assert Outline.of(square, 0.0, 6e-4, spacing=0.05).corners.size == 4
    assert Outline.of(ellipse(300), 0.0, 6e-4, spacing=0.05).corners.size == 0
    assert Outline.of(ellipse(300), 0.0, 6e-4, spacing=1.0).corners.size > 0
