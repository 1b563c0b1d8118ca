"""Frames of a drawing joined into one animated SVG, by SMIL's `animate`, which browsers play.

The frames have the same elements, and their paths the same commands (`carry_frames`), so players interpolate between
them. An attribute or a property of style that differs between frames is animated: paths and numbers continuously,
anything else in steps.
"""

import re
from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ...errors import InputError
from ..svg import css
from ..svg.document import root
from .element import SVG

COMMANDS = re.compile(r"[A-DF-Za-df-z]")
"""Letters of path data but for the e of numbers like 1e-05."""
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
FIXED = ("transform", "gradientTransform", "patternTransform")
"""Attributes that `animate` does not change."""


def write(frames: Sequence[Path], path: Path, fps: float) -> tuple[str, ...]:
    """Write an animated SVG that shows frames in a loop.

    Args:
        frames: SVG files with the same elements.
        path: the file to write.
        fps: frames per second.

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
    seconds = f"{max(len(frames) - 1, 1) / fps:.9g}s"
    still = sum(_animate(elements, seconds) for elements in zip(*(list(top.iter()) for top in tops)))
    ElementTree.ElementTree(tops[0]).write(path, encoding="utf-8", xml_declaration=True)
    return (f"{still} × transform of a gradient or pattern, as in the first frame",) if still else ()


def _animate(elements: Sequence[Element], seconds: str) -> int:
    """Animate what differs between an element's forms in all frames, and return how many attributes do not move."""
    still = 0
    names = dict.fromkeys(chain.from_iterable(element.attrib for element in elements))
    styles = [css.declarations(element.get("style", "")) for element in elements]
    values = {name: [element.get(name, "") for element in elements] for name in names if name != "style"}
    for name in dict.fromkeys(chain.from_iterable(styles)):
        values[name] = [style.get(name, "") for style in styles]
    for name, over_time in values.items():
        if len(set(over_time)) == 1:
            continue
        if name in FIXED:
            still += 1
            continue
        moving = {"attributeName": name.rpartition("}")[2], "values": ";".join(over_time), "dur": seconds}
        moving["repeatCount"] = "indefinite"
        if not _continuous(name, over_time):
            moving["calcMode"] = "discrete"
        SubElement(elements[0], f"{SVG}animate", moving)
    return still


def _continuous(name: str, over_time: Sequence[str]) -> bool:
    """Return whether values can be interpolated: paths with the same commands, or numbers."""
    if name == "d":
        return len({"".join(COMMANDS.findall(value)) for value in over_time}) == 1
    return all(NUMBER.fullmatch(value) for value in over_time)
