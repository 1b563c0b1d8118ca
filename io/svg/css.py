"""Declarations of CSS: those of a `style` attribute, and of parsed rules."""

import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import tinycss2

_PLAIN = re.compile(r"[^\"'()\\/@{}!<]*")


def declarations(text: str) -> dict[str, str]:
    """`name: value; …` by name; what cannot be read is left out, as CSS has it."""
    if _PLAIN.fullmatch(text):  # most are: no need to look at every character
        pairs = (part.partition(":") for part in text.split(";"))
        return {k.strip().lower(): v.strip() for k, colon, v in pairs if colon}
    return dict(_quoted(text))


@lru_cache(64)  # what <use> draws again
def _quoted(text: str) -> dict[str, str]:
    return block(text)


def block(content: Any) -> dict[str, str]:
    """The declarations of a block, by name.

    Args:
        content: text, or what tinycss2 parsed it to.
    """
    nodes = parsed(tinycss2.parse_blocks_contents, content)
    return {node.lower_name: written(node.value) for node in nodes if node.type == "declaration"}


def parsed(parse: Callable[..., list[Any]], content: Any) -> list[Any]:
    """What a parser finds; nothing where it gives up, at numbers of thousands of digits and deep nesting."""
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
