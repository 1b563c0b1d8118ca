"""Drawings rendered as pictures: colours as numbers, positions, hidden elements; no other file is read."""

import json
import re
import signal
import struct
import subprocess
import sys
from base64 import b64encode

import numpy as np
import pytest

from iccm import InputError
from iccm.io import limits
from iccm.io.artwork import rendering
from iccm.io.pictures import image_files
from iccm.io.pictures.image import Image
from iccm.io.run import texture
from iccm.io.run.job import Job
from iccm.io.shapes import shape as shapes
from iccm.io.svg.lettering import Lettering

SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" {}>{}</svg>'
CANVAS = 'viewBox="0 0 40 20"'
WHOLE = (-20j, 40 + 0j)


@pytest.fixture
def rendered(tmp_path):
    """Write an SVG body and render a box of it, with ten pixels per unit; return pixels by x, y in file units."""

    def render(body, attributes=CANVAS, box=WHOLE):
        path = tmp_path / "a.svg"
        path.write_text(SVG.format(attributes, body))
        extent = box[1] - box[0]
        rendered_drawing = rendering.render(path, box, (round(10 * extent.real), round(10 * extent.imag)))
        assert (
            rendered_drawing.alpha,
            rendered_drawing.associated,
            rendered_drawing.colorspace,
            rendered_drawing.pixels.dtype,
        ) == (
            3,
            False,
            "sRGB",
            np.uint8,
        )

        def pixel_at(x, y):
            column, row = (int(10 * (x - box[0].real)), int(10 * (y + box[1].imag)))
            return tuple(rendered_drawing.pixels[row, column].tolist())

        return pixel_at

    return render


def test_colours_are_straight_and_composited_in_srgb(rendered):
    pixel_at = rendered(
        '<rect width="10" height="20" fill="#c86432" fill-opacity=".5"/>'
        '<rect x="10" width="10" height="20" fill="#c86432"/>'
        '<rect x="15" width="10" height="20" fill="#0000ff" opacity=".25"/>'
    )
    assert pixel_at(5, 5) == pytest.approx(
        (200, 100, 50, 128), abs=1
    )  # premultiplied it would be 100, 50, 25
    assert pixel_at(12, 5) == (200, 100, 50, 255)
    assert pixel_at(17, 5) == pytest.approx((150, 75, 0.75 * 50 + 64, 255), abs=1)
    assert pixel_at(22, 5) == pytest.approx((0, 0, 255, 64), abs=1) and pixel_at(30, 5) == (0, 0, 0, 0)


def test_places_are_those_of_the_reader(rendered):
    body = '<rect x="2" y="3" width="4" height="5" fill="red"/><rect x="50%" width="25%" height="20%" fill="lime"/>'
    for box in (WHOLE, (-9j, 24 - 1j), (-10 - 30j, 60 + 10j)):
        pixel_at = rendered(body, box=box)
        assert pixel_at(3, 4)[:2] == (255, 0) and pixel_at(5.9, 7.9)[3] == 255
        assert pixel_at(1.9, 4)[3] == pixel_at(3, 8.1)[3] == pixel_at(6.1, 4)[3] == 0
        assert pixel_at(21, 3.9)[:2] == (0, 255) and pixel_at(21, 4.1)[3] == 0
    beyond = rendered('<rect x="35" y="15" width="10" height="10" fill="red"/>', box=(-30j, 50 + 0j))
    assert beyond(44, 24)[0] == 255  # of the canvas
    scaled = rendered(
        '<rect width="10" height="10" fill="red"/>', 'width="80" height="40" viewBox="0 0 40 20"'
    )
    assert scaled(9, 9)[3] == 255 and scaled(11, 9)[3] == 0
    without = rendered('<rect x="5" width="10" height="10" fill="red"/>', "")
    assert without(6, 9)[3] == 255 and without(4, 9)[3] == 0


