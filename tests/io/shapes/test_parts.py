"""Matching shapes of two drawings: by names that users gave, else by position and size."""

import numpy as np
import pytest

from iccm import InputError
from iccm.io.shapes import parts, shape

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'
FACE = '<circle cx="50" cy="50" r="40"/><circle cx="35" cy="40" r="6"/><circle cx="65" cy="40" r="6"/>'
MASK = '<path d="M80 5h10v10h-10z"/><path d="M5 20H95V90H5z"/><path d="M60 40h15v9h-15z"/><path d="M25 40h15v9h-15z"/>'


@pytest.fixture
def drawn(tmp_path):
    def read(content, name="a.svg"):
        (tmp_path / name).write_text(SVG.format(content))
        return shape.read_all(str(tmp_path / name))

    return read


def test_all_shapes_are_read_and_know_how_they_are_named(drawn):
    drawing = drawn(f'<g id="face">{FACE}</g><path id="brow" d="M30 20h20v3h-20z"/>')
    assert [outline.part for outline in drawing] == ["1", "2", "3", "4"]
    assert [outline.names for outline in drawing] == [("face",)] * 3 + [("brow",)]
    assert np.allclose([outline.bounds for outline in drawing], (10 - 90j, 90 - 10j), atol=0.01)
    assert drawing[3].curve.box[0] == 30 - 23j
    picked = shape.read(f"{drawing[3].spec}#{drawing[3].part}")
    assert np.array_equal(picked.curve.z, drawing[3].curve.z)
    within = shape.read_all(drawing[0].spec + "#face")
    assert [outline.part for outline in within] == ["face#1", "face#2", "face#3"]
    assert shape.read_all(drawing[0].spec + "#2")[0].curve.area == drawing[1].curve.area
    with pytest.raises(InputError, match="no 'nose' in the file"):
        shape.read_all(drawing[0].spec + "#nose")


def test_shapes_that_cannot_be_mapped_get_notes(drawn):
    bow = '<path d="M80 80L95 95V80L80 95z"/>'
    drawing = drawn(FACE + bow + '<circle id="pin-a" cx="50" cy="50" r="1"/>')
    assert len(drawing) == 5
    assert any("crosses itself" in note for note in drawing[0].notes)
    assert any("pins and strokes" in note for note in drawing[0].notes)


def test_partners_have_the_same_place_and_size(drawn):
    face, mask = drawn(FACE), drawn(MASK, "b.svg")
    pairs = parts.pair(face, mask)
    size = {left: k for k, left in enumerate(part.curve.box[0].real for part in mask)}
    assert pairs[0] == (0, size[5.0]) and len(pairs) == 3
    for i, j in pairs[1:]:
        assert (face[i].curve.box[0].real < 50) == (mask[j].curve.box[0].real < 50)
    around = parts.pair(face, mask, turn=180)
    assert (face[1].curve.box[0].real < 50) != (mask[dict(around)[1]].curve.box[0].real < 50)
    assert parts.pair(mask, face) == sorted((j, i) for i, j in pairs)


def squares(*places):
    return "".join(f'<path d="M{x} {y}h10v10h-10z"/>' for x, y in places)


def left_and_top(shapes):
    """The upper left corner of each square, y down."""
    return [(square.curve.box[0].real, -square.curve.box[1].imag) for square in shapes]


def test_rotations_are_counter_clockwise(drawn):
    """Three squares, and the same rotated by 90 degrees."""
    source, target = (
        drawn(squares((10, 10), (80, 10), (80, 40))),
        drawn(squares((10, 80), (10, 10), (40, 10)), "b.svg"),
    )
    source_corners, target_corners = left_and_top(source), left_and_top(target)
    partners = {source_corners[i]: target_corners[j] for i, j in parts.pair(source, target, turn=90)}
    assert partners == {(10, 10): (10, 80), (80, 10): (10, 10), (80, 40): (40, 10)}


def test_places_are_relative_to_the_middle_of_all_shapes(drawn):
    """A single square matches the one in the middle of a tower."""
    source, target = drawn(squares((70, 70))), drawn(squares((10, 0), (10, 50), (10, 65), (10, 100)), "b.svg")
    ((_, j),) = parts.pair(source, target)
    assert left_and_top(target)[j] == (10, 50)


@pytest.mark.parametrize(
    ("name", "given"), [("left", True), ("path12-3", False), ("Layer_1", False), ("g10", False)]
)
def test_a_name_counts_unless_a_program_gave_it(drawn, name, given):
    square = '<path {} d="M{} 40h20v20h-20z"/>'
    source = drawn(square.format(f'id="{name}"', 10) + square.format("", 70))
    target = drawn(square.format("", 10) + square.format(f'id="{name}"', 70), "b.svg")
    pairs = dict(parts.pair(source, target))
    named = [next(k for k, part in enumerate(shapes) if name in part.names) for shapes in (source, target)]
    assert (pairs[named[0]] == named[1]) == given


NAMED = {
    "nose": (20, 30),
    "eye": (40, 60),
    "ear": (75, 25),
    "chin": (80, 70),
    "tail": (50, 45),
    "hat": (60, 80),
}
OTHERS = {"a": (10, 10), "b": (90, 90), "c": (10, 90), "d": (90, 10)}


def board(folder, name, places):
    """A square with named dots on it, as a whole shape."""
    dots = "".join(f'<circle id="{id}" cx="{x}" cy="{y}" r="3"/>' for id, (x, y) in places.items())
    (folder / name).write_text(SVG.format(f'<path d="M0 0h100v100h-100z"/>{dots}'))
    return shape.read(str(folder / name))


@pytest.mark.parametrize(
    ("places", "shared"),
    [
        ({"Nose": (80, 70), "ear": (25, 75), "hat": (40, 20)}, ["nose", "ear", "hat"]),
        # two of six names
        ({"nose": (20, 30), "ear": (75, 25), **OTHERS}, ["nose", "ear"]),
        # one of six
        ({"nose": (20, 30), "z": (50, 30), **OTHERS}, []),
        # all names of the drawing with fewer names are common
        ({"nose": (70, 30)}, ["nose"]),
        # the same arrangement, rotated, smaller, and with each dot moved a little
        ({"nose": (68, 27), "eye": (42, 41), "ear": (74, 64), "chin": (38, 71)}, ["nose", "eye", "ear", "chin"]),
        # mirrored: no rotation takes one onto the other
        ({"nose": (80, 30), "eye": (60, 60), "ear": (25, 25), "chin": (20, 70)}, []),
    ],
)  # fmt: skip
def test_accidental_namesakes_do_not_count(tmp_path, places, shared):
    names, ends, radii = parts.namesakes(board(tmp_path, "a.svg", NAMED), board(tmp_path, "b.svg", places))
    count = len(shared)
    assert sorted(names) == sorted(shared) and ends.shape == (count, 2) and radii.shape == (count,)
    lower = {name.casefold(): z for name, z in places.items()}
    expected = [(NAMED[name], lower[name]) for name in names]
    assert np.allclose(ends.real, [[a[0], b[0]] for a, b in expected] or ends.real, atol=0.01)
    assert np.allclose(radii, 3, atol=0.01)
