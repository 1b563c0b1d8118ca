"""Shapes from files of every format: `file` or `file#id` as a domain in the core plane."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.affinity import scale

from ...arrays import Box, Complex, Real, complex_of, xy_of
from ...curve import Curve, polygon_of
from ...drawings.drawing import Drawing
from ...drawings.frame import close_hairlines
from ...drawings.mappable_holes import mappable
from ...errors import InputError, first_names
from ...pixels.texture import REPEAT, Wrap
from ...plane import bounding_box
from ...polygons import unite
from ...saved.georeference import Georeference
from .. import formats
from ..outlines import dxf, lettering, polygons
from ..point_syntax import Place, written
from ..spec import Spec
from ..svg import reader as svg
from ..svg.drawing_content import DrawingContent
from ..svg.fill import FilledOutline
from . import planar_obj, silhouette
from .silhouette import CANVAS

if TYPE_CHECKING:
    from ...meshes.flatten import Flattening
    from ...pixels.texture import Placing, Texture
    from ...projection.view import View


@dataclass(frozen=True, eq=False)
class Shape:
    """A planar domain read from a file.

    Attributes:
        spec: the user's specification, `file` or `file#id`.
        path: the file.
        curve: the domain's boundary in the core plane (y up), counter-clockwise and simple.
        box: lower left and upper right corner of the canvas in the core plane.
        flip: whether the file's y axis points down.
        pins: positions of pins drawn in the file, by name, core plane.
        pin_radii: radii of the circles that represent these pins, by name.
        strokes: strokes drawn in the file, by name, core plane.
        rigid: outlines of rigid regions drawn in the file, core plane.
        drawing: everything that the file paints, core plane, if the whole drawing is used; closed lines are filled in
            line drawings. `curve` is then the outline of a frame around it, or of its only part.
        ink: the same as drawn, without filling lines.
        notes: sentences on what was ignored or changed.
        part: how `#` selects it in the file, if it is one of several shapes.
        names: ids and labels of its element and of all groups that contain it.
        extent: the bounding box of all shapes that were read, if it is one of several.
        holes: boundaries of its holes, core plane.
        hole_names: ids and labels of the content of each hole.
        aspect: for a layout, width / height of the pictures on it.
        coloured: whether its file has separate colours to show; it is then its own texture.
        trace: how a picture is traced, see `silhouette.read`.
        millimetres: length of a unit of its file; None if the file does not state it.
        unit: the unit in which the file states its size, such as "in"; empty if it does not.
        outlines: all outlines of its file, in the file's coordinates, if the whole file was read.
        selected_outlines: those of the selected part of its file, or all if none is selected.
        georeference: where the file's coordinates lie on a map, if the file says so.
        view: how a flat sheet is seen in it, if it is one of `projected`.
    """

    spec: str
    path: Path
    curve: Curve
    box: Box
    flip: bool
    pins: dict[str, complex]
    strokes: dict[str, Curve]
    notes: tuple[str, ...] = ()
    part: str = ""
    names: tuple[str, ...] = ()
    extent: Box | None = None
    holes: tuple[Complex, ...] = ()
    hole_names: tuple[tuple[str, ...], ...] = ()
    aspect: float = 1.0
    rigid: tuple[Complex, ...] = ()
    coloured: bool = False
    trace: str = "auto"
    drawing: Drawing | None = None
    ink: Drawing | None = None
    outlines: tuple[FilledOutline, ...] | None = None
    selected_outlines: tuple[FilledOutline, ...] = ()
    pin_radii: dict[str, float] = field(default_factory=dict)
    view: View | None = None
    millimetres: float | None = None
    unit: str = ""
    georeference: Georeference | None = None

    @property
    def bounds(self) -> Box:
        """The bounding box of the outline, or of all shapes that were read with it."""
        return self.extent or self.curve.box

    @cached_property
    def mappable_holes(self) -> list[int]:
        """Indices of the holes that leave room for a map."""
        return mappable(self.curve, self.holes)

    is_mesh: ClassVar[bool] = False

    def all_at(self, place: Place) -> list[complex]:
        """Return the positions in the plane of a place given by the user: several for a vertex on a seam.

        Raises:
            InputError: the place is not on the shape.
        """
        return [self.at(place)]

    def unit_at(self, z: complex) -> float:
        """Return the length in the plane of one unit of the file near a point."""
        return 1.0

    @cached_property
    def elements(self) -> dict[str, tuple[complex, float]]:
        """The elements inside it, by id or label: centroid, and radius of a circle with the same area."""
        polygons_by_name: dict[str, list[shapely.Polygon]] = {}
        if not self.is_mesh and READERS.get(formats.suffix_of(self.path)) is svg.read:
            with suppress(InputError):
                outlines = self.outlines
                for outline in read_drawing(Spec(self.path)).outlines if outlines is None else outlines:
                    for name in set(outline.names) - set(self.names):
                        polygons_by_name.setdefault(name, []).append(polygon_of(_core(outline.z, self.flip)))
        discs = {}
        for name, pieces in polygons_by_name.items():
            region = shapely.MultiPolygon(pieces)
            middle = complex(region.centroid.x, region.centroid.y)
            if self.curve.contains(np.array([middle]))[0]:
                discs[name] = middle, float(np.sqrt(region.area / np.pi))
        return discs

    @property
    def domain(self) -> Curve | Flattening | Drawing:
        """The domain of the map: the whole drawing, the domain's boundary, or a flattened mesh."""
        return self.drawing or self.curve

    def part_of(self, drawing: Drawing, number: int) -> Shape:
        """Return one part of the whole drawing as a shape, named by a number."""
        return replace(
            self,
            curve=drawing.tightest.outline,
            drawing=drawing,
            ink=drawing,
            holes=tuple(drawing.holes),
            hole_names=(),
            part=str(number),
            extent=self.bounds,
        )

    def by_element(self) -> list[Shape]:
        """Return the letters or elements of a whole drawing as shapes with all their parts, the largest first.

        Parts whose element is unknown become separate shapes.
        """
        groups: dict[tuple[str, int | None], list[shapely.Geometry]] = {}
        for number, outline in enumerate(self.selected_outlines):
            has_element = outline.element is not None
            key: tuple[str, int | None] = ("element", outline.element) if has_element else ("outline", number)
            ring = polygon_of(*(_core(z, self.flip) for z in (outline.z, *outline.holes)))
            groups.setdefault(key, []).append(ring)
        drawings = [Drawing(close_hairlines(unite(shapely.make_valid(rings)))) for rings in groups.values()]
        drawings.sort(key=lambda drawing: -drawing.region.area)
        return [self.part_of(drawing, number) for number, drawing in enumerate(drawings, start=1)]

    def scaled(self, factor: float) -> Shape:
        """Return the shape scaled about its middle; extent and canvas are unchanged."""
        if factor == 1:
            return self
        low, high = self.bounds
        middle = (low + high) / 2

        def moved(z: Complex) -> Complex:
            return middle + factor * (z - middle)

        drawing = self.drawing
        if drawing is not None:
            origin = (middle.real, middle.imag)
            drawing = Drawing(scale(drawing.painted, factor, factor, origin=origin))
        return replace(
            self,
            curve=Curve(moved(self.curve.z)),
            drawing=drawing,
            ink=drawing,
            holes=tuple(moved(hole) for hole in self.holes),
            rigid=tuple(moved(region) for region in self.rigid),
            extent=self.bounds,
        )

    def framed(self, frame: Curve) -> Shape:
        """Return the shape with the chosen frame as its outline."""
        return replace(self, curve=frame)

    @property
    def is_layout(self) -> bool:
        """Whether the plane is that of a mesh's texture coordinates, and the canvas one of its tiles."""
        return False

    @property
    def mirror(self) -> float | None:
        """Abscissa of the line about which the plane is reflected relative to the file; None if it is not."""
        return None

    def spread(self, spatial: bool) -> tuple[Real, Real, Real]:
        """Return centroid, minimum and maximum (3,) of the shape for pairing; the latter of all that were read with it.

        They are in the plane; for a mesh, in space if `spatial`.
        """
        centre = self.curve.polygon.centroid
        low, high = self.bounds
        middle, least, greatest = (
            np.array([*xy, 0.0]) for xy in ((centre.x, centre.y), *xy_of(np.array([low, high])))
        )
        return middle, least, greatest

    @property
    def has_uv(self) -> bool:
        """Whether the file has texture coordinates; only meshes do."""
        return False

    @property
    def wrap(self) -> Wrap:
        """The wrap mode of a texture shown by texture coordinates."""
        return REPEAT

    @property
    def pictures(self) -> tuple[Path | bytes, ...]:
        """The textures that a mesh file refers to or contains, or the drawing's file if it has separate colours."""
        return (self.path,) if self.coloured else ()

    def placing(self, texture: Texture, tiles: Box | None = None) -> Placing:
        """Return how points of the shape's plane are placed in a texture.

        Args:
            texture: a texture placed in the plane.
            tiles: for a mesh, the range of its texture coordinates that the texture covers; 0..1 repeated by default.
        """
        return texture

    def to_core(self, xy: ArrayLike) -> Complex:
        """Convert (..., 2) coordinates in the file's units to complex numbers of the core plane."""
        xy = np.asarray(xy, dtype=float)
        return _core(xy[..., 0] + 1j * xy[..., 1], self.flip)

    def at(self, place: Place) -> complex:
        """Return the position in the core plane of a place given by the user.

        Raises:
            InputError: the place is a vertex or a point in space, and the shape is not a mesh.
        """
        if isinstance(place, str) or len(place) != 2:
            text = f"{written(place)} is a point on a mesh, but this is not a mesh; write x,y"
            raise InputError(f"{self.spec}: {text}")
        return complex(self.to_core(place))

    def along(self, places: Sequence[Place], name: str) -> Curve:
        """Return the stroke through places; `name` is used in messages."""
        return Curve.stroke([self.at(place) for place in places], name)

    def to_file(self, z: ArrayLike) -> NDArray[np.float64]:
        """Convert complex numbers of the core plane to (..., 2) coordinates in the file's units."""
        return xy_of(_core(np.asarray(z, dtype=complex), self.flip))


