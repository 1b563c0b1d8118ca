"""Frames of a drawing joined into a Lottie animation, which players on the web and on phones interpolate.

The frames are SVG files whose paths have the same commands (`carry_frames`). Fills and lines of one colour are written;
gradients become grey, and clip paths, masks, filters, markers and pictures of the drawing are left out.
Areas that fade are a second layer, under an inverted mask, whose opacity falls.
"""

import json
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from ...arrays import Box, Complex
from ...plane import polygon_area
from ..svg import css, tree
from ..svg.flat_areas import css_colour
from ..svg.tree import Node
from .areas import Area

VERSION = "5.7.0"  # of the format, which all players read
SMALLEST_SIDE = 512
"""Of the longer side of the composition: Lottie counts whole pixels, and drawings may be 24 units wide."""
DIGITS = 3  # after the decimal point, in pixels of the composition
COMMANDS = re.compile(r"([MCLZ])([^MCLZ]*)")
CAPS, JOINS = {"butt": 1, "round": 2, "square": 3}, {"miter": 1, "round": 2, "bevel": 3}
GREY = (0.5, 0.5, 0.5)  # instead of gradients and patterns

Json = dict[str, Any]


def write(
    frames: Sequence[Path],
    path: Path,
    fps: float,
    painted: Sequence[Sequence[Complex]] = (),
    shares: Sequence[float] = (),
) -> tuple[str, ...]:
    """Write a Lottie animation of frames.

    Args:
        frames: SVG files with the same elements, without a mask of what fades.
        path: the JSON file to write.
        fps: frames per second.
        painted: for each frame the rings of the area outside of which it fades, core plane; empty if nothing fades.
        shares: for each frame its position between source and target, from 0 to 1, if something fades.

    Returns:
        Notes, with counts, on what is left out.
    """
    documents = [tree.parse(frame.read_bytes()) for frame in frames]
    canvas = documents[0].canvas
    assert canvas is not None
    x, y, width, height = canvas
    factor = max(1.0, SMALLEST_SIDE / max(width, height))

    def to_lottie(z: Complex) -> Complex:
        return factor * (z - complex(x, y))

    nodes = [document.shapes for document in documents]
    notes: Counter[str] = Counter()
    parents = {child: parent for parent in documents[0].top.iter() for child in parent}
    shapes: list[Json] = []
    for nodes_of_shape in zip(*nodes, strict=True):
        if group := _group(nodes_of_shape, to_lottie, factor, notes):
            group["it"][-1]["o"] = _still(round(100 * _opacity(parents, nodes_of_shape[0].element), DIGITS))
            shapes.insert(0, group)  # the first is on top
    notes["picture, left out"] += len(documents[0].pictures)
    last = len(frames)
    layers = [_layer(shapes, last, 1)]
    if painted and len({len(rings) for rings in painted}) == 1:
        order = np.argsort([-abs(polygon_area(ring)) for ring in painted[0]])
        masks = [_mask([rings[k].conj() for rings in painted], to_lottie) for k in order]
        fading = [{"t": k, "s": [round(100 * (1 - share), DIGITS)]} for k, share in enumerate(shares)]
        below = _layer(shapes, last, 2)
        below["ks"]["o"] = {"a": 1, "k": [_eased(keyframe) for keyframe in fading]}
        layers[0] |= {"hasMask": True, "masksProperties": masks}
        layers.append(below)  # what the upper layer shows covers it
    _write(path, layers, (factor * width, factor * height), last, fps)
    return tuple(f"{count} × {note}" for note, count in sorted((+notes).items()))


