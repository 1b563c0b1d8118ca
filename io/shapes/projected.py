"""Shapes for mock-ups and for rectifying photographs: sheets on generated objects, and sheets marked on photographs.

The syntax is described in docs/reference/shapes.md.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from ...arrays import Box, Complex, complex_of
from ...curve import Curve
from ...errors import InputError, naming
from ...plane import bounding_box
from ...projection.camera import Camera
from ...projection.marked import Found, planar, revolved
from ...projection.method import FlatView
from ...projection.surfaces import Ball, Flat, Revolved, SheetSurface
from ...projection.view import Projected, View, label_size
from .. import formats, limits
from ..spec import MARKED, Spec, is_marked, is_view
from . import shape
from .shape import Shape
from .silhouette import CANVAS

SHEET = "sheet"
USUAL_DISTANCE = 5.0
"""Relative to the largest side of an object: from where its perspective looks natural, as from two or three metres for
a poster."""
EXAMPLES = {
    SHEET: "sheet:210x297",
    "plane": "plane:210x297,turn=30",
    "cylinder": "cylinder:90x100,pitch=15",
    "cone": "cone:90x60x110",
    "sphere": "sphere:220,label=80x60",
}
SIX_POINTS = "left end, middle and right end of the upper edge, then of the lower edge from right to left"
MARKED_EXAMPLES = {
    "plane": "photo.jpg#plane=20,30:400,50:420,600:10,580 (four corners, from the top left clockwise)",
    "cylinder": f"photo.jpg#cylinder=82x95:20,30:… ({SIX_POINTS})",
    "cone": f"photo.jpg#cone=90x60x110:20,30:… ({SIX_POINTS})",
}
NUMBERS_OF_SIZES = {SHEET: 2, "plane": 2, "cylinder": 2, "cone": 3, "sphere": 1}
NUMBERS_OF_POINTS = {"plane": 4, "cylinder": 6, "cone": 6}
_SETTINGS = ("label", "turn", "pitch", "distance")
_MARKED_SETTINGS = ("focal",)
MOST_DEGREES = {"turn": 360.0, "pitch": 90.0}


def read_pair(source: str, target: str) -> tuple[Shape, Shape]:
    """Read two shapes, at least one of which is a view or a sheet.

    Raises:
        InputError: one of them cannot be read, or both do not fit each other.
    """
    pair = [_read_view(text) if is_view(text) else flat_picture(text) for text in (source, target)]
    for k, text in enumerate((source, target)):
        if text == SHEET:
            pair[k] = _sheet_of(pair[1 - k], text)
    balls = [side for side in pair if _is_ball(side)]
    if balls and not any(isinstance(view_of(side), FlatView) for side in pair):
        raise InputError(f"{balls[0].spec}: the other side of a sphere must be a flat picture or a sheet")
    first, second = pair
    return first, second


def is_sheet(text: str) -> bool:
    """Return whether a spec names a flat sheet without a camera."""
    return text.partition(":")[0] == SHEET and is_view(text)


def flat_picture(text: str) -> Shape:
    """Read the canvas of a picture or a drawing as a shape; of a part of it, the bounding box.

    Raises:
        InputError: it cannot be read.
    """
    spec = Spec.of(text)
    if formats.of(spec.path).mesh and not formats.of(spec.path).drawing:
        raise InputError(f"{text}: is a mesh; only pictures and drawings lie flat on such a shape")
    if spec.selection in MARKED_EXAMPLES and formats.of(spec.path).picture:
        raise InputError(
            f"{text}: its points are missing; write for example {MARKED_EXAMPLES[spec.selection]}"
        )
    boxes = f"#{CANVAS}", f"#{shape.BBOX}"
    if not text.endswith(boxes):
        is_whole = spec.selection is None and (formats.of(spec.path).picture or formats.of(spec.path).drawing)
        text += boxes[0] if is_whole and formats.suffix_of(spec.path) != ".obj" else boxes[1]
    return shape.read(text)


def view_of(shape: Shape) -> View:
    """Return how the sheet is seen in the picture of a shape: flat on its canvas, unless it is a view."""
    return shape.view or FlatView(shape.box)


def _is_ball(shape: Shape) -> bool:
    return isinstance(shape.view, Projected) and isinstance(shape.view.surface, Ball)


def _read_view(text: str) -> Shape:
    if is_marked(text):
        return _marked(text)
    kind, _, values = text.partition(":")
    if kind == SHEET and not values:
        return _sheet(text, (1.0, 1.0))  # replaced when the other side is known
    sizes, points, settings = _parsed(text, kind, values, EXAMPLES)
    if points:
        raise InputError(f"{text}: has no points; write {EXAMPLES[kind]}")
    if kind == SHEET:
        if settings:
            raise InputError(f"{text}: a sheet has no settings; write {EXAMPLES[kind]}")
        return _sheet(text, (sizes[0], sizes[1]))
    surface = _surface(kind, sizes)
    label = settings.get("label")
    if label and (label[0] > surface.size[0] * 1.0001 or label[1] > surface.size[1] * 1.0001):
        width, height = surface.size
        raise InputError(
            f"{text}: the label is {label[0]:g} by {label[1]:g}, but the surface only {width:.4g} by {height:.4g}"
        )
    distance = settings.get("distance", [USUAL_DISTANCE * max(sizes)])[0]
    camera = Camera.around(settings.get("turn", [0.0])[0], settings.get("pitch", [0.0])[0], distance)
    view = Projected(surface, camera, (label[0], label[1]) if label else None)
    with naming(text):
        outline = _outline(view)
    return _shape(text, Path(kind), view, outline, bounding_box(camera.image(surface.extremes)), flip=False)


def _surface(kind: str, sizes: Sequence[float]) -> SheetSurface:
    if kind == "plane":
        return Flat(sizes[0], sizes[1])
    if kind == "sphere":
        return Ball(sizes[0] / 2)
    top, bottom, height = (sizes[0], sizes[0], sizes[1]) if kind == "cylinder" else sizes
    return Revolved(top / 2, bottom / 2, height)


def _marked(text: str) -> Shape:
    """Read a sheet that is marked on a photograph."""
    spec = Spec.of(text)
    match = MARKED.fullmatch(spec.selection or "")
    assert match is not None
    kind, values = match.groups()
    if not formats.of(spec.path).picture:
        raise InputError(f"{text}: points are marked on a picture, and {spec.path} is not one")
    sizes, points, settings = _parsed(text, kind, values, MARKED_EXAMPLES)
    canvas = shape.read(f"{spec.path}#{CANVAS}")
    places = [complex(x, -y) for x, y in points]
    with naming(str(spec.path)):
        estimate = _estimate_view(kind, sizes, places, canvas.box, settings.get("focal", [None])[0])
    notes = _notes(estimate)
    marked = _shape(
        text, spec.path, estimate.view, _outline(estimate.view), canvas.box, flip=True, notes=notes
    )
    return replace(marked, georeference=canvas.georeference)


def _estimate_view(
    kind: str, sizes: Sequence[float], points: Sequence[complex], box: Box, focal: float | None
) -> Found:
    if kind == "plane":
        return planar(points, box)
    top, bottom, height = (sizes[0], sizes[0], sizes[1]) if kind == "cylinder" else sizes
    return revolved(top, bottom, height, points, box, focal)


def _notes(estimate: Found) -> tuple[str, ...]:
    """Return a note on what was found from points on a photograph."""
    if estimate.focal_mm is None:
        return ()
    width, height = estimate.view.label or estimate.view.size
    return (
        f"the marked label is {width:.4g} by {height:.4g} on the surface (camera: {estimate.focal_mm:.0f} mm; marks "
        f"within {estimate.error:.1f} pixels)",
    )


def _sheet(text: str, size: tuple[float, float]) -> Shape:
    """Return a flat sheet, with its origin at the top left and y down, as on a page."""
    width, height = size
    box = complex(0, -height), complex(width, 0)
    corners = np.array([box[0], width - 1j * height, box[1], 0])
    return Shape(text, Path(SHEET), Curve(corners), box, True, {}, {})


def _sheet_of(view_shape: Shape, text: str) -> Shape:
    """Return the sheet of a view, in the size that the view has on its own."""
    if view_shape.view is None or view_shape.view.label is None:
        raise InputError(f"{text}: its size is not known; write sheet:WIDTHxHEIGHT")
    return _sheet(text, label_size(view_shape.view, None))


def _outline(view: View) -> Complex:
    """Return the outline of the part of the largest sheet that is seen."""
    region = max(shapely.get_parts(view.visible(label_size(view, None))), key=lambda part: part.area)
    ring = orient(region).exterior.segmentize(region.length / 256)
    return view.image(view.sheet(complex_of(shapely.get_coordinates(ring)[:-1])))


def _shape(
    text: str, path: Path, view: View, outline: Complex, box: Box, *, flip: bool, notes: tuple[str, ...] = ()
) -> Shape:
    curve = Curve.domain(outline, text)
    return Shape(text, path, curve, box, flip, {}, {}, notes, view=view, coloured=flip)


Values = tuple[list[float], list[tuple[float, float]], dict[str, list[float]]]
"""Sizes, points and settings."""


def _parsed(text: str, kind: str, values: str, examples: dict[str, str]) -> Values:
    """Parse `SIZES:X,Y:X,Y,…,setting=value` or `SIZES,setting=value`; a plane that is marked has no sizes.

    Raises:
        InputError: it has another form; the message has an example.
    """
    marked = examples is MARKED_EXAMPLES
    usage = f"write for example {examples[kind]}"
    allowed = _MARKED_SETTINGS if marked else _SETTINGS
    words = re.split(r",(?=\s*[a-z]+\s*=)", values)
    settings = dict[str, list[float]]()
    for word in words[1:]:
        name, _, value = (part.strip() for part in word.partition("="))
        if name not in allowed or (kind == "plane" and name == "focal"):
            available = [setting for setting in allowed if not (kind == "plane" and setting == "focal")]
            raise InputError(f"{text}: {name!r} is not a setting; {_listed(available)}; {usage}")
        numbers = _sizes(value, text, usage) if name == "label" else [_number(value, text, usage)]
        if len(numbers) != (2 if name == "label" else 1):
            raise InputError(f"{text}: {name}={value} is not a size; write {name}=80x60")
        most = MOST_DEGREES.get(name)
        if most is None and numbers[0] <= 0:
            raise InputError(f"{text}: {name} must be greater than 0")
        if most is not None and abs(numbers[0]) > most:
            raise InputError(f"{text}: {name} must be between -{most:g} and {most:g} degrees")
        settings[name] = numbers
    first, *further = words[0].split(":")
    if marked and kind == "plane":
        sizes, places = [], [first, *further]
    else:
        sizes, places = _sizes(first, text, usage), further
        if len(sizes) != NUMBERS_OF_SIZES[kind]:
            many = f"{NUMBERS_OF_SIZES[kind]} sizes" if NUMBERS_OF_SIZES[kind] > 1 else "one size"
            raise InputError(f"{text}: a {kind} has {many}; {usage}")
    points = [_point(place, text, usage) for place in places]
    if marked and len(points) != NUMBERS_OF_POINTS[kind]:
        raise InputError(f"{text}: has {len(points)} points instead of {NUMBERS_OF_POINTS[kind]}; {usage}")
    return sizes, points, settings


def _listed(names: Sequence[str]) -> str:
    return f"these are {', '.join(names)}" if names else "there are none here"


def _sizes(text: str, spec: str, usage: str) -> list[float]:
    numbers = [_number(word, spec, usage) for word in re.split("[x×]", text)]
    if min(numbers) <= 0:
        raise InputError(f"{spec}: sizes must be greater than 0")
    return numbers


def _point(text: str, spec: str, usage: str) -> tuple[float, float]:
    words = text.split(",")
    if len(words) != 2:
        raise InputError(f"{spec}: {text!r} is not a point; {usage}")
    return _number(words[0], spec, usage), _number(words[1], spec, usage)


def _number(text: str, spec: str, usage: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{spec}: {text!r} is not a number; {usage}") from None
    if not abs(value) <= limits.COORDINATE:
        raise InputError(f"{spec}: {text!r} is not a number, or is too large or too small; {usage}")
    return value
