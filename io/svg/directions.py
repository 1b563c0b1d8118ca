"""Bidirectional text: split into parts of one direction, in visual order."""

from unicodedata import bidirectional

_LEFTWARD, _NUMBERS = ("R", "AL"), ("EN", "AN")
_BRACKETS = {"(": ")", "[": "]", "{": "}"}
_MARKS = ("NSM",)  # nonspacing marks have the direction of the letter before them


def in_visual_order(text: str, *, leftward: bool = False) -> list[str]:
    """Split a line of text into parts of one direction, from left to right.

    The line starts at the left, or at the right if it is `leftward` (CSS: `direction: rtl`).

    This is Unicode's bidirectional algorithm (UAX 9) without explicit embeddings: neutral characters between letters of
    one direction belong to them, and numbers after right-to-left letters read left to right among these.
    """
    if not any(bidirectional(letter) in _LEFTWARD for letter in text):
        return [text]
    parts: list[str] = []
    directed = _directed(text, _ways(text), leftward)
    for runs_leftward, part in directed[::-1] if leftward else directed:
        parts += _numbers_apart(part)[::-1] if runs_leftward else [part]
    return parts


def _ways(text: str) -> list[str]:
    """Return the direction of each character: L, R, or N for neutral."""
    ways: list[str] = []
    strong = "L"
    for letter in text:
        kind = bidirectional(letter)
        if kind in _MARKS and ways:
            ways.append(ways[-1])
        elif kind == "L" or kind in _LEFTWARD:
            strong = "L" if kind == "L" else "R"
            ways.append(strong)
        else:
            ways.append(strong if kind in _NUMBERS else "N")
    _direct_brackets(text, ways)
    return ways


def _direct_brackets(text: str, ways: list[str]) -> None:
    """Give both brackets of a pair the direction of their content.

    That is left to right if the content has a letter of this direction, else right to left if a letter before the pair
    has that direction, too.
    """
    opened: list[int] = []
    for k, letter in enumerate(text):
        if letter in _BRACKETS:
            opened.append(k)
        elif opened and letter == _BRACKETS[text[opened[-1]]]:
            begin = opened.pop()
            preceding = next((direction for direction in ways[:begin][::-1] if direction != "N"), "L")
            inside = set(ways[begin:k])
            if inside & {"L", "R"}:
                ways[begin] = ways[k] = "L" if "L" in inside else preceding


def _directed(text: str, ways: list[str], base: bool) -> list[tuple[bool, str]]:
    """Return parts of one direction, and whether it is leftward.

    Neutrals have the direction of the letters on both sides if these agree, else that of the line, `base`.
    """
    parts: list[tuple[bool, str]] = []
    k = 0
    while k < len(text):
        end = k
        while end < len(text) and ways[end] == "N":
            end += 1
        if end > k:  # without a direction
            around = {ways[j] == "R" if 0 <= j < len(text) else base for j in (k - 1, end)}
            leftward = around.pop() if len(around) == 1 else base
        else:
            leftward, end = ways[k] == "R", k + 1
        if parts and parts[-1][0] == leftward:
            parts[-1] = leftward, parts[-1][1] + text[k:end]
        else:
            parts.append((leftward, text[k:end]))
        k = end
    return parts


def _numbers_apart(text: str) -> list[str]:
    """Split the numbers off a right-to-left part."""
    parts: list[str] = []
    for k, letter in enumerate(text):
        number = _in_number(text, k)
        if parts and k and _in_number(text, k - 1) == number:
            parts[-1] += letter
        else:
            parts.append(letter)
    return parts


def _in_number(text: str, k: int) -> bool:
    """Return whether a character is a digit, or a separator or sign between two digits."""
    kinds = [bidirectional(text[j]) if 0 <= j < len(text) else "" for j in (k - 1, k, k + 1)]
    return kinds[1] in _NUMBERS or (
        kinds[1] in ("CS", "ES") and kinds[0] in _NUMBERS and kinds[2] in _NUMBERS
    )
