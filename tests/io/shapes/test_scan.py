"""Scans and photographs: uneven light, pencil, gaps, noise."""

import functools
from pathlib import Path

import numpy as np
import pytest
import shapely

from iccm import InputError
from iccm.io.pictures import image_files
from iccm.io.shapes import shape as shapes
from iccm.io.shapes import silhouette

H, W = 300, 400
ANGLE = np.linspace(0, 2 * np.pi, 400, endpoint=False)
TRUE = 200 + 150j + 100 * (1 + 0.2 * np.sin(3 * ANGLE)) * np.exp(1j * ANGLE)
INSIDE = shapely.Polygon(np.column_stack([TRUE.real, TRUE.imag]))
Y, X = np.mgrid[:H, :W] + 0.5


def paper(uneven, noise=3):
    light = 230 * (1 - uneven * (0.5 * X / W + 0.5 * (Y / H) ** 2))
    return light + np.random.default_rng(0).normal(0, noise, (H, W))


@functools.cache
def away():
    """The distance of each pixel from the outline."""
    return shapely.distance(shapely.points(X, Y), INSIDE.exterior)


def line(width, gap=0.0, places=(37,)):
    """The share of each pixel that a line along the outline covers, with gaps of some pixels at several points."""
    cover = np.clip(width / 2 + 0.5 - away(), 0, 1)
    return cover * np.all([np.abs(X + 1j * Y - TRUE[k]) > gap / 2 for k in places], axis=0)


@functools.cache
def filled():
    return shapely.contains_xy(INSIDE, X, Y)


def traced(tmp_path, pixels, part="", name="a.png", **how):
    pixels = np.clip(pixels, 0, 255).astype(np.uint8)
    image_files.write(tmp_path / name, image_files.Image(pixels.reshape(H, W, -1)))
    return shapes.read(f"{tmp_path / name}{part}", **how)


def gap_to_truth(outline):
    ring = shapely.Polygon(np.column_stack([outline.curve.z.real, -outline.curve.z.imag]))
    return shapely.hausdorff_distance(ring.exterior, INSIDE.exterior, densify=0.05)


@pytest.mark.parametrize("uneven", [0.0, 0.7])
@pytest.mark.parametrize("ink, gap", [(40, 0), (120, 0), (40, 8)])
def test_a_closed_line_is_its_inside_in_any_light(tmp_path, uneven, ink, gap):
    cover = line(4, gap)
    outline = traced(tmp_path, paper(uneven) * (1 - cover) + ink * cover * (1 - uneven / 3))
    assert gap_to_truth(outline) < 5 and not outline.holes
    assert "the inside of the line is used; --trace dark uses the line itself" in outline.notes


@pytest.mark.parametrize("table", [False, True])
def test_a_line_in_pieces_is_its_inside(tmp_path, table):
    """None of the pieces spans most of it, and there is a dark table beside the paper."""
    cover = line(4, 14, (0, 70, 160, 220, 310))
    pixels = paper(0.5) * (1 - cover) + 40 * cover
    outline = traced(tmp_path, np.where(table & (X > 360), 30, pixels))
    assert gap_to_truth(outline) < 6 and not outline.holes
    assert "the inside of the line is used; --trace dark uses the line itself" in outline.notes


def test_coins_in_a_photograph():
    """Roman coins from Pompeii under uneven light: scikit-image's picture of 24 coins."""
    import skimage

    pieces = shapes.read_all(f"{Path(skimage.__file__).parent / 'data' / 'coins.png'}")
    coins = [shape.curve for shape in pieces if shape.curve.area > 1000]
    assert len(coins) == 24
    # that of a circle is 1
    assert np.median([4 * np.pi * coin.area / coin.length**2 for coin in coins]) > 0.95


def test_the_line_itself_and_its_inside_by_name(tmp_path):
    pixels = paper(0.3) * (1 - line(6)) + 30 * line(6)
    ring, inside = (traced(tmp_path, pixels, trace=trace) for trace in ("dark", "inside"))
    assert len(ring.holes) == 1 and not inside.holes and inside.notes == ()
    assert inside.curve.area == pytest.approx(ring.curve.area, rel=0.02)


@pytest.mark.parametrize("trace", ["auto", "dark"])
def test_a_dark_shape_under_uneven_light(tmp_path, trace):
    outline = traced(tmp_path, np.where(filled(), 0.4, 1.0) * paper(0.6), trace=trace)
    assert gap_to_truth(outline) < 2.5 and outline.curve.area == pytest.approx(INSIDE.area, rel=0.01)
    assert not outline.holes and not outline.notes


def test_a_light_shape_by_name(tmp_path):
    outline = traced(tmp_path, np.where(filled(), 1.0, 0.4) * paper(0.4), trace="light")
    assert gap_to_truth(outline) < 2.5


