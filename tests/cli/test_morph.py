"""`iccm morph` as it is typed: frames, animations, drawings, and what is refused."""

import re

import numpy as np
import pytest
from PIL import Image

QUICK = ("--frames", "3", "--size", "48")


def pixels(path):
    return np.asarray(Image.open(path).convert("RGBA"))


def test_frames_begin_and_end_with_the_shapes(shapes, iccm):
    done = iccm("morph", "square.svg", "blob.svg", *QUICK, "-o", "m-{number}.png", "-o", "m-{number}.svg")
    assert done.code == 0 and "wrote m-1.png to m-3.svg" in done.err
    assert iccm("map", "square.svg", "blob.svg", "--size", "48", "--fit", "whole", "-o", "t.png").code == 0
    assert iccm("map", "square.svg", "square.svg", "--size", "48", "-o", "s.png").code == 0
    for number, name in ((1, "s.png"), (3, "t.png")):
        away = np.abs(pixels(f"m-{number}.png").astype(int) - pixels(name))
        assert away.max(axis=2).mean() < 2, name
    ends = [len(re.findall("<path", (shapes / f"m-{k}.svg").read_text())) for k in (1, 2, 3)]
    assert ends[0] and ends == ends[:1] * 3


def test_animations_hold_every_frame_and_textures_fade(shapes, iccm):
    for name, colour in (("red.png", (255, 0, 0)), ("blue.png", (0, 0, 255))):
        Image.new("RGB", (8, 8), colour).save(name)
    given = ("--texture", "red.png", "--target-texture", "blue.png", "--fps", "10")
    outputs = ("-o", "m.webp", "-o", "m.gif", "-o", "m.png", "-o", "f-{number}.png")
    done = iccm("morph", "square.svg", "blob.svg", *QUICK, *given, *outputs)
    assert done.code == 0, done.err
    for name in ("m.webp", "m.gif", "m.png"):
        with Image.open(name) as file:
            assert file.n_frames == 3
    with Image.open("m.webp") as file:
        file.seek(1)
        assert np.array_equal(np.asarray(file.convert("RGBA"))[24, 24], pixels("f-2.png")[24, 24])
        assert file.info["duration"] == 100
    middles = [pixels(f"f-{k}.png")[24, 24].tolist() for k in (1, 2, 3)]
    assert middles[0] == [255, 0, 0, 255] and middles[2] == [0, 0, 255, 255]
    assert middles[1] == pytest.approx([128, 0, 128, 255], abs=1)


def test_holes_go_along_where_both_have_as_many(shapes, iccm):
    ring = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path fill-rule="evenodd" d="{}"/></svg>'
    (shapes / "ring.svg").write_text(ring.format("M10 10H90V90H10ZM40 40H60V60H40Z"))
    (shapes / "other.svg").write_text(ring.format("M5 20H95V80H5ZM40 35H65V60H40Z"))
    assert iccm("morph", "ring.svg", "other.svg", *QUICK, "-o", "m-{number}.png").code == 0
    assert [pixels(f"m-{k}.png")[24, 24, 3] for k in (1, 2, 3)] == [0, 0, 0]
    done = iccm("morph", "square.svg", "other.svg", *QUICK, "-o", "f-{number}.png")
    assert done.code == 0 and "0 and 1 holes cannot go onto each other: they are filled" in done.err
    assert [pixels(f"f-{k}.png")[24, 24, 3] for k in (1, 2, 3)] == [255, 255, 255]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("square.svg", "blob.svg", "-o", "m.jpg"), "m.jpg: is no animation; use .webp .gif .png"),
        (("square.svg", "blob.svg", "-o", "m.png", "-o", "m.png"), "is written twice"),
        (("square.svg", "blob.svg", "--target-texture", "t.png", "-o", "{number}.svg"), "fades pictures"),
        (("square.svg", "none.svg", "-o", "m.webp"), "none.svg: no such file"),
        (
            ("square.svg", "ring.svg", "--holes", "keep", "-o", "m.webp"),
            "0 and 1 holes cannot go onto each other",
        ),
        (("square.svg", "sheet.obj", "-o", "m.webp"), "a morph is between shapes of the plane"),
        (("square.svg", "blob.svg", "-o", "square.svg"), "is no animation"),
        (("square.svg", "blob.svg", "-o", "old.webp"), "old.webp"),
        (
            ("square.svg", "blob.svg", "--frames", "9999", "-o", "m.webp"),
            "--frames: 9999 pictures of about 1024x1024",
        ),
    ],
)
def test_what_cannot_be_done_is_told_in_a_line(shapes, iccm, words, message):
    (shapes / "ring.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path fill-rule="evenodd" '
        'd="M10 10H90V90H10ZM40 40H60V60H40Z"/></svg>'
    )
    (shapes / "sheet.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 0\nf 1 2 3\nf 1 3 4\n")
    (shapes / "old.webp").write_bytes(b"old")
    Image.new("RGB", (8, 8)).save("t.png")
    done = iccm("morph", *words)
    assert done.code == 2 and len(done.lines) == 1 and message in done.err, done.err
    assert (shapes / "old.webp").read_bytes() == b"old" and not list(shapes.glob("m*.png"))
