"""Files that meshes and material libraries refer to: only those below their folder, unless others are allowed.

Otherwise the mesh of a stranger could refer to any file on this machine, whose content would then appear in outputs.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

_ALLOWED = ContextVar("outside", default=False)
OUTSIDE = "which is outside its folder; allow this with --allow-outside"


@contextmanager
def outside(allowed: bool) -> Iterator[None]:
    """Set whether files outside of the folder may be read in the block."""
    token = _ALLOWED.set(allowed)
    try:
        yield
    finally:
        _ALLOWED.reset(token)


def may_be_read(path: Path, folder: Path) -> bool:
    """Return whether a file referred to by a file in the folder may be read; symbolic links are resolved."""
    if "\0" in str(path):
        return False
    return _ALLOWED.get() or Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))
