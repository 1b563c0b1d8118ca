"""Declare functions of the core for Python.

A declaration is the prototype of the function, exactly as in C++:

    _fill = function("int64_t iccm_linalg_fill(const int64_t *starts, Complex *z, int64_t n, double share)")

The function then accepts NumPy arrays for pointers, and Python numbers for scalars. Every call checks that an array has
the declared type, is C-contiguous and, unless `const`, writable; this takes less than a microsecond per array. Sizes
and indices are not checked; the caller is responsible for them.

Related arrays are declared as a record, a struct of the core, with its members in order. A record checks its arrays
once, when it is created, and keeps references to them:

    Rails = record("struct Rails { const double *knots; const Complex *vertices; int64_t size; }")
    _length = function("double iccm_example_length(const Rails *rails)")
    _length(Rails(knots, vertices, vertices.size))

Callbacks of the core are declared as types, too; a member of that type accepts an object of it, or None for null:

    Total = callback("double Total(const Complex *u)")
    total = Total(lambda u: float(np.abs(array_at(u, n, np.complex128)).sum()))
"""

import ctypes
import re
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from .library import library

SCALARS: dict[str, Any] = {
    "int64_t": ctypes.c_int64,
    "int32_t": ctypes.c_int32,
    "double": ctypes.c_double,
    "float": ctypes.c_float,
    "bool": ctypes.c_bool,
}
ARRAYS: dict[str, Any] = {
    "int64_t": np.int64,
    "int32_t": np.int32,
    "int8_t": np.int8,
    "uint8_t": np.uint8,
    "uint16_t": np.uint16,
    "uint32_t": np.uint32,
    "bool": np.bool_,
    "float": np.float32,
    "double": np.float64,
    "Complex": np.complex128,
    "Complex64": np.complex64,
}
STRUCT = re.compile(r"struct (?P<name>\w+) \{ (?P<members>[^}]*)\}", re.ASCII)
PROTOTYPE = re.compile(r"(?P<returns>\w+) (?P<name>iccm_\w+)\((?P<arguments>[^)]*)\)", re.ASCII)
CALLBACK = re.compile(r"(?P<returns>\w+) (?P<name>\w+)\((?P<arguments>[^)]*)\)", re.ASCII)
ARGUMENT = re.compile(r"(?P<const>const )?(?P<type>\w+) (?P<pointer>\*?)(?P<name>\w+)", re.ASCII)
OUT_OF_MEMORY = -(2**63)
"""Return value of functions that could not allocate memory; `iccm::OUT_OF_MEMORY` in core.h."""


class Function:
    """A function of the core, looked up in the library at its first call.

    Args:
        prototype: as in C++.
    """

    def __init__(self, prototype: str):
        self.prototype = " ".join(prototype.split()).replace("( ", "(")
        match = PROTOTYPE.fullmatch(self.prototype)
        if match is None:
            raise ValueError(f"not a prototype of a function of the core: {self.prototype}")
        self.name, self._returns = match["name"], match["returns"]
        self._arguments = match["arguments"].split(", ") if match["arguments"] else []

    def __call__(self, *args: Any) -> Any:
        """Call the function.

        Raises:
            ctypes.ArgumentError: an array has the wrong type, is not contiguous, or is read-only but would be written.
            MemoryError: the function could not allocate memory.
        """
        result = self._entry(*args)
        if result == OUT_OF_MEMORY:
            raise MemoryError(self.name)
        return result

    @cached_property
    def _entry(self) -> Any:
        entry = library()[self.name]  # indexing returns a new object each time, unlike attribute access
        entry.argtypes = [_argument(text) for text in self._arguments]
        entry.restype = SCALARS[self._returns]
        return entry


def function(prototype: str) -> Function:
    """Declare a function of the core by its prototype; see `Function`."""
    return Function(prototype)


class Record(ctypes.Structure):
    """A struct of the core, created from its members in order: NumPy arrays, numbers and other records.

    Raises:
        TypeError: an array has the wrong type, is not contiguous, or is read-only but would be written.
    """

    declaration: str
    _converters: tuple[Callable[[Any], Any], ...]

    def __init__(self, *values: Any):
        if len(values) != len(self._converters):
            raise TypeError(f"{type(self).__name__} has {len(self._converters)} members, not {len(values)}")
        super().__init__(*[convert(value) for convert, value in zip(self._converters, values)])
        self._values = values  # the arrays, which must not be freed before the record


RECORDS: dict[str, type[Record]] = {}
"""Declared records by name."""
CALLBACKS: dict[str, Any] = {}
"""Types of declared callbacks by name."""


