"""Maps of large surfaces by way of coarser triangulations: the same map as without, without folds."""

import numpy as np
import pytest

import iccm
from iccm.flattening import flatten
from iccm.meshes.disk_patch import disk_patch
from iccm.plane import triangle_areas
from iccm.surfaces import coarse_start
from tests.iccm.surfaces.test_surfaces import circle, grid, hill


@pytest.mark.slow
@pytest.mark.parametrize(("mirrored", "newton"), [(False, True), (True, True), (False, False)])
def test_a_coarser_triangulation_leads_to_the_same_map(monkeypatch, mirrored, newton):
    """The energy of both maps agrees within the tolerance of the last steps, and the coarser one is really used.

    Large maps get no Newton steps on all triangles, which costs a little.
    """
    outline = circle(40) * np.where(np.arange(40) < 13, 1.3, 1.0)
    mesh = grid(80, 72, hill if not mirrored else lambda x, y: (*hill(y, x),))
    layout = flatten(disk_patch(mesh))
    plain = iccm.fit(outline, layout)
    sizes = []
    real = coarse_start._refine_to_all_triangles

    def watched(state, points, small, *args):
        result = real(state, points, small, *args)
        sizes.append((small.u.size, state.u.size, result[0] is state, result[1]))
        return result

    monkeypatch.setattr(coarse_start, "LARGE_VERTEX_COUNT", 300)
    monkeypatch.setattr(coarse_start, "DIRECT_VERTEX_COUNT", 10**6 if newton else 300)
    monkeypatch.setattr(coarse_start, "MOST_SWEEPS", 100)
    monkeypatch.setattr(coarse_start, "_refine_to_all_triangles", watched)
    fit = iccm.fit(outline, layout)
    (small, whole, unchanged, _), *_ = sizes
    assert sizes[-1][3] is not newton
    assert small < 0.5 * whole and not unchanged
    assert fit.energies[-1]["total"] == pytest.approx(
        plain.energies[-1]["total"], rel=1e-3 if newton else 4e-3
    )
    assert (triangle_areas(fit.map.source[fit.map.faces]) > 0).all()
    shift = np.abs(fit.map.source - plain.map.source)
    assert np.quantile(shift, 0.95) < 0.01 * np.ptp(plain.map.source.real)
