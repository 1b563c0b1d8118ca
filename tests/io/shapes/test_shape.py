"""Reading arbitrary input: mutated files of every format give a shape or one line."""

import random
import warnings
from pathlib import Path

import pytest

from iccm import InputError
from iccm.io.shapes import listing, shape

SAMPLES = Path(__file__).resolve().parents[3] / "samples"
RICH = """<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 100 100"
width="10cm"><style>.a{fill:none;stroke:red} #b,rect{fill-rule:evenodd}</style><defs><g id="g"><rect rx="2" width="3"
height="4"/></g><symbol id="s" viewBox="0 0 3 4"><circle r="3"/></symbol></defs><use xlink:href="#g" x="3"/><use
href="#s" width="5" height="50%"/><svg x="1" y="2" width="30" height="80" viewBox="0 0 3 4"
preserveAspectRatio="xMinYMin slice"><ellipse rx="1" ry="3"/></svg><g class="a"
transform="rotate(3 4 5) skewX(3) matrix(1 2 3 4 5 6)"><path id="p"
d="M0 0C1 2 3 4 5 6s1 2 3 9q1 2 3 4t5 6a5 4 30 0 1 9 9h4v-3zm5 5l9 9 3-3z"/><polygon points="1,2 3,4 5 60"/></g>
<circle id="pin-a" r="1"/><path id="stroke-b" d="M1 1L9 9"/></svg>"""
TOKENS = [
    "nan",
    "inf",
    "1e308",
    "-1e308",
    "1e-320",
    "0",
    "-1",
    "99999999999999999999",
    '"',
    "<",
    ">",
    "&",
    "%",
    "#",
    "\x00",
    "M",
    "Z",
    "e",
    ".",
    ",",
    "/",
    "url(#g)",
    "#g",
    "{",
    "}",
    "a",
]


def sources():
    yield ".svg", RICH.encode()
    for name in ("pins/cat.svg", "polyline/pear.obj", "polyline/constraints.json"):
        yield Path(name).suffix, (SAMPLES / name).read_bytes()


def mutated(data, rng):
    """The bytes with a few of them changed, removed, repeated, or replaced by likely causes of errors."""
    data = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 3, 6])):
        position, origin = rng.randrange(len(data) + 1), rng.randrange(len(data) + 1)
        change = rng.choice(["byte", "loss", "token", "repeat", "number"])
        if change == "byte":
            data[position : position + 1] = bytes([rng.randrange(256)])
        elif change == "loss":
            del data[position : position + rng.randrange(1, 30)]
        elif change == "repeat":
            data[position:position] = data[origin : origin + rng.randrange(40)]
        else:
            length = 0 if change == "token" else rng.randrange(1, 5)
            data[position : position + length] = rng.choice(TOKENS).encode()
    return bytes(data)


@pytest.mark.parametrize(
    "suffix, data", list(sources()), ids=lambda value: value if isinstance(value, str) else ""
)
def test_mutated_files_are_shapes_or_one_line(tmp_path, suffix, data):
    rng = random.Random(7)
    path = tmp_path / f"x{suffix}"
    read = listing.read if suffix == ".json" else lambda path: shape.read(str(path))
    refused = 0
    for _ in range(250):
        path.write_bytes(mutated(data, rng))
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            try:
                read(path)
            except InputError as error:
                refused += 1
                assert "\n" not in str(error) and str(error).startswith(str(path))
    assert 0 < refused < 250


@pytest.mark.parametrize("flatness", [0, -1, 1, float("nan"), float("inf")])
def test_flatness_out_of_range(flatness):
    with pytest.raises(InputError, match="flatness"):
        shape.read(str(SAMPLES / "hexagon-blob/blob.svg"), flatness=flatness)


@pytest.mark.parametrize("name", ["", "#", "no/such/file.svg", ".", "a.unknown", "#id"])
def test_names_of_nothing(name):
    with pytest.raises(InputError) as caught:
        shape.read(name)
    assert "\n" not in str(caught.value)
