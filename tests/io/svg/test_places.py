"""Positions of shapes in a drawing, with numbers that differ in x and y: viewports, transforms, percentages, lines."""

import numpy as np
import pytest

from iccm.io.shapes import shape as shapes
from iccm.io.svg import affine, reader

SVG = '<svg xmlns="http://www.w3.org/2000/svg" {}>{}</svg>'


@pytest.fixture
def svg(tmp_path):
    """Write an SVG body and read it as a shape."""

    def read(body, attributes='viewBox="0 0 200 100"', chosen=""):
        path = tmp_path / "a.svg"
        path.write_text(SVG.format(attributes, body))
        return shapes.read(f"{path}{chosen}")

    return read


@pytest.fixture
def drawing(tmp_path):
    """Write an SVG body and read it as a drawing."""

    def read(body):
        (tmp_path / "a.svg").write_text(SVG.format('viewBox="0 0 200 100"', body))
        return reader.read(tmp_path / "a.svg")

    return read


def box(shape):
    """Left, top, right and bottom in file units."""
    (left, bottom), (right, top) = shape.to_file(np.array(shape.curve.box))
    return [left, top, right, bottom]


@pytest.mark.parametrize(
    ("aspect", "corner", "scale"),
    [
        ("xMinYMin", (10, 20), 10),
        ("xMaxYMid", (10, 40), 10),
        ("xMinYMax meet", (10, 60), 10),
        ("xMinYMax slice", (10, 20), 20),
        ("xMidYMin slice", (-5, 20), 20),
        ("xMaxYMid slice", (-20, 20), 20),
    ],
)
def test_a_view_box_is_aligned_in_each_direction_by_its_own_word(aspect, corner, scale):
    """3 by 4 units starting at (1, 2) in a rectangle of 30 by 80 at (10, 20)."""
    map = affine.viewport((10, 20, 30, 80), (1, 2, 3, 4), aspect)
    assert map(1 + 2j) == pytest.approx(complex(*corner))
    assert map(2 + 4j) - map(1 + 2j) == pytest.approx(scale * (1 + 2j))
    wide = affine.viewport((20, 10, 80, 30), (2, 1, 4, 3), _exchanged(aspect))
    assert wide(2 + 1j) == pytest.approx(complex(*corner[::-1]))


def _exchanged(aspect):
    """The alignment with x and y exchanged."""
    words = aspect.split()
    return " ".join([f"x{words[0][5:]}Y{words[0][1:4]}", *words[1:]])


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ('<g transform="scale(2 3)"><rect width="6" height="7" transform="translate(5 4)"/></g>', [10, 12, 22, 33]),
        ('<rect id="r" width="6" height="7"/><use href="#r" x="5" y="4" transform="scale(2 3)"/>', [10, 12, 22, 33]),
        ('<rect width="6" height="7" transform="scale(3)"/>', [0, 0, 18, 21]),
        ('<rect width="6" height="7" transform="rotate(90 10 4)"/>', [7, -6, 14, 0]),
        ('<rect width="6" height="7" transform="skewX(45)"/>', [0, 0, 13, 7]),
        ('<rect width="6" height="7" transform="skewY(45)"/>', [0, 0, 6, 13]),
        ('<rect x="5%" y="5%" width="50%" height="50%"/>', [10, 5, 110, 55]),
        ('<ellipse cx="50%" cy="50%" rx="10%" ry="10%"/>', [80, 40, 120, 60]),
        ('<path d="M10 10h20v30zl-4 0 0 6z" fill-rule="nonzero"/>', [10, 10, 30, 40]),
    ],
)  # fmt: skip
def test_boxes_are_where_the_specification_has_them(svg, body, expected):
    assert box(svg(body)) == pytest.approx(expected, abs=3e-3)  # curves are flattened


def test_the_origin_of_a_transform_counts_from_the_view_box(svg):
    body = '<rect x="10" y="20" width="30" height="40" transform="rotate(180)" transform-origin="25 30"/>'
    assert box(svg(body, 'viewBox="5 6 100 100"')) == pytest.approx([20, 12, 50, 52])


