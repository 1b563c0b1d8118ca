"""A shape to be mapped, and the SVG elements that it becomes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ...arrays import Complex
from ...errors import InputError
from .. import limits
from ..svg import basic_shapes, css
from ..svg.affine import Affine
from ..svg.batches import batches
from ..svg.curves import Bezier
from ..svg.drawing_content import Rectangle
from ..svg.path_data import PenPath
from ..svg.tree import Node
from .clip import Clipped

SVG = "{http://www.w3.org/2000/svg}"
BEYOND_CANVAS = 10**7  # beyond any canvas
RUNS_AT_ONCE = 100  # subpaths that are formatted at a time: their numbers are Python objects meanwhile
# Properties that apply to an element as a whole, with the values that have no effect.
_WHOLE = {"opacity": "1", "filter": "none", "mask": "none", "clip-path": "none", "mix-blend-mode": "normal"}
_ENDS = {"marker-start": "none", "marker-end": "none"}
_CURVE, _LINE = "C%.15g %.15g %.15g %.15g %.15g %.15g", "L%.15g %.15g"
_UNSEEN = {"fill-opacity": "0", "stroke-opacity": "0"}

# A subpath as (k, 4) control points for each of its segments, and whether it is closed.
Cubics = tuple[list[Complex], bool]


@dataclass(eq=False)
class MappedElement:
    """A shape in the root's user units, y down.

    Attributes:
        out, parent: the element that it becomes, and the parent of that.
        runs: its subpaths; each has at least one segment.
        declared: the element's own styles, without inherited ones.
        filled, lined: whether its fill and its line are painted; markers need a line even where that is not painted.
        aside: whether it belongs to a clip path or mask; where it surrounds the source, it is then extended.
        markers: the marker properties that it has.
        line_first: whether the line is painted below the fill.
        copy: number of the only map that transfers it; None for the maps of the regions that it lies in.
    """

    out: Element
    parent: Element
    runs: list[PenPath]
    declared: Mapping[str, str] = field(default_factory=dict)
    filled: bool = True
    lined: bool = False
    aside: bool = False
    markers: frozenset[str] = frozenset()
    line_first: bool = False
    copy: int | None = None

    @cached_property
    def points(self) -> Complex:
        """Ends of straight segments and points along the others; they determine its box to about a thousandth."""
        pieces = [piece for run in self.runs for piece in run.pieces]
        straight = [(run.start, *(piece.last() for piece in run.pieces)) for run in self.runs]
        curved = [piece.at(np.linspace(0, 1, 33)) for piece in pieces if piece.bend()]
        return np.concatenate([np.concatenate(straight), *curved])

    def write(
        self,
        clipped: Clipped,
        fill: list[Cubics],
        line: list[Cubics],
        digits: int,
        *,
        line_is_filled: bool = True,
        curves: bool = False,
    ) -> None:
        """Write the mapped shape as a path, or as a group where fill, line and markers need separate paths.

        Args:
            clipped: the part of the shape that is inside.
            fill: closed subpaths of the fill, if different from the line; those around the whole source come last.
            line: subpaths of the line, or of both.
            digits: digits after the decimal point.
            line_is_filled: whether fill and line have the same subpaths. They differ if the fill is clipped, closes an
                open subpath, or encloses nothing.
            curves: whether straight segments are written as curves, so that all frames have the same commands.
        """
        paths: list[tuple[str, dict[str, str]]] = []
        if line:
            style = {} if line_is_filled else {"fill": "none"}
            has_marker = {"marker-start": clipped.begins, "marker-mid": False, "marker-end": clipped.ends}
            style |= {name: "none" for name in sorted(self.markers) if not has_marker[name]}
            paths.append((_data(line, digits, curves), style))
            if "marker-mid" in self.markers:  # at the shape's own vertices, not at those added by refitting
                bare = [([_outer(run)], closed) for run, closed in line]
                groups = [[run] for run in bare] if clipped.cut else [bare]
                paths += [(_data(group, digits, curves), _UNSEEN | _ENDS) for group in groups]
        if fill:
            around = [windings for windings in clipped.windings if windings] if self.aside else []
            data = _data(fill[: len(fill) - len(around)], digits, curves) + "".join(map(_square, around))
            unlined = {"stroke": "none"} | dict.fromkeys(sorted(self.markers), "none") if self.lined else {}
            first = 1 if self.line_first and line else 0  # a path with only markers stays last
            paths.insert(first, (data, unlined))
        if len(paths) == 1:
            self.out.set("d", paths[0][0])
            restyle(self.out, paths[0][1])
            return
        kept_style = css.declarations(self.out.get("style", ""))
        group_style = {k: v for k, v in (dict(self.declared) | kept_style).items() if k in _WHOLE}
        for data, style in paths:
            part = SubElement(self.out, self.out.tag, {k: v for k, v in self.out.attrib.items() if k != "id"})
            part.set("d", data)
            restyle(part, {k: _WHOLE[k] for k in group_style} | style)
        self.out.tag = f"{SVG}g"
        self.out.attrib = {k: v for k, v in self.out.attrib.items() if k == "id" or k.startswith("{")}
        restyle(self.out, group_style)


def pen_paths_of(node: Node) -> list[PenPath]:
    """Return the subpaths of a shape in the root's user units, y down; closed ones end where they start.

    Raises:
        InputError: a malformed attribute, or coordinates that are too large.
    """
    out = []
    for run in basic_shapes.pen_paths(node):
        pieces = list(run.pieces)
        if run.closed and pieces and pieces[-1].last() != run.start:
            pieces.append(Bezier((pieces[-1].last(), run.start)))
        if pieces:
            pieces = [piece.under(node.affine) for piece in pieces]
            out.append(PenPath(node.affine(run.start), pieces, run.closed))
    groups = batches([piece for run in out for piece in run.pieces], Affine())
    rough = np.concatenate([[run.start for run in out], *(batch.rough()[0] for batch in groups)])
    if not (np.abs(rough) <= limits.SVG_NUMBER).all():  # NaN included
        raise InputError("the coordinates are too large")
    return out


def box_of(shapes: Sequence[MappedElement], affine: Affine) -> Rectangle | None:
    """Return the bounding box of shapes in the user space that `affine` maps to the root's; None if it has no area."""
    points = [shape.points for shape in shapes]
    if not points or not affine.determinant:
        return None
    z = affine.inverse(np.concatenate(points))
    x, y, width, height = z.real.min(), z.imag.min(), np.ptp(z.real), np.ptp(z.imag)
    return float(x), float(y), float(width), float(height)


