"""Where the seam of a surface that had to be cut is lengthened.

After Gu, Gortler, Hoppe, *Geometry Images*, SIGGRAPH 2002, who cut to where the layout stretches most.
"""

import numpy as np

from ..arrays import Index, Real
from ..meshes.cut import extended
from ..meshes.flatten import Flattening
from ..meshes.patch import Patch


def longer(result: Flattening) -> Patch:
    """The patch, its seam extended to the vertex that has the largest product of stretch and distance to a boundary.

    The stretch is the logarithm of max(s₁, 1/s₂), averaged over a vertex's triangles. Without the distance, or with
    the most shrunk or most stretched vertex instead, seams were found that helped less.
    """
    patch = result.patch
    border = np.unique(np.concatenate(patch.loops))
    reach, _ = patch.triangles.paths(patch.points, border, patch.drawn)
    score = at_vertices(patch.faces, np.log(result.strain)) * np.where(np.isfinite(reach), reach, 0)
    return extended(patch, int(np.argmax(score)))


def at_vertices(faces: Index, values: Real) -> Real:
    """(n,) means of values (m,) over the triangles of each vertex."""
    return np.bincount(faces.ravel(), np.repeat(values, 3)) / np.bincount(faces.ravel())