def test_hidden_elements_are_not_rendered(rendered):
    green = '<rect width="40" height="20" fill="lime"/>'
    for hidden in (
        '<circle id="pin-a" cx="20" cy="10" r="9" fill="red"/>',
        '<path id="stroke-b" d="M0 10H40" stroke="red" stroke-width="9"/>',
        '<g display="none"><rect width="40" height="20"/></g>',
        '<style>.off{display:none}</style><rect class="off" width="40" height="20"/>',
        '<rect width="40" height="20" visibility="hidden"/>',
        '<script>0</script><foreignObject width="40" height="20"/>',
    ):
        assert rendered(green + hidden)(20, 10) == (0, 255, 0, 255), hidden
    assert rendered(green + '<rect id="rigid-logo" width="40" height="20" fill="red"/>')(20, 10)[0] == 255
    assert (
        rendered(green + '<g id="pinboard"><rect width="40" height="20" fill="red"/></g>')(20, 10)[0] == 255
    )


def test_nothing_outside_the_file_is_read(rendered, tmp_path):
    image_files.write(tmp_path / "red.png", Image(np.full((8, 8, 3), (255, 0, 0), np.uint8)))
    (tmp_path / "red.css").write_text("rect{fill:red}")
    green = '<rect width="40" height="20" fill="lime"/>'
    for link in (
        f"{tmp_path}/red.png",
        f"file://{tmp_path}/red.png",
        "red.png",
        "http://127.0.0.1:9/red.png",
    ):
        for name in ("href", "xlink:href"):
            image = f'<image width="40" height="20" preserveAspectRatio="none" {name}="{link}"/>'
            assert rendered(green + image)(20, 10) == (0, 255, 0, 255), image
    assert rendered(f'<style>@import url("{tmp_path}/red.css");</style>{green}')(20, 10) == (0, 255, 0, 255)
    inner = SVG.format(CANVAS, f'<image width="40" height="20" href="{tmp_path}/red.png"/>')
    embedded = f'<image width="40" height="20" href="data:image/svg+xml;base64,{b64encode(inner.encode()).decode()}"/>'
    assert rendered(green + embedded)(20, 10) == (0, 255, 0, 255)


def test_an_embedded_picture_is_shown(rendered, tmp_path):
    image_files.write(tmp_path / "a.png", Image(np.full((8, 16, 3), (255, 0, 0), np.uint8)))
    data = b64encode((tmp_path / "a.png").read_bytes()).decode()
    for kind in ("image/png", ""):  # old drawings of Illustrator omit it
        pixel_at = rendered(f'<image x="4" width="16" height="8" href="data:{kind};base64,{data}"/>')
        assert (
            pixel_at(5, 1) == pixel_at(19, 7) == (255, 0, 0, 255)
            and pixel_at(21, 4)[3] == pixel_at(3, 4)[3] == 0
        )


def test_letters_are_where_the_shape_has_them(tmp_path):
    path = tmp_path / "a.svg"
    text = '<text x="2" y="15" font-family="DejaVu Sans" font-size="16" transform="translate(1 0)" fill="red">Hf</text>'
    path.write_text(SVG.format(CANVAS, f"<g fill='blue'>{text}</g>"))
    painted = shapes.read_drawing(shapes.Spec(path)).painted
    if painted.is_empty:
        pytest.skip("no such font")
    pixels = rendering.render(path, WHOLE, (400, 200)).pixels
    assert pixels[..., 3].sum() / 255 / 100 == pytest.approx(painted.area, rel=0.01)
    assert set(map(tuple, pixels[pixels[..., 3] == 255][:, :3].tolist())) == {(255, 0, 0)}
    columns = np.flatnonzero(pixels[..., 3].any(axis=0))
    assert columns[[0, -1]] / 10 == pytest.approx(np.array(painted.bounds)[[0, 2]], abs=0.15)


def test_twice_the_same(tmp_path):
    path = tmp_path / "a.svg"
    path.write_text(
        SVG.format(CANVAS, '<circle cx="9" cy="9" r="7.3" fill="#123456" filter="url(#f)"/><text>A</text>')
    )
    assert rendering.render_png(path, WHOLE, (333, 77)) == rendering.render_png(path, WHOLE, (333, 77))