def length_of(runs: Sequence[PenPath]) -> float:
    """Return the total length of subpaths, in the root's units, to about a thousandth."""
    z = [piece.at(np.linspace(0, 1, 33)) for run in runs for piece in run.pieces]
    return float(sum(np.abs(np.diff(points)).sum() for points in z))


def restyle(out: Element, style: dict[str, str]) -> None:
    """Add declarations to an element's own style, where they override attributes and style sheets."""
    for name in style:
        out.attrib.pop(name, None)
    styles = css.declarations(out.get("style", ""))
    styles.update(style)
    if styles:
        out.set("style", styles.text())


def _data(runs: Sequence[Cubics], digits: int, curves: bool) -> str:
    """Return the path data of subpaths.

    The numbers of many subpaths are rounded and formatted together, since a path can have millions of them; `%g` omits
    trailing zeros.
    """
    return "".join(
        _formatted(runs[k : k + RUNS_AT_ONCE], digits, curves) for k in range(0, len(runs), RUNS_AT_ONCE)
    )


def _formatted(runs: Sequence[Cubics], digits: int, curves: bool) -> str:
    """Return the path data of a few subpaths."""
    cubics = [np.concatenate(run) for run, _ in runs]
    straight = [_is_straight(run, 10.0**-digits) & (not curves) for run in cubics]
    for k, (_, closed) in enumerate(runs):
        if closed and straight[k][-1] and len(straight[k]) > 1:  # Z draws the last line
            cubics[k], straight[k] = cubics[k][:-1], straight[k][:-1]
    forms = [
        f"M%.15g %.15g{''.join([_CURVE, _LINE][line] for line in lines.tolist())}{'Z' if closed else ''}"
        for lines, (_, closed) in zip(straight, runs)
    ]
    points = [
        part
        for run, lines in zip(cubics, straight)
        for part in (run[0, :1], run[:, 1:][~lines[:, None] | np.array([False, False, True])])
    ]
    numbers = np.concatenate(points).view(np.float64)
    numbers = np.round(numbers, digits) + 0.0  # which makes -0 to 0
    return "".join(forms) % tuple(numbers.tolist())


def _is_straight(run: Complex, tolerance: float) -> np.ndarray:
    """Return which cubics (n, 4) are straight segments, with their control points at a third and two thirds."""
    start, end = run[:, :1], run[:, 3:]
    thirds = start + (end - start) * np.array([1 / 3, 2 / 3])
    return (np.abs(run[:, 1:3] - thirds) < tolerance).all(axis=1)


def _outer(run: list[Complex]) -> Complex:
    """Return one cubic for each original segment, with its ends and its directions there."""
    return np.array([[fitted[0, 0], fitted[0, 1], fitted[-1, 2], fitted[-1, 3]] for fitted in run])


def _square(windings: int) -> str:
    """Return path data of a square beyond any canvas, run `windings` times, clockwise on the screen if negative."""
    return (
        f"M-{BEYOND_CANVAS} -{BEYOND_CANVAS}{'V{0}H{0}V-{0}Z' if windings > 0 else 'H{0}V{0}H-{0}Z'}".format(
            BEYOND_CANVAS
        )
        * abs(windings)
    )
