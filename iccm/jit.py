"""How kernels are compiled, and no more of it than is used: the first run on a fresh machine waits for it.

Nobody hands a kernel to C, so none gets an entry for C; those that only other kernels call get none for Python either.
Together these entries were a sixth of the time. They are part of what calls them, and not kept for themselves: that
costs every start a look at the disk. A test proves that nothing else calls `inner` kernels, which would crash.
"""

from typing import Any

from numba import njit

# numpy's error model: a division by zero gives inf, which line searches reject, instead of a branch at each one
COMMON: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
kernel = njit(cache=True, **COMMON)
inner = njit(**COMMON | {"no_cpython_wrapper": True})
