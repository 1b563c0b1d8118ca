"""Select the attributes and styles that an element keeps in the new drawing."""

from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from ..svg import css
from ..svg.document import local
from ..svg.tree import LABEL, MODE, TRANSFORMS, Document

SPACES = {
    "": "http://www.w3.org/2000/svg",
    "xlink": "http://www.w3.org/1999/xlink",
    "inkscape": "http://www.inkscape.org/namespaces/inkscape",
    "cc": "http://creativecommons.org/ns#",
    "inkstitch": "http://inkstitch.org/namespace",
}
# Once, because while a prefix is registered again, another thread would write elements without it.
for _prefix, _name in SPACES.items():
    ElementTree.register_namespace(_prefix, _name)
# Other attributes of Inkscape, and all of sodipodi, describe how to recompute a path from its original shape.
_NAMED = {LABEL, MODE, "{http://www.w3.org/XML/1998/namespace}space"}
# The elements that a line connects, such as a command of Ink/Stitch and its object; both keep their ids.
_NAMED |= {f"{{{SPACES['inkscape']}}}connection-{end}" for end in ("start", "end")}
# Namespaces of which attributes describe the original shape, or act: those of the web, of Inkscape and of Sodipodi.
_NOT_FOREIGN = ("http://www.w3.org/", "http://www.inkscape.org/", "http://sodipodi.sourceforge.net/")
# Attributes for the position of an element, which path data replace, and for conditions on drawing it.
_PLACED = {"d", "x", "y", "width", "height", "cx", "cy", "r", "rx", "ry", "x1", "y1", "x2", "y2", "points"}
_PLACED |= {*TRANSFORMS, "transform-origin", "transform-box", "viewBox", "preserveAspectRatio", "pathLength"}
_PLACED |= {"clip-path", "clipPathUnits", "mask", "maskUnits", "maskContentUnits", "href"}
_PLACED |= {"version", "baseProfile", "requiredExtensions", "requiredFeatures", "systemLanguage"}


def remaining_attributes(document: Document, element: Element, tag: str, *, named: bool) -> dict[str, str]:
    """Return the attributes of an element that becomes a `tag`: without position and scripts; an id only if `named`.

    Style sheet rules that matched its old tag or id, and no longer match, are added to its own style.
    """
    attributes = {k: v for k, v in element.attrib.items() if not k.startswith("{")}
    remaining = {k: v for k, v in attributes.items() if k not in _PLACED and not k.lower().startswith("on")}
    if not named:
        remaining.pop("id", None)
    sheet = document.sheet
    nothing = css.Style()
    full_style, simple_style = (
        (sheet.style(element), sheet.simple_style(tag, remaining)) if sheet else (nothing, nothing)
    )
    style = full_style.only(k for k, v in full_style.items() if simple_style.get(k) != v)
    style.add({k: attributes.get(k, "inherit") for k in simple_style if k not in full_style})
    style.add(css.declarations(remaining.pop("style", "")))
    style = style.only(k for k in style if k not in _PLACED)
    for name in TRANSFORMS.intersection(simple_style):
        style.add(css.Style({name: "none"}, simple_style.important.intersection([name])))
    remaining |= {k: v for k, v in element.attrib.items() if k in _NAMED or _is_foreign(k)}
    return remaining | ({"style": style.text()} if style else {})


def _is_foreign(name: str) -> bool:
    """Return whether an attribute is one of another program, such as parameters of Ink/Stitch."""
    return name.startswith("{") and not name[1:].startswith(_NOT_FOREIGN)


def settled(document: Document, *, wholly: bool = False) -> Document:
    """Copy rules that depend on an element's place in the tree from the style sheet to `style` attributes, in place.

    With `wholly` all rules are copied, and nothing is left of the style sheet.
    """
    sheet = document.sheet
    if sheet is None or not (sheet.contextual or wholly):
        return document
    nothing = css.Style()
    styles = [
        (e, sheet.style(e), nothing if wholly else sheet.simple_style(local(e), e.attrib))
        for e in document.top.iter()
    ]
    for element, full_style, simple_style in styles:
        if style := full_style.only(k for k, v in full_style.items() if simple_style.get(k) != v):
            element.set("style", style.add(css.declarations(element.get("style", ""))).text())
        if local(element) == "style":
            element.text = "" if wholly else sheet.without_contextual("".join(element.itertext()))
            element[:] = []
    return Document(document.top)
