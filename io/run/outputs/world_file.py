"""Where the picture lies on a map, for programs of geographic information: its world file, and its projection."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ....errors import InputError
from ....saved.georeference import Affine
from ... import formats
from ...pictures import georeferenced
from ..job import Job
from ..report import OutputReport
from ..state import Run
from .output import Output

PROJECTION = ".prj"


class WorldFile(Output):
    """The world file of the target's canvas (`.pgw`, `.jgw`, `.tfw`, `.wld`), or its coordinate reference system
    (`.prj`).
    """

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require a plane target."""
        if onto_mesh:
            raise InputError(f"{self.name}: {job.target} is a mesh, which does not lie on a map")

    def check(self, run: Run) -> None:
        """Require a target that lies on a map, and for `.prj` its system and rasterio, which writes it."""
        place = run.target.georeference
        if place is None:
            raise InputError(
                f"{self.name}: {run.target.spec} does not lie on a map; name a GeoJSON file, a GeoTIFF, or a picture "
                "with a world file"
            )
        if formats.suffix_of(self.name) == PROJECTION:
            if not place.crs:
                raise InputError(
                    f"{self.name}: the coordinate reference system of {run.target.spec} is unknown"
                )
            georeferenced.rasterio(f"{self.name}: writing it")

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Write the file."""
        place = run.target.georeference
        assert place is not None
        if formats.suffix_of(self.name) == PROJECTION:
            path.write_text(georeferenced.projection_text(place.crs))
        else:
            path.write_text(georeferenced.world_file_text(canvas_transform(run)))
        return OutputReport()


def canvas_transform(run: Run) -> Affine:
    """Return the transform from column and row of the picture to the map, for a target that lies on one."""
    place, canvas = run.target.georeference, run.canvas
    assert place is not None
    return place.of_pixels(canvas.box, (canvas.width, canvas.height), down=run.target.flip)
