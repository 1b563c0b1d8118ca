"""Outlines of pictures: accurate to a fraction of a pixel, few vertices, y up in the core plane."""

import functools
from base64 import b64encode
from pathlib import Path

import numpy as np
import pytest
import shapely

from iccm import InputError
from iccm.io import limits
from iccm.io.pictures import image_files
from iccm.io.pictures.image import Image
from iccm.io.shapes import shape as shapes
from iccm.io.shapes import silhouette
from tests.cases import slow

pytestmark = pytest.mark.usefixtures("solve_once")

SIDE = 200


@functools.cache
def covered(inside, supersampling=16):
    """The share (SIDE, SIDE) of each pixel for which inside(x, y) holds, with pixel centres at +0.5."""
    coordinates = (np.arange(SIDE * supersampling) + 0.5) / supersampling
    fine = inside(coordinates[None, :], coordinates[:, None]).astype(np.float32)
    shares = fine.reshape(SIDE, supersampling, SIDE, supersampling).mean(axis=(1, 3))
    shares.flags.writeable = False  # it is shared
    return shares


def disc(x, y):
    return (x - 90.3) ** 2 + (y - 80.6) ** 2 < 60**2


def turned(x, y):
    """A rectangle of 120 by 80 about (100.2, 95.7), rotated by 20 degrees."""
    w = ((x - 100.2) + 1j * (y - 95.7)) * np.exp(-1j * np.radians(20))
    return (abs(w.real) < 60) & (abs(w.imag) < 40)


TRUE = {
    disc: shapely.Point(90.3, 80.6).buffer(60, quad_segs=500).exterior,
    turned: shapely.LinearRing(
        [
            (100.2 + w.real, 95.7 + w.imag)
            for w in np.exp(1j * np.radians(20)) * np.array([-60 - 40j, 60 - 40j, 60 + 40j, -60 + 40j])
        ]
    ),
}


def ring(outline):
    return shapely.LinearRing(np.column_stack([outline.z.real, outline.z.imag]))


@pytest.mark.parametrize("shape", [disc, turned])
@pytest.mark.parametrize("hard, gap", [(False, 0.5), (True, 0.8)])
def test_the_outline_is_within_a_pixel_and_has_no_staircase(shape, hard, gap):
    field = covered(shape)
    (outline,), ignored = silhouette.traced((field >= 0.5).astype(np.float32) if hard else field)
    assert outline.area == pytest.approx(shapely.Polygon(TRUE[shape]).area, rel=1e-3)
    assert shapely.hausdorff_distance(ring(outline), TRUE[shape], densify=0.02) < gap
    assert outline.z.size < 180 and (outline.holes, ignored) == ((), 0)
    assert np.sort(turns(outline.z))[:-4].max(initial=0) < 10  # degrees; a rectangle has four corners


def turns(z):
    """Angles in degrees between the edges at each vertex of a polygon."""
    edges = np.roll(z, -1) - z
    return np.abs(np.degrees(np.angle(edges / np.roll(edges, 1))))


def leaf(x, y):
    """The intersection of two discs: arcs of radius 90 that meet at two tips."""
    return ((x - 60.4) ** 2 + (y - 97.2) ** 2 < 90**2) & ((x - 141.7) ** 2 + (y - 110.9) ** 2 < 90**2)


@pytest.mark.parametrize("hard, off, tip_distance", [(False, 0.05, 0.6), (True, 0.25, 1.5)])
def test_curves_are_smooth_and_corners_sharp(hard, off, tip_distance):
    """A small picture shown large does not look like a polygon: between its tips the leaf is round."""
    field = covered(leaf)
    (outline,), _ = silhouette.traced((field >= 0.5).astype(np.float32) if hard else field)
    discs = [shapely.Point(*c).buffer(90, quad_segs=2000) for c in ((60.4, 97.2), (141.7, 110.9))]
    truth = shapely.intersection(*discs).exterior
    middle, across = (60.4 + 141.7 + 1j * (97.2 + 110.9)) / 2, (141.7 - 60.4) + 1j * (110.9 - 97.2)
    rise = 1j * across / abs(across) * np.sqrt(90**2 - (abs(across) / 2) ** 2)
    sharpest = np.argsort(turns(outline.z))[-2:]
    for tip in (middle + rise, middle - rise):
        assert np.abs(outline.z[sharpest] - tip).min() < tip_distance
    assert np.sort(turns(outline.z))[:-2].max() < 6
    points = shapely.points(shapely.get_coordinates(shapely.segmentize(ring(outline), 0.5)))
    assert shapely.distance(points, truth).mean() < off


