"""Constraints inside the domains as vertices of a mesh.

Those of strokes, which slide, come first; those of pins, which are held, follow.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ..minimise.sliding import OUTLINE_WEIGHT, Border, Rail
from .boundary_pairs import Match


class Foot(NamedTuple):
    """A point where a stroke meets the outline.

    Attributes:
        vertex: the stroke's first or last vertex inside, which an edge joins to the outline.
        place: point on the source's outline.
        stroke: index of the stroke.
        end: 0 for its beginning, 1 for its end.
    """

    vertex: int
    place: complex
    stroke: int
    end: int


class InnerConstraints(NamedTuple):
    """Constrained vertices inside a mesh, with their positions on the strokes.

    Attributes:
        z: (k,) positions in the source.
        goals: (k,) goal positions in the image.
        s: (k,) arclengths on the source's strokes; 0 for pins.
        tau: (k,) arclengths on the target's strokes; 0 for pins.
        stroke_index: (k,) index of the stroke; -1 for pins.
        links: (k,) the next vertex on the same stroke; -1 for none.
        at_source: (k,) vertices that are fixed in the source: pins, corners and ends of the source's strokes.
        at_target: (k,) the same in the image: pins, corners, and those ends of strokes that are mapped to ends.
        stuck: (k,) the subset of `at_target` that stays fixed when corners are released: pins and such ends.
        strokes: the rails of each stroke in the source and in the image.
        feet: points where strokes meet the outline; the strokes have no separate vertex there.
    """

    z: Complex
    goals: Complex
    s: Real
    tau: Real
    stroke_index: Index
    links: Index
    at_source: Flags
    at_target: Flags
    stuck: Flags
    strokes: tuple[tuple[Rail, Rail], ...] = ()
    feet: tuple[Foot, ...] = ()

    @classmethod
    def of_pins(cls, pins: Complex) -> "InnerConstraints":
        """Return the constraints of pins (k, 2), given in the source and in the image."""
        k = len(pins)
        none, fixed = np.full(k, -1), np.ones(k, bool)
        return cls(
            pins[:, 0].copy(),
            pins[:, 1].copy(),
            np.zeros(k),
            np.zeros(k),
            none,
            none.copy(),
            fixed,
            fixed.copy(),
            fixed.copy(),
        )

    @property
    def matches(self) -> list[Match]:
        """The correspondence on each stroke."""
        return [self._match(stroke) for stroke in range(len(self.strokes))]

    def _match(self, stroke: int) -> Match:
        """Return the correspondence on a stroke, including ends on the outline, which have no vertex inside."""
        chain = self.stroke_index == stroke
        on = {foot.end for foot in self.feet if foot.stroke == stroke}
        source, target = self.strokes[stroke]
        s, tau = self.s[chain], self.tau[chain]
        if 0 in on:
            s, tau = np.append(0.0, s), np.append(0.0, tau)
        if 1 in on:  # the rail of a stroke is traversed forth and back
            s, tau = np.append(s, 0.5 * source.knots[-1]), np.append(tau, 0.5 * target.knots[-1])
        return Match(s, tau)

    @property
    def following(self) -> Index:
        """The next vertex on the same stroke, or the vertex itself if there is none; shape (k,)."""
        return np.where(self.links >= 0, self.links, np.arange(self.links.size))

    @property
    def lines(self) -> Index:
        """Vertex pairs of the strokes' edges; shape (l, 2)."""
        first = np.flatnonzero(self.links >= 0)
        return np.column_stack([first, self.links[first]])

    def rays(self, outline: Complex) -> Index:
        """Return (e, 2) edges from the outline to inner vertices, where strokes meet the outline.

        The outline has the vertices (b,).
        """
        ends = [(int(np.abs(outline - foot.place).argmin()), foot.vertex) for foot in self.feet]
        return np.array(ends, np.int64).reshape(-1, 2)

    def lines_with(self, outline: Complex) -> Index:
        """Return (l, 2) vertex pairs of the strokes' edges.

        The first vertices of the mesh are those (b,) of the outline.
        """
        rays = self.rays(outline)
        rays[:, 1] += outline.size
        return np.concatenate([outline.size + self.lines, rays])

    def inverse(self, outline: Complex, image: Complex) -> "InnerConstraints":
        """Return the constraints of the inverse map.

        Args:
            outline: (b,) vertices of the mesh's outlines.
            image: (b,) their images.
        """
        on_outline = self.rays(outline)[:, 0]
        feet = tuple(foot._replace(place=complex(image[k])) for foot, k in zip(self.feet, on_outline))
        return self._replace(
            z=self.goals,
            goals=self.z,
            s=self.tau,
            tau=self.s,
            at_source=self.at_target,
            at_target=self.at_source,
            strokes=tuple((target, source) for source, target in self.strokes),
            feet=feet,
        )

    def slid(self, u: Complex, tau: Real, stay: Flags) -> "InnerConstraints":
        """Return the constraints after the vertices on strokes moved.

        Args:
            u: (k,) new positions in the image.
            tau: (k,) new arclengths on the target's strokes.
            stay: (k,) vertices that keep their goals.
        """
        goals = np.where(stay, self.goals, u)
        return self._replace(tau=tau, goals=goals, at_target=self.at_target & stay)

    def with_pins_of(self, other: "InnerConstraints") -> "InnerConstraints":
        """Return the constraints with the goals that the same pins have in another mesh."""
        goals = self.goals.copy()
        goals[self.stroke_index < 0] = other.goals[other.stroke_index < 0]
        return self._replace(goals=goals)

    def chains(self, forward: bool, first: int) -> tuple[Real, Border]:
        """Return arclengths (k,) on the side that moves, and the strokes as chains.

        The lengths of edges on the fixed side are scaled to the moving side; they are 1 where a vertex has no
        next one.

        Args:
            forward: whether the image moves, rather than the source.
            first: number of the first inner vertex in the mesh.
        """
        moving, fixed_side = (self.tau, self.s) if forward else (self.s, self.tau)
        spans = np.ones(self.z.size)
        edges = np.flatnonzero(self.links >= 0)
        for stroke in range(len(self.strokes)):
            tails = edges[self.stroke_index[edges] == stroke]
            heads = self.links[tails]
            scale = (moving[heads] - moving[tails]).sum() / (fixed_side[heads] - fixed_side[tails]).sum()
            spans[tails] = scale * (fixed_side[heads] - fixed_side[tails])
        linked = self.links >= 0
        stiffness, laps = np.where(linked, OUTLINE_WEIGHT, 0.0), np.where(linked, 0.0, 1.0)
        return moving, Border(first + self.following, spans, stiffness, laps)
