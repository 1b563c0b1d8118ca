"""Several maps as one: each maps a part of the source onto a part of the target."""

from collections.abc import Sequence

import numpy as np

from ..arrays import Box
from . import inverse_tiles, preimages
from .canvas import Band, Canvas, Diagnostics


class Several:
    """Maps in the place of one, for pictures and STMaps. Where parts lie over each other the first one is seen.

    Args:
        maps: source → target, of any kind.
        boxes: the bounding box of each one's image.
    """

    def __init__(self, maps: Sequence[preimages.AnyMap], boxes: Sequence[Box]):
        self.maps, self.boxes = maps, boxes

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> "SeveralPreimages":
        """As `preimages.Mapping` has it."""
        sources = [preimages.of(map, canvas, tolerance, slopes) for map in self.maps]
        corners = canvas.pixels(np.array(self.boxes))
        rows = [(float(high.imag) - 1, float(low.imag) + 1) for low, high in corners]
        return SeveralPreimages(sources, rows, canvas)


class SeveralPreimages:
    """Where the pixels of a canvas come from under several maps.

    Args:
        parts: the same for each map.
        rows: the first and the last row that each one's image may touch.
        canvas: the pixels.
    """

    def __init__(self, parts: Sequence[preimages.Bands], rows: Sequence[tuple[float, float]], canvas: Canvas):
        self.parts, self.rows, self.canvas = parts, rows, canvas

    def band(self, row: int) -> Band:
        """The band that starts at the given row.

        A pixel shows the first part that covers half of it, or else the one that covers most; parts that share an
        edge together cover all of the pixels there. Counts are of all parts, hidden ones included.
        """
        shape = min(inverse_tiles.TILE, self.canvas.height - row), self.canvas.width
        nothing = complex(np.nan, np.nan)
        z, right, down = (
            np.full(shape, nothing, kind) for kind in (np.complex128, np.complex64, np.complex64)
        )
        out = Band(row, np.zeros(shape, np.float32), z, right, down, Diagnostics())
        most = np.zeros(shape, np.float32)
        for part, (first, last) in zip(self.parts, self.rows):
            if last < row or first >= row + shape[0]:
                continue
            found = part.band(row)
            shown = (found.coverage > most) & (most < 0.5)
            most[shown] = found.coverage[shown]
            for into, values in ((out.z, found.z), (out.right, found.right), (out.down, found.down)):
                into[shown] = values[shown]
            np.minimum(out.coverage + found.coverage, 1, out=out.coverage)
            out.diagnostics.add(found.diagnostics)
        return out
