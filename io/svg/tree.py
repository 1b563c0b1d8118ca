"""An SVG document as the list of shapes that it draws: XML read safely, `use` expanded, styles inherited.

Nothing outside the file is ever read: entities are refused, and links to anything but an id of the file are ignored.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from xml.etree.ElementTree import Element

from ...errors import InputError
from . import affine, css
from .affine import Affine
from .budget import MAX_DEPTH, MAX_LINKS, Copies
from .document import SHAPES, canvas, length, local, root, view_box
from .drawing import Rectangle

GROUPS = frozenset(["g", "a", "switch"])
_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
LINKS = ("href", "{http://www.w3.org/1999/xlink}href")
CLIPS = {  # what cuts an element off, the element that it names, and what says that this is in units of a box
    "clip-path": ("clipPath", "clipPathUnits"),
    "mask": ("mask", "maskContentUnits"),
}
UNREAD = frozenset(["image", "text", "foreignObject"])  # what no shape is read from
_URL = re.compile(r"""url\(\s*["']?#([^"')]+?)["']?\s*\)""")
_INHERITED = (
    *("fill", "stroke", "fill-rule", "visibility", "clip-rule", "paint-order"),
    *("stroke-width", "stroke-dasharray", "stroke-dashoffset", "stroke-linejoin", "stroke-linecap"),
    *("marker", "marker-start", "marker-mid", "marker-end"),
)


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
    shapes: tuple["Drawn", ...] = ()


@dataclass(frozen=True, eq=False)
class Drawn:
    """One shape that the document draws.

    Attributes:
        tag: one of SHAPES.
        properties: attributes and styles by name, those of the style sheet and of parents included.
        affine: from the shape's own coordinates to the root's user units.
        size: width and height that percentages refer to; None where the document states none.
        names: its own id and Inkscape label, as far as it has them.
        groups: ids and labels of everything that it is inside of.
        clips: what cuts it off: its own, and those of all that it is inside of.
    """

    tag: str
    properties: Mapping[str, str]
    affine: Affine
    size: tuple[float, float] | None
    names: tuple[str, ...]
    groups: tuple[str, ...] = ()
    clips: tuple[Clip, ...] = ()

    def length(self, name: str, axis: str, default: float = 0.0) -> float:
        """A length attribute in user units; `axis` (x, y or r) says what a percentage refers to."""
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

    @property
    def dashed(self) -> bool:
        """Whether its line has gaps."""
        return self.stroked and self.properties.get("stroke-dasharray", "none").strip() not in (
            "",
            "none",
            "0",
        )

    @property
    def visible(self) -> bool:
        """Whether anything of it is painted."""
        return self.filled or self.stroked

    def _painted(self, kind: str, default: str) -> bool:
        paint = self.properties.get(kind, default).strip()
        opacity = self.properties.get(f"{kind}-opacity", "1").strip().rstrip("%")
        return paint not in ("none", "transparent") and opacity not in ("0", "0.0", ".0")


@dataclass(frozen=True, eq=False)
class Document:
    """A parsed document: its canvas in user units (None when it states none), what it draws in order, the tags of
    all its elements by id and Inkscape label, and how many of its style rules are not read."""

    canvas: Rectangle | None
    shapes: list[Drawn]
    tags: Mapping[str, str]
    unread: int = 0


def parse(data: bytes) -> Document:
    """The shapes that an SVG document draws.

    Raises:
        InputError: not XML, not SVG, entities, too deep or too many elements, a `use` of itself, a malformed transform,
            length or viewBox.
    """
    top = root(data)
    box, walk, inside = begin(top)
    shapes = list(walk.children(top, inside and walk.clipped(inside)))
    tags = {n: local(e) for e in top.iter() for n in (e.get("id"), e.get(_LABEL)) if n}
    return Document(box, shapes, tags, walk.sheet.unread)


def begin(top: Element) -> tuple[Rectangle | None, "Walk", "Inherited | None"]:
    """A document's canvas, what walks over its elements, and the state inside its root, None when it is not displayed.

    Raises:
        InputError: a malformed transform, length or viewBox.
    """
    box = canvas(top)
    sheet = css.sheet("\n".join("".join(e.itertext()) for e in top.iter() if local(e) == "style"))
    walk = Walk({e.get("id", ""): e for e in reversed(list(top.iter()))}, sheet)
    state = Inherited(Affine(), box[2:] if box else None, box[:2] if box else (0.0, 0.0))
    return box, walk, walk.enter(top, state, root=True)


def linked(ids: Mapping[str, Element], element: Element) -> Element | None:
    """The element of the same document that another one's href names."""
    link = next(filter(None, map(element.get, LINKS)), "")
    return ids.get(link[1:]) if link.startswith("#") else None


