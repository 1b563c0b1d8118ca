"""The settings of a balanced map, and the solution of a solve."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...arrays import Complex, Index
from ...maps.triangulated.map import TriangulatedMap
from ...maps.triangulated.patches import NO_LINES
from ...pins import Softness
from ...plane import Similarity
from ..minimise.soft_pins import SoftPins
from .energy import Energy
from .metric import Metric


@dataclass(frozen=True)
class Settings:
    """Options of a balanced map.

    Attributes:
        energy: the energy that the map minimises, and by which maps are compared.
        turn: desired rotation of the picture in radians; None leaves it to the shapes.
        tolerance: largest two-sided distance of the outlines, relative to the target's diagonal.
        max_dilatation: largest K = s1/s2 requested; None for no bound.
        max_stretch: largest max(s1, 1/s2) requested, relative to the mean scale; None for no bound.
        fit: whether both outlines are matched entirely, or concavities may be filled (`iccm.fits`).
        starts: multiple of the usual number of correspondences to try.
        triangles: approximate number of triangles of the final mesh.
        rigid_size: scale of rigid regions relative to the mean scale; None leaves it free.
        metric: of the source, in unit coordinates; None for the Euclidean plane.
        keep_start: whether an earlier map that meets all constraints is returned unchanged.
    """

    energy: Energy = field(default_factory=Energy)
    turn: float | None = 0.0
    tolerance: float = 1e-3
    max_dilatation: float | None = None
    max_stretch: float | None = None
    fit: str = "whole"
    starts: int = 1
    triangles: int = 6000
    rigid_size: float | None = 1.0
    metric: Metric | None = None
    keep_start: bool = False

    def inverse(self) -> "Settings":
        """Return the settings of the inverse map."""
        turn, size = self.turn and -self.turn, self.rigid_size and 1 / self.rigid_size
        return replace(self, energy=self.energy.inverse(), turn=turn, rigid_size=size)

    def in_frames(self, frames: tuple[Similarity, Similarity], pins: SoftPins | None = None) -> "Settings":
        """Return the settings for unit coordinates: terms are rotated and mirrored with the shapes.

        Args:
            frames: the similarities from the given to unit coordinates, for source and target.
            pins: soft pins in unit coordinates.
        """
        return replace(self, energy=self.energy.in_frames(frames, pins))

    @property
    def theta(self) -> float:
        """The energy's balance of angles and areas, θ."""
        return self.energy.balance

    @property
    def bounded(self) -> bool:
        """Whether there are bounds on the distortion."""
        return self.max_dilatation is not None or self.max_stretch is not None


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
        turn: mean rotation of the picture in radians.
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
    turn: float = 0.0
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
            turn=-self.turn,
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
