"""Checks of the installation: versions, the compiled core, threads, write access, and a map with a known result."""

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
from . import extensions

if TYPE_CHECKING:
    from packaging.requirements import Requirement
    from packaging.specifiers import SpecifierSet

MODULES = {
    "libigl": "igl",
    "pillow": "PIL",
    "resvg-py": "resvg_py",
    "scikit-image": "skimage",
}
"""Module names of requirements, where they differ."""


@dataclass(frozen=True)
class Finding:
    """The result of one check; `ok` is None if it is neither good nor bad."""

    check: str
    result: str
    ok: bool | None = None


def examine(watched: Callable[[], AbstractContextManager[None]]) -> Iterator[Finding]:
    """Yield the results of all checks; slow ones run inside `watched`."""
    yield Finding("iccm", f"{__version__} in {Path(__file__).parents[1]}")
    yield Finding(
        "python", f"{platform.python_version()} on {platform.platform()}", sys.version_info >= (3, 11)
    )
    yield from _requirements()
    yield from _threads()
    yield from _writing()
    yield _fonts()
    for name, package, error in extensions.listed():
        yield Finding(name, package if error is None else str(error), error is None)
    yield _check("core", _compiled_core, watched)
    yield _check("map", _try_map, watched)


def _requirements() -> Iterator[Finding]:
    """Yield the requirements of the installed package; those of extras may be missing, but not too old."""
    try:
        from packaging.requirements import Requirement

        listed = [Requirement(text) for text in metadata.requires("iccm") or []]
    except ImportError as error:  # missing metadata raises an ImportError, too
        yield Finding("requirements", f"{error.name} is not installed", False)
        return
    purposes = {"": "", **{extra.name: extra.purpose for extra in extensions.extras()}}
    for requirement in listed:
        extra = next((name for name in purposes if _applies(requirement, name)), None)
        if extra is not None:
            yield _library(requirement.name, requirement.specifier, extra, purposes[extra])


def _applies(requirement: Requirement, extra: str) -> bool:
    return requirement.marker is None or requirement.marker.evaluate({"extra": extra})


def _library(name: str, versions: SpecifierSet, extra: str, purpose: str) -> Finding:
    """Return whether a requirement, of an extra unless that is empty, is installed in a suitable version.

    One that iccm always needs is also imported.
    """
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        missing = f"not installed; pip install 'iccm[{extra}]' for {purpose}" if purpose else "not installed"
        return Finding(name, missing, None if purpose else False)
    if not versions.contains(version, prereleases=True):
        requirement = f"{name}{versions} is needed"
        return Finding(
            name, f"{version}; {requirement} for {purpose}" if purpose else f"{version}; {requirement}", False
        )
    if purpose:  # extras are imported by the commands that need them
        return Finding(name, version, True)
    start = time.perf_counter()
    try:
        import_module(MODULES.get(name, name))
    except Exception as error:  # whatever a broken library raises is the result
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
    for name, folder in (("this folder", Path.cwd()), ("temporary files", Path(tempfile.gettempdir()))):
        yield _writable(name, folder)


def _fonts() -> Finding:
    """Return which tool finds the fonts for texts in drawings."""
    try:
        from .svg.installed_fonts import finder
    except ImportError as error:  # missing libraries are reported separately
        return Finding("fonts", f"cannot be searched: {error}")
    return Finding("fonts", finder())


def _writable(name: str, folder: Path) -> Finding:
    try:
        with tempfile.TemporaryFile(dir=folder):
            return Finding(name, f"{folder} is writable", True)
    except OSError as error:
        return Finding(name, f"{folder} is not writable: {error.strerror}", False)


def _check(
    name: str, test: Callable[[], str], watched: Callable[[], AbstractContextManager[None]]
) -> Finding:
    try:
        with watched():
            return Finding(name, test(), True)
    except Exception as error:  # the result is that it does not work
        return Finding(name, f"{type(error).__name__}: {' '.join(str(error).split())}", False)


def _compiled_core() -> str:
    """Load the compiled core, and return the variant for this processor."""
    from ..native.library import library

    return Path(library()._name).name


def _try_map() -> str:
    """Check that mapping a square onto itself gives the identity, for points and for a picture."""
    import numpy as np

    import iccm

    from ..pixels.warp import Canvas, Texture, warp

    square = np.array([0, 1, 1 + 1j, 1j])
    start = time.perf_counter()
    fit = iccm.fit(square, square, method="paper")
    gap = float(np.abs(fit.map(np.array([0.3 + 0.6j])) - (0.3 + 0.6j))[0])
    pixels = np.arange(192, dtype=np.uint8).reshape(8, 8, 3)
    box = (0j, 1 + 1j)
    warped = warp(fit.map, Texture(pixels, box), Canvas(8, 8, box)).pixels[1:7, 1:7, :3]
    off = int(np.abs(warped.astype(int) - pixels[1:7, 1:7]).max())
    if not (gap < 1e-6 and off <= 1):
        raise ArithmeticError(
            f"the map of a square onto itself is wrong: error {gap:.3g}, error of its picture {off}"
        )
    return (
        f"the map of a square onto itself is correct to {gap:.0e} (took {time.perf_counter() - start:.2f} s)"
    )
