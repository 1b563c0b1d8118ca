"""Frames of a drawing joined into one animated SVG, by SMIL's `animate` or by CSS's `@keyframes`; browsers play both.

The frames have the same elements, and their paths the same commands (`carry_frames`), so players interpolate between
them. An attribute or a property of style that differs between frames is animated: paths and numbers continuously,
anything else in steps.
"""

import base64
import re
from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ...errors import InputError
from ..svg import css
from ..svg.document import root
from ..svg.tree import LINKS
from .element import SVG

COMMANDS = re.compile(r"[A-DF-Za-df-z]")
"""Letters of path data but for the e of numbers like 1e-05."""
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
APPEARS_SHARE = 2 / 3
"""Share of the time after which a drawing that ends an animation begins to appear."""
CSS_SUFFIX = ".css.svg"
"""End of the names of files that are animated by CSS."""
PROPERTIES = frozenset([
    *("d", "fill", "fill-opacity", "fill-rule", "stroke", "stroke-opacity", "stroke-width", "stroke-dasharray"),
    *("stroke-dashoffset", "opacity", "visibility", "display", "clip-path", "clip-rule", "mask", "filter"),
    *("stop-color", "stop-opacity", "flood-color", "flood-opacity", "cx", "cy", "r", "rx", "ry", "x", "y"),
])  # fmt: skip
"""Attributes that are properties of CSS, which `@keyframes` changes."""
FIXED = ("transform", "gradientTransform", "patternTransform")
"""Attributes that `animate` does not change."""


def write(
    frames: Sequence[Path],
    path: Path,
    fps: float,
    *,
    ending: Path | None = None,
    ends_halfway: bool = False,
    by_css: bool = False,
    stepped: bool = False,
) -> tuple[str, ...]:
    """Write an animated SVG that shows frames in a loop.

    Args:
        frames: SVG files with the same elements.
        path: the file to write.
        fps: frames per second.
        ending: a drawing that appears at the end, in which parts are that the frames do not have.
        ends_halfway: whether the frames run back to the first one, so that `ending` is seen in the middle.
        stepped: whether each frame is shown for as long as the others, and nothing moves in between.
        by_css: whether style sheets animate it, which work where SMIL is off; paths then move in Chromium and Firefox.

    Returns:
        Notes on what is not animated.

    Raises:
        InputError: the elements of the frames differ.
    """
    tops = [root(frame.read_bytes()) for frame in frames]
    if len({tuple(element.tag for element in top.iter()) for top in tops}) > 1:
        raise InputError(
            "the frames have different elements; write a file per frame, with {number} in its name"
        )
    steps = max(len(frames) - (not stepped), 1)
    seconds = f"{steps / fps:.9g}s"
    together = zip(*(list(top.iter()) for top in tops))
    keys = [(0.0, 0), (APPEARS_SHARE, 0), (1.0, 1)]
    if ends_halfway:
        keys = [(share / 2, opacity) for share, opacity in keys]
        keys += [(1 - share, opacity) for share, opacity in reversed(keys[:-1])]
    if by_css:
        sheet, counts = list[str](), list[int]()
        for elements in together:
            counts.append(_keyframes(elements, steps, seconds, f"morph-{len(counts)}", sheet))
        still = sum(counts)
        if ending is not None:
            appearing = _appearing(ending)
            appearing.set("class", "morph-end")
            tops[0].append(appearing)
            steps_of_ending = "".join(f"{100 * share:.6g}%{{opacity:{opacity}}}" for share, opacity in keys)
            sheet.append(f"@keyframes morph-end{{{steps_of_ending}}}")
            sheet.append(f".morph-end{{animation:morph-end {seconds} linear infinite}}")
        style = Element(f"{SVG}style")
        style.text = "\n".join(sheet)
        tops[0].insert(0, style)
    else:
        still = sum(_animate(elements, seconds, stepped=stepped) for elements in together)
        if ending is not None:
            appearing = _appearing(ending)
            tops[0].append(appearing)
            times = {
                "values": ";".join(str(opacity) for _, opacity in keys),
                "keyTimes": ";".join(f"{share:.6g}" for share, _ in keys),
                "dur": seconds,
            }
            SubElement(
                appearing, f"{SVG}animate", {"attributeName": "opacity", "repeatCount": "indefinite", **times}
            )
    ElementTree.ElementTree(tops[0]).write(path, encoding="utf-8", xml_declaration=True)
    kind = "attribute that CSS cannot animate" if by_css else "transform of a gradient or pattern"
    return (f"{still} × {kind}, as in the first frame",) if still else ()


