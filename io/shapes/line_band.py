"""Bands along lines: the target of `--along`, onto which a drawing is bent like text on a path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely.ops import nearest_points, substring

from ...arrays import Complex, complex_of, xy_of
from ...curve import Curve, polygon_of
from ...drawings.drawing import Drawing
from ...errors import InputError
from ...plane import bounding_box, distinct
from .. import formats
from ..outlines import lettering
from ..spec import Spec
from ..svg import reader as svg
from ..svg.drawing_content import DrawingContent
from ..svg.fill import FilledOutline
from .shape import Shape, of_drawing, suggested

SEAM_LENGTH_SHARE = 2e-4
"""Relative to the line's length: ends that are closer meet, and a closed line is cut open by a gap of this length."""
END_LENGTH_SHARE = 0.01
"""Of a line: at each end, so much of it is not fixed to the source's baseline, but follows the band."""
HALVINGS = 10
"""Of the interval in which the largest width without overlap is sought: accurate to a thousandth."""
LEAST_SIDE_SHARE = 0.02
"""Relative to the band's width: a band that reaches less beyond one side of the line ends at the line."""
MITRE_LIMIT = 4.0
"""Longest corner of a band relative to the distance of its edge from the line, as in SVG."""


@dataclass(frozen=True, eq=False)
class LineBand:
    """A band along a line in the core plane, and the line as the image of the source's baseline.

    Attributes:
        shape: the band as a shape.
        lower: its lower edge, (n,) complex, in the direction in which the source is read.
        upper: its upper edge.
        line: the line itself; None where it is an edge of the band, or lies outside.
        width: of the band, in units of the file.
        note: why the band is not as wide as it should be, or not within the canvas; empty if it is.
    """

    shape: Shape
    lower: Complex
    upper: Complex
    line: Complex | None
    width: float
    note: str = ""

    def strokes(self, box: tuple[complex, complex], baseline: float) -> list[tuple[Curve, Curve]]:
        """Return the strokes that map the edges and the baseline of the source's box onto those of the band."""
        low, high = box
        pairs = [
            (np.array([complex(low.real, y), complex(high.real, y)]), z)
            for y, z in ((low.imag, self.lower), (high.imag, self.upper))
        ]
        if self.line is not None:
            middle = np.array([complex(low.real, baseline), complex(high.real, baseline)])
            pairs.append((_shortened(middle), _shortened(self.line)))
        return [(Curve(a, closed=False), Curve(b, closed=False)) for a, b in pairs]


def _shortened(z: Complex) -> Complex:
    """Return a line without its ends, which would meet where a closed line is cut open."""
    line = shapely.LineString(xy_of(z))
    inner = substring(line, END_LENGTH_SHARE, 1 - END_LENGTH_SHARE, normalized=True)
    return complex_of(shapely.get_coordinates(inner))


def baseline_of(source: Shape) -> float:
    """Return the ordinate of a source's baseline in the core plane: of a text its own, else the middle of its box."""
    if _is_text(source):
        return -lettering.BASELINE
    low, high = source.curve.box
    return (low.imag + high.imag) / 2


def _is_text(source: Shape) -> bool:
    return formats.suffix_of(source.path) in formats.FONTS


