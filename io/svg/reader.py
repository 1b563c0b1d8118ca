"""Read SVG files as outlines and drawn constraints, in the root's user units (those of its viewBox), y down."""

import math
from collections import Counter
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import shapely
from tinycss2.color3 import parse_color

from ... import deadline
from ...arrays import Complex
from ...curve import polygon_of
from ...errors import InputError, naming
from ...plane import bounding_box, diagonal, distinct_each
from .. import limits
from . import tree
from .affine import Affine
from .basic_shapes import pen_paths
from .budget import Budget
from .clips import Clips
from .crossings import TooMuch
from .curves import thinned
from .data_uri import content_of
from .document import drawing_bytes, local
from .drawing_content import DrawingContent, Rectangle, WrappedPicture
from .fill import FilledOutline, Refused, outlines, outlines_of
from .painted import painted_areas
from .path_data import PenPath, Subpath, flatten, least
from .strokes import Fills, silhouette, width_of
from .tree import Node

PIN, STROKE, RIGID = "pin-", "stroke-", "rigid"
CANVAS, SILHOUETTE = "canvas", "silhouette"
FAINT_OPACITY = 0.25
"""Opacity below which paint is a shadow or a glow, and does not belong to the painted area. The lighter tone of
two-tone icons has 0.4, and does."""
# An unfilled subpath counts as closed if its ends are closer than its line is wide, or than this share of its size.
GAP_SIDE_SHARE = 0.01
# Subpaths with more points than this are simplified, within this share of the flatness.
MANY_VERTICES, THINNED_TOLERANCE_SHARE = 20_000, 0.1


def read(
    path: Path,
    selection: str | None = None,
    *,
    flatness: float = 1e-4,
    max_bytes: int = limits.SVG_BYTES,
    max_segments: int = limits.SEGMENTS,
) -> DrawingContent:
    """Read the outlines that an SVG shows, or those of one element or group.

    Only displayed content counts: `defs`, `display: none`, text and images do not, and clip paths and masks are
    applied. Each outline is one region painted by an element's fill; open subpaths of a filled shape are closed as in
    SVG, with a note. A fill without area does not count.

    Without `selection`, lines compete with fills: if strokes of the shapes without a fill together enclose a larger
    area than every fill, the outlines of that area are used as well. If nothing is filled, the outlines are those of
    everything that strokes paint.

    Args:
        path: the file.
        selection: id or Inkscape label of an element or group; or, if no element has this name, `silhouette` for the
            union of everything painted, or `canvas`. A selected shape without a fill gives its closed subpaths; an open
            one is refused unless its ends almost meet.
        flatness: tolerance of flattened curves relative to the diagonal of each subpath.
        max_bytes: largest size of the file.
        max_segments: limit on lines and curves.

    Raises:
        InputError: not SVG, malformed attributes, pins or strokes, or more work than is allowed (`budget`).
    """
    data = drawing_bytes(path, max_bytes)
    with naming(path):
        document = tree.parse(data)
        drawing = DrawingContent(
            [], document.canvas, flip=True, millimetres=document.millimetres, unit=document.unit
        )
        flattener = CurveFlattener(flatness, Budget(max_segments))
        if count := document.unread:
            rules = f"{count} style rule{'s' * (count > 1)}"
            drawing.notes.append(f"{rules} ignored: a malformed selector, or a pseudo-class such as :hover")
        _check_size(document.shapes, max_segments)
        flattener.flatten_ahead([node for node in document.shapes if _may_be_outline(node, selection)])
        page = document.canvas if selection is None else None
        on_page = _on_page(document.shapes, page, drawing, flattener)
        shown_nodes, without_area = _read_shapes(on_page, selection, drawing, flattener)
        for node in document.pictures:
            with naming(node.name):
                _picture(node, selection, drawing, flattener)
        if selection is None:
            drawing = _with_whole(drawing, document, shown_nodes, without_area, flattener)
        drawing = replace(drawing, coloured=_has_colours(shown_nodes, document))
        drawing.notes.extend(
            f"{count} text{'s' * (count > 1)} ignored, since {reason}; convert text to paths in your drawing program"
            for reason, count in Counter(document.unset_texts.values()).items()
        )
        drawing.notes.extend(
            f"{count} × {substitution}"
            for substitution, count in Counter(document.substituted_texts.values()).items()
        )
        drawing.notes.extend(
            f"{node.name}: drawn up to {node.faults[0]}" for node in document.shapes if node.faults
        )
        _special(drawing, document, shown_nodes, selection, flattener)
        if not drawing.outlines:
            drawing.refused.extend(without_area.values())
    drawing.outlines.sort(key=lambda o: -o.area)
    return drawing


