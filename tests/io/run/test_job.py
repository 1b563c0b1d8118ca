"""A job is validated completely, reports mistakes by option, and survives conversion to JSON and back."""

import gc
import json
import os

import pytest

from iccm import Fit, InputError
from iccm.cli import apply, deform, map, options
from iccm.io.options import ApplyOptions, options_of
from iccm.io.run.execute import run
from iccm.io.run.inputs import Inputs
from iccm.io.run.job import Job, make
from iccm.io.run.resolve import name_outputs
from iccm.io.run.state import Run
from iccm.io.spec import path_of
from iccm.parallel import thread_count
from tests.cases import slow


def test_round_trip_through_json():
    job = Job(
        source="a.svg#x", target="b.svg", pin=["1,-2.5:3e1,.5"], size="640x480", output="o.png", quasi=0.1
    )
    assert Job(**json.loads(json.dumps(job.model_dump(mode="json")))) == job
    assert job.pin == (((1.0, -2.5), (30.0, 0.5)),)
    assert job.size == (640, 480)
    assert job.output == ("o.png",)


@pytest.mark.parametrize("pin", ["1,2:3,4", [1, 2, 3, 4], [[1, 2], [3, 4]]])
def test_a_pin_may_be_written_in_three_ways(pin):
    assert Job(source="a", pin=[pin]).pin == (((1, 2), (3, 4)),)


@pytest.mark.parametrize(
    ("values", "place", "cause"),
    [
        ({"size": "0x4"}, "--size", "between 1 and"),
        ({"size": "12y3"}, "--size", "WxH"),
        ({"size": "9999999"}, "--size", "between 1 and"),
        ({"pin": ["1,2"]}, "--pin 1: ", "SX,SY:TX,TY"),
        ({"pin": ["1,2:3,4", "nan,0:1,1"]}, "--pin 2: ", "SX,SY:TX,TY"),
        ({"pin": [[1, 2, 3, float("inf")]]}, "--pin 1: ", "finite"),
        ({"quasi": -1}, "--quasi", "greater than 0"),
        ({"tolerance": float("nan")}, "--tolerance", "finite"),
        ({"order": 2}, "--order", "0 or 1"),
        ({"vertices": 2}, "--vertices", "2 is not between 3 and 4000"),
        ({"method": "magic"}, "--method", "conformal"),
        ({"colour": 1}, "--colour", "unknown key"),
        ({"padding_fill": "nearest"}, "--padding-fill", "--padding"),
        ({"output": ["-"], "report": "-"}, "only one output", "only one output"),
        ({"texture": "a.png", "normal": "n.png", "output": ["o.png"]}, "2 textures but 1 picture: ", "-o"),
    ],
)
def test_a_mistake_is_one_line_that_names_the_option(values, place, cause):
    with pytest.raises(InputError) as caught:
        make({"source": "a.svg", **values})
    message = str(caught.value)
    assert message.startswith(place) and cause in message and "\n" not in message


@pytest.mark.parametrize("pin", ["1,2:v17", "1,2: V17 ", [[1, 2], "v17"]])
def test_a_pin_may_name_a_vertex(pin):
    assert Job(source="a", pin=[pin]).pin == (((1, 2), "v17"),)


def test_a_pin_may_be_a_point_in_space():
    assert Job(source="a", pin=["1,2:3,4,5"]).pin == (((1, 2), (3, 4, 5)),)


OF_THE_COMMAND = {
    *("dry_run", "watch", "open", "resume", "time_limit", "threads"),
    *("help", "debug", "log_format", "quiet", "verbose"),
    *("text", "target_text", "font", "font_variation"),
}
"""Options of the command that are not part of a job."""


@pytest.mark.parametrize(("name", "command"), [("map", map.command), ("deform", deform.command)])
def test_every_value_of_a_job_is_an_option_of_its_commands_and_back(name, command):
    values = {value for value, (_, option) in options_of().items() if name in option.commands}
    parameters = {parameter.name for parameter in command.params}
    assert parameters - OF_THE_COMMAND - {"source", "target", "shape"} == values
    assert parameters >= ({"source", "target"} if name == "map" else {"shape"})
    assert ("fit" in values) == (name == "map") and {"texture", "pin", "holes"} <= values


def test_apply_takes_its_options_from_the_same_place():
    of_map = {parameter.name: parameter for parameter in map.command.params}
    for parameter in apply.command.params[2:]:
        if parameter.name in options_of(ApplyOptions):
            continue
        counterpart = of_map[parameter.name]
        assert (parameter.help, parameter.default, repr(parameter.type)) == (
            counterpart.help, counterpart.default, repr(counterpart.type)
        )  # fmt: skip
    assert {"filter", "kind", "edge", "colorspace", "memory"} <= {p.name for p in apply.command.params}


