"""Subpaths and bounding boxes of paths and basic shapes, in their own coordinates."""

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from ...arrays import Complex, complex_of
from ...errors import InputError
from ...plane import bounding_box
from . import path_data
from .budget import Budget
from .curves import Bezier, Polyline
from .path_data import PenPath


class ShapeNode(Protocol):
    """The interface of a node of a path or basic shape."""

    tag: str
    properties: Mapping[str, str]
    faults: tuple[str, ...]

    def length(self, name: str, axis: str, default: float = 0.0) -> float:
        """Return a length as `Node.length` does."""


def pen_paths(shape: ShapeNode, budget: Budget | None = None, *, joined: bool = False) -> list[PenPath]:
    """Return the subpaths of a shape in its own coordinates; arguments and errors as for `path_data.runs`.

    As SVG 2 (9.5.4) requires, malformed path data and point lists are drawn up to the error, which is added to the
    shape's `faults`.
    """
    budget, faults = budget or Budget(), list[str]()
    if shape.tag in ("polyline", "polygon"):
        values = path_data.numbers(shape.properties.get("points", ""), faults)
        z = complex_of(np.array(values[: len(values) // 2 * 2]).reshape(-1, 2))
        if len(values) % 2 and not faults:
            faults.append(f"points: {len(values)} numbers; x and y of each point are needed")
        budget.segments.spend(z.size)
        pieces: list[Any] = [Polyline(z)] if joined else [Bezier(ends) for ends in pairwise(z.tolist())]
        runs = [PenPath(complex(z[0]), pieces, shape.tag == "polygon")] if z.size else []
    else:
        runs = path_data.runs(_PATH[shape.tag](shape), budget, joined=joined, faults=faults)
    shape.faults = tuple(faults)
    return runs


def box_of(shape: ShapeNode) -> Complex | None:
    """Return two opposite corners of a shape's bounding box in its own coordinates, to about a thousandth.

    None where there is nothing to bound.
    """
    t = np.linspace(0, 1, 33)
    z = [piece.at(t) for run in pen_paths(shape) for piece in run.pieces]
    return np.array(bounding_box(np.concatenate(z))) if z else None


def _line(shape: ShapeNode) -> str:
    return _text("M", (shape.length(f"{axis}{end}", axis) for end in "12" for axis in "xy"))


def _ellipse(shape: ShapeNode) -> str:
    if shape.tag == "circle":
        rx = ry = _positive(shape, "r", "r")
    else:
        rx, ry = _positive(shape, "rx", "x"), _positive(shape, "ry", "y")
        rx, ry = (rx if "rx" in shape.properties else ry), (ry if "ry" in shape.properties else rx)
    x, y = shape.length("cx", "x"), shape.length("cy", "y")
    if not rx or not ry:
        return ""
    halves = [_text("A", (rx, ry, 0, 0, 1, x + side * rx, y)) for side in (-1, 1)]
    return f"{_text('M', (x + rx, y))}{halves[0]}{halves[1]}Z"


def _rectangle(shape: ShapeNode) -> str:
    x, y, w, h = shape.length("x", "x"), shape.length("y", "y"), _positive(shape, "width", "x"), 0.0
    h = _positive(shape, "height", "y")
    if not w or not h:
        return ""
    stated = [k for k in ("rx", "ry") if shape.properties.get(k, "auto").strip() != "auto"]
    radii = {k: _positive(shape, k, k[1]) for k in stated}
    rx = min(radii.get("rx", radii.get("ry", 0.0)), w / 2)
    ry = min(radii.get("ry", radii.get("rx", 0.0)), h / 2)
    if not rx or not ry:
        return _text("M", (x, y, x + w, y, x + w, y + h, x, y + h)) + "Z"
    corners = [
        (x + w - rx, y, x + w, y + ry),
        (x + w, y + h - ry, x + w - rx, y + h),
        (x + rx, y + h, x, y + h - ry),
        (x, y + ry, x + rx, y),
    ]
    sides = (_text("L", c[:2]) + _text("A", (rx, ry, 0, 0, 1, *c[2:])) for c in corners)
    return _text("M", (x + rx, y)) + "".join(sides) + "Z"


def _positive(shape: ShapeNode, name: str, axis: str) -> float:
    value = shape.length(name, axis)
    if value < 0:
        raise InputError(f"{name} is {value:g}; it must not be negative")
    return value


def _text(command: str, values: Iterable[float]) -> str:
    return command + " ".join(repr(float(v)) if v not in (0, 1) else str(int(v)) for v in values)


_PATH = {
    "path": lambda shape: shape.properties.get("d", ""),
    "line": _line,
    "circle": _ellipse,
    "ellipse": _ellipse,
    "rect": _rectangle,
}
