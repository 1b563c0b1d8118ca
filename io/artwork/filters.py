"""Make filters follow a map's affine part: a shadow scales and rotates with the object that casts it."""

import cmath
import math
from dataclasses import replace
from xml.etree.ElementTree import Element

from ...errors import InputError, naming
from ..svg.affine import Affine
from ..svg.document import local
from ..svg.path_data import numbers
from ..svg.tree import LINKS
from .affine_part import AffinePart
from .paint_server import SIDES, Apply, Definitions, Space, affine_note, scale

MARGIN = {"x": "-10%", "y": "-10%", "width": "120%", "height": "120%"}
_PLACES = {"fePointLight": [("x", "y")], "feSpotLight": [("x", "y"), ("pointsAtX", "pointsAtY")]}
_DEPTHS = {"feDisplacementMap": {"scale": 0.0}, "feDiffuseLighting": {"surfaceScale": 1.0}}
_DEPTHS |= {"feSpecularLighting": {"surfaceScale": 1.0}, "fePointLight": {"z": 0.0}}
_DEPTHS |= {"feSpotLight": {"z": 0.0, "pointsAtZ": 0.0}}


def filtered(definitions: Definitions, original: Element, space: Space) -> tuple[str, Apply] | None:
    """Copy a filter; return a reference `url(#id)` to the copy, and a function that makes it follow the map.

    The copy's region has the margins of the original's, around the image of the shapes that use it.

    Returns:
        None where its units refer to a missing box; SVG then shows nothing.

    Raises:
        InputError: a length or number is malformed.
    """
    attributes, source = definitions.inherited_attributes(original)
    region = space.rectangle(attributes, "filterUnits", MARGIN)
    boxed = attributes.get("primitiveUnits") == "objectBoundingBox"
    if not region or (boxed and not space.area):
        return None
    copied_attributes = {
        k: v for k, v in attributes.items() if k not in (*LINKS, *MARGIN, "id", "primitiveUnits")
    }
    new = definitions.new("filter", copied_attributes | {"filterUnits": "userSpaceOnUse"})
    new.extend(definitions.copied(source))
    for element in new.iter():
        _under(element, Affine())  # checks the numbers before a map is known
    (x, y, width, height), (left, top, wide, high) = space.box, region
    margin = max(0.0, x - left, y - top, left + wide - x - width, top + high - y - height)

    def apply(over: AffinePart) -> str:
        map = over.affine @ space.affine
        pad = margin * scale(map) * complex(1, 1)
        low, side = over.box[0] - pad, over.box[1] - over.box[0] + 2 * pad
        for (name, _), value in zip(SIDES, (low.real, low.imag, side.real, side.imag)):
            new.set(name, f"{value:.6g}")
        for element in new.iter():
            _under(element, map @ space.units if boxed else map)
        return affine_note("filter", over)

    return f"url(#{new.get('id')})", apply


def _under(element: Element, map: Affine) -> None:
    """Transform a filter primitive by an affine map."""
    tag, linear, factor = local(element), replace(map, gamma=0), scale(map)
    if tag in ("feOffset", "feDropShadow"):
        default = 2.0 if tag == "feDropShadow" else 0.0
        offset = linear(complex(_number(element, "dx", default), _number(element, "dy", default)))
        _set(element, dx=offset.real, dy=offset.imag)
    if tag == "feDropShadow":
        element.attrib.setdefault("stdDeviation", "2")
    for name in {"stdDeviation", "radius"} & element.attrib.keys():
        a, b = (_numbers(element, name) * 2)[:2]
        across, down = linear(a + 0j), linear(1j * b)
        sides = abs(complex(across.real, down.real)), abs(complex(across.imag, down.imag))
        element.set(name, " ".join(f"{side:.6g}" for side in sides))
    for name, default in _DEPTHS.get(tag, {}).items():
        _set(element, **{name: _number(element, name, default) * factor})
    for x, y in _PLACES.get(tag, ()):
        place = map(complex(_number(element, x), _number(element, y)))
        _set(element, **{x: place.real, y: place.imag})
    if tag == "feDistantLight":
        light = linear(cmath.rect(1, math.radians(_number(element, "azimuth"))))
        _set(element, azimuth=math.degrees(cmath.phase(light)))
    if tag == "feTurbulence" and "baseFrequency" in element.attrib:
        frequencies = _numbers(element, "baseFrequency")
        element.set("baseFrequency", " ".join(f"{value / max(factor, 1e-9):.6g}" for value in frequencies))


def _numbers(element: Element, name: str) -> list[float]:
    with naming(f"<{local(element)}> {name}"):
        values = numbers(element.get(name, ""))
    if not values:
        raise InputError(f"<{local(element)}> {name}: not a number")
    return values


def _number(element: Element, name: str, default: float = 0.0) -> float:
    return _numbers(element, name)[0] if name in element.attrib else default


def _set(element: Element, **values: float) -> None:
    for name, value in values.items():
        element.set(name, f"{value:.6g}")
