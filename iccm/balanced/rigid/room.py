"""Find room for rigid regions in a target."""

import numpy as np
import shapely

from ...arrays import Complex, complex_of, xy_of
from ...plane import bounding_box, longer_side

GRID_CELLS_ACROSS = 200  # along the target's longer side
CLEARANCE_FACTOR = 1.1  # size that has to fit, relative to a region's: its surroundings need room, too
SNUG_SIZE_SHARE = 0.97  # relative to the largest size that fits, if that is smaller than the region's
SMALLER_SIZE_RATIO = 0.9  # of two sizes that are tried, one after the other
DISTANCE_WEIGHT = 1.0
"""Of the squared distance from the desired position, relative to half the shape's extent, in what is compared with the
loss of size: to be off by half its width is as bad for a logo as a size of 0.37."""
SIZE_HALVINGS = 8  # bisections of the interval of sizes


def room_for(
    shape: Complex, domain: shapely.Polygon, desired: complex, *, is_smaller_nearer: bool = False
) -> tuple[float, complex]:
    """Find the largest scale, up to 1, with which a shape fits into a domain without rotation, and where.

    Args:
        shape: (n,) a polygon around 0.
        domain: the polygon.
        desired: desired position of 0.
        is_smaller_nearer: whether a smaller scale is preferred if the shape then lies nearer to the desired position,
            see `DISTANCE_WEIGHT`.

    Returns:
        The scale, and the position closest to `desired` at which the shape fits.
    """
    low, high = bounding_box(complex_of(shapely.get_coordinates(domain.exterior)))
    cell = longer_side(low, high) / GRID_CELLS_ACROSS
    x, y = (np.arange(int(size / cell) + 2) * cell for size in ((high - low).real, (high - low).imag))
    places = low + x[None, :] + 1j * y[:, None]
    shapely.prepare(domain)
    outside = np.ones((places.shape[0] + GRID_CELLS_ACROSS, places.shape[1] + GRID_CELLS_ACROSS))
    outside[: y.size, : x.size] = ~shapely.contains_xy(domain, places.real, places.imag)
    waves = np.fft.rfft2(outside)
    reach_of_shape = float(np.abs(shape).max())

    def where(size: float) -> Complex:
        """Return the positions at which it fits, the nearest first."""
        reach = int(np.ceil(size * reach_of_shape / cell)) + 1
        if 2 * reach + 1 > GRID_CELLS_ACROSS:  # the shape is larger than the domain
            return places[:0, 0]
        steps = cell * np.arange(-reach, reach + 1)
        grown = shapely.Polygon(xy_of(size * shape)).buffer(0.5 * cell)
        shapely.prepare(grown)
        mask = np.zeros(outside.shape)
        mask[: steps.size, : steps.size] = shapely.contains_xy(grown, -steps[None, :], -steps[:, None])
        covered = np.fft.irfft2(waves * np.fft.rfft2(mask), outside.shape)
        fitting = places[np.roll(covered, (-reach, -reach), (0, 1))[: y.size, : x.size] < 0.5]
        return fitting[np.argsort(np.abs(fitting - desired), kind="stable")]

    def cost(share: float, place: complex) -> float:
        return float(-np.log(share) + DISTANCE_WEIGHT * (abs(place - desired) / reach_of_shape) ** 2)

    candidates, least, most = where(CLEARANCE_FACTOR), 0.0, CLEARANCE_FACTOR
    for _ in range(0 if candidates.size else SIZE_HALVINGS):
        size = 0.5 * (least + most)
        fitting = where(size)
        least, most = (size, most) if fitting.size else (least, size)
        candidates = fitting if fitting.size else candidates
    snug = 1 / CLEARANCE_FACTOR if is_smaller_nearer else SNUG_SIZE_SHARE
    share = 1.0 if least == 0 else min(1.0, snug * least)
    if is_smaller_nearer and candidates.size:
        best = cost(share, candidates[0])
        smaller = share
        # below a cell, smaller shapes fit at the same places
        while -np.log(smaller) < best and smaller * reach_of_shape > cell:
            smaller *= SMALLER_SIZE_RATIO
            fitting = where(CLEARANCE_FACTOR * smaller)
            if fitting.size and (price := cost(smaller, fitting[0])) < best:
                best, share, candidates = price, smaller, fitting
    for _ in range(SIZE_HALVINGS):
        for place in candidates:  # it is inside at the points of the grid, but perhaps not between them
            if domain.contains(shapely.Polygon(xy_of(place + share * shape))):
                return share, complex(place)
        share *= SNUG_SIZE_SHARE
    return 0.0, desired
