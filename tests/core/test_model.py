"""Flips that lower a map's energy, against the same in plain Python: the same triangles in the same order."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from iccm.balanced.model import retriangulation
from iccm.maps.triangulated.adjacency import neighbours
from tests.core.reference import model as reference


@pytest.mark.parametrize("theta, q, share", [(1.0, 1.0, 0.5), (0.4, 3.0, 1.0), (2.0, 2.5, 0.0)])
@np.errstate(divide="ignore", over="ignore", invalid="ignore")
def test_flips_that_lower_the_energy(theta, q, share):
    rng = np.random.default_rng(11)
    z = (rng.random(120) + 1j * rng.random(120)) * 0.7
    u = 1.6 * z.real + 0.5j * z.imag + 0.3 * z**2
    faces = Delaunay(np.column_stack([z.real, z.imag])).simplices.astype(np.int64)
    fixed, links = np.arange(len(faces)) % 7 == 3, rng.integers(-1, 20, 20)
    results = []
    for compiled in (True, False):
        new, across = faces.copy(), neighbours(faces, z.size)
        stack = np.append(len(faces), np.resize(np.arange(len(faces)), 3 * len(faces)))
        arguments = z, u, new, across, stack
        how = theta, q, share
        if compiled:
            retriangulation._flip_to_lower_energy(*arguments, stack.size, fixed, 25, links, links.size, *how)
        else:
            reference.flip_to_lower_energy(*arguments, fixed, 25, links, *how)
        assert stack[0] == 0
        results.append((new, across))
    assert np.array_equal(results[0][0], results[1][0]) and np.array_equal(results[0][1], results[1][1])
    assert not np.array_equal(results[0][0], faces)
