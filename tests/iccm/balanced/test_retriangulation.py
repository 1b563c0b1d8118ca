"""Edge flips in a map's triangulation that decrease its energy."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from iccm.balanced.meshing.mesh import Sizes
from iccm.balanced.model.boundary_mesh import mesh_boundary
from iccm.balanced.model.boundary_pairs import Match
from iccm.balanced.model.discrete_map import DiscreteMap, folds
from iccm.balanced.model.energy import WITHOUT_ROTATION
from iccm.balanced.model.inner_constraints import InnerConstraints
from iccm.balanced.model.retriangulation import flip_edges
from iccm.balanced.search.levels import Level
from iccm.balanced.search.unit_problem import UnitProblem
from iccm.curve import Curve
from tests.cases import some_fast

SQUARE = Curve(np.array([-0.5 - 0.5j, 0.5 - 0.5j, 0.5 + 0.5j, -0.5 + 0.5j]))
BAR = Curve(np.array([-1 - 0.25j, 1 - 0.25j, 1 + 0.25j, -1 + 0.25j]))


def square_onto_bar() -> DiscreteMap:
    level = Level.of(UnitProblem(SQUARE, BAR, WITHOUT_ROTATION), 0.15, 0.0, 0.0, 20.0)
    corners = np.arange(5) / 4
    return level.started(Match(corners * SQUARE.length, BAR.knots))


def flips(state: DiscreteMap) -> list[np.ndarray]:
    """The triangulations after one flip of an inner edge that does not join two vertices of the outline."""
    faces, flipped_edges = state.faces.tolist(), []
    beyond = {(tri[k], tri[k - 2]): (t, tri[k - 1]) for t, tri in enumerate(faces) for k in range(3)}
    for (b, c), (t, a) in beyond.items():
        if b < c and (c, b) in beyond:
            neighbour, d = beyond[c, b]
            if min(a, d) >= state.border or max(a, d) >= state.border > min(a, d):
                flipped = state.faces.copy()
                flipped[t], flipped[neighbour] = (a, b, d), (a, d, c)
                if not folds(flipped, state.z) and not folds(flipped, state.u):
                    flipped_edges.append(flipped)
    return flipped_edges


@pytest.mark.slow
@pytest.mark.parametrize("q", some_fast([1.0, 3.0], {3.0}))
def test_no_flip_of_an_edge_lowers_the_energy_any_further(q):
    before = square_onto_bar()
    after = flip_edges(before, q)

    least = energy_at(after, after.faces, q)
    assert least < energy_at(before, before.faces, q)
    assert all(energy_at(after, faces, q) > (1 - 1e-6) * least for faces in flips(after))


def energy_at(state: DiscreteMap, faces, q: float) -> float:
    """The energy of triangles, from singular values."""
    total = 0.0
    for z, u in zip(state.z[faces], state.u[faces]):
        (e, f), (g, h) = [[w[1] - w[0], w[2] - w[0]] for w in (z, u)]
        source, image = (
            np.array([[e.real, f.real], [e.imag, f.imag]]),
            np.array([[g.real, h.real], [g.imag, h.imag]]),
        )
        large, small = np.linalg.svd(image @ np.linalg.inv(source), compute_uv=False)
        d = large * small
        core = (large / small + small / large) / 2 * (d + 1 / d) / 2
        total += 0.5 * np.linalg.det(source) * core**q * (1 + d) / 2
    return total


def test_vertices_and_both_areas_stay():
    before = square_onto_bar()
    after = flip_edges(before, 3.0)
    assert np.array_equal(before.z, after.z) and np.array_equal(before.u, after.u)
    assert not folds(after.faces, after.z) and not folds(after.faces, after.u)
    assert len(after.faces) == len(before.faces)
    again = flip_edges(after, 3.0)
    assert np.array_equal(np.sort(again.faces, axis=1), np.sort(after.faces, axis=1))
    assert after.forward(3.0, 5, 1e-3).value < np.inf


def test_voids_and_rigid_regions_keep_their_triangles():
    before = square_onto_bar()
    some = np.abs(before.z[before.faces].mean(axis=1)) < 0.3
    for kept in (
        replace(before, weights=np.where(some, 1e-2, 1.0)),
        replace(before, rigid=np.where(some, 0, -1)),
    ):
        after = flip_edges(kept, 3.0)
        assert np.array_equal(after.faces[some], before.faces[some])
        assert not np.array_equal(after.faces, before.faces)


def test_edges_of_strokes_stay():
    match, lost = Match(np.arange(5) / 4 * SQUARE.length, BAR.knots), 0
    level = Level.of(UnitProblem(SQUARE, BAR, WITHOUT_ROTATION), 0.15, 0.0, 0.0, 20.0)
    for turn in np.exp(1j * np.linspace(0, np.pi, 13)):
        ends = np.array([-0.08, 0.08]) * turn
        inside = InnerConstraints.of_pins(np.stack([ends, ends], axis=1))
        stroke = inside._replace(links=np.array([1, -1]))
        state = mesh_boundary(level.boundary(match), Sizes.even(0.01), stroke).unfold_from_harmonic()
        edge = state.border + np.arange(2)
        assert is_edge(state.faces, edge) and is_edge(flip_edges(state, 3.0).faces, edge)
        lost += not is_edge(flip_edges(replace(state, inside=inside), 3.0).faces, edge)
    assert lost


def is_edge(faces, ends) -> bool:
    return bool((np.isin(faces, ends).sum(axis=1) == 2).any())


NEEDLES = """
import numpy as np
from iccm.balanced.model.retriangulation import _flip_to_lower_energy as flip

rng = np.random.default_rng(1)
for _ in range(100_000):
    x, height = np.sort(rng.uniform(0, 1, 2)), 10 ** rng.uniform(-13.5, -10)
    upward = height * rng.uniform(0.1, 1, 4) * [0, -1j, 1j, 0]
    z = (np.array([0, x[0], x[1], 1]) + upward) * np.exp(1j * rng.uniform(0, np.pi)) + complex(*rng.uniform(0, 1, 2))
    u = np.array([0, *rng.uniform(0.2, 0.8, 2), 1]) + height * rng.uniform(0.1, 1, 4) * [0, -1j, 1j, 0]
    faces, across = np.array([[0, 1, 2], [3, 2, 1]]), np.array([[1, -1, -1], [0, -1, -1]])
    stack, links = np.array([2, 0, 1] + 13 * [0]), np.array([], np.int64)
    flip(z, u, faces, across, stack, stack.size, np.zeros(2, bool), 0, links, 0, 1.0, 1.0, 0.5)
    assert sorted(faces.ravel()) in ([0, 1, 1, 2, 2, 3], [0, 0, 1, 2, 3, 3])
"""


def test_flips_of_needles_end():
    """Rounding gives needles another energy for each order of their corners; compiled code cannot be interrupted."""
    subprocess.run([sys.executable, "-c", NEEDLES], check=True, timeout=100)