@dataclass(frozen=True, eq=False)
class Inherited:
    """What children inherit."""

    affine: Affine
    size: tuple[float, float] | None
    origin: tuple[float, float] = (0.0, 0.0)
    properties: Mapping[str, str] = field(default_factory=dict)
    groups: tuple[str, ...] = ()
    used: tuple[int, ...] = ()
    depth: int = 0
    clips: tuple[Clip, ...] = ()


class Walk:
    """The document in drawing order."""

    def __init__(self, ids: Mapping[str, Element], sheet: css.Sheet):
        self.ids, self.sheet, self.copies = ids, sheet, Copies()
        self.unread: dict[int, bool] = {}
        self.clips: dict[tuple[int, Affine, tuple[float, float] | None], Clip] = {}

    def count(self, element: Element, outer: Inherited) -> None:
        """Count an element that is about to be drawn.

        Raises:
            InputError: too much is drawn again by `use` and the like, or nested too deeply.
        """
        if outer.used:
            self.copies.add(element)
        if outer.depth > MAX_DEPTH:
            raise InputError(f"<use> nests elements more than {MAX_DEPTH} deep")

    def own(self, element: Element) -> dict[str, str]:
        """The element's attributes and styles by name, nothing inherited."""
        own = {k.rpartition("}")[2]: v for k, v in element.attrib.items() if not k.startswith("{")}
        return own | self.sheet.style(local(element), own) | css.declarations(own.get("style", ""))

    def enter(self, element: Element, state: Inherited, *, root: bool = False) -> Inherited | None:
        """The state inside an element, or None when it is not displayed."""
        own = self.own(element)
        if own.get("display") == "none" or own.get("opacity", "").strip() in ("0", "0%", "0.0"):
            return None
        kept = {k: state.properties[k] for k in _INHERITED if k in state.properties}
        properties = kept | {k: v for k, v in own.items() if v != "inherit"}
        names = tuple(dict.fromkeys(n for n in (element.get("id"), element.get(_LABEL)) if n))
        transform = Affine() if root else _transform(properties, state)
        return replace(
            state,
            affine=state.affine @ transform,
            properties=properties,
            groups=state.groups if root else state.groups + names,
            depth=state.depth + 1,
        )

    def children(self, element: Element, state: Inherited | None) -> Iterator[Drawn]:
        """What the children of an element draw."""
        if state is not None:
            for child in element:
                yield from self.element(child, state)

    def element(self, element: Element, outer: Inherited) -> Iterator[Drawn]:
        """What an element draws."""
        tag = local(element)
        if tag not in SHAPES and tag not in GROUPS and tag not in ("svg", "use"):
            return
        self.count(element, outer)
        state = self.enter(element, outer)
        if state is None:
            return
        state = state if tag == "use" else self.clipped(state)
        if tag in GROUPS:
            yield from self.children(element, state)
        elif tag == "svg":
            yield from self.children(element, _viewed(state, state.properties))
        elif tag == "use":
            yield from self.use(element, state)
        elif state.properties.get("visibility", "visible") == "visible":
            names = state.groups[len(outer.groups) :]
            yield Drawn(tag, state.properties, state.affine, state.size, names, outer.groups, state.clips)

    def clipped(self, state: Inherited) -> Inherited:
        """The state inside an element with the clip path and the mask that it has itself.

        Raises:
            InputError: they refer to each other too often, or what draws them is malformed.
        """
        said = {name: state.properties.get(name, "none").strip() for name in CLIPS}
        own = [self._clip(name, text, state) for name, text in said.items() if text not in ("", "none")]
        return replace(state, clips=(*state.clips, *own)) if own else state

    def _clip(self, name: str, said: str, state: Inherited) -> Clip:
        tag, units = CLIPS[name]
        match = _URL.match(said)
        found = self.ids.get(match[1]) if match else None
        if found is None or local(found) != tag or id(found) in state.used:
            return Clip(name)
        if len(state.used) > MAX_LINKS:
            raise InputError(f"clip paths, masks and <use> refer to each other more than {MAX_LINKS} deep")
        own = self.own(found)
        if id(found) not in self.unread:
            self.unread[id(found)] = any(local(each) in UNREAD for each in found.iter())
        if self.unread[id(found)] or own.get(units) == "objectBoundingBox":
            return Clip(name)
        place = id(found), state.affine, state.size
        if place not in self.clips:
            shapes = tuple(self.children(found, self._inside_clip(found, own, state)))
            self.clips[place] = Clip(name, own, shapes)
        return self.clips[place]

    def _inside_clip(self, found: Element, own: Mapping[str, str], state: Inherited) -> Inherited:
        """The state inside a clip path or mask, which inherits nothing from where it is used."""
        transform = affine.parse(own.get("transform", "")) if local(found) == "clipPath" else Affine()
        return self.clipped(
            Inherited(
                state.affine @ transform,
                state.size,
                state.origin,
                properties=own,
                used=(*state.used, id(found)),
                depth=state.depth + 1,
            )
        )

    def use(self, element: Element, state: Inherited) -> Iterator[Drawn]:
        """What a `use` draws."""
        target = linked(self.ids, element)
        if target is None:  # elsewhere, or nowhere: SVG draws nothing, and no other file is read
            return
        if id(target) in state.used:
            raise InputError(f"<use> of {'#' + target.get('id', '')!r} contains itself")
        shift = affine.translation(
            *(length(state.properties.get(k) or "0", state.size, k, f"<use> {k}") for k in "xy")
        )
        state = self.clipped(
            replace(state, affine=state.affine @ shift)
        )  # x and y move what it is cut by, too
        state = replace(state, used=(*state.used, id(target)))
        if local(target) not in ("symbol", "svg"):
            yield from self.element(target, state)
            return
        inner = self.enter(target, state)
        if inner is not None:
            size = {k: state.properties[k] for k in ("width", "height") if k in state.properties}
            yield from self.children(target, _viewed(self.clipped(inner), dict(inner.properties) | size))