BBOX = "bbox"
"""Name of the bounding box of what a file, or a part of it, paints: `logo.svg#bbox`, `logo.svg#part#bbox`."""
THINNEST_RATIO = 1e6
"""Outline's length squared / area; for a strip that is four times its length / width."""
READERS = {
    **dict.fromkeys((".svg", ".svgz"), svg.read),
    ".obj": planar_obj.read,
    **dict.fromkeys((".geojson", ".geojsonl", ".geojsons", ".topojson", ".json"), polygons.read),
    **dict.fromkeys((".gpkg", ".shp", ".kml", ".fgb"), polygons.read_layer),
    **dict.fromkeys(formats.FONTS, lettering.read),
    ".dxf": dxf.read,
}
SUFFIXES = (*READERS, *formats.holding("picture"))


def read(
    text: str,
    *,
    vertices: int | None = None,
    flatness: float = 1e-4,
    max_bytes: int | None = None,
    max_segments: int | None = None,
    trace: str = "auto",
    whole: bool = False,
) -> Shape:
    """Read the shape that `file`, `file#part`, `file#number` or `file#part#number` specifies.

    Args:
        text: the specification. Without a part, it means the largest outline of the file; a part is the id or Inkscape
            label of an SVG element or group, or an OBJ object or group; a number counts outlines from the largest, 1.
        vertices: approximate number of evenly spaced vertices to which to resample; None for no resampling.
        flatness: tolerance of flattened curves relative to the shape's size; corners are kept exactly.
        max_bytes: largest size of the file.
        max_segments: limit on lines and curves of an SVG file.
        trace: how pictures are traced, see `silhouette.read`.
        whole: whether to read everything that the file or part paints, unless a number selects one outline.

    Raises:
        InputError: the file does not contain a valid domain; the message has file, place, problem and remedy.
    """
    spec = Spec.of(text)
    drawing = read_drawing(
        spec, flatness=flatness, max_bytes=max_bytes, max_segments=max_segments, trace=trace
    )
    chosen = spec.among(drawing.ids)
    outline, notes = _choose(drawing, text, chosen, warn=not whole)
    if whole and chosen.number is None and vertices is None:
        return _whole_shape(drawing, text, spec, notes, trace)
    curve = Curve.domain(_core(outline.z, drawing.flip), text)
    if curve.length**2 > THINNEST_RATIO * curve.area:
        times = curve.length**2 / (4 * curve.area)
        raise InputError(
            f"{text}: the outline is too long for the area that it encloses (like a strip {times:.2g} "
            "times as long as wide); make it wider, or simplify it"
        )
    if vertices is not None:
        curve = Curve.domain(curve.resample(vertices).z, f"{text} with {vertices} vertices")
    strokes = {
        k: Curve.stroke(_core(z, drawing.flip), f"{spec.path}: {k}") for k, z in drawing.strokes.items()
    }
    pins = {k: complex(_core(z, drawing.flip)) for k, z in drawing.pins.items()}
    box = _box(drawing, curve.box)
    return Shape(
        text,
        spec.path,
        curve,
        box,
        drawing.flip,
        pins,
        strokes,
        tuple(notes),
        names=outline.names,
        rigid=tuple(_core(z, drawing.flip) for z in drawing.rigid),
        coloured=drawing.coloured,
        trace=trace,
        pin_radii=drawing.pin_radii,
        millimetres=drawing.millimetres,
        unit=drawing.unit,
        georeference=drawing.georeference,
        **_holes(drawing, outline),
    )


