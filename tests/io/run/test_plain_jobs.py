"""A job's values are validated by the table of options, without pydantic."""

import math
import subprocess
import sys
from typing import get_args, get_origin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iccm.errors import JobError
from iccm.io.run.job import KINDS, Job

HINTS = {name: hint for name, (hint, _) in Job.rows.items()}

ODD = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 200_000), st.floats(), st.sampled_from([1e200, -0.0, 0.5, 1.0, 10**400]),
    st.text(max_size=4), st.lists(st.one_of(st.integers(-1, 2000), st.text(max_size=3)), max_size=3),
    st.dictionaries(st.text(max_size=2), st.integers(), max_size=2),
    st.sampled_from(["a.svg", "any", "640x480", "2G", "source", "0.5", "uv", "keep", "data", "\ud800", "-", "1,2:3,4"]),
)  # fmt: skip


def likely(hint):
    """Values that an option takes."""
    choices = [choice for part in (hint, *get_args(hint)) for choice in get_args(part) if get_origin(part)]
    valid = st.sampled_from([choice for choice in choices if isinstance(choice, str | int)] or ["a.png"])
    return st.one_of(valid, ODD)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(st.data())
def test_a_job_accepts_its_options_or_names_each_mistake(data):
    names = data.draw(st.lists(st.sampled_from(sorted(HINTS)), max_size=4, unique=True))
    values = {name: data.draw(likely(HINTS[name])) for name in names} | {"source": "a.svg"}
    try:
        checked = Job.check(values)
    except JobError as error:
        assert {key.partition(".")[0] for key, _ in error.mistakes} <= values.keys()
        return
    assert checked.keys() == values.keys()
    assert Job.check(checked) == checked  # stored values are accepted again, unchanged
    for value in checked.values():
        assert not isinstance(value, float) or math.isfinite(value)
        assert not isinstance(value, list)


@pytest.mark.parametrize(
    ("options", "kept"),
    [
        ({"balance": 2}, 2.0),
        ({"balance": "0.5"}, 0.5),
        ({"effort": 4.0}, 4),
        ({"effort": "16"}, 16),
        ({"force": "Yes"}, True),
        ({"force": 0}, False),
        ({"turn": "any"}, "any"),
        ({"turn": 90}, 90.0),
        ({"output": "o.png"}, ("o.png",)),
        ({"size": [640, 480]}, (640, 480)),
        ({"size": "x480"}, (0, 480)),
        ({"texture_scale": 0.25}, (0.25,)),
        ({"order": 0}, 0),
        ({"report": None}, None),
    ],
)
def test_values_are_kept_as_their_types_have_them(options, kept):
    (name,) = options
    value = getattr(Job(source="a.svg", **options), name)
    assert value == kept and type(value) is type(kept)


@pytest.mark.parametrize(
    ("options", "cause"),
    [
        ({"balance": True}, "number"),
        ({"balance": -0.5}, "at least 0"),
        ({"tolerance": 0}, "greater than 0"),
        ({"effort": 2.5}, "whole number"),
        ({"effort": 17}, "at most 16"),
        ({"effort": "9" * 5000}, "whole number"),
        ({"force": "maybe"}, "true or false"),
        ({"force": None}, "true or false"),
        ({"parts": "some"}, "'joined'"),
        ({"report": 3}, "text"),
        ({"output": "\ud800.png"}, "UTF-8"),
        ({"texture_offset": [1]}, "two numbers"),
        ({"source": ""}, "is missing"),
        ({"target": ""}, "is missing"),
        ({"max_dilatation": math.inf}, "finite"),
        ({"require_injective": 10**400}, "share"),
    ],
)
def test_a_value_of_another_type_or_out_of_bounds_is_reported(options, cause):
    with pytest.raises(JobError) as caught:
        Job(**{"source": "a.svg"} | options)
    ((key, text),) = caught.value.mistakes
    assert key.partition(".")[0] in options and cause in text


def test_options_that_are_not_given_have_their_defaults():
    for kind in KINDS.values():
        for name, value in kind.defaults().items():
            option = kind.rows[name][1]
            if option and not option.required:
                assert option.value_of(value, kind.rows[name][0]) == value
    assert vars(Job(source="a", pin=["1,2:3,4"])) == vars(Job(source="a")) | {
        "pin": (((1.0, 2.0), (3.0, 4.0)),)
    }


def test_a_job_does_not_change_and_its_copies_do():
    job = Job(source="a.svg")
    with pytest.raises(AttributeError):
        job.force = True
    assert job.model_copy(update={"force": True}).force and not job.force
    assert job != job.model_copy(update={"force": True}) and job == Job(source="a.svg")
    assert "source='a.svg'" in repr(job)


def test_mistakes_are_reported_with_their_keys():
    with pytest.raises(JobError) as caught:
        Job(source="a.svg", order=2, colour=1)
    assert [key for key, _ in caught.value.mistakes] == ["order", "colour"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "unused"), [("out.png", {"numpy.ma"}), ("out.svg", {"numpy.ma", "OpenImageIO", "fontTools"})]
)
def test_a_plain_job_of_the_command_line_runs_without_modules_that_it_does_not_need(shapes, name, unused):
    unused = {"pydantic", "cv2", "scipy.linalg", "scipy.sparse", "matplotlib", "trimesh", "skimage"} | unused
    script = (
        "import sys; from iccm import cli; code = cli.run(sys.argv[1:]); "
        f"print(code, *{unused} & sys.modules.keys())"
    )
    line = [sys.executable, "-c", script, "map", "square.svg", "blob.svg", "-q", "-o", name]
    assert subprocess.run(line, capture_output=True, text=True).stdout == "0\n"