def _appearing(drawing: Path) -> Element:
    """Return a drawing, at first invisible, as an embedded picture, so that its names and styles are its own."""
    data = drawing.read_bytes()
    box = root(data).get("viewBox", "").split()
    address = f"data:image/svg+xml;base64,{base64.b64encode(data).decode()}"
    place = dict(zip(("x", "y", "width", "height"), box))
    return Element(f"{SVG}image", {**place, LINKS[1]: address, "opacity": "0"})


def _animate(elements: Sequence[Element], seconds: str, *, stepped: bool) -> int:
    """Animate what differs between an element's forms in all frames, and return how many attributes do not move."""
    still = 0
    for name, over_time in _changing(elements).items():
        if name in FIXED:
            still += 1
            continue
        moving = {"attributeName": name.rpartition("}")[2], "values": ";".join(over_time), "dur": seconds}
        moving["repeatCount"] = "indefinite"
        if stepped or not _continuous(name, over_time):
            moving["calcMode"] = "discrete"
        SubElement(elements[0], f"{SVG}animate", moving)
    return still


def _changing(elements: Sequence[Element]) -> dict[str, list[str]]:
    """Return the values in all frames of the attributes and properties of style that change."""
    names = dict.fromkeys(chain.from_iterable(element.attrib for element in elements))
    styles = [css.declarations(element.get("style", "")) for element in elements]
    values = {name: [element.get(name, "") for element in elements] for name in names if name != "style"}
    for name in dict.fromkeys(chain.from_iterable(styles)):
        values[name] = [style.get(name, "") for style in styles]
    return {name: over_time for name, over_time in values.items() if len(set(over_time)) > 1}


def _keyframes(elements: Sequence[Element], count: int, seconds: str, name: str, sheet: list[str]) -> int:
    """Add rules that animate an element to a style sheet, and return how many of its attributes do not move."""
    changing = _changing(elements)
    moving = {key: values for key, values in changing.items() if key in PROPERTIES}
    animations = []
    stepped = count == len(elements)
    for kind, timing in (("move", "linear"), ("switch", "step-end")):
        of_kind = {k: v for k, v in moving.items() if (not stepped and _continuous(k, v)) == (kind == "move")}
        if not of_kind:
            continue
        animations.append(f"{name}-{kind} {seconds} {timing} infinite")
        steps = []
        for number in range(len(elements)):
            values = ";".join(f"{k}:{_as_css(k, over_time[number])}" for k, over_time in of_kind.items())
            steps.append(f"{100 * number / count:.6g}%{{{values}}}")
        sheet.append(f"@keyframes {name}-{kind}{{{''.join(steps)}}}")
    if animations:
        elements[0].set("class", f"{elements[0].get('class', '')} {name}".strip())
        sheet.append(f".{name}{{animation:{','.join(animations)}}}")
    return len(changing) - len(moving)


def _as_css(name: str, value: str) -> str:
    """Return the value of an attribute as that of the property of CSS."""
    return f'path("{value}")' if name == "d" else value or "initial"


def _continuous(name: str, over_time: Sequence[str]) -> bool:
    """Return whether values can be interpolated: paths with the same commands, or numbers."""
    if name == "d":
        return len({"".join(COMMANDS.findall(value)) for value in over_time}) == 1
    return all(NUMBER.fullmatch(value) for value in over_time)
