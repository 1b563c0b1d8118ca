"""Checks of the installation: versions, threads, caches, write access, and a map that must come out."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module, metadata
from pathlib import Path

import numpy as np

from .. import __version__

NEEDED = {
    "numpy": "numpy",
    "scipy": "scipy",
    "shapely": "shapely",
    "numba": "numba",
    "libigl": "igl",
    "OpenImageIO": "OpenImageIO",
    "isal": "isal",
    "opencv-python-headless": "cv2",
    "scikit-image": "skimage",
    "trimesh": "trimesh",
    "defusedxml": "defusedxml",
    "pydantic": "pydantic",
    "matplotlib": "matplotlib",
    "tqdm": "tqdm",
    "click": "click",
}
OPTIONAL = {
    "distributed": "iccm batch --dask",
    "starlette": "iccm edit",
    "uvicorn": "iccm edit",
    "websockets": "iccm edit",
}


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at; `ok` None where it is neither good nor bad."""

    what: str
    said: str
    ok: bool | None = None


def examine() -> Iterator[Finding]:
    """Everything that is worth a look, as it is found."""
    yield Finding("iccm", f"{__version__} in {Path(__file__).parents[1]}")
    yield Finding(
        "python", f"{platform.python_version()} on {platform.platform()}", sys.version_info >= (3, 11)
    )
    for name, module in NEEDED.items():
        yield _library(name, module)
    for name, purpose in OPTIONAL.items():
        yield Finding(name, _version(name) or f"not installed; only needed for {purpose}")
    yield from _threads()
    yield from _writing()
    yield _check("kernels", _compiled_kernels)
    yield _check("map", _try_map)


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _library(name: str, module: str) -> Finding:
    start = time.perf_counter()
    try:
        import_module(module)
    except Exception as error:  # whatever a broken library raises is the finding
        return Finding(name, f"{_version(name) or 'not installed'}: {' '.join(str(error).split())}", False)
    return Finding(name, f"{_version(name)} (imported in {time.perf_counter() - start:.2f} s)", True)


def _threads() -> Iterator[Finding]:
    yield Finding(
        "cores", str(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count())
    )
    names = (
        "OMP_NUM_THREADS",
        "NUMBA_NUM_THREADS",
        "NUMBA_CACHE_DIR",
        "SOURCE_DATE_EPOCH",
    )
    for name in names:
        if name in os.environ:
            yield Finding(name, os.environ[name])


def _writing() -> Iterator[Finding]:
    for what, folder in (("this folder", Path.cwd()), ("temporary files", Path(tempfile.gettempdir()))):
        yield _writable(what, folder, True)
    found = [_writable("compiled kernels", folder, False) for folder in _caches()]
    hint = "; every start compiles again: set NUMBA_CACHE_DIR to a folder that can be written"
    good = next((finding for finding in found if finding.ok), None)
    yield good or Finding("compiled kernels", found[0].said + hint, False)


def _caches() -> list[Path]:
    """Where numba keeps compiled kernels: the first of these that can be written."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return [Path(os.environ["NUMBA_CACHE_DIR"])]
    import iccm

    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return [Path(iccm.__file__).parent, Path(home)]


def _writable(what: str, folder: Path, needed: bool) -> Finding:
    try:
        with tempfile.TemporaryFile(dir=folder):
            return Finding(what, f"{folder} can be written", True)
    except OSError as error:
        return Finding(what, f"{folder} cannot be written: {error.strerror}", False if needed else None)


def _check(what: str, test: Callable[[], str]) -> Finding:
    try:
        return Finding(what, test(), True)
    except Exception as error:  # the finding is that it does not work
        return Finding(what, f"{type(error).__name__}: {' '.join(str(error).split())}", False)


def _compiled_kernels() -> str:
    """The kernels of common jobs must compile; what is in the cache is not compiled again."""
    from .. import ahead

    parts, start = ahead.missing(), time.perf_counter()
    ahead.compile_ahead()
    if parts and ahead.missing() == parts:
        raise OSError("compiled, but not kept: every start compiles again")
    return f"compiled in {time.perf_counter() - start:.0f} s, once" if parts else "compiled"


def _try_map() -> str:
    """A square onto itself must be the identity, and so must a picture through it."""
    import iccm

    from ..pixels.warp import Canvas, Texture, warp

    square = np.array([0, 1, 1 + 1j, 1j])
    start = time.perf_counter()
    fit = iccm.fit(square, square, method="paper")
    gap = float(np.abs(fit.map(np.array([0.3 + 0.6j])) - (0.3 + 0.6j))[0])
    pixels = np.arange(192, dtype=np.uint8).reshape(8, 8, 3)
    box = (0j, 1 + 1j)
    shown = warp(fit.map, Texture(pixels, box), Canvas(8, 8, box)).pixels[1:7, 1:7, :3]
    off = int(np.abs(shown.astype(int) - pixels[1:7, 1:7]).max())
    if not (gap < 1e-6 and off <= 1):
        raise ArithmeticError(f"a square onto itself is off by {gap:.3g}, its picture by {off}")
    return f"a square onto itself is right to {gap:.0e}, in {time.perf_counter() - start:.2f} s"
