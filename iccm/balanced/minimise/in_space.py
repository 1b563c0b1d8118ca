"""The energy of a map to a surface in space, as a function of its vertices' positions in the surface's layout.

The metric of a layout (`model.metric`) is evaluated at the beginning of some steps, and does not change as
vertices move: where it changes fast, at ears and legs, steps lose more than they gain. Here every vertex of the
map is a point of the surface, the image of a triangle is the flat triangle that joins three of these, and the
derivative of a point in space with respect to its position in the layout is that of the surface's triangle that
contains it. Line searches evaluate this energy. A small additional energy in the layout prevents folds there.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ...meshes.locate import Locator, LocatorArrays
from ...native import Record, function, record
from .energy import Objective, RestShapes

BARRIER_WEIGHT = 0.01
"""Weight of the energy in the layout, which prevents folds there: so low that it hardly changes the map."""

PlacesRecord = record(
    """struct Places {
        const Complex *flat; const int64_t *faces; const int64_t *twin; const int32_t *grid; int64_t size;
        double low_x; double low_y; double scale; }"""
)
GroundRecord = record("struct Ground { Places places; const double *points; const double *slopes; }")
SurfaceMapRecord = record(
    """struct SurfaceMap {
        Ground ground; RestShapes layout; Objective barrier; const bool *open; const double *orientations; int64_t *on;
        double *points; Complex *laid; double *axes; Complex *slopes; double *blocks; int64_t n; }"""
)
_total_in_space = function(
    """double iccm_minimise_total_in_space(
        const RestShapes *rest, SurfaceMap *surface, const Complex *u, const Objective *objective)"""
)
_assemble_in_space = function(
    """double iccm_minimise_assemble_in_space(
        const RestShapes *rest, SurfaceMap *surface, const Complex *u, const Objective *objective, double *matrix,
        Complex *gradient, int64_t n, int64_t e)"""
)


class Ground(NamedTuple):
    """A surface in space and its layout, beyond which it is extended linearly.

    Attributes:
        places: locates points in the layout's triangles.
        points: (p, 3) vertices in space, the surface's area scaled to one.
        slopes: (k, 3, 2) derivatives of points in space with respect to the position in the layout, for each
            triangle.
    """

    places: LocatorArrays
    points: Real
    slopes: Real

    @classmethod
    def of(cls, locator: Locator, points: Real) -> "Ground":
        """Return the ground of a layout with vertices at points (p, 3) in space."""
        flat, corners = locator.flat[locator.faces], points[locator.faces]
        sides, edges = (w[:, 1:] - w[:, :1] for w in (flat, corners))
        matrix = np.stack([sides.real, sides.imag], axis=1)  # columns are the sides
        slopes = np.ascontiguousarray(edges.transpose(0, 2, 1) @ np.linalg.inv(matrix))
        return cls(locator.places, np.ascontiguousarray(points), slopes)

    def record(self) -> Record:
        """Return the struct that is passed to the core."""
        flat, faces, twin, grid, low, scale = self.places
        places = PlacesRecord(flat, faces, twin, grid, len(grid), low.real, low.imag, scale)
        return GroundRecord(places, self.points, self.slopes)


class SurfaceMap(NamedTuple):
    """A map to a surface in space: the data that its energy needs besides the rest triangles, and work arrays.

    The rest triangles share no corners: triangle t has corners 3t, 3t + 1 and 3t + 2, and separate blocks.

    Attributes:
        ground: the surface.
        layout: the rest triangles for the energy in the layout; corners and slots are those of the mesh.
        barrier: objective of the energy in the layout.
        open: (m,) triangles in holes of the source, whose images are those in the layout.
        orientations: (m,) 1 if the corners are counter-clockwise, else -1.
        on: (n,) the surface's triangle that contains each vertex.
        points: (n, 3) vertices in space.
        laid: (3m,) images of triangles, flattened.
        axes: (m, 2, 3) directions in space that become x and y in the flattened triangle.
        slopes: (3m,) gradients at flattened corners.
        blocks: (6m, 4) of the Hessian.
    """

    ground: Ground
    layout: RestShapes
    barrier: Objective
    open: Flags
    orientations: Real
    on: Index
    points: Real
    flat_images: Complex
    axes: Real
    slopes: Complex
    blocks: Real

    @classmethod
    def of(
        cls, ground: Ground, layout: RestShapes, theta: float, open: Flags, orientations: Real
    ) -> "SurfaceMap":
        """Return the data for a mesh's rest triangles in the source's layout."""
        n, m = int(layout.corners.max()) + 1, len(layout.corners)
        light = layout._replace(weights=BARRIER_WEIGHT * layout.weights)
        flat_images, slopes = np.empty((2, 3 * m), np.complex128)
        return cls(
            ground,
            light,
            Objective.of(theta, 1.0),
            open,
            orientations,
            on=np.empty(n, np.int64),
            points=np.empty((n, 3)),
            flat_images=flat_images,
            axes=np.empty((m, 2, 3)),
            slopes=slopes,
            blocks=np.empty((6 * m, 4)),
        )

    def record(self) -> Record:
        """Return the struct that is passed to the core."""
        return SurfaceMapRecord(
            self.ground.record(),
            self.layout.record(),
            self.barrier.record(),
            self.open,
            self.orientations,
            self.on,
            self.points,
            self.flat_images,
            self.axes,
            self.slopes,
            self.blocks,
            self.on.size,
        )


def separate(gradients: Complex, weights: Real) -> RestShapes:
    """Return rest triangles (m, 3) that share no corners."""
    m = len(gradients)
    corners, slots = np.arange(3 * m).reshape(m, 3), np.arange(6 * m).reshape(m, 6)
    return RestShapes(corners, slots, gradients, weights)


def total_in_space(rest: RestShapes, surface: SurfaceMap, u: Complex, objective: Objective) -> float:
    """Compute the energy of images u (n,), without the curves'; infinite if a triangle is folded in the layout."""
    return float(_total_in_space(rest.record(), surface.record(), u, objective.record()))


def assemble_in_space(
    rest: RestShapes, surface: SurfaceMap, u: Complex, objective: Objective, matrix: Real, gradient: Complex
) -> float:
    """Compute the energy, and fill in the gradient (n,) and the projected Hessian (e, 4).

    Second derivatives of the surface are omitted, so that the Hessian stays positive.
    """
    return float(
        _assemble_in_space(
            rest.record(), surface.record(), u, objective.record(), matrix, gradient, u.size, len(matrix)
        )
    )
