"""Carry DXF drawings through maps, as DXF in millimetres, written by ezdxf.

The document is changed in place, so that layers, line types, text styles and everything else in it are kept. An entity
over which the map is a similarity is moved, rotated and scaled; arcs stay arcs there. Of others, lines become
polylines, arcs and polylines with arcs become polylines with arcs, ellipses and splines become splines, all within a
tolerance. Points and texts follow the map at their position. References to blocks stay references: to the same block if
the map is a similarity over it, otherwise to a block with the mapped content.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from ... import deadline
from ...arrays import Complex, Index, Real
from ...errors import InputError
from ...maps.approximation import AnyMap
from ...maps.arc_fit import refit_arcs
from ...maps.bezier_fit import refit
from ...plane import bounding_box
from ..outlines.dxf import contents, library, load, unit_of
from ..shapes.shape import Shape
from ..svg.affine import Affine
from ..svg.curves import Arc, Bezier, Piece
from ..svg.path_data import PenPath
from .clip import Span
from .mapping import CUT, LOST, OUTSIDE, PathMapping, Prepared, SubpathPlacement
from .regions import MapDomain

OPEN_TOLERANCE_SHARE = 1e-3
"""Of the tolerance: by how much a similarity may miss the image of an open line, which is joined to others."""
CLOSED_TOLERANCE_SHARE = 0.5
"""Of the tolerance: by how much it may miss the image of a closed line, or of a reference to a block."""
FITTED_TOLERANCE_SHARE = 0.8
"""Of the tolerance: allowed distance at the points at which a fit is compared, between which it can be larger."""
SAMPLES = np.arange(17) / 16  # parameters of a segment at which a map is compared with a similarity
WHOLE_TURN = 2 * np.pi * (1 - 1e-9)  # angles from which a circle or an ellipse is closed
ANCHORED = ("POINT", "TEXT", "MTEXT", "ATTRIB")
R12 = "AC1009"
"""The version without light polylines and splines."""
MILLIMETRES_CODE = 4  # of $INSUNITS
POLYLINE_FLAGS_OF_FRAMES = 16  # of vertices: control points of a smoothed polyline, which are not on it


@dataclass(eq=False)
class DrawnEntity:
    """Lines of an entity in the plane of the source, y down, as `PathMapping` takes them.

    Attributes:
        entity: the entity of ezdxf; a copy if it belongs to a block.
        runs: its lines.
        filled: whether it is an area.
        curved: whether its lines are ellipses or splines.
    """

    entity: Any
    runs: list[PenPath]
    filled: bool = False
    curved: bool = False
    markers: frozenset[str] = frozenset()
    copy: int | None = None

    @property
    def lined(self) -> bool:
        """Whether its lines are drawn, and not the area that they enclose."""
        return not self.filled

    @property
    def closed(self) -> bool:
        """Whether it has no ends that could be joined to others."""
        return self.filled or all(run.closed for run in self.runs)


@dataclass(eq=False)
class Reference:
    """A reference to a block, with the content of the block as the reference shows it."""

    entity: Any
    content: list[Any] = field(default_factory=list)

    def all_content(self) -> Iterator[Any]:
        """Yield everything in it, including the content of references in the block."""
        for entity in self.content:
            if isinstance(entity, Reference):
                yield from entity.all_content()
            else:
                yield entity


@dataclass(frozen=True)
class Plane:
    """Converts between the numbers of a drawing and a core plane: z = scale * number + foot.

    y of a drawing counts from the lower edge of the canvas, if the shape's file has y down.
    """

    scale: float
    foot: complex

    @classmethod
    def of(cls, shape: Shape, scale: float) -> Plane:
        """Return the plane of a shape; `scale` is the length of the drawing's unit in the shape's units."""
        return cls(scale, complex(0, shape.box[0].imag) if shape.flip else 0j)

    @property
    def to_down(self) -> Affine:
        """The map from the drawing's numbers to the core plane with y reversed."""
        return Affine(0, self.scale, complex(self.foot).conjugate())


