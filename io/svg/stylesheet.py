"""Style sheets of a document: rules are matched by cssselect2, and applied in the order of the cascade.

Supported are all selectors except malformed ones, those with pseudo-classes that depend on user actions (`:hover`), and
those that cost more than a walk to the root or over the siblings (`:has`, `:nth-child(… of …)`). Every step counts
towards a limit.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any
from xml.etree.ElementTree import Element

import cssselect2
import tinycss2

from ...errors import InputError
from .. import limits
from . import css
from .budget import Quota
from .document import local

COSTLY = 100  # characters of a selector, or of an attribute compared with it, that take a microsecond
_SCREENS = {
    "",
    "all",
    "screen",
    "only screen",
    "(prefers-color-scheme: light)",
    "(prefers-color-scheme:light)",
}
_NESTING = ("layer", "supports", "media")
_MARKS = (">", "+", "~", ":")  # of combinators and of pseudo-classes
_LOGICAL = {"not", "is", "where"}
_OF_TYPE = {"first-of-type", "last-of-type", "only-of-type", "nth-of-type", "nth-last-of-type"}
_STRUCTURAL = {"root", "empty", "first-child", "last-child", "only-child"} | _OF_TYPE
_COUNTED = {"nth-child", "nth-last-child"} | _OF_TYPE
SIBLINGS = 8  # siblings whose tags are compared in the time of one step


class Stylesheet:
    """The rules of a style sheet.

    Args:
        text: the style sheet.
        root: of the document whose elements are styled.

    Attributes:
        unread: number of selectors that are not supported.
        contextual: whether a selector depends on more than its element's tag, classes and id.

    Raises:
        InputError: the sheet is too long.
    """

    def __init__(self, text: str, root: Element):
        if len(text) > limits.STYLE_CHARACTERS:
            raise InputError(
                f"its style sheet has more than {limits.STYLE_CHARACTERS} characters; save it as plain SVG"
            )
        self.root, self.unread = root, 0
        self._tests = Quota(
            limits.RULES,
            f"its style sheet has more than {limits.RULES} combinations of rules and elements; save it as "
            "plain SVG with styles in attributes",
        )
        self._simple, self._contextual = _Matcher(self._tests), _Matcher(self._tests)
        self._styles: dict[tuple[str, str | None, str | None], tuple[list[Any], css.Style]] = {}
        attribute_names: set[str] = set()
        self._compares_siblings = False
        for order, (tokens, style) in enumerate(_rules(text)):
            if order >= limits.SELECTORS:
                raise InputError(f"its style sheet has more than {limits.SELECTORS} selectors; simplify it")
            selector = _compiled(tokens)
            if selector is None:
                self.unread += 1
                continue
            matcher = self._contextual if _is_contextual(tokens) else self._simple
            matcher.order = order  # the order is common to both matchers
            matcher.cost = max(matcher.cost, 1 + len(css.serialize(tokens)) // COSTLY)
            matcher.add_selector(selector, style)
            attribute_names.update(_attributes(tokens))
            self._compares_siblings |= any(name in css.serialize(tokens) for name in _OF_TYPE)
        self.contextual = self._contextual.order > 0
        if attribute_names:
            values = (v for element in root.iter() for k, v in element.attrib.items() if k in attribute_names)
            self._contextual.cost *= 1 + max(map(len, values), default=0) // COSTLY

    def style(self, element: Element) -> css.Style:
        """Return the declarations that apply to an element of the document.

        Raises:
            InputError: there are too many rules for too many elements.
        """
        matches, style = self._simple_matches(local(element), element.attrib)
        wrapper = self._wrappers.get(id(element)) if self.contextual else None
        if wrapper is None or not (contextual := self._contextual.match(wrapper)):
            return style
        self._tests.spend(len(matches))
        return _cascade(sorted(matches + contextual))

    def simple_style(self, tag: str, attributes: Mapping[str, str]) -> css.Style:
        """Return the declarations of selectors by tag, classes and id, which apply wherever the element is."""
        return self._simple_matches(tag, attributes)[1]

    def _simple_matches(self, tag: str, attributes: Mapping[str, str]) -> tuple[list[Any], css.Style]:
        name = attributes.get("id")
        key = tag, attributes.get("class"), name if name in self._simple.id_selectors else None
        if key not in self._styles:
            element = Element(tag, {k: v for k, v in zip(("class", "id"), key[1:]) if v is not None})
            wrapper = cssselect2.ElementWrapper.from_xml_root(element)
            self._tests.spend(len(wrapper.classes) // 8)  # a look-up costs that much less than a rule
            matches = self._simple.match(wrapper)
            self._styles[key] = matches if self.contextual else [], _cascade(matches)
        return self._styles[key]

    @staticmethod
    def without_contextual(text: str) -> str:
        """Return a style sheet without selectors that depend on more than the tag, classes and id."""
        return css.serialize(_without_contextual(css.parsed(tinycss2.parse_stylesheet, text)))

    @cached_property
    def _wrappers(self) -> dict[int, cssselect2.ElementWrapper]:
        """Selector wrappers of all elements of the document, by Python's id."""
        wrapper = _counting_wrapper(self._tests, self._contextual.cost, siblings=self._compares_siblings)
        return {id(node.etree_element): node for node in wrapper.from_xml_root(self.root).iter_subtree()}


class _Matcher(cssselect2.Matcher):
    """Match selectors, and charge each test at the cost of the most expensive selector."""

    def __init__(self, tests: Quota):
        super().__init__()
        self.tests, self.cost = tests, 1

    def add_relevant_selectors(self, element, selectors, relevant_selectors):
        self.tests.spend(self.cost * len(selectors))
        super().add_relevant_selectors(element, selectors, relevant_selectors)


