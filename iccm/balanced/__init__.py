"""--method balanced: maps whose outline is held, with nothing folded, the size even and the picture upright."""

from .failure import NoMapError
from .method import solve
from .solution import Settings, Solution

__all__ = ["NoMapError", "Settings", "Solution", "solve"]
