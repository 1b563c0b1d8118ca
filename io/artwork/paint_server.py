"""Make gradients, patterns and markers follow a map.

None of them is a path. They follow the map's affine part over the shape that uses them. Each use gets a separate copy,
in the target's units.
"""

import copy
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count
from xml.etree.ElementTree import Element

from ...errors import InputError
from .. import limits
from ..svg import affine
from ..svg.affine import Affine
from ..svg.document import length, local
from ..svg.drawing_content import Rectangle
from ..svg.tree import LINKS, Document
from .affine_part import AffinePart
from .element import SVG, MappedElement, box_of, length_of, restyle

CURVED_SIZE_SHARE = 0.05  # of a shape's size: deviation from the affine part above which a note is given
UNEVEN_SCALE_RATIO = 1.5  # ratio of scales along a line above which a note says that its width is constant
_REFERENCE = re.compile(r"""url\(\s*["']?#([^"')]+?)["']?\s*\)""")
_FOCUS = (("fx", "x", ""), ("fy", "y", ""), ("fr", "r", ""))
_GRADIENTS = {
    "linearGradient": (("x1", "x", "0%"), ("y1", "y", "0%"), ("x2", "x", "100%"), ("y2", "y", "0%")),
    "radialGradient": (("cx", "x", "50%"), ("cy", "y", "50%"), ("r", "r", "50%"), *_FOCUS),
}
SIDES = (("x", "x"), ("y", "y"), ("width", "x"), ("height", "y"))

Apply = Callable[[AffinePart], str]


@dataclass(frozen=True, eq=False)
class Space:
    """The context in which a definition is used.

    Attributes:
        affine: map from the user space there to the root's.
        size: width and height that percentages refer to.
        shapes: the shapes that use it.
    """

    affine: Affine
    size: tuple[float, float] | None
    shapes: Sequence[MappedElement] = ()

    @cached_property
    def box(self) -> Rectangle:
        """The bounding box of the shapes in user space; all zero where there are none."""
        return box_of(self.shapes, self.affine) or (0.0, 0.0, 0.0, 0.0)

    @property
    def area(self) -> bool:
        """Whether the box has area; otherwise units relative to it are invalid."""
        return self.box[2] > 0 and self.box[3] > 0

    @property
    def units(self) -> Affine:
        """Map from the bounding box's units to user space."""
        x, y, width, height = self.box
        return Affine.matrix(width, 0, 0, height, x, y)

    def rectangle(
        self, attributes: Mapping[str, str], units: str, default: Mapping[str, str]
    ) -> Rectangle | None:
        """Return x, y, width and height in user space; None where units refer to a box without area.

        Raises:
            InputError: one of them is not a length.
        """
        boxed = attributes.get(units, "objectBoundingBox") == "objectBoundingBox"
        if boxed and not self.area:
            return None
        size = (1.0, 1.0) if boxed else self.size
        x, y, w, h = (length(attributes.get(name, default[name]), size, axis, name) for name, axis in SIDES)
        if not boxed:
            return x, y, w, h
        left, top, width, height = self.box
        return left + x * width, top + y * height, w * width, h * height


