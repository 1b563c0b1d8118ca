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
        rotates: whether charts may be rotated: so that their smallest rectangle is upright, and then by
            multiples of 90°.

    Returns:
        Their positions.

    Raises:
        InputError: there is no room for so many charts, however small.
    """
    turned = [_upright(flat) if rotates else 1 + 0j for flat, _ in charts]
    corners = [(flat * turn)[faces] for (flat, faces), turn in zip(charts, turned)]
    low, high = complex(*region.bounds[:2]), complex(*region.bounds[2:])
    side = max((high - low).real, (high - low).imag)
    area = sum(float(_areas(corner).sum()) for corner in corners)
    order = sorted(range(len(charts)), key=lambda k: -_size(corners[k]))
    stacked = _Stack([corners[k] for k in order], 4 if rotates else 1)

    outside = dict[int, NDArray[np.int64]]()

    def at(scale: float, cells: int) -> Real | None:
        """Return positions of all charts at a scale, in units of the region's plane; None if one does not fit."""
        texels = max(1, round(margin * cells / GRID_CELLS_ACROSS)) if margin else 0
        if cells not in outside:
            outside[cells] = _outside(region, low, high, side / cells, -(-texels // 2))
        found = stacked.placed(scale * cells / side, outside[cells].copy(), texels)
        return None if found is None else found * (1, side / cells, side / cells)

    most = np.sqrt(region.area / max(area, 1e-300))
    scale = most * np.sqrt(FIRST_FILLED_SHARE)
    while at(scale, COARSE_GRID_CELLS_ACROSS) is None:
        scale /= COARSE_STEP_RATIO
        if scale < LEAST_SCALE_SHARE * most:
            raise InputError(
                f"there is no room for {len(charts)} pieces in this outline; choose one with --parts largest"
            )
    scale *= COARSE_STEP_RATIO
    while (places := at(scale, GRID_CELLS_ACROSS)) is None:
        scale /= FINE_STEP_RATIO
    factor, shift = np.zeros((2, len(charts)), complex)
    factor[order] = scale * np.array(turned)[order] * 1j ** places[:, 0]
    shift[order] = complex_of(places[:, 1:]) + low
    return Packing(factor, shift, float(area * scale**2 / region.area))


class _Stack:
    """Concatenated charts, as the kernel takes them."""

    def __init__(self, corners: Sequence[Complex], orientations: int) -> None:
        self._corners = xy_of(np.concatenate([each.ravel() for each in corners]))
        self._starts = np.cumsum([0, *(len(each) for each in corners)])
        self._orientations = orientations
        alike = [np.array_equal(a, b) for a, b in pairwise(corners)]
        self._alike = np.array([False, *alike])

    def placed(self, scale: float, taken: NDArray[np.int64], margin: int) -> Real | None:
        """Return the places of all charts at a scale; None if one does not fit.

        They are (k, 3) multiples of 90° and translations in cells.
        """
        height, words = taken.shape
        count = self._starts.size - 1
        places = np.zeros((count, 3))
        found = _pack(
            self._corners * scale,
            self._starts,
            count,
            self._orientations,
            taken,
            words * WORD_BITS,
            height,
            margin,
            self._alike,
            places,
        )
        return places if found == count else None


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


def _areas(corners: Complex) -> Real:
    a, b, c = corners.T
    return 0.5 * np.abs(((b - a).conj() * (c - a)).imag)


def _size(corners: Complex) -> float:
    """Return the sort key of charts: the sum of the sides of their boxes.

    Long charts are the hardest to place.
    """
    if not corners.size:
        return 0.0
    return float(np.ptp(corners.real) + np.ptp(corners.imag))
