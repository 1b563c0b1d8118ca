"""The part of CSS that decides what an SVG shows: declarations, and rules with simple selectors."""

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import tinycss2

from ...errors import InputError
from .budget import MAX_RULES, MAX_STYLE

_SIMPLE = re.compile(r"(\*|[A-Za-z][\w-]*+)?((?:[.#][\w-]++)*+)")
_PLAIN = re.compile(r"[^\"'()\\/@{}!<]*")
_PART = re.compile(r"[.#][\w-]+")


@dataclass(frozen=True)
class Rule:
    """One selector without combinators, with its declarations and its rank in the cascade."""

    tag: str
    parts: frozenset[str]
    style: Mapping[str, str]
    rank: tuple[int, int, int, int]  # CSS specificity (ids, classes, tags), then the order


@dataclass(frozen=True)
class Sheet:
    """Rules by one thing that an element must have: an id, a class, a tag or anything.

    Attributes:
        rules: these.
        unread: how many rules there are beside them, with other selectors.
        known: what was found for elements so far, by tag, classes and id.
        classes: those that rules ask for, by lists of classes so far.
        tried: how many rules were held against elements.
    """

    rules: Mapping[str, list[Rule]] = field(default_factory=dict)
    unread: int = 0
    known: dict[tuple[str, frozenset[str]], dict[str, str]] = field(default_factory=dict)
    classes: dict[str, frozenset[str]] = field(default_factory=dict)
    tried: Counter[str] = field(default_factory=Counter)

    def style(self, tag: str, attributes: Mapping[str, str]) -> dict[str, str]:
        """What the sheet says of an element.

        Raises:
            InputError: there are too many rules for too many elements.
        """
        if not self.rules:
            return {}
        key = (
            tag,
            self._classes(attributes.get("class", "")) | ({f"#{attributes.get('id', '')}"} & self.parts),
        )
        if key not in self.known:
            self.known[key] = self._style(*key)
        return dict(self.known[key])

    @cached_property
    def parts(self) -> frozenset[str]:
        """All classes and ids that rules ask for."""
        return frozenset(part for rules in self.rules.values() for rule in rules for part in rule.parts)

    def _classes(self, text: str) -> frozenset[str]:
        if text not in self.classes:
            words = text.split()
            self._try(len(words) // 8)  # looking for one takes so much less than a rule
            self.classes[text] = self.parts & {f".{word}" for word in words}
        return self.classes[text]

    def _try(self, rules: int) -> None:
        self.tried["rules"] += rules
        if self.tried["rules"] > MAX_RULES:
            raise InputError(
                f"its style sheet has more than {MAX_RULES} combinations of rules and elements; "
                "save it as plain SVG, with styles in attributes"
            )

    def _style(self, tag: str, has: Set[str]) -> dict[str, str]:
        self._try(sum(len(self.rules.get(key, ())) for key in (*has, tag, "*")))
        near = (rule for key in (*has, tag, "*") for rule in self.rules.get(key, ()))
        fitting = [rule for rule in near if rule.tag in ("", "*", tag) and rule.parts <= has]
        found: dict[str, str] = {}
        for rule in sorted(fitting, key=lambda rule: rule.rank):
            found |= rule.style
        return found


def declarations(text: str) -> dict[str, str]:
    """`name: value; …` by name; what cannot be read is left out, as CSS has it."""
    if _PLAIN.fullmatch(text):  # most are: no need to look at every character
        pairs = (part.partition(":") for part in text.split(";"))
        return {k.strip().lower(): v.strip() for k, colon, v in pairs if colon}
    return dict(_quoted(text))


@lru_cache(64)  # what <use> draws again
def _quoted(text: str) -> dict[str, str]:
    return _declared(_parsed(tinycss2.parse_blocks_contents, text))


def sheet(text: str) -> Sheet:
    """The rules of a style sheet whose selectors are a tag, classes and an id; others, and @-rules, are left out.

    Raises:
        InputError: it is too long.
    """
    if len(text) > MAX_STYLE:
        raise InputError(f"its style sheet has more than {MAX_STYLE} characters; save it as plain SVG")
    rules, unread = defaultdict(list), 0
    for order, (selector, body) in enumerate(_rules(text)):
        match = _SIMPLE.fullmatch(selector)
        if match and match[0]:
            tag, parts = match[1] or "", frozenset(_PART.findall(match[2]))
            ids = sum(part[0] == "#" for part in parts)
            rank = ids, len(parts) - ids, int(tag not in ("", "*")), order
            rules[min(parts, default=tag)].append(Rule(tag, parts, body, rank))
        else:
            unread += 1
    return Sheet(dict(rules), unread)


def _rules(text: str) -> Iterator[tuple[str, dict[str, str]]]:
    """Selectors and declarations at the top level, outside every @-rule."""
    for rule in _parsed(tinycss2.parse_stylesheet, text):
        if rule.type == "qualified-rule":
            body = _declared(_parsed(tinycss2.parse_blocks_contents, rule.content))
            yield from ((part.strip(), body) for part in _written(rule.prelude).split(","))


def _parsed(parse: Callable[..., list[Any]], text: Any) -> list[Any]:
    """What a parser finds; nothing where it gives up, at numbers of thousands of digits and deep nesting."""
    try:
        return parse(text, skip_comments=True, skip_whitespace=True)
    except (ValueError, RecursionError):
        return []


def _declared(nodes: Sequence[Any]) -> dict[str, str]:
    return {node.lower_name: _written(node.value) for node in nodes if node.type == "declaration"}


def _written(values: Sequence[Any]) -> str:
    try:
        return _serialized(values)
    except RecursionError:
        return ""


def _serialized(values: Sequence[Any]) -> str:
    return tinycss2.serialize([value for value in values if value.type != "comment"]).strip()
