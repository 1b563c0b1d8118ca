"""Lines and arcs fitted to curves."""

import numpy as np

from iccm.maps.arc_fit import refit_arcs


def test_a_curve_whose_image_is_a_point_is_a_point():
    ((vertices, bulges),) = refit_arcs(lambda which, t: np.full(t.shape, 2 + 3j), np.array([True]), 1e-6)
    assert vertices.tolist() == [2 + 3j, 2 + 3j] and bulges.tolist() == [0]
