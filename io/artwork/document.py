"""An SVG document written anew, without what hangs on places: no transforms, no `use`, each clip path for one use only.

A path that goes through a map is in the target's units. So groups, classes and style sheets are kept, transforms and
`use` are resolved, and clip paths and masks, which are drawings, too, become copies for every place that uses them.
"""

import copy
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from xml.etree.ElementTree import Element, SubElement

from ...errors import InputError
from ..shapes.shape import Shape
from ..svg import affine, reader, tree
from ..svg.affine import Affine
from ..svg.document import length, local, root
from ..svg.drawing import Rectangle
from ..svg.tree import Drawn, Inherited
from . import attributes
from .budget import Load
from .element import SVG, MappedElement, box_of, restyle, runs_of
from .filters import MARGIN, filtered
from .mapping import OUTSIDE, Effect
from .paint_server import SIDES, Definitions, Space, lined, scale, shown
from .references import confine, typed

CELL = 1 / 24
"""Of the source's diagonal: size of the parts of a picture that follow the map each by its affine part."""
OVERLAP = 0.02  # of a part: so much it reaches under the next, which leaves no seam
_TEXT = "<{}>, left out (turn it into paths: Inkscape, Path > Object to Path; Illustrator, Type > Create Outlines)"
_UNREAD = "style rule that is not read but kept: its selector is more than a tag, classes and an id"
_COPIED = ("title", "desc", "metadata")
# Drawn only where something refers to them, or not at all.
_SILENT = {"defs", "clipPath", "mask", "marker", "symbol", "linearGradient", "radialGradient", "pattern"}
_SILENT |= {"filter", "style", "view", "solidColor", "color-profile", "cursor", "font", "font-face"}
_PAINTED = ("linearGradient", "radialGradient", "pattern")
_MARKERS = ("marker-start", "marker-mid", "marker-end")
_MARKED = ("path", "line", "polyline", "polygon")
MOST_USED = 40  # deep: no drawing made by people comes near (by hand)