def test_no_shift():
    """The centroid of an antialiased disc is accurate to a hundredth of a pixel, in x and in y."""
    (outline,), _ = silhouette.traced(covered(disc))
    centre = shapely.Polygon(ring(outline)).centroid
    assert abs(centre.x - 90.3) < 0.01 and abs(centre.y - 80.6) < 0.01


def test_a_shape_that_touches_the_edge_ends_there():
    (outline,), _ = silhouette.traced(np.ones((20, 30), np.float32))
    assert np.allclose([outline.z.real.min(), outline.z.real.max()], [0, 30])
    assert np.allclose([outline.z.imag.min(), outline.z.imag.max()], [0, 20])
    assert outline.area == pytest.approx(600)


def written(tmp_path, pixels, alpha=-1, name="a.png"):
    image_files.write(tmp_path / name, image_files.Image(pixels, alpha=alpha))
    return str(tmp_path / name)


def test_read_flips_to_the_core_plane(tmp_path):
    pixels = np.zeros((100, 200, 4), np.uint8)
    pixels[10:30, 50:150, 3] = 255
    shape = shapes.read(written(tmp_path, pixels, alpha=3))
    assert shape.box == (-100j, 200 + 0j) and shape.flip
    low, high = shape.curve.box
    assert abs(low - (50 - 30j)) < 0.8 and abs(high - (150 - 10j)) < 0.8
    assert shape.curve.area == pytest.approx(2000, rel=2e-3)
    assert np.allclose(shape.to_file(50 - 30j), [50, 30])


@pytest.mark.parametrize(
    "shape, ground",
    [(0, 255), (255, 0), ((200, 30, 30), (255, 255, 255)), ((250, 240, 180), (20, 30, 90)), (180, 220)],
)
def test_masks_of_any_two_colours(tmp_path, shape, ground):
    part = covered(disc)[..., None]
    colours = part * np.broadcast_to(shape, 3) + (1 - part) * np.broadcast_to(ground, 3)
    outline = shapes.read(written(tmp_path, np.rint(colours).astype(np.uint8)))
    assert outline.curve.area == pytest.approx(np.pi * 60**2, rel=3e-3)


@pytest.mark.parametrize("suffix, depth", [(".tif", np.uint16), (".exr", np.float32), (".png", np.uint16)])
def test_other_depths(tmp_path, suffix, depth):
    scale = np.iinfo(depth).max if depth is np.uint16 else 1
    pixels = np.repeat(covered(disc)[..., None] * scale, 4, axis=2).astype(depth)
    shape = shapes.read(written(tmp_path, pixels, alpha=3, name=f"a{suffix}"))
    assert shape.curve.area == pytest.approx(np.pi * 60**2, rel=3e-3)


def test_pieces_holes_and_specks(tmp_path):
    mask = np.zeros((100, 100), np.uint8)
    mask[10:60, 10:60] = 255
    mask[20:30, 20:30] = 0
    mask[70:90, 70:90] = 255
    mask[5, 90] = 255
    path = written(tmp_path, mask[..., None])
    shape = shapes.read(path)
    assert shape.curve.area == pytest.approx(2500, rel=2e-3)
    notes = " ".join(shape.notes)
    assert len(shape.holes) == 1 and "1 other outline" in notes and "1 speck" in notes
    assert shapes.read(f"{path}#2").curve.area == pytest.approx(400, rel=5e-3)


def test_a_few_transparent_pixels_are_not_a_shape(tmp_path):
    pixels = np.full((200, 200, 4), 255, np.uint8)
    pixels[60:140, 60:140, :3] = 0
    pixels[0, :30, 3] = 0
    square = shapes.read(written(tmp_path, pixels, alpha=3))
    assert square.curve.area == pytest.approx(6400, rel=2e-3)
    pixels[:10, :30, 3] = 0
    assert shapes.read(written(tmp_path, pixels, alpha=3)).curve.area > 39000
    pixels[...] = 255
    pixels[0, :30, 3] = 0
    assert (
        shapes.read(written(tmp_path, pixels, alpha=3)).curve.area > 39000
    )  # of one colour: there is nothing else


def test_pieces_that_touch_at_a_corner_are_two():
    mask = np.zeros((40, 40), np.float32)
    mask[5:20, 5:20] = mask[20:35, 20:35] = 1
    shape, _ = silhouette.traced(mask)
    assert [round(o.area) for o in shape] == [225, 225]


@pytest.mark.slow
def test_a_mask_with_noise_is_bounded():
    noise = np.random.default_rng(3).random((300, 300)).astype(np.float32)
    shape, ignored = silhouette.traced(noise)
    assert len(shape) <= limits.PIECES and ignored > 1000


