"""Charts of a mesh's own layout as flattenings."""

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.flattening.charts import Atlas
from iccm.meshes.mesh import Mesh


def sheet(n, low, size, x0=0.0, folded=None):
    """Points, coordinates and quads of a sheet over a rectangle of the layout; `folded` reverses u beyond a place."""
    y, x = np.mgrid[0:n, 0:n] / (n - 1)
    points = np.stack([x0 + x, y, 0.1 * x * y], axis=-1).reshape(-1, 3)
    across = x.ravel() if folded is None else np.where(x.ravel() > folded, 2 * folded - x.ravel(), x.ravel())
    uv = np.stack([low[0] + size[0] * across, low[1] + size[1] * y.ravel()], axis=-1)
    i = np.arange(n * n).reshape(n, n)
    quads = np.stack([i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]], axis=-1).reshape(-1, 4)
    return points, uv, quads


def mesh_of(*sheets, split=False):
    """One mesh of several sheets; `split` gives every corner its own point and coordinate."""
    points, uv, faces, first = [], [], [], 0
    for p, t, q in sheets:
        points.append(p)
        uv.append(t)
        faces.append(q + first)
        first += len(p)
    points, uv, faces = map(np.concatenate, (points, uv, faces))
    corners = faces.ravel()
    if split:
        points, uv, corners = points[corners], uv[corners], np.arange(corners.size)
    return Mesh("m", points, corners, 4 * np.arange(len(faces) + 1), uv, corners.copy())


PAIR = (sheet(5, (0.1, 0.1), (0.3, 0.3)), sheet(5, (0.9, 0.2), (-0.4, 0.5), x0=2))


@pytest.mark.parametrize("split", [False, True])
def test_charts_are_numbered_by_their_area_and_a_mirrored_one_is_seen_from_the_front(split):
    atlas = Atlas.of(mesh_of(*PAIR, split=split))
    assert np.allclose(atlas.areas, [0.2, 0.09])
    large, small = (atlas.chart(k) for k in (1, 2))
    assert (large.mirror, small.mirror) == (0.5, None)
    for chart, area in zip((large, small), atlas.areas):
        flat = chart.flattening
        assert flat.boundary.area == pytest.approx(area)
        assert flat.flipped.size == 0
        assert len(flat.patch.points) == 25
    x, _, _ = large.flattening.patch.points.T
    assert np.allclose(large.flattening.flat.real, 0.1 + 0.4 * (x - 2))  # 1 - u
    with pytest.raises(InputError, match=r"no chart 3.*\b2$"):
        atlas.chart(3)


def test_a_layout_that_folds_back_is_two_charts_one_of_them_mirrored():
    atlas = Atlas.of(mesh_of(sheet(9, (0.1, 0.1), (0.6, 0.5), folded=0.5)))
    assert atlas.count == 2
    assert sorted(atlas.mirrored(k) for k in (1, 2)) == [False, True]
    assert [atlas.shared(k) for k in (1, 2)] == [1, 1]


def test_tiles_and_proportions():
    atlas = Atlas.of(mesh_of(sheet(3, (2.1, 1.1), (0.5, 0.5)), sheet(3, (0.9, 0.2), (0.3, 0.5))))
    assert [atlas.tile(k) for k in (1, 2)] == [2 + 1j, 1]  # the tile of its centre
    low, high = atlas.chart(1, 2.0).flattening.boundary.box
    assert np.allclose([low, high], [4.2 + 1.1j, 5.2 + 1.6j])


def test_an_outline_that_touches_itself_is_drawn_apart_by_a_hair():
    """Without its middle, and a corner that touches the middle's, as in charts around a leg of a model."""
    points, uv, quads = sheet(4, (0, 0), (1, 1))
    mesh = mesh_of((points, uv, quads[[k for k in range(9) if k not in (4, 8)]]))
    layout = Atlas.of(mesh).chart(1).flattening
    assert len(layout.patch.loops) == 1
    assert np.abs(layout.flat[:, None] - (uv @ [1, 1j])).min(axis=1).max() < 2e-5
    assert layout.boundary.area == pytest.approx(7 / 9, abs=1e-4)


def test_a_sliver_that_is_folded_back_is_flipped_and_a_larger_fold_is_not():
    points, uv, quads = sheet(9, (0, 0), (1, 1))
    for depth, count in ((1e-6, 1), (0.06, 2)):
        moved = uv.copy()
        moved[40] = uv[31] + (0, -depth) if count == 1 else uv[31] + (0.0, -depth)
        atlas = Atlas.of(mesh_of((points, moved, quads)))
        assert (atlas.count > 1) == (count > 1)
        if count == 1:
            assert "flipped" in atlas.notes[0]
            assert atlas.chart(1).flattening.flipped.size == 0


def test_a_chart_that_overlaps_itself_is_refused():
    """A strip wound around more than once: no triangle is flipped, yet it overlaps itself."""
    n, t = 40, np.linspace(0, 3 * np.pi, 40)
    points = np.concatenate([np.stack([t, 0 * t + y, 0 * t], axis=-1) for y in (0, 1)])
    uv = np.concatenate([0.5 + r * np.stack([np.cos(t), -np.sin(t)], axis=-1) for r in (0.2, 0.4)])
    i = np.arange(n - 1)
    quads = np.stack([i, i + 1, i + n + 1, i + n], axis=-1)
    with pytest.raises(InputError, match="chart 1 of its texture coordinates overlaps itself"):
        Atlas.of(mesh_of((points, uv, quads))).chart(1)


def test_faces_without_coordinates_or_area_are_omitted_and_reported():
    mesh = mesh_of(*PAIR)
    mesh.uv_corners[:4] = -1
    mesh.uv[-3:] = np.nan
    notes = Atlas.of(mesh).notes
    assert any("without texture coordinates" in note for note in notes)
    flat = mesh_of(sheet(3, (0, 0), (1, 0)))
    with pytest.raises(InputError, match="no face has an area"):
        Atlas.of(flat)
