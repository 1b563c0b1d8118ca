"""Problems in coordinates in which both shapes have radius one about their centroids.

The paper's and the conformal method solve in these coordinates, so that weights and lengths depend neither on the size
of the shapes nor on their position and rotation.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Complex, Real
from ..curve import Curve, boundary_samples
from ..maps.harmonic import HarmonicMap
from ..plane import Similarity
from ..problem import Problem, from_known

SYMMETRIC_MOMENT = 1e-6  # third moment of a boundary of radius one below which its sign is due to rounding


@dataclass(frozen=True, eq=False)
class NormalisedProblem:
    """Source, target and constraints in their frames; `target` is None for a deformation.

    Attributes:
        source: outline of the source.
        target: outline of the target.
        pins: (k, 2) points of the source and their images.
        strokes: polylines in the source and their images.
        source_frame: similarity from the user's coordinates of the source to these.
        target_frame: the same for the target, or for the deformed source.
    """

    source: Curve
    target: Curve | None
    pins: Complex
    strokes: list[tuple[Curve, Curve]]
    source_frame: Similarity
    target_frame: Similarity

    @classmethod
    def of(cls, problem: Problem, *, as_begun: bool = False) -> "NormalisedProblem":
        """Transform a problem to its frames.

        Args:
            problem: in the user's coordinates.
            as_begun: whether outlines keep their first vertices, from which the paper's initial map measures
                arclengths; otherwise the first vertices are chosen independently of the input's.
        """
        source, target = problem.source, problem.target
        if not as_begun:
            source, target = from_known(source), target and from_known(target)
        source_frame = frame_of(source)
        target_frame = frame_of(target or source)
        pins = np.column_stack([source_frame(problem.pins[:, 0]), target_frame(problem.pins[:, 1])])
        strokes = [(_in_frame(source_frame, a), _in_frame(target_frame, b)) for a, b in problem.strokes]
        goal = target and _in_frame(target_frame, target)
        return cls(_in_frame(source_frame, source), goal, pins, strokes, source_frame, target_frame)

    def mirrored(self) -> "NormalisedProblem":
        """Return the reflected problem."""
        strokes = [(Curve(a.z.conj(), False), Curve(b.z.conj(), False)) for a, b in self.strokes]
        return NormalisedProblem(
            _mirror(self.source),
            self.target and _mirror(self.target),
            self.pins.conj(),
            strokes,
            self.source_frame.conjugate(),
            self.target_frame.conjugate(),
        )

    @property
    def handedness(self) -> float:
        """A number whose sign changes under reflection.

        It is the third moment of the source's boundary about its axis, or of the target's if that is zero.
        """
        moments = [
            float(c.lengths @ (c.z + 0.5 * c.edges).imag ** 3) for c in (self.source, self.target) if c
        ]
        return next((moment for moment in moments if abs(moment) > SYMMETRIC_MOMENT), 1.0)

    @property
    def upright(self) -> complex:
        """The rotation between the frames in a similarity that does not rotate the user's picture, of modulus one."""
        rotation = self.target_frame.factor / self.source_frame.factor
        return rotation / abs(rotation)

    def in_plane(self, polygon: Complex, phi: Complex, psi: Complex) -> HarmonicMap:
        """Transform a map between the frames to the user's planes; constants go only to φ, since Σ C = 1."""
        z = self.source_frame.pull_back(polygon)
        slack = overhang(Curve(z), self.source_frame.pull_back(self.source.z))
        return HarmonicMap(z, self.target_frame.pull_back(phi), psi / self.target_frame.factor, slack)


def frame_of(curve: Curve) -> Similarity:
    """Return the similarity that maps a boundary's centroid to 0 and the vertex farthest from it to 1.

    It is equivariant, so that results in this frame do not depend on the shape's position and rotation.
    """
    middle = 0.5 * (curve.z[: curve.edges.size] + np.roll(curve.z, -1)[: curve.edges.size])
    # relative to a vertex, to avoid cancellation far from the origin
    centre = curve.z[0] + complex(np.average(middle - curve.z[0], weights=curve.lengths))
    farthest = curve.z[np.argmax(np.abs(curve.z - centre))]
    return Similarity(complex(1 / (farthest - centre)), centre=complex(centre))


def _in_frame(frame: Similarity, curve: Curve) -> Curve:
    return Curve(frame(curve.z), curve.closed)


def _mirror(curve: Curve) -> Curve:
    return Curve(np.roll(curve.z.conj()[::-1], 1))


def overhang(polygon: Curve, outline: Complex) -> float:
    """Return how far an outline lies outside the polygon that approximates it, at samples of its edges."""
    z = boundary_samples(outline)
    return float(np.abs(polygon.pulled_in(z) - z).max()) * (1 + 1e-9)


def measure_of(curve: Curve, per_edge: int) -> Real:
    """Return (e · per_edge,) share of the curve's length that each sample of `curve.sample(per_edge)` represents."""
    return np.repeat(curve.lengths / (per_edge * curve.length), per_edge)
