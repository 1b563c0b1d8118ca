"""The inverse of a map, used as a map: for pictures and drawings from the target back to the source."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..arrays import Complex
from ..maps.triangulated.map import TriangulatedMap
from ..pixels.canvas import BAND_ROWS, Band, Canvas, Diagnostics
from ..pixels.coverage import coverage
from ..pixels.preimages import Bands


@dataclass(frozen=True, eq=False)
class InverseMap:
    """The inverse of a triangulated map.

    Attributes:
        map: source → target.
    """

    map: TriangulatedMap

    def __call__(self, w: Complex) -> Complex:
        """Return f⁻¹ at points of any shape, NaN outside its domain."""
        return self.map.inverse(w)

    def jet(self, w: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """Return f⁻¹ and its derivatives by w and w̄ at points of any shape."""
        return self.map.inverse_jet(w, threads)

    @property
    def rims(self) -> list[Complex]:
        """Vertices of its domain's boundaries, the outer one first."""
        return [self.map.image[loop] for loop in self.map.loops]

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of its domain's bounding box."""
        return self.map.image_diagonal

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> Bands:
        """See `preimages.Mapping`; source points are images of the map itself, exact whatever the tolerance."""
        loops = [canvas.pixels(rim) for rim in self.map.rims]
        return partial(_band, self.map, canvas, loops)


def _band(map: TriangulatedMap, canvas: Canvas, loops: list[Complex], row: int) -> Band:
    """Return the band that starts at a row; `loops` are the source's boundaries in pixels.

    Pixels that are only touched show the nearest boundary point.
    """
    rows = min(BAND_ROWS, canvas.height - row)
    area, inside = coverage(loops[0], row, rows, canvas.width)
    for loop in loops[1:]:
        hole, within = coverage(loop, row, rows, canvas.width)
        area, inside = np.maximum(area - hole, 0), inside & ~within
    z = np.full(area.shape, complex(np.nan, np.nan))
    right, down = (np.full(area.shape, complex(np.nan, np.nan), np.complex64) for _ in range(2))
    is_covered = area > 0
    dx, dy = canvas.step
    z[is_covered], by_z, by_conj = map.extended_jet(canvas.centres(row, rows)[is_covered])
    right[is_covered], down[is_covered] = (by_z + by_conj) * dx, -1j * (by_z - by_conj) * dy
    count = int((is_covered & inside).sum())
    return Band(row, area, z, right, down, Diagnostics(count, int(is_covered.sum()) - count))
