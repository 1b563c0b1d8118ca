"""Optional packages: the extras of iccm, which packages they install, and the import of these.

To add an extra: its packages in `pyproject.toml` and in `PACKAGES`, and its line in `PURPOSES`. `iccm doctor` and the
page on installation list them.
"""

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType
from typing import Any

from ..errors import InputError

PURPOSES: Mapping[str, str] = MappingProxyType(
    {
        "edit": "iccm edit",
        "dxf": "DXF drawings",
        "draco": "glTF files compressed by Draco",
        "meshopt": "glTF files compressed by meshopt",
        "dask": "iccm batch --dask",
        "gis": "GeoTIFF: where a picture lies on a map, and ground control points",
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
        "meshopt": ("meshopt", "meshopt"),
        "networkx": ("networkx", "3mf"),
        "nibabel": ("nibabel", "brain"),
        "pi_heif": ("pi-heif", "heic"),
        "pxr": ("usd-core", "usd"),
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
        distribution, extra = PACKAGES[package]
        alternative = f", or {otherwise}" if otherwise else ""
        raise InputError(
            f"{purpose} needs the package {distribution}: pip install 'iccm[{extra}]'{alternative}"
        ) from None
    return module
