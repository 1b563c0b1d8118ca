"""Checks of the installation: versions, the compiled core, threads, write access, and a map that must come out."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib import import_module, metadata
from pathlib import Path
from typing import TYPE_CHECKING

from .. import __version__

if TYPE_CHECKING:
    from packaging.requirements import Requirement
    from packaging.specifiers import SpecifierSet

MODULES = {
    "libigl": "igl",
    "pillow": "PIL",
    "resvg-py": "resvg_py",
    "scikit-image": "skimage",
}
"""Module names of requirements whose names differ."""
EXTRAS = {
    "dask": "iccm batch --dask",
    "draco": "glTF files compressed by Draco",
    "dxf": "shapes from DXF files",
    "edit": "iccm edit",
    "meshopt": "glTF files compressed by meshopt",
}
"""What each extra is for."""


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at; `ok` None where it is neither good nor bad."""

    what: str
    said: str
    ok: bool | None = None


def examine(watched: Callable[[], AbstractContextManager[None]]) -> Iterator[Finding]:
    """Everything that is worth a look, as it is found; what takes long is done inside `watched`."""
    yield Finding("iccm", f"{__version__} in {Path(__file__).parents[1]}")
    yield Finding(
        "python", f"{platform.python_version()} on {platform.platform()}", sys.version_info >= (3, 11)
    )
    yield from _requirements()
    yield from _threads()
    yield from _writing()
    yield _fonts()
    yield _check("core", _compiled_core, watched)
    yield _check("map", _try_map, watched)


def _requirements() -> Iterator[Finding]:
    """Everything that the installed package asks for; that of extras may be missing, but not too old."""
    try:
        from packaging.requirements import Requirement

        listed = [Requirement(text) for text in metadata.requires("iccm") or []]
    except ImportError as error:  # metadata that is missing counts as an ImportError, too
        yield Finding("requirements", f"{error.name} is not installed", False)
        return
    for requirement in listed:
        extra = next((name for name in ("", *EXTRAS) if _applies(requirement, name)), None)
        if extra is not None:
            yield _library(requirement.name, requirement.specifier, EXTRAS.get(extra, ""))


def _applies(requirement: Requirement, extra: str) -> bool:
    return requirement.marker is None or requirement.marker.evaluate({"extra": extra})


def _library(name: str, wanted: SpecifierSet, purpose: str) -> Finding:
    """Return whether a requirement is there, of a version that will do, and can be imported."""
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        missing = f"not installed; only needed for {purpose}" if purpose else "not installed"
        return Finding(name, missing, None if purpose else False)
    if not wanted.contains(version, prereleases=True):
        needed = f"{name}{wanted} is needed"
        return Finding(
            name, f"{version}; {needed} for {purpose}" if purpose else f"{version}; {needed}", False
        )
    if purpose:  # imported by the commands that need it
        return Finding(name, version, True)
    start = time.perf_counter()
    try:
        import_module(MODULES.get(name, name))
    except Exception as error:  # whatever a broken library raises is the finding
        return Finding(name, f"{version}: {' '.join(str(error).split())}", False)
    return Finding(name, f"{version} (imported in {time.perf_counter() - start:.2f} s)", True)


def _threads() -> Iterator[Finding]:
    yield Finding(
        "cores", str(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count())
    )
    for name in ("OMP_NUM_THREADS", "ICCM_CORE", "SOURCE_DATE_EPOCH"):
        if name in os.environ:
            yield Finding(name, os.environ[name])


def _writing() -> Iterator[Finding]:
    for what, folder in (("this folder", Path.cwd()), ("temporary files", Path(tempfile.gettempdir()))):
        yield _writable(what, folder)


def _fonts() -> Finding:
    """Return what finds the fonts that texts of drawings ask for."""
    try:
        from .svg.lettering import finder
    except ImportError as error:  # a library that is missing has its own line
        return Finding("fonts", f"not looked for: {error}")
    return Finding("fonts", finder())


def _writable(what: str, folder: Path) -> Finding:
    try:
        with tempfile.TemporaryFile(dir=folder):
            return Finding(what, f"{folder} is writable", True)
    except OSError as error:
        return Finding(what, f"{folder} is not writable: {error.strerror}", False)


def _check(
    what: str, test: Callable[[], str], watched: Callable[[], AbstractContextManager[None]]
) -> Finding:
    try:
        with watched():
            return Finding(what, test(), True)
    except Exception as error:  # the finding is that it does not work
        return Finding(what, f"{type(error).__name__}: {' '.join(str(error).split())}", False)


def _compiled_core() -> str:
    """Return the compiled core must load; which of its variants this processor has."""
    from ..native.library import library

    return Path(library()._name).name


def _try_map() -> str:
    """Return a square onto itself must be the identity, and so must a picture through it."""
    import numpy as np

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
        raise ArithmeticError(
            f"the map of a square onto itself is wrong: error {gap:.3g}, error of its picture {off}"
        )
    return (
        f"the map of a square onto itself is correct to {gap:.0e} (took {time.perf_counter() - start:.2f} s)"
    )