def test_a_percentage_of_a_radius_refers_to_both_sides(svg):
    radius = 0.1 * ((200**2 + 100**2) / 2) ** 0.5
    shape = svg('<circle cx="100" cy="50" r="10%"/>').curve
    assert np.abs(shape.z - (100 - 50j)) == pytest.approx(radius)


@pytest.mark.parametrize(
    ("radii", "rx", "ry"),
    [
        ('rx="3" ry="2"', 3, 2),
        ('rx="3"', 3, 3),
        ('ry="2"', 2, 2),
        ('rx="40" ry="40"', 30, 10),
        ('ry="15"', 15, 10),
    ],
)
def test_corners_of_an_oblong_rectangle_are_rounded_by_half_a_side_at_most(svg, radii, rx, ry):
    shape = svg(f'<rect width="60" height="20" {radii}/>').curve
    assert shape.area == pytest.approx(1200 - (4 - np.pi) * rx * ry, rel=1e-3)


def test_a_smooth_curve_after_one_of_another_kind_starts_straight(svg):
    by_hand = svg('<path d="M0 0Q20 40 40 0C40 0 70 -40 80 0V50H0z"/>')
    assert svg('<path d="M0 0Q20 40 40 0S70 -40 80 0V50H0z"/>').curve.z == pytest.approx(by_hand.curve.z)
    by_hand = svg('<path d="M0 0C20 40 30 30 40 0Q40 0 80 0V50H0z"/>')
    assert svg('<path d="M0 0C20 40 30 30 40 0T80 0V50H0z"/>').curve.area == pytest.approx(by_hand.curve.area)


def test_the_rotation_of_an_arc_is_in_degrees(svg):
    """Half an ellipse of 20 by 10, its long axis up."""
    shape = svg('<path d="M40 40A20 10 90 0 1 60 40z"/>')
    assert box(shape) == pytest.approx([40, 20, 60, 40], abs=1e-2)


@pytest.mark.parametrize(
    ("flags", "low", "high"), [("0 0", 30, 45), ("0 1", 20, 30), ("1 0", 30, 60), ("1 1", 0, 30)]
)
def test_arcs_follow_their_flags(svg, flags, low, high):
    """From (50, 30) to (70, 30), on circles of radius 12: a chord of 20 is 6.633 from the centre."""
    depth = 12 - 6.6332 if flags[0] == "0" else 12 + 6.6332
    top, bottom = (30, 30 + depth) if flags[2] == "0" else (30 - depth, 30)
    assert box(svg(f'<path d="M50 30A12 12 0 {flags} 70 30z"/>'))[1::2] == pytest.approx(
        [top, bottom], abs=1e-2
    )


def test_whether_a_line_is_closed_depends_on_how_wide_it_is_drawn(svg):
    line = (
        '<path id="a" d="M0 0H5V8H0V1" stroke="black" stroke-width="{}" fill="none" transform="scale(10)"/>'
    )
    assert svg(line.format(1.5), chosen="#a").curve.area == pytest.approx(4000)
    with pytest.raises(Exception, match="open"):
        svg(line.format(0.5), chosen="#a")


def test_a_closed_stroke_returns_to_its_start(drawing):
    shape = drawing('<path id="stroke-a" d="M10 20H40V60Z"/><rect width="90" height="90"/>').strokes[
        "stroke-a"
    ]
    assert shape[0] == shape[-1] == 10 + 20j and shape.size == 4


def test_a_line_paints_its_length_times_its_width_where_it_lies(drawing):
    moved = 'transform="translate(50 5) rotate(30) scale(2 1)"'
    ink = drawing(f'<path d="M10 0H30" stroke="black" stroke-width="4" fill="none" {moved}/>').ink
    assert ink.area == pytest.approx(2 * 20 * 4)
    middle = 50 + 5j + 40 * np.exp(1j * np.pi / 6)
    assert (ink.centroid.x, ink.centroid.y) == pytest.approx((middle.real, middle.imag))
