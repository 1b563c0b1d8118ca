"""Declare functions of the core for Python.

A declaration is the prototype of the function, word by word as it is in C++:

    _fill = function("int64_t iccm_linalg_fill(const int64_t *starts, Complex *z, int64_t n, double share)")

The function then takes NumPy arrays for pointers and Python numbers for the others. That an array has the type of the
declaration, is contiguous in C's order and, unless `const`, writable is checked at every call, which takes less than a
microsecond for an array; the functions themselves trust sizes and indices, which whoever calls them hands over right.

Arrays that go together are declared as a record, a struct of the core, member by member in its order. A record checks
its arrays once, when it is made, and keeps them:

    Rails = record("struct Rails { const double *knots; const Complex *vertices; int64_t size; }")
    _length = function("double iccm_example_length(const Rails *rails)")
    _length(Rails(knots, vertices, vertices.size))

What the core calls back is declared as a type, too; a member of that type takes an object of it, or None for null:

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
"""What a function returns that found no memory, as `iccm::OUT_OF_MEMORY` in core.h."""


class Function:
    """A function of the core, looked up in the library at its first call.

    Args:
        prototype: as in C++.
    """

    def __init__(self, prototype: str):
        self.prototype = " ".join(prototype.split()).replace("( ", "(")
        found = PROTOTYPE.fullmatch(self.prototype)
        if found is None:
            raise ValueError(f"not a prototype of a function of the core: {self.prototype}")
        self.name, self._returns = found["name"], found["returns"]
        self._arguments = found["arguments"].split(", ") if found["arguments"] else []

    def __call__(self, *args: Any) -> Any:
        """Call the function.

        Raises:
            ctypes.ArgumentError: an array of another type, not contiguous, or read-only where it is written.
            MemoryError: it needs memory for its work, and there is none.
        """
        result = self._entry(*args)
        if result == OUT_OF_MEMORY:
            raise MemoryError(self.name)
        return result

    @cached_property
    def _entry(self) -> Any:
        entry = library()[self.name]  # a separate object, unlike the attribute
        entry.argtypes = [_argument(text) for text in self._arguments]
        entry.restype = SCALARS[self._returns]
        return entry


def function(prototype: str) -> Function:
    """Declare a function of the core by its prototype; see `Function`."""
    return Function(prototype)


class Record(ctypes.Structure):
    """A struct of the core, made from its members in their order: NumPy arrays, numbers and other records.

    Raises:
        TypeError: an array of another type, not contiguous, or read-only where it is written.
    """

    declaration: str
    _converters: tuple[Callable[[Any], Any], ...]

    def __init__(self, *values: Any):
        if len(values) != len(self._converters):
            raise TypeError(f"{type(self).__name__} has {len(self._converters)} members, not {len(values)}")
        super().__init__(*[convert(value) for convert, value in zip(self._converters, values)])
        self._values = values  # the arrays, which must not be freed before the record


RECORDS: dict[str, type[Record]] = {}
"""The records that are declared, by name."""
CALLBACKS: dict[str, Any] = {}
"""The types of functions that the core calls, by name."""


def record(declaration: str) -> type[Record]:
    """Declare a struct of the core, word by word as in C++; see `Record`."""
    declaration = " ".join(declaration.split())
    found = STRUCT.fullmatch(declaration)
    if found is None:
        raise ValueError(f"not a struct of the core: {declaration}")
    fields: list[tuple[str, Any]] = []
    converters: list[Callable[[Any], Any]] = []
    for text in found["members"].rstrip("; ").split("; "):
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
    made: type[Record] = type(found["name"], (Record,), attributes)
    RECORDS[found["name"]] = made
    return made


def callback(declaration: str) -> Any:
    """Declare the type of a function that the core calls: numbers, and addresses for arrays (see `array_at`).

    It must not raise: ctypes would continue with a result of 0.
    """
    found = CALLBACK.fullmatch(" ".join(declaration.split()))
    if found is None:
        raise ValueError(f"not a function that the core calls: {declaration}")
    arguments = [ARGUMENT.fullmatch(text) for text in found["arguments"].split(", ")]
    types = [
        ctypes.c_void_p if argument["pointer"] else SCALARS[argument["type"]]
        for argument in arguments
        if argument is not None
    ]
    made = ctypes.CFUNCTYPE(SCALARS[found["returns"]], *types)
    CALLBACKS[found["name"]] = made
    return made


def array_at(address: int, size: int, dtype: type) -> np.ndarray:
    """Return the array of the core at an address, without a copy: it is valid while the core's function runs."""
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
        found = convert(array)
        return (found.value or 0) if isinstance(found, ctypes.c_void_p) else ctypes.addressof(found)

    return address


def _argument(text: str) -> Any:
    """Return what ctypes converts an argument with."""
    found = ARGUMENT.fullmatch(text)
    if found is None:
        raise ValueError(f"not an argument of a function of the core: {text}")
    if not found["pointer"]:
        return SCALARS[found["type"]]
    if found["type"] in RECORDS:
        return ctypes.POINTER(RECORDS[found["type"]])
    return _array(found)


def _array(found: re.Match[str]) -> Any:
    """Return what ctypes converts an array with."""
    dtype = np.dtype(ARRAYS[found["type"]])
    return _constant(found["name"], dtype) if found["const"] else _written(found["name"], dtype)


Bytes: Any = ctypes.c_char * 0
ADDRESS: Callable[[Any], Any] = Bytes.from_buffer
"""An object at the address of a contiguous, writable array: five times as fast as NumPy's own `ctypes` attribute."""


def _written(name: str, dtype: np.dtype) -> Any:
    class Written:
        """An array that is read and written."""

        @staticmethod
        def from_param(array: Any) -> Any:
            if array.dtype is not dtype and array.dtype != dtype:
                raise TypeError(_mismatch(name, array, dtype, "writable "))
            try:
                return ADDRESS(array)
            except (TypeError, ValueError, BufferError):
                raise TypeError(_mismatch(name, array, dtype, "writable ")) from None

    return Written


def _constant(name: str, dtype: np.dtype) -> Any:
    class Constant:
        """An array that is only read."""

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
