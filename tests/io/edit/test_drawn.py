"""Pins drawn into copies of SVG files: all other bytes are kept."""

import pytest

from iccm.errors import InputError
from iccm.io.edit import drawn
from iccm.io.shapes import shape

HEAD = '<?xml version="1.0"?>\n<!-- > pin-x --><svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">'
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
OUTLINE = '<path id="o" d="M10 10H90V90H10Z"/>'
PINS = [("nose", (20.5, 30.25)), ("é & <\"'", (70, 70.125))]
STROKES = [("arm", [(30, 40), (50, 45), (60, 40)])]


def copied(tmp_path, body, pins=PINS, strokes=STROKES, part="", head=HEAD):
    (tmp_path / "a.svg").write_text(f"{head}{body}</svg>\n", encoding="utf-8")
    like = shape.read(f"{tmp_path / 'a.svg'}{part}")
    (tmp_path / "b.svg").write_bytes(drawn.copy_with(like, pins, strokes))
    drawn.check(f"{tmp_path / 'b.svg'}{part}", like, pins, strokes)
    return (tmp_path / "b.svg").read_text(encoding="utf-8"), shape.read(f"{tmp_path / 'b.svg'}{part}")


def test_what_is_drawn_is_read_again(tmp_path):
    text, read = copied(tmp_path, OUTLINE)
    assert read.pins == {"pin-nose": 20.5 - 30.25j, "pin-é & <\"'": 70 - 70.125j}
    assert list(read.strokes["stroke-arm"].z) == [30 - 40j, 50 - 45j, 60 - 40j]
    assert text.startswith(HEAD + OUTLINE) and text.endswith("</svg>\n")


@pytest.mark.parametrize(
    "old",
    [
        '<circle id="pin-a" cx="1" cy="1" r="1"/>',
        '<circle id="pin-a" cx="1" cy="1" r="1"></circle>',
        '<circle id="pin-a" cx="1" cy="1" r="1" data-x=">"  ><title>x &gt; y</title></circle  >',
        f'<ellipse xmlns:inkscape="{INKSCAPE}" id="e7" inkscape:label="pin-a" rx="1" ry="2"/>',
        '<path id="stroke-a" d="M20 20L40 40"/>',
    ],
)
@pytest.mark.parametrize("between", ["{}", "<g>{}</g>", "<!-- a -->{}<!-- b -->", "{}<?pi?>", "{}\n  "])
def test_those_that_were_there_go_and_nothing_else(tmp_path, old, between):
    text, read = copied(tmp_path, OUTLINE + between.format(old))
    assert len(read.pins) == 2 and len(read.strokes) == 1
    assert text.startswith(HEAD + OUTLINE + between.format("") + "<circle")


def test_without_any_only_the_old_ones_go(tmp_path):
    text, read = copied(tmp_path, OUTLINE + '<circle id="pin-a" cx="1" cy="1" r="1"/>', [], [])
    assert not read.pins and "circle" not in text and not read.strokes


def test_parts_and_prefixes_stay(tmp_path):
    body = '<s:svg xmlns:s="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><s:path id="o" d="M10 10H90V90H10Z"/>'
    body += '<s:circle id="pin-a" cx="1" cy="1" r="1"/><s:rect id="p" x="40" y="40" width="20" height="20"/></s:svg>'
    (tmp_path / "a.svg").write_text(body)
    like = shape.read(f"{tmp_path / 'a.svg'}#p")
    (tmp_path / "b.svg").write_bytes(drawn.copy_with(like, PINS, STROKES))
    drawn.check(f"{tmp_path / 'b.svg'}#p", like, PINS, STROKES)
    assert shape.read(f"{tmp_path / 'b.svg'}#p").curve.area == pytest.approx(400)


def test_a_drawing_whose_root_is_transformed_is_refused_or_right(tmp_path):
    head = HEAD.replace("viewBox", 'transform="translate(5 5)" viewBox')
    try:
        _, read = copied(tmp_path, OUTLINE, head=head)
    except InputError as error:
        assert "as JSON" in str(error)
    else:
        assert read.pins["pin-nose"] == pytest.approx(20.5 - 30.25j)


def test_a_drawing_in_sixteen_bits_is_refused(tmp_path):
    (tmp_path / "a.svg").write_text(f"{HEAD[21:]}{OUTLINE}</svg>", encoding="utf-16")
    with pytest.raises(InputError, match="UTF-8"):
        drawn.copy_with(shape.read(str(tmp_path / "a.svg")), PINS, STROKES)