def carry(
    path: Path,
    parts: Sequence[tuple[Shape, AnyMap]],
    target: Shape,
    output: Path,
    *,
    tolerance: float | None = None,
    default_tolerance: float,
) -> tuple[str, ...]:
    """Write a DXF drawing mapped by the maps of one or several shapes.

    Args:
        path: the drawing.
        parts: the shapes, each with its map, source → target, core plane; see `carry_parts`.
        target: the shape in whose plane the result lies; its unit determines the millimetres.
        output: the file to write.
        tolerance: in millimetres.
        default_tolerance: the tolerance if none is given, in the target's units.

    Returns:
        Notes on the unit, the tolerance, and what was cut or omitted.

    Raises:
        InputError: the drawing cannot be read, or nothing of it lies in the shapes.
    """
    unit = target.millimetres or 1.0
    within = tolerance / unit if tolerance else default_tolerance
    with library(path) as ezdxf:
        document = load(ezdxf, path)
        source, unit_length = parts[0][0], unit_of(document)
        scale = unit_length / source.millimetres if unit_length and source.millimetres else 1.0
        drawing = MappedDxf(ezdxf, document, path, Plane.of(source, scale), Plane.of(target, 1 / unit))
        drawing.carry(PathMapping(parts, within))
        document.header["$INSUNITS"], document.header["$MEASUREMENT"] = MILLIMETRES_CODE, 1
        document.audit()
        document.saveas(output)
    notes = [f"{number} × {note}" for note, number in sorted(drawing.notes.items())]
    return (*notes, *remarks(target, within * unit))


def remarks(target: Shape, tolerance: float) -> list[str]:
    """Return notes on the unit of a drawing in millimetres, and on its tolerance."""
    notes = [f"lines are within {tolerance:.3g} mm of their exact images"]
    if target.millimetres is None:
        notes.insert(0, f"{target.spec}: does not state a unit; one unit is written as 1 mm")
    return notes


def check(path: Path) -> None:
    """Check that a drawing can be read, before a map is solved for.

    Raises:
        InputError: it cannot.
    """
    with library(path) as ezdxf:
        load(ezdxf, path)


