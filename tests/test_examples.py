"""Every public function and class has an example, and examples show their results."""

import doctest
import inspect

import numpy as np
import pytest

import iccm

WITHOUT = {
    "HarmonicMap",
    "TriangulatedMap",
    "Transfer",
    "Status",
    "IccmError",
    "InputError",
    "Cancelled",
    "Progress",
}
"""Classes that functions return, and that users do not create."""
PUBLIC = [name for name in iccm.__all__ if name not in WITHOUT]


@pytest.mark.parametrize("name", PUBLIC)
def test_the_examples_of(name):
    thing = getattr(iccm, name)
    module = inspect.getmodule(inspect.unwrap(thing))
    finder = doctest.DocTestFinder(recurse=False)
    examples = [test for test in finder.find(thing, name, globs=vars(module) | {"np": np}) if test.examples]
    assert examples, "no example"
    for test in examples:
        assert doctest.DocTestRunner().run(test).failed == 0