@dataclass(eq=False)
class Definitions:
    """Collects the definitions of the new drawing, made from those of a document."""

    document: Document
    out: Element = field(default_factory=lambda: Element(f"{SVG}defs"))

    def __post_init__(self) -> None:
        numbered = (f"mapped-{number}" for number in count(1))
        self._free = (name for name in numbered if name not in self.document.ids)

        self._pictures: dict[tuple[tuple[str, str], ...], Element] = {}

    def new(self, tag: str, attributes: Mapping[str, str] | None = None) -> Element:
        """Add and return a new, empty definition with an unused id."""
        definition = Element(f"{SVG}{tag}", {"id": next(self._free), **(attributes or {})})
        self.out.append(definition)
        return definition

    def picture(self, attributes: Mapping[str, str]) -> Element:
        """Return a definition of a picture at the origin, shared by equal pictures."""
        key = tuple(sorted(attributes.items()))
        if key not in self._pictures:
            self._pictures[key] = self.new("image", attributes)
        return self._pictures[key]

    def copied(self, element: Element) -> list[Element]:
        """Return copies of an element's children.

        Raises:
            InputError: the drawing makes too many copies.
        """
        self.document.copies.add(element, whole=True)
        return [copy.deepcopy(child) for child in element]

    def collect(self, top: Element) -> None:
        """Add copies of all definitions that the new document refers to, and drop the unused ones."""
        pending, ids = [top], self.document.ids
        included = {e.get("id") for e in top.iter()}
        new_definitions = {e.get("id"): e for e in self.out}
        self.out[:] = []
        while pending:
            for element in pending.pop().iter():
                names = {
                    name for text in (*element.attrib.values(), element.text or "") for name in _names(text)
                }
                if local(element) == "style":  # clip paths and masks have separate copies
                    names = {n for n in names if local(ids.get(n, element)) not in ("clipPath", "mask")}
                names |= {
                    element.get(link, "")[1:] for link in LINKS if element.get(link, "").startswith("#")
                }
                for name in sorted(names - included):
                    definition = new_definitions.get(name)
                    if definition is None and name in ids:
                        definition = copy.deepcopy(ids[name])
                        definition.tail = None
                    if definition is not None:
                        included |= {e.get("id") for e in definition.iter()}
                        self.out.append(definition)
                        pending.append(definition)

    def inherited_attributes(self, element: Element) -> tuple[dict[str, str], Element]:
        """Return an element's attributes including those inherited by href, and the element that has the children.

        Raises:
            InputError: the chain of references is too long.
        """
        chain: list[Element] = []
        following: Element | None = element
        while following is not None and following not in chain:
            chain.append(following)
            following = self.document.linked(following)
            if len(chain) > limits.SVG_LINKS:
                name = element.get("id")
                raise InputError(
                    f"<{local(element)}> {name!r} has a chain of more than {limits.SVG_LINKS} references"
                )
        attributes = {k: v for link in reversed(chain) for k, v in link.attrib.items()}
        return attributes, next((link for link in chain if len(link)), element)

    def painted(self, element: Element, space: Space) -> tuple[str, Apply] | None:
        """Copy a gradient or pattern into user space; return `url(#id)` and its effect; None if its box has no area."""
        make = self._pattern if local(element) == "pattern" else self._gradient
        copied = make(element, space)
        return (f"url(#{copied[0].get('id')})", copied[1]) if copied else None

    def _gradient(self, element: Element, space: Space) -> tuple[Element, Apply] | None:
        attributes, _ = self.inherited_attributes(element)
        boxed = attributes.get("gradientUnits", "objectBoundingBox") == "objectBoundingBox"
        if boxed and not space.area:
            return None
        size = (1.0, 1.0) if boxed else space.size
        new = self.new(local(element), {LINKS[1]: f"#{element.get('id')}", "gradientUnits": "userSpaceOnUse"})
        for name, axis, default in _GRADIENTS[local(element)]:
            if text := attributes.get(name, default):
                new.set(name, f"{length(text, size, axis, name):.9g}")
        to_root = (
            space.affine
            @ (space.units if boxed else Affine())
            @ affine.parse(attributes.get("gradientTransform", ""))
        )
        return new, _following(new, "gradientTransform", to_root, "gradient")

    def _pattern(self, element: Element, space: Space) -> tuple[Element, Apply] | None:
        attributes, _ = self.inherited_attributes(element)
        tile = space.rectangle(attributes, "patternUnits", dict.fromkeys(("x", "y", "width", "height"), "0"))
        boxed = attributes.get("patternContentUnits") == "objectBoundingBox" and "viewBox" not in attributes
        if not tile or tile[2] <= 0 or tile[3] <= 0 or (boxed and not space.area):
            return None
        new = self.new("pattern", {LINKS[1]: f"#{element.get('id')}", "patternUnits": "userSpaceOnUse"})
        for (name, _axis), value in zip(SIDES, tile):
            new.set(name, f"{value:.9g}")
        if boxed:
            new.set("patternContentUnits", "userSpaceOnUse")
            new.set("viewBox", f"0 0 {tile[2] / space.box[2]:.9g} {tile[3] / space.box[3]:.9g}")
            new.set("preserveAspectRatio", "none")
        to_root = space.affine @ affine.parse(attributes.get("patternTransform", ""))
        return new, _following(new, "patternTransform", to_root, "pattern")

    def marker(self, element: Element, unit: float) -> tuple[str, Apply] | None:
        """Copy a marker in user space units; return `url(#id)` and its effect; None if its unit is the line's width.

        Args:
            element: the marker.
            unit: scale from user space to the root's units.
        """
        if element.get("markerUnits", "strokeWidth") != "userSpaceOnUse":
            return None
        new = self.new("marker", {k: v for k, v in element.attrib.items() if k != "id"})
        new.extend(self.copied(element))
        sides = [length(element.get(name, "3"), None, "x", name) for name in ("markerWidth", "markerHeight")]
        new.attrib.setdefault("viewBox", f"0 0 {sides[0]:.9g} {sides[1]:.9g}")

        def apply(over: AffinePart) -> str:
            for name, side in zip(("markerWidth", "markerHeight"), sides):
                new.set(name, f"{side * unit * over.scale:.6g}")
            return ""

        return f"url(#{new.get('id')})", apply