@pytest.mark.parametrize(
    "pixels, alpha, message",
    [
        (np.full((9, 9, 3), 7, np.uint8), -1, "colour.*#canvas"),
        (np.zeros((9, 9, 4), np.uint8), 3, "transparent everywhere"),
        (np.full((9, 9, 4), 255, np.uint8), 3, "colour.*#canvas"),
        (np.pad(np.full((1, 1, 1), 255, np.uint8), ((4, 4), (4, 4), (0, 0))), -1, "at least 4 pixels"),
    ],
)
def test_nothing_to_trace_is_one_line(tmp_path, pixels, alpha, message):
    path = written(tmp_path, pixels, alpha)
    with pytest.raises(InputError, match=message) as caught:
        shapes.read(path)
    assert str(caught.value).startswith(path) and "\n" not in str(caught.value)


def test_not_a_picture(tmp_path):
    (tmp_path / "a.png").write_bytes(b"no picture")
    for call in (lambda: shapes.read(f"{tmp_path}/a.png"), lambda: shapes.read(f"{tmp_path}/b.png")):
        with pytest.raises(InputError, match=r"[ab]\.png"):
            call()
    with pytest.raises(InputError, match=r"cannot read a shape from '\.xyz'"):
        shapes.read("a.xyz")


def test_values_that_are_not_finite():
    pixels = np.ones((5, 5, 1), np.float32)
    pixels[2, 2] = np.nan
    with pytest.raises(InputError, match="not finite"):
        silhouette.coverage(pixels, -1)


def of_scikit_image(name):
    import skimage

    return str(Path(skimage.__file__).parent / "data" / name)


@pytest.mark.parametrize(
    "name",
    ["chelsea.png", "rocket.jpg", *map(slow, ("coffee.png", "astronaut.png", "camera.png", "brick.png"))],
)
def test_a_photograph_is_its_rectangle_with_a_note(name):
    path = of_scikit_image(name)
    photo, canvas = shapes.read(path), shapes.read(f"{path}#canvas")
    assert photo.curve.z.size == 4 and photo.curve.box == photo.box == canvas.curve.box
    assert "rectangle" in photo.notes[0] and "#silhouette" in photo.notes[0] and not canvas.notes
    assert photo.coloured and canvas.coloured


@pytest.mark.slow
def test_a_photograph_is_traced_on_request():
    path = of_scikit_image("rocket.jpg")
    whole = shapes.read(path).curve.area
    for traced in (shapes.read(f"{path}#silhouette"), shapes.read(path, trace="light")):
        assert traced.curve.area < 0.6 * whole and not any("rectangle" in note for note in traced.notes)


@pytest.mark.parametrize("name", ["horse.png", slow("retina.jpg"), "coins.png", "color.png"])
def test_a_shape_on_a_background_is_not_a_rectangle(name):
    shape = shapes.read(of_scikit_image(name))
    assert shape.curve.area < 0.8 * abs(shape.box[1] - shape.box[0]) ** 2 / 2
    assert not any("rectangle" in note for note in shape.notes)


def test_a_shape_cut_off_by_the_edge_is_not_a_photograph(tmp_path):
    """Shoulders at the lower edge, in two colours: a bust."""
    y, x = np.mgrid[:SIDE, :SIDE]
    bust = ((x - 90) ** 2 + (y - 70) ** 2 < 40**2) | ((abs(x - 100) < 70) & (y > 100 + 20 * np.sin(x / 20)))
    pixels = np.where(bust[..., None], np.where(y[..., None] > 120, (40, 60, 200), (230, 170, 120)), 250)
    shape = shapes.read(written(tmp_path, pixels.astype(np.uint8)))
    assert shape.curve.area == pytest.approx(bust.sum(), rel=0.01) and shape.coloured


@pytest.mark.parametrize("name", ["cross", "horizon", "bands"])
def test_a_flag_or_a_landscape_is_a_rectangle(tmp_path, name):
    """What reaches three or four sides has no background, however plain its colours are."""
    y, x = np.mgrid[:120, :SIDE]
    masks = {
        "cross": (abs(x - 70) < 14) | (abs(y - 60) < 14),
        "horizon": y > 80 + 9 * np.sin(x / 30),
        "bands": x > 110,
    }
    pixels = np.where(masks[name][..., None], (200, 30, 40), (240, 240, 250)).astype(np.uint8)
    shape = shapes.read(written(tmp_path, pixels))
    assert shape.curve.area == 120 * SIDE and "rectangle" in shape.notes[0] and shape.coloured


