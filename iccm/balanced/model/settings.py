"""The settings of a balanced map, and the solution of a solve."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...arrays import Complex, Index
from ...maps.triangulated.map import TriangulatedMap
from ...maps.triangulated.patches import NO_LINES
from ...pins import Softness
from .energy import Energy
from .metric import Metric


@dataclass(frozen=True)
class Settings:
    """What is asked of a map.

    Attributes:
        energy: what the map minimises, and is compared by.
        turn: radians by which the picture should be turned; None leaves it to the shapes.
        tolerance: two-sided gap from the outlines aimed at, of the diagonal.
        max_dilatation: the largest K = s1/s2 wished; None for no bound.
        max_stretch: the largest max(s1, 1/s2) wished, relative to the mean scale; None for no bound.
        fit: whether both outlines are met whole, or concavities may be filled (`iccm.fits`).
        keep_holes: whether partial maps pass over no holes.
        max_left_out: the largest share of the source that may be left out.
        max_uncovered: the largest share of the target that may stay uncovered.
        starts: times as many correspondences are tried as usual.
        triangles: about how many the last mesh has.
        metric: of the source, in unit coordinates; None for the plane's own.
        rigid_size: of rigid regions, relative to the mean scale; None where it is free.
    """

    energy: Energy = field(default_factory=Energy)
    turn: float | None = 0.0
    tolerance: float = 1e-3
    max_dilatation: float | None = None
    max_stretch: float | None = None
    fit: str = "whole"
    keep_holes: bool = False
    max_left_out: float = 1.0
    max_uncovered: float = 1.0
    starts: int = 1
    triangles: int = 6000
    rigid_size: float | None = 1.0
    metric: Metric | None = None

    def inverse(self) -> "Settings":
        """Return what is asked of the inverse map."""
        turn, size = self.turn and -self.turn, self.rigid_size and 1 / self.rigid_size
        return replace(self, turn=turn, rigid_size=size)

    @property
    def theta(self) -> float:
        """The balance of angles and areas."""
        return self.energy.balance

    @property
    def bounded(self) -> bool:
        """Whether there are bounds on the distortion."""
        return self.max_dilatation is not None or self.max_stretch is not None


@dataclass(frozen=True, eq=False)
class Solution:
    """A map that was found, in the given coordinates, and how the search ended.

    Attributes:
        map: the map, one-to-one on its triangles, which are counter-clockwise in both planes, exactly.
        energies: at the end of each level.
        reached: whether tolerance and bounds are met.
        met: whether all pins and strokes are met.
        simple: whether the image's outlines overlap neither themselves nor each other; only deformations may.
        energy: at q = 1, areas taken as one, without the outline's term.
        turn: radians by which the picture is turned on average.
        gap: two-sided distance of the image's outline from the target, of its diagonal.
        source_gap: that of the mesh's outline from the source.
        notes: sentences on what was decided on the way.
        lines: (l, 2) vertices of the edges of strokes, which go straight to straight lines.
        partners: for each loop but the first, which hole of the source and of the target it is; -1 for a slit.
        holes: numbers of the holes of the source and of the target that the map does not pass over; None for all.
        filled: where concavities are filled, the outer outline with them in the source and in the image.
        rigid: outlines of rigid regions and of holes in them.
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
    holes: tuple[tuple[int, ...], tuple[int, ...]] | None = None
    filled: tuple[Complex, Complex] | None = None
    rigid: tuple[tuple[Complex, ...], ...] = ()
    rigid_of_target: bool = False
    soft_pins: Complex = field(default_factory=lambda: np.empty((0, 2), np.complex128))
    softness: Softness = field(default_factory=lambda: Softness.free(0))

    def inverse(self) -> "Solution":
        """Return the inverse map; rigid regions of one side are regions of the other side of the other."""
        return replace(
            self,
            map=self.map.linear_inverse(),
            turn=-self.turn,
            gap=self.source_gap,
            source_gap=self.gap,
            holes=self.holes and self.holes[::-1],
            filled=self.filled and self.filled[::-1],
            partners=tuple((j, i) for i, j in self.partners),
            rigid_of_target=not self.rigid_of_target,
        )


@dataclass
class SolveLog:
    """What happened on the way: energies at the end of each level, and sentences."""

    energies: list[float] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, other: "SolveLog") -> None:
        """Take over what another one has."""
        self.energies += other.energies
        self.notes += other.notes