def write_areas(
    frames: Sequence[Sequence[Area]], box: Box, path: Path, fps: float, *, stepped: bool = True
) -> None:
    """Write a Lottie animation of areas of flat colours.

    Args:
        frames: for each frame the same number of areas, each painted over those before it.
        box: the canvas, core plane.
        path: the JSON file to write.
        fps: frames per second.
        stepped: whether each frame is shown alone; otherwise its rings move to those of the next one.
    """
    size = box[1] - box[0]
    corner = complex(box[0].real, -box[1].imag)
    factor = max(1.0, SMALLEST_SIDE / max(size.real, size.imag))

    def form(ring: Complex) -> Json:
        still = np.zeros(ring.size, complex)
        return _bezier(factor * (ring.conj() - corner), still, still, True)

    if stepped:
        layers = []
        for number, areas in enumerate(frames):
            groups = [
                _filled([_still(form(ring)) for ring in area.rings], *map(_still, _colour_of(area)))
                for area in areas
            ]
            layer = _layer(groups[::-1], len(frames), number + 1)
            layers.append(layer | {"ip": number, "op": number + 1})
    else:
        groups = []
        for over_time in zip(*frames):
            rings = [
                _moving([form(ring) for ring in of_frames])
                for of_frames in zip(*(area.rings for area in over_time))
            ]
            colours, opacities = zip(*(_colour_of(area) for area in over_time))
            groups.append(_filled(rings, _changing(colours), _changing([[share] for share in opacities])))
        layers = [_layer(groups[::-1], len(frames), 1)]
    _write(path, layers, (factor * size.real, factor * size.imag), len(frames), fps)


def _colour_of(area: Area) -> tuple[list[float], float]:
    """Return red, green, blue and 1 from 0 to 1, and the opacity in percent."""
    channels = [round(level / 255, DIGITS) for level in area.colour]
    return [*channels[:3], 1.0], 100 * channels[3]


def _filled(forms: Sequence[Json], colour: Json, opacity: Json) -> Json:
    """Return a group of rings filled together by the even-odd rule."""
    shapes = [{"ty": "sh", "ks": form} for form in forms]
    return {"ty": "gr", "it": [*shapes, {"ty": "fl", "r": 2, "c": colour, "o": opacity}, _placed()]}


def _write(path: Path, layers: list[Json], size: tuple[float, float], frames: int, fps: float) -> None:
    width, height = (max(1, round(side)) for side in size)
    about = {"v": VERSION, "fr": fps, "ip": 0, "op": frames, "w": width, "h": height, "ddd": 0, "assets": []}
    path.write_text(json.dumps(about | {"layers": layers}, separators=(",", ":")), encoding="utf-8")


def _layer(shapes: list[Json], frames: int, number: int) -> Json:
    still = {"o": _still(100), "r": _still(0), "p": _still([0, 0, 0]), "a": _still([0, 0, 0])}
    transform = still | {"s": _still([100, 100, 100])}
    times = {"ip": 0, "op": frames, "st": 0, "sr": 1, "bm": 0}
    return {"ddd": 0, "ind": number, "ty": 4, "ks": transform, "ao": 0, "shapes": shapes, **times}


def _group(
    nodes: Sequence[Node], to_lottie: Callable[[Complex], Complex], factor: float, notes: Counter[str]
) -> Json | None:
    """Return the forms of one shape in all frames as a group; None if it is not painted."""
    first = nodes[0]
    items = []
    if first.stroked:
        items.append(_line(nodes, factor, notes))
    if first.filled:
        rule = 2 if first.properties.get("fill-rule", "nonzero").strip() == "evenodd" else 1
        items.append({"ty": "fl", "r": rule, **_paint(first, "fill", "black", notes)})
    if not items:
        return None
    for name in ("clip-path", "mask", "filter"):
        notes[f"{name}, left out"] += first.declared.get(name, "none").strip() != "none"
    paths = [_runs(node.properties["d"]) for node in nodes]
    forms = [
        {"ty": "sh", "ks": _moving([_path(z, closed, to_lottie) for z, closed in run])}
        for run in zip(*paths, strict=True)
    ]
    return {"ty": "gr", "it": [*forms, *items, _placed()]}


def _placed() -> Json:
    """Return the transform of a group: the identity, opaque."""
    place = {"p": _still([0, 0]), "a": _still([0, 0]), "s": _still([100, 100]), "r": _still(0)}
    return {"ty": "tr", **place, "o": _still(100)}


def _runs(d: str) -> list[tuple[Complex, bool]]:
    """Return the subpaths of path data that iccm wrote: points of cubics (3 k + 1,), and whether each is closed."""
    runs: list[tuple[list[complex], bool]] = []
    for command, text in COMMANDS.findall(d):
        numbers = np.array(text.split(), float)
        points = (numbers[::2] + 1j * numbers[1::2]).tolist()
        if command == "M":
            runs.append((points, False))
        elif command == "Z":
            runs[-1] = runs[-1][0], True
        else:
            runs[-1][0].extend(points)
    return [(np.array(points), closed) for points, closed in runs]