def of_drawing(drawing: DrawingContent, text: str) -> Shape:
    """Return the shape of everything that a drawing paints, for the spec of its file."""
    return _whole_shape(drawing, text, Spec.of(text), list(drawing.notes), "auto")


def _whole_shape(drawing: DrawingContent, text: str, spec: Spec, notes: list[str], trace: str) -> Shape:
    """Return the shape of everything that a drawing paints, in the tightest frame around all of it."""
    notes += dict.fromkeys(f"ignored: {error}" for _, error in drawing.refused)
    painted = _drawn_region(drawing, drawing.painted)
    ink = painted if drawing.ink is drawing.painted else _drawn_region(drawing, drawing.ink)
    frame = painted.tightest.outline
    if painted.is_one_part:
        largest = drawing.outlines[0]
        named_holes = _holes(drawing, largest) if len(largest.holes) == len(painted.holes) else {}
        holes: dict[str, Any] = named_holes or {"holes": tuple(painted.holes)}
    else:
        holes = {}
    return Shape(
        text,
        spec.path,
        frame,
        _box(drawing, frame.box),
        drawing.flip,
        {k: complex(_core(z, drawing.flip)) for k, z in drawing.pins.items()},
        {k: Curve.stroke(_core(z, drawing.flip), f"{spec.path}: {k}") for k, z in drawing.strokes.items()},
        tuple(dict.fromkeys(notes)),
        names=drawing.outlines[0].names,
        rigid=tuple(_core(z, drawing.flip) for z in drawing.rigid),
        pin_radii=drawing.pin_radii,
        millimetres=drawing.millimetres,
        unit=drawing.unit,
        georeference=drawing.georeference,
        drawing=painted,
        ink=ink,
        coloured=drawing.coloured,
        trace=trace,
        outlines=tuple(drawing.outlines) if spec.part is None else None,
        selected_outlines=tuple(drawing.outlines),
        **holes,
    )


