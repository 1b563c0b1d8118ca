"""SVG drawings carried through a map as SVG: every shape becomes a path of Béziers, styles stay.

Groups, classes, style sheets and definitions are kept; transforms and `use` are resolved, because a path that went
through the map is in the target's units. Clip paths and masks are drawings, too: each use of one gets its own, mapped.
What has no path follows the map as well as its kind allows: line widths and dashes its mean scale along the line,
gradients, patterns and filters its affine part. Of what lies outside the source shape nothing is left.
"""

import copy
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ..errors import InputError
from ..evaluate import Evaluator
from ..harmonic import HarmonicMap
from . import affine, attributes, css, files, svg, svgtree
from .affine import Affine
from .carrier import Carrier, Effect
from .drawing import Rectangle
from .filters import MARGIN, filtered
from .paint import SIDES, Definitions, Space, lined, scale
from .placed import SVG, Placed, box_of, restyle, runs_of
from .shapes import Shape
from .svgtree import Drawn, _State
from .svgxml import canvas, length, local, root

TOLERANCE = 2e-4  # of the target's diagonal
_LEFT_OUT = {
    "text": " (turn it into paths: Inkscape, Path > Object to Path; Illustrator, Type > Create Outlines)",
    "image": " (--texture carries a picture)",
}
_LEFT_OUT["flowRoot"] = _LEFT_OUT["text"]
_COPIED = ("title", "desc", "metadata")
# Drawn only where something refers to them, or not at all.
_SILENT = {
    "defs",
    "clipPath",
    "mask",
    "marker",
    "symbol",
    "linearGradient",
    "radialGradient",
    "pattern",
    "filter",
}
_SILENT |= {"style", "view", "solidColor", "color-profile", "cursor", "font", "font-face"}
_PAINTED = ("linearGradient", "radialGradient", "pattern")
_MARKERS = ("marker-start", "marker-mid", "marker-end")
_MARKED = ("path", "line", "polyline", "polygon")
MOST_USED = 40


def carry(
    source: Shape,
    map: HarmonicMap | Evaluator,
    target: Shape,
    path: str | Path,
    *,
    tolerance: float | None = None,
) -> tuple[str, ...]:
    """Writes the drawing that the source shape was read from, carried to the target.

    Args:
        source: a shape from an SVG file; all that the file draws inside of it is carried, not only the outline.
        map: source → target, core plane.
        target: its canvas becomes the drawing's.
        path: the SVG file to write.
        tolerance: of the paths, in the target's units; TOLERANCE of the target's diagonal by default.

    Returns:
        A note for each kind of thing that was cut off, left out or approximated, with how often.

    Raises:
        InputError: the source is no SVG file, or it is malformed.
    """
    if source.path.suffix.lower() != ".svg":
        raise InputError(f"{source.path}: artwork is carried from SVG files only")
    try:
        drawing = _Drawing.of(files.read_bytes(source.path, max_bytes=svg.MAX_BYTES), target)
    except InputError as error:
        raise InputError(f"{source.path}: {error}") from error
    carrier = Carrier(map, source, tolerance or TOLERANCE * target.curve.diagonal)
    carrier.carry(drawing.placed, drawing.effects)
    drawing.definitions.collect(drawing.out)
    if len(drawing.definitions.out):
        drawing.out.insert(0, drawing.definitions.out)
    for prefix, name in attributes.SPACES.items():
        ElementTree.register_namespace(prefix, name)
    ElementTree.ElementTree(drawing.out).write(path, encoding="utf-8", xml_declaration=True)
    notes = (drawing.notes + carrier.notes).items()
    return tuple(f"{number} × {what}" for what, number in sorted(notes))