def read_lines(
    path: Path,
    selection: str | None = None,
    *,
    flatness: float = 1e-4,
    max_segments: int = limits.SEGMENTS,
) -> tuple[DrawingContent, list[tuple[str, Subpath]]]:
    """Read the lines of an SVG, or of one element or group, along which drawings are bent.

    Args:
        path: the file.
        selection: id or Inkscape label of an element or group, whose lines need not be visible.
        flatness: tolerance of flattened curves relative to the diagonal of each subpath.
        max_segments: limit on lines and curves.

    Returns:
        The drawing without outlines, and each subpath with the name of its element. Without a selection, these are the
        subpaths of the visible shapes without a fill, or of all visible shapes if there are none.

    Raises:
        InputError: not SVG, an unknown name, or more work than is allowed.
    """
    with naming(path):
        document = tree.parse(drawing_bytes(path, limits.SVG_BYTES))
        drawing = DrawingContent(
            [], document.canvas, flip=True, millimetres=document.millimetres, unit=document.unit
        )
        flattener = CurveFlattener(flatness, Budget(max_segments))
        _check_size(document.shapes, max_segments)
        nodes = [node for node in document.shapes if not is_constraint(node)]
        drawing.ids.update(dict.fromkeys(name for node in nodes for name in (*node.groups, *node.names)))
        if selection is None:
            lines = [node for node in nodes if node.stroked and not node.filled]
            nodes = lines or [node for node in nodes if node.visible]
        else:
            nodes = [node for node in nodes if selection in (*node.groups, *node.names)]
        return drawing, [(node.name, run) for node in nodes for run in flattener.runs(node) if run.z.size > 1]


class CurveFlattener:
    """Flattens the curves of a drawing within a budget, and applies its clip paths.

    Args:
        flatness: tolerance relative to each subpath's diagonal.
        budget: limits of the drawing.
    """

    def __init__(self, flatness: float, budget: Budget):
        self.flatness, self.budget = flatness, budget
        self.clips = Clips(self.runs)
        self.fills = Fills()
        self._runs: dict[Node, list[Subpath]] = {}
        self._rings: dict[Node, list[Complex]] = {}

    def flatten_ahead(self, shapes: Sequence[Node]) -> None:
        """Flatten shapes together, which takes a fraction of the time of flattening thousands one by one.

        If any is malformed or exceeds a limit, all are left to `runs`, so that the error names the shape.
        """
        if len(shapes) < 2:
            return
        budget = deepcopy(self.budget)
        pens: dict[Affine, list[tuple[Node, list[PenPath]]]] = {}
        flattened: dict[Node, list[Subpath]] = {}
        rings: dict[Node, list[Complex]] = {}
        try:
            for node in shapes:
                deadline.check("reading it")
                _check_affine(node.affine)
                node_pens = pen_paths(node, budget, joined=True)
                pens.setdefault(node.affine, []).append((node, node_pens))
            for affine, group in pens.items():
                flattened_runs = flatten(
                    [pen for _, node_pens in group for pen in node_pens], affine, self.flatness, budget
                )
                flattened_runs = _bounded(flattened_runs, self.flatness)
                flattened_rings = distinct_each([run.z for run in flattened_runs])
                last = 0
                for node, node_pens in group:
                    first, last = last, last + len(node_pens)
                    flattened[node], rings[node] = flattened_runs[first:last], flattened_rings[first:last]
        except InputError:
            return
        self.budget = budget
        self._runs.update(flattened)
        self._rings.update(rings)

    def runs(self, node: Node) -> list[Subpath]:
        """Return the flattened subpaths of a shape, see `runs_of`; cached."""
        if node not in self._runs:
            self._runs[node] = runs_of(node, self.flatness, self.budget)
        return self._runs[node]

    def rings(self, node: Node) -> list[Complex]:
        """Return the distinct points of each subpath of a shape."""
        if node not in self._rings:
            return distinct_each([run.z for run in self.runs(node)])
        return self._rings[node]