def _drawn_region(drawing: DrawingContent, region: shapely.Geometry) -> Drawing:
    """Return a region of the file as a drawing in the core plane; the vertices of a single outline are kept exactly."""
    first = drawing.outlines[0]
    polygon = polygon_of(first.z, *first.holes)
    if len(drawing.outlines) == 1 and polygon.is_valid and np.isclose(polygon.area, region.area, rtol=1e-9):
        region = polygon
    upward = shapely.transform(region, lambda xy: xy * [1, -1]) if drawing.flip else region
    return Drawing(close_hairlines(shapely.make_valid(upward)))


def read_all(text: str, *, flatness: float = 1e-4, trace: str = "auto") -> list[Shape]:
    """Read all shapes that `file` or `file#part` draws, the largest first; drawn constraints are ignored.

    Raises:
        InputError: there is none, or as for `read`.
    """
    spec = Spec.of(text)
    drawing = read_drawing(spec, flatness=flatness, trace=trace)
    chosen = spec.among(drawing.ids)
    if chosen.number is not None or not drawing.outlines:
        return [read(text, flatness=flatness, trace=trace)]
    if chosen.part is not None and chosen.part not in drawing.ids:
        _choose(drawing, text, chosen)
    curves: dict[int, Curve] = {}
    notes = [*drawing.notes, *dict.fromkeys(f"ignored: {error}" for _, error in drawing.refused)]
    if drawing.pins or drawing.strokes or drawing.rigid:
        constraints = "pins, strokes and rigid regions" if drawing.rigid else "pins and strokes"
        notes.append(
            f"ignored the {constraints} drawn in it, because they only apply to a single shape; choose one with #id"
        )
    for number, outline in enumerate(drawing.outlines):
        try:
            curves[number] = Curve.domain(_core(outline.z, drawing.flip), f"{text}#{number + 1}")
        except InputError as error:
            notes.append(f"ignored: {error}")
        else:
            notes += outline.notes
    if not curves:
        raise InputError(f"{text}: contains no usable outline; {notes[-1]}")
    extent = bounding_box(np.array([curve.box for curve in curves.values()]))
    box, all_notes = _box(drawing, extent), tuple(dict.fromkeys(notes))
    return [
        Shape(
            *(text, spec.path, curve, box, drawing.flip, {}, {}, all_notes),
            part=f"{chosen.part or ''}#{number + 1}".removeprefix("#"),
            names=drawing.outlines[number].names,
            extent=extent,
            coloured=drawing.coloured,
            trace=trace,
            millimetres=drawing.millimetres,
            unit=drawing.unit,
            georeference=drawing.georeference,
            **_holes(drawing, drawing.outlines[number]),
        )
        for number, curve in curves.items()
    ]