def band_along(text: str, width: float | None, source: Shape, *, max_segments: int) -> LineBand:
    """Return the band along the line that a spec names.

    An open line runs to the right, so that the source is upright where it is; a closed one clockwise from below its
    middle, so that the source stands on it.

    Args:
        text: the spec; the longest line of what it selects is used.
        width: of the band, in units of the file; a text that is then shorter than the line keeps its proportions, in
            the line's middle. None: so wide that the source keeps its proportions on the whole line, as far as the band
            does not overlap itself.
        source: the box that is bent along the line.
        max_segments: limit on lines and curves.

    Raises:
        InputError: the file has no lines, or the band overlaps itself.
    """
    spec = Spec.of(text)
    if formats.suffix_of(spec.path) not in (".svg", ".svgz"):
        raise InputError(f"{spec.path}: --along reads lines from SVG files; name one")
    drawing, lines = svg.read_lines(spec.path, spec.selection, max_segments=max_segments)
    if spec.selection is not None and spec.selection not in drawing.ids:
        raise InputError(
            f"{text}: there is no {spec.selection!r} in the file; {suggested(spec.selection, drawing.ids)}"
        )
    runs = [(name, np.append(run.z, run.z[:1]) if run.closed else run.z) for name, run in lines]
    lengths = [float(np.abs(np.diff(z)).sum()) for _, z in runs]
    if not lengths or not max(lengths) > 0:
        raise InputError(f"{text}: contains no line; draw a path, or leave --along out")
    name, z = runs[int(np.argmax(lengths))]
    if len(runs) > 1:
        drawing.notes.append(f"bent along the longest of {len(runs)} lines, {name}; choose another with #id")
    line = _Line.directed(z.conj() if drawing.flip else z)
    low, high = source.curve.box
    share = (baseline_of(source) - low.imag) / (high - low).imag
    if abs(share) < LEAST_SIDE_SHARE or abs(share - 1) < LEAST_SIDE_SHARE:
        share = float(round(share))
    if width is not None and _is_text(source):
        line = line.middle(width * (high - low).real / (high - low).imag)
    wanted = width or line.path.length * (high - low).imag / (high - low).real
    fitting, note = wanted, ""
    if _edges(line, wanted, share) is None:
        fitting = _widest(line, wanted, share)
        if width is not None:
            raise InputError(
                f"--along {width:g}: a band of this width along {name} overlaps itself; use {fitting:.3g} or less"
            )
        note = f"{text}: a band in the source's proportions would overlap itself, so it is {fitting:.3g} wide"
    edges = _edges(line, fitting, share)
    if edges is None:
        raise InputError(f"{text}: {name} crosses or touches itself; no band along it is free of overlaps")
    lower, upper = edges
    inside = LEAST_SIDE_SHARE <= share <= 1 - LEAST_SIDE_SHARE
    shape = of_drawing(_with_region(drawing, np.concatenate([lower, upper[::-1]])), text)
    outline = Curve.domain(np.concatenate([lower, upper[::-1]]), text)
    region = Drawing(polygon_of(outline.z))  # with the gap between the ends of a closed line
    shape = replace(shape, curve=outline, drawing=region, ink=region, holes=())
    box = bounding_box(np.array([*shape.box, *shape.curve.box]))
    if box != shape.box:
        note = note or f"{text}: the band reaches out of the canvas, which is extended to show all of it"
        shape = replace(shape, box=box)
    return LineBand(shape, lower, upper, line.beside(0) if inside else None, fitting, note)


