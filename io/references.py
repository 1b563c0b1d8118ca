"""Files that meshes and material libraries refer to: those in their folder and below, others only where allowed.

A mesh from a stranger could otherwise name any file of this machine, and its content would be in what is written.
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
    """Whether, inside the block, files outside of the folder are taken."""
    token = _ALLOWED.set(allowed)
    try:
        yield
    finally:
        _ALLOWED.reset(token)


def may_be_read(path: Path, folder: Path) -> bool:
    """Return whether a file that something in the folder refers to may be read; links count as what they lead to."""
    if "\0" in str(path):
        return False
    return _ALLOWED.get() or Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))
