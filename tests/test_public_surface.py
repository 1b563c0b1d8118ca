"""Public names stay: nothing of the last release is removed, and additions are recorded."""

import click
import pytest

from . import public_surface

RECORD = "run `python -m tests.public_surface --record`, and look at the difference"


@pytest.fixture(scope="module")
def current():
    return set(public_surface.entries())


def test_nothing_of_the_last_release_is_gone(current):
    removed = sorted(set(public_surface.read(public_surface.RELEASED)) - current)
    assert not removed, (
        "public in the last release: keep them, or deprecate them (docs/reference/stability.md)"
    )


def test_additions_since_the_last_release_are_recorded(current):
    added = current - set(public_surface.read(public_surface.RELEASED))
    recorded = set(public_surface.read(public_surface.UNRELEASED))
    assert not sorted(added - recorded), f"not recorded: {RECORD}"
    assert not sorted(recorded - added), f"recorded, but not there: {RECORD}"


def test_the_list_has_an_entry_of_each_kind(current):
    assert current >= {
        "command iccm map",
        "argument iccm map 2",
        "option iccm map --size",
        "option iccm map --starts",  # a former name
        "value iccm map --method balanced",
        "environment ICCM_MAX_PIXELS",
        "exit-code 70",
        "schema report-1 status (always)",
        "schema report-1 boundary.rms (always)",
        "saved-map iccm.map/1",
        "job padding_fill",
        "job fill",  # a former name
        "solver-option balance",
        "python iccm.fit(pins=)",
        "python iccm.Fit.inverse",
        "python iccm.io.run.run",
    }


def test_the_entries_of_a_command_are_all_of_its_names():
    @click.command()
    @click.argument("source")
    @click.option("-k", "--kind", type=click.Choice(["a", "b"]))
    def command(source, kind):
        """Do nothing."""

    names = {"command x", "argument x 1", "option x -k", "option x --kind", "option x --help"}
    assert set(public_surface.of_command("x", command)) == names | {"value x --kind a", "value x --kind b"}


def test_the_keys_of_a_schema_are_listed_at_any_depth():
    inner = {"properties": {"x": {}}, "required": ["x"]}
    schema = {"properties": {"a": {"$ref": "#/$defs/p"}, "b": {"items": inner}}, "$defs": {"p": inner}}
    assert list(public_surface.of_object("s", schema, schema, "")) == [
        *("s a", "s a.x", "s a.x (always)"),
        *("s b", "s b[].x", "s b[].x (always)"),
    ]
