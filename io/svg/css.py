"""CSS declarations, of a `style` attribute or of parsed rules."""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import tinycss2

MOST_NESTED_VARIABLES, MOST_CHARACTERS = 100, 10_000  # of one value
_VARIABLE = re.compile(r"var\(\s*(--[\w-]+)\s*(?:,((?:[^()]|\([^()]*\))*))?\)")
_PLAIN = re.compile(r"[^\"'()\\/@{}!<]*")


class Style(dict[str, str]):
    """Property values by name; values that are `!important` are not replaced by others.

    Args:
        values: values by name.
        important: names of the values that are important.
        layer: number of its cascade layer; rules outside of layers come last.
    """

    def __init__(
        self,
        values: Mapping[str, str] = MappingProxyType({}),
        important: Iterable[str] = (),
        layer: float = math.inf,
    ):
        super().__init__(values)
        self.important, self.layer = set(important), layer

    def add(self, later: Mapping[str, str]) -> "Style":
        """Add declarations that come later in the cascade, in place; return this style."""
        vital = later.important if isinstance(later, Style) else frozenset()
        for name, value in later.items():
            if name in vital or name not in self.important:
                self[name] = value
        self.important |= vital
        return self

    def only(self, names: Iterable[str]) -> "Style":
        """Return the declarations with the given names."""
        selected = {name: self[name] for name in names}
        return Style(selected, self.important.intersection(selected))

    def text(self) -> str:
        """Return the declarations as the value of a `style` attribute."""
        return ";".join(f"{k}:{v}{'!important' if k in self.important else ''}" for k, v in self.items())


def declarations(text: str) -> Style:
    """Parse `name: value; …`; invalid declarations are ignored, as in CSS."""
    if _PLAIN.fullmatch(text):  # the usual case: no need to parse character by character
        pairs = (part.partition(":") for part in text.split(";"))
        return Style({k.strip().lower(): v.strip() for k, colon, v in pairs if colon})
    style = _quoted(text)
    return Style(style, style.important)


@lru_cache(64)  # for elements that <use> draws again
def _quoted(text: str) -> Style:
    return block(text)


def block(content: Any) -> Style:
    """Return the declarations of a block.

    Args:
        content: text, or tokens parsed by tinycss2.
    """
    style = Style()
    for node in parsed(tinycss2.parse_blocks_contents, content):
        if node.type == "declaration":
            vital = [node.lower_name] if node.important else []
            style.add(Style({node.lower_name: serialize(node.value)}, vital))
    return style


def substituted(text: str, variables: Mapping[str, str]) -> str | None:
    """Return a value with `var(--name, fallback)` replaced; None where a variable has neither a value nor a fallback.

    >>> substituted("var(--ink, red)", {}), substituted("var(--ink)", {"--ink": "#123"}), substituted("var(--ink)", {})
    ('red', '#123', None)
    """
    for _ in range(MOST_NESTED_VARIABLES):
        match = _VARIABLE.search(text)
        if not match:
            return text
        value = variables.get(match[1], match[2])
        if value is None or len(text) > MOST_CHARACTERS:
            return None
        text = f"{text[: match.start()]}{value.strip()}{text[match.end() :]}"
    return None  # variables that refer to each other


def parsed(parse: Callable[..., list[Any]], content: Any) -> list[Any]:
    """Apply a tinycss2 parser; return nothing where it fails, as for numbers with thousands of digits, deep nesting."""
    try:
        return parse(content, skip_comments=True, skip_whitespace=True)
    except (ValueError, RecursionError):
        return []


def serialize(values: Sequence[Any]) -> str:
    """Serialize component values or rules without comments; empty where they are malformed or nested too deeply."""
    try:
        return tinycss2.serialize([value for value in values if value.type != "comment"]).strip()
    except (RecursionError, TypeError):
        return ""