@pytest.mark.parametrize("name", sorted(options_of()))
def test_the_table_of_options_agrees_with_the_checks_of_the_job(name):
    _, option = options_of()[name]
    assert getattr(Job(source="a"), name) == option.default and option.help[0].isalnum()
    if option.least is not None:
        with pytest.raises(InputError, match=f"--{name.replace('_', '-')}: "):
            make({"source": "a.svg", name: option.least - 1})


def test_defaults_of_the_command_line_are_those_of_the_job():
    given = map.command.make_context("map", ["a.svg", "b.svg"]).params
    for name in OF_THE_COMMAND & set(given):
        given.pop(name)
    job = make(options.values(given))
    assert job == Job(source="a.svg", target="b.svg")


def test_inputs_and_outputs_are_files_without_ids_and_streams():
    job = Job(source="a.svg#x", target="b.svg", texture="t.png", output=["o.png", "-"], plot="p.png")
    assert job.inputs == ("a.svg", "b.svg", "t.png")
    assert job.outputs == ("o.png", "p.png")


def test_a_file_whose_name_has_a_hash_wins(tmp_path):
    path = tmp_path / "a#b.svg"
    assert path_of(str(path)) == str(tmp_path / "a")
    path.write_text("")
    assert path_of(str(path)) == str(path)


@pytest.mark.parametrize(
    ("job", "name"),
    [
        (Job(source="x/a.svg", target="y/b.svg"), "a-b.png"),
        (Job(source="x/a.svg#head", target="y/b.svg#2"), "a-head-b-2.png"),
        (Job(source="x/a.svg"), "a-deformed.png"),
    ],
)
def test_the_default_output_is_named_after_the_shapes(job, name):
    assert name_outputs(job, Inputs(job)).output == (name,)


def test_no_picture_by_default_when_another_output_is_requested():
    for job in (Job(source="a", target="b", report="-"), Job(source="a", target="b", plot="p.png")):
        assert name_outputs(job, Inputs(job)).output == ()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"output": ["o.xyz"]}, "o.xyz: unknown suffix"),
        ({"plot": "p.txt"}, "p.txt: unknown suffix"),
        ({"output": ["missing/o.png"]}, "does not exist"),
        ({"output": ["o.png", "./o.png"]}, "two outputs"),
        ({"output": ["there.png"]}, "--force"),
        ({"output": ["a.svg"], "force": True}, "also an input"),
        ({"output": ["o.png"], "rigid_size": 0.7}, "--rigid-size: .* --rigid"),
        ({"output": ["o.png"], "subdivide_rim": True}, "--subdivide-rim: .* mesh"),
        ({"output": ["o.npz"], "carry_maps": True}, "--carry-maps: .* mesh"),
    ],
)
def test_outputs_are_checked_before_anything_runs(tmp_path, monkeypatch, options, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.png").write_bytes(b"old")
    for name in ("a.svg", "b.svg"):
        (tmp_path / name).write_text(
            '<svg xmlns="http://www.w3.org/2000/svg"><rect width="9" height="9"/></svg>'
        )
    with pytest.raises(InputError, match=message):
        run(Job(source="a.svg", target="b.svg", **options))
    assert (tmp_path / "there.png").read_bytes() == b"old"


@pytest.mark.parametrize("threads", [slow(1), 2])
def test_the_memory_of_a_job_is_freed_when_it_ends(tmp_path, threads):
    """Otherwise a worker keeps the maps and pictures of many jobs until Python's next garbage collection."""
    (tmp_path / "a.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0H4V3H0z"/></svg>')
    name = str(tmp_path / "a.svg")
    job = Job(
        source=name, target=name, size=40, output=str(tmp_path / "o.png"), report=str(tmp_path / "r.json")
    )

    def kept():
        # isinstance would access dead proxies
        return {id(o) for o in gc.get_objects() if type(o) in (Run, Fit)}

    gc.collect()
    gc.disable()
    try:
        before = kept()
        assert run(job, threads=threads).ok
        assert kept() <= before
    finally:
        gc.enable()


def test_the_usual_variable_caps_the_threads(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert thread_count() == 1 and thread_count(3) == 3
    monkeypatch.setenv("OMP_NUM_THREADS", "1,4")
    assert thread_count() == 1
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    for ignored in ("", "many", "0", "99999"):
        monkeypatch.setenv("OMP_NUM_THREADS", ignored)
        assert thread_count() == cores