def test_drawings_that_cannot_be_rendered_are_refused_in_one_line(tmp_path, monkeypatch):
    path, script = tmp_path / "a.svg", tmp_path / "rasterize.py"
    path.write_text(SVG.format(CANVAS, ""))
    ends = {
        "a reason": "raise SystemExit('a reason')",
        "ended early": "import os; os._exit(9)",
        "boom": "1 / 0 # boom",
    }
    for words, code in ends.items():
        script.write_text(code)
        monkeypatch.setattr(rendering.rasterize, "__file__", str(script))
        with pytest.raises(InputError) as caught:
            rendering.render(path, WHOLE, (4, 2))
        message = str(caught.value)
        assert re.match(f"{re.escape(str(path))}: .*render", message) and "\n" not in message
        assert words in message or words == "boom"


HOSTILE = {
    "masks": "".join(
        f'<mask id="m{k}"><g mask="url(#m{k - 1})"><rect width="9" height="9" mask="url(#m{k - 1})"/></g></mask>'
        for k in range(1, 40)
    )
    + '<mask id="m0"/><rect width="40" height="20" mask="url(#m39)"/>',
    "turbulence": '<filter id="f"><feTurbulence numOctaves="1000000000" baseFrequency=".1"/></filter>'
    '<rect width="40" height="20" filter="url(#f)"/>',
}


@pytest.mark.parametrize("name", HOSTILE)
def test_endless_renderings_are_stopped(tmp_path, monkeypatch, name):
    path = tmp_path / "a.svg"
    path.write_text(SVG.format(CANVAS, HOSTILE[name]))
    monkeypatch.setattr(limits, "RENDER_SECONDS", 0.5)
    with pytest.raises(InputError, match="rendering takes longer") as caught:
        rendering.render(path, WHOLE, (400, 200))
    assert "--texture" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "body, coloured",
    [
        ('<rect width="9" height="9"/><rect x="20" width="9" height="9" fill="#000"/>', False),
        (
            '<rect width="9" height="9"/><rect x="20" width="9" height="9" fill="black" style="fill:#000000"/>',
            False,
        ),
        ('<path d="M0 0h9v9h-9z" fill="none" stroke="red"/>', False),
        ('<rect width="9" height="9"/><rect x="20" width="9" height="9" display="none" fill="red"/>', False),
        ('<rect width="9" height="9"/><circle id="pin-a" r="9" fill="red"/>', False),
        ('<rect width="9" height="9"/><rect x="20" width="9" height="9" fill="red"/>', True),
        ('<rect width="9" height="9"/><rect x="20" width="9" height="9" opacity=".4"/>', True),
        ('<g fill-opacity=".4"><rect width="9" height="9"/></g><rect x="20" width="9" height="9"/>', True),
        ('<rect width="9" height="9" stroke="red"/>', True),
        ('<path d="M0 0h9v9h-9zM3 3h2" fill="none" stroke="red"/>', False),  # ink of one colour
        ('<linearGradient id="g"/><rect width="9" height="9" fill="url(#g)"/>', True),
        ('<rect width="9" height="9"/><text>a</text>', True),
    ],
)
def test_drawings_with_colours_of_their_own(tmp_path, body, coloured):
    path = tmp_path / "a.svg"
    path.write_text(SVG.format(CANVAS, body))
    assert shapes.read_drawing(shapes.Spec(path)).coloured == coloured


SOURCE = (
    '<rect x="2" y="2" width="16" height="16" fill="#c86432" fill-opacity=".5"/>'
    '<rect x="3" y="3" width="5" height="4" fill="#0000c8"/>'
)


def pixel_reader(name):
    pixels = image_files.read(name).pixels
    height, width = pixels.shape[:2]
    return lambda x, y: tuple(pixels[int(y * height), int(x * width)].tolist())


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.svg").write_text(SVG.format('viewBox="0 0 20 20"', SOURCE))
    square = '<rect x="20" y="10" width="160" height="160"/>'
    (tmp_path / "b.svg").write_text(SVG.format('viewBox="0 0 200 180"', square))
    return tmp_path


