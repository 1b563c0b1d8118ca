"""Numbers and labels at the vertices of a surface, read from GIFTI, FreeSurfer's files, MGH, tables and meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...arrays import Index, Real
from ...errors import InputError
from .. import files, formats, limits
from ..spec import Spec
from .brain_formats import GiftiFormat, freesurfer, gifti
from .mesh_files import open_mesh
from .mesh_format import Overlay, reason_of

TABLES = (".txt", ".csv", ".1d")
MGH = (".mgh", ".mgz")
LABEL_INTENT = 1002  # GIFTI's intent of labels


def read(name: str | Path, count: int) -> Overlay:
    """Read an overlay of a surface with `count` vertices.

    Raises:
        InputError: the file cannot be read, or is for a surface with another number of vertices.
    """
    spec = Spec.of(str(name))
    path = spec.path
    files.open_input(path, max_bytes=limits.MESH_BYTES)
    try:
        overlay = _read(spec)
    except InputError:
        raise
    except Exception as error:  # whatever exception a parser raises, the file is at fault
        raise InputError(f"{path}: cannot read this overlay: {reason_of(error)}") from None
    if overlay.values.size != count:
        raise InputError(f"{path}: has {overlay.values.size} values, but the surface has {count} vertices")
    return overlay


def _read(spec: Spec) -> Overlay:
    path, suffix = spec.path, spec.path.suffix.lower()  # lh.thickness.mgh is not a surface
    is_surface = formats.of(path).mesh and suffix not in (*MGH, *TABLES)
    surface = open_mesh(path) if is_surface else None
    if surface is not None and (overlay := surface.overlay(spec.selection)) is not None:
        return overlay
    if spec.selection:
        raise InputError(f"{path}#{spec.selection}: arrays of files of this type have no names")
    if isinstance(surface, GiftiFormat):
        return _gifti(path)
    if suffix in TABLES:
        return Overlay(np.loadtxt(path, delimiter="," if suffix == ".csv" else None, ndmin=1))
    kind = "mgh" if suffix in MGH else "annot" if path.name.endswith(".annot") else "morph"
    data = freesurfer(path, kind)
    colors = {key: _rgba(row[:3] / 255) for key, row in enumerate(data.get("colors", ()))}
    return Overlay(data["values"], colors if kind == "annot" else None)


def _gifti(path: Path) -> Overlay:
    """Read the first array of numbers or labels of a GIFTI file."""
    data = gifti(path)
    arrays = [
        (array, intent)
        for array, intent in zip(data["arrays"], data["intents"])
        if array.ndim and array.size == len(array)
    ]
    if not arrays:
        raise InputError(f"{path}: has no values at vertices")
    values, intent = arrays[0][0].astype(float).ravel(), arrays[0][1]
    if intent != LABEL_INTENT:
        return Overlay(values)
    return Overlay(values, {int(key): np.array(color) for key, *color in data["labels"]})


def _rgba(rgb: Real) -> NDArray[np.float64]:
    return np.append(rgb, 1.0)


def interpolate(overlay: Overlay, corners: Index, weights: Real) -> tuple[Real, Real]:
    """Return values (p,) at points in triangles, and for labels the colours (p, 4); else an empty array.

    Args:
        overlay: the overlay.
        corners: (p, 3) the vertices of each point's triangle.
        weights: (p, 3) barycentric coordinates.
    """
    if overlay.colors is None:
        return (overlay.values[corners] * weights).sum(axis=1), np.empty((0, 4))
    nearest = overlay.values[corners[np.arange(len(corners)), weights.argmax(axis=1)]]
    keys, row = np.unique(nearest, return_inverse=True)
    table = np.array(
        [overlay.colors.get(int(key), np.zeros(4)) if key == key else np.zeros(4) for key in keys]
    )
    return nearest, table[row] if keys.size else np.empty((0, 4))
