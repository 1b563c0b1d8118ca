"""Files of libraries in native code: whatever happens to the process that reads them, this one reports it in a line."""

import json
from pathlib import Path

import numpy as np
import pytest

from iccm import InputError
from iccm.io import limits
from iccm.io.isolated import process

HEADER = json.dumps({"values": {"x": {"array": 0}}, "arrays": [{"dtype": "<f8", "shape": [3]}]})
FATES = {
    "crash": "import os; os.abort()",
    "exit": "import os; os._exit(3)",
    "nothing": "pass",
    "half a header": f"print({HEADER[:20]!r}, end='')",
    "half an array": f"import sys; sys.stdout.write({HEADER + chr(10) + 'abcdefgh'!r})",
    "no end": "import resource, sys\nresource.setrlimit(resource.RLIMIT_CPU, (1, 1))\nwhile True: pass",
}


@pytest.mark.slow
@pytest.mark.parametrize("fate", FATES)
def test_the_end_of_the_process_is_a_line(tmp_path, monkeypatch, fate):
    if fate == "no end":
        pytest.importorskip("resource")
    (tmp_path / "reader.py").write_text(FATES[fate])
    (tmp_path / "a.vtp").write_bytes(b"x")
    monkeypatch.setattr(process.readers, "__file__", str(tmp_path / "reader.py"))
    with pytest.raises(InputError, match=r"a\.vtp: damaged") as error:
        process.read(tmp_path / "a.vtp", "vtk", suffix=".vtp")
    assert "\n" not in str(error.value)


def test_a_process_that_waits_is_ended(tmp_path, monkeypatch):
    (tmp_path / "reader.py").write_text("import time; time.sleep(600)")
    (tmp_path / "a.vtp").write_bytes(b"x")
    monkeypatch.setattr(process.readers, "__file__", str(tmp_path / "reader.py"))
    monkeypatch.setattr(limits, "READER_WALL_TIME_RATIO", 0.1)
    with pytest.raises(InputError, match="took too long"):
        process.read(tmp_path / "a.vtp", "vtk", suffix=".vtp")


def test_memory_is_limited(tmp_path, monkeypatch):
    resource = pytest.importorskip("resource")
    if not hasattr(resource, "RLIMIT_AS"):
        pytest.skip("the address space cannot be limited")
    source = Path(process.readers.__file__).read_text()
    greedy = "READERS['vtk'] = lambda path, suffix: {'x': np.ones(1 << 28)}\n\n\ndef main() -> None:"
    (tmp_path / "reader.py").write_text(source.replace("def main() -> None:", greedy, 1))
    (tmp_path / "a.vtp").write_bytes(b"x")
    monkeypatch.setattr(process.readers, "__file__", str(tmp_path / "reader.py"))
    monkeypatch.setattr(limits, "READER_BYTES", 1 << 30)
    with pytest.raises(InputError, match="memory"):
        process.read(tmp_path / "a.vtp", "vtk", suffix=".vtp")


def test_arrays_of_any_shape_and_type_arrive(tmp_path, monkeypatch):
    source = Path(process.readers.__file__).read_text()
    arrays = (
        "{'a': np.arange(6, dtype='>i2').reshape(2, 3).T, 'b': [np.empty((0, 4)), np.array(2.5)], 'c': None}"
    )
    made = f"READERS['made'] = lambda path: {arrays}\n\n\ndef main() -> None:"
    (tmp_path / "reader.py").write_text(source.replace("def main() -> None:", made, 1))
    (tmp_path / "a.vtp").write_bytes(b"x")
    monkeypatch.setattr(process.readers, "__file__", str(tmp_path / "reader.py"))
    found = process.read(tmp_path / "a.vtp", "made")
    assert np.array_equal(found["a"], [[0, 3], [1, 4], [2, 5]]) and found["a"].dtype == np.dtype(">i2")
    assert found["b"][0].shape == (0, 4) and found["b"][1] == 2.5 and found["c"] is None


POLYDATA = """<?xml version="1.0"?><VTKFile type="PolyData" version="1.0" byte_order="LittleEndian"><PolyData>
<Piece NumberOfPoints="{points}" NumberOfPolys="{polys}"><Points><DataArray type="Float64" NumberOfComponents="3"
format="ascii">{places}</DataArray></Points><Polys><DataArray type="Int64" Name="connectivity" format="ascii">{corners}
</DataArray><DataArray type="Int64" Name="offsets" format="ascii">{offsets}</DataArray></Polys></Piece></PolyData>
</VTKFile>"""
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