@dataclass(eq=False)
class MappedDocument:
    """A document being built.

    Attributes:
        out, definitions: its root, and what will be in its <defs>.
        walk: the document that it is built from.
        region: of a mask: the target's canvas and as much around it.
        elements, effects: what the map has to carry.
        shapes: those of `elements` that are drawn in the present place, not in a clip path or mask that is used there.
        aside: whether the present place is a clip path or mask.
        pictures: groups of the parts of a picture.
        cell: size of these, in the source's units.
        notes: what was left out.
        load: how much there is to carry.
    """

    out: Element
    definitions: Definitions
    walk: tree.Walk
    region: dict[str, str]
    cell: float
    elements: list[MappedElement] = field(default_factory=list)
    effects: list[Effect] = field(default_factory=list)
    shapes: list[MappedElement] = field(default_factory=list)
    aside: bool = False
    pictures: list[Element] = field(default_factory=list)
    notes: Counter[str] = field(default_factory=Counter)
    load: Load = field(default_factory=Load)

    @classmethod
    def of(cls, data: bytes, source: Shape, target: Shape) -> "MappedDocument":
        """The document that the source was read from, on the target's canvas, its shapes still without paths.

        Raises:
            InputError: it is malformed.
        """
        top = root(data)
        _, walk, inner = tree.begin(top)
        low, high = target.box
        x, y, width, height = low.real, -high.imag, (high - low).real, (high - low).imag
        around = (x - width, y - height, 3 * width, 3 * height)
        out = Element(f"{SVG}svg", {"viewBox": " ".join(f"{v:.9g}" for v in (x, y, width, height))})
        drawing = cls(
            out,
            Definitions(walk.ids, walk.copies),
            walk,
            {name: f"{value:.9g}" for (name, _), value in zip(SIDES, around)},
            CELL * abs(source.bounds[1] - source.bounds[0]),
        )
        out.attrib |= drawing._styled(top, "svg")
        out.extend(copy.deepcopy(e) for e in top.iter() if local(e) == "style")
        drawing.notes[_UNREAD] += walk.sheet.unread
        if inner is not None:
            drawing._children(top, inner, out)
            drawing._applied(top, inner, out, drawing.shapes)
        return drawing

    def finish(self) -> None:
        """After the map has carried the shapes: drops parts of pictures outside, and adds the definitions in use."""
        for group in self.pictures:
            group[:] = [part for part in group if part[0].get("transform")]
            self.notes[OUTSIDE] += not len(group)
        self.definitions.collect(self.out)
        if len(self.definitions.out):
            self.out.insert(0, self.definitions.out)
        self.notes["reference to another file, left out"] += confine(self.out)

    def _children(self, element: Element, state: Inherited, parent: Element) -> None:
        for child in element:
            self.add(child, state, parent)

    def add(self, element: Element, outer: Inherited, parent: Element) -> None:
        """Adds an element, and what is in it, to the parent in the new document."""
        tag = local(element)
        if tag in _COPIED:
            if outer.used:
                self.walk.copies.add(element, whole=True)
            parent.append(copy.deepcopy(element))
        elif tag in tree.SHAPES or tag in (*tree.GROUPS, "svg", "use", "image"):
            self.walk.count(element, outer)
            state = self.walk.enter(element, outer)
            if state is None:
                self.notes["hidden element (display: none, opacity 0), left out"] += not self.aside
            elif tag in tree.SHAPES:
                try:
                    self._shape(tag, element, state, outer, parent)
                except InputError as error:
                    if str(error).startswith("<"):
                        raise
                    name = f" {element.get('id')!r}" if element.get("id") else ""
                    raise InputError(f"<{tag}>{name}: {error}") from error
            elif tag == "image":
                self._picture(element, state, parent)
            else:
                self._group(tag, element, state, parent)
        elif tag and tag not in _SILENT:
            self.notes[(_TEXT if tag in ("text", "flowRoot") else "<{}>, left out").format(tag)] += 1

    def _group(self, tag: str, element: Element, state: Inherited, parent: Element) -> None:
        first = len(self.shapes)
        group = self._nested(parent, self._styled(element, "g", state))
        if tag == "use":  # x and y are part of its transform, for what applies to it, too
            x, y = (length(state.properties.get(k) or "0", state.size, k, f"<use> {k}") for k in "xy")
            state = replace(state, affine=state.affine @ affine.translation(x, y))
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

    def _use(self, element: Element, state: Inherited, group: Element) -> None:
        used = tree.linked(self.walk.ids, element)
        if used is None:
            return
        if id(used) in state.used:
            raise InputError(f"<use> of {used.get('id')!r} contains itself")
        inside = replace(state, used=(*state.used, id(used)))
        if local(used) not in ("symbol", "svg"):
            self.add(used, inside, group)
            return
        inner = self.walk.enter(used, inside)
        if inner is None:
            return
        size = {k: state.properties[k] for k in ("width", "height") if k in state.properties}
        first = len(self.shapes)
        view = self._nested(group, self._styled(used, "g", inner))
        self._view(used, inner, dict(inner.properties) | size, view)
        if view is not group:
            self._applied(used, inner, view, self.shapes[first:])

    def _view(self, element: Element, state: Inherited, said: Mapping[str, str], group: Element) -> None:
        """The inside of a nested svg or a symbol, clipped to its rectangle where it reaches out of that."""
        first = len(self.shapes)
        inner = tree.inside_viewport(state, said)
        inside = self._nested(group, {})
        self._children(element, inner, inside)
        box = box_of(self.shapes[first:], state.affine)
        if inside is group or not box or not inner.size or said.get("overflow") in ("visible", "auto"):
            return
        sides = {k: said[k] for k, _ in SIDES if said.get(k, "auto") != "auto"}
        whole = {"x": "0", "y": "0", "width": "100%", "height": "100%"}
        place = Space(state.affine, state.size).rectangle({"units": "userSpaceOnUse"} | sides, "units", whole)
        if place and not _holds(place, box):
            restyle(inside, {"clip-path": self._clip_to(place, state)[0]})

    def _shape(self, tag: str, element: Element, state: Inherited, outer: Inherited, parent: Element) -> None:
        names = state.groups[len(outer.groups) :]
        if any(name.startswith((reader.PIN, reader.STROKE)) for name in names):
            return
        drawn = Drawn(tag, state.properties, state.affine, state.size, names, outer.groups)
        runs = runs_of(drawn)
        if not runs or not scale(state.affine):
            return
        self.load.carry(sum(len(run.pieces) for run in runs))
        said = state.properties
        out = SubElement(parent, f"{SVG}path", self._styled(element, "path", state))
        marked = {name for name in _MARKERS if said.get(name, said.get("marker", "none")) != "none"}
        marks = frozenset(marked if tag in _MARKED else ())
        shape = MappedElement(
            out,
            parent,
            runs,
            own=self.walk.own(element),
            filled=drawn.filled,
            lined=local(parent) != "clipPath" and (bool(marks) or drawn._painted("stroke", "none")),
            aside=self.aside,
            markers=marks,
            line_first=said.get("paint-order", "").strip().startswith("stroke"),
        )
        self.elements.append(shape)
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

    def _picture(self, element: Element, state: Inherited, parent: Element) -> None:
        """A picture in parts: each is cut out as the map has it, and shows the picture under the affine part there."""
        said = state.properties
        link = next((k for k in tree.LINKS if element.get(k, "").strip().startswith("data:")), None)
        sides = {k: said[k] for k in ("x", "y", "width", "height") if said.get(k, "auto").strip() != "auto"}
        if link is None or len({"width", "height"} & sides.keys()) < 2:
            self.notes["<image> that is not embedded, or without width and height, left out"] += 1
            return
        zero = {"x": "0", "y": "0", "width": "0", "height": "0"}
        place = Space(state.affine, state.size).rectangle(sides | {"units": "userSpaceOnUse"}, "units", zero)
        if local(parent) == "clipPath" or not place or min(place[2:]) <= 0:
            return
        kept = {link: typed(element.get(link, ""))} | {
            k: f"{v:.9g}" for k, v in zip(("width", "height"), place[2:])
        }
        picture = self.definitions.picture(kept | {k: said[k] for k in ("preserveAspectRatio",) if k in said})
        inside = state.affine @ affine.translation(*place[:2])
        group = SubElement(parent, f"{SVG}g", self._styled(element, "g", state))
        shapes: list[MappedElement] = []
        cells = _cells(place, state.affine, self.cell)
        self.load.check(4 * len(cells))
        for cell in cells:
            clip, corners = self._clip_to(cell, state)
            part = SubElement(group, f"{SVG}g", {"clip-path": clip})
            use = SubElement(part, f"{SVG}use", {tree.LINKS[1]: f"#{picture.get('id')}"})
            self.effects.append(Effect(corners, shown(use, inside)))
            shapes += corners
        self.pictures.append(group)
        self.shapes += shapes
        self._applied(element, state, group, shapes)

    def _paint(self, shape: MappedElement, said: Mapping[str, str], space: Space) -> None:
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

    def _applied(self, element: Element, state: Inherited, out: Element, shapes: list[MappedElement]) -> None:
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
            self.load.cover(shapes)
            known = found is not None and id(found) not in state.used
            made = make(found, state, space) if found is not None and known else None
            if made is None and shapes:
                self.notes[f"{name} without its element in the file or without area, left out"] += 1
            restyle(out, {name: made or "none"})

    def _clip(self, found: Element, state: Inherited, space: Space) -> str | None:
        inner = self._entered(found, state, space, "clipPathUnits")
        if inner is None:
            return None
        mapped = self.definitions.new("clipPath", self._styled(found, "clipPath", inner))
        with self._elsewhere():
            self._children(found, inner, mapped)
            self._applied(found, inner, mapped, self.shapes)
        return f"url(#{mapped.get('id')})"

    def _mask(self, found: Element, state: Inherited, space: Space) -> str | None:
        inner = self._entered(found, state, space, "maskContentUnits")
        place = space.rectangle(self.walk.own(found), "maskUnits", MARGIN)
        if inner is None or place is None:
            return None
        mapped = self.definitions.new("mask", self._styled(found, "mask", inner) | self.region)
        mapped.set("maskUnits", "userSpaceOnUse")
        content = SubElement(mapped, f"{SVG}g")
        if space.area and not _holds(place, space.box):
            restyle(content, {"clip-path": self._clip_to(place, state)[0]})
        with self._elsewhere():
            self._children(found, inner, content)
            self._applied(found, inner, mapped, self.shapes)
        return f"url(#{mapped.get('id')})"

    def _filter(self, found: Element, state: Inherited, space: Space) -> str | None:
        made = filtered(self.definitions, found, space)
        if made is None:
            return None
        self.effects.append(Effect(space.shapes, made[1]))
        return made[0]

    def _entered(self, found: Element, state: Inherited, space: Space, units: str) -> Inherited | None:
        """The state inside a clip path or mask, which inherits from where it is written, not from where it is used."""
        if len(state.used) > MOST_USED:
            raise InputError(f"clip paths, masks and <use> refer to each other more than {MOST_USED} deep")
        own = self.walk.own(found)
        boxed = own.get(units) == "objectBoundingBox"
        if boxed and not space.area:
            return None
        kept = {k: v for k, v in own.items() if k not in ("display", "opacity")}
        transform = affine.parse(own.get("transform", "")) if local(found) == "clipPath" else Affine()
        to_root = space.affine @ transform @ (space.units if boxed else Affine())
        return replace(
            state,
            affine=to_root,
            properties=kept,
            groups=(),
            used=(*state.used, id(found)),
            depth=state.depth + 1,
        )

    def _clip_to(self, place: Rectangle, state: Inherited) -> tuple[str, list[MappedElement]]:
        """A clip path of a rectangle in the state's user space, and its shape."""
        mapped = self.definitions.new("clipPath")
        with self._elsewhere():
            rectangle = Element(f"{SVG}rect", {name: repr(value) for (name, _), value in zip(SIDES, place)})
            self.add(rectangle, replace(state, properties={}, groups=()), mapped)
            return f"url(#{mapped.get('id')})", self.shapes

    @contextmanager
    def _elsewhere(self) -> Iterator[None]:
        """While a clip path or mask is added: its shapes are not those of the place where it is used."""
        shapes, aside = self.shapes, self.aside
        self.shapes, self.aside = [], True
        try:
            yield
        finally:
            self.shapes, self.aside = shapes, aside

    def _styled(self, element: Element, tag: str, state: Inherited | None = None) -> dict[str, str]:
        """What an element keeps of its attributes; no id where it may be there twice."""
        once = (state is None or not state.used) and tag not in ("clipPath", "mask")
        return attributes.kept(self.walk.sheet, element, tag, named=once)

    @staticmethod
    def _nested(parent: Element, attributes: dict[str, str]) -> Element:
        """A group in the parent; in a clip path, which may hold shapes only, the parent itself."""
        return parent if local(parent) == "clipPath" else SubElement(parent, f"{SVG}g", attributes)


