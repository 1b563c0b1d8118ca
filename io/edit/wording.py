"""Messages of iccm in the words of the page, which has controls instead of options."""

from __future__ import annotations

import re
from typing import Any

from .workspace import without_folders

SENTENCES = ("message", "error", "notes")  # fields of messages that contain text for the user
CONTROLS = {"exact_pins": "Exactly here", "fit": "Fit", "radius": "Keeps its form within", "turn": "Rotation"}
"""What the page calls an option that a note names in parentheses; names of other options are left out."""
CURES = {
    "--parts joined": "choose Frames under Fit to map them together",
    "--texture": "choose a texture under Files",
    "#": "choose another part under Files",
}
"""What users of the page can do where a message recommends an option, or a part of a file; other recommendations of
options are left out.
"""
PLAIN_WORDS = {
    " (10,20:30,40,tolerance=2)": "",
    "Soft pins miss": "Pins miss",
    "give them a smaller tolerance to come closer": "enter less under “May miss its place by” to come closer",
    "as a soft pin it": "it otherwise",
    "as soft pins some": "some otherwise",
}
"""Terms of constraints files, and what users of the page understand without having read about them."""

_SUBJECT = re.compile(r"^--[a-z][a-z-]*(?: [a-z]+)?: ")
_FOLDER = re.compile(r"^(?:[A-Za-z]:)?[\\/](?:[^:]*[\\/])?(?=[^\\/:]+: )")
_NAMES = re.compile(r" \(([a-z_.]+(?:, [a-z_.]+)*)\)(?=[.;:,]|$)")
_ALTERNATIVE = re.compile(r",? or [^;,()]*--[a-z][^;,()]*")
_CURE = re.compile(r"(; | \()([^;()]*(?:--[a-z]|#[a-z0-9])[^;()]*?)(\)|(?=\.?$|;))")


def on_page(text: str) -> str:
    """Return a message without what only the command line and Python have.

    >>> on_page("The picture is rotated by 40 degrees instead of 0, because of the shapes (turn).")
    'The picture is rotated by 40 degrees instead of 0, because of the shapes (Rotation).'
    >>> on_page("a.obj: has 9 faces, more than the limit of 8; raise --max-faces")
    'a.obj: has 9 faces, more than the limit of 8'
    >>> on_page("/home/ann/my cards/heart.svg: pin 2: (20, 20) is 8 outside the shape; move it inside")
    'heart.svg: pin 2: (20, 20) is 8 outside the shape; move it inside'
    """
    for term, plain in PLAIN_WORDS.items():
        text = text.replace(term, plain)
    text = _SUBJECT.sub("", _FOLDER.sub("", without_folders(text)))
    text = _CURE.sub(_cure, _ALTERNATIVE.sub("", text))
    return _NAMES.sub(_control, text)


def message_on_page(message: dict[str, Any]) -> dict[str, Any]:
    """Return a message to the page with its texts in the words of the page."""
    texts = {name: _all_on_page(message[name]) for name in SENTENCES if name in message}
    if "notes" in message.get("figures", {}):
        texts["figures"] = message["figures"] | {"notes": _all_on_page(message["figures"]["notes"])}
    return message | texts


def _all_on_page(texts: str | list[str]) -> str | list[str]:
    return on_page(texts) if isinstance(texts, str) else [on_page(text) for text in texts]


def _control(names: re.Match[str]) -> str:
    """Return the page's controls for names of options in parentheses."""
    controls = [CONTROLS[name] for name in names[1].split(", ") if name in CONTROLS]
    return f" ({', '.join(controls)})" if controls else ""


def _cure(recommendation: re.Match[str]) -> str:
    """Return what the page's users can do instead of what a message recommends."""
    opening, text, closing = recommendation.groups()
    cure = next((cure for option, cure in CURES.items() if option in text), "")
    return f"{opening}{cure}{closing}" if cure else ""