def test_a_coloured_thing_on_a_table_with_its_shadow(tmp_path):
    table = paper(0.4, 6)[..., None] * np.array([0.8, 0.85, 0.9])
    table *= 1 - 0.25 * np.exp(-(((X - 215) ** 2 + (Y - 165) ** 2) / 110**2))[..., None]
    thing = np.stack([100 + 60 * np.sin(X / 9), 60 + 30 * np.cos(Y / 7), np.full_like(X, 60)], axis=-1)
    outline = traced(tmp_path, np.where(filled()[..., None], thing, table), name="a.tif")
    assert outline.curve.area == pytest.approx(INSIDE.area, rel=0.06)


def test_a_scene_out_of_focus_is_not_a_table():
    """A thing in front of green and blue that merge: a photograph, though the thing stands out everywhere."""
    green, blue = np.array([20.0, 90, 40]), np.array([20.0, 50, 110])
    share = 1 / (1 + np.exp(-(X - 200) / 60))[..., None]
    scene = green * (1 - share) + blue * share + np.random.default_rng(0).normal(0, 3, (H, W, 1))
    thing = np.where(filled()[..., None], [230, 150, 60], scene).clip(0, 255).astype(np.uint8)
    assert silhouette.interpret(thing, -1).kind == "rectangle"
    assert silhouette.interpret(thing, -1, part="silhouette").kind != "rectangle"


def test_an_open_line_has_no_inside(tmp_path):
    cover = line(4) * (X < 200)
    with pytest.raises(InputError, match=r"no line .*use --trace dark"):
        traced(tmp_path, paper(0.5) * (1 - cover) + 30 * cover, trace="inside")


@pytest.mark.parametrize("trace", ["dark", "light", "inside"])
def test_bare_paper_is_refused(tmp_path, trace):
    with pytest.raises(InputError, match=r"no shape stands out|no line"):
        traced(tmp_path, paper(0.6), trace=trace)


def test_a_large_scan_is_traced_in_its_own_pixels(tmp_path, monkeypatch):
    from iccm.io.shapes import scan

    pixels = np.where(filled(), 0.4, 1.0) * paper(0.6)
    monkeypatch.setattr(scan, "LONGER_SIDE_PIXELS", 200)
    assert gap_to_truth(traced(tmp_path, pixels)) < 3


@pytest.mark.slow
def test_traced_outlines_are_simple():
    rng = np.random.default_rng(1)
    for k in range(18):
        field = rng.random((24, 24)).astype(np.float32)
        field = np.round(field * (2, 4, 1000)[k % 3]) / np.float32((2, 4, 1000)[k % 3])  # half exactly, too
        for outline in silhouette.traced(field)[0]:
            rings = [np.column_stack([z.real, z.imag]) for z in (outline.z, *outline.holes)]
            assert shapely.Polygon(rings[0], rings[1:]).is_valid


def test_scans_must_be_pictures(shapes, iccm):
    result = iccm("map", "square.svg", "blob.svg", "--trace", "dark", "-o", "o.png")
    assert (
        result.code == 2
        and "--trace dark: only works for pictures, and square.svg is not a picture" in result.err
    )


@pytest.mark.parametrize("ground", ["a darker sheet", "a shadow"])
@pytest.mark.parametrize("ink", [40, 90])
def test_a_pencil_line_comes_before_paper_that_is_darker_in_parts(tmp_path, ground, ink):
    """The darker part has more contrast than the pencil, or there is no plain background at all."""
    darker = (X > 310) & (Y > 60) if ground == "a darker sheet" else 1 / (1 + np.exp(-(X + Y - 430) / 15))
    cover = line(2, 8)
    outline = traced(tmp_path, paper(0.05, noise=2) - 80 * darker - ink * cover)
    assert gap_to_truth(outline) < 6 and not outline.holes
    assert "the inside of the line is used; --trace dark uses the line itself" in outline.notes


def test_a_line_inside_a_shape_is_part_of_it(tmp_path):
    """A ring drawn on a coloured shape does not hide the shape."""
    ring = np.abs(np.hypot(X - 200, Y - 150) - 40) < 1.5
    pixels = np.where(filled(), 120, paper(0, noise=1))
    outline = traced(tmp_path, np.where(ring, 20, pixels))
    assert gap_to_truth(outline) < 2 and not any("line" in note for note in outline.notes)


def test_the_background_between_two_shapes_is_not_a_line():
    """A black ring within another, and white inside: the white gap between them is thin and closed."""
    outer, face = (shapely.contains_xy(INSIDE.buffer(reach), X, Y) for reach in (30, -20))
    gap = away() < 4
    black = outer & ~gap & ~face
    pixels = np.where(black, 0, 255).astype(np.uint8)
    reading = silhouette.interpret(pixels[..., None].repeat(3, axis=2), -1)
    assert reading.kind == "plain"
    assert reading.field[black].mean() > 0.95 and reading.field[~black].mean() < 0.05
