"""Drawings that are their own picture: placed whole and upright in the target, in pictures and in artwork."""

import io

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

resvg = pytest.importorskip("resvg_py")

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} {}">{}</svg>'
RING = '<path fill-rule="evenodd" d="M7 7H93V73H7ZM15 15H85V65H15Z"/><path d="M93 30h6v20h-6z"/>'
ARROW = '<path d="M10 50 50 20v18h40v24H50v18z"/><circle cx="52" cy="50" r="6" fill="#fff"/>'
TARGETS = {
    "square": SVG.format(100, 100, '<path d="M5 5H95V95H5Z"/>'),
    "rounded": SVG.format(100, 100, '<rect x="5" y="5" width="90" height="90" rx="20"/>'),
    "wide": SVG.format(120, 80, '<path d="M0 0H120V80H0Z"/>'),
}
SYMMETRIC = {
    "pawn": '<circle cx="50" cy="25" r="15"/><path d="M42 40h16l8 40h-32z"/><path d="M28 84h44v10h-44z"/>',
    "bell": '<path d="M50 10c-20 0-24 20-24 40l-10 20h68l-10-20c0-20-4-40-24-40z"/><circle cx="50" cy="82" r="8"/>',
    "bulb": '<path d="M50 8a28 28 0 0 0-14 52v14h28v-14a28 28 0 0 0-14-52z"/><path d="M38 80h24v8h-24z"/>',
    "cup": '<path d="M25 10h50v20c0 20-12 28-20 30v20h15v10H30V80h15V60c-8-2-20-10-20-30z"/>'
    '<path d="M10 15h10v18zM90 15h-10v18z"/>',
    "tree": '<path d="M50 5 80 45H66L88 80H12L34 45H20z"/><path d="M44 84h12v12h-12z"/>',
    "house": '<path d="M50 8 95 48H82V92H60V62H40V92H18V48H5z"/><circle cx="50" cy="40" r="7" fill="#fff"/>',
    "face": '<path fill-rule="evenodd" d="M50 5a45 45 0 1 0 .1 0zM35 35a6 6 0 1 1-.1 0zM65 35a6 6 0 1 1-.1 0zM30 62h40'
    'c-4 16-36 16-40 0z"/>',
    "ring": '<circle cx="50" cy="50" r="36" fill="none" stroke="#000" stroke-width="12"/>'
    '<circle cx="50" cy="50" r="9"/>',
    "anchor": '<path fill="none" stroke="#000" stroke-width="7" d="M50 25V90M30 38H70M12 60c4 40 72 40 76 0"/>'
    '<circle cx="50" cy="16" r="9" fill="none" stroke="#000" stroke-width="6"/>',
    "plus": '<path d="M40 10h20v30h30v20H60v30H40V60H10V40h30z"/><circle cx="50" cy="50" r="6" fill="#fff"/>',
    "butterfly": '<path d="M47 50C20 5 0 25 12 50C0 75 20 95 47 55z"/>'
    '<path d="M53 50C80 5 100 25 88 50C100 75 80 95 53 55z"/>',
    "scales": '<path d="M48 10h4v70h20v8H28v-8h20z"/><path d="M20 20h60v4H20z"/><path d="M8 55h24L20 26z"/>'
    '<path d="M68 55h24L80 26z"/>',
    "figure": '<circle cx="50" cy="18" r="12"/><path d="M44 34h12l4 16 25 20v8H15v-8l25-20z"/>'
    '<path d="M20 84h60v8H20z"/>',
    "letter": '<path d="M42 10h16l30 80H72l-7-20H35l-7 20H12zM50 28 40 58h20z" fill-rule="evenodd"/>',
    "crown": '<path d="M10 30 30 50 50 15 70 50 90 30 82 75H18z"/><path d="M18 80h64v10H18z"/>',
    "lock": '<path d="M30 45V30a20 20 0 0 1 40 0v15" fill="none" stroke="#000" stroke-width="8"/>'
    '<path fill-rule="evenodd" d="M20 45h60v48H20zM50 60a7 7 0 1 1-.1 0z"/>',
}


def rendered(path, width):
    """An SVG as (h, w, 4) numbers from 0 to 255, on white where it is transparent."""
    image = Image.open(io.BytesIO(bytes(resvg.svg_to_bytes(svg_path=str(path), width=width)))).convert("RGBA")
    return on_white(image)


def on_white(image):
    image = image.convert("RGBA")
    ground = Image.new("RGBA", image.size, "white")
    ground.alpha_composite(image)
    return np.asarray(ground.convert("RGB")).astype(int)


