"""Holes from the command line: onto holes, by name, by pins, filled, and in different numbers."""

import json
import re

import numpy as np
import pytest

from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.io.pictures import image_files
from iccm.io.shapes import holes, mesh_reading, shape

pytestmark = pytest.mark.usefixtures("solve_once")

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'
RING = '<path fill-rule="evenodd" d="M10 10H90V90H10Z M30 30V60H60V30Z"/>'
OFF = '<path fill-rule="evenodd" d="M5 50C5 0 95 0 95 50S5 100 5 50Z M55 40V60H75V40Z"/>'
EYES = '<path fill-rule="evenodd" d="M5 5H95V95H5Z M20 30H40V50H20Z M60 30H80V50H60Z"/>{}'
NAMED = '<circle id="{}" cx="30" cy="40" r="4"/><circle id="{}" cx="70" cy="40" r="4"/>'


@pytest.fixture
def holed(shapes):
    drawings = {
        "ring": RING,
        "off": OFF,
        "eyes": EYES.format(""),
        "a": EYES.format(NAMED.format("one", "two")),
    }
    drawings["b"] = EYES.format(NAMED.format("two", "one"))
    drawings["specks"] = (
        '<path fill-rule="evenodd" d="M10 10H90V90H10Z M30 30V60H60V30Z M70 70v.1h.1v-.1z M10 70L20 75V65Z"/>'
    )
    for name, drawing in drawings.items():
        (shapes / f"{name}.svg").write_text(SVG.format(drawing))
    return shapes


def mapped(iccm, *typed):
    typed = typed if "--holes" in typed else (*typed, "--holes", "keep")
    result = iccm("map", *typed, "-o", "o.png", "--report", "r.json", "--size", "100", "--force")
    with open("r.json") as file:
        return result, json.load(file)


@pytest.mark.slow
def test_a_hole_is_mapped_onto_the_hole_and_stays_transparent(holed, iccm):
    done, report = mapped(iccm, "ring.svg", "off.svg", "--stmap", "o.tif")
    assert done.code == 0 and "hole" not in done.err
    (hole,) = report["holes"]
    assert (hole["source"], hole["target"]) == (1, 1) and hole["gap"] <= 1e-3
    assert report["injective"]["certified"] and report["boundary"]["hausdorff"] <= 1e-3
    alpha = image_files.read("o.png").pixels[..., 3]
    assert (alpha[41:59, 56:74] == 0).all() and (alpha[41:59, 77:90] == 255).all()
    assert (image_files.read("o.tif").pixels[41:59, 56:74] == 0).all()
    _, filled = mapped(iccm, "ring.svg", "off.svg", "--holes", "fill")
    assert "holes" not in filled
    assert (image_files.read("o.png").pixels[41:59, 56:74, 3] == 255).all()


def test_the_rim_of_a_hole_shows_the_rim_of_its_partner(holed, iccm):
    picture = np.zeros((100, 100, 3), np.uint8)
    picture[28:62, 28:62] = (255, 0, 0)  # two units around the source's hole
    image_files.write("rim.png", image_files.Image(picture))
    mapped(iccm, "ring.svg", "off.svg", "--texture", "rim.png")
    red = image_files.read("o.png").pixels
    sides = (red[39, 58:72], red[60, 58:72], red[42:58, 54], red[42:58, 75])
    assert min(int(side[:, 0].min()) for side in sides) > 120


@pytest.mark.slow
def test_surplus_holes_are_reported(holed, iccm):
    done, report = mapped(iccm, "eyes.svg", "ring.svg")
    assert (
        done.code == 0 and "The source has 2 holes and the target 1: 1 hole of the source shrunk" in done.err
    )
    assert sorted(h["target"] or 0 for h in report["holes"]) == [0, 1]
    done, report = mapped(iccm, "square.svg", "eyes.svg")
    assert done.code == 0 and "2 holes of the target opened from a slit" in done.err
    assert [h["source"] for h in report["holes"]] == [None, None] and report["injective"]["certified"]
    alpha = image_files.read("o.png").pixels[..., 3]
    assert (
        (alpha[32:48, 22:38] == 0).all()
        and (alpha[32:48, 62:78] == 0).all()
        and (alpha[55:90, 10:90] == 255).all()
    )


