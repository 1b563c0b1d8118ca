"""Pins and strokes, drawn in the files or listed in JSON, become the right pairs in the core plane."""

import json

import numpy as np
import pytest

from iccm import InputError
from iccm.io.shapes import constraints, listing
from iccm.io.shapes import shape as shapes


def shape(tmp_path, name, extra, box="0 0 100 100"):
    path = tmp_path / f"{name}.svg"
    body = f'<rect width="100" height="100"/>{extra}'
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}">{body}</svg>')
    return shapes.read(str(path))


def listed(tmp_path, content):
    path = tmp_path / "c.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return listing.read(path)


def paired(source, target, listed=None):
    """Pins and strokes for a solver that weights them equally."""
    collected = constraints.collect(source, target, listed)
    collected.check_weights()
    return collected.pins, collected.strokes


def test_drawn_constraints_are_paired_by_name_in_any_order(tmp_path):
    source = shape(
        tmp_path,
        "s",
        '<circle id="pin-a" cx="1" cy="2" r="1"/><circle id="pin-b" cx="3" cy="4" r="1"/>'
        '<path id="stroke-x" d="M0 0H9"/>',
    )
    target = shape(
        tmp_path,
        "t",
        '<path id="stroke-x" d="M5 5V50"/>'
        '<ellipse id="pin-b" cx="30" cy="40" rx="1" ry="2"/><circle id="pin-a" cx="10" cy="20" r="1"/>',
    )
    pins, strokes = paired(source, target)
    assert np.array_equal(pins, [[1 - 2j, 10 - 20j], [3 - 4j, 30 - 40j]])
    ((a, b),) = strokes
    assert np.array_equal(a.z, [0, 9]) and np.array_equal(b.z, [5 - 5j, 5 - 50j])


def test_listed_ones_follow_in_file_units_and_sticking_ends_are_pins(tmp_path):
    square = shape(tmp_path, "s", "")
    collected = constraints.collect(
        square,
        square,
        listed(
            tmp_path,
            {
                "pins": [{"name": "nose", "source": [1, 2], "target": [3, 4.5], "weight": 2}],
                "strokes": [
                    {"source": [[0, 0], [5, 5], [9, 0]], "target": [[0, 1], [9, 1]]},
                    {"source": [[0, 0], [5, 5]], "target": [[7, 7], [8, 8]], "ends": "stick", "weight": 3},
                ],
            },
        ),
    )
    assert np.array_equal(collected.pins, [[1 - 2j, 3 - 4.5j], [0, 7 - 7j], [5 - 5j, 8 - 8j]])
    assert np.array_equal(collected.pin_weights, [2, 3, 3]) and np.array_equal(
        collected.stroke_weights, [1, 3]
    )
    assert [a.z.size for a, _ in collected.strokes] == [3, 2]


def test_nothing_at_all(tmp_path):
    square = shape(tmp_path, "s", "")
    pins, strokes = paired(square, square, listed(tmp_path, {}))
    assert pins.shape == (0, 2) and strokes == []


def test_constraints_without_a_partner_are_named(tmp_path):
    source = shape(tmp_path, "s", '<circle id="pin-a" r="1"/><circle id="pin-b" r="1"/>')
    target = shape(tmp_path, "t", '<circle id="pin-b" r="1"/>')
    with pytest.raises(InputError, match=r"s\.svg: pin-a: missing in .*t\.svg"):
        paired(source, target)
    with pytest.raises(InputError, match=r"s\.svg: pin-a: missing in .*t\.svg"):
        paired(target, source)
    stroke = shape(tmp_path, "u", '<path id="stroke-x" d="M0 0H9"/>')
    with pytest.raises(InputError, match="stroke-x: missing"):
        paired(stroke, shape(tmp_path, "v", ""))


def test_weights_that_the_solver_would_ignore_are_refused(tmp_path):
    square = shape(tmp_path, "s", "")
    pin = {"source": [1, 2], "target": [3, 4]}
    with pytest.raises(InputError, match="--pin-weight"):
        paired(square, square, listed(tmp_path, {"pins": [pin, {**pin, "weight": 2}]}))


PIN = '{"source": [1, 2], "target": [3, 4]'


