"""Meshes that are there as arrays, flattened into the plane."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..blas import on_one_thread
from ..errors import InputError
from ..meshes.disk_patch import disk_patch
from ..meshes.flatten import Flattening
from ..meshes.mesh import Mesh
from . import method as methods


@on_one_thread
def flatten(
    mesh: Any, faces: ArrayLike | None = None, *, method: str = "balanced", cut_open: bool = False
) -> Flattening:
    """Flatten a mesh in the plane, without folds or overlaps.

    Parameters
    ----------
    mesh
        (n, 3) positions of the vertices, or a mesh with `vertices` and `faces`, as trimesh has them.
    faces
        (m, 3) the vertices of the triangles, counted from 0.
    method
        "conformal" keeps angles, "balanced" angles and areas, "lscm" is least squares unchanged.
    cut_open
        Whether a closed mesh, or one with handles, may be cut open.

    Returns
    -------
    Flattening
        With `flat`, the complex positions of the vertices of `patch`, and `boundary`; `iccm.fit` takes it.

    Raises
    ------
    InputError
        The mesh is not a surface that can be flattened; the message says why and what to do.

    Examples
    --------
    >>> points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0]])
    >>> flat = flatten(points, [[0, 1, 2], [0, 2, 3]])
    >>> flat.flat.shape
    (4,)
    """
    if faces is None:
        if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
            raise InputError(
                "flatten: pass vertices and faces, or a mesh with both; read files with iccm.read_shape"
            )
        mesh, faces = mesh.vertices, mesh.faces
    points, corners = np.asarray(mesh, np.float64), np.asarray(faces)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise InputError(f"flatten: vertices have shape {points.shape}; pass (n, 3) finite numbers")
    if corners.ndim != 2 or corners.shape[1] != 3 or corners.dtype.kind not in "iu" or not corners.size:
        raise InputError(f"flatten: faces have shape {corners.shape}; pass (m, 3) integers")
    if corners.min() < 0 or corners.max() >= len(points):
        raise InputError(
            f"flatten: faces use vertices {corners.min()} to {corners.max()}, but there are {len(points)}"
        )
    if method not in methods.METHODS:
        raise InputError(f"method: {method!r} is not one of {', '.join(methods.METHODS)}")
    patch = disk_patch(Mesh.triangles("mesh", points, corners), cut=cut_open)
    return methods.flatten(patch, grow=cut_open, method=method)
