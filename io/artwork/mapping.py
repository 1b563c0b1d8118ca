"""A map that carries shapes: paths refitted within a tolerance, and the map's affine part for what has no path."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...arrays import Complex
from ...curve import Curve
from ...maps.bezier_fit import refit
from ...maps.kinds import AnyMap, Evaluated, evaluated
from ..shapes.shape import Shape
from ..svg.affine import Affine
from ..svg.path_data import Run
from .affine_part import AffinePart, Samples, affine_part
from .clip import Clipped, Domain, Part
from .element import MappedElement

NEAR = 3e-4  # of the source's diagonal: no farther outside counts as on the outline, which is flattened
LOST = "shape of which the map makes no numbers, left out"
CUT, OUTSIDE = "shape partly outside the source, cut off at its outline", "shape outside the source, left out"
# Parameters on a piece: samples at the odd ones, each for the length from the one before to the one after.
_T = np.arange(9) / 8
_CONJUGATE = Affine(0, 1)


@dataclass(frozen=True, eq=False)
class Effect:
    """What follows the map only by its affine part over some shapes; `apply` returns what is to be noted."""

    shapes: Sequence[MappedElement]
    apply: Callable[[AffinePart], str]


class PathMapping:
    """The map, ready to carry shapes.

    Args:
        map: source → target, core plane.
        source: the shape that it was made for.
        tolerance: of the paths, in the target's units.

    Attributes:
        notes: what was cut off, left out or approximated, with how often.
    """

    def __init__(self, map: AnyMap | Evaluated, source: Shape, tolerance: float):
        self.map = evaluated(map)
        self.rim = Curve(self.map.polygon)
        outline = source.curve.z
        gap = float(np.abs(self.rim.at(self.rim.closest(outline)) - outline).max())
        self.domain = Domain(self.rim, max(1.2 * gap, NEAR * source.curve.diagonal))
        self.tolerance = tolerance
        self.notes: Counter[str] = Counter()

    def carry(self, shapes: Sequence[MappedElement], effects: Sequence[Effect]) -> None:
        """Applies the effects, then gives every shape's element its path, or takes the element out."""
        clipped = [
            self.domain.clip([_core(run) for run in shape.runs], seams=bool(shape.markers))
            for shape in shapes
        ]
        parts = [self._parts(shape, each) for shape, each in zip(shapes, clipped)]
        pieces = [piece for fill, line in parts for run, _ in fill + line for piece in run]
        fitted = refit(lambda which, t: self.image(_points(pieces, which, t)), len(pieces), self.tolerance)
        fitted = [control.conj() for control in fitted]
        samples = self._samples(pieces)
        sampled: dict[MappedElement, Samples] = {}
        last = 0
        for shape, (fill, line) in zip(shapes, parts):
            first, begin = last, last + sum(len(run) for run, _ in fill)
            last = begin + sum(len(run) for run, _ in line)
            lined = (np.arange(first, last) >= begin) | (not line)
            sampled[shape] = samples.part(slice(4 * first, 4 * last), lined.repeat(4), fitted[first:last])
        for effect in effects:
            over = affine_part([sampled[shape] for shape in effect.shapes])
            note = effect.apply(over) if over else ""
            self.notes[note] += bool(note)
        cubics = iter(fitted)
        digits = max(0, int(np.ceil(-np.log10(self.tolerance / 20))))
        for shape, each, (fill, line) in zip(shapes, clipped, parts):
            fills, lines = ([([next(cubics) for _ in run], c) for run, c in kind] for kind in (fill, line))
            if not all(np.isfinite(cubic).all() for run, _ in fills + lines for cubic in run):
                shape.parent.remove(shape.out)
                self.notes[LOST] += 1
            elif fills or lines:
                shape.write(each, fills, lines, digits)
                self.notes[CUT] += each.cut and not shape.aside
            else:
                shape.parent.remove(shape.out)
                self.notes[OUTSIDE] += not shape.aside
        self.notes = +self.notes

    def image(self, z: Complex) -> Complex:
        """Images of points (p,) inside, or so little outside that they count as on the outline."""
        return self._jet(z)[1]

    def _jet(self, z: Complex) -> tuple[Complex, ...]:
        """Points, images and derivatives; points that are not inside are replaced by those of the outline."""
        z = z.copy()
        jet = self.map.jet(z)
        far = float(np.abs(self.rim.z).max())
        for inward in (
            0.0,
            1e-9 * self.map.diagonal + 8 * np.spacing(far),
        ):  # where rounding puts it outside again
            lost = np.flatnonzero(np.isnan(jet[0]))
            if not lost.size:
                break
            s = self.rim.closest(z[lost])
            edge, _ = self.rim.locate(s)
            z[lost] = self.rim.at(s) - inward * self.rim.normals[edge]
            for values, found in zip(jet, self.map.jet(z[lost])):
                values[lost] = found
        return z, *jet

    def _parts(self, shape: MappedElement, clipped: Clipped) -> tuple[list["_Parts"], list["_Parts"]]:
        """What is to be fitted of a shape: runs of its fill, where they differ from the line's, and of its line."""
        if not clipped.cut:
            return [], clipped.line
        line = clipped.line if shape.lined else []
        if shape.lined and not shape.filled:
            return [], line
        around = [self.domain.around(turns) for turns in clipped.turns if turns]
        return [(run, True) for run in clipped.fill + around], line

    def _samples(self, pieces: list[Part]) -> Samples:
        """Four for each piece."""
        which = np.repeat(np.arange(len(pieces)), _T.size)
        z = _points(pieces, which, np.tile(_T, len(pieces))).reshape(-1, _T.size)
        length = np.abs(np.diff(z[:, ::2])).ravel()
        z, w, alpha, beta = self._jet(z[:, 1::2].ravel())
        return Samples(z.conj(), w.conj(), alpha.conj(), beta.conj(), length, length > 0, w)


_Parts = tuple[list[Part], bool]


def _core(run: Run) -> Run:
    return Run(_CONJUGATE(run.start), [piece.under(_CONJUGATE) for piece in run.pieces], run.closed)


def _points(pieces: Sequence[Part], which: NDArray[np.intp], t: NDArray[np.float64]) -> Complex:
    """Points of the pieces; `which` is not sorted, but comes in runs."""
    out = np.empty(t.size, dtype=np.complex128)
    cuts = np.flatnonzero(np.diff(which, prepend=-1, append=-1))
    for a, b in pairwise(cuts):
        out[a:b] = pieces[which[a]].at(t[a:b])
    return out