def _viewed(state: Inherited, attributes: Mapping[str, str]) -> Inherited:
    """The state inside a nested svg or a symbol, which is cut off at its rectangle unless it overflows."""
    inner = inside_viewport(state, attributes)
    overflows = attributes.get("overflow", "hidden").strip() in ("visible", "auto")
    if overflows or inner.size is None or min(inner.size) <= 0:
        return inner
    given = {k: attributes[k] for k in ("x", "y", "width", "height") if attributes.get(k, "auto") != "auto"}
    view = Drawn("rect", {"width": "100%", "height": "100%"} | given, state.affine, state.size, ())
    return replace(inner, clips=(*inner.clips, Clip("overflow", {}, (view,))))


def _transform(properties: Mapping[str, str], state: Inherited) -> Affine:
    own = affine.parse(properties.get("transform", ""))
    if "transform-origin" not in properties:
        return own
    words = [*properties["transform-origin"].split(), "50%"][:2]
    words = [
        {"left": "0", "top": "0", "center": "50%", "right": "100%", "bottom": "100%"}.get(w, w) for w in words
    ]
    at = [length(w, state.size, axis, "transform-origin") for w, axis in zip(words, "xy")]
    at = [a + o for a, o in zip(at, state.origin)]
    return affine.translation(*at) @ own @ affine.translation(-at[0], -at[1])


def inside_viewport(state: Inherited, attributes: Mapping[str, str]) -> Inherited:
    """The state inside a nested svg or a symbol, whose rectangle and viewBox `attributes` give."""
    x, y = (length(attributes.get(k) or "0", state.size, k, k) for k in "xy")
    whole = "100%" if state.size else None
    sides = [attributes.get(k, whole) for k in ("width", "height")]
    sides = [whole if text == "auto" else text for text in sides]
    if None in sides:
        return replace(state, affine=state.affine @ affine.translation(x, y), origin=(0.0, 0.0))
    width, height = (length(t or "", state.size, k, k) for t, k in zip(sides, "xy"))
    if "viewBox" not in attributes or width <= 0 or height <= 0:
        shifted = state.affine @ affine.translation(x, y)
        return replace(state, affine=shifted, size=(width, height), origin=(0.0, 0.0))
    box = view_box(attributes)
    fit = affine.viewport((x, y, width, height), box, attributes.get("preserveAspectRatio", "xMidYMid"))
    return replace(state, affine=state.affine @ fit, size=box[2:], origin=box[:2])
