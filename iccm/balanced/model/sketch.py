"""A map carried from one mesh to another: vertices and images, without the outlines they came from."""

from dataclasses import dataclass, field

from ...arrays import Complex, Index, Real
from ...maps.triangulated.patches import NO_LINES
from .boundary_pairs import Loop
from .metric import PLANES, Metrics


@dataclass(frozen=True, eq=False)
class Sketch:
    """A map without outlines: vertices, outline first, images, triangles, how many vertices are on the outline, which
    one is the first pin's, the edges (l, 2) of strokes, and the holes' vertices and weights as of `DiscreteMap`."""

    z: Complex
    u: Complex
    faces: Index
    border: int
    first_pin: int = 0
    lines: Index = field(default_factory=lambda: NO_LINES)
    loops: tuple[Loop, ...] = ()
    filled: tuple[Loop, ...] = ()
    weights: Real | None = None
    metrics: Metrics = PLANES

    @property
    def material(self) -> Index:
        """The triangles that are not in filled holes."""
        return self.faces if self.weights is None else self.faces[self.weights == 1]

    @property
    def outer(self) -> slice:
        """The vertices of the outer loop."""
        return slice(0, self.loops[0].first if self.loops else self.border)