@pytest.mark.slow
def test_a_drawing_is_its_own_picture(files, iccm):
    transparent = "--background", "transparent"
    assert iccm("map", "a.svg", "b.svg", "--size", "100", *transparent, "-o", "o.png").code == 0
    pixel_at = pixel_reader("o.png")
    assert pixel_at(0.6, 0.6) == pytest.approx((200, 100, 50, 128), abs=2)
    # the second rectangle begins a sixteenth of the width inside: x 30 of 200 and y 20 of 180
    assert pixel_at(0.2, 0.2) == pytest.approx((0, 0, 200, 255), abs=2) and pixel_at(0.7, 0.2)[2] < 60
    assert pixel_at(0.02, 0.5)[3] == 0
    assert iccm("map", "a.svg", "b.svg", "--size", "100", "--texture", "checker", "-o", "c.png").code == 0
    assert pixel_reader("c.png")(0.6, 0.6)[3] == 255
    assert iccm("map", "b.svg", "b.svg", "--size", "100", "--texture", "a.svg", "-o", "d.png").code == 0
    assert pixel_reader("d.png")(0.6, 0.6) == pytest.approx((200, 100, 50, 128), abs=2)


def test_a_file_called_checker_is_that_file(files, iccm):
    image_files.write(files / "grey.png", Image(np.full((8, 8, 3), 77, np.uint8)))
    (files / "grey.png").rename(files / "checker")
    assert iccm("map", "b.svg", "b.svg", "--size", "50", "--texture", "checker", "-o", "o.png").code == 0
    assert pixel_reader("o.png")(0.5, 0.5) == (77, 77, 77, 255)


def test_the_checkerboard_is_remembered_where_a_job_is_written_down():
    job = Job(source="a.svg", target="b.svg", texture="checker")
    assert job.texture is None and job.checkered and "checker" not in job.inputs
    again = Job(**job.model_dump())
    assert again.checkered and again == job and not Job(source="a.svg", target="b.svg").checkered


@pytest.fixture
def rendered_sizes(monkeypatch):
    """Return a list to which the size of each rendering is added."""
    sizes = []
    render = rendering.render
    monkeypatch.setattr(
        rendering,
        "render",
        lambda path, box, size, **how: sizes.append(size) or render(path, box, size, **how),
    )
    return sizes


@pytest.mark.slow
def test_a_drawing_is_rendered_as_finely_as_the_map_samples_it(files, rendered_sizes):
    """A narrow part of the source is magnified to most of a large picture."""
    from iccm.io.run.execute import run

    for size in (200, 1500):
        run(Job(source="a.svg", target="b.svg", size=(size,), output=(f"{size}.png",)))
    assert rendered_sizes[0] == (1024, 1024) == rendered_sizes[1] and len(rendered_sizes) == 3
    extent = 16 * (1 + 2 * texture.BESIDE_SIZE_SHARE)  # units across; 16 units become 160 of 200, 1200 pixels
    assert rendered_sizes[2][0] == pytest.approx(extent * 1200 / 16, rel=0.05)
    job = Job(source="a.svg", target="b.svg", size=(900,), output=("m.png",), max_pixels=900_000, force=True)
    run(job)
    assert 800_000 < rendered_sizes[-1][0] * rendered_sizes[-1][1] <= 900_000


