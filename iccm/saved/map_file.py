"""Map files: archives of NumPy arrays (.npz), described in docs/reference/map-file.md.

Files are not trusted (`saved.archive`): every value that the map relies on is validated.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any, TypeGuard

import numpy as np

from .. import limits
from ..arrays import Box, Complex, Index
from ..curve import Curve
from ..errors import InputError
from ..maps.approximation import AnyMap
from ..maps.harmonic import HarmonicMap
from ..maps.triangulated.adjacency import edges_of
from ..maps.triangulated.injectivity import unfit
from ..maps.triangulated.map import TriangulatedMap
from ..plane import bounding_box, triangle_areas
from .archive import Archive, opened
from .georeference import Georeference

FORMAT = "iccm.map/1"
ARRAYS = {"pins": ("complex128", 2, 2), "hole_partners": ("int32", 2, 2)}
RINGS = (
    *("stroke_sources", "stroke_targets", "source_holes", "target_holes"),
    *("passed_source_holes", "passed_target_holes", "filled", "rigid"),
    *("source_drawing", "target_drawing"),
)
"""Data of a result besides the map (see `Fit`): arrays by type, dimensions and columns; and lists of rings."""
DRAWING_RINGS = ("source_drawing", "target_drawing")
"""Rings of whole drawings, filled by the even-odd rule; empty if the map is between outlines."""
FORMER_RINGS = ("passed_source_holes", "passed_target_holes")
"""Holes that a map of an earlier version ignored; they are part of the format, and no longer used."""
LATER = ("rigid", *DRAWING_RINGS)  # added later, so that files of this format may lack them


SIDES = ("source", "target")
PLANES = {"names": "name", "millimetres": "millimetres", "units": "unit"}
"""What `about` contains of both planes: its names for attributes of `SavedPlane`."""


@dataclass(frozen=True, eq=False)
class SavedPlane:
    """Data of the source's or the target's plane.

    Attributes:
        outline: (p,) vertices of the shape's outline, y up; None where there is none.
        box: lower left and upper right corner of its canvas.
        down: whether its file has y down; points in the file's coordinates are then the conjugates.
        holes: outlines of the shape's holes.
        name: of its file, as given by the user.
        millimetres: length of a unit of its file; None if the file does not state it.
        unit: the unit in which its file states its size, such as "in"; empty if it does not.
        georeference: where it lies on a map, if its file says so.
    """

    outline: Complex | None
    box: Box
    down: bool = False
    holes: Sequence[Complex] = ()
    name: str = ""
    millimetres: float | None = None
    unit: str = ""
    georeference: Georeference | None = None

    @classmethod
    def of(cls, outline: Complex, holes: Sequence[Curve]) -> "SavedPlane":
        """Create the plane of an outline given as an array: y up, with its bounding box as the canvas."""
        return cls(outline, bounding_box(outline), holes=[hole.z for hole in holes])

    def flip(self, z: Complex) -> Complex:
        """Convert points x + iy between the file's coordinates and those of the plane, in either direction."""
        return z.conj() if self.down else z


@dataclass(frozen=True, eq=False)
class MapFile:
    """The content of a map file.

    Attributes:
        map: source → target.
        planes: of source and target.
        arrays: those of ARRAYS, by name.
        rings: those of RINGS, by name.
        about: JSON data by name. When read, these have the given type if present: `ended`, a string; `notes`, a list of
            strings; `energies`, a list of numbers by name; `rigid`, a list of positive integers; `rigid_of_target`, a
            boolean; `job`, values by name.
    """

    map: AnyMap
    planes: tuple[SavedPlane, SavedPlane]
    arrays: Mapping[str, Any]
    rings: Mapping[str, Sequence[Complex]]
    about: Mapping[str, Any]

    def write(self, path: str | PathLike) -> None:
        """Write the archive; equal maps give equal bytes."""
        data: dict[str, Any] = {"format": FORMAT}
        about = dict(self.about)
        about |= {
            name: [getattr(plane, attribute) for plane in self.planes] for name, attribute in PLANES.items()
        }
        if any(plane.georeference for plane in self.planes):
            about["georeferences"] = [
                plane.georeference and plane.georeference.as_json() for plane in self.planes
            ]
        data["about"] = json.dumps(about, ensure_ascii=False)
        data |= _triangles(self.map) if isinstance(self.map, TriangulatedMap) else _harmonic(self.map)
        for side, plane in zip(SIDES, self.planes):
            data[side] = np.empty(0, complex) if plane.outline is None else plane.outline
            data[f"{side}_box"] = np.array(plane.box)
            data[f"{side}_y"] = np.int32(-1 if plane.down else 1)
            data |= _joined(f"{side}_rings", plane.holes)
        for name, rings in self.rings.items():
            data |= _joined(name, rings)
        for name, (dtype, _, columns) in ARRAYS.items():
            data[name] = np.asarray(self.arrays[name], dtype).reshape(-1, columns)
        with open(path, "wb") as file:  # given a path, NumPy would add a suffix
            np.savez_compressed(file, **data)