class MappedDxf:
    """A document whose entities are mapped in place.

    Attributes:
        notes: counts of content that was cut or omitted.
    """

    def __init__(self, ezdxf: Any, document: Any, path: Path, source: Plane, target: Plane):
        self.ezdxf, self.document, self.path = ezdxf, document, path
        self.source, self.target = source, target
        self.notes: Counter[str] = Counter()
        self.uses = Counter(
            str(entity.dxf.name) for block in document.blocks for entity in block if _is_reference(entity)
        )

    def carry(self, mapping: PathMapping) -> None:
        """Replace the content of the model space by its image.

        Raises:
            InputError: nothing is left of it.
        """
        space = self.document.modelspace()
        entities = list(space)
        content = [part for entity in entities for part in self._content(entity)]
        names = list(_names_inside(content))
        self.uses.update(names)
        self.fitted = _Fitted(
            mapping, self._drawn_entities(content), arcs_only=self.document.dxfversion == R12
        )
        self.mapping = mapping
        kept_ids: set[int] = set()
        low, high = self._write(content, space, 0j, kept_ids)
        for entity in entities:
            if id(entity) not in kept_ids:
                space.delete_entity(entity)
        if not len(space):
            raise InputError(f"{self.path}: nothing of it lies inside the source shape of the map")
        for name in set(names):  # blocks to which no reference is left
            with suppress(self.ezdxf.DXFError):
                self.document.blocks.delete_block(name)
        self.notes = +self.notes
        if np.isfinite([low, high]).all():
            header = self.document.header
            header["$EXTMIN"], header["$EXTMAX"] = (low.real, low.imag, 0.0), (high.real, high.imag, 0.0)
            middle = (low + high) / 2
            self.document.set_modelspace_vport(1.1 * (high - low).imag, (middle.real, middle.imag))

    def _content(self, entity: Any) -> Iterator[Any]:
        """Yield what is mapped of an entity: itself with its lines, or with its position, or as a reference."""
        kind = entity.dxftype()
        if kind == "INSERT":
            inside = contents(entity)
            yield Reference(entity, [mapped for part in inside for mapped in self._content(part)])
        elif kind in ANCHORED:
            yield entity
        elif runs := self._runs(entity):
            curved = kind in ("ELLIPSE", "SPLINE")
            yield DrawnEntity(entity, runs, filled=kind in AREAS, curved=curved)
        elif kind != "ATTDEF":
            self.notes[f"{kind}, omitted"] += 1

    def _drawn_entities(self, content: Sequence[Any]) -> list[DrawnEntity]:
        entities = [
            part
            for entity in content
            for part in (entity.all_content() if isinstance(entity, Reference) else [entity])
        ]
        return [entity for entity in entities if isinstance(entity, DrawnEntity)]

    def _runs(self, entity: Any) -> list[PenPath]:
        """Return the lines of an entity in the plane of the source, y down; none if it has no lines."""
        read_runs = RUNS.get(entity.dxftype())
        runs = read_runs(self.ezdxf, entity) if read_runs else []
        affine = self.source.to_down
        mapped_runs = [
            PenPath(affine(run.start), [piece.under(affine) for piece in run.pieces], run.closed)
            for run in runs
        ]
        return [run for run in mapped_runs if run.pieces]

    # Writing --------------------------------------------------------------------------------------------------------

    def _write(
        self, content: Sequence[Any], layout: Any, base: complex, kept_ids: set[int]
    ) -> tuple[complex, complex]:
        """Write the images of content into a layout, with positions relative to `base`.

        Entities that are changed in place are added to `kept`. Returns the corners of a box around the images.
        """
        box = [complex(np.inf, np.inf), complex(-np.inf, -np.inf)]
        for item in content:
            deadline.check("writing DXF")
            if isinstance(item, Reference):
                z = self._write_reference(item, layout, base, kept_ids)
            elif isinstance(item, DrawnEntity):
                z = self._write_lines(item, layout, base, kept_ids)
            else:
                z = self._write_anchored(item, layout, base, kept_ids)
            if z.size:
                low, high = bounding_box(z)
                box = [
                    complex(min(box[0].real, low.real), min(box[0].imag, low.imag)),
                    complex(max(box[1].real, high.real), max(box[1].imag, high.imag)),
                ]
        return box[0], box[1]

    def _write_reference(
        self, reference: Reference, layout: Any, base: complex, kept_ids: set[int]
    ) -> Complex:
        """Write a reference to a block, or to a new block with the mapped content. Returns points of its image."""
        entity, drawn_entities = reference.entity, self._drawn_entities([reference])
        images = [self.fitted.of(part) for part in drawn_entities]
        points = np.concatenate([np.empty(0, complex), *(image.w for image in images)])
        if (
            drawn_entities
            and not any(image.cut for image in images)
            and len({image.region for image in images}) == 1
        ):
            z = np.concatenate([image.z for image in images])
            similarity = _similarity(z, points)
            if similarity.error <= CLOSED_TOLERANCE_SHARE * self.mapping.tolerance:
                self._move(entity, similarity, layout, base, kept_ids)
                return self._numbers(points)
        position = _position(entity)
        reference_similarity = self._local(position)
        origin = self._numbers(np.array([reference_similarity.w]))[0] if reference_similarity else 0j
        block = self._block_for(str(entity.dxf.name))
        low, high = self._write(reference.content, block, complex(origin), kept_ids)
        if not len(block):
            self.document.blocks.delete_block(block.name, safe=False)
            return np.empty(0, complex)
        for attribute in list(entity.attribs):
            attribute_similarity = self._local(_position(attribute)) or reference_similarity
            if attribute_similarity:
                attribute.transform(self._matrix(attribute_similarity, base))
            else:
                entity.attribs.remove(attribute)
                self.notes[OUTSIDE] += 1
        entity.dxf.name = block.name
        entity.dxf.extrusion = (0, 0, 1)
        entity.dxf.insert = ((origin - base).real, (origin - base).imag, 0)
        entity.dxf.xscale = entity.dxf.yscale = entity.dxf.zscale = 1
        entity.dxf.rotation, entity.dxf.row_count, entity.dxf.column_count = 0, 1, 1
        self._keep(entity, layout, kept_ids)
        return np.array([low, high]) if np.isfinite([low, high]).all() else np.empty(0, complex)

    def _block_for(self, name: str) -> Any:
        """Return an empty block: the one with this name if it has no other references, else a new one."""
        blocks = self.document.blocks
        if self.uses[name] <= 2 and name in blocks:  # in the document itself, and as it is realized here
            block = blocks.get(name)
            block.delete_all_entities()
            block.block.dxf.base_point = (0, 0, 0)
            self.uses[name] = 3
            return block
        number = 2
        while f"{name}_{number}" in blocks:
            number += 1
        return blocks.new(f"{name}_{number}")

    def _write_lines(self, item: DrawnEntity, layout: Any, base: complex, kept_ids: set[int]) -> Complex:
        image = self.fitted.of(item)
        placements = image.fills or image.lines
        if not placements or not np.isfinite(image.w).all():
            self.notes[LOST if placements else OUTSIDE] += 1
            return np.empty(0, complex)
        self.notes[CUT] += image.cut
        share = CLOSED_TOLERANCE_SHARE if item.closed else OPEN_TOLERANCE_SHARE
        similarity = _similarity(image.z, image.w)
        if not image.cut and similarity.error <= share * self.mapping.tolerance:
            self._move(item.entity, similarity, layout, base, kept_ids)
            return self._numbers(image.w)
        attributes = item.entity.graphic_properties()
        if item.filled:
            self._add_area(item, image, layout, base, attributes, kept_ids)
        else:
            for placement, pieces in zip(image.lines, image.line_fits):
                if image.as_splines:
                    self._add_spline(pieces, layout, base, attributes)
                else:
                    width = (
                        _width(item.entity) * abs(similarity.alpha) * self.source.scale / self.target.scale
                    )
                    self._add_polyline(item, placement, pieces, layout, base, attributes, width)
        return self._numbers(image.w)

    def _add_polyline(
        self,
        item: DrawnEntity,
        placement: SubpathPlacement,
        pieces: Sequence[tuple[Complex, Real]],
        layout: Any,
        base: complex,
        attributes: dict[str, Any],
        width: float,
    ) -> None:
        """Add the image of lines and arcs: as a line or an arc if it is one, else as a polyline."""
        vertices, bulges = self._polyline(pieces, base)
        kind = item.entity.dxftype()
        if kind == "LINE" and bulges.size == 1:
            layout.add_line(*([z.real, z.imag] for z in vertices), dxfattribs=attributes)
        elif kind == "ARC" and bulges.size == 1 and bulges[0]:
            ends = [(z.real, z.imag) for z in vertices]
            centre, begin, end, radius = self.ezdxf.math.bulge_to_arc(*ends, float(bulges[0]))
            angles = np.degrees([begin, end])
            layout.add_arc(centre, radius, float(angles[0]), float(angles[1]), dxfattribs=attributes)
        else:
            if placement.closed:
                vertices = vertices[:-1]
            else:
                bulges = np.append(bulges, 0.0)
            points = np.column_stack([vertices.real, vertices.imag, bulges]).tolist()
            add = layout.add_polyline2d if self.document.dxfversion == R12 else layout.add_lwpolyline
            line = add(points, format="xyb", close=placement.closed, dxfattribs=attributes)
            if width and self.document.dxfversion != R12:
                line.dxf.const_width = width

    def _add_spline(
        self, pieces: Sequence[Complex], layout: Any, base: complex, attributes: dict[str, Any]
    ) -> None:
        """Add cubic Béziers, each of which begins where the one before ends, as a cubic spline."""
        cubics = self._numbers(np.concatenate(pieces).ravel()).reshape(-1, 4) - base
        math = self.ezdxf.math
        curves = [math.Bezier4P([math.Vec3(z.real, z.imag, 0) for z in cubic]) for cubic in cubics]
        spline = layout.add_spline(dxfattribs=attributes)
        spline.apply_construction_tool(math.bezier_to_bspline(curves))

    def _add_area(
        self,
        item: DrawnEntity,
        image: _Image,
        layout: Any,
        base: complex,
        attributes: dict[str, Any],
        kept_ids: set[int],
    ) -> None:
        """Replace the boundary of a hatch; other filled areas become solid hatches."""
        if item.entity.dxftype() == "HATCH":
            hatch = item.entity
            hatch.paths.clear()
            hatch.dxf.associative = 0
            hatch.dxf.elevation, hatch.dxf.extrusion = (0, 0, 0), (0, 0, 1)
            self._keep(hatch, layout, kept_ids)
        elif self.document.dxfversion == R12:
            self.notes[f"{item.entity.dxftype()}, omitted"] += 1
            return
        else:
            hatch = layout.add_hatch(dxfattribs=attributes)
            hatch.dxf.color = attributes.get("color", 256)
        for pieces in image.fill_fits or image.line_fits:
            vertices, bulges = self._polyline(pieces, base)
            points = np.column_stack([vertices.real[:-1], vertices.imag[:-1], bulges]).tolist()
            hatch.paths.add_polyline_path(points, is_closed=True)

    def _polyline(self, pieces: Sequence[tuple[Complex, Real]], base: complex) -> tuple[Complex, Real]:
        """Return vertices and bulges of consecutive pieces."""
        vertices = np.concatenate(
            [part[: 1 if k == 0 else 0] for k, (part, _) in enumerate(pieces)]
            + [part[1:] for part, _ in pieces]
        )
        return self._numbers(vertices) - base, np.concatenate([bulges for _, bulges in pieces])

    def _write_anchored(self, entity: Any, layout: Any, base: complex, kept_ids: set[int]) -> Complex:
        """Move a point or a text by the similarity that the map is near its position."""
        similarity = self._local(_position(entity))
        if similarity is None:
            self.notes[OUTSIDE] += 1
            return np.empty(0, complex)
        self._move(entity, similarity, layout, base, kept_ids)
        return self._numbers(np.array([similarity.w]))

    def _move(
        self, entity: Any, similarity: _Similarity, layout: Any, base: complex, kept_ids: set[int]
    ) -> None:
        entity.transform(self._matrix(similarity, base))
        self._keep(entity, layout, kept_ids)

    def _keep(self, entity: Any, layout: Any, kept_ids: set[int]) -> None:
        """Keep a changed entity in its layout; copies of a block's content are added to theirs."""
        kept_ids.add(id(entity))
        if entity.is_virtual:
            layout.add_entity(entity)

    def _numbers(self, w: Complex) -> Complex:
        """Convert points of the target's core plane to numbers of the output."""
        return (w - self.target.foot) / self.target.scale

    def _matrix(self, similarity: _Similarity, base: complex) -> Any:
        """Return the matrix of ezdxf for a similarity of core planes."""
        factor = similarity.alpha * self.source.scale / self.target.scale
        origin = similarity.alpha * self.source.foot + similarity.beta
        move = self._numbers(np.array([origin]))[0] - base
        a, b = factor.real, factor.imag
        rows = [a, b, 0, 0, -b, a, 0, 0, 0, 0, abs(factor), 0, move.real, move.imag, 0, 1]
        return self.ezdxf.math.Matrix44([float(x) for x in rows])

    def _local(self, position: complex) -> _Similarity | None:
        """Return the similarity part of the map at a position of the drawing; None outside of all shapes."""
        z = self.source.scale * position + self.source.foot
        for region in self.mapping.regions.all:
            if shapely.contains_xy(region.domain.reach, z.real, z.imag):
                place = np.array([z])
                foot, w, alpha, beta = region.jet(place)
                images = w + alpha * (place - foot) + beta * (place - foot).conj()
                if np.isfinite(images[0]) and np.isfinite(alpha[0]) and alpha[0]:
                    factor = alpha[0]
                    return _Similarity(
                        complex(factor), complex(images[0] - factor * z), 0.0, complex(images[0])
                    )
        return None


