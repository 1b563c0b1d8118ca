"""SVG to outlines: geometry compared with formulas, selection, and what must be rejected in one line."""

import math
from contextlib import suppress
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from iccm import InputError
from iccm.io.shapes import shape as shapes
from iccm.io.svg import affine, reader
from tests.cases import some_fast

SVG = '<svg xmlns="http://www.w3.org/2000/svg" {}>{}</svg>'


@pytest.fixture
def svg(tmp_path):
    """Write an SVG body and read it as a shape."""

    def read(body, attributes='viewBox="0 0 100 100"', chosen="", **options):
        path = tmp_path / "a.svg"
        path.write_text(SVG.format(attributes, body))
        return shapes.read(f"{path}{chosen}", **options)

    return read


def vertices(shape):
    """Vertices in file units, rounded, in any order."""
    return {tuple(p) for p in shape.to_file(shape.curve.z).round(6) + 0.0}


def one_line(call, *words):
    with pytest.raises(InputError) as caught:
        call()
    message = str(caught.value)
    assert "\n" not in message and len(message) < 600
    for word in words:
        assert word in message, message


SQUARE = {(10, 20), (40, 20), (40, 60), (10, 60)}


@pytest.mark.parametrize(
    "body",
    [
        '<path d="M10 20L40 20L40 60L10 60Z"/>',
        '<path d="M10,20 40,20 40,60 10,60z"/>',
        '<path d="m10-0.5e1m0 25h30v40h-30z"/>',
        '<path d="M1.e1 20.L40. +20,40 6e1 10 60."/>',
        '<path d="M10 20A0 5 0 0 1 40 20V60H10"/>',
        '<path d="M10 20H40V60H10Z"/>',
        '<path d="M10 20H40V60H10"/>',
        '<path d="M 10 20 l 30 0 0 40 -30 0 0 -40"/>',
        '<path d="M10 20L10 60L40 60L40 20Z"/>',
        '<rect x="10" y="20" width="30" height="40"/>',
        '<polygon points="10,20 40,20 40,60 10,60"/>',
        '<polyline points="10 20 40 20 40 60 10 60"/>',
        '<polygon points="10,20,40,20,40,20,40,60,10,60,10,20"/>',
        '<g transform="translate(10 20)"><rect width="30" height="40"/></g>',
        '<rect width="3" height="4" transform="translate(10,20) scale(10)"/>',
        '<rect width="40" height="30" transform="matrix(0 1 1 0 10 20)"/>',
        '<rect width="40" height="30" transform="translate(40 20)rotate(90)"/>',
        '<rect x="10" y="20" width="30" height="40" transform="rotate(180 25 40)"/>',
        '<rect style="transform:translate(10px, 20px);width:30px;height:40px"/>',
        '<rect x="10" y="20" width="30" height="40" transform="rotate(180)" transform-origin="25 40"/>',
        '<defs><rect id="r" width="30" height="40"/></defs><use href="#r" x="10" y="20"/>',
        '<defs><g id="r"><path d="M0 0h30v40h-30z"/></g></defs>'
        '<use xmlns:xlink="http://www.w3.org/1999/xlink" xlink:href="#r" transform="translate(10 20)"/>',
        '<symbol id="s" viewBox="0 0 3 4"><rect width="3" height="4"/></symbol>'
        '<use href="#s" x="10" y="20" width="30" height="40"/>',
        '<svg x="10" y="20" width="30" height="80" viewBox="0 0 3 4" preserveAspectRatio="xMinYMin">'
        '<rect width="3" height="4"/></svg>',
        '<svg x="10" y="0" width="30" height="80" viewBox="5 6 3 4"><rect x="5" y="6" width="3" height="4"/></svg>',
        '<svg x="10" y="20" width="30" height="40" viewBox="0 0 1 1" preserveAspectRatio="none">'
        '<rect width="1" height="1"/></svg>',
        '<rect x="10%" y="20%" width="30%" height="40%"/>',
        '<style>.k { x: 10px; y: 20px } rect { width: 30px } #q{height:40px}</style><rect class="j k" id="q"/>',
    ],
)
def test_one_rectangle_in_many_forms(svg, body):
    shape = svg(body)
    assert vertices(shape) == SQUARE
    assert shape.curve.area == pytest.approx(1200)


def test_the_core_plane_is_the_roots_user_units_with_y_up(svg):
    shape = svg(
        '<rect x="10" y="20" width="30" height="40"/>', 'width="10cm" height="50mm" viewBox="-5 -6 200 100"'
    )
    assert vertices(shape) == SQUARE
    assert shape.box == (-5 - 94j, 195 + 6j)
    assert shape.curve.box == (10 - 60j, 40 - 20j)


def test_the_canvas_without_a_view_box(svg):
    rectangle = '<rect x="10" y="20" width="30" height="40"/>'
    assert svg(rectangle, 'width="2in" height="96"').box == (-96j, 192 + 0j)
    assert svg(rectangle, "").box == svg(rectangle, 'width="100%"').box == (10 - 60j, 40 - 20j)


@pytest.mark.parametrize(
    "text, value",
    [("3", 3), ("1in", 96), ("2.54cm", 96), ("25.4mm", 96), ("72pt", 96), ("6pc", 96), ("1e1px", 10)],
)
def test_units(svg, text, value):
    assert svg(f'<rect width="{text}" height="1"/>').curve.box[1].real == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("flatness", [1e-3, 1e-4, 1e-6])
@pytest.mark.parametrize(
    "body",
    [
        '<circle cx="50" cy="40" r="20"/>',
        '<ellipse cx="50" cy="40" rx="20" ry="20"/>',
        '<ellipse cx="50" cy="40" rx="20"/>',
        '<rect x="30" y="20" width="40" height="40" rx="20"/>',
        '<path d="M70 40A20 20 0 1 1 30 40 20 20 0 0170 40z"/>',
        '<circle cx="5" cy="8" r="2" transform="translate(0,-40) scale(10)"/>',
        '<ellipse cx="5" cy="8" rx="1" ry="2" transform="scale(20 10) translate(-2.5 -4)"/>',
    ],
)
def test_a_circle_is_within_the_stated_tolerance(svg, body, flatness):
    shape = svg(body, flatness=flatness)
    radius = abs(shape.curve.z - (50 - 40j))
    middle = abs(shape.curve.sample(1) - (50 - 40j))
    assert np.allclose(radius, 20, rtol=1e-7)
    assert 20 - middle.min() <= flatness * 40 * math.sqrt(2)
    assert 20 - middle.min() >= flatness * 5  # and not finer than requested


