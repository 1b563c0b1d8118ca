"""Maps composed of others: several parts as one map, mirrored maps, and maps cut at outlines or holes."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..arrays import Box, Complex
from ..plane import polygon_area
from . import preimages
from .canvas import BAND_ROWS, Band, Canvas, Diagnostics, Mixed
from .coverage import coverage


class Several:
    """Several maps as one, for pictures and STMaps; where parts overlap, the first one is visible.

    Args:
        maps: source → target, of any kind.
        boxes: the bounding box of each map's image.
    """

    def __init__(self, maps: Sequence[preimages.AnyMap], boxes: Sequence[Box]):
        self.maps, self.boxes = maps, boxes

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> preimages.Bands:
        """See `preimages.Mapping`."""
        sources = [preimages.of(map, canvas, tolerance, slopes) for map in self.maps]
        corners = canvas.pixels(np.array(self.boxes))
        rows = [(float(high.imag) - 1, float(low.imag) + 1) for low, high in corners]
        return partial(_band_of_several, sources, rows, canvas)


def _band_of_several(
    parts: Sequence[preimages.Bands], rows: Sequence[tuple[float, float]], canvas: Canvas, row: int
) -> Band:
    """Return the band that starts at a row.

    A pixel shows the first part that covers half of it, or else the one that covers most. The visible share of another
    part is mixed in, with earlier parts on top of later ones. Diagnostics count all parts, including hidden ones.

    Args:
        parts: preimages of each map.
        rows: first and last row that the image of each part may touch.
        canvas: the raster.
        row: the first row of the band.
    """
    shape = min(BAND_ROWS, canvas.height - row), canvas.width
    nothing = complex(np.nan, np.nan)
    z, right, down = (np.full(shape, nothing, kind) for kind in (np.complex128, np.complex64, np.complex64))
    out = Band(row, np.zeros(shape, np.float32), z, right, down, Diagnostics())
    most, free, mixed = np.zeros(shape, np.float32), np.ones(shape, bool), []
    for part, (first, last) in zip(parts, rows):
        if last < row or first >= row + shape[0]:
            continue
        band = part(row)
        in_front = (band.coverage > most) & (most < 0.5)
        shared = np.flatnonzero(free & (out.coverage > 0) & (out.coverage < 1) & (band.coverage > 0))
        if shared.size:
            mixed.append(_mixed(out, band, in_front, shared))
            free.ravel()[shared] = False
        most[in_front] = band.coverage[in_front]
        for into, values in ((out.z, band.z), (out.right, band.right), (out.down, band.down)):
            into[in_front] = values[in_front]
        np.minimum(out.coverage + band.coverage, 1, out=out.coverage)
        out.diagnostics.add(band.diagnostics)
    return replace(out, mixed=Mixed(*(np.concatenate(column) for column in zip(*mixed)))) if mixed else out


def _mixed(above: Band, below: Band, below_first: NDArray[np.bool_], pixels: NDArray[np.intp]) -> Mixed:
    """Return the second source points of pixels (k,), given by flat indices, that two parts cover.

    `below_first` marks the pixels whose first source point is in the lower part.
    """
    upper = above.coverage.ravel()[pixels]
    lower = np.minimum(below.coverage.ravel()[pixels], 1 - upper)
    swapped = below_first.ravel()[pixels]
    share = np.where(swapped, upper, lower) / (upper + lower)

    def second(upper_values: NDArray, lower_values: NDArray) -> NDArray:
        return np.where(swapped, upper_values.ravel()[pixels], lower_values.ravel()[pixels])

    return Mixed(
        pixels,
        share.astype(np.float32),
        second(above.z, below.z),
        second(above.right, below.right),
        second(above.down, below.down),
    )


class Reflected:
    """A map between reflected planes as a map between the original planes, for pictures and STMaps.

    Args:
        map: source → target, of any kind.
        source, target: abscissa of the line about which each plane is reflected; None where it is not.
    """

    def __init__(self, map: preimages.AnyMap, source: float | None, target: float | None):
        self.map, self.source, self.target = map, source, target

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> preimages.Bands:
        """See `preimages.Mapping`."""
        reflected_canvas = replace(canvas, box=reflected(canvas.box, self.target))
        whole = preimages.of(self.map, reflected_canvas, tolerance, slopes)
        return partial(_reflected_band, whole, self.source, self.target is not None)


def reflected(box: Box, line: float | None) -> Box:
    """Return the mirror image of a box about a vertical line; the box itself without a line."""
    low, high = box
    if line is None:
        return box
    return complex(2 * line - high.real, low.imag), complex(2 * line - low.real, high.imag)


def _reflected_band(whole: preimages.Bands, line: float | None, mirrored: bool, row: int) -> Band:
    """Return the band that starts at a row; reflect the source about `line` if given, and the canvas if `mirrored`."""
    band = whole(row)
    z, right, down, covered = band.z, band.right, band.down, band.coverage
    if mirrored:
        z, right, down, covered = z[:, ::-1], -right[:, ::-1], down[:, ::-1], covered[:, ::-1]
    if line is not None:
        z, right, down = 2 * line - z.conj(), -right.conj(), -down.conj()
    z, right, down, covered = map(np.ascontiguousarray, (z, right, down, covered))
    return replace(band, z=z, right=right, down=down, coverage=covered)


class PaintedMap:
    """A map restricted to the area that a drawing paints, for pictures and STMaps.

    Args:
        map: source → target, of any kind.
        rings: boundaries of the painted area in the target's plane, closed polylines: those of parts
            counter-clockwise, those of holes clockwise.
    """

    def __init__(self, map: preimages.AnyMap, rings: Sequence[Complex]):
        self.map, self.rings = map, rings

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> preimages.Bands:
        """See `preimages.Mapping`."""
        whole = preimages.of(self.map, canvas, tolerance, slopes)
        loops = [(canvas.pixels(ring), polygon_area(ring) > 0) for ring in self.rings]
        return partial(_cut_band, whole, loops)


def _cut_band(whole: preimages.Bands, loops: Sequence[tuple[Complex, bool]], row: int) -> Band:
    """Return the band that starts at a row, with coverage limited by loops in pixel units.

    Parts do not overlap and holes lie in parts, so the painted share of a pixel is the sum over parts minus that over
    holes. Coverage is the minimum of this and the map's own, not the product: where both outlines coincide, an edge
    pixel half covered by both stays half covered.
    """
    band = whole(row)
    painted, centres = _painted(loops, row, *band.coverage.shape)
    hidden = int((~centres & (band.coverage > 0)).sum())
    band.diagnostics.inside = max(0, band.diagnostics.inside - hidden)
    np.minimum(band.coverage, painted, out=band.coverage)
    band.z[band.coverage == 0] = complex(np.nan, np.nan)
    return band


def _painted(
    loops: Sequence[tuple[Complex, bool]], row: int, rows: int, width: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the share of each pixel (rows, width) that loops paint, and whether they paint its centre.

    Loops are in pixel units, and marked as parts or holes.
    """
    painted, centres = np.zeros((rows, width), np.float32), np.zeros((rows, width), bool)
    for loop, is_part in loops:
        if not (loop.imag.max() > row and loop.imag.min() < row + rows):
            continue
        covered, inside = coverage(loop, row, rows, width)
        painted += covered if is_part else -covered
        centres ^= inside
    return np.clip(painted, 0, 1), centres