@dataclass(frozen=True)
class _Similarity:
    """The map w = alpha z + beta between core planes, its largest error at given points, and one of its images."""

    alpha: complex
    beta: complex
    error: float
    w: complex = 0j


def _similarity(z: Complex, w: Complex) -> _Similarity:
    """Return the similarity that is nearest to a map, given points (p,) and their images."""
    middle, image = z.mean(), w.mean()
    spread = float((np.abs(z - middle) ** 2).sum())
    if not spread:
        return _Similarity(1, complex(image - middle), float("inf"))
    alpha = complex(((w - image) * (z - middle).conj()).sum() / spread)
    beta = complex(image - alpha * middle)
    return _Similarity(alpha, beta, float(np.abs(alpha * z + beta - w).max()) if alpha else float("inf"))


@dataclass(frozen=True, eq=False)
class _Image:
    """The image of an entity's lines in the core plane of the target.

    Attributes:
        z, w: points on what is left of it, and their images.
        region: the domain that contains it; None if there are several.
        cut: whether anything was cut off.
        lines, fills: its subpaths; those of the fill, if they differ.
        line_fits, fill_fits: for each subpath, the vertices and bulges, or the control points, of each piece.
        as_splines: whether the pieces are control points.
    """

    z: Complex
    w: Complex
    region: MapDomain | None
    cut: bool
    lines: list[SubpathPlacement]
    fills: list[SubpathPlacement]
    line_fits: list[list[Any]]
    fill_fits: list[list[Any]]
    as_splines: bool