def _triangles(map: TriangulatedMap) -> dict[str, Any]:
    ends = np.cumsum([loop.size for loop in map.loops])
    return {
        "vertices": map.source,
        "images": map.image,
        "faces": map.faces.astype(np.int32),
        "sides": map.edges.sides.astype(np.int32),
        "bulges": map.bulges,
        "loops": np.concatenate(map.loops).astype(np.int32),
        "loops_ends": ends.astype(np.int32),
        "near": np.float64(map.near),
    }


def _harmonic(map: HarmonicMap) -> dict[str, Any]:
    return {"polygon": map.polygon, "phi": map.phi, "psi": map.psi, "slack": np.float64(map.slack)}


def _joined(name: str, rings: Sequence[Complex]) -> dict[str, Any]:
    """Return rings as one array, and the end of each in it, by name."""
    ends = np.cumsum([ring.size for ring in rings], dtype=np.int32)
    return {name: np.concatenate([np.empty(0, complex), *rings]), f"{name}_ends": ends}


def read(path: str | PathLike) -> MapFile:
    """Read a file written by `MapFile.write`.

    Raises:
        InputError: the file is missing, has another format or version, or does not contain a valid map.
    """
    with opened(
        path,
        otherwise="not a saved map (not an archive of arrays); iccm map -o map.npz writes one",
        damaged="damaged or invalid map",
    ) as archive:
        return _Archive(archive).map_file()


