"""`file#part#number` means the same in every command."""

from pathlib import Path

import pytest

from iccm import InputError
from iccm.io.shapes import shape as shapes
from iccm.io.spec import Spec, path_of

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'
TWO = "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 0\ng left\nf 1 2 3\ng right\nf 1 3 4\n"


@pytest.mark.parametrize(
    ("text", "spec"),
    [
        ("a/b.svg", Spec(Path("a/b.svg"))),
        ("a/b.svg#c d", Spec(Path("a/b.svg"), "c d")),
        ("a#1/b.svg#c", Spec(Path("a#1/b.svg"), "c")),
        ("a.svg#", Spec(Path("a.svg"))),
        ("a.obj#2", Spec(Path("a.obj"), None, 2)),
        ("a.obj#body#1", Spec(Path("a.obj"), "body", 1)),
        ("a.obj#body#left", Spec(Path("a.obj"), "body#left")),
        ("#x", Spec(Path(), "x")),
        ("", Spec(Path())),
    ],
)
def test_file_part_and_number(text, spec):
    assert Spec.of(text) == spec


def test_existing_files_and_parts_with_such_names_take_precedence(tmp_path):
    path = tmp_path / "a#b.svg"
    assert path_of(str(path)) == str(tmp_path / "a")
    path.write_text("")
    assert Spec.of(f"{path}#c#3") == Spec(path, "c", 3)
    assert Spec.of("a.obj#7").among(["7"]) == Spec(Path("a.obj"), "7")
    assert Spec.of("a.obj#7").among(["x"]) == Spec(Path("a.obj"), None, 7)
    assert Spec.of("a.obj#x#7").among(["x", "x#7"]) == Spec(Path("a.obj"), "x#7")


def test_an_outline_of_a_part(tmp_path):
    part = '<g id="g"><path d="M0 0H9V9H0z"/><path d="M20 0H23V3H20z"/></g><path d="M40 0H90V50H40z"/>'
    (tmp_path / "a.svg").write_text(SVG.format(part))
    name = str(tmp_path / "a.svg")
    areas = [shapes.read(name + suffix).curve.area for suffix in ("", "#2", "#g", "#g#1", "#g#2")]
    assert areas == pytest.approx([2500, 81, 81, 81, 9])
    with pytest.raises(InputError, match="no outline 3; it has 2"):
        shapes.read(name + "#g#3")
    with pytest.raises(InputError, match="no 'h' in the file; it has g"):
        shapes.read(name + "#h#1")


def test_map_and_flatten_take_the_same_part_and_loop(shapes, iccm):
    (shapes / "g.obj").write_text(TWO)
    assert iccm("flatten", "g.obj#left#1", "-o", "flat.svg").code == 0
    words = ("--method", "paper", "--vertices", "40", "--report", "-", "-q", "-o", "o.obj")
    assert iccm("map", "square.svg", "g.obj#left#1", *words).code in (0, 1)
    text = (shapes / "o.obj").read_text()
    assert "f 1/1 2/2 3/3" in text and "f 1 3 4" in text
    assert "no boundary 2" in iccm("map", "square.svg", "g.obj#left#2", *words, "--force").err