def _on_page(
    shapes: list[Node], page: Rectangle | None, drawing: DrawingContent, flattener: CurveFlattener
) -> list[Node]:
    """Return the shapes of which something may be seen on the page, with a note on the others; all if none may be.

    Drawings often have leftovers beside the page, such as swatches, which no program shows that renders them.
    """
    if page is None:
        return shapes
    on_page = [node for node in shapes if is_constraint(node) or _meets(node, page, flattener)]
    if (left_out := len(shapes) - len(on_page)) == 0 or all(map(is_constraint, on_page)):
        return shapes
    drawing.notes.append(
        f"{left_out} shape{'s lie' if left_out > 1 else ' lies'} completely outside the page, and "
        f"{'are' if left_out > 1 else 'is'} left out; #ID selects one all the same"
    )
    return on_page


def _meets(node: Node, page: Rectangle, flattener: CurveFlattener) -> bool:
    """Return whether the box of a shape with its stroke meets a page; also if it has none, being malformed."""
    try:
        runs = flattener.runs(node)
        scale = abs(node.affine.alpha) + abs(node.affine.beta)
        width = scale * width_of(node)
    except InputError:
        return True
    if not runs:
        return True
    z = np.concatenate([run.z for run in runs])
    x, y, page_width, page_height = page
    across = z.real.max() + width >= x and z.real.min() - width <= x + page_width
    return bool(across and z.imag.max() + width >= y and z.imag.min() - width <= y + page_height)


def _read_shapes(
    shapes: list[Node], selection: str | None, drawing: DrawingContent, flattener: CurveFlattener
) -> tuple[list[Node], dict[Node, Refused]]:
    """Add constraints, rigid regions and the outlines of fills to the drawing.

    Returns:
        The shapes that are not constraints or regions, and those of them whose fill encloses no area, each with the
        reason.
    """
    shown_nodes, without_area = list[Node](), dict[Node, Refused]()
    for node in shapes:
        with naming(node.name):
            deadline.check("reading it")
            if _constraint(node, drawing, flattener) or _rigid(node, selection, drawing, flattener):
                continue
            shown_nodes.append(node)
            if refused := _candidate(node, selection, drawing, flattener):
                without_area[node] = refused
    return shown_nodes, without_area


def _with_whole(
    drawing: DrawingContent,
    document: tree.Document,
    shown_nodes: list[Node],
    without_area: dict[Node, Refused],
    flattener: CurveFlattener,
) -> DrawingContent:
    """Return a drawing of which nothing is selected with the outlines of its lines, and everything that it paints."""
    lines = [node for node in shown_nodes if node.stroked and (not node.filled or node in without_area)]
    _closed_lines(drawing, lines, flattener)
    pictures = [
        polygon_of(outline.z, *outline.holes)
        for outline in drawing.outlines
        if outline.name.startswith("<image>")
    ]
    paint = partial(_paint, drawing, shown_nodes, pictures, flattener)
    drawing = replace(drawing, paint=paint, has_lines=any(node.stroked for node in shown_nodes))
    if len(document.pictures) == 1 and not any(node.visible for node in shown_nodes):
        drawing = replace(drawing, wrapped=_wrapped(document.pictures[0]))
    return drawing


