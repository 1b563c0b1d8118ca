"""Clip paths, masks and views: shapes are reduced to what these leave visible."""

import math

import numpy as np
import pytest
import shapely

from iccm import InputError
from iccm.arrays import xy_of
from iccm.io.shapes import shape as shapes
from iccm.io.svg import reader

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'
BLOCK = '<rect width="40" height="40"/>'
DISC = '<clipPath id="c"><circle cx="20" cy="20" r="10"/></clipPath>'


@pytest.fixture
def svg(tmp_path):
    def read(body, chosen=""):
        (tmp_path / "a.svg").write_text(SVG.format(body))
        return shapes.read(f"{tmp_path}/a.svg{chosen}")

    return read


def area(shape):
    """The shape's area without its holes."""
    return shapely.Polygon(xy_of(shape.curve.z), [xy_of(hole) for hole in shape.holes]).area


def mask(content, attributes=""):
    return f'<mask id="c" {attributes}>{content}</mask><g mask="url(#c)">{BLOCK}</g>'


WHITE = '<path fill="#fff" d="M10 10h20v10H10z"/>'
LEFT = [  # what is drawn, and what part of it is visible
    (DISC + '<rect width="40" height="40" clip-path="url(#c)"/>', 100 * math.pi),
    (DISC + f'<g style="clip-path: url(&quot;#c&quot;)">{BLOCK}</g>', 100 * math.pi),
    (DISC + f'<g transform="scale(2 1)"><g clip-path="url(#c)">{BLOCK}</g></g>', 200 * math.pi),
    (DISC.replace('id="c"', 'id="c" transform="scale(.5)"')
     + f'<g clip-path="url(#c)">{BLOCK}</g>', 25 * math.pi),
    (DISC + f'<g clip-path="url(#c)"><g clip-path="url(#c)" transform="translate(10)">{BLOCK}</g></g>',
     100 * (2 * math.pi / 3 - math.sqrt(3) / 2)),
    ('<clipPath id="d"><path d="M0 0h9v9H0z"/></clipPath>'
     f'<clipPath id="c" clip-path="url(#d)"><path d="M4 4h9v9H4z"/></clipPath><g clip-path="url(#c)">{BLOCK}</g>', 25),
    ('<clipPath id="c"><path clip-rule="evenodd" d="M0 0h30v30H0zM10 10h10v10H10z"/></clipPath>'
     f'<g clip-path="url(#c)">{BLOCK}</g>', 800),
    ('<clipPath id="c"><path fill="none" d="M0 0h9v9H0z"/><path d="M5 5h9v9H5z"/></clipPath>'
     f'<g clip-path="url(#c)">{BLOCK}</g>', 162 - 16),
    (f'<defs><g id="b">{BLOCK}</g><clipPath id="c"><use href="#s"/></clipPath><path id="s" d="M0 0h9v9H0z"/></defs>'
     '<use href="#b" x="50" clip-path="url(#c)"/><use href="#b" y="5" clip-path="url(#c)"/>', 81),
    ('<clipPath id="c"><g><path d="M0 0h30v30H0z"/></g><path d="M0 0h9v9H0z"/></clipPath>'
     f'<g clip-path="url(#c)">{BLOCK}</g>', 81),  # groups do not clip
    (f'<g clip-path="circle(10px)">{BLOCK}</g>', 100 * math.pi),
    (f'<g style="clip-path:circle(25% at 50% 50%)">{BLOCK}</g>', 100 * math.pi),
    (f'<g style="clip-path:ellipse(10px 25% at left 20px bottom 20px)">{BLOCK}</g>', 100 * math.pi),
    (f'<g style="clip-path:inset(5px 10px 15px)">{BLOCK}</g>', 20 * 20),
    (f'<g style="clip-path:inset(0 round 10px)">{BLOCK}</g>', 1600 - (4 - math.pi) * 100),
    (f'<g style="clip-path:polygon(evenodd, 0 0, 50% 0, 50% 100%, 0 100%)">{BLOCK}</g>', 800),
    (f'<g style="clip-path:xywh(10px 10px 20px 25%)">{BLOCK}</g>', 200),
    (f'<g style="clip-path:rect(10px 30px auto auto)">{BLOCK}</g>', 900),
    ('<rect x="10" y="10" width="40" height="40" style="clip-path:path(&quot;M0 0h9v9h-9z&quot;)"/>', 81),
    ('<rect x="10" width="40" height="40" style="clip-path:circle(10px at 10px 20px) view-box"/>',
     50 * math.pi),
    (mask(WHITE), 200),
    (mask(WHITE + '<path fill="black" d="M12 12h4v4h-4z"/>'), 184),
    (mask(WHITE + '<path fill="black" d="M12 12h4v4h-4z"/>', 'style="mask-type:alpha"'), 200),
    (mask('<path fill="none" stroke="white" stroke-width="2" d="M10 10H30"/>'), 40),
    (mask('<path d="M10 10h20v10H10z"/>', 'fill="white"'), 200),
    ('<svg x="10" y="10" width="20" height="20" viewBox="0 0 10 10"><circle cx="0" cy="0" r="5"/></svg>', 25 * math.pi),
    ('<svg x="10" y="10" width="20" height="20" viewBox="0 0 10 10" overflow="visible"><circle r="5"/></svg>',
     100 * math.pi),
    ('<symbol id="s" viewBox="0 0 10 10"><circle r="5"/></symbol><use href="#s" width="20" height="20"/>',
     25 * math.pi),
]  # fmt: skip


