"""Build the new SVG document: without transforms and `use`, and with a separate clip path for each use.

Mapped paths are in the target's units. So groups, classes and style sheets are kept, but transforms and `use` are
resolved. Clip paths and masks are drawings as well, and are copied for every place that uses them.
"""

import copy
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ...arrays import Complex
from ...errors import InputError
from .. import limits
from ..lengths import svg_size
from ..shapes.shape import Shape
from ..svg import affine, css_functions, reader, tree
from ..svg.budget import Quota
from ..svg.document import local
from ..svg.drawing_content import Rectangle
from ..svg.tree import Node
from . import attributes, embedded
from .affine_part import AffinePart
from .element import SVG, MappedElement, box_of, pen_paths_of, restyle
from .filters import MARGIN, filtered
from .mapping import Effect
from .paint_server import SIDES, Definitions, Space, lined, scale
from .references import confine
from .tiles import tiled

_REMEDY = " (convert it to paths: Inkscape, Path > Object to Path; Illustrator, Type > Create Outlines)"
_MOVING = "animations are not played"
_REASONS = {
    "flowRoot": "it is flowed text of a draft of SVG 1.2, which browsers do not show either",
    "foreignObject": "it contains HTML, which has no outlines",
    "script": "scripts are not run",
    **dict.fromkeys(("animate", "animateTransform", "animateMotion", "animateColor", "set"), _MOVING),
}
"""Why elements are omitted, by tag."""
_UNREAD = "style rule that is kept but not applied: a malformed selector, or a pseudo-class such as :hover"
_CARRIED = (
    f"as artwork it has more than {limits.ARTWORK_CURVES} lines and curves, counting clip paths and masks each time "
    "they are used; simplify the drawing, or map a picture of it (--texture)"
)
_COVERED = (
    f"as artwork more than {limits.ARTWORK_COVERED} of its lines and curves lie under clip paths, masks and "
    "filters (counted once for each nested group); use these in fewer groups"
)
_D_IN_CSS = re.compile(r"(?<![\w-])d\s*:\s*(?:path\([^)]*\)|none)\s*;?")  # it would replace mapped paths
_DESCRIBING = ("title", "desc")
_COPIED = ("title", "desc", "metadata")
_EFFECTS = ("clip-path", "mask", "filter", "opacity", "mix-blend-mode")
_PAINTED = ("linearGradient", "radialGradient", "pattern")
_MARKERS = ("marker-start", "marker-mid", "marker-end")
_MARKED = ("path", "line", "polyline", "polygon")


