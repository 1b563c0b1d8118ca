"""Storage of large arrays, and limits on the memory of concurrent work.

`iccm.io.memory` has an implementation with a limit.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Memory:
    """Memory without a limit."""

    def __call__(self, shape: tuple[int, ...], dtype: Any) -> NDArray:
        """Return an uninitialised array."""
        return np.empty(shape, dtype)

    def release(self) -> None:
        """Release memory between pieces of work; contents of the arrays may be moved to disk."""

    def threads(self, requested: int | None, bytes_each: int, what: str) -> int | None:
        """Return the number of threads to use for work that needs `bytes_each` bytes per thread."""
        return requested

    def check(self, bytes_each: int, what: str) -> None:
        """Raise if memory will not suffice for some work, before a map is solved for it; arguments as for
        `threads`.
        """
