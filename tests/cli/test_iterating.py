"""Repeated runs: outputs of the same command are replaced without --force, and nothing else is."""

import os
import shutil

import pytest

pytestmark = pytest.mark.usefixtures("solve_once")

STATE = "LOCALAPPDATA" if os.name == "nt" else "XDG_STATE_HOME"
SMALL = ("--size", "24", "--method", "paper", "--vertices", "40")


def test_an_earlier_result_of_the_same_shapes_is_replaced(shapes, iccm):
    arguments = ("map", "square.svg", "blob.svg", *SMALL)
    assert iccm(*arguments).code == 0
    first = (shapes / "square-blob.png").read_bytes()
    again = iccm(*arguments, "--size", "30")
    assert again.code == 0 and (shapes / "square-blob.png").read_bytes() != first
    shutil.copy("disk.svg", "square.svg")  # the drawing was edited
    assert iccm(*arguments).code == 0


def test_all_of_several_outputs_must_be_from_the_same_run(shapes, iccm):
    arguments = ("map", "square.svg", "blob.svg", *SMALL, "-o", "a.png")
    assert iccm(*arguments).code == 0
    (shapes / "r.json").write_text("mine")
    before = (shapes / "a.png").read_bytes()
    result = iccm(*arguments, "--size", "30", "--report", "r.json")
    assert (
        result.code == 2
        and (shapes / "a.png").read_bytes() == before
        and "r.json: the file exists" in result.err
    )


@pytest.mark.parametrize(
    "change", ["edited", "touched", "other source", "other target", "forgotten", "cut short"]
)
def test_other_files_are_kept(shapes, iccm, monkeypatch, change):
    arguments = ["map", "square.svg", "blob.svg", *SMALL, "-o", "out.png"]
    assert iccm(*arguments).code == 0
    out, log = shapes / "out.png", None
    if change == "edited":
        out.write_bytes(out.read_bytes() + b" ")
    elif change == "touched":
        os.utime(out, ns=(1, 1))
    elif change == "other source":
        arguments[1] = "disk.svg"
    elif change == "other target":
        arguments[2] = "disk.svg"
    elif change == "forgotten":
        monkeypatch.setenv(STATE, str(shapes / "elsewhere"))
    else:
        log = os.path.join(os.environ[STATE], "iccm", "outputs.jsonl")
        with open(log, "rb+") as file:
            file.truncate(20)
    kept = out.read_bytes()
    result = iccm(*arguments)
    assert result.code == 2 and "use --force" in result.err and out.read_bytes() == kept


@pytest.mark.slow
def test_meshes_need_force_and_a_state_folder_that_is_none_hinders_nothing(shapes, iccm, monkeypatch):
    (shapes / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\nf 1 2 3\nf 1 3 4\n")
    arguments = ("map", "square.svg", "m.obj", "-o", "out.obj")
    assert iccm(*arguments).code == 0 and iccm(*arguments).code == 2
    (shapes / "file").touch()
    monkeypatch.setenv(STATE, str(shapes / "file"))
    assert iccm("map", "square.svg", "blob.svg", *SMALL).code == 0


@pytest.mark.slow
def test_the_memory_of_results_stays_small(shapes, iccm, monkeypatch):
    from iccm.io.run import earlier

    monkeypatch.setattr(earlier, "MOST_BYTES", 400)
    for count in range(4):
        assert iccm("map", "square.svg", "blob.svg", *SMALL, "-o", f"{count}.png").code == 0
    place = os.path.join(os.environ[STATE], "iccm", "outputs.jsonl")
    assert os.path.getsize(place) < 1200
    assert iccm("map", "square.svg", "blob.svg", *SMALL, "-o", "3.png").code == 0


def test_a_deformation_starts_from_an_earlier_one(shapes, iccm):
    arguments = ["deform", "square.svg", "--pin", "30,30:33,31"]
    assert iccm(*arguments, "-o", "d.npz").code == 0
    result = iccm(*arguments, "--pin", "60,60:58,61", "--start", "d.npz", "-o", "e.npz")
    assert result.code == 0, result.err
