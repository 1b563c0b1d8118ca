"""Pieces of a mesh divided into charts: nothing is left out, and nothing overlaps."""

import numpy as np
import pytest
import trimesh

from iccm.errors import InputError
from iccm.flattening import segmentation
from iccm.flattening.segmentation import charts_of
from iccm.meshes.disk_patch import sound_piece
from iccm.meshes.flatten import overlap
from iccm.meshes.mesh import Mesh
from iccm.meshes.patch import patch_of


def piece_of(surface):
    return sound_piece(Mesh.triangles("piece", surface.vertices, surface.faces))


def covered(charts):
    return np.sort(np.concatenate([chart.triangles for chart in charts])).tolist()


@pytest.mark.parametrize("most", [40, 7, 1, 0])
def test_what_does_not_flatten_is_split_until_it_does(monkeypatch, most):
    flatten = segmentation.flatten

    def picky(patch, **how):
        if len(patch.faces) > most:
            raise InputError("too large")
        return flatten(patch, **how)

    monkeypatch.setattr(segmentation, "flatten", picky)
    piece = piece_of(trimesh.creation.torus(2, 0.7, major_sections=12, minor_sections=6))
    charts = charts_of(piece, grow=True, method="balanced", charts="one")
    assert covered(charts) == list(range(144))
    assert len(charts) >= 144 / max(most, 1)
    for chart in charts:
        assert overlap(chart.layout) is None
        assert (chart.layout.patch.corner == piece.corner[chart.triangles]).all()
        assert chart.layout.patch.areas.sum() == pytest.approx(piece.areas[chart.triangles].sum())


def test_a_piece_that_flattens_is_one_chart():
    piece = piece_of(trimesh.creation.icosphere(2))
    (chart,) = charts_of(piece, grow=True, method="balanced")
    assert covered([chart]) == list(range(320)) and len(chart.layout.patch.seam)


def test_a_closed_piece_that_must_not_be_cut_is_refused():
    piece = piece_of(trimesh.creation.icosphere(1))
    with pytest.raises(InputError, match="closed"):
        charts_of(piece, grow=False, method="balanced")


def test_a_triangle_without_area_gets_a_place():
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]])
    piece = patch_of("needle", points, np.array([[0, 1, 3], [1, 2, 3], [0, 2, 1]]))
    charts = charts_of(piece, grow=True, method="lscm")
    assert covered(charts) == [0, 1, 2] and not any(overlap(chart.layout) for chart in charts)


def test_a_triangle_whose_corners_are_on_one_line_gets_a_place():
    points = np.array([[29.609, 151.478, 8.086], [29.609, 221.857, 8.086], [29.609, 220.457, 8.086]])
    piece = patch_of("edge", points, np.array([[0, 1, 2]]))
    (chart,) = charts_of(piece, grow=True, method="balanced", charts="one")
    assert np.isfinite(chart.layout.flat).all()


def test_faces_whose_corners_differ_by_rounding_are_one_surface():
    """Each face of a box has vertices of its own, computed in single precision."""
    box = trimesh.creation.box((1, 0.5, 0.25))
    points = box.vertices[box.faces.ravel()] + np.random.default_rng(79).normal(0, 5e-8, (36, 3))
    piece = sound_piece(Mesh.triangles("box", points, np.arange(36).reshape(-1, 3)))
    (chart,) = charts_of(piece, grow=True, method="balanced")
    assert len(chart.triangles) == 12 and chart.layout.dilated(95) < 1.001
