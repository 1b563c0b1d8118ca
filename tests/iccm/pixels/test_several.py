"""Several maps as one: every pixel shows the first part that covers it, parts that meet leave no seam."""

import numpy as np

from iccm.curve import Curve
from iccm.pixels import preimages
from iccm.pixels.canvas import Canvas
from iccm.pixels.several import Several
from iccm.pixels.stmap import stmap
from tests.triangulations import irregular, map_of

SQUARE = np.array([0, 1, 1 + 1j, 1j])


def square(size, to, shift):
    """A map of the unit square onto one of another size and place; its source lies elsewhere."""
    return map_of(irregular(SQUARE, 0.3), lambda w: w + shift).moved(image=(size, 0, to))


def several(*maps):
    return Several(
        maps, [Curve(np.concatenate([each.image[loop] for loop in each.loops])).box for each in maps]
    )


def bands(map, canvas):
    source = preimages.of(map, canvas, 1e-3)
    return [source.band(row) for row in range(0, canvas.height, 32)]


def test_small_parts_lie_over_large_ones():
    below, above = square(8, 1 + 1j, 100), square(2, 4 + 4j, 200)
    canvas = Canvas(100, 100, (0, 10 + 10j))
    found = bands(several(above, below), canvas)
    z, cover = (np.concatenate([getattr(band, name) for band in found]) for name in ("z", "coverage"))
    assert (z[42:58, 42:58].real > 199).all() and (z[12:38, 12:88].real < 102).all()
    assert (cover[11:89, 11:89] == 1).all() and cover[:9].max() == 0 and np.isnan(z[:9]).all()
    assert np.isfinite(z[cover > 0]).all()
    alone = bands(below, canvas)
    assert np.array_equal(found[0].z[:38], alone[0].z[:38], equal_nan=True)
    assert np.array_equal(found[0].right[:38], alone[0].right[:38], equal_nan=True)


def test_parts_that_share_an_edge_leave_no_seam():
    left, right = square(5, 0, 0), square(5, 5, 10)
    canvas = Canvas(33, 33, (0, 10 + 10j))  # the edge runs through the middle of a column
    (band, last) = bands(several(left, right), canvas)
    cover = np.concatenate([band.coverage, last.coverage])
    assert np.abs(cover[18:] - 1).max() < 1e-5
    rows = np.concatenate(list(stmap(several(left, right), (0, 11 + 1j), canvas)))
    assert rows.shape == (33, 33, 4) and rows[25, 3, 0] < 0.1 < 0.9 < rows[25, 30, 0]