class _Fitted:
    """The images of all lines of a drawing, which are fitted together."""

    def __init__(self, mapping: PathMapping, entities: Sequence[DrawnEntity], *, arcs_only: bool):
        self.prepared = mapping.prepare(entities) if entities else None
        self._numbers = {entity: number for number, entity in enumerate(entities)}
        if self.prepared is None:
            return
        prepared = self.prepared
        counts = [sum(len(run.pieces) for run in (*part.fill, *part.line)) for part in prepared.parts]
        self._first = np.cumsum([0, *counts])
        splines = np.repeat([entity.curved and not arcs_only for entity in entities], counts)
        straight = np.array([
            _is_straight(piece) for part in prepared.parts for run in (*part.fill, *part.line) for piece in run.pieces
        ], dtype=bool)  # fmt: skip
        self._splines = [entity.curved and not arcs_only for entity in entities]
        self._fits: list[Any] = [None] * len(prepared.owners)

        def part(numbers: Index) -> Any:
            return lambda segment, t: _images(prepared, numbers[segment], t)[1]

        within = FITTED_TOLERANCE_SHARE * mapping.tolerance
        cubic, not_cubic = np.flatnonzero(splines), np.flatnonzero(~splines)
        if cubic.size:
            for number, fit in zip(cubic, refit(part(cubic), cubic.size, within)):
                self._fits[number] = fit
        if not_cubic.size:
            for number, pair in zip(not_cubic, refit_arcs(part(not_cubic), straight[not_cubic], within)):
                self._fits[number] = pair
        segment = np.repeat(np.arange(len(prepared.owners)), SAMPLES.size)
        self._z, self._w = _images(prepared, segment, np.tile(SAMPLES, len(prepared.owners)))

    def of(self, entity: DrawnEntity) -> _Image:
        """Return the image of one entity."""
        assert self.prepared is not None
        number = self._numbers[entity]
        fill, line, _ = self.prepared.parts[number]
        first, last = self._first[number], self._first[number + 1]
        fits = iter(self._fits[first:last])
        fill_fits, line_fits = ([[next(fits) for _ in run.pieces] for run in kind] for kind in (fill, line))
        owners = set(self.prepared.owners[first:last])
        sampled = slice(first * SAMPLES.size, last * SAMPLES.size)
        return _Image(
            self._z[sampled],
            self._w[sampled],
            owners.pop() if len(owners) == 1 else None,
            self.prepared.clipped[number].cut,
            line,
            fill,
            line_fits,
            fill_fits,
            self._splines[number] and not entity.filled,
        )


