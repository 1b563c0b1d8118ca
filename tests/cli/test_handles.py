"""Handles: a finished map as a file of pins that gives the same map back, and follows handles that are moved."""

import json
from pathlib import Path

import numpy as np
import pytest

import iccm as library

pytestmark = pytest.mark.usefixtures("solve_once")

ROOT = Path(__file__).parents[2]
PAIRS = {
    "drawings": ("samples/rose-leaf/rose.svg", "samples/rose-leaf/leaf.svg", ()),
    "limbs": ("samples/limbs/gingerbread.svg", "samples/limbs/starfish.svg", ("--balance", "2")),
    "countries": ("docs/files/iceland.geojson", "docs/files/africa.geojson", ()),
    "holes": ("docs/files/mug.svg", "docs/files/ring.svg", ("--holes", "keep")),
    "drawn pins": ("samples/pins/round.svg", "samples/pins/cat.svg", ()),
}

OFTEN = ("drawings", "holes")


def written(iccm, folder, source, target, options=()):
    """Return the command without outputs, the map, and the content of the file of its handles."""
    command = ["map", ROOT / source, ROOT / target, *options]
    result = iccm(*command, "--handles", "4x5", "-o", folder / "h.json", "-o", folder / "first.npz")
    assert result.code == 0, result.err
    return command, library.load(folder / "first.npz"), json.loads((folder / "h.json").read_text())


def again(iccm, folder, command, content):
    """Return the map of a command with a file of handles, and the report."""
    (folder / "h.json").write_text(json.dumps(content))
    outputs = "-o", folder / "second.npz", "--report", folder / "r.json", "--force"
    result = iccm(*command, "--pins", folder / "h.json", *outputs)
    assert result.code == 0, result.err
    return library.load(folder / "second.npz"), json.loads((folder / "r.json").read_text())


def size(fit):
    return np.sqrt(abs(fit.target.area))


@pytest.mark.parametrize(
    "pair", [pytest.param(pair, marks=[pytest.mark.slow] * (pair not in OFTEN)) for pair in PAIRS]
)
def test_handles_that_stay_give_the_same_map(iccm, tmp_path, pair):
    command, first, content = written(iccm, tmp_path, *PAIRS[pair])
    assert len(content["pins"]) >= 5
    second, _ = again(iccm, tmp_path, command, content)
    gap = np.abs(first.map(first.map.source) - second.map(first.map.source))
    assert np.nanmax(gap) < 1e-9 * size(first) and np.isfinite(gap).mean() > 0.99


def test_the_map_follows_a_handle_that_is_moved_and_stays_elsewhere(iccm, tmp_path):
    command, first, content = written(iccm, tmp_path, *PAIRS["drawings"])
    names = [pin["name"] for pin in content["pins"]]
    moved = names.index("r2c4")
    content["pins"][moved]["target"][0] += 0.05 * size(first)
    second, report = again(iccm, tmp_path, command, content)
    x, y = np.array([pin["source"] for pin in content["pins"]]).T
    shift = np.abs(second.map(x - 1j * y) - first.map(x - 1j * y)) / size(first)
    assert 0.04 < shift[moved] < 0.06 and np.delete(shift, moved).max() < 0.01
    assert all(pin["error"] <= pin["tolerance"] for pin in report["pins"])
    assert report["injective"]["certified"]


def test_handles_are_named_by_rows_from_the_top_and_lie_inside(iccm, tmp_path):
    _, first, content = written(iccm, tmp_path, *PAIRS["drawings"])
    places = {pin["name"]: pin["source"] for pin in content["pins"]}
    assert places["r1c3"][1] < places["r2c3"][1] and places["r2c2"][0] < places["r2c3"][0]
    assert places["r2c2"][1] == places["r2c3"][1] and places["r1c3"][0] == places["r2c3"][0]
    assert "r1c1" not in places  # beside the flower
    x, y = np.array(list(places.values())).T
    assert first.source.contains(x - 1j * y).all()


@pytest.mark.slow
def test_pins_of_the_map_are_written_with_its_handles(iccm, tmp_path):
    typed = "--pin", "250,150:250,200,r=20", "--pin", "167,340:190,300"
    command, first, content = written(iccm, tmp_path, *PAIRS["drawings"][:2], typed)
    assert [pin["source"] for pin in content["pins"][:2]] == [[250, 150], [167, 340]]
    second, _ = again(iccm, tmp_path, command[:3], content)
    assert np.abs(second.map.image - first.map(second.map.source)).max() < 1e-9 * size(first)


def test_a_saved_map_gets_handles(iccm, tmp_path):
    command, _, content = written(iccm, tmp_path, *PAIRS["limbs"])
    kept = tmp_path / "from-saved.json"
    result = iccm(*command, "--start", tmp_path / "first.npz", "--handles", "4x5", "-o", kept)
    assert result.code == 0, result.err
    assert json.loads(kept.read_text()) == content


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["-o", "h.json"], "--handles"),
        (["--handles", "4x5"], "-o"),
        (["--handles", "4", "-o", "h.json"], "4x5"),
        (["--handles", "0x3", "-o", "h.json"], "1x1"),
        (["--handles", "999x999", "-o", "h.json"], "400"),
        (["--handles", "4x5", "-o", "h.json", "--fit", "cover"], "--fit"),
        (["--handles", "4x5", "-o", "h.json", "--method", "paper"], "--method"),
        (["--handles", "4x5", "-o", "h.json", "--exact-pins"], "--exact-pins"),
        (["--handles", "4x5", "-o", "h.json", "--parts", "each"], "--parts"),
    ],
)
def test_options_that_handles_do_not_support_are_refused(iccm, tmp_path, monkeypatch, options, word):
    monkeypatch.chdir(tmp_path)
    result = iccm("map", *(ROOT / name for name in PAIRS["drawings"][:2]), *options)
    assert result.code == 2 and word in result.err and result.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_meshes_closed_holes_and_empty_lattices_are_refused(iccm, tmp_path):
    file = tmp_path / "h.json"
    for source, target, lattice, word in (
        ("samples/face-pins/tiger.svg", "samples/face-pins/face.obj", "4x5", "face.obj"),
        ("docs/files/ring.svg", "docs/files/medal.svg", "4x5", "--holes"),
        ("docs/files/ring.svg", "docs/files/ring.svg", "1x1", "rows"),
    ):
        result = iccm("map", ROOT / source, ROOT / target, "--handles", lattice, "-o", file)
        assert result.code == 2 and word in result.err, result.err
        assert not file.exists()