@pytest.mark.slow
def test_holes_are_paired_by_the_names_of_drawings_in_them(holed, iccm):
    drawings = [shape.read(f"{name}.svg") for name in "ab"]
    assert sorted(drawings[0].hole_names) == [("one",), ("two",)]
    named = holes.named_partners(*drawings, ([0, 1], [0, 1]))
    assert {drawings[0].hole_names[i] == drawings[1].hole_names[j] for i, j in named} == {True} and len(
        named
    ) == 2
    _, report = mapped(iccm, "a.svg", "b.svg", "--parts", "largest")  # without what is drawn inside the holes
    _, unnamed = mapped(iccm, "eyes.svg", "eyes.svg")
    assert [h["source"] for h in report["holes"]] == [h["source"] for h in unnamed["holes"]][::-1]


@pytest.mark.slow
def test_pins_in_holes_pair_the_holes(holed, iccm):
    done, report = mapped(iccm, "eyes.svg", "eyes.svg", "--pin", "30,40:70,40")
    assert done.code == 0 and report["pins"] == []
    assert sorted((h["source"], h["target"]) for h in report["holes"]) == [(1, 2), (2, 1)]
    done = iccm("map", "eyes.svg", "eyes.svg", "--pin", "30,40:50,80", "-o", "p.png")
    assert done.code == 2 and re.search("pin 1: .*in a hole.*source.*target", done.err)


def test_holes_too_small_or_touching_the_outline_are_ignored(holed, iccm):
    done, report = mapped(iccm, "specks.svg", "specks.svg")
    assert done.code == 0 and len(report["holes"]) == 1
    assert "too small or too close to an outline" in done.err and "leave transparent" in done.err


def test_holes_of_a_shape_that_is_deformed_move_freely(holed, iccm):
    pins = ("--pin", "15,15:15,15", "--pin", "85,85:85,85", "--pin", "30,45:25,45", "--pin", "60,45:65,45")
    typed = (
        "deform",
        "ring.svg",
        *pins,
        "--exact-pins",
        "-o",
        "o.png",
        "--report",
        "r.json",
        "--size",
        "100",
        "--force",
    )
    done = iccm(*typed)
    report = json.loads((holed / "r.json").read_text())
    assert done.code == 0 and "hole" not in done.err
    assert all(pin["error"] < 1e-9 for pin in report["pins"]) and report["injective"]["certified"]
    row = image_files.read("o.png").pixels[:, :, 3]
    assert row.shape[0] and (row[45, 30:60] == 0).all()
    assert "filled" in iccm(*typed, "--pin", "45,45:45,45").err
    filled = iccm(*typed, "--holes", "fill")
    assert filled.code == 0 and (image_files.read("o.png").pixels[40:50, 35:55, 3] == 255).all()


def test_holes_are_kept_or_cut_whichever_is_cheaper_by_default(holed, iccm):
    done, report = mapped(iccm, "ring.svg", "off.svg", "--holes", "auto", "--texture", "checker")
    assert done.code == 0 and report["injective"]["certified"]
    alpha = image_files.read("o.png").pixels[..., 3]
    assert (alpha[41:59, 56:74] == 0).all()  # transparent in both cases
    done, report = mapped(iccm, "ring.svg", "off.svg", "--holes", "cut", "--texture", "checker")
    assert done.code == 0 and "holes" not in report
    assert (image_files.read("o.png").pixels[41:59, 56:74, 3] == 0).all()