def _path(z: Complex, closed: bool, to_lottie: Callable[[Complex], Complex]) -> Json:
    """Return a run of cubics as Lottie's vertices with tangents relative to them."""
    z = to_lottie(z)
    vertices, out, into = z[::3], z[1::3] - z[:-1:3], z[2::3] - z[3::3]
    if closed:  # its end is its beginning
        return _bezier(vertices[:-1], np.append(into[-1:], into[:-1]), out, closed)
    return _bezier(vertices, np.append(0, into), np.append(out, 0), closed)


def _bezier(vertices: Complex, into: Complex, out: Complex, closed: bool) -> Json:
    def pairs(z: Complex) -> list[list[float]]:
        return np.round(np.column_stack([z.real, z.imag]), DIGITS).tolist()

    return {"v": pairs(vertices), "i": pairs(into), "o": pairs(out), "c": closed}


def _mask(rings: Sequence[Complex], to_lottie: Callable[[Complex], Complex]) -> Json:
    """Return a ring in all frames as a mask: that of a part adds, that of a hole, which is clockwise, subtracts."""
    mode = "a" if polygon_area(rings[0].conj()) > 0 else "s"
    still = np.zeros(rings[0].size, complex)
    forms = [_bezier(to_lottie(ring), still, still, True) for ring in rings]
    return {"inv": False, "mode": mode, "pt": _moving(forms), "o": _still(100), "x": _still(0)}


def _line(nodes: Sequence[Node], factor: float, notes: Counter[str]) -> Json:
    first = nodes[0].properties
    widths = [round(factor * node.length("stroke-width", "r"), DIGITS) for node in nodes]
    ends = {
        "lc": CAPS.get(first.get("stroke-linecap", "butt").strip(), 1),
        "lj": JOINS.get(first.get("stroke-linejoin", "miter").strip(), 1),
    }
    moving = _changing([[width] for width in widths])
    notes["dashed line, drawn whole"] += nodes[0].dashed
    return {"ty": "st", "w": moving, "ml": 4, **ends, **_paint(nodes[0], "stroke", "none", notes)}


def _paint(node: Node, kind: str, default: str, notes: Counter[str]) -> Json:
    """Return colour and opacity of a fill or line."""
    parsed = css_colour(node.properties.get(kind, default), node)
    colour, alpha = GREY, 1.0
    if parsed is None:
        notes["gradient or pattern, drawn in grey"] += 1
    else:
        colour, alpha = (parsed.red, parsed.green, parsed.blue), parsed.alpha
    alpha *= _number(node.properties.get(f"{kind}-opacity", "1"))
    channels = [round(float(part), DIGITS) for part in colour]
    return {"c": _still([*channels, 1]), "o": _still(round(100 * float(alpha), DIGITS))}


def _opacity(parents: Mapping[Element, Element], element: Element) -> float:
    """Return the product of the opacities of an element and of the groups around it."""
    opacity, ancestor = 1.0, element
    while ancestor in parents:
        style = css.declarations(ancestor.get("style", ""))
        opacity *= _number(style.get("opacity", ancestor.get("opacity", "1")))
        ancestor = parents[ancestor]
    return opacity


def _number(text: str) -> float:
    try:
        return float(text.strip().removesuffix("%")) / (100 if text.strip().endswith("%") else 1)
    except ValueError:
        return 1.0


def _still(value: Any) -> Json:
    return {"a": 0, "k": value}


def _moving(values: Sequence[Any]) -> Json:
    """Return a value for each frame, between which players interpolate linearly."""
    frames = [{"t": k, "s": value if isinstance(value, list) else [value]} for k, value in enumerate(values)]
    return {"a": 1, "k": [_eased(frame) for frame in frames]}


def _changing(values: Sequence[Any]) -> Json:
    """Return values for each frame, or one if they are all the same."""
    first = values[0]
    if any(value != first for value in values):
        return _moving(values)
    return _still(first if len(first) > 1 else first[0])


def _eased(frame: Json) -> Json:
    return frame | {"o": {"x": [0], "y": [0]}, "i": {"x": [1], "y": [1]}}
