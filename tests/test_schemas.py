"""The published schemas describe what is written; reports of all tests are checked against them in `conftest`."""

import json

import pytest

from iccm.io.check.compare import Tolerances
from iccm.io.figure_table import REPORTS

from .conftest import SCHEMAS, validator

pytestmark = pytest.mark.usefixtures("solve_once")

NAMES = sorted(path.stem.removeprefix("iccm.") for path in SCHEMAS.iterdir())


@pytest.mark.parametrize("name", NAMES)
def test_a_schema_is_one(name):
    schema_validator = validator(name)
    schema_validator.check_schema(schema_validator.schema)
    kind, _, version = name.rpartition("-")
    assert schema_validator.schema["properties"]["schema"]["const"] == f"iccm.{kind}/{version}"


def described(value, schema, root):
    """The keys of a value that its schema does not describe."""
    schema = root["$defs"][schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema
    if isinstance(value, dict) and "properties" in schema:
        properties = schema["properties"]
        inside = (
            key for name, item in value.items() for key in described(item, properties.get(name, {}), root)
        )
        return [*(key for key in value if key not in properties), *inside]
    if isinstance(value, list) and "items" in schema:
        return [key for item in value for key in described(item, schema["items"], root)]
    return []


@pytest.mark.parametrize(
    "arguments",
    [
        ("map", "blob.svg", "square.svg"),
        ("map", "blob.svg", "square.svg", "--method", "paper", "--pin", "50,50:50,50"),
        ("map", "blob.svg", "square.svg", "--fit", "cover"),
        ("deform", "square.svg", "--pin", "20,20:25,20", "--pin", "80,80:80,80"),
    ],
)
def test_a_report_has_no_key_that_its_schema_lacks(shapes, iccm, arguments):
    typed = iccm(*arguments, "--report", "-", "-o", "out.png", "--size", "32", "-q")
    result = json.loads(typed.out)
    schema = validator("report-1").schema
    assert described(result, schema, schema) == []


def test_each_key_follows_the_object_that_contains_it():
    for name, kind in REPORTS.items():
        known = {""}
        for row in kind.rows:
            assert row.key.rpartition(".")[0].removesuffix("[]") in known, (name, row.key)
            assert row.key not in known, (name, row.key)
            known.add(row.key)


def test_times_are_ignored_in_all_reports_and_shares_are_compared():
    allowed = Tolerances()
    for key in ("seconds", "seconds.solve", "specimens.3.seconds", "inputs.0.path", "job.size"):
        assert allowed.figure(key).ignore, key
    assert not allowed.figure("inputs.0.sha256").ignore
    assert allowed.figure("shown").abs > allowed.figure("left_out").abs


SAMPLES = SCHEMAS.parents[2] / "samples"


@pytest.mark.slow
@pytest.mark.parametrize("output", [("-o", "out.obj"), ("--bake", "-o", "out.png", "--size", "32")])
def test_a_mesh_adds_keys_that_the_schema_knows(shapes, iccm, output):
    assert iccm("flatten", SAMPLES / "hexagon-surface" / "sail.obj", "--uv", "sail.obj").code == 0
    texture = SAMPLES / "hexagon-surface" / "tiles.png"
    result = iccm("map", "square.svg", "sail.obj", "--texture", texture, *output, "--report", "-", "-q")
    schema = validator("report-1").schema
    assert described(json.loads(result.out), schema, schema) == []


def test_layouts_are_as_their_schemas(shapes, iccm):
    mesh = SAMPLES / "hexagon-surface" / "sail.obj"
    arguments = ("--uv", "disk.obj", "--report", "-", "-q")
    flat = json.loads(iccm("flatten", mesh, "--onto", "disk.svg", *arguments).out)
    texture = SAMPLES / "hexagon-surface" / "tiles.png"
    iccm("flatten", mesh, "--uv", "old.obj")
    out = ("--texture", texture, "-o", "out.png", "--size", "32", "--report", "-", "-q")
    relaid = json.loads(iccm("relayout", "old.obj", "disk.obj", *out).out)
    for name, result in (("flatten-1", flat), ("relayout-1", relaid)):
        schema = validator(name).schema
        validator(name).validate(result)
        assert described(result, schema, schema) == []
        assert not validator(name).is_valid(result | {"status": "wrong"})


@pytest.mark.slow
def test_results_and_verdicts_are_as_their_schemas(shapes, iccm):
    (shapes / "empty.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
    job = '{{"source": "{}", "target": "disk.svg", "size": 32, "output": "{}.png", "report": "{}.json"}}\n'
    names = ("square.svg", "empty.svg")
    (shapes / "jobs.jsonl").write_text("".join(job.format(n, n, n) for n in names))
    results = [
        json.loads(line) for line in iccm("batch", "jobs.jsonl", "--root", "out", "-j", "1").out.splitlines()
    ]
    assert sorted(result["status"] for result in results) == ["done", "failed"]
    iccm("check", "out", "base", "--update")
    (shapes / "out" / "square.svg.json").write_text("{}")
    verdicts = [json.loads(line) for line in iccm("check", "out", "base", "--json").out.splitlines()]
    assert {verdict["state"] for verdict in verdicts} == {"same", "differs"}
    for name, lines in (("result-1", results), ("check-1", verdicts)):
        schema = validator(name).schema
        for entry in lines:
            validator(name).validate(entry)
            assert described(entry, schema, schema) == []


def test_a_wrong_report_is_refused(shapes, iccm):
    typed = iccm("map", "square.svg", "disk.svg", "--report", "-", "-o", "out.png", "--size", "32", "-q")
    result = json.loads(typed.out)
    for change in ({"schema": "iccm.report/2"}, {"boundary": {"rms": "0"}}, {"pins": None}):
        assert not validator("report-1").is_valid(result | change)
