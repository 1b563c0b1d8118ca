"""Find the triangle of a flattened patch that contains a point of the plane."""

from typing import ClassVar, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex, Index, Real, xy_of
from ..native import function
from ..parallel import over_slices
from ..plane import bounding_box, longer_side
from .flatten import Flattening
from .rasterise import rasterise

_walk = function("""int64_t iccm_meshes_walk(
    const Complex *flat, const int64_t *faces, const int64_t *twin, const Complex *z, const int32_t *start,
    int64_t count, int64_t *triangle, double *weights)""")
GRID_CELLS_ACROSS = 1024
"""Cells along the longer side of the grid of starting triangles: a walk then passes few of them."""


class LocatorArrays(NamedTuple):
    """Arrays for point location in a kernel.

    Attributes:
        flat: (n,) vertices.
        faces: (m, 3) triangles.
        twin: (3m,) half-edges.
        grid: (GRID_CELLS_ACROSS, GRID_CELLS_ACROSS) triangles to start from.
        low: corner of the grid.
        scale: cells per unit of length.
    """

    flat: Complex
    faces: Index
    twin: Index
    grid: NDArray[np.int32]
    low: complex
    scale: float


class Locator:
    """Point location by walking from triangle to triangle, started from a grid.

    Args:
        flattening: the patch; its triangles do not overlap.
    """

    _made: ClassVar[WeakKeyDictionary[Flattening, "Locator"]] = WeakKeyDictionary()

    @classmethod
    def of(cls, flattening: Flattening) -> "Locator":
        """Return the locator of a layout, which is made only once as long as the layout exists."""
        locator = cls._made.get(flattening)
        if locator is None:
            locator = cls._made[flattening] = cls(flattening)
        return locator

    def __init__(self, flattening: Flattening):
        self.faces = np.ascontiguousarray(flattening.patch.faces, np.int64)
        self.flat = np.ascontiguousarray(flattening.flat, np.complex128)
        self.twin = np.ascontiguousarray(flattening.patch.triangles.twin, np.int64)
        low, high = bounding_box(self.flat)
        size = longer_side(low, high)
        self.low, self.scale = low - size * (1 + 1j) / GRID_CELLS_ACROSS, (GRID_CELLS_ACROSS - 2) / size
        corners = xy_of((self.flat - self.low) * self.scale)[self.faces]
        self.grid = self._filled(
            rasterise(
                corners, GRID_CELLS_ACROSS, GRID_CELLS_ACROSS, border=np.ones(len(self.faces), bool)
            ).owner
        )

    @property
    def places(self) -> LocatorArrays:
        """The arrays for kernels."""
        return LocatorArrays(
            self.flat, self.faces, self.twin, self.grid, complex(self.low), float(self.scale)
        )

    @staticmethod
    def _filled(owner: NDArray[np.int32]) -> NDArray[np.int32]:
        """Fill empty cells of the grid with the nearest cell's triangle."""
        from scipy.ndimage import distance_transform_edt

        rows, columns = distance_transform_edt(owner < 0, return_distances=False, return_indices=True)
        return owner[rows, columns]

    def __call__(self, z: Complex, threads: int | None = None) -> tuple[Index, Real]:
        """Return (p,) the triangle and (p, 3) the barycentric coordinates of points.

        Points in a hole or outside are treated as points on the border of a nearby triangle.
        """
        z = np.ascontiguousarray(z, np.complex128)
        cells = (z - self.low) * self.scale
        column, row = (
            np.clip(c.astype(np.int64), 0, GRID_CELLS_ACROSS - 1) for c in (cells.real, cells.imag)
        )
        start = self.grid[row, column]
        triangle, weights = np.empty(z.size, np.int64), np.empty((z.size, 3))

        def walk(part: slice) -> None:
            some, begin = z[part], start[part]
            _walk(self.flat, self.faces, self.twin, some, begin, some.size, triangle[part], weights[part])

        over_slices(walk, z.size, threads)
        return triangle, weights


def barycentric(corners: Real, points: Real) -> Real:
    """Return (p, 3) barycentric coordinates of points (p, 3) on triangles (p, 3, 3) in space.

    They are clipped to be nonnegative.
    """
    inner = in_basis(corners[:, 1:] - corners[:, :1], points - corners[:, 0])
    weights = np.clip(np.column_stack([1 - inner.sum(axis=1), inner]), 0, 1)
    return weights / weights.sum(axis=1, keepdims=True)


def in_basis(edges: Real, direction: Real) -> Real:
    """Return (p, 2) coordinates of vectors (p, 3) in the basis of two edges (p, 2, 3).

    Orthogonal components are ignored.
    """
    gram, right = np.einsum("pki,pli->pkl", edges, edges), np.einsum("pki,pi->pk", edges, direction)
    det = gram[:, 0, 0] * gram[:, 1, 1] - gram[:, 0, 1] ** 2
    det = np.where(det > 0, det, 1.0)
    s = (right[:, 0] * gram[:, 1, 1] - right[:, 1] * gram[:, 0, 1]) / det
    t = (right[:, 1] * gram[:, 0, 0] - right[:, 0] * gram[:, 0, 1]) / det
    return np.column_stack([s, t])
