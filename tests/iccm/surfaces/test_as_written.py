"""Whether new texture coordinates are one-to-one, by exact signs, even if a hole is a slit."""

import numpy as np
import pytest

from iccm.curve import Curve
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.flatten import Flattening
from iccm.meshes.mesh import Mesh
from iccm.surfaces.as_written import WrittenCoordinates

OUTER = np.array([0, 6, 6 + 5j, 5j])
INNER = np.array([2 + 2j, 4 + 2j, 4 + 3j, 2 + 3j])


def frame(inner):
    """A frame of eight triangles around a hole whose corners are at `inner`, with its layout."""
    flat = np.concatenate([OUTER, INNER])
    quads = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    faces = np.array([half for a, b, c, d in quads for half in ((a, b, c), (a, c, d))])
    points = np.column_stack([flat.real, flat.imag, np.zeros(8)])
    patch = disk_patch(Mesh.triangles("frame", points, faces))
    outer = next(loop for loop in patch.loops if 0 in patch.vertex[loop])
    layout = Flattening(patch, flat[patch.vertex], outer, "lscm")
    return WrittenCoordinates.of(np.concatenate([OUTER, inner])[patch.vertex], layout, Curve(OUTER))


@pytest.mark.parametrize(
    ("inner", "certified"),
    [
        (INNER, True),
        (np.array([2 + 2j, 4 + 2j, 4 + 2.5j, 2 + 2.5j]), True),
        (np.array([2 + 2.5j, 3 + 2.5j, 4 + 2.5j, 3 + 2.5j]), True),  # a slit
        (np.array([2 + 3j, 4 + 3j, 4 + 2j, 2 + 2j]), False),  # flipped
        (INNER + 3, False),  # outside
    ],
)
def test_a_hole_may_be_open_or_a_slit_but_not_inverted(inner, certified):
    certificate = frame(inner)
    assert certificate.one_to_one == certified
    assert ("injective" in certificate.report()) == certified
