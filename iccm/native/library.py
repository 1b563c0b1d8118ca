"""Find and load the shared library of the core that fits the processor.

In an editable installation, the core is compiled anew if its sources have changed: a library that does not match the
declarations in Python could access invalid memory.
"""

import ctypes
import os
import platform
import subprocess
import sys
from functools import cache
from pathlib import Path

from ..errors import IccmError

FOLDER = Path(__file__).resolve().parent / "lib"
VARIANT = "ICCM_CORE"
"""Environment variable with the name of a variant, such as x86-64, for tests and comparisons."""
ENDING = {"Darwin": ".dylib", "Windows": ".dll"}.get(platform.system(), ".so")


class CoreMissing(IccmError, ImportError):
    """The compiled core is missing, or cannot be loaded."""


@cache
def library() -> ctypes.CDLL:
    """Return the core, loaded at the first call; its functions release the GIL.

    Raises:
        CoreMissing: there is none for this platform.
    """
    refresh()
    if variant := os.environ.get(VARIANT):
        return _load(f"core-{variant}")
    if platform.machine() not in ("x86_64", "AMD64"):
        return _load("core")
    if (FOLDER / f"core-x86-64-v3{ENDING}").is_file():  # a checkout has one variant only
        wide = _load("core-x86-64-v3")
        level = wide.iccm_runtime_x86_64_level
        level.restype = ctypes.c_int64
        if level() >= 3:
            return wide
    return _load("core-x86-64")


def _load(name: str) -> ctypes.CDLL:
    file = FOLDER / (name + ENDING)
    if not file.is_file():
        raise CoreMissing(
            f"{file}: the compiled core is missing; install iccm again, or in a checkout run: "
            f"{sys.executable} core/compile.py iccm/native/lib"
        )
    try:
        return ctypes.CDLL(str(file))
    except OSError as error:
        raise CoreMissing(f"{file}: the compiled core cannot be loaded: {error}") from error


def refresh() -> None:
    """Compile the core in a checkout if it is older than its sources; an installed package has no sources."""
    core = FOLDER.parents[2] / "core"
    if not (core / "include" / "iccm" / "core.h").is_file():
        return
    files = [path for ending in ("*.cpp", "*.h", "*.py") for path in core.rglob(ending)]
    newest = max(path.stat().st_mtime for path in files)
    libraries = list(FOLDER.glob(f"core*{ENDING}"))
    if libraries and min(path.stat().st_mtime for path in libraries) >= newest:
        return
    compilation = subprocess.run([sys.executable, str(core / "compile.py")], capture_output=True, text=True)
    if compilation.returncode:
        raise CoreMissing(
            f"the compiled core is older than its sources, and compiling it failed:\n{compilation.stderr}"
        )
