"""Constraints inside the domains as vertices of a mesh: those of strokes, which slide, then pins, which are held."""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ..minimise.sliding import Rail
from ..pairs import Match


class Inside(NamedTuple):
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
    def of_pins(cls, pins: Complex) -> "Inside":
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

    def chains(self, forward: bool) -> tuple[Real, Real]:
        """(k,) arclengths on the side that moves, and those of the edges on the side that is kept.

        The latter are scaled to the moving side's lengths, and 1 where there is no edge.
        """
        moving, kept = (self.tau, self.s) if forward else (self.s, self.tau)
        spans = np.ones(self.z.size)
        edges = np.flatnonzero(self.links >= 0)
        for stroke in range(len(self.strokes)):
            those = edges[self.own[edges] == stroke]
            after = self.links[those]
            scale = (moving[after] - moving[those]).sum() / (kept[after] - kept[those]).sum()
            spans[those] = scale * (kept[after] - kept[those])
        return moving, spans
