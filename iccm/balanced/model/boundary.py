"""Boundaries of maps: vertices that slide on outlines, or that are free except for pins."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ..meshing.mesh import closed_links
from ..minimise.energy import BOTH_AREAS, IMAGE_AREA, SOURCE_AREA
from ..minimise.sliding import FREE, HELD, NO_RAIL, OUTLINE_WEIGHT, SLIDING, Border, Rail
from .boundary_pairs import HoleMatch, Loop, Match, Pairs, are_distinct
from .outline import Outline

NO_PINS, NO_GOALS = np.empty(0, np.int64), np.empty(0, np.complex128)


class Support(NamedTuple):
    """The constraints of vertices on the side of a map that moves.

    Attributes:
        tau: (c,) arclengths on their rails.
        border: the curves as chains.
        kinds: (c,) HELD, SLIDING or FREE.
        goals: (c,) goal positions of those that are held.
        rails: the curves on which vertices slide.
        rail_index: (c,) the rail of each vertex.
    """

    tau: Real
    border: Border
    kinds: Index
    goals: Complex
    rails: list[Rail]
    rail_index: Index


class MeshHoles(NamedTuple):
    """The holes of a discrete map.

    Attributes:
        outlines: for each hole of the mesh, its outlines in source and target.
        loops: their vertices.
        filled: outlines of holes of the source without a partner, whose vertices are inner vertices of the
            mesh.
    """

    outlines: tuple[tuple[Outline, Outline], ...] = ()
    loops: tuple[Loop, ...] = ()
    filled: tuple[Loop, ...] = ()

    def inverse(self) -> "MeshHoles":
        """Return the holes of the inverse map."""
        outlines = tuple((b, a) for a, b in self.outlines)
        loops = tuple(loop.inverse() for loop in self.loops)
        return MeshHoles(outlines, loops, tuple(loop.inverse() for loop in self.filled))


NO_HOLES = MeshHoles()


@dataclass(frozen=True, eq=False)
class PlainBoundary:
    """Vertices on outlines, without their positions on these.

    Attributes:
        size: number of vertices on the outlines.
        holes: the holes.
    """

    size: int
    holes: MeshHoles = NO_HOLES

    @property
    def slices(self) -> list[slice]:
        """The range of vertices of each outline."""
        return slices_of(self.size, self.holes.loops)


def slices_of(size: int, loops: tuple[Loop, ...]) -> list[slice]:
    """Return the range of vertices of each outline, the outer one first, of `size` vertices in all."""
    return [slice(0, loops[0].first if loops else size), *(loop.vertices for loop in loops)]


class MatchedLoop(NamedTuple):
    """One loop of a map's boundary.

    Attributes:
        source: its outline in the source.
        target: its outline in the target.
        vertices: its range of vertices.
    """

    source: Outline
    target: Outline
    vertices: slice

    @property
    def lengths(self) -> tuple[float, float]:
        """Lengths of both outlines."""
        return self.source.length, self.target.length


@dataclass(frozen=True, eq=False)
class MatchedBoundary:
    """Vertices that slide on the outlines of source and target.

    Attributes:
        source: outline of the source at this level.
        target: outline of the target.
        pairs: arclengths of the vertices on both outlines, and which vertices are at corners.
        anchored: (b,) vertices that never move.
        axis: arclength on the source from which the outline is a mirror axis, whose edges have no stiffness;
            inf if there is no axis.
        holes: the holes.
    """

    source: Outline
    target: Outline
    pairs: Pairs
    anchored: Flags
    axis: float = np.inf
    holes: MeshHoles = NO_HOLES

    pinned, goals = NO_PINS, NO_GOALS

    @classmethod
    def of(
        cls,
        source: Outline,
        target: Outline,
        pairs: Pairs,
        anchors: Match | None,
        holes: MeshHoles = NO_HOLES,
        axis: float = np.inf,
    ) -> "MatchedBoundary":
        """Return a boundary whose vertices at the anchors of the outer outline are fixed."""
        anchored = np.zeros(pairs.s.size, bool)
        outer = slice(0, holes.loops[0].first if holes.loops else anchored.size)
        if anchors is not None:
            anchored[outer] = ~are_distinct(pairs.s[outer], anchors.s, source.length)
        return cls(source, target, pairs, anchored, axis, holes)

    @property
    def size(self) -> int:
        """Number of vertices on the outlines."""
        return self.pairs.s.size

    @property
    def slices(self) -> list[slice]:
        """The range of vertices of each outline."""
        return slices_of(self.size, self.holes.loops)

    @cached_property
    def loops(self) -> list[MatchedLoop]:
        """The outlines and their vertices, the outer one first."""
        outlines = (self.source, self.target), *self.holes.outlines
        return [MatchedLoop(*pair, vertices) for pair, vertices in zip(outlines, self.slices)]

    @property
    def following(self) -> Index:
        """The next vertex on the same outline; shape (b,)."""
        return closed_links([vertices.stop - vertices.start for vertices in self.slices])

    @property
    def match(self) -> Match:
        """The correspondence of the outlines."""
        outer, *holes = [self._match(loop) for loop in self.loops]
        numbers = ((loop.source, loop.target) for loop in self.holes.loops)
        return outer._replace(holes=tuple(HoleMatch(i, j, hole) for (i, j), hole in zip(numbers, holes)))

    def _match(self, loop: MatchedLoop) -> Match:
        s, tau = self.pairs.s[loop.vertices], self.pairs.tau[loop.vertices]
        return Match(np.append(s, s[0] + loop.source.length), np.append(tau, tau[0] + loop.target.length))

    def inverse(self) -> "MatchedBoundary":
        """Return the boundary of the inverse map; not valid if holes are filled."""
        s, tau, at_source, at_target = self.pairs
        pairs, holes = Pairs(tau, s, at_target, at_source), self.holes.inverse()
        return replace(self, source=self.target, target=self.source, pairs=pairs, holes=holes)

    def with_filled(self, loops: tuple[Loop, ...]) -> "MatchedBoundary":
        """Return the boundary with the outlines of holes without a partner."""
        return replace(self, holes=self.holes._replace(filled=loops))

    def images(self) -> Complex:
        """Return (b,) the positions of the vertices on the target."""
        u = np.zeros(self.size, np.complex128)
        for loop in self.loops:
            u[loop.vertices] = loop.target.curve.at(self.pairs.tau[loop.vertices])
        return u

    def area_share(self, forward: bool) -> float:
        """Return one half, so that a map and its inverse have the same energy."""
        return BOTH_AREAS

    def support(self, forward: bool, moving: Complex, corners: bool) -> Support:
        """Return the constraints on the side that moves.

        Vertices at corners of the moving side are held there. Those at corners of the fixed side slide along
        the moving side.

        Args:
            forward: whether the image moves, rather than the source.
            moving: (b,) positions on the moving side.
            corners: whether corners of the target hold their vertices.
        """
        loops, rail_index = self.loops, np.zeros(self.size, np.int64)
        for k, loop in enumerate(loops):
            rail_index[loop.vertices] = k
        kinds = np.where(self._held(forward, corners), HELD, SLIDING)
        rails = [(loop.target if forward else loop.source).rail for loop in loops]
        return Support(*self._chains(forward), kinds, moving, rails, rail_index)

    def _held(self, forward: bool, corners: bool) -> Flags:
        """Return (b,) the vertices that do not move."""
        if forward and not corners:
            return self.anchored
        return self.anchored | (self.pairs.at_target if forward else self.pairs.at_source)

    def _chains(self, forward: bool) -> tuple[Real, Border]:
        """Return arclengths on the side that moves, and the loops as chains."""
        moving, fixed_side = (self.pairs.tau, self.pairs.s) if forward else (self.pairs.s, self.pairs.tau)
        spans, laps = np.empty(fixed_side.size), np.zeros(fixed_side.size)
        spans[:-1] = fixed_side[1:] - fixed_side[:-1]
        for loop in self.loops:
            (length, lap), last = loop.lengths if forward else loop.lengths[::-1], loop.vertices.stop - 1
            spans[last] = fixed_side[loop.vertices.start] + length - fixed_side[last]
            laps[last] = lap
        stiffness = np.full(fixed_side.size, OUTLINE_WEIGHT)
        if self.axis < np.inf:
            on_axis = np.mod(self.pairs.s, self.source.length) > self.axis - 1e-9 * self.source.length
            stiffness[on_axis] = 0.0
        return moving, Border(self.following, spans, stiffness, laps)

    def slid(self, forward: bool, tau: Real, corners: bool) -> "MatchedBoundary":
        """Return the boundary with vertices at arclengths tau (b,) on one side.

        Target corners that were released are omitted.
        """
        if not forward:
            return replace(self, pairs=self.pairs._replace(s=tau))
        at_target = self.pairs.at_target & self._held(True, corners)
        return replace(self, pairs=self.pairs._replace(tau=tau, at_target=at_target))

    def with_goals(self, goals: Complex) -> "MatchedBoundary":
        """Return the boundary unchanged: pins on outlines are anchors."""
        return self


@dataclass(frozen=True, eq=False)
class FreeBoundary:
    """Boundary vertices that are free, except for pins.

    Attributes:
        sizes: number of vertices on each outline, the outer one and those of holes.
        pinned: (p,) the vertices that are pins.
        goals: (p,) their goal positions.
    """

    sizes: tuple[int, ...]
    pinned: Index
    goals: Complex

    holes = NO_HOLES

    @property
    def size(self) -> int:
        """Number of vertices on the outlines."""
        return sum(self.sizes)

    @property
    def slices(self) -> list[slice]:
        """The range of vertices of each outline."""
        return [slice(start, end) for start, end in pairwise(np.cumsum([0, *self.sizes]).tolist())]

    @property
    def following(self) -> Index:
        """Each vertex itself: edges of the outlines have no stiffness; shape (b,)."""
        return np.arange(self.size)

    def area_share(self, forward: bool) -> float:
        """Return the share with which only the source's area counts; otherwise a bar shrinks to 74 % as it bends."""
        return SOURCE_AREA if forward else IMAGE_AREA

    def support(self, forward: bool, moving: Complex, corners: bool) -> Support:
        """Return the constraints on the side that moves: pins are held, and in the source all vertices."""
        vertices = np.arange(self.size)
        border, goals = Border.still(vertices), moving.copy()
        kinds = np.full(self.size, FREE if forward else HELD)
        if forward:
            kinds[self.pinned], goals[self.pinned] = HELD, self.goals
        return Support(np.zeros(self.size), border, kinds, goals, [NO_RAIL], 0 * vertices)

    def slid(self, forward: bool, tau: Real, corners: bool) -> "FreeBoundary":
        """Return the boundary unchanged: no vertex slides."""
        return self

    def with_goals(self, goals: Complex) -> "FreeBoundary":
        """Return the boundary with other goals (p,)."""
        return replace(self, goals=goals)


HeldBoundary = MatchedBoundary | FreeBoundary
"""Boundaries of maps that Newton's method can move."""
Boundary = PlainBoundary | HeldBoundary