@dataclass(eq=False)
class _Drawing:
    """The document being built.

    Attributes:
        out, definitions: its root, and what will be in its <defs>.
        walk: the document that it is built from.
        region: of a mask: the target's canvas and as much around it.
        placed, effects: what the map has to carry.
        shapes: those of `placed` that are drawn in the present place, not in a clip path or mask that is used there.
        aside: whether the present place is a clip path or mask.
        notes: what was left out.
    """

    out: Element
    definitions: Definitions
    walk: svgtree._Walk
    region: dict[str, str]
    placed: list[Placed] = field(default_factory=list)
    effects: list[Effect] = field(default_factory=list)
    shapes: list[Placed] = field(default_factory=list)
    aside: bool = False
    notes: Counter[str] = field(default_factory=Counter)

    @classmethod
    def of(cls, data: bytes, target: Shape) -> "_Drawing":
        """The document on the target's canvas, its shapes still without paths.

        Raises:
            InputError: it is malformed.
        """
        top = root(data)
        box = canvas(top)
        sheet = css.sheet("\n".join("".join(e.itertext()) for e in top.iter() if local(e) == "style"))
        ids = {e.get("id", ""): e for e in reversed(list(top.iter()))}
        low, high = target.box
        x, y, width, height = low.real, -high.imag, (high - low).real, (high - low).imag
        around = (x - width, y - height, 3 * width, 3 * height)
        out = Element(f"{SVG}svg", {"viewBox": " ".join(f"{v:.9g}" for v in (x, y, width, height))})
        drawing = cls(
            out,
            Definitions(ids),
            svgtree._Walk(ids, sheet),
            {name: f"{value:.9g}" for (name, _), value in zip(SIDES, around)},
        )
        out.attrib |= drawing._styled(top, "svg")
        for style in (e for e in top.iter() if local(e) == "style"):
            out.append(copy.deepcopy(style))
        state = _State(Affine(), box[2:] if box else None, box[:2] if box else (0.0, 0.0))
        inner = drawing.walk.enter(top, state, root=True)
        if inner is not None:
            drawing._children(top, inner, out)
            drawing._applied(top, inner, out, drawing.shapes)
        return drawing

    def _children(self, element: Element, state: _State, parent: Element) -> None:
        for child in element:
            self.add(child, state, parent)

    def add(self, element: Element, outer: _State, parent: Element) -> None:
        """Adds an element, and what is in it, to the parent in the new document."""
        tag = local(element)
        if tag in _COPIED:
            parent.append(copy.deepcopy(element))
        elif tag in svgtree.SHAPES or tag in (*svgtree._GROUPS, "svg", "use"):
            state = self.walk.enter(element, outer)
            self.walk.copies += bool(outer.used)
            if self.walk.copies > svgtree.MAX_COPIES or outer.depth > svgtree.MAX_DEPTH:
                raise InputError(
                    f"<use> makes more than {svgtree.MAX_COPIES} elements, or nests them too deeply"
                )
            if state is None:
                self.notes["hidden element (display: none, opacity 0), left out"] += not self.aside
            elif tag in svgtree.SHAPES:
                try:
                    self._shape(tag, element, state, outer, parent)
                except InputError as error:
                    if str(error).startswith("<"):
                        raise
                    name = f" {element.get('id')!r}" if element.get("id") else ""
                    raise InputError(f"<{tag}>{name}: {error}") from error
            else:
                self._group(tag, element, state, parent)
        elif tag and tag not in _SILENT:
            self.notes[f"<{tag}>, left out{_LEFT_OUT.get(tag, '')}"] += 1

    def _group(self, tag: str, element: Element, state: _State, parent: Element) -> None:
        first = len(self.shapes)
        group = self._nested(parent, self._styled(element, "g", state))
        if tag == "use":
            self._use(element, state, group)
        elif tag == "svg":
            self._view(element, state, state.properties, group)
        elif tag == "switch":
            chosen = next((child for child in element if _understood(child)), None)
            if chosen is not None:
                self.add(chosen, state, group)
        else:
            self._children(element, state, group)
        if group is not parent:
            self._applied(element, state, group, self.shapes[first:])

    def _use(self, element: Element, state: _State, group: Element) -> None:
        used = self.definitions.linked(element)
        if used is None:
            return
        if id(used) in state.used:
            raise InputError(f"<use> of {used.get('id')!r} contains itself")
        x, y = (length(state.properties.get(k) or "0", state.size, k, f"<use> {k}") for k in "xy")
        shifted = replace(state, affine=state.affine @ affine.translation(x, y), used=(*state.used, id(used)))
        if local(used) not in ("symbol", "svg"):
            self.add(used, shifted, group)
            return
        inner = self.walk.enter(used, shifted)
        if inner is None:
            return
        size = {k: state.properties[k] for k in ("width", "height") if k in state.properties}
        first = len(self.shapes)
        view = self._nested(group, self._styled(used, "g", inner))
        self._view(used, inner, dict(inner.properties) | size, view)
        if view is not group:
            self._applied(used, inner, view, self.shapes[first:])

    def _view(self, element: Element, state: _State, said: Mapping[str, str], group: Element) -> None:
        """The inside of a nested svg or a symbol, clipped to its rectangle where it reaches out of that."""
        first = len(self.shapes)
        inner = svgtree._inside_viewport(state, said)
        inside = self._nested(group, {})
        self._children(element, inner, inside)
        box = box_of(self.shapes[first:], state.affine)
        if inside is group or not box or not inner.size or said.get("overflow") in ("visible", "auto"):
            return
        sides = {k: said[k] for k, _ in SIDES if said.get(k, "auto") != "auto"}
        whole = {"x": "0", "y": "0", "width": "100%", "height": "100%"}
        place = Space(state.affine, state.size).rectangle({"units": "userSpaceOnUse"} | sides, "units", whole)
        if place and not _holds(place, box):
            restyle(inside, {"clip-path": self._clip_to(place, state)})

    def _shape(self, tag: str, element: Element, state: _State, outer: _State, parent: Element) -> None:
        names = state.groups[len(outer.groups) :]
        if any(name.startswith((svg.PIN, svg.STROKE)) for name in names):
            return
        drawn = Drawn(tag, state.properties, state.affine, state.size, names, outer.groups)
        runs = runs_of(drawn)
        if not runs or not scale(state.affine):
            return
        said = state.properties
        out = SubElement(parent, f"{SVG}path", self._styled(element, "path", state))
        marked = {name for name in _MARKERS if said.get(name, said.get("marker", "none")) != "none"}
        shape = Placed(
            out,
            parent,
            runs,
            own=self.walk.own(element),
            filled=drawn.filled,
            lined=local(parent) != "clipPath" and drawn._painted("stroke", "none"),
            aside=self.aside,
            markers=frozenset(marked) if tag in _MARKED else frozenset(),
            line_first=said.get("paint-order", "").strip().startswith("stroke"),
        )
        self.placed.append(shape)
        self.shapes.append(shape)
        self._applied(element, state, out, [shape])
        if local(parent) == "clipPath":
            if "clip-rule" in said and "clip-rule" not in shape.own:  # of a <use> that is not there any more
                restyle(out, {"clip-rule": said["clip-rule"]})
            return
        if marked and tag not in _MARKED:
            restyle(out, dict.fromkeys(sorted(marked), "none"))
        space = Space(state.affine, state.size, [shape])
        self._paint(shape, said, space)
        if shape.lined and said.get("vector-effect") != "non-scaling-stroke":
            self.effects.append(Effect([shape], lined(shape, element, said, space)))

    def _paint(self, shape: Placed, said: Mapping[str, str], space: Space) -> None:
        """Gradients, patterns and markers in user space, each as one of the shape's own."""
        for kind in ("fill", "stroke"):
            found = self.definitions.named(said.get(kind, ""), *_PAINTED)
            if found is not None and (made := self.definitions.painted(found, space)):
                restyle(shape.out, {kind: made[0]})
                self.effects.append(Effect([shape], made[1]))
        for name in sorted(shape.markers):
            found = self.definitions.named(said.get(name, said.get("marker", "")), "marker")
            if found is not None and (made := self.definitions.marker(found, scale(space.affine))):
                restyle(shape.out, {name: made[0]})
                self.effects.append(Effect([shape], made[1]))

    def _applied(self, element: Element, state: _State, out: Element, shapes: list[Placed]) -> None:
        """Gives `out` the clip path, mask and filter that its element has, each one of its own to be mapped."""
        own = self.walk.own(element)
        space = Space(state.affine, state.size, shapes)
        kinds = (
            ("clip-path", "clipPath", self._clip),
            ("mask", "mask", self._mask),
            ("filter", "filter", self._filter),
        )
        for name, tag, make in kinds:
            said = own.get(name, "none").strip()
            if said == "none" or (local(out) == "clipPath" and name != "clip-path"):
                continue
            found = self.definitions.named(said, tag)
            known = found is not None and id(found) not in state.used
            made = make(found, state, space) if found is not None and known else None
            if made is None and shapes:
                self.notes[f"{name} without its element in the file or without area, left out"] += 1
            restyle(out, {name: made or "none"})

    def _clip(self, found: Element, state: _State, space: Space) -> str | None:
        inner = self._entered(found, state, space, "clipPathUnits")
        if inner is None:
            return None
        mapped = self.definitions.new("clipPath", self._styled(found, "clipPath", inner))
        with self._elsewhere():
            self._children(found, inner, mapped)
            self._applied(found, inner, mapped, self.shapes)
        return f"url(#{mapped.get('id')})"

    def _mask(self, found: Element, state: _State, space: Space) -> str | None:
        inner = self._entered(found, state, space, "maskContentUnits")
        place = space.rectangle(self.walk.own(found), "maskUnits", MARGIN)
        if inner is None or place is None:
            return None
        mapped = self.definitions.new("mask", self._styled(found, "mask", inner) | self.region)
        mapped.set("maskUnits", "userSpaceOnUse")
        content = SubElement(mapped, f"{SVG}g")
        if space.area and not _holds(place, space.box):
            restyle(content, {"clip-path": self._clip_to(place, state)})
        with self._elsewhere():
            self._children(found, inner, content)
            self._applied(found, inner, mapped, self.shapes)
        return f"url(#{mapped.get('id')})"

    def _filter(self, found: Element, state: _State, space: Space) -> str | None:
        made = filtered(self.definitions, found, space)
        if made is None:
            return None
        self.effects.append(Effect(space.shapes, made[1]))
        return made[0]

    def _entered(self, found: Element, state: _State, space: Space, units: str) -> _State | None:
        """The state inside a clip path or mask, which inherits from where it is written, not from where it is used."""
        if len(state.used) > MOST_USED:
            raise InputError(f"clip paths, masks and <use> refer to each other more than {MOST_USED} deep")
        own = self.walk.own(found)
        boxed = own.get(units) == "objectBoundingBox"
        if boxed and not space.area:
            return None
        kept = {k: v for k, v in own.items() if k not in ("display", "opacity")}
        transform = affine.parse(own.get("transform", "")) if local(found) == "clipPath" else Affine()
        placed = space.affine @ transform @ (space.units if boxed else Affine())
        return replace(
            state,
            affine=placed,
            properties=kept,
            groups=(),
            used=(*state.used, id(found)),
            depth=state.depth + 1,
        )

    def _clip_to(self, place: Rectangle, state: _State) -> str:
        """A clip path of a rectangle in the state's user space."""
        mapped = self.definitions.new("clipPath")
        with self._elsewhere():
            rectangle = Element(f"{SVG}rect", {name: repr(value) for (name, _), value in zip(SIDES, place)})
            self.add(rectangle, replace(state, properties={}, groups=()), mapped)
        return f"url(#{mapped.get('id')})"

    @contextmanager
    def _elsewhere(self) -> Iterator[None]:
        """While a clip path or mask is added: its shapes are not those of the place where it is used."""
        shapes, aside = self.shapes, self.aside
        self.shapes, self.aside = [], True
        yield
        self.shapes, self.aside = shapes, aside

    def _styled(self, element: Element, tag: str, state: _State | None = None) -> dict[str, str]:
        """What an element keeps of its attributes; no id where it may be there twice."""
        once = (state is None or not state.used) and tag not in ("clipPath", "mask")
        return attributes.kept(self.walk.sheet, element, tag, named=once)

    @staticmethod
    def _nested(parent: Element, attributes: dict[str, str]) -> Element:
        """A group in the parent; in a clip path, which may hold shapes only, the parent itself."""
        return parent if local(parent) == "clipPath" else SubElement(parent, f"{SVG}g", attributes)


def _understood(element: Element) -> bool:
    """Whether a <switch> takes this child."""
    drawn = local(element) in (*svgtree.SHAPES, *svgtree._GROUPS, "svg", "use", "text", "image")
    speaks = element.get("systemLanguage", "en").partition("-")[0].strip() == "en"
    return drawn and "requiredExtensions" not in element.attrib and speaks


def _holds(outer: Rectangle, inner: Rectangle) -> bool:
    """Whether a rectangle is in another, but for rounding."""
    tiny = 1e-6 * max(inner[2:])
    return all(
        a <= b + tiny and a + sides >= b + size - tiny
        for a, sides, b, size in zip(outer[:2], outer[2:], inner[:2], inner[2:])
    )
