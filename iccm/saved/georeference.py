"""Where the coordinates of a file lie on a map of the earth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from .. import limits
from ..arrays import Box
from ..errors import InputError

Affine = tuple[float, float, float, float, float, float]
"""a, b, c, d, e, f of X = a x + b y + c and Y = d x + e y + f."""
IDENTITY: Affine = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)  # X = x, Y = y


@dataclass(frozen=True)
class Georeference:
    """Where the coordinates of a file lie on a map.

    Attributes:
        transform: from the file's coordinates to those of the map.
        crs: the map's coordinate reference system, as WKT or such as "EPSG:32627"; empty if it is not known.
    """

    transform: Affine = IDENTITY
    crs: str = ""

    def to_map(self, x: float, y: float) -> tuple[float, float]:
        """Return the place on the map of a point in the file's coordinates."""
        a, b, c, d, e, f = self.transform
        return a * x + b * y + c, d * x + e * y + f

    def from_map(self, x: float, y: float) -> tuple[float, float]:
        """Return the point in the file's coordinates of a place on the map."""
        a, b, c, d, e, f = self.transform
        x, y, across = x - c, y - f, a * e - b * d
        return (e * x - b * y) / across, (a * y - d * x) / across

    def of_pixels(self, box: Box, size: tuple[int, int], *, down: bool) -> Affine:
        """Return the transform from column and row of a picture, counted from its upper left corner, to the map.

        Args:
            box: lower left and upper right corner of the picture, y up.
            size: its width and height in pixels.
            down: whether y points down in the file's coordinates.
        """
        (low, high), (width, height) = box, size
        step_x, step_y = (high - low).real / width, (high - low).imag / height
        sign = -1.0 if down else 1.0
        a, b, c, d, e, f = self.transform
        x, y = low.real, sign * high.imag
        return (
            a * step_x,
            -b * sign * step_y,
            a * x + b * y + c,
            d * step_x,
            -e * sign * step_y,
            d * x + e * y + f,
        )

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON data."""
        return {"transform": list(self.transform), "crs": self.crs}

    @classmethod
    def of_json(cls, data: Any) -> Georeference | None:
        """Return what `as_json` returned as a georeference; None for None.

        Raises:
            InputError: it is not one.
        """
        if data is None:
            return None
        numbers = data.get("transform") if isinstance(data, dict) else None
        crs = data.get("crs") if isinstance(data, dict) else None
        sound = isinstance(numbers, list) and len(numbers) == 6
        sound = sound and all(
            type(number) in (int, float) and math.isfinite(number) for number in numbers or ()
        )
        if (
            not sound
            or not isinstance(crs, str)
            or not (crs.isprintable() and len(crs) <= limits.CRS_CHARACTERS)
        ):
            raise InputError("about: a georeference is not a transform and a coordinate reference system")
        assert numbers is not None
        a, b, c, d, e, f = (float(number) for number in numbers)
        return cls((a, b, c, d, e, f), crs)
