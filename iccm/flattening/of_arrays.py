"""Flatten meshes given as arrays: `iccm.flatten`."""

from typing import Any, Literal

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
    mesh: Any,
    faces: ArrayLike | None = None,
    *,
    method: Literal["conformal", "balanced", "lscm"] = "balanced",
    cut_open: bool = False,
) -> Flattening:
    """Flatten a mesh into the plane without folds or overlaps.

    Args:
        mesh: (n, 3) vertex positions, or an object with `vertices` and `faces`, such as a trimesh.Trimesh.
        faces: (m, 3) vertex numbers of the triangles, from 0; needed unless `mesh` has them.
        method: "conformal" preserves angles, "balanced" balances angles and areas, "lscm" is plain least squares,
            which may fold.
        cut_open: Whether to cut the mesh open if it is closed or has handles.

    Returns:
        A flattening with `flat`, the complex positions of the vertices of `patch`, and `boundary`, for `iccm.fit`.

    Raises:
        InputError: The mesh is not a surface that can be flattened; the message gives the reason and a remedy.

    Examples:
        >>> import iccm
        >>> points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0]])
        >>> flat = iccm.flatten(points, [[0, 1, 2], [0, 2, 3]])
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