def _images(prepared: Prepared, segment: NDArray[np.intp], t: Real) -> tuple[Complex, Complex]:
    """Return points on segments, and their images; beyond the domain's outline the map continues linearly.

    The outline of the domain is flattened, but that of the drawing is not.
    """
    z = prepared.places(segment, t)
    foot, w, alpha, beta = prepared.jet(segment, z)
    away = z - foot
    return z, np.where(away == 0, w, w + alpha * away + beta * away.conj())


def _is_straight(piece: Any) -> bool:
    piece_or_curve = piece.whole if isinstance(piece, Span) else piece
    return not isinstance(piece_or_curve, Piece) or (
        isinstance(piece_or_curve, Bezier) and len(piece_or_curve.p) == 2
    )


def _is_reference(entity: Any) -> bool:
    return bool(entity.dxftype() == "INSERT")


def _names_inside(content: Sequence[Any]) -> Iterator[str]:
    """Yield the names of the blocks that references in some content show."""
    for part in content:
        if isinstance(part, Reference):
            yield str(part.entity.dxf.name)
            yield from _names_inside(part.content)


def _position(entity: Any) -> complex:
    """Return the position of a point, a text or a reference."""
    kind = entity.dxftype()
    point = entity.dxf.location if kind == "POINT" else entity.dxf.insert
    if kind in ("TEXT", "ATTRIB", "INSERT"):
        point = entity.ocs().to_wcs(point)
    return complex(point.x, point.y)


