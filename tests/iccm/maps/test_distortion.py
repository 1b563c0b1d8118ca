"""Distortion over the target: known maps, and one definition for triangles and for points of the source."""

from dataclasses import replace

import numpy as np
import pytest

from iccm.maps.distortion import Distortion, of_inverse, of_triangles
from tests.triangulations import irregular, lattice, map_of

SQUARE = np.array([0, 1, 1 + 1j, 1j])


def test_a_similarity_has_none():
    turn = np.exp(np.radians(25) * 1j)
    report = of_triangles(map_of(irregular(SQUARE, 0.2), lambda w: w / (3 * turn))).report()
    assert report["stretch"] == pytest.approx({"p50": 1, "p95": 1, "max": 1})
    assert report["dilatation"] == pytest.approx({"median": 1, "p95": 1, "max": 1})
    assert report["scale"] == {"within2": 1, "within4": 1}
    assert report["turn"] == pytest.approx(25)


def test_a_stretch_by_nine_is_three_by_one_third():
    report = of_triangles(map_of(lattice(4), lambda w: w.real / 9 + 1j * w.imag)).report()
    assert report["stretch"] == pytest.approx({"p50": 3, "p95": 3, "max": 3})
    assert report["dilatation"]["max"] == pytest.approx(9)
    assert report["scale"]["within2"] == 1
    assert report["turn"] == pytest.approx(0, abs=1e-9)


def of_singular_values(*values, scale=1.0):
    """One sample for each pair of singular values."""
    large, small = np.array(values, float).T
    return Distortion(np.ones(large.size), (large + small) / 2 + 0j, (large - small) / 2 + 0j, scale)


def test_stretch_is_the_larger_of_both_directions():
    distortion = of_singular_values((3, 0.5), (5, 3), scale=2.0)
    assert distortion.stretches == pytest.approx([4, 2.5])
    assert distortion.dilatations == pytest.approx([6, 5 / 3])
    assert distortion.scales == pytest.approx([np.sqrt(1.5) / 2, np.sqrt(15) / 2])


@pytest.mark.parametrize("balance", [0.0, 0.5, 1.0])
def test_energies_grow_with_areas_and_with_their_inverses(balance):
    energies = of_singular_values((3, 0.5), (5, 3), scale=2.0).energies(balance)
    angle = np.array([6 + 1 / 6, 5 / 3 + 3 / 5]) / 2
    area = np.array([3 / 8 + 8 / 3, 15 / 4 + 4 / 15]) / 2
    assert energies["angle"] == pytest.approx(angle) and energies["area"] == pytest.approx(area)
    assert energies["total"] == pytest.approx(angle * area**balance)


def two_sizes(w):
    """The left nine tenths of the target come from a strip three times as narrow; the rest is unchanged."""
    return np.minimum(w.real, 0.9) / 3 + np.maximum(w.real - 0.9, 0) + 1j * w.imag


def test_shares_and_quantiles_count_the_target_s_area():
    map = map_of(lattice(10), two_sizes, bulge=np.zeros(320, complex))
    distortion = of_triangles(map)
    scale = np.sqrt(1 / 0.4)
    assert distortion.scale == pytest.approx(scale)
    assert distortion.within(1.2) == pytest.approx(0.9)
    assert distortion.quantile(distortion.dilatations, 0.89) == pytest.approx(3)
    assert distortion.quantile(distortion.dilatations, 0.0) == pytest.approx(1)
    assert distortion.quantile(distortion.dilatations, 0.11) == pytest.approx(3)
    assert distortion.stretches.max() == pytest.approx(3 / scale)
    assert distortion.report()["stretch"]["max"] == pytest.approx(3 / scale)


def test_points_of_the_target_give_the_same_figures():
    map = map_of(irregular(SQUARE, 0.05), lambda w: w + 0.15 * w**2 + 0.1 * w.conj())
    x, y = np.meshgrid(np.linspace(-0.3, 1.6, 400), np.linspace(-0.3, 1.6, 400))
    w = (x + 1j * y).ravel()
    w = w[np.isfinite(replace(map, near=0.0).inverse(w))]
    by_triangles = of_triangles(map)
    by_points = of_inverse(map, w, by_triangles.scale).report()
    for kind, figures in by_triangles.report().items():
        if kind == "turn":
            assert by_points[kind] == pytest.approx(figures, abs=0.1)
        else:
            for name in set(figures) - {"max"}:
                assert by_points[kind][name] == pytest.approx(figures[name], rel=0.01)


def test_unreached_points_are_not_painted():
    map = map_of(lattice(4), lambda w: w)
    distortion = of_inverse(map, np.array([0.3 + 0.3j, 0.6 + 0.5j, 2 + 0.5j, 0.5 - 1j]), 1.0)
    assert distortion.within(4) == 0.5 and distortion.report()["stretch"]["p95"] == np.inf


def test_folds_are_infinite_and_do_not_spoil_the_rest():
    distortion = Distortion(np.array([1.0, 3.0]), np.array([0.5, 1j]), np.array([1.0, 0j]), 1.0)
    assert distortion.report()["stretch"] == {"p50": 1, "p95": np.inf, "max": np.inf}
    assert distortion.quantile(distortion.dilatations, 0.75) == 1
    assert distortion.turn == pytest.approx(np.degrees(np.arctan2(3, 1)))


@pytest.mark.parametrize("side", ["source", "target"])
def test_nearly_folded_triangles_count_on_their_larger_side(side):
    """A strip squeezed by 1000 is much of one side, and nothing of the other."""
    singular = np.array([[1, 1e-3], [1, 1]]) if side == "source" else np.array([[1e3, 1], [1, 1]])
    determinant, area = singular.prod(axis=1), np.array([1.0, 9.0])
    area = area * determinant if side == "source" else area
    distortion = Distortion(
        area, singular.sum(axis=1) / 2 + 0j, (singular[:, 0] - singular[:, 1]) / 2 + 0j, 1.0
    )
    assert distortion.dilatations == pytest.approx([1000, 1])
    assert distortion.squeezed == pytest.approx(0.1)
    assert replace(distortion, area=distortion.area * [0, 1]).squeezed == 0
