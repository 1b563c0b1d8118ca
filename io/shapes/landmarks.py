"""Landmark pairs of other programs: BigWarp (.csv), QGIS (.points), TPS files with two specimens (.tps),
and ground control points of a GeoTIFF (.tif).

The source is called moving in BigWarp, source in QGIS, and is the first specimen in TPS. BigWarp uses pixels, x right
and y down. In QGIS y points up, and is negative in pictures since it starts at their upper edge. In TPS y points up
from the lower edge of the picture.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ...errors import InputError
from .. import formats, limits
from ..pictures import georeferenced
from ..point_syntax import coordinate

if TYPE_CHECKING:
    from .shape import Shape

Axes = Literal["image", "upward", "lower-edge", "map"]
Point = tuple[float, float]
SUFFIXES = (".csv", ".points", ".tps")
BIGWARP_COLUMNS = 6  # of a planar row: name, active, two coordinates in both images
BIGWARP_SPATIAL_COLUMNS = 8  # of a row in three dimensions
QGIS_HEADER = "mapX,mapY,sourceX,sourceY,enable,dX,dY,residual"
QGIS_SOURCE = (("sourceX", "sourceY"), ("pixelX", "pixelY"))  # columns of newer and older versions
NO = ("false", "0", "no")


@dataclass(frozen=True)
class LandmarkPairs:
    """Named pairs of points of two shapes.

    Attributes:
        axes: conventions of the coordinates in the source and in the target.
        names: of each pair, possibly empty.
        source: points of the source.
        target: points of the target.
        crs: the coordinate reference system of the target's points, if they are places on a map.
    """

    axes: tuple[Axes, Axes]
    names: list[str]
    source: list[Point]
    target: list[Point]
    crs: str = ""

    def in_file_units(self, source: Shape, target: Shape) -> list[tuple[str, Point, Point]]:
        """Return names and points, converted to the units of two shapes' files.

        Raises:
            InputError: one of them is a mesh.
        """
        for shape in (source, target):
            if shape.is_mesh:
                raise InputError(
                    f"{shape.spec}: landmarks of images only work for drawings and pictures; use JSON"
                )
        target_crs = target.georeference.crs if target.georeference else ""
        if self.crs and target_crs and self.crs != target_crs:
            raise InputError(
                f"{target.spec}: is in {target_crs}, but the ground control points are in {self.crs}; reproject one of "
                "them"
            )
        source_axes, target_axes = self.axes
        return [
            (name, _from_axes(source_axes, a, source), _from_axes(target_axes, b, target))
            for name, a, b in zip(self.names, self.source, self.target)
        ]


def _from_axes(axes: Axes, point: Point, shape: Shape) -> Point:
    """Convert a point from a program's coordinates to the units of a shape's file."""
    if axes == "image":
        return point
    if axes == "map" and shape.georeference:
        return shape.georeference.from_map(*point)
    origin = shape.box[0] if axes == "lower-edge" else 0j
    x, y = shape.to_file(origin + complex(*point)).tolist()
    return x, y


def _to_axes(axes: Axes, point: Point, shape: Shape) -> Point:
    if axes == "image":
        return point
    if axes == "map" and shape.georeference:
        return shape.georeference.to_map(*point)
    z = complex(shape.to_core(point)) - (shape.box[0] if axes == "lower-edge" else 0j)
    return z.real, z.imag


def is_landmarks(name: str) -> bool:
    """Return whether a file contains landmarks of another program, by its suffix."""
    return formats.suffix_of(name) in (*SUFFIXES, *georeferenced.TIFF_SUFFIXES)


def parse(name: str, data: bytes) -> LandmarkPairs:
    """Read landmark pairs; inactive ones are ignored.

    Args:
        name: of the file; its suffix determines the format.
        data: content of the file.

    Raises:
        InputError: the file is invalid; the message starts with what is wrong.
    """
    if formats.suffix_of(name) in georeferenced.TIFF_SUFFIXES:
        return _limited(_read_gcps(name))
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("not a text file in UTF-8") from error
    readers = {".csv": _read_bigwarp, ".points": _read_qgis, ".tps": _read_tps}
    return _limited(readers[formats.suffix_of(name)](text))


def _limited(pairs: LandmarkPairs) -> LandmarkPairs:
    """Return landmarks after checking their number."""
    if not pairs.names:
        raise InputError("contains no landmarks that are switched on")
    if len(pairs.names) > limits.PAGE_PINS:
        raise InputError(f"contains more than {limits.PAGE_PINS} landmarks")
    return pairs


def _rows(text: str) -> list[tuple[int, list[str]]]:
    """Return the rows of a table with their line numbers, without empty lines and comments."""
    lines = csv.reader(io.StringIO(text))
    try:
        rows = [(lines.line_num, [cell.strip() for cell in row]) for row in lines]
    except csv.Error as error:
        raise InputError(f"not a table: {error}") from error
    return [(number, row) for number, row in rows if any(row) and not row[0].startswith("#")]


def _read_bigwarp(text: str) -> LandmarkPairs:
    pairs = LandmarkPairs(("image", "image"), [], [], [])
    for line, row in _rows(text):
        if len(row) == BIGWARP_SPATIAL_COLUMNS:
            raise InputError(f"line {line}: landmarks in space are not supported; use two coordinates")
        if len(row) != BIGWARP_COLUMNS:
            raise InputError(
                f"line {line}: has {len(row)} columns instead of name, active, x, y, x, y (BigWarp)"
            )
        if row[1].lower() not in NO:
            x, y, u, v = (coordinate(cell, f"line {line}") for cell in row[2:])
            pairs.names.append(row[0])
            pairs.source.append((x, y))
            pairs.target.append((u, v))
    return pairs


def _read_qgis(text: str) -> LandmarkPairs:
    rows = _rows(text)
    header = rows[0][1] if rows else []
    sources = next((columns for columns in QGIS_SOURCE if set(columns) <= set(header)), None)
    if sources is None or not {"mapX", "mapY"} <= set(header):
        raise InputError("has no columns mapX, mapY, sourceX and sourceY (QGIS)")
    pairs = LandmarkPairs(("upward", "map"), [], [], [])
    for line, row in rows[1:]:
        cells = dict(zip(header, row))
        if cells.get("enable", "1").lower() in NO:
            continue
        x, y, u, v = (coordinate(cells.get(name, ""), f"line {line}") for name in (*sources, "mapX", "mapY"))
        pairs.names.append("")
        pairs.source.append((x, y))
        pairs.target.append((u, v))
    return pairs


def _read_gcps(name: str) -> LandmarkPairs:
    """Return the ground control points of a GeoTIFF, from its own pixels to a map."""
    pixels, places, crs = georeferenced.gcps(Path(name))
    return LandmarkPairs(("image", "map"), [""] * len(pixels), pixels, places, crs)


def _read_tps(text: str) -> LandmarkPairs:
    specimens = _specimens(text)
    if len(specimens) != 2:
        raise InputError(f"has {len(specimens)} specimens; pairs need two, the source and the target")
    first, second = specimens
    if len(first) != len(second):
        raise InputError(f"the first specimen has {len(first)} landmarks but the second {len(second)}")
    pairs = LandmarkPairs(("lower-edge", "lower-edge"), [], [], [])
    for number, (a, b) in enumerate(zip(first, second), 1):
        if a is not None and b is not None:  # else one of the specimens lacks it
            pairs.names.append(str(number))
            pairs.source.append(a)
            pairs.target.append(b)
    return pairs


def _specimens(text: str) -> list[list[Point | None]]:
    """Return the landmarks of each specimen, which follow LM=n; None for missing ones.

    Other lines, such as curves and names of pictures, are ignored.
    """
    specimens: list[list[Point | None]] = []
    remaining = 0
    for line, row in enumerate(text.splitlines(), 1):
        words = row.split()
        key, _, count = row.replace(" ", "").partition("=")
        if key.upper() == "LM" and re.fullmatch("[0-9]{1,9}", count):
            specimens.append([])
            remaining = int(count)
        elif remaining and words:
            if len(words) != 2:
                raise InputError(
                    f"line {line}: {row.strip()[:40]!r} is not a landmark; write its x and y, such as 12.5 40"
                )
            if [word.upper() for word in words] == ["NA", "NA"]:
                specimens[-1].append(None)
            else:
                x, y = (coordinate(word, f"line {line}") for word in words)
                specimens[-1].append((x, y))
            remaining -= 1
    if remaining:
        raise InputError(f"the file ends before the last {remaining} landmarks")
    return specimens


def write(suffix: str, pins: Sequence[Any], source: Shape, target: Shape) -> str:
    """Write pins as landmark pairs in the format of another program.

    Args:
        suffix: of the format.
        pins: objects with `name`, `source` and `target`, in the units of the shapes' files.
        source, target: the shapes.

    Raises:
        InputError: a pin is on a mesh, or the format is unknown.
    """
    writers: dict[str, tuple[tuple[Axes, Axes], Callable[[LandmarkPairs], str]]] = {
        ".csv": (("image", "image"), _bigwarp),
        ".points": (("upward", "map"), _qgis),
        ".tps": (("lower-edge", "lower-edge"), _tps),
    }
    if suffix not in writers:
        raise InputError(f"{suffix}: unknown format of landmarks; use {', '.join(SUFFIXES)}")
    if source.is_mesh or target.is_mesh:
        raise InputError("landmarks on meshes can only be saved as JSON")
    axes, writer = writers[suffix]
    names = [pin.name for pin in pins]
    sides = [[_to_axes(side_axes, getattr(pin, side), shape) for pin in pins] for side_axes, side, shape in
             ((axes[0], "source", source), (axes[1], "target", target))]  # fmt: skip
    return writer(LandmarkPairs(axes, names, sides[0], sides[1]))


def _text(value: float) -> str:
    return f"{value:.12g}"


def _bigwarp(pairs: LandmarkPairs) -> str:
    file = io.StringIO()
    writer = csv.writer(file, quoting=csv.QUOTE_ALL, lineterminator="\n")
    for number, (name, a, b) in enumerate(zip(pairs.names, pairs.source, pairs.target)):
        writer.writerow([name or f"Pt-{number}", "true", *map(_text, (*a, *b))])
    return file.getvalue()


def _qgis(pairs: LandmarkPairs) -> str:
    rows = [",".join(map(_text, (*b, *a, 1, 0, 0, 0))) for a, b in zip(pairs.source, pairs.target)]
    return "\n".join([QGIS_HEADER, *rows]) + "\n"


def _tps(pairs: LandmarkPairs) -> str:
    lines: list[str] = []
    for side, points in (("source", pairs.source), ("target", pairs.target)):
        lines += [f"LM={len(points)}", *(" ".join(map(_text, point)) for point in points), f"ID={side}"]
    return "\n".join(lines) + "\n"