def supported_suffix(path: Path) -> str:
    """Return the suffix of a file, checking that shapes can be read from it.

    Raises:
        InputError: they cannot.
    """
    suffix = formats.suffix_of(path)
    if suffix not in SUFFIXES:
        if path.is_dir():
            raise InputError(f"{path}: is a folder; name a file in it")
        if suffix in formats.WEB_FONTS:
            raise InputError(f"{path}: {formats.WEB_FONT}")
        kind = repr(path.suffix) if path.suffix else "a file without suffix"
        suffixes = sorted({*SUFFIXES, *formats.holding("mesh")})
        if str(path) == "-":
            raise InputError("-: shapes are not read from standard input; name a file")
        raise InputError(
            f"{path}: cannot read a shape from {kind}; {formats.remedy(path, 'shape', suffixes)}"
        )
    return suffix


def read_drawing(
    spec: Spec,
    *,
    flatness: float = 1e-4,
    max_bytes: int | None = None,
    max_segments: int | None = None,
    trace: str = "auto",
) -> DrawingContent:
    """Read everything that a file, or a part of it, draws, with the reader for its suffix.

    Raises:
        InputError: an unknown suffix, or an error of the reader.
    """
    if not 1e-9 <= flatness <= 0.1:
        raise InputError(f"flatness {flatness:g}: must be between 1e-9 and 0.1, relative to the shape's size")
    path, suffix = spec.path, supported_suffix(spec.path)
    if spec.part is not None and spec.number is None and without_box(path, spec.part) != spec.part:
        inner = Spec.of(f"{path}#{without_box(path, spec.part)}".removesuffix("#"))
        drawing = read_drawing(
            inner, flatness=flatness, max_bytes=max_bytes, max_segments=max_segments, trace=trace
        )
        if spec.part not in drawing.ids:  # no element has this name
            return _boxed(drawing, inner, spec.part)
    reader: Callable[..., DrawingContent] = READERS.get(suffix, silhouette.read)
    limits: dict[str, Any] = {"flatness": flatness} | ({"max_bytes": max_bytes} if max_bytes else {})
    limits |= {"max_segments": max_segments} if max_segments and reader is svg.read else {}
    limits |= {"trace": trace} if reader is silhouette.read else {}
    drawing = reader(path, spec.selection, **limits)
    if spec.number is not None and not drawing.outlines and not drawing.refused:
        drawing = reader(path, spec.part, **limits)
    if drawing.wrapped is not None and trace == "auto":
        with suppress(InputError):  # a picture that cannot be read is used as its rectangle
            if outlines := silhouette.of_wrapped(drawing.wrapped, flatness):
                drawing = replace(drawing, outlines=outlines, paint=None)
    if drawing.has_lines and drawing.outlines:
        with suppress(InputError):  # outlines can be used even if the drawing as a whole exceeds limits
            drawing.outlines.extend(_lines_apart(drawing))
            drawing.outlines.sort(key=lambda outline: -outline.area)
    return drawing