def _check_size(shapes: list[Node], max_segments: int) -> None:
    """Refuse a drawing that would exceed its limits before flattening it.

    Raises:
        InputError: the shapes have more segments than allowed.
    """
    budget, segments = Budget(max_segments), dict[str, int]()
    for node in shapes:
        text = node.properties.get({"path": "d"}.get(node.tag, "points"), "")
        if text not in segments:
            segments[text] = least(text)
        budget.runs.spend(text.count("M") + text.count("m"))
        budget.segments.spend(segments[text])


def _special(
    drawing: DrawingContent,
    document: tree.Document,
    shown_nodes: list[Node],
    selection: str | None,
    flattener: CurveFlattener,
) -> None:
    """Add outlines that do not belong to a single element: the drawing's silhouette, and its canvas."""
    if selection is not None and selection in document.tags and selection not in drawing.ids:
        drawing.ids[selection] = None
        element = f"<{document.tags[selection]}> {selection!r}"
        reason = f"{element} draws no outline; show it if it is hidden, convert text to paths"
        drawing.refused.append((0.0, InputError(reason)))
    elif selection == CANVAS and selection not in drawing.ids and drawing.rectangle:
        drawing.ids[selection] = None
        x, y, width, height = drawing.rectangle
        corners = complex(x, y) + np.array([0, width, width + 1j * height, 1j * height])
        drawing.outlines.append(FilledOutline("the canvas", corners, width * height))
    elif (selection == SILHOUETTE and selection not in drawing.ids) or not (
        selection or drawing.outlines or drawing.refused
    ):
        drawing.ids.update({SILHOUETTE: None} if selection else {})
        visible = [node for node in shown_nodes if node.visible]
        label = "the silhouette" if selection else "the silhouette of its strokes"
        drawing.notes.extend(_ignored_properties(visible))
        shapes = ((d, flattener.runs(d)) for d in visible)
        drawing.outlines.extend(silhouette(shapes, label, flattener.clips.cut))


def _ignored_properties(shapes: list[Node]) -> list[str]:
    """Return notes on properties that a silhouette ignores."""
    counts = Counter(name for node in shapes for name in _unsupported_clips(node))
    counts["dashes"] = sum(node.dashed for node in shapes)
    return [f"{name} of {count} shape{'s' * (count > 1)} ignored" for name, count in counts.items() if count]


def _unsupported_clips(node: Node) -> list[str]:
    """Return the kinds of a shape's clip paths and masks that are not supported."""
    return list(dict.fromkeys(clip.name for clip in node.clips if clip.properties is None))


def _may_be_outline(node: Node, selection: str | None) -> bool:
    """Return whether outlines are sought in a shape: in all that are filled, or in those of the chosen name."""
    if is_constraint(node):
        return False
    return node.filled if selection is None else selection in (*node.groups, *node.names)


