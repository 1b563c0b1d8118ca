"""Tables of points as spreadsheets and statistics programs write them."""

import numpy as np
import pytest

from iccm.io.geometry import document
from iccm.io.geometry.document import Images


def read(tmp_path, content, suffix=".csv", **options):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return document.read(str(path), **options)


def moved(table):
    """The table with its points moved by 0.5."""
    return table.text(Images(table.geometry.points + 0.5, [], [], True, ".csv"))


@pytest.mark.parametrize(
    "content, delimiter",
    [
        ("name;x;y\na;12,5;-3,25\nb;7;8,0\n", ";"),
        ("12,5;-3,25\n7;8,0\n", ";"),
        ("x\ty\n12,5\t-3,25\n7\t8,0\n", "\t"),
        ("12,5;-3,25;1,5\n7;8,0;2,5\n", ";"),
    ],
)
def test_decimal_commas_are_read_and_written(tmp_path, content, delimiter):
    table = read(tmp_path, content)
    assert table.delimiter == delimiter and np.array_equal(table.geometry.points, [12.5 - 3.25j, 7 + 8j])
    first = moved(table).splitlines()[bool(table.head)].split(delimiter)
    assert "13,0" in first and "-3,25" in first


@pytest.mark.parametrize(
    "content", ["x,y\n12.5,-3.25\n", "12.5,-3.25\n", 'x,y,note\n12.5,-3.25,"a;b"\n', "x;y\n12.5;-3.25\n"]
)
def test_points_stay_points(tmp_path, content):
    table = read(tmp_path, content)
    assert np.array_equal(table.geometry.points, [12.5 - 3.25j])
    assert "13.0" in moved(table)


def test_values_that_are_missing_have_no_place(tmp_path):
    table = read(tmp_path, "x,y\n1,2\nNA,NA\n3,N/A\nnan,4\n,\n5,6\n")
    assert np.isnan(table.geometry.points).tolist() == [False, True, True, True, True, False]


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "cp1252"])
def test_encodings_of_spreadsheets(tmp_path, encoding):
    table = read(tmp_path, "name\tx\ty\nM\u00fcnchen\t1.5\t2\n".encode(encoding), ".tsv")
    assert table.rows[0][0] == "M\u00fcnchen" and np.array_equal(table.geometry.points, [1.5 + 2j])