@pytest.mark.parametrize(
    "content, message",
    [
        ("", "empty"),
        ("{", "not valid JSON: "),
        ("[]", "the file: must be a JSON object"),
        (
            '{"pins": [{"source": "west", "target": [3, 4]}]}',
            r"pins\.0\.source: 'west' is not a point; write .*\[x, y\]",
        ),
        ('{"pins": [{"source": -1, "target": [3, 4]}]}', r"pins\.0\.source: '-1' is not a point"),
        ('{"pins": [{"source": null, "target": [3, 4]}]}', r"pins\.0\.source: is not a point"),
        ("[" * 100_000, "nested more than"),
        ('{"pegs": []}', "pegs: unknown key"),
        ('{"pins": [' + PIN + ', "colour": 1}]}', r"pins\.0\.colour: unknown key"),
        ('{"pins": [' + PIN + "}, {}]}", r"pins\.1\.source: is missing \(and 1 more"),
        ('{"pins": [' + PIN + ', "source": [0, 0]}]}', "'source' is given twice"),
        ('{"pins": [{"source": [1], "target": [3, 4]}]}', r"pins\.0\.source"),
        ('{"pins": [{"source": [1, 2, 3, 4], "target": [3, 4]}]}', r"pins\.0\.source"),
        ('{"pins": [{"source": [1, "2"], "target": [3, 4]}]}', r"pins\.0\.source: .*y .*number"),
        ('{"pins": [{"source": [1, NaN], "target": [3, 4]}]}', r"pins\.0\.source: .*y .*finite"),
        ('{"pins": [{"source": [1, 1e400], "target": [3, 4]}]}', r"pins\.0\.source: .*y .*finite"),
        ('{"pins": [' + PIN + ', "weight": 0}]}', r"pins\.0\.weight: .*greater than 0"),
        ('{"strokes": [{"source": [[1, 2]], "target": [[1, 2], [3, 4]]}]}', r"strokes\.0\.source: .*2 items"),
        (
            '{"strokes": [{"source": [[1, 2], [3, 4]], "target": [[1, 2], [3, 4]], "ends": "glue"}]}',
            "'free' or 'stick'",
        ),
        ("\xff", "not valid JSON"),
    ],
)
def test_bad_files_are_one_line(tmp_path, content, message):
    path = tmp_path / "c.json"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(InputError, match=message) as caught:
        listing.read(path)
    assert "\n" not in str(caught.value) and str(caught.value).startswith(str(path))


def test_a_stroke_without_length(tmp_path):
    square = shape(tmp_path, "s", "")
    content = {"strokes": [{"name": "arm", "source": [[1, 2], [1, 2]], "target": [[1, 2], [3, 4]]}]}
    with pytest.raises(InputError, match=r"strokes\.0 \(arm\): source: .*2 distinct"):
        paired(square, square, listed(tmp_path, content))


def test_settings_of_pins_are_listed_and_drawn(tmp_path):
    circles = '<circle id="pin-a" cx="20" cy="30" r="6"/><circle id="pin-b" cx="60" cy="40" r="1"/>'
    source = shape(tmp_path, "s", circles, box="0 0 200 200")
    target = shape(tmp_path, "t", circles.replace('r="6"', 'r="9"'), box="0 0 200 200")
    content = {
        "pins": [
            {"source": [70, 80], "target": [75, 80], "radius": 0, "tolerance": 2.5},
            {"source": [50, 20], "target": [50, 25], "turn": -30, "scale": 1.5},
        ],
        "strokes": [{"source": [[10, 90], [30, 90]], "target": [[10, 85], [30, 85]], "ends": "stick"}],
    }
    collected = constraints.collect(source, target, listed(tmp_path, content))
    assert collected.settings == [
        {"radius": 6.0},  # that of the source's circle; the other one is only a mark
        {},
        {"radius": 0.0, "tolerance": 2.5},
        {"turn": -30.0, "scale": 1.5},
        {"radius": 0.0},  # fixed ends
        {"radius": 0.0},
    ]


@pytest.mark.parametrize(
    "wrong", [{"radius": -1}, {"tolerance": 0}, {"scale": 0}, {"radius": "6"}, {"turn": 400}]
)
def test_settings_of_pins_out_of_range_are_named(tmp_path, wrong):
    content = {"pins": [{"source": [70, 80], "target": [75, 80]} | wrong]}
    with pytest.raises(InputError, match=next(iter(wrong))):
        listed(tmp_path, content)


def test_widths_of_strokes_are_listed_and_only_written_where_given(tmp_path):
    source, target = shape(tmp_path, "s", "", box="0 0 200 200"), shape(tmp_path, "t", "", box="0 0 200 200")
    lines = {"source": [[10, 90], [30, 90]], "target": [[10, 85], [30, 85]]}
    content = {
        "strokes": [lines | {"width": 4.5}, {"source": [[10, 30], [30, 30]], "target": [[10, 35], [30, 35]]}]
    }
    read = listed(tmp_path, content)
    assert constraints.collect(source, target, read).stroke_widths == [4.5, 0.0]
    assert ["width" in stroke.model_dump() for stroke in read.strokes] == [True, False]
    with pytest.raises(InputError, match="width"):
        listed(tmp_path, {"strokes": [lines | {"width": -1}]})
