"""DXF drawings as SVG, so that they can be mapped as artwork: a group for each layer, lines in their colours."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

from ..outlines.dxf import DRAWN, drawn_entities, library, load, unit_of
from ..svg.tree import LABEL, MODE
from .element import SVG

FILLED = ("HATCH", "MPOLYGON", "SOLID", "TRACE")
HAIRLINE_MILLIMETRES = 0.25
"""Width of lines for which the drawing states none: the default of CAD programs."""


def svg_of(path: Path) -> bytes:
    """Return the model space of a DXF drawing as an SVG file, in its units with y down.

    Entities that are not lines or areas become empty elements of their kind, which are reported when the drawing is
    mapped.

    Raises:
        InputError: ezdxf is not installed, or the file is not a DXF drawing.
    """
    top = Element(f"{SVG}svg", {"viewBox": "0 0 1 1"})
    layers = dict[str, Element]()
    with library(path) as ezdxf:
        document = load(ezdxf, path)
        millimetres = unit_of(document) or 1.0
        for entity, _ in drawn_entities(document.modelspace(), everything=True):
            name = str(entity.dxf.layer)
            if name not in layers:
                layers[name] = SubElement(top, f"{SVG}g", {LABEL: name, MODE: "layer"})
            if entity.dxftype() not in DRAWN:
                SubElement(layers[name], f"{SVG}{entity.dxftype()}")
            elif data := _path_data(ezdxf, entity):
                colour, width = _colour(ezdxf, document, entity), _width(document, entity) / millimetres
                style = (
                    {"fill": colour, "fill-rule": "evenodd"}
                    if entity.dxftype() in FILLED
                    else {"fill": "none", "stroke": colour, "stroke-width": f"{width:.6g}"}
                )
                SubElement(layers[name], f"{SVG}path", {"d": data, **style})
    return tostring(top)


def _path_data(ezdxf: Any, entity: Any) -> str:
    """Return the lines of an entity as path data."""
    areas = entity.dxftype() in ("HATCH", "MPOLYGON")
    paths = ezdxf.path.from_hatch(entity) if areas else [ezdxf.path.make_path(entity)]
    words = list[str]()
    for whole in paths:
        for path in whole.sub_paths():
            if not len(path):
                continue
            words.append("M" + _point(path.start))
            for command in path.commands():
                controls = [
                    getattr(command, name) for name in ("ctrl", "ctrl1", "ctrl2") if hasattr(command, name)
                ]
                words.append("LQC"[len(controls)] + " ".join(map(_point, (*controls, command.end))))
            if areas or path.is_closed:
                words.append("Z")
    return "".join(words)


def _point(point: Any) -> str:
    return f"{point.x:.12g} {-point.y:.12g}"


def _colour(ezdxf: Any, document: Any, entity: Any) -> str:
    """Return the colour of an entity, or of its layer; black where it is that of the background's contrast."""
    by_layer, contrast = 256, 7
    rgb = entity.rgb
    if rgb is None:
        index = entity.dxf.get("color", by_layer)
        if index in (0, by_layer) and entity.dxf.layer in document.layers:
            layer = document.layers.get(entity.dxf.layer)
            rgb, index = layer.rgb, abs(layer.color)
        if rgb is None:
            rgb = (0, 0, 0) if index == contrast or not 0 < index < by_layer else ezdxf.colors.aci2rgb(index)
    return "#{:02x}{:02x}{:02x}".format(*rgb)


def _width(document: Any, entity: Any) -> float:
    """Return the width of an entity's lines in millimetres."""
    hundredths = entity.dxf.get("lineweight", -1)
    if hundredths == -1 and entity.dxf.layer in document.layers:
        hundredths = document.layers.get(entity.dxf.layer).dxf.get("lineweight", -3)
    return hundredths / 100 if hundredths >= 0 else HAIRLINE_MILLIMETRES