def _counting_wrapper(tests: Quota, cost: int, *, siblings: bool) -> type[cssselect2.ElementWrapper]:
    """Create a wrapper class that counts classes, ancestors and siblings when selectors look at them.

    With `siblings`, all siblings count wherever a selector may compare their tags.
    """

    def walk(wrapper: Any, step: str) -> Iterator[Any]:
        while (wrapper := getattr(wrapper, step)) is not None:
            tests.spend(cost)
            yield wrapper

    def counted(words: list[str]) -> set[str]:
        tests.spend(len(words))
        return set(words)

    class Wrapper(cssselect2.ElementWrapper):
        classes = cached_property(lambda self: counted(self.etree_element.get("class", "").split()))
        ancestors = property(lambda self: walk(self, "parent"))
        previous_siblings = property(lambda self: walk(self, "previous"))

    class ComparingWrapper(Wrapper):
        @property
        def etree_siblings(self):
            tests.spend(cost * (1 + len(self._siblings) // SIBLINGS))
            return self._siblings

        @etree_siblings.setter
        def etree_siblings(self, elements):
            self._siblings = elements

    return ComparingWrapper if siblings else Wrapper


def _rules(
    content: Any, layers: dict[str, int] | None = None, layer: str = ""
) -> Iterator[tuple[list[Any], css.Style]]:
    """Yield selectors, each as its tokens, with their declarations, also of rules in @layer, @supports and @media.

    Conditions of @supports are taken as true, and a screen without preferences as the medium.

    Args:
        content: text, or tokens.
        layers: numbers of the layers so far, by name.
        layer: the name of the layer around the content.
    """
    layers = {} if layers is None else layers
    number = layers.setdefault(layer, len(layers)) if layer else math.inf
    parse = tinycss2.parse_stylesheet if isinstance(content, str) else tinycss2.parse_rule_list
    for rule in css.parsed(parse, content):
        if rule.type == "qualified-rule":
            style = css.block(rule.content)
            style.layer = number
            yield from ((tokens, style) for tokens in _selectors(rule))
        elif rule.type == "at-rule" and rule.lower_at_keyword in _NESTING:
            prelude = css.serialize(rule.prelude)
            names = [f"{layer}.{name.strip()}".strip(".") for name in prelude.split(",")]
            if rule.content is None:
                for name in names if rule.lower_at_keyword == "layer" else ():
                    layers.setdefault(name, len(layers))
            elif rule.lower_at_keyword == "layer":
                yield from _rules(rule.content, layers, names[0] or f"{layer}.{len(layers)}")
            elif rule.lower_at_keyword == "supports" or prelude.strip().lower() in _SCREENS:
                yield from _rules(rule.content, layers, layer)


def _without_contextual(rules: Sequence[Any]) -> list[Any]:
    """Return rules without selectors that depend on more than the tag, classes and id."""
    remaining, comma = [], tinycss2.ast.LiteralToken(0, 0, ",")
    for rule in rules:
        if rule.type == "qualified-rule":
            parts = [part for part in _selectors(rule) if not _is_contextual(part) or not _compiled(part)]
            rule.prelude = [token for part in parts for token in (comma, *part)][1:]
        elif rule.type == "at-rule" and rule.content is not None and rule.lower_at_keyword in _NESTING:
            rule.content = _without_contextual(css.parsed(tinycss2.parse_rule_list, rule.content))
        if rule.type != "qualified-rule" or rule.prelude:
            remaining.append(rule)
    return remaining


def _selectors(rule: Any) -> list[list[Any]]:
    """Split the selectors of a rule; unlike in CSS, an invalid one does not invalidate the others."""
    selectors: list[list[Any]] = [[]]
    for token in rule.prelude:
        if token == ",":
            selectors.append([])
        elif token.type != "comment" and (selectors[-1] or token.type != "whitespace"):
            selectors[-1].append(token)
    for tokens in selectors:
        while tokens and tokens[-1].type == "whitespace":
            tokens.pop()
    return selectors


def _compiled(tokens: list[Any]) -> Any:
    """Return a compiled selector; None where it is not supported."""
    try:
        if len(css.serialize(tokens)) > limits.SELECTOR_CHARACTERS or not _is_bounded(tokens):
            return None
        (selector,) = cssselect2.compile_selector_list(tokens)
    except (
        Exception
    ):  # of many types, from the library and from the Python code that it compiles selectors to
        return None
    return selector


def _is_contextual(tokens: Sequence[Any]) -> bool:
    """Return whether a selector depends on more than a tag, classes and ids."""
    return any(t.type in ("whitespace", "[] block") or t in _MARKS for t in tokens)


def _attributes(tokens: Sequence[Any]) -> Iterator[str]:
    """Yield the names of attributes, and other identifiers, in the brackets of a selector."""
    for token in tokens:
        if token.type == "[] block":
            yield from (part.value for part in token.content if part.type == "ident")
        elif token.type == "function":
            yield from _attributes(token.arguments)


def _is_bounded(tokens: Sequence[Any]) -> bool:
    """Return whether all pseudo-classes in a selector are supported."""
    for previous, token in pairwise([None, *tokens]):
        if token.type == "function" and token.lower_name in _LOGICAL:
            if not _is_bounded(token.arguments):
                return False
        elif token.type == "function":
            words = (argument.lower_value for argument in token.arguments if argument.type == "ident")
            if token.lower_name not in _COUNTED or "of" in words:
                return False
        elif previous == ":" and (token.type != "ident" or token.lower_value not in _STRUCTURAL):
            return False
    return True


def _cascade(matches: Sequence[Any]) -> css.Style:
    cascaded = css.Style()
    for _specificity, _order, pseudo_element, style in sorted(matches, key=lambda match: match[3].layer):
        if pseudo_element is None:
            cascaded.add(style)
    return cascaded
