"""Closed lines of DXF drawings, read by ezdxf.

These are polylines with bulges, splines, circles, ellipses, and chains of lines and arcs. y points up; units are the
file's. Loops inside each other on a layer are holes; names are those of layers, and of the blocks that they belong to.
"""

import json
import os
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from ... import deadline
from ...arrays import Complex, complex_of, xy_of
from ...errors import InputError
from ...plane import diagonal
from .. import extras, files, limits
from ..svg.drawing_content import DrawingContent

JOINED_DIAGONAL_SHARE = 1e-6  # of the drawing's diagonal: ends at most this far apart are joined
NO_FONTS = {"version": 2, "font-faces": []}
"""An empty font list in ezdxf's format, so that ezdxf does not scan the system's fonts. It is rebuilt for other
versions.
"""
DRAWN = {"LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE", "HATCH", "MPOLYGON", "SOLID"}
READER_ERRORS = (
    OSError,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    AssertionError,
    RecursionError,
)
"""What ezdxf raises for damaged drawings, besides its own errors."""
MILLIMETRES = {1: 25.4, 2: 304.8, 4: 1.0, 5: 10.0, 6: 1000.0, 8: 25.4e-6, 9: 0.0254, 10: 914.4, 14: 100.0}
"""Millimetres in a unit, for values of the header variable $INSUNITS."""


def read(
    path: Path, selection: str | None = None, *, flatness: float = 1e-4, max_bytes: int = limits.DRAWING_BYTES
) -> DrawingContent:
    """Return the closed outlines in the drawing's model space, including blocks.

    Args:
        path: the file.
        selection: a layer, or a block of whose references the outlines are returned.
        flatness: tolerance of flattened curves relative to their size.
        max_bytes: largest size of the file.

    Raises:
        InputError: ezdxf is not installed, or the file is not a DXF drawing.
    """
    curves = defaultdict[str, list[_Curve]](list)
    with library(path) as ezdxf:
        document = load(ezdxf, path, max_bytes)
        for entity, blocks in drawn_entities(document.modelspace()):
            for part in _paths(ezdxf, entity):
                ends = np.array([[v.x, v.y] for v in part.control_vertices()])
                tolerance = max(flatness * float(np.linalg.norm(np.ptp(ends, axis=0))), 1e-300)
                z = complex_of(np.array([[v.x, v.y] for v in part.flattening(tolerance)]))
                curves[str(entity.dxf.layer)].append(_Curve(z, blocks))
        millimetres = unit_of(document)
    if not curves:
        raise InputError(f"{path}: contains no lines in model space")
    lines = [curve.z for layer_curves in curves.values() for curve in layer_curves]
    if not all((np.abs(z) <= limits.SVG_NUMBER).all() for z in lines):
        raise InputError(f"{path}: a coordinate is not finite, or too large")
    inserted = {name for layer_curves in curves.values() for curve in layer_curves for name in curve.blocks}
    drawing = DrawingContent(
        [], None, flip=False, ids=dict.fromkeys([*curves, *sorted(inserted)]), millimetres=millimetres
    )
    joining_distance = JOINED_DIAGONAL_SHARE * diagonal(np.concatenate(lines))
    for layer, layer_curves in curves.items():
        selected = [
            curve for curve in layer_curves if selection is None or selection in (layer, *curve.blocks)
        ]
        if selected:
            _add(drawing, layer, selected, joining_distance)
    drawing.outlines.sort(key=lambda outline: -outline.area)
    return drawing


class _Curve(NamedTuple):
    """A flattened line or curve, and the names of the blocks that contain it."""

    z: Complex
    blocks: tuple[str, ...]


@contextmanager
def library(path: Path | str) -> Iterator[Any]:
    """Provide ezdxf; its errors, which concern a file, become errors of the input.

    Raises:
        InputError: ezdxf is not installed, or an error of ezdxf.
    """
    with _without_fonts():
        ezdxf = extras.load(f"{path}: reading DXF", "ezdxf", "disassemble", "path", "recover")
    try:
        yield ezdxf
    except InputError:
        raise
    except (ezdxf.DXFError, *READER_ERRORS) as error:
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise InputError(f"{path}: cannot read this DXF drawing: {reason}") from None


def load(ezdxf: Any, path: Path, max_bytes: int = limits.DRAWING_BYTES) -> Any:
    """Return a drawing as ezdxf's document, repaired where that is possible.

    Raises:
        InputError: the file is missing or too large, or shows too much.
    """
    files.open_input(path, max_bytes=max_bytes)
    document, _ = ezdxf.recover.readfile(path)
    with suppress(RecursionError):
        if _count_shown(document, document.modelspace(), {}) <= limits.DXF_ENTITIES:
            return document
    raise InputError(
        f"{path}: shows more than {limits.DXF_ENTITIES} entities, or blocks nested more than {limits.DXF_DEPTH} deep; "
        "split the drawing"
    )