def without_box(path: Path, part: str) -> str:
    """Return a part without `#bbox` at its end, and in a font without `#canvas`; "" for the whole file."""
    boxes = (BBOX, CANVAS) if READERS.get(formats.suffix_of(path)) is lettering.read else (BBOX,)
    head, _, last = part.rpartition("#")
    return head if last in boxes else part


def _boxed(drawing: DrawingContent, spec: Spec, part: str) -> DrawingContent:
    """Return a drawing whose only outline is the bounding box of what it paints, or its canvas.

    Args:
        drawing: of a file, or a part of it.
        spec: of that file or part.
        part: the same with `#bbox` or `#canvas`.

    Raises:
        InputError: nothing is painted.
    """
    text = f"{spec.path}#{part}"
    selected = spec.among(drawing.ids)
    if selected.number is not None or not drawing.outlines or selected.part not in (None, *drawing.ids):
        outline, _ = _choose(drawing, text, selected, warn=False)
        painted: shapely.Geometry = polygon_of(outline.z)
    else:
        painted = drawing.painted
    left, low, right, high = painted.bounds
    name = "the bounding box"
    if part.rpartition("#")[2] == CANVAS and drawing.rectangle is not None:
        left, low, width, height = drawing.rectangle
        right, high, name = left + width, low + height, "the canvas"
    corners = np.array([left + 1j * low, right + 1j * low, right + 1j * high, left + 1j * high])
    box = FilledOutline(name, corners, (right - left) * (high - low))
    ids = {**drawing.ids, part: None}
    return replace(drawing, outlines=[box], refused=[], paint=None, has_lines=False, wrapped=None, ids=ids)


def _lines_apart(drawing: DrawingContent) -> list[FilledOutline]:
    """Return the parts of a drawing painted only by lines that touch no outline, such as the arcs of an icon."""
    parts = shapely.get_parts(drawing.painted)
    tree = shapely.STRtree(shapely.buffer([polygon_of(outline.z) for outline in drawing.outlines], 0))
    touching, _ = tree.query(parts, "intersects")
    lines = []
    for part in np.delete(parts, np.unique(touching)):
        if part.geom_type == "Polygon" and part.area > 0:
            outer, *holes = (
                complex_of(shapely.get_coordinates(ring)[:-1]) for ring in (part.exterior, *part.interiors)
            )
            area = shapely.Polygon(part.exterior).area
            lines.append(FilledOutline("a line", outer, area, tuple(holes)))
    return lines