def _candidate(
    node: Node, selection: str | None, drawing: DrawingContent, flattener: CurveFlattener
) -> Refused | None:
    """Add a shape's outlines to the drawing, or the reason why it has none.

    If its fill encloses no area, and it is not chosen, the reason is returned instead, since other shapes may have
    outlines.
    """
    names = (*node.groups, *node.names)
    drawing.ids.update(dict.fromkeys(names))
    if (selection is None and not node.filled) or (selection is not None and selection not in names):
        return None
    runs = flattener.runs(node)
    rings: list[Complex] = []
    notes = [f"{node.name}: its {name} is ignored" for name in _unsupported_clips(node)]
    notes += [
        f"{node.name}: simplified from {run.original_size} to {run.z.size} points, within "
        f"{THINNED_TOLERANCE_SHARE * flattener.flatness:g} of its size"
        for run in runs
        if run.original_size
    ]
    for run, ring in zip(runs, flattener.rings(node)):
        try:
            rings.append(_ring(run, ring, node, notes))
        except InputError as error:
            drawing.refused.append((float(np.ptp(run.z.real) * np.ptp(run.z.imag)), error))
    if runs and not rings:
        return None
    if node.faults and not rings:
        drawing.refused.append((0.0, InputError(f"{node.name}: {node.faults[0]}")))
        return None
    rule = node.properties.get("fill-rule", "nonzero").strip()
    try:
        fills = flattener.fills
        shape_outlines, refused = outlines(
            rings, rule, node.name, tuple(notes), paint=fills.painted, budget=fills.budget
        )
    except TooMuch as error:
        shape_outlines, refused = [], [_too_much(runs, node, error)]
    except InputError as error:
        reason = InputError(f"{node.name}: {node.faults[0]}") if node.faults else error
        if selection is None:
            return 0.0, reason
        shape_outlines, refused = [], [(0.0, reason)]
    try:
        shape_outlines = _clipped(shape_outlines, node, flattener)
    except TooMuch as error:
        shape_outlines, refused = [], [_too_much(runs, node, error)]
    number = len(drawing.outlines)
    drawing.outlines.extend(replace(outline, names=names, element=number) for outline in shape_outlines)
    drawing.refused.extend(refused)
    return None


def _has_colours(shown_nodes: list[Node], document: tree.Document) -> bool:
    """Return whether a drawing has separate colours to show, and is not just a shape.

    It has if it contains paint of more than one colour, a gradient or pattern, an embedded picture, or text. Ink of one
    colour, filled or stroked, is a shape.
    """
    if document.pictures or any(local(element) == "text" for element in document.top.iter()):
        return True
    paints = set[tuple[str, str, str]]()
    for node in shown_nodes:
        for kind, default, painted in (("fill", "black", node.filled), ("stroke", "none", node.stroked)):
            paint = node.properties.get(kind, default).strip()
            if painted and (paint.startswith("url(") or "gradient" in paint):
                return True
            if painted:
                opacity = node.properties.get(f"{kind}-opacity", "1").strip()
                paints.add(
                    (str(parse_color(paint) or paint), opacity, node.declared.get("opacity", "1").strip())
                )
    return len(paints) > 1


def _picture(node: Node, selection: str | None, drawing: DrawingContent, flattener: CurveFlattener) -> None:
    """Add the rectangle of an embedded picture to the outlines of the drawing."""
    names = (*node.groups, *node.names)
    drawing.ids.update(dict.fromkeys(names))
    if selection is not None and selection not in names:
        return
    sides = (
        node.length(name, axis) for name, axis in (("x", "x"), ("y", "y"), ("width", "x"), ("height", "y"))
    )
    x, y, width, height = sides
    corners = node.affine(complex(x, y) + np.array([0, width, width + 1j * height, 1j * height]))
    area = float(shapely.area(polygon_of(corners)))
    if area > 0:
        place = FilledOutline(node.name, corners, area)
        drawing.outlines.extend(
            replace(outline, names=names) for outline in _clipped([place], node, flattener)
        )


def _wrapped(node: Node) -> WrappedPicture | None:
    """Return an embedded picture as the only content of a drawing; None if it is clipped, or its address malformed."""
    address = next((node.element.get(link, "") for link in tree.LINKS if node.element.get(link)), "")
    content = content_of(address)
    if not content or node.clips:
        return None
    x, y = node.length("x", "x"), node.length("y", "y")
    place = x, y, node.length("width", "x"), node.length("height", "y")
    aspect = node.properties.get("preserveAspectRatio", "").strip() or "xMidYMid"
    return WrappedPicture(content, place, node.affine, aspect, node.name)


