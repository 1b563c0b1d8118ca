"""Restrict a drawing's references to the drawing itself: `#id`, and pictures as `data:`.

When an SVG is opened or shown in a page, it fetches what its styles and links refer to, and runs its scripts. So no
external reference or script may be passed on, however it is written: styles are parsed as CSS rather than searched for
names and values.
"""

import re
from collections.abc import Callable, Iterator
from typing import Any
from xml.etree.ElementTree import Element

import tinycss2

from ..svg.document import local

PICTURE = re.compile(r"data:image/(?:png|jpe?g|gif|webp|avif|bmp|tiff?|x-icon)[;,]", re.IGNORECASE)
UNTYPED = re.compile(r"\s*data:;base64,\s*")
SIGNATURES = {"iVBORw0KGgo": "png", "/9j/": "jpeg", "R0lGOD": "gif"}  # first characters of the file in base64
FETCHING = {"url", "src"}  # functions whose argument is an address
OTHERS = {"image", "image-set", "-webkit-image-set", "cross-fade", "-webkit-cross-fade", "expression", "attr"}
NESTED = {"media", "supports", "layer", "container", "scope", "keyframes", "-webkit-keyframes"}
HOLDING = {"font-face", "page", "counter-style", "property", "color-profile"}
INERT = {"charset", "namespace"}
ACTIVE = {"script", "foreignObject", "iframe", "embed", "object", "audio", "video", "handler", "listener"}
ACTIVE |= {"animate", "set", "animateMotion", "animateTransform", "animateColor", "discard", "link"}
NUMBERLESS = re.compile(r"(?i)(?<![\w#.-])[-+]?(?:nan|inf|infinity)(?![\w.-])")
PATHLESS = re.compile(r"(?i)nan|inf")  # in path data, where letters may be next to numbers
NAMES = {
    "id",
    "class",
    "label",
    "style",
    "type",
    "result",
    "in",
    "in2",
    "values",
}  # and links: text, not numbers
XHTML = "{http://www.w3.org/1999/xhtml}"
LINKS = {"href", "src", "data", "base", "action", "formaction"}


def confine(top: Element) -> int:
    """Remove from a document, in place, everything that refers outside of it or could run.

    Returns:
        The number of references that were removed.
    """
    left_out = 0
    for parent in list(top.iter()):
        for child in [child for child in parent if _active(child)]:
            parent.remove(child)
    for element in top.iter():
        if local(element) == "style":
            text = "".join(element.itertext())
            element[:] = []
            element.text, removed_count = sheet(text)
            left_out += removed_count
        for name, value in list(element.attrib.items()):
            new_value, removed_count = _attribute(name, value)
            left_out += removed_count
            if new_value is None:
                del element.attrib[name]
            else:
                element.set(name, new_value)
    return left_out


def typed(address: str) -> str:
    """Add the media type to an embedded picture's address, which old drawings of Illustrator lack."""
    untyped = UNTYPED.match(address)
    content = address[untyped.end() :] if untyped else ""
    kind = next((kind for first, kind in SIGNATURES.items() if content.startswith(first)), "")
    return f"data:image/{kind};base64,{content}" if kind else address


def sheet(text: str) -> tuple[str, int]:
    """Return a style sheet without references out of the document, and the number of removed declarations and rules."""
    return _confined(_rules, tinycss2.parse_stylesheet, text)


def style(text: str) -> tuple[str, int]:
    """Remove declarations that refer to other documents from a style attribute. Returns it, and their number."""
    return _confined(_declarations, tinycss2.parse_blocks_contents, text)


def _confined(
    keep: Callable[..., Iterator[Any]], parse: Callable[[str], list[Any]], text: str
) -> tuple[str, int]:
    removed: list[Any] = []
    try:
        return tinycss2.serialize(list(keep(parse(text), removed))), len(removed)
    except (ValueError, RecursionError):  # numbers of thousands of digits, deep nesting
        return "", 1


def _active(element: Element) -> bool:
    name = str(element.tag).rpartition("}")[2]
    return str(element.tag).startswith(XHTML) or name in ACTIVE


def _attribute(name: str, value: str) -> tuple[str | None, int]:
    """Return an attribute's new value, None if it is removed, and the number of removed references."""
    bare = name.rpartition("}")[2].lower()
    if bare.startswith("on"):
        return None, 0
    if bare in LINKS and "rdf-syntax" not in name:
        return (value, 0) if _inside(value) else (None, 1)
    if bare == "style":
        return style(value)
    if bare not in NAMES and (NUMBERLESS if bare != "d" else PATHLESS).search(value):
        return None, 0
    if "(" not in value and "\\" not in value:
        return value, 0
    try:
        return (None, 1) if _leads_out(tinycss2.parse_component_value_list(value)) else (value, 0)
    except (ValueError, RecursionError):
        return None, 1


def _rules(nodes: list[Any], removed: list[Any]) -> Iterator[Any]:
    for node in nodes:
        # @import, in any form
        if node.type == "at-rule" and node.lower_at_keyword not in NESTED | HOLDING | INERT:
            removed.append(node)
            continue
        if node.type == "qualified-rule":
            node.content = list(_declarations(tinycss2.parse_blocks_contents(node.content), removed))
        elif node.type == "at-rule" and node.content is not None:
            if node.lower_at_keyword in NESTED:
                node.content = list(_rules(tinycss2.parse_rule_list(node.content), removed))
            else:
                node.content = list(_declarations(tinycss2.parse_blocks_contents(node.content), removed))
        elif node.type == "error":
            removed.append(node)
            continue
        if node.type in ("qualified-rule", "at-rule") and _leads_out(node.prelude, node.type == "at-rule"):
            removed.append(node)
            continue
        yield node


def _declarations(nodes: list[Any], removed: list[Any]) -> Iterator[Any]:
    """Yield declarations without external references as text; nested rules and unreadable content are dropped."""
    first = True
    for node in nodes:
        if node.type in ("whitespace", "comment"):
            yield node
        elif node.type == "declaration" and not _leads_out(node.value):
            text = f"{node.name}:{tinycss2.serialize(node.value)}{'!important' if node.important else ''}"
            yield from tinycss2.parse_component_value_list(text if first else f";{text}")
            first = False
        else:
            removed.append(node)


def _leads_out(values: list[Any], inert: bool = False) -> bool:
    """Return whether component values refer to anything outside the document.

    If `inert`, addresses are only names.
    """
    for value in values:
        if value.type == "url" and not inert and not _inside(value.value):
            return True
        if value.type in ("error", "at-keyword"):
            return True
        if value.type == "function":
            name = value.lower_name
            if name in OTHERS or (name in FETCHING and not inert and not _names_inside(value.arguments)):
                return True
            if name not in FETCHING and _leads_out(value.arguments, inert):
                return True
        if value.type.endswith("block") and _leads_out(value.content, inert):
            return True
    return False


def _names_inside(arguments: list[Any]) -> bool:
    significant = [value for value in arguments if value.type not in ("whitespace", "comment")]
    return len(significant) == 1 and significant[0].type == "string" and _inside(significant[0].value)


def _inside(address: str) -> bool:
    """Return whether an address is an id in the document, or a picture embedded in it."""
    address = address.strip()
    return address.startswith("#") or bool(PICTURE.match(address))
