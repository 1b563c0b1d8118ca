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
    room = _Room(shape, domain, desired)
    share, places = room.largest(1 / CLEARANCE_FACTOR if is_smaller_nearer else SNUG_SIZE_SHARE)
    if is_smaller_nearer and places.size:
        share, places = room.cheapest(share, places)
    for _ in range(SIZE_HALVINGS):
        for place in places:  # it is inside at the points of the grid, but perhaps not between them
            if domain.contains(shapely.Polygon(xy_of(place + share * shape))):
                return share, complex(place)
        share *= SNUG_SIZE_SHARE
    return 0.0, desired


class _Room:
    """A grid over a domain, on which all positions of a shape are tried at once.

    A shape fits at a position if it covers no point of the grid outside of the domain. The number of such points, for
    all positions, is the correlation of both masks, which the fast Fourier transform finds.
    """

    def __init__(self, shape: Complex, domain: shapely.Polygon, desired: complex) -> None:
        """Place the grid.

        Args:
            shape: (n,) a polygon around 0.
            domain: the polygon.
            desired: desired position of 0.
        """
        self._shape, self._desired = shape, desired
        self._reach = float(np.abs(shape).max())
        low, high = bounding_box(complex_of(shapely.get_coordinates(domain.exterior)))
        self._cell = longer_side(low, high) / GRID_CELLS_ACROSS
        x, y = (
            np.arange(int(size / self._cell) + 2) * self._cell
            for size in ((high - low).real, (high - low).imag)
        )
        self._grid = low + x[None, :] + 1j * y[:, None]
        shapely.prepare(domain)
        # beyond the grid all is outside, so that shapes that reach over its edge do not come in at the other one
        outside = np.ones((y.size + GRID_CELLS_ACROSS, x.size + GRID_CELLS_ACROSS))
        outside[: y.size, : x.size] = ~shapely.contains_xy(domain, self._grid.real, self._grid.imag)
        self._size, self._spectrum = outside.shape, np.fft.rfft2(outside)

    def places(self, size: float) -> Complex:
        """Return the positions of the grid at which the shape fits with this size, the nearest first."""
        reach = int(np.ceil(size * self._reach / self._cell)) + 1
        if 2 * reach + 1 > GRID_CELLS_ACROSS:  # the shape is larger than the domain
            return self._grid[:0, 0]
        steps = self._cell * np.arange(-reach, reach + 1)
        grown = shapely.Polygon(xy_of(size * self._shape)).buffer(0.5 * self._cell)
        shapely.prepare(grown)
        mask = np.zeros(self._size)
        mask[: steps.size, : steps.size] = shapely.contains_xy(grown, -steps[None, :], -steps[:, None])
        covered = np.fft.irfft2(self._spectrum * np.fft.rfft2(mask), self._size)
        rows, columns = self._grid.shape
        fitting = self._grid[np.roll(covered, (-reach, -reach), (0, 1))[:rows, :columns] < 0.5]
        return fitting[np.argsort(np.abs(fitting - self._desired), kind="stable")]

    def largest(self, snug_share: float) -> tuple[float, Complex]:
        """Return the largest size, up to 1, at which the shape fits, and where, the nearest place first.

        Args:
            snug_share: the size that is returned relative to the largest that fits, if the shape has to be smaller.
        """
        places = self.places(CLEARANCE_FACTOR)
        if places.size:
            return 1.0, places
        least, most = 0.0, CLEARANCE_FACTOR
        for _ in range(SIZE_HALVINGS):
            size = 0.5 * (least + most)
            fitting = self.places(size)
            if fitting.size:
                least, places = size, fitting
            else:
                most = size
        return (min(1.0, snug_share * least) if places.size else 1.0), places

    def cheapest(self, share: float, places: Complex) -> tuple[float, Complex]:
        """Return the size and the places with the least cost, from a size and its places on, see `DISTANCE_WEIGHT`."""
        best, smaller = self._cost(share, places[0]), share
        # below a cell, smaller shapes fit at the same places
        while -np.log(smaller) < best and smaller * self._reach > self._cell:
            smaller *= SMALLER_SIZE_RATIO
            fitting = self.places(CLEARANCE_FACTOR * smaller)
            if fitting.size and (price := self._cost(smaller, fitting[0])) < best:
                best, share, places = price, smaller, fitting
        return share, places

    def _cost(self, share: float, place: complex) -> float:
        return float(-np.log(share) + DISTANCE_WEIGHT * (abs(place - self._desired) / self._reach) ** 2)