def bezier(points, t):
    while len(points) > 1:
        points = [a * (1 - t) + b * t for a, b in pairwise(points)]
    return points[0]


def test_every_kind_of_curve_is_within_the_stated_tolerance(svg):
    shape = svg('<path d="M0 0C0 40 30 50 50 20S80 0 90 30q0 60-40 50t-50-20z"/>', flatness=1e-4)
    t = np.linspace(0, 1, 400)
    p, q, r, s, u = 0, 50 + 20j, 90 + 30j, 50 + 80j, 60j
    curves = [
        bezier([p, 40j, 30 + 50j, q], t),
        bezier([q, 2 * q - (30 + 50j), 80, r], t),
        bezier([r, 90 + 90j, s], t),
        bezier([s, 2 * s - (90 + 90j), u], t),
        bezier([u, p], t),
    ]
    z = np.concatenate(curves).conj()
    nearest = shape.curve.nearest(z)
    assert abs(nearest - z).max() <= 1e-4 * shape.curve.diagonal
    for corner in (p, q, r, s, u):
        assert abs(shape.curve.z - np.conj(corner)).min() < 1e-12


numbers = st.floats(-50, 50, allow_nan=False).map(lambda x: round(x, 4))
pairs = st.tuples(numbers, numbers)
transforms = st.one_of(
    pairs.map(lambda p: "translate({} {})".format(*p)),
    pairs.map(lambda p: "scale({},{})".format(*p)),
    st.tuples(numbers, numbers, numbers).map(lambda p: "rotate({} {} {})".format(*p)),
    numbers.map(lambda x: f"skewX({x})"),
    numbers.map(lambda x: f" skewY( {x} ) "),
    st.tuples(*[numbers] * 6).map(lambda p: "matrix({},{},{} {} {} {})".format(*p)),
)


def matrix(text):
    """The matrix of a transform function by SVG's specification."""
    name, arguments = text.strip(" )").split("(")
    v = [float(x) for x in arguments.replace(",", " ").split()]
    if name == "rotate":
        c, s, x, y = math.cos(math.radians(v[0])), math.sin(math.radians(v[0])), v[1], v[2]
        return np.array([[c, -s, x - c * x + s * y], [s, c, y - s * x - c * y], [0, 0, 1]])
    a, b, c, d, e, f = {
        "translate": lambda: (1, 0, 0, 1, *v),
        "scale": lambda: (v[0], 0, 0, v[1], 0, 0),
        "skewX": lambda: (1, 0, math.tan(math.radians(v[0])), 1, 0, 0),
        "skewY": lambda: (1, math.tan(math.radians(v[0])), 0, 1, 0, 0),
        "matrix": lambda: v,
    }[name]()
    return np.array([[a, c, e], [b, d, f], [0, 0, 1]])


@given(st.lists(transforms, max_size=4), pairs)
def test_transforms_compose_like_matrices(parts, point):
    product = np.eye(3)
    for part in parts:
        product = product @ matrix(part)
    x, y, _ = product @ [*point, 1]
    nested = affine.Affine()
    for part in parts:
        nested = nested @ affine.parse(part)
    scale = 1e-9 * (1 + np.abs(product).max()) * 50
    for image in (nested(complex(*point)), affine.parse(" , ".join(parts))(complex(*point))):
        assert abs(image - complex(x, y)) <= scale


@given(st.lists(pairs, min_size=1, max_size=5), st.booleans())
def test_file_units_to_core_and_back(points, flip):
    shape = shapes.Shape("", None, None, (0j, 0j), flip, {}, {})
    core = shape.to_core(points)
    assert np.array_equal(shape.to_file(core), points)
    assert np.array_equal(core.imag, np.array(points)[:, 1] * (-1 if flip else 1))


def test_the_largest_outer_loop_is_the_default_and_the_others_are_reported(svg):
    shape = svg('<path d="M0 0H10V10H0zM20 0H60V40H20zM30 10H50V30H30z" fill-rule="evenodd"/>')
    assert vertices(shape) == {(20, 0), (60, 0), (60, 40), (20, 40)}
    notes = " ".join(shape.notes)
    assert [hole.size for hole in shape.holes] == [4] and "1 other outline" in notes and "6.2%" in notes


def test_ids_labels_groups_and_numbers_select(svg):
    body = (
        '<g id="g" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape">'
        '<rect id="a" width="4" height="4"/><rect inkscape:label="b b" width="5" height="5"/></g>'
        '<rect id="c" width="9" height="9"/><rect id="2" width="1" height="1"/>'
    )
    for chosen, size in [
        ("", 9),
        ("#a", 4),
        ("#b b", 5),
        ("#g", 5),
        ("#c", 9),
        ("#1", 9),
        ("#3", 4),
        ("#2", 1),
    ]:
        assert svg(body, chosen=chosen).curve.area == pytest.approx(size**2), chosen
    one_line(lambda: svg(body, chosen="#d"), "a.svg#d", "no 'd'", "g, a, b b, c, 2")
    one_line(lambda: svg(body, chosen="#9"), "no outline 9", "has 4")


def test_a_file_called_with_a_hash(tmp_path):
    (tmp_path / "a#b.svg").write_text(SVG.format("", '<rect width="2" height="2"/>'))
    assert shapes.read(str(tmp_path / "a#b.svg")).curve.area == 4


HIDDEN = [
    "<defs>{}</defs>",
    '<g display="none">{}</g>',
    '<g style="display : none !important">{}</g>',
    '<clipPath id="x">{}</clipPath>',
    "<mask>{}</mask>",
    "<symbol>{}</symbol>",
    "<pattern>{}</pattern>",
    '<g visibility="hidden">{}</g>',
    '<g fill="none">{}</g>',
    '<g opacity="0">{}</g>',
    "<metadata>{}</metadata>",
    '<foreign xmlns="http://example.org">{}</foreign>',
    "<style>.h{{display:none}} /* .h{{display:inline}} */ @media print{{.h{{display:inline}}}}</style>"
    '<g class="h">{}</g>',
]


