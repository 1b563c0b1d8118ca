"""Outlines of pictures: right to a part of a pixel, few vertices, y up in the core plane."""

import numpy as np
import pytest
import shapely

from iccm import InputError
from iccm.io import limits
from iccm.io.pictures import image_files
from iccm.io.shapes import shape as shapes
from iccm.io.shapes import silhouette

SIDE = 200


def covered(inside, supersampling=16):
    """(SIDE, SIDE) share of each pixel for which inside(x, y) holds, pixel centres at +0.5."""
    at = (np.arange(SIDE * supersampling) + 0.5) / supersampling
    fine = inside(at[None, :], at[:, None]).astype(np.float32)
    return fine.reshape(SIDE, supersampling, SIDE, supersampling).mean(axis=(1, 3))


def disc(x, y):
    return (x - 90.3) ** 2 + (y - 80.6) ** 2 < 60**2


def turned(x, y):
    """A rectangle of 120 by 80 about (100.2, 95.7), turned by 20 degrees."""
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
@pytest.mark.parametrize("hard, gap, most", [(False, 0.5, 70), (True, 0.8, 60)])
def test_the_outline_is_within_a_pixel_and_has_no_staircase(shape, hard, gap, most):
    field = covered(shape)
    (outline,), rest = silhouette.traced((field >= 0.5).astype(np.float32) if hard else field)
    assert outline.area == pytest.approx(shapely.Polygon(TRUE[shape]).area, rel=1e-3)
    assert shapely.hausdorff_distance(ring(outline), TRUE[shape], densify=0.02) < gap
    assert outline.z.size < most and (outline.holes, rest) == ((), 0)


def test_no_shift():
    """The centroid of an antialiased disc is right to a hundredth of a pixel, in x and in y."""
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
    found = shapes.read(written(tmp_path, np.rint(colours).astype(np.uint8)))
    assert found.curve.area == pytest.approx(np.pi * 60**2, rel=3e-3)


@pytest.mark.parametrize("suffix, depth", [(".tif", np.uint16), (".exr", np.float32), (".png", np.uint16)])
def test_other_depths(tmp_path, suffix, depth):
    scale = np.iinfo(depth).max if depth is np.uint16 else 1
    pixels = np.repeat(covered(disc)[..., None] * scale, 4, axis=2).astype(depth)
    found = shapes.read(written(tmp_path, pixels, alpha=3, name=f"a{suffix}"))
    assert found.curve.area == pytest.approx(np.pi * 60**2, rel=3e-3)


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


def test_a_few_transparent_pixels_are_no_shape(tmp_path):
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
    found, _ = silhouette.traced(mask)
    assert [round(o.area) for o in found] == [225, 225]


def test_a_mask_with_noise_is_bounded():
    noise = np.random.default_rng(3).random((300, 300)).astype(np.float32)
    found, rest = silhouette.traced(noise)
    assert len(found) <= limits.PIECES and rest > 1000


@pytest.mark.parametrize(
    "pixels, alpha, message",
    [
        (np.full((9, 9, 3), 7, np.uint8), -1, "one colour"),
        (np.zeros((9, 9, 4), np.uint8), 3, "transparent everywhere"),
        (np.full((9, 9, 4), 255, np.uint8), 3, "one colour"),
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
    with pytest.raises(InputError, match=r"no shape is read from '\.xyz'"):
        shapes.read("a.xyz")


def test_values_that_are_not_finite():
    pixels = np.ones((5, 5, 1), np.float32)
    pixels[2, 2] = np.nan
    with pytest.raises(InputError, match="not finite"):
        silhouette.coverage(pixels, -1)
