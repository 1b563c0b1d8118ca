"""Jobs whose values are plain are made without pydantic, and are those that it would make."""

import subprocess
import sys
from typing import get_args, get_origin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iccm.errors import JobError
from iccm.io.run.job import KINDS, Job
from iccm.io.run.validate import checked, validate

HINTS = {name: hint for name, (hint, _) in Job.rows.items()}

ODD = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 200_000), st.floats(), st.sampled_from([1e200, -0.0, 0.5, 1.0]),
    st.text(max_size=4), st.lists(st.one_of(st.integers(-1, 2000), st.text(max_size=3)), max_size=3),
    st.sampled_from(["a.svg", "any", "640x480", "2G", "source", "0.5", "uv", "keep", "data", "\ud800", "-", "1,2:3,4"]),
)  # fmt: skip


def likely(hint):
    """Values that an option takes."""
    choices = [each for part in (hint, *get_args(hint)) for each in get_args(part) if get_origin(part)]
    known = st.sampled_from([each for each in choices if isinstance(each, str | int)] or ["a.png"])
    return st.one_of(known, ODD)


VALUES = st.fixed_dictionaries(
    {"source": st.sampled_from(["a.svg", "b.obj#2", ""])},
    optional={name: likely(hint) for name, hint in HINTS.items() if name != "source"},
)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(st.data())
def test_what_is_plain_is_what_pydantic_makes_of_it(data):
    names = data.draw(st.lists(st.sampled_from(sorted(HINTS)), max_size=4, unique=True))
    values = {name: data.draw(likely(HINTS[name])) for name in names} | {"source": "a.svg"}
    plain = Job.parse(values)
    if plain is not None:
        assert repr(Job.defaults() | plain) == repr(Job.defaults() | validate(Job, values))


@pytest.mark.parametrize(
    "values",
    [
        {"size": (64,), "texture": "p.jpg", "output": ["o.png"], "force": True},
        {"turn": 90.0, "memory": 1 << 30, "method": "balanced", "tolerance": 1e-4, "report": "-"},
        {"normal": ["n.png"], "vertices": "source", "require_injective": 0.99, "parts": "all"},
    ],
)
def test_what_the_command_line_gives_is_plain(values):
    assert Job.parse({"source": "a.svg", "target": "b.svg", **values}) is not None


def test_every_value_has_the_default_that_pydantic_gives():
    for kind in KINDS.values():
        fields = checked(kind).model_fields
        assert kind.defaults() == {name: field.get_default() for name, field in fields.items()} | {
            name: kind.defaults()[name] for name in kind.required()
        }
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


def test_mistakes_are_told_by_their_keys():
    with pytest.raises(JobError) as caught:
        Job(source="a.svg", order=2, colour=1)
    assert [key for key, _ in caught.value.mistakes] == ["order", "colour"]


def test_a_plain_job_of_the_command_line_runs_without_pydantic_opencv_and_scipy(shapes):
    script = (
        "import sys; from iccm import cli; code = cli.run(sys.argv[1:]); "
        "print(code, *{'pydantic', 'cv2', 'scipy.linalg', 'scipy.sparse', 'matplotlib'} & sys.modules.keys())"
    )
    line = [sys.executable, "-c", script, "map", "square.svg", "blob.svg", "-q", "--size", "64"]
    assert subprocess.run(line, capture_output=True, text=True).stdout == "0\n"
