"""Files of libraries in native code: whatever happens to the process that reads them, this one reports it in a line."""

import json

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


@pytest.fixture
def reading(tmp_path):
    """`reading(code)` reads a file by the function `read` that the code defines."""

    def reading(code):
        (tmp_path / "a.vtp").write_bytes(b"x")
        module = tmp_path / "reader.py"
        module.write_text(code)
        return process.read(tmp_path / "a.vtp", function_of(module))

    def function_of(module):
        names = {}
        exec(
            compile("def read(path): pass", str(module), "exec"), names
        )  # as the import of the module makes it
        return names["read"]

    return reading


@pytest.mark.slow
@pytest.mark.parametrize("fate", FATES)
def test_the_end_of_the_process_is_a_line(tmp_path, monkeypatch, reading, fate):
    if fate == "no end":
        pytest.importorskip("resource")
    (tmp_path / "program.py").write_text(FATES[fate])
    monkeypatch.setattr(process.program, "__file__", str(tmp_path / "program.py"))
    with pytest.raises(InputError, match=r"a\.vtp: damaged") as error:
        reading("")
    assert "\n" not in str(error.value)


def test_a_process_that_waits_is_ended(reading, monkeypatch):
    monkeypatch.setattr(limits, "READER_WALL_TIME_RATIO", 0.1)
    with pytest.raises(InputError, match="took too long"):
        reading("import time; time.sleep(600)")


def test_memory_is_limited(reading, monkeypatch):
    resource = pytest.importorskip("resource")
    if not hasattr(resource, "RLIMIT_AS"):
        pytest.skip("the address space cannot be limited")
    monkeypatch.setattr(limits, "READER_BYTES", 1 << 30)
    with pytest.raises(InputError, match="memory"):
        reading("import numpy as np\ndef read(path): return {'x': np.ones(1 << 28)}")


def test_arrays_of_any_shape_and_type_arrive(reading):
    arrays = (
        "{'a': np.arange(6, dtype='>i2').reshape(2, 3).T, 'b': [np.empty((0, 4)), np.array(2.5)], 'c': None}"
    )
    found = reading(f"import numpy as np\ndef read(path): return {arrays}")
    assert np.array_equal(found["a"], [[0, 3], [1, 4], [2, 5]]) and found["a"].dtype == np.dtype(">i2")
    assert found["b"][0].shape == (0, 4) and found["b"][1] == 2.5 and found["c"] is None


def test_a_damaged_file_is_the_sentence_of_the_reader(reading):
    code = "from iccm.io.isolated.program import Damaged\ndef read(path): raise Damaged('has a hole')"
    with pytest.raises(InputError, match=r"a\.vtp: has a hole$"):
        reading(code)
    with pytest.raises(InputError, match=r"a\.vtp: cannot be read \(odd\)$"):
        reading("def read(path): raise ValueError('odd')")
    with pytest.raises(InputError, match="no_such_library"):
        reading("def read(path): import no_such_library")
