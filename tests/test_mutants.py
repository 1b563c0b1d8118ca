"""The table of mutants, and the message about a row whose text does not exist any more."""

from collections import Counter

from tests.mutants import MUTANTS
from tests.mutants.__main__ import stale
from tests.mutants.mutant import Mutant


def test_every_row_is_a_bug_of_its_own_with_tests():
    assert len(MUTANTS) >= 100
    assert {mutant.file.partition("/")[0] for mutant in MUTANTS} == {"iccm", "io", "cli", "core"}
    assert max(Counter(mutant.effect for mutant in MUTANTS).values()) == 1
    for mutant in MUTANTS:
        assert mutant.old != mutant.new and mutant.tests and len(mutant.effect) > 10, mutant


def test_a_stale_row_is_reported_with_advice(tmp_path):
    row = Mutant("setup.py", "no such text", "", "tests/test_mutants.py", "nothing")
    assert row.mutate("some text") is None and row.mutate("no such text, no such text") is None
    assert row.mutate("a no such text b") == "a  b"
    for mutant in (row, row._replace(file="moved/away.py")):
        (line,) = stale([mutant])
        assert mutant.file in line and "update or remove the row" in line
    (line,) = stale([row._replace(old="ROOT = ", new="ROOT = = ")])
    assert "correct the row" in line
