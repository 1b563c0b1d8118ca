"""Relax layouts on coarser triangulations first, and huge ones by multigrid, without factorisations on all vertices.

The multigrid method is the full approximation scheme (Brandt, *Multi-level adaptive solutions to boundary-value
problems*, 1977) as a descent method (Nash, *A multigrid approach to discretized optimization problems*, 2000). Each
cycle moves vertices one by one, which removes what differs between neighbours. What is left is smooth, so that it
can be found on a coarser triangulation: there the energy is minimised less the work of forces, which make up for the
difference between both energies. The displacements are interpolated, and shortened until they lower the energy
without folds.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Index, Real
from ..balanced.minimise.newton import largest_step
from ..balanced.minimise.terms import TermOnMesh
from ..meshes.mesh import with_unit_area
from .coarsening import (
    NONE,
    Removed,
    by_coarser,
    gradient,
    interpolate,
    much_coarser,
    reinsert_vertices,
    restrict,
    smooth,
)
from .free import LARGE_VERTEX_COUNT, Elastic, surface

HUGE_VERTEX_COUNT = 100_000
"""Vertices from which a surface is relaxed by multigrid: there the factorisations of Newton's method take longer than
everything else together, and most of the memory."""
MOST_CYCLES = 16
"""Newton's method takes over when these are not enough. Noisy surfaces took up to eleven; more were only needed where
the outline crosses itself, so that the layout is discarded anyway."""
LEAST_STEP_SHARE = 0.3
"""Share of a step found on coarser grids below which they are made again. Triangles that do not fold in the present
layout allow longer steps than those that did not fold in an earlier one: white noise ended at 2 % less energy. Always
making them again took half as long again."""
LEAST_CYCLE_GAIN_SHARE = 1e-4
"""Share of the energy that a cycle must gain to be worth another. Smooth surfaces are then within 3e-5 of Newton's
energy after one or two cycles, and noisy ones within 1.4e-3 after seven or eight, where the 95th percentile of the
dilatation differs by 0.3 %."""
SWEEPS = 2  # times that each vertex is moved in a cycle
COARSE_STEPS = 3  # Newton steps on the coarsest triangulation in a cycle
SHARE_OF_FLIP, SHORTEST_SHARE = 0.8, 1e-3
"""Longest step relative to the one at which a triangle folds; share of the displacements below which none is made."""


def relaxed(
    sheet: Elastic,
    points: Real,
    u: Complex,
    theta: float,
    steps: int,
    tolerance: float,
) -> Complex:
    """Return (n,) positions with less energy, from positions without folds.

    Large surfaces are relaxed on a coarser triangulation first, and huge ones only by multigrid where it converges.

    Args:
        sheet: the surface, all of whose vertices move.
        points: (n, 3) vertices in space.
        u: (n,) positions in the plane, scaled to a total area of one.
        theta: weight of the area part of the energy.
        steps: most Newton steps on each triangulation.
        tolerance: relative decrease of the energy below which Newton's method stops.
    """
    if u.size >= HUGE_VERTEX_COUNT:
        u, converged = _by_multigrid(points, sheet.faces, u, theta, steps, tolerance)
        if converged:
            return u
    else:
        u = by_coarser(
            sheet,
            points,
            u,
            theta,
            lambda coarse, vertices: relaxed(coarse, points[vertices], u[vertices], theta, steps, tolerance),
        )
    return sheet.relaxed(u, theta, steps, tolerance)


def nearly_relaxed(
    points: Real, faces: Index, u: Complex, theta: float, steps: int, tolerance: float
) -> Complex | None:
    """Return (n,) positions relaxed on a coarser triangulation only, which takes a fraction of the time of `relaxed`.

    The other vertices are relaxed one by one. Returns None where the surface is small or cannot be coarsened. Arguments
    are as in `relaxed`, with the triangles (m, 3) of the surface.
    """
    small = much_coarser(points, faces, u, LARGE_VERTEX_COUNT, NONE)
    if small is None:
        return None
    vertices, coarse, removed = small
    new_u = u.copy()
    new_u[vertices] = relaxed(
        surface(points[vertices], coarse), points[vertices], u[vertices], theta, steps, tolerance
    )
    unit = with_unit_area(points, faces)
    return new_u if reinsert_vertices(removed, unit, theta, new_u) else None


def _by_multigrid(
    points: Real, faces: Index, u: Complex, theta: float, steps: int, tolerance: float
) -> tuple[Complex, bool]:
    """Return positions (n,) with no more energy, and whether they have converged; arguments are as in `relaxed`."""
    grid = Grid.of(points, faces, u, theta)
    if grid.coarser is None:
        return u, False
    start_energy = grid.gradient()[0]
    energy = grid.gradient()[0] if grid.solve_coarsest_first(steps, tolerance) else np.inf
    if energy > start_energy:
        grid.start_from(u)
        energy = start_energy
    converged = grid.converge(energy)
    return grid.u, converged


def relaxed_from_coarsest(
    points: Real,
    faces: Index,
    start: Callable[[Index, Real, Index], Complex | None],
    theta: float,
    steps: int,
    tolerance: float,
) -> Complex | None:
    """Return (n,) positions with little energy, without needing a layout of the whole surface to start from.

    The surface is coarsened without a layout, so that a first one is only needed of its coarsest triangulation. Returns
    None where the surface is not huge, cannot be coarsened or has no such layout, or multigrid does not converge.

    Args:
        points: (n, 3) vertices in space.
        faces: (m, 3) triangles.
        start: returns positions without folds on the coarsest triangulation, or None, given the numbers (k,) of its
            vertices, their positions (k, 3), scaled to a surface area of one, and its triangles.
        theta, steps, tolerance: as in `relaxed`.
    """
    grid = Grid.of(points, faces, None, theta)
    if grid.coarser is None or not grid.start_coarsest(start, np.arange(len(points))):
        return None
    if not grid.solve_coarsest_first(steps, tolerance):
        return None
    return grid.u if grid.converge(grid.gradient()[0]) else None


@dataclass(eq=False)
class Grid:
    """A triangulation of a surface with a layout that is being relaxed, and the coarser ones below it.

    Attributes:
        points: (n, 3) vertices in space, scaled to a surface area of one.
        faces: (m, 3) triangles.
        theta: weight of the area part of the energy.
        u: (n,) positions in the plane without folds. In a coarser grid they drift away from those of the same vertices
            in the finer one, where these follow details that the coarser triangles do not have, and would fold them.
        coarser: the next coarser grid; None where Newton's method relaxes this one.
        step_share: how much of the last step found on it was made.
    """

    points: Real
    faces: Index
    theta: float
    u: Complex
    coarser: "Coarser | None" = None
    step_share: float = 1.0

    @classmethod
    def of(cls, points: Real, faces: Index, u: Complex | None, theta: float) -> "Grid":
        """Create it from a layout without folds, with coarser ones until they are small or cannot be coarsened.

        Without a layout, all positions are zero until there is one of the coarsest grid.
        """
        first_u = np.zeros(len(points), np.complex128) if u is None else u.copy()
        grid = cls(with_unit_area(points, faces), np.ascontiguousarray(faces), theta, first_u)
        grid._coarsen(u)
        return grid

    def _coarsen(self, u: Complex | None) -> None:
        """Create the coarser grids; u (n,) are positions without folds, or None."""
        self.coarser = None
        coarsened = much_coarser(self.points, self.faces, u, HUGE_VERTEX_COUNT, NONE)
        if coarsened is None:
            return
        vertices, faces, removed = coarsened
        coarse_u = None if u is None else u[vertices]
        self.coarser = Coarser(Grid.of(self.points[vertices], faces, coarse_u, self.theta), vertices, removed)

    @cached_property
    def _sheet(self) -> Elastic:
        return surface(self.points, self.faces)

    def gradient(self) -> tuple[float, Complex]:
        """Return the energy, and its gradient (n,)."""
        return gradient(self.faces, self.points, self.theta, self.u)

    def start_from(self, u: Complex) -> None:
        """Set the positions (n,) of this grid, and of all coarser ones."""
        self.u = u.copy()
        if self.coarser is not None:
            self.coarser.grid.start_from(u[self.coarser.vertices])

    def start_coarsest(self, start: Callable[[Index, Real, Index], Complex | None], vertices: Index) -> bool:
        """Give the coarsest grid positions; return whether there are any.

        Args:
            start: see `relaxed_from_coarsest`.
            vertices: the numbers (n,) of this grid's vertices in the finest one.
        """
        if self.coarser is not None:
            return self.coarser.grid.start_coarsest(start, vertices[self.coarser.vertices])
        u = start(vertices, self.points, self.faces)
        self.u = self.u if u is None else u
        return u is not None

    def solve_coarsest_first(self, steps: int, tolerance: float) -> bool:
        """Relax the coarsest grid, and put back the vertices of finer ones; return False where one has no place."""
        if self.coarser is None:
            self.u = relaxed(self._sheet, self.points, self.u, self.theta, steps, tolerance)
            return True
        grid, vertices, removed = self.coarser
        if not grid.solve_coarsest_first(steps, tolerance):
            return False
        self.u[vertices] = grid.u
        return reinsert_vertices(removed, self.points, self.theta, self.u)

    def converge(self, energy: float) -> bool:
        """Cycle until little is gained, given the energy; return whether that was reached."""
        no_forces = np.zeros(self.u.size, np.complex128)
        for _ in range(MOST_CYCLES):
            if self.step_share < LEAST_STEP_SHARE:
                self._coarsen(self.u)
            if self.coarser is None:
                return False
            self.cycle(no_forces)
            previous, energy = energy, self.gradient()[0]
            if previous - energy < LEAST_CYCLE_GAIN_SHARE * previous:
                return True
        return False

    def cycle(self, forces: Complex) -> None:
        """Lower the energy less the work of forces (n,): the descent of one V-cycle."""
        if self.coarser is None:
            work = Work(forces, self.u)
            self.u = self._sheet.relaxed(self.u, self.theta, COARSE_STEPS, LEAST_CYCLE_GAIN_SHARE, work)
            return
        none_fixed = np.zeros(self.u.size, bool)
        smooth(self.faces, self.points, none_fixed, SWEEPS, self.theta, self.u, forces=forces)
        self._correct(self.coarser, forces)

    def _correct(self, coarser: "Coarser", forces: Complex) -> None:
        """Take a step that lowers the energy less the work of forces (n,), found on the coarser grid."""
        grid, vertices, removed = coarser
        old_u = grid.u.copy()
        energy, slopes = self.gradient()
        # With these forces, the coarser grid has the same slopes as this one: both are minimal at the same positions.
        residual = forces - slopes
        restrict(removed, residual)
        grid.cycle(grid.gradient()[1] + residual[vertices])
        step = np.zeros(self.u.size, np.complex128)
        step[vertices] = grid.u - old_u
        interpolate(removed, step)
        work = float(np.vdot(forces, step).real)
        start, share = self.u, min(1.0, SHARE_OF_FLIP * largest_step(self.faces, self.u, step))
        while share > SHORTEST_SHARE:
            self.u = start + share * step
            if self.gradient()[0] - share * work < energy:
                break
            share *= 0.5
        else:
            self.u, share = start, 0.0
        self.step_share = share
        # the coarser grid follows, as far as none of its triangles folds
        coarse_step = grid.u - old_u
        share = min(share, SHARE_OF_FLIP * largest_step(grid.faces, old_u, coarse_step))
        grid.u = old_u + share * coarse_step


class Coarser(NamedTuple):
    """The next coarser grid of a grid.

    Attributes:
        grid: the coarser grid.
        vertices: (k,) the numbers of its vertices in the finer grid.
        removed: the other vertices of the finer grid.
    """

    grid: Grid
    vertices: Index
    removed: Removed


class Work(TermOnMesh):
    """The work of forces on the vertices, from a start, subtracted from the energy.

    Args:
        forces: (n,) x + iy on each vertex.
        start: (n,) positions at which the work is zero.
    """

    def __init__(self, forces: Complex, start: Complex):
        self.stencils = np.arange(start.size)[:, None]
        self._forces, self._start = forces, start.copy()

    def values(self, u: Complex) -> Real:
        """Return the work (n,) on each vertex, negative."""
        return -((u - self._start) * self._forces.conj()).real

    def derivatives(self, u: Complex) -> tuple[Complex, Real]:
        """Return the gradients (n, 1), which are constant, and Hessians (n, 1, 1, 2, 2) of zero."""
        return -self._forces[:, None], np.zeros((u.size, 1, 1, 2, 2))
