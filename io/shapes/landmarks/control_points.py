"""Ground control points of a GeoTIFF (`.tif`): from its own pixels to places on a map."""

from __future__ import annotations

from pathlib import Path

from ....errors import InputError, naming
from ...pictures import georeferenced
from .landmarks_file import LandmarksFile
from .pairs import LandmarkPairs


class ControlPoints(LandmarksFile):
    """The ground control points in the tags of a picture. They are only read."""

    axes = ("image", "map")

    def read(self) -> LandmarkPairs:
        """Return the points of the file, which GDAL opens, so that pictures of any size are read.

        Raises:
            InputError: rasterio is missing, or the file has none.
        """
        with naming(self.name):
            pixels, places, crs = georeferenced.gcps(Path(self.name))
        return LandmarkPairs(self.axes, [""] * len(pixels), pixels, places, crs)

    def parse(self, content: bytes) -> LandmarkPairs:
        """Refuse the content of a file that is not there, such as one chosen on a page.

        Raises:
            InputError: always.
        """
        raise InputError("ground control points are read by `iccm map --constraints`, not on a page")
