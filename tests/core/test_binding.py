"""Functions of the core as Python calls them."""

import ctypes
import pkgutil
import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import iccm
from iccm.native.binding import RECORDS, Function, function, record
from iccm.native.library import FOLDER, library

CORE = Path(__file__).parents[2] / "core"
EXPORTED = re.compile(r"^ICCM_EXPORT (\w+ \w+\([^)]*\)) \{", re.MULTILINE)
FILL = """int64_t iccm_linalg_fill(
    const int64_t *starts, const int64_t *around, const int64_t *corners, const int64_t *order, int64_t *ends,
    int64_t *members, int64_t room, int64_t *work, int64_t n)"""


def one_triangle():
    numbers = [np.array(given) for given in ([0, 1, 2, 3], [0, 0, 0], [0, 1, 2], [2, 0, 1])]
    return [*numbers, np.zeros(4, np.int64), np.zeros(9, np.int64), 9, np.zeros(12, np.int64), 3]


def exported():
    return {
        " ".join(text.split()).replace("( ", "(")
        for path in CORE.rglob("*.cpp")
        for text in EXPORTED.findall(path.read_text(encoding="utf-8"))
    }


def declared():
    modules = [
        import_module(info.name)
        for info in pkgutil.walk_packages(iccm.__path__, "iccm.")
        if not info.name.startswith(("iccm.cli", "iccm.io", "iccm.plugins", "iccm.samples"))
    ]
    modules += [import_module(name) for name in ("iccm.io.meshes.obj_scan", "tests.core.line_search")]
    return {
        value.prototype
        for module in modules
        for value in vars(module).values()
        if isinstance(value, Function)
    }


def test_declarations_are_the_prototypes_in_c():
    ours = declared()
    assert any("iccm_linalg_fill" in prototype for prototype in ours)
    assert ours <= exported()


def test_every_function_that_is_exported_is_declared():
    assert {p for p in exported() if "iccm_runtime" not in p} <= declared()


def test_records_are_the_structs_in_c():
    """Data members come first, then functions if there are any."""
    declared()  # imports all of them
    text = "\n".join(
        path.read_text(encoding="utf-8") for ending in ("*.h", "*.cpp") for path in CORE.rglob(ending)
    )
    text = " ".join(re.sub("//.*", "", text).split())
    assert "System" in RECORDS
    for struct_record in RECORDS.values():
        _, match, following = text.partition(struct_record.declaration.removesuffix("}"))
        assert match, struct_record.declaration
        assert following.startswith("}") or "(" in following.partition(";")[0], struct_record.declaration


def test_a_record_checks_its_members():
    example = record("struct Example { const double *x; int64_t *order; int64_t n; }")
    try:
        order = np.arange(3)
        instance = example(np.zeros(3), order, 3)
        assert instance.n == 3 and instance.order == order.ctypes.data
        for values in ((np.zeros(3, np.float32), order, 3), (np.zeros(6)[::2], order, 3)):
            with pytest.raises(TypeError, match="x: a contiguous array of float64"):
                example(*values)
        order.flags.writeable = False
        with pytest.raises(TypeError, match="order: a writable"):
            example(np.zeros(3), order, 3)
        with pytest.raises(TypeError, match="3 members, not 1"):
            example(np.zeros(3))
    finally:
        del RECORDS["Example"]


def test_every_library_has_every_function():
    names = {re.search(r"iccm_\w+", prototype)[0] for prototype in exported()}
    library()  # updates those of a source checkout
    libraries = list(FOLDER.glob("core*.*"))
    assert libraries
    for path in libraries:
        loaded = ctypes.CDLL(str(path))
        assert all(hasattr(loaded, name) for name in names)


def test_a_function_is_called_with_arrays():
    args = one_triangle()
    assert function(FILL)(*args) == 1
    assert args[4].tolist() == [0, 2, 3, 3] and args[5][:3].tolist() == [0, 1, 1]


@pytest.mark.parametrize(
    "place, change",
    [
        (0, lambda a: a.astype(np.int32)),
        (0, lambda a: np.repeat(a, 2)[::2]),
        (4, lambda a: a.astype(float)),
        (5, lambda a: np.repeat(a, 2)[::2]),
    ],
)
def test_arrays_of_another_kind_are_refused(place, change):
    args = one_triangle()
    args[place] = change(args[place])
    with pytest.raises(ctypes.ArgumentError, match="starts" if place == 0 else "ends|members"):
        function(FILL)(*args)


def test_read_only_arrays_are_read_and_not_written():
    args = one_triangle()
    for array in args[:4]:
        array.flags.writeable = False
    assert function(FILL)(*args) == 1
    args[4].flags.writeable = False
    with pytest.raises(ctypes.ArgumentError, match="ends"):
        function(FILL)(*args)


def test_declarations_that_are_not_prototypes_are_refused():
    with pytest.raises(ValueError, match="prototype"):
        function("iccm_linalg_fill(int64_t n)")


def test_the_processor_has_a_level():
    assert library().iccm_runtime_x86_64_level() in (0, 1, 3)
