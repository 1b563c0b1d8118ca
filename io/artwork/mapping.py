"""Apply maps to shapes: paths are refitted within a tolerance, other content follows the maps' affine parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ... import deadline
from ...arrays import Complex, Index, Real
from ...curve import Curve
from ...maps.approximation import AnyMap
from ...maps.bezier_fit import refit
from ..shapes.shape import Shape
from ..svg.affine import Affine
from ..svg.batches import batches
from ..svg.curves import Bezier, Piece
from ..svg.path_data import PenPath
from .affine_part import AffinePart, MapSamples, affine_part
from .clip import Clipped, Part, Span, is_flat
from .element import MappedElement
from .embedded import EmbeddedPicture
from .regions import MapDomain, MapDomains

LOST = "shape whose image is not finite, omitted"
CUT, OUTSIDE = "shape partly outside the source, clipped at its outline", "shape outside the source, omitted"
# Parameters on a segment. Samples are at the odd ones; each represents the length between its neighbours.
_T = np.arange(9) / 8
_CONJUGATE = Affine(0, 1)


@dataclass(frozen=True, eq=False)
class Effect:
    """Content that follows the map only by its affine part over some shapes; `apply` returns a note or nothing."""

    shapes: Sequence[MappedElement]
    apply: Callable[[AffinePart], str]


class Lines(Protocol):
    """What is mapped of a shape of any format, in the plane of the source with y down.

    Attributes:
        runs: its subpaths; each has at least one segment.
        filled, lined: whether the area and the line are mapped.
        markers: anything if lines must not continue across the start of a closed subpath.
        copy: number of the only map that transfers it; None for the maps of the regions that it lies in.
    """

    runs: list[PenPath]
    markers: frozenset[str]
    copy: int | None

    @property
    def filled(self) -> bool: ...  # noqa: D102

    @property
    def lined(self) -> bool: ...  # noqa: D102


Shapes = TypeVar("Shapes", bound=Lines)


@dataclass(frozen=True, eq=False)
class Prepared(Generic[Shapes]):
    """What is left of shapes inside the regions, as segments to be fitted.

    Attributes:
        shapes: the shapes.
        clipped: of each shape, its part inside.
        parts: of each shape, its subpaths to be fitted.
        owners: of each segment of all subpaths, the region that transforms it.
        places: evaluates the segments.
    """

    shapes: Sequence[Shapes]
    clipped: Sequence[Clipped]
    parts: Sequence[ToFit]
    owners: Sequence[MapDomain]
    places: SegmentMapper

    def image(self, segment: NDArray[np.intp], t: NDArray[np.float64]) -> Complex:
        """Return images of points on segments, given their numbers and parameters in [0, 1]."""
        return _by_region(MapDomain.images, 2, self.owners, segment, self.places(segment, t))[1]

    def jet(self, segment: NDArray[np.intp], z: Complex) -> Sequence[Complex]:
        """Return points, one of each of the numbered segments, moved into the domains, with images and derivatives."""
        return _by_region(MapDomain.jet, 4, self.owners, segment, z)


class PathMapping:
    """Maps that are ready to transform shapes.

    Args:
        parts: the source shapes, each with its map, source → target, core plane.
        tolerance: of the paths, in the target's units.
        curves: whether straight segments are written as curves, so that the paths of all frames have the same commands.

    Attributes:
        notes: counts of content that was clipped, omitted or approximated.
    """

    def __init__(self, parts: Sequence[tuple[Shape, AnyMap]], tolerance: float, *, curves: bool = False):
        self.regions = MapDomains([MapDomain(source, map, tolerance) for source, map in parts])
        self.tolerance, self.curves = tolerance, curves
        self.notes: Counter[str] = Counter()

    def carry(self, shapes: Sequence[MappedElement], effects: Sequence[Effect]) -> None:
        """Apply the effects, then write the paths of all shapes, or remove shapes of which nothing is left."""
        prepared = self.prepare(shapes)
        self.write(prepared, refit(prepared.image, len(prepared.owners), self.tolerance), effects)

    def prepare(self, shapes: Sequence[Shapes]) -> Prepared[Shapes]:
        """Return what is left of shapes, as segments to be fitted."""
        clippings = [self._clip(shape) for shape in shapes]
        clipped = [_together([clipped for _, clipped in clipping]) for clipping in clippings]
        parts = [_to_fit(shape, clipping) for shape, clipping in zip(shapes, clippings)]
        runs = [run for part in parts for run in part.fill + part.line]
        owners = [run.region for run in runs for _ in run.pieces]
        return Prepared(
            shapes, clipped, parts, owners, SegmentMapper([piece for run in runs for piece in run.pieces])
        )

    def write(
        self, prepared: Prepared[MappedElement], fitted: Sequence[Complex], effects: Sequence[Effect]
    ) -> None:
        """Apply the effects, then write the paths of all shapes.

        The cubics of each segment, `fitted`, are changed to y down.
        """
        for control in fitted:
            np.conjugate(control, out=control)
        samples = _samples(prepared.places, prepared.owners)
        sampled: dict[MappedElement, MapSamples] = {}
        last = 0
        for shape, (fill, line, _) in zip(prepared.shapes, prepared.parts):
            first, begin = last, last + sum(len(run.pieces) for run in fill)
            last = begin + sum(len(run.pieces) for run in line)
            lined = (np.arange(first, last) >= begin) | (not line)
            sampled[shape] = samples.part(slice(4 * first, 4 * last), lined.repeat(4), fitted[first:last])
        for effect in effects:
            over = affine_part([sampled[shape] for shape in effect.shapes])
            note = effect.apply(over) if over else ""
            self.notes[note] += bool(note)
        cubics = iter(fitted)
        digits = max(0, int(np.ceil(-np.log10(self.tolerance / 20))))
        for shape, clipped, (fill, line, line_is_filled) in zip(
            prepared.shapes, prepared.clipped, prepared.parts
        ):
            fills, lines = (
                [([next(cubics) for _ in run.pieces], run.closed) for run in kind] for kind in (fill, line)
            )
            if not all(np.isfinite(cubic).all() for run, _ in fills + lines for cubic in run):
                shape.parent.remove(shape.out)
                self.notes[LOST] += 1
            elif fills or lines:
                shape.write(clipped, fills, lines, digits, line_is_filled=line_is_filled, curves=self.curves)
                self.notes[CUT] += clipped.cut and not shape.aside
            else:
                shape.parent.remove(shape.out)
                self.notes[OUTSIDE] += clipped.cut and not shape.aside
        self.notes = +self.notes

    def carry_pictures(self, pictures: Sequence[EmbeddedPicture]) -> None:
        """Add every embedded picture, or remove its group if nothing of it is left; call this after `carry`."""
        for picture in pictures:
            regions = (
                [self.regions.in_order[picture.copy]] if picture.copy is not None else self.regions.outer
            )
            deadline.check("carrying embedded pictures")
            note = picture.carry(regions, self.tolerance) or ("" if len(picture.out) else OUTSIDE)
            self.notes[note] += bool(note)
            picture.group[:] = picture.group if len(picture.out) else []
        self.notes = +self.notes

    def _clip(self, shape: Lines) -> list[tuple[MapDomain, Clipped]]:
        """Return the regions that transform a shape, with the part of it in each."""
        runs = [_core(run) for run in shape.runs]
        regions = self.regions.of(runs) if shape.copy is None else [self.regions.in_order[shape.copy]]
        clipped_by_region = [
            (region, region.domain.clip(runs, seams=bool(shape.markers), filled=shape.filled))
            for region in regions
        ]
        not_empty = [
            (region, clipped)
            for region, clipped in clipped_by_region
            if clipped.line or clipped.fill or any(clipped.windings)
        ]
        return not_empty or clipped_by_region[:1]


class SubpathPlacement(NamedTuple):
    """A subpath to be fitted, and the region that transforms it."""

    pieces: list[Part]
    closed: bool
    region: MapDomain


class ToFit(NamedTuple):
    """The subpaths of a shape to be fitted.

    Attributes:
        fill: those of its fill, if different from its line's; those around a whole region come last.
        line: those of its line.
        line_is_filled: whether the line's are also those of the fill.
    """

    fill: list[SubpathPlacement]
    line: list[SubpathPlacement]
    line_is_filled: bool = True


def _together(clippings: Sequence[Clipped]) -> Clipped:
    """Join the parts of a shape that lie in different regions."""
    if len(clippings) == 1:
        return clippings[0]
    lines, fills = (
        [run for clipped in clippings for run in getattr(clipped, name)] for name in ("line", "fill")
    )
    windings = [number for clipped in clippings for number in clipped.windings]
    begins, ends = (any(getattr(clipped, name) for clipped in clippings) for name in ("begins", "ends"))
    return Clipped(lines, True, fills, windings, begins, ends)


def _to_fit(shape: Lines, clippings: Sequence[tuple[MapDomain, Clipped]]) -> ToFit:
    """Return the subpaths of a shape to be fitted, given its part in each region."""
    cut = any(clipped.cut for _, clipped in clippings)
    lines = [SubpathPlacement(run, closed, region) for region, part in clippings for run, closed in part.line]
    if not shape.filled and (shape.lined or not cut):
        return ToFit([], lines)
    if cut:
        fills = [SubpathPlacement(run, True, region) for region, part in clippings for run in part.fill]
        fills += [
            SubpathPlacement(region.domain.around(windings), True, region)
            for region, part in clippings
            for windings in part.windings
            if windings
        ]
    else:
        fills = [
            SubpathPlacement(_closed(run), True, region)
            for region, part in clippings
            for run, _ in part.line
            if not is_flat(run)
        ]
        if len(fills) == len(lines) and all(closed for _, closed, _ in lines):
            return ToFit([], lines)
    return ToFit(fills, lines if shape.lined else [], line_is_filled=False)


def _closed(run: list[Part]) -> list[Part]:
    """Return a subpath closed as its fill closes it: by a chord in the source, which is mapped like any other line."""
    ends = np.array([0.0, 1.0])
    start, end = complex(run[0].at(ends)[0]), complex(run[-1].at(ends)[1])
    return run if start == end else [*run, Bezier((end, start))]


def _by_region(
    evaluate: Callable[[MapDomain, Complex], tuple[Complex, ...]],
    values: int,
    owners: Sequence[MapDomain],
    segment: NDArray[np.intp],
    z: Complex,
) -> Sequence[Complex]:
    """Return `values` arrays (p,): what a method of regions returns for points (p,), one of each segment."""
    if len(set(owners)) == 1:
        return evaluate(owners[0], z)
    out = np.empty((values, z.size), np.complex128)
    number = {region: k for k, region in enumerate(dict.fromkeys(owners))}
    region_number = np.array([number[region] for region in owners], dtype=np.intp)[segment]
    for region, k in number.items():
        points = np.flatnonzero(region_number == k)
        if points.size:
            out[:, points] = evaluate(region, z[points])
    return list(out)


def _samples(places: SegmentMapper, owners: Sequence[MapDomain]) -> MapSamples:
    """Sample the map at four points per segment, given the segments' regions."""
    count = len(owners)
    z = places(np.repeat(np.arange(count), _T.size), np.tile(_T, count)).reshape(-1, _T.size)
    length = np.abs(np.diff(z[:, ::2])).ravel()
    z, w, alpha, beta = _by_region(
        MapDomain.jet, 4, owners, np.repeat(np.arange(count), 4), z[:, 1::2].ravel()
    )
    return MapSamples(z.conj(), w.conj(), alpha.conj(), beta.conj(), length, length > 0, w)