def test_shapes_drawn_by_lines_are_filled(shapes, iccm):
    thin = '<path fill-rule="evenodd" d="M10 10H90V90H10Z M15 15V85H85V15Z"/>'
    (shapes / "frame.svg").write_text(SVG.format(thin))
    result = iccm("map", "frame.svg", "square.svg", "-o", "o.png", "--size", "64")
    assert (
        result.code == 0
        and "frame.svg: drawn " in result.err
        and "filled" in result.err
        and "--holes keep" in result.err
    )
    assert (image_files.read("o.png").pixels[20:44, 20:44, 3] == 255).all()


def test_other_methods_pass_over_holes(holed, iccm):
    done, report = mapped(iccm, "ring.svg", "off.svg", "--method", "conformal")
    assert done.code == 0 and "ignores its 1 hole, which pictures leave transparent" in done.err
    assert (image_files.read("o.png").pixels[41:59, 56:74, 3] == 0).all() and "holes" not in report


def head(path):
    """A dome with two eyes and a mouth, groups of faces around the eyes, and a disconnected lid."""
    turn = np.exp(2j * np.pi * np.arange(80) / 80)
    rims = [0.15 * turn[::-4] + eye for eye in (-0.35 + 0.3j, 0.35 + 0.3j)]
    rims.append(0.3 * turn[::-4].real + 0.12j * turn[::-4].imag - 0.4j)
    z, faces = triangulate(turn, Sizes.even(0.004), holes=rims)
    middle = z[faces].mean(axis=1)
    lines = [f"v {w.real:.6f} {w.imag:.6f} {np.sqrt(1.5 - abs(w) ** 2):.6f}" for w in z]
    groups = [
        ("left", np.abs(middle - rims[0].mean()) < 0.25),
        ("right", np.abs(middle - rims[1].mean()) < 0.25),
    ]
    groups.append(("skin", ~groups[0][1] & ~groups[1][1]))
    for name, chosen in groups:
        lines += [f"g {name}", *(f"f {a} {b} {c}" for a, b, c in faces[chosen] + 1)]
    lines += ["g lid", "v 3 0 0", "v 4 0 0", "v 4 1 0", f"f {z.size + 1} {z.size + 2} {z.size + 3}"]
    path.write_text("\n".join(lines) + "\n")


FACE = (
    '<path fill-rule="evenodd" d="M5 5H95V95H5Z M20 30H40V50H20Z M60 30H80V50H60Z M30 65H70V80H30Z"/>'
    '<circle id="{}" cx="30" cy="40" r="5"/><circle id="{}" cx="70" cy="40" r="5"/>'
)


@pytest.mark.slow
def test_boundaries_of_a_mesh_are_holes_and_its_pieces_are_picked_by_number(shapes, iccm):
    head(shapes / "head.obj")
    for name, eyes in (("face", ("left", "right")), ("other", ("right", "left"))):
        (shapes / f"{name}.svg").write_text(SVG.format(FACE.format(*eyes)))
    typed = ("map", "face.svg", "head.obj#piece-1", "-o", "o.obj", "--report", "r.json", "--force")
    done = iccm(*typed)
    report = json.loads((shapes / "r.json").read_text())
    assert done.code == 0 and len(report["holes"]) == 3 and report["injective"]["certified"]
    assert all(h["gap"] <= 1e-3 for h in report["holes"]) and report["uv"] == {"flipped": 0, "degenerate": 0}
    target = mesh_reading.read("head.obj#piece-1")
    assert [set(names) & {"left", "right"} for names in target.hole_names].count(set()) == 1
    for name in ("face", "other"):
        source = shape.read(f"{name}.svg")
        named = holes.named_partners(source, target, (range(3), range(3)))
        assert len(named) == 2 and all(
            set(source.hole_names[i]) & set(target.hole_names[j]) for i, j in named
        )
    assert iccm("map", "square.svg", "head.obj#piece-2", "-o", "lid.obj").code == 0
    assert "no piece 3" in iccm("map", "square.svg", "head.obj#piece-3", "-o", "p.obj").err