@pytest.mark.parametrize(("body", "left"), LEFT)
def test_a_shape_is_reduced_by_its_clips_and_masks(svg, body, left):
    for chosen in ("", "#silhouette"):
        shape = svg(body, chosen)
        assert area(shape) == pytest.approx(left, rel=1e-3)
        assert not any("ignored" in note and "other outline" not in note for note in shape.notes)


def test_clips_that_hide_nothing_change_nothing(svg):
    free = svg('<circle cx="20" cy="20" r="9.99"/>')
    kept = svg(DISC + '<circle cx="20" cy="20" r="9.99" clip-path="url(#c)"/>')
    assert np.array_equal(free.curve.z, kept.curve.z) and not kept.notes


def test_lines_are_cut_too(svg):
    line = '<path d="M0 20H40" fill="none" stroke="red" stroke-width="4"/>'
    assert svg(f'{DISC}<g clip-path="url(#c)">{line}</g>').curve.area == pytest.approx(4 * 20, rel=0.01)


def test_a_clip_may_part_a_shape_or_hide_it(svg):
    two = '<clipPath id="c"><path d="M0 0h9v9H0zM20 0h5v9h-5z"/></clipPath>'
    shape = svg(f'{two}<g clip-path="url(#c)">{BLOCK}</g>')
    assert shape.curve.area == 81 and "ignored 1 other outline" in shape.notes[0]
    with pytest.raises(InputError, match="contains no outline"):
        svg(f'<clipPath id="c"/><g clip-path="url(#c)">{BLOCK}</g>')


@pytest.mark.parametrize(
    "wrong",
    [
        f'<g clip-path="url(#nowhere)">{BLOCK}</g>',
        f'<g clip-path="circle(10furlongs)">{BLOCK}</g>',
        f'<clipPath id="c" clipPathUnits="objectBoundingBox"/><g clip-path="url(#c)">{BLOCK}</g>',
        f'<clipPath id="c"><text>a</text></clipPath><g clip-path="url(#c)">{BLOCK}</g>',
        f'<path id="c" d="M0 0h1v1z"/><g clip-path="url(#c)">{BLOCK}</g>',
    ],
)  # fmt: skip
def test_unsupported_clips_get_a_note(svg, wrong):
    for chosen, message in (
        ("", "its clip-path is ignored"),
        ("#silhouette", "clip-path of 1 shape ignored"),
    ):
        shape = svg(wrong, chosen)
        assert shape.curve.area == 1600 and message in shape.notes[0]


def test_a_clip_path_of_itself_ends(svg):
    definition = f'<clipPath id="c" clip-path="url(#c)">{BLOCK}</clipPath><g clip-path="url(#c)">{BLOCK}</g>'
    assert svg(definition).curve.area == 1600


def test_clip_paths_are_counted(svg, tmp_path, monkeypatch):
    chain = "".join(f'<clipPath id="c{k}" clip-path="url(#c{k + 1})">{BLOCK}</clipPath>' for k in range(60))
    with pytest.raises(InputError, match="refer to each other more than 40 deep"):
        svg(f'{chain}<g clip-path="url(#c0)">{BLOCK}</g>')
    many = f'<clipPath id="c">{BLOCK * 99}</clipPath>'
    moved = (f'<g transform="translate({k})" clip-path="url(#c)">{BLOCK}</g>' for k in range(600))
    with pytest.raises(InputError, match="more than 50000 elements"):
        svg(many + "".join(moved))
    teeth = 300
    comb = "M0 0" + "".join(f"V30H{k + 0.5}V0H{k + 1}" for k in range(teeth)) + "V-1H0z"
    crossed = (
        f'<clipPath id="c"><path transform="matrix(0 .2 .2 0 0 0)" d="{comb}"/></clipPath>'
        f'<path transform="scale(.2)" d="{comb}" clip-path="url(#d)"/>'
    )
    (tmp_path / "b.svg").write_text(SVG.format(crossed.replace("#d", "#c")))
    monkeypatch.setattr("iccm.io.limits.CROSSINGS", 1000)
    (refused,) = reader.read(tmp_path / "b.svg").refused
    assert "cross each other too often" in str(refused[1])
    monkeypatch.setattr("iccm.io.limits.CUT_POINTS", 1000)
    with pytest.raises(InputError, match="clip paths and masks cut too many shapes"):
        svg(DISC + f'<g clip-path="url(#c)">{BLOCK * 20}</g>')
