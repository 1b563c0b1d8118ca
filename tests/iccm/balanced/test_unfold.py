"""Local removal of folds in coordinates."""

import numpy as np

from iccm.balanced.minimise.unfold import unfold_on
from iccm.plane import triangle_heights


def grid(n):
    """Points of n × n squares, their triangles, and which are on the border."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"))
    k = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([k, k + n + 1, k + n + 2], 1), np.stack([k, k + n + 2, k + 1], 1)])
    return i + 1j * j, faces, (np.minimum(i, j) == 0) | (np.maximum(i, j) == n)


def test_folds_are_undone_where_they_are_and_those_that_cannot_be_stay():
    flat, faces, border = grid(24)
    points = np.column_stack([flat.real, flat.imag, 0 * flat.real])
    bad, fixed = flat.copy(), border.copy()
    bad[4 * 25 + 4] += 1.7  # within reach
    stuck = 20 * 25 + 20
    bad[stuck] += 1.7
    fixed[stuck] = True  # and its neighbours: it cannot be repaired
    fixed[np.unique(faces[(faces == stuck).any(axis=1)])] = True
    unfolded = unfold_on(bad, faces, fixed, points, 1e-6)
    folded = faces[triangle_heights(unfolded[faces]) <= 1e-6]
    assert folded.size and (folded == stuck).any(axis=1).all()
    moved = np.flatnonzero(unfolded != bad)
    assert moved.size and np.abs(flat[moved] - (4 + 4j)).max() < 9
    assert (unfolded[fixed] == bad[fixed]).all()
