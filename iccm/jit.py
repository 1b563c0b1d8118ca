"""Compilation of kernels, and no more of it than is used: the first run on a fresh machine waits for it.

A kernel is compiled with an entry for Python when Python calls it, and kept in Numba's cache. Where another kernel
calls it, its code becomes part of that one's, without an entry, and is not kept for itself: that would cost every
start a look at the disk. Nobody hands a kernel to C, so none gets an entry for that.
"""

from collections.abc import Callable
from functools import cached_property, update_wrapper
from pathlib import Path
from typing import Any

import numba
from numba import njit

KNOWN = (0, 68)
"""The version of Numba whose insides `compiling` knows; others compile in their own way, which takes longer."""


KNOWS = numba.version_info[:2] == KNOWN


def _compiler() -> dict[str, Any]:
    if not KNOWS:
        return {}
    from .compiling.pipeline import Pipeline

    return {"pipeline_class": Pipeline}


COMMON: dict[str, Any] = {"nogil": True, "no_cfunc_wrapper": True} | _compiler()
# a division by zero gives inf, which line searches reject, instead of a branch at each one
NUMPY: dict[str, Any] = {"error_model": "numpy"}


def _stamp() -> tuple[tuple[int, int], ...]:
    """When the files that hold kernels were written, and their sizes."""
    files = sorted(
        path
        for path in Path(__file__).parent.rglob("*.py")
        if b"numba" in path.read_bytes() or b"jit import" in path.read_bytes()
    )
    return tuple((path.stat().st_mtime_ns, path.stat().st_size) for path in files)


STAMP = _stamp()


class Kernel:
    """A function that Python and other kernels call, compiled for whichever does."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]):
        update_wrapper(self, function)
        self.py_func, self._options = function, COMMON | options

    def __call__(self, *args: Any) -> Any:
        """As the function does, compiled."""
        return self.entry(*args)

    @cached_property
    def entry(self) -> Any:
        """What Python calls, kept in Numba's cache until a file with kernels changes.

        Numba itself looks at the kernel's own file alone, and would go on with old code of kernels that this one calls.
        """
        found = njit(**self._options | {"cache": True})(self.py_func)
        if KNOWS and hasattr(found, "_cache"):
            from .compiling.pipeline import Kept

            found._cache = Kept(self.py_func)
        file: Any = getattr(getattr(found, "_cache", None), "_cache_file", None)
        if hasattr(file, "_version"):
            # beside the version, which is read before types are unpickled, whose classes may be gone
            file._version = file._version, STAMP
        return found

    @cached_property
    def part(self) -> Any:
        """What other kernels call."""
        return njit(**self._options | {"no_cpython_wrapper": True})(self.py_func)

    @property
    def _numba_type_(self) -> Any:
        """What Numba takes this for where a kernel names it."""
        return self.part._numba_type_


def kept(**options: Any) -> Callable[[Callable[..., Any]], Kernel]:
    """A decorator for kernels with options of Numba's."""
    return lambda function: Kernel(function, options)


kernel = kept(**NUMPY)
# makes no array: without counts of references, which take time to compile and to keep
in_place = kept(**NUMPY, _nrt=False)
inlined = kept(**NUMPY, _nrt=False, forceinline=True)  # likewise, where a call takes long
