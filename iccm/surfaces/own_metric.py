"""The metric of a mesh whose triangles are those of a surface."""

from dataclasses import dataclass

from ..arrays import Complex, Flags
from ..balanced.model.metric import Metric
from ..meshes.stretch import Linear


@dataclass(frozen=True, eq=False)
class OwnMetric(Metric):
    """The metric of a mesh whose triangles are the surface's own.

    Attributes:
        maps: for each triangle, the linear map from the plane to the surface, whose area is scaled to one.
        material: (m,) marks the triangles that are not in holes.
    """

    maps: Linear
    material: Flags

    def over(self, z: Complex) -> Linear:
        """Return the maps of all triangles z (m, 3), or of those not in holes."""
        return (
            self.maps
            if len(z) == self.material.size
            else Linear(*(part[self.material] for part in self.maps))
        )
