"""Options: which method they select, and that none is without effect."""

import inspect
from types import UnionType
from typing import Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
import pytest

import iccm
from iccm import InputError
from iccm.arrays import xy_of
from iccm.options import BALANCED_ONLY, DEFAULTS, ROWS, WEIGHTED_ONLY, Options, OptionValues
from iccm.texture_transfer import FitOptions


def another_value(name):
    """A value of an option that it accepts, other than its default."""
    row, default = ROWS[name], DEFAULTS[name]
    if row.is_number:
        return next(n for n in (1, 2, 0.5, 50) if n != default and not row.mistake(n, default))
    if row.words:
        return next(word for word in row.words if word != default)
    return True if default is False else [object()]


CONFORMAL = {
    "method": {"method": "conformal"},
    "paper": {"method": "paper"},
    "quasi": {"quasi": 0.1},
    "balance 0": {"balance": 0.0},
    "balance 0 by name": {"balance": 0.0, "method": "balanced"},
}


@pytest.mark.parametrize("name", CONFORMAL)
def test_options_of_the_balanced_method_are_refused_by_others(name):
    options = CONFORMAL[name]
    assert not Options(**options).is_balanced
    for option in set(BALANCED_ONLY) - set(options):
        with pytest.raises(InputError, match=f"^{option}: .* (conformal|paper)"):
            Options(**options, **{option: another_value(option)})


def test_options_of_other_methods_are_refused_by_the_balanced_method():
    assert "balance" in BALANCED_ONLY and "quasi" in WEIGHTED_ONLY
    for name in BALANCED_ONLY:
        assert Options(**{name: another_value(name)}).is_balanced
    for name in WEIGHTED_ONLY:
        with pytest.raises(InputError, match=f"^{name}: .* balanced"):
            Options(method="balanced", **{name: another_value(name)})


@pytest.mark.parametrize("balance", [-1, 10.5, 1e308, 10**400, float("nan")])
def test_a_weight_of_areas_beyond_its_range_is_refused(balance):
    """Larger weights are approached by doubling, so that their number would have no end."""
    with pytest.raises(InputError, match=r"^balance: .*10"):
        Options(balance=balance)


def parts_of(hint):
    """The types of a union and the values of literals."""
    if get_origin(hint) in (Union, UnionType, Literal):
        return [part for each in get_args(hint) for part in parts_of(each)]
    return [hint]


def test_type_checkers_see_the_options_and_the_arguments_of_fit():
    options, values = get_type_hints(Options), get_type_hints(OptionValues)
    assert options.keys() == values.keys()
    for name, hint in values.items():  # a string with a choice of words is a literal for type checkers
        seen, stored = (
            {type(part) if isinstance(part, str) else part for part in parts_of(each)}
            for each in (hint, options[name])
        )
        assert seen == stored, name
    named = [
        value.name
        for value in inspect.signature(iccm.fit).parameters.values()
        if value.kind is value.KEYWORD_ONLY
    ]
    assert {*named, *get_type_hints(OptionValues)} == set(get_type_hints(FitOptions))


def test_real_arrays_make_the_same_map_as_complex_ones():
    z = np.array([0, 2, 2 + 1j, 1j])
    pins = np.array([[0.5 + 0.5j, 0.6 + 0.5j]])
    strokes = [(np.array([1 + 0.2j, 1 + 0.8j]), np.array([1.1 + 0.2j, 1.1 + 0.8j]))]
    settings = {"method": "conformal", "max_iterations": 5}
    from_complex = iccm.fit(z, 2 * z, pins=pins, strokes=strokes, **settings)
    pairs = [[xy_of(line) for line in pair] for pair in strokes]
    from_real = iccm.fit(xy_of(z), xy_of(2 * z), pins=xy_of(pins), strokes=pairs, **settings)
    assert (
        np.array_equal(from_complex.map.polygon, from_real.map.polygon)
        and from_complex.energies == from_real.energies
    )


def test_a_result_is_described_in_one_line():
    z = np.array([0, 2, 2 + 1j, 1j])
    fit = iccm.deform(z, pins=[(0.5 + 0.5j, 0.6 + 0.5j), (1.5 + 0.5j, 1.5 + 0.5j)])
    assert repr(fit).startswith("<Fit: met, TriangulatedMap with ") and repr(fit).endswith(", 2 pins>")
    assert "\n" not in repr(fit.transform) and "TriangulatedMap: " in repr(fit.transform)
    text = repr(iccm.warp(fit, iccm.checkerboard(), size=16))
    assert text.startswith("<Transfer: ") and repr(fit) in text and "\n" not in text
