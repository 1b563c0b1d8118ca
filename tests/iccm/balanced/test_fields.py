"""Importance and sizes over the source: constant ones change nothing; others move distortion and areas as requested."""

import numpy as np
import pytest

import iccm
from iccm.balanced import cartogram
from iccm.curve import Curve
from iccm.maps.fields import Field
from iccm.plane import triangle_areas

BAR = np.array([0, 4, 4 + 1j, 1j])
FLAG = np.array([0, 3, 2.5 + 0.6j, 3.1 + 1.5j, 1 + 1.7j, 0.9 + 3j, 0.2 + 2.9j])
BEAN = np.array([0, 2, 4 + 0.4j, 4.2 + 1.5j, 3 + 2j, 1.5 + 1.4j, 0.3 + 1.8j])
BOX = Curve(FLAG).box


def test_a_field_is_linear_between_pixels_and_constant_beyond_them():
    field = Field.of(np.array([[0, 1.0], [2, 5]]), (0j, 2 + 2j), 0.0, "field")
    places = np.array([0.5 + 1.5j, 1.5 + 1.5j, 0.5 + 0.5j, 1 + 1j, 9 - 9j, 1 + 0.5j])
    assert field(places) == pytest.approx([0, 1, 2, 2, 5, 3.5])
    assert Field.of([[7]], (0j, 1 + 1j), 0.0, "field")(places) == pytest.approx(7)
    assert Field.of([[1, 100]], (0j, 1 + 1j), 0.1, "field").values.min() == 10
    np.testing.assert_array_equal(field.values[field.pixels(places)], [0, 1, 2, 5, 5, 5])


@pytest.mark.parametrize("name", ["importance", "size_map"])
def test_constant_fields_change_nothing(name):
    plain = iccm.fit(FLAG, BEAN, fit="whole")
    even = iccm.fit(FLAG, BEAN, **{name: np.full((3, 4), 0.7)})
    for fit in (plain, even):
        assert fit.status.ok and fit.certificate.share == 1
    assert even.report()["stretch"]["p95"] == pytest.approx(plain.report()["stretch"]["p95"], rel=0.03)
    assert abs(even.map(1 + 0.8j) - plain.map(1 + 0.8j)) < 0.02 * plain._diagonal


@pytest.mark.slow
def test_distortion_avoids_important_places():
    y, x = np.mgrid[BOX[1].imag : BOX[0].imag : 60j, BOX[0].real : BOX[1].real : 60j]
    matters = np.exp(-((x - 1) ** 2 + (y - 0.9) ** 2) / 0.3)
    worst = []
    for options in ({"fit": "whole"}, {"importance": matters}, {"importance": (matters, BOX)}):
        fit = iccm.fit(FLAG, BEAN, **options)
        close = np.abs(fit.map.source[fit.map.faces].mean(axis=1) - (1 + 0.9j)) < 0.4
        worst.append(np.quantile(fit.triangles.dilatations[close], 0.9) - 1)
        assert fit.certificate.share == 1 and fit._boundary["hausdorff"] <= 1e-3
    assert worst[1] < 0.5 * worst[0] and worst[1] == pytest.approx(worst[2], rel=1e-9)


@pytest.mark.slow
def test_halves_of_a_bar_get_the_requested_areas():
    sizes = np.ones((4, 400))
    sizes[:, 200:] = np.sqrt(3)  # three quarters of the area
    shares = []
    for balance in (1.0, 8.0):
        fit = iccm.fit(BAR, BAR, size_map=sizes, balance=balance)
        areas = triangle_areas(fit.map.image[fit.map.faces])
        shares.append(areas[fit.map.source[fit.map.faces].mean(axis=1).real > 2].sum() / areas.sum())
        assert fit.status.ok and fit.certificate.share == 1
    assert 0.6 < shares[0] < shares[1] and shares[1] == pytest.approx(0.75, rel=0.02)
    assert any("requested areas" in note for note in fit.notes)


@pytest.mark.slow
def test_areas_get_through_a_neck_past_its_corners():
    bell = np.array([0, 4, 4 + 1.6j, 6 + 1.6j, 6, 10, 10 + 4j, 6 + 4j, 6 + 2.4j, 4 + 2.4j, 4 + 4j, 4j])
    sizes = np.where(np.arange(200) < 100, 1, np.sqrt(3))[None]
    fit = iccm.fit(bell, bell, size_map=sizes, balance=8)
    areas, middles = triangle_areas(fit.map.image[fit.map.faces]), fit.map.source[fit.map.faces].mean(axis=1)
    assert fit.status.ok and fit.certificate.share == 1
    assert areas[middles.real > 5].sum() / areas.sum() == pytest.approx(0.75, rel=0.02)


def test_parts_of_a_field_are_connected_and_of_one_size():
    values = np.array([[1, 1, 2], [1, 2, 2], [3, 1, 1]], float)
    parts = cartogram.parts_of(Field.of(values, (0j, 3 + 3j), 0.0, "field"))
    assert parts.max() == 3 and parts[0, 0] == parts[1, 0] and parts[0, 2] == parts[1, 1]
    assert len({parts[0, 0], parts[0, 2], parts[2, 0], parts[2, 1]}) == 4
    ramp = Field.of(np.geomspace(1, 4, 1000)[None], (0j, 3 + 3j), 0.0, "field")
    assert (np.unique(cartogram.parts_of(ramp)) == np.arange(cartogram.SIZE_LEVELS)).all()


def test_rigid_regions_and_size_maps_work_together():
    ring = 0.9 + 0.8j + 0.4 * np.exp(2j * np.pi * np.arange(16) / 16)
    fit = iccm.fit(FLAG, BEAN, rigid=[ring], size_map=[[1, 2], [1, 3]], importance=[[1, 2, 1]])
    assert fit.status.ok and fit.rigid[0].is_rigid and fit.rigid[0].scale == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"importance": [[0, 0]]}, "importance: is zero"),
        ({"importance": [1, 2]}, r"importance: .* \(h, w\)"),
        ({"size_map": [[1, -1]]}, "size_map: "),
        ({"size_map": ([[1, 2]], (1, 0))}, "size_map: .* lower left"),
        ({"size_map": [[1, 2]], "fit": "cover"}, "size_map: .* use whole or auto"),
        ({"importance": [[1, 2]], "method": "paper"}, "importance: .* balanced method"),
    ],
)
def test_wrong_fields_are_refused(options, message):
    with pytest.raises(iccm.InputError, match=message):
        iccm.fit(FLAG, BEAN, **options)