def _closed_lines(drawing: DrawingContent, lines: list[Node], flattener: CurveFlattener) -> None:
    """Add the outlines of areas enclosed by lines to those of fills, if one of them is larger than every fill."""
    largest = max((outline.area for outline in drawing.outlines), default=0.0)
    if not largest or not lines:
        return
    try:
        runs = [(node, flattener.runs(node)) for node in lines]
        points = [run.z for _, node_runs in runs for run in node_runs if run.z.size]
        low, high = bounding_box(np.concatenate(points)) if points else (0j, 0j)
        if (high - low).real * (high - low).imag <= largest:
            return
        line_outlines = silhouette(runs, "the silhouette of its strokes", flattener.clips.cut)
    except InputError as error:
        drawing.notes.append(f"lines ignored: {error}")
        return
    closed = [outline for outline in line_outlines if outline.holes]
    if max((outline.area for outline in closed), default=0.0) > largest:
        drawing.outlines.extend(closed)


def _paint(
    drawing: DrawingContent,
    shown_nodes: list[Node],
    pictures: list[shapely.Polygon],
    flattener: CurveFlattener,
) -> tuple[shapely.Geometry, shapely.Geometry]:
    """Return the ink and the painted area of a drawing, see `DrawingContent`."""
    try:
        clear = [_without_faint(node) for node in shown_nodes]
        visible = [node for node in clear if node.visible] or [node for node in shown_nodes if node.visible]
        shapes = [(node, flattener.runs(node)) for node in visible]
        return painted_areas(shapes, flattener.clips.cut, pictures, flattener.fills)
    except TooMuch as error:
        drawing.notes.append(f"its strokes are ignored: {error}")
        return replace(drawing, paint=None)._areas


def _without_faint(node: Node) -> Node:
    """Return the shape without a fill or stroke that is hardly visible, such as that of a shadow."""
    faint = [kind for kind in ("fill", "stroke") if node.alpha(kind) < FAINT_OPACITY]
    return replace(node, properties={**node.properties, **dict.fromkeys(faint, "none")}) if faint else node


def _too_much(runs: list[Subpath], node: Node, error: TooMuch) -> Refused:
    size = max(float(np.ptp(run.z.real) * np.ptp(run.z.imag)) for run in runs)
    return size, InputError(f"{node.name}: {error}")


def _clipped(
    outlines_of_shape: list[FilledOutline], node: Node, flattener: CurveFlattener
) -> list[FilledOutline]:
    """Return the parts of a shape's outlines that clip paths and masks show."""
    shown_parts: list[FilledOutline] = []
    for outline in outlines_of_shape if node.clips else ():
        region = polygon_of(outline.z, *outline.holes)
        remaining = flattener.clips.cut(node, region)
        shown_parts += (
            [outline] if remaining is region else outlines_of(remaining, outline.name, outline.notes)
        )
    return shown_parts if node.clips else outlines_of_shape


def _ring(run: Subpath, z: Complex, node: Node, notes: list[str]) -> Complex:
    """Return the distinct points z of a subpath as a ring.

    Raises:
        InputError: The subpath is open, and no fill closes it; or the width of its stroke is malformed.
    """
    reach = width_of(node) * math.sqrt(abs(node.affine.determinant))
    if run.closed or z.size < 3 or abs(run.z[-1] - run.z[0]) <= max(reach, GAP_SIDE_SHARE * diagonal(z)):
        return z
    ends = " and ".join(f"({p.real:g}, {p.imag:g})" for p in (run.z[0], run.z[-1]))
    if not node.filled:
        raise InputError(f"{node.name}: the outline is open, its ends are {ends}; close the path")
    notes.append(f"{node.name}: closed the open outline between {ends}, as SVG does to fill it")
    return z


def is_constraint(node: Node) -> bool:
    """Return whether a shape is a pin or stroke for the map by its name; what <use> draws again is not."""
    return not node.copied_from and any(name.startswith((PIN, STROKE)) for name in node.names)