@pytest.mark.parametrize("hidden", HIDDEN)
def test_hidden_elements_are_not_read(svg, hidden):
    body = '<rect width="5" height="5"/>' + hidden.format('<rect width="90" height="90"/>')
    assert svg(body).curve.area == pytest.approx(25)


def test_entities_of_plain_words_are_read(tmp_path):
    """Illustrator writes the names of namespaces in this way."""
    names = '<!ENTITY ns_svg "http://www.w3.org/2000/svg"><!ENTITY ns_link "http://www.w3.org/1999/xlink">'
    body = '<rect id="r" width="5" height="5"/><use xlink:href="#r" x="5"/>'
    (tmp_path / "a.svg").write_text(
        f'<!DOCTYPE svg [{names}]><svg xmlns="&ns_svg;" xmlns:xlink="&ns_link;" viewBox="0 0 9 9">{body}</svg>'
    )
    assert shapes.read(f"{tmp_path}/a.svg#silhouette").curve.area == 50


@pytest.mark.parametrize(
    "selector",
    [
        *("g rect", "g > rect", "svg rect#a", "x, path + rect", "path ~ rect.k", "path+rect:last-child"),
        *("[fill]", '[fill="red"]', "[fill^=r]", '[data-name~="b"]', "rect:not(.j)", "rect:not(svg > rect)"),
        *(":is(rect, circle)", ":where(g) .k", "rect:nth-child(2)", "rect:nth-child(2n)", ":root rect"),
    ],
)
def test_selectors_determine_which_elements_they_style(svg, selector):
    body = f"<style>rect{{width:1px}} {selector}{{width:9px !important}}</style>"
    body += '<g><path/><rect id="a" class="k" fill="red" data-name="a b" height="4"/></g>'
    body += '<rect class="j" x="20" width="2" height="3"/>'
    shape = svg(body, chosen="#a")
    assert (
        shape.curve.area == 36 and svg(body).curve.area == 36 and not [n for n in shape.notes if "read" in n]
    )


def test_selectors_hold_by_specificity_then_by_order(svg):
    body = '<g id="g"><rect id="r" class="a b" height="1"/></g>'
    for rules, width in [
        ("#g rect{width:5px} .a.b{width:6px}", 5),
        (".b.a{width:6px} g .a{width:5px}", 6),
        (".a{width:5px} rect[class]{width:6px} .b{width:7px}", 6),
        ("g>.a{width:5px} g .b{width:6px}", 6),
        ("g>.a{width:5px} .b.a{width:6px} .a{width:7px}", 6),
    ]:
        assert svg(f"<style>{rules}</style>{body}").curve.area == width, rules


def test_a_use_is_styled_like_its_referenced_element(svg):
    body = "<style>#g > rect{width:4px} #h use{width:9px} #h rect{width:7px}</style>"
    body += '<g id="g"><rect id="r" height="1"/></g>'
    areas = svg(f'{body}<g id="h"><use id="u" href="#r" x="20"/></g>', chosen="#u").curve.area
    assert areas == 4


def test_unsupported_style_rules_get_a_note(svg):
    body = '<rect class="a" width="9" height="9"/>'
    rules = "g>.a{fill:none} .a:hover{fill:red} g:has(rect){fill:none} .a:nth-child(1 of g), .a:no{x:1}"
    assert svg(f"<style>{rules}</style>{body}").notes == (
        "4 style rules ignored: a malformed selector, or a pseudo-class such as :hover",
    )
    assert not svg(f"<style>.a{{fill:red}} g>.a{{fill:none}}</style>{body}").notes


def test_a_clip_gets_a_note(svg):
    shape = svg('<g clip-path="url(#c)"><rect width="9" height="9"/></g>')
    assert shape.curve.area == 81 and "clip-path is ignored" in shape.notes[0]


def test_the_outline_is_that_of_the_visible_fill(svg):
    overlapping = "M0 0H20V20H0zM10 5H40V15H10z"
    assert svg(f'<path d="{overlapping}"/>').curve.area == pytest.approx(400 + 200)
    assert svg(f'<path d="{overlapping}" fill-rule="evenodd"/>').curve.area == 300  # cut in two
    ring = svg('<path d="M0 0H30V30H0zM10 10H20V20H10z"/>')
    assert ring.curve.area == pytest.approx(900) and not ring.notes
    away = svg('<path d="M0 0H30V30H0zM20 10H40V20H20z" style="fill-rule:evenodd"/>')
    assert away.curve.area == pytest.approx(800)


def test_a_keyhole_or_a_spike_is_harmless(svg):
    keyhole = svg('<path d="M0 0H30V30H0V15H10V20H20V10H10V15H0z"/>')
    assert keyhole.curve.area == pytest.approx(900) and len(keyhole.holes) == 1
    assert svg('<path d="M0 0H30V30H0V15H-10H0z"/>').curve.box[0] == -30j
    assert svg('<path d="M0 0H30V30H0zM5 5L9 9z"/>').curve.z.size == 4


def test_a_tiny_crossing_is_removed_and_a_larger_one_follows_its_fill_rule(svg):
    assert svg('<path d="M0 0H30V30H0V-.01L-.01 0z"/>').curve.area == pytest.approx(900, rel=1e-4)
    bow = svg('<path id="p" d="M0 0L30 30V0L0 30z"/>')
    assert bow.curve.area == pytest.approx(225) and "crosses itself at (15, 15)" in bow.notes[0]
    star = '<polygon points="50,0 80,90 2,35 98,35 20,90" fill-rule="{}"/>'
    whole, pierced = svg(star.format("nonzero")), svg(star.format("evenodd"))
    assert whole.curve.z.size == 10 and whole.holes == ()
    assert pierced.curve.z.size == 3 and any("4 other outlines" in note for note in pierced.notes)


def test_a_crossing_elsewhere_gets_no_note(svg):
    shape = svg('<rect width="60" height="60"/><path id="bow" d="M0 0L30 30V0L0 30z"/>')
    assert shape.curve.area == 3600 and not any("bow" in note for note in shape.notes)


