"""The solution of a solve, and the log that it keeps."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...arrays import Complex, Index
from ...maps.triangulated.map import TriangulatedMap
from ...maps.triangulated.patches import NO_LINES
from ...pins import Softness


@dataclass(frozen=True, eq=False)
class Solution:
    """A map in the given coordinates, and how the search ended.

    Attributes:
        map: the map. It is one-to-one on each triangle, and triangles are counter-clockwise in both planes, in
            exact arithmetic.
        energies: energy at the end of each level.
        reached: whether tolerance and bounds are met.
        met: whether all pins and strokes are met.
        simple: whether the image's outlines overlap neither themselves nor each other; this can be False for
            deformations only.
        energy: at q = 1, both areas scaled to one, without the outline's term.
        rotation: mean rotation of the picture in radians.
        gap: two-sided distance between the image's outline and the target, relative to the target's diagonal.
        source_gap: the same between the mesh's outline and the source.
        notes: messages about decisions of the search.
        lines: (l, 2) vertex pairs of the edges of strokes, which are mapped to straight lines.
        partners: for each loop but the first, the hole of the source and the hole of the target; -1 for a slit.
        filled: if concavities are filled, the outer outlines of source and image including them.
        covering_map: the map with the triangles that fill holes of the target; None if it has none.
        rigid: outlines of rigid regions, and of holes in them.
        rigid_of_target: whether these are regions of the target.
        soft_pins: (k, 2) pins that need not be met exactly.
        softness: of these, with radii and tolerances.
    """

    map: TriangulatedMap
    energies: list[float]
    reached: bool
    met: bool = True
    simple: bool = True
    energy: float = np.nan
    rotation: float = 0.0
    gap: float = 0.0
    source_gap: float = 0.0
    notes: list[str] = field(default_factory=list)
    lines: Index = field(default_factory=lambda: NO_LINES)
    partners: tuple[tuple[int, int], ...] = ()
    filled: tuple[Complex, Complex] | None = None
    covering_map: TriangulatedMap | None = None
    rigid: tuple[tuple[Complex, ...], ...] = ()
    rigid_of_target: bool = False
    soft_pins: Complex = field(default_factory=lambda: np.empty((0, 2), np.complex128))
    softness: Softness = field(default_factory=lambda: Softness.free(0))

    def inverse(self) -> "Solution":
        """Return the solution of the inverse problem.

        Rigid regions of the source become regions of the target, and vice versa.
        """
        return replace(
            self,
            map=self.map.linear_inverse(),
            rotation=-self.rotation,
            gap=self.source_gap,
            source_gap=self.gap,
            filled=self.filled and self.filled[::-1],
            covering_map=None,
            partners=tuple((j, i) for i, j in self.partners),
            rigid_of_target=not self.rigid_of_target,
        )


@dataclass
class SolveLog:
    """The energies at the end of each level, and the messages, that a solve collects."""

    energies: list[float] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, other: "SolveLog") -> None:
        """Append the energies and messages of another log."""
        self.energies += other.energies
        self.notes += other.notes