def unit_of(document: Any) -> float | None:
    """Return the length of a drawing's unit in millimetres; None if the drawing does not state it."""
    return MILLIMETRES.get(int(document.header.get("$INSUNITS", 0)))


def contents(entity: Any) -> Iterator[Any]:
    """Yield the entities of the block that an INSERT entity shows, in the drawing's coordinates."""
    for reference in entity.multi_insert() if entity.mcount > 1 else [entity]:
        yield from reference.virtual_entities()


def _count_shown(document: Any, layout: Any, counts: dict[str, int], depth: int = 0) -> int:
    """Return the number of entities that a layout shows, with those of all references to blocks.

    Args:
        document: the drawing.
        layout: the model space or a block.
        counts: the numbers of blocks, by name.
        depth: of the blocks around this one.

    Raises:
        RecursionError: blocks are nested too deeply, or contain themselves.
    """
    if depth > limits.DXF_DEPTH:
        raise RecursionError
    count = 0
    for entity in layout:
        count += 1
        if entity.dxftype() == "INSERT" and (block := document.blocks.get(entity.dxf.name)) is not None:
            if block.name not in counts:
                counts[block.name] = _count_shown(document, block, counts, depth + 1)
            count += max(entity.mcount, 1) * counts[block.name]
    return count


def drawn_entities(
    entities: Iterable[Any], blocks: tuple[str, ...] = (), *, everything: bool = False
) -> Iterator[tuple[Any, tuple[str, ...]]]:
    """Yield lines and areas, including those of block references, with the names of the blocks around each.

    With `everything`, entities of other kinds are among them.
    """
    for entity in entities:
        deadline.check("reading it")
        if entity.dxftype() == "INSERT":
            inside = (*blocks, str(entity.dxf.name))
            yield from drawn_entities(contents(entity), inside, everything=everything)
        elif everything or entity.dxftype() in DRAWN:
            yield entity, blocks


def _paths(ezdxf: Any, entity: Any) -> list[Any]:
    """Return the lines and curves of an entity as paths of ezdxf."""
    filled = entity.dxftype() in ("HATCH", "MPOLYGON")
    parts = ezdxf.path.from_hatch(entity) if filled else [ezdxf.path.make_path(entity)]
    return [part for part in parts if part.has_lines or part.has_curves]


@contextmanager
def _without_fonts() -> Iterator[None]:
    """Prevent ezdxf from scanning the system's fonts when it is imported, and from storing a list of them.

    ezdxf reads such a list from the cache folder if there is one; this provides an empty list in a temporary folder.
    Lines need no fonts.
    """
    old_value = os.environ.get("XDG_CACHE_HOME")
    with files.scratch() as folder:
        (folder / "ezdxf").mkdir()
        (folder / "ezdxf" / "font_manager_cache.json").write_text(json.dumps(NO_FONTS))
        os.environ["XDG_CACHE_HOME"] = str(folder)
        try:
            yield
        finally:
            os.environ.pop("XDG_CACHE_HOME")
            if old_value is not None:
                os.environ["XDG_CACHE_HOME"] = old_value


def _add(drawing: DrawingContent, layer: str, curves: list[_Curve], joining_distance: float) -> None:
    """Add a layer's closed loops to the drawing, and a note on open lines."""
    closed, open_lines = list[Complex](), list[Complex]()
    for z, _ in curves:
        (closed if z.size > 2 and abs(z[0] - z[-1]) <= joining_distance else open_lines).append(z)
    joined = shapely.set_precision(
        [shapely.LineString(xy_of(z)) for z in open_lines], joining_distance, mode="pointwise"
    )
    chains = shapely.get_parts(shapely.line_merge(shapely.union_all(joined))) if open_lines else []
    opened = 0
    for chain in chains:
        if chain.is_closed and not chain.is_empty:
            closed.append(complex_of(shapely.get_coordinates(chain)))
        else:
            opened += not chain.is_empty
    if opened:
        drawing.notes.append(f"ignored {opened} open lines of layer {layer!r}")
    if not closed:
        return
    first = len(drawing.outlines)
    drawing.add(closed, "evenodd", repr(layer), (layer,))
    if any(curve.blocks for curve in curves):
        lines = shapely.STRtree([shapely.LineString(xy_of(curve.z)) for curve in curves])
        for number, outline in enumerate(drawing.outlines[first:], start=first):
            nearest = curves[lines.nearest(shapely.Point(outline.z[0].real, outline.z[0].imag))]
            drawing.outlines[number] = replace(outline, names=(layer, *nearest.blocks))
