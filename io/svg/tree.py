"""The rendering tree of an SVG document (SVG 2, section 3.1), resolved once for all that read it: styles cascaded,
transforms and viewports composed, `use` expanded, clip paths and masks found.

Nothing outside the file is ever read: entities are refused, and links to anything but an id of the file are ignored.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ...errors import InputError
from ...plane import bounding_box
from .. import limits
from . import affine, basic_shapes, css, fonts_in_css, lettering
from .affine import Affine
from .budget import Copies
from .document import SHAPES, canvas, length, local, root, view_box
from .drawing import Rectangle

VIEWPORT = "viewport"  # the node of what is inside an <svg> or a <symbol>, of which there is no element
GROUPS = frozenset(["g", "a", "switch", "svg", "symbol", "use", VIEWPORT])
_RENDERED = SHAPES | GROUPS | {"image"}
# Rendered only where something refers to them, or not at all; "" is what is not SVG.
_NEVER_RENDERED = {
    "",
    "defs",
    "clipPath",
    "mask",
    "marker",
    "symbol",
    "linearGradient",
    "radialGradient",
    "pattern",
}
_NEVER_RENDERED |= {"filter", "style", "view", "solidColor", "color-profile", "cursor", "font", "font-face"}
LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
LINKS = ("href", "{http://www.w3.org/1999/xlink}href")
CLIPS = {  # what cuts an element off, the element that it names, and what says that this is in units of a box
    "clip-path": ("clipPath", "clipPathUnits"),
    "mask": ("mask", "maskContentUnits"),
}
UNREAD = frozenset(["image", "text", "foreignObject"])  # what no shape is read from
_URL = re.compile(r"""\s*url\(\s*["']?#([^"')]+?)["']?\s*\)""")
_INHERITED = (
    *("fill", "stroke", "fill-opacity", "stroke-opacity"),
    *("fill-rule", "visibility", "clip-rule", "paint-order"),
    *("stroke-width", "stroke-dasharray", "stroke-dashoffset", "stroke-linejoin", "stroke-linecap"),
    *("marker", "marker-start", "marker-mid", "marker-end"),
    *lettering.INHERITED,
)
IDENTITY = Affine()
_OWN_BOXES = ("fill-box", "content-box", "stroke-box", "border-box")
"""Values of `transform-box` for the box of the element itself; line widths are not counted in."""
_TRANSLATED = re.compile(r"(translate[XY]?)\s*\(([^()]*)\)")
_KEYWORDS = {"left": "0", "top": "0", "center": "50%", "right": "100%", "bottom": "100%"}


@dataclass(eq=False, slots=True)
class Node:
    """An element where it is rendered.

    Attributes:
        element: of the document; the same for all nodes that `use` makes of it.
        tag: the element's, or VIEWPORT.
        affine: from its own coordinates to the root's user units.
        size: width and height that percentages refer to; None where the document states none.
        origin: the corner of the viewBox, which `transform-origin` is measured from.
        groups: ids and labels of everything that it is inside of.
        used: what it is a copy of, innermost last: <use>'s targets, clip paths and masks, by Python's id.
        depth: of nesting.
        own: attributes and styles by name, those of the style sheet included, nothing inherited.
        properties: these and what is inherited.
        names: its own id and Inkscape label, as far as it has them.
        hidden: whether it is not displayed, and so nothing in it.
        opacity: of it as a whole, with that of all groups that it is inside of.
        frame: of a viewport that does not overflow: its rectangle, a node outside of it.
        clips: what cuts it off, its own and those of all that it is inside of; only `Document.shapes` says so.
        faults: what is wrong with its path data or points, which it is drawn up to; known when these are read.
    """

    element: Element
    tag: str
    affine: Affine
    size: tuple[float, float] | None
    origin: tuple[float, float] = (0.0, 0.0)
    groups: tuple[str, ...] = ()
    used: tuple[int, ...] = ()
    depth: int = 0
    own: Mapping[str, str] = field(default_factory=dict)
    properties: Mapping[str, str] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    hidden: bool = False
    opacity: float = 1.0
    frame: "Node | None" = None
    clips: "tuple[Clip, ...]" = ()
    faults: tuple[str, ...] = ()

    def length(self, name: str, axis: str, default: float = 0.0) -> float:
        """Return a length attribute in user units; `axis` (x, y or r) says what a percentage refers to."""
        text = self.properties.get(name, "")
        return length(text, self.size, axis, name) if text.strip() not in ("", "auto") else default

    @property
    def name(self) -> str:
        """How messages name the shape."""
        return f"<{self.tag}> {self.names[0]!r}" if self.names else f"<{self.tag}> without id"

    @property
    def filled(self) -> bool:
        """Whether its inside is painted; SVG closes open runs of such a shape."""
        return self._painted("fill", "black")

    @property
    def stroked(self) -> bool:
        """Whether its line is painted."""
        return self._painted("stroke", "none")

    def alpha(self, kind: str) -> float:
        """Return how opaque what it paints is, of its "fill" or "stroke", as far as numbers say so."""
        return self.opacity * _share(self.properties.get(f"{kind}-opacity", "1"))

    @property
    def dashed(self) -> bool:
        """Whether its line has gaps."""
        dashes = self.properties.get("stroke-dasharray", "none").strip()
        return self.stroked and dashes not in ("", "none", "0")

    @property
    def visible(self) -> bool:
        """Whether anything of it is painted."""
        return self.filled or self.stroked

    def _painted(self, kind: str, default: str) -> bool:
        paint = self.properties.get(kind, default).strip()
        opacity = self.properties.get(f"{kind}-opacity", "1").strip().rstrip("%")
        return paint not in ("none", "transparent") and opacity not in ("0", "0.0", ".0")


@dataclass(frozen=True, eq=False)
class Clip:
    """What cuts shapes off: a clip path, or a mask.

    Attributes:
        name: the property that asks for it, for messages.
        properties: of the element that draws it; None where there is none, it depends on the box of what it cuts, or
            holds pictures or text.
        shapes: what this draws, in the root's user units.
    """

    name: str
    properties: Mapping[str, str] | None = None
    shapes: tuple[Node, ...] = ()


def parse(data: bytes) -> "Document":
    """Return an SVG document, its tree still to be walked.

    Raises:
        InputError: not XML, not SVG, entities, too deep or too many elements, a malformed transform or viewBox of the
            root.
    """
    return Document(root(data))


class Document:
    """A parsed document.

    Attributes:
        top: its <svg>.
        ids: its elements by id.
        sheet: its style sheet, if any.
        copies: what is shown again so far.
        canvas: its viewBox or size in user units; None when it states none.
        unset_texts: the texts seen so far that are not outlined, by Python's id.
        painted_texts: those that are painted in parts, as groups of paths.
        root: the node of `top`.
    """

    def __init__(self, top: Element):
        self.top, self.copies = top, Copies()
        self.ids = {e.get("id", ""): e for e in reversed(list(top.iter()))}
        text = "\n".join("".join(e.itertext()) for e in top.iter() if local(e) == "style")
        self.sheet = None
        if text:
            from .stylesheet import Stylesheet  # and its library: few drawings need them

            self.sheet = Stylesheet(text, top)
        self.lettering = lettering.Lettering(self.own, self.linked)
        self.unset_texts: set[int] = set()
        self.painted_texts: dict[Element, Node] = {}
        self._root_font = fonts_in_css.MEDIUM
        self.canvas: Rectangle | None = canvas(top)
        corner, size = (self.canvas[:2], self.canvas[2:]) if self.canvas else ((0.0, 0.0), None)
        self.root = self._resolved(Node(top, "g", IDENTITY, size, corner, depth=1), {})
        self.root.names = ()
        self._clips: dict[tuple[int, Affine, tuple[float, float] | None], Clip] = {}
        self._unread: dict[int, bool] = {}

    @property
    def unread(self) -> int:
        """How many of its selectors are not read."""
        return self.sheet.unread if self.sheet else 0

    @cached_property
    def tags(self) -> dict[str, str]:
        """The tags of all elements by id and Inkscape label."""
        return {n: local(e) for e in self.top.iter() for n in (e.get("id"), e.get(LABEL)) if n}

    @cached_property
    def shapes(self) -> list[Node]:
        """The shapes that the document shows, in painting order, with what cuts them off.

        Raises:
            InputError: a `use` of itself, a malformed transform, length or viewBox, or too much is drawn again.
        """
        return [node for node in self._shown if node.tag in SHAPES]

    @property
    def pictures(self) -> list[Node]:
        """The embedded pictures that the document shows and of which width and height are stated, in the same way."""
        return [node for node in self._shown if node.tag == "image" and self._is_embedded(node)]

    @cached_property
    def _shown(self) -> list[Node]:
        """Shapes and pictures that the document shows."""
        self.root.clips = self._cut_by(self.root)
        return [] if self.root.hidden else list(self._shapes(self.root, pictures=True))

    @staticmethod
    def _is_embedded(node: Node) -> bool:
        stated = all(node.properties.get(side, "auto").strip() != "auto" for side in ("width", "height"))
        return stated and any(node.element.get(link, "").strip().startswith("data:") for link in LINKS)

    def linked(self, element: Element) -> Element | None:
        """Return the element of the same document that another one's href names."""
        link = next(filter(None, map(element.get, LINKS)), "")
        return self.ids.get(link[1:]) if link.startswith("#") else None

    def named(self, paint: str, *tags: str) -> Element | None:
        """Return the element of one of these tags that `url(#id)` names."""
        match = _URL.match(paint)
        found = self.ids.get(match[1]) if match else None
        return found if found is not None and local(found) in tags else None

    def own(self, element: Element) -> dict[str, str]:
        """Return an element's attributes and styles by name, nothing inherited."""
        own = {k: v for k, v in element.attrib.items() if k[0] != "{"}
        style = own.get("style")
        if not self.sheet:
            return own | css.declarations(style) if style else own
        said = self.sheet.style(element)
        return own | (css.Style(said, said.important).add(css.declarations(style)) if style else said)

    def children(self, node: Node) -> Iterator[Node]:
        """Yield what is rendered in a node, in painting order: what a <use> refers to, the viewport of an <svg> or
        <symbol>, the first child of a <switch> that is understood, else all children, those of unknown tags included.

        Raises:
            InputError: a `use` of itself, a malformed transform, length or viewBox, or too much is drawn again.
        """
        if node.tag == "use":
            yield from self._used(node)
        elif node.tag in ("svg", "symbol"):
            yield _viewport(node)
        elif node.tag == "switch":
            understood = (child for child in node.element if _is_understood(child))
            yield from (self._child(child, node, node.used) for child in list(understood)[:1])
        else:
            for child in node.element:
                if local(child) not in _NEVER_RENDERED:
                    yield self._child(child, node, node.used)

    def definition(self, found: Element, node: Node, units: Affine = IDENTITY) -> Node:
        """Return a clip path or mask that a node uses; it inherits from nothing around it.

        Args:
            found: its element.
            node: what it cuts.
            units: from the units of what it draws to the node's.

        Raises:
            InputError: they refer to each other too often, or its transform is malformed.
        """
        if len(node.used) > limits.SVG_LINKS:
            raise InputError(
                f"clip paths, masks and <use> refer to each other more than {limits.SVG_LINKS} deep"
            )
        own = self.own(found)
        transform = affine.parse(own.get("transform", "")) if local(found) == "clipPath" else IDENTITY
        return Node(
            found,
            local(found),
            node.affine @ transform @ units,
            node.size,
            node.origin,
            used=(*node.used, id(found)),
            depth=node.depth + 1,
            own=own,
            properties=own,
        )

    def _used(self, node: Node) -> Iterator[Node]:
        target = self.linked(node.element)
        if target is None:  # elsewhere, or nowhere: SVG draws nothing, and no other file is read
            return
        if id(target) in node.used:
            raise InputError(f"<use> of {'#' + target.get('id', '')!r} contains itself")
        tag = local(target)
        if tag == "symbol" or tag not in _NEVER_RENDERED:
            child = self._child(target, node, (*node.used, id(target)))
            if tag in ("symbol", "svg"):
                size = {k: node.properties[k] for k in ("width", "height") if k in node.properties}
                child.properties = dict(child.properties) | size
            yield child

    def _child(self, element: Element, outer: Node, used: tuple[int, ...]) -> Node:
        """Return the node of an element in another, counted where it is drawn again."""
        tag = local(element)
        groups = outer.groups + outer.names
        node = Node(element, tag, outer.affine, outer.size, outer.origin, groups, used, outer.depth + 1)
        node.opacity = outer.opacity
        if tag not in _RENDERED:
            return self._lettered(node, outer) if tag == "text" else node
        if used and tag != "symbol":
            self.copies.add(element)
        if outer.depth > limits.SVG_DEPTH:
            raise InputError(f"<use> nests elements more than {limits.SVG_DEPTH} deep")
        return self._resolved(node, outer.properties)

    def _lettered(self, node: Node, outer: Node) -> Node:
        """Return the node of a text as a path, where it can be outlined."""
        if node.used:
            self.copies.add(node.element, whole=True)
        found = self._resolved(replace(node), outer.properties)
        if found.hidden:
            return node
        parts = self.lettering.painted(node.element, found.properties)
        if parts is None:
            self.unset_texts.add(id(node.element))
            return node
        if [paint for paint, _ in parts] == [self.lettering.plain(found.properties)]:
            found.tag, found.properties = "path", {**found.properties, "d": parts[0][1]}
            return found
        self.painted_texts[node.element] = found
        found.tag, found.element = "g", _as_paths(node.element, parts)
        return found

    def _resolved(self, node: Node, inherited: Mapping[str, str]) -> Node:
        """Return the node, with its own styles, transform and names; only `hidden` where it is not displayed."""
        own = node.own = self.own(node.element)
        node.hidden = own.get("display") == "none" or own.get("opacity", "").strip() in ("0", "0%", "0.0")
        if node.hidden:
            return node
        node.opacity *= _share(own.get("opacity", "1"))
        kept = {k: inherited[k] for k in _INHERITED if k in inherited}
        node.properties = kept | {k: v for k, v in own.items() if v != "inherit"}
        self._settle_fonts(node, own, inherited)
        names = node.element.get("id"), node.element.get(LABEL)
        node.names = tuple(dict.fromkeys(n for n in names if n))
        if "transform" in node.properties and node.element is not self.top:
            node.affine = node.affine @ self._transform(node)
        if node.tag == "use":  # x and y are part of its transform, for what cuts it off, too
            x, y = (length(node.properties.get(k) or "0", node.size, k, f"<use> {k}") for k in "xy")
            node.affine = node.affine @ affine.translation(x, y)
        return node

    def _settle_fonts(self, node: Node, own: Mapping[str, str], inherited: Mapping[str, str]) -> None:
        """Give the size of the font in px, and lengths that refer to it."""
        properties = dict(node.properties)
        changed = fonts_in_css.shorthand(own["font"]) if "font" in own else {}
        if changed:
            properties |= {k: v for k, v in changed.items() if k not in own} | {"font": ""}
            del properties["font"]
        outer = fonts_in_css.px(inherited.get("font-size", ""))
        if ("font-size" in own or changed) and (size := properties.get("font-size", "inherit")) != "inherit":
            properties["font-size"] = repr(fonts_in_css.size(size, outer, self._root_font))
        inner = fonts_in_css.px(properties.get("font-size", ""))
        if node.element is self.top:
            self._root_font = inner
        for name in fonts_in_css.LENGTHS.intersection(own):
            properties[name] = fonts_in_css.without_ems(properties[name], inner, self._root_font)
        node.properties = properties

    def _transform(self, node: Node) -> Affine:
        """Return the transform of a node, about its origin, which is measured from the viewBox or from the node's own
        box.
        """
        properties, corner, size = node.properties, node.origin, node.size
        if own_box := properties.get("transform-box", "view-box").strip() in _OWN_BOXES:
            corner, size = self._own_box(node)
        text = properties["transform"]
        if "%" in text and size:
            text = _TRANSLATED.sub(lambda found: _without_percentages(found, size), text)
        own = affine.parse(text)
        if "transform-origin" not in properties and not own_box:
            return own
        words = [*properties.get("transform-origin", "0 0").split(), "center"][:2]
        if words[0] in ("top", "bottom") or words[1] in ("left", "right"):
            words.reverse()
        words = [_KEYWORDS.get(w, w) for w in words]
        at = [length(w, size, axis, "transform-origin") for w, axis in zip(words, "xy")]
        at = [a + o for a, o in zip(at, corner)]
        return affine.translation(*at) @ own @ affine.translation(-at[0], -at[1])

    def _own_box(self, node: Node) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the corner and the size of the box of a node, in its own units and without its transform."""
        plain = {k: v for k, v in node.properties.items() if not k.startswith("transform")}
        still = replace(node, affine=IDENTITY, properties=plain)
        if still.tag == "text":
            data = self.lettering.path_data(node.element, plain)
            still = replace(still, tag="path", properties=plain | {"d": data or ""})
        boxes = []
        for shape in [still] if still.tag in SHAPES else self._shapes(still):
            if (box := basic_shapes.box_of(shape)) is not None:
                corners = np.array(
                    [*box, complex(box[0].real, box[1].imag), complex(box[1].real, box[0].imag)]
                )
                boxes.append(shape.affine(corners))
        low, high = bounding_box(np.concatenate(boxes)) if boxes else (0j, 0j)
        return (low.real, low.imag), ((high - low).real, (high - low).imag)

    def _shapes(self, node: Node, *, pictures: bool = False) -> Iterator[Node]:
        """Yield the shapes shown in a node, with its pictures if they are asked for."""
        for child in self.children(node):
            drawn = child.tag in SHAPES or (pictures and child.tag == "image")
            if not child.hidden and (drawn or child.tag in GROUPS):
                child.clips = node.clips + self._cut_by(child)
                if child.tag in GROUPS:
                    yield from self._shapes(child, pictures=pictures)
                elif child.properties.get("visibility", "visible") == "visible":
                    yield child

    def _cut_by(self, node: Node) -> tuple[Clip, ...]:
        """Return the clip path and the mask of a node itself, or the rectangle of a viewport."""
        if node.tag == VIEWPORT:
            return (Clip("overflow", {}, (node.frame,)),) if node.frame else ()
        said = ((name, node.properties.get(name, "none").strip()) for name in CLIPS)
        return tuple(self._clip(name, text, node) for name, text in said if text not in ("", "none"))

    def _clip(self, name: str, said: str, node: Node) -> Clip:
        tag, units = CLIPS[name]
        found = self.named(said, tag)
        if found is None or id(found) in node.used:
            return Clip(name)
        inside = self.definition(found, node)
        if id(found) not in self._unread:
            self._unread[id(found)] = any(local(each) in UNREAD for each in found.iter())
        if self._unread[id(found)] or inside.own.get(units) == "objectBoundingBox":
            return Clip(name)
        place = id(found), node.affine, node.size
        if place not in self._clips:
            inside.clips = self._cut_by(inside)
            self._clips[place] = Clip(name, inside.own, tuple(self._shapes(inside)))
        return self._clips[place]


def _as_paths(text: Element, parts: Sequence[tuple[Mapping[str, str], str]]) -> Element:
    """Return a <text> whose content is a path for each part that is painted alike, which has all that this takes."""
    group = Element(text.tag, text.attrib)
    tag = text.tag.replace("text", "path")
    for paint, data in parts:
        SubElement(group, tag, {"d": data, "style": ";".join(f"{k}:{v}" for k, v in paint.items())})
    return group


def _share(text: str) -> float:
    """Return a number from 0 to 1, or a percentage; 1 where it is neither."""
    words = text.strip()
    try:
        value = float(words.rstrip("%")) / (100 if words.endswith("%") else 1)
    except ValueError:
        return 1.0
    return min(1.0, max(0.0, value)) if value == value else 1.0


def _without_percentages(translate: "re.Match[str]", size: tuple[float, float]) -> str:
    """Return a translation in numbers, of which parts are percentages of a box."""
    sides = size[::-1] if translate[1] == "translateY" else size
    parts = [
        repr(length(part, size, axis, "transform")) if part.endswith("%") else part
        for part, axis in zip(re.split(r"[\s,]+", translate[2].strip()), "yx" if sides is not size else "xy")
    ]
    return f"{translate[1]}({','.join(parts)})"


def _is_understood(element: Element) -> bool:
    """Return whether a <switch> takes this child."""
    drawn = local(element) in _RENDERED - {"symbol"} | {"text"}
    speaks = element.get("systemLanguage", "en").partition("-")[0].strip() == "en"
    return drawn and "requiredExtensions" not in element.attrib and speaks


def _viewport(node: Node) -> Node:
    """Return what is inside an <svg> or a <symbol>, whose rectangle and viewBox its properties give."""
    said, size, corner, frame = node.properties, node.size, (0.0, 0.0), None
    given = {k: said[k] for k in ("x", "y", "width", "height") if said.get(k, "auto") != "auto"}
    sides = ({"width": "100%", "height": "100%"} if size else {}) | given
    x, y = (length(given.get(k) or "0", size, k, k) for k in "xy")
    fit = affine.translation(x, y)
    if "width" in sides and "height" in sides:
        size = width, height = (
            length(sides["width"], size, "x", "width"),
            length(sides["height"], size, "y", "height"),
        )
        if "viewBox" in said and min(size) > 0:
            box, aspect = view_box(said), said.get("preserveAspectRatio", "xMidYMid")
            fit, size, corner = affine.viewport((x, y, width, height), box, aspect), box[2:], box[:2]
    overflows = said.get("overflow", "hidden").strip() in ("visible", "auto")
    if not overflows and size and min(size) > 0:
        frame = Node(node.element, "rect", node.affine, node.size, properties=sides)
    return replace(
        node,
        tag=VIEWPORT,
        affine=node.affine @ fit,
        size=size,
        origin=corner,
        groups=node.groups + node.names,
        names=(),
        own={},
        frame=frame,
    )
