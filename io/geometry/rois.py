"""Regions of interest of ImageJ and Fiji: one in a .roi file, several in the .zip of the ROI Manager."""

from __future__ import annotations

import io
import re
import struct
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np
import shapely

from ...arrays import Complex
from ...errors import InputError
from ...polygons import polygons_of
from ...saved import archive as archives
from .. import extras, limits
from .document import Geometry, GeometryDocument, Images

if TYPE_CHECKING:
    from roifile import ImagejRoi

ZIP = b"PK\x03\x04"
UNREAD = (ValueError, TypeError, LookupError, ArithmeticError, RuntimeError, struct.error)
"""What roifile raises where a file is damaged."""
KEPT_FIELDS = (
    "version",
    "position",
    "c_position",
    "z_position",
    "t_position",
    "group",
    "stroke_width",
    "float_stroke_width",
    "stroke_color",
    "fill_color",
)
"""What a region keeps when its coordinates change: its slice, group, line width and colours."""
MOVE, LINE, CLOSE = 0.0, 1.0, 4.0
"""Segments of the path of a composite ROI (java.awt.geom.PathIterator)."""


@dataclass
class Rois(GeometryDocument):
    """Regions of interest: points, lines and polygons, in pixels, y down.

    Rectangles and ovals become polygons, since a map bends their sides.

    Attributes:
        rois: as roifile reads them, each with the kind of its geometry and the number of points or polygons.
        is_archive: whether the file is a ZIP archive, which may hold several.
    """

    keeps = False

    rois: list[tuple[ImagejRoi, str, int]]
    is_archive: bool
    geometry: Geometry
    notes: tuple[str, ...] = ()

    @classmethod
    def parse(cls, data: bytes, columns: str | None) -> Rois:
        """Read a .roi file, or an archive of them."""
        is_archive = data.startswith(ZIP)
        rois = list[tuple["ImagejRoi", str, int]]()
        names, skipped = list[str](), 0
        points, lines, polygons = list[complex](), list[Complex](), list[list[Complex]]()
        for roi in _members(data) if is_archive else [_roi(data)]:
            kind, parts = _shapes(roi)
            if kind == "points":
                points += parts[0].tolist()
                names += [roi.name if parts[0].size == 1 else ""] * parts[0].size
                rois.append((roi, kind, parts[0].size))
            elif kind == "line":
                lines += parts
                rois.append((roi, kind, len(parts)))
            elif kind == "polygon":
                filled = _polygons(parts)
                polygons += filled
                rois.append((roi, kind, len(filled)))
            else:
                skipped += 1
        if not rois:
            raise InputError("contains no points, lines or polygons")
        notes = (f"{skipped} texts or images are dropped",) if skipped else ()
        geometry = Geometry(np.array(points, complex), lines, polygons, names)
        return cls(rois, is_archive, geometry, notes)

    def encode(self, images: Images) -> bytes:
        """Return the file with the images of its regions; what was cut becomes several, named "a", "a-2", …

        Raises:
            InputError: a .roi file would have to hold several regions, or none.
        """
        points, lines, polygons = iter(images.points.tolist()), iter(images.lines), iter(images.polygons)
        regions = list[tuple[str, bytes]]()
        for roi, kind, count in self.rois:
            if kind == "points":
                z = np.array([next(points) for _ in range(count)])
                pieces = [[z[~np.isnan(z)]]]
            elif kind == "line":
                pieces = [[piece] for _ in range(count) for piece in next(lines)]
            else:
                pieces = [rings for _ in range(count) for rings in next(polygons)]
            for number, rings in enumerate((rings for rings in pieces if rings and rings[0].size), 1):
                try:
                    name = (roi.name or roi.autoname) + (f"-{number}" if number > 1 else "")
                    regions.append((_file_name(name), _region_like(roi, name, kind, rings).tobytes()))
                except UNREAD as error:
                    raise InputError(f"the region {roi.name!r} cannot be written: {error}") from error
        if not self.is_archive:
            if len(regions) != 1:
                raise InputError(
                    f"the result has {len(regions)} regions, but a .roi file holds one; use a .zip as the input"
                )
            return regions[0][1]
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in regions:
                archive.writestr(zipfile.ZipInfo(f"{name}.roi"), data)
        return file.getvalue()


