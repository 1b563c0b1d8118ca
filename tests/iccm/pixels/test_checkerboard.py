"""The numbered checkerboard: its digits, at every size."""

import subprocess
import sys

import numpy as np
import pytest

from iccm.pixels.checkerboard import STROKES, _drawn, checkerboard

HEIGHT = 30.0


def test_digits_differ_from_each_other_and_from_their_mirror_images():
    drawn = [_drawn(str(k), HEIGHT) for k in range(10)]
    ink = drawn[8].sum()
    for k, digit in enumerate(drawn):
        for mark in drawn[k + 1 :]:
            assert np.abs(digit - mark).sum() > 0.1 * ink
        if k not in (0, 8):
            assert np.abs(digit - digit[:, ::-1]).sum() > 0.1 * ink
    assert np.allclose(drawn[6], drawn[9][::-1, ::-1], atol=1e-6)


def test_a_line_covers_its_length_times_its_thickness():
    """The stem of the 4 is separate at its foot: its width in a row is the line's thickness."""
    rows = _drawn("4", 200.0).sum(axis=1)
    assert rows[int(0.99 * rows.size) - 45] == pytest.approx(0.22 * 200, rel=0.02)
    assert len(STROKES) == 10


@pytest.mark.parametrize(("size", "cells"), [(7, 8), (64, 8), (100, 3), (1024, 8)])
def test_numbers_stand_in_the_middle_of_their_cells(size, cells):
    picture = checkerboard(size, cells)
    assert picture.shape == (size, size, 3) and picture.dtype == np.uint8
    if size < 64:
        return
    edges = np.round(np.linspace(0, size, cells + 1)).astype(int)
    for i in range(cells):
        cell = picture[edges[i] : edges[i + 1], edges[-2] : edges[-1]].astype(int)
        marked = np.argwhere(np.abs(cell - cell[0, 0]).sum(axis=2) > 100)
        middle = (marked.min(axis=0) + marked.max(axis=0)) / 2
        assert np.abs(middle - (np.array(cell.shape[:2]) - 1) / 2).max() <= 2 + 0.05 * size / cells


def test_cells_are_numbered_row_by_row():
    """The first row of ten by ten shows 0 to 9: each cell has the ink of its digit."""
    picture = checkerboard(1000, 10).astype(float)
    for k in range(10):
        cell = picture[:100, 100 * k : 100 * k + 100].sum(axis=2)
        ink = np.abs(cell - cell[0, 0])
        assert ink.sum() / ink.max() == pytest.approx(_drawn(str(k), 27.0).sum(), rel=0.02)


def test_the_checkerboard_needs_no_opencv():
    script = (
        "import sys; from iccm.pixels.checkerboard import checkerboard as c; c(); print('cv2' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, text=True).stdout == "False\n"