def test_the_canvas_of_any_picture(tmp_path):
    pixels = np.zeros((50, 80, 4), np.uint8)
    pixels[10:30, 10:40] = 255
    path = written(tmp_path, pixels, alpha=3)
    assert (
        shapes.read(f"{path}#canvas").curve.area == 4000
        and shapes.read(f"{path}#canvas#1").curve.area == 4000
    )
    assert shapes.read(f"{path}#silhouette").curve.area == pytest.approx(600, rel=0.01)
    with pytest.raises(InputError, match="no 'face' in the file"):
        shapes.read(f"{path}#face")


def test_lines_around_several_things_are_all_filled(tmp_path):
    y, x = np.mgrid[:SIDE, :SIDE]
    rings = [(60, 70, 40), (150, 120, 25)]
    away = np.min([abs(np.hypot(x - a, y - b) - r) for a, b, r in rings], axis=0)
    outlines = shapes.read_all(written(tmp_path, np.where(away < 1.5, 0, 255).astype(np.uint8)[..., None]))
    assert [round(outline.curve.area) for outline in outlines] == [
        pytest.approx(np.pi * (r + 1.5) ** 2, rel=0.02) for _, _, r in rings
    ]


@pytest.mark.parametrize(
    "inside, coloured", [((200, 30, 30), False), (((200, 30, 30), (30, 90, 200)), True), ((0, 0, 0), False)]
)
def test_a_picture_has_colours_of_its_own_where_it_paints_more_than_one(tmp_path, inside, coloured):
    part, x = covered(disc)[..., None], np.arange(SIDE)[None, :, None]
    colours = np.broadcast_to(inside, (2, 3))
    painted = np.where(x < 70, colours[0], colours[1])
    on_white = np.rint(part * painted + (1 - part) * 255).astype(np.uint8)
    assert shapes.read(written(tmp_path, on_white)).coloured == coloured
    clear = np.concatenate([np.broadcast_to(painted, on_white.shape), part * 255], axis=2).astype(np.uint8)
    assert shapes.read(written(tmp_path, clear, alpha=3)).coloured == coloured


def test_a_drawing_on_paper_is_its_own_texture_without_the_paper(tmp_path):
    """Left half red, right half a red close to the background's; the edge has no fringe of the background."""
    from iccm.io.shapes import own_picture
    from iccm.io.spec import Spec

    part, x = covered(disc)[..., None], np.arange(SIDE)[None, :, None]
    painted = np.where(x < 90, (200, 30, 40), (200, 180, 40))
    path = written(tmp_path, np.rint(part * painted + (1 - part) * (20, 200, 60)).astype(np.uint8))
    picture = own_picture.read(Spec.of(path))
    assert picture.alpha == 3 and picture.pixels.shape == (SIDE, SIDE, 4)
    alpha = picture.pixels[..., 3] / 255
    assert np.abs(alpha - part[..., 0]).max() < 0.15 and set(alpha[part[..., 0] == 1]) == {1}
    left = (part[..., 0] > 0.3) & (x[..., 0] < 85)
    assert np.abs(picture.pixels[left][:, :3].astype(int) - (200, 30, 40)).max() <= 40
    assert np.abs(picture.pixels[left][:, :3].astype(int) - (200, 30, 40)).mean() < 2


@pytest.mark.slow
def test_a_photograph_is_carried_without_a_texture_given(tmp_path, iccm, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "disc.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><circle cx="4.5" cy="4.5" r="4"/></svg>'
    )
    result = iccm("map", of_scikit_image("chelsea.png"), "disc.svg", "--size", "64", "-o", "o.png")
    assert result.code == 0 and "#silhouette" not in result.err  # it shows itself, as was asked for
    cat = image_files.read(of_scikit_image("chelsea.png")).pixels
    picture = image_files.read("o.png").pixels
    seen = picture[picture[..., 3] == 255][:, :3]
    assert np.abs(seen.mean(axis=0) - cat.reshape(-1, 3).mean(axis=0)).max() < 12  # no checkerboard
    result = iccm("map", "disc.svg", of_scikit_image("rocket.jpg"), "--size", "64", "-o", "p.png")
    assert result.code == 0 and "#silhouette" in result.err
    assert (image_files.read("p.png").pixels[..., 3] == 255).mean() > 0.6