def _choose(
    drawing: DrawingContent, text: str, spec: Spec, *, warn: bool = True
) -> tuple[FilledOutline, list[str]]:
    """Return the selected outline and notes; with `warn`, including notes on the other outlines."""
    outlines, number = drawing.outlines, spec.number
    if spec.part is not None and spec.part not in drawing.ids:
        raise InputError(
            f"{text}: there is no {spec.part!r} in the file; {suggested(spec.part, drawing.ids)}"
        )
    if number is not None and not 1 <= number <= len(outlines):
        raise InputError(
            f"{text}: there is no outline {number}; {'it' if spec.part else 'the file'} has {len(outlines)}"
        )
    largest = max(drawing.refused, key=lambda r: r[0], default=None)
    if largest and (not outlines or (number is None and largest[0] > outlines[0].area)):
        raise InputError(f"{text}: {largest[1]}")
    if not outlines:
        raise InputError(
            f"{text}: contains no outline; draw a closed path, convert text to paths in your drawing "
            "program, or set a word in a font with font.ttf#text=Hello"
        )
    outline = outlines[(number or 1) - 1]
    return outline, [*drawing.notes, *outline.notes, *(_left_out(drawing, outline) if warn else [])]


def _left_out(drawing: DrawingContent, outline: FilledOutline) -> list[str]:
    notes = []
    other_outlines = [o for o in drawing.outlines if o is not outline]
    if other_outlines:
        share = other_outlines[0].area / outline.area
        notes.append(
            f"ignored {len(other_outlines)} other outline{'s' * (len(other_outlines) > 1)}, the largest with "
            f"{share:.1%} of this one's area; #id or #2 selects another, --parts all maps all of them"
        )
    notes += dict.fromkeys(f"ignored: {error}" for _, error in drawing.refused)
    return notes


def _holes(drawing: DrawingContent, outline: FilledOutline) -> dict[str, Any]:
    """Return the outlines of holes, and the names of what is drawn in them, since holes have no names themselves."""
    candidates = [other for other in drawing.outlines if other.names and other is not outline]
    starts = np.array([candidate.z[0] for candidate in candidates], dtype=complex)
    return {
        "holes": tuple(_core(hole, drawing.flip) for hole in outline.holes),
        "hole_names": tuple(_names_in(Curve(hole), outline, candidates, starts) for hole in outline.holes),
    }


def _names_in(
    hole: Curve, outline: FilledOutline, candidates: Sequence[FilledOutline], starts: Complex
) -> tuple[str, ...]:
    """Return the names of what is drawn in a hole, except those of groups that contain the shape itself.

    `starts` has a point of each of the `candidates`.
    """
    low, high = hole.box
    is_near = (low.real <= starts.real) & (starts.real <= high.real)
    is_near &= (low.imag <= starts.imag) & (starts.imag <= high.imag)
    inside = [candidates[k] for k in np.flatnonzero(is_near).tolist() if hole.contains(candidates[k].z).all()]
    return tuple(
        dict.fromkeys(name for candidate in inside for name in candidate.names if name not in outline.names)
    )


def suggested(name: str, ids: Iterable[str]) -> str:
    """Return a hint for an unknown id: the most similar one, and a list of all."""
    from difflib import get_close_matches

    all_ids = list(ids)
    similar = get_close_matches(name, all_ids, 1)
    listed = f"has {_listed(all_ids)}"
    return f"did you mean '#{similar[0]}'? It {listed}" if similar else f"it {listed}"


def _listed(names: Iterable[str], most: int = 12) -> str:
    return first_names(list(names), most) or "no names"


def _box(drawing: DrawingContent, extent: Box) -> Box:
    if drawing.rectangle is None:
        return extent
    x, y, width, height = drawing.rectangle
    low = y + height if drawing.flip else y
    high = y if drawing.flip else y + height
    return complex(_core(complex(x, low), drawing.flip)), complex(
        _core(complex(x + width, high), drawing.flip)
    )


def _core(z, flip: bool):
    return z.conjugate() if flip else z
