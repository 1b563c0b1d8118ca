"""Closed lines of DXF drawings, read by ezdxf.

These are polylines with bulges, splines, circles, ellipses, and chains of lines and arcs. y points up; units are the
file's. Loops inside each other on a layer are holes; names are those of layers.
"""

import json
import os
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from ...arrays import Complex, complex_of, xy_of
from ...errors import InputError
from ...plane import diagonal
from .. import files, limits
from ..svg.drawing import Drawing

JOINED_DIAGONAL_SHARE = 1e-6  # of the drawing's diagonal: ends at most this far apart are joined
NO_FONTS = {"version": 2, "font-faces": []}
"""An empty font list in ezdxf's format, so that ezdxf does not scan the system's fonts. It is rebuilt for other
versions.
"""
DRAWN = {"LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE", "HATCH", "MPOLYGON", "SOLID"}


def read(
    path: Path, chosen: str | None = None, *, flatness: float = 1e-4, max_bytes: int = limits.DRAWING_BYTES
) -> Drawing:
    """Return the closed outlines in the drawing's model space, including blocks, or on the layer `chosen`.

    Raises:
        InputError: ezdxf is not installed, or the file is not a DXF drawing.
    """
    try:
        with _without_fonts():
            import ezdxf
            from ezdxf import disassemble, recover
            from ezdxf import path as paths
    except ImportError:
        raise InputError(f"{path}: reading DXF needs the package ezdxf: pip install 'iccm[dxf]'") from None
    files.open_input(path, max_bytes=max_bytes)
    curves = defaultdict[str, list[Complex]](list)
    try:
        document, _ = recover.readfile(path)
        found = []
        entities: Any = disassemble.recursive_decompose(document.modelspace())
        for entity in entities:
            if entity.dxftype() in DRAWN:
                kind = entity.dxftype() in ("HATCH", "MPOLYGON")
                parts = list(paths.from_hatch(entity)) if kind else [paths.make_path(entity)]
                found += [
                    (str(entity.dxf.layer), part) for part in parts if part.has_lines or part.has_curves
                ]
        for layer, part in found:
            ends = np.array([[v.x, v.y] for v in part.control_vertices()])
            tolerance = max(flatness * float(np.linalg.norm(np.ptp(ends, axis=0))), 1e-300)
            curves[layer].append(complex_of(np.array([[v.x, v.y] for v in part.flattening(tolerance)])))
    except (ezdxf.DXFError, OSError, ValueError, TypeError, KeyError, IndexError, AttributeError) as error:
        said = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise InputError(f"{path}: cannot read this DXF drawing: {said}") from None
    if not curves:
        raise InputError(f"{path}: contains no lines in model space")
    if not all((np.abs(z) <= limits.SVG_NUMBER).all() for each in curves.values() for z in each):
        raise InputError(f"{path}: a coordinate is not finite, or too large")
    drawing = Drawing([], None, flip=False, ids=dict.fromkeys(curves))
    near = JOINED_DIAGONAL_SHARE * diagonal(np.concatenate([z for each in curves.values() for z in each]))
    for layer in curves if chosen is None else {chosen} & curves.keys():
        _add(drawing, layer, curves[layer], near)
    drawing.outlines.sort(key=lambda outline: -outline.area)
    return drawing


@contextmanager
def _without_fonts() -> Iterator[None]:
    """Prevent ezdxf from scanning the system's fonts when it is imported, and from storing a list of them.

    ezdxf reads such a list from the cache folder if there is one; this provides an empty list in a temporary folder.
    Lines need no fonts.
    """
    before = os.environ.get("XDG_CACHE_HOME")
    with files.scratch() as folder:
        (folder / "ezdxf").mkdir()
        (folder / "ezdxf" / "font_manager_cache.json").write_text(json.dumps(NO_FONTS))
        os.environ["XDG_CACHE_HOME"] = str(folder)
        try:
            yield
        finally:
            os.environ.pop("XDG_CACHE_HOME")
            if before is not None:
                os.environ["XDG_CACHE_HOME"] = before


def _add(drawing: Drawing, layer: str, curves: list[Complex], near: float) -> None:
    """Add a layer's closed loops to the drawing, and a note on open lines."""
    closed = [z for z in curves if z.size > 2 and abs(z[0] - z[-1]) <= near]
    rest = [z for z in curves if not (z.size > 2 and abs(z[0] - z[-1]) <= near)]
    joined = shapely.set_precision([shapely.LineString(xy_of(z)) for z in rest], near, mode="pointwise")
    chains = shapely.get_parts(shapely.line_merge(shapely.union_all(joined))) if rest else []
    opened = 0
    for chain in chains:
        if chain.is_closed and not chain.is_empty:
            closed.append(complex_of(shapely.get_coordinates(chain)))
        else:
            opened += not chain.is_empty
    if opened:
        drawing.notes.append(f"ignored {opened} open lines of layer {layer!r}")
    if closed:
        drawing.add(closed, "evenodd", repr(layer), (layer,))