def differing_share(first, second):
    """The share of pixels that differ by 32 of 255 from all colours within a pixel of them in the other picture."""
    low, high = (
        extreme(second, size=(3, 3, 1)) for extreme in (ndimage.minimum_filter, ndimage.maximum_filter)
    )
    return (np.maximum(low - first, first - high).max(axis=2) >= 32).mean()


@pytest.mark.slow
def test_a_drawing_on_a_ring_is_whole_with_the_ring_below_it_in_picture_and_artwork(
    tmp_path, iccm, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arrow.svg").write_text(SVG.format(100, 100, ARROW))
    (tmp_path / "ring.svg").write_text(SVG.format(100, 80, RING))
    result = iccm("map", "arrow.svg", "ring.svg", "-o", "o.png", "-o", "o.svg", "--size", "200")
    assert result.code == 0, result.err
    assert "silhouette" in result.err and "--holes keep" in result.err
    picture, artwork = on_white(Image.open("o.png")), rendered("o.svg", 200)
    assert differing_share(picture, artwork) < 0.01 and differing_share(artwork, picture) < 0.01
    line, paper = picture[20, 100], picture[32, 32]
    assert (line < paper).all() and (paper < 255).all() and picture[80, 130].max() < 20


@pytest.mark.slow
@pytest.mark.parametrize("parts", ["each", "elements"])
def test_each_part_of_a_target_shows_all_of_a_drawing(tmp_path, iccm, monkeypatch, parts):
    monkeypatch.chdir(tmp_path)
    body = '<path fill="#d22" d="M20 35H80V90H20z"/><path fill="#2a2" d="M50 10H70V25H50z"/>'
    (tmp_path / "apple.svg").write_text(SVG.format(100, 100, body))
    (tmp_path / "two.svg").write_text(
        SVG.format(200, 100, '<circle cx="50" cy="50" r="40"/><path d="M110 20H190V80H140V95H110z"/>')
    )
    result = iccm(
        "map", "apple.svg", "two.svg", "--parts", parts, "-o", "o.png", "-o", "o.svg", "--size", "200"
    )
    assert result.code == 0, result.err
    picture, artwork = on_white(Image.open("o.png")), rendered("o.svg", 200)
    assert differing_share(picture, artwork) < 0.01
    for half in (picture[:, :100], picture[:, 100:]):
        red, green, blue = np.moveaxis(half, 2, 0)
        body, leaf = (red > blue + 100) & (green < 80), (green > red + 60)
        assert leaf.sum() == pytest.approx(300 / 3300 * body.sum(), rel=0.25)
        assert np.argwhere(leaf)[:, 0].max() < np.argwhere(body)[:, 0].min()  # upright


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("figure", SYMMETRIC)
def test_symmetric_figures_stay_whole_upright_and_symmetric(tmp_path, iccm, monkeypatch, figure, target):
    """Each half of the picture is the other one's mirror image, and proportions are kept."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.svg").write_text(SVG.format(100, 100, SYMMETRIC[figure]))
    (tmp_path / "t.svg").write_text(TARGETS[target])
    result = iccm("map", "s.svg", "t.svg", "-o", "o.png", "--size", "480")
    assert result.code == 0, result.err
    picture = on_white(Image.open("o.png"))
    assert differing_share(picture, picture[:, ::-1]) < 0.01  # antialiased edges
    ink = picture.max(axis=2) < 100
    source = rendered("s.svg", 480).max(axis=2) < 100

    def extent(marks):
        rows, columns = (np.flatnonzero(marks.any(axis=axis)) for axis in (1, 0))
        return np.ptp(rows) + 1, np.ptp(columns) + 1, marks.sum()

    (height, width, area), (own_height, own_width, own_area) = extent(ink), extent(source)
    assert width / height == pytest.approx(own_width / own_height, rel=0.03)  # upright
    assert area / (width * height) == pytest.approx(own_area / (own_width * own_height), rel=0.06)  # whole
    assert max(height, width) > 0.5 * min(picture.shape[:2])


@pytest.mark.slow
def test_a_text_that_stays_straight_names_the_remedy(shapes, iccm):
    """The note is gone once the remedy is followed, and the word then fills more of a bent target."""
    (shapes / "wave.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 400 170">'
        '<path d="M20 45C120 0 280 90 380 40V125C280 175 120 85 20 130Z"/></svg>'
    )
    arguments = ("map", "--text", "HI", "wave.svg", "--size", "60")
    straight = iccm(*arguments, "-o", "a.png")
    assert straight.code == 0 and "--fit box" in straight.err
    bent = iccm(*arguments, "--fit", "box", "-o", "b.png")
    assert bent.code == 0 and "--fit box" not in bent.err