def _members(data: bytes) -> list[ImagejRoi]:
    """Return the regions in an archive, in its order."""
    problem = "cannot read this archive"
    with archives.opened(
        io.BytesIO(data), otherwise=problem, damaged=problem, most_bytes=limits.GEOMETRY_BYTES
    ) as archive:
        entries = [entry for entry in archive.infolist() if entry.filename.lower().endswith(".roi")]
        contents = [archive.read(entry) for entry in entries]
    regions = [_roi(content) for content in contents]
    if not regions:
        raise InputError("contains no .roi files (of the ROI Manager of ImageJ)")
    return regions


def _file_name(name: str) -> str:
    """Return a name of a region as the name of a file in an archive, which must not lead to another folder."""
    return re.sub(r"[/\\:\x00-\x1f]", "_", name)[: limits.NAME_BYTES // 4]


def _roi(data: bytes) -> ImagejRoi:
    """Return a region of interest from its bytes."""
    roifile = extras.load("reading ImageJ's regions", "roifile", otherwise="export a table")
    try:
        with np.errstate(invalid="ignore"):
            roi = roifile.ImagejRoi.frombytes(data)
            roi.coordinates(multi=True)
    except UNREAD as error:
        raise InputError(f"not a region of interest of ImageJ: {error}") from error
    return roi


def _shapes(roi: ImagejRoi) -> tuple[str, list[Complex]]:
    """Return what a region is (points, line, polygon, or "") and the points of each of its parts."""
    from roifile import ROI_SUBTYPE, ROI_TYPE

    if roi.subtype in (ROI_SUBTYPE.TEXT, ROI_SUBTYPE.IMAGE):
        return "", []
    kinds = {ROI_TYPE.POINT: "points"}
    kinds |= dict.fromkeys((ROI_TYPE.LINE, ROI_TYPE.POLYLINE, ROI_TYPE.FREELINE, ROI_TYPE.ANGLE), "line")
    kind = kinds.get(roi.roitype, "polygon")
    parts = list[Complex]()
    for xy in roi.coordinates(multi=True):
        with np.errstate(invalid="ignore"):  # of numbers that are not finite
            z = np.asarray(xy, float).reshape(-1, 2) @ [1, 1j]
        if not (np.abs(z) < limits.COORDINATE).all():
            raise InputError("some coordinates are not finite numbers")
        if kind == "polygon" and z.size and z[0] == z[-1]:
            z = z[:-1]
        if z.size >= {"points": 1, "line": 2, "polygon": 3}[kind]:
            parts.append(z)
    return (kind, parts) if parts else ("", [])


def _polygons(rings: list[Complex]) -> list[list[Complex]]:
    """Return the polygons that some rings enclose by the even-odd rule, each an outer ring and those of its holes."""
    if len(rings) == 1:
        return [rings]
    areas = [shapely.Polygon(np.column_stack([ring.real, ring.imag])).buffer(0) for ring in rings]
    return [
        [shapely.get_coordinates(ring)[:-1] @ [1, 1j] for ring in (part.exterior, *part.interiors)]
        for part in polygons_of([reduce(shapely.symmetric_difference, areas)])
    ]


def _region_like(roi: ImagejRoi, name: str, kind: str, rings: Sequence[Complex]) -> ImagejRoi:
    """Return a region with other coordinates, and the name, slice, colours and line width of `roi`."""
    from roifile import ROI_TYPE, ImagejRoi

    def pairs(z: Complex) -> np.ndarray:
        return np.column_stack([z.real, z.imag])

    with np.errstate(invalid="ignore"):  # of whole pixels that are too large, beside those in floating point
        region = ImagejRoi.frompoints(pairs(np.concatenate(rings)), name=name)
    region.roitype = {"points": ROI_TYPE.POINT, "line": ROI_TYPE.POLYLINE, "polygon": ROI_TYPE.POLYGON}[kind]
    if len(rings) > 1:
        # a polygon with holes is a composite: a rectangle with a path
        path = list[float]()
        for ring in rings:
            for number, (x, y) in enumerate(pairs(ring).tolist()):
                path += [LINE if number else MOVE, x, y]
            path.append(CLOSE)
        region.roitype = ROI_TYPE.RECT
        region.integer_coordinates = region.subpixel_coordinates = None
        region.n_coordinates = 0
        region.options = type(region.options)(0)
        region.multi_coordinates = np.array(path, np.float32)
        region.shape_roi_size = len(path)
    for field in KEPT_FIELDS:
        setattr(region, field, getattr(roi, field))
    return region
