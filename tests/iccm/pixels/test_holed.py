"""Holes of the target stay empty, with smooth rims, and nothing else changes."""

import numpy as np
import pytest

from iccm.pixels import preimages
from iccm.pixels.canvas import Canvas
from iccm.pixels.holed import Holed
from tests.triangulations import irregular, map_of

SQUARE = np.array([0, 1, 1 + 1j, 1j])


@pytest.mark.parametrize("way", [1, -1])
def test_pixels_in_holes_are_empty(way):
    map = map_of(irregular(SQUARE, 0.1), lambda w: w)
    canvas = Canvas(50, 50, (-0.1 - 0.1j, 1.1 + 1.1j))
    hole = 0.5 + 0.5j + 0.2 * np.exp(2j * np.pi * np.arange(100) / 100)[::way]
    whole = preimages.of(map, canvas, 1e-3).band(0)
    found = preimages.of(Holed(map, [hole]), canvas, 1e-3).band(0)
    pixel = canvas.step[0] * canvas.step[1]
    assert (whole.coverage.sum() - found.coverage.sum()) * pixel == pytest.approx(np.pi * 0.04, rel=1e-3)
    kept = found.coverage > 0
    assert np.array_equal(found.z[kept], whole.z[kept]) and np.isnan(found.z[~kept]).all()
    lost = whole.diagnostics.inside - found.diagnostics.inside
    assert lost * pixel == pytest.approx(np.pi * 0.04, rel=0.02)
    assert ((found.coverage > 0) & (found.coverage < 1)).sum() > (
        (whole.coverage > 0) & (whole.coverage < 1)
    ).sum()
