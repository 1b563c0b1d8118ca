"""Messages, help, docstrings and comments do not use the words of `AVOIDED`."""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

from .test_pages import TERMS, uses

ROOT = Path(__file__).parents[1]
FILES = [
    path
    for folder in ("iccm", "io", "cli", "extensions", "plugins")
    for path in sorted((ROOT / folder).rglob("*.py"))
]
PAGE = ROOT / "io" / "edit" / "page"
SCRIPTS = [ROOT / "io" / "page.html", PAGE / "index.html", *sorted(PAGE.glob("*.js"))]
SCRIPTS.remove(PAGE / "shaders.js")  # only programs for the graphics card
NAME = re.compile(r"^\s*(?:\w+, )*\w+(?::|  )", re.MULTILINE)
"""A name that a docstring describes: an argument, an attribute, a module."""
NAMES_OF_CODE = re.compile(r"\b\w*_\w+\b|\w+\(|\b\w+(?:\.\w+)+")


def prose(text):
    """Text without names of code."""
    return NAMES_OF_CODE.sub(" ", NAME.sub(" ", text))


def strings(source):
    """Messages and docstrings with their lines: strings of several words."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value.strip():
            yield node.lineno, node.value


def comments(source):
    """Comments with their lines; adjacent ones are joined, so that a term may span lines."""
    texts, last = [], 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            text = token.string.lstrip("# ")
            if texts and token.start[0] == last + 1:
                texts[-1] = (texts[-1][0], f"{texts[-1][1]} {text}")
            else:
                texts.append((token.start[0], text))
            last = token.start[0]
    return texts


def avoidable(source):
    """Terms not to be used, with their lines."""
    texts = [*strings(source), *comments(source)]
    return {(line, term) for line, text in texts for term in uses(" ".join(prose(text).split()), TERMS)}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_module_does_not_use_terms_to_avoid(path):
    terms = avoidable(path.read_text(encoding="utf-8"))
    assert not terms, "AVOIDED in tests/test_pages.py has other words: " + ", ".join(
        f"line {line}: {term}" for line, term in sorted(terms)
    )


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.name)
def test_the_pages_of_iccm_do_not_use_terms_to_avoid(path):
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".html":
        matches = re.findall(r">([^<>{}]+)<|(?:title|aria-label)=\"([^\"]+)\"", text.partition("<script>")[0])
    else:
        matches = re.findall(r"'([^'\n]* [^'\n]*)'|`([^`]* [^`]*)`", re.sub(r"(?s:/\*.*?\*/)|//.*", "", text))
    assert not uses(" . ".join(" ".join(words) for words in matches), TERMS)


def test_terms_to_avoid_are_found_in_code():
    source = '"""A map that goes\non."""\nraise ValueError(f"{x} is no mesh")  # a kink\nbay = told("bay")\n'
    assert {term for _, term in avoidable(source)} == {"goes on", "is no", "kink"}
    assert not avoidable('"""Fill.\n\nArgs:\n    bays: the concavities, see `bays` and `holes.bays`.\n"""\n')
