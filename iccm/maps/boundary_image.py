"""The image of the source's boundary: which boundary point goes where."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex


@dataclass(frozen=True, eq=False)
class BoundaryImage:
    """A closed polyline with its preimage.

    Attributes:
        z: (k,) points of the source boundary in order, the vertices among them.
        w: (k,) their images, limits from inside.
        edge: (k,) the polygon's edge that a point lies on; a vertex begins its edge.
    """

    z: Complex
    w: Complex
    edge: NDArray[np.int64]
