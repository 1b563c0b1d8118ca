"""How kernels are compiled, and no more of it than is used: the first run on a fresh machine waits for it.

Nobody hands a kernel to C, so none gets an entry for C; those that only other kernels call get none for Python either.
Together these entries were a sixth of the time. They are part of what calls them, and not kept for themselves: that
costs every start a look at the disk. A test proves that nothing else calls `inner` kernels, which would crash.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit

COMMON: dict[str, Any] = {"nogil": True, "no_cfunc_wrapper": True}
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


def kept(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator for kernels that Python calls, kept in numba's cache until a file with kernels changes.

    Numba itself looks at the kernel's own file alone, and would go on with old code of kernels that this one calls.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        found = njit(**COMMON | options | {"cache": True})(function)
        file: Any = getattr(getattr(found, "_cache", None), "_cache_file", None)
        if hasattr(file, "_version"):
            # beside the version, which is read before types are unpickled, whose classes may be gone
            file._version = file._version, STAMP
        return found

    return compiled


kernel = kept(**NUMPY)
inner = njit(**COMMON | NUMPY | {"no_cpython_wrapper": True})
inlined = njit(**COMMON | NUMPY | {"no_cpython_wrapper": True}, forceinline=True)  # where a call takes long
