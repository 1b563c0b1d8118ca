"""Pack charts into a square or any other region of the plane, without overlap, at one scale, with a margin.

The packer of the library xatlas only packs into rectangles; this one can also fill the outline of a drawing.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from ..arrays import Complex, Index, Real, complex_of, xy_of
from ..errors import InputError
from ..native import function
from .topology import Triangles

_pack = function("""int64_t iccm_meshes_pack(
    const double *outlines, const int64_t *starts, int64_t k, const int64_t *order, const double *rotations, int64_t r,
    int64_t line, int64_t *taken, int64_t width, int64_t height, int64_t margin, const bool *alike, double *places)""")

GRID_CELLS_ACROSS = 1024  # cells along the longer side of the region: the texels of a usual texture
COARSE_GRID_CELLS_ACROSS = 256
"""Grid on which arrangements are compared, in a sixteenth of the time."""
FIRST_FILLED_SHARE = 0.8  # relative to the region's area: good packers fill 0.6 to 0.8
COARSE_STEP_RATIO = 1.06
"""Factor between the scales at which the first arrangement is tried."""
BETTER_SCALE_RATIO = 1.005
"""An arrangement replaces the best one if it fits at a scale larger by this factor."""
FINEST_SCALE_RATIO = 1.005
"""The scale on the fine grid is as large as possible up to this factor."""
LEAST_SCALE_SHARE = 0.02
"""Relative to the scale at which charts would fill the region: with less, there is no room for them."""
WORD_BITS = 64
RECTANGLE_ROUNDING = 1e-9
"""Share of its area by which a rectangle may differ from its box."""
ROTATIONS_TRIED = 90
"""Of a chart, a degree apart: the side of the smallest square changes by less than 2 % in between."""
LINES = 1, 0, 2
"""Of a chart, which lies as low as possible: its centre of gravity, its bottom or its top. The centre is the best
rule most often, as it lays concave charts into each other."""
VARIANTS_TRIED = 60
"""Variants of the best arrangement. 40 fill 2 % more of a square than none, 160 fill 3 % more."""
MOST_CHARTS_PLACED = 5_000
"""On the coarse grid in all arrangements: each chart takes .05 to .1 ms."""
MOVED_CHARTS_MEAN = 3
"""Mean number of a chart that a variant moves in the order: the first, the largest, decide."""


class Packing(NamedTuple):
    """Positions of packed charts: each is multiplied by a complex number, and translated.

    Attributes:
        factor: (k,) the scale, which is the same for all, times the rotation of each.
        shift: (k,) the translation after that.
        filled: share of the region's area that charts cover.
    """

    factor: Complex
    shift: Complex
    filled: float

    def of(self, flat: Complex, chart: int) -> Complex:
        """Return points (n,) of a chart at their packed positions."""
        return flat * self.factor[chart] + self.shift[chart]


def pack(
    charts: Sequence[tuple[Complex, Index]],
    region: shapely.Geometry,
    *,
    margin: int,
    rotates: bool = True,
) -> Packing:
    """Pack charts into a region at the largest common scale that is found.

    Args:
        charts: for each, (n,) positions at a common scale, and (m, 3) triangles.
        region: a polygon, or several.
        margin: distance between charts, and half of it to the region's outline, in texels, of which there are
            `GRID_CELLS_ACROSS` along the region's longer side.
        rotates: whether charts may be rotated: so that their smallest rectangle is upright, or for the largest chart
            also so that its smallest square is, and then by multiples of 90°; in some of the arrangements that are
            tried, a chart is rotated by any angle.

    Returns:
        Their positions.

    Raises:
        InputError: there is no room for so many charts, however small.
    """
    charts_to_place = _Outlines(charts)
    low, high = complex(*region.bounds[:2]), complex(*region.bounds[2:])
    side = max((high - low).real, (high - low).imag)
    area = sum(charts_to_place.areas)
    outside = dict[int, NDArray[np.int64]]()

    def places_at(
        scale: float, arrangement: _Arrangement, cells: int = COARSE_GRID_CELLS_ACROSS
    ) -> tuple[Complex, Complex] | None:
        """Return factors and shifts of all charts at a scale; None if one does not fit."""
        texels = max(1, round(margin * cells / GRID_CELLS_ACROSS)) if margin else 0
        if cells not in outside:
            outside[cells] = _outside(region, low, high, side / cells, -(-texels // 2))
        placed = charts_to_place.placed(scale * cells / side, arrangement, outside[cells].copy(), texels)
        return placed and (scale * placed[0], low + side / cells * placed[1])

    first, *others = _arrangements(charts, charts_to_place, rotates)
    most = np.sqrt(region.area / max(area, 1e-300))
    scale = most * np.sqrt(FIRST_FILLED_SHARE)
    while places_at(scale, first) is None:
        scale /= COARSE_STEP_RATIO
        if scale < LEAST_SCALE_SHARE * most:
            raise InputError(
                f"there is no room for {len(charts)} pieces in this outline; choose one with --parts largest"
            )
    best = first
    variants = _Variants(charts_to_place.areas, rotates)
    for trial in range(min(len(others) + VARIANTS_TRIED, MOST_CHARTS_PLACED // len(charts))):
        arrangement = others[trial] if trial < len(others) else variants.of(best)
        while places_at(scale * BETTER_SCALE_RATIO, arrangement) is not None:
            best = arrangement
            scale *= BETTER_SCALE_RATIO
    places = None
    while places is None:
        places = places_at(scale, best, GRID_CELLS_ACROSS)
        scale = scale if places else scale / BETTER_SCALE_RATIO
    # coarse cells take up to 6 % more room than fine ones
    fits, fails = scale, scale * COARSE_STEP_RATIO
    while fails > fits * FINEST_SCALE_RATIO:
        middle = np.sqrt(fits * fails)
        better = places_at(middle, best, GRID_CELLS_ACROSS)
        places, fits, fails = (better, middle, fails) if better else (places, fits, middle)
    return Packing(*places, float(area * fits**2 / region.area))


class _Arrangement(NamedTuple):
    """How charts are placed.

    Attributes:
        order: (k,) numbers of charts: those first that are the hardest to place.
        rotations: (k, r) unit numbers by which each may be multiplied.
        line: of a chart, which lies as low as possible: its bottom (0), its centre of gravity (1) or its top (2).
    """

    order: Index
    rotations: Complex
    line: int


def _arrangements(
    charts: Sequence[tuple[Complex, Index]], outlines: "_Outlines", rotates: bool
) -> list[_Arrangement]:
    """Return arrangements: large charts first, by several sizes; see `pack` for rotations."""
    upright = np.array([_upright(flat) if rotates else 1 + 0j for flat, _ in charts])
    turned = [edges * rotation for edges, rotation in zip(outlines.edges, upright)]
    boxes = np.array([(np.ptp(z.real), np.ptp(z.imag)) if z.size else (0.0, 0.0) for z in turned])
    sizes = boxes.prod(axis=1), outlines.areas, boxes.max(axis=1), boxes.sum(axis=1)
    orders = [np.argsort(-size, kind="stable") for size in sizes]
    quarters = 1j ** np.arange(4) if rotates else np.ones(1)
    rotations = [np.outer(upright, quarters)]
    if rotates:
        diagonal = upright.copy()
        diagonal[orders[0][0]] = into_smallest_square(charts[orders[0][0]][0])
        rotations.insert(0, np.outer(diagonal, quarters))
    return [_Arrangement(order, turns, line) for line in LINES for order in orders for turns in rotations]


class _Variants:
    """Arrangements that differ from others by chance, which is the same for all meshes.

    Attributes:
        shares: (k,) areas of the charts; they add up to 1.
        rotates: whether charts may be rotated.
    """

    def __init__(self, areas: Real, rotates: bool) -> None:
        self.shares, self.rotates = areas / max(float(areas.sum()), 1e-300), rotates
        self._draw = np.random.default_rng(0)

    def of(self, arrangement: _Arrangement) -> _Arrangement:
        """Return an arrangement in which one chart comes earlier or later, or a large one is rotated."""
        draw, count = self._draw, len(arrangement.order)
        order, rotations, line = arrangement
        if self.rotates and (count == 1 or draw.random() < 0.4):
            chart = int(np.searchsorted(np.cumsum(self.shares), draw.random()).clip(0, count - 1))
            rotations = rotations.copy()
            rotations[chart] *= np.exp(1j * draw.uniform(0, np.pi / 2))
        else:
            at = min(int(draw.exponential(MOVED_CHARTS_MEAN)), count - 1)
            to = int(draw.integers(count))
            order = np.insert(np.delete(order, at), to, order[at])
        return _Arrangement(order, rotations, line)


class _Outlines:
    """The outlines of charts as the kernel takes them: concatenated.

    Attributes:
        edges: of each chart, (e, 2) ends of the edges that belong to one triangle.
        areas: (k,) areas of the charts.
    """

    def __init__(self, charts: Sequence[tuple[Complex, Index]]) -> None:
        self.edges = [_outline(flat, faces) for flat, faces in charts]
        self.areas = np.array([float(_areas(flat[faces]).sum()) for flat, faces in charts])
        self._ends = xy_of(np.concatenate([edges.ravel() for edges in self.edges]))
        self._starts = np.cumsum([0, *(len(edges) for edges in self.edges)])
        numbers = dict[bytes, int]()
        self._kinds = np.array([numbers.setdefault(edges.tobytes(), k) for k, edges in enumerate(self.edges)])

    def placed(
        self, scale: float, arrangement: _Arrangement, occupied: NDArray[np.int64], margin: int
    ) -> tuple[Complex, Complex] | None:
        """Return the places of all charts at a scale; None if one does not fit.

        They are (k,) rotations and (k,) translations in cells.
        """
        order, rotations, line = arrangement
        height, words = occupied.shape
        count = self._starts.size - 1
        before, after = order[:-1], order[1:]
        alike = (self._kinds[before] == self._kinds[after]) & (rotations[before] == rotations[after]).all(
            axis=1
        )
        places = np.zeros((count, 3))
        packed = _pack(
            self._ends * scale,
            self._starts,
            count,
            order,
            xy_of(rotations),
            rotations.shape[1],
            line,
            occupied,
            words * WORD_BITS,
            height,
            margin,
            np.concatenate([[False], alike]),
            places,
        )
        if packed != count:
            return None
        return rotations[np.arange(count), places[:, 0].astype(int)], complex_of(places[:, 1:])


def _outside(
    region: shapely.Geometry, low: complex, high: complex, cell: float, border: int
) -> NDArray[np.int64]:
    """Return (h, words) bits of the cells that charts must avoid.

    These are all but the cells that are inside a region, at least `border` cells from its outline.
    """
    width, height = (
        max(1, int(np.ceil(extent / cell - 1e-9))) for extent in ((high - low).real, (high - low).imag)
    )
    words = -(-width // WORD_BITS)
    blocked = np.ones((height, words * WORD_BITS), bool)
    inner = region.buffer(-(border + np.sqrt(0.5)) * cell, join_style="mitre")
    if not inner.is_empty:
        x, y = low.real + cell * (np.arange(width) + 0.5), low.imag + cell * (np.arange(height) + 0.5)
        left, bottom, right, top = inner.bounds
        columns, rows = np.flatnonzero((x > left) & (x < right)), np.flatnonzero((y > bottom) & (y < top))
        if inner.area < (1 - RECTANGLE_ROUNDING) * (right - left) * (top - bottom):
            shapely.prepare(inner)
            blocked[:, :width] = ~shapely.contains_xy(inner, *np.meshgrid(x, y))
        elif columns.size and rows.size:
            blocked[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] = False
    return np.packbits(blocked, axis=1, bitorder="little").view(np.int64)


def _upright(flat: Complex) -> complex:
    """Return the rotation that makes the sides of a chart's smallest rectangle horizontal and vertical."""
    box = shapely.oriented_envelope(shapely.MultiPoint(xy_of(flat)))
    if not isinstance(box, shapely.Polygon):
        return 1 + 0j
    z = complex_of(np.array(box.exterior.coords))
    sides = np.diff(z)
    longest = sides[int(np.argmax(np.abs(sides)))]
    return complex((longest / abs(longest)).conjugate()) if abs(longest) > 0 else 1 + 0j


def into_smallest_square(flat: Complex) -> complex:
    """Return the rotation with which a chart fits into its smallest upright square."""
    hull = complex_of(shapely.get_coordinates(shapely.MultiPoint(xy_of(flat)).convex_hull))
    rotations = np.exp(1j * np.linspace(0, np.pi / 2, ROTATIONS_TRIED, endpoint=False))
    rotated = np.outer(rotations, hull)
    sides = np.maximum(np.ptp(rotated.real, axis=1), np.ptp(rotated.imag, axis=1))
    return complex(rotations[np.argmin(sides)])


def _areas(corners: Complex) -> Real:
    a, b, c = corners.T
    return 0.5 * np.abs(((b - a).conj() * (c - a)).imag)


def _outline(flat: Complex, faces: Index) -> Complex:
    """Return (e, 2) ends of a chart's edges that belong to one triangle."""
    triangles = Triangles(faces, flat.size)
    ends = np.column_stack([triangles.tail, triangles.head])[triangles.twin < 0]
    return flat[ends]