def record(declaration: str) -> type[Record]:
    """Declare a struct of the core, exactly as in C++; see `Record`."""
    declaration = " ".join(declaration.split())
    match = STRUCT.fullmatch(declaration)
    if match is None:
        raise ValueError(f"not a struct of the core: {declaration}")
    fields: list[tuple[str, Any]] = []
    converters: list[Callable[[Any], Any]] = []
    for text in match["members"].rstrip("; ").split("; "):
        member = ARGUMENT.fullmatch(text)
        if member is None:
            raise ValueError(f"not a member of a struct of the core: {text}")
        kind, name = member["type"], member["name"]
        if member["pointer"]:
            fields.append((name, ctypes.c_void_p))
            converters.append(_address_of(_array(member)))
        elif kind in CALLBACKS:
            fields.append((name, CALLBACKS[kind]))
            converters.append(_callback_or_null(CALLBACKS[kind]))
        elif kind in RECORDS:
            fields.append((name, RECORDS[kind]))
            converters.append(_same)
        else:
            fields.append((name, SCALARS[kind]))
            converters.append(_same)
    attributes = {"_fields_": fields, "_converters": tuple(converters), "declaration": declaration}
    record_type: type[Record] = type(match["name"], (Record,), attributes)
    RECORDS[match["name"]] = record_type
    return record_type


def callback(declaration: str) -> Any:
    """Declare the type of a callback of the core; its arguments are numbers, and addresses of arrays (see `array_at`).

    A callback must not raise: ctypes would ignore the exception and return 0.
    """
    match = CALLBACK.fullmatch(" ".join(declaration.split()))
    if match is None:
        raise ValueError(f"not a function that the core calls: {declaration}")
    arguments = [ARGUMENT.fullmatch(text) for text in match["arguments"].split(", ")]
    types = [
        ctypes.c_void_p if argument["pointer"] else SCALARS[argument["type"]]
        for argument in arguments
        if argument is not None
    ]
    callback_type = ctypes.CFUNCTYPE(SCALARS[match["returns"]], *types)
    CALLBACKS[match["name"]] = callback_type
    return callback_type


def array_at(address: int, size: int, dtype: type) -> np.ndarray:
    """Return the core's array at an address without a copy; it is valid only while the core's function runs."""
    kind = np.dtype(dtype)
    memory: Any = (ctypes.c_char * (size * kind.itemsize)).from_address(address)
    return np.frombuffer(memory, kind)


def _same(value: Any) -> Any:
    return value


def _callback_or_null(kind: Any) -> Callable[[Any], Any]:
    return lambda value: kind(0) if value is None else value


def _address_of(converter: Any) -> Callable[[Any], int]:
    convert = converter.from_param

    def address(array: Any) -> int:
        reference = convert(array)
        return (
            (reference.value or 0) if isinstance(reference, ctypes.c_void_p) else ctypes.addressof(reference)
        )

    return address


def _argument(text: str) -> Any:
    """Return the ctypes converter of an argument."""
    match = ARGUMENT.fullmatch(text)
    if match is None:
        raise ValueError(f"not an argument of a function of the core: {text}")
    if not match["pointer"]:
        return SCALARS[match["type"]]
    if match["type"] in RECORDS:
        return ctypes.POINTER(RECORDS[match["type"]])
    return _array(match)


def _array(match: re.Match[str]) -> Any:
    """Return the ctypes converter of an array."""
    dtype = np.dtype(ARRAYS[match["type"]])
    converter = _readonly_converter if match["const"] else _writable_converter
    return converter(match["name"], dtype)


Bytes: Any = ctypes.c_char * 0
ADDRESS: Callable[[Any], Any] = Bytes.from_buffer
"""Returns an object at the address of a contiguous, writable array; five times as fast as NumPy's `ctypes`."""


def _writable_converter(name: str, dtype: np.dtype) -> Any:
    """Return the ctypes converter of an array that the core reads and writes; `name` is for messages."""

    class Written:
        """Converter of an array that is read and written."""

        @staticmethod
        def from_param(array: Any) -> Any:
            if array.dtype is not dtype and array.dtype != dtype:
                raise TypeError(_mismatch(name, array, dtype, "writable "))
            try:
                return ADDRESS(array)
            except (TypeError, ValueError, BufferError):
                raise TypeError(_mismatch(name, array, dtype, "writable ")) from None

    return Written


def _readonly_converter(name: str, dtype: np.dtype) -> Any:
    """Return the ctypes converter of an array that the core only reads; `name` is for messages."""

    class Constant:
        """Converter of an array that is only read."""

        @staticmethod
        def from_param(array: Any) -> Any:
            if array.dtype is not dtype and array.dtype != dtype:
                raise TypeError(_mismatch(name, array, dtype))
            try:
                return ADDRESS(array)
            except (TypeError, ValueError, BufferError):
                if not array.flags.c_contiguous:
                    raise TypeError(_mismatch(name, array, dtype)) from None
                return ctypes.c_void_p(array.ctypes.data)  # read-only

    return Constant


def _mismatch(name: str, array: np.ndarray, dtype: np.dtype, more: str = "") -> str:
    order = "contiguous" if array.flags.c_contiguous else "strided"
    access = "writable" if array.flags.writeable else "read-only"
    return (
        f"{name}: a {more}contiguous array of {dtype} is needed, not one of {array.dtype} "
        f"that is {order} and {access}, of shape {array.shape}"
    )
