"""Planar OBJ files: polylines and boundary loops become shapes; invalid ones are rejected with their line."""

import numpy as np
import pytest

from iccm import InputError
from iccm.io.shapes import shape as shapes

CORNERS = "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\n"


@pytest.fixture
def read(tmp_path):
    def read(text, chosen=""):
        path = tmp_path / "a.obj"
        path.write_text(text)
        return shapes.read(f"{path}{chosen}")

    return read


@pytest.mark.parametrize(
    "lines",
    [
        "l 1 2 3 4 1",
        "l 4 3 2 1 4\n",
        "l 1 2\nl 3 4\nl 2 3\nl 1 4",
        "l -4 -3 -2 -1 -4",
        "l 1/7 2/7 3 4/ 1  # comment",
        "o thing\nl 1 2 3\nl 3 4 1",
        "f 1 2 3\nf 1 3 4",
        "f 1 2 3 4",
        "v 2 1 0\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5",
        "v 0 0 0\nl 1 2 3 4 5",
    ],
)
def test_one_rectangle_in_many_forms(read, lines):
    shape = read(CORNERS + lines)
    assert {complex(z) for z in shape.curve.z} == {0, 4, 4 + 3j, 3j}
    assert shape.curve.area == 12 and shape.box == (0, 4 + 3j) and not shape.flip
    assert np.array_equal(shape.to_core([1, 2]), 1 + 2j)


TWO = CORNERS + "v 1 1 0\nv 2 1 0\nv 2 2 0\no big\nl 1 2 3 4 1\no small\nl 5 6 7 5\n"


def test_objects_and_numbers_select(read):
    assert read(TWO).curve.area == 12
    assert read(TWO, "#small").curve.area == read(TWO, "#2").curve.area == 0.5
    with pytest.raises(InputError, match="no 'huge' in the file; it has big, small"):
        read(TWO, "#huge")


def test_groups_of_faces_and_holes(read):
    frame = "v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\nv 3 3 0\nv 6 3 0\nv 6 6 0\nv 3 6 0\n"
    frame += "g low\nf 1 2 6 5\ng rest\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
    whole = read(frame)
    assert whole.curve.area == 81 and [hole.size for hole in whole.holes] == [4]
    assert read(frame, "#low").curve.area == pytest.approx(18)


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "empty"),
        ("hello", "no vertices"),
        (CORNERS, "no polylines"),
        (CORNERS + "l 1 2 3 4", r"open: it ends at \(0, 0\) and \(0, 3\)"),
        (CORNERS + "l 1 2 3 4 1 3", r"branch at \(0, 0\) and \(4, 3\)"),
        (CORNERS + "l 1 3 2 4 1", r"crosses itself at \(2, 1.5\)"),
        (CORNERS + "l 1 2 9 1", "line 5: there is no vertex 9"),
        (CORNERS + "l 1 2 -9 1", "line 5: there is no vertex -9"),
        (CORNERS + "l 1 2 x 1", "line 5: 'x' is not a vertex"),
        (CORNERS + "l 1 0 2 1", "line 5: '0' is not a vertex"),
        (CORNERS + "l 1", "line 5: .*at least 2"),
        (CORNERS + "l 1 2 1", "open"),
        (CORNERS + "f 1 2 9", "vertex 9"),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nl 1 2 3 1", "no area"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 1\nl 1 2 3 1", "draw it flat"),
        ("v 0 0 0\nv 1 0 0\nv nan 1 0\nl 1 2 3 1", "vertex 3|number"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 1 3 4", "no boundary"),
    ],
)
def test_bad_files_are_one_line(read, text, message):
    with pytest.raises(InputError, match=message) as caught:
        read(text)
    assert "\n" not in str(caught.value) and "a.obj" in str(caught.value)


def test_a_long_outline_keeps_its_vertices(read):
    t = np.linspace(0, 2 * np.pi, 5000, endpoint=False)
    r = 1 + 0.2 * np.sin(40 * t)
    text = "".join(f"v {x:.9f} {y:.9f} 0\n" for x, y in zip(r * np.cos(t), r * np.sin(t)))
    shape = read(text + "l " + " ".join(str(k + 1) for k in range(5000)) + " 1\n")
    assert shape.curve.z.size == 5000


@pytest.mark.parametrize(
    "points, line, message",
    [
        ("0 0 0, 1 0 0, 1 0 1, 0 0 1", "l 1 2 3 4 1", "but y = constant; export it with z up"),
        ("0 0 0, 1 0 0, 1 0 1, 0 0 1", "f 1 2 3 4", "or flatten it first with iccm flatten"),
        ("2 0 0, 2 1 0, 2 1 1, 2 0 1", "l 1 2 3 4 1", "but x = constant"),
        ("0 0 0, 1 0 0, 1 1 1, 0 1 1", "l 1 2 3 4 1", "draw it flat"),
        ("0 0 0, 1 0 0, 1 1 1, 0 1 1", "f 1 2 3 4", "flatten it first"),
    ],
)
def test_the_advice_for_another_plane_depends_on_the_contents(read, points, line, message):
    """Lines cannot be flattened, and programs with y up write objects on the ground at y = 0."""
    with pytest.raises(InputError, match="z = constant") as error:
        read("".join(f"v {point}\n" for point in points.split(", ")) + line)
    assert message in str(error.value) and ("flatten" in str(error.value)) == line.startswith("f")
