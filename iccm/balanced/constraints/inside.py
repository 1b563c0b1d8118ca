"""Constraints inside the domains as vertices of a mesh: those of strokes, which slide, then pins, which are held."""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ..minimise.sliding import BETA, Border, Rail
from ..pairs import Match


class InnerConstraints(NamedTuple):
    """Constrained vertices inside a mesh, with their places on the strokes.

    Attributes:
        z: (k,) in the source.
        goals: (k,) where they are to be in the image.
        s: (k,) arclengths on the source's strokes; 0 for pins.
        tau: (k,) arclengths on the target's strokes; likewise.
        own: (k,) which stroke; -1 for pins.
        links: (k,) the next vertex of the same stroke; -1 for none.
        at_source: (k,) those that stay where they are in the source: pins, corners and ends of its strokes.
        at_target: (k,) likewise in the image: pins, corners, and those ends of strokes that go to ends.
        stuck: (k,) those of them that stay where corners are released: pins and such ends.
        strokes: the rails of each stroke in the source and in the image.
    """

    z: Complex
    goals: Complex
    s: Real
    tau: Real
    own: Index
    links: Index
    at_source: Flags
    at_target: Flags
    stuck: Flags
    strokes: tuple[tuple[Rail, Rail], ...] = ()

    @classmethod
    def of_pins(cls, pins: Complex) -> "InnerConstraints":
        """Pins (k, 2), in the source and in the image."""
        k = len(pins)
        none, held = np.full(k, -1), np.ones(k, bool)
        return cls(
            pins[:, 0].copy(),
            pins[:, 1].copy(),
            np.zeros(k),
            np.zeros(k),
            none,
            none.copy(),
            held,
            held.copy(),
            held.copy(),
        )

    @property
    def matches(self) -> list[Match]:
        """The correspondence on each stroke."""
        chains = [self.own == stroke for stroke in range(len(self.strokes))]
        return [Match(self.s[chain], self.tau[chain]) for chain in chains]

    @property
    def following(self) -> Index:
        """(k,) the next vertex of the same stroke, or the vertex itself."""
        return np.where(self.links >= 0, self.links, np.arange(self.links.size))

    @property
    def lines(self) -> Index:
        """(l, 2) vertices of the edges of strokes."""
        first = np.flatnonzero(self.links >= 0)
        return np.column_stack([first, self.links[first]])

    def slid(self, u: Complex, tau: Real, stay: Flags) -> "InnerConstraints":
        """With goals and arclengths (k,) where vertices on strokes have come to be, but for those that stay."""
        goals = np.where(stay, self.goals, u)
        return self._replace(tau=tau, goals=goals, at_target=self.at_target & stay)

    def chains(self, forward: bool, first: int) -> tuple[Real, Border]:
        """(k,) arclengths on the side that moves, and the strokes as chains of vertices, the first of which is `first`.

        Arclengths of the edges on the side that is kept are scaled to the moving side's, and 1 where there is no edge.
        """
        moving, kept = (self.tau, self.s) if forward else (self.s, self.tau)
        spans = np.ones(self.z.size)
        edges = np.flatnonzero(self.links >= 0)
        for stroke in range(len(self.strokes)):
            those = edges[self.own[edges] == stroke]
            after = self.links[those]
            scale = (moving[after] - moving[those]).sum() / (kept[after] - kept[those]).sum()
            spans[those] = scale * (kept[after] - kept[those])
        linked = self.links >= 0
        stiffness, laps = np.where(linked, BETA, 0.0), np.where(linked, 0.0, 1.0)
        return moving, Border(first + self.following, spans, stiffness, laps)