def _understood(element: Element) -> bool:
    """Whether a <switch> takes this child."""
    drawn = local(element) in (*tree.SHAPES, *tree.GROUPS, "svg", "use", "text", "image")
    speaks = element.get("systemLanguage", "en").partition("-")[0].strip() == "en"
    return drawn and "requiredExtensions" not in element.attrib and speaks


def _holds(outer: Rectangle, inner: Rectangle) -> bool:
    """Whether a rectangle is in another, but for rounding."""
    tiny = 1e-6 * max(inner[2:])
    return all(
        a <= b + tiny and a + sides >= b + size - tiny
        for a, sides, b, size in zip(outer[:2], outer[2:], inner[:2], inner[2:])
    )


def _cells(place: Rectangle, map: Affine, size: float) -> list[Rectangle]:
    """A rectangle in parts of about a size under a map, 24 by 24 at most; each reaches a little under the next."""
    x, y, width, height = place
    across, down = abs(map.alpha + map.beta) * width, abs(map.alpha - map.beta) * height
    columns, rows = (min(24, max(1, round(length / size))) for length in (across, down))
    w, h = width / columns, height / rows
    return [
        (x + i * w, y + j * h, w * (1 + OVERLAP * (i < columns - 1)), h * (1 + OVERLAP * (j < rows - 1)))
        for j in range(rows)
        for i in range(columns)
    ]
