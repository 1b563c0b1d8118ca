"""Angular gradients, which Figma exports as HTML since SVG has none, as embedded pictures."""

import base64
import io
import math
import re
from xml.etree.ElementTree import Element

import numpy as np
import tinycss2
from PIL import Image
from tinycss2.color3 import RGBA, parse_color

from . import css
from .document import local

PIXELS = 512  # of the picture's sides
_SVG = "{http://www.w3.org/2000/svg}"
_LINK = "{http://www.w3.org/1999/xlink}href"
_ANGLE = re.compile(r"([+-]?[\d.]+(?:[eE][+-]?\d+)?)(deg|turn|rad|grad|%)")
_TURNS = {"deg": 1 / 360, "turn": 1.0, "rad": 0.5 / math.pi, "grad": 1 / 400, "%": 0.01}


def replace_angular_gradients(top: Element) -> None:
    """Replace each <foreignObject> that only shows a conic gradient of CSS by a picture of it, in place."""
    for parent in list(top.iter()):
        for place, child in enumerate(parent):
            if local(child) == "foreignObject" and (picture := _picture(child)) is not None:
                parent[place] = picture


def _picture(element: Element) -> Element | None:
    """Return the <image> for a <foreignObject>; None where it shows anything else."""
    if len(element) != 1 or len(element[0]) or "".join(element.itertext()).strip():
        return None
    style = css.declarations(element[0].get("style", ""))
    background = style.get("background", style.get("background-image", ""))
    try:
        pixels = conic_gradient(background)
        pixels[..., 3] = np.rint(pixels[..., 3] * min(1.0, max(0.0, float(style.get("opacity", "1")))))
    except ValueError:
        return None
    content = io.BytesIO()
    Image.fromarray(pixels).save(content, "PNG")
    address = f"data:image/png;base64,{base64.b64encode(content.getvalue()).decode()}"
    attributes = {k: v for k, v in element.attrib.items() if k not in ("style", "class")}
    return Element(f"{_SVG}image", attributes | {"preserveAspectRatio": "none", _LINK: address})


def conic_gradient(text: str, pixels: int = PIXELS) -> np.ndarray:
    """Return the picture (pixels, pixels, 4) of a `conic-gradient()` of CSS around the middle of its square.

    Raises:
        ValueError: it is not one, or has another centre.

    >>> conic_gradient("conic-gradient(red 0deg, blue 360deg)", 2)[:, :, 0].tolist()
    [[32, 223], [96, 159]]
    """
    tokens = [t for t in tinycss2.parse_component_value_list(text) if t.type not in ("whitespace", "comment")]
    if len(tokens) != 1 or tokens[0].type != "function" or tokens[0].lower_name != "conic-gradient":
        raise ValueError("not a conic gradient")
    parts: list[list[str]] = [[]]
    for token in tokens[0].arguments:
        if token == ",":
            parts.append([])
        elif token.type not in ("whitespace", "comment"):
            parts[-1].append(css.serialize([token]))
    start = 0.0
    if parts[0][:1] == ["from"]:
        start, rest = _turn(parts[0][1]), parts[0][2:]
        if rest and rest not in (["at", "50%", "50%"], ["at", "center"]):
            raise ValueError("not around the middle")
        del parts[0]
    turns, colours = _stops(parts)
    steps = (np.arange(pixels) + 0.5) / pixels - 0.5
    x, y = np.meshgrid(steps, steps)
    angle = (np.arctan2(x, -y) / (2 * math.pi) - start) % 1.0
    premultiplied = colours * np.where([True, True, True, False], colours[:, 3:], 1.0)
    mixed = np.stack([np.interp(angle, turns, channel) for channel in premultiplied.T], axis=-1)
    alpha = mixed[..., 3:]
    mixed[..., :3] = np.where(alpha > 0, mixed[..., :3] / np.where(alpha > 0, alpha, 1), 0)
    return np.rint(255 * np.clip(mixed, 0, 1)).astype(np.uint8)


def _stops(parts: list[list[str]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the turns (n,) and colours (n, 4) of stops; those without an angle lie evenly between the others."""
    turns: list[float | None] = []
    colours: list[RGBA] = []
    for words in parts:
        colour = parse_color(words[0]) if words else None
        if not isinstance(colour, RGBA):
            raise ValueError("not a colour")
        for angle in words[1:] or [""]:
            turns.append(_turn(angle) if angle else None)
            colours.append(colour)
    if len(turns) < 2:
        raise ValueError("fewer than two stops")
    turns[0], turns[-1] = turns[0] or 0.0, 1.0 if turns[-1] is None else turns[-1]
    known = [k for k, turn in enumerate(turns) if turn is not None]
    places = np.interp(np.arange(len(turns)), known, [turns[k] or 0.0 for k in known])
    return np.maximum.accumulate(places), np.array([tuple(colour) for colour in colours])


def _turn(text: str) -> float:
    """Return an angle or a percentage in turns."""
    if text in ("0", "0.0"):
        return 0.0
    match = _ANGLE.fullmatch(text.lower())
    if not match:
        raise ValueError("not an angle")
    return float(match[1]) * _TURNS[match[2]]