@dataclass(eq=False)
class MappedDocument:
    """A document being built.

    Attributes:
        out, definitions: its root, and the future content of its <defs>.
        document: the original document.
        region: of a mask: the target's canvas and as much again on each side.
        bends: whether the map is not affine.
        depends_on_bends: whether the document depends on that.
        elements, effects: what the map has to transfer.
        shapes: those of `elements` that are drawn at the current place, without those of clip paths and masks.
        aside: whether the current place is a clip path or mask.
        copy: number of the current copy of the drawing, if there are several.
        pictures: the embedded pictures.
        notes: counts of omitted content.
        carried: limit on lines and curves.
        covered: limit on lines and curves, counted once for each clip path, mask or filter that applies to them or to a
            group around them.
    """

    out: Element
    definitions: Definitions
    document: tree.Document
    region: dict[str, str]
    bends: bool = True
    depends_on_bends: bool = False
    elements: list[MappedElement] = field(default_factory=list)
    effects: list[Effect] = field(default_factory=list)
    shapes: list[MappedElement] = field(default_factory=list)
    aside: bool = False
    copy: int | None = None
    pictures: list[embedded.EmbeddedPicture] = field(default_factory=list)
    notes: Counter[str] = field(default_factory=Counter)
    carried: Quota = field(default_factory=lambda: Quota(limits.ARTWORK_CURVES, _CARRIED))
    covered: Quota = field(default_factory=lambda: Quota(limits.ARTWORK_COVERED, _COVERED))

    @classmethod
    def of(
        cls,
        data: bytes,
        target: Shape,
        copies: int = 1,
        *,
        bends: bool = True,
        alone: bool = True,
    ) -> "MappedDocument":
        """Build the document of an SVG file on the target's canvas; its shapes have no paths yet.

        With several copies, each is a group. If the map `bends`, that is, is not affine, patterns are drawn as tiles.
        Unless it is `alone`, no style sheets remain, which would also apply to the other drawing.

        Raises:
            InputError: the document is malformed.
        """
        document = attributes.settled(tree.parse(data), wholly=not alone)
        node = document.root
        low, high = target.box
        x, y, width, height = low.real, -high.imag, (high - low).real, (high - low).imag
        around = (x - width, y - height, 3 * width, 3 * height)
        out = Element(f"{SVG}svg", svg_size(complex(width, height), target.millimetres, target.unit))
        out.set("viewBox", " ".join(f"{v:.9g}" for v in (x, y, width, height)))
        drawing = cls(
            out,
            Definitions(document),
            document,
            {name: f"{value:.9g}" for (name, _), value in zip(SIDES, around)},
            bends,
        )
        out.attrib |= drawing._styled(node, "svg")
        for style in [copy.deepcopy(e) for e in document.top.iter() if local(e) == "style"]:
            style.text = _D_IN_CSS.sub("", style.text or "")
            out.append(style)
        drawing.notes[_UNREAD] += document.unread
        for copy_number in range(0 if node.hidden else copies):
            place, drawing.shapes = out, []
            if copies > 1:
                drawing.copy, place = copy_number, SubElement(out, f"{SVG}g")
            drawing._children(node, place)
            drawing._applied(node, place, drawing.shapes)
        drawing.notes.update(document.substituted_texts.values())
        return drawing

    def cut_by(
        self,
        rings: Sequence[Complex],
        opacity: float = 0.0,
        grounds: Sequence[tuple[str, Sequence[Complex]]] = (),
    ) -> None:
        """Show the drawing only inside rings, and outside with an opacity.

        Grounds are colours with the rings of areas that lie behind the drawing, the lowest first. All rings are in the
        target's core plane, and filled by the even-odd rule.
        """
        content = [child for child in self.out if local(child) not in ("style", "defs")]
        cut = (
            {"mask": self._fading_mask(rings, opacity)}
            if opacity
            else {"clip-path": self._painted_clip(rings)}
        )
        group = Element(f"{SVG}g", cut)
        for child in content:
            self.out.remove(child)
            group.append(child)
        for colour, area in grounds:
            style = f"fill:{colour};fill-opacity:1;fill-rule:evenodd;stroke:none"
            self.out.append(Element(f"{SVG}path", {"d": path_of(area), "style": style}))
        self.out.append(group)

    def _painted_clip(self, rings: Sequence[Complex]) -> str:
        """Add a clip path of rings, and return a reference to it."""
        clip = self.definitions.new("clipPath")
        SubElement(clip, f"{SVG}path", {"d": path_of(rings), "clip-rule": "evenodd"})
        return f"url(#{clip.get('id')})"

    def _fading_mask(self, rings: Sequence[Complex], opacity: float) -> str:
        """Add a mask that shows the inside of rings, and the outside with an opacity; return a reference to it."""
        mask = self.definitions.new("mask")
        everywhere = dict(zip(("x", "y", "width", "height"), self._everywhere()))
        mask.attrib |= {"maskUnits": "userSpaceOnUse", **everywhere}
        SubElement(mask, f"{SVG}rect", {**everywhere, "fill": "white", "fill-opacity": f"{opacity:.4g}"})
        SubElement(mask, f"{SVG}path", {"d": path_of(rings), "fill": "white", "fill-rule": "evenodd"})
        return f"url(#{mask.get('id')})"

    def _everywhere(self) -> list[str]:
        """Return x, y, width and height of the canvas, tripled about its middle since lines extend beyond it."""
        x, y, width, height = map(float, self.out.attrib["viewBox"].split())
        return [f"{value:.9g}" for value in (x - width, y - height, 3 * width, 3 * height)]

    def finish(self) -> None:
        """Add the definitions in use, once the map has transferred the shapes and pictures."""
        self._share_pictures()
        self.definitions.collect(self.out)
        if len(self.definitions.out):
            self.out.insert(0, self.definitions.out)
        self.notes["reference to another file, omitted"] += confine(self.out)

    def _share_pictures(self) -> None:
        """Store unchanged pictures that are shown more than once only once."""
        images = [(out, out[0]) for out in (picture.out for picture in self.pictures) if len(out) == 1]
        uses = Counter(image.get(tree.LINKS[1]) for _, image in images)
        for out, image in images:
            if uses[image.get(tree.LINKS[1])] > 1 and (transform := image.attrib.pop("transform", "")):
                shared = self.definitions.picture(image.attrib)
                link = {tree.LINKS[1]: f"#{shared.get('id')}", "transform": transform}
                out[0] = Element(f"{SVG}use", link)

    def _children(self, node: Node, parent: Element) -> None:
        for child in self.document.children(node):
            self.add(child, parent)

    def add(self, node: Node, parent: Element) -> None:
        """Add a node and its content to a parent in the new document."""
        if node.hidden:
            self.notes["hidden element (display: none, opacity 0), omitted"] += not self.aside
        elif node.tag in tree.SHAPES:
            try:
                self._shape(node, parent)
            except InputError as error:
                if str(error).startswith("<"):
                    raise
                name = f" {node.element.get('id')!r}" if node.element.get("id") else ""
                raise error.named(f"<{node.tag}>{name}") from error
        elif node.tag == "use" and _is_command(self.document.linked(node.element)):
            self._command(node, parent)
        elif node.tag in tree.GROUPS:
            self._group(node, parent)
        elif node.tag == "image":
            self._picture(node, parent)
        elif node.tag in _COPIED:
            if node.copied_from:
                self.document.copies.add(node.element, whole=True)
            parent.append(copy.deepcopy(node.element))
        else:
            reason = self.document.unset_texts.get(id(node.element)) or _REASONS.get(node.tag, "")
            remedy = _REMEDY if node.tag in ("text", "flowRoot") else ""
            self.notes[f"<{node.tag}>, omitted{', since ' * bool(reason)}{reason}{remedy}"] += 1

    def _group(self, node: Node, parent: Element) -> None:
        first = len(self.shapes)
        if node.tag == "a" and any(name in node.element.attrib for name in tree.LINKS):
            self.notes["link (<a>), drawn without its address"] += 1
        group = self._nested(parent, {} if node.tag == tree.VIEWPORT else self._styled(node, "g"))
        self._children(node, group)
        if group is parent:
            return
        shapes = self.shapes[first:]
        if node.tag != tree.VIEWPORT:
            self._applied(node, group, shapes)
        elif node.frame and (box := box_of(shapes, node.frame.affine)):
            place = _rectangle(node.frame)
            if not _holds(place, box):  # only if it extends beyond the viewport
                restyle(group, {"clip-path": self._clip_to(place, node.frame)[0]})

    def _command(self, node: Node, parent: Element) -> None:
        """Add a command of Ink/Stitch: a <use>, which follows the map's affine part where its symbol lies."""
        out, first = SubElement(parent, f"{SVG}g"), len(self.shapes)
        self._children(node, Element(f"{SVG}g"))  # mapped to know where it lies, but not written
        link = next(node.element.get(name, "") for name in tree.LINKS if node.element.get(name))
        sides = {name: node.properties[name] for name in ("width", "height") if name in node.properties}
        command = self._styled(node, "use") | sides | {tree.LINKS[1]: link}

        def place(over: AffinePart) -> str:
            out.tag, out.attrib = (
                f"{SVG}use",
                command | {"transform": affine.to_svg(over.affine @ node.affine)},
            )
            return ""

        self.effects.append(Effect(self.shapes[first:], place))

    def _shape(self, node: Node, parent: Element) -> None:
        if reader.is_constraint(node):
            return
        runs = pen_paths_of(node)
        self.notes["shape whose path data or points are malformed, drawn up to there"] += bool(node.faults)
        if not runs or not scale(node.affine):
            return
        self.carried.spend(sum(len(run.pieces) for run in runs))
        properties = node.properties
        out = SubElement(parent, f"{SVG}path", self._styled(node, "path"))
        marked = {
            name for name in _MARKERS if properties.get(name, properties.get("marker", "none")) != "none"
        }
        marks = frozenset(marked if node.tag in _MARKED else ())
        shape = MappedElement(
            out,
            parent,
            runs,
            declared=node.declared,
            filled=node.filled,
            lined=local(parent) != "clipPath" and (bool(marks) or node.stroked),
            aside=self.aside,
            markers=marks,
            line_first=properties.get("paint-order", "").strip().startswith("stroke"),
            copy=self.copy,
        )
        self.elements.append(shape)
        self.shapes.append(shape)
        if local(parent) != "clipPath":
            out.extend(copy.deepcopy(child) for child in node.element if local(child) in _DESCRIBING)
        self._applied(node, out, [shape])
        if local(parent) == "clipPath":
            if (
                "clip-rule" in properties and "clip-rule" not in shape.declared
            ):  # inherited from a <use>, which is resolved
                restyle(out, {"clip-rule": properties["clip-rule"]})
            return
        if marked and node.tag not in _MARKED:
            restyle(out, dict.fromkeys(sorted(marked), "none"))
        space = Space(node.affine, node.size, [shape])
        if self._tile(node, shape, space):
            properties = {**properties, "fill": "none"}
        self._paint(shape, properties, space)
        if shape.lined and properties.get("vector-effect") != "non-scaling-stroke":
            self.effects.append(Effect([shape], lined(shape, node.element, properties, space)))

    def _picture(self, node: Node, parent: Element) -> None:
        """Add a group for an embedded picture, clipped to its mapped outline; the picture is resampled later."""
        link = next((k for k in tree.LINKS if node.element.get(k, "").strip().startswith("data:")), None)
        if link is None:
            self.notes["<image> that is not embedded, omitted"] += 1
            return
        if local(parent) == "clipPath":
            return
        address = embedded.typed(node.element.get(link, ""))
        picture = embedded.size_of(address)
        if picture is None:
            self.notes["<image> that cannot be read, omitted"] += 1
            return
        content, width, height = picture
        self.carried.spend(embedded.COUNTED_CURVES)
        place = _picture_place(node, width / height, height)
        if min(place[2:]) <= 0:
            return
        aspect = node.properties.get("preserveAspectRatio", "")
        fit, visible = embedded.placed(place, (width / height, 1.0), aspect)
        group = SubElement(parent, f"{SVG}g", self._styled(node, "g"))
        clip, shapes = self._clip_to(visible, node)
        self.pictures.append(
            embedded.EmbeddedPicture(
                SubElement(group, f"{SVG}g", {"clip-path": clip}),
                group,
                content,
                address,
                node.affine(_corners(visible)),
                node.affine @ fit,
                width / height,
                smooth=node.properties.get("image-rendering", "auto").strip() not in embedded.NEAREST,
                copy=self.copy,
            )
        )
        self.shapes += shapes
        self._applied(node, group, shapes)

    def _tile(self, node: Node, shape: MappedElement, space: Space) -> bool:
        """Draw the pattern that fills a shape as tiles, which the map bends, below its line; return whether it does.

        Patterns of shapes with clip paths, opacities or filters stay patterns, which follow the map's affine part.
        """
        properties, parent = node.properties, shape.parent
        pattern = self.document.referenced(properties.get("fill", ""), "pattern")
        has_effects = any(node.declared.get(name, "none") != "none" for name in _EFFECTS)
        if pattern is None or not space.area or has_effects or id(pattern) in node.copied_from:
            return False
        self.depends_on_bends = True
        if not self.bends:
            return False
        attributes_of_pattern, source = self.definitions.inherited_attributes(pattern)
        tile = space.rectangle(
            attributes_of_pattern, "patternUnits", dict.fromkeys(("x", "y", "width", "height"), "0")
        )
        if not tile or tile[2] <= 0 or tile[3] <= 0:
            return False
        drawn = tiled(self.document, source, attributes_of_pattern, tile, space)
        if drawn is None:
            return False
        outline = replace(node, properties={**properties, "fill": "black"}, declared={}, hidden=False)
        clip = self.definitions.new("clipPath")
        with self._elsewhere():
            area = MappedElement(SubElement(clip, f"{SVG}path"), clip, shape.runs, aside=True, copy=self.copy)
            restyle(area.out, {"clip-rule": properties.get("fill-rule", "nonzero")})
            self.elements.append(area)
        style = {"clip-path": f"url(#{clip.get('id')})", "opacity": properties.get("fill-opacity", "1")}
        group = Element(f"{SVG}g", {"style": ";".join(f"{name}:{value}" for name, value in style.items())})
        parent.insert(list(parent).index(shape.out), group)
        inside = replace(
            outline,
            element=drawn,
            tag="g",
            properties={},
            copied_from=(*node.copied_from, id(pattern)),
            names=(),
        )
        with self._elsewhere():
            self.aside = False
            self.add(self.document.resolved(inside, {}), group)
        restyle(shape.out, {"fill": "none"})
        shape.filled = False
        return True

    def _paint(self, shape: MappedElement, properties: Mapping[str, str], space: Space) -> None:
        """Copy the shape's gradients, patterns and markers into user space, so that they can follow the map."""
        for kind in ("fill", "stroke"):
            definition = self.document.referenced(properties.get(kind, ""), *_PAINTED)
            if definition is not None and (copied := self.definitions.painted(definition, space)):
                restyle(shape.out, {kind: copied[0]})
                self.effects.append(Effect([shape], copied[1]))
        for name in sorted(shape.markers):
            definition = self.document.referenced(
                properties.get(name, properties.get("marker", "")), "marker"
            )
            if definition is not None and (
                copied := self.definitions.marker(definition, scale(space.affine))
            ):
                restyle(shape.out, {name: copied[0]})
                self.effects.append(Effect([shape], copied[1]))

    def _applied(self, node: Node, out: Element, shapes: list[MappedElement]) -> None:
        """Apply a node's clip path, mask and filter to `out`, each as a separate copy to be mapped."""
        space = Space(node.affine, node.size, shapes)
        kinds = (("clip-path", self._clip), ("mask", self._mask), ("filter", self._filter))
        for name, make in kinds:
            reference = node.declared.get(name, "none").strip()
            if reference == "none" or (local(out) == "clipPath" and name != "clip-path"):
                continue
            definition = self.document.effect(node, name)
            self.covered.spend(sum(len(run.pieces) for shape in shapes for run in shape.runs))
            usable = definition is not None and id(definition) not in node.copied_from
            new_reference = make(definition, node, space) if definition is not None and usable else None
            if new_reference is None and shapes:
                reason = "refers to no element of the file or has no area"
                if css_functions.is_function(reference):
                    reason = "has a CSS function or a unit that is not supported"
                self.notes[f"{name} that {reason}, omitted"] += 1
            restyle(out, {name: new_reference or "none"})

    def _clip(self, element: Element, node: Node, space: Space) -> str | None:
        inner = self._definition(element, node, space, "clipPathUnits")
        if inner is None:
            return None
        mapped = self.definitions.new("clipPath", self._styled(inner, "clipPath"))
        with self._elsewhere():
            self._children(inner, mapped)
            self._applied(inner, mapped, self.shapes)
        return f"url(#{mapped.get('id')})"

    def _mask(self, element: Element, node: Node, space: Space) -> str | None:
        inner = self._definition(element, node, space, "maskContentUnits")
        place = space.rectangle(self.document.declared(element), "maskUnits", MARGIN)
        if inner is None or place is None:
            return None
        mapped = self.definitions.new("mask", self._styled(inner, "mask") | self.region)
        mapped.set("maskUnits", "userSpaceOnUse")
        content = SubElement(mapped, f"{SVG}g")
        if space.area and not _holds(place, space.box):
            restyle(content, {"clip-path": self._clip_to(place, node)[0]})
        with self._elsewhere():
            self._children(inner, content)
            self._applied(inner, mapped, self.shapes)
        return f"url(#{mapped.get('id')})"

    def _filter(self, element: Element, node: Node, space: Space) -> str | None:
        copied = filtered(self.definitions, element, space)
        if copied is None:
            return None
        self.effects.append(Effect(space.shapes, copied[1]))
        return copied[0]

    def _definition(self, element: Element, node: Node, space: Space, units: str) -> Node | None:
        """Return the clip path or mask that a node uses; None where its units refer to a box without area."""
        boxed = self.document.declared(element).get(units) == "objectBoundingBox"
        if boxed and not space.area:
            return None
        return self.document.definition(element, node, space.units if boxed else tree.IDENTITY)

    def _clip_to(self, place: Rectangle, node: Node) -> tuple[str, list[MappedElement]]:
        """Return a clip path for a rectangle in the node's user space, and its shape."""
        mapped = self.definitions.new("clipPath")
        sides = {name: repr(value) for (name, _), value in zip(SIDES, place)}
        rectangle = Node(
            Element(f"{SVG}rect", sides),
            "rect",
            node.affine,
            node.size,
            copied_from=node.copied_from,
            properties=sides,
        )
        with self._elsewhere():
            self.add(rectangle, mapped)
            return f"url(#{mapped.get('id')})", self.shapes

    @contextmanager
    def _elsewhere(self) -> Iterator[None]:
        """Separate the shapes of a clip path or mask from those of the place where it is used."""
        shapes, aside = self.shapes, self.aside
        self.shapes, self.aside = [], True
        try:
            yield
        finally:
            self.shapes, self.aside = shapes, aside

    def _styled(self, node: Node, tag: str) -> dict[str, str]:
        """Return the attributes that a node keeps; without an id if it might occur twice."""
        once = not node.copied_from and not self.copy and tag not in ("clipPath", "mask")
        styled = Element(tag, attributes.remaining_attributes(self.document, node.element, tag, named=once))
        contextual = [kind for kind in ("fill", "stroke") if "context-" in node.declared.get(kind, "")]
        restyle(styled, {kind: node.properties[kind] for kind in contextual if kind in node.properties})
        return styled.attrib

    @staticmethod
    def _nested(parent: Element, attributes: dict[str, str]) -> Element:
        """Return a new group in the parent; or the parent itself if it is a clip path, which cannot contain groups."""
        return parent if local(parent) == "clipPath" else SubElement(parent, f"{SVG}g", attributes)