@dataclass(frozen=True, eq=False)
class _Line:
    """A line in the direction in which a source is read along it, which runs on its left.

    Attributes:
        z: (n,) complex vertices; a closed line does not repeat the first one.
        seam: where a closed line is cut open: a point on it and the direction in which it is cut; None if it is open.
    """

    z: Complex
    seam: tuple[complex, complex] | None = None

    @classmethod
    def directed(cls, z: Complex) -> _Line:
        """Return a line through points: open ones run to the right, closed ones clockwise from below
        their middle."""
        length = float(np.abs(np.diff(z)).sum())
        if abs(z[-1] - z[0]) > SEAM_LENGTH_SHARE * length:
            return cls(z if (z[-1] - z[0]).real >= 0 else z[::-1])
        ring = distinct(z[:-1] if z[-1] == z[0] else z)
        if polygon_of(ring).exterior.is_ccw:
            ring = ring[::-1]
        loop = shapely.LinearRing(xy_of(ring))
        left, lowest, right, highest = loop.bounds
        middle = (left + right) / 2
        meridian = shapely.intersection(loop, shapely.LineString([(middle, lowest), (middle, highest)]))
        start = shapely.line_locate_point(loop, nearest_points(meridian, shapely.Point(middle, lowest))[0])
        pieces = substring(loop, start, loop.length), substring(loop, 0, start)
        ring = distinct(complex_of(shapely.get_coordinates(np.array(pieces))[:-1]))
        before, after = ring[0] - ring[-1], ring[1] - ring[0]
        across = 1j * (before / abs(before) + after / abs(after))
        return cls(ring, (complex(ring[0]), across / abs(across)))

    @property
    def path(self) -> shapely.LineString:
        """The line as a polyline, which ends before a closed one begins again."""
        return (
            self._opened(shapely.LinearRing(xy_of(self.z)))
            if self.seam
            else shapely.LineString(xy_of(self.z))
        )

    def middle(self, length: float) -> _Line:
        """Return the middle part of the line, of a given length; the whole line if that is shorter."""
        path = self.path
        if length >= path.length:
            return self
        beyond = (path.length - length) / 2
        return _Line(complex_of(shapely.get_coordinates(substring(path, beyond, path.length - beyond))))

    def beside(self, distance: float) -> Complex | None:
        """Return the line at a distance to the left, or to the right if it is negative; None if it falls apart."""
        corners: dict[str, Any] = {"join_style": "mitre", "mitre_limit": MITRE_LIMIT}
        if distance == 0:
            edge = self.path
        elif self.seam is None:
            edge = shapely.offset_curve(self.path, distance, **corners)
        else:  # the left of a line that runs clockwise is outside of it
            region = shapely.buffer(shapely.Polygon(xy_of(self.z)), distance, **corners)
            edge = (
                self._opened(region.exterior) if region.geom_type == "Polygon" and region.area > 0 else region
            )
        is_whole = edge.geom_type == "LineString" and not edge.is_empty
        return complex_of(shapely.get_coordinates(edge)) if is_whole else None

    def _opened(self, ring: shapely.LinearRing) -> shapely.LineString:
        """Return a ring around the line's region, clockwise, cut open at the seam."""
        assert self.seam is not None
        place, across = self.seam
        reach = ring.length
        cut = shapely.LineString(xy_of(np.array([place - reach * across, place + reach * across])))
        crossings = shapely.intersection(ring, cut)
        if crossings.is_empty:  # a narrow region has shrunk away from the seam
            return shapely.LineString()
        start = shapely.line_locate_point(
            ring, nearest_points(crossings, shapely.Point(place.real, place.imag))[0]
        )
        z = complex_of(shapely.get_coordinates(substring(ring, start, ring.length)))
        z = np.append(z, complex_of(shapely.get_coordinates(substring(ring, 0, start))))
        loop = shapely.LineString(xy_of(z[::-1] if ring.is_ccw else z))
        gap = SEAM_LENGTH_SHARE * loop.length
        return substring(loop, gap / 2, loop.length - gap / 2)


def _edges(line: _Line, width: float, share: float) -> tuple[Complex, Complex] | None:
    """Return the edges of a band, of whose width a share lies below the line; None if the band overlaps itself."""
    lower, upper = (line.beside(distance) for distance in (-share * width, (1 - share) * width))
    if lower is None or upper is None:
        return None
    return (lower, upper) if polygon_of(np.concatenate([lower, upper[::-1]])).is_valid else None


def _widest(line: _Line, width: float, share: float) -> float:
    """Return the largest width, up to a given one, at which a band does not overlap itself."""
    low, high = 0.0, width
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if _edges(line, middle, share) is None else (middle, high)
    return low


def _with_region(drawing: DrawingContent, band: Complex) -> DrawingContent:
    """Return a drawing that consists of a band in the core plane."""
    z = band.conj() if drawing.flip else band
    return replace(drawing, outlines=[FilledOutline("the band", z, float(polygon_of(z).area))])
