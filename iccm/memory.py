"""Storage of large arrays, and the work that may be in memory at a time. `iccm.io.memory` has one with a bound."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Memory:
    """Memory without a bound."""

    def __call__(self, shape: tuple[int, ...], dtype: Any) -> NDArray:
        """Return an array of any content."""
        return np.empty(shape, dtype)

    def release(self) -> None:
        """Release memory between pieces of work: what the arrays hold need not be at hand."""

    def threads(self, asked: int | None, each: int, what: str) -> int | None:
        """Return how many threads there may be for some work of which each needs so many bytes."""
        return asked

    def check(self, each: int, what: str) -> None:
        """Refuses, before a map is solved for, work for which there will be no room; arguments as for `threads`."""
