"""The rendering tree of an SVG document (SVG 2, section 3.1), resolved once for all readers.

Styles are cascaded, transforms and viewports composed, `use` expanded, and clip paths and masks found. No other file is
ever read: entities are refused, and only links to ids in the same file are followed.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ...errors import InputError
from ...plane import bounding_box
from .. import limits
from . import affine, basic_shapes, css, css_functions, fonts_in_css, lettering
from .affine import Affine
from .budget import Copies
from .document import SHAPES, canvas, length, local, root, unit_of_length, view_box
from .drawing_content import Rectangle

VIEWPORT = "viewport"  # tag of the node inside an <svg> or <symbol>, which has no element
GROUPS = frozenset(["g", "a", "switch", "svg", "symbol", "use", VIEWPORT])
_RENDERED = SHAPES | GROUPS | {"image"}
# Rendered only by reference, or not at all; "" stands for elements that are not SVG.
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
_CSS_PATH = re.compile(r"""\s*path\(\s*(["'])([^"']*)\1\s*\)\s*""")
LABEL, MODE = (f"{{http://www.inkscape.org/namespaces/inkscape}}{name}" for name in ("label", "groupmode"))
"""Attributes of Inkscape: the name that people give an element, and "layer" for groups that are layers."""
LINKS = ("href", "{http://www.w3.org/1999/xlink}href")
EFFECTS = {"clip-path": "clipPath", "mask": "mask", "filter": "filter"}
"""Properties that apply to what an element and its content paint, and the elements that they refer to."""
CLIPS = {"clip-path": "clipPathUnits", "mask": "maskContentUnits"}
"""Those that cut, and the attributes for units relative to a bounding box."""
UNREAD = frozenset(["image", "text", "foreignObject"])  # elements without shapes
_CONTEXT = {"context-fill": "fill", "context-stroke": "stroke"}
_URL = re.compile(r"""\s*url\(\s*["']?#([^"')]+?)["']?\s*\)""")
_INHERITED = (
    *("fill", "stroke", "fill-opacity", "stroke-opacity"),
    *("fill-rule", "visibility", "clip-rule", "paint-order", "color"),
    *("stroke-width", "stroke-dasharray", "stroke-dashoffset", "stroke-linejoin", "stroke-linecap"),
    *("marker", "marker-start", "marker-mid", "marker-end"),
    *lettering.INHERITED,
)
IDENTITY = Affine()
_OWN_BOXES = ("fill-box", "content-box", "stroke-box", "border-box")
"""Values of `transform-box` that mean the element's own box; line widths are ignored."""
_TRANSLATED = re.compile(r"(translate[XY]?)\s*\(([^()]*)\)")
TRANSFORMS = frozenset(["transform", "translate", "rotate", "scale"])
"""Properties that transform an element."""
_KEYWORDS = {"left": "0", "top": "0", "center": "50%", "right": "100%", "bottom": "100%"}


@dataclass(eq=False, slots=True)
class Node:
    """An element where it is rendered.

    Attributes:
        element: of the document; the same for all nodes that `use` makes of it.
        tag: the element's tag, or VIEWPORT.
        affine: map from its own coordinates to the root's user units.
        size: width and height that percentages refer to; None where the document does not give them.
        origin: corner of the viewBox, from which `transform-origin` is measured.
        groups: ids and labels of all elements that contain it.
        copied_from: elements that it is a copy of: targets of <use>, clip paths and masks, innermost last, as Python's
            ids.
        depth: of nesting.
        declared: its attributes and styles by name, including the style sheet, without inherited ones.
        properties: its own and inherited properties.
        names: its id and Inkscape label, if any.
        hidden: whether it and its content are not displayed.
        opacity: product of the opacities of itself and of all groups that contain it.
        frame: the clipping rectangle of a viewport, as a node outside of it; None if content may overflow.
        clips: clip paths and masks of itself and of all elements that contain it; set only in `Document.shapes`.
        faults: errors in its path data or points, which are drawn up to there; known once these are read.
        context: fill and stroke of the <use> that draws it, which `context-fill` and `context-stroke` mean.
    """

    element: Element
    tag: str
    affine: Affine
    size: tuple[float, float] | None
    origin: tuple[float, float] = (0.0, 0.0)
    groups: tuple[str, ...] = ()
    copied_from: tuple[int, ...] = ()
    depth: int = 0
    declared: Mapping[str, str] = field(default_factory=dict)
    properties: Mapping[str, str] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    hidden: bool = False
    opacity: float = 1.0
    frame: "Node | None" = None
    clips: "tuple[Clip, ...]" = ()
    faults: tuple[str, ...] = ()
    context: Mapping[str, str] = field(default_factory=dict)

    def length(self, name: str, axis: str, default: float = 0.0) -> float:
        """Return a length attribute in user units; percentages refer to `axis` (x, y or r)."""
        text = self.properties.get(name, "")
        return length(text, self.size, axis, name) if text.strip() not in ("", "auto") else default

    @property
    def name(self) -> str:
        """The shape's name in messages."""
        return f"<{self.tag}> {self.names[0]!r}" if self.names else f"<{self.tag}> without id"

    @property
    def filled(self) -> bool:
        """Whether its fill is painted; SVG closes open subpaths of such a shape."""
        return self._painted("fill", "black")

    @property
    def stroked(self) -> bool:
        """Whether its stroke is painted."""
        return self._painted("stroke", "none")

    def alpha(self, kind: str) -> float:
        """Return the opacity of its "fill" or "stroke", as far as it is given by numbers."""
        return self.opacity * _share(self.properties.get(f"{kind}-opacity", "1"))

    @property
    def dashed(self) -> bool:
        """Whether its stroke is dashed."""
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
    """A clip path or mask that cuts shapes.

    Attributes:
        name: the property that refers to it, for messages.
        properties: of its element; None if that is missing, depends on the bounding box of the shape, or contains
            pictures or text.
        shapes: its content, in the root's user units.
    """

    name: str
    properties: Mapping[str, str] | None = None
    shapes: tuple[Node, ...] = ()


def parse(data: bytes) -> "Document":
    """Parse an SVG document; its tree is resolved later.

    Raises:
        InputError: not XML, not SVG, entities, too deeply nested or too many elements, a malformed transform or viewBox
            of the root.
    """
    top = root(data)
    if b"conic-gradient" in data:
        from .css_pictures import replace_angular_gradients  # with Pillow, which few drawings need

        replace_angular_gradients(top)
    return Document(top)


class Document:
    """A parsed document.

    Attributes:
        top: its <svg>.
        ids: its elements by id.
        sheet: its style sheet, if any.
        has_variables: whether a style has a `var()`.
        copies: count of content that is drawn repeatedly.
        canvas: its viewBox or size in user units; None if it has neither.
        millimetres: length of a user unit; None if it is not stated.
        unit: the unit in which its size is stated, such as "in"; empty if it is not.
        unset_texts: reasons why texts found so far are not outlined, as clauses, by Python's id.
        substituted_texts: in which fonts texts are set whose font is missing, as clauses, by Python's id.
        painted_texts: texts with several paints, as groups of paths.
        root: the node of `top`.
    """

    def __init__(self, top: Element):
        self.top, self.copies = top, Copies()
        self.ids = {e.get("id", ""): e for e in reversed(list(top.iter()))}
        text = "\n".join("".join(e.itertext()) for e in top.iter() if local(e) == "style")
        self.sheet = None
        styles = [text, *(value for e in top.iter() for value in e.attrib.values())]
        self.has_variables = any("var(" in style for style in styles)
        self._parents = (
            {child: parent for parent in top.iter() for child in parent} if self.has_variables else {}
        )
        self._variables: dict[int, Mapping[str, str]] = {}
        if text:
            from .stylesheet import Stylesheet  # with its library, which few drawings need

            self.sheet = Stylesheet(text, top)
        self.lettering = lettering.Lettering(self.declared, self.linked)
        self.unset_texts: dict[int, str] = {}
        self.substituted_texts: dict[int, str] = {}
        self.painted_texts: dict[Element, Node] = {}
        self._root_font = fonts_in_css.MEDIUM_PIXELS
        self.canvas: Rectangle | None = canvas(top)
        self.millimetres, self.unit = unit_of_length(top)
        corner, size = (self.canvas[:2], self.canvas[2:]) if self.canvas else ((0.0, 0.0), None)
        self.root = self.resolved(Node(top, "g", IDENTITY, size, corner, depth=1), {})
        self.root.names = ()
        self._clips: dict[tuple[int, Affine, tuple[float, float] | None], Clip] = {}
        self._effects: dict[tuple[int, str, Rectangle], Element | None] = {}
        self._unread: dict[int, bool] = {}

    @property
    def unread(self) -> int:
        """Number of its selectors that are not supported."""
        return self.sheet.unread if self.sheet else 0

    @cached_property
    def tags(self) -> dict[str, str]:
        """The tags of all elements with an id or Inkscape label, by that."""
        return {n: local(e) for e in self.top.iter() for n in (e.get("id"), e.get(LABEL)) if n}

    @cached_property
    def shapes(self) -> list[Node]:
        """The shapes that are displayed, in painting order, with their clip paths and masks.

        Raises:
            InputError: a `use` of itself, a malformed transform, length or viewBox, or too much is drawn repeatedly.
        """
        return [node for node in self._displayed if node.tag in SHAPES]

    @property
    def pictures(self) -> list[Node]:
        """The embedded pictures that are displayed and have a width and height, like `shapes`."""
        return [node for node in self._displayed if node.tag == "image" and self._is_embedded(node)]

    @cached_property
    def _displayed(self) -> list[Node]:
        """Shapes and pictures that are displayed."""
        self.root.clips = self._cut_by(self.root)
        return [] if self.root.hidden else list(self._shapes(self.root, pictures=True))

    @staticmethod
    def _is_embedded(node: Node) -> bool:
        stated = all(node.properties.get(side, "auto").strip() != "auto" for side in ("width", "height"))
        return stated and any(node.element.get(link, "").strip().startswith("data:") for link in LINKS)

    def linked(self, element: Element) -> Element | None:
        """Return the element of the same document that an element's href refers to."""
        link = next(filter(None, map(element.get, LINKS)), "")
        return self.ids.get(link[1:]) if link.startswith("#") else None

    def referenced(self, paint: str, *tags: str) -> Element | None:
        """Return the element that `url(#id)` refers to, if it has one of the given tags."""
        match = _URL.match(paint)
        element = self.ids.get(match[1]) if match else None
        return element if element is not None and local(element) in tags else None

    def effect(self, node: Node, name: str) -> Element | None:
        """Return the element for a node's clip path, mask or filter; None if there is none that can be used.

        Functions of CSS, such as `circle(40%)` and `blur(2px)`, become elements.

        Args:
            node: the node.
            name: "clip-path", "mask" or "filter".
        """
        text = node.properties.get(name, "none")
        referenced = self.referenced(text, EFFECTS[name])
        if referenced is not None or name == "mask" or not css_functions.is_function(text):
            return referenced
        box = self._reference_box(node, "fill-box" if name == "filter" else css_functions.reference_box(text))
        key = id(node.element), text, box
        if key not in self._effects:
            color = node.properties.get("color", "black")
            made = (
                css_functions.filter_element(text, box, color)
                if name == "filter"
                else css_functions.clip_path(text, box)
            )
            if made is not None:
                numbered = (f"css-{number}" for number in count(1))
                made.set("id", next(number for number in numbered if number not in self.ids))
                self.ids[made.get("id", "")] = made
            self._effects[key] = made
        return self._effects[key]

    def _reference_box(self, node: Node, kind: str) -> Rectangle:
        """Return the box that functions of CSS refer to, in the node's own units."""
        if kind == "view-box" and node.size:
            return (0.0, 0.0, *node.size)
        (x, y), (width, height) = self._own_box(node)
        if kind in css_functions.FILL_BOXES or not node.stroked or node.tag not in SHAPES:
            return x, y, width, height
        line = node.length("stroke-width", "r", 1.0)
        return x - line / 2, y - line / 2, width + line, height + line

    def declared(self, element: Element) -> dict[str, str]:
        """Return an element's attributes and styles by name, without inherited ones; `var()` is substituted."""
        declared = self._declared(element)
        if not self.has_variables:
            return declared
        variables = self._variables_of(element)
        substituted = {k: css.substituted(v, variables) if "var(" in v else v for k, v in declared.items()}
        return {k: v for k, v in substituted.items() if v is not None}

    def _variables_of(self, element: Element) -> Mapping[str, str]:
        """Return the custom properties (`--name`) that apply to an element."""
        if id(element) not in self._variables:
            parent = self._parents.get(element)
            inherited = self._variables_of(parent) if parent is not None else {}
            own = {k: v for k, v in self._declared(element).items() if k.startswith("--")}
            self._variables[id(element)] = {**inherited, **own} if own else inherited
        return self._variables[id(element)]

    def _declared(self, element: Element) -> dict[str, str]:
        attributes = {k: v for k, v in element.attrib.items() if k[0] != "{"}
        style = attributes.get("style")
        if not self.sheet:
            return attributes | css.declarations(style) if style else attributes
        from_sheet = self.sheet.style(element)
        if style:
            from_sheet = css.Style(from_sheet, from_sheet.important).add(css.declarations(style))
        return attributes | from_sheet

    def children(self, node: Node) -> Iterator[Node]:
        """Yield the nodes rendered in a node, in painting order.

        That is the target of a <use>, the viewport of an <svg> or <symbol>, the first supported child of a <switch>, or
        else all children, including those with unknown tags.

        Raises:
            InputError: a `use` of itself, a malformed transform, length or viewBox, or too much is drawn repeatedly.
        """
        if node.tag == "clipPath":
            yield from self._clip_children(node)
        elif node.tag == "use":
            yield from self._use_target(node)
        elif node.tag in ("svg", "symbol"):
            yield _viewport(node)
        elif node.tag == "switch":
            understood = (child for child in node.element if _is_understood(child))
            yield from (self._child(child, node, node.copied_from) for child in list(understood)[:1])
        else:
            for child in node.element:
                if local(child) not in _NEVER_RENDERED:
                    yield self._child(child, node, node.copied_from)

    def _clip_children(self, node: Node) -> Iterator[Node]:
        """Yield the content of a clip path: shapes, text, and uses of them; groups do not clip, as in browsers."""
        for child in node.element:
            target = self.linked(child) if local(child) == "use" else child
            if target is not None and local(target) in SHAPES | {"text"}:
                yield self._child(child, node, node.copied_from)

    def definition(self, element: Element, node: Node, units: Affine = IDENTITY) -> Node:
        """Return the node of a clip path or mask, which inherits nothing from its surroundings.

        Args:
            element: its element.
            node: the node that it cuts.
            units: map from the units of its content to those of the node.

        Raises:
            InputError: such references are nested too deeply, or its transform is malformed.
        """
        if len(node.copied_from) > limits.SVG_LINKS:
            raise InputError(
                f"clip paths, masks and <use> refer to each other more than {limits.SVG_LINKS} deep"
            )
        declared = self.declared(element)
        transform = affine.parse(declared.get("transform", "")) if local(element) == "clipPath" else IDENTITY
        return Node(
            element,
            local(element),
            node.affine @ transform @ units,
            node.size,
            node.origin,
            copied_from=(*node.copied_from, id(element)),
            depth=node.depth + 1,
            declared=declared,
            properties=declared,
        )

    def _use_target(self, node: Node) -> Iterator[Node]:
        target = self.linked(node.element)
        if target is None:  # a missing element or another file: SVG draws nothing, and no file is read
            return
        if id(target) in node.copied_from:
            raise InputError(f"<use> of {'#' + target.get('id', '')!r} contains itself")
        tag = local(target)
        if tag == "symbol" or tag not in _NEVER_RENDERED:
            child = self._child(target, node, (*node.copied_from, id(target)))
            if tag in ("symbol", "svg"):
                size = {k: node.properties[k] for k in ("width", "height") if k in node.properties}
                child.properties = dict(child.properties) | size
            yield child

    def _child(self, element: Element, outer: Node, copied_from: tuple[int, ...]) -> Node:
        """Return the node of a child element; it counts towards the limit if it is drawn repeatedly."""
        tag = local(element)
        groups = outer.groups + outer.names
        node = Node(
            element, tag, outer.affine, outer.size, outer.origin, groups, copied_from, outer.depth + 1
        )
        node.opacity, node.context = outer.opacity, outer.context
        if outer.tag == "use":
            defaults = (("fill", "black"), ("stroke", "none"))
            node.context = {kind: outer.properties.get(kind, default) for kind, default in defaults}
        if tag not in _RENDERED:
            return self._lettered(node, outer) if tag == "text" else node
        if copied_from and tag != "symbol":
            self.copies.add(element)
        if outer.depth > limits.SVG_DEPTH:
            raise InputError(f"<use> nests elements more than {limits.SVG_DEPTH} deep")
        return self.resolved(node, outer.properties)

    def _lettered(self, node: Node, outer: Node) -> Node:
        """Return the node of a text as a path, where it can be outlined."""
        if node.copied_from:
            self.copies.add(node.element, whole=True)
        text = self.resolved(replace(node), outer.properties)
        if text.hidden:
            return node
        parts = self.lettering.painted(node.element, text.properties)
        if parts is None:
            self.unset_texts[id(node.element)] = self.lettering.reason
            return node
        if self.lettering.substitution:
            self.substituted_texts[id(node.element)] = self.lettering.substitution
        if [paint for paint, _ in parts] == [self.lettering.plain(text.properties)]:
            text.tag, text.properties = "path", {**text.properties, "d": parts[0][1]}
            return text
        self.painted_texts[node.element] = text
        text.tag, text.element = "g", _as_paths(node.element, parts)
        return text

    def resolved(self, node: Node, inherited: Mapping[str, str]) -> Node:
        """Resolve a node's styles, transform and names; only `hidden` is set if it is not displayed."""
        declared = node.declared = self.declared(node.element)
        transparent = declared.get("opacity", "").strip() in ("0", "0%", "0.0")
        node.hidden = declared.get("display") == "none" or transparent
        if node.hidden:
            return node
        node.opacity *= _share(declared.get("opacity", "1"))
        from_parent = {k: inherited[k] for k in _INHERITED if k in inherited}
        node.properties = from_parent | {k: v for k, v in declared.items() if v != "inherit"}
        if node.tag == "path" and (data := path_data_in_css(declared.get("d", ""))) is not None:
            node.properties["d"] = data
        for kind in ("fill", "stroke"):
            if (paint := node.properties.get(kind, "").strip()) in _CONTEXT:
                node.properties[kind] = node.context.get(_CONTEXT[paint], "none")
        self._settle_fonts(node, declared, inherited)
        names = node.element.get("id"), node.element.get(LABEL)
        node.names = tuple(dict.fromkeys(n for n in names if n))
        if TRANSFORMS & node.properties.keys() and node.element is not self.top:
            node.affine = node.affine @ self.transform(node)
        if node.tag == "use":  # x and y are part of its transform, also for what clips it
            x, y = (length(node.properties.get(k) or "0", node.size, k, f"<use> {k}") for k in "xy")
            node.affine = node.affine @ affine.translation(x, y)
        return node

    def _settle_fonts(self, node: Node, declared: Mapping[str, str], inherited: Mapping[str, str]) -> None:
        """Convert the node's font size, and lengths relative to it, to px."""
        properties = dict(node.properties)
        changed = fonts_in_css.shorthand(declared["font"]) if "font" in declared else {}
        if changed:
            properties |= {k: v for k, v in changed.items() if k not in declared} | {"font": ""}
            del properties["font"]
        outer = fonts_in_css.px(inherited.get("font-size", ""))
        size = properties.get("font-size", "inherit")
        if ("font-size" in declared or changed) and size != "inherit":
            properties["font-size"] = repr(fonts_in_css.size(size, outer, self._root_font))
        inner = fonts_in_css.px(properties.get("font-size", ""))
        if node.element is self.top:
            self._root_font = inner
        for name in fonts_in_css.LENGTHS.intersection(declared).intersection(properties):
            properties[name] = fonts_in_css.without_ems(properties[name], inner, self._root_font)
        node.properties = properties

    def transform(self, node: Node) -> Affine:
        """Return the transform of a node about its origin, which is relative to the viewBox or the node's own box."""
        properties, corner, size = node.properties, node.origin, node.size
        if own_box := properties.get("transform-box", "view-box").strip() in _OWN_BOXES:
            corner, size = self._own_box(node)
        text = " ".join(filter(None, (*separate_transforms(properties), properties.get("transform", ""))))
        if "%" in text and size:
            text = _TRANSLATED.sub(lambda match: _without_percentages(match, size), text)
        transform = affine.parse(text)
        if "transform-origin" not in properties and not own_box:
            return transform
        words = [*properties.get("transform-origin", "0 0").split(), "center"][:2]
        if words[0] in ("top", "bottom") or words[1] in ("left", "right"):
            words.reverse()
        words = [_KEYWORDS.get(w, w) for w in words]
        origin = [length(w, size, axis, "transform-origin") for w, axis in zip(words, "xy")]
        origin = [a + o for a, o in zip(origin, corner)]
        return affine.translation(*origin) @ transform @ affine.translation(-origin[0], -origin[1])

    def _own_box(self, node: Node) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the corner and size of a node's bounding box, in its own units and without its transform."""
        placing = {*TRANSFORMS, "transform-box", "transform-origin"}
        plain = {k: v for k, v in node.properties.items() if k not in placing}
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
        """Yield the shapes displayed in a node, and with `pictures` its pictures."""
        for child in self.children(node):
            is_drawn = child.tag in SHAPES or (pictures and child.tag == "image")
            if not child.hidden and (is_drawn or child.tag in GROUPS):
                child.clips = node.clips + self._cut_by(child)
                if child.tag in GROUPS:
                    yield from self._shapes(child, pictures=pictures)
                elif child.properties.get("visibility", "visible") == "visible":
                    yield child

    def _cut_by(self, node: Node) -> tuple[Clip, ...]:
        """Return the clip path and mask of a node itself, or the rectangle of a viewport."""
        if node.tag == VIEWPORT:
            return (Clip("overflow", {}, (node.frame,)),) if node.frame else ()
        used = [name for name in CLIPS if node.properties.get(name, "none").strip() not in ("", "none")]
        return tuple(self._clip(name, node) for name in used)

    def _clip(self, name: str, node: Node) -> Clip:
        units = CLIPS[name]
        element = self.effect(node, name)
        if element is None or id(element) in node.copied_from:
            return Clip(name)
        inside = self.definition(element, node)
        if id(element) not in self._unread:
            self._unread[id(element)] = any(local(descendant) in UNREAD for descendant in element.iter())
        if self._unread[id(element)] or inside.declared.get(units) == "objectBoundingBox":
            return Clip(name)
        place = id(element), node.affine, node.size
        if place not in self._clips:
            inside.clips = self._cut_by(inside)
            self._clips[place] = Clip(name, inside.declared, tuple(self._shapes(inside)))
        return self._clips[place]


def _as_paths(text: Element, parts: Sequence[tuple[Mapping[str, str], str]]) -> Element:
    """Return a <text> as a group with one path for each part with the same paint."""
    group = Element(text.tag, text.attrib)
    tag = text.tag.replace("text", "path")
    for paint, data in parts:
        SubElement(group, tag, {"d": data, "style": ";".join(f"{k}:{v}" for k, v in paint.items())})
    return group


def separate_transforms(properties: Mapping[str, str]) -> Iterator[str]:
    """Yield CSS's properties `translate`, `rotate` and `scale` as functions of `transform`, in their order."""
    for name in ("translate", "rotate", "scale"):
        words = properties.get(name, "none").split()
        # the attribute `rotate` of text is a list of numbers without units
        if words not in ([], ["none"]) and (name != "rotate" or words[-1][-1:].isalpha()):
            numbers = [word for word in words if word != "z"]
            yield f"{name}({','.join(_number_of(word) if name == 'scale' else word for word in numbers)})"


def _number_of(word: str) -> str:
    """Return a percentage as a number."""
    return repr(_share(word)) if word.endswith("%") else word


def path_data_in_css(text: str) -> str | None:
    """Return the path data in a value of CSS's property `d`; None if it is the attribute, which is the data itself.

    >>> path_data_in_css("path('M0 0H9')"), path_data_in_css("none"), path_data_in_css("M0 0H9")
    ('M0 0H9', '', None)
    """
    if text.strip() == "none":
        return ""
    match = _CSS_PATH.fullmatch(text)
    return match[2] if match else None


def _share(text: str) -> float:
    """Return a number or percentage, clipped to [0, 1]; 1 where it is neither."""
    words = text.strip()
    try:
        value = float(words.rstrip("%")) / (100 if words.endswith("%") else 1)
    except ValueError:
        return 1.0
    return min(1.0, max(0.0, value)) if value == value else 1.0


def _without_percentages(translate: "re.Match[str]", size: tuple[float, float]) -> str:
    """Replace percentages of a box in a translation by numbers."""
    sides = size[::-1] if translate[1] == "translateY" else size
    parts = [
        repr(length(part, size, axis, "transform")) if part.endswith("%") else part
        for part, axis in zip(re.split(r"[\s,]+", translate[2].strip()), "yx" if sides is not size else "xy")
    ]
    return f"{translate[1]}({','.join(parts)})"


def _is_understood(element: Element) -> bool:
    """Return whether a <switch> can select this child."""
    is_drawn = local(element) in _RENDERED - {"symbol"} | {"text"}
    speaks = element.get("systemLanguage", "en").partition("-")[0].strip() == "en"
    return is_drawn and "requiredExtensions" not in element.attrib and speaks


def _viewport(node: Node) -> Node:
    """Return the node inside an <svg> or <symbol>, with the transform of its viewBox."""
    properties, size, corner, frame = node.properties, node.size, (0.0, 0.0), None
    stated = {k: properties[k] for k in ("x", "y", "width", "height") if properties.get(k, "auto") != "auto"}
    sides = ({"width": "100%", "height": "100%"} if size else {}) | stated
    x, y = (length(stated.get(k) or "0", size, k, k) for k in "xy")
    fit = affine.translation(x, y)
    if "width" in sides and "height" in sides:
        size = width, height = (
            length(sides["width"], size, "x", "width"),
            length(sides["height"], size, "y", "height"),
        )
        if "viewBox" in properties and min(size) > 0:
            box, aspect = view_box(properties), properties.get("preserveAspectRatio", "xMidYMid")
            fit, size, corner = affine.viewport((x, y, width, height), box, aspect), box[2:], box[:2]
    overflows = properties.get("overflow", "hidden").strip() in ("visible", "auto")
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
        declared={},
        frame=frame,
    )
