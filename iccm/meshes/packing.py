"""Pack charts into a square or any other region of the plane, without overlap, at one scale, with a margin.

The packer of the library xatlas only packs into rectangles; this one can also fill the outline of a drawing.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from ..arrays import Complex, Index, Real, complex_of, xy_of
from ..errors import InputError
from ..native import function

_pack = function("""int64_t iccm_meshes_pack(
    const double *corners, const int64_t *starts, int64_t k, int64_t orientations, int64_t *taken, int64_t width,
    int64_t height, int64_t margin, const bool *alike, double *places)""")

GRID_CELLS_ACROSS = 1024  # cells along the longer side of the region: the texels of a usual texture
COARSE_GRID_CELLS_ACROSS = 256
"""Grid on which the scale is searched first, in a sixteenth of the time."""
FIRST_FILLED_SHARE = 0.8  # relative to the region's area: good packers fill 0.6 to 0.8
# Factors between successive scales, on the coarse and on the fine grid.
COARSE_STEP_RATIO, FINE_STEP_RATIO = 1.06, 1.02
LEAST_SCALE_SHARE = 0.02
"""Relative to the scale at which charts would fill the region: with less, there is no room for them."""
WORD_BITS = 64
ROTATIONS_TRIED = 90
"""Of a chart, a degree apart: the side of the smallest square changes by less than 2 % in between."""


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
        rotates: whether charts may be rotated: so that their smallest rectangle is upright, or for the longest chart
            also so that its smallest square is, and then by multiples of 90°.

    Returns:
        Their positions.

    Raises:
        InputError: there is no room for so many charts, however small.
    """
    upright = [_upright(flat) if rotates else 1 + 0j for flat, _ in charts]
    rotations = [upright]
    if rotates:
        longest = max(range(len(charts)), key=lambda k: _size(charts[k][0] * upright[k]))
        diagonal = list(upright)
        diagonal[longest] = _into_smallest_square(charts[longest][0])
        rotations.append(diagonal)
    stacks = [_Stack(charts, turns, 4 if rotates else 1) for turns in rotations]
    low, high = complex(*region.bounds[:2]), complex(*region.bounds[2:])
    side = max((high - low).real, (high - low).imag)
    area = sum(float(_areas(flat[faces]).sum()) for flat, faces in charts)

    outside = dict[int, NDArray[np.int64]]()

    def places_at(scale: float, cells: int) -> tuple[Complex, Complex] | None:
        """Return factors and shifts of all charts at a scale; None if one does not fit, however they are rotated."""
        texels = max(1, round(margin * cells / GRID_CELLS_ACROSS)) if margin else 0
        if cells not in outside:
            outside[cells] = _outside(region, low, high, side / cells, -(-texels // 2))
        for stack in stacks:
            placed = stack.placed(scale * cells / side, outside[cells].copy(), texels)
            if placed is not None:
                return scale * placed[0], low + side / cells * placed[1]
        return None

    most = np.sqrt(region.area / max(area, 1e-300))
    scale = most * np.sqrt(FIRST_FILLED_SHARE)
    while places_at(scale, COARSE_GRID_CELLS_ACROSS) is None:
        scale /= COARSE_STEP_RATIO
        if scale < LEAST_SCALE_SHARE * most:
            raise InputError(
                f"there is no room for {len(charts)} pieces in this outline; choose one with --parts largest"
            )
    scale *= COARSE_STEP_RATIO
    while (places := places_at(scale, GRID_CELLS_ACROSS)) is None:
        scale /= FINE_STEP_RATIO
    return Packing(*places, float(area * scale**2 / region.area))


class _Stack:
    """Rotated charts as the kernel takes them: concatenated, those that are the hardest to place first."""

    def __init__(
        self, charts: Sequence[tuple[Complex, Index]], rotations: Sequence[complex], orientations: int
    ) -> None:
        corners = [(flat * rotation)[faces] for (flat, faces), rotation in zip(charts, rotations)]
        self._order = sorted(range(len(charts)), key=lambda k: -_size(corners[k]))
        self._rotations = np.array(rotations)
        corners = [corners[k] for k in self._order]
        self._corners = xy_of(np.concatenate([chart.ravel() for chart in corners]))
        self._starts = np.cumsum([0, *(len(chart) for chart in corners)])
        self._orientations = orientations
        alike = [np.array_equal(a, b) for a, b in pairwise(corners)]
        self._alike = np.array([False, *alike])

    def placed(
        self, scale: float, occupied: NDArray[np.int64], margin: int
    ) -> tuple[Complex, Complex] | None:
        """Return the places of all charts at a scale; None if one does not fit.

        They are (k,) rotations and (k,) translations in cells.
        """
        height, words = occupied.shape
        count = self._starts.size - 1
        places = np.zeros((count, 3))
        packed = _pack(
            self._corners * scale,
            self._starts,
            count,
            self._orientations,
            occupied,
            words * WORD_BITS,
            height,
            margin,
            self._alike,
            places,
        )
        if packed != count:
            return None
        rotation, shift = np.empty((2, count), complex)
        rotation[self._order] = self._rotations[self._order] * 1j ** places[:, 0]
        shift[self._order] = complex_of(places[:, 1:])
        return rotation, shift


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
        shapely.prepare(inner)
        x, y = low.real + cell * (np.arange(width) + 0.5), low.imag + cell * (np.arange(height) + 0.5)
        blocked[:, :width] = ~shapely.contains_xy(inner, *np.meshgrid(x, y))
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


def _into_smallest_square(flat: Complex) -> complex:
    """Return the rotation with which a chart fits into the smallest upright square."""
    hull = complex_of(shapely.get_coordinates(shapely.MultiPoint(xy_of(flat)).convex_hull))
    rotations = np.exp(1j * np.linspace(0, np.pi / 2, ROTATIONS_TRIED, endpoint=False))
    rotated = np.outer(rotations, hull)
    sides = np.maximum(np.ptp(rotated.real, axis=1), np.ptp(rotated.imag, axis=1))
    return complex(rotations[np.argmin(sides)])


def _areas(corners: Complex) -> Real:
    a, b, c = corners.T
    return 0.5 * np.abs(((b - a).conj() * (c - a)).imag)


def _size(corners: Complex) -> float:
    """Return the area of a chart's box: large charts are the hardest to place."""
    if not corners.size:
        return 0.0
    return float(np.ptp(corners.real) * np.ptp(corners.imag))