class Faded:
    """A map that is translucent outside the area that a drawing paints, for pictures and STMaps.

    Args:
        map: source → target, of any kind.
        rings: boundaries of the painted area, as for `PaintedMap`.
        opacity: of what lies outside, from 0 to 1.
    """

    def __init__(self, map: preimages.AnyMap, rings: Sequence[Complex], opacity: float):
        self.map, self.rings, self.opacity = map, rings, opacity

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> preimages.Bands:
        """See `preimages.Mapping`."""
        whole = preimages.of(self.map, canvas, tolerance, slopes)
        loops = [(canvas.pixels(ring), polygon_area(ring) > 0) for ring in self.rings]
        return partial(_faded_band, whole, loops, self.opacity)


def _faded_band(
    whole: preimages.Bands, loops: Sequence[tuple[Complex, bool]], opacity: float, row: int
) -> Band:
    """Return the band that starts at a row, with less coverage outside loops in pixel units."""
    band = whole(row)
    painted, _ = _painted(loops, row, *band.coverage.shape)
    np.multiply(band.coverage, opacity + (1 - opacity) * painted, out=band.coverage)
    return band


class Holed:
    """A map without what it maps into holes of the target, for pictures and STMaps.

    Args:
        map: source → target, of any kind.
        holes: closed polylines in the target's plane.
    """

    def __init__(self, map: preimages.AnyMap, holes: Sequence[Complex]):
        self.map, self.holes = map, holes

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> preimages.Bands:
        """See `preimages.Mapping`."""
        whole = preimages.of(self.map, canvas, tolerance, slopes)
        return partial(_holed_band, whole, [canvas.pixels(hole) for hole in self.holes])


def _holed_band(whole: preimages.Bands, loops: Sequence[Complex], row: int) -> Band:
    """Return the band that starts at a row, without the pixels in holes, which are given in pixel units."""
    band = whole(row)
    rows, width = band.coverage.shape
    for loop in loops:
        if not (loop.imag.max() > row and loop.imag.min() < row + rows):
            continue
        covered, inside = coverage(loop, row, rows, width)
        band.diagnostics.inside -= int((inside & (band.coverage > 0)).sum())
        np.maximum(band.coverage - covered, 0, out=band.coverage)
    band.z[band.coverage == 0] = complex(np.nan, np.nan)
    return band
