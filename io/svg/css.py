"""Declarations of CSS: those of a `style` attribute, and of parsed rules."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import tinycss2

_PLAIN = re.compile(r"[^\"'()\\/@{}!<]*")


class Style(dict[str, str]):
    """Values by name, of which some are `!important`: others do not replace them.

    Args:
        values: by name.
        important: names of those that are.
    """

    def __init__(self, values: Mapping[str, str] = MappingProxyType({}), important: Iterable[str] = ()):
        super().__init__(values)
        self.important = set(important)

    def add(self, later: Mapping[str, str]) -> "Style":
        """Add declarations that come later in the cascade; returns the same style."""
        vital = later.important if isinstance(later, Style) else frozenset()
        for name, value in later.items():
            if name in vital or name not in self.important:
                self[name] = value
        self.important |= vital
        return self

    def only(self, names: Iterable[str]) -> "Style":
        """Return some of the declarations."""
        kept = {name: self[name] for name in names}
        return Style(kept, self.important.intersection(kept))

    def text(self) -> str:
        """Return as the value of a `style` attribute."""
        return ";".join(f"{k}:{v}{'!important' if k in self.important else ''}" for k, v in self.items())


def declarations(text: str) -> Style:
    """`name: value; …` by name; what cannot be read is left out, as CSS has it."""
    if _PLAIN.fullmatch(text):  # most are: no need to look at every character
        pairs = (part.partition(":") for part in text.split(";"))
        return Style({k.strip().lower(): v.strip() for k, colon, v in pairs if colon})
    found = _quoted(text)
    return Style(found, found.important)


@lru_cache(64)  # what <use> draws again
def _quoted(text: str) -> Style:
    return block(text)


def block(content: Any) -> Style:
    """Return the declarations of a block, by name.

    Args:
        content: text, or what tinycss2 parsed it to.
    """
    found = Style()
    for node in parsed(tinycss2.parse_blocks_contents, content):
        if node.type == "declaration":
            vital = [node.lower_name] if node.important else []
            found.add(Style({node.lower_name: written(node.value)}, vital))
    return found


def parsed(parse: Callable[..., list[Any]], content: Any) -> list[Any]:
    """Return what a parser finds; nothing where it gives up, at numbers of thousands of digits and deep nesting."""
    try:
        return parse(content, skip_comments=True, skip_whitespace=True)
    except (ValueError, RecursionError):
        return []


def written(values: Sequence[Any]) -> str:
    """Component values, or rules, as text without comments; nothing where it is malformed, or nested too deeply."""
    try:
        return tinycss2.serialize([value for value in values if value.type != "comment"]).strip()
    except (RecursionError, TypeError):
        return ""
