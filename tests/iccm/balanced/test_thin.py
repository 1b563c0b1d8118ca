"""Thin shapes: their maps are found on meshes no larger than those of other shapes, with as few starts."""

import numpy as np
import pytest

import iccm
from iccm.balanced.model import discrete_map

SQUARE = np.array([5 + 5j, 95 + 5j, 95 + 95j, 5 + 95j])
DART = np.array([0, 50 + 49.9j, 100, 50 + 50j]).conj()[::-1]
"""An arrowhead, a thousandth as wide as it is long, with a concavity 500 times its area."""


@pytest.fixture
def untangled(monkeypatch):
    """The number of vertices of each mesh on which folds were removed."""
    sizes: list[int] = []
    untangle = discrete_map.untangle

    def counted(pattern, rest_shapes, u, *args):
        sizes.append(u.size)
        return untangle(pattern, rest_shapes, u, *args)

    monkeypatch.setattr(discrete_map, "untangle", counted)
    return sizes


@pytest.mark.slow
@pytest.mark.parametrize("pair", [(SQUARE, DART), (DART, SQUARE)])
def test_an_arrowhead_of_wire_has_a_symmetric_map_after_few_starts(untangled, pair):
    fit = iccm.fit(*pair)
    assert fit.status.ok and fit.certificate.share == 1
    assert sum(size > 1000 for size in untangled) < 20 and max(untangled) < 20_000
    mirrored = fit.map(100 - fit._interior.conj())
    assert np.nanmax(np.abs(100 - mirrored.conj() - fit.map(fit._interior))) < 1e-6
