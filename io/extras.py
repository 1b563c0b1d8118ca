"""Optional packages: the extras of iccm, which packages they install, and the import of these.

To add an extra: its packages in `pyproject.toml`, and its row in `EXTRAS`, or an `Extra` of an extension. `iccm doctor`
and the page on installation list them.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from ..errors import InputError


@dataclass(frozen=True, eq=False)
class Extra:
    """An extra of iccm.

    Attributes:
        name: as in `pip install 'iccm[name]'`.
        purpose: what it is for.
        packages: their names on PyPI, by the names they are imported by.
    """

    name: str
    purpose: str
    packages: Mapping[str, str]

    def load(self, purpose: str, package: str, *submodules: str, otherwise: str = "") -> Any:
        """Import one of its packages; see the function `load`."""
        try:
            module = import_module(package)
            for name in submodules:
                import_module(f"{package}.{name}")
        except ImportError:
            raise self._missing(purpose, package, otherwise) from None
        return module

    def require(self, purpose: str, package: str, *, otherwise: str = "") -> None:
        """Check that one of its packages is installed; see the function `require`."""
        try:
            is_installed = package in sys.modules or find_spec(package) is not None
        except ValueError:
            is_installed = False
        if not is_installed or sys.modules.get(package, True) is None:
            raise self._missing(purpose, package, otherwise)

    def _missing(self, purpose: str, package: str, otherwise: str) -> InputError:
        alternative = f", or {otherwise}" if otherwise else ""
        return InputError(
            f"{purpose} needs the package {self.packages[package]}: pip install 'iccm[{self.name}]'{alternative}"
        )


EXTRAS = (
    Extra("edit", "iccm edit", {name: name for name in ("starlette", "uvicorn", "websockets")}),
    Extra("plot", "--plot, Fit.plot(), and colours of overlays on surfaces", {"matplotlib": "matplotlib"}),
    Extra("dxf", "DXF drawings", {"ezdxf": "ezdxf"}),
    Extra("draco", "glTF files compressed by Draco", {"DracoPy": "DracoPy"}),
    Extra("meshopt", "glTF files compressed by meshopt", {"meshopt": "meshopt"}),
    Extra("dask", "iccm batch --dask", {"distributed": "distributed"}),
    Extra(
        "gis",
        "GeoTIFF: where a picture lies on a map, and ground control points; GeoPackage, Shapefile and KML",
        {name: name for name in ("pyogrio", "rasterio")},
    ),
    Extra("heic", "photos in HEIC, as phones take them", {"pi_heif": "pi-heif"}),
    Extra("imagej", "points from ImageJ and Fiji", {"roifile": "roifile"}),
    Extra("itk", "displacement fields as .nrrd, .mha and .nii", {"SimpleITK": "SimpleITK"}),
)
"""The extras of iccm itself; `io.extensions.extras` returns those of extensions."""


def load(purpose: str, package: str, *submodules: str, otherwise: str = "") -> Any:
    """Import an optional package with the submodules that are used.

    Args:
        purpose: what needs it, with which the message begins, such as "drawing.dxf: reading DXF".
        package: the name it is imported by.
        submodules: their names within the package, such as "recover".
        otherwise: what can be done without the package, with which the message ends.

    Raises:
        InputError: it is not installed; the message names the extra that installs it.

    >>> load("reading DXF", "ezdxf", "recover").__name__
    'ezdxf'
    """
    return _with(package).load(purpose, package, *submodules, otherwise=otherwise)


def require(purpose: str, package: str, *, otherwise: str = "") -> None:
    """Check that an optional package is installed, without importing it; arguments and errors as for `load`."""
    _with(package).require(purpose, package, otherwise=otherwise)


def _with(package: str) -> Extra:
    """Return the extra that installs a package, given the name it is imported by."""
    return next(extra for extra in EXTRAS if package in extra.packages)
