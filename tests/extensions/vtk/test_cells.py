"""Cells of VTK files that name points or corners that the file does not have."""

from pathlib import Path

import pytest

from tests.extensions.vtk.files import POLYDATA

GOOD = {
    "points": 4,
    "polys": 2,
    "places": "0 0 0 1 0 0 1 1 0 0 1 0",
    "corners": "0 1 2 0 2 3",
    "offsets": "3 6",
}


@pytest.mark.large("vtkmodules")
@pytest.mark.parametrize(
    "change",
    [
        {},
        {"corners": "0 1 2 0 2"},  # the last one would be what memory holds
        {"corners": "0 1 2"},
        {"corners": ""},
        {"corners": "0 1 2 0 2 4"},
        {"corners": "0 1 2 0 2 -1"},
        {"corners": "0 1 2 0 2 139672017640640"},
        {"offsets": "3 7"},
        {"offsets": "6 3"},
        {"offsets": "-3 6"},
        {"points": 5},
        {"points": 10**12},
        {"polys": 3},
        {"polys": 10**9},
        {"places": "0 0 0 1 0 0 1 1 0"},
    ],
)
def test_cells_that_a_vtk_file_does_not_have_are_not_made_up(shapes, iccm, change):
    Path("a.vtp").write_text(POLYDATA.format(**GOOD | change))
    results = [iccm("map", "a.vtp", "square.svg", "-o", "o.png", "--size", "16", "--force") for _ in range(2)]
    assert [result.code for result in results] == [2 if change else 0] * 2
    if change:
        assert results[0].err == results[1].err and len(results[0].lines) == 1
        assert "a.vtp" in results[0].err and "139" not in results[0].err
