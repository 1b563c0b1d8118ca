"""Names that occur in both drawings determine the map if nothing else does."""

import json
from pathlib import Path

import pytest

FISH = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 60"><g transform="matrix({way} 0 0 1 {shift} 0)">'
    '<path d="M5 30Q30 0 70 28L95 10V50L70 32Q30 60 5 30Z"/>'
    '<circle id="{name}" cx="20" cy="30" r="6"/><g id="Tail"><circle cx="85" cy="30" r="3"/></g></g></svg>'
)
RIGHT, LEFT = {"way": 1, "shift": 0}, {"way": -1, "shift": 100}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("target", "more", "turned"),
    [
        ("left.svg", (), True),
        # names given by the drawing program are ignored
        ("other.svg", (), False),
        # constraints have precedence
        ("left.svg", ("--pin", "50,30:50,30"), False),
        # no start is needed if the map is right already
        ("right.svg", (), False),
    ],
)
def test_a_fish_is_rotated_to_match_the_names_in_both_drawings(
    tmp_path, monkeypatch, iccm, target, more, turned
):
    monkeypatch.chdir(tmp_path)
    Path("right.svg").write_text(FISH.format(name="head", **RIGHT))
    Path("left.svg").write_text(FISH.format(name="Head", **LEFT))
    Path("other.svg").write_text(FISH.format(name="circle12", **LEFT).replace("Tail", "g7"))
    result = iccm("map", "right.svg", target, "-o", "o.png", "--size", "64", "--report", "r.json", *more)
    assert result.code == 0 and (abs(json.loads(Path("r.json").read_text())["turn"]) > 160) == turned
    assert ("same names in both drawings: head, tail" in result.err) == turned
    assert "instead of 0 (turn)" not in result.err
