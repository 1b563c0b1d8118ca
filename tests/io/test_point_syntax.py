"""Points have the same syntax wherever a user enters one."""

import json

import pytest
from pydantic import TypeAdapter, ValidationError

from iccm.io import point_syntax
from iccm.io.run.job import Job
from iccm.io.shapes import listing

PLACE = TypeAdapter(point_syntax.Place)
FORMS = [
    ("v5", "v5"),
    (" V5 ", "v5"),
    ("5", "v5"),
    (5, "v5"),
    ("1,-2.5", (1, -2.5)),
    ([1, -2.5], (1, -2.5)),
    ("1, 2 ,3e1", (1, 2, 30)),
    ([1, 2, 3], (1, 2, 3)),
]


@pytest.mark.parametrize(("given", "place"), FORMS)
def test_every_form_everywhere(tmp_path, given, place):
    assert PLACE.validate_python(given) == place
    assert PLACE.validate_python(point_syntax.written(place)) == place
    assert Job(source="a", pin=[[given, [0, 1]]]).pin == ((place, (0, 1)),)
    if isinstance(given, str):
        assert Job(source="a", pin=[f"{given}:0,1"]).pin == ((place, (0, 1)),)
    listed = {
        "pins": [{"source": given, "target": "0,1"}],
        "strokes": [{"source": [given, 2], "target": [1, "v2"]}],
    }
    (tmp_path / "c.json").write_text(json.dumps(listed))
    constraints = listing.read(tmp_path / "c.json")
    assert (constraints.pins[0].source, constraints.pins[0].target) == (place, (0, 1))
    assert (constraints.strokes[0].source, constraints.strokes[0].target) == ([place, "v2"], ["v1", "v2"])


@pytest.mark.parametrize(
    "wrong",
    [
        "",
        "a",
        "v",
        "v-1",
        "-1",
        -1,
        "1.5",
        1.5,
        True,
        None,
        "1,2,3,4",
        [1],
        [1, 2, 3, 4],
        "nan,1",
        "1,",
        {},
        [0, -1e300],
        "1e300,0",
    ],
)
def test_invalid_points_are_refused(wrong):
    with pytest.raises(ValidationError):
        PLACE.validate_python(wrong)


@pytest.mark.parametrize("pin", ["1,2:5", "1,2:v5", "1,2:0,0,0"])
def test_a_place_on_a_mesh_where_there_is_none(shapes, iccm, pin):
    place = {"5": "v5"}.get(pin.partition(":")[2], pin.partition(":")[2])
    ran = iccm("map", "square.svg", "blob.svg", "--pin", pin)
    assert ran.code == 2
    assert ran.lines == [f"error: blob.svg: {place} is a point on a mesh, but this is not a mesh; write x,y"]


def test_a_place_may_name_a_vertex_by_its_number():
    assert point_syntax.vertex_of("v5") == 5 and point_syntax.vertex_of("v0") == 0
    assert point_syntax.vertex_of((1.0, -2.5)) is None


def test_a_pin_may_have_settings():
    pins = TypeAdapter(point_syntax.Pin)
    expected = ((10.0, 20.0), (30.0, 40.5), {"radius": 6.0, "turn": -20.0, "tolerance": 1.5})
    assert pins.validate_python("10,20:30,40.5,r=6,turn=-20,tolerance=1.5") == expected
    assert (
        pins.validate_python([[10, 20], [30, 40.5], {"radius": 6, "turn": -20, "tolerance": 1.5}]) == expected
    )
    assert pins.validate_python("v5:30,40,scale=2") == ("v5", (30.0, 40.0), {"scale": 2.0})
    wrong_settings = ("size=6", "r=x", "r=-1", "scale=0", "turn=", "=3")
    for wrong in ("10,20,r=6:30,40", *(f"10,20:30,40,{setting}" for setting in wrong_settings)):
        with pytest.raises(ValidationError):
            pins.validate_python(wrong)
