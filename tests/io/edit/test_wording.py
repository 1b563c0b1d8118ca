"""Messages on the page of `iccm edit`: what only the command line and Python have is not in them."""

import re
from pathlib import Path

import numpy as np
import pytest

from iccm.balanced.fit import exact_pin_note, rotation_notes, soft_pin_notes
from iccm.io.edit import wording
from iccm.io.edit.map_update import verdict
from iccm.io.edit.wording import message_on_page, on_page
from iccm.io.shapes.silhouette import INSIDE, PHOTOGRAPH
from iccm.maps.triangulated.map import TriangulatedMap
from iccm.status import Status

OPTION = re.compile(r"--[a-z]|#\w|\([a-z]+[_.][a-z]+")
SQUARE = np.array([0, 2, 2 + 1j, 1j])
PAGE = Path(wording.__file__).parent / "page" / "index.html"


@pytest.mark.parametrize(
    ("message", "kept"),
    [
        (INSIDE, "the inside of the line is used"),
        (PHOTOGRAPH, "no plain background (choose another part under Files)"),
        ("the file exists; use --force to replace it", "the file exists"),
        (
            "--size: 9x9 exceeds the limit of 8 pixels; raise --max-pixels",
            "9x9 exceeds the limit of 8 pixels",
        ),
        (
            "it has 9 curves; simplify it (Inkscape: Path > Simplify), or raise --max-segments",
            "it has 9 curves; simplify it (Inkscape: Path > Simplify)",
        ),
        (
            "rendering is slow; simplify it, or use --texture checker, or --texture with a picture of it",
            "rendering is slow; simplify it",
        ),
        (
            "ignored 2 other outlines, the largest with 1.5% of this one's area; #id or #2 selects another",
            "1.5% of this one's area; choose another part under Files",
        ),
        (
            "cat.svg: its 3 parts are mapped separately (use --parts joined to map them together)",
            "3 parts are mapped separately (choose Frames under Fit to map them together)",
        ),
        ("materials have different textures; choose one with --texture", "; choose a texture under Files"),
        (exact_pin_note([2]), "Pin 3 is met exactly"),
        (rotation_notes(0.5, 0.0)[0], "because of the shapes or the constraints (Rotation)."),
        (
            "Pins are soft; exact pins meet their places (exact_pins).",
            "exact pins meet their places (Exactly here).",
        ),
        *[(status.value, status.value[:20]) for status in Status],
    ],
)
def test_messages_name_no_options(message, kept):
    """What is wrong stays, and what to do is said with the controls of the page."""
    text = on_page(message)
    assert not OPTION.search(text) and kept in text and text.count("(") == text.count(")")


def test_notes_on_pins_are_understood_without_the_words_of_constraints_files():
    """They name the control that changes what they are about."""
    map = TriangulatedMap(SQUARE, SQUARE, np.array([[0, 1, 2], [0, 2, 3]]), (np.arange(4),))
    (missed,) = soft_pin_notes(map, np.array([[0.5 + 0.5j, 0.5 + 0.9j]]))
    for note in (missed, exact_pin_note([0]), exact_pin_note([1, 2])):
        text = on_page(note)
        assert not re.search("soft|tolerance", text, re.IGNORECASE) and "miss" in text
    assert all(name in PAGE.read_text(encoding="utf-8") for name in re.findall("“(.*?)”", on_page(missed)))
    assert "“May miss its place by”" in on_page(missed)


def test_the_page_has_no_words_of_constraints_files():
    """Explanations that are shown on request may name the field of the file."""
    texts = re.sub("<[^>]*>", " ", PAGE.read_text(encoding="utf-8"))
    assert not re.search("soft|nail|tolerance", texts, re.IGNORECASE)


def test_a_picture_that_was_changed_by_hand_is_not_called_a_good_fit():
    """The same figures, with and without pins."""
    report = {"injective": {"certified": True}, "stretch": {"p95": 1.1}}
    given, pinned = (
        verdict(Status.DECREASE, report, deformed=False, constrained=is_pinned) for is_pinned in (False, True)
    )
    assert given.startswith("Good fit") and "Good" not in pinned
    for sentence in (given, pinned):
        assert "nothing folds" in sentence and "nearly uniform" in sentence


def test_controls_that_messages_name_are_on_the_page():
    """The words are those that users read there."""
    page = PAGE.read_text(encoding="utf-8")
    assert all(control in page for control in wording.CONTROLS.values())
    assert all(word in page for cure in wording.CURES.values() for word in re.findall("[A-Z][a-z]+", cure))


def test_notes_beside_figures_are_translated_and_commands_are_not():
    """The command line on the page is for the shell."""
    message = {
        "notes": ["a (fit)."],
        "figures": {"notes": ["b (turn)."], "turn": 3},
        "command": "iccm --fit auto",
    }
    assert message_on_page(message) == {
        "notes": ["a (Fit)."],
        "figures": {"notes": ["b (Rotation)."], "turn": 3},
        "command": "iccm --fit auto",
    }