def _constraint(node: Node, drawing: DrawingContent, flattener: CurveFlattener) -> bool:
    """Add a shape to the drawing if it is a pin or a stroke; return whether it is."""
    if not is_constraint(node):
        return False
    name = next(n for n in reversed(node.names) if n.startswith((PIN, STROKE)))
    constraints = drawing.pins if name.startswith(PIN) else drawing.strokes
    if name in constraints:
        raise InputError(f"a second {name!r}; give pins and strokes different names")
    if name.startswith(PIN):
        drawing.pins[name], drawing.pin_radii[name] = _circle(node)
        return True
    runs = flattener.runs(node)
    if len(runs) != 1:
        raise InputError(f"a stroke must be a single line, but this path has {len(runs)} parts")
    z = np.append(runs[0].z, runs[0].z[:1]) if runs[0].closed else runs[0].z
    if np.ptp(z.real) == np.ptp(z.imag) == 0:
        raise InputError("a stroke needs at least 2 distinct points")
    drawing.strokes[name] = z
    return True


def _rigid(node: Node, selection: str | None, drawing: DrawingContent, flattener: CurveFlattener) -> bool:
    """Add a shape's outlines as rigid regions if it is in one that is not chosen; return whether it is."""
    names = (*node.groups, *node.names)
    name = next((n for n in names if n.startswith(RIGID)), None)
    if name is None or selection in names:
        return False
    region = DrawingContent([], None, flip=True)
    _candidate(node, name, region, flattener)
    if not region.outlines:
        raise (
            region.refused[0][1]
            if region.refused
            else InputError("a rigid region must be a closed path; close it")
        )
    drawing.ids.update(region.ids)
    drawing.rigid.extend(outline.z for outline in region.outlines)
    return True


def _circle(node: Node) -> tuple[complex, float]:
    """Return the centre of a pin, and the radius of the circle with the same area."""
    if node.tag not in ("circle", "ellipse"):
        raise InputError("a pin must be a circle or an ellipse, whose centre counts; draw one")
    centre = node.affine(complex(node.length("cx", "x"), node.length("cy", "y")))
    sides = ("r", ""), ("r", "")
    if node.tag == "ellipse":
        sides = ("rx", "x"), ("ry", "y")
    first, second = (node.length(name, axis) for name, axis in sides)
    if node.tag == "ellipse":  # a missing radius equals the other
        first, second = (
            first if "rx" in node.properties else second,
            second if "ry" in node.properties else first,
        )
    return centre, math.sqrt(abs(first * second * node.affine.determinant))


def runs_of(node: Node, flatness: float, budget: Budget | None = None) -> list[Subpath]:
    """Return the subpaths of a shape in the root's user units, flattened to `flatness` times each one's diagonal.

    Subpaths with very many points are simplified.

    Raises:
        InputError: a malformed attribute, coordinates that are not finite, or the budget is exceeded.
    """
    _check_affine(node.affine)
    budget = budget or Budget()
    pens = pen_paths(node, budget, joined=True)
    return _bounded(flatten(pens, node.affine, flatness, budget), flatness)


def _check_affine(affine: Affine) -> None:
    """Refuse a map with numbers beyond the limit, or NaN."""
    if not all(abs(part) <= limits.SVG_NUMBER for part in (affine.alpha, affine.beta, affine.gamma)):
        raise InputError("its transforms contain numbers that are too large")


def _bounded(runs: list[Subpath], flatness: float) -> list[Subpath]:
    """Return subpaths with coordinates and numbers of vertices within limits.

    Raises:
        InputError: coordinates are too large.
    """
    if runs and not (np.abs(np.concatenate([run.z for run in runs])) <= limits.SVG_NUMBER).all():
        raise InputError("coordinates are too large")
    return [
        _fewer(run, THINNED_TOLERANCE_SHARE * flatness) if run.z.size > MANY_VERTICES else run for run in runs
    ]


def _fewer(run: Subpath, share: float) -> Subpath:
    size = diagonal(run.z)
    return Subpath(thinned(run.z, share * size, closed=run.closed), run.closed, run.z.size)
