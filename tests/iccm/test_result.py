"""The result of a solve: former names of attributes, and freedom from cycles."""

import gc
import re
import weakref
from dataclasses import fields, replace

import numpy as np
import pytest

import iccm
from iccm.result import FORMER_NAMES
from tests.shapes import arrow, ell, pear


@pytest.fixture(scope="module")
def fit():
    """A map that leaves parts of both shapes without partners."""
    hole = 0.15 * (pear()[::-1] - pear().mean()) + 0.5 + 0.5j
    return iccm.fit(ell(), pear(), source_holes=[hole], fit="whole", holes="keep")


def test_former_names_have_their_values_and_warn(fit):
    values = {}
    for name in set(FORMER_NAMES) - {"has_drifted"}:  # of surfaces only
        with pytest.warns(DeprecationWarning, match=rf"^Fit\.{name}: use "):
            values[name] = getattr(fit, name)
        assert name not in dir(fit)
    assert values["ended"] is fit.status is iccm.Status.REACHED
    assert values["left_out"] == fit.coverage.left_out
    assert values["uncovered"] == fit.coverage.uncovered
    assert values["covered"] == 1 - fit.coverage.bare and values["shown"] == 1 - fit.coverage.hidden
    assert values["seen"].hidden == fit.coverage.hidden
    assert values["is_partial"] and values["voids"].any()
    assert values["lost"] == fit.report()["injective"]["folded"] == 0
    assert values["iterations"] == fit.report()["iterations"] > 0
    assert values["doubts"]() == []
    assert values["boxes"] == (fit.source.box, fit.target.box)
    assert fit.source.contains(values["interior"]).all() and values["interior"].size > 1000
    assert values["without_partner"][0].area > 0
    assert values["hole_partners"] is fit.details.hole_partners and values["place"] == "fill"
    assert values["tolerance"] == fit.details.tolerance > 0 and values["passed_holes"] == ((), ())
    assert values["moved_rings"][0].size > 4 and values["visible_map"] is not None


def test_a_name_that_never_was_is_an_attribute_error(fit):
    with pytest.raises(AttributeError, match="nonsense"):
        _ = fit.nonsense
    assert not hasattr(fit, "nonsense")


def test_a_result_can_be_made_by_its_former_keyword(fit):
    given = {field.name: getattr(fit, field.name) for field in fields(fit) if field.name != "_ended"}
    with pytest.warns(DeprecationWarning, match="ended"):
        made = iccm.Fit(**given, ended=iccm.Status.GAP)
    assert made.status is iccm.Status.GAP
    del given["details"]
    with pytest.warns(DeprecationWarning, match="tolerance in details"):
        made = iccm.Fit(**given, _ended=iccm.Status.GAP, tolerance=0.25)
    assert made.details.tolerance == 0.25 and made.details.drawings is None
    assert replace(made, notes=["new"]).notes == ["new"]


def test_a_number_has_a_number_as_its_image(fit):
    z = complex(fit.source.z[0])
    w = fit.map(z)
    for image in (w, fit.inverse(w), fit.transform(z), fit.transform.inverse(w)):
        assert isinstance(image, complex)
    assert abs(fit.inverse(w) - z) < 1e-9
    assert np.shape(fit.map(np.array(z))) == () and np.shape(fit.map(np.array([z]))) == (1,)


def test_a_result_is_freed_without_the_collector():
    fit = iccm.fit(arrow(), 2 * arrow())
    fit.report()
    gc.disable()
    try:
        reference = weakref.ref(fit)
        del fit
        assert reference() is None
    finally:
        gc.enable()


def test_hidden_and_bare_shares_of_drawings_are_those_of_their_painted_areas():
    import shapely

    two = shapely.union(shapely.box(0, 0, 2, 1), shapely.box(3, 0, 3.5, 0.5))
    fit = iccm.fit(two, shapely.box(0, 0, 3, 1))
    report = fit.report()
    assert report["shown"] == 1 - fit.coverage.hidden and report["covered"] == 1 - fit.coverage.bare
    hidden, bare = fit.coverage.lost_regions
    assert hidden.area / two.area == pytest.approx(fit.coverage.hidden, abs=0.02)
    assert bare.area / 3 == pytest.approx(fit.coverage.bare, abs=0.02)


def test_what_is_not_a_result_or_a_file_is_an_input_error(fit, tmp_path):
    misuses = {
        "warp": lambda: iccm.warp(fit.map, iccm.checkerboard(16)),
        "stmap": lambda: iccm.stmap(fit.map),
        "morph": lambda: next(iccm.morph(fit.map, [0.5])),
        "then": lambda: fit.then(fit.map),
        "load": lambda: iccm.load(3),
        "checkerboard": lambda: iccm.checkerboard(-3),
        "source": lambda: iccm.fit(None, arrow()),
        str(tmp_path): lambda: fit.save(tmp_path),
    }
    for name, misuse in misuses.items():
        with pytest.raises(iccm.InputError, match=re.escape(name)):
            misuse()
    for missing in (lambda: iccm.load("nope"), lambda: fit.save(tmp_path / "nope" / "map.npz")):
        with pytest.raises(FileNotFoundError, match="nope") as caught:
            missing()
        assert isinstance(caught.value, iccm.InputError)
