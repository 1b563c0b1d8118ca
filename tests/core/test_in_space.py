"""The energy of a map onto a surface in space, compared with plain Python: equal to the last bit."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from iccm.balanced.minimise import in_space, newton
from iccm.balanced.minimise.energy import Objective, RestShapes, geometry
from iccm.balanced.minimise.in_space import Ground, SurfaceMap
from iccm.balanced.minimise.sliding import Constraints
from iccm.linalg.cholesky import system_of
from iccm.meshes.locate import LocatorArrays
from iccm.meshes.topology import Triangles
from iccm.plane import triangle_areas
from tests.core.reference import in_space as reference

RNG = np.random.default_rng(4)
GRID = 8


def scattered(count):
    """Points of the square from 0 to 1 + i, and counter-clockwise triangles over them."""
    z = RNG.random(count) + 1j * RNG.random(count)
    faces = Delaunay(np.column_stack([z.real, z.imag])).simplices.astype(np.int64)
    clockwise = triangle_areas(z[faces]) < 0
    return z, np.where(clockwise[:, None], faces[:, ::-1], faces)


@pytest.fixture(scope="module")
def ground():
    """A bumpy surface over scattered points, where walks may start anywhere."""
    flat, faces = scattered(60)
    points = np.column_stack([flat.real, flat.imag, 0.4 * np.sin(3 * flat.real + 1) * np.cos(4 * flat.imag)])
    grid = RNG.integers(0, len(faces), (GRID, GRID)).astype(np.int32)
    places = LocatorArrays(flat, faces, Triangles(faces, flat.size).twin, grid, 0j, float(GRID))
    sides, edges = flat[faces][:, 1:] - flat[faces][:, :1], points[faces][:, 1:] - points[faces][:, :1]
    matrix = np.stack([sides.real, sides.imag], axis=1)
    return Ground(places, points, np.ascontiguousarray(edges.transpose(0, 2, 1) @ np.linalg.inv(matrix)))


@pytest.fixture(scope="module")
def mapped(ground):
    """Triangles at rest, the map onto the surface, images of which some lie beside it, and the mesh."""
    z, faces = scattered(30)
    pattern = system_of(faces, np.empty(0, np.int64), z.size)
    gradients, areas = geometry(z, pattern.corners)
    turns = np.sign(triangle_areas(z[pattern.corners]))
    open = np.arange(len(faces)) % 9 == 4
    layout = RestShapes.of(pattern, gradients, areas)
    surface = SurfaceMap.of(ground, layout, 0.8, open, turns)
    u = 1.05 * z + 0.04 * z**2 - 0.03
    return in_space.separate(gradients, areas), surface, u, pattern, faces


def test_the_energy_and_its_derivatives(mapped):
    rest_shapes, surface, u, pattern, _ = mapped
    objective = Objective.of(0.8, 2.0)
    assert in_space.total_in_space(rest_shapes, surface, u, objective) == reference.total_in_space(
        rest_shapes, surface, u, objective
    )
    assert np.isfinite(in_space.total_in_space(rest_shapes, surface, u, objective))
    results = []
    for assemble in (in_space.assemble_in_space, reference.assemble_in_space):
        matrix, gradient = np.empty((pattern.columns.size, 4)), np.empty(u.size, complex)
        energy = assemble(rest_shapes, surface, u, objective, matrix, gradient)
        results.append(
            (energy, matrix, gradient, surface.points.copy(), surface.flat_images.copy(), surface.on.copy())
        )
    for compiled, expected in zip(*results):
        assert np.array_equal(compiled, expected)


def test_a_fold_in_the_layout_is_infinite(mapped):
    rest_shapes, surface, u, _, faces = mapped
    folded = u.copy()
    folded[faces[3, 0]] += 2
    for total in (in_space.total_in_space, reference.total_in_space):
        assert total(rest_shapes, surface, folded, Objective.of(1.0, 1.0)) == np.inf


def test_a_descent_lowers_the_energy_in_space(mapped):
    rest_shapes, surface, u, pattern, faces = mapped
    objective = Objective.of(0.8, 1.0)
    constraints = Constraints.of_fixed(u, np.arange(u.size) < 3)
    system = newton.System.of(pattern, faces, rest_shapes, constraints)
    moved = u.copy()
    energy, steps, _ = newton.descend(system, objective, surface, moved, np.zeros(3), 5, 1e-9)
    assert steps > 0
    assert energy == pytest.approx(
        reference.total_in_space(rest_shapes, surface, moved, objective), rel=1e-12
    )
    assert energy < reference.total_in_space(rest_shapes, surface, u, objective)
    assert np.array_equal(moved[:3], u[:3])
