"""Parameters of tests that have many similar cases."""

from collections.abc import Iterable

import pytest


def slow(case: object):
    """Return a case, or a tuple of its values, as a parameter that is marked as slow."""
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.slow)


def some_fast(cases: Iterable, fast: int | set) -> list:
    """Return cases as parameters; those not among the fast ones, given by number or by value, are marked as slow."""
    cases = list(cases)
    chosen = set(cases[:fast]) if isinstance(fast, int) else fast
    return [case if case in chosen else slow(case) for case in cases]
