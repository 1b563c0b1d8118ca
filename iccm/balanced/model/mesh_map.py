"""A piecewise linear map between meshes of two domains, the form that every stage of a solve uses."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Complex, Index, Real
from ...maps.triangulated.patches import NO_LINES
from .boundary import Boundary, MeshHoles, PlainBoundary
from .boundary_pairs import Loop
from .inner_constraints import InnerConstraints
from .metric import PLANES, Metrics

NONE_INSIDE = InnerConstraints.of_pins(np.empty((0, 2), np.complex128))


@dataclass(frozen=True, eq=False)
class MeshMap:
    """A mesh of the source, its image, the constraints on its vertices, and the metrics of both sides.

    Vertices of the outlines come first, then those of constraints inside, then those of filled holes.

    Attributes:
        faces: (m, 3) counter-clockwise triangles.
        z: (n,) vertices in the source.
        u: (n,) their images.
        boundary: the vertices on the outlines and what constrains them.
        inside: the constraints inside.
        bound: whether the constraints inside are in force; if not, their vertices move freely.
        weights: (m,) 1; FILLED and `BAY` for virtual triangles in holes without a partner and in concavities;
            PASSED_OVER for triangles in holes of a surface (`discrete_map`). None if all are 1.
        metrics: of the surfaces that the planes of source and target stand for.
    """

    faces: Index
    z: Complex
    u: Complex
    boundary: Boundary
    inside: InnerConstraints = NONE_INSIDE
    bound: bool = False
    weights: Real | None = None
    metrics: Metrics = PLANES

    @classmethod
    def plain(
        cls,
        z: Complex,
        u: Complex,
        faces: Index,
        border: int,
        *,
        loops: tuple[Loop, ...] = (),
        filled: tuple[Loop, ...] = (),
        weights: Real | None = None,
        metrics: Metrics = PLANES,
    ) -> "MeshMap":
        """Return a map without constraints, whose boundary is only a range of vertices.

        Args:
            z: (n,) vertices, those of the outlines first.
            u: (n,) their images.
            faces: (m, 3) triangles.
            border: number of vertices on the outlines.
            loops: outlines of holes.
            filled: outlines of holes without a partner.
            weights: see the class.
            metrics: see the class.
        """
        boundary = PlainBoundary(border, MeshHoles(loops=loops, filled=filled))
        return MeshMap(faces, z, u, boundary, weights=weights, metrics=metrics)

    @property
    def border(self) -> int:
        """Number of vertices on the outlines, including those of holes."""
        return self.boundary.size

    @property
    def outer(self) -> slice:
        """The vertices of the outer loop."""
        return self.boundary.slices[0]

    @property
    def loops(self) -> tuple[Loop, ...]:
        """The outlines of holes."""
        return self.boundary.holes.loops

    @property
    def filled(self) -> tuple[Loop, ...]:
        """The outlines of holes without a partner."""
        return self.boundary.holes.filled

    @property
    def material(self) -> Index:
        """The triangles that are not virtual."""
        return self.faces if self.weights is None else self.faces[self.weights == 1]

    @property
    def fills_holes(self) -> bool:
        """Whether triangles fill all holes without a partner: then Euler's formula holds for the outlines alone."""
        return 2 * self.z.size - len(self.faces) - self.border == 2 - 2 * len(self.loops)

    @property
    def first_pin(self) -> int:
        """Index of the first pin inside."""
        return self.border + int(np.count_nonzero(self.inside.stroke_index >= 0))

    @property
    def lines(self) -> Index:
        """Vertex pairs of the edges of strokes, if these are in force; shape (l, 2)."""
        if not self.bound:
            return NO_LINES
        return self.inside.lines_with(self.z[: self.border])

    def inverse(self) -> "MeshMap":
        """Return the inverse map, for results and for other meshes.

        Its boundary is plain: filled holes are held in the source only, so that Newton's method could not
        continue from here.
        """
        boundary = PlainBoundary(self.border, self.boundary.holes.inverse()._replace(outlines=()))
        inside = self.inside.inverse(self.z[: self.border], self.u[: self.border])
        metrics = self.metrics[1], self.metrics[0]
        return MeshMap(self.faces, self.u, self.z, boundary, inside, self.bound, self.weights, metrics)
