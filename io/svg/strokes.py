"""Regions that lines paint: strokes as wide as they are drawn, and the silhouette of a whole drawing."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
import shapely
from shapely.affinity import affine_transform

from ...arrays import Complex, xy_of
from ...errors import InputError
from ...plane import bounding_box, distinct
from ...polygons import unite
from .. import limits
from . import crossings
from .affine import Affine
from .fill import FilledOutline, outlines_of, painted, rings_of
from .path_data import Subpath
from .tree import Node

JOINS = {"round": "round", "bevel": "bevel"}  # others (arcs, miter-clip) are drawn as mitres
CAPS = {"round": "round", "square": "square"}
MITRE_LIMIT = 4.0  # SVG's default
ROUND = 32  # segments of a quarter circle: 3e-4 of half the width
FIRST_LOOK, MORE = 2000, 4
"""Runs after which crossings are looked for, and how many times more for the next look."""
LARGEST_FILLS = 16  # that others may be covered by (by hand)

Seen = tuple[Node, list[Subpath]]


def width_of(drawn: Node) -> float:
    """Return the width of a shape's stroke in its own units; 0 where it has none.

    Raises:
        InputError: a malformed or negative width.
    """
    if not drawn.stroked:
        return 0.0
    width = drawn.length("stroke-width", "r", 1.0)
    if not 0 <= width <= limits.SVG_NUMBER:
        raise InputError(f"stroke-width is {width:g}; it must not be negative")
    return width


def painted_by_stroke(drawn: Node, runs: Iterable[Subpath]) -> shapely.Geometry:
    """Return the area that a shape's stroke paints, from its runs in the root's units."""
    width = width_of(drawn)
    affine = drawn.affine
    if not width or not affine.determinant:
        return shapely.Polygon()
    own = affine.inverse
    style = {
        "quad_segs": ROUND,
        "cap_style": CAPS.get(drawn.properties.get("stroke-linecap", ""), "flat"),
        "join_style": JOINS.get(drawn.properties.get("stroke-linejoin", ""), "mitre"),
        "mitre_limit": MITRE_LIMIT,
    }
    runs = [run for run in runs if run.z.size > 1]
    for run in runs:
        crossings.check([own(np.append(run.z, run.z[:1]) if run.closed else run.z)], reach=width)
    lines = [_line(own(run.z), run.closed) for run in runs]
    areas = [shapely.buffer(line, width / 2, **style) for line in lines]
    return affine_transform(unite(areas), _matrix(affine))


def silhouette(
    shapes: Iterable[Seen],
    name: str,
    cut: Callable[[Node, shapely.Geometry], shapely.Geometry],
) -> list[FilledOutline]:
    """Return the outlines of the union of all that fills and strokes paint, each as `cut` leaves it, the largest first.

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
    """Compute what the fills of shapes paint together, and what each stroke paints that these do not cover.

    Args:
        shapes: with their runs in the root's units.
        cut: leaves of what a shape paints what its clip paths and masks show.
        filled: what is known of the fills already.

    Raises:
        InputError: a malformed width, or lines that cross too often.
    """
    filled = filled or Fills()
    seen = list(_bearable(shapes, filled))
    base, rest = _base(seen, filled)
    fills = [base]
    for drawn, runs in rest:
        fills += [cut(drawn, part) for part in filled.of(drawn, runs)]
    strokes = [
        (drawn, cut(drawn, painted_by_stroke(drawn, runs)))
        for drawn, runs in _uncovered(base, seen)
        if drawn.stroked
    ]
    crossings.check([ring for area in (*fills, *(area for _, area in strokes)) for ring in rings_of(area)])
    return unite(fills), strokes


