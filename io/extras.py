"""Optional packages: the extras of iccm, which packages they install, and the import of these.

To add an extra: its packages in `pyproject.toml` and in `PACKAGES`, and its line in `PURPOSES`. `iccm doctor` and the
page on installation list them.
"""

import sys
from collections.abc import Mapping
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any

from ..errors import InputError

PURPOSES: Mapping[str, str] = MappingProxyType(
    {
        "edit": "iccm edit",
        "plot": "--plot, Fit.plot(), and colours of overlays on surfaces",
        "dxf": "DXF drawings",
        "draco": "glTF files compressed by Draco",
        "meshopt": "glTF files compressed by meshopt",
        "dask": "iccm batch --dask",
        "gis": "GeoTIFF: where a picture lies on a map, and ground control points; GeoPackage, Shapefile and KML",
        "heic": "photos in HEIC, as phones take them",
        "usd": "meshes in USD files",
        "vtk": "meshes in VTK files, as ParaView saves them",
        "3mf": "meshes in 3MF files",
        "brain": "cortical surfaces of GIFTI and FreeSurfer",
        "imagej": "points from ImageJ and Fiji",
        "itk": "displacement fields as .nrrd, .mha and .nii",
    }
)
"""What each extra is for."""
PACKAGES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "DracoPy": ("DracoPy", "draco"),
        "SimpleITK": ("SimpleITK", "itk"),
        "distributed": ("distributed", "dask"),
        "ezdxf": ("ezdxf", "dxf"),
        "lxml": ("lxml", "3mf"),
        "matplotlib": ("matplotlib", "plot"),
        "meshopt": ("meshopt", "meshopt"),
        "networkx": ("networkx", "3mf"),
        "nibabel": ("nibabel", "brain"),
        "pi_heif": ("pi-heif", "heic"),
        "pxr": ("usd-core", "usd"),
        "pyogrio": ("pyogrio", "gis"),
        "rasterio": ("rasterio", "gis"),
        "roifile": ("roifile", "imagej"),
        "starlette": ("starlette", "edit"),
        "uvicorn": ("uvicorn", "edit"),
        "vtkmodules": ("vtk", "vtk"),
        "websockets": ("websockets", "edit"),
    }
)
"""Of each optional package, by the name it is imported by: its name on PyPI, and the extra of iccm it belongs to."""


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
    try:
        module = import_module(package)
        for name in submodules:
            import_module(f"{package}.{name}")
    except ImportError:
        raise _missing(purpose, package, otherwise) from None
    return module


def require(purpose: str, package: str, *, otherwise: str = "") -> None:
    """Check that an optional package is installed, without importing it; arguments and errors as for `load`."""
    try:
        is_installed = package in sys.modules or find_spec(package) is not None
    except ValueError:
        is_installed = False
    if not is_installed or sys.modules.get(package, True) is None:
        raise _missing(purpose, package, otherwise)


def _missing(purpose: str, package: str, otherwise: str) -> InputError:
    distribution, extra = PACKAGES[package]
    alternative = f", or {otherwise}" if otherwise else ""
    return InputError(f"{purpose} needs the package {distribution}: pip install 'iccm[{extra}]'{alternative}")