def _is_command(symbol: Element | None) -> bool:
    """Return whether an element is a symbol by whose id Ink/Stitch knows a command, such as where to trim a thread."""
    return symbol is not None and local(symbol) == "symbol" and symbol.get("id", "").startswith("inkstitch_")


def _rectangle(node: Node) -> Rectangle:
    """Return x, y, width and height of a node in its user space."""
    x, y, width, height = (node.length(name, axis) for name, axis in SIDES)
    return x, y, width, height


def _holds(outer: Rectangle, inner: Rectangle) -> bool:
    """Return whether a rectangle contains another, up to rounding."""
    tiny = 1e-6 * max(inner[2:])
    return all(
        a <= b + tiny and a + sides >= b + size - tiny
        for a, sides, b, size in zip(outer[:2], outer[2:], inner[:2], inner[2:])
    )


def _picture_place(node: Node, ratio: float, height: float) -> Rectangle:
    """Return the rectangle of a picture in its user space; a missing width or height follows from the picture's own.

    Args:
        node: the element.
        ratio: width / height of the picture's pixels.
        height: of the picture's pixels, which is the height where neither is given.
    """
    has_width, has_height = (
        node.properties.get(name, "auto").strip() not in ("", "auto") for name in ("width", "height")
    )
    x, y, given_width, given_height = _rectangle(node)
    if has_width and has_height:
        return x, y, given_width, given_height
    if has_width:
        return x, y, given_width, given_width / ratio
    if not has_height:
        given_height = height
    return x, y, ratio * given_height, given_height


def _corners(place: Rectangle) -> Complex:
    """Return the corners (4,) of a rectangle in order."""
    x, y, width, height = place
    return complex(x, y) + np.array([0, width, complex(width, height), 1j * height])


def path_of(rings: Sequence[Complex]) -> str:
    """Return path data of rings in the core plane, where y points up."""
    return "".join(
        "M" + "L".join(f"{z.real:.9g} {-z.imag:.9g}" for z in ring.tolist()) + "Z" for ring in rings
    )
