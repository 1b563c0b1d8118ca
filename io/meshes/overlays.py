"""Numbers and labels at the vertices of a surface, read from tables and by the formats that have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...arrays import Index, Real
from ...errors import InputError
from .. import files, formats, limits
from ..spec import Spec
from .mesh_files import class_at
from .mesh_format import Overlay, reason_of

TABLES = (".txt", ".csv", ".1d")


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
    path, suffix = spec.path, spec.path.suffix.lower()
    if suffix in TABLES and not spec.selection:
        return Overlay(np.loadtxt(path, delimiter="," if suffix == ".csv" else None, ndmin=1))
    form = formats.of(path)
    place = form.mesh or form.overlay
    overlay = class_at(place)(path).overlay(spec.selection) if place and suffix not in TABLES else None
    if overlay is None:
        array = f"#{spec.selection}" if spec.selection else ""
        problem = "arrays of such files have no names" if array else "such files have no numbers at vertices"
        raise InputError(f"{path}{array}: {problem}")
    return overlay


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