def _names(text: str) -> list[str]:
    return _REFERENCE.findall(text) if "url(" in text else []


def _following(new: Element, name: str, to_root: Affine, kind: str) -> Apply:
    def apply(over: AffinePart) -> str:
        new.set(name, affine.to_svg(over.affine @ to_root))
        return affine_note(kind, over)

    return apply


def affine_note(kind: str, over: AffinePart) -> str:
    """Return a note for content that follows only the map's affine part, where that is not accurate enough."""
    return (
        f"{kind} that follows the map only approximately (by an affine map)"
        if over.curved > CURVED_SIZE_SHARE
        else ""
    )


def lined(shape: MappedElement, element: Element, properties: Mapping[str, str], space: Space) -> Apply:
    """Return an effect that scales a line's width and dashes by the map's mean scale along it.

    Raises:
        InputError: a length is malformed.
    """
    unit = scale(space.affine)
    width, offset = (
        length(properties.get(name, default), space.size, "r", name)
        for name, default in (("stroke-width", "1"), ("stroke-dashoffset", "0"))
    )
    texts = properties.get("stroke-dasharray", "none").replace(",", " ").split()
    dashes = [length(text, space.size, "r", "stroke-dasharray") for text in texts if text != "none"]
    path_length = length(element.get("pathLength") or "0", None, "r", "pathLength")
    dash_unit = length_of(shape.runs) / path_length if path_length > 0 else unit

    def apply(over: AffinePart) -> str:
        style = {"stroke-width": f"{width * unit * over.scale:.6g}"}
        if dashes:
            style["stroke-dasharray"] = " ".join(f"{dash * dash_unit * over.scale:.6g}" for dash in dashes)
            style["stroke-dashoffset"] = f"{offset * dash_unit * over.scale:.6g}"
        restyle(shape.out, style)
        wide = max(over.uneven, unevenness(space.affine)) > UNEVEN_SCALE_RATIO
        return (
            "line with constant width, although the map would vary it (convert strokes to paths to avoid this)"
            if wide
            else ""
        )

    return apply


def scale(map: Affine) -> float:
    """Return the factor by which an affine map scales lengths: the square root of its factor of areas."""
    return abs(map.determinant) ** 0.5


def unevenness(map: Affine) -> float:
    """Return the ratio of an affine map's largest to smallest scale; infinite if its determinant is zero."""
    large, small = abs(map.alpha) + abs(map.beta), abs(abs(map.alpha) - abs(map.beta))
    return large / small if small else math.inf
