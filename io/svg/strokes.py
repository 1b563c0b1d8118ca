"""Regions that lines paint: strokes with their widths, and the silhouette of a whole drawing."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
import shapely
from shapely.affinity import affine_transform

from ...arrays import Complex, xy_of
from ...errors import InputError
from ...plane import distinct_each
from ...polygons import unite
from .. import limits
from . import crossings
from .affine import Affine
from .fill import FaceBudget, FilledOutline, outlines_of, painted, rings_of
from .path_data import Subpath
from .tree import Node

JOINS = {"round": "round", "bevel": "bevel"}  # others (arcs, miter-clip) are drawn as mitres
CAPS = {"round": "round", "square": "square"}
MITRE_LIMIT = 4.0  # SVG's default
ROUND_SEGMENTS = 32  # segments per quarter circle: accurate to 3e-4 of half the width
FIRST_LOOK_SUBPATHS, MORE_FACTOR = 2000, 4
"""Shapes' subpaths after which crossings are first checked, and the factor until the next check."""
LARGEST_FILLS = 16  # fills that are tested for covering others, which bounds the time

Seen = tuple[Node, list[Subpath]]


def width_of(node: Node) -> float:
    """Return the width of a shape's stroke in its own units; 0 where it has none.

    Raises:
        InputError: the width is malformed or negative.
    """
    if not node.stroked:
        return 0.0
    width = node.length("stroke-width", "r", 1.0)
    if not 0 <= width <= limits.SVG_NUMBER:
        raise InputError(f"stroke-width is {width:g}; it must not be negative")
    return width


def painted_by_stroke(node: Node, runs: Iterable[Subpath]) -> shapely.Geometry:
    """Return the area that a shape's stroke paints, given its subpaths in the root's units."""
    width = width_of(node)
    affine = node.affine
    if not width or not affine.determinant:
        return shapely.Polygon()
    to_own = affine.inverse
    style = {
        "quad_segs": ROUND_SEGMENTS,
        "cap_style": CAPS.get(node.properties.get("stroke-linecap", ""), "flat"),
        "join_style": JOINS.get(node.properties.get("stroke-linejoin", ""), "mitre"),
        "mitre_limit": MITRE_LIMIT,
    }
    runs = [run for run in runs if run.z.size > 1]
    for run in runs:
        crossings.check([to_own(np.append(run.z, run.z[:1]) if run.closed else run.z)], reach=width)
    lines = [_line(to_own(run.z), run.closed) for run in runs]
    areas = [shapely.buffer(line, width / 2, **style) for line in lines]
    return affine_transform(unite(areas), _matrix(affine))


def silhouette(
    shapes: Iterable[Seen],
    name: str,
    cut: Callable[[Node, shapely.Geometry], shapely.Geometry],
) -> list[FilledOutline]:
    """Return the outlines of the union of all fills and strokes, each restricted by `cut`, the largest first.

    Raises:
        InputError: a malformed width, or lines that cross too often.
    """
    fills, strokes = areas(shapes, cut)
    return outlines_of(unite([fills, *(area for _, area in strokes)]), name)


def areas(
    shapes: Iterable[Seen],
    cut: Callable[[Node, shapely.Geometry], shapely.Geometry],
    filled: "Fills | None" = None,
) -> tuple[shapely.Geometry, list[tuple[Node, shapely.Geometry]]]:
    """Compute the union of the fills of shapes, and for each stroke the area that fills do not cover.

    Args:
        shapes: shapes with their subpaths in the root's units; a list if all are flattened already.
        cut: restricts a shape's painted area to what its clip paths and masks show.
        filled: cache of fills computed before.

    Raises:
        InputError: a malformed width, or lines that cross too often.
    """
    filled = filled or Fills()
    checked = shapes if isinstance(shapes, list) else list(_bearable(shapes, filled))
    base, uncovered = _base(checked, filled)
    fills = [base]
    for node, runs in uncovered:
        fills += [cut(node, part) for part in filled.of(node, runs)]
    stroked = [(node, runs) for node, runs in checked if node.stroked]
    strokes = [
        (node, cut(node, painted_by_stroke(node, runs)))
        for node, runs in _uncovered(base, stroked, _boxes(stroked))
    ]
    # The boundaries of one region do not cross. Those of whole fills consist of lines that `_base` has checked.
    if strokes or any(node.clips for node, _ in uncovered):
        crossings.check(
            [ring for area in (*fills, *(area for _, area in strokes)) for ring in rings_of(area)]
        )
    return unite(fills), strokes


