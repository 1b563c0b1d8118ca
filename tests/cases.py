"""Parameters of tests that have many similar cases, and pictures as arrays."""

from collections.abc import Iterable

import numpy as np
import pytest
from PIL import Image


def pixels(name: str) -> np.ndarray:
    """Return a picture as floats, with alpha."""
    return np.asarray(Image.open(name).convert("RGBA"), float)


def slow(*values: object):
    """Return the values of a case as a parameter that is marked as slow."""
    return pytest.param(*values, marks=pytest.mark.slow)


def some_fast(cases: Iterable, fast: int | set) -> list:
    """Return cases as parameters; those not among the fast ones, given by number or by value, are marked as slow."""
    cases = list(cases)
    chosen = set(cases[:fast]) if isinstance(fast, int) else fast
    return [case if case in chosen else slow(*case if isinstance(case, tuple) else (case,)) for case in cases]
