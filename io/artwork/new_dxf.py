"""New DXF drawings of lines, in millimetres, written by ezdxf: each subpath as a polyline of lines and arcs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from tinycss2.color3 import RGBA

from ...arrays import Complex, Real
from ...errors import InputError
from ...maps.arc_fit import refit_arcs
from ...plane import bounding_box
from ..outlines.dxf import library
from ..svg import tree
from ..svg.affine import Affine
from ..svg.curves import Bezier
from ..svg.document import local
from ..svg.flat_areas import css_colour
from ..svg.path_data import PenPath
from .element import pen_paths_of
from .mapping import SegmentMapper

VERSION = "R2010"
MILLIMETRES_CODE = 4  # of $INSUNITS
DEFAULT_LAYER = "0"
FORBIDDEN_IN_LAYERS = str.maketrans(dict.fromkeys('<>/\\":;?*|=`', "_"))
NOT_CUT = "line under a clip path or mask, written as a whole"
WITHOUT_FILL = "filled shape, of which the outline is written"
PICTURE = "embedded picture, omitted"


class WrittenPath(NamedTuple):
    """A subpath to be written.

    Attributes:
        run: its segments, in millimetres, y up.
        layer: its layer.
        colour: red, green and blue of 255; None for that of the layer.
    """

    run: PenPath
    layer: str = DEFAULT_LAYER
    colour: tuple[int, int, int] | None = None


def write(lines: Sequence[WrittenPath], path: Path, tolerance: float) -> None:
    """Write lines as a DXF drawing in millimetres.

    Args:
        lines: what to write.
        path: the file.
        tolerance: largest distance of arcs from the lines, in millimetres.

    Raises:
        InputError: ezdxf is not installed, or there are no lines.
    """
    if not lines:
        raise InputError(f"{path}: there are no lines to write")
    pieces = [piece for line in lines for piece in line.run.pieces]
    straight = np.array([isinstance(piece, Bezier) and len(piece.p) == 2 for piece in pieces])
    fits = iter(refit_arcs(SegmentMapper(pieces), straight, tolerance))
    with library(path) as ezdxf:
        document = ezdxf.new(VERSION)
        document.header["$INSUNITS"], document.header["$MEASUREMENT"] = MILLIMETRES_CODE, 1
        space = document.modelspace()
        corners = list[Complex]()
        for line in lines:
            layer = line.layer.translate(FORBIDDEN_IN_LAYERS)[:255] or DEFAULT_LAYER
            if layer not in document.layers:
                document.layers.add(layer)
            vertices, bulges = _joined([next(fits) for _ in line.run.pieces], closed=line.run.closed)
            points = np.column_stack([vertices.real, vertices.imag, bulges]).tolist()
            polyline = space.add_lwpolyline(
                points, format="xyb", close=line.run.closed, dxfattribs={"layer": layer}
            )
            if line.colour is not None:
                polyline.rgb = line.colour
            corners.append(vertices)
        low, high = bounding_box(np.concatenate(corners))
        header = document.header
        header["$EXTMIN"], header["$EXTMAX"] = (low.real, low.imag, 0.0), (high.real, high.imag, 0.0)
        middle = (low + high) / 2
        document.set_modelspace_vport(1.1 * max((high - low).imag, 1e-9), (middle.real, middle.imag))
        document.saveas(path)


def of_svg(data: bytes, to_millimetres: Affine) -> tuple[list[WrittenPath], Counter[str]]:
    """Return the lines of an SVG drawing, and counts of what a DXF drawing of lines does not contain.

    A line has the layer (Inkscape) that contains it, and the colour of its stroke, or of its fill.

    Args:
        data: the drawing.
        to_millimetres: maps its user units, y down, to millimetres, y up.
    """
    document = tree.parse(data)
    layers = dict[Element, str]()
    for group in document.top.iter():  # outer layers before those in them
        name = group.get(tree.LABEL) or group.get("id")
        if group.get(tree.MODE) == "layer" and name:
            layers |= dict.fromkeys(group.iter(), name)
    lines, notes = list[WrittenPath](), Counter[str]()
    for node in document.shapes:
        runs = pen_paths_of(node)
        painted = "stroke" if node.stroked else "fill"
        if not runs or not (node.stroked or node.filled):
            continue
        notes[NOT_CUT] += bool(node.clips)
        notes[WITHOUT_FILL] += painted == "fill"
        layer = layers.get(node.element, DEFAULT_LAYER)
        colour = _rgb(css_colour(node.properties.get(painted, "black"), node))
        for run in runs:
            pieces = [piece.under(to_millimetres) for piece in run.pieces]
            lines.append(WrittenPath(PenPath(to_millimetres(run.start), pieces, run.closed), layer, colour))
    notes[PICTURE] += len(document.pictures)
    notes["text, omitted"] += sum(local(element) == "text" for element in document.top.iter())
    return lines, notes


def _rgb(colour: RGBA | None) -> tuple[int, int, int] | None:
    """Return a colour as numbers to 255; None for None."""
    if colour is None:
        return None
    red, green, blue = (round(255 * min(max(share, 0), 1)) for share in colour[:3])
    return red, green, blue


def _joined(pieces: Sequence[tuple[Complex, Real]], *, closed: bool) -> tuple[Complex, Real]:
    """Return vertices and bulges of consecutive pieces, a bulge for each vertex; a closed one ends before its start."""
    vertices = np.concatenate([pieces[0][0][:1], *(part[1:] for part, _ in pieces)])
    bulges = np.concatenate([bulges for _, bulges in pieces])
    if closed and vertices.size > 2:
        return vertices[:-1], bulges
    return vertices, np.append(bulges, 0.0)
