"""What a newcomer types works, or ends with a line that names the remedy: the list of `tests.bench.attempts`."""

import importlib.util

import pytest

from .bench.attempts import ATTEMPTS, run

QUICK = ("iccm help", "iccm map --version", "iccm heart.svg", "iccm map icons/*", "iccm init")
"""How commands begin that do not compute a map."""


def parameter(attempt):
    """An attempt as a parameter; those that compute a map are slow together."""
    is_quick = attempt.line.startswith(QUICK) or attempt.line in ("iccm", "iccm batch")
    marks = [] if is_quick else [pytest.mark.slow]
    if "load_path" in attempt.line and not all(map(importlib.util.find_spec, ("lxml", "svg"))):
        marks.append(
            pytest.mark.skip(reason="trimesh reads SVG by lxml and svg.path, which are not installed")
        )
    return pytest.param(attempt, marks=marks, id=attempt.line[:60])


@pytest.mark.parametrize("attempt", [parameter(attempt) for attempt in ATTEMPTS])
def test_a_first_attempt_works_or_helps(attempt):
    verdict, last, _ = run(attempt, None)
    assert verdict in ("works", "helps"), last
