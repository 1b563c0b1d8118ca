"""Points of the Georeferencer of QGIS (`.points`): y points up, and is negative in pictures, since it starts at their
upper edge; the target's points may be places on a map.
"""

from __future__ import annotations

from ....errors import InputError
from ...point_syntax import coordinate
from .landmarks_file import LandmarksFile, decoded, digits, is_off, rows_of
from .pairs import LandmarkPairs

HEADING = "mapX,mapY,sourceX,sourceY,enable,dX,dY,residual"
SOURCE_COLUMNS = (("sourceX", "sourceY"), ("pixelX", "pixelY"))  # of newer and of older versions


class Qgis(LandmarksFile):
    """A table with a heading, whose order of columns differs between versions."""

    axes = ("upward", "map")

    def parse(self, content: bytes) -> LandmarkPairs:
        """Return the pairs that are enabled."""
        rows = rows_of(decoded(content))
        heading = rows[0][1] if rows else []
        source_columns = next((names for names in SOURCE_COLUMNS if {*names} <= {*heading}), None)
        if source_columns is None or not {"mapX", "mapY"} <= {*heading}:
            raise InputError("has no columns mapX, mapY, sourceX and sourceY (QGIS)")
        pairs = LandmarkPairs(self.axes)
        for line, row in rows[1:]:
            cells = dict(zip(heading, row))
            if not is_off(cells.get("enable", "1")):
                x, y, u, v = (
                    coordinate(cells.get(name, ""), f"line {line}")
                    for name in (*source_columns, "mapX", "mapY")
                )
                pairs.append("", (x, y), (u, v))
        return pairs

    def text(self, pairs: LandmarkPairs) -> str:
        """Return the table, with all pairs enabled and without residuals."""
        rows = [
            ",".join(map(digits, (*target, *source, 1, 0, 0, 0)))
            for source, target in zip(pairs.source, pairs.target)
        ]
        return "\n".join([HEADING, *rows]) + "\n"
