"""Options: which method they choose, and that none is without effect."""

import pytest

from iccm import InputError
from iccm.problem import OTHERS, OWN, Options

GIVEN = {"balance": 2.0, "turn": "any", "max_dilatation": 3.0, "max_stretch": 3.0}
CONFORMAL = {
    "method": {"method": "conformal"},
    "paper": {"method": "paper"},
    "quasi": {"quasi": 0.1},
    "balance 0": {"balance": 0.0},
    "balance 0 by name": {"balance": 0.0, "method": "balanced"},
}


@pytest.mark.parametrize("name", CONFORMAL)
def test_what_the_balanced_method_alone_does_is_refused_by_others(name):
    options = CONFORMAL[name]
    assert not Options(**options).is_balanced and set(GIVEN) == set(OWN)
    for own in set(OWN) - set(options):
        with pytest.raises(
            InputError, match=f"^{own}: an option of --method balanced, not of (conformal|paper)"
        ):
            Options(**options, **{own: GIVEN[own]})


def test_what_the_others_do_is_refused_by_the_balanced_method():
    for own, value in GIVEN.items():
        assert Options(**{own: value}).is_balanced
    for name in OTHERS:
        values = {"vertices": 50, "weights": "paper", "order": 1}
        with pytest.raises(
            InputError, match=f"^{name}: an option of --method conformal or paper, not of balanced"
        ):
            Options(method="balanced", **{name: values.get(name, 7)})
