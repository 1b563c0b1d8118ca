"""Areas of flat colours: what each colour shows in the end, and which drawings have none."""

import pytest

from iccm.io.svg.flat_areas import flat_areas

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'


def areas(tmp_path, content):
    path = tmp_path / "drawing.svg"
    path.write_text(SVG.format(content))
    flat = flat_areas(path)
    return flat if flat is None else {colour: area.area for colour, area in flat.items()}


def test_later_shapes_cover_earlier_ones(tmp_path):
    content = (
        '<path d="M0 0H40V30H0z" fill="red"/><path d="M10 10H20V20H10z" fill="lime"/>'
        '<path d="M0 0H10V30H0z" fill="red"/><path d="M50 50V60" stroke="#00f" stroke-width="4"/>'
    )
    assert areas(tmp_path, content) == {
        (255, 0, 0, 255): pytest.approx(1200 - 100),
        (0, 255, 0, 255): pytest.approx(100),
        (0, 0, 255, 255): pytest.approx(40),
    }


def test_translucent_shapes_blend_with_what_they_cover(tmp_path):
    content = '<path d="M0 0H10V10H0z" fill="red"/><path d="M5 0H25V10H5z" fill="blue" fill-opacity=".4"/>'
    assert areas(tmp_path, content) == {
        (255, 0, 0, 255): pytest.approx(50),
        (153, 0, 102, 255): pytest.approx(50),
        (0, 0, 255, 102): pytest.approx(150),
    }


def test_colours_come_from_style_sheets_and_clips_cut(tmp_path):
    content = (
        '<style>.a{fill:#123456}</style><clipPath id="c"><path d="M0 0H5V10H0z"/></clipPath>'
        '<g color="#654321"><path class="a" clip-path="url(#c)" d="M0 0H10V10H0z"/>'
        '<path d="M20 0H30V10H20z" fill="none" stroke="currentColor" stroke-width="2"/></g>'
    )
    assert areas(tmp_path, content) == {
        (0x12, 0x34, 0x56, 255): pytest.approx(50),
        (0x65, 0x43, 0x21, 255): pytest.approx(12**2 - 8**2),
    }


@pytest.mark.parametrize(
    "content",
    [
        '<linearGradient id="g"><stop stop-color="red"/></linearGradient><path d="M0 0H9V9z" fill="url(#g)"/>',
        '<path d="M0 0H9V9" fill="none" stroke="red" stroke-dasharray="1"/>',
        '<image width="9" height="9" href="data:image/png;base64,AAAA"/><path d="M0 0H9V9z"/>',
        "".join(f'<path d="M{k} 0h1v1z" fill="#{k:02x}0000"/>' for k in range(20)),
    ],
)
def test_other_drawings_have_none(tmp_path, content):
    assert areas(tmp_path, content) is None