def wrapped_in_svg(tmp_path, pixels, attributes, more=""):
    data = b64encode(image_files.as_png(Image(pixels, alpha=3 if pixels.shape[2] == 4 else -1))).decode()
    image = f'<image {attributes} href="data:image/png;base64,{data}"/>'
    (tmp_path / "w.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 200">{image}{more}</svg>'
    )
    return shapes.read(f"{tmp_path}/w.svg")


def disc_with_a_hole():
    i, j = np.mgrid[:80, :160] + 0.5
    away = np.hypot(i - 40, j - 60)
    pixels = np.full((80, 160, 4), 90, np.uint8)
    pixels[..., 3] = np.where((away < 30) & (away > 10), 255, 0)
    return pixels


def test_a_drawing_that_wraps_a_picture_with_alpha_is_its_silhouette(tmp_path):
    """At the position given by its transform and proportions: twice as large, in the middle of its rectangle."""
    place = 'x="10" y="0" width="160" height="100" transform="translate(-20 10) scale(2 1)"'
    shape = wrapped_in_svg(tmp_path, disc_with_a_hole(), place)
    z = shape.to_file(shape.curve.z)
    assert np.allclose([*z.min(axis=0), *z.max(axis=0)], [60, 30, 180, 90], atol=0.6)
    assert shape.curve.area == pytest.approx(2 * np.pi * 900, rel=0.01) and len(shape.holes) == 1


def test_other_drawings_with_a_picture_have_its_rectangle(tmp_path):
    place = 'x="10" y="0" width="160" height="80"'
    opaque = wrapped_in_svg(tmp_path, np.ascontiguousarray(disc_with_a_hole()[..., :3]), place)
    with_rectangle = wrapped_in_svg(
        tmp_path, disc_with_a_hole(), place, '<rect x="200" width="20" height="10"/>'
    )
    assert opaque.curve.area == with_rectangle.curve.area == 160 * 80


def test_a_large_picture_is_judged_by_a_small_one_and_traced_in_its_own_pixels(tmp_path, monkeypatch):
    """Shapes on a plain background keep their accuracy; the inside of a line has that of the small picture."""
    from iccm.io.shapes import scan

    monkeypatch.setattr(scan, "LONGER_SIDE_PIXELS", 80)
    pixels = np.rint(255 * (1 - 0.8 * covered(disc)))[..., None].astype(np.uint8)
    reading = silhouette.interpret(pixels, -1)
    assert reading.kind == "plain" and reading.field.shape == (SIDE, SIDE)
    (outline,), _ = silhouette.traced(reading.field)
    assert shapely.hausdorff_distance(ring(outline), TRUE[disc], densify=0.02) < 0.5
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    ring_drawn = np.abs(np.hypot(x - 90.3, y - 80.6) - 58) < 3
    shape = shapes.read(written(tmp_path, np.where(ring_drawn, 30, 240).astype(np.uint8)[..., None]))
    assert shape.curve.area == pytest.approx(np.pi * 61**2, rel=0.03)
    photo = image_files.read(of_scikit_image("chelsea.png"))
    assert silhouette.interpret(photo.pixels, photo.alpha).kind == "rectangle"


@pytest.mark.slow
def test_a_photograph_is_decoded_once(tmp_path, monkeypatch, iccm):
    """For its shape and for its pixels; again if it has changed in between, or memory is limited."""
    from iccm.io.pictures import image_files as decoders

    monkeypatch.chdir(tmp_path)
    photo = np.random.default_rng(5).integers(0, 256, (40, 60, 3), dtype=np.uint8)
    decoders.write("photo.png", decoders.Image(photo))
    Path("leaf.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 60 40"><path d="M2 2L58 9L50 38L9 30z"/></svg>'
    )
    decoded, read = [], decoders.read

    def counted(path, **options):
        decoded.append(Path(path).name)
        return read(path, **options)

    monkeypatch.setattr(decoders, "read", counted)
    pixels = []
    for more, times in (((), 1), (("--memory", "2G"), 2), (("--colorspace", "sRGB"), 2)):
        result = iccm("map", "photo.png", "leaf.svg", "-o", "o.png", "--size", "60", "--force", *more)
        assert result.code == 0 and decoded.count("photo.png") == times, result.err
        decoded.clear()
        pixels.append(read("o.png").pixels)
    assert all(np.array_equal(picture, pixels[0]) for picture in pixels)
    assert iccm("map", "photo.png", "leaf.svg", "-o", "o.npz").code == 0
    decoders.write("photo.png", decoders.Image(255 - photo[:, ::-1]))
    decoded.clear()
    assert iccm("map", "photo.png", "leaf.svg", "-o", "p.png", "--size", "60").code == 0
    assert not np.array_equal(read("p.png").pixels, pixels[0])