class Fills:
    """What the fills of shapes paint, computed once for the same rings, wherever they are needed."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, tuple[bytes, ...]], list[shapely.Polygon]] = {}

    def of(self, drawn: Node, runs: Sequence[Subpath]) -> list[shapely.Polygon]:
        """Return what the fill of one shape paints."""
        rings = [ring for ring in (distinct(run.z) for run in runs) if ring.size > 2]
        return self.painted(rings, drawn.properties.get("fill-rule", "nonzero").strip())

    def painted(self, rings: Sequence[Complex], rule: str) -> list[shapely.Polygon]:
        """Return the polygons that filling rings by a rule paints, see `fill.painted`."""
        key = rule, tuple(ring.tobytes() for ring in rings)
        if key not in self._known:
            self._known[key] = painted(rings, rule)
        return self._known[key]


def _bearable(shapes: Iterable[Seen], filled: Fills) -> Iterator[Seen]:
    """Yield the shapes, looked at for crossings of what they fill unchanged, ever more of them at once, so that what is
    refused has not been read to its end.

    Raises:
        InputError: lines that cross too often, and are not all covered.
    """
    seen: list[Seen] = []
    count, look = 0, FIRST_LOOK
    for drawn, runs in shapes:
        if count >= look:  # there are more: the last look is that of the caller
            _base(seen, filled)
            look = MORE * count
        seen.append((drawn, runs))
        count += len(runs) if drawn.filled else 0
        yield drawn, runs


def _base(seen: Sequence[Seen], filled: Fills) -> tuple[shapely.Geometry, list[Seen]]:
    """Return what the LARGEST fills paint together, and the other shapes that fill and that it does not cover: those
    that it does have no part in the silhouette, however often their lines cross.

    Raises:
        InputError: lines of the others cross too often.
    """
    shapes = [(drawn, runs) for drawn, runs in seen if drawn.filled and runs]
    shapes.sort(key=lambda each: -_box(*each).area)
    base, taken = shapely.Polygon(), set[Node]()
    for each in [each for each in shapes if not each[0].clips][:LARGEST_FILLS]:
        try:
            crossings.check([*_closed([each]), *rings_of(base)])
            base = unite([base, *filled.of(*each)])
        except crossings.TooMuch:
            continue
        taken.add(each[0])
    rest = _uncovered(base, [each for each in shapes if each[0] not in taken])
    crossings.check([*_closed(rest), *rings_of(base)])
    return base, rest


def _uncovered(base: shapely.Geometry, shapes: Sequence[Seen]) -> list[Seen]:
    """Return the shapes whose boxes an area does not cover."""
    shapely.prepare(base)
    hidden = shapely.covers(base, np.array([_box(drawn, runs) for drawn, runs in shapes], dtype=object))
    return [each for each, covered in zip(shapes, hidden) if not covered]


def _closed(shapes: Iterable[Seen]) -> list[Complex]:
    return [np.append(run.z, run.z[:1]) for _, runs in shapes for run in runs if run.z.size]


def _box(drawn: Node, runs: Sequence[Subpath]) -> shapely.Polygon:
    """Return a box that holds all that a shape paints; empty if it has no points."""
    if not any(run.z.size for run in runs):
        return shapely.Polygon()
    low, high = bounding_box(np.concatenate([run.z for run in runs]))
    affine = drawn.affine
    reach = MITRE_LIMIT * width_of(drawn) / 2 * (abs(affine.alpha) + abs(affine.beta))
    return shapely.box(low.real - reach, low.imag - reach, high.real + reach, high.imag + reach)


def _line(z: np.ndarray, closed: bool) -> shapely.Geometry:
    if np.abs(z - z[0]).max() == 0:
        return shapely.Point(z[0].real, z[0].imag)
    return shapely.LinearRing(xy_of(z)) if closed and z.size > 2 else shapely.LineString(xy_of(z))


def _matrix(affine: Affine) -> list[float]:
    """Return the six numbers of an affine map as shapely takes them."""
    origin, right, up = affine(0j), affine(1 + 0j) - affine(0j), affine(1j) - affine(0j)
    return [right.real, up.real, right.imag, up.imag, origin.real, origin.imag]
