"""Drawings that are shown together with another one in the same document, whose ids must not meet."""

import copy
import re
from itertools import count
from xml.etree.ElementTree import Element

from ..svg.tree import LINKS
from .attributes import SPACES

REFERENCE = re.compile(r"""(url\(\s*["']?#)([^"')]+)""")
LINKING = {*LINKS, *(f"{{{SPACES['inkscape']}}}connection-{end}" for end in ("start", "end"))}
"""Attributes whose value is a reference `#id`."""


def with_unused_ids(drawing: Element, document: Element) -> Element:
    """Return a copy of a drawing whose ids do not occur in a document, and in which references follow them."""
    used = {element.get("id", "") for element in document.iter()}
    prefixes = (f"background{number or ''}-" for number in count())
    prefix = next(prefix for prefix in prefixes if not any(name.startswith(prefix) for name in used))
    drawing = copy.deepcopy(drawing)
    own = {element.get("id") for element in drawing.iter()} - {None}
    for element in drawing.iter():
        for name, value in list(element.attrib.items()):
            if name == "id":
                element.set(name, prefix + value)
            elif name in LINKING and value[:1] == "#" and value[1:] in own:
                element.set(name, f"#{prefix}{value[1:]}")
            elif "url(" in value:
                element.set(name, REFERENCE.sub(rf"\g<1>{prefix}\g<2>", value))
    return drawing