def test_a_crossing_ring_is_one_more_outline(svg):
    island = svg('<path id="p" d="M0 0H60V60H0zM70 0L80 10V0L70 10z"/>')
    assert island.curve.area == 3600 and any("crosses itself at (75, 5)" in note for note in island.notes)
    small = svg('<path id="p" d="M0 0H6V6H0zM70 0L80 10V0L70 10z"/>')
    assert small.curve.area == 36 and any("2 other outlines" in note for note in small.notes)


def test_an_open_line_beside_a_closed_one(svg):
    shape = svg('<path id="p" fill="none" stroke="red" d="M0 0H6V6H0zM70 0L80 10"/>', chosen="#p")
    assert shape.curve.area == 36 and not [note for note in shape.notes if "open" in note]


def test_open_runs(svg):
    filled = svg('<path id="p" d="M0 0H30V30"/>')
    assert (
        filled.curve.area == 450 and "closed the open outline between (0, 0) and (30, 30)" in filled.notes[0]
    )
    nearly = '<path id="p" fill="none" d="M0 0H30V30H0V0.1"/>'
    assert svg(nearly, chosen="#p").curve.z.size == 5
    wide = '<path id="p" fill="none" stroke="red" stroke-width="6" d="M0 0H30V30H0V5"/>'
    assert svg(wide, chosen="#p").curve.area == 900  # closed by its line
    one_line(
        lambda: svg('<path id="p" fill="none" stroke="red" d="M0 0H30V30"/>', chosen="#p"),
        "'p'",
        "open",
        "(30, 30)",
        "close",
    )


def test_closed_lines_compete_with_fills_by_area(svg):
    small, large = '<path d="M10 10H20V20H10z"/>', '<path d="M-5 -5H96V96H-5z"/>'
    line = '<path id="line" fill="none" stroke="red" d="M0 0H90V90H0z"/>'
    assert svg(line + small).curve.area == pytest.approx(91**2) == svg(line).curve.area
    assert svg(line + large).curve.area == 101**2 and not svg(line + large).notes
    assert svg(line + small, chosen="#line").curve.area == 8100
    open_line = '<path fill="none" stroke="red" d="M0 0L90 80L5 60"/>' + small
    assert svg(open_line).curve.area == 100 and not svg(open_line).notes
    assert svg(f'<g stroke-opacity="0">{line}</g>{small}').curve.area == 100


PIECE = '<path id="front" d="M10 10L100 20C110 70 110 110 110 180L10 180z" fill="none" stroke="red" stroke-width=".4"/>'
ON_IT = {
    "grain line": '<path d="M50 40V150" stroke="#000"/>',
    "line": '<line x1="30" y1="50" x2="80" y2="50" stroke="#000"/>',
    "polyline": '<polyline points="30 100 60 95 80 100" stroke="#000"/>',
    "label": '<path id="o" d="M30 90h9v9h-9z m2 2v5h5v-5z"/>',
    "words": '<text x="30" y="100" font-size="12" font-family="DejaVu Sans">Front</text>',
    "arrowhead": '<path d="M50 40l4 8h-8z"/>',
    "fill without paint": '<path d="M0 0H300V300H0z" fill-opacity="0"/>',
}


@pytest.mark.parametrize("mark", ON_IT)
def test_an_unfilled_piece_is_the_shape_with_anything_drawn_on_it(svg, mark):
    canvas = 'viewBox="0 0 120 200"'
    alone, marked = svg(PIECE, canvas), svg(PIECE + ON_IT[mark], canvas)
    assert marked.curve.area == pytest.approx(alone.curve.area, rel=1e-9)
    assert not any("two points" in note or "encloses no area" in note for note in marked.notes)


def test_an_empty_fill_is_the_reason_only_without_other_elements(svg):
    flat = '<path id="flat" d="M50 40V150"/>'
    assert svg(flat + '<path d="M10 10H20V20H10z"/>').curve.area == 100
    one_line(lambda: svg(flat), "flat", "2 distinct points")
    one_line(lambda: svg(flat + '<path d="M10 10H20V20H10z"/>', chosen="#flat"), "2 distinct points")


def drawn(tmp_path, body, attributes='viewBox="0 0 100 100"'):
    path = tmp_path / "a.svg"
    path.write_text(SVG.format(attributes, body))
    return shapes.read_drawing(shapes.Spec(path))


def test_the_painted_area_is_that_of_all_fills_and_strokes(tmp_path):
    body = (
        '<path d="M0 0H60V60H0zM10 10H30V30H10z" fill-rule="evenodd"/><rect x="40" y="40" width="40" height="40"/>'
        '<path d="M70 10H90" stroke="red" stroke-width="4" fill="none"/>'  # an open stroke
        '<path d="M0 95H90" stroke="red" stroke-width=".1" fill="none"/>'  # less than a pixel wide
        '<rect x="90" y="90" width="9" height="9" display="none"/>'
    )
    drawing = drawn(tmp_path, body)
    assert drawing.painted.area == pytest.approx(3600 - 400 + 1600 - 400 + 80)
    assert drawing.ink.equals(drawing.painted) and len(drawing.painted.geoms) == 2