class Fills:
    """Cache of the areas that fills paint, by their rings."""

    def __init__(self) -> None:
        self._cache: dict[tuple[str, tuple[bytes, ...]], list[shapely.Polygon]] = {}
        self.budget = FaceBudget()

    def of(self, node: Node, runs: Sequence[Subpath]) -> list[shapely.Polygon]:
        """Return the polygons that the fill of one shape paints."""
        rings = [ring for ring in distinct_each([run.z for run in runs]) if ring.size > 2]
        return self.painted(rings, node.properties.get("fill-rule", "nonzero").strip())

    def painted(self, rings: Sequence[Complex], rule: str) -> list[shapely.Polygon]:
        """Return the polygons painted by filling rings by a rule, see `fill.painted`."""
        key = rule, tuple(ring.tobytes() for ring in rings)
        if key not in self._cache:
            self._cache[key] = painted(rings, rule, self.budget)
        return self._cache[key]


def _bearable(shapes: Iterable[Seen], filled: Fills) -> Iterator[Seen]:
    """Yield the shapes unchanged, checking their fills for crossings at growing intervals.

    A drawing with too many crossings is thus refused before all of it has been flattened.

    Raises:
        InputError: lines cross too often, and are not all covered.
    """
    previous: list[Seen] = []
    count, look = 0, FIRST_LOOK_SUBPATHS
    for node, runs in shapes:
        if count >= look:  # more shapes follow; the caller makes the final check
            _base(previous, filled)
            look = MORE_FACTOR * count
        previous.append((node, runs))
        count += len(runs) if node.filled else 0
        yield node, runs


def _base(candidates: Sequence[Seen], filled: Fills) -> tuple[shapely.Geometry, list[Seen]]:
    """Return the union of the LARGEST_FILLS largest fills, and the other filled shapes that it does not cover.

    Covered shapes do not affect the silhouette, however often their lines cross.

    Raises:
        InputError: lines of the other shapes cross too often.
    """
    shapes = [(node, runs) for node, runs in candidates if node.filled and runs]
    boxes = _boxes(shapes)
    order = np.argsort(-shapely.area(boxes), kind="stable").tolist()
    base, united = shapely.Polygon(), set[int]()
    for k in [k for k in order if not shapes[k][0].clips][:LARGEST_FILLS]:
        try:
            if not base.is_empty:  # one shape's own crossings are counted when it is painted
                crossings.check([*_closed([shapes[k]]), *rings_of(base)])
            base = unite([base, *filled.of(*shapes[k])])
        except crossings.TooMuch:
            continue
        united.add(k)
    remaining = [k for k in order if k not in united]
    uncovered = _uncovered(base, [shapes[k] for k in remaining], boxes[remaining])
    if uncovered:
        crossings.check([*_closed(uncovered), *rings_of(base)])
    return base, uncovered


def _uncovered(base: shapely.Geometry, shapes: Sequence[Seen], boxes: np.ndarray) -> list[Seen]:
    """Return the shapes whose bounding boxes an area does not cover."""
    shapely.prepare(base)
    hidden = shapely.covers(base, boxes)
    return [shape for shape, covered in zip(shapes, hidden) if not covered]


def _closed(shapes: Iterable[Seen]) -> list[Complex]:
    return [np.append(run.z, run.z[:1]) for _, runs in shapes for run in runs if run.z.size]


def _boxes(shapes: Sequence[Seen]) -> np.ndarray:
    """Return for each shape a box that contains everything that it paints; empty if it has no points."""
    boxes = np.full(len(shapes), shapely.Polygon(), dtype=object)
    sizes = np.array([sum(run.z.size for run in runs) for _, runs in shapes], dtype=np.intp)
    some = np.flatnonzero(sizes)
    if not some.size:
        return boxes
    z = np.concatenate([run.z for _, runs in shapes for run in runs])
    starts = (np.cumsum(sizes) - sizes)[some]
    reach = np.array([_reach(shapes[k][0]) for k in some.tolist()])
    low_x, low_y = (np.minimum.reduceat(axis, starts) - reach for axis in (z.real, z.imag))
    high_x, high_y = (np.maximum.reduceat(axis, starts) + reach for axis in (z.real, z.imag))
    boxes[some] = shapely.box(low_x, low_y, high_x, high_y)
    return boxes


def _reach(node: Node) -> float:
    """Return the largest distance from a shape's lines up to which its stroke may paint."""
    affine = node.affine
    return MITRE_LIMIT * width_of(node) / 2 * (abs(affine.alpha) + abs(affine.beta))


def _line(z: np.ndarray, closed: bool) -> shapely.Geometry:
    if np.abs(z - z[0]).max() == 0:
        return shapely.Point(z[0].real, z[0].imag)
    return shapely.LinearRing(xy_of(z)) if closed and z.size > 2 else shapely.LineString(xy_of(z))


def _matrix(affine: Affine) -> list[float]:
    """Return the six numbers of an affine map in shapely's order."""
    origin, right, up = affine(0j), affine(1 + 0j) - affine(0j), affine(1j) - affine(0j)
    return [right.real, up.real, right.imag, up.imag, origin.real, origin.imag]