def test_the_letters_of_a_drawing_are_outlined_once_for_all_its_sizes(tmp_path, monkeypatch):
    path = tmp_path / "a.svg"
    path.write_text(
        SVG.format(CANVAS, '<text x="2" y="15" font-size="12" font-family="DejaVu Sans">Qg</text>')
    )
    outlined = []
    painted = Lettering.painted
    monkeypatch.setattr(Lettering, "painted", lambda *args: outlined.append(args) or painted(*args))
    coarse, fine = (rendering.render(path, WHOLE, size).pixels for size in ((40, 20), (80, 40)))
    assert len(outlined) == 1
    halves = fine[..., 3].reshape(20, 2, 40, 2).mean(axis=(1, 3))
    assert np.abs(halves - coarse[..., 3]).max() < 40  # the same letters, at half the size
    assert coarse[..., 3].max() == 255
    path.write_text(path.read_text().replace("Qg", "i"))
    assert not np.array_equal(rendering.render(path, WHOLE, (40, 20)).pixels, coarse)


@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="alarms of POSIX")
def test_the_renderer_ends_without_who_started_it():
    """It would render for minutes with nobody to stop it."""
    tall = '<feMorphology operator="dilate" radius="900"/>' * 9
    document = (
        '<svg xmlns="http://www.w3.org/2000/svg" width="4000" height="4000">'
        f'<filter id="f" x="0" y="0" width="1" height="1">{tall}</filter>'
        '<path d="M0 0H4000V4000H9Z" filter="url(#f)"/></svg>'
    )
    command = [sys.executable, "-P", rendering.rasterize.__file__, "1"]
    result = subprocess.run(command, input=document.encode(), capture_output=True, timeout=60)
    assert result.returncode == -signal.SIGALRM


@pytest.mark.slow
def test_a_small_result_needs_no_large_rendering(files, rendered_sizes, monkeypatch):
    """However much of the source a pixel shows: a number of texels for each pixel, or the size before the map is
    known.
    """
    monkeypatch.setattr(texture, "density_needed", lambda fits, step: 1e3)
    from iccm.io.run.execute import run

    monkeypatch.setattr(limits, "RENDERED_PIXELS", 2_000_000)
    for size in (24, 40, 90):
        run(Job(source="a.svg", target="b.svg", size=(size,), output=(f"{size}.png",)))
    sizes = [width * height for width, height in rendered_sizes if (width, height) != (1024, 1024)]
    assert len(sizes) == 2 and sizes[0] == pytest.approx(40 * 36 * texture.MOST_PIXELS_PER_PIXEL, rel=0.01)
    assert sizes[1] == pytest.approx(limits.RENDERED_PIXELS, rel=0.01)


@pytest.mark.slow
def test_a_mesh_holds_the_rendered_drawing(files, iccm):
    (files / "m.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .4 .5 .2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"
    )
    assert iccm("map", "a.svg", "m.obj", "-o", "o.glb").code == 0
    data = (files / "o.glb").read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    scene = json.loads(data[20 : 20 + length])
    assert scene["images"][0]["mimeType"] == "image/png"
    view = scene["bufferViews"][scene["images"][0]["bufferView"]]
    start = 20 + length + 8 + view.get("byteOffset", 0)
    (files / "held.png").write_bytes(data[start : start + view["byteLength"]])
    pixel_at = pixel_reader("held.png")
    assert pixel_at(0.5, 0.6) == pytest.approx((200, 100, 50, 128), abs=1) and pixel_at(0.2, 0.2) == (
        0,
        0,
        200,
        255,
    )


def test_a_stroke_at_the_outline_is_shown_in_its_whole_width(files, iccm):
    """The frame also surrounds strokes: 18 units with a border of 2, half of it outside of the fill."""
    (files / "a.svg").write_text(
        SVG.format(
            'viewBox="0 0 20 20"',
            '<rect x="2" y="2" width="16" height="16" fill="lime" stroke="red" stroke-width="2"/>',
        )
    )
    assert iccm("map", "a.svg", "b.svg", "--size", "200", "-o", "o.png").code == 0
    pixels = image_files.read("o.png").pixels
    row = pixels[90]
    red = (row[:, 0] > 200) & (row[:, 1] < 50) & (row[:, 3] == 255)
    assert red[20:100].sum() == pytest.approx(160 * 2 / 18, abs=2) and red[20:35].all()
    assert tuple(row[60].tolist()) == (0, 255, 0, 255)