class _Archive(Archive):
    """The arrays of a map, validated on demand."""

    def map_file(self) -> MapFile:
        format = self.text("format")
        if format != FORMAT:
            raise InputError(f"its format is {format[:60]!r}, but this version of iccm reads {FORMAT!r}")
        about = self.about()
        map = self.harmonic() if "polygon" in self else self.triangulated()
        lengths = about.get("millimetres", [None, None])  # files of older versions have none
        units = about.get("units", ["", ""])
        places = about.get("georeferences", [None, None])
        if not isinstance(places, list) or len(places) != 2:
            raise InputError("about: does not contain two georeferences")
        planes = tuple(
            replace(self.plane(side, name, length), unit=unit, georeference=Georeference.of_json(place))
            for side, name, length, unit, place in zip(SIDES, about["names"], lengths, units, places)
        )
        if planes[0].outline is None:
            raise InputError("source: has no vertices")
        arrays = {name: self.array(name, *form) for name, form in ARRAYS.items()}
        rings = {name: [] if self.lacks(name) else self.rings(name) for name in RINGS}
        return MapFile(map, (planes[0], planes[1]), arrays, rings, about)

    def about(self) -> dict[str, Any]:
        """Return the JSON data, with the types that `MapFile` documents."""
        about = json.loads(self.text("about"))
        if not isinstance(about, dict):
            raise InputError("about: not a JSON object")
        names = about.get("names")
        if not (_are(names, str) and len(names) == 2):
            raise InputError("about: does not contain two names")
        energies = about.get("energies", [])
        counts = about.get("rigid", [])
        sound = {
            "ended": isinstance(about.get("ended"), str),
            "notes": _are(about.get("notes", []), str),
            "energies": _are(energies, dict)
            and all(_are(list(step.values()), float, int) for step in energies),
            "rigid": _are(counts, int) and all(count > 0 for count in counts),
            "rigid_of_target": isinstance(about.get("rigid_of_target", False), bool),
            "job": isinstance(about.get("job", {}), dict),
            "millimetres": _are_lengths(about.get("millimetres", [None, None])),
            "units": _are(about.get("units", ["", ""]), str) and len(about.get("units", ["", ""])) == 2,
        }
        if wrong := [name for name, fine in sound.items() if not fine]:
            raise InputError(f"about: {wrong[0]} is invalid")
        for text in (*names, *about.get("notes", [])):
            if not text.isprintable():
                raise InputError("about: a name or note contains characters that cannot be printed")
        return about

    def lacks(self, name: str) -> bool:
        """Return whether the file lacks an array that was added to the format later."""
        return name in LATER and name not in self

    def triangulated(self) -> TriangulatedMap:
        source, image = (self.array(name, "complex128") for name in ("vertices", "images"))
        if source.size != image.size or source.size < 3:
            raise InputError(f"images: {image.size} for {source.size} vertices")
        faces, sides = (self.indices(name, 3) for name in ("faces", "sides"))
        _within("faces", faces, source.size)
        loops = tuple(self.split("loops", self.indices("loops")))
        for loop in loops:
            _within("loops", loop, source.size)
        if not loops or any(loop.size < 3 for loop in loops):
            raise InputError("loops: missing, or with fewer than three vertices")
        edges = edges_of(faces)
        bulge = self.array("bulges", "complex128")
        if not np.array_equal(edges.sides, sides) or len(edges.ends) != bulge.size:
            raise InputError("sides: differ from the edges of the faces, or lack bulges")
        if why := unfit(source, image, faces, loops, bulge):
            raise InputError(f"faces: {why}")
        for name, plane in (("vertices", source), ("images", image)):
            if (triangle_areas(plane[faces]) < 0).any():
                raise InputError(f"{name}: some triangles are flipped")
        margin = float(self.array("near", "float64", 0))
        if not 0 <= margin <= 1:
            raise InputError(f"near: {margin:g} is not a share of the diagonal")
        return TriangulatedMap(source, image, faces, loops, margin, bulge)

    def harmonic(self) -> HarmonicMap:
        polygon, phi, psi = (self.array(name, "complex128") for name in ("polygon", "phi", "psi"))
        if not polygon.size == phi.size == psi.size:
            raise InputError(f"phi, psi: {phi.size} and {psi.size} for {polygon.size} vertices")
        slack = float(self.array("slack", "float64", 0))
        Curve.domain(polygon, "polygon")
        # vertices of a crowded map may be closer than `Curve.domain` allows
        curve = Curve(polygon)
        if (
            not curve.polygon.is_valid
            or curve.area < 0
            or np.any(polygon == np.roll(polygon, 1))
            or slack < 0
        ):
            raise InputError("polygon: is clockwise, repeats vertices, or has a negative slack")
        return HarmonicMap(polygon, phi, psi, slack)

    def plane(self, side: str, name: str, millimetres: float | None) -> SavedPlane:
        outline = self.array(side, "complex128")
        if outline.size:
            Curve.domain(outline, side)
        low, high = (complex(corner) for corner in self.pair(f"{side}_box"))
        if not (low.real < high.real and low.imag < high.imag):
            raise InputError(f"{side}_box: not a lower left and an upper right corner")
        y = int(self.array(f"{side}_y", "int32", 0))
        if y not in (1, -1):
            raise InputError(f"{side}_y: is {y}, but must be 1 or -1")
        rings = self.rings(f"{side}_rings")
        return SavedPlane(outline if outline.size else None, (low, high), y < 0, rings, name, millimetres)

    def pair(self, name: str) -> Complex:
        points = self.array(name, "complex128")
        if points.size != 2:
            raise InputError(f"{name}: has {points.size} points instead of 2")
        return points

    def rings(self, name: str) -> list[Complex]:
        """Return a list of rings, stored as one array and their ends."""
        rings = self.split(name, self.array(name, "complex128"))
        least = 2 if name.startswith("stroke") else 3
        if any(ring.size < least for ring in rings):
            raise InputError(f"{name}: an item has fewer than {least} points")
        return rings

    def split(self, name: str, joined: Any) -> list[Any]:
        ends = self.indices(f"{name}_ends")
        if np.any(np.diff(ends, prepend=0) <= 0) or (ends[-1] if ends.size else 0) != joined.size:
            raise InputError(f"{name}_ends: do not increase to {joined.size}")
        return np.split(joined, ends[:-1]) if ends.size else []

    def indices(self, name: str, columns: int = 0) -> Index:
        return self.array(name, "int32", 2 if columns else 1, columns).astype(np.int64)

    def array(self, name: str, dtype: str, dimensions: int = 1, columns: int = 0) -> Any:
        """Return an array of a type and shape; all numbers are finite and at most limits.COORDINATE."""
        array = self.member(name)
        fits = array.dtype == dtype and array.ndim == dimensions
        if not fits or (columns and array.shape[1] != columns):
            raise InputError(f"{name}: has type {array.dtype} and shape {array.shape}; expected {dtype}")
        numbers = array.view("float64") if array.dtype == "complex128" and array.size else array
        if not np.isfinite(numbers).all():
            raise InputError(f"{name}: some are not finite numbers")
        largest = max(numbers.max(initial=0), -numbers.min(initial=0)) if numbers.dtype.kind == "f" else 0
        if largest > limits.COORDINATE:
            raise InputError(f"{name}: some numbers are larger than {limits.COORDINATE:g}")
        return array

    def text(self, name: str) -> str:
        if name not in self or (value := self.member(name)).dtype.kind != "U" or value.ndim:
            raise InputError(f"{name}: not text")
        text = str(value)
        text.encode()  # refuse lone surrogates, which cannot be printed or written
        return text


def _are(values: Any, *types: type) -> TypeGuard[list[Any]]:
    """Return whether something is a list of values of the given types; booleans do not count as numbers."""
    return isinstance(values, list) and all(
        isinstance(value, types) and not isinstance(value, bool) for value in values
    )


def _are_lengths(units: Any) -> bool:
    """Return whether something is a pair of positive lengths, or None where a length is not known."""
    if not (isinstance(units, list) and len(units) == 2):
        return False
    stated = [unit for unit in units if unit is not None]
    return _are(stated, float, int) and all(0 < unit <= limits.COORDINATE for unit in stated)


def _within(name: str, values: Index, count: int) -> None:
    if values.size and not 0 <= values.min() <= values.max() < count:
        raise InputError(f"{name}: {values.min()} to {values.max()} of {count} vertices")