def _core(run: PenPath) -> PenPath:
    return PenPath(_CONJUGATE(run.start), [piece.under(_CONJUGATE) for piece in run.pieces], run.closed)


def _along(outline: Curve, number: Index, arclength: Real) -> Complex:
    """Return the points of an outline at arclengths, as pieces give theirs; it is one piece, whatever the number."""
    return outline.at(arclength)


class SegmentMapper:
    """Evaluates many segments at once.

    Args:
        pieces: the segments in the order of their numbers.
    """

    def __init__(self, pieces: Sequence[Part]):
        self._pieces = pieces
        wholes = [piece.whole if isinstance(piece, Span) else piece for piece in pieces]
        numbers = np.array([k for k, whole in enumerate(wholes) if isinstance(whole, Piece)], dtype=np.intp)
        spans = [(p.start, p.stop) if isinstance(p, Span) else (0.0, 1.0) for p in pieces]
        self._start, self._stop = np.array(spans).reshape(-1, 2).T
        self._batch = np.empty(len(pieces), dtype=np.intp)  # of each segment
        self._place = np.zeros(len(pieces), dtype=np.intp)  # index of each segment in its batch
        self._batches = list[Callable[[Index, Real], Complex]]()
        for batch in batches([whole for whole in wholes if isinstance(whole, Piece)], Affine()):
            self._batch[numbers[batch.number]] = len(self._batches)
            self._place[numbers[batch.number]] = np.arange(batch.number.size)
            self._batches.append(batch.at)
        outlines: dict[Curve, list[int]] = {}
        for k, whole in enumerate(wholes):
            if isinstance(whole, Curve):
                outlines.setdefault(whole, []).append(k)
        for outline, parts in outlines.items():
            self._batch[parts] = len(self._batches)
            self._batches.append(partial(_along, outline))

    def __call__(self, segment: NDArray[np.intp], t: NDArray[np.float64]) -> Complex:
        """Return points at parameters in [0, 1] of the numbered segments."""
        out = np.empty(t.size, dtype=np.complex128)
        batch = self._batch[segment]
        parameters = self._start[segment] + (self._stop - self._start)[segment] * t
        for k, points_at in enumerate(self._batches):
            points = np.flatnonzero(batch == k)
            out[points] = points_at(self._place[segment[points]], parameters[points])
        return out