def test_the_area_painted_by_many_lines_has_few_vertices(tmp_path):
    places = [(3 + 7 * (k % 13), 4 + 8 * (k // 13)) for k in range(150)]
    rings = "".join(f'<circle cx="{x}" cy="{y}" r="2.5"/>' for x, y in places)
    painted = drawn(tmp_path, f'<g fill="none" stroke="red" stroke-width=".6">{rings}</g>').painted
    assert len(painted.geoms) == 150 and shapely.get_num_coordinates(painted) < 150 * 80
    assert painted.area == pytest.approx(150 * np.pi * 2.8**2, rel=5e-3)


def test_shadows_are_not_part_of_the_painted_area(tmp_path):
    body = '<rect width="20" height="20"/><rect x="30" width="30" height="20" {}/>'
    for faint in ('fill-opacity=".2"', 'opacity="20%"', 'opacity=".5" style="fill-opacity:.4"'):
        assert drawn(tmp_path, body.format(faint)).painted.area == pytest.approx(400), faint
    half = '<g opacity=".4"><g opacity=".5"><rect x="30" width="9" height="9"/></g></g>'
    grouped = f'<rect width="20" height="20"/>{half}'
    assert drawn(tmp_path, grouped).painted.area == pytest.approx(400)
    for tone in ('fill-opacity=".4"', 'opacity=".3"', 'stroke="red" opacity="1"'):
        assert drawn(tmp_path, body.format(tone)).painted.area >= 1000, tone
    assert drawn(tmp_path, '<rect width="20" height="20" opacity=".1"/>').painted.area == pytest.approx(400)


def test_closed_lines_are_filled_where_lines_draw(tmp_path):
    house = '<path d="M10 40L50 10L90 40V90H10z" fill="none" stroke="red" stroke-width="2"/>'
    smoke = '<path d="M70 10V0" fill="none" stroke="red" stroke-width="2"/>'
    dot = '<circle cx="50" cy="60" r="5"/>'
    outer = (
        shapely.Polygon([(10, 40), (50, 10), (90, 40), (90, 90), (10, 90)]).buffer(1, join_style="mitre").area
    )
    for body, more in [(house, 0), (house + dot, 0), (house + smoke + dot, 20)]:
        drawing = drawn(tmp_path, body)
        assert drawing.painted.area == pytest.approx(outer + more)
        assert drawing.ink.area < 700
    # among fills that cover most of the enclosed area, a line is a line
    drawing = drawn(tmp_path, house + '<rect x="20" y="45" width="55" height="40"/>')
    assert (
        len(drawing.painted.interiors if drawing.painted.geom_type == "Polygon" else drawing.painted.geoms)
        > 0
    )
    assert drawing.painted.area < outer - 1500
    # and a wide stroke is a ring
    ring = drawn(tmp_path, '<circle cx="50" cy="50" r="20" fill="none" stroke="red" stroke-width="10"/>')
    assert ring.painted.area == pytest.approx(np.pi * (25**2 - 15**2), rel=1e-3)


LINE = '<path d="{}" fill="none" stroke="red" stroke-width="2"/>'


@pytest.mark.parametrize(
    ("paths", "closed"),
    [
        (["M11 40L50 10L90 40V90H10V42"], True),  # a pen's stroke that misses its start at a corner
        (["M30 90H10V40L50 10L90 40V90H32"], True),  # and on a straight line
        (["M30 90H10V40L50 10", "M52 11L90 40V90H32"], True),  # two strokes, two gaps
        (["M30 90H10V40L50 10L90 40V90H37"], False),  # the gap is wider than a thirty-second of the drawing
        (["M10 40L50 10L90 40V90H10V50"], False),
        (["M30 90H10V40L50 10L90 40V90H32V88"], False),  # the last line leads away from the first
        (["M10 10H90", "M10 13.5H90", "M10 17H90"], False),  # parallel lines whose ends are close
    ],
)
def test_small_gaps_in_lines_are_closed(tmp_path, paths, closed):
    body = "".join(map(LINE.format, paths))
    drawing = drawn(tmp_path, body)
    assert (drawing.painted.area > 4000) == closed and drawing.ink.area < 800
    if closed:
        assert drawing.painted.geom_type == "Polygon" and not drawing.painted.interiors
        assert drawing.painted.covers(drawing.ink.buffer(-1e-6))
    else:
        assert drawing.painted.equals(drawing.ink)
    # hidden elements are not lines, even if their ends are close
    if closed:
        assert (
            drawn(tmp_path, body.replace('red"', 'none"') + '<rect width="5" height="5"/>').painted.area == 25
        )


def test_a_gap_is_as_wide_as_the_line_where_that_is_thick(tmp_path):
    ring = '<path d="M{} A30 30 0 1 0 {}" fill="none" stroke="red" stroke-width="8" stroke-linecap="{}"/>'
    for half, cap, closed in [(4, "butt", True), (5, "butt", False), (7, "round", True), (9, "round", False)]:
        y = 50 - (30**2 - half**2) ** 0.5
        drawing = drawn(tmp_path, ring.format(f"{50 - half} {y}", f"{50 + half} {y}", cap))
        assert (drawing.painted.area > 3000) == closed, (half, cap)


def test_a_figure_of_open_lines_keeps_them(tmp_path):
    head = '<circle cx="40" cy="20" r="9"/>'
    limbs = '<path d="M40 30V55L20 90M40 55L70 85M10 45H75"/>'
    figure = drawn(tmp_path, f'<g fill="none" stroke="red" stroke-width="2">{head}{limbs}</g>')
    assert figure.painted.equals(figure.ink)
    # also if its lines are narrow
    narrow = drawn(tmp_path, f'<g fill="none" stroke="red" stroke-width=".1">{head}{limbs}</g>')
    assert narrow.painted.equals(narrow.ink) and narrow.ink.area > 10
    # a closed line is filled beside a text that consists of open ones
    piece = '<path d="M10 10H60L75 70H15z"/>'
    letters = "".join(f'<path d="M{x} 95v-6h3v6"/>' for x in range(5, 95, 8))
    labelled = drawn(tmp_path, f'<g fill="none" stroke="red" stroke-width="1">{piece}{letters}</g>')
    assert labelled.painted.area > 3000 > 1000 > labelled.ink.area


def test_an_embedded_picture_is_its_rectangle(tmp_path, svg):
    dot = "data:image/png;base64,iVBORw0KGgo="
    body = f'<image id="photo" x="10" y="20" width="30" height="50" transform="scale(2 1)" href="{dot}"/>'
    drawing = drawn(tmp_path, body + '<circle cx="50" cy="40" r="5"/>')
    assert drawing.painted.bounds == (20, 20, 80, 70) and drawing.painted.area == 3000
    assert svg(body, chosen="#photo").curve.area == 3000
    linked = '<image width="30" height="50" href="photo.png"/>'
    one_line(lambda: svg(linked), "contains no outline")
    cut = f'<clipPath id="c"><rect width="35" height="25"/></clipPath><g clip-path="url(#c)">{body}</g>'
    assert drawn(tmp_path, cut).painted.bounds == (20, 20, 35, 25)


STROKES = {
    "butt": ('<path fill="none" stroke="red" stroke-width="4" d="M10 10H50"/>', 160),
    "square": (
        '<path fill="none" stroke="red" stroke-width="4" stroke-linecap="square" d="M10 10H50"/>',
        176,
    ),
    "round": (
        '<g stroke-linecap="round" fill="none" stroke="red" stroke-width="4"><line x1="10" x2="50"/></g>',
        160 + 4 * np.pi,
    ),
    "mitre": ('<path fill="none" stroke="red" stroke-width="4" d="M10 10H50V50"/>', 320),
    "bevel": (
        '<path fill="none" stroke="red" stroke-width="4" stroke-linejoin="bevel" d="M10 10H50V50"/>',
        318,
    ),
    "stretched": (
        '<path transform="scale(2 1)" fill="none" stroke="red" stroke-width="4" d="M10 10H50"/>',
        320,
    ),
    "circle": ('<circle cx="50" cy="50" r="20" fill="none" stroke="red" stroke-width="10"/>', 625 * np.pi),
}


@pytest.mark.parametrize("name", STROKES)
def test_a_drawing_of_lines_alone_is_the_silhouette_of_its_strokes(svg, name):
    content, area = STROKES[name]
    assert svg(content).curve.area == pytest.approx(area, rel=1e-3)


def test_the_silhouette_and_the_canvas_by_name(svg):
    two = '<rect width="30" height="30"/><path fill="none" stroke="red" stroke-width="4" d="M20 15H60"/>'
    assert svg(two).curve.area == 900
    assert svg(two, chosen="#silhouette").curve.area == pytest.approx(900 + 4 * 30)
    assert svg(two, chosen="#canvas").curve.area == pytest.approx(100 * 100)
    named = '<rect id="canvas" width="30" height="30"/>'
    assert svg(named, chosen="#canvas").curve.area == 900


def test_only_notes_of_the_selected_outline_are_shown(svg):
    shape = svg('<path d="M0 0H60V60"/><rect width="70" height="70"/>')
    assert shape.curve.area == 4900 and not [note for note in shape.notes if "closed" in note]


def test_a_line_without_width_encloses_nothing(svg):
    one_line(lambda: svg('<line x2="5" y2="6"/>'), "<line>", "2 distinct points")


BAD = {
    "M0 0L10": ("d: character", "L", "2 numbers"),
    "M0 0L10 10 L 5 x": ("character 16", "'x'"),
    "L0 0 10 10": ("must begin with M",),
    "M0 0C1 2 3 4 5": ("takes 6",),
    "M0 0 L nan nan": ("d: character",),
    "M0 0 L 1e999 0 0 1": ("too large",),
    "M0 0 L 10,,10 5 5 ": ("d: character",),
    "M0 0 A 5 5 0 2 0 10 10": ("takes 7",),
    "hello": ("must begin with M",),
    "M0 0 L 10 0 L 20 0 Z": ("encloses no area",),
    "M0 0 L 10 0 L 0 0": ("points",),
    "M5 5 Z": ("0 distinct points",),
    "": ("0 distinct points",),
}


@pytest.mark.parametrize("d", BAD)
def test_bad_path_data(svg, d):
    one_line(lambda: svg(f'<path id="p" d="{d}"/>'), "a.svg", "'p'", *BAD[d])


WRONG = {
    '<path id="p" d="M0 0 L 10 10 0 10 B"/>': ("'B'", "not a path command"),
    '<path id="p" d="M0 0 L 10 10 0 10 Z 5"/>': ("not a path command",),
    '<path id="p" d="M0 0 L 10 10 L 0 10 L NaN NaN L 30 5"/>': ("command L", "'NaN NaN L 30"),
    '<path id="p" d="M0 0 L 10 10 0 10 8"/>': ("takes 2", "5 are given"),
    '<path id="p" d="M0 0 L 10 10 0 10 1e999 3"/>': ("too large",),
    '<polygon id="p" points="0,0 10,10 0,10 9"/>': ("points: 7 numbers",),
    '<polygon id="p" points="0,0 10,10 0,10 9,b"/>': ("points: character", "b'"),
}


@pytest.mark.parametrize("body", WRONG)
def test_a_shape_is_drawn_up_to_its_first_error(svg, body):
    """As in SVG 2, with a note; the other shapes are drawn, too."""
    shape = svg(f'{body}<rect x="50" width="4" height="5"/>')
    assert shape.curve.area == 50
    (note,) = [note for note in shape.notes if "drawn up to" in note]
    assert "'p'" in note and all(word in note for word in WRONG[body])


def test_a_fault_in_one_shape_refuses_no_other(svg):
    shape = svg('<path d="L 5 5"/><rect x="50" width="4" height="5"/>')
    assert shape.curve.area == 20 and any("must begin with M" in note for note in shape.notes)


@pytest.mark.parametrize(
    "style, body, area",
    [
        ("#a{display:none!important}", '<rect id="a" width="90" height="90" style="display:inline"/>', 20),
        (
            ".a{display:none !important}.a#b{display:inline}",
            '<rect class="a" id="b" width="90" height="90"/>',
            20,
        ),
        (
            "#a{display:none!important}",
            '<rect id="a" width="9" height="9" style="display:inline!important"/>',
            81,
        ),
        ("#a{display:none}", '<rect id="a" width="9" height="9" style="display:inline"/>', 81),
    ],
)
def test_important_declarations_win(svg, style, body, area):
    assert svg(f'<style>{style}</style>{body}<rect width="4" height="5"/>').curve.area == area


@pytest.mark.parametrize(
    "body, box",
    [
        ('<g font-size="30"><rect x="1em" width="2em" height="1em"/></g>', (30, 0, 90, 30)),
        ('<g font-size="30"><g font-size=".5em"><rect width="2em" height="1ex"/></g></g>', (0, 0, 30, 7.5)),
        (
            '<g font-size="20"><g style="font-size:150%"><rect width="2em" height="1em"/></g></g>',
            (0, 0, 60, 30),
        ),
        (
            '<g style="font:bold 20px/2 Arial, sans-serif"><rect width="2em" height="1em"/></g>',
            (0, 0, 40, 20),
        ),
        ('<g font-size="30"><rect width="2rem" height="1rem"/></g>', (0, 0, 32, 16)),
        ('<rect width="2em" height="1em" style="font-size:large"/>', (0, 0, 36, 18)),
    ],
)
def test_lengths_refer_to_the_font(svg, body, box):
    z = svg(body).to_file(svg(body).curve.z)
    assert np.allclose([*z.min(axis=0), *z.max(axis=0)], box)


@pytest.mark.parametrize(
    "style, box",
    [
        ("transform-box:fill-box;transform-origin:center", (75, 15, 95, 65)),
        ("transform-box:fill-box;transform-origin:bottom right", (110, 0, 130, 50)),
        ("transform-box:fill-box", (40, 30, 60, 80)),
        ("transform-origin:0 0", (-50, 60, -30, 110)),
    ],
)
@pytest.mark.parametrize("tag", ["rect", "g"])
def test_transforms_about_the_box_of_the_element(svg, style, box, tag):
    """A rectangle at (60, 30) of 50 × 20, rotated by a right angle."""
    rect = '<rect {} x="60" y="30" width="50" height="20"/>'
    turned = f'style="{style};transform:rotate(90deg)"'
    shape = svg(rect.format(turned) if tag == "rect" else f"<g {turned}>{rect.format('')}</g>")
    z = shape.to_file(shape.curve.z)
    assert np.allclose([*z.min(axis=0), *z.max(axis=0)], box)


def test_translations_by_parts_of_a_box(svg):
    moved = 'style="transform-box:fill-box;transform:translate(50%, -100%) scaleX(2)"'
    shape = svg(f'<rect {moved} x="60" y="30" width="50" height="20"/>')
    z = shape.to_file(shape.curve.z)
    assert np.allclose([*z.min(axis=0), *z.max(axis=0)], (85, 10, 185, 30))


@pytest.mark.parametrize(
    "body, words",
    [
        ("", ("contains no outline",)),
        ('<text writing-mode="sideways-lr">hello</text>', ("paths", "#text=")),
        ('<rect width="5"/>', ("0 distinct points",)),
        ('<rect width="-5" height="5"/>', ("width is -5",)),
        ('<circle r="x"/>', ("r 'x' is not a length",)),
        ('<circle r="5furlong"/>', ("not a length",)),
        ('<polygon points="0,0 1,0 1"/>', ("<polygon>", "points: ", "5 numbers")),
        ('<polygon points="0,0 1,0 1,b"/>', ("points: character", "b'")),
        ('<rect width="5" height="5" transform="spin(4)"/>', ("transform", "spin")),
        ('<rect width="5" height="5" transform="scale(0)"/>', ("1 distinct point",)),
        ('<rect width="5" height="5" transform="scale(1,0)"/>', ("points",)),
        ('<rect width="5" height="5" transform="translate(1"/>', ("transform",)),
        ('<g id="g"><use href="#g"/></g>', ("contains itself",)),
        ('<use id="a" href="#b"/><use id="b" href="#a"/>', ("contains itself",)),
        ('<rect id="pin-a" width="5" height="5"/>', ("pin-a", "circle or an ellipse")),
        ('<circle id="pin-a" r="5"/><circle id="pin-a" r="5"/>', ("a second 'pin-a'",)),
        ('<path id="stroke-a" d="M0 0L5 5M6 6L7 7"/>', ("stroke-a", "single line")),
        ('<path id="stroke-a" d="M5 5L5 5"/>', ("2 distinct points",)),
    ],
)
def test_bad_documents(svg, body, words):
    one_line(lambda: svg(body), "a.svg", *words)


def test_a_percentage_of_nothing(svg):
    one_line(lambda: svg('<rect width="50%" height="5"/>', ""), "percentage")


@pytest.mark.parametrize("box", ["0 0 1", "0 0 0 5", "0 0 -1 5", "0 0 a 5", ""])
def test_a_bad_view_box(svg, box):
    one_line(lambda: svg('<rect width="5" height="5"/>', f'viewBox="{box}"'), "a.svg", "viewBox")


LAUGHS = "".join(f'<!ENTITY l{i + 1} "{f"&l{i};" * 10}">' for i in range(9))
HOSTILE = {
    b"": "empty",
    b"\x00\x01\xff\xfe\x89PNG" * 20: "XML",
    b"\xff\xfe\xff\xff<svg": "XML",
    b"<svg": "not well-formed XML: ",
    b"<svg></g>": "not well-formed XML: ",
    b"plain text": "not well-formed XML: ",
    b"<html></html>": "<html>, not <svg>",
    b'<?xml version="1.0" encoding="klingon"?><svg/>': "XML",
    b'<?xml version="1.0" encoding="shift-jis"?><svg/>': "XML",
    f'<!DOCTYPE s [<!ENTITY l0 "ha">{LAUGHS}]><svg>&l9;</svg>'.encode(): "entity 'l1'",
    b'<!DOCTYPE s [<!ENTITY x SYSTEM "file:///etc/passwd">]><svg>&x;</svg>': "entity 'x'",
    b'<!DOCTYPE s [<!ENTITY % x SYSTEM "http://127.0.0.1/">%x;]><svg></svg>': "entity 'x'",
    b"<svg>" + b"<g>" * 100_000: "nested",
    b"<svg>" + b"<g>" * 100_000 + b"</g>" * 100_000 + b"</svg>": "nested",
    b"<svg>" + b"<g/>" * 301_000 + b"</svg>": "elements",
}


@pytest.mark.slow
@pytest.mark.parametrize("data", HOSTILE, ids=lambda data: repr(data[:24]))
def test_hostile_files_end_at_once(tmp_path, data):
    path = tmp_path / "bad.svg"
    path.write_bytes(data)
    one_line(lambda: shapes.read(str(path)), "bad.svg: ", HOSTILE[data])


@pytest.mark.slow
def test_uses_that_multiply_end_at_once(svg):
    layers = "".join(f'<g id="g{i + 1}">{f"""<use href="#g{i}"/>""" * 10}</g>' for i in range(12))
    one_line(lambda: svg(f'<g id="g0"><rect width="1" height="1"/></g>{layers}'), "elements")


FILLERS = (" ", "9", "(", "\n", ",", "-", "M", "1 ", "/*", "{", ".a", "a(")


@pytest.mark.slow
@pytest.mark.parametrize("filler", some_fast(FILLERS, 3))
@pytest.mark.parametrize(
    "template",
    [
        '<path d="M0 0 L5 {} x"/>',
        '<path d="m0 0h9v9z" transform="{}!"/>',
        "<style>{}</style>",
        '<rect width="{}"/>',
    ],
)
@pytest.mark.timeout(30)  # quadratic time would be hours
def test_no_pattern_backtracks(svg, filler, template):
    with suppress(InputError):
        svg(template.format(filler * 100_000) + "<path/>")


def test_external_links_are_not_read(svg, tmp_path):
    (tmp_path / "other.svg").write_text(SVG.format("", '<rect id="r" width="90" height="90"/>'))
    body = (
        f'<image href="file://{tmp_path}/other.svg" width="90" height="90"/><use href="other.svg#r"/>'
        f'<use href="file://{tmp_path}/other.svg#r"/><rect width="5" height="5"/>'
    )
    assert svg(body).curve.area == 25


def test_a_doctype_alone_is_fine(tmp_path):
    path = tmp_path / "a.svg"
    path.write_text(
        '<?xml version="1.0"?><!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://127.0.0.1/svg11.dtd">'
        + SVG.format("", '<rect width="5" height="5"/>')
    )
    assert shapes.read(str(path)).curve.area == 25


def test_a_large_file_is_refused_before_it_is_parsed(svg):
    one_line(lambda: svg('<rect width="5" height="5"/>' * 100, max_bytes=1000), "limit of 1000")


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1e6, 1e12])
def test_size_does_not_matter(svg, scale):
    body = f'<path transform="scale({scale})" d="M0 0C0 40 30 50 50 60S80 20 90 0z"/>'
    assert svg(body).curve.area == pytest.approx(svg(body, "").curve.area)
    assert svg(body).curve.z.size == svg('<path d="M0 0C0 40 30 50 50 60S80 20 90 0z"/>').curve.z.size


def test_vertices_resamples(svg):
    shape = svg('<circle cx="50" cy="50" r="40"/>', vertices=30)
    assert abs(shape.curve.z.size - 30) <= 1 and np.ptp(shape.curve.lengths) < 0.1


def test_pins_and_strokes_are_read_and_never_the_domain(svg):
    body = (
        '<rect width="20" height="20"/><g transform="scale(2)">'
        '<circle id="pin-eye" cx="5" cy="6" r="40"/>'
        '<ellipse id="e" xmlns:i="http://www.inkscape.org/namespaces/inkscape" i:label="pin-nose" rx="1" ry="2"/>'
        '<path id="stroke-arm" fill="none" stroke="red" d="M0 0Q40 0 40 40"/></g>'
        '<line id="stroke-leg" x1="1" y1="2" x2="3" y2="4"/><circle id="stroke-loop" r="5"/>'
    )
    shape = svg(body)
    assert shape.curve.area == 400
    assert shape.pins == {"pin-eye": 10 - 12j, "pin-nose": 0}
    assert set(shape.strokes) == {"stroke-arm", "stroke-leg", "stroke-loop"}
    arm = shape.strokes["stroke-arm"]
    assert not arm.closed and arm.z[0] == 0 and arm.z[-1] == 80 - 80j and arm.z.size > 10
    assert np.array_equal(shape.strokes["stroke-leg"].z, [1 - 2j, 3 - 4j])
    assert shape.strokes["stroke-loop"].z[0] == shape.strokes["stroke-loop"].z[-1]


def test_an_id_that_draws_no_outline_is_not_called_missing(svg):
    body = (
        '<rect width="9" height="9"/><text id="title" writing-mode="sideways-lr">x</text>'
        '<g style="display:none"><rect id="old" width="9" height="9"/></g>'
    )
    one_line(lambda: svg(body, chosen="#title"), "<text> 'title' draws no outline", "text to paths")
    one_line(lambda: svg(body, chosen="#old"), "<rect> 'old' draws no outline", "hidden")
    one_line(lambda: svg(body, chosen="#young"), "no 'young' in the file")


@pytest.mark.parametrize(("start", "kind"), [(b"\xff\xd8\xff\xe0", "JPEG"), (b"\x89PNG\r\n", "PNG")])
def test_a_picture_with_the_suffix_of_a_drawing_is_named(tmp_path, start, kind):
    path = tmp_path / "photo.svg"
    path.write_bytes(start + bytes(range(256)))
    with pytest.raises(InputError, match=kind):
        reader.read(path)


def test_the_area_of_a_fill_is_computed_once(tmp_path, monkeypatch):
    """For the outlines that may be selected, and for everything that the drawing paints."""
    from iccm.io.svg import fill, strokes

    computed = []

    def count(rings, rule, budget):
        computed.append(rule)
        return fill.painted(rings, rule, budget)

    monkeypatch.setattr(strokes, "painted", count)
    path = tmp_path / "a.svg"
    path.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">'
        '<path fill-rule="evenodd" d="M0 0H8V5H0Z M1 1H3V2H1Z"/></svg>'
    )
    drawing = reader.read(path)
    assert drawing.painted.area == drawing.outlines[0].area - 2 == 38
    assert computed == ["evenodd"]


