"""The part of the target that a picture shows, the part of the source that a texture covers, holes, and blank
pictures.
"""

import numpy as np
import pytest

from iccm.io.pictures import image_files

pytestmark = pytest.mark.usefixtures("solve_once")

SMALL = ("--size", "64")
PICTURE = ("--method", "paper", "--order", "0", "--vertices", "60", *SMALL)


def read(name):
    return image_files.read(name)


def write(name, pixels):
    image_files.write(name, image_files.Image(pixels, alpha=3 if pixels.shape[2] == 4 else -1))


def test_a_shape_that_leaves_its_canvas_gets_a_note(shapes, iccm):
    drawing = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} 100"><path d="M10 10H90V90H10Z"/></svg>'
    )
    for name, width in (("half", 50), ("out", 5)):
        (shapes / f"{name}.svg").write_text(drawing.format(width))
    typed = ("--texture-box", "viewbox", "--target-box", "viewbox")
    done = iccm("map", "half.svg", "out.svg", *PICTURE, *typed)
    assert [line for line in done.lines if line.startswith("note")] == [
        "note: out.svg: 100% of its extent lies outside its canvas and is not shown; use --target-box "
        "bbox to show all of it",
        "note: half.svg: 50% of its extent lies outside its canvas, beyond the texture; use "
        "--texture-box bbox to cover it",
        "note: the picture is empty: no part of the target lies in the area that it shows",
    ]
    assert "canvas" not in iccm("map", "half.svg", "disk.svg", *PICTURE).err
    done = iccm("map", "half.svg", "out.svg", *PICTURE, "--force")
    assert [line for line in done.lines if line.startswith("note")] == [
        "note: out.svg: lies outside its canvas, so pictures show the shape's bounding box; use "
        "--target-box viewbox to show the canvas"
    ]


@pytest.mark.slow
def test_a_small_part_of_a_large_canvas_fills_the_picture(shapes, iccm):
    part = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 800 400"><path d="M100 50h80v40h-80z"/></svg>'
    )
    (shapes / "part.svg").write_text(part)
    result = iccm("map", "disk.svg", "part.svg", "-o", "small.png", "--stmap", "small.tif", "--size", "64")
    (note,) = (line for line in result.lines if line.startswith("note: part.svg: "))
    assert all(word in note for word in ("10%", "canvas", "box")) and len(result.lines) > 1
    assert read("small.png").pixels.shape == (32, 64, 4)
    assert (read("small.png").pixels[..., 3] == 255).mean() > 0.9
    assert read("small.tif").pixels.shape[:2] == (32, 64)
    iccm("map", "disk.svg", "part.svg", "-o", "all.png", "--size", "64", "--target-box", "viewbox")
    assert 0 < (read("all.png").pixels[..., 3] > 0).mean() < 0.02
    iccm("map", "part.svg", "disk.svg", "-o", "box.png", "--size", "64", "--target-box", "bbox")
    assert (read("box.png").pixels[..., 3] == 255).mean() > 0.75
    bent = iccm(
        "deform", "part.svg", "--pin", "110,60:112,62", "--pin", "170,80:170,80", "-o", "d.png", *SMALL
    )
    assert (
        "note: part.svg: " in bent.err
        and "10%" in bent.err
        and (read("d.png").pixels[..., 3] > 0).mean() > 0.5
    )


@pytest.mark.slow
def test_the_checkerboard_covers_the_shape_and_a_texture_the_canvas(shapes, iccm):
    part = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 800 800"><path d="M100 50h80v80h-80z"/></svg>'
    )
    (shapes / "part.svg").write_text(part)
    write("left.png", np.repeat(np.uint8([[[200, 0, 0]] * 4 + [[0, 0, 0]] * 4]), 8, axis=0))
    write("clear.png", np.zeros((8, 8, 4), np.uint8))

    def notes(*options):
        result = iccm("map", "part.svg", "disk.svg", "-o", "out.png", "--force", *SMALL, *options)
        return [line for line in result.lines if line.startswith("note")]

    assert notes() == [] and len(np.unique(read("out.png").pixels.reshape(-1, 4), axis=0)) > 100
    small, single = notes("--texture", "left.png")
    assert small.startswith("note: part.svg: ") and "10%" in small and "--texture-box bbox" in small
    assert "single colour" in single and "--texture-box bbox" in single
    assert notes("--texture", "left.png", "--texture-box", "bbox") == []
    assert notes("--texture", "left.png", "--padding", "2")[1] == single
    empty = notes("--texture", "clear.png", "--texture-box", "bbox")
    assert len(empty) == 1 and "empty" in empty[0] and "transparent" in empty[0]


@pytest.mark.slow
def test_holes_of_the_target_stay_transparent(shapes, iccm):
    ring = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 80 80"><path d="M{}h60v60h-60zM{}v20h20v-20z"/></svg>'
    (shapes / "ring.svg").write_text(ring.format("10 10", "30 30"))
    typed = ("map", "ring.svg", "ring.svg", "--size", "80", "--force", "-o", "out.png")
    done = iccm(*typed, "--stmap", "out.tif")
    assert "hole" not in done.err
    alpha = read("out.png").pixels[..., 3]
    assert (alpha[31:49, 31:49] == 0).all() and (alpha[11:29, 11:69] == 255).all()
    assert (read("out.tif").pixels[31:49, 31:49] == 0).all()
    assert "which pictures fill" in iccm(*typed, "--holes", "fill").err
    assert (read("out.png").pixels[11:69, 11:69, 3] == 255).all()
    iccm("deform", "ring.svg", "--pin", "20,20:40,20", "--pin", "60,60:80,60", "-o", "d.png", "--size", "100")
    alpha = read("d.png").pixels[..., 3]
    _, columns = np.nonzero(alpha[30:50] == 0)
    middle = columns[(columns > 25) & (columns < 95)]
    assert 40 < middle.mean() < 80 and middle.size > 100


@pytest.mark.slow
def test_a_texture_with_other_proportions_than_the_canvas_gets_a_note(shapes, iccm):
    for name, size in (("wide.png", (40, 120)), ("even.png", (40, 41))):
        write(name, np.random.default_rng(1).integers(0, 255, (*size, 3), np.uint8))
    notes = {
        (name, *more): "are stretched to the canvas of 100x100"
        in iccm("map", "square.svg", "disk.svg", "--texture", name, *more, *PICTURE, "--force").err
        for name in ("wide.png", "even.png")
        for more in ((), ("--texture-box", "bbox"))
    }
    assert [key for key, is_noted in notes.items() if is_noted] == [("wide.png",)]


def test_a_texture_that_is_not_visible_gets_a_note(shapes, iccm):
    write("grey.png", np.full((9, 9, 3), 99, np.uint8))
    written = {"picture": ("-o", "o.png"), "drawing": ("-o", "o.svg"), "figures": ("--report", "o.json")}
    notes = {
        name: "-o FILE.png"
        in iccm("map", "square.svg", "disk.svg", "--texture", "grey.png", *typed, *PICTURE).err
        for name, typed in written.items()
    }
    assert notes == {"picture": False, "drawing": True, "figures": True}