def _width(entity: Any) -> float:
    """Return the width of a polyline, if it has the same everywhere."""
    width = entity.dxf.get("const_width", 0) if entity.dxftype() == "LWPOLYLINE" else 0
    return float(width or 0)


# Lines of entities, in the numbers of the drawing ------------------------------------------------------------------


def _complex(point: Any) -> complex:
    return complex(point.x, point.y)


def _line(ezdxf: Any, entity: Any) -> list[PenPath]:
    a, b = _complex(entity.dxf.start), _complex(entity.dxf.end)
    return [PenPath(a, [Bezier((a, b))])] if a != b else []


def _arc(ezdxf: Any, entity: Any) -> list[PenPath]:
    """Return an arc, or a circle as two halves."""
    ocs, radius = entity.ocs(), entity.dxf.radius
    middle = ocs.to_wcs(entity.dxf.center)

    def from_middle(x: float, y: float) -> complex:
        return _complex(ocs.to_wcs(entity.dxf.center + ezdxf.math.Vec3(x, y))) - _complex(middle)

    u, v = from_middle(radius, 0), from_middle(0, radius)
    if entity.dxftype() == "CIRCLE":
        begin, sweep = 0.0, 2 * np.pi
    else:
        begin = np.radians(entity.dxf.start_angle)
        sweep = np.radians((entity.dxf.end_angle - entity.dxf.start_angle) % 360) or 2 * np.pi
    return _elliptic(_complex(middle), u, v, begin, sweep) if radius > 0 else []


def _ellipse(ezdxf: Any, entity: Any) -> list[PenPath]:
    begin, end = entity.dxf.start_param, entity.dxf.end_param
    sweep = (end - begin) % (2 * np.pi) or 2 * np.pi
    u, v = _complex(entity.dxf.major_axis), _complex(entity.minor_axis)
    return _elliptic(_complex(entity.dxf.center), u, v, begin, sweep)


def _elliptic(centre: complex, u: complex, v: complex, begin: float, sweep: float) -> list[PenPath]:
    """Return an elliptical arc, in two halves if it is more than half of the ellipse."""
    cuts = np.linspace(begin, begin + sweep, 3 if sweep > np.pi * (1 + 1e-9) else 2)
    points = centre + u * np.cos(cuts) + v * np.sin(cuts)
    closed = sweep >= WHOLE_TURN
    if closed:
        points[-1] = points[0]
    step = float(cuts[1] - cuts[0])
    pieces = [Arc(centre, u, v, float(cut), step, complex(end)) for cut, end in zip(cuts[:-1], points[1:])]
    return [PenPath(complex(points[0]), list[Piece](pieces), closed)]