PAGE = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="10 20 100 50">{}</svg>'
INSIDE = '<path id="a" d="M20 30h30v20h-30z"/>'


@pytest.mark.parametrize(
    ("beside", "count"),
    [
        ('<path id="b" d="M120 30h10v10h-10z"/>', 1),
        ('<path id="b" d="M20 2h10v10h-10z"/>', 1),
        ('<path id="b" d="M108 30h10v10h-10z"/>', 2),  # partly on the page
        ('<path id="b" d="M112 30h10v10h-10z" stroke="red" stroke-width="6"/>', 2),  # its stroke is
        ('<g transform="translate(-100)"><path id="b" d="M120 30h10v10h-10z"/></g>', 2),
    ],
)
def test_shapes_beside_the_page_are_left_out_with_a_note_unless_selected(tmp_path, beside, count):
    (tmp_path / "a.svg").write_text(PAGE.format(INSIDE + beside))
    drawing = reader.read(tmp_path / "a.svg")
    assert len(drawing.outlines) == count and len(drawing.notes) == 2 - count
    assert len(reader.read(tmp_path / "a.svg", "b").outlines) == 1


def test_a_drawing_completely_beside_its_page_is_read(tmp_path):
    (tmp_path / "a.svg").write_text(PAGE.format(INSIDE.replace("M20", "M120")))
    drawing = reader.read(tmp_path / "a.svg")
    assert len(drawing.outlines) == 1 and not drawing.notes