def _polyline(ezdxf: Any, entity: Any) -> list[PenPath]:
    """Return a polyline, whose sides are lines and arcs; meshes that DXF stores as polylines have none."""
    if entity.dxftype() == "LWPOLYLINE":
        vertices = [(ezdxf.math.Vec3(x, y), bulge) for x, y, bulge in entity.get_points("xyb")]
        ocs, closed = entity.ocs(), bool(entity.closed)
    elif entity.is_2d_polyline or entity.is_3d_polyline:
        on_line = [vertex for vertex in entity.vertices if not vertex.dxf.flags & POLYLINE_FLAGS_OF_FRAMES]
        vertices = [(vertex.dxf.location, vertex.dxf.get("bulge", 0)) for vertex in on_line]
        ocs, closed = entity.ocs() if entity.is_2d_polyline else None, bool(entity.is_closed)
    else:
        return []
    z = np.array([_complex(ocs.to_wcs(point) if ocs else point) for point, _ in vertices])
    mirrored = ocs is not None and ocs.transform and entity.dxf.extrusion.z < 0
    bulges = [-bulge if mirrored else bulge for _, bulge in vertices]
    ends = np.append(z[1:], z[:1]) if closed else z[1:]
    pieces = [_side(complex(a), complex(b), bulge) for a, b, bulge in zip(z, ends, bulges) if a != b]
    return [PenPath(complex(z[0]), pieces, closed)] if pieces else []


def _side(a: complex, b: complex, bulge: float) -> Piece:
    """Return the side of a polyline from a to b."""
    if not bulge:
        return Bezier((a, b))
    centre = (a + b) / 2 + 1j * (b - a) * (1 - bulge**2) / (4 * bulge)
    radius = abs(a - centre)
    begin = float(np.angle(a - centre))
    return Arc(centre, radius, 1j * radius, begin, float(4 * np.arctan(bulge)), b)


def _spline(ezdxf: Any, entity: Any) -> list[PenPath]:
    path = ezdxf.path.make_path(entity)
    return [_pen_path(ezdxf, path, closed=path.is_closed)] if len(path) else []


def _hatch(ezdxf: Any, entity: Any) -> list[PenPath]:
    paths = [path for path in ezdxf.path.from_hatch(entity) if len(path)]
    return [_pen_path(ezdxf, path, closed=True) for path in paths]


def _pen_path(ezdxf: Any, path: Any, *, closed: bool) -> PenPath:
    """Return a path of ezdxf as a subpath."""
    start = current = _complex(path.start)
    pieces = list[Piece]()
    for command in path.commands():
        controls = [
            _complex(getattr(command, name)) for name in ("ctrl", "ctrl1", "ctrl2") if hasattr(command, name)
        ]
        end = _complex(command.end)
        if controls or end != current:
            pieces.append(Bezier((current, *controls, end)))
        current = end
    if closed and current != start:
        pieces.append(Bezier((current, start)))
    return PenPath(start, pieces, closed)


def _solid(ezdxf: Any, entity: Any) -> list[PenPath]:
    """Return the outline of a filled triangle or quadrilateral."""
    z = np.array([_complex(point) for point in entity.wcs_vertices(close=False)])
    pieces = [Bezier((complex(a), complex(b))) for a, b in zip(z, np.append(z[1:], z[:1])) if a != b]
    return [PenPath(complex(z[0]), list[Piece](pieces), True)] if len(pieces) > 2 else []


AREAS = ("HATCH", "SOLID", "TRACE")
RUNS = {
    "LINE": _line,
    "ARC": _arc,
    "CIRCLE": _arc,
    "ELLIPSE": _ellipse,
    "LWPOLYLINE": _polyline,
    "POLYLINE": _polyline,
    "SPLINE": _spline,
    "HATCH": _hatch,
    "SOLID": _solid,
    "TRACE": _solid,
}
"""The lines of each kind of entity."""
